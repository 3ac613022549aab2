//! Running the program as people do.

// Each test program uses its own part of this.
#![allow(dead_code)]

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

/// What one run of the program left behind.
pub(crate) struct Run {
    /// The exit code.
    pub(crate) code: i32,
    /// Standard output.
    pub(crate) stdout: String,
    /// Standard error.
    pub(crate) stderr: String,
}

impl Run {
    /// Standard output as one JSON object.
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.stdout)
            .unwrap_or_else(|error| panic!("{error}: {}\n{}", self.stdout, self.stderr))
    }

    /// Fails unless the program ended well.
    pub(crate) fn well(self) -> Self {
        assert_eq!(self.code, 0, "{}\n{}", self.stdout, self.stderr);
        self
    }
}

/// Runs `imp` with these words in a directory.
pub(crate) fn imp_in(directory: &Path, words: &[&str]) -> Run {
    imp_with(directory, words, b"")
}

/// Runs `imp` with these words at the root of the package.
pub(crate) fn imp(words: &[&str]) -> Run {
    imp_in(Path::new(env!("CARGO_MANIFEST_DIR")), words)
}

/// The program in a directory, still without words.
pub(crate) fn program(directory: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_imp"));
    command.current_dir(directory).env("NO_COLOR", "1");
    command
}

/// Runs `imp` with these words and this standard input.
pub(crate) fn imp_with(directory: &Path, words: &[&str], input: &[u8]) -> Run {
    let mut child = program(directory)
        .args(words)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut stdin = child.stdin.take().expect("standard input is piped");
    let input = input.to_vec();
    let writer = std::thread::spawn(move || {
        // A program that ends early closes its input: that is its right.
        let _ = stdin.write_all(&input);
    });
    let output = child.wait_with_output().expect("the program ends");
    writer.join().expect("the writer ends");
    Run {
        code: output.status.code().unwrap_or(-1),
        stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
        stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

/// Runs a script given as text from standard input.
pub(crate) fn script(text: &str) -> Run {
    let directory = tempfile::tempdir().expect("a temporary directory");
    imp_with(directory.path(), &["run", "-"], text.as_bytes())
}
