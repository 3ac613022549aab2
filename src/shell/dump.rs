//! `imp dump`

use super::arguments::Dump;
use super::output;
use super::workspace::Workspace;
use crate::language::Mode;

/// Prints an intermediate form of a field; the exit code.
pub(super) fn dump(command: &Dump) -> u8 {
    match attempt(command) {
        Ok(()) => 0,
        Err(code) => code,
    }
}

fn attempt(command: &Dump) -> Result<(), u8> {
    let mut workspace = Workspace::open(Some(&command.file), &command.common, Mode::Define)?;
    workspace.run()?;
    let field = workspace.field(command.field.as_deref())?;
    let program = field.program(workspace.session.graph());
    let program = program.map_err(|error| workspace.fail(&[*error]))?;
    let text = if command.form.graph {
        program.graph_text()
    } else {
        program.clif()
    };
    output::data(text.trim_end());
    Ok(())
}
