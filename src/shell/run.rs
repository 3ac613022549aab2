//! `imp run`

use serde_json::{Map, Value as Json};

use super::arguments::Run;
use super::output;
use super::workspace::Workspace;
use crate::language::Mode;

/// Runs a script; fails with an exit code.
pub(super) fn run(command: &Run) -> Result<(), u8> {
    let mut workspace = Workspace::open(Some(&command.file), &command.common, Mode::Run)?;
    workspace.run()?;
    if command.common.json {
        let mut object = Map::new();
        let printed = workspace.heard.printed.borrow();
        object.insert("printed".into(), printed.iter().cloned().collect());
        let written = workspace.heard.written.borrow();
        let paths = written.iter().map(|path| path.display().to_string());
        object.insert("written".into(), paths.collect());
        workspace.finish_json(&mut object);
        output::data(&Json::Object(object).to_string());
    }
    Ok(())
}
