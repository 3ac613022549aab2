//! Triangulations of the loops that a level set leaves on the surface of a cube: disks, and tubes
//! between two loops that a tunnel joins.
//!
//! No diagonal may lie in a face of the cube: it could coincide with one of the neighbouring cube
//! and be shared by four triangles. Where a loop has no triangulation without such a diagonal, it
//! gets a vertex of its own inside the cube, its centre.

use glam::{DVec3, IVec3};

use super::loops::{EDGES, Loop, in_common_face, loops};

/// The first number of a vertex inside the cube; lesser ones are edges.
pub(in crate::polygonize) const FIRST_CENTRE: u8 = 12;

/// A way through the interior of a cube between two regions on its surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Passage {
    /// Whether these regions are inside, rather than outside.
    pub(super) inside: bool,
    /// Its direction: the diagonal of the cube from this corner, 0 to 3, to the opposite one.
    pub(super) diagonal: usize,
}

impl Passage {
    /// Three directions across the passage, in which its neck is marked.
    pub(super) fn neck_directions(self) -> [DVec3; 3] {
        let sign = |axis: usize| {
            if self.diagonal >> axis & 1 == 1 {
                -1.0
            } else {
                1.0
            }
        };
        [0, 1, 2].map(|along| {
            let component = |axis: usize| sign(axis) * if axis == along { 2.0 } else { -1.0 };
            DVec3::from_array([0, 1, 2].map(component))
        })
    }
}

/// What a vertex inside the cube is.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Centre {
    /// The centre of a loop through these edges.
    Loop(Vec<u8>),
    /// On the neck of the tunnel, in the direction with this number.
    Neck(usize),
}

/// The part of a level set in one cube.
#[derive(Clone, Debug, Default)]
pub(super) struct Patches {
    /// Triples of vertices, counter-clockwise seen from outside the surface: edges of the cube or,
    /// from [`FIRST_CENTRE`] on, centres.
    pub(super) triangles: Vec<[u8; 3]>,
    /// The vertices inside the cube.
    pub(super) centres: Vec<Centre>,
}

impl Patches {
    /// The patches of a case, given the ambiguous faces whose inside corners are joined and the
    /// passage through the interior. It means nothing unless it joins two regions that are
    /// separate on the surface.
    pub(super) fn new(case: u8, joined: u8, passage: Option<Passage>) -> Self {
        let mut patches = Patches::default();
        let mut loops = loops(case, joined);
        if let Some(passage) = passage
            && let Some([one, other]) = tunnel_ends(&loops, passage.inside)
        {
            // The second is the later one.
            let ends = [loops.remove(other), loops.remove(one)].map(|end| bytes(&end.edges));
            patches.add_tunnel(ends.each_ref().map(Vec::as_slice), passage);
        }
        for polygon in loops {
            patches.add_disk(&bytes(&polygon.edges));
        }
        patches
    }

    /// Adds the triangulation of a loop with the least sum of squared diagonals, with the
    /// crossings in the middle of the edges; or a fan around a centre.
    ///
    /// The classical dynamic programme over the chains from vertex `first` to vertex `last`.
    fn add_disk(&mut self, polygon: &[u8]) {
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
        if least[0][count - 1] == f64::INFINITY {
            return self.add_fan(polygon);
        }
        let mut chains = vec![(0, count - 1)];
        while let Some((first, last)) = chains.pop() {
            if last - first >= 2 {
                let middle = apex[first][last];
                let corners = [first, middle, last].map(|vertex| polygon[vertex]);
                self.triangles.push(corners);
                chains.extend([(middle, last), (first, middle)]);
            }
        }
    }

    /// Adds the triangles between a loop and its centre.
    fn add_fan(&mut self, polygon: &[u8]) {
        let centre = FIRST_CENTRE + self.centres.len() as u8;
        let sides = polygon.iter().zip(polygon.iter().cycle().skip(1));
        let triangles = sides.map(|(&from, &to)| [from, to, centre]);
        self.triangles.extend(triangles);
        self.centres.push(Centre::Loop(polygon.to_vec()));
    }

