//! `test` blocks and `imp test`.

use std::path::Path;

use crate::common::{Run, imp_with};

fn test(program: &str, more: &[&str]) -> (Run, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.imp"), program).unwrap();
    let words: Vec<&str> = ["test", "a.imp"].iter().chain(more).copied().collect();
    (imp_with(folder.path(), &words, b""), folder)
}

const PROGRAM: &str = "param r = 1\n\
    test \"later definitions are seen\" { assert(twice(2) == 4) }\n\
    fn twice(x) = 2*x\n\
    field ball(p in R3) over -2..2 = norm(p) - r\n\
    let volume = polygonize(ball, cell = 0.5).volume\n\
    var n = 0\n\
    print(\"not shown\")\n\
    export(polygonize(ball, cell = 0.5), \"never.stl\")\n\
    assert(false, \"not run either\")\n\
    test \"a script's lets are made when they are asked for\" { assert(volume > 3 and volume < 4.2) }\n\
    test \"one\" { n = n + 1; let k = 3; print(\"n = {n}\"); assert(n == 1) }\n\
    test \"two\" { n = n + 1; assert(n == 1); let k = 4 }\n\
    test \"wrong\" {\n    assert(1 + 1 == 3, \"arithmetic\")\n}\n\
    test \"broken\" { let x = [1][3] }\n";

#[test]
fn every_test_has_a_line_and_the_failures_their_places() {
    let (run, folder) = test(PROGRAM, &[]);
    assert_eq!(run.code, 1);
    let expected = [
        "ok   a.imp: later definitions are seen",
        "ok   a.imp: a script's lets are made when they are asked for",
        "ok   a.imp: one",
        "     n = 1",
        "ok   a.imp: two",
        "FAIL a.imp: wrong",
        "FAIL a.imp: broken",
        "6 tests: 4 passed, 2 failed",
    ];
    assert_eq!(run.stdout.lines().collect::<Vec<_>>(), expected);
    for words in ["arithmetic", "a.imp:14:12", "E0501", "E0303"] {
        assert!(run.stderr.contains(words), "{words}\n{}", run.stderr);
    }
    assert!(!folder.path().join("never.stl").exists());
}

#[test]
fn the_results_are_given_as_json() {
    let (run, _folder) = test(PROGRAM, &["--json"]);
    assert_eq!(run.code, 1);
    let json = run.json();
    assert_eq!((&json["passed"], &json["failed"]), (&4.into(), &2.into()));
    let tests = json["tests"].as_array().unwrap();
    assert_eq!(tests[2]["printed"][0], "n = 1");
    assert_eq!(tests[4]["name"], "wrong");
    assert_eq!(tests[4]["passed"], false);
    assert_eq!(tests[4]["error"]["code"], "E0501");
    assert_eq!(tests[4]["error"]["line"], 14);
    assert_eq!(
        (&tests[4]["line"], &tests[4]["column"]),
        (&13.into(), &6.into())
    );
}

#[test]
fn a_filter_chooses_by_name_and_success_is_zero() {
    let (run, _folder) = test(PROGRAM, &["--filter", "t"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(
        run.stdout.ends_with("3 tests: 3 passed, 0 failed\n"),
        "{}",
        run.stdout
    );
}

#[test]
fn tests_are_run_by_nobody_else_but_checked() {
    let folder = tempfile::tempdir().unwrap();
    let imp = |words: &[&str], program: &str| imp_with(folder.path(), words, program.as_bytes());
    let program = "test \"t\" { assert(false) }\nprint(1)\n";
    assert_eq!(imp(&["run", "-"], program).well().stdout, "1\n");
    imp(&["check", "-"], program).well();
    assert_eq!(imp(&["eval", "-", "2"], program).well().stdout, "2\n");
    // Names in tests are checked by everybody, and `imp check` evaluates them.
    let misspelt = imp(
        &["run", "-"],
        "let radius = 1\ntest \"t\" { assert(radus == 1) }\n",
    );
    assert!(misspelt.stderr.contains("`radius`"), "{}", misspelt.stderr);
    let wrong = imp(&["check", "-"], "test \"t\" { let x = [1][3] }\n");
    assert!(wrong.stderr.contains("E0303"), "{}", wrong.stderr);
    let inside = imp(&["run", "-"], "fn f() { test \"t\" { } }\n");
    assert!(inside.stderr.contains("E0210"), "{}", inside.stderr);
}

#[test]
fn several_files_and_what_cannot_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        std::fs::write(Path::new(folder.path()).join(name), text).unwrap();
    };
    write("a.imp", "test \"a\" { assert(true) }\n");
    write("b.imp", "test \"b\" { assert(true) }\ntest \"b\" { }\n");
    write("none.imp", "let x = 1\n");
    let good = imp_with(folder.path(), &["test", "a.imp", "b.imp", "none.imp"], b"").well();
    assert!(
        good.stdout.ends_with("3 tests: 3 passed, 0 failed\n"),
        "{}",
        good.stdout
    );
    // A file that cannot be run does not keep the others from being tested.
    write("bad.imp", "let x = [1][3]\n");
    let bad = imp_with(folder.path(), &["test", "bad.imp", "a.imp"], b"");
    assert_eq!(bad.code, 1);
    assert!(bad.stdout.contains("ok   a.imp: a"), "{}", bad.stdout);
    let missing = imp_with(folder.path(), &["test", "missing.imp", "a.imp"], b"");
    assert_eq!(missing.code, 3);
}

#[test]
fn a_failed_comparison_tells_both_sides() {
    for (program, help) in [
        (
            "assert(1 + 1 == 3)",
            "the left side is 2, the right side is 3",
        ),
        (
            "let v = 0.5\nassert(v > 0 and v > 1)",
            "the left side is 0.5, the right side is 1",
        ),
        (
            "assert(\"a\" == \"b\", \"why\")",
            "the left side is \"a\", the right side is \"b\"",
        ),
        (
            "for i in range(3) { assert(0 < i + 1 < 3) }",
            "the left side is 3, the right side is 3",
        ),
    ] {
        let run = crate::common::script(program);
        assert_eq!(run.code, 1, "{program}");
        assert!(run.stderr.contains(help), "{program}\n{}", run.stderr);
    }
    // Where another part decides, nothing is said of the comparison.
    for program in [
        "assert(false)",
        "for i in range(2) { assert(not (i == 1)) }",
        "let x = 1 == 2\nassert(x)",
    ] {
        let run = crate::common::script(program);
        assert_eq!(run.code, 1, "{program}");
        assert!(
            !run.stderr.contains("left side"),
            "{program}\n{}",
            run.stderr
        );
    }
}
