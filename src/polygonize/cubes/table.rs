//! The case table of marching cubes, derived from one rule instead of typed in.
//!
//! Walk around each face of the cube, counter-clockwise seen from outside the cube. Every run of
//! inside corners is cut off by one oriented segment, from the edge where the walk enters the run
//! to the edge where it leaves it. The rule looks at nothing but the four corners of the face, so
//! that the two cubes that share a face draw the same segments on it, in opposite directions:
//! the surface has no cracks. (On an ambiguous face, with two inside corners across a diagonal,
//! it separates these corners.)
//!
//! Every crossed edge of the cube lies in two faces; in one a segment ends there, in the other
//! one begins. The segments therefore join to disjoint oriented loops, which are triangulated
//! without a diagonal that lies in a face: such a diagonal could coincide with one of the
//! neighbouring cube and be shared by four triangles. Lorensen and Cline, "Marching cubes",
//! SIGGRAPH 1987, is the source of the table's use; the tracing of loops follows Bloomenthal,
//! "Polygonization of implicit surfaces", Computer Aided Geometric Design 5 (1988).
//!
//! Corner c of the cube lies at (c & 1, c >> 1 & 1, c >> 2 & 1). Edge 4·axis + k runs along
//! `axis` from the k-th (in ascending order) of the corners that have coordinate 0 there.

use std::sync::LazyLock;

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
const FACES: [[usize; 4]; 6] = [
    [0, 4, 6, 2],
    [1, 3, 7, 5],
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 2, 3, 1],
    [4, 5, 7, 6],
];

/// The triangles of each of the 256 cases.
pub(in crate::polygonize) static TABLE: LazyLock<CaseTable> = LazyLock::new(CaseTable::generate);

/// Triangles of all cases in one list, and where each case starts in it.
pub(in crate::polygonize) struct CaseTable {
    starts: [usize; 257],
    triangles: Vec<[u8; 3]>,
}

impl CaseTable {
    /// The triangles of a case, as triples of edges, counter-clockwise seen from outside the
    /// surface. Bit c of `case` tells whether corner c is inside.
    pub(in crate::polygonize) fn triangles(&self, case: u8) -> &[[u8; 3]] {
        let case = usize::from(case);
        &self.triangles[self.starts[case]..self.starts[case + 1]]
    }

    fn generate() -> Self {
        let mut table = CaseTable {
            starts: [0; 257],
            triangles: Vec::new(),
        };
        for case in 0..=255u8 {
            for polygon in loops(case) {
                triangulate(&polygon, &mut table.triangles);
            }
            table.starts[usize::from(case) + 1] = table.triangles.len();
        }
        table
    }
}

/// The edge between two neighbouring corners.
fn edge_between(one: usize, other: usize) -> usize {
    let lower = one.min(other);
    let axis = (one ^ other).trailing_zeros() as usize;
    // Leaving out the bit of the axis, which is 0, ranks the lower corner among its like.
    let bits_below = (1 << axis) - 1;
    4 * axis + (lower & bits_below | lower >> 1 & !bits_below)
}

/// The oriented loops of crossed edges of a case.
fn loops(case: u8) -> Vec<Vec<usize>> {
    let inside = |corner: usize| case >> corner & 1 == 1;
    let mut following = [None; 12];
    for face in FACES {
        let corner = |step: usize| face[step % 4];
        for entry in 0..4 {
            if inside(corner(entry)) || !inside(corner(entry + 1)) {
                continue;
            }
            // The run that begins at corner entry + 1 ends within three steps, because corner
            // `entry` is outside.
            let exit = (entry + 1..entry + 4).find(|&step| !inside(corner(step + 1)));
            following[edge_between(corner(entry), corner(entry + 1))] =
                exit.map(|step| edge_between(corner(step), corner(step + 1)));
        }
    }
    let mut loops = Vec::new();
    for first in 0..12 {
        let mut polygon = Vec::new();
        let mut edge = first;
        while let Some(next) = following[edge].take() {
            polygon.push(edge);
            edge = next;
        }
        if !polygon.is_empty() {
            loops.push(polygon);
        }
    }
    loops
}

/// Appends the triangulation of a loop that has no diagonal in a face of the cube and, among
/// these, the least sum of squared diagonals with the crossings in the middle of the edges.
///
/// The classical dynamic programme over the chains from vertex `first` to vertex `last`.
fn triangulate(polygon: &[usize], triangles: &mut Vec<[u8; 3]>) {
    let count = polygon.len();
    let mut least = vec![vec![0.0; count]; count];
    let mut apex = vec![vec![0; count]; count];
    for length in 2..count {
        for first in 0..count - length {
            let last = first + length;
            let (cost, middle) = (first + 1..last)
                .map(|middle| (least[first][middle] + least[middle][last], middle))
                .fold((f64::INFINITY, first + 1), |best, next| {
                    if next.0 < best.0 { next } else { best }
                });
            let is_side = length == count - 1;
            let diagonal = if is_side {
                0.0
            } else {
                diagonal_cost(polygon[first], polygon[last])
            };
            least[first][last] = cost + diagonal;
            apex[first][last] = middle;
        }
    }
    let mut chains = vec![(0, count - 1)];
    while let Some((first, last)) = chains.pop() {
        if last - first >= 2 {
            let middle = apex[first][last];
            triangles.push([first, middle, last].map(|vertex| polygon[vertex] as u8));
            chains.extend([(middle, last), (first, middle)]);
        }
    }
}

