//! What becomes of `-o`, and what the values of picture flags may be.

use std::fs;

use serde_json::json;
use tempfile::tempdir;

use crate::common::{imp_in, imp_with, program};

const FIELDS: &str = "field ball(p in R3) over -2..2 = norm(p) - 1\n\
                      field disc(p in R2) over -2..2 = norm(p) - 1\n\
                      field ends(x) over -2..2 = x^2 - 1\n";

fn folder() -> tempfile::TempDir {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("f.imp"), FIELDS).unwrap();
    folder
}

#[test]
fn wrong_values_of_picture_flags_are_wrong_usage() {
    let folder = folder();
    for (flag, values) in [
        (
            "--size",
            &["0", "-3", "huge", "10x", "x", "1.5", "3x0", "1x2x3"][..],
        ),
        ("--style", &["dotted", ""]),
        ("--view", &["behind", "30", "30,", "1,2,3", "nan,0"]),
        ("--samples", &["0", "9", "-1", "many"]),
        ("--perspective", &["0", "200", "-5", "wide"]),
    ] {
        for value in values {
            let words = ["render", "f.imp", "ball", "-o", "a.png", flag, value];
            let run = imp_in(folder.path(), &words);
            assert_eq!(run.code, 2, "{flag} {value}: {}", run.stderr);
            assert!(run.stderr.contains(flag), "{}", run.stderr);
            let json = imp_in(folder.path(), &[&words[..], &["--json"]].concat());
            assert_eq!(json.json()["error"]["code"], json!("E0001"));
        }
    }
    for flags in [
        ["--size", "20"],
        ["--size", "24x16"],
        ["--view", "-30,20"],
        ["--samples", "1"],
    ] {
        let words = ["render", "f.imp", "ball", "-o", "a.png", "--size", "16"];
        let words = if flags[0] == "--size" {
            &words[..5]
        } else {
            &words[..]
        };
        imp_in(folder.path(), &[words, &flags[..]].concat()).well();
    }
}

#[test]
fn work_whose_result_would_be_lost_is_refused() {
    let folder = folder();
    for words in [
        &["mesh", "f.imp", "ball"][..],
        &["mesh", "f.imp", "disc"],
        &["sample", "f.imp", "ball"],
        &["render", "f.imp", "ball"],
        &["render", "f.imp", "ends"],
    ] {
        let run = imp_in(folder.path(), words);
        assert_eq!((run.code, run.stdout.as_str()), (2, ""), "{words:?}");
        assert!(run.stderr.contains("`-o"), "{}", run.stderr);
    }
    // Measures are a result of their own, and roots are printed.
    let measures = imp_in(
        folder.path(),
        &["mesh", "f.imp", "ball", "--json", "--cell", "0.2"],
    );
    assert_eq!(measures.well().json()["genus"], json!(0));
    assert_eq!(
        imp_in(folder.path(), &["mesh", "f.imp", "ends"])
            .well()
            .stdout,
        "[-1, 1]\n"
    );
}

#[test]
fn a_file_that_cannot_be_written_is_said_before_the_work() {
    let folder = folder();
    fs::create_dir(folder.path().join("taken.png")).unwrap();
    fs::write(folder.path().join("plain"), "").unwrap();
    // The work would take hours: it is never begun.
    let endless = ["--size", "5000x5000", "--samples", "1", "--occlusion"];
    for (path, expected) in [
        ("no/such/a.png", "does not exist"),
        ("taken.png", "is a folder"),
        ("plain/a.png", "not a folder"),
    ] {
        let words = ["render", "f.imp", "ball", "-o", path];
        let run = imp_in(folder.path(), &[&words[..], &endless[..]].concat());
        assert_eq!(run.code, 3, "{path}: {}", run.stderr);
        assert!(run.stderr.contains(expected), "{path}: {}", run.stderr);
        let text = format!("{FIELDS}plot(ball, \"{path}\", size = 5000, samples = 1)");
        let run = imp_with(folder.path(), &["run", "-"], text.as_bytes());
        assert_eq!(run.code, 3, "{path}: {}", run.stderr);
    }
    // A folder that `--out` names is made when it is needed.
    let words = [
        "mesh", "f.imp", "ball", "-o", "a.stl", "--cell", "0.5", "--out", "new/deep",
    ];
    imp_in(folder.path(), &words).well();
    assert!(folder.path().join("new/deep/a.stl").exists());
    let words = [
        "mesh",
        "f.imp",
        "ball",
        "-o",
        "a.stl",
        "--out",
        "plain/deep",
    ];
    assert_eq!(imp_in(folder.path(), &words).code, 3);
}

#[test]
fn formats_that_suit_are_named() {
    let folder = folder();
    let words = ["render", "f.imp", "ball", "-o", "z.jpg"];
    let run = imp_in(folder.path(), &words);
    assert_eq!(run.code, 3);
    assert!(run.stderr.contains("known are .png\n"), "{}", run.stderr);
    let run = imp_in(folder.path(), &["mesh", "f.imp", "ball", "-o", "z.jpg"]);
    assert!(
        run.stderr
            .contains("known are .obj, .stl, .ply, .off, .glb, .3mf, .vtp, .vtu\n"),
        "{}",
        run.stderr
    );
}

#[test]
fn a_byte_order_mark_says_nothing() {
    let folder = folder();
    let text = "\u{feff}let a = 2\nprint(a, b)\n";
    let words = ["run", "-", "--message-format", "short"];
    let run = imp_with(folder.path(), &words, text.as_bytes());
    assert!(
        run.stderr.starts_with("<stdin>:2:10: error[E0201]"),
        "{}",
        run.stderr
    );
    let run = imp_with(folder.path(), &["run", "-"], "\u{feff}print(7)".as_bytes()).well();
    assert_eq!(run.stdout, "7\n");
    fs::write(folder.path().join("m.vm"), "\u{feff}a var-x\nb square a\n").unwrap();
    let run = imp_in(folder.path(), &["eval", "load(\"m.vm\")(3, 0)"]).well();
    assert_eq!(run.stdout, "9\n");
}

/// An interrupt at any time leaves whole files or none.
#[cfg(target_os = "linux")]
#[test]
fn an_interrupt_leaves_no_temporary_file() {
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};

    let folder = folder();
    // Writing one file after the other, the program is nearly always within a file.
    let text = "field ball(p in R3) over -2..2 = norm(p) - 1\n\
                let m = polygonize(ball, cell = 0.05)\n\
                while true { export(m, \"m.obj\") }\n";
    fs::write(folder.path().join("write.imp"), text).unwrap();
    let mut child = program(folder.path())
        .args(["run", "write.imp"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while !folder.path().join("m.obj").exists() {
        assert!(
            begun.elapsed() < Duration::from_secs(60),
            "nothing is written"
        );
        std::thread::sleep(Duration::from_millis(5));
    }
    let number = child.id().to_string();
    let sent = Command::new("kill")
        .args(["-INT", &number])
        .status()
        .unwrap();
    assert!(sent.success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let names = fs::read_dir(folder.path()).unwrap();
    let mut names: Vec<String> = names
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, ["f.imp", "m.obj", "write.imp"]);
}
