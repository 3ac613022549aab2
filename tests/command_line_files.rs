//! The command line and the disk: what is read, where files go, and where they may not go.

mod common;

use std::fs;
use std::path::Path;

use common::{Run, imp_in, imp_with};
use serde_json::json;
use tempfile::{TempDir, tempdir};

const BALL: &str = "field ball(p in R3) over -1.3..1.3 = norm(p) - 1\n";

/// A script that exports a small mesh to a path.
fn exporting(path: &str) -> String {
    format!("{BALL}export(polygonize(ball, cell = 0.5), \"{path}\")\n")
}

/// Runs a script that exports to a path.
fn export_in(directory: &Path, path: &str, options: &[&str]) -> Run {
    let words = [&["run", "-"], options].concat();
    imp_with(directory, &words, exporting(path).as_bytes())
}

fn folder_with_ball() -> TempDir {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("ball.imp"), BALL).unwrap();
    folder
}

#[cfg(unix)]
#[test]
fn no_link_leads_a_script_out_of_the_output_directory() {
    use std::os::unix::fs::symlink;
    let (folder, outside) = (tempdir().unwrap(), tempdir().unwrap());
    let build = folder.path().join("build");
    fs::create_dir(&build).unwrap();
    let secret = outside.path().join("secret.stl");
    fs::write(&secret, "old").unwrap();
    symlink(&secret, build.join("file.stl")).unwrap();
    symlink(outside.path().join("new.stl"), build.join("dangling.stl")).unwrap();
    symlink(outside.path(), build.join("folder")).unwrap();
    symlink("file.stl", build.join("twice.stl")).unwrap();
    symlink("circle.stl", build.join("circle.stl")).unwrap();
    for name in ["file.stl", "dangling.stl", "folder/a.stl", "twice.stl"] {
        let run = export_in(folder.path(), name, &["--out", "build"]);
        assert_eq!(run.code, 3, "{name}");
        assert!(run.stderr.contains("E0704"), "{name}: {}", run.stderr);
    }
    let run = export_in(folder.path(), "circle.stl", &["--out", "build"]);
    assert!(run.stderr.contains("circle"), "{}", run.stderr);
    assert_eq!(fs::read(&secret).unwrap(), b"old");
    assert_eq!(fs::read_dir(outside.path()).unwrap().count(), 1);
    // Links that stay inside are followed, also to a file that is not there yet.
    symlink("real.stl", build.join("inside.stl")).unwrap();
    export_in(folder.path(), "inside.stl", &["--out", "build"]).well();
    assert!(build.join("inside.stl").is_symlink());
    assert!(fs::metadata(build.join("real.stl")).unwrap().len() > 84);
    // And what is allowed is allowed.
    let directory = outside.path().to_str().unwrap();
    let options = ["--out", "build", "--allow-write", directory];
    export_in(folder.path(), "folder/a.stl", &options).well();
}

#[test]
fn a_missing_folder_is_said_to_be_missing_and_not_to_be_outside() {
    let folder = tempdir().unwrap();
    let absolute = folder.path().canonicalize().unwrap();
    let absolute = absolute.join("build/no/a.stl");
    let absolute = absolute.to_str().unwrap();
    for (path, options) in [
        ("no/a.stl", &[][..]),
        ("no/a.stl", &["--out", "build"]),
        (absolute, &["--out", "build"]),
        (absolute, &[]),
    ] {
        let run = export_in(folder.path(), path, options);
        assert_eq!(run.code, 3, "{path}");
        let text = run.stderr.replace('\n', " ");
        assert!(text.contains("does not exist"), "{path}: {text}");
        assert!(text.contains("E0703"), "{path}: {text}");
    }
    for path in ["../no/a.stl", "no/../../a.stl", "/no/such/a.stl"] {
        let run = export_in(folder.path(), path, &["--out", "build"]);
        assert!(run.stderr.contains("E0704"), "{path}: {}", run.stderr);
    }
    fs::write(folder.path().join("x.stl"), "old").unwrap();
    let run = export_in(folder.path(), "x.stl/y.stl", &[]);
    assert!(run.stderr.contains("is not a folder"), "{}", run.stderr);
}

