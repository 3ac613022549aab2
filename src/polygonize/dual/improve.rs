//! Better triangles: vertices of badly shaped ones slide along the surface.
//!
//! A vertex on a smooth part whose facets contain a bad triangle moves toward the middle of its
//! neighbours, in the tangent plane, and is put back on the surface by Newton's method (a Laplacian
//! smoothing; only those that need it move, for F costs more than anything else here). Moves that
//! do not improve the worst triangle around a vertex are taken back, so that no facet is folded.

use glam::DVec3;
use rayon::prelude::*;

use super::around::{Around, worst};
use super::facets::Patch;
use super::place::Vertex;
use super::scattered::Scattered;
use crate::polygonize::Job;
use crate::polygonize::edge_roots::Root;
use crate::polygonize::projection::{self, Start};

/// How far vertices of bad triangles go toward where they should be, sweep by sweep: where a whole
/// step would make other triangles worse, a part of it may do.
const STEPS: [f64; 6] = [1.0, 1.0, 1.0, 0.5, 0.5, 0.25];

/// Passes that take back moves which have made something worse.
const REVIEWS: usize = 4;

/// At least so many facets and vertices are looked at together.
const BATCH: usize = 1024;

/// Moves vertices until the triangles around them have at least the shape `good`, where 1 is
/// equilateral; returns the number of evaluations.
pub(super) fn relax(
    (job, field): (&Job, &mut Scattered),
    (facets, around): (&[impl Patch], &Around),
    good: f64,
    vertices: &mut [Vertex],
) -> usize {
    let mut evaluations = 0;
    let mut fitness: Vec<f64> = (facets.par_iter().with_min_len(BATCH))
        .map(|facet| facet.fitness(vertices))
        .collect();
    for step in STEPS {
        if job.monitor.cancelled() {
            break;
        }
        let moving: Vec<u32> = (0..vertices.len() as u32)
            .into_par_iter()
            .with_min_len(BATCH)
            .filter(|&own| {
                let mut facets = around.numbers(own).iter();
                let is_bad = |&number: &u32| fitness[number as usize] < good;
                vertices[own as usize].rank == 1 && facets.any(is_bad)
            })
            .collect();
        if moving.is_empty() {
            break;
        }
        let targets = moving.par_iter().with_min_len(64);
        let targets = targets.map(|&own| target(around, facets, vertices, (own, step)));
        let (targets, count) = project((job, &mut *field), &targets.collect::<Vec<_>>());
        evaluations += count;
        let moved = moving.iter().copied().zip(targets);
        let moved = moved.filter_map(|(own, vertex)| Some((own, vertex?)));
        accept(around, facets, vertices, moved.collect());
        for &number in moving.iter().flat_map(|&own| around.numbers(own)) {
            let facet = &facets[number as usize];
            fitness[number as usize] = facet.fitness(vertices);
        }
    }
    evaluations
}

/// Makes the moves, and takes those back that make the worst triangle around them worse.
fn accept(
    around: &Around,
    facets: &[impl Patch],
    vertices: &mut [Vertex],
    mut moved: Vec<(u32, Vertex)>,
) {
    let before: Vec<(f64, Vertex)> = moved
        .par_iter()
        .map(|&(own, _)| (worst(around, facets, vertices, own), vertices[own as usize]))
        .collect();
    for &(own, vertex) in &moved {
        vertices[own as usize] = vertex;
    }
    let mut back: Vec<(f64, Vertex)> = before;
    for review in 0..REVIEWS {
        let worse: Vec<bool> = moved
            .par_iter()
            .zip(&back)
            .map(|(&(own, _), (before, _))| worst(around, facets, vertices, own) < *before)
            .collect();
        if !worse.contains(&true) {
            break;
        }
        // The last review ends with every move that is left around a fold undone.
        let is_last = review + 1 == REVIEWS;
        for ((own, _), (_, (_, old))) in moved
            .iter()
            .zip(worse.iter().zip(&back))
            .filter(|(_, (worse, _))| is_last || **worse)
        {
            vertices[*own as usize] = *old;
        }
        let mut keep = worse.iter().map(|worse| !worse);
        moved.retain(|_| keep.next().unwrap_or(false));
        let mut keep = worse.iter().map(|worse| !worse);
        back.retain(|_| keep.next().unwrap_or(false));
    }
}

/// Where a vertex should go: a part of the way to the middle of its neighbours, in its tangent plane.
fn target(
    around: &Around,
    facets: &[impl Patch],
    vertices: &[Vertex],
    (vertex, part): (u32, f64),
) -> Vertex {
    let own = vertices[vertex as usize];
    let (mut sum, mut count) = (DVec3::ZERO, 0.0);
    for facet in around.of(facets, vertex) {
        let corners = facet.corners();
        let at = corners
            .iter()
            .position(|&corner| corner == vertex)
            .unwrap_or(0);
        // Each neighbour is in two facets, so that one of its two comes from each.
        let next = corners[(at + 1) % corners.len()];
        let across = corners[(at + 2) % corners.len()];
        sum += vertices[next as usize].position + 0.5 * vertices[across as usize].position;
        count += 1.5;
    }
    let step = part * (sum / count - own.position);
    Vertex {
        position: own.position + step - own.normal * own.normal.dot(step),
        ..own
    }
}

/// Puts vertices back on the surface; `None` where that fails. And the number of evaluations.
fn project(
    (job, field): (&Job, &mut Scattered),
    vertices: &[Vertex],
) -> (Vec<Option<Vertex>>, usize) {
    let start = |vertex: &Vertex| Start {
        point: vertex.position,
        low: DVec3::NEG_INFINITY,
        high: DVec3::INFINITY,
        ends: [vertex.position; 2],
    };
    let starts: Vec<Start> = vertices.iter().map(start).collect();
    let (roots, evaluations) = projection::newton(field, job.accuracy, &starts);
    let vertex = |(root, old): (Root, &Vertex)| {
        (!root.is_poor()).then_some(Vertex {
            position: root.position,
            normal: root.normal,
            residual: root.residual,
            rank: old.rank,
        })
    };
    let vertices = roots.into_iter().zip(vertices).map(vertex);
    (vertices.collect(), evaluations)
}
