//! Points onto a level set, by Newton's method along the gradient.

use glam::DVec3;
use rayon::iter::{IndexedParallelIterator, ParallelIterator};
use rayon::slice::ParallelSliceMut;

use super::columns::Columns;
use crate::engine::Field;

/// Newton's method doubles the digits in each step: from a distance that it can cope with these are
/// enough.
const STEPS: usize = 10;

/// Moves points near the level set F = iso of a field in R3 onto it by p ← p − (F − iso) F_x / |F_x|²,
/// and writes the unit normals F_x / |F_x| beside them.
///
/// A point that would have to go farther than `reach`, or comes to where F or F_x is not finite or
/// F_x = 0, stays with its normal. Of all points on its way the one with the least |F − iso| is
/// taken. There are as many normals as points. Costs ten evaluations a point at most, in parallel;
/// the result does not depend on the number of threads.
pub fn project(
    field: &dyn Field,
    iso: f64,
    reach: f64,
    points: &mut [DVec3],
    normals: &mut [DVec3],
) {
    const BATCH: usize = 1024;
    points
        .par_chunks_mut(BATCH)
        .zip(normals.par_chunks_mut(BATCH))
        .for_each(|(points, normals)| project_batch(field, iso, reach, points, normals));
}

fn project_batch(
    field: &dyn Field,
    iso: f64,
    reach: f64,
    points: &mut [DVec3],
    normals: &mut [DVec3],
) {
    let starts = points.to_vec();
    let mut ways = starts.clone();
    let mut least = vec![f64::INFINITY; points.len()];
    let mut under_way: Vec<usize> = (0..points.len()).collect();
    for _ in 0..STEPS {
        let here: Vec<DVec3> = under_way.iter().map(|&place| ways[place]).collect();
        let (values, gradients) = values_at(field, &here);
        let mut going_on = Vec::new();
        for ((&place, value), gradient) in under_way.iter().zip(values).zip(gradients) {
            let value = value - iso;
            let slope = gradient.length();
            // NaN fails each of the tests.
            let is_better = value.abs() < least[place] && slope > 0.0 && slope.is_finite();
            if !is_better || ways[place].distance(starts[place]) > reach {
                continue;
            }
            least[place] = value.abs();
            points[place] = ways[place];
            normals[place] = gradient / slope;
            let step = normals[place] * (value / slope);
            if value != 0.0 && step.is_finite() {
                ways[place] -= step;
                going_on.push(place);
            }
        }
        under_way = going_on;
        if under_way.is_empty() {
            break;
        }
    }
}

/// F and F_x at points of R3.
pub fn values_at(field: &dyn Field, points: &[DVec3]) -> (Vec<f64>, Vec<DVec3>) {
    let mut columns = Columns::default();
    columns.set_points(points.iter().copied());
    columns.evaluate(&mut { field }, 0.0);
    columns.results().unzip()
}
