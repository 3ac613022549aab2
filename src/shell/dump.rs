//! `imp dump`

use serde_json::{Map, Value as Json};

use super::arguments::Dump;
use super::output;
use super::workspace::Workspace;
use crate::language::Mode;

/// Prints an intermediate form of a field; fails with an exit code.
pub(super) fn dump(command: &Dump) -> Result<(), u8> {
    let mut workspace = Workspace::open(Some(&command.file), &command.common, Mode::Define)?;
    workspace.run()?;
    let field = workspace.field(command.field.as_deref())?;
    let program = field.program(workspace.session.graph());
    let program = program.map_err(|error| workspace.fail(&[*error]))?;
    let (form, text) = if command.form.graph {
        ("graph", program.graph_text())
    } else {
        ("clif", program.clif())
    };
    if command.common.json {
        let mut object = Map::new();
        object.insert(form.into(), text.into());
        workspace.finish_json(&mut object);
        output::data(&Json::Object(object).to_string());
    } else {
        output::data(text.trim_end());
    }
    Ok(())
}
