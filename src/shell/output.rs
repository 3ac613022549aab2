//! Text for people and programs: standard output, standard error, JSON, exit codes.

use std::io::{self, IsTerminal, Write};
use std::sync::{Mutex, MutexGuard};
use std::time::Instant;

use serde_json::{Map, Value as Json};

use super::arguments::{Color, Common, MessageFormat};
use crate::diagnostic::render::{render, short};
use crate::diagnostic::{Code, Diagnostic, Severity, Sources, Span};
use crate::engine::compilations;

/// What has become of standard output.
enum StandardOutput {
    Open,
    /// The reader has gone away, as `head` does: nobody wants more, and that is no error.
    Abandoned,
    Failed(io::Error),
}

/// There is one standard output, so there is one record of it.
static STANDARD_OUTPUT: Mutex<StandardOutput> = Mutex::new(StandardOutput::Open);

fn standard_output() -> MutexGuard<'static, StandardOutput> {
    // A thread that panicked while it held this left a whole value behind.
    STANDARD_OUTPUT
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Writes data and a line's end to standard output. After a failure nothing more is written, but
/// the work goes on: files are still to be written and assertions to be checked. The failure is
/// told by [`finish`].
pub(super) fn data(text: &str) {
    data_as_it_is(&format!("{text}\n"));
}

/// Writes data that has its own line ends to standard output, as [`data`] does.
pub(super) fn data_as_it_is(text: &str) {
    print(|| {
        let mut stdout = io::stdout().lock();
        stdout.write_all(text.as_bytes())?;
        stdout.flush()
    });
}

/// Prints to standard output with `write`, unless that has failed before, and keeps its failure.
pub(super) fn print(write: impl FnOnce() -> io::Result<()>) {
    let mut state = standard_output();
    if !matches!(*state, StandardOutput::Open) {
        return;
    }
    if let Err(error) = write() {
        *state = match error.kind() {
            io::ErrorKind::BrokenPipe => StandardOutput::Abandoned,
            _ => StandardOutput::Failed(error),
        };
    }
}

/// The program's exit code, after a command that ended with `code`: what could not be printed
/// spoils a success.
pub(super) fn finish(code: u8, format: MessageFormat) -> u8 {
    match &*standard_output() {
        StandardOutput::Failed(error) => {
            let message = format!("cannot write to standard output: {error}");
            let error = Diagnostic::error(Code::CannotWrite, message);
            messages_as(format, &[error], &Sources::default(), false);
            if code == 0 {
                Code::CannotWrite.exit_code()
            } else {
                code
            }
        }
        _ => code,
    }
}

/// A name as it is shown on one line: control characters could change what the terminal says.
pub(super) fn escaped(name: &str) -> String {
    let mut shown = String::with_capacity(name.len());
    for character in name.chars() {
        if character.is_control() {
            shown.extend(character.escape_default());
        } else {
            shown.push(character);
        }
    }
    shown
}

/// Writes a message to standard error; there is nowhere to report that this failed.
pub(super) fn error_text(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{}", text.trim_end());
}

/// Whether there is room on standard error for what is not a diagnostic.
pub(super) fn takes_notes(common: &Common) -> bool {
    !common.quiet && !common.json && common.message_format != Some(MessageFormat::Json)
}

/// Writes what is good to know to standard error, where there is room for it.
pub(super) fn note(text: &str, common: &Common) {
    if takes_notes(common) {
        error_text(text);
    }
}

/// Writes diagnostics to standard error in the form that was asked for; where the result is to be
/// one JSON object, only if a form was asked for.
pub(super) fn messages(diagnostics: &[Diagnostic], sources: &Sources, common: &Common) {
    let format = match common.message_format {
        Some(format) => format,
        None if common.json => return,
        None => MessageFormat::Human,
    };
    messages_as(format, diagnostics, sources, colored(common));
}

