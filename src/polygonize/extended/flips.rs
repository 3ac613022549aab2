//! Flips that make sharp edges edges of the mesh: where two fans meet along a side that a sharp edge
//! crosses, the edge between their centres replaces the side (section 4 of the paper). Where a patch
//! without a centre is between them, edges to a centre replace those that cut the sharp edge off,
//! until the next one is reached.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::geometry::Mesh;
use crate::polygonize::Job;
use crate::polygonize::columns::Columns;
use crate::polygonize::dual::are_smooth;
use crate::polygonize::edge_roots::first_order_distance;
use crate::polygonize::grid::Grid;

/// Passes over the edges at most. Each flip leaves one edge less that cuts sharp edges off.
const PASSES: usize = 8;

/// The middle of a new edge must be nearer to the surface than this part of the old one's.
const NEARER: f64 = 0.5;

/// Flips edges in place; vertices from `centres` on are centres of fans, the others roots. Returns the
/// number of evaluations.
pub(super) fn flip(
    (job, grid, mesh): (&Job, &Grid, &Mesh),
    centres: u32,
    triangles: &mut [[u32; 3]],
) -> usize {
    let flipper = Flipper {
        job,
        grid,
        mesh,
        centres,
    };
    let near: Vec<usize> = (0..triangles.len())
        .filter(|&number| flipper.is_near(triangles[number]))
        .collect();
    let mut evaluations = 0;
    for _ in 0..PASSES {
        let candidates = flipper.candidates(&near, triangles);
        evaluations += 2 * candidates.len();
        if !flipper.apply(&candidates, triangles) {
            break;
        }
    }
    evaluations
}

struct Flipper<'a> {
    job: &'a Job<'a>,
    grid: &'a Grid,
    mesh: &'a Mesh,
    centres: u32,
}

/// A flip that may be done.
struct Flip {
    /// The two triangles.
    numbers: [usize; 2],
    /// What becomes of them.
    flipped: [[u32; 3]; 2],
    /// The edge between them.
    old: [u32; 2],
    /// The one that replaces it, its lower end first.
    new: [u32; 2],
}

impl Flipper<'_> {
    /// Whether a triangle has a centre or an edge that cuts a sharp edge off. All edges at centres
    /// are in such triangles.
    fn is_near(&self, triangle: [u32; 3]) -> bool {
        triangle.iter().any(|&corner| corner >= self.centres)
            || sides(triangle).iter().any(|&side| self.cuts(side))
    }

    /// The flips of edges that cut sharp edges off to edges at centres, in the order of the triangles.
    fn candidates(&self, near: &[usize], triangles: &[[u32; 3]]) -> Vec<Flip> {
        let own_sides = |&number: &usize| sides(triangles[number]).map(|side| (side, number));
        let at_side: FxHashMap<[u32; 2], usize> = near.iter().flat_map(own_sides).collect();
        let flip_of = |(old, number): ([u32; 2], usize)| {
            let [from, to] = old;
            // Every edge is met twice.
            if from > to || !self.cuts(old) {
                return None;
            }
            let other = *at_side.get(&[to, from])?;
            let across = |number: usize| {
                let mut corners = triangles[number].into_iter();
                corners.find(|corner| !old.contains(corner))
            };
            let (one, two) = (across(number)?, across(other)?);
            let flipped = [[from, two, one], [to, one, two]];
            let is_new = !at_side.contains_key(&[one, two]) && !at_side.contains_key(&[two, one]);
            let is_fit = one != two
                && is_new
                && one.max(two) >= self.centres
                && flipped.iter().all(|corners| self.faces_outward(*corners));
            is_fit.then_some(Flip {
                numbers: [number, other],
                flipped,
                old,
                new: [one.min(two), one.max(two)],
            })
        };
        near.iter()
            .flat_map(own_sides)
            .filter_map(flip_of)
            .collect()
    }

    /// Does those flips that bring edges nearer to the surface, no two at the same triangle; whether
    /// there are any.
    fn apply(&self, flips: &[Flip], triangles: &mut [[u32; 3]]) -> bool {
        let middle = |edge: [u32; 2]| {
            let [a, b] = edge.map(|vertex| self.mesh.positions[vertex as usize]);
            0.5 * (a + b)
        };
        let edges = flips.iter().flat_map(|flip| [flip.old, flip.new]);
        let mut columns = Columns::default();
        columns.set_points(edges.map(middle));
        let mut field = self.job.field;
        columns.evaluate(&mut field, self.job.accuracy.iso);
        let distances = columns
            .results()
            .map(|(value, gradient)| first_order_distance(value, gradient));
        let distances: Vec<f64> = distances.collect();
        let (mut touched, mut added) = (FxHashSet::default(), FxHashSet::default());
        for (flip, distances) in flips.iter().zip(distances.as_chunks::<2>().0) {
            let [old, new] = *distances;
            let is_open = !flip.numbers.iter().any(|number| touched.contains(number));
            if new <= NEARER * old && is_open && added.insert(flip.new) {
                touched.extend(flip.numbers);
                for (&number, corners) in flip.numbers.iter().zip(flip.flipped) {
                    triangles[number] = corners;
                }
            }
        }
        !touched.is_empty()
    }

    /// Whether an edge cuts a sharp edge off: it joins roots with different normals. Vertices that
    /// close the surface at the box are no roots.
    fn cuts(&self, [from, to]: [u32; 2]) -> bool {
        let ends = [from, to].map(|vertex| vertex as usize);
        let normals = ends.map(|vertex| self.mesh.normals[vertex]);
        from.max(to) < self.centres
            && !are_smooth(normals.into_iter())
            && !ends.iter().any(|&vertex| self.is_cap(vertex))
    }

    fn is_cap(&self, vertex: usize) -> bool {
        let position = self.mesh.positions[vertex];
        self.grid.is_on_side(position) && self.mesh.normals[vertex] == self.grid.outward(position)
    }

    /// Whether a triangle has an area and does not turn its back to the surface at its corners that
    /// are roots: at each of them if their normals agree, else in the mean. False in sides of the box.
    fn faces_outward(&self, triangle: [u32; 3]) -> bool {
        let [a, b, c] = triangle.map(|vertex| self.mesh.positions[vertex as usize]);
        let across = (b - a).cross(c - a);
        let roots = triangle.into_iter().filter(|&vertex| vertex < self.centres);
        let mut normals = roots.map(|vertex| self.mesh.normals[vertex as usize]);
        let in_side = (0..3).any(|axis| {
            let sides = &self.grid.coordinates[axis];
            let ends = [sides.first(), sides.last()];
            a[axis] == b[axis] && b[axis] == c[axis] && ends.contains(&Some(&a[axis]))
        });
        if in_side {
            return false;
        }
        if are_smooth(normals.clone()) {
            return normals.all(|normal| across.dot(normal) > 0.0);
        }
        across.dot(normals.sum()) > 0.0
    }
}

fn sides([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}
