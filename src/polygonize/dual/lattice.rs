//! The points, cells and blocks that dual contouring works on.
//!
//! The box is divided into equal cells. Around them lies one layer of flat cells, between the
//! sides of the box and *ghost* points that have the coordinates of the side: a vertex in a flat
//! cell lies in the side itself, so that surfaces end exactly at the box. With a cap ghost points
//! count as outside, which closes the surface along the side; without, they are what F is at the
//! side, and the surface is open there.
//!
//! Cells are grouped in blocks of 8³, which the driver over boxes decides or hands out as leaves.

use glam::DVec3;
use rustc_hash::FxHashSet;

use crate::engine::{Cell, Subdivision};
use crate::polygonize::{Options, PolygonizeError};

/// Cells of a block along each axis.
pub(super) const BLOCK: usize = 8;

/// Parts of a cell of the subdivision per axis: 64 parts make one pass of intervals.
const SPLIT: usize = 4;

/// The lattice over a box in R3.
pub(super) struct Lattice {
    /// The coordinates of points along each axis, ghosts included.
    pub(super) coordinates: [Vec<f64>; 3],
    /// Whether ghosts count as outside.
    pub(super) cap: bool,
    /// The side of a cell along each axis.
    pub(super) side: DVec3,
    /// What is explored: its leaves are the blocks.
    pub(super) subdivision: Subdivision,
}

impl Lattice {
    /// The lattice with as few cells as `cell` allows.
    ///
    /// # Errors
    ///
    /// Too many cells: those near the surface are counted, which are about as many as on the
    /// sides of the box.
    pub(super) fn new(options: &Options) -> Result<Lattice, PolygonizeError> {
        let bounds = &options.bounds;
        let size = bounds.size();
        let counts = (size / options.cell * (1.0 - 1e-12)).ceil().max(DVec3::ONE);
        let needed = 2.0 * (counts.x * counts.y + counts.y * counts.z + counts.z * counts.x);
        if needed > options.cell_limit as f64 {
            return Err(PolygonizeError::TooManyCells {
                needed,
                limit: options.cell_limit,
            });
        }
        // A side of the box must not be a face between blocks, whose coordinate is not its own.
        let counts = counts.to_array().map(|count| {
            let count = count as usize;
            count + usize::from((count + 1).is_multiple_of(BLOCK))
        });
        let side = size / DVec3::from_array(counts.map(|count| count as f64));
        let blocks = counts.map(|count| (count + 2).div_ceil(BLOCK));
        let low = bounds.min - side;
        let splits = splits(blocks);
        let total = |axis: usize| splits.iter().map(|split| split[axis]).product::<usize>();
        let total = DVec3::from_array([0, 1, 2].map(|axis| total(axis) as f64));
        let subdivision = Subdivision {
            low,
            high: low + total * BLOCK as f64 * side,
            splits,
            descending: [false; 3],
        };
        let mut lattice = Lattice {
            coordinates: Default::default(),
            cap: options.cap,
            side,
            subdivision,
        };
        let ends = (bounds.min.to_array(), bounds.max.to_array());
        for (axis, &count) in counts.iter().enumerate() {
            lattice.coordinates[axis] = lattice.along(axis, count, (ends.0[axis], ends.1[axis]));
        }
        Ok(lattice)
    }

    /// The coordinates of the points along an axis with so many cells between its ends.
    fn along(&self, axis: usize, count: usize, (low, high): (f64, f64)) -> Vec<f64> {
        let level = self.subdivision.splits.len() - 1;
        let coordinate = |point: usize| {
            let step = point.saturating_sub(1).min(count);
            if step == 0 || step == count {
                return if step == 0 { low } else { high };
            }
            let (done, left) = (step as f64, (count - step) as f64);
            let exact = (low * left + high * done) / count as f64;
            // Points of a block lie in its box to the last bit, as pruned fields demand.
            let mut place = [0; 3];
            place[axis] = point / BLOCK;
            let block = self.subdivision.cell(level, place);
            match point % BLOCK {
                0 => block.low[axis],
                _ => exact.clamp(block.low[axis], block.high[axis]),
            }
        };
        (0..count + 3).map(coordinate).collect()
    }

