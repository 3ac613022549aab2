//! `imp eval`

use std::path::Path;

use serde_json::{Map, Value as Json};

use super::arguments::Eval;
use super::output::{self, report};
use super::workspace::Workspace;
use crate::diagnostic::{Code, Diagnostic, Sources};
use crate::language::json::json;
use crate::language::show::show;
use crate::language::{Mode, Value};

/// Prints the values of expressions; fails with an exit code.
pub(super) fn eval(command: &Eval) -> Result<(), u8> {
    let (file, expressions) = split(&command.words);
    if expressions.is_empty() {
        let error = Diagnostic::error(Code::Usage, "an expression is needed after the file")
            .help("for more information, try `imp eval --help`");
        return Err(report(&[error], &Sources::default(), &command.common));
    }
    let mut workspace = Workspace::open(file, &command.common, Mode::Define)?;
    workspace.run()?;
    let mut values = Vec::new();
    for (index, text) in expressions.iter().enumerate() {
        let origin = match expressions.len() {
            1 => "<expression>".to_string(),
            _ => format!("<expression {}>", index + 1),
        };
        let value = workspace.evaluate(&origin, text)?;
        if !command.common.json && !matches!(value, Value::Nothing) {
            output::data(&show(&value, None));
        }
        values.push(value);
    }
    if command.common.json {
        output::data(&object(&workspace, &values).to_string());
    }
    Ok(())
}

fn object(workspace: &Workspace, values: &[Value]) -> Json {
    let mut object = Map::new();
    match values {
        [Value::Nothing] => {}
        [value] => drop(object.insert("value".into(), json(value))),
        values => drop(object.insert("values".into(), values.iter().map(json).collect())),
    }
    let printed = workspace.heard.printed.borrow();
    if !printed.is_empty() {
        object.insert("printed".into(), printed.iter().cloned().collect());
    }
    workspace.finish_json(&mut object);
    Json::Object(object)
}

/// The file, if the first word is one by its name, and the expressions: what `5` means does not
/// depend on what lies in the folder.
fn split(words: &[String]) -> (Option<&Path>, &[String]) {
    match words.split_first() {
        Some((first, rest)) if first == "-" || first.ends_with(".imp") => {
            (Some(Path::new(first)), rest)
        }
        _ => (None, words),
    }
}
