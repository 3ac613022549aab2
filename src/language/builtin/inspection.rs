//! What is unusual about a field, as functions of the language.

use glam::DVec3;

use super::surfaces::{box_of, compiled_argument};
use super::{Arguments, Builtin, action};
use crate::diagnostic::Code;
use crate::inspect::{Report, inspect};
use crate::language::function::At;
use crate::language::inspection;
use crate::language::session::Session;
use crate::language::value::{Outcome, Value, failure};

pub(super) const TABLE: &[Builtin] = &[
    action(
        "check",
        &["f", "bounds ="],
        "Warns of what is unusual about a field on its box: a constant, no number anywhere, an inside that surrounds the outside, singular points; true if there is nothing.",
        |session, arguments| {
            let (report, dimension) = report(session, arguments)?;
            for warning in inspection::warnings(&report, dimension, arguments.place("f")) {
                session.host.warn(warning);
            }
            Ok(Value::Bool(report.is_clean()))
        },
    ),
    action(
        "singularities",
        &["f", "bounds ="],
        "The points of the zero set in a box at which the gradient vanishes, as the tip of a cone; of curves and surfaces of such points, some that lie close together. The box is `bounds`, or what `over` says.",
        |session, arguments| {
            let (report, dimension) = report(session, arguments)?;
            let points = report.points.iter().chain(report.sets.iter().flatten());
            let coordinates =
                |point: &DVec3| Value::numbers(point.to_array().into_iter().take(dimension));
            Ok(Value::list(points.map(coordinates).collect()))
        },
    ),
];

fn report(session: &mut Session, arguments: &Arguments) -> Outcome<(Report, usize)> {
    let (field, bounds) = compiled_argument(session, arguments)?;
    let bounds = box_of(&field, 0.0, bounds, arguments, &session.monitor())?;
    inspect(&field, &bounds, &session.monitor())
        .map(|report| (report, bounds.dimension))
        .map_err(|error| failure(Code::Cancelled, error.to_string()).at(arguments.span, "here"))
}
