//! The last look at the mesh: facets that are turned against F_x or have no area are taken out by
//! flips of edges, as far as that goes, and those that are left are counted.
//!
//! Only facets in doubt are looked at, those whose normal disagrees with that of a corner or which
//! are very thin, and their neighbours: on smooth parts there are none, and nothing is evaluated.

use glam::DVec3;
use rustc_hash::{FxHashMap, FxHashSet};

use super::facets::shape;
use super::scattered::Scattered;
use crate::geometry::{Bounds, Mesh};
use crate::polygonize::Job;
use crate::polygonize::columns::Columns;
use crate::polygonize::edge_roots::first_order_distance;

/// A facet whose normal and that of a corner have a cosine below this is in doubt: 46 degrees, a
/// little more than beside the right angle of two planes.
const DOUBT: f64 = 0.7;

/// So is one whose shape is below this, where 1 is equilateral.
const THIN: f64 = 0.01;

/// A facet of a shape below this has no area.
const FLAT: f64 = 1e-7;

/// Rounds of flips: each may free others.
const ROUNDS: usize = 6;

/// The middle of a new edge may be this part of its length away from the surface, or as far as that
/// of the old one.
const CUTS: f64 = 0.02;

/// What was done, and what could not be mended.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Repaired {
    /// Points at which F and F_x were taken.
    pub(super) evaluations: usize,
    /// Facets that are turned over or have no area.
    pub(super) folded: usize,
}

/// Flips edges at facets that are turned or have no area; counts those that stay.
pub(super) fn repair((job, field): (&Job, &mut Scattered), mesh: &mut Mesh) -> Repaired {
    let mut known = Known {
        iso: job.accuracy.iso,
        bounds: &job.options.bounds,
        field,
        columns: Columns::default(),
        evaluations: 0,
    };
    let mut doubtful: Vec<usize> = (0..mesh.triangles.len())
        .filter(|&number| is_doubtful(mesh, number))
        .collect();
    if !doubtful.is_empty() {
        doubtful = with_neighbours(mesh, &doubtful);
    }
    let mut bad = known.bad(mesh, &doubtful);
    for _ in 0..ROUNDS {
        let flipped = match bad.is_empty() {
            true => break,
            false => known.flip(mesh, &bad),
        };
        if flipped.is_empty() {
            break;
        }
        doubtful.extend(flipped);
        doubtful.sort_unstable();
        doubtful.dedup();
        bad = known.bad(mesh, &doubtful);
    }
    Repaired {
        evaluations: known.evaluations,
        folded: bad.len(),
    }
}

/// Whether a facet may be turned: this needs no evaluation.
fn is_doubtful(mesh: &Mesh, number: usize) -> bool {
    let corners = mesh.triangles[number];
    let points = positions(mesh, corners);
    let normal = normal(points).normalize_or_zero();
    let agrees = |&corner: &u32| mesh.normals[corner as usize].dot(normal) >= DOUBT;
    !corners.iter().all(agrees) || shape(points) < THIN
}

/// The facets that share a corner with one of these, ascending.
fn with_neighbours(mesh: &Mesh, numbers: &[usize]) -> Vec<usize> {
    let mut is_near = vec![false; mesh.positions.len()];
    for corner in numbers.iter().flat_map(|&number| mesh.triangles[number]) {
        is_near[corner as usize] = true;
    }
    let is_near = |corner: &u32| is_near[*corner as usize];
    (0..mesh.triangles.len())
        .filter(|&number| mesh.triangles[number].iter().any(is_near))
        .collect()
}

fn positions(mesh: &Mesh, corners: [u32; 3]) -> [DVec3; 3] {
    corners.map(|corner| mesh.positions[corner as usize])
}

fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// A flip: the facets, their new corners, and how many of the old and of the new ones are bad.
struct Flip {
    triangles: [usize; 2],
    corners: [[u32; 3]; 2],
    /// The edge as it is and as it would be.
    edges: [[u32; 2]; 2],
    /// Whether the first facet has no area, so that the surface stays where it is.
    is_flat: bool,
}

/// The field, and how often it was asked.
struct Known<'a, 'f> {
    field: &'a mut Scattered<'f>,
    iso: f64,
    bounds: &'a Bounds,
    columns: Columns,
    evaluations: usize,
}

impl Known<'_, '_> {
    /// Whether a triangle lies in a side of the box, where F_x says nothing of it.
    fn is_cap(&self, points: [DVec3; 3]) -> bool {
        let sides = [self.bounds.min, self.bounds.max];
        sides.iter().any(|side| {
            let along = points.map(|point| point.cmpeq(*side));
            (along[0] & along[1] & along[2]).any()
        })
    }

    fn evaluate(&mut self, points: &[DVec3]) {
        self.evaluations += points.len();
        self.columns.set_points(points.iter().copied());
        self.columns.evaluate(self.field, self.iso);
    }

