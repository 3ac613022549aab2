//! The test of a simplex: its linear interpolant's gradient and F's gradients point to the same
//! side, all of them.
//!
//! The interpolant's gradient follows corner by corner, from the last to the first: each differs
//! from the one before along one axis that is new. The numbers are rounded, so the test leaves a margin
//! that is far greater than all roundings together; the checker does the same with intervals.

use super::super::simplices::{Lattice, Place};
use crate::graph::Interval;

/// What rounding may have done to a sum of this kind, relative to its terms: a hundred times more
/// than it does.
const MARGIN: f64 = 1e-13;

/// Below that, numbers lose digits.
const SMALLEST: f64 = 1e-280;

/// The interpolant's gradient, and a bound of each component's error.
pub(super) struct Normal {
    gradient: [f64; 3],
    error: [f64; 3],
}

/// The gradient of the linear function that has these values at the corners of a simplex.
pub(super) fn normal(lattice: &Lattice, corners: &[Place], values: &[f64]) -> Normal {
    let mut normal = Normal {
        gradient: [0.0; 3],
        error: [0.0; 3],
    };
    let mut known = [false; 3];
    for index in (1..corners.len()).rev() {
        let (from, to) = (corners[index], corners[index - 1]);
        let mut rise = values[index - 1] - values[index];
        let mut size = rise.abs();
        let mut error = 0.0;
        let mut new = (0, 0.0);
        for axis in 0..3 {
            if from[axis] == to[axis] {
                continue;
            }
            let step = lattice.coordinate(axis, to[axis]) - lattice.coordinate(axis, from[axis]);
            if known[axis] {
                let part = normal.gradient[axis] * step;
                rise -= part;
                size += part.abs();
                error += normal.error[axis] * step.abs();
            } else {
                new = (axis, step);
            }
        }
        let (axis, step) = new;
        known[axis] = true;
        normal.gradient[axis] = rise / step;
        normal.error[axis] = (error + MARGIN * size) / step.abs();
    }
    normal
}

impl Normal {
    /// Whether the inner product with every vector of a box is positive, for the components along
    /// the axes that are not in the set of bits `without`.
    pub(super) fn agrees(&self, slopes: &[Interval], without: u8) -> bool {
        let (mut least, mut error) = (0.0, SMALLEST);
        for (axis, slope) in slopes.iter().enumerate() {
            if without >> axis & 1 == 1 {
                continue;
            }
            let (low, high) = (
                self.gradient[axis] * slope.low,
                self.gradient[axis] * slope.high,
            );
            least += low.min(high);
            let size = slope.low.abs().max(slope.high.abs());
            error += (self.error[axis] + MARGIN * self.gradient[axis].abs()) * size;
        }
        // False where anything is NaN.
        least > error && least.is_finite()
    }
}

/// Whether some vector has a positive inner product with every vector of the box; tried is that
/// to its middle.
pub(super) fn is_narrow(slopes: &[Interval]) -> bool {
    let least: f64 = slopes
        .iter()
        .map(|slope| {
            let middle = 0.5 * slope.low + 0.5 * slope.high;
            (middle * slope.low).min(middle * slope.high)
        })
        .sum();
    least > 0.0 && least.is_finite()
}
