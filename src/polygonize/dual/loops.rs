//! How the surface passes through a cell: the crossed edges of a cube as loops.
//!
//! On each face of the cube oriented segments join the crossed edges (see the case table of
//! marching cubes for the rule and the numbers of corners, edges and faces); each crossed edge
//! lies in two faces, so that segments join to loops. Each loop becomes one vertex of the dual
//! mesh: G. M. Nielson, "Dual marching cubes", IEEE Visualization 2004.
//!
//! An ambiguous face, with two inside corners across a diagonal, has two segments. If both belong
//! to one loop in either of the two cubes, two edges of the dual mesh would have the same ends,
//! and four facets would meet there (R. Wenger, Isosurfaces, 2013, section 3.4). There the face is
//! *turned*: it joins the inside corners rather than separating them. Orientation sees to it that
//! this splits the loop in both cubes.

use std::sync::LazyLock;

use crate::polygonize::cubes;

/// What stands for no loop.
const NONE: u8 = u8::MAX;

/// The loops of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Loops {
    /// How many there are.
    pub(super) count: u8,
    /// The loop that goes through each edge; of no meaning for edges that are not crossed.
    pub(super) of_edge: [u8; 12],
    /// Bit f: face f is ambiguous and both of its segments belong to one loop.
    pub(super) doubled: u8,
}

static TABLE: LazyLock<[Loops; 256]> =
    LazyLock::new(|| std::array::from_fn(|case| Loops::trace(case as u8, 0)));

impl Loops {
    /// The loops of a case, of which bit c tells whether corner c is inside.
    pub(super) fn of_case(case: u8) -> &'static Loops {
        &TABLE[usize::from(case)]
    }

    /// The loops of a case with some ambiguous faces turned, by their bits.
    pub(super) fn trace(case: u8, turned: u8) -> Loops {
        let mut loops = Loops {
            count: 0,
            of_edge: [NONE; 12],
            doubled: 0,
        };
        for own in cubes::loops(case, turned) {
            for edge in own.edges {
                loops.of_edge[edge] = loops.count;
            }
            loops.count += 1;
        }
        let ambiguous = cubes::ambiguous_faces(case);
        for face in (0..6).filter(|face| ambiguous >> face & 1 == 1) {
            // All four edges of an ambiguous face are crossed.
            let mut edges = (0..12).filter(|&edge| cubes::is_in_face(edge, face));
            let first = edges.next().map(|edge| loops.of_edge[edge]);
            if edges.all(|edge| Some(loops.of_edge[edge]) == first) {
                loops.doubled |= 1 << face;
            }
        }
        loops
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_crossed_edge_is_in_one_loop() {
        for case in 0..=255u8 {
            let loops = Loops::of_case(case);
            for (edge, (lower, axis)) in cubes::EDGES.into_iter().enumerate() {
                let upper = lower + (1 << axis);
                let crossed = (case >> lower ^ case >> upper) & 1 == 1;
                assert_eq!(loops.of_edge[edge] != NONE, crossed, "{case} {edge}");
                assert!(!crossed || loops.of_edge[edge] < loops.count);
            }
        }
    }

    #[test]
    fn turning_a_doubled_face_splits_its_loop() {
        let mut doubled = 0;
        for case in 0..=255u8 {
            let loops = Loops::of_case(case);
            for face in 0..6 {
                if loops.doubled >> face & 1 == 1 {
                    doubled += 1;
                    let turned = Loops::trace(case, 1 << face);
                    assert_eq!(turned.count, loops.count + 1, "{case} {face}");
                    assert_eq!(turned.doubled >> face & 1, 0);
                }
            }
        }
        assert!(doubled > 0);
    }

    #[test]
    fn one_inside_corner_gives_one_loop_of_three_edges() {
        for corner in 0..8 {
            let loops = Loops::of_case(1 << corner);
            assert_eq!(loops.count, 1);
            let edges = loops.of_edge.iter().filter(|&&own| own == 0).count();
            assert_eq!(edges, 3);
        }
    }
}
