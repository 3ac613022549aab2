//! Level sets with an interior: regions in which F is the level, as max(x² + y² + z² − 1, 0) is
//! inside of the unit sphere. What is made there is the region's boundary at best.

use glam::DVec3;

use super::project::values_at;
use super::{Job, Shape};

/// Facets or segments that are looked at, at most.
const LOOKED_AT: usize = 256;

/// Steps away from a facet, in cells. There are two, lest another sheet at just that distance is
/// taken for a plateau.
const STEPS: [f64; 2] = [0.37, 0.2];

/// Among some facets of a mesh, or segments of curves, how many have points beside them in which F
/// is the level to the last bit, and how many were looked at.
///
/// Costs four evaluations for each.
pub(super) fn plateau(job: &Job, shape: &Shape) -> (usize, usize) {
    let places = places(shape);
    let mut points = Vec::with_capacity(4 * places.len());
    for &(middle, normal) in &places {
        for side in [job.options.cell, -job.options.cell] {
            points.extend(STEPS.map(|step| middle + step * side * normal));
        }
    }
    let (values, _) = values_at(job.field, &points);
    let is_flat = |values: &[f64]| values.iter().all(|&value| value == job.accuracy.iso);
    let beside = |values: &&[f64]| values.chunks(STEPS.len()).any(is_flat);
    let found = values.chunks(2 * STEPS.len()).filter(beside).count();
    (found, places.len())
}

/// The middles of some facets or segments, with a direction of length 1 away from them.
fn places(shape: &Shape) -> Vec<(DVec3, DVec3)> {
    match shape {
        Shape::Roots(_) => Vec::new(),
        Shape::Curves(curves) => {
            let lines = curves.polylines.iter();
            let segments = lines.flat_map(|line| line.points.windows(2));
            let segments: Vec<&[DVec3]> = segments.collect();
            spread(&segments, |pair| {
                let across = (pair[1] - pair[0]).truncate().perp().extend(0.0);
                Some((pair[0].midpoint(pair[1]), across.try_normalize()?))
            })
        }
        Shape::Mesh(mesh) => spread(&mesh.triangles, |triangle| {
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
            Some(((a + b + c) / 3.0, (b - a).cross(c - a).try_normalize()?))
        }),
    }
}

/// What becomes of some elements, evenly over all of them.
fn spread<T, U>(elements: &[T], told: impl Fn(&T) -> Option<U>) -> Vec<U> {
    let step = elements.len().div_ceil(LOOKED_AT).max(1);
    elements.iter().step_by(step).filter_map(told).collect()
}
