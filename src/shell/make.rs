//! `imp mesh` and `imp sample`: the language's `polygonize` and `sample` with their arguments as
//! flags, and a file for the result.

use std::path::Path;

use serde_json::{Map, Value as Json};

use super::arguments::{Mesh, Sample, Subject};
use super::output;
use super::workspace::Workspace;
use crate::diagnostic::{Code, Diagnostic};
use crate::file;
use crate::language::builtin::file_failure;
use crate::language::json::json;
use crate::language::show::show;
use crate::language::{Mode, Value};

/// A flag that is an argument of the language's function: its name and the text of its value.
type Flag<'a> = (&'static str, Option<&'a str>);

/// Polygonizes a field; the exit code.
pub(super) fn mesh(command: &Mesh) -> u8 {
    let method = command.method.as_deref().map(quoted);
    let flags = [
        ("method", method.as_deref()),
        ("cell", command.cell.as_deref()),
        ("resolution", command.resolution.as_deref()),
        ("iso", command.iso.as_deref()),
        ("cap", command.cap.then_some("true")),
    ];
    make("polygonize", &command.subject, &flags, &command.common)
}

/// Samples a field; the exit code.
pub(super) fn sample(command: &Sample) -> u8 {
    let method = command.method.as_deref().map(quoted);
    let flags = [
        ("method", method.as_deref()),
        ("count", command.count.as_deref()),
        ("seed", command.seed.as_deref()),
        ("friction", command.friction.as_deref()),
    ];
    make("sample", &command.subject, &flags, &command.common)
}

/// A word as a string of the language.
fn quoted(word: &str) -> String {
    let escaped = word
        .replace('\\', "\\\\")
        .replace('"', "\\\"")
        .replace('{', "{{")
        .replace('}', "}}");
    format!("\"{escaped}\"")
}

fn make(
    function: &str,
    subject: &Subject,
    flags: &[Flag<'_>],
    common: &super::arguments::Common,
) -> u8 {
    let made = attempt(function, subject, flags, common);
    match made {
        Ok(()) => 0,
        Err(code) => code,
    }
}

fn attempt(
    function: &str,
    subject: &Subject,
    flags: &[Flag<'_>],
    common: &super::arguments::Common,
) -> Result<(), u8> {
    let mut workspace = Workspace::open(Some(&subject.file), common, Mode::Define)?;
    if let Some(path) = &subject.output {
        // A name that no format knows is said before the work, not after it.
        file::Format::of_path(path).map_err(|error| workspace.fail(&[*file_failure(&error)]))?;
    }
    workspace.run()?;
    let field = workspace.field(subject.field.as_deref())?;
    let both = [
        ("bounds", subject.bounds.as_deref()),
        ("tolerance", subject.tolerance.as_deref()),
    ];
    let mut options = Vec::new();
    for (name, text) in flags.iter().chain(&both) {
        if let Some(text) = text {
            let value = workspace.parse(&format!("<--{name}>"), text)?;
            options.push((*name, value));
        }
    }
    let value = workspace
        .session
        .call(function, Value::Field(field), &options)
        .map_err(|errors| workspace.fail(&errors))?;
    if let Some(path) = &subject.output {
        write(&workspace, path, &value)?;
    }
    if common.json {
        output::data(&object(&workspace, subject, &value).to_string());
    } else {
        output::data(&show(&value, None));
    }
    Ok(())
}

fn write(workspace: &Workspace, path: &Path, value: &Value) -> Result<(), u8> {
    let result = match value {
        Value::Mesh(set) => file::write_mesh(path, &set.mesh),
        Value::Curves(set) => file::write_curves(path, &set.curves),
        Value::Samples(set) => file::write_samples(path, &set.samples),
        other => {
            let message = format!("{} cannot be written to a file", other.kind());
            return Err(
                workspace.fail(&[Diagnostic::error(Code::WrongFormat, message)
                    .help("leave out `-o`: the roots are printed")]),
            );
        }
    };
    result.map_err(|error| workspace.fail(&[*file_failure(&error)]))
}

fn object(workspace: &Workspace, subject: &Subject, value: &Value) -> Json {
    let mut object = Map::new();
    if let Some(path) = &subject.output {
        object.insert("output".into(), path.display().to_string().into());
    }
    match json(value) {
        Json::Object(properties) => object.extend(properties),
        roots => drop(object.insert("roots".into(), roots)),
    }
    workspace.finish_json(&mut object);
    Json::Object(object)
}