/// The squared length of the diagonal between two crossed edges, infinite in a face.
fn diagonal_cost(one: usize, other: usize) -> f64 {
    if in_common_face(one, other) {
        return f64::INFINITY;
    }
    // Twice the middle of an edge, in integers.
    let middle = |edge: usize| {
        let (corner, axis) = EDGES[edge];
        [0, 1, 2].map(|a| 2 * (corner >> a & 1) as i32 + i32::from(a == axis))
    };
    let (from, to) = (middle(one), middle(other));
    (0..3).map(|a| f64::from((to[a] - from[a]).pow(2))).sum()
}

/// Whether two edges lie in one face of the cube.
fn in_common_face(one: usize, other: usize) -> bool {
    let ends = |edge: usize| {
        let (corner, axis) = EDGES[edge];
        [corner, corner | 1 << axis]
    };
    FACES.iter().any(|face| {
        let mut corners = ends(one).into_iter().chain(ends(other));
        corners.all(|corner| face.contains(&corner))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// How often each directed side occurs among the triangles of a case.
    fn directed_sides(case: u8) -> BTreeMap<(u8, u8), usize> {
        let mut sides = BTreeMap::new();
        for &[a, b, c] in TABLE.triangles(case) {
            for side in [(a, b), (b, c), (c, a)] {
                *sides.entry(side).or_default() += 1;
            }
        }
        sides
    }

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

    #[test]
    fn exactly_the_crossed_edges_are_vertices() {
        for case in 0..=255u8 {
            for (edge, &(corner, axis)) in EDGES.iter().enumerate() {
                let crossed = (case >> corner ^ case >> (corner | 1 << axis)) & 1 == 1;
                let mut vertices = TABLE.triangles(case).iter().flatten();
                assert_eq!(vertices.any(|&vertex| usize::from(vertex) == edge), crossed);
            }
        }
    }

    #[test]
    fn no_inner_side_lies_in_a_face_and_every_outer_side_does() {
        for case in 0..=255u8 {
            let sides = directed_sides(case);
            for (&(from, to), &count) in &sides {
                assert_eq!(count, 1, "case {case}: side {from}-{to} is repeated");
                let inner = sides.contains_key(&(to, from));
                let in_face = in_common_face(usize::from(from), usize::from(to));
                assert_ne!(inner, in_face, "case {case}: side {from}-{to}");
            }
        }
    }

    #[test]
    fn the_inside_corner_of_the_simplest_case_is_behind_its_triangle() {
        assert_eq!(TABLE.triangles(1).len(), 1);
        let mut triangle = TABLE.triangles(1)[0];
        let first = triangle.iter().position(|&edge| edge == 0).unwrap();
        triangle.rotate_left(first);
        // The edges along x, y and z from corner 0: the normal points to (1, 1, 1).
        assert_eq!(triangle, [0, 4, 8]);
    }

    /// All pairs of cases that share a face, along every axis: what one leaves open on the common
    /// face, the other closes.
    #[test]
    fn neighbouring_cases_match_on_their_common_face() {
        // The sides of a case that lie in the face `coordinate` of `axis`, as edges of the face
        // (edge numbers with the face's own coordinate removed).
        let open_sides = |case: u8, axis: usize, coordinate: usize| {
            let project = |edge: u8| {
                let (corner, along) = EDGES[usize::from(edge)];
                (along != axis && corner >> axis & 1 == coordinate)
                    .then_some((corner & !(1 << axis), along))
            };
            let mut sides: Vec<_> = directed_sides(case)
                .into_keys()
                .filter_map(|(from, to)| Some((project(from)?, project(to)?)))
                .collect();
            sides.sort_unstable();
            sides
        };
        // Whether the corners of `one` at coordinate 1 are those of `other` at coordinate 0.
        let agree = |one: u8, other: u8, axis: usize| {
            let mut corners = (0..8).filter(|corner| corner >> axis & 1 == 0);
            corners.all(|corner| one >> (corner | 1 << axis) & 1 == other >> corner & 1)
        };
        for axis in 0..3 {
            let low: Vec<_> = (0..=255).map(|case| open_sides(case, axis, 0)).collect();
            let high: Vec<_> = (0..=255).map(|case| open_sides(case, axis, 1)).collect();
            for (one, sides) in (0..=255).zip(&high) {
                for (other, others) in (0..=255).zip(&low) {
                    if agree(one, other, axis) {
                        let reversed = others.iter().map(|&(from, to)| (to, from));
                        let mut reversed: Vec<_> = reversed.collect();
                        reversed.sort_unstable();
                        assert_eq!(*sides, reversed, "cases {one} and {other}, axis {axis}");
                    }
                }
            }
        }
    }
}
