//! Where the time of a run went: `imp run --timings`, `imp sample --timings`.

use std::time::Duration;

use serde_json::{Map, Value as Json};

use super::output;
use super::workspace::Workspace;
use crate::engine::{compilations, compiling};
use crate::sample::Times;

/// A part of the run.
struct Part {
    name: &'static str,
    /// How often it was done, where that can be counted.
    times: Option<u64>,
    time: Duration,
}

/// The parts of a run, in the order in which they began, and the whole. What is left of the whole
/// is evaluation. Machine code is made within the other parts, by several threads, so its time is
/// told beside them and not taken from them.
fn parts(workspace: &Workspace) -> (Vec<Part>, Duration) {
    let whole = workspace.begun.elapsed();
    let part = |name, times, time| Part { name, times, time };
    let functions = workspace.session.spent().iter();
    let functions: Vec<Part> = functions
        .map(|(name, spent)| part(name, Some(spent.calls), spent.time))
        .collect();
    let known: Duration = functions.iter().map(|part| part.time).sum();
    let evaluating = whole.saturating_sub(workspace.parsing + known);
    let mut parts = vec![
        part("parse", None, workspace.parsing),
        part("evaluate", None, evaluating),
    ];
    parts.extend(functions);
    parts.push(part("compile", Some(compilations()), compiling()));
    (parts, whole)
}

/// Tells the times on standard error, and those of the phases of a sampler.
pub(super) fn tell(workspace: &Workspace, phases: &Times) {
    let (parts, whole) = parts(workspace);
    let mut lines = String::new();
    let mut line = |name: &str, time: Duration, note: &str| {
        let text = format!("{name:<12}{:>10.6} s{note}", time.as_secs_f64());
        lines.push_str(text.trim_end());
        lines.push('\n');
    };
    for part in parts {
        let note = match part.times {
            Some(times) if part.name == "compile" => {
                format!("  {times} functions, within the others")
            }
            Some(times) => format!("  {times} times"),
            None => String::new(),
        };
        line(part.name, part.time, &note);
        if part.name == "sample" {
            for (phase, time) in &phases.0 {
                line(&format!("  {phase}"), *time, "");
            }
        }
    }
    line("total", whole, "");
    output::error_text(&lines);
}

/// The times in seconds, by name; those of the phases of a sampler are in `phases`.
pub(super) fn json(workspace: &Workspace, phases: &Times) -> Json {
    let (parts, whole) = parts(workspace);
    let mut object: Map<String, Json> = parts
        .iter()
        .map(|part| (part.name.to_owned(), part.time.as_secs_f64().into()))
        .collect();
    object.insert("total".into(), whole.as_secs_f64().into());
    let phase = |(name, time): &(String, Duration)| (name.clone(), time.as_secs_f64().into());
    let phases: Map<String, Json> = phases.0.iter().map(phase).collect();
    if !phases.is_empty() {
        object.insert("phases".into(), phases.into());
    }
    Json::Object(object)
}
