//! Divides leaves until neighbours, also those that share an edge or a corner only, differ by at
//! most one level: larger steps make thin tetrahedra.

use rayon::prelude::*;
use rustc_hash::FxHashSet;

use super::super::simplices::{Lattice, Place};
use super::super::{Job, PolygonizeError, check_cells};
use super::build::Tree;
use super::{CHUNK, Node};

/// Balances the leaves of the boundary. The others have no tetrahedra.
pub(super) fn balance(
    job: &Job,
    lattice: &Lattice,
    tree: &mut Tree,
) -> Result<(), PolygonizeError> {
    loop {
        let divided = oversized(lattice, &tree.boundary);
        if divided.is_empty() {
            return Ok(());
        }
        let is_divided = |node: &Node| divided.binary_search(&(node.low, node.size)).is_ok();
        let (old, kept) = tree.boundary.iter().copied().partition(is_divided);
        let old: Vec<Node> = old;
        tree.boundary = kept;
        // What is flat stays flat in its parts.
        let children: Vec<Node> = old.iter().flat_map(Node::children).collect();
        tree.add(job, lattice, &children, 0)?;
        check_cells(tree.boundary.len() as f64, job.options)?;
    }
}

/// The leaves that are larger than a neighbour by more than a level, by place and size, ascending.
pub(in crate::polygonize) fn oversized(lattice: &Lattice, leaves: &[Node]) -> Vec<(Place, u32)> {
    let largest = leaves.iter().map(|leaf| leaf.size).max().unwrap_or(0);
    let known: FxHashSet<(Place, u32)> = leaves.iter().map(|leaf| (leaf.low, leaf.size)).collect();
    let mut found: Vec<(Place, u32)> = leaves
        .par_chunks(CHUNK)
        .flat_map_iter(|leaves| {
            let around = |leaf| too_large(leaf, lattice, &known, largest);
            leaves.iter().flat_map(around)
        })
        .collect();
    found.par_sort_unstable();
    found.dedup();
    found
}

/// The leaves around one that are larger by more than a level.
fn too_large(
    leaf: &Node,
    lattice: &Lattice,
    known: &FxHashSet<(Place, u32)>,
    largest: u32,
) -> Vec<(Place, u32)> {
    let mut found = Vec::new();
    let mut size = leaf.size.saturating_mul(4);
    while size <= largest {
        for direction in 0..27 {
            let steps = [direction % 3, direction / 3 % 3, direction / 9];
            let place = [0, 1, 2].map(|axis| match steps[axis] {
                0 => leaf.low[axis].checked_sub(leaf.size),
                step => Some(leaf.low[axis] + (step - 1) * leaf.size),
            });
            let [Some(x), Some(y), Some(z)] = place else {
                continue;
            };
            let beyond = |axis: usize| [x, y, z][axis] >= lattice.top[axis];
            if !(0..3).any(beyond) {
                // Larger nodes lie at multiples of their size.
                found.push(([x, y, z].map(|place| place / size * size), size));
            }
        }
        size = size.saturating_mul(2);
    }
    found.retain(|node| known.contains(node));
    found
}
