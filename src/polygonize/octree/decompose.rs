//! Leaves as tetrahedra that fit together.
//!
//! The smallest sides are those of leaves that no smaller leaf touches from beyond; a larger leaf's
//! side is made of them. Likewise edges. Around the centre of each smallest side it is divided up
//! to its smallest edges, and from the triangles to the leaf's centre there are tetrahedra. What a
//! smallest side or edge is depends on nothing but a set of points, so that all leaves that share
//! one see the same: the corners of leaves and of everything that a division made beside them.
//! Of these the latter are needed because not all parts of what was divided are here: a side that
//! one part alone divides has its edges divided, too.

use rayon::prelude::*;
use rustc_hash::FxHashSet;

use super::super::simplices::{Lattice, Place};
use super::{CHUNK, Node};

/// What the division of all leaves depends on.
pub(in crate::polygonize) struct Decomposition<'a> {
    pub(in crate::polygonize) lattice: &'a Lattice,
    /// The numbers of the corners of all parts of what was divided.
    corners: FxHashSet<u64>,
}

/// A square in a side of a leaf.
#[derive(Clone, Copy)]
struct Square {
    low: Place,
    size: u32,
    /// The axes that it extends along: turning from the first to the second is counter-clockwise
    /// seen from outside the leaf.
    axes: [usize; 2],
}

impl Square {
    /// The place so many halves of its side from the lowest corner along its axes.
    fn at(&self, halves: [u32; 2]) -> Place {
        let mut place = self.low;
        for (axis, halves) in self.axes.into_iter().zip(halves) {
            place[axis] += halves * (self.size / 2);
        }
        place
    }
}

impl<'a> Decomposition<'a> {
    /// For these leaves.
    pub(in crate::polygonize) fn new(lattice: &'a Lattice, leaves: &[Node]) -> Self {
        let mut divided: FxHashSet<(Place, u32)> = FxHashSet::default();
        let mut corners: FxHashSet<u64> = FxHashSet::default();
        for leaf in leaves {
            let mut node = *leaf;
            while node.level > 0 {
                node = node.parent();
                if !divided.insert((node.low, node.size)) {
                    break;
                }
                let points = (0..27).map(|number| [number % 3, number / 3 % 3, number / 9]);
                corners.extend(points.map(|halves| lattice.key(node.at(halves))));
            }
        }
        Decomposition { lattice, corners }
    }

    /// The numbers of all points that the tetrahedra have, ascending.
    pub(in crate::polygonize) fn points(&self, leaves: &[Node]) -> Vec<u64> {
        let of_chunk = |leaves: &[Node]| {
            let mut points = Vec::new();
            for leaf in leaves {
                self.for_each_tetrahedron(leaf, |corners| {
                    points.extend(corners.map(|place| self.lattice.key(place)));
                });
            }
            points.sort_unstable();
            points.dedup();
            points
        };
        let mut points: Vec<u64> = leaves.par_chunks(CHUNK).flat_map_iter(of_chunk).collect();
        points.par_sort_unstable();
        points.dedup();
        points
    }

    /// Calls `visit` with the corners of every tetrahedron of a leaf, all of positive orientation.
    pub(in crate::polygonize) fn for_each_tetrahedron(
        &self,
        leaf: &Node,
        mut visit: impl FnMut([Place; 4]),
    ) {
        let center = leaf.at([1; 3]);
        let mut squares = Vec::with_capacity(12);
        for axis in 0..3 {
            let [one, other] = [(axis + 1) % 3, (axis + 2) % 3];
            let mut upper = leaf.low;
            upper[axis] += leaf.size;
            for (low, axes) in [(leaf.low, [other, one]), (upper, [one, other])] {
                squares.push(Square {
                    low,
                    size: leaf.size,
                    axes,
                });
            }
        }
        let mut edges = Vec::with_capacity(8);
        while let Some(square) = squares.pop() {
            let middle = square.at([1; 2]);
            if self.is_corner(middle, square.size) {
                squares.extend([[0, 0], [1, 0], [1, 1], [0, 1]].map(|halves| Square {
                    low: square.at(halves),
                    size: square.size / 2,
                    ..square
                }));
                continue;
            }
            let ring = [[0, 0], [2, 0], [2, 2], [0, 2]].map(|halves| square.at(halves));
            edges.extend((0..4).map(|step| (ring[step], ring[(step + 1) % 4], square.size)));
            self.divide_edges(&mut edges, |[from, to]| visit([center, middle, from, to]));
        }
    }

    /// The same in the plane, for leaves that are the squares in the lattice's lowest layer: calls
    /// `visit` with the corners of every triangle, counter-clockwise.
    pub(in crate::polygonize) fn for_each_triangle(
        &self,
        leaf: &Node,
        mut visit: impl FnMut([Place; 3]),
    ) {
        let center = leaf.at([1, 1, 0]);
        let ring = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]].map(|halves| leaf.at(halves));
        let mut edges = Vec::with_capacity(8);
        edges.extend((0..4).map(|step| (ring[step], ring[(step + 1) % 4], leaf.size)));
        self.divide_edges(&mut edges, |[from, to]| visit([center, from, to]));
    }

    /// Empties a list of edges with their lengths: calls `visit` with the ends of all smallest edges
    /// that they are made of.
    fn divide_edges(
        &self,
        edges: &mut Vec<(Place, Place, u32)>,
        mut visit: impl FnMut([Place; 2]),
    ) {
        while let Some((from, to, length)) = edges.pop() {
            let between = [0, 1, 2].map(|axis| from[axis].midpoint(to[axis]));
            if self.is_corner(between, length) {
                edges.extend([(from, between, length / 2), (between, to, length / 2)]);
            } else {
                visit([from, to]);
            }
        }
    }

    /// Whether the middle of something of this size is a corner of a leaf. Leaves have sides of
    /// two places at least.
    fn is_corner(&self, middle: Place, size: u32) -> bool {
        size > 2 && self.corners.contains(&self.lattice.key(middle))
    }
}
