//! What the README shows is true: every command in it works.

mod common;

use std::path::Path;

use common::imp_in;

/// The lines of the README's `console` blocks that start with `$ imp`, or with `$ cargo run`.
fn commands() -> Vec<Vec<String>> {
    let text = include_str!("../README.md");
    text.lines()
        .filter_map(|line| line.trim().strip_prefix("$ "))
        .filter_map(|line| {
            let line = line.replace("cargo run --release --", "imp");
            let words = split(&line);
            (words.first().map(String::as_str) == Some("imp")).then(|| words[1..].to_vec())
        })
        .collect()
}

/// Words of a shell command with double quotes.
fn split(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    let mut word = String::new();
    let mut quoted = false;
    for character in line.chars() {
        match character {
            '"' => quoted = !quoted,
            ' ' if !quoted => {
                if !word.is_empty() {
                    words.push(std::mem::take(&mut word));
                }
            }
            other => word.push(other),
        }
    }
    if !word.is_empty() {
        words.push(word);
    }
    words
}

#[test]
fn every_command_of_the_readme_works() {
    let folder = tempfile::tempdir().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut open = vec![Path::new("examples").to_path_buf()];
    while let Some(inner) = open.pop() {
        std::fs::create_dir(folder.path().join(&inner)).unwrap();
        for entry in std::fs::read_dir(root.join(&inner)).unwrap() {
            let path = inner.join(entry.unwrap().file_name());
            if root.join(&path).is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|extension| extension == "imp") {
                std::fs::copy(root.join(&path), folder.path().join(&path)).unwrap();
            }
        }
    }
    let commands = commands();
    assert!(
        commands.len() >= 5,
        "the README shows few commands: {commands:?}"
    );
    for command in commands {
        let words: Vec<&str> = command.iter().map(String::as_str).collect();
        let run = imp_in(folder.path(), &words);
        assert_eq!(run.code, 0, "imp {}\n{}", command.join(" "), run.stderr);
    }
}

/// The picture that the README shows is the one that its command makes.
#[test]
fn the_picture_of_the_readme_is_up_to_date() {
    let decoded = |path: &Path| {
        let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        (info.width, info.height, bytes)
    };
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    let command = commands()
        .into_iter()
        .find(|words| words.contains(&"part.png".to_owned()))
        .unwrap();
    let out = folder.path().to_str().unwrap();
    let words = command.iter().map(String::as_str);
    let words: Vec<&str> = words.chain(["--out", out]).collect();
    imp_in(root, &words).well();
    let shown = root.join("docs/part.png");
    assert!(std::fs::metadata(&shown).unwrap().len() < 100_000);
    let (shown, made) = (decoded(&shown), decoded(&folder.path().join("part.png")));
    assert_eq!((shown.0, shown.1), (made.0, made.1));
    // Decisions by wider bounds may move a root by less than can be seen.
    let pairs = shown.2.iter().zip(&made.2);
    assert!(pairs.into_iter().all(|(a, b)| a.abs_diff(*b) <= 2));
}
