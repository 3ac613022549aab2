//! The samples that become vertices.

use glam::DVec3;
use rayon::prelude::*;

use super::super::continuation::Shifted;
use super::super::edge_roots::Root;
use super::super::grid::Seen;
use super::super::projection::{Start, newton};
use super::super::{Job, PolygonizeError, Statistics};
use super::restricted::values_at_points;
use crate::engine::{CompiledField, Field};
use crate::geometry::nearest_distances;
use crate::sample::{self, sample};

/// How far samples are moved for the triangulation, as a part of the usual distance between neighbours.
/// Samples of a sphere or a plane are all on one sphere up to rounding, so that every decision among
/// them would have to be made with many digits; and it would mean nothing, because they are there
/// up to rounding only.
const SHAKE: f64 = 1.0 / 1_048_576.0;

/// Samples that are moved together.
const BATCH: usize = 1024;

/// Samples on the level set, and those that were inserted at the end of them.
pub(super) struct Cloud {
    pub(super) positions: Vec<DVec3>,
    /// F_x / |F_x|.
    pub(super) normals: Vec<DVec3>,
    /// How far the nearest other sample was at the beginning, or when it was inserted.
    distances: Vec<f64>,
    /// The median of these.
    usual: f64,
    /// Samples that are not on the level set or not in the box.
    pub(super) left_out_before: usize,
    pub(super) statistics: Statistics,
}

impl Cloud {
    /// The samples among the options, put onto the level set, or floaters.
    pub(super) fn new(job: &Job) -> Result<Self, PolygonizeError> {
        let given = &job.options.samples;
        let made;
        let points = if given.is_empty() {
            made = floaters(job)?;
            &made
        } else {
            given
        };
        let distances = nearest_distances(points);
        let (roots, evaluations) = put_on_level_set(job, points, &distances);
        let mut cloud = Cloud {
            positions: Vec::with_capacity(points.len()),
            normals: Vec::with_capacity(points.len()),
            distances: Vec::with_capacity(points.len()),
            usual: median(&distances),
            left_out_before: 0,
            statistics: Statistics {
                evaluations,
                ..Statistics::default()
            },
        };
        let doubles = doubles(points, &distances);
        for ((root, &distance), double) in roots.iter().zip(&distances).zip(doubles) {
            let is_out = !job.options.bounds.contains(root.position);
            match double || root.is_poor() || is_out {
                true => cloud.left_out_before += 1,
                false => cloud.push(root, distance),
            }
        }
        if cloud.len() == 0 && !given.is_empty() {
            return Err(PolygonizeError::NoSamples {
                samples: points.len(),
            });
        }
        Ok(cloud)
    }

    pub(super) fn len(&self) -> usize {
        self.positions.len()
    }

    fn push(&mut self, root: &Root, distance: f64) {
        self.positions.push(root.position);
        self.normals.push(root.normal);
        self.distances.push(distance);
        let residual = &mut self.statistics.max_residual;
        *residual = residual.max(root.residual);
    }

    /// Adds samples at roots.
    pub(super) fn insert(&mut self, roots: &[Root]) {
        for root in roots {
            self.push(root, self.usual);
        }
        self.statistics.inserted += roots.len();
    }

    /// How far from each other samples are at three of them: what is usual, or more where all are sparse.
    pub(super) fn distance_at(&self, corners: [u32; 3]) -> f64 {
        let distances = corners.map(|corner| self.distances[corner as usize]);
        let widest = distances.into_iter().fold(0.0, f64::max);
        match widest.is_finite() {
            true => widest.max(self.usual),
            false => self.usual,
        }
    }

    /// The samples from a number on, each moved a little in a direction of its own.
    pub(super) fn shaken(&self, first: usize) -> Vec<DVec3> {
        let reach = SHAKE * self.usual;
        let later = self.positions.iter().enumerate().skip(first);
        later
            .map(|(number, &position)| {
                // Parts of multiples of three numbers that no rational is near to.
                let part = |step: f64| (number as f64 * step).fract() - 0.5;
                let [x, y, z] = [0.819_172_513, 0.671_043_606, 0.549_700_478].map(part);
                position + reach * DVec3::new(x, y, z)
            })
            .collect()
    }

    /// On which sides of the level set the corners of the box and its centre are.
    pub(super) fn surroundings(&self, job: &Job) -> Seen {
        let bounds = &job.options.bounds;
        let corner = |number: usize| {
            let part = |axis: usize| (number >> axis & 1) as f64;
            bounds.min + bounds.size() * DVec3::from_array([0, 1, 2].map(part))
        };
        let mut points: Vec<DVec3> = (0..8).map(corner).collect();
        points.push(bounds.center());
        Seen::of_values(&values_at_points(job, &points))
    }
}

/// Floaters with distances of a cell.
fn floaters(job: &Job) -> Result<Vec<DVec3>, PolygonizeError> {
    let options = sample::Options {
        spacing: Some(job.options.cell),
        bounds: Some(job.options.bounds),
        tolerance: job.options.tolerance.clamp(1e-15, 0.01),
        count_limit: job.options.cell_limit as u64,
        ..sample::Options::default()
    };
    let iso = job.accuracy.iso;
    let compiled = job.field.compiled().filter(|_| iso != 0.0);
    let level: Option<CompiledField> = compiled.map(|field| field.minus(iso));
    let shifted = Shifted {
        field: job.field,
        iso,
    };
    let field: &dyn Field = match &level {
        Some(level) => level,
        None if iso == 0.0 => job.field,
        None => &shifted,
    };
    let outcome = sample(field, &options, job.monitor).map_err(PolygonizeError::Sampling)?;
    Ok(outcome.samples.positions)
}

/// The roots that Newton's method comes to from samples, not farther away than half of the way to the
/// next, and the number of evaluations.
fn put_on_level_set(job: &Job, points: &[DVec3], distances: &[f64]) -> (Vec<Root>, usize) {
    let (field, accuracy) = (job.field, job.accuracy);
    let parts: Vec<(Vec<Root>, usize)> = points
        .par_chunks(BATCH)
        .zip(distances.par_chunks(BATCH))
        .map(|(points, distances)| {
            let starts = points.iter().zip(distances).map(|(&point, &distance)| {
                let reach = 0.5 * distance.min(job.options.cell).max(accuracy.distance);
                Start {
                    point,
                    low: point - reach,
                    high: point + reach,
                    ends: [point; 2],
                }
            });
            newton(&mut { field }, accuracy, &starts.collect::<Vec<_>>())
        })
        .collect();
    let evaluations = parts.iter().map(|part| part.1).sum();
    let roots = parts.into_iter().flat_map(|part| part.0);
    (roots.collect(), evaluations)
}

/// Which points are in the same place as an earlier one.
fn doubles(points: &[DVec3], distances: &[f64]) -> Vec<bool> {
    let mut same: Vec<usize> = (0..points.len())
        .filter(|&place| distances[place] == 0.0)
        .collect();
    // The sum with 0 is 0 for both zeros.
    let coordinates = |place: usize| (points[place] + 0.0).to_array().map(f64::to_bits);
    same.sort_by_key(|&place| (coordinates(place), place));
    let mut doubles = vec![false; points.len()];
    for pair in same.windows(2) {
        doubles[pair[1]] = points[pair[0]] == points[pair[1]];
    }
    doubles
}

/// The middle one of numbers, 0 of none that are finite.
fn median(numbers: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = numbers.iter().copied().filter(|n| n.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}
