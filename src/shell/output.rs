//! Text for people and programs: standard output, standard error, JSON, exit codes.

use std::io::{self, IsTerminal, Write};

use serde_json::{Map, Value as Json};

use super::arguments::{Color, Common};
use crate::diagnostic::render::render;
use crate::diagnostic::{Diagnostic, Sources};

/// Writes data to standard output. When the reader has gone away there is nobody left to tell,
/// so the process ends quietly, as is the custom for a broken pipe.
pub(super) fn data(text: &str) {
    let mut stdout = io::stdout().lock();
    let written = stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.write_all(b"\n"))
        .and_then(|()| stdout.flush());
    if written.is_err() {
        std::process::exit(0);
    }
}

/// Writes a message to standard error; there is nowhere to report that this failed.
pub(super) fn error_text(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{}", text.trim_end());
}

/// Whether messages are coloured: as asked, else if a person reads them and `NO_COLOR` is unset.
pub(super) fn colored(common: &Common) -> bool {
    match common.color {
        Color::Always => true,
        Color::Never => false,
        Color::Auto => {
            let refused = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
            io::stderr().is_terminal() && !refused
        }
    }
}

/// Reports what ended a command and gives its exit code. With `--json` the first error is the
/// one object on standard output.
pub(super) fn report(errors: &[Diagnostic], sources: &Sources, common: &Common) -> u8 {
    if common.json
        && let Some(error) = errors.first()
    {
        let mut object = Map::new();
        object.insert("error".into(), error_object(error, sources));
        data(&Json::Object(object).to_string());
    } else {
        error_text(&render(errors, sources, colored(common)));
    }
    // The gravest code counts: what cannot be read matters more than what it says.
    errors
        .iter()
        .map(|error| error.code.exit_code())
        .max()
        .unwrap_or(1)
}

fn error_object(error: &Diagnostic, sources: &Sources) -> Json {
    let mut object = Map::new();
    object.insert("code".into(), error.code.as_str().into());
    object.insert("message".into(), error.message.clone().into());
    if let Some(span) = error.span() {
        let (line, column) = sources.position(span.source, span.start);
        object.insert("file".into(), sources.get(span.source).name.clone().into());
        object.insert("line".into(), line.into());
        object.insert("column".into(), column.into());
    }
    if let Some(help) = &error.help {
        object.insert("help".into(), help.clone().into());
    }
    Json::Object(object)
}

/// Warnings as a list of sentences.
pub(super) fn warnings_json(warnings: &[Diagnostic]) -> Json {
    warnings
        .iter()
        .map(|warning| Json::String(format!("{}: {}", warning.code.as_str(), warning.message)))
        .collect()
}
