//! Flips that bring sharp edges out: an edge of the mesh that cuts a sharp edge off, so that its
//! middle is far from the surface, is replaced by the one across it, from a point of the sharp edge
//! (after L. P. Kobbelt, M. Botsch, U. Schwanecke, H.-P. Seidel, "Feature sensitive surface extraction
//! from volume data", SIGGRAPH 2001, section 4).

use glam::DVec3;
use rustc_hash::{FxHashMap, FxHashSet};

use super::place::Vertex;
use super::scattered::Scattered;
use crate::polygonize::Job;
use crate::polygonize::columns::Columns;

/// Passes over the edges: each may free others.
const PASSES: usize = 8;

/// The middle of a new edge must be nearer to the surface than this part of the old one's.
const NEARER: f64 = 0.5;

/// An edge whose middle is nearer to the surface than this part of its length does not cut.
const CUTS: f64 = 0.01;

/// An edge between two triangles whose other corners are sharp.
struct Crossing {
    /// The ends of the edge.
    edge: [u32; 2],
    /// The corners across it: of the triangle that has the edge as it is, and of the one that has
    /// it turned around.
    across: [u32; 2],
    /// The triangles, in the same order.
    triangles: [usize; 2],
}

/// Flips edges in place; returns the number of evaluations.
pub(super) fn flip(
    (job, field): (&Job, &mut Scattered),
    triangles: &mut [[u32; 3]],
    vertices: &[Vertex],
) -> usize {
    let is_sharp = |vertex: u32| vertices[vertex as usize].rank > 1;
    let near = near_sharp(triangles, vertices);
    let mut evaluations = 0;
    for _ in 0..PASSES {
        let across = opposite_corners(triangles, &near);
        let crossings = crossings(triangles, &near, &across, is_sharp);
        if crossings.is_empty() {
            break;
        }
        let distances = distances((job, &mut *field), &crossings, vertices);
        evaluations += distances.len();
        let mut done = 0;
        let (mut touched, mut added) = (FxHashSet::default(), FxHashSet::default());
        for (crossing, pair) in crossings.iter().zip(distances.as_chunks::<2>().0) {
            let [own, other] = crossing.across;
            let is_new = !across.contains_key(&[own, other]) && !across.contains_key(&[other, own]);
            let is_still = !crossing
                .triangles
                .iter()
                .any(|triangle| touched.contains(triangle));
            let [from, to] = crossing.edge;
            let length = vertices[from as usize]
                .position
                .distance(vertices[to as usize].position);
            let is_nearer = pair[0] > CUTS * length && pair[1] < NEARER * pair[0];
            if !(is_new && is_still && is_nearer) {
                continue;
            }
            let flipped = [[from, other, own], [to, own, other]];
            let is_sound = flipped
                .iter()
                .all(|corners| faces_outward(*corners, vertices));
            if is_sound && added.insert([own.min(other), own.max(other)]) {
                touched.extend(crossing.triangles);
                for (&number, corners) in crossing.triangles.iter().zip(flipped) {
                    triangles[number] = corners;
                }
                done += 1;
            }
        }
        if done == 0 {
            break;
        }
    }
    evaluations
}

/// The triangles at sharp corners, and those that share a corner with them.
fn near_sharp(triangles: &[[u32; 3]], vertices: &[Vertex]) -> Vec<usize> {
    let mut is_near: Vec<bool> = vertices.iter().map(|vertex| vertex.rank > 1).collect();
    let beside: Vec<[u32; 3]> = (triangles.iter().copied())
        .filter(|corners| corners.iter().any(|&corner| is_near[corner as usize]))
        .collect();
    for corner in beside.into_iter().flatten() {
        is_near[corner as usize] = true;
    }
    let is_near = |corners: &[u32; 3]| corners.iter().any(|&corner| is_near[corner as usize]);
    (0..triangles.len())
        .filter(|&number| is_near(&triangles[number]))
        .collect()
}

/// The corner across each directed edge, and the triangle's number.
pub(super) fn opposite_corners(
    triangles: &[[u32; 3]],
    near: &[usize],
) -> FxHashMap<[u32; 2], (u32, usize)> {
    let edges = near.iter().flat_map(|&number| {
        let [a, b, c] = triangles[number];
        [
            ([a, b], (c, number)),
            ([b, c], (a, number)),
            ([c, a], (b, number)),
        ]
    });
    edges.collect()
}

/// The edges that may be flipped, in the order of the triangles.
fn crossings(
    triangles: &[[u32; 3]],
    near: &[usize],
    across: &FxHashMap<[u32; 2], (u32, usize)>,
    is_sharp: impl Fn(u32) -> bool,
) -> Vec<Crossing> {
    let mut found = Vec::new();
    for &number in near {
        let [a, b, c] = triangles[number];
        for (edge, own) in [([a, b], c), ([b, c], a), ([c, a], b)] {
            let Some(&(other, second)) = across.get(&[edge[1], edge[0]]) else {
                continue;
            };
            let cuts = (is_sharp(own) || is_sharp(other)) && !edge.into_iter().all(&is_sharp);
            if edge[0] < edge[1] && own != other && cuts {
                found.push(Crossing {
                    edge,
                    across: [own, other],
                    triangles: [number, second],
                });
            }
        }
    }
    found
}

/// |F − iso| / |F_x| in the middle of each edge and of the one that would replace it.
fn distances(
    (job, field): (&Job, &mut Scattered),
    crossings: &[Crossing],
    vertices: &[Vertex],
) -> Vec<f64> {
    let middle =
        |[a, b]: [u32; 2]| 0.5 * (vertices[a as usize].position + vertices[b as usize].position);
    let points = crossings
        .iter()
        .flat_map(|crossing| [crossing.edge, crossing.across]);
    let points: Vec<DVec3> = points.map(middle).collect();
    let mut columns = Columns::default();
    columns.set_points(points.iter().copied());
    columns.evaluate(field, job.accuracy.iso);
    let distance = |index: usize| {
        let (value, gradient) = columns.result(index);
        value.abs() / gradient.length()
    };
    (0..points.len()).map(distance).collect()
}

/// Whether a triangle has an area and does not turn its back to the normal of a smooth corner.
pub(super) fn faces_outward(corners: [u32; 3], vertices: &[Vertex]) -> bool {
    let corners = corners.map(|corner| vertices[corner as usize]);
    let [a, b, c] = corners.map(|corner| corner.position);
    let normal = (b - a).cross(c - a);
    let smooth = corners.iter().filter(|corner| corner.rank == 1);
    normal != DVec3::ZERO
        && smooth
            .into_iter()
            .all(|corner| corner.normal.dot(normal) > 0.0)
}
