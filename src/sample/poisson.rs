//! Poisson-disk samples: random points of which no two are close, exactly as many as are wanted.
//!
//! A dense sample by rays is thinned out by weighted sample elimination (C. Yuksel, "Sample
//! elimination for generating Poisson disk sample sets", Computer Graphics Forum 34, Eurographics
//! 2015): again and again the point that has the most and the closest neighbours is taken away,
//! until the wanted number is left.
//!
//! What is left is then improved: each point in turn is taken away, and a point of the dense sample
//! comes in where the gap is widest (T. Schlömer, D. Heck and O. Deussen, "Farthest-point optimized
//! point sets with maximized minimum distance", High Performance Graphics 2011, which moves points
//! to the exact middles of gaps in the plane). The exact middles of gaps, put on the surface, join the
//! dense sample in between. In the end hardly a gap is wider than the least distance between two
//! points: it is a maximal Poisson-disk sample, or nearly.
//!
//! Distances are straight, but two points whose normals differ by more than 120 degrees are no
//! neighbours: they lie on two sheets, or on both sides of a thin part.

mod cells;
mod elimination;
mod exchange;

use glam::DVec3;
use rayon::prelude::*;

use super::evaluation::Batch;
use super::floaters::balance::spacing_for;
use super::newton::{Point, Polish, polish_to_rounding};
use super::rays::Harvest;
use super::{Options, Outcome, SampleError, samples};
use crate::engine::{Field, Monitor};
use crate::geometry::Bounds;
use cells::Cells;
use elimination::eliminate;
use exchange::{Exchange, PASSES};

/// Points of the dense sample for each one that is wanted.
const DENSITY: u64 = 6;

/// How often the middles of gaps are added to the dense sample.
const ROUNDS: usize = 12;

/// Places that share calls of the field.
const CHUNK: usize = 256;

/// How far neighbours are looked for, in ideal spacings: the widest gaps are about as wide.
const REACH: f64 = 1.2;

/// The least cosine between the normals of neighbours.
const SAME_SHEET: f64 = -0.5;

