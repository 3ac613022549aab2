//! Thin triangles beside sharp edges: where an edge can be flipped within one smooth part of the
//! surface, so that the worse of its two triangles gets better, it is. Nothing is evaluated for this.

use glam::DVec3;
use rustc_hash::{FxHashMap, FxHashSet};

use super::facets::Patch;
use super::flips::opposite_corners;
use super::place::{Vertex, are_alike};

/// Passes over the triangles: each may free others.
const PASSES: usize = 4;

/// The least cosine between a new triangle's normal and that of the surface: flips must not bend
/// what is flat.
const FLAT: f64 = 0.9;

/// A flip: the two triangles, what becomes of them, and the edge that is new, its lower end first.
struct Flip {
    numbers: [usize; 2],
    flipped: [[u32; 3]; 2],
    edge: [u32; 2],
    /// The shape of the worse new triangle.
    after: f64,
}

/// The corner across each directed edge, and the triangle's number.
type Across = FxHashMap<[u32; 2], (u32, usize)>;

/// Flips edges of triangles below the shape `fair`, in place.
pub(super) fn flip(fair: f64, triangles: &mut [[u32; 3]], vertices: &[Vertex]) {
    for _ in 0..PASSES {
        let is_thin = |number: &usize| triangles[*number].fitness(vertices) < fair;
        let thin: Vec<usize> = (0..triangles.len()).filter(is_thin).collect();
        if thin.is_empty() {
            break;
        }
        let across = opposite_corners(triangles, &around(&thin, triangles, vertices.len()));
        let (mut touched, mut added) = (FxHashSet::default(), FxHashSet::default());
        for number in thin {
            let Some(flip) = best_flip(number, triangles, &across, vertices) else {
                continue;
            };
            let is_free = !flip.numbers.iter().any(|number| touched.contains(number));
            if is_free && added.insert(flip.edge) {
                touched.extend(flip.numbers);
                for (number, corners) in flip.numbers.into_iter().zip(flip.flipped) {
                    triangles[number] = corners;
                }
            }
        }
        if touched.is_empty() {
            break;
        }
    }
}

/// The triangles that share a corner with one of these, ascending.
fn around(thin: &[usize], triangles: &[[u32; 3]], vertices: usize) -> Vec<usize> {
    let mut is_near = vec![false; vertices];
    for corner in thin.iter().flat_map(|&number| triangles[number]) {
        is_near[corner as usize] = true;
    }
    let is_near = |corner: &u32| is_near[*corner as usize];
    (0..triangles.len())
        .filter(|&number| triangles[number].iter().any(is_near))
        .collect()
}

/// The flip of an edge of a triangle that leaves the best shapes, if there is one that makes the worse
/// of its triangles better.
fn best_flip(
    number: usize,
    triangles: &[[u32; 3]],
    across: &Across,
    vertices: &[Vertex],
) -> Option<Flip> {
    let [a, b, c] = triangles[number];
    let before = triangles[number].fitness(vertices);
    let mut best: Option<Flip> = None;
    for [a, b, c] in [[a, b, c], [b, c, a], [c, a, b]] {
        let Some(&(d, other)) = across.get(&[b, a]) else {
            continue;
        };
        let exists = across.contains_key(&[c, d]) || across.contains_key(&[d, c]);
        let flipped = [[a, d, c], [d, b, c]];
        if c == d || exists || !is_in_one_part([a, b, c, d], flipped, vertices) {
            continue;
        }
        let before = before.min(triangles[other].fitness(vertices));
        let after = flipped.map(|corners| corners.fitness(vertices));
        let after = after[0].min(after[1]);
        if after > before && best.as_ref().is_none_or(|best| after > best.after) {
            best = Some(Flip {
                numbers: [number, other],
                flipped,
                edge: [c.min(d), c.max(d)],
                after,
            });
        }
    }
    best
}

/// Whether a flip of the edge from a to b stays within one smooth part: the edge is not along a sharp
/// one, the normals of the smooth corners agree, and the new triangles with them.
fn is_in_one_part([a, b, c, d]: [u32; 4], flipped: [[u32; 3]; 2], vertices: &[Vertex]) -> bool {
    let vertex = |corner: u32| vertices[corner as usize];
    let smooth = [a, b, c, d].map(vertex).into_iter();
    let normals = smooth.filter(|corner| corner.rank == 1);
    let normals = normals.map(|corner| corner.normal);
    let Some(normal) = normals.clone().next() else {
        return false;
    };
    let is_flat = |corners: [u32; 3]| {
        let [a, b, c] = corners.map(|corner| vertex(corner).position);
        (b - a).cross(c - a).normalize_or_zero().dot(normal) > FLAT
    };
    let is_sharp = vertex(a).rank > 1 && vertex(b).rank > 1;
    !is_sharp && normal != DVec3::ZERO && are_alike(normals) && flipped.into_iter().all(is_flat)
}
