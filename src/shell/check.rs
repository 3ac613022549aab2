//! `imp check`

use std::path::Path;
use std::time::Instant;

use serde_json::{Map, Value as Json};

use super::arguments::Check;
use super::output::{self, escaped};
use super::workspace::{Workspace, source_name};
use crate::language::Mode;

/// Checks files; fails with the gravest exit code. With `--json` the first error ends it, since
/// there is one object.
pub(super) fn check(command: &Check) -> Result<(), u8> {
    let begun = Instant::now();
    let mut gravest = 0;
    let mut warnings = Vec::new();
    for file in &command.files {
        match check_file(file, command) {
            Ok(workspace) => {
                warnings.append(&mut workspace.heard.warnings.borrow_mut());
                let name = escaped(&source_name(file));
                output::note(&format!("{name}: no errors"), &command.common);
            }
            Err(code) if command.common.json => return Err(code),
            Err(code) => gravest = gravest.max(code),
        }
    }
    if command.common.json {
        let mut object = Map::new();
        object.insert("checked".into(), command.files.len().into());
        output::finish_json(&mut object, begun, &warnings);
        output::data(&Json::Object(object).to_string());
    }
    match gravest {
        0 => Ok(()),
        code => Err(code),
    }
}

fn check_file(file: &Path, command: &Check) -> Result<Workspace, u8> {
    let mut workspace = Workspace::open(Some(file), &command.common, Mode::Check)?;
    workspace.run()?;
    let inspected = workspace.session.inspect_fields(&workspace.tree);
    inspected.map_err(|error| workspace.fail(&[*error]))?;
    Ok(workspace)
}