    /// The number of cells along an axis, flat ones included.
    pub(super) fn cells(&self, axis: usize) -> usize {
        self.coordinates[axis].len() - 1
    }

    /// Cells that are not flat.
    pub(super) fn solid_cells(&self) -> usize {
        (0..3).map(|axis| self.cells(axis) - 2).product()
    }

    /// Out of the box from a flat cell; 0 for others.
    pub(super) fn outward(&self, cell: [usize; 3]) -> DVec3 {
        let along = |axis: usize| match cell[axis] {
            0 => -1.0,
            last if last + 1 == self.cells(axis) => 1.0,
            _ => 0.0,
        };
        DVec3::from_array([0, 1, 2].map(along))
    }

    /// Whether a point at this index along an axis is a ghost.
    pub(super) fn is_ghost(&self, axis: usize, point: usize) -> bool {
        point == 0 || point + 1 == self.coordinates[axis].len()
    }

    /// The cell that a point is in, unless that is a flat one or beyond the box.
    pub(super) fn cell_of(&self, point: DVec3) -> Option<[usize; 3]> {
        let mut cell = [0; 3];
        for (axis, along) in self.coordinates.iter().enumerate() {
            let above = along.partition_point(|&coordinate| coordinate <= point[axis]);
            if above < 2 || above + 1 >= along.len() {
                return None;
            }
            cell[axis] = above - 1;
        }
        Some(cell)
    }

    /// The coordinate of a point, which may lie beyond the last: then it is that of the last.
    pub(super) fn coordinate(&self, axis: usize, point: usize) -> f64 {
        let along = &self.coordinates[axis];
        along[point.min(along.len() - 1)]
    }

    /// The point at a place.
    pub(super) fn point(&self, place: [usize; 3]) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|axis| self.coordinate(axis, place[axis])))
    }

    /// How many blocks the cell of a level of the subdivision has along an axis.
    pub(super) fn blocks_of(&self, level: usize, axis: usize) -> usize {
        let below = self.subdivision.splits.iter().skip(level + 1);
        below.map(|split| split[axis]).product()
    }

    /// The cells of a level of the subdivision that these blocks are in.
    pub(super) fn around(&self, level: usize, blocks: &[[usize; 3]]) -> FxHashSet<[usize; 3]> {
        let sizes = [0, 1, 2].map(|axis| self.blocks_of(level, axis));
        let cell = |block: &[usize; 3]| [0, 1, 2].map(|axis| block[axis] / sizes[axis]);
        blocks.iter().map(cell).collect()
    }

    /// The lattice's cells that a cell of the subdivision covers: first, and behind the last;
    /// `None` if it lies beyond the lattice.
    pub(super) fn covered(&self, cell: &Cell) -> Option<[[usize; 2]; 3]> {
        let range = |axis: usize| {
            let cells = self.blocks_of(cell.level, axis) * BLOCK;
            let first = cell.index[axis] * cells;
            [first, (first + cells).min(self.cells(axis))]
        };
        let ranges = [0, 1, 2].map(range);
        ranges
            .iter()
            .all(|[first, end]| first < end)
            .then_some(ranges)
    }

    /// Whether a cell of the subdivision covers flat cells.
    pub(super) fn touches_side(&self, cell: &Cell) -> bool {
        self.covered(cell).is_some_and(|ranges| {
            (0..3).any(|axis| {
                let [first, end] = ranges[axis];
                first == 0 || end == self.cells(axis)
            })
        })
    }
}

/// The levels of a subdivision with at least so many leaves along each axis.
fn splits(mut blocks: [usize; 3]) -> Vec<[usize; 3]> {
    let mut splits = Vec::new();
    loop {
        let split = blocks.map(|count| count.min(SPLIT));
        blocks = [0, 1, 2].map(|axis| blocks[axis].div_ceil(split[axis]));
        splits.push(split);
        if blocks.iter().all(|&count| count <= 2 * SPLIT) {
            break;
        }
    }
    splits.push(blocks);
    splits.reverse();
    splits
}
