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

/// Checks many texts; fails with the shortest that fails. Gives how many are programs.
fn check_all(texts: impl Iterator<Item = String>) -> usize {
    let results = texts.map(|text| check(&text));
    let (mut well, mut worst) = (0, None::<String>);
    for result in results {
        match result {
            Ok(is_program) => well += usize::from(is_program),
            Err(error) if worst.as_ref().is_none_or(|worst| error.len() < worst.len()) => {
                worst = Some(error);
            }
            Err(_) => {}
        }
    }
    assert!(worst.is_none(), "{}", worst.unwrap_or_default());
    well
}

#[test]
fn the_layout_of_a_program_has_no_meaning() {
    let mut random = Random(1);
    let folders = ["examples", "src/library", "tests/fuzz_corpus"];
    let files = folders.into_iter().flat_map(files).map(|(_, text)| text);
    let texts: Vec<String> = files.chain(documents()).collect();
    let well = check_all(texts.iter().cloned());
    assert!(well >= texts.len() - 3);
    let shaken = |text: &String| shaken(&mut random, text);
    let changed: Vec<String> = texts
        .iter()
        .cycle()
        .take(5 * texts.len())
        .map(shaken)
        .collect();
    assert_eq!(check_all(changed.into_iter()), 5 * well);
}

/// A random program and a random layout of it.
fn random_program(random: &mut Random, round: usize) -> String {
    let text = match round % 2 {
        0 => Grammar::new(random).program(),
        _ => Sentences::new(random).program(),
    };
    shaken(random, &text)
}

#[test]
fn ten_thousand_random_programs_keep_their_meaning() {
    std::thread::scope(|scope| {
        for seed in 0..4 {
            scope.spawn(move || {
                let mut random = Random(seed);
                let (mut well, mut comments, mut round) = (0, 0, 0);
                while well < 2_500 {
                    let texts = (0..100).map(|index| {
                        let text = random_program(&mut random, index);
                        comments += text.matches('#').count();
                        text
                    });
                    well += check_all(texts);
                    round += 100;
                }
                // Most parse, and comments are everywhere.
                assert!(round < 2_900 && comments > 5 * round, "{round}, {comments}");
            });
        }
    });
}