/// Writes diagnostics to standard error.
pub(super) fn messages_as(
    format: MessageFormat,
    diagnostics: &[Diagnostic],
    sources: &Sources,
    color: bool,
) {
    match format {
        MessageFormat::Human => {
            let advised = diagnostics.iter().map(|diagnostic| {
                let advice = diagnostic.advice();
                diagnostic.clone().help(advice)
            });
            let advised: Vec<Diagnostic> = advised.collect();
            error_text(&render(&advised, sources, color));
        }
        MessageFormat::Short => error_text(&short(diagnostics, sources)),
        MessageFormat::Json => {
            for diagnostic in diagnostics {
                error_text(&message_object(diagnostic, sources).to_string());
            }
        }
    }
}

/// Whether messages are coloured: as asked, else never with `NO_COLOR`, always with
/// `CLICOLOR_FORCE`, else if a person reads them at a terminal that is not dumb.
pub(super) fn colored(common: &Common) -> bool {
    match common.color {
        Color::Always => true,
        Color::Never => false,
        Color::Auto => {
            let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
            let forced = is_set("CLICOLOR_FORCE")
                && std::env::var_os("CLICOLOR_FORCE").is_some_and(|value| value != "0");
            let is_dumb = std::env::var_os("TERM").is_some_and(|value| value == "dumb");
            !is_set("NO_COLOR") && (forced || (io::stderr().is_terminal() && !is_dumb))
        }
    }
}

/// Reports what ended a command and gives its exit code. With `--json` the first error is the
/// one object on standard output.
pub(super) fn report(errors: &[Diagnostic], sources: &Sources, common: &Common) -> u8 {
    if common.json
        && let Some(error) = errors.first()
    {
        error_json(error, sources);
    }
    messages(errors, sources, common);
    // The gravest code counts: what cannot be read matters more than what it says.
    errors
        .iter()
        .map(|error| error.code.exit_code())
        .max()
        .unwrap_or(1)
}

/// Prints an error as the one JSON object on standard output.
pub(super) fn error_json(error: &Diagnostic, sources: &Sources) {
    let mut object = Map::new();
    object.insert("error".into(), error_object(error, sources));
    data(&Json::Object(object).to_string());
}

/// A diagnostic with all its places, as one line of `--message-format json`.
fn message_object(diagnostic: &Diagnostic, sources: &Sources) -> Json {
    let severity = match diagnostic.severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
    };
    let mut object = Map::new();
    object.insert("severity".into(), severity.into());
    if let Json::Object(rest) = error_object(diagnostic, sources) {
        object.extend(rest);
    }
    let labels = diagnostic.labels.iter().map(|label| {
        let mut object = place(label.span, sources);
        let (line, column) = sources.position(label.span.source, label.span.end);
        object.insert("end_line".into(), line.into());
        object.insert("end_column".into(), column.into());
        object.insert("message".into(), label.message.clone().into());
        Json::Object(object)
    });
    object.insert("labels".into(), labels.collect());
    Json::Object(object)
}

/// Where a span begins.
fn place(span: Span, sources: &Sources) -> Map<String, Json> {
    let (line, column) = sources.position(span.source, span.start);
    let mut object = Map::new();
    object.insert("file".into(), sources.get(span.source).name.clone().into());
    object.insert("line".into(), line.into());
    object.insert("column".into(), column.into());
    object
}

/// An error as JSON: code, message, place and help.
pub(super) fn error_object(error: &Diagnostic, sources: &Sources) -> Json {
    let mut object = Map::new();
    object.insert("code".into(), error.code.as_str().into());
    object.insert("message".into(), error.message.clone().into());
    if let Some(span) = error.span() {
        object.extend(place(span, sources));
    }
    object.insert("help".into(), error.advice().into());
    Json::Object(object)
}

/// The ends of every JSON object: compilations, time, warnings.
pub(super) fn finish_json(object: &mut Map<String, Json>, begun: Instant, warnings: &[Diagnostic]) {
    object.insert("compilations".into(), compilations().into());
    object.insert("seconds".into(), begun.elapsed().as_secs_f64().into());
    let warnings = warnings
        .iter()
        .map(|warning| Json::String(format!("{}: {}", warning.code.as_str(), warning.message)))
        .collect();
    object.insert("warnings".into(), warnings);
}
