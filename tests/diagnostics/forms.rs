//! `--message-format`: the same diagnostics for people, for editors and for programs.

use serde_json::{Value, json};
use tempfile::tempdir;

use crate::common::{Run, imp, imp_with};

const WRONG: &str = "let radius = 2\nprint(raduis + radus)\n";

fn run(text: &str, form: &str) -> Run {
    let folder = tempdir().unwrap();
    let words = ["run", "-", "--message-format", form];
    imp_with(folder.path(), &words, text.as_bytes())
}

#[test]
fn short_messages_are_one_line_each() {
    let short = run(WRONG, "short");
    assert_eq!(short.code, 1);
    assert_eq!(
        short.stderr,
        "<stdin>:2:7: error[E0201]: there is no `raduis` here\n\
         <stdin>:2:16: error[E0201]: there is no `radus` here\n"
    );
    let warned = run("print(sin(90))", "short").well();
    assert_eq!(
        warned.stderr,
        "<stdin>:1:11: warning[W0808]: `sin` takes radians, but 90 looks like degrees\n"
    );
    let missing = imp(&["run", "missing.imp", "--message-format=short"]);
    assert!(
        missing.stderr.starts_with("error[E0701]: cannot read"),
        "{}",
        missing.stderr
    );
    assert_eq!(missing.stderr.lines().count(), 1);
}

#[test]
fn json_messages_are_one_object_a_line() {
    let found = run(WRONG, "json");
    let objects: Vec<Value> = found
        .stderr
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(objects.len(), 2);
    let first = &objects[0];
    assert_eq!(first["severity"], json!("error"));
    assert_eq!(first["code"], json!("E0201"));
    assert_eq!(first["message"], json!("there is no `raduis` here"));
    assert_eq!(first["help"], json!("did you mean `radius`?"));
    let place = [&first["file"], &first["line"], &first["column"]];
    assert_eq!(place, [&json!("<stdin>"), &json!(2), &json!(7)]);
    let label = &first["labels"][0];
    assert_eq!(
        [&label["end_line"], &label["end_column"]],
        [&json!(2), &json!(13)]
    );
    assert_eq!(label["message"], json!("unknown name"));
    // Notes would not be objects.
    let checked = imp(&["check", "examples/torus.imp", "--message-format", "json"]).well();
    assert_eq!(checked.stderr, "");
}

#[test]
fn the_forms_differ_in_form_only() {
    let human = run(WRONG, "human");
    assert!(
        human
            .stderr
            .contains("[E0201] Error: there is no `raduis` here")
    );
    assert!(human.stderr.contains("unknown name"));
    for form in ["human", "short", "json"] {
        let quiet = run("print(1)", form).well();
        assert_eq!((quiet.stdout.as_str(), quiet.stderr.as_str()), ("1\n", ""));
    }
}

#[test]
fn every_error_has_help() {
    for text in [
        "fn f(a, b) = a\nprint(f(1))",
        "print(norm(\"three\"))",
        "if 2 { print(1) }",
        "print(max([]))",
        "assert(1 == 2)",
    ] {
        let found = run(text, "json");
        let object: Value = serde_json::from_str(found.stderr.trim()).unwrap();
        assert!(object["help"].as_str().unwrap().len() > 10, "{text}");
        assert!(object["line"].is_u64(), "{text}");
    }
}

#[test]
fn wrong_usage_takes_the_form_that_was_asked_for() {
    let short = imp(&["eval", "1", "--threads", "-1", "--message-format", "short"]);
    assert_eq!(short.code, 2);
    assert!(
        short.stderr.starts_with("error[E0001]: "),
        "{}",
        short.stderr
    );
    assert_eq!(short.stderr.lines().count(), 1);
    let json = imp(&["frobnicate", "--message-format=json"]);
    let object: Value = serde_json::from_str(json.stderr.trim()).unwrap();
    assert_eq!((json.code, &object["code"]), (2, &json!("E0001")));
    assert_eq!(imp(&["eval", "1", "--message-format", "long"]).code, 2);
}

#[test]
fn the_one_object_on_standard_output_stays_alone_unless_a_form_is_asked_for() {
    let folder = tempdir().unwrap();
    let plain = imp_with(folder.path(), &["run", "-", "--json"], WRONG.as_bytes());
    assert_eq!(plain.stderr, "");
    let words = ["run", "-", "--json", "--message-format", "short"];
    let both = imp_with(folder.path(), &words, WRONG.as_bytes());
    assert_eq!(both.stdout, plain.stdout);
    assert_eq!(both.stderr.lines().count(), 2);
}
