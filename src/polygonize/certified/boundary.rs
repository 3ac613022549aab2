//! What else has to hold at the sides of the box, and at points between a cell with the level set
//! and one that is proven to have none.

use rayon::prelude::*;
use rustc_hash::FxHashSet;

use super::super::octree::Node;
use super::super::octree::decompose::Decomposition;
use super::super::simplices::Place;
use super::cells::{FINEST, Key};
use super::enclosing::{self, Known};
use super::forest::Forest;
use super::normals::Normal;
use crate::graph::Interval;

/// Whether a simplex passes in all sides, edges and corners of the box that it touches: F and
/// its interpolant keep off 0 there with the same sign, or the test holds for the gradients'
/// components along them.
pub(super) fn passes(
    forest: &Forest,
    corners: &[Place],
    values: &[f64; 4],
    (normal, slopes): (&Normal, &[Interval; 3]),
) -> bool {
    let frame = forest.frame;
    let borders: [u8; 4] = std::array::from_fn(|index| match corners.get(index) {
        Some(&corner) => frame.border(corner),
        None => 0,
    });
    (1u8..1 << frame.dimension).all(|part| {
        let touching: Vec<usize> = (0..corners.len())
            .filter(|&index| borders[index] & part == part)
            .collect();
        let Some(&first) = touching.first() else {
            return true;
        };
        if normal.agrees(&slopes[..frame.dimension], part) {
            return true;
        }
        let places: Vec<Place> = touching.iter().map(|&index| corners[index]).collect();
        let hull = [frame.hull(&places)];
        let is_inside = values[first] < 0.0;
        let is_one = touching.iter().all(|&index| (values[index] < 0.0) == is_inside);
        let agrees = |known: Option<Known>| {
            matches!(known, Some(Known::Decided { is_inside: own }) if own == is_inside)
        };
        let natural = enclosing::values(forest.analysed.field, &hull);
        if is_one && agrees(enclosing::decided(&natural[0], forest.iso(), 0.0)) {
            return true;
        }
        match enclosing::judge(forest.analysed, forest.iso(), &hull).first() {
            Some(Known::Gradients(slopes)) => normal.agrees(&slopes[..frame.dimension], part),
            Some(&known) => is_one && agrees(Some(known)),
            None => false,
        }
    })
}

/// Corners of simplices at which the sign of what was computed is not proven, and which touch a
/// cell that is proven to be on one side: there both might differ.
pub(super) fn uncertain(
    forest: &Forest,
    decomposition: &Decomposition,
    nodes: &[Node],
) -> FxHashSet<u64> {
    let lattice = &forest.frame.lattice;
    let active: FxHashSet<Key> = nodes.iter().map(super::cells::key).collect();
    let keys: Vec<Vec<u64>> = nodes
        .par_chunks(1024)
        .map(|nodes| {
            let mut keys = Vec::new();
            for node in nodes {
                forest
                    .frame
                    .for_each_simplex(decomposition, node, |corners| {
                        // The centre is in the cell alone.
                        keys.extend(corners[1..].iter().map(|&corner| lattice.key(corner)));
                    });
            }
            keys.sort_unstable();
            keys.dedup();
            keys
        })
        .collect();
    keys.into_par_iter()
        .flat_map_iter(|keys| {
            let places: Vec<Place> = keys.iter().map(|&key| lattice.place(key)).collect();
            let points: Vec<_> = places
                .iter()
                .map(|&place| forest.frame.hull(&[place]))
                .collect();
            let known = enclosing::values(forest.analysed.field, &points);
            let doubtful = places.into_iter().zip(known).filter(|(place, known)| {
                let own = forest.value(*place) < 0.0;
                let proven = enclosing::decided(known, forest.iso(), 0.0);
                let agrees =
                    matches!(proven, Some(Known::Decided { is_inside }) if is_inside == own);
                !agrees && touches_decided(forest, &active, *place)
            });
            doubtful
                .map(|(place, _)| lattice.key(place))
                .collect::<Vec<u64>>()
        })
        .collect()
}

/// Whether a place is a point of a cell that has no level set.
fn touches_decided(forest: &Forest, active: &FxHashSet<Key>, place: Place) -> bool {
    let frame = forest.frame;
    (0..1u32 << frame.dimension).any(|octant| {
        // The smallest cell there in this direction.
        let mut low = place;
        for (axis, low) in low.iter_mut().enumerate().take(frame.dimension) {
            let is_lower = octant >> axis & 1 == 1;
            match is_lower {
                true if *low == 0 => return false,
                true => *low -= 1,
                false if *low == frame.lattice.top[axis] => return false,
                false => {}
            }
        }
        !(1..=FINEST + 1).any(|power| {
            let size = 1 << power;
            active.contains(&(low.map(|place| place / size * size), size))
        })
    })
}
