//! Cells: which points are near a point, in a grid of which only cells with points are stored.

use glam::DVec3;

/// The largest index of a cell along an axis: three of them make one whole number.
const LAST: f64 = ((1_u64 << 21) - 3) as f64;

/// Points by cubic cells. Those that are chosen stand first in each.
pub(super) struct Cells {
    /// Where the points of each cell begin in `points`; one more at the end.
    starts: Vec<u32>,
    /// How many points of each cell are chosen.
    chosen: Vec<u32>,
    /// The cells around each, itself included: nine rows of up to three consecutive ones.
    around: Vec<[(u32, u32); 9]>,
    /// The points' places in the caller's list, cell by cell.
    points: Vec<u32>,
    /// Of each point its cell, and where in `points` it stands.
    places: Vec<(u32, u32)>,
}

/// The side of cells at least `reach` wide, and the lowest corner; wider where there would be more
/// than two million in a row.
fn layout(positions: &[DVec3], reach: f64) -> (DVec3, f64) {
    let low = positions.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = (positions.iter().copied()).fold(DVec3::NEG_INFINITY, DVec3::max);
    (low, reach.max((high - low).max_element() / LAST))
}

/// The key of the cell of a position.
fn key_of(position: DVec3, low: DVec3, side: f64) -> u64 {
    // Indices begin at 1, so that there is one before each.
    let index = ((position - low) / side).to_array();
    key(index.map(|place| place.clamp(0.0, LAST) as u64 + 1))
}

/// The places of the points, cell by cell: in this order, points that are close in space are close
/// in memory.
pub(super) fn order(positions: &[DVec3], reach: f64) -> Vec<u32> {
    let (low, side) = layout(positions, reach);
    let keys = positions
        .iter()
        .map(|&position| key_of(position, low, side));
    let mut placed: Vec<(u64, u32)> = keys.zip(0..).collect();
    placed.sort_unstable();
    placed.into_iter().map(|(_, index)| index).collect()
}

impl Cells {
    /// Cells at least `reach` wide; wider where there would be more than two million in a row.
    pub(super) fn new(positions: &[DVec3], reach: f64) -> Cells {
        let (low, side) = layout(positions, reach);
        let mut placed: Vec<(u64, u32)> = positions
            .iter()
            .zip(0..)
            .map(|(&position, index)| (key_of(position, low, side), index))
            .collect();
        placed.sort_unstable();
        let mut keys: Vec<u64> = Vec::new();
        let mut starts = Vec::new();
        let mut points = Vec::with_capacity(placed.len());
        let mut places = vec![(0, 0); placed.len()];
        for (place, (key, index)) in (0..).zip(placed) {
            if keys.last() != Some(&key) {
                keys.push(key);
                starts.push(place);
            }
            places[index as usize] = (keys.len() as u32 - 1, place);
            points.push(index);
        }
        starts.push(points.len() as u32);
        Cells {
            starts,
            chosen: vec![0; keys.len()],
            around: keys.iter().map(|&cell| around(&keys, cell)).collect(),
            points,
            places,
        }
    }

    /// Calls `visit` with every point that may be within reach of one, itself included.
    pub(super) fn near(&self, index: u32, mut visit: impl FnMut(u32)) {
        let (cell, _) = self.places[index as usize];
        for (begin, end) in self.around[cell as usize] {
            let (from, to) = (self.starts[begin as usize], self.starts[end as usize]);
            let row = &self.points[from as usize..to as usize];
            row.iter().for_each(|&point| visit(point));
        }
    }

    /// Like [`Cells::near`] for chosen points only.
    pub(super) fn near_chosen(&self, index: u32, mut visit: impl FnMut(u32)) {
        let (cell, _) = self.places[index as usize];
        for (begin, end) in self.around[cell as usize] {
            for cell in begin as usize..end as usize {
                let from = self.starts[cell] as usize;
                let chosen = &self.points[from..from + self.chosen[cell] as usize];
                chosen.iter().for_each(|&point| visit(point));
            }
        }
    }

    /// Whether a point is chosen.
    pub(super) fn is_chosen(&self, index: u32) -> bool {
        let (cell, place) = self.places[index as usize];
        place < self.starts[cell as usize] + self.chosen[cell as usize]
    }

    /// Chooses a point that was not.
    pub(super) fn choose(&mut self, index: u32) {
        let (cell, place) = self.places[index as usize];
        let first_other = self.starts[cell as usize] + self.chosen[cell as usize];
        self.swap(place, first_other);
        self.chosen[cell as usize] += 1;
    }

    /// Undoes the choice of a point.
    pub(super) fn release(&mut self, index: u32) {
        let (cell, place) = self.places[index as usize];
        self.chosen[cell as usize] -= 1;
        self.swap(
            place,
            self.starts[cell as usize] + self.chosen[cell as usize],
        );
    }

    fn swap(&mut self, one: u32, other: u32) {
        self.points.swap(one as usize, other as usize);
        for place in [one, other] {
            self.places[self.points[place as usize] as usize].1 = place;
        }
    }
}

fn key([x, y, z]: [u64; 3]) -> u64 {
    (x << 42) | (y << 21) | z
}

/// The rows of cells around one, as ranges in the ascending list of the cells that there are.
fn around(keys: &[u64], cell: u64) -> [(u32, u32); 9] {
    let mut row = 0;
    [(); 9].map(|()| {
        let (x, y) = (row / 3, row % 3);
        row += 1;
        // Differences of −1, 0, 1 in the first two indices; three cells in a row have consecutive
        // keys.
        let middle = cell + (x << 42) + (y << 21) - (1 << 42) - (1 << 21);
        let begin = keys.partition_point(|&key| key < middle - 1);
        let end = begin + keys[begin..].partition_point(|&key| key <= middle + 1);
        (begin as u32, end as u32)
    })
}
