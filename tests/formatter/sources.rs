//! The programs of this project are formatted, and thousands of random ones can be.

use std::path::{Path, PathBuf};

use crate::layout::shaken;
use crate::programs::{Grammar, Random};
use crate::sentences::Sentences;
use crate::{check, formatted};

/// The `.imp` files of a folder, sorted.
fn files(folder: &str) -> Vec<(PathBuf, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let entries = std::fs::read_dir(folder).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    let mut paths: Vec<PathBuf> = paths
        .filter(|path| path.extension().is_some_and(|extension| extension == "imp"))
        .collect();
    paths.sort();
    assert!(!paths.is_empty());
    let read = |path: PathBuf| {
        let text = std::fs::read_to_string(&path).unwrap();
        (path, text)
    };
    paths.into_iter().map(read).collect()
}

/// The programs in the fences of a Markdown text.
fn fenced(text: &str) -> impl Iterator<Item = String> {
    let blocks = text.split("```imp\n").skip(1);
    blocks.map(|block| block.split("```").next().unwrap().to_owned())
}

fn documents() -> Vec<String> {
    let texts = [
        include_str!("../../README.md"),
        include_str!("../../docs/guide.md"),
    ];
    texts.into_iter().flat_map(fenced).collect()
}

#[test]
fn the_programs_of_this_project_are_formatted() {
    for (path, text) in files("examples").into_iter().chain(files("src/library")) {
        assert!(
            formatted(&text) == text,
            "`imp fmt {}` changes it",
            path.display()
        );
    }
    let documents = documents();
    assert!(documents.len() > 10);
    for text in documents {
        assert_eq!(formatted(&text), text);
    }
}

#[test]
fn the_layout_of_a_program_has_no_meaning() {
    let mut random = Random(1);
    let files = ["examples", "src/library", "tests/fuzz_corpus"];
    let texts = files.into_iter().flat_map(files_of);
    for text in texts.chain(documents()) {
        if check(&text) {
            for _ in 0..5 {
                assert!(check(&shaken(&mut random, &text)));
            }
        }
    }
}

fn files_of(folder: &str) -> Vec<String> {
    files(folder).into_iter().map(|(_, text)| text).collect()
}

#[test]
fn ten_thousand_random_programs_keep_their_meaning() {
    let mut random = Random(0);
    let (mut well, mut comments) = (0, 0);
    for round in 0..10_000 {
        let text = match round % 2 {
            0 => Grammar::new(&mut random).program(),
            _ => Sentences::new(&mut random).program(),
        };
        assert!(check(&text) || round % 2 == 0, "{text}");
        let text = shaken(&mut random, &text);
        well += usize::from(check(&text));
        comments += text.matches('#').count();
    }
    assert!(well > 9_900 && comments > 10_000, "{well}, {comments}");
}
