//! ARCHITECTURE.md's rules, checked: who may use whom, what may not be written.

use std::path::{Path, PathBuf};

/// The rooms and what each may use, as in ARCHITECTURE.md.
const ROOMS: &[(&str, &[&str])] = &[
    ("diagnostic", &[]),
    ("syntax", &["diagnostic"]),
    ("formatter", &["diagnostic", "syntax"]),
    ("math", &[]),
    ("graph", &["math"]),
    ("engine", &["graph", "math"]),
    ("geometry", &["math"]),
    ("continuation", &["engine", "geometry", "graph", "math"]),
    (
        "sample",
        &["continuation", "engine", "geometry", "graph", "math"],
    ),
    ("motion", &["sample", "engine", "geometry", "math"]),
    ("elastic", &["engine", "geometry"]),
    (
        "polygonize",
        &["continuation", "sample", "engine", "geometry", "graph"],
    ),
    ("inspect", &["engine", "geometry", "graph"]),
    ("picture", &["engine", "geometry", "graph", "math"]),
    ("file", &["geometry", "graph"]),
    ("library", &[]),
    (
        "language",
        &[
            "diagnostic",
            "syntax",
            "graph",
            "engine",
            "geometry",
            "sample",
            "motion",
            "elastic",
            "polygonize",
            "inspect",
            "picture",
            "file",
            "library",
        ],
    ),
    ("assist", &["diagnostic", "syntax", "language", "library"]),
    (
        "shell",
        &[
            "assist",
            "diagnostic",
            "syntax",
            "graph",
            "engine",
            "geometry",
            "sample",
            "motion",
            "elastic",
            "polygonize",
            "inspect",
            "picture",
            "file",
            "formatter",
            "language",
        ],
    ),
];

/// Crates that one room keeps to itself.
const KEPT: &[(&str, &str)] = &[
    ("logos", "syntax"),
    ("chumsky", "syntax"),
    ("ariadne", "diagnostic"),
    ("cranelift", "engine/jit"),
    ("clap", "shell"),
    ("rustyline", "shell/repl"),
    ("rustix", "shell/repl"),
    ("icy_sixel", "shell/repl"),
    ("base64", "shell/repl"),
    ("ctrlc", "shell"),
    ("indicatif", "shell"),
    ("lsp_server", "shell/lsp"),
    ("lsp_types", "shell/lsp"),
    ("png", "file"),
    ("ttf_parser", "file"),
    ("zip", "file"),
    ("similar", "shell"),
    ("notify", "shell"),
    ("nalgebra", "motion"),
    ("robust", "geometry"),
];

fn sources() -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut pending = vec![root.clone()];
    let mut files = Vec::new();
    while let Some(folder) = pending.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                pending.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let text = std::fs::read_to_string(&path).unwrap();
                files.push((path.strip_prefix(&root).unwrap().to_path_buf(), text));
            }
        }
    }
    files.sort();
    assert!(files.len() > 50);
    files
}

/// The program part of a file: without its unit tests and without comments.
fn program(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let end = text.find("#[cfg(test)]\nmod tests {").unwrap_or(text.len());
    text[..end]
        .lines()
        .enumerate()
        .map(|(number, line)| (number + 1, line.split("//").next().unwrap_or("")))
}

fn is_test(path: &Path) -> bool {
    path.iter()
        .any(|part| part.to_str().is_some_and(|part| part.contains("test")))
}

fn room(path: &Path) -> &str {
    path.iter().next().and_then(|part| part.to_str()).unwrap()
}

#[test]
fn rooms_use_only_what_they_may() {
    let names: Vec<&str> = ROOMS.iter().map(|(name, _)| *name).collect();
    for (path, text) in sources() {
        let Some((own, allowed)) = ROOMS.iter().find(|(name, _)| *name == room(&path)) else {
            assert!(
                path == Path::new("lib.rs") || path == Path::new("main.rs"),
                "{} is in no room",
                path.display()
            );
            continue;
        };
        if is_test(&path) {
            continue;
        }
        for (number, line) in program(&text) {
            for used in names.iter().filter(|name| *name != own) {
                assert!(
                    !line.contains(&format!("crate::{used}")) || allowed.contains(used),
                    "{}:{number}: `{own}` may not use `{used}`",
                    path.display()
                );
            }
        }
    }
}

#[test]
fn crates_stay_in_their_rooms() {
    for (path, text) in sources() {
        for (number, line) in program(&text) {
            for (name, home) in KEPT {
                let used =
                    line.contains(&format!("use {name}")) || line.contains(&format!("{name}::"));
                assert!(
                    !used || path.starts_with(home),
                    "{}:{number}: {name} is known to {home} only",
                    path.display()
                );
            }
        }
    }
}

#[test]
fn every_module_says_what_it_is_for() {
    for (path, text) in sources() {
        if is_test(&path) {
            continue;
        }
        assert!(
            text.starts_with("//! ") && text.len() > 100,
            "{} does not begin with what it is for",
            path.display()
        );
    }
}

#[test]
fn forbidden_words_are_not_written() {
    let unreproducible = [
        ".sin()", ".cos()", ".tan()", ".exp()", ".ln()", ".powf(", ".powi(", ".atan2(", ".sinh()",
        ".cosh()", ".tanh()", ".asin()", ".acos()", ".atan()", ".hypot(", ".cbrt()",
    ];
    for (path, text) in sources() {
        if is_test(&path) {
            continue;
        }
        for (number, line) in program(&text) {
            let place = format!("{}:{number}: {line}", path.display());
            for word in [
                "todo!",
                "unimplemented!",
                "dbg!",
                "#[ignore",
                "should_panic",
            ] {
                assert!(!line.contains(word), "{place}");
            }
            let may_be_unsafe = ["engine/jit", "engine/block", "math/scalar.rs"]
                .iter()
                .any(|room| path.starts_with(room));
            assert!(!line.contains("unsafe ") || may_be_unsafe, "{place}");
            // Interval and jet types have methods of these names of their own.
            let own_methods = path.starts_with("graph");
            for word in unreproducible {
                assert!(!line.contains(word) || own_methods, "{place}");
            }
        }
    }
}

#[test]
fn files_are_of_readable_length() {
    for (path, text) in sources() {
        let lines = text.lines().count();
        assert!(lines <= 700, "{} has {lines} lines", path.display());
    }
}