#[test]
fn names_cannot_write_to_the_terminal() {
    let folder = tempdir().unwrap();
    let run = export_in(folder.path(), "a\\nb.stl", &[]);
    assert_eq!(run.code, 1);
    assert!(run.stderr.contains("E0309"), "{}", run.stderr);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    let run = export_in(folder.path(), "a.stl", &["--out", "b\u{1b}[31mc"]).well();
    assert!(run.stderr.contains("b\\u{1b}[31mc"), "{}", run.stderr);
}

#[test]
fn the_output_directory_is_made_when_something_is_written() {
    let folder = folder_with_ball();
    let build = folder.path().join("a/build");
    for words in [
        &["check", "ball.imp"][..],
        &["eval", "1"],
        &["info", "ball.imp"],
        &["dump", "ball.imp", "--graph"],
        &["mesh", "ball.imp", "--cell", "0.5", "--json"],
    ] {
        let words = [words, &["--out", "a/build"]].concat();
        imp_in(folder.path(), &words).well();
        assert!(!build.exists(), "{words:?}");
    }
    export_in(folder.path(), "s.stl", &["--out", "a/build"]).well();
    assert!(build.join("s.stl").exists());
}

#[test]
fn the_output_of_mesh_and_sample_goes_below_the_output_directory() {
    let folder = folder_with_ball();
    let words = ["mesh", "ball.imp", "--cell", "0.5", "-o", "a.stl", "--json"];
    let run = imp_in(folder.path(), &[&words[..], &["--out", "build"]].concat()).well();
    assert!(folder.path().join("build/a.stl").exists());
    assert!(!folder.path().join("a.stl").exists());
    let expected = Path::new("build").join("a.stl");
    assert_eq!(run.json()["output"], json!(expected.to_str().unwrap()));
    imp_in(folder.path(), &words).well();
    assert!(folder.path().join("a.stl").exists());
    let words = ["sample", "ball.imp", "--count", "50", "-o", "b.csv"];
    imp_in(folder.path(), &[&words[..], &["--out", "build"]].concat()).well();
    assert!(folder.path().join("build/b.csv").exists());
}

#[test]
fn bricks_are_files_of_their_own() {
    let folder = folder_with_ball();
    let words = "mesh ball.imp --resolution 26 --bricks 13 -o parts/b.ply --json --out build";
    let words: Vec<&str> = words.split(' ').collect();
    fs::create_dir_all(folder.path().join("build/parts")).unwrap();
    let told = imp_in(folder.path(), &words).well().json();
    assert_eq!((&told["files"], &told["bricks"]), (&json!(8), &json!(8)));
    let expected = Path::new("build").join("parts/b.ply");
    assert_eq!(told["output"], json!(expected.to_str().unwrap()));
    for place in ["0-0-0", "1-0-0", "0-1-1", "1-1-1"] {
        let name = format!("build/parts/b-{place}.ply");
        assert!(folder.path().join(&name).exists(), "{name}");
    }
    assert!(!folder.path().join(&expected).exists());
    // The same measures as in one piece.
    let whole = [
        "mesh",
        "ball.imp",
        "--resolution",
        "26",
        "--method",
        "cubes",
        "--json",
    ];
    let whole = imp_in(folder.path(), &whole).well().json();
    assert_eq!(told["triangles"], whole["triangles"]);
    let close = |name: &str| {
        let [one, other] = [&told, &whole].map(|told| told[name].as_f64().unwrap());
        (one - other).abs() < 1e-12 * other
    };
    assert!(close("area") && close("volume"), "{told} {whole}");
    // Nothing is told of each file, and one line of all of them.
    let words = [
        "mesh",
        "ball.imp",
        "--resolution",
        "26",
        "--bricks",
        "13",
        "-o",
        "b.ply",
    ];
    let run = imp_in(folder.path(), &words).well();
    assert_eq!(run.stdout.lines().count(), 1, "{}", run.stdout);
    assert_eq!(run.stderr, "");
    for option in ["--method", "--snap", "--bricks=0", "--split=6"] {
        let mut more = words.to_vec();
        match option {
            "--method" => more.extend(["--method", "dual"]),
            "--bricks=0" => more[5] = "0",
            option => more.push(option),
        }
        assert_eq!(imp_in(folder.path(), &more).code, 1, "{option}");
    }
    let without_name = ["mesh", "ball.imp", "--bricks", "13", "--json"];
    assert_eq!(imp_in(folder.path(), &without_name).code, 2);
}

