//! Cells: which points are near a place, in a grid of which only cells with points are stored.

use glam::DVec3;

/// The largest index of a cell along an axis: three of them make one whole number.
const LAST: f64 = ((1_u64 << 21) - 3) as f64;

/// Points by cubic cells.
pub(super) struct Cells {
    low: DVec3,
    side: f64,
    /// The cells that have points, ascending, and where each begins in `points`; one more at the end.
    keys: Vec<u64>,
    starts: Vec<u32>,
    /// The points' places in the caller's list, cell by cell, ascending in each.
    points: Vec<u32>,
}

impl Cells {
    /// Cells at least `reach` wide; wider where there would be more than two million in a row.
    pub(super) fn new(positions: &[DVec3], reach: f64) -> Cells {
        let low = positions.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = positions.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let side = reach.max((high - low).max_element() / LAST);
        let mut cells = Cells {
            low,
            side,
            keys: Vec::new(),
            starts: Vec::new(),
            points: Vec::new(),
        };
        let mut placed: Vec<(u64, u32)> = positions
            .iter()
            .zip(0..)
            .map(|(&position, index)| (cells.key(cells.cell(position)), index))
            .collect();
        placed.sort_unstable();
        for (place, (key, index)) in (0..).zip(placed) {
            if cells.keys.last() != Some(&key) {
                cells.keys.push(key);
                cells.starts.push(place);
            }
            cells.points.push(index);
        }
        cells.starts.push(cells.points.len() as u32);
        cells
    }

    /// Calls `visit` with every point that may be within reach of a place, in a fixed order.
    pub(super) fn around(&self, position: DVec3, mut visit: impl FnMut(u32)) {
        let [x, y, z] = self.cell(position);
        for x in x - 1..=x + 1 {
            for y in y - 1..=y + 1 {
                // Three cells in a row have consecutive keys.
                let (first, last) = (self.key([x, y, z - 1]), self.key([x, y, z + 1]));
                let begin = self.keys.partition_point(|&key| key < first);
                let mut end = begin;
                while self.keys.get(end).is_some_and(|&key| key <= last) {
                    end += 1;
                }
                let (from, to) = (self.starts[begin] as usize, self.starts[end] as usize);
                self.points[from..to].iter().for_each(|&point| visit(point));
            }
        }
    }

    /// The cell of a place; indices begin at 1, so that there is one before each.
    fn cell(&self, position: DVec3) -> [u64; 3] {
        ((position - self.low) / self.side)
            .to_array()
            .map(|place| place.clamp(0.0, LAST) as u64 + 1)
    }

    fn key(&self, [x, y, z]: [u64; 3]) -> u64 {
        (x << 42) | (y << 21) | z
    }
}
