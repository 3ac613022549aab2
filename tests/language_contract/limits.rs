//! Limits: each is named by its error, and raised or lowered by `--limit`.

use crate::common::{Run, imp_with};

fn limited(limit: &str, program: &str) -> (Run, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("two.off"), TWO).unwrap();
    let words = ["run", "-", "--limit", limit];
    (imp_with(folder.path(), &words, program.as_bytes()), folder)
}

const BALL: &str = "field f(p in R3) over -2..2 = norm(p) - 1\n";

/// A limit, a program that stays below `enough` and hits `few`, and the error's code.
const LIMITS: [(&str, u64, u64, &str, &str); 11] = [
    (
        "recursion",
        300,
        50,
        "fn g(n) = if n < 1 then 0 else g(n - 1)\nlet x = g(100)",
        "E0601",
    ),
    (
        "nodes",
        10_000,
        100,
        "field g(x) = sum(sin(x + i) for i in range(200))",
        "E0602",
    ),
    ("elements", 2_000, 500, "let x = range(1000)", "E0603"),
    (
        "characters",
        3_000,
        500,
        "var s = \"ab\"\nfor i in range(9) { s = \"{s}{s}\" }",
        "E0603",
    ),
    (
        "steps",
        2_000,
        500,
        "var n = 0\nwhile n < 1000 { n = n + 1 }",
        "E0604",
    ),
    (
        "cells",
        10_000,
        500,
        "let m = polygonize(f, cell = 0.25)",
        "E0605",
    ),
    (
        "particles",
        200,
        99,
        "let s = sample(f, count = 100)",
        "E0606",
    ),
    (
        "seconds",
        3_600,
        0,
        "let s = sample(f, count = 100)",
        "E0607",
    ),
    (
        "bytes",
        2_000,
        50,
        "for i in range(20) { print(\"12345\") }",
        "E0608",
    ),
    (
        "bytes",
        100_000,
        50,
        "export(polygonize(f, cell = 0.5), \"a.stl\")",
        "E0608",
    ),
    ("input", 1_000, 20, "let m = load(\"two.off\")", "E0609"),
];

/// Two triangles, for the limit of what is loaded.
const TWO: &str = "OFF\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2\n3 0 2 3\n";

#[test]
fn every_limit_can_be_hit_and_raised() {
    for (name, enough, few, program, code) in LIMITS {
        let program = format!("{BALL}{program}\n");
        let (run, _folder) = limited(&format!("{name}={enough}"), &program);
        assert_eq!(run.code, 0, "{name}: {}", run.stderr);
        let (run, folder) = limited(&format!("{name}={few}"), &program);
        assert_eq!(run.code, 1, "{name}: {}", run.stderr);
        for words in [code, &format!("--limit {name}=N"), &few.to_string()] {
            assert!(
                run.stderr.contains(words),
                "{name}: {words}\n{}",
                run.stderr
            );
        }
        assert!(!folder.path().join("a.stl").exists());
    }
}

#[test]
fn every_limit_is_tried_here_and_told_by_the_help() {
    let folder = tempfile::tempdir().unwrap();
    let refused = imp_with(folder.path(), &["run", "-", "--limit", "nonsense=3"], b"");
    assert_eq!(refused.code, 2);
    let listed = refused.stderr.split("the limits are ").nth(1).unwrap();
    let listed = listed.lines().next().unwrap();
    let help = imp_with(folder.path(), &["run", "--help"], b"").stdout;
    for name in listed.split(", ") {
        assert!(LIMITS.iter().any(|(tried, ..)| *tried == name), "{name}");
        assert!(help.contains(name), "{name}");
    }
}

#[test]
fn endless_work_ends_when_the_time_is_over() {
    for program in [
        "while true { let x = 1 }",
        "let m = polygonize(f, cell = 0.001)",
        "let m = [[i + j for i in range(100)] for j in range(100)]\nvar q = m\nfor i in range(3000) { q = q @ m }",
        "for i in range(1000) { let s = sum(range(1000000) * range(1000000)) }",
        "field h(p in R3) = sum(sin(i*p.x)*p.y for i in range(2000))\nfor i in range(3000) { let g = (h + i).grad()(i, 2, 3) }",
        "field b(p in R3) = sum(exp(-norm2(p - [cos(i), sin(i*i), i/200])) for i in range(200)) - 1\nlet b2 = [bounds(b) for i in range(1000)]",
        "test \"t\" { while true { let x = 1 } }",
    ] {
        let folder = tempfile::tempdir().unwrap();
        let command = if program.starts_with("test") {
            "test"
        } else {
            "run"
        };
        let words = [
            command,
            "-",
            "--limit",
            "seconds=1",
            "--limit",
            "cells=9000000000",
        ];
        let run = imp_with(
            folder.path(),
            &words,
            format!("{BALL}{program}\n").as_bytes(),
        );
        assert_eq!(run.code, 1, "{program}");
        assert!(run.stderr.contains("E0607"), "{program}\n{}", run.stderr);
    }
}
