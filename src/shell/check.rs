//! `imp check`

use serde_json::json;

use super::arguments::Check;
use super::output;
use super::workspace::Workspace;
use crate::language::Mode;

/// Checks files; the gravest exit code. With `--json` the first error ends it, since there is
/// one object.
pub(super) fn check(command: &Check) -> u8 {
    let mut gravest = 0;
    for file in &command.files {
        let checked = Workspace::open(Some(file), &command.common, Mode::Check)
            .and_then(|mut workspace| workspace.run());
        match checked {
            Ok(()) if !command.common.quiet && !command.common.json => {
                output::error_text(&format!("{}: no errors", file.display()));
            }
            Ok(()) => {}
            Err(code) if command.common.json => return code,
            Err(code) => gravest = gravest.max(code),
        }
    }
    if command.common.json {
        output::data(&json!({ "checked": command.files.len() }).to_string());
    }
    gravest
}
