//! Every example runs to its last assertion, checks, and describes itself.

mod common;

use std::path::PathBuf;

use common::imp;

fn examples() -> Vec<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples");
    let entries = std::fs::read_dir(&folder).unwrap();
    let inner = entries
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_dir());
    let folders: Vec<PathBuf> = inner.chain([folder.clone()]).collect();
    let mut files: Vec<PathBuf> = folders
        .iter()
        .flat_map(|folder| std::fs::read_dir(folder).unwrap())
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "imp"))
        .collect();
    files.sort();
    assert!(files.len() >= 20, "examples are missing: {files:?}");
    files
}

#[test]
fn every_example_runs_to_its_asserts() {
    for file in examples() {
        let output = tempfile::tempdir().unwrap();
        let run = imp(&[
            "run",
            file.to_str().unwrap(),
            "--out",
            output.path().to_str().unwrap(),
        ]);
        assert_eq!(run.code, 0, "{}\n{}", file.display(), run.stderr);
        let text = std::fs::read_to_string(&file).unwrap();
        assert!(text.contains("assert("), "{} shows nothing", file.display());
        let exports = text.matches("export(").count() + text.matches(".png\"").count();
        let written = std::fs::read_dir(output.path()).unwrap().count();
        assert_eq!(written, exports, "{}", file.display());
    }
}

#[test]
fn every_example_checks_and_lists_its_fields() {
    for file in examples() {
        let path = file.to_str().unwrap();
        let check = imp(&["check", path]);
        assert_eq!(check.code, 0, "{path}\n{}", check.stderr);
        let info = imp(&["info", path, "--json"]).well().json();
        assert!(!info["fields"].as_array().unwrap().is_empty(), "{path}");
    }
}

/// A sphere's grid points do not depend on how many threads evaluate them.
#[test]
fn files_are_the_same_for_any_number_of_threads() {
    let mut seen = Vec::new();
    for threads in ["1", "2", "4"] {
        let output = tempfile::tempdir().unwrap();
        let out = output.path().to_str().unwrap();
        imp(&[
            "run",
            "examples/blobs.imp",
            "--out",
            out,
            "--threads",
            threads,
        ])
        .well();
        let read = |name: &str| std::fs::read(output.path().join(name)).unwrap();
        seen.push((read("blobs.ply"), read("blobs.stl")));
    }
    assert!(seen[0].0.len() > 10_000 && seen[0].1.len() > 10_000);
    assert!(seen.iter().all(|files| *files == seen[0]));
}
