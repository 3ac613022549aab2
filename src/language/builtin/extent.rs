//! Boxes found for fields that come without one.

use super::surfaces::field_argument;
use super::{Arguments, Builtin, action};
use crate::diagnostic::{Code, Diagnostic};
use crate::engine::{CompiledField, Extent, Field, Monitor, extent};
use crate::geometry::Bounds;
use crate::graph::Interval;
use crate::language::FieldValue;
use crate::language::function::At;
use crate::language::session::Session;
use crate::language::value::{Outcome, Value, failure};
use std::sync::atomic::{AtomicUsize, Ordering};

pub(super) const TABLE: &[Builtin] = &[action(
    "bounds",
    &["f"],
    "A box that provably holds the whole zero set of a field, as a list of one interval for each axis; an error if the set is empty, unbounded, or nothing can be proven. What a field's `over` says does not count.",
    |session, arguments| {
        let field = field_argument(session, arguments, None)?;
        let compiled = field
            .compiled(&mut session.graph, session.parameters.values())
            .at(arguments.place("f"), "this field")?;
        let sides = sides(&compiled, arguments, &session.monitor())?;
        Ok(Value::list(
            sides.into_iter().map(Value::Interval).collect(),
        ))
    },
)];

/// A box is at least so long: its inverse is far from overflow.
const SMALLEST: f64 = 1e-300;

/// A box around the set on which the field has this value, a little larger than the one that is proven, so that nothing lies in
/// its faces, and with round numbers for ends.
pub(super) fn found_bounds(
    field: &CompiledField,
    iso: f64,
    arguments: &Arguments,
    monitor: &dyn Monitor,
) -> Outcome<Bounds> {
    let sides = match iso == 0.0 {
        true => sides(field, arguments, monitor)?,
        false => sides(&field.minus(iso), arguments, monitor)?,
    };
    rounded(&sides).ok_or_else(|| no_box(arguments, "no finite box holds it"))
}

/// How much a search for a box may cost that nobody asked for: batches of enclosures times nodes of
/// the field.
const SMALL_EFFORT: usize = 1_000_000;

/// Someone who wants an end after so many questions.
struct Budget<'a> {
    left: AtomicUsize,
    monitor: &'a dyn Monitor,
}

impl Monitor for Budget<'_> {
    fn progress(&self, phase: &str, fraction: f64) {
        self.monitor.progress(phase, fraction);
    }

    fn cancelled(&self) -> bool {
        let take = |left: usize| left.checked_sub(1);
        let taken = self
            .left
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, take);
        taken.is_err() || self.monitor.cancelled()
    }
}

impl Session {
    /// A box around the zero set of a field, as functions without `bounds` find it, if that is
    /// proven with little work: the same work on every machine.
    pub fn box_at_hand(&mut self, field: &FieldValue) -> Option<Bounds> {
        let compiled = field.compiled(&mut self.graph, self.parameters.values());
        let compiled = compiled.ok()?;
        let budget = Budget {
            left: AtomicUsize::new(SMALL_EFFORT / compiled.program().size().max(1)),
            monitor: &self.monitor(),
        };
        match extent(&compiled, &budget) {
            Some(Extent::Within(sides)) => rounded(&sides),
            _ => None,
        }
    }
}

/// The box with these sides, enlarged and with round numbers for ends.
fn rounded(sides: &[Interval]) -> Option<Bounds> {
    let lengths = sides.iter().map(|side| side.high - side.low);
    let longest = lengths.fold(SMALLEST, f64::max);
    // Ends are multiples of a power of ten between 1/1000 and 1/100 of the box. Its inverse is what
    // is kept: a decimal divided by it is rounded once.
    let mut per_unit = 1.0;
    while longest * per_unit < 100.0 {
        per_unit *= 10.0;
    }
    while longest * per_unit >= 1000.0 {
        per_unit /= 10.0;
    }
    let margin = longest / 50.0;
    let sides: Vec<(f64, f64)> = sides
        .iter()
        .map(|side| {
            (
                ((side.low - margin) * per_unit).floor() / per_unit,
                ((side.high + margin) * per_unit).ceil() / per_unit,
            )
        })
        .collect();
    Bounds::from_sides(&sides)
}

/// The proven sides.
fn sides(
    field: &CompiledField,
    arguments: &Arguments,
    monitor: &dyn Monitor,
) -> Outcome<Vec<Interval>> {
    let Some(extent) = extent(field, monitor) else {
        let message = "the search for a box was cancelled";
        return Err(failure(Code::Cancelled, message).at(arguments.place("f"), "of this field"));
    };
    match extent {
        Extent::Within(sides) => Ok(sides),
        Extent::Empty => {
            let message = "the field has no zero anywhere, which was proven by intervals";
            let mut error =
                failure(Code::NoSurface, message).at(arguments.place("f"), "no zero set");
            error.help = Some(match sign(field) {
                Some(-1) => "it is negative (inside) at the origin".into(),
                _ => "it is not negative (inside) at the origin".into(),
            });
            Err(error)
        }
        Extent::Unbounded => Err(no_box(
            arguments,
            "it goes to infinity, since the field has both signs at all large distances",
        )),
        // A sign nearby says only that the set is there.
        Extent::Unknown { reach } if reach > 1000.0 => Err(no_box(
            arguments,
            &format!("the field still changes its sign at a distance of {reach}"),
        )),
        Extent::Unknown { .. } => Err(no_box(
            arguments,
            "intervals could not prove that the field has no zero outside of some box",
        )),
    }
}

/// The sign at the origin.
fn sign(field: &CompiledField) -> Option<i32> {
    let value = field.value(glam::DVec3::ZERO);
    value.partial_cmp(&0.0).map(|ordering| ordering as i32)
}

/// Without a box nobody knows where to look.
fn no_box(arguments: &Arguments, why: &str) -> Box<Diagnostic> {
    let message = format!("no box was found for the zero set of this field: {why}");
    let mut error =
        failure(Code::NoBounds, message).at(arguments.place("f"), "a field without `over`");
    error.help = Some(
        "write `field name(…) over -2..2 = …`, or give `bounds = -2..2` (or one interval for each \
         axis, `bounds = [-2..2, -2..2, 0..1]`)"
            .into(),
    );
    error
}