    /// Adds the wall of a tunnel between two loops; if need be in two parts, with a loop of three
    /// vertices around the neck between them.
    fn add_tunnel(&mut self, [one, other]: [&[u8]; 2], passage: Passage) {
        // The diagonals' lengths: the neck is marked closely around the middle of the cube.
        let directions = passage.neck_directions().map(|d| d.as_ivec3());
        let place = |vertex: u8| match vertex.checked_sub(FIRST_CENTRE) {
            Some(centre) => IVec3::splat(12) + directions[usize::from(centre) % 3],
            None => 12 * doubled_middle(usize::from(vertex)),
        };
        let cost = |one: u8, other: u8| {
            let both_edges = one < FIRST_CENTRE && other < FIRST_CENTRE;
            if both_edges && in_common_face(usize::from(one), usize::from(other)) {
                return f64::INFINITY;
            }
            f64::from((place(one) - place(other)).length_squared())
        };
        let direct = tube([one, other], cost);
        if direct.0 < f64::INFINITY {
            self.triangles.extend(direct.1);
            return;
        }
        // A tunnel is the first thing that is added to a cube: its centres are the first ones.
        let neck = [0, 1, 2].map(|number| FIRST_CENTRE + number);
        let [a, b, c] = neck;
        let around = [[a, b, c], [c, b, a]].map(|neck| {
            let [mut near, far] = [
                tube([one, &neck], cost),
                tube([&[neck[2], neck[1], neck[0]], other], cost),
            ];
            near.1.extend(far.1);
            (near.0 + far.0, near.1)
        });
        let [forwards, backwards] = around;
        let best = if forwards.0 <= backwards.0 {
            forwards
        } else {
            backwards
        };
        self.triangles.extend(best.1);
        self.centres.extend([0, 1, 2].map(Centre::Neck));
    }
}

/// The triangulation of the tube between two loops with the least sum of its diagonals' costs,
/// and this sum: the cheapest closed path of steps along one loop or the other.
fn tube([one, other]: [&[u8]; 2], cost: impl Fn(u8, u8) -> f64) -> (f64, Vec<[u8; 3]>) {
    let (length, around) = (one.len(), other.len());
    let mut best = (f64::INFINITY, Vec::new());
    for (first, start) in (0..length).flat_map(|i| (0..around).map(move |j| (i, j))) {
        let ahead = |step: usize| one[(first + step) % length];
        // The second loop runs the other way around the tube.
        let back = |step: usize| other[(2 * around - 1 - (start + step) % around) % around];
        let (sum, path) = cheapest_path([length, around], |i, j| cost(ahead(i), back(j)));
        if sum >= best.0 {
            continue;
        }
        let (mut i, mut j) = (0, 0);
        let triangles = path.into_iter().map(|along_first| {
            if along_first {
                i += 1;
                [ahead(i - 1), ahead(i), back(j)]
            } else {
                j += 1;
                [back(j), back(j - 1), ahead(i)]
            }
        });
        best = (sum, triangles.collect());
    }
    best
}

/// The cheapest path from (0, 0) to (`rows`, `columns`) by steps of one in either direction: what
/// the points on it cost without the last, and for each step whether it is along the rows.
///
/// On the torus that these rows and columns make, the path is closed and meets no point twice:
/// its first step is along the rows, its last one is not, and it does not pass (`rows`, 0). Every
/// such closed path has this form from one of its points on.
fn cheapest_path(
    [rows, columns]: [usize; 2],
    cost: impl Fn(usize, usize) -> f64,
) -> (f64, Vec<bool>) {
    let mut least = vec![vec![f64::INFINITY; columns + 1]; rows + 1];
    least[0][0] = cost(0, 0);
    for (i, j) in (1..=rows).flat_map(|i| (0..columns).map(move |j| (i, j))) {
        let before = match j {
            0 => least[i - 1][0],
            _ => f64::min(least[i - 1][j], least[i][j - 1]),
        };
        if (i, j) != (rows, 0) {
            least[i][j] = before + cost(i, j);
        }
    }
    let sum = least[rows][columns - 1];
    let mut path = vec![false];
    let (mut i, mut j) = (rows, columns - 1);
    while i + j > 0 {
        let along_rows = j == 0 || i > 0 && least[i - 1][j] <= least[i][j - 1];
        path.push(along_rows);
        if along_rows {
            i -= 1;
        } else {
            j -= 1;
        }
    }
    path.reverse();
    (sum, path)
}

/// The numbers of the two loops that a tunnel joins, ascending: between its two regions lies one
/// other region. `None` if there are not two such regions.
fn tunnel_ends(loops: &[Loop], inside: bool) -> Option<[usize; 2]> {
    let sides = |polygon: &Loop| match inside {
        true => (polygon.inside, polygon.outside),
        false => (polygon.outside, polygon.inside),
    };
    let mut regions: Vec<usize> = loops.iter().map(|polygon| sides(polygon).0).collect();
    regions.sort_unstable();
    regions.dedup();
    if regions.len() != 2 {
        return None;
    }
    let mut pairs = (0..loops.len()).flat_map(|one| (one + 1..loops.len()).map(move |o| [one, o]));
    pairs.find(|pair| {
        let [one, other] = pair.map(|number| sides(&loops[number]));
        one.0 != other.0 && one.1 == other.1
    })
}

