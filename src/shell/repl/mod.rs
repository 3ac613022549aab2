//! `imp repl`: a session in which what is typed is run at once.
//!
//! `session` holds what has been entered and takes in more; `echo` says what came of it; `commands`
//! is the table of what begins with `:`; `editor` and `helper` read lines at a terminal (rustyline is
//! known to this folder only); `screen`, `cells` and `graphics` show pictures there. What comes
//! through a pipe (`inputs`) is run as if it were typed, without a greeting, up to the first error.

mod answer;
mod cells;
mod commands;
mod echo;
mod editor;
mod fields;
mod files;
mod graphics;
mod helper;
mod history;
mod inputs;
mod keyboard;
mod pictures;
mod screen;
mod session;

use std::io::{self, BufRead, IsTerminal};

use super::arguments;
use super::output::{self, report};
use crate::diagnostic::Sources;
use editor::Editor;
use inputs::Inputs;
use keyboard::Keyboard;
use screen::Screen;
use session::{After, Repl};

/// Whether there is anything to read: a person at a terminal, or something in a pipe or file.
pub(super) fn has_input() -> bool {
    if io::stdin().is_terminal() {
        return true;
    }
    // What cannot be read is reported by whoever reads all of it.
    let mut stdin = io::stdin().lock();
    stdin.fill_buf().map_or(true, |bytes| !bytes.is_empty())
}

/// Holds a session; fails with an exit code.
pub(super) fn repl(command: &arguments::Repl) -> Result<(), u8> {
    let common = &command.common;
    let is_typed = io::stdin().is_terminal() && io::stdout().is_terminal();
    let screen = match is_typed {
        true => Screen::of_terminal(common),
        false => Screen::without_terminal(),
    };
    let mut repl = Repl::new(common, screen, is_typed)?;
    if is_typed && repl.screen.has_editor {
        let _keyboard = Keyboard::waiting();
        super::interrupt::caught(|| converse(&mut repl, command))
    } else if is_typed {
        super::interrupt::caught(|| converse(&mut repl, command))
    } else {
        begin(&mut repl, command)?;
        run_piped(&mut repl)
    }
}

/// Loads the file, if one is named, and sets what is to be set.
fn begin(repl: &mut Repl, command: &arguments::Repl) -> Result<(), u8> {
    match &command.file {
        Some(file) => repl.load(file),
        None => {
            let settings = repl.common.set.clone();
            let mut settings = settings.iter();
            settings.try_for_each(|set| commands::set_value(repl, &set.name, &set.text))
        }
    }
}

/// Reads what a person types, until they have enough.
fn converse(repl: &mut Repl, command: &arguments::Repl) -> Result<(), u8> {
    let common = &command.common;
    let mut editor = Editor::new(repl, common)
        .map_err(|error| report(&[*error], &Sources::default(), common))?;
    output::note(
        &format!(
            "Imp {} · :help lists the commands, :quit ends",
            env!("CARGO_PKG_VERSION")
        ),
        common,
    );
    editor.open_history();
    repl.find_graphics(&mut editor);
    // What is wrong with it has been said; the session begins without it.
    let _ = super::interrupt::caught(|| begin(repl, command));
    loop {
        editor.learn(repl);
        match editor.read() {
            Ok(Some(text)) => {
                editor.remember(&text);
                // What is wrong has been said, and the session is as it was.
                let result = super::interrupt::caught(|| repl.take(&text));
                if matches!(result, Ok(After::End)) {
                    return Ok(());
                }
            }
            Ok(None) => return Ok(()),
            Err(error) => {
                return Err(report(&[*error], &Sources::default(), common));
            }
        }
    }
}

/// Runs what comes through standard input: commands, and statements as soon as they are whole.
fn run_piped(repl: &mut Repl) -> Result<(), u8> {
    let mut inputs = Inputs::new(io::stdin().lock());
    loop {
        match inputs.next_input() {
            Ok(Some((lines_before, text))) => {
                repl.lines_before = lines_before;
                if let After::End = repl.take(&text)? {
                    return Ok(());
                }
            }
            Ok(None) => return Ok(()),
            Err(error) => return Err(report(&[*error], &Sources::default(), &repl.common)),
        }
    }
}
