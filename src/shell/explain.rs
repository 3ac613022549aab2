//! `imp explain`

use serde_json::{Map, Value as Json};

use super::arguments::{Explain, MessageFormat};
use super::output;
use crate::diagnostic::{Code, Diagnostic, Severity, Sources, suggest};

/// Says what a code means, or lists all codes; fails with an exit code.
pub(super) fn explain(command: &Explain) -> Result<(), u8> {
    let Some(word) = &command.code else {
        output::data(&match command.json {
            true => Json::from_iter([("codes", list_json())]).to_string(),
            false => list(),
        });
        return Ok(());
    };
    let Some(code) = Code::named(word) else {
        let error = unknown(word);
        match command.json {
            true => output::error_json(&error, &Sources::default()),
            false => {
                let sources = Sources::default();
                output::messages_as(MessageFormat::Human, &[error], &sources, false);
            }
        }
        return Err(Code::Usage.exit_code());
    };
    output::data(&match command.json {
        true => Json::Object(object(code, true)).to_string(),
        false => format!(
            "{}: {}\n\n{}",
            code.as_str(),
            code.title(),
            code.page().trim_end()
        ),
    });
    Ok(())
}

fn unknown(word: &str) -> Diagnostic {
    let capitals = word.to_uppercase();
    let names = Code::ALL.iter().map(|code| code.as_str());
    let error = Diagnostic::error(Code::Usage, format!("there is no code `{word}`"));
    error.help(match suggest::nearest(&capitals, names) {
        Some(near) => format!("did you mean `{near}`? `imp explain` lists all codes"),
        None => "`imp explain` lists all codes".into(),
    })
}

fn list() -> String {
    let lines = Code::ALL
        .iter()
        .map(|code| format!("{}  {}", code.as_str(), code.title()));
    lines.collect::<Vec<_>>().join("\n")
}

fn list_json() -> Json {
    let codes = Code::ALL.iter();
    codes
        .map(|&code| Json::Object(object(code, false)))
        .collect()
}

fn object(code: Code, with_page: bool) -> Map<String, Json> {
    let mut object = Map::new();
    object.insert("code".into(), code.as_str().into());
    let severity = match code.severity() {
        Severity::Error => "error",
        Severity::Warning => "warning",
    };
    object.insert("severity".into(), severity.into());
    object.insert("title".into(), code.title().into());
    if with_page {
        object.insert("page".into(), code.page().into());
    }
    object
}
