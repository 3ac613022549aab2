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

use crate::polygonize::cubes::{FACES, edge_between};

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
        let mut label: [u8; 12] = std::array::from_fn(|edge| edge as u8);
        let segments = FACES.map(|face| face_segments(case, face));
        for (face, pairs) in segments.iter().enumerate() {
            for [from, to] in joined(pairs, turned >> face & 1 == 1) {
                let (keep, drop) = (label[from].min(label[to]), label[from].max(label[to]));
                for own in label.iter_mut().filter(|own| **own == drop) {
                    *own = keep;
                }
                (loops.of_edge[from], loops.of_edge[to]) = (0, 0);
            }
        }
        for edge in 0..12 {
            if loops.of_edge[edge] == NONE {
                continue;
            }
            let first = usize::from(label[edge]);
            if first == edge {
                loops.of_edge[edge] = loops.count;
                loops.count += 1;
            } else {
                loops.of_edge[edge] = loops.of_edge[first];
            }
        }
        for (face, pairs) in segments.iter().enumerate() {
            if let [one, other] = pairs[..]
                && label[one[0]] == label[one[1]]
                && label[one[0]] == label[other[0]]
                && label[one[0]] == label[other[1]]
            {
                loops.doubled |= 1 << face;
            }
        }
        loops
    }
}

/// The segments on a face that cut off runs of inside corners, as the edges from which and to
/// which they lead.
fn face_segments(case: u8, face: [usize; 4]) -> Vec<[usize; 2]> {
    let inside = |step: usize| case >> face[step % 4] & 1 == 1;
    let edge = |step: usize| edge_between(face[step % 4], face[(step + 1) % 4]);
    let entries = (0..4).filter(|&step| !inside(step) && inside(step + 1));
    entries
        .filter_map(|entry| {
            let exit = (entry + 1..entry + 4).find(|&step| !inside(step + 1))?;
            Some([edge(entry), edge(exit)])
        })
        .collect()
}

/// The same, or if the face is turned and ambiguous those that cut off the outside corners.
fn joined(segments: &[[usize; 2]], is_turned: bool) -> Vec<[usize; 2]> {
    match segments {
        [one, other] if is_turned => vec![[one[0], other[1]], [other[0], one[1]]],
        _ => segments.to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The faces with four crossed edges.
    fn ambiguous_faces(case: u8) -> u8 {
        let faces = FACES.iter().enumerate();
        let two = faces.filter(|(_, face)| face_segments(case, **face).len() == 2);
        two.map(|(face, _)| 1 << face).sum()
    }

    #[test]
    fn every_crossed_edge_is_in_one_loop() {
        for case in 0..=255u8 {
            let loops = Loops::of_case(case);
            for (edge, (lower, axis)) in crate::polygonize::cubes::EDGES.into_iter().enumerate() {
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
            assert_eq!(loops.doubled & !ambiguous_faces(case), 0);
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
