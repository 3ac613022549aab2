//! Thinning: collapse points that lie close together into one.
//!
//! Particle samples "usually contain many almost coincident points; such concentrations occur at
//! singularities and points of high curvature" ("Practical issues"). The paper's remedy is to
//! collapse δ-cliques, sets of points no two of which are farther apart than δ, and its
//! approximation of that is used here: divide the bounding box of the sample into square buckets
//! of side δ and collapse the points of each bucket, "either by electing representative or by
//! using the barycenter".

use glam::DVec3;

use super::evaluation::Batch;
use super::newton::{Point, Polish, polish_to_rounding};
use super::radii::radii;
use super::{SampleError, out_of_range};
use crate::engine::Field;
use crate::geometry::Samples;

/// What becomes of the points in a bucket.
#[derive(Clone, Copy)]
pub enum Keep<'a> {
    /// The one nearest to their barycentre stays, the first of equals. It keeps its normal and
    /// its residual.
    Representative,
    /// Their barycentre, put back onto the zero set of this field: on a curved surface it lies
    /// a few per cent of δ off. Where that does not succeed the representative stays.
    Barycenter(&'a dyn Field),
}

/// The largest |F| / |F_x| of a barycentre that was put back, relative to the diagonal of the
/// sample's bounding box.
const TOLERANCE: f64 = 1e-9;

/// Collapses the points in each bucket of side `delta`, in lexicographic order of the buckets.
///
/// The buckets are found by sorting, thus the cost is O(n log n) for n points plus, for
/// barycentres, some evaluations of the field per bucket. Radii are computed afresh. Points of
/// neighbouring buckets may be closer than `delta`.
///
/// # Errors
/// If `delta` is not a positive finite number, if it is smaller than the rounding of the
/// coordinates, or if the field has another number of coordinates than the samples.
pub fn thin(samples: &Samples, delta: f64, keep: Keep<'_>) -> Result<Samples, SampleError> {
    if let Keep::Barycenter(field) = keep
        && field.dimension() != samples.dimension
    {
        return Err(SampleError::Dimension {
            bounds: samples.dimension,
            field: field.dimension(),
        });
    }
    let low = fold(&samples.positions, DVec3::min);
    let extent = fold(&samples.positions, DVec3::max) - low;
    let finest = extent.max_element() / (1_u64 << 52) as f64;
    if !(delta > finest && delta.is_finite()) {
        let expected = "a positive number, larger than the rounding of the coordinates";
        return Err(out_of_range("delta", expected, delta.to_string()));
    }
    let buckets = buckets(&samples.positions, low, delta);
    let representatives: Vec<usize> = buckets
        .iter()
        .map(|bucket| representative(&samples.positions, bucket))
        .collect();
    let mut thinned = Samples {
        dimension: samples.dimension,
        positions: pick(&samples.positions, &representatives),
        normals: pick(&samples.normals, &representatives),
        residuals: pick(&samples.residuals, &representatives),
        radii: Vec::new(),
        tangents: match (samples.tangents.is_empty(), &keep) {
            (false, Keep::Representative) => pick(&samples.tangents, &representatives),
            _ => Vec::new(),
        },
        weights: Vec::new(),
    };
    if let Keep::Barycenter(field) = keep {
        let barycentres = buckets
            .iter()
            .map(|bucket| barycentre(&samples.positions, bucket));
        replace_by_barycentres(&mut thinned, barycentres, field, delta, extent.length());
    }
    thinned.radii = radii(&thinned.positions);
    Ok(thinned)
}

/// The componentwise minimum or maximum of the positions, 0 without any.
fn fold(positions: &[DVec3], pick: fn(DVec3, DVec3) -> DVec3) -> DVec3 {
    positions.iter().copied().reduce(pick).unwrap_or_default()
}

fn pick<T: Copy>(list: &[T], places: &[usize]) -> Vec<T> {
    places
        .iter()
        .filter_map(|&place| list.get(place).copied())
        .collect()
}

/// The buckets that hold points: for each, the places of its points in the list, ascending.
fn buckets(positions: &[DVec3], low: DVec3, delta: f64) -> Vec<Vec<usize>> {
    let key = |position: DVec3| {
        ((position - low) / delta)
            .floor()
            .to_array()
            .map(|k| k as i64)
    };
    let mut keyed: Vec<([i64; 3], usize)> = positions
        .iter()
        .enumerate()
        .map(|(place, &position)| (key(position), place))
        .collect();
    keyed.sort_unstable();
    keyed
        .chunk_by(|(one, _), (other, _)| one == other)
        .map(|bucket| bucket.iter().map(|&(_, place)| place).collect())
        .collect()
}

fn barycentre(positions: &[DVec3], bucket: &[usize]) -> DVec3 {
    // Differences from one of them are small, which keeps the rounding of the sum small.
    let origin = positions[bucket[0]];
    let sum: DVec3 = bucket.iter().map(|&place| positions[place] - origin).sum();
    origin + sum / bucket.len() as f64
}

/// The place of the point nearest to the barycentre of the bucket, the first of equals.
fn representative(positions: &[DVec3], bucket: &[usize]) -> usize {
    let centre = barycentre(positions, bucket);
    let distance = |place: usize| positions[place].distance_squared(centre);
    let mut best = bucket[0];
    for &place in bucket {
        if distance(place) < distance(best) {
            best = place;
        }
    }
    best
}

/// Replaces each point by the barycentre of its bucket, put back onto the zero set.
fn replace_by_barycentres(
    samples: &mut Samples,
    barycentres: impl Iterator<Item = DVec3>,
    field: &dyn Field,
    delta: f64,
    diagonal: f64,
) {
    let barycentres: Vec<DVec3> = barycentres.collect();
    let wanted = Polish {
        tolerance: TOLERANCE * diagonal,
        leash: delta,
        diagonal,
    };
    let mut batch = Batch::default();
    let there = batch.evaluate(field, barycentres.iter().copied());
    let points = barycentres
        .iter()
        .zip(there)
        .map(|(&position, here)| Point { position, here });
    let points: Vec<Point> = points.collect();
    let (polished, _) = polish_to_rounding(field, &wanted, points.into_iter());
    for (place, point) in polished.into_iter().enumerate() {
        if let Some(Point { position, here }) = point {
            samples.positions[place] = position;
            samples.normals[place] = here.normal();
            samples.residuals[place] = here.distance();
        }
    }
}
