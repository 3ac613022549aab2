//! What becomes of cells that were halved as often as is allowed and are still not settled.
//!
//! Around each group of such cells a box is drawn that holds no other, so that the curve passes
//! through its border only where cells are settled. If it is proven that every component of the
//! curve in the box reaches that border, all of them are known, however they look inside. For the
//! zero set Z of a function in the plane, suppose that a component K of it in the box B does not.
//! Then there is a closed curve J around K in the inside of B on which F is not 0, say F > 0
//! (Whyburn, "Analytic Topology", chapter VI, theorem 3.1); for F < 0 the same holds for -F.
//!
//! * *Monotone.* If the derivative of F along one direction has one sign in B (it may vanish, and
//!   stand for all generalised derivatives of a kink), then from a point of K one way along that
//!   direction leads through F ≤ 0 up to the border of B. But it crosses J.
//! * *Saddle.* If det F_xx < 0 in B, then F has no minimum inside of J, where det F_xx ≥ 0 in one.
//!   But on J F is positive, and on K it is 0.
//!
//! The first decides at corners at which the curve goes on, the second where two branches cross at
//! an angle. Isolated points, cusps, ends and crossings of more than two branches stay undecided,
//! and so do the curves in space, and what lies at the border of the whole box.

use glam::DVec3;

use super::proof::{Cell, enclose};
use super::system::System;
use crate::engine::CompiledField;
use crate::geometry::Bounds;
use crate::graph::Interval;
use crate::graph::interval::{Enclosure, Regularity};
use crate::math::scalar;

/// Boxes are larger than the cells in them by this part of a cell, on each side.
const MARGIN: f64 = 0.25;

/// Of more cells, which are left where the search was given up, none is decided.
const MOST: usize = 1 << 12;

/// Directions in a half circle along which F may be monotonous.
const DIRECTIONS: u32 = 8;

/// Cells that are near each other, in one box.
struct Group {
    hull: Cell,
    cells: Vec<Cell>,
}

/// The cells in which a component of the curve may have been missed, of those that were left.
pub(super) fn undecided(
    system: &System,
    fields: &[&CompiledField],
    bounds: &Bounds,
    left: Vec<Cell>,
) -> Vec<Cell> {
    let &[field] = fields else {
        return left;
    };
    if left.is_empty() || left.len() > MOST {
        return left;
    }
    let inside = |hull: &Cell| {
        (0..system.dimension)
            .all(|axis| bounds.min[axis] < hull.low[axis] && hull.high[axis] < bounds.max[axis])
    };
    let mut undecided = Vec::new();
    let mut open: Vec<Group> = Vec::new();
    for group in groups(&left) {
        match inside(&group.hull) {
            true => open.push(group),
            false => undecided.extend(group.cells),
        }
    }
    let hulls: Vec<Cell> = open.iter().map(|group| group.hull).collect();
    let monotone = enclose(system, fields, &hulls);
    let mut monotone = monotone.iter().map(|known| is_monotone(&known.tangent));
    open.retain(|_| monotone.next() != Some(true));
    let mut saddle = saddles(system, field, &open).into_iter();
    open.retain(|_| saddle.next() != Some(true));
    undecided.extend(open.into_iter().flat_map(|group| group.cells));
    undecided
}

/// Cells in boxes that have no point in common, in the order of their last cells.
fn groups(cells: &[Cell]) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for &cell in cells {
        let mut merged = Group {
            hull: cell.scaled(1.0 + 2.0 * MARGIN),
            cells: vec![cell],
        };
        loop {
            let before = groups.len();
            let hull = merged.hull;
            let (near, far): (Vec<Group>, Vec<Group>) = groups
                .into_iter()
                .partition(|group| touch(&group.hull, &hull));
            groups = far;
            for group in near {
                merged.hull.low = merged.hull.low.min(group.hull.low);
                merged.hull.high = merged.hull.high.max(group.hull.high);
                merged.cells.extend(group.cells);
            }
            if groups.len() == before {
                break;
            }
        }
        groups.push(merged);
    }
    groups
}

/// Whether two boxes have a point in common.
fn touch(one: &Cell, other: &Cell) -> bool {
    one.low.cmple(other.high).all() && other.low.cmple(one.high).all()
}

/// Whether F is monotonous along some direction, by what encloses the direction of the curve, which
/// is F_x turned by a right angle.
fn is_monotone(tangent: &[Interval; 3]) -> bool {
    (0..DIRECTIONS).any(|number| {
        let angle = std::f64::consts::PI * f64::from(number) / f64::from(DIRECTIONS);
        // Exact along the axes, where a derivative may just vanish.
        let direction = match number {
            0 => DVec3::X,
            _ if 2 * number == DIRECTIONS => DVec3::Y,
            _ => DVec3::new(scalar::cos(angle), scalar::sin(angle), 0.0),
        };
        let [along, across, _] = *tangent;
        let slope = match (direction.x, direction.y) {
            (_, 0.0) => along,
            (0.0, _) => across,
            (x, y) => along * Interval::point(x) + across * Interval::point(y),
        };
        // A product with 0 is rounded outward.
        slope.low >= -f64::MIN_POSITIVE || slope.high <= f64::MIN_POSITIVE
    })
}

/// Whether det F_xx < 0 in the boxes of groups.
fn saddles(system: &System, field: &CompiledField, groups: &[Group]) -> Vec<bool> {
    if groups.is_empty() {
        return Vec::new();
    }
    let sides = [0, 1].map(|axis| {
        let sides = groups.iter().map(|group| group.hull.side(axis));
        sides.collect::<Vec<Interval>>()
    });
    let sides = sides.each_ref().map(Vec::as_slice);
    let unknown = Enclosure {
        range: Interval::ENTIRE,
        regularity: Regularity::Partial,
    };
    let derivatives = field.derivatives();
    system.count((derivatives.len() * groups.len()) as u64);
    let rows: Vec<(Vec<Enclosure>, [Vec<Interval>; 2])> = derivatives
        .iter()
        .map(|derivative| {
            let mut values = vec![unknown; groups.len()];
            let mut slopes = [(); 2].map(|()| vec![Interval::ENTIRE; groups.len()]);
            let mut outputs = slopes.each_mut().map(Vec::as_mut_slice);
            derivative.enclose_gradients(&sides, &mut values, &mut outputs);
            (values, slopes)
        })
        .collect();
    let [first, second] = &rows[..] else {
        return vec![false; groups.len()];
    };
    let is_saddle = |place: usize| {
        let smooth = [first, second]
            .iter()
            .all(|(values, _)| values[place].regularity == Regularity::Continuous);
        // Both mixed derivatives are the same number, so their enclosures have it in common.
        let mixed = first.1[1][place].intersection(second.1[0][place]);
        let determinant = first.1[0][place] * second.1[1][place] - mixed * mixed;
        smooth && determinant.high < 0.0
    };
    (0..groups.len()).map(is_saddle).collect()
}
