//! The curves in which a level set meets the surface of a cube, and the regions between them.
//!
//! Walk around each face of the cube, counter-clockwise seen from outside the cube. Every run of
//! inside corners is cut off by one oriented segment, from the edge where the walk enters the run
//! to the edge where it leaves it; or, on an ambiguous face (with two inside corners across a
//! diagonal) whose inside corners are joined, every run of outside corners is. The rule looks at
//! nothing but the face, so that the two cubes that share a face draw the same segments on it, in
//! opposite directions: the surface has no cracks.
//!
//! Every crossed edge of the cube lies in two faces; in one a segment ends there, in the other
//! one begins. The segments therefore join to disjoint oriented loops. The tracing follows
//! Bloomenthal, "Polygonization of implicit surfaces", Computer Aided Geometric Design 5 (1988).
//!
//! Corner c of the cube lies at (c & 1, c >> 1 & 1, c >> 2 & 1). Edge 4·axis + k runs along
//! `axis` from the k-th (in ascending order) of the corners that have coordinate 0 there.

/// The cube's edges as (lower corner, axis).
pub(in crate::polygonize) const EDGES: [(usize, usize); 12] = [
    (0, 0),
    (2, 0),
    (4, 0),
    (6, 0),
    (0, 1),
    (1, 1),
    (4, 1),
    (5, 1),
    (0, 2),
    (1, 2),
    (2, 2),
    (3, 2),
];

/// The corners of the six faces, counter-clockwise seen from outside the cube.
pub(super) const FACES: [[usize; 4]; 6] = [
    [0, 4, 6, 2],
    [1, 3, 7, 5],
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 2, 3, 1],
    [4, 5, 7, 6],
];

/// One of the curves.
pub(in crate::polygonize) struct Loop {
    /// The crossed edges in the order of the curve: counter-clockwise about the part of the level
    /// set that it bounds, seen from outside the level set.
    pub(in crate::polygonize) edges: Vec<usize>,
    /// The region on the cube's surface that it bounds from the inside: the least of its corners.
    pub(super) inside: usize,
    /// The same for the other side.
    pub(super) outside: usize,
}

/// Whether an edge lies in a face, by their numbers.
pub(in crate::polygonize) fn is_in_face(edge: usize, face: usize) -> bool {
    ends(edge).iter().all(|corner| FACES[face].contains(corner))
}

/// Whether bit `corner` of a case is set: whether the corner is inside.
pub(super) fn is_inside(case: u8, corner: usize) -> bool {
    case >> corner & 1 == 1
}

/// The faces of a case with two inside corners across a diagonal, as bits.
pub(in crate::polygonize) fn ambiguous_faces(case: u8) -> u8 {
    let ambiguous = |face: &[usize; 4]| {
        let [a, b, c, d] = face.map(|corner| is_inside(case, corner));
        a == c && b == d && a != b
    };
    let bit = |(number, face)| u8::from(ambiguous(face)) << number;
    FACES.iter().enumerate().map(bit).sum()
}

/// The loops of a case. Bit c of `case` tells whether corner c is inside, bit f of `joined`
/// whether the inside corners of face f are joined if it is ambiguous.
pub(in crate::polygonize) fn loops(case: u8, joined: u8) -> Vec<Loop> {
    let joined = joined & ambiguous_faces(case);
    let mut following = [None; 12];
    for (number, face) in FACES.into_iter().enumerate() {
        let corner = |step: usize| face[step % 4];
        let edge = |step: usize| edge_between(corner(step), corner(step + 1));
        for entry in 0..4 {
            if is_inside(case, corner(entry)) || !is_inside(case, corner(entry + 1)) {
                continue;
            }
            // The run that begins at corner entry + 1 ends within three steps, because corner
            // `entry` is outside. On an ambiguous face the run before has ended one step earlier.
            let exit = match joined >> number & 1 {
                0 => (entry + 1..entry + 4).find(|&step| !is_inside(case, corner(step + 1))),
                _ => Some(entry + 3),
            };
            following[edge(entry)] = exit.map(edge);
        }
    }
    let regions = regions(case, joined);
    let mut loops = Vec::new();
    for first in 0..12 {
        let mut edges = Vec::new();
        let mut edge = first;
        while let Some(next) = following[edge].take() {
            edges.push(edge);
            edge = next;
        }
        if !edges.is_empty() {
            let ends = ends(first);
            let [inside, outside] = match is_inside(case, ends[0]) {
                true => ends,
                false => [ends[1], ends[0]],
            };
            loops.push(Loop {
                edges,
                inside: regions[inside],
                outside: regions[outside],
            });
        }
    }
    loops
}

