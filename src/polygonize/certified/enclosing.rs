//! What enclosures tell of boxes.

use super::doubts::Cause;
use crate::engine::CompiledField;
use crate::graph::Interval;
use crate::graph::interval::{Enclosure, Regularity};

/// How much of the natural enclosure's width must separate the mean-value form from the level.
/// The form holds what F is exactly, and the roundings of its evaluation are far less than this.
const GAP: f64 = 1e-6;

/// What is known of a box.
#[derive(Clone, Copy, Debug)]
pub(super) enum Known {
    /// There is no zero of F − iso in it.
    Decided {
        /// Whether F < iso everywhere.
        is_inside: bool,
    },
    /// F is continuous and Lipschitz in it, and these hold all its generalised gradients.
    Gradients([Interval; 3]),
    /// Nothing.
    Nothing(Cause),
}

/// An enclosure of which nothing is known.
pub(super) const UNKNOWN: Enclosure = Enclosure {
    range: Interval::ENTIRE,
    regularity: Regularity::Partial,
};

/// Judges boxes. Their enclosures do not depend on which others there are if there are at least two.
pub(super) fn judge(analysed: &Analysed, iso: f64, boxes: &[[Interval; 3]]) -> Vec<Known> {
    let field = analysed.field;
    let natural = values(field, boxes);
    let mut known: Vec<Option<Known>> = natural.iter().map(|own| decided(own, iso, 0.0)).collect();
    let open: Vec<usize> = (0..boxes.len())
        .filter(|&index| known[index].is_none())
        .collect();
    let some: Vec<[Interval; 3]> = open.iter().map(|&index| boxes[index]).collect();
    let found = gradients(field, &some);
    for (&index, (value, slopes)) in open.iter().zip(&found) {
        let width = natural[index].range.high - natural[index].range.low;
        let tightened = decided(value, iso, GAP * width);
        known[index] = Some(tightened.unwrap_or_else(|| lipschitz(field, value, slopes)));
    }
    let mut known: Vec<Known> = known.into_iter().flatten().collect();
    analysed.tighten(boxes, &mut known);
    known
}

/// A field with its derivatives as fields of their own.
pub(super) struct Analysed<'a> {
    pub(super) field: &'a CompiledField,
    derivatives: Vec<CompiledField>,
}

impl<'a> Analysed<'a> {
    /// Of this field.
    pub(super) fn new(field: &'a CompiledField) -> Self {
        Analysed {
            field,
            derivatives: field.derivatives(),
        }
    }

    /// Cuts enclosures of gradients by the mean-value form of each component. Where that is
    /// continuous it is the derivative of a Lipschitz function almost everywhere, and so everywhere.
    fn tighten(&self, boxes: &[[Interval; 3]], known: &mut [Known]) {
        let some: Vec<usize> = (0..boxes.len())
            .filter(|&index| matches!(known[index], Known::Gradients(_)))
            .collect();
        let sides: Vec<[Interval; 3]> = some.iter().map(|&index| boxes[index]).collect();
        for (axis, derivative) in self.derivatives.iter().enumerate() {
            let found = gradients(derivative, &sides);
            for (&index, (value, _)) in some.iter().zip(&found) {
                if let Known::Gradients(slopes) = &mut known[index]
                    && value.regularity == Regularity::Continuous
                {
                    let tighter = slopes[axis].intersection(value.range);
                    if is_bounded(&tighter) {
                        slopes[axis] = tighter;
                    }
                }
            }
        }
    }
}

/// Whether F is Lipschitz in a box, by its enclosures.
fn lipschitz(field: &CompiledField, value: &Enclosure, slopes: &[Interval; 3]) -> Known {
    let dimension = crate::engine::Field::dimension(field);
    match value.regularity {
        Regularity::Partial => Known::Nothing(Cause::Undefined),
        Regularity::Defined => Known::Nothing(Cause::Jump),
        Regularity::Continuous if slopes[..dimension].iter().all(is_bounded) => {
            Known::Gradients(*slopes)
        }
        Regularity::Continuous => Known::Nothing(Cause::Steep),
    }
}

/// Whether an interval holds numbers, and not all beyond some number.
pub(super) fn is_bounded(slope: &Interval) -> bool {
    f64::NEG_INFINITY < slope.low && slope.low <= slope.high && slope.high < f64::INFINITY
}

/// The sum of the lengths of a box's sides.
pub(super) fn width(slopes: &[Interval; 3]) -> f64 {
    slopes.iter().map(|slope| slope.high - slope.low).sum()
}

/// On which side of the level F is in a box with this enclosure, if it keeps this distance. Where F
/// is undefined it has no zero and counts as outside.
pub(super) fn decided(enclosure: &Enclosure, iso: f64, gap: f64) -> Option<Known> {
    let Interval { low, high } = enclosure.range;
    if enclosure.range.is_empty() || (low > iso && low - iso >= gap) {
        Some(Known::Decided { is_inside: false })
    } else if enclosure.regularity >= Regularity::Defined && high < iso && iso - high >= gap {
        Some(Known::Decided { is_inside: true })
    } else {
        None
    }
}

/// The natural enclosures of F over boxes.
pub(super) fn values(field: &CompiledField, boxes: &[[Interval; 3]]) -> Vec<Enclosure> {
    let sides = columns(boxes);
    let mut values = vec![UNKNOWN; boxes.len()];
    field.enclose(&sides.each_ref().map(Vec::as_slice), &mut values);
    values
}

/// The enclosures of F, also by the mean-value form, and of F_x. Components that are not there are 0.
pub(super) fn gradients(
    field: &CompiledField,
    boxes: &[[Interval; 3]],
) -> Vec<(Enclosure, [Interval; 3])> {
    let dimension = crate::engine::Field::dimension(field);
    let sides = columns(boxes);
    let mut values = vec![UNKNOWN; boxes.len()];
    let mut slopes = [const { Vec::new() }; 3];
    for (axis, column) in slopes.iter_mut().enumerate() {
        let start = if axis < dimension {
            Interval::ENTIRE
        } else {
            Interval::new(0.0, 0.0)
        };
        column.resize(boxes.len(), start);
    }
    field.enclose_gradients(
        &sides.each_ref().map(Vec::as_slice),
        &mut values,
        &mut slopes.each_mut().map(Vec::as_mut_slice),
    );
    let own = |index: usize| slopes.each_ref().map(|column| column[index]);
    values
        .into_iter()
        .enumerate()
        .map(|(index, value)| (value, own(index)))
        .collect()
}

/// The sides of boxes, a column per axis.
fn columns(boxes: &[[Interval; 3]]) -> [Vec<Interval>; 3] {
    std::array::from_fn(|axis| boxes.iter().map(|sides| sides[axis]).collect())
}
