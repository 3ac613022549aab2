//! Every code has a page, every wrong example gives exactly that code, and its repair none.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::rc::Rc;
use std::time::Instant;

use imp::diagnostic::{Code, Sources};
use imp::language::{Limits, Mode, Session};
use imp::syntax::parse;
use serde_json::json;
use tempfile::tempdir;

use crate::common::{imp, imp_with};
use crate::host::{Deadline, Listener};

/// A block of a page: what stands behind its first backquotes, and its lines.
struct Block {
    kind: String,
    text: String,
}

fn blocks(page: &str) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let mut inside = false;
    for line in page.lines() {
        match line.strip_prefix("```") {
            Some(_) if inside => inside = false,
            Some(kind) => {
                inside = true;
                let (kind, text) = (kind.to_string(), String::new());
                blocks.push(Block { kind, text });
            }
            None if inside => {
                let last = blocks.last_mut().unwrap();
                last.text += line;
                last.text.push('\n');
            }
            None => {}
        }
    }
    assert!(!inside, "{page}");
    blocks
}

/// The codes in lines such as `file:1:2: error[E0201]: …`.
fn codes(stderr: &str) -> BTreeSet<String> {
    let codes = stderr.lines().filter_map(|line| {
        let (_, rest) = line
            .split_once("error[")
            .or_else(|| line.split_once("warning["))?;
        Some(rest.split_once("]: ")?.0.to_string())
    });
    codes.collect()
}

/// The codes that a program from standard input gives.
fn of_program(text: &str) -> BTreeSet<String> {
    let folder = tempdir().unwrap();
    let words = ["run", "-", "--message-format", "short"];
    codes(&imp_with(folder.path(), &words, text.as_bytes()).stderr)
}

/// The codes that the last of some shell commands gives.
fn of_commands(text: &str) -> BTreeSet<String> {
    let folder = tempdir().unwrap();
    let program = PathBuf::from(env!("CARGO_BIN_EXE_imp"));
    let path = std::env::var_os("PATH").unwrap();
    let folders = program.parent().map(Path::to_owned).into_iter();
    let path = std::env::join_paths(folders.chain(std::env::split_paths(&path))).unwrap();
    let lines = text.lines().map(|line| {
        let command = line.strip_prefix("$ ").expect("a command line");
        match command.starts_with("imp ") {
            true => format!("{command} --message-format short\n"),
            false => format!("{command}\n"),
        }
    });
    let output = Command::new("sh")
        .args(["-c", &lines.collect::<String>()])
        .current_dir(folder.path())
        .env("PATH", path)
        .output()
        .unwrap();
    codes(&String::from_utf8_lossy(&output.stderr))
}

/// The codes that a program gives to somebody who cancels all work.
fn of_cancelled(text: &str) -> BTreeSet<String> {
    let folder = tempdir().unwrap();
    let mut sources = Sources::default();
    let id = sources.add("cancelled.imp", text);
    let listener = Listener {
        warnings: Rc::default(),
        deadline: Deadline(Instant::now()),
    };
    let place = folder.path().to_owned();
    let output = vec![place.clone()];
    let mut session = Session::new(
        Box::new(listener),
        Mode::Run,
        Limits::default(),
        place,
        output,
    );
    let errors = session.run(&parse(id, text).tree).unwrap_err();
    errors.iter().map(|e| e.code.as_str().to_string()).collect()
}

fn of_block(block: &Block) -> BTreeSet<String> {
    match block.kind.as_str() {
        "imp" => of_program(&block.text),
        "console" => of_commands(&block.text),
        "imp cancelled" => of_cancelled(&block.text),
        other => panic!("a block of kind {other}"),
    }
}

#[cfg(unix)]
#[test]
fn every_example_gives_its_code_and_every_repair_gives_none() {
    for &code in Code::ALL {
        let page = code.page();
        let text = page.split("Wrong:").next().unwrap().trim();
        assert!(text.len() > 80 && text.ends_with('.'), "{code:?}: {text}");
        let blocks = blocks(page);
        let [wrong, repaired] = blocks.as_slice() else {
            panic!("{code:?} has {} blocks", blocks.len());
        };
        // Without machine code: tests/engine_refusal.rs runs that, alone in its process.
        if code != Code::NoMachineCode {
            let expected = BTreeSet::from([code.as_str().to_string()]);
            assert_eq!(of_block(wrong), expected, "{}", wrong.text);
        }
        assert_eq!(of_block(repaired), BTreeSet::new(), "{}", repaired.text);
    }
}

#[test]
fn codes_are_in_order_and_unlike() {
    let names: Vec<&str> = Code::ALL.iter().map(|code| code.as_str()).collect();
    let key = |name: &str| name[1..].parse::<u32>().unwrap();
    assert!(names.windows(2).all(|pair| key(pair[0]) < key(pair[1])));
    // Nothing stands beside the pages of the table.
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/diagnostic/explain");
    let files = std::fs::read_dir(folder).unwrap();
    let mut files: Vec<String> = files
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    files.sort();
    let mut expected: Vec<String> = names.iter().map(|name| format!("{name}.md")).collect();
    expected.sort();
    assert_eq!(files, expected);
}

#[test]
fn the_command_explains_and_lists() {
    let page = imp(&["explain", "E0105"]).well().stdout;
    assert!(
        page.starts_with("E0105: multiplication without `*`\n\n"),
        "{page}"
    );
    assert!(page.contains("Repaired:"), "{page}");
    assert_eq!(imp(&["explain", "e0105"]).well().stdout, page);
    let list = imp(&["explain"]).well().stdout;
    assert_eq!(list.lines().count(), Code::ALL.len());
    assert!(list.contains("\nE0201  unknown name\n"), "{list}");
    let object = imp(&["explain", "W0808", "--json"]).well().json();
    assert_eq!(object["code"], json!("W0808"));
    assert_eq!(object["severity"], json!("warning"));
    assert!(object["page"].as_str().unwrap().contains("90deg"));
    let all = imp(&["explain", "--json"]).well().json();
    assert_eq!(all["codes"].as_array().unwrap().len(), Code::ALL.len());
    assert_eq!(all["codes"][0]["code"], json!("E0001"));
}

#[test]
fn an_unknown_code_is_wrong_usage_and_a_near_one_is_named() {
    let run = imp(&["explain", "E0150"]);
    assert_eq!((run.code, run.stdout.as_str()), (2, ""));
    assert!(run.stderr.contains("`E0150`"), "{}", run.stderr);
    assert!(
        run.stderr.contains("did you mean `E0105`"),
        "{}",
        run.stderr
    );
    let run = imp(&["explain", "nonsense", "--json"]);
    assert_eq!(run.code, 2);
    assert_eq!(run.json()["error"]["code"], json!("E0001"));
}
