//! What is unusual about a file's fields, as warnings.

use glam::DVec3;

use super::function::At;
use super::session::Session;
use super::show::show;
use super::value::{Outcome, Value, failure};
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::inspect::{Report, inspect};
use crate::syntax::tree::{StatementKind, Tree};

/// So many points are written out in a warning.
const POINTS_SHOWN: usize = 4;

impl Session {
    /// Inspects the fields of the file that are scalars and have a domain, and warns of what is
    /// unusual about them where they are defined.
    ///
    /// Fails where a field cannot be compiled, or if the work is cancelled.
    pub fn inspect_fields(&mut self, tree: &Tree) -> Outcome<()> {
        for statement in &tree.statements {
            let StatementKind::Field { name, .. } = &statement.kind else {
                continue;
            };
            let Some(field) = self.fields.get(&name.text).cloned() else {
                continue;
            };
            let (Some(bounds), false) = (field.domain(), matches!(field.body(), Value::List(_)))
            else {
                continue;
            };
            let compiled = field
                .compiled(&mut self.graph, self.parameters.values())
                .at(name.span, "this field")?;
            let report = inspect(&compiled, &bounds, &self.monitor())
                .map_err(|error| failure(Code::Cancelled, error.to_string()))
                .at(name.span, "this field")?;
            for warning in warnings(&report, bounds.dimension, name.span) {
                self.host.warn(warning);
            }
        }
        Ok(())
    }
}

/// The warnings that a report gives rise to, about the field at `span`.
pub(super) fn warnings(report: &Report, dimension: usize, span: Span) -> Vec<Diagnostic> {
    let mut warnings = Vec::new();
    let mut warn = |code, message: String, label: &str, help: &str| {
        warnings.push(
            Diagnostic::warning(code, message)
                .label(span, label)
                .help(help),
        );
    };
    if report.undefined {
        warn(
            Code::UndefinedField,
            "the field is not a number at any point of its box that was tried".into(),
            "nowhere a number",
            "look for square roots and logarithms of negative numbers, and for 0/0",
        );
    }
    if let Some(value) = report.constant {
        let value = show(&Value::Number(value), None);
        warn(
            Code::ConstantField,
            format!("the field is {value} everywhere in its box"),
            "constant",
            "its value should depend on the point: is a coordinate missing?",
        );
    }
    if report.inside_out {
        warn(
            Code::InsideOut,
            "the field is negative (inside) on the whole border of its box".into(),
            "its inside is the unbounded side",
            "change the sign of the field, or write `!f` for its complement",
        );
    }
    if let Some(message) = singular(report, dimension) {
        warn(
            Code::SingularPoints,
            message,
            "singular",
            "there is no normal there, and what is sampled or polygonized near it is less exact; \
             `singularities(f)` gives the points",
        );
    }
    warnings
}

/// The sentence about singular points, if there are any.
fn singular(report: &Report, dimension: usize) -> Option<String> {
    let mut parts = Vec::new();
    match report.points.len() {
        0 => {}
        1 => parts.push(format!("at {}", shown(&report.points[..1], dimension))),
        count => {
            let some = &report.points[..count.min(POINTS_SHOWN)];
            let more = if count > POINTS_SHOWN { ", …" } else { "" };
            parts.push(format!(
                "at {count} points, {}{more}",
                shown(some, dimension)
            ));
        }
    }
    let through: Vec<DVec3> = report
        .sets
        .iter()
        .filter_map(|set| set.first().copied())
        .collect();
    match through.as_slice() {
        [] => {}
        [one] => parts.push(format!("along a set through {}", shown(&[*one], dimension))),
        several => parts.push(format!(
            "along {} sets, one of them through {}",
            several.len(),
            shown(&several[..1], dimension)
        )),
    }
    if parts.is_empty() {
        return None;
    }
    let places = parts.join(" and ");
    Some(format!(
        "the gradient of the field vanishes on its zero set {places}"
    ))
}

/// Points with six digits each, which is more than enough to find them.
fn shown(points: &[DVec3], dimension: usize) -> String {
    let texts: Vec<String> = points
        .iter()
        .map(|point| {
            // Adding 0 takes the sign off a zero.
            let rounded = point
                .to_array()
                .map(|value| (value * 1e6).round() / 1e6 + 0.0);
            show(&Value::numbers(rounded.into_iter().take(dimension)), None)
        })
        .collect();
    texts.join(", ")
}
