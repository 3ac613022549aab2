//! The cells of a subdivision in which F and all of F_x may be 0.

use glam::DVec3;

use super::Cancelled;
use crate::engine::{CompiledField, Monitor};
use crate::geometry::Bounds;
use crate::graph::Interval;
use crate::graph::interval::Enclosure;

/// How often the box is halved along each axis, by dimension.
const DEPTH: [u32; 3] = [12, 9, 7];

/// More cells than this are not halved again.
const MOST_CELLS: usize = 60_000;

/// Cells that are enclosed together.
const BATCH: usize = 512;

/// Cells of one size.
pub(super) struct Cells {
    /// The number of axes.
    pub(super) dimension: usize,
    /// Half of a cell's sides.
    pub(super) half: DVec3,
    /// The middles, in order.
    pub(super) centers: Vec<DVec3>,
}

impl Cells {
    /// The diagonal of a cell.
    pub(super) fn diagonal(&self) -> f64 {
        2.0 * self.half.length()
    }
}

/// The finest cells in which the enclosures of F and of each derivative hold 0.
pub(super) fn suspicious(
    field: &CompiledField,
    bounds: &Bounds,
    monitor: &dyn Monitor,
) -> Result<Cells, Cancelled> {
    let depth = DEPTH[bounds.dimension - 1];
    let mut cells = Cells {
        dimension: bounds.dimension,
        half: 0.5 * bounds.size(),
        centers: vec![bounds.center()],
    };
    for level in 0..=depth {
        if monitor.cancelled() {
            return Err(Cancelled);
        }
        let phase = f64::from(level) / f64::from(2 * depth);
        monitor.progress("inspecting", phase);
        keep_suspicious(field, &mut cells);
        let children = cells.centers.len() << bounds.dimension;
        if level == depth || children > MOST_CELLS {
            break;
        }
        halve(&mut cells);
    }
    Ok(cells)
}

fn halve(cells: &mut Cells) {
    cells.half *= 0.5;
    let (half, dimension) = (cells.half, cells.dimension);
    let children = cells.centers.iter().flat_map(|&center| {
        (0..1_usize << dimension).map(move |corner| {
            let mut child = center;
            for axis in 0..dimension {
                let sign = if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
                child[axis] += sign * half[axis];
            }
            child
        })
    });
    cells.centers = children.collect();
}

/// Drops the cells in which F or one of its derivatives cannot be 0.
fn keep_suspicious(field: &CompiledField, cells: &mut Cells) {
    let (half, dimension) = (cells.half, cells.dimension);
    let mut kept = Vec::new();
    for batch in cells.centers.chunks(BATCH) {
        let sides: Vec<Vec<Interval>> = (0..dimension)
            .map(|axis| {
                let side = |center: &DVec3| {
                    Interval::new(center[axis] - half[axis], center[axis] + half[axis])
                };
                batch.iter().map(side).collect()
            })
            .collect();
        let columns: Vec<&[Interval]> = sides.iter().map(Vec::as_slice).collect();
        let mut values = vec![Enclosure::of_interval(Interval::EMPTY); batch.len()];
        let mut gradients = vec![vec![Interval::EMPTY; batch.len()]; dimension];
        let mut outputs: Vec<&mut [Interval]> =
            gradients.iter_mut().map(Vec::as_mut_slice).collect();
        field.enclose_gradients(&columns, &mut values, &mut outputs);
        for (index, center) in batch.iter().enumerate() {
            let level = gradients.iter().all(|column| column[index].contains(0.0));
            if level && values[index].range.contains(0.0) {
                kept.push(*center);
            }
        }
    }
    cells.centers = kept;
}
