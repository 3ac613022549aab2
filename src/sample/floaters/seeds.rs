//! Where floaters start: a seed on every component of the zero set.
//!
//! Given seeds are put on the zero set and are all there is. Otherwise the cover of the box
//! (`cover`) gives a seed in each of its cells, which proves that no component is missed. In cells
//! that it has left open, and for fields of which nothing can be enclosed, seeds are looked for:
//! by Newton's method from the cells, and by kinematic particles released all over the box.

use glam::DVec3;
use rustc_hash::FxHashSet;

use crate::engine::{CompiledField, Field, Monitor};
use crate::geometry::Bounds;
use crate::sample::Potential;
use crate::sample::cover::{Cell, cover};
use crate::sample::evaluation::Batch;
use crate::sample::kinematic::Kinematic;
use crate::sample::newton::{Point, Polish, polish};
use crate::sample::random::Stream;
use crate::sample::release::{Release, release};
use crate::sample::statistics::{Proof, Tally};
use crate::sample::{Options, SampleError, out_of_range, search};

/// The purpose of the random stream; the preliminary search takes the small numbers.
const SEED_STREAM: u64 = 1 << 32;

/// Particles released to find seeds.
pub(super) const RELEASED: u64 = 1024;

/// A given seed may be off the zero set by this part of the box's diagonal.
const FARTHEST_OFF: f64 = 0.1;

/// Cells that are left open and tried by Newton's method, at most.
const TRIED: usize = 1 << 12;

/// Of seeds in a cube of this part of the box's longest side one is enough.
const FINEST: f64 = 1.0 / 64.0;

/// Seeds, and how they were found.
pub(super) struct Seeds {
    pub(super) points: Vec<Point>,
    pub(super) located: search::Located,
    pub(super) proof: Option<Proof>,
}

/// Finds seeds in the bounds or, without any, in the box that the preliminary search finds.
pub(super) fn seeds(
    field: &dyn Field,
    start_box: Bounds,
    options: &Options,
    monitor: &dyn Monitor,
    tally: &mut Tally,
) -> Result<Seeds, SampleError> {
    let first = Release {
        field,
        motion: &Kinematic {
            potential: Potential::Absolute,
        },
        stream: Stream::new(options.seed, SEED_STREAM),
        count: RELEASED,
        bounds: start_box,
        reach: search::reach(options.bounds, start_box),
        within: options.bounds,
        tolerance: options.tolerance,
        iteration_limit: options.iteration_limit,
    };
    let located = match options.bounds {
        Some(bounds) => search::Located {
            bounds,
            rounds: 0,
            settled: true,
        },
        None => search::locate(&first, options, monitor, tally)?,
    };
    let mut seeds = Seeds {
        points: Vec::new(),
        located,
        proof: None,
    };
    let bounds = seeds.located.bounds;
    if !options.seeds.is_empty() {
        seeds.points = given(field, bounds, options, tally)?;
        return Ok(seeds);
    }
    if let Some(compiled) = field.compiled() {
        let proof = covered(compiled, &mut seeds, options, monitor, tally)?;
        seeds.proof = Some(proof);
        if proof.left == 0 {
            return Ok(seeds);
        }
    }
    let last = Release {
        bounds,
        reach: search::reach(options.bounds, bounds),
        within: Some(bounds),
        ..first
    };
    let (points, counts) = release(&last, monitor, &|_| ()).ok_or(SampleError::Cancelled)?;
    tally.add(&counts);
    seeds.points.extend(points);
    Ok(seeds)
}

/// The seeds that were asked for, put on the zero set.
fn given(
    field: &dyn Field,
    bounds: Bounds,
    options: &Options,
    tally: &mut Tally,
) -> Result<Vec<Point>, SampleError> {
    let diagonal = bounds.diagonal();
    let leash = FARTHEST_OFF * diagonal;
    let points = put(
        field,
        bounds,
        (leash, options.tolerance),
        &options.seeds,
        tally,
    );
    for (seed, point) in options.seeds.iter().zip(&points) {
        if point.is_none() {
            let expected = format!(
                "points of the box within {leash:.3} of the zero set, from which it is reached"
            );
            let found = format!("{:?}", &seed.to_array()[..bounds.dimension]);
            return Err(out_of_range("seeds", &expected, found));
        }
    }
    Ok(points.into_iter().flatten().collect())
}

/// Seeds in the cells of the cover.
fn covered(
    field: &CompiledField,
    seeds: &mut Seeds,
    options: &Options,
    monitor: &dyn Monitor,
    tally: &mut Tally,
) -> Result<Proof, SampleError> {
    let bounds = seeds.located.bounds;
    let cover = cover(field, &bounds, monitor).ok_or(SampleError::Cancelled)?;
    tally.evaluations += cover.evaluations;
    let leash = 1e-3 * bounds.diagonal();
    let enough = sparse(&cover.points, FINEST * bounds.size().max_element());
    let points = put(field, bounds, (leash, options.tolerance), &enough, tally);
    seeds.points.extend(points.into_iter().flatten());
    // Evenly from all of them, where they are too many.
    let stride = cover.left.len().div_ceil(TRIED).max(1);
    let tried: Vec<&Cell> = cover.left.iter().step_by(stride).collect();
    let middles: Vec<DVec3> = tried
        .iter()
        .map(|cell| cell.low.midpoint(cell.high))
        .collect();
    let leash = 2.0 * cover.largest_left();
    let points = put(field, bounds, (leash, options.tolerance), &middles, tally);
    seeds.points.extend(points.into_iter().flatten());
    Ok(Proof {
        covered: cover.points.len() as u64,
        left: cover.left.len() as u64,
        largest_left: cover.largest_left(),
    })
}

/// The first point in each cube of a side.
fn sparse(points: &[DVec3], side: f64) -> Vec<DVec3> {
    let mut taken = FxHashSet::default();
    let cube = |point: &DVec3| (*point / side).floor().to_array().map(|place| place as i64);
    points
        .iter()
        .copied()
        .filter(|point| taken.insert(cube(point)))
        .collect()
}

/// Puts places on the zero set, not farther than the leash and within the box; `None` for those
/// with which that fails.
fn put(
    field: &dyn Field,
    bounds: Bounds,
    (leash, tolerance): (f64, f64),
    places: &[DVec3],
    tally: &mut Tally,
) -> Vec<Option<Point>> {
    let diagonal = bounds.diagonal();
    let mut batch = Batch::default();
    let here = batch.evaluate(field, places.iter().copied());
    let points: Vec<Point> = places
        .iter()
        .zip(here)
        .map(|(&position, here)| Point { position, here })
        .collect();
    let wanted = Polish {
        tolerance: tolerance * diagonal,
        leash: leash.max(10.0 * tolerance * diagonal),
        diagonal,
    };
    let (polished, evaluations) = polish(field, &wanted, points.iter().copied());
    tally.evaluations += evaluations + places.len() as u64;
    let inside = |point: &Point| bounds.contains(point.position);
    polished
        .into_iter()
        .map(|point| point.filter(inside))
        .collect()
}
