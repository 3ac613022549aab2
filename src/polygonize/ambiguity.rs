//! Squares with two opposite corners inside and two outside: whether those inside are joined.

use std::collections::VecDeque;

use super::options::Ambiguity;
use crate::engine::Field;

/// A square is subdivided into two to this power at most, along each side.
const DEEPEST: u32 = 6;

/// An ambiguous square.
pub(super) struct Ambiguous {
    /// F − iso at its corners, counter-clockwise from the lower left.
    pub(super) values: [f64; 4],
    /// Its lower left and upper right corner.
    pub(super) corners: [[f64; 2]; 2],
}

impl Ambiguous {
    /// Whether the corners inside are joined, and how often F was evaluated for that.
    pub(super) fn joins(&self, rule: Ambiguity, field: &dyn Field, iso: f64) -> (bool, usize) {
        match rule {
            Ambiguity::Saddle => (self.saddle_is_inside(), 0),
            Ambiguity::Join => (true, 0),
            Ambiguity::Separate => (false, 0),
            Ambiguity::Subdivide => self.subdivided(field, iso),
        }
    }

    /// Whether the bilinear interpolant is negative at its saddle. That is the quotient of
    /// ac − bd, with the corners inside a and c, and a + c − b − d, which is negative.
    fn saddle_is_inside(&self) -> bool {
        // Scaling keeps products from overflowing and vanishing.
        let scale = self
            .values
            .iter()
            .fold(0.0_f64, |most, value| most.max(value.abs()));
        let [a, b, c, d] = self.values.map(|value| value / scale);
        match a < 0.0 {
            // NaN and infinities do not join.
            true => a * c > b * d,
            false => b * d > a * c,
        }
    }

    /// Whether F on ever finer grids joins the corners inside, before it joins those outside.
    fn subdivided(&self, field: &dyn Field, iso: f64) -> (bool, usize) {
        let mut evaluations = 0;
        for depth in 1..=DEEPEST {
            let cells = 1_usize << depth;
            let inside = self.flags(field, iso, cells);
            evaluations += inside.len();
            let first = usize::from(self.values[0] >= 0.0 || self.values[0].is_nan());
            let corners = [0, cells, inside.len() - 1, inside.len() - 1 - cells];
            let joins = |from: usize, flag: bool| {
                reaches(&inside, cells + 1, flag, corners[from], corners[from + 2])
            };
            if joins(first, true) {
                return (true, evaluations);
            }
            if joins(1 - first, false) {
                return (false, evaluations);
            }
        }
        (self.saddle_is_inside(), evaluations)
    }

    /// Whether F < iso at the points of a grid, row by row; at the corners as was seen before.
    fn flags(&self, field: &dyn Field, iso: f64, cells: usize) -> Vec<bool> {
        let [low, high] = self.corners;
        let place = |axis: usize, step: usize| {
            let part = step as f64 / cells as f64;
            (1.0 - part) * low[axis] + part * high[axis]
        };
        let points = || (0..=cells).flat_map(|y| (0..=cells).map(move |x| (x, y)));
        let xs: Vec<f64> = points().map(|(x, _)| place(0, x)).collect();
        let ys: Vec<f64> = points().map(|(_, y)| place(1, y)).collect();
        let mut values = vec![0.0; xs.len()];
        field.values(&[&xs, &ys], &mut values);
        let mut flags: Vec<bool> = values.iter().map(|value| value - iso < 0.0).collect();
        let last = flags.len() - 1;
        let corners = [0, cells, last, last - cells];
        for (corner, value) in corners.into_iter().zip(self.values) {
            flags[corner] = value < 0.0;
        }
        flags
    }
}

/// Whether steps along the rows and columns of a grid lead from one point to another over points
/// with the same flag.
fn reaches(flags: &[bool], row: usize, flag: bool, from: usize, to: usize) -> bool {
    let mut seen = vec![false; flags.len()];
    let mut waiting = VecDeque::from([from]);
    seen[from] = true;
    while let Some(here) = waiting.pop_front() {
        if here == to {
            return true;
        }
        let steps = [
            (!here.is_multiple_of(row)).then(|| here - 1),
            (!(here + 1).is_multiple_of(row)).then_some(here + 1),
            here.checked_sub(row),
            Some(here + row),
        ];
        for next in steps.into_iter().flatten() {
            if next < flags.len() && flags[next] == flag && !seen[next] {
                seen[next] = true;
                waiting.push_back(next);
            }
        }
    }
    false
}
