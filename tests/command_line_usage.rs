//! The command line's words, and what it promises of standard output.

mod common;

use std::ffi::OsStr;
use std::fs;
use std::path::Path;
use std::process::{Output, Stdio};

use common::{imp, imp_in, imp_with, program};
use serde_json::json;
use tempfile::tempdir;

const BALL: &str = "field ball(p in R3) over -1.3..1.3 = norm(p) - 1\n";

const WRONG: &[&[&str]] = &[
    &["eval", "1", "--limit", "foo=1"],
    &["eval", "1", "--limit", "nodes=abc"],
    &["eval", "1", "--limit", "nodes=-1"],
    &["eval", "1", "--limit", "nodes"],
    &["eval", "1", "--set", "b"],
    &["eval", "1", "--set", "=3"],
    &["eval", "1", "--threads", "20000"],
    &["eval", "1", "--threads", "-1"],
    &["eval", "1", "--frobnicate"],
    &["eval", "examples/torus.imp"],
    &["eval"],
    &["frobnicate"],
    &["dump", "examples/torus.imp"],
];

#[test]
fn wrong_usage_ends_with_2() {
    for words in WRONG {
        let run = imp(words);
        assert_eq!(run.code, 2, "{words:?}: {}", run.stderr);
        assert_eq!(run.stdout, "", "{words:?}");
        assert!(!run.stderr.is_empty(), "{words:?}");
    }
    assert_eq!(imp(&["eval", "1", "--threads", "3"]).well().stdout, "1\n");
}

#[test]
fn wrong_usage_is_one_json_object_on_request() {
    for words in WRONG {
        let words = [words, &["--json"][..]].concat();
        let run = imp(&words);
        assert_eq!(run.code, 2, "{words:?}");
        let error = &run.json()["error"];
        assert_eq!(error["code"], json!("E0001"), "{words:?}");
        let message = error["message"].as_str().unwrap();
        assert!(!message.is_empty() && !message.contains('\n'), "{message}");
        assert!(!message.starts_with("error"), "{message}");
    }
    // Behind `--` it is an expression.
    assert_eq!(imp(&["eval", "--", "--json"]).stdout, "");
}

#[test]
fn every_command_prints_one_json_object() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("ball.imp"), BALL).unwrap();
    let object = |words: &[&str]| {
        let run = imp_in(folder.path(), &[words, &["--json"]].concat()).well();
        assert_eq!(run.stderr, "", "{words:?}");
        assert_eq!(run.stdout.lines().count(), 1, "{words:?}");
        let object = run.json();
        assert!(object["seconds"].as_f64().unwrap() >= 0.0, "{words:?}");
        assert_eq!(object["warnings"], json!([]), "{words:?}");
        object
    };
    let graph = object(&["dump", "ball.imp", "--graph"]);
    let plain = imp_in(folder.path(), &["dump", "ball.imp", "--graph"]).well();
    let text = graph["graph"].as_str().unwrap();
    assert_eq!(text.trim_end(), plain.stdout.trim_end());
    let clif = object(&["dump", "ball.imp", "--clif"]);
    assert!(clif["clif"].as_str().unwrap().contains("function"));
    assert_eq!(object(&["check", "ball.imp"])["checked"], json!(1));
    assert_eq!(object(&["eval", "1"])["value"], json!(1));
    assert_eq!(object(&["info", "ball.imp"])["fields"][0]["dimension"], 3);
    assert_eq!(object(&["run", "ball.imp"])["printed"], json!([]));
}

#[test]
fn numbers_of_info_are_written_as_everywhere() {
    let text = "param a = 1 in 0..inf\nfield f(x) over -2..2 = x - a\n";
    let folder = tempdir().unwrap();
    let run = imp_with(folder.path(), &["info", "-", "--json"], text.as_bytes()).well();
    let object = run.json();
    let range = object["parameters"][0]["range"].to_string();
    assert_eq!(range, r#"{"lo":0,"hi":"inf"}"#);
    assert_eq!(object["fields"][0]["domain"].to_string(), "[[-2,2]]");
}

#[test]
fn a_file_alone_is_run() {
    let folder = tempdir().unwrap();
    let write = |name: &str| fs::write(folder.path().join(name), "param a = 2\nprint(a)").unwrap();
    write("f.imp");
    write("script");
    for (words, expected) in [
        (&["f.imp"][..], "2\n"),
        (&["script"], "2\n"),
        (&["-q", "f.imp"], "2\n"),
        (&["--set", "a=1", "f.imp"], "1\n"),
        (&["--set=a=1", "script"], "1\n"),
        (&["--threads", "1", "--quiet", "script"], "2\n"),
        (&["--", "f.imp"], "2\n"),
    ] {
        let run = imp_in(folder.path(), words).well();
        assert_eq!(run.stdout, expected, "{words:?}");
    }
    assert_eq!(imp_in(folder.path(), &["missing.imp"]).code, 3);
    assert_eq!(imp_in(folder.path(), &["missing"]).code, 2);
    assert_eq!(imp_with(folder.path(), &["-"], b"print(7)").stdout, "7\n");
}

#[cfg(target_os = "linux")]
#[test]
fn a_file_name_need_not_be_text() {
    use std::os::unix::ffi::OsStrExt;
    let folder = tempdir().unwrap();
    let name = OsStr::from_bytes(b"caf\xe9");
    fs::write(folder.path().join(name), "print(3)").unwrap();
    let output = program(folder.path()).arg(name).output().unwrap();
    assert_eq!(output.stdout, b"3\n");
}

#[test]
fn standard_input_has_one_name() {
    let run = imp_with(Path::new("."), &["check", "-"], b"let a = 1\n").well();
    assert_eq!(run.stderr, "<stdin>: no errors\n");
}

/// Runs a script with this standard output, in a folder of its own: what it ended with, and
/// whether it exported its mesh.
fn printing_to(stdout: impl Into<Stdio>, last: &str) -> (Output, bool) {
    let folder = tempdir().unwrap();
    let text = format!(
        "{BALL}print(1)\nprint(2)\nexport(polygonize(ball, cell = 0.5), \"a.stl\")\n{last}\n"
    );
    fs::write(folder.path().join("ball.imp"), text).unwrap();
    let output = program(folder.path())
        .args(["run", "ball.imp"])
        .stdout(stdout)
        .stderr(Stdio::piped())
        .spawn()
        .and_then(std::process::Child::wait_with_output)
        .unwrap();
    (output, folder.path().join("a.stl").exists())
}

#[cfg(target_os = "linux")]
#[test]
fn what_cannot_be_printed_spoils_a_success() {
    let full = || {
        fs::OpenOptions::new()
            .write(true)
            .open("/dev/full")
            .unwrap()
    };
    let (output, exported) = printing_to(full(), "");
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(3), "{message}");
    assert!(message.contains("cannot write to standard output"));
    assert!(exported);
    assert_eq!(
        printing_to(full(), "assert(false)").0.status.code(),
        Some(1)
    );
    let help = program(Path::new("."))
        .arg("--help")
        .stdout(full())
        .status();
    assert_eq!(help.unwrap().code(), Some(3));
}

#[test]
fn a_script_goes_on_when_nobody_reads_what_it_prints() {
    let closed = || {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        writer
    };
    let (output, exported) = printing_to(closed(), "");
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{message}");
    assert!(!message.contains("standard output"), "{message}");
    assert!(exported);
    let (output, _) = printing_to(closed(), "assert(false)");
    assert_eq!(output.status.code(), Some(1));
}
