//! Whether the level set is flat in a cell.
//!
//! F is compared with its trilinear interpolant from the cell's corners at the other 19 points
//! that halving the cell's sides would make. Divided by |F_x| the difference is a length: how far
//! the level set is from where the interpolant puts it. That also bounds how much the normal
//! turns in the cell, about 8 times the length divided by the side, and makes cells small along
//! sharp edges, where the difference shrinks no faster than the cell.

use glam::DVec3;

use super::super::Job;
use super::super::simplices::Lattice;
use super::{Node, values_at};

/// In which of some nodes the level set is flat.
pub(super) struct Flat {
    pub(super) leaves: Vec<bool>,
    pub(super) evaluations: usize,
}

/// Points of a node at which F is evaluated: 0, 1 or 2 halves along each axis.
const POINTS: usize = 27;

/// Looks at every node.
pub(super) fn is_flat(job: &Job, lattice: &Lattice, nodes: &[Node]) -> Flat {
    let places = nodes
        .iter()
        .flat_map(|node| (0..POINTS).map(|number| node.at(halves(number))));
    let values = values_at(job, places, lattice);
    let error = job.options.error.unwrap_or(job.options.cell / 64.0);
    let (cells, _) = values.as_chunks::<POINTS>();
    let flat = |(node, values): (&Node, &[f64; POINTS])| {
        let sides = lattice.point(node.at([2; 3])) - lattice.point(node.low);
        is_one_flat_sheet(values, sides, error)
    };
    Flat {
        leaves: nodes.iter().zip(cells).map(flat).collect(),
        evaluations: values.len(),
    }
}

/// The place of a point in a node.
fn halves(number: usize) -> [u32; 3] {
    [number % 3, number / 3 % 3, number / 9].map(|half| half as u32)
}

/// Its number.
fn number([x, y, z]: [usize; 3]) -> usize {
    x + 3 * y + 9 * z
}

/// Whether the corners show the level set, without doubt how it runs, and the interpolant is as
/// near as `error`.
fn is_one_flat_sheet(values: &[f64; POINTS], sides: DVec3, error: f64) -> bool {
    let corner = |c: usize| values[number([c & 1, c >> 1 & 1, c >> 2].map(|bit| 2 * bit))];
    let inside = |c: usize| corner(c) < 0.0;
    let shows = (1..8).any(|c| inside(c) != inside(0));
    // The corners of a side whose diagonals are on different sides of the level.
    let ambiguous = |axis: usize, end: usize| {
        let (one, other) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        let base = end << axis;
        let diagonal = inside(base) == inside(base | one | other);
        diagonal && inside(base | one) == inside(base | other) && inside(base) != inside(base | one)
    };
    if !shows || (0..3).any(|axis| ambiguous(axis, 0) || ambiguous(axis, 1)) {
        return false;
    }
    // Differences between opposite sides' centres.
    let slope = |axis: usize| {
        let ends = [0, 2].map(|half| {
            let mut place = [1; 3];
            place[axis] = half;
            values[number(place)]
        });
        (ends[1] - ends[0]) / sides[axis]
    };
    let greatest = error * DVec3::from_array([0, 1, 2].map(slope)).length();
    // False where a value is NaN or infinite.
    greatest > 0.0
        && (0..POINTS).all(|point| (values[point] - interpolated(values, point)).abs() <= greatest)
}

/// The trilinear interpolant of the corners at a point.
fn interpolated(values: &[f64; POINTS], point: usize) -> f64 {
    let halves = [point % 3, point / 3 % 3, point / 9];
    let weight = |corner: [usize; 3]| -> f64 {
        let along = |axis: usize| match corner[axis] {
            0 => 1.0 - 0.5 * halves[axis] as f64,
            _ => 0.5 * halves[axis] as f64,
        };
        along(0) * along(1) * along(2)
    };
    (0..8)
        .map(|c: usize| {
            let corner = [c & 1, c >> 1 & 1, c >> 2].map(|bit| 2 * bit);
            weight(corner) * values[number(corner)]
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(field: impl Fn(DVec3) -> f64) -> [f64; POINTS] {
        std::array::from_fn(|point| field(0.5 * DVec3::from_array(halves(point).map(f64::from))))
    }

    #[test]
    fn a_plane_is_flat_and_a_sphere_as_its_sagitta_says() {
        let plane = values(|p| p.dot(DVec3::new(1.0, 2.0, 3.0)) - 2.9);
        assert!(is_one_flat_sheet(&plane, DVec3::ONE, 1e-12));
        // x² differs from its chord over a unit by 1/4 in the middle, so F does by 3/4 in the
        // middle of the cell, where |F_x| is √3·(1 + 2·10).
        let center = DVec3::splat(-10.0);
        let sphere = values(|p| p.distance_squared(center) - 3.0 * 10.5 * 10.5);
        let sagitta = 0.75 / (3f64.sqrt() * 21.0);
        assert!(is_one_flat_sheet(&sphere, DVec3::ONE, 1.001 * sagitta));
        assert!(!is_one_flat_sheet(&sphere, DVec3::ONE, 0.999 * sagitta));
    }

    #[test]
    fn what_is_ambiguous_or_undefined_or_not_there_is_not_flat() {
        let saddle = values(|p| (p.x - 0.5) * (p.y - 0.5) + 1e-3);
        assert!(!is_one_flat_sheet(&saddle, DVec3::ONE, 1.0));
        let torn = values(|p| {
            if p == DVec3::splat(0.5) {
                f64::NAN
            } else {
                p.x - 0.3
            }
        });
        assert!(!is_one_flat_sheet(&torn, DVec3::ONE, 1.0));
        let elsewhere = values(|p| p.x + 1.0);
        assert!(!is_one_flat_sheet(&elsewhere, DVec3::ONE, 1.0));
    }
}
