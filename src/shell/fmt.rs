//! `imp fmt`

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::{Map, Value as Json};
use similar::TextDiff;

use super::arguments::Fmt;
use super::output::{self, escaped};
use super::workspace::{BYTE_ORDER_MARK, STANDARD_INPUT, read_whole, source_name};
use crate::diagnostic::{Code, Diagnostic, Sources};
use crate::file::write_text;
use crate::formatter::format;

/// Lines around a change that a difference shows.
const CONTEXT: usize = 3;

/// The exit code where a check finds files that are not formatted.
const NOT_FORMATTED: u8 = 1;

/// What formatting made of a file.
struct Formatted {
    name: String,
    before: String,
    after: String,
}

/// Formats files, or says which are not formatted; fails with the gravest exit code.
pub(super) fn fmt(command: &Fmt) -> Result<(), u8> {
    let begun = Instant::now();
    let mut gravest = 0;
    let (mut checked, mut changed) = (0, Vec::new());
    let files = sources(command)?;
    for file in &files {
        match format_file(file, command) {
            Ok(formatted) => {
                checked += 1;
                if formatted.before != formatted.after {
                    changed.push(formatted.name);
                }
            }
            Err(code) if command.common.json => return Err(code),
            Err(code) => gravest = gravest.max(code),
        }
    }
    if command.check && !changed.is_empty() {
        gravest = gravest.max(NOT_FORMATTED);
    }
    if command.common.json {
        let mut object = Map::new();
        object.insert("checked".into(), checked.into());
        object.insert("changed".into(), changed.into_iter().collect());
        output::finish_json(&mut object, begun, &[]);
        output::data(&Json::Object(object).to_string());
    }
    match gravest {
        0 => Ok(()),
        code => Err(code),
    }
}

/// The files that are meant, with those in folders, in order.
fn sources(command: &Fmt) -> Result<Vec<PathBuf>, u8> {
    let mut files = Vec::new();
    for path in &command.files {
        let found = match path.is_dir() {
            true => walk(path, &mut files),
            false => {
                files.push(path.clone());
                Ok(())
            }
        };
        found.map_err(|error| {
            let message = format!("cannot read `{}`: {error}", source_name(path));
            let error = Diagnostic::error(Code::CannotRead, message);
            output::report(&[error], &Sources::default(), &command.common)
        })?;
    }
    Ok(files)
}

/// Adds the `.imp` files in a folder and in those below it, by name; hidden folders and links to
/// folders are left out.
fn walk(folder: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    let mut pending = vec![folder.to_owned()];
    let first = files.len();
    while let Some(folder) = pending.pop() {
        for entry in fs::read_dir(folder)? {
            let entry = entry?;
            let path = entry.path();
            let hidden = entry.file_name().to_string_lossy().starts_with('.');
            if entry.file_type()?.is_dir() {
                if !hidden {
                    pending.push(path);
                }
            } else if path.extension().is_some_and(|extension| extension == "imp") {
                files.push(path);
            }
        }
    }
    files[first..].sort();
    Ok(())
}

/// Formats a file and does with it what was asked for.
fn format_file(file: &Path, command: &Fmt) -> Result<Formatted, u8> {
    let common = &command.common;
    let mut sources = Sources::default();
    let fail = |error: Diagnostic| output::report(&[error], &Sources::default(), common);
    let (name, before) = read_whole(file).map_err(fail)?;
    let text = before.strip_prefix(BYTE_ORDER_MARK).unwrap_or(&before);
    let id = sources.add(name.clone(), text);
    let after = format(id, text).map_err(|errors| output::report(&errors, &sources, common))?;
    let formatted = Formatted {
        name,
        before,
        after,
    };
    show(file, &formatted, command).map_err(fail)?;
    Ok(formatted)
}

/// Writes or shows what was formatted.
fn show(file: &Path, formatted: &Formatted, command: &Fmt) -> Result<(), Diagnostic> {
    let differs = formatted.before != formatted.after;
    let name = escaped(&formatted.name);
    if command.diff {
        if differs && !command.common.json {
            output::data_as_it_is(&difference(formatted));
        }
    } else if command.check {
        if differs && !command.common.json {
            output::data(&name);
        }
    } else if file == Path::new(STANDARD_INPUT) {
        if !command.common.json {
            output::data_as_it_is(&formatted.after);
        }
    } else if differs {
        write_text(file, &formatted.after)
            .map_err(|error| Diagnostic::error(Code::CannotWrite, error.to_string()))?;
        output::note(&format!("formatted {name}"), &command.common);
    }
    Ok(())
}

/// What formatting changes, as a unified difference.
fn difference(formatted: &Formatted) -> String {
    let name = escaped(&formatted.name);
    TextDiff::from_lines(&formatted.before, &formatted.after)
        .unified_diff()
        .context_radius(CONTEXT)
        .header(&name, &format!("{name} (formatted)"))
        .to_string()
}
