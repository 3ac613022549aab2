//! The commands around programs: formatting, watching, completions and manual pages.

mod common;

use std::fs;
use std::io::{BufRead, BufReader};
use std::process::Stdio;
use std::sync::mpsc::channel;
use std::time::Duration;

use common::{imp, imp_in, imp_with, program};

/// A program that is not formatted, and the same formatted.
const BEFORE: &str = "let  a=1 # one\nprint( a )\n";
const AFTER: &str = "let a = 1 # one\nprint(a)\n";

#[test]
fn files_and_folders_are_formatted_in_place() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("inner");
    fs::create_dir(&inner).unwrap();
    fs::write(folder.path().join("a.imp"), BEFORE).unwrap();
    fs::write(
        inner.join("b.imp"),
        format!("\u{feff}{}", AFTER.replace('\n', "\r\n")),
    )
    .unwrap();
    fs::write(inner.join("c.txt"), BEFORE).unwrap();
    let run = imp_in(folder.path(), &["fmt", ".", "--check"]);
    assert_eq!(run.code, 1, "{}", run.stderr);
    assert_eq!(run.stdout, "./a.imp\n./inner/b.imp\n");
    imp_in(folder.path(), &["fmt", "."]).well();
    assert_eq!(
        fs::read_to_string(folder.path().join("a.imp")).unwrap(),
        AFTER
    );
    assert_eq!(fs::read_to_string(inner.join("b.imp")).unwrap(), AFTER);
    assert_eq!(fs::read_to_string(inner.join("c.txt")).unwrap(), BEFORE);
    let run = imp_in(folder.path(), &["fmt", ".", "--check"]).well();
    assert_eq!(run.stdout, "");
    let run = imp_in(folder.path(), &["fmt", ".", "--json"]).well();
    assert_eq!(run.json()["checked"], 2);
}

#[test]
fn a_file_with_mistakes_is_left_alone_and_the_others_are_formatted() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.imp"), "let a = (\n").unwrap();
    fs::write(folder.path().join("b.imp"), BEFORE).unwrap();
    let run = imp_in(folder.path(), &["fmt", "a.imp", "b.imp"]);
    assert_eq!(run.code, 1);
    assert!(run.stderr.contains("a.imp"), "{}", run.stderr);
    assert_eq!(
        fs::read_to_string(folder.path().join("a.imp")).unwrap(),
        "let a = (\n"
    );
    assert_eq!(
        fs::read_to_string(folder.path().join("b.imp")).unwrap(),
        AFTER
    );
    assert_eq!(imp_in(folder.path(), &["fmt", "none.imp"]).code, 3);
}

#[test]
fn standard_input_is_formatted_to_standard_output_and_differences_are_shown() {
    let folder = tempfile::tempdir().unwrap();
    let run = imp_with(folder.path(), &["fmt", "-"], BEFORE.as_bytes()).well();
    assert_eq!(run.stdout, AFTER);
    let run = imp_with(folder.path(), &["fmt", "-", "--diff"], BEFORE.as_bytes()).well();
    assert_eq!(
        run.stdout,
        "--- <stdin>\n+++ <stdin> (formatted)\n@@ -1,2 +1,2 @@\n-let  a=1 # one\n-print( a )\n+let a = 1 # one\n+print(a)\n"
    );
}

#[test]
fn completions_know_the_commands_in_every_shell() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let run = imp(&["completions", shell]).well();
        for word in ["polygonizes", "render", "tolerance"] {
            let found = run.stdout.to_lowercase().contains(word);
            // bash's completions have no descriptions.
            assert!(found || shell == "bash", "{shell}: {word}");
        }
        assert!(run.stdout.contains("resolution"), "{shell}");
    }
    assert_eq!(imp(&["completions", "cmd"]).code, 2);
}

#[test]
fn manual_pages_are_there_for_the_program_and_its_commands() {
    let run = imp(&["man"]).well();
    assert!(
        run.stdout.contains(".TH imp 1") && run.stdout.contains("Examples"),
        "{}",
        run.stdout
    );
    let run = imp(&["man", "mesh"]).well();
    assert!(run.stdout.contains("resolution"), "{}", run.stdout);
    let run = imp(&["man", "mash"]);
    assert_eq!(run.code, 2);
    assert!(
        run.stderr.contains("did you mean `mesh`?"),
        "{}",
        run.stderr
    );
}