/// Samples the zero set of a field in R2 or R3 by elimination.
pub(super) fn poisson(
    field: &dyn Field,
    bounds: Bounds,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Outcome, SampleError> {
    let dimension = bounds.dimension;
    let mut harvest = Harvest::new(field, bounds, options, monitor)?;
    harvest.draw_first()?;
    let count = harvest.number(options)?;
    harvest.draw(DENSITY * count)?;
    let dense: Vec<Point> = harvest.crossings.iter().map(|c| c.point).collect();
    let ask = |phase: &str, fraction| {
        monitor.progress(phase, fraction);
        !monitor.cancelled()
    };
    let area = harvest.counted_area().map_or(0.0, |area| area.value);
    let spacing = spacing_for(dimension, area, count as f64);
    let mut evaluations = 0;
    let kept = if (dense.len() as u64) <= count {
        dense
    } else {
        let polished = |places: &[DVec3]| {
            let (points, cost) = on_surface(field, &bounds, options.tolerance, spacing, places);
            evaluations += cost;
            points
        };
        thin_out(dimension, dense, spacing, count as usize, polished, &ask)
            .ok_or(SampleError::Cancelled)?
    };
    let complete = kept.len() as u64 == count;
    let mut statistics = harvest.statistics(&kept, complete);
    statistics.evaluations += evaluations;
    Ok(Outcome {
        samples: samples(dimension, &kept),
        statistics,
    })
}

/// So many points of the dense ones, well apart. `polished` puts places on the surface, as far as it
/// can. `None` if `ask` says to stop.
fn thin_out(
    dimension: usize,
    mut dense: Vec<Point>,
    spacing: f64,
    count: usize,
    mut polished: impl FnMut(&[DVec3]) -> Vec<Point>,
    ask: &dyn Fn(&str, f64) -> bool,
) -> Option<Vec<Point>> {
    let positions: Vec<DVec3> = dense.iter().map(|point| point.position).collect();
    let order = cells::order(&positions, REACH * spacing);
    dense = order.iter().map(|&index| dense[index as usize]).collect();
    let mut cloud = Cloud::new(dimension, &dense, spacing);
    let eliminating = |fraction| ask("eliminate", fraction);
    eliminating(0.0).then_some(())?;
    let mut sample = eliminate(&cloud, count, &eliminating)?;
    let base = dense.len();
    for round in 0..=ROUNDS {
        let mut exchange = Exchange::new(&mut cloud, &sample);
        let passes = if round < ROUNDS { 1 } else { PASSES };
        exchange.run(&mut sample, passes, &|done| {
            ask("exchange", (round as f64 + done) / (ROUNDS + 1) as f64)
        })?;
        if round < ROUNDS {
            let middles = polished(&exchange.middles());
            keep_chosen(&mut dense, base, &mut sample);
            dense.extend(middles);
            cloud = Cloud::new(dimension, &dense, spacing);
        }
    }
    sample.sort_unstable();
    Some(sample.iter().map(|&index| dense[index as usize]).collect())
}

/// Forgets earlier middles that nobody chose, which stand behind the first `base` points.
fn keep_chosen(dense: &mut Vec<Point>, base: usize, sample: &mut [u32]) {
    let middles = dense.split_off(base);
    for index in sample {
        if let Some(middle) = (*index as usize).checked_sub(base) {
            *index = dense.len() as u32;
            dense.push(middles[middle]);
        }
    }
}

/// Puts places on the surface; those that end up far away or outside of the box are left out. Comes
/// with the number of evaluations.
fn on_surface(
    field: &dyn Field,
    bounds: &Bounds,
    tolerance: f64,
    spacing: f64,
    places: &[DVec3],
) -> (Vec<Point>, u64) {
    let diagonal = bounds.diagonal();
    let wanted = Polish {
        tolerance: tolerance * diagonal,
        leash: 0.5 * spacing,
        diagonal,
    };
    let parts: Vec<(Vec<Point>, u64)> = places
        .par_chunks(CHUNK)
        .map(|places| {
            let mut batch = Batch::default();
            let here = batch.evaluate(field, places.iter().copied());
            let starts: Vec<Point> = (places.iter().zip(here))
                .map(|(&position, here)| Point { position, here })
                .filter(|point| point.here.is_defined())
                .collect();
            let (points, evaluations) = polish_to_rounding(field, &wanted, starts.into_iter());
            let inside = |point: &Point| bounds.contains(point.position);
            let points = points.into_iter().flatten().filter(inside).collect();
            (points, evaluations + places.len() as u64)
        })
        .collect();
    let evaluations = parts.iter().map(|(_, evaluations)| evaluations).sum();
    let points = parts.into_iter().flat_map(|(points, _)| points);
    (points.collect(), evaluations)
}

/// The dense sample.
struct Cloud {
    dimension: usize,
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    /// The distance between neighbours in the ideal pattern of the points that are to be left.
    spacing: f64,
    /// How far points know of each other.
    reach: f64,
    cells: Cells,
}

impl Cloud {
    fn new(dimension: usize, points: &[Point], spacing: f64) -> Cloud {
        let positions: Vec<DVec3> = points.iter().map(|point| point.position).collect();
        Cloud {
            dimension,
            cells: Cells::new(&positions, REACH * spacing),
            normals: points.iter().map(|point| point.here.normal()).collect(),
            positions,
            spacing,
            reach: REACH * spacing,
        }
    }

    /// Calls `visit` with every other point that is within reach, on the same sheet, and
    /// with the squared distance.
    fn neighbours(&self, index: u32, mut visit: impl FnMut(u32, f64)) {
        self.cells.near(index, |other| {
            if let Some(square) = self.square(index, other) {
                visit(other, square);
            }
        });
    }

    /// Like [`Cloud::neighbours`] for chosen points only.
    fn chosen_neighbours(&self, index: u32, mut visit: impl FnMut(u32, f64)) {
        self.cells.near_chosen(index, |other| {
            if let Some(square) = self.square(index, other) {
                visit(other, square);
            }
        });
    }

    /// The squared distance of two neighbours.
    #[inline(always)]
    fn square(&self, one: u32, other: u32) -> Option<f64> {
        let (here, there) = (one as usize, other as usize);
        let square = self.positions[here].distance_squared(self.positions[there]);
        let is_near = square < self.reach * self.reach && one != other;
        let is_neighbour = is_near && self.normals[here].dot(self.normals[there]) >= SAME_SHEET;
        is_neighbour.then_some(square)
    }

    /// The squared distance from a point to the nearest other chosen one, and which that is; of
    /// equally near ones the first. Without any the reach, and the point itself.
    fn nearest_chosen(&self, index: u32) -> (f64, u32) {
        let mut nearest = (self.reach * self.reach, index);
        self.chosen_neighbours(index, |other, square| {
            if (square, other) < nearest {
                nearest = (square, other);
            }
        });
        nearest
    }
}

/// A number that orders heaps; NaN does not occur.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Key {
    value: f64,
    index: u32,
}

impl Eq for Key {}

impl Ord for Key {
    /// By value; of equal ones the earlier index is greater, so that it leaves a heap first.
    #[inline(always)]
    fn cmp(&self, other: &Key) -> std::cmp::Ordering {
        let by_value = self.value.total_cmp(&other.value);
        by_value.then(other.index.cmp(&self.index))
    }
}

impl PartialOrd for Key {
    #[inline(always)]
    fn partial_cmp(&self, other: &Key) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
