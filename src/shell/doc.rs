//! `imp doc`

use serde_json::json;

use super::arguments::Doc;
use super::output;
use crate::diagnostic::suggest::nearest;
use crate::diagnostic::{Code, Diagnostic, Sources};
use crate::language::reference;

/// Prints the reference, or what it says of a name; fails with an exit code.
pub(super) fn doc(command: &Doc) -> Result<(), u8> {
    let Some(name) = &command.name else {
        match command.common.json {
            true => output::data(&json!({ "reference": reference::reference() }).to_string()),
            false => output::data(reference::reference().trim_end()),
        }
        return Ok(());
    };
    let Some(text) = reference::about(name) else {
        let names = reference::names();
        let message = format!("there is no `{name}` in the language or its library");
        let mut error = Diagnostic::error(Code::UnknownName, message);
        if let Some(other) = nearest(name, names.iter().map(String::as_str)) {
            error = error.help(format!("did you mean `{other}`?"));
        }
        return Err(output::report(
            &[error],
            &Sources::default(),
            &command.common,
        ));
    };
    match command.common.json {
        true => output::data(&json!({ "name": name, "text": text }).to_string()),
        false => output::data(text.trim_end()),
    }
    Ok(())
}
