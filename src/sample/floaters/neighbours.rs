//! Who is near: lists of neighbours from a grid of cells, in time linear in the floaters.
//!
//! Floaters are sorted by the cells of a grid whose side is the reach of the longest list; all
//! that a floater can see lies in its cell and the 26 around it. The lists are made a little
//! longer than needed, so that they hold for some iterations while floaters move.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

/// Floaters that one task searches for.
const CHUNK: usize = 256;

/// Cells along an axis: keys of three axes fit into 63 bits.
const MOST_CELLS: f64 = (1_u64 << 21) as f64 - 4.0;

/// A place and how far it sees.
#[derive(Clone, Copy)]
pub(super) struct Site {
    pub(super) position: DVec3,
    pub(super) reach: f64,
}

/// The order that puts sites near each other in space near each other in memory.
///
/// It depends on the sites only. Costs O(n log n), of integers.
pub(super) fn order(sites: &[Site]) -> Vec<u32> {
    let grid = Grid::new(sites);
    let mut keyed: Vec<(u64, u32)> = sites
        .iter()
        .zip(0..)
        .map(|(site, index)| (grid.key(site.position), index))
        .collect();
    keyed.par_sort_unstable();
    keyed.into_iter().map(|(_, index)| index).collect()
}

/// For each site, the others within the longer of the two reaches.
#[derive(Default)]
pub(super) struct Neighbours {
    starts: Vec<u32>,
    lists: Vec<u32>,
}

impl Neighbours {
    /// The lists of sites that are in the order of [`order`].
    pub(super) fn new(sites: &[Site]) -> Self {
        let grid = Grid::new(sites);
        let keys: Vec<u64> = sites.iter().map(|site| grid.key(site.position)).collect();
        let chunks: Vec<(Vec<u32>, Vec<u32>)> = (0..sites.len().div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let first = chunk * CHUNK;
                let last = (first + CHUNK).min(sites.len());
                lists_of(sites, &keys, first..last)
            })
            .collect();
        let mut neighbours = Neighbours {
            starts: vec![0],
            lists: Vec::new(),
        };
        for (lengths, lists) in chunks {
            let base = neighbours.lists.len() as u32;
            neighbours
                .starts
                .extend(lengths.iter().map(|end| base + end));
            neighbours.lists.extend(lists);
        }
        neighbours
    }

    /// All of so many others are neighbours of the first, and nobody has others.
    #[cfg(test)]
    pub(super) fn of_first(number: usize) -> Self {
        let lists: Vec<u32> = (1..number as u32).collect();
        let mut starts = vec![lists.len() as u32; number + 1];
        starts[0] = 0;
        Neighbours { starts, lists }
    }

    /// The neighbours of one.
    pub(super) fn of(&self, index: usize) -> &[u32] {
        &self.lists[self.starts[index] as usize..self.starts[index + 1] as usize]
    }
}

/// The lists of some consecutive sites, one after the other, with the end of each.
fn lists_of(sites: &[Site], keys: &[u64], range: Range<usize>) -> (Vec<u32>, Vec<u32>) {
    let mut ends = Vec::with_capacity(range.len());
    let mut lists = Vec::with_capacity(24 * range.len());
    let mut rows = Rows::before(keys[range.start], keys);
    for index in range {
        rows.advance(keys[index], keys);
        let site = sites[index];
        for row in &rows.ranges {
            for (other, there) in row.clone().zip(&sites[row.clone()]) {
                let reach = site.reach.max(there.reach);
                if other != index && site.position.distance_squared(there.position) < reach * reach
                {
                    lists.push(other as u32);
                }
            }
        }
        ends.push(lists.len() as u32);
    }
    (ends, lists)
}

/// The sorted sites in the nine rows of three cells around a cell. Cells are asked for in order, so
/// that the rows only ever move on.
struct Rows {
    ranges: [Range<usize>; 9],
    around: Option<u64>,
}

impl Rows {
    /// The first keys of the rows around a cell: one before the middle.
    fn firsts(key: u64) -> impl Iterator<Item = u64> {
        let lowest = key - (1 << 42) - (1 << 21) - 1;
        (0..9).map(move |row: u64| lowest + ((row / 3) << 42) + ((row % 3) << 21))
    }

    /// Not yet moved on to the cell.
    fn before(key: u64, keys: &[u64]) -> Rows {
        let mut rows = Rows {
            ranges: std::array::from_fn(|_| 0..0),
            around: None,
        };
        for (row, first) in rows.ranges.iter_mut().zip(Rows::firsts(key)) {
            let start = keys.partition_point(|&key| key < first);
            *row = start..start;
        }
        rows
    }

    fn advance(&mut self, key: u64, keys: &[u64]) {
        if self.around == Some(key) {
            return;
        }
        self.around = Some(key);
        let next = |from: usize, key: u64| {
            let beyond = keys[from..].iter().position(|&other| other >= key);
            beyond.map_or(keys.len(), |steps| from + steps)
        };
        for (row, first) in self.ranges.iter_mut().zip(Rows::firsts(key)) {
            let start = next(row.start, first);
            *row = start..next(start.max(row.end), first + 3);
        }
    }
}

/// Cells of equal side; keys count them along x first.
struct Grid {
    origin: DVec3,
    per_unit: f64,
}

impl Grid {
    fn new(sites: &[Site]) -> Self {
        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        let mut reach: f64 = 0.0;
        for site in sites {
            low = low.min(site.position);
            high = high.max(site.position);
            reach = reach.max(site.reach);
        }
        let longest = (high - low).max_element();
        let side = reach.max(longest / MOST_CELLS).max(f64::MIN_POSITIVE);
        Grid {
            origin: low,
            per_unit: 1.0 / side,
        }
    }

    /// One cell is left free below the lowest, so that there is always one before.
    fn key(&self, position: DVec3) -> u64 {
        let cell = (position - self.origin) * self.per_unit + 1.0;
        (((cell.z as u64) << 21 | cell.y as u64) << 21) | cell.x as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::random::Stream;

    #[test]
    fn lists_agree_with_all_pairs() {
        let stream = Stream::new(1, 0);
        let unsorted: Vec<Site> = (0..700)
            .map(|i| Site {
                position: DVec3::new(
                    stream.unit(4 * i),
                    3.0 * stream.unit(4 * i + 1),
                    0.2 * stream.unit(4 * i + 2),
                ),
                reach: 0.05 + 0.2 * stream.unit(4 * i + 3),
            })
            .collect();
        let sites: Vec<Site> = order(&unsorted)
            .into_iter()
            .map(|index| unsorted[index as usize])
            .collect();
        let neighbours = Neighbours::new(&sites);
        for (index, site) in sites.iter().enumerate() {
            let mut found = neighbours.of(index).to_vec();
            found.sort_unstable();
            let expected: Vec<u32> = (0..sites.len())
                .filter(|&other| {
                    let distance = site.position.distance(sites[other].position);
                    other != index && distance < site.reach.max(sites[other].reach)
                })
                .map(|other| other as u32)
                .collect();
            assert_eq!(found, expected);
        }
    }

    #[test]
    fn nobody_and_one_alone_have_no_neighbours() {
        assert!(order(&[]).is_empty());
        Neighbours::new(&[]);
        let alone = Site {
            position: DVec3::ONE,
            reach: 1.0,
        };
        assert!(Neighbours::new(&[alone]).of(0).is_empty());
    }
}
