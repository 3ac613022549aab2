//! A coarse look at a field: its values and gradients on a grid over the box.

use glam::DVec3;

use crate::engine::{CompiledField, Field};
use crate::geometry::Bounds;

/// Grid points along each side, by dimension; the border belongs to the grid.
const POINTS: [usize; 3] = [1025, 65, 17];

/// What a grid of points tells.
pub(super) struct Survey {
    pub(super) undefined: bool,
    pub(super) constant: Option<f64>,
    pub(super) inside_out: bool,
    /// The median of |F_x|, for the scale of what counts as 0; 0 if it is nowhere a number.
    pub(super) slope: f64,
}

/// Looks at a field on the grid.
pub(super) fn survey(field: &CompiledField, bounds: &Bounds) -> Survey {
    let side = POINTS[bounds.dimension - 1];
    let (points, on_border) = grid(bounds, side);
    let count = on_border.len();
    let mut values = vec![f64::NAN; count];
    let mut gradients = vec![vec![f64::NAN; count]; bounds.dimension];
    {
        let columns: Vec<&[f64]> = points.iter().map(Vec::as_slice).collect();
        let mut outputs: Vec<&mut [f64]> = gradients.iter_mut().map(Vec::as_mut_slice).collect();
        field.gradients(&columns, &mut values, &mut outputs);
    }
    let mut defined = values.iter().copied().filter(|value| !value.is_nan());
    let first = defined.next();
    let constant = first.filter(|first| defined.all(|value| value == *first));
    let border_is_inside = values
        .iter()
        .zip(&on_border)
        .all(|(value, &on_border)| !on_border || *value < 0.0);
    Survey {
        undefined: first.is_none(),
        constant,
        inside_out: border_is_inside && values.iter().any(|value| *value > 0.0),
        slope: median_length(&gradients),
    }
}

/// The columns of the grid's points, and which of them lie on the border.
fn grid(bounds: &Bounds, side: usize) -> (Vec<Vec<f64>>, Vec<bool>) {
    let count = side.pow(bounds.dimension as u32);
    let mut points = vec![Vec::with_capacity(count); bounds.dimension];
    let mut on_border = Vec::with_capacity(count);
    for index in 0..count {
        let mut rest = index;
        let mut border = false;
        for (axis, column) in points.iter_mut().enumerate() {
            let place = rest % side;
            rest /= side;
            border |= place == 0 || place + 1 == side;
            let part = place as f64 / (side - 1) as f64;
            column.push(bounds.min[axis] + part * (bounds.max[axis] - bounds.min[axis]));
        }
        on_border.push(border);
    }
    (points, on_border)
}

fn median_length(gradients: &[Vec<f64>]) -> f64 {
    let count = gradients.first().map_or(0, Vec::len);
    let mut lengths: Vec<f64> = (0..count)
        .map(|index| {
            let mut gradient = DVec3::ZERO;
            for (axis, column) in gradients.iter().enumerate() {
                gradient[axis] = column[index];
            }
            gradient.length()
        })
        .filter(|length| length.is_finite() && *length > 0.0)
        .collect();
    lengths.sort_by(f64::total_cmp);
    lengths.get(lengths.len() / 2).copied().unwrap_or(0.0)
}
