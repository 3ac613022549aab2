//! Better triangles: vertices of badly shaped ones slide along the surface.
//!
//! A vertex on a smooth part whose facets contain a bad triangle moves toward the middle of its
//! neighbours, in the tangent plane, and is put back on the surface by Newton's method (a Laplacian
//! smoothing; only those that need it move, for F costs more than anything else here). Moves that
//! do not improve the worst triangle around a vertex are taken back, so that no facet is folded.

use glam::DVec3;
use rayon::prelude::*;

use super::around::{Around, worst};
use super::facets::Facet;
use super::place::Vertex;
use crate::engine::Field;
use crate::polygonize::Job;
use crate::polygonize::columns::Columns;

/// Sweeps over the bad triangles.
const SWEEPS: usize = 6;

/// Triangles below this shape are improved, where 1 is equilateral.
const GOOD: f64 = 0.6;

/// Passes that take back moves which have made something worse.
const REVIEWS: usize = 4;

/// Steps of Newton's method after a move; its error is squared in each.
const STEPS: usize = 4;

/// Points evaluated together.
const BATCH: usize = 1024;

/// Moves vertices until the triangles around them are good; returns the number of evaluations.
pub(super) fn relax(
    job: &Job,
    facets: &[Facet],
    around: &Around,
    vertices: &mut [Vertex],
) -> usize {
    let mut evaluations = 0;
    for _ in 0..SWEEPS {
        if job.monitor.cancelled() {
            break;
        }
        let moving: Vec<u32> = (0..vertices.len() as u32)
            .into_par_iter()
            .filter(|&own| {
                let vertex = &vertices[own as usize];
                vertex.rank == 1 && worst(around, facets, vertices, own) < GOOD
            })
            .collect();
        if moving.is_empty() {
            break;
        }
        let targets = moving
            .par_iter()
            .map(|&own| target(around, facets, vertices, own));
        let targets: Vec<Vertex> = targets.collect();
        let batches: Vec<(Vec<Option<Vertex>>, usize)> = targets
            .par_chunks(BATCH)
            .map(|targets| project(job, targets))
            .collect();
        evaluations += batches.iter().map(|(_, count)| count).sum::<usize>();
        let moved = batches.into_iter().flat_map(|(vertices, _)| vertices);
        let moved = moving.iter().copied().zip(moved);
        let moved = moved
            .filter_map(|(own, vertex)| Some((own, vertex?)))
            .collect();
        accept(around, facets, vertices, moved);
    }
    evaluations
}

/// Makes the moves, and takes those back that make the worst triangle around them worse.
fn accept(
    around: &Around,
    facets: &[Facet],
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

/// Where a vertex should go: the middle of its neighbours, in its tangent plane.
fn target(around: &Around, facets: &[Facet], vertices: &[Vertex], vertex: u32) -> Vertex {
    let own = vertices[vertex as usize];
    let (mut sum, mut count) = (DVec3::ZERO, 0.0);
    for facet in around.of(facets, vertex) {
        let at = facet
            .corners
            .iter()
            .position(|&corner| corner == vertex)
            .unwrap_or(0);
        // Each neighbour is in two facets, so that one of its two comes from each.
        let next = facet.corners[(at + 1) % 4];
        let across = facet.corners[(at + 2) % 4];
        sum += vertices[next as usize].position + 0.5 * vertices[across as usize].position;
        count += 1.5;
    }
    let step = sum / count - own.position;
    Vertex {
        position: own.position + step - own.normal * own.normal.dot(step),
        ..own
    }
}

/// Puts vertices back on the surface; `None` where that fails.
fn project(job: &Job, vertices: &[Vertex]) -> (Vec<Option<Vertex>>, usize) {
    let mut columns = Columns::default();
    let mut field: &dyn Field = job.field;
    let mut points: Vec<DVec3> = vertices.iter().map(|vertex| vertex.position).collect();
    let mut found = vec![None; vertices.len()];
    let mut open: Vec<usize> = (0..vertices.len()).collect();
    let mut evaluations = 0;
    for _ in 0..STEPS {
        columns.set_points(open.iter().map(|&place| points[place]));
        columns.evaluate(&mut field, job.accuracy.iso);
        evaluations += open.len();
        let mut next = 0;
        open.retain(|&place| {
            let (value, gradient) = columns.result(next);
            next += 1;
            let length = gradient.length();
            if value.abs() <= job.accuracy.distance * length {
                found[place] = Some(Vertex {
                    position: points[place],
                    normal: gradient / length,
                    residual: value.abs() / length,
                    rank: vertices[place].rank,
                });
                return false;
            }
            points[place] -= gradient * (value / (length * length));
            points[place].is_finite()
        });
        if open.is_empty() {
            break;
        }
    }
    (found, evaluations)
}
