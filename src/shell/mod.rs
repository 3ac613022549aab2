//! The command line: one file a command.
//!
//! Data goes to standard output, everything else to standard error. Commands return an exit
//! code: 0 well, 1 the script is wrong or an assertion failed, 2 usage, 3 input or output, 4 no
//! surface found. There is no algorithm here: a command opens a file (`workspace`), asks the
//! language for values, and shows them.

mod arguments;
mod check;
mod completions;
mod doc;
mod dump;
mod eval;
mod explain;
mod fmt;
mod info;
mod interrupt;
mod lsp;
mod make;
mod man;
mod output;
mod progress;
mod render;
mod repl;
mod run;
mod test;
mod timings;
mod verify;
mod watch;
mod workspace;

use std::ffi::{OsStr, OsString};
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;

use clap::{ArgAction, CommandFactory, Parser, ValueEnum};

use crate::diagnostic::{Code, Diagnostic, Sources};
use crate::file;
use arguments::{Arguments, Command, Common, MessageFormat};
use output::report;

/// The exit code after an interrupt: 128 and the number of the signal, as shells have it.
const INTERRUPTED: i32 = 130;

/// Runs the program with the process's arguments.
pub fn main() -> ExitCode {
    handle_interrupts();
    let words = with_default_command(std::env::args_os().collect());
    let ended = if words.len() < 2 {
        without_words()
    } else {
        match Arguments::try_parse_from(&words) {
            Ok(arguments) => perform(&arguments.command),
            Err(error) => answer(&error, &words),
        }
    };
    ExitCode::from(output::finish(
        ended.err().unwrap_or(0),
        message_format(&words),
    ))
}

/// What the program does when it is told nothing: at a terminal a session begins, and what comes
/// through a pipe is run.
fn without_words() -> Result<(), u8> {
    let Ok(words) = Arguments::try_parse_from(["imp", "repl"]) else {
        return Err(Code::Usage.exit_code());
    };
    if let Command::Repl(command) = &words.command
        && repl::has_input()
    {
        start_threads(&command.common)?;
        return repl::repl(command);
    }
    // Showing the help is the answer to a missing command, but not a success.
    output::error_text(&Arguments::command().render_help().to_string());
    Err(Code::Usage.exit_code())
}

/// Lets an interrupt remove files that are written in part before it ends the program, unless it
/// only ends what a session computes. Where the
/// system has no interrupts there is nothing to do.
fn handle_interrupts() {
    let _ = ctrlc::set_handler(|| {
        if interrupt::note() {
            return;
        }
        let _nothing_is_written = file::abandon();
        std::process::exit(INTERRUPTED);
    });
}

/// The form of messages that the words ask for: needed where the command line as a whole is not
/// understood.
fn message_format(words: &[OsString]) -> MessageFormat {
    let name = "--message-format";
    let mut words = words.iter().take_while(|word| *word != "--");
    while let Some(word) = words.next() {
        let word = word.to_string_lossy();
        let value = match word.split_once('=') {
            _ if word == name => words
                .next()
                .map(|value| value.to_string_lossy().into_owned()),
            Some((option, value)) if option == name => Some(value.to_owned()),
            _ => None,
        };
        if let Some(value) = value {
            return MessageFormat::from_str(&value, true).unwrap_or(MessageFormat::Human);
        }
    }
    MessageFormat::Human
}

/// Performs a command, which has reported what is wrong when it fails with an exit code.
fn perform(command: &Command) -> Result<(), u8> {
    if let Some(common) = command.common() {
        start_threads(common)?;
    }
    match command {
        Command::Run(command) => run::run(command),
        Command::Check(command) => check::check(command),
        Command::Test(command) => test::test(command),
        Command::Eval(command) => eval::eval(command),
        Command::Mesh(command) => make::mesh(command),
        Command::Verify(command) => verify::verify(command),
        Command::Sample(command) => make::sample(command),
        Command::Render(command) => render::render(command),
        Command::Doc(command) => doc::doc(command),
        Command::Info(command) => info::info(command),
        Command::Dump(command) => dump::dump(command),
        Command::Repl(command) => repl::repl(command),
        Command::Explain(command) => explain::explain(command),
        Command::Lsp(command) => lsp::lsp(command),
        Command::Fmt(command) => fmt::fmt(command),
        Command::Watch(command) => watch::watch(command),
        Command::Completions(command) => {
            completions::completions(command);
            Ok(())
        }
        Command::Man(command) => man::man(command),
    }
}