    /// Which of these triangles are turned against F_x at their centres or have no area. Where F_x
    /// is not known no triangle is.
    fn are_bad(&mut self, triangles: &[[DVec3; 3]]) -> Vec<bool> {
        let centres: Vec<DVec3> = triangles
            .iter()
            .map(|[a, b, c]| (a + b + c) / 3.0)
            .collect();
        self.evaluate(&centres);
        let pairs = triangles.iter().enumerate();
        pairs
            .map(|(index, &points)| {
                let (_, gradient) = self.columns.result(index);
                let is_turned = normal(points).dot(gradient) < 0.0;
                is_turned && !self.is_cap(points) || shape(points) < FLAT
            })
            .collect()
    }

    /// The bad ones of the facets with these numbers.
    fn bad(&mut self, mesh: &Mesh, numbers: &[usize]) -> Vec<usize> {
        let corners = numbers.iter().map(|&number| mesh.triangles[number]);
        let triangles: Vec<[DVec3; 3]> = corners.map(|own| positions(mesh, own)).collect();
        let are_bad = self.are_bad(&triangles);
        let pairs = numbers.iter().zip(are_bad);
        pairs
            .filter_map(|(&number, is_bad)| is_bad.then_some(number))
            .collect()
    }

    /// One round: flips edges of bad facets where that leaves fewer of them; returns the facets that
    /// have changed.
    fn flip(&mut self, mesh: &mut Mesh, bad: &[usize]) -> Vec<usize> {
        let across = edges_around(mesh, bad);
        let flips = flips(mesh, bad, &across);
        let of_flip = |flip: &Flip| {
            let old = flip.triangles.map(|number| mesh.triangles[number]);
            [old[0], old[1], flip.corners[0], flip.corners[1]].map(|own| positions(mesh, own))
        };
        let triangles: Vec<[DVec3; 3]> = flips.iter().flat_map(of_flip).collect();
        let are_bad = self.are_bad(&triangles);
        let middle =
            |[a, b]: [u32; 2]| 0.5 * (mesh.positions[a as usize] + mesh.positions[b as usize]);
        let middles = flips.iter().flat_map(|flip| flip.edges.map(middle));
        self.evaluate(&middles.collect::<Vec<_>>());
        // Those that mend most come first, then those with the better shape.
        let mut order: Vec<(usize, f64, usize)> = Vec::new();
        for (index, flip) in flips.iter().enumerate() {
            let count = |range: std::ops::Range<usize>| {
                are_bad[range].iter().filter(|is_bad| **is_bad).count()
            };
            let at = 4 * index;
            let (before, after) = (count(at..at + 2), count(at + 2..at + 4));
            let distance = |which: usize| {
                let (value, gradient) = self.columns.result(2 * index + which);
                first_order_distance(value, gradient)
            };
            let [a, b] = flip.edges[1].map(|end| mesh.positions[end as usize]);
            let is_near = distance(1) <= distance(0).max(CUTS * a.distance(b));
            if after < before && (is_near || flip.is_flat) {
                let shape = shape(triangles[at + 2]).min(shape(triangles[at + 3]));
                order.push((after, shape, index));
            }
        }
        order.sort_by(|one, other| {
            one.0
                .cmp(&other.0)
                .then(other.1.total_cmp(&one.1))
                .then(one.2.cmp(&other.2))
        });
        let (mut changed, mut added) = (FxHashSet::default(), FxHashSet::default());
        let mut list = Vec::new();
        for (_, _, index) in order {
            let flip = &flips[index];
            let [c, d] = flip.edges[1];
            let is_free = flip
                .triangles
                .iter()
                .all(|number| !changed.contains(number));
            if is_free && added.insert([c.min(d), c.max(d)]) {
                for (&number, corners) in flip.triangles.iter().zip(flip.corners) {
                    mesh.triangles[number] = corners;
                    changed.insert(number);
                    list.push(number);
                }
            }
        }
        list
    }
}

/// The facet on the left of each directed edge, and its third corner, for all facets that share a
/// corner with one of these.
fn edges_around(mesh: &Mesh, numbers: &[usize]) -> FxHashMap<[u32; 2], (u32, usize)> {
    let corners = numbers.iter().flat_map(|&number| mesh.triangles[number]);
    let near: FxHashSet<u32> = corners.collect();
    let facets = mesh.triangles.iter().enumerate();
    let facets = facets.filter(|(_, corners)| corners.iter().any(|corner| near.contains(corner)));
    let edges = facets.flat_map(|(number, &[a, b, c])| {
        [
            ([a, b], (c, number)),
            ([b, c], (a, number)),
            ([c, a], (b, number)),
        ]
    });
    edges.collect()
}

/// The flips of the edges of these facets that give no edge a second time.
fn flips(mesh: &Mesh, bad: &[usize], across: &FxHashMap<[u32; 2], (u32, usize)>) -> Vec<Flip> {
    let mut flips = Vec::new();
    for &number in bad {
        let [a, b, c] = mesh.triangles[number];
        let is_flat = shape(positions(mesh, [a, b, c])) < FLAT;
        for [a, b, c] in [[a, b, c], [b, c, a], [c, a, b]] {
            let Some(&(d, other)) = across.get(&[b, a]) else {
                continue;
            };
            if c == d || across.contains_key(&[c, d]) || across.contains_key(&[d, c]) {
                continue;
            }
            flips.push(Flip {
                triangles: [number, other],
                corners: [[a, d, c], [d, b, c]],
                edges: [[a, b], [c, d]],
                is_flat,
            });
        }
    }
    flips
}
