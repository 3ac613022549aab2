//! `imp run`

use std::path::PathBuf;

use serde_json::{Map, Value as Json};

use super::arguments::Run;
use super::output;
use super::timings;
use super::watch::watch;
use super::workspace::Workspace;
use crate::language::Mode;
use crate::sample::Times;

/// Runs a script, once or whenever it is saved; fails with an exit code.
pub(super) fn run(command: &Run) -> Result<(), u8> {
    match command.watch {
        true => watch(command),
        false => run_once(command).0,
    }
}

/// Runs a script once; fails with an exit code. Gives the files that were read, too.
pub(super) fn run_once(command: &Run) -> (Result<(), u8>, Vec<PathBuf>) {
    let opened = Workspace::open(Some(&command.file), &command.common, Mode::Run);
    let mut workspace = match opened {
        Ok(workspace) => workspace,
        Err(code) => return (Err(code), Vec::new()),
    };
    let result = workspace.run();
    let read = workspace.heard.read.borrow().clone();
    if result.is_ok() && command.common.json {
        let mut object = Map::new();
        let printed = workspace.heard.printed.borrow();
        object.insert("printed".into(), printed.iter().cloned().collect());
        let written = workspace.heard.written.borrow();
        let paths = written.iter().map(|path| path.display().to_string());
        object.insert("written".into(), paths.collect());
        if command.timings {
            object.insert(
                "timings".into(),
                timings::json(&workspace, &Times::default()),
            );
        }
        workspace.finish_json(&mut object);
        output::data(&Json::Object(object).to_string());
    }
    if command.timings && !command.common.json {
        timings::tell(&workspace, &Times::default());
    }
    (result, read)
}
