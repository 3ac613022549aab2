//! Definitions that are given again, and inputs that fail.

use std::path::Path;

use crate::common::{Run, imp_with};

/// The inputs one after the other, each on its own.
fn session(inputs: &[&str]) -> Run {
    let folder = tempfile::tempdir().unwrap();
    // A command between two inputs parts them.
    let text = inputs.join("\n:set pictures on\n");
    imp_with(folder.path(), &["repl"], text.as_bytes())
}

fn value(inputs: &[&str]) -> String {
    session(inputs).well().stdout.trim_end().to_string()
}

#[test]
fn what_depends_on_a_definition_is_made_again() {
    let field = "field ball(p in R2) over -9..9 = norm(p) - r";
    assert_eq!(value(&["let r = 1", field, "let r = 2", "ball(5, 0)"]), "3");
    assert_eq!(
        value(&["param r = 1", field, "param r = 2", "ball(5, 0)"]),
        "3"
    );
    assert_eq!(
        value(&["param r = 1", field, "let r = 2", "ball(5, 0)"]),
        "3"
    );
    assert_eq!(
        value(&["let r = 1", field, "param r = 2", "diff(ball, r)(5, 0)"]),
        "-1"
    );
    assert_eq!(
        value(&[
            "param r = [1, 1]",
            "let s = r.x",
            "param r = [5, 1, 1]",
            "s"
        ]),
        "5"
    );
    let chain = [
        "let a = 1",
        "let b = 2*a",
        "fn f(x) = x + b",
        "let c = f(1)",
        "let a = 10",
        "c",
    ];
    assert_eq!(value(&chain), "21");
    // What takes actions is made again when it is asked for.
    let mesh = [
        "field f(x) over 0..10 = x - 3",
        "let root = polygonize(f)",
        "field f(x) over 0..10 = x - 4",
        "root",
    ];
    assert_eq!(value(&mesh), "[4]");
}

#[test]
fn a_variable_is_counted_again_with_what_it_was_made_of() {
    assert_eq!(value(&["var n = 0", "n = n + 1", "n = n + 1", "n"]), "2");
    assert_eq!(value(&["var n = 0", "n = n + 1", "var n = 5", "n"]), "5");
    let step = [
        "let step = 1",
        "var n = 0",
        "n = n + step",
        "n = n + step",
        "let step = 10",
        "n",
    ];
    assert_eq!(value(&step), "20");
}

#[test]
fn the_last_value_has_a_name_and_definitions_keep_what_it_was() {
    assert_eq!(value(&["2 + 3", "let a = 2*ans", "100", "a"]), "5\n100\n10");
    assert_eq!(value(&["2 + 3; let a = 2*ans; a + ans"]), "5\n15");
    assert_eq!(
        value(&["1", "ans + 1", "ans + ans", "let a = ans", "0", "a"]),
        "1\n2\n4\n0\n4"
    );
    assert_eq!(value(&["let ans = 3", "1 + 1", "ans"]), "2\n3");
    let run = session(&["ans"]);
    assert!(run.stderr.contains("there is no `ans`"), "{}", run.stderr);
}

#[test]
fn an_input_may_give_several_definitions_again() {
    let plane = "field f(p in R2) = p.x; field g(p in R2) = f(p) + p.y";
    let space = "field f(p in R3) = p.x; field g(p in R3) = f(p) + p.z";
    assert_eq!(value(&[plane, space, "g(1, 2, 3)"]), "4");
    // Alone, f does not fit g, and stays as it was.
    let run = session(&[plane, "field f(p in R3) = p.x", "g(1, 2)"]);
    assert_eq!(run.code, 1);
    assert!(
        run.stderr.contains("because this is given again"),
        "{}",
        run.stderr
    );
    assert!(run.stderr.contains("<stdin>:3:"), "{}", run.stderr);
}

#[test]
fn a_definition_cannot_be_made_of_itself() {
    for inputs in [
        &["let a = 1", "let a = a + 1"][..],
        &["let a = 1", "let b = a", "let a = b"],
    ] {
        let run = session(inputs);
        assert_eq!(run.code, 1);
        assert!(
            run.stderr.contains("uses what it replaces"),
            "{}",
            run.stderr
        );
    }
    assert_eq!(
        value(&[
            "fn f(n) = if n < 1 then 1 else n*f(n - 1)",
            "fn f(n) = if n < 2 then 1 else n*f(n - 1)",
            "f(5)"
        ]),
        "120"
    );
    let run = session(&["let [a, b] = [1, 2]", "let a = 3"]);
    assert!(
        run.stderr.contains("`b` would be left without"),
        "{}",
        run.stderr
    );
    assert_eq!(
        value(&["let [a, b] = [1, 2]", "let [b, a] = [5, 6]", "a"]),
        "6"
    );
}

#[test]
fn settings_and_modules_can_be_changed() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("part.imp"),
        "param w = 2\nlet twice = 2*w\n",
    )
    .unwrap();
    let run = |text: &str| imp_with(Path::new(folder.path()), &["repl"], text.as_bytes());
    let text = "import \"part.imp\" as part\nlet k = part.twice\nimport \"part.imp\" as part\nk\n";
    assert_eq!(run(text).well().stdout, "4\n");
    let text = "setting n = 2\nfield f(x) = n*x\n(f with {n = 5})(1)\nsetting n = 3\n(f with {n = 5})(1)\nf(1)\n";
    assert_eq!(run(text).well().stdout, "5\n5\n3\n");
}