#[test]
fn colours_can_be_forced_and_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.imp"), "let a = (\n").unwrap();
    for (forced, refused, coloured) in [("1", "", true), ("0", "", false), ("1", "1", false)] {
        let output = program(folder.path())
            .args(["check", "a.imp"])
            .env("CLICOLOR_FORCE", forced)
            .env("NO_COLOR", refused)
            .output()
            .unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(stderr.contains('\u{1b}'), coloured, "{forced} {refused}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_watched_script_runs_again_when_one_of_its_files_is_saved() {
    let folder = tempfile::tempdir().unwrap();
    let (main, part) = (
        folder.path().join("main.imp"),
        folder.path().join("part.imp"),
    );
    let text = "import \"part.imp\" as part\nprint(part.a)\n";
    fs::write(&part, "let a = 1\n").unwrap();
    fs::write(&main, text).unwrap();
    let mut child = program(folder.path())
        .args(["watch", "main.imp"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let (sender, lines) = channel();
    for reader in [
        Box::new(child.stdout.take().unwrap()) as Box<dyn std::io::Read + Send>,
        Box::new(child.stderr.take().unwrap()),
    ] {
        let sender = sender.clone();
        std::thread::spawn(move || {
            for line in BufReader::new(reader).lines().map_while(Result::ok) {
                let _ = sender.send(line);
            }
        });
    }
    // Output and messages come through two pipes, so the order between them is open.
    let wait_for = |texts: &[&str]| {
        let mut missing = texts.to_vec();
        while !missing.is_empty() {
            let line = lines.recv_timeout(Duration::from_secs(60));
            let line = line.unwrap_or_else(|_| panic!("no line with {missing:?}"));
            missing.retain(|text| !line.contains(text));
        }
    };
    wait_for(&["watching 2 files"]);
    // As editors do: a new file takes the name.
    let new = folder.path().join("new");
    fs::write(&new, "let a = 22\n").unwrap();
    fs::rename(&new, &part).unwrap();
    wait_for(&["22", "done"]);
    fs::write(&main, "print(\n").unwrap();
    wait_for(&["failed"]);
    fs::remove_file(&main).unwrap();
    fs::write(&main, "print(333)\n").unwrap();
    wait_for(&["333", "done"]);
    // A run that never ends is stopped by the next save.
    fs::write(&main, "print(\"begun\")\nwhile true { let x = 1 }\n").unwrap();
    wait_for(&["begun"]);
    fs::write(&main, "print(4444)\n").unwrap();
    wait_for(&["4444"]);
    let pid = child.id().to_string();
    let killed = std::process::Command::new("kill")
        .args(["-INT", &pid])
        .status();
    assert!(killed.unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
}

#[test]
fn the_times_of_a_run_are_told_and_add_up() {
    let folder = tempfile::tempdir().unwrap();
    let text = "field ball(p in R3) over -2..2 = norm(p) - 1\nprint(area(polygonize(ball)))\n";
    fs::write(folder.path().join("a.imp"), text).unwrap();
    let run = imp_in(folder.path(), &["run", "a.imp", "--timings"]).well();
    for part in [
        "parse",
        "evaluate",
        "polygonize",
        "print",
        "compile",
        "total",
    ] {
        let line = run.stderr.lines().find(|line| line.starts_with(part));
        assert!(line.is_some(), "{part}: {}", run.stderr);
    }
    let run = imp_in(folder.path(), &["run", "a.imp", "--timings", "--json"]).well();
    let timings = &run.json()["timings"];
    let seconds = |part: &str| timings[part].as_f64().expect(part);
    let sum: f64 = ["parse", "evaluate", "polygonize", "print"]
        .map(seconds)
        .iter()
        .sum();
    assert!((sum - seconds("total")).abs() < 1e-6, "{timings}");
}