/// Starts the threads that share the work; it can be done once in a process.
fn start_threads(common: &Common) -> Result<(), u8> {
    let threads = usize::from(common.threads);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    pool.build_global().map_err(|error| {
        let message = format!("cannot start the threads: {error}");
        let error =
            Diagnostic::error(Code::Usage, message).help("ask for fewer with `--threads N`");
        report(&[error], &Sources::default(), common)
    })
}

/// What clap has to say instead of a command: help, which was asked for, or wrong usage.
fn answer(error: &clap::Error, words: &[OsString]) -> Result<(), u8> {
    if !error.use_stderr() {
        output::print(|| error.print().and_then(|()| io::stdout().flush()));
        return Ok(());
    }
    let mut options = words.iter().take_while(|word| *word != "--");
    if options.any(|word| word == "--json") {
        output::error_json(&usage(error), &Sources::default());
    } else {
        match message_format(words) {
            // There is nowhere to report that this failed.
            MessageFormat::Human => drop(error.print()),
            format => {
                output::messages_as(format, &[usage(error)], &Sources::default(), false);
            }
        }
    }
    Err(Code::Usage.exit_code())
}

/// clap's text as an error: its first paragraph is the message, the others are help.
fn usage(error: &clap::Error) -> Diagnostic {
    let text = error.render().to_string();
    let (message, help) = text.split_once("\n\n").unwrap_or((&text, ""));
    let message = message.trim_start_matches("error: ");
    let words: Vec<&str> = message.split_whitespace().collect();
    let diagnostic = Diagnostic::error(Code::Usage, words.join(" "));
    match help.trim() {
        "" => diagnostic,
        help => diagnostic.help(help),
    }
}

/// `imp FILE` is `imp run FILE`, also where options come before the file.
fn with_default_command(mut words: Vec<OsString>) -> Vec<OsString> {
    if first_operand(&words).is_some_and(names_file) {
        words.insert(1, "run".into());
    }
    words
}

/// The first word that is neither an option of `run` nor the value of one.
fn first_operand(words: &[OsString]) -> Option<&OsStr> {
    let mut rest = words.iter().skip(1);
    while let Some(word) = rest.next() {
        match word.to_str() {
            Some("--") => return rest.next().map(OsString::as_os_str),
            Some(option) if option.starts_with('-') && option != workspace::STANDARD_INPUT => {
                if takes_next_word(option) {
                    rest.next();
                }
            }
            _ => return Some(word),
        }
    }
    None
}

/// Whether the value of this option of `run` is the next word.
fn takes_next_word(option: &str) -> bool {
    let Some(name) = option.strip_prefix("--") else {
        return false;
    };
    Arguments::command()
        .find_subcommand("run")
        .into_iter()
        .flat_map(clap::Command::get_arguments)
        .any(|argument| {
            argument.get_long() == Some(name)
                && matches!(argument.get_action(), ArgAction::Set | ArgAction::Append)
        })
}

/// Whether a word in the place of a command is a file. A name with a dot is one in any case, so
/// that a misspelt file is said to be missing and not to be an unknown command.
fn names_file(word: &OsStr) -> bool {
    let Some(text) = word.to_str() else {
        return true;
    };
    let is_command = text == "help"
        || Arguments::command()
            .get_subcommands()
            .any(|command| command.get_name() == text);
    let is_file = text == workspace::STANDARD_INPUT || text.contains('.');
    !is_command && (is_file || Path::new(text).exists())
}
