//! What `docs/guide.md` shows works: every program in it runs without an error or a warning, and
//! every command succeeds. A console block sees the files that the blocks before it were named.

use std::fs;
use std::path::Path;

use crate::common::imp_in;

/// A block of code: its language, the file it is shown as, and its lines.
struct Block {
    language: String,
    file: Option<String>,
    text: String,
    line: usize,
}

/// The blocks of the guide. A line such as "`ball.imp`:" before a block names its file.
fn blocks(guide: &str) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let mut inside = false;
    let mut before = "";
    for (number, line) in guide.lines().enumerate() {
        match line.strip_prefix("```") {
            Some(_) if inside => inside = false,
            Some(language) => {
                inside = true;
                let name = before
                    .strip_prefix('`')
                    .and_then(|rest| rest.strip_suffix("`:"));
                blocks.push(Block {
                    language: language.to_string(),
                    file: name.map(str::to_string),
                    text: String::new(),
                    line: number + 1,
                });
            }
            None if inside => {
                let last = blocks.last_mut().unwrap();
                last.text += line;
                last.text.push('\n');
            }
            None if !line.is_empty() => before = line,
            None => {}
        }
    }
    blocks
}

/// Words of a shell command with double quotes.
fn words(command: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (index, part) in command.split('"').enumerate() {
        match index % 2 {
            0 => words.extend(part.split_whitespace().map(str::to_string)),
            _ => words.push(part.to_string()),
        }
    }
    words
}

#[test]
fn every_block_of_the_guide_works() {
    let folder = tempfile::tempdir().unwrap();
    let guide = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/guide.md");
    let blocks = blocks(&fs::read_to_string(guide).unwrap());
    let programs = blocks.iter().filter(|block| block.language == "imp");
    assert!(programs.count() >= 9);
    for block in blocks {
        match block.language.as_str() {
            "imp" => {
                let name = block.file.as_deref().unwrap_or("block.imp");
                fs::write(folder.path().join(name), &block.text).unwrap();
                let run = imp_in(folder.path(), &["run", name, "--message-format", "short"]);
                assert_eq!(run.code, 0, "line {}: {}", block.line, run.stderr);
                assert!(
                    !run.stderr.contains("warning"),
                    "line {}: {}",
                    block.line,
                    run.stderr
                );
                let expected = block
                    .text
                    .lines()
                    .filter_map(|line| line.split_once("# prints "));
                let printed: Vec<&str> = run.stdout.lines().collect();
                for (_, expected) in expected {
                    assert!(
                        printed.contains(&expected),
                        "line {}: {printed:?}",
                        block.line
                    );
                }
            }
            "console" => {
                for line in block.text.lines() {
                    let Some(command) = line.strip_prefix("$ imp ") else {
                        continue;
                    };
                    let words = words(command);
                    let words: Vec<&str> = words.iter().map(String::as_str).collect();
                    let run = imp_in(folder.path(), &words);
                    assert_eq!(run.code, 0, "line {}: {line}\n{}", block.line, run.stderr);
                }
            }
            other => panic!("line {}: a block of `{other}`", block.line),
        }
    }
}
