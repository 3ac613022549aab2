//! `imp test`

use std::path::Path;
use std::time::Instant;

use serde_json::{Map, Value as Json};

use super::arguments::Test;
use super::output::{self, escaped};
use super::workspace::{Workspace, source_name};
use crate::diagnostic::Diagnostic;
use crate::language::Mode;

/// What became of the tests of all files.
#[derive(Default)]
struct Results {
    passed: usize,
    failed: usize,
    /// The gravest exit code of a file that could not be run.
    gravest: u8,
    tests: Vec<Json>,
    warnings: Vec<Diagnostic>,
}

/// Runs the tests of files; fails with the gravest exit code, 1 where a test failed.
pub(super) fn test(command: &Test) -> Result<(), u8> {
    let begun = Instant::now();
    let mut results = Results::default();
    for file in &command.files {
        match test_file(file, command, &mut results) {
            Ok(()) => {}
            // There is one object, and it is the error.
            Err(code) if command.common.json => return Err(code),
            Err(code) => results.gravest = results.gravest.max(code),
        }
    }
    if command.common.json {
        let mut object = Map::new();
        object.insert("tests".into(), results.tests.into());
        object.insert("passed".into(), results.passed.into());
        object.insert("failed".into(), results.failed.into());
        output::finish_json(&mut object, begun, &results.warnings);
        output::data(&Json::Object(object).to_string());
    } else {
        let all = results.passed + results.failed;
        output::data(&format!(
            "{all} test{}: {} passed, {} failed",
            if all == 1 { "" } else { "s" },
            results.passed,
            results.failed
        ));
    }
    match results.gravest.max(u8::from(results.failed > 0)) {
        0 => Ok(()),
        code => Err(code),
    }
}

/// Runs the tests of one file whose names contain what is asked for.
fn test_file(file: &Path, command: &Test, results: &mut Results) -> Result<(), u8> {
    let mut workspace = Workspace::open(Some(file), &command.common, Mode::Define)?;
    workspace.run()?;
    workspace.heard.gathers.set(true);
    let wanted = command.filter.as_deref().unwrap_or("");
    for test in workspace.session.tests() {
        if !test.name.contains(wanted) {
            continue;
        }
        let begun = Instant::now();
        workspace.heard.printed.borrow_mut().clear();
        let errors = workspace.session.run_test(&test).err();
        let printed = workspace.heard.printed.take();
        match errors {
            None => results.passed += 1,
            Some(_) => results.failed += 1,
        }
        if command.common.json {
            let mut object = Map::new();
            object.insert("file".into(), source_name(file).into());
            object.insert("name".into(), test.name.to_string().into());
            let sources = workspace.heard.sources.borrow();
            let (line, column) = sources.position(test.span.source, test.span.start);
            object.insert("line".into(), line.into());
            object.insert("column".into(), column.into());
            object.insert("passed".into(), errors.is_none().into());
            if let Some(error) = errors.as_ref().and_then(|errors| errors.first()) {
                object.insert("error".into(), output::error_object(error, &sources));
            }
            object.insert("printed".into(), printed.into_iter().collect());
            object.insert("seconds".into(), begun.elapsed().as_secs_f64().into());
            results.tests.push(Json::Object(object));
            continue;
        }
        let outcome = if errors.is_none() { "ok  " } else { "FAIL" };
        let name = escaped(&test.name);
        output::data(&format!(
            "{outcome} {}: {name}",
            escaped(&source_name(file))
        ));
        for line in printed {
            output::data(&format!("     {line}"));
        }
        if let Some(errors) = errors {
            workspace.fail(&errors);
        }
    }
    results
        .warnings
        .append(&mut workspace.heard.warnings.borrow_mut());
    Ok(())
}
