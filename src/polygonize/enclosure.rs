//! Boxes in three colours: proven to be inside, proven to be outside, and those that the level set
//! may pass through (K. E. Hoff III, "Polygonization of implicit surfaces": interior, exterior and
//! boundary voxels of an octree, of which the boundary has O(1/h²)).

use glam::DVec3;

use crate::engine::CompiledField;
use crate::graph::Interval;
use crate::graph::interval::{Enclosure, Regularity};

/// What is known of a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Colour {
    /// F < iso everywhere.
    Interior,
    /// F ≥ iso, or undefined, everywhere.
    Exterior,
    /// Neither is proven.
    Boundary,
}

/// How much of the natural enclosure's width must separate the mean-value form from the level:
/// that form holds what F is exactly, but not what rounding makes of it, which is far less than
/// this.
const GAP: f64 = 1e-6;

/// The colours of boxes, given by their corners, and whether F is strictly monotone along an axis
/// in them: then the level set in the box is a graph over one of its sides.
pub(super) fn classify(
    field: &CompiledField,
    iso: f64,
    boxes: &[[DVec3; 2]],
) -> Vec<(Colour, bool)> {
    let mut found = vec![(Colour::Boundary, false); boxes.len()];
    let mut natural = vec![UNKNOWN; boxes.len()];
    let sides = columns(boxes.iter());
    field.enclose(&sides.each_ref().map(Vec::as_slice), &mut natural);
    for ((found, _), enclosure) in found.iter_mut().zip(&natural) {
        *found = colour(enclosure, iso, 0.0);
    }
    let open: Vec<usize> = (0..boxes.len())
        .filter(|&index| found[index].0 == Colour::Boundary)
        .collect();
    let sides = columns(open.iter().map(|&index| &boxes[index]));
    let mut values = vec![UNKNOWN; open.len()];
    let mut slopes = [const { Vec::new() }; 3];
    slopes
        .iter_mut()
        .for_each(|column| column.resize(open.len(), Interval::ENTIRE));
    field.enclose_gradients(
        &sides.each_ref().map(Vec::as_slice),
        &mut values,
        &mut slopes.each_mut().map(Vec::as_mut_slice),
    );
    for (place, &index) in open.iter().enumerate() {
        let width = natural[index].range.high - natural[index].range.low;
        let monotone = slopes.iter().any(|column| {
            let Interval { low, high } = column[place];
            low > 0.0 || high < 0.0
        });
        let smooth = values[place].regularity == Regularity::Continuous;
        found[index] = (colour(&values[place], iso, GAP * width), monotone && smooth);
    }
    found
}

/// An enclosure of which nothing is known.
const UNKNOWN: Enclosure = Enclosure {
    range: Interval::ENTIRE,
    regularity: Regularity::Partial,
};

/// The colour of a box with this enclosure, if it keeps this distance from the level. Where F may
/// be undefined nothing is proven of what is computed, unless it is undefined everywhere.
fn colour(enclosure: &Enclosure, iso: f64, gap: f64) -> Colour {
    let Interval { low, high } = enclosure.range;
    if enclosure.range.is_empty() {
        Colour::Exterior
    } else if enclosure.regularity < Regularity::Defined {
        Colour::Boundary
    } else if low >= iso && low - iso >= gap {
        Colour::Exterior
    } else if high < iso && iso - high >= gap {
        Colour::Interior
    } else {
        Colour::Boundary
    }
}

/// The sides of boxes, a column per axis.
fn columns<'a>(boxes: impl Iterator<Item = &'a [DVec3; 2]> + Clone) -> [Vec<Interval>; 3] {
    std::array::from_fn(|axis| {
        let side = |[low, high]: &[DVec3; 2]| Interval::new(low[axis], high[axis]);
        boxes.clone().map(side).collect()
    })
}
