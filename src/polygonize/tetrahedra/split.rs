//! How cells are divided into tetrahedra.
//!
//! Places are those of [`super::super::simplices::Lattice`], relative to a cell's lowest corner: a cell extends from 0
//! to 2 along every axis. All tetrahedra have positive orientation.

use crate::polygonize::options::Split;

/// The corners of a tetrahedron.
pub(super) type Tetrahedron = [[i32; 3]; 4];

/// The tetrahedra that belong to a cell.
pub(super) struct Pattern {
    /// Those in the cell itself, by the parity of the sum of its indices.
    pub(super) cell: [Vec<Tetrahedron>; 2],
    /// Those between the centres of the cell and of the one below it along each axis.
    pub(super) between: [Vec<Tetrahedron>; 3],
    /// Those at a side of the box, by axis and end.
    pub(super) wall: [[Vec<Tetrahedron>; 2]; 3],
}

impl Pattern {
    /// The pattern of a split.
    pub(super) fn new(split: Split) -> Self {
        let mut pattern = Pattern {
            cell: [const { Vec::new() }; 2],
            between: [const { Vec::new() }; 3],
            wall: [const { [const { Vec::new() }; 2] }; 3],
        };
        match split {
            Split::Five => pattern.cell = [five(0), five(7)],
            Split::Six => pattern.cell = [six(), six()],
            Split::Twelve => {
                let all: Vec<Tetrahedron> =
                    sides().flat_map(|(axis, end)| wall(axis, end)).collect();
                pattern.cell = [all.clone(), all];
            }
            Split::TwentyFour => {
                let all: Vec<Tetrahedron> =
                    sides().flat_map(|(axis, end)| fan(axis, end)).collect();
                pattern.cell = [all.clone(), all];
            }
            Split::Centred => {
                for axis in 0..3 {
                    pattern.between[axis] = between(axis);
                    pattern.wall[axis] = [wall(axis, 0), wall(axis, 1)];
                }
            }
        }
        pattern
    }

    /// The points that the tetrahedra of one cell have, at a side of the box or not.
    pub(super) fn points(&self) -> Vec<[i32; 3]> {
        let walls = self.wall.iter().flatten();
        let lists = self.cell.iter().chain(&self.between).chain(walls);
        let mut points: Vec<[i32; 3]> = lists.flatten().flatten().copied().collect();
        points.sort_unstable();
        points.dedup();
        points
    }
}

/// The sides of a cell.
fn sides() -> impl Iterator<Item = (usize, usize)> {
    (0..3).flat_map(|axis| [(axis, 0), (axis, 1)])
}

/// The place of a cell's corner; bit a of its number is its coordinate along axis a.
fn corner(number: usize) -> [i32; 3] {
    [0, 1, 2].map(|axis| 2 * (number >> axis & 1) as i32)
}

/// The corners of a side, in a ring that begins with the lowest.
fn ring(axis: usize, end: usize) -> [usize; 4] {
    let base = end << axis;
    let (one, other) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
    [base, base | one, base | one | other, base | other]
}

/// The tetrahedron, turned to positive orientation.
fn oriented(corners: [[i32; 3]; 4]) -> Tetrahedron {
    let [a, b, c, d] = corners;
    let from_a = |p: [i32; 3]| [0, 1, 2].map(|axis| p[axis] - a[axis]);
    let [u, v, w] = [b, c, d].map(from_a);
    let cross = [
        v[1] * w[2] - v[2] * w[1],
        v[2] * w[0] - v[0] * w[2],
        v[0] * w[1] - v[1] * w[0],
    ];
    let volume: i32 = (0..3).map(|axis| u[axis] * cross[axis]).sum();
    if volume > 0 { corners } else { [a, b, d, c] }
}

/// Five tetrahedra: one that is regular in a cube, and one at each of the corners that it leaves.
/// `cut` is one of these; in neighbouring cells they are opposite ones.
fn five(cut: usize) -> Vec<Tetrahedron> {
    // The parity of a corner is that of the number of its upper coordinates.
    let is_cut = |number: &usize| (number ^ cut).count_ones().is_multiple_of(2);
    let middle: Vec<usize> = (0..8).filter(|number| !is_cut(number)).collect();
    let corners = (0..8)
        .filter(is_cut)
        .map(|number| oriented([number, number ^ 1, number ^ 2, number ^ 4].map(corner)));
    let middle = middle
        .as_array()
        .map(|middle: &[usize; 4]| oriented(middle.map(corner)));
    corners.chain(middle).collect()
}

/// Six tetrahedra around a diagonal of the cell, one for each order in which the axes can be gone
/// along (Freudenthal 1942, Kuhn 1960). They are alike in all cells.
fn six() -> Vec<Tetrahedron> {
    const ORDERS: [[usize; 3]; 6] = [
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [1, 2, 0],
        [2, 0, 1],
        [2, 1, 0],
    ];
    let path = |[one, two, _]: [usize; 3]| [0, 1 << one, 1 << one | 1 << two, 7];
    let tetrahedron = |order| oriented(path(order).map(corner));
    ORDERS.map(tetrahedron).to_vec()
}

/// From the centre to both triangles of a side, which its diagonal divides.
fn wall(axis: usize, end: usize) -> Vec<Tetrahedron> {
    let [a, b, c, d] = ring(axis, end).map(corner);
    [[a, b, c], [a, c, d]]
        .map(|[p, q, r]| oriented([[1; 3], p, q, r]))
        .to_vec()
}

/// From the centre to the four triangles of a side around its own centre.
fn fan(axis: usize, end: usize) -> Vec<Tetrahedron> {
    let mut middle = [1; 3];
    middle[axis] = 2 * end as i32;
    around([[1; 3], middle], axis, end)
}

/// The four tetrahedra around the line from the centre to that of the cell below: of the
/// body-centred cubic lattice.
fn between(axis: usize) -> Vec<Tetrahedron> {
    let mut below = [1; 3];
    below[axis] = -1;
    around([[1; 3], below], axis, 0)
}

/// From a line to the four edges of a side.
fn around([from, to]: [[i32; 3]; 2], axis: usize, end: usize) -> Vec<Tetrahedron> {
    let ring = ring(axis, end).map(corner);
    let edge = |step: usize| oriented([from, to, ring[step], ring[(step + 1) % 4]]);
    [0, 1, 2, 3].map(edge).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Six times the volume.
    fn volume([a, b, c, d]: Tetrahedron) -> i32 {
        let vector = |p: [i32; 3]| glam::IVec3::from_array(p) - glam::IVec3::from_array(a);
        vector(b).dot(vector(c).cross(vector(d)))
    }

    #[test]
    fn tetrahedra_are_as_many_as_the_split_says_and_fill_the_cell() {
        for (split, count) in [
            (Split::Five, 5),
            (Split::Six, 6),
            (Split::Twelve, 12),
            (Split::TwentyFour, 24),
        ] {
            for cell in Pattern::new(split).cell {
                assert_eq!(cell.len(), count);
                assert!(cell.iter().all(|&own| volume(own) > 0));
                // 6 · 2³
                assert_eq!(cell.into_iter().map(volume).sum::<i32>(), 48);
            }
        }
        // Of every cell of the lattice a half belongs to each of two cells' sides.
        let centred = Pattern::new(Split::Centred);
        let all = centred.between.iter().flatten();
        assert_eq!(all.clone().count(), 12);
        assert_eq!(all.map(|&own| volume(own)).sum::<i32>(), 48);
        let walls = centred.wall.iter().flatten().flatten();
        assert_eq!(walls.map(|&own| volume(own)).sum::<i32>(), 48);
    }
}