/// For each corner the least corner of its region on the cube's surface: those that are connected
/// to it by edges with equal ends and across ambiguous faces.
pub(super) fn regions(case: u8, joined: u8) -> [usize; 8] {
    let mut regions = [0, 1, 2, 3, 4, 5, 6, 7];
    let mut connect = |one: usize, other: usize| {
        let (kept, gone) = (
            regions[one].min(regions[other]),
            regions[one].max(regions[other]),
        );
        for region in &mut regions {
            if *region == gone {
                *region = kept;
            }
        }
    };
    for edge in 0..12 {
        let [one, other] = ends(edge);
        if is_inside(case, one) == is_inside(case, other) {
            connect(one, other);
        }
    }
    let ambiguous = ambiguous_faces(case);
    for (number, [a, b, c, d]) in FACES.into_iter().enumerate() {
        if ambiguous >> number & 1 == 1 {
            if is_inside(case, a) == (joined >> number & 1 == 1) {
                connect(a, c);
            } else {
                connect(b, d);
            }
        }
    }
    regions
}

/// The two ends of an edge.
pub(super) fn ends(edge: usize) -> [usize; 2] {
    let (corner, axis) = EDGES[edge];
    [corner, corner | 1 << axis]
}

/// The edge between two neighbouring corners.
pub(in crate::polygonize) fn edge_between(one: usize, other: usize) -> usize {
    let lower = one.min(other);
    let axis = (one ^ other).trailing_zeros() as usize;
    // Leaving out the bit of the axis, which is 0, ranks the lower corner among its like.
    let bits_below = (1 << axis) - 1;
    4 * axis + (lower & bits_below | lower >> 1 & !bits_below)
}

/// Whether two edges lie in one face of the cube.
pub(super) fn in_common_face(one: usize, other: usize) -> bool {
    FACES.iter().any(|face| {
        let mut corners = ends(one).into_iter().chain(ends(other));
        corners.all(|corner| face.contains(&corner))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_are_numbered_as_documented_and_found_by_their_corners() {
        for (number, &(corner, axis)) in EDGES.iter().enumerate() {
            assert_eq!(number / 4, axis);
            assert_eq!(corner >> axis & 1, 0);
            assert_eq!(edge_between(corner | 1 << axis, corner), number);
        }
    }

    #[test]
    fn faces_are_counter_clockwise_seen_from_outside() {
        let position = |corner: usize| {
            glam::DVec3::from_array([0, 1, 2].map(|axis| (corner >> axis & 1) as f64))
        };
        for face in FACES {
            let [a, b, c, d] = face.map(position);
            let outward = (a + b + c + d) / 4.0 - glam::DVec3::splat(0.5);
            assert!((b - a).cross(c - b).dot(outward) > 0.0);
            assert!((d - c).cross(a - d).dot(outward) > 0.0);
        }
    }

    /// Loops on a sphere lie between regions like the edges of a tree between its vertices.
    #[test]
    fn there_is_one_loop_less_than_regions() {
        for case in 1..255u8 {
            for joined in (0..64).filter(|joined| joined & !ambiguous_faces(case) == 0) {
                let mut regions = regions(case, joined).to_vec();
                regions.sort_unstable();
                regions.dedup();
                let loops = loops(case, joined);
                assert_eq!(
                    loops.len() + 1,
                    regions.len(),
                    "case {case}, joined {joined}"
                );
                for polygon in loops {
                    assert!(is_inside(case, polygon.inside) && !is_inside(case, polygon.outside));
                }
            }
        }
    }
}