#[test]
fn a_format_that_cannot_hold_the_result_is_refused_before_the_work() {
    let folder = folder_with_ball();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("disc.imp", "field disc(p in R2) over -2..2 = norm(p) - 1\n");
    write("line.imp", "field line(x) over -2..2 = x^2 - 1\n");
    // The work would end with exit code 1, since the limits are too low for it.
    let low = ["--limit", "cells=1", "--limit", "particles=1"];
    for words in [
        ["mesh", "disc.imp", "-o", "a.stl"],
        ["mesh", "ball.imp", "-o", "a.svg"],
        ["mesh", "line.imp", "-o", "a.obj"],
        ["sample", "ball.imp", "-o", "a.stl"],
    ] {
        let run = imp_in(folder.path(), &[&words[..], &low].concat());
        assert_eq!(run.code, 3, "{words:?}");
        assert!(run.stderr.contains("E0706"), "{words:?}: {}", run.stderr);
    }
    // The limits do end the work, where the format is right.
    let words = ["mesh", "disc.imp", "-o", "a.svg"];
    assert_eq!(imp_in(folder.path(), &[&words[..], &low].concat()).code, 1);
}

#[cfg(unix)]
#[test]
fn an_endless_file_is_refused() {
    let run = imp_in(Path::new("/"), &["run", "/dev/zero"]);
    assert_eq!(run.code, 3);
    assert!(run.stderr.contains("E0701"), "{}", run.stderr);
    assert!(run.stderr.contains("256 MB"), "{}", run.stderr);
}

#[test]
fn only_words_that_look_like_files_are_files() {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("5"), "this is no script").unwrap();
    let run = imp_in(folder.path(), &["eval", "5", "3"]).well();
    assert_eq!(run.stdout, "5\n3\n");
    let run = imp_with(folder.path(), &["eval", "-", "a + 1"], b"let a = 2\n").well();
    assert_eq!(run.stdout, "3\n");
}

#[test]
fn certificates_without_a_place_are_refused_before_the_work() {
    let folder = folder_with_ball();
    let mesh = |words: &[&str]| {
        let run = imp_in(
            folder.path(),
            &[&["mesh", "ball.imp", "-o", "ball.ply"], words].concat(),
        );
        assert!(!folder.path().join("ball.ply").exists(), "{words:?}");
        run
    };
    let certified = ["--method", "certified", "--certificate"];
    let same = mesh(&[&certified[..], &["ball.ply"]].concat());
    assert_eq!(same.code, 2);
    assert!(same.stderr.contains("a name of its own"), "{}", same.stderr);
    let nowhere = mesh(&[&certified[..], &["none/ball.certificate"]].concat());
    assert_eq!(nowhere.code, 3);
    assert!(nowhere.stderr.contains("E0703"), "{}", nowhere.stderr);
    let other = mesh(&["--certificate", "ball.certificate"]);
    assert_eq!(other.code, 2);
    assert!(other.stderr.contains("certified"), "{}", other.stderr);
}
