//! Why a cell could not be proven.

use glam::{DMat3, DVec3};

use super::super::octree::Node;
use super::cells::Frame;
use super::enclosing;
use crate::engine::{CompiledField, Field};
use crate::graph::Interval;

/// Why a proof failed in a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Cause {
    /// F and F_x vanish together, or cannot be told from that.
    Singular,
    /// F has a kink, or cannot be told from that: its gradients differ too much in small cells.
    Kink,
    /// F may be undefined.
    Undefined,
    /// F may jump.
    Jump,
    /// The gradient is not bounded.
    Steep,
    /// The level set may touch the box without crossing it, or meet one of its edges or corners.
    Border,
    /// The cells are used up.
    Budget,
}

impl Cause {
    /// In words, after "because".
    pub fn words(self) -> &'static str {
        match self {
            Cause::Singular => {
                "F and its gradient vanish together there, or nearly: the level set may be singular"
            }
            Cause::Kink => {
                "the gradient of F jumps or turns too fast there: the level set may have an edge or a corner"
            }
            Cause::Undefined => "F may be undefined there",
            Cause::Jump => "F may jump there",
            Cause::Steep => "the gradient of F is not bounded there",
            Cause::Border => {
                "the level set may touch a side of the box there, or run through an edge or a corner of it"
            }
            Cause::Budget => "the limit of cells was reached before anything could be proven there",
        }
    }
}

/// How often the search for a singular point steps.
const STEPS: usize = 24;

/// How much smaller than the cell the box is in which F and F_x must be undecided still.
const PROBE: f64 = 1.0 / 4096.0;

/// Whether F − iso and F_x vanish together in or near a cell, as far as enclosures over a box of a
/// 4096th of its size tell: then dividing it twelve times more would not help.
pub(super) fn is_singular(field: &CompiledField, frame: &Frame, iso: f64, node: &Node) -> bool {
    let sides = frame.sides(node);
    let part = |pick: fn(Interval) -> f64| DVec3::from_array(sides.map(pick));
    let centre = part(|side| 0.5 * (side.low + side.high));
    let diagonal = part(|side| side.high - side.low).length();
    let Some(point) = critical_point(field, frame.dimension, centre, 2.5 * diagonal) else {
        return false;
    };
    let around = |axis: usize| {
        let side = sides[axis].high - sides[axis].low;
        let radius = (side * PROBE).max(4.0 * f64::EPSILON * point[axis].abs());
        Interval::new(point[axis] - radius, point[axis] + radius)
    };
    let near = [0, 1, 2].map(around);
    let (value, slopes) = enclosing::gradients(field, &[near])[0];
    let slopes = slopes.iter().take(frame.dimension);
    value.range.contains(iso) && slopes.into_iter().all(|slope| slope.contains(0.0))
}

/// The point that Newton's method for F_x = 0 reaches from `start`, if it stays within `radius`.
/// Where F_xx is singular, it takes the shortest step, nearly.
fn critical_point(
    field: &CompiledField,
    dimension: usize,
    start: DVec3,
    radius: f64,
) -> Option<DVec3> {
    let mut point = start;
    for _ in 0..STEPS {
        let (gradient, hessian) = derivatives(field, dimension, point);
        let square = hessian * hessian;
        let size = (0..3)
            .map(|axis| square.col(axis)[axis])
            .fold(0.0, f64::max);
        let damped = square + DMat3::from_diagonal(DVec3::splat(1e-12 * size));
        if !(size > 0.0 && size.is_finite()) {
            break;
        }
        let step = damped.inverse() * (hessian * gradient);
        if !step.is_finite() {
            break;
        }
        point -= step;
        if point.distance(start) > 4.0 * radius {
            return None;
        }
        if step.length() <= 1e-14 * radius {
            break;
        }
    }
    (point.distance(start) <= radius).then_some(point)
}

/// F_x and F_xx. What belongs to axes that are not there is 0.
fn derivatives(field: &CompiledField, dimension: usize, point: DVec3) -> (DVec3, DMat3) {
    let coordinates = point.to_array().map(|coordinate| [coordinate]);
    let columns = coordinates.each_ref().map(|column| &column[..]);
    let mut value = [0.0];
    let mut first = [[0.0]; 3];
    let mut second = [[0.0]; 6];
    field.hessians(
        &columns[..dimension],
        &mut value,
        &mut first.each_mut().map(|column| &mut column[..])[..dimension],
        &mut second.each_mut().map(|column| &mut column[..])[..dimension * (dimension + 1) / 2],
    );
    let mut matrix = DMat3::ZERO;
    let pairs = (0..dimension).flat_map(|row| (row..dimension).map(move |column| (row, column)));
    for ((row, column), entry) in pairs.zip(second) {
        matrix.col_mut(column)[row] = entry[0];
        matrix.col_mut(row)[column] = entry[0];
    }
    (DVec3::from_array(first.map(|column| column[0])), matrix)
}

/// The critical point near a place if there is one, else the place; and |F − iso| and |F_x| there.
pub(super) fn settled(
    field: &CompiledField,
    dimension: usize,
    iso: f64,
    place: DVec3,
    radius: f64,
) -> (DVec3, [f64; 2]) {
    let values = |point: DVec3| {
        let (value, gradient) = field.value_gradient(point);
        // Scaled, so that squares neither overflow nor vanish.
        let scale = gradient.abs().max_element();
        let length = match scale > 0.0 && scale.is_finite() {
            true => scale * (gradient / scale).length(),
            false => scale,
        };
        [(value - iso).abs(), length]
    };
    let here = values(place);
    match critical_point(field, dimension, place, 2.0 * radius) {
        Some(point) if values(point)[0] <= here[0] => (point, values(point)),
        _ => (place, here),
    }
}