/// The squared length of the diagonal between two crossed edges, infinite in a face.
fn diagonal_cost(one: u8, other: u8) -> f64 {
    let [one, other] = [one, other].map(usize::from);
    if in_common_face(one, other) {
        return f64::INFINITY;
    }
    f64::from((doubled_middle(one) - doubled_middle(other)).length_squared())
}

/// Twice the middle of an edge of the unit cube.
fn doubled_middle(edge: usize) -> IVec3 {
    let (corner, axis) = EDGES[edge];
    let component = |a: usize| 2 * (corner >> a & 1) as i32 + i32::from(a == axis);
    IVec3::from_array([0, 1, 2].map(component))
}

/// The numbers of edges as they are stored.
fn bytes(edges: &[usize]) -> Vec<u8> {
    edges.iter().map(|&edge| edge as u8).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::super::loops::{ambiguous_faces, is_inside, loops};
    use super::*;

    /// All cases with all decisions on their faces.
    fn cases() -> impl Iterator<Item = (u8, u8)> {
        (0..=255u8).flat_map(|case| {
            let faces = (0..64).filter(move |joined| joined & !ambiguous_faces(case) == 0);
            faces.map(move |joined| (case, joined))
        })
    }

    /// The same with every passage and with none.
    fn all() -> impl Iterator<Item = ((u8, u8), Option<Passage>, Patches)> {
        let passages = (0..8).map(|number| Passage {
            inside: number >= 4,
            diagonal: number % 4,
        });
        let passages: Vec<_> = passages.map(Some).chain([None]).collect();
        cases().flat_map(move |(case, joined)| {
            let each = passages.clone().into_iter();
            each.map(move |passage| ((case, joined), passage, Patches::new(case, joined, passage)))
        })
    }

    /// How often each directed side occurs among the triangles.
    fn directed_sides(patches: &Patches) -> BTreeMap<(u8, u8), usize> {
        let mut sides = BTreeMap::new();
        for &[a, b, c] in &patches.triangles {
            for side in [(a, b), (b, c), (c, a)] {
                *sides.entry(side).or_default() += 1;
            }
        }
        sides
    }

    #[test]
    fn exactly_the_crossed_edges_and_the_centres_are_vertices() {
        for ((case, _), _, patches) in all() {
            let mut vertices = patches.triangles.as_flattened().to_vec();
            vertices.sort_unstable();
            vertices.dedup();
            let crossed = (0..12u8).filter(|&edge| {
                let (corner, axis) = EDGES[usize::from(edge)];
                is_inside(case, corner) != is_inside(case, corner | 1 << axis)
            });
            let centres = (0..patches.centres.len()).map(|centre| FIRST_CENTRE + centre as u8);
            assert_eq!(vertices, crossed.chain(centres).collect::<Vec<_>>());
        }
    }

    #[test]
    fn no_inner_side_lies_in_a_face_and_the_outer_sides_are_the_loops() {
        for ((case, joined), passage, patches) in all() {
            let sides = directed_sides(&patches);
            let mut outer = Vec::new();
            for (&(from, to), &count) in &sides {
                assert_eq!(
                    count, 1,
                    "case {case}, {passage:?}: side {from}-{to} is repeated"
                );
                let on_edges = from < FIRST_CENTRE && to < FIRST_CENTRE;
                let in_face = on_edges && in_common_face(usize::from(from), usize::from(to));
                let inner = sides.contains_key(&(to, from));
                assert_ne!(inner, in_face, "case {case}, {passage:?}: side {from}-{to}");
                if !inner {
                    outer.push((from, to));
                }
            }
            let mut expected = Vec::new();
            for polygon in loops(case, joined) {
                let edges = bytes(&polygon.edges);
                let next = edges.iter().cycle().skip(1);
                expected.extend(edges.iter().copied().zip(next.copied()));
            }
            expected.sort_unstable();
            assert_eq!(outer, expected, "case {case}, {passage:?}");
        }
    }

    /// The Euler number tells disks from tubes.
    #[test]
    fn a_passage_makes_one_tube_of_two_disks() {
        let euler = |patches: &Patches| {
            let mut vertices = patches.triangles.as_flattened().to_vec();
            vertices.sort_unstable();
            vertices.dedup();
            let directed = directed_sides(patches);
            let sides = directed
                .keys()
                .filter(|&&(from, to)| from < to || !directed.contains_key(&(to, from)));
            (vertices.len() + patches.triangles.len()) as isize - sides.count() as isize
        };
        for ((case, joined), passage, patches) in all() {
            let loops = loops(case, joined);
            let tube = passage.is_some_and(|passage| tunnel_ends(&loops, passage.inside).is_some());
            let expected = loops.len() as isize - if tube { 2 } else { 0 };
            assert_eq!(euler(&patches), expected, "case {case}, {passage:?}");
        }
    }
}
