//! The command line: one file a command.
//!
//! Data goes to standard output, everything else to standard error. Commands return an exit
//! code: 0 well, 1 the script is wrong or an assertion failed, 2 usage, 3 input or output, 4 no
//! surface found. There is no algorithm here: a command opens a file (`workspace`), asks the
//! language for values, and shows them.

mod arguments;
mod check;
mod dump;
mod eval;
mod info;
mod make;
mod output;
mod progress;
mod run;
mod workspace;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::{CommandFactory, Parser};

use arguments::{Arguments, Command};

/// Exit code for wrong usage.
const USAGE: u8 = 2;

/// Runs the program with the process's arguments.
pub fn main() -> ExitCode {
    let words = with_default_command(std::env::args_os().collect());
    if words.len() < 2 {
        // Showing the help is the answer to a missing command, but not a success.
        output::error_text(&Arguments::command().render_help().to_string());
        return ExitCode::from(USAGE);
    }
    let arguments = match Arguments::try_parse_from(words) {
        Ok(arguments) => arguments,
        Err(error) => {
            let code = if error.use_stderr() { USAGE } else { 0 };
            // Nothing is left to be done when even this cannot be printed.
            let _ = error.print();
            return ExitCode::from(code);
        }
    };
    let code = match arguments.command {
        Command::Run(command) => run::run(&command),
        Command::Check(command) => check::check(&command),
        Command::Eval(command) => eval::eval(&command),
        Command::Mesh(command) => make::mesh(&command),
        Command::Sample(command) => make::sample(&command),
        Command::Info(command) => info::info(&command),
        Command::Dump(command) => dump::dump(&command),
    };
    ExitCode::from(code)
}

/// `imp FILE` is `imp run FILE`.
fn with_default_command(mut words: Vec<OsString>) -> Vec<OsString> {
    let first = words.get(1).and_then(|word| word.to_str());
    let is_file = first.is_some_and(|word| {
        let is_command = Arguments::command()
            .get_subcommands()
            .any(|command| command.get_name() == word);
        word == "-"
            || (!word.starts_with('-') && !is_command && word != "help" && word.contains('.'))
    });
    if is_file {
        words.insert(1, "run".into());
    }
    words
}
