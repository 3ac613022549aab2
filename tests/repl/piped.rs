//! What comes through a pipe.

use std::io::{BufRead, BufReader, Write};
use std::process::Stdio;

use crate::common::{imp_with, program};

fn piped(words: &[&str], text: &[u8]) -> crate::common::Run {
    let folder = tempfile::tempdir().unwrap();
    imp_with(folder.path(), words, text)
}

#[test]
fn values_are_data_and_nothing_else_is_written() {
    for words in [&[][..], &["repl"]] {
        let run = piped(words, b"2^10\nlet a = [\n1,\n2]\nprint(a.x)\na\n").well();
        assert_eq!(run.stdout, "1024\n1\n[1, 2]\n");
        assert_eq!(run.stderr, "");
    }
    // What is written over several lines is one input.
    let script = b"fn g(x) = x + 1\nfn f(x) = g(x)\n\nf(1)\nif true {\n  print(\"a\")\n} else {\n  print(\"b\")\n}";
    assert_eq!(piped(&[], script).well().stdout, "2\na\n");
}

#[test]
fn each_input_is_run_and_taken_back_alone() {
    let run = piped(&[], b"print(1)\nnosuch\nprint(2)\n");
    assert_eq!((run.code, run.stdout.as_str()), (1, "1\n"));
    assert!(run.stderr.contains("<stdin>:2:1"), "{}", run.stderr);
    let run = piped(&[], b"let a = 1\nlet b = 2\n:undo\na\nb\n");
    assert_eq!((run.code, run.stdout.as_str()), (1, "1\n"));
    assert!(run.stderr.contains("`b`"), "{}", run.stderr);
}

#[test]
fn an_answer_comes_before_the_next_input() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = program(folder.path())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let mut answers = BufReader::new(child.stdout.take().unwrap()).lines();
    for number in 1..4 {
        writeln!(stdin, "{number} + {number}").unwrap();
        assert_eq!(answers.next().unwrap().unwrap(), (2 * number).to_string());
    }
    drop(stdin);
    assert_eq!(child.wait().unwrap().code(), Some(0));
}

#[test]
fn what_keeps_a_last_value_is_not_defined_again() {
    let run = piped(&[], b"2 + 3\nlet q = ans\nlet ans1 = 9\n");
    assert_eq!(run.code, 1);
    assert!(
        run.stderr.contains("keeps an earlier value"),
        "{}",
        run.stderr
    );
    let run = piped(&[], b"let ans1 = 9\n2 + 3\nlet q = ans\nq + ans1\n").well();
    assert_eq!(run.stdout, "5\n14\n");
}

#[test]
fn the_first_error_ends_it() {
    let run = piped(&[], b"1 + 1\n:list\nlet a = 1\nprint(a)\nb\nprint(2)\n");
    assert_eq!(run.code, 1);
    assert_eq!(run.stdout, "2\nnothing is defined yet\n1\n");
    assert!(run.stderr.contains("<stdin>:5:1"), "{}", run.stderr);
    let run = piped(&[], b"print(1)\nassert(1 > 2)\nprint(2)\n");
    assert_eq!((run.code, run.stdout.as_str()), (1, "1\n"));
    let run = piped(&[], b"let = 1\n");
    assert_eq!((run.code, run.stdout.as_str()), (1, ""));
}

#[test]
fn nothing_at_all_is_wrong_usage() {
    let run = piped(&[], b"");
    assert_eq!(run.code, 2);
    assert!(
        run.stdout.is_empty() && run.stderr.contains("Usage"),
        "{}",
        run.stderr
    );
    assert_eq!(piped(&["repl"], b"").code, 0);
    assert_eq!(piped(&[], b"\n\n").code, 0);
}

#[test]
fn bytes_that_are_no_text_are_an_error() {
    let run = piped(&[], b"1 + 1\n\xff\xfe\n");
    assert_eq!(run.code, 3, "{}", run.stderr);
    assert!(
        run.stderr.contains("not UTF-8 text: byte 6"),
        "{}",
        run.stderr
    );
    let run = piped(&[], b"1 \x07\x1b[31m + 1\n");
    assert_eq!(run.code, 1);
    assert!(
        !run.stderr.contains('\x07') && !run.stderr.contains("\x1b[31m"),
        "{:?}",
        run.stderr
    );
    let run = piped(&[], b":\x07bell\x1b[31m\n");
    assert_eq!(run.code, 1);
    assert!(
        !run.stderr.contains('\x07') && !run.stderr.contains('\x1b'),
        "{:?}",
        run.stderr
    );
}

#[test]
fn a_file_comes_first_and_values_can_be_set() {
    let folder = tempfile::tempdir().unwrap();
    let file = "param r = 1 in 0..5\nlet twice = 2*r\nprint(\"left out\")\n";
    std::fs::write(folder.path().join("a.imp"), file).unwrap();
    let words = ["repl", "a.imp", "--set", "r=3"];
    let run = imp_with(folder.path(), &words, b"twice\n:set r=4\ntwice\n").well();
    assert_eq!(run.stdout, "6\n8\n");
    let run = imp_with(folder.path(), &["repl", "--set", "r=3"], b"1\n");
    assert!(
        run.code == 1 && run.stderr.contains("no parameter or setting `r`"),
        "{}",
        run.stderr
    );
}

#[test]
fn a_reader_that_goes_away_is_no_error() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = program(folder.path())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let mut stdin = child.stdin.take().unwrap();
    // It may end before it has read all.
    let _ = stdin.write_all("1 + 1\n".repeat(100).as_bytes());
    drop(stdin);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stderr.is_empty());
}

#[test]
fn a_megabyte_of_lines_is_run() {
    let line = "print(\"a line that is not very long but long enough\")\n";
    let count = 1_000_000 / line.len();
    let run = piped(&[], line.repeat(count).as_bytes()).well();
    assert_eq!(run.stdout.lines().count(), count);
    let brackets = piped(&[], "(".repeat(1_000_000).as_bytes());
    assert_eq!(brackets.code, 1);
}
