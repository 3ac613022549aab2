//! The cells of a proof, in R2 and R3 alike: squares of a quadtree or cubes of an octree, and the
//! simplices that they are divided into.

use super::super::octree::Node;
use super::super::octree::decompose::Decomposition;
use super::super::simplices::{Lattice, Place};
use crate::geometry::Bounds;
use crate::graph::Interval;

/// How many cells there are along the longest side of the box at first.
const COARSE: f64 = 8.0;

/// How often cells can be halved: points are numbered by 63 bits.
pub(super) const FINEST: u32 = 16;

/// The name of a cell: its place and its size.
pub(super) type Key = (Place, u32);

/// The name of a node.
pub(super) fn key(node: &Node) -> Key {
    (node.low, node.size)
}

/// The tree's frame: the lattice of its points and the cells of the coarsest level.
pub(super) struct Frame {
    pub(super) dimension: usize,
    pub(super) lattice: Lattice,
    /// The number of cells of the coarsest level along each axis; 1 in R2 along the third.
    pub(super) coarse: [u32; 3],
}

impl Frame {
    /// The frame of a box, with cells that are nearly cubes.
    pub(super) fn of_box(bounds: &Bounds) -> Option<Frame> {
        let cell = bounds.size().max_element() / COARSE;
        let mut coarse = [1; 3];
        for (count, (low, high)) in coarse.iter_mut().zip(bounds.sides()) {
            *count = ((high - low) / cell).round().clamp(1.0, COARSE) as u32;
        }
        Frame::new(bounds, coarse)
    }

    /// The frame with so many coarse cells; `None` if there are none, or too many.
    pub(super) fn new(bounds: &Bounds, coarse: [u32; 3]) -> Option<Frame> {
        if coarse
            .iter()
            .any(|&count| count == 0 || f64::from(count) > COARSE)
        {
            return None;
        }
        let cells = coarse.map(|count| (count as usize) << FINEST);
        Some(Frame {
            dimension: bounds.dimension,
            lattice: Lattice::large(bounds, cells)?,
            coarse,
        })
    }

    /// The cells of the coarsest level, in the order in which a certificate lists them.
    pub(super) fn roots(&self) -> Vec<Node> {
        let size = 2 << FINEST;
        let [x, y, z] = self.coarse;
        let place = |number: u32| [number % x, number / x % y, number / (x * y)];
        (0..x * y * z)
            .map(|number| Node {
                level: 0,
                low: place(number).map(|index| index * size),
                size,
            })
            .collect()
    }

    /// The halves of a cell along each axis, in the order in which a certificate lists them.
    pub(super) fn children(&self, node: &Node) -> impl Iterator<Item = Node> + use<> {
        node.children().take(1 << self.dimension)
    }

    /// The sides of a cell as intervals.
    pub(super) fn sides(&self, node: &Node) -> [Interval; 3] {
        self.hull(&[node.low, node.at([2; 3])])
    }

    /// The smallest box that holds these places. An axis that is not there is the point 0.
    pub(super) fn hull(&self, places: &[Place]) -> [Interval; 3] {
        let mut sides = [Interval::new(0.0, 0.0); 3];
        for (axis, side) in sides.iter_mut().enumerate().take(self.dimension) {
            let coordinate = |place: &Place| self.lattice.coordinate(axis, place[axis]);
            *side = places.iter().fold(Interval::EMPTY, |hull, place| {
                let value = coordinate(place);
                hull.hull(Interval::new(value, value))
            });
        }
        sides
    }

    /// The axes along which a place is at a side of the box, as bits.
    pub(super) fn border(&self, place: Place) -> u8 {
        let at_side = |axis: usize| place[axis] == 0 || place[axis] == self.lattice.top[axis];
        (0..self.dimension)
            .map(|axis| u8::from(at_side(axis)) << axis)
            .sum()
    }

    /// Whether all these places lie in one side of the box.
    pub(super) fn in_one_side(&self, places: &[Place]) -> bool {
        (0..self.dimension).any(|axis| {
            let within = |side: u32| places.iter().all(|place| place[axis] == side);
            within(0) || within(self.lattice.top[axis])
        })
    }

    /// Whether a cell touches a side of the box.
    pub(super) fn touches_side(&self, node: &Node) -> bool {
        (0..self.dimension)
            .any(|axis| node.low[axis] == 0 || node.low[axis] + node.size == self.lattice.top[axis])
    }

    /// The names of cells of half the size up to twice the size that may touch a cell.
    pub(super) fn neighbours(&self, node: &Node) -> Vec<Key> {
        let mut keys = Vec::new();
        let top = self.lattice.top;
        for size in [node.size / 2, node.size, 2 * node.size] {
            if size < 2 {
                continue;
            }
            let range = |axis: usize| {
                let low = node.low[axis].saturating_sub(1) / size;
                let high = (node.low[axis] + node.size).min(top[axis] - 1) / size;
                low..=high
            };
            for x in range(0) {
                for y in range(1) {
                    for z in if self.dimension == 3 { range(2) } else { 0..=0 } {
                        keys.push(([x, y, z].map(|step| step * size), size));
                    }
                }
            }
        }
        keys
    }

    /// Calls `visit` with the corners of all simplices of a cell: its centre first, then in R3 the
    /// middle of a square in its boundary, then both ends of an edge.
    pub(super) fn for_each_simplex(
        &self,
        decomposition: &Decomposition,
        node: &Node,
        mut visit: impl FnMut(&[Place]),
    ) {
        match self.dimension {
            2 => decomposition.for_each_triangle(node, |corners| visit(&corners)),
            _ => decomposition.for_each_tetrahedron(node, |corners| visit(&corners)),
        }
    }
}
