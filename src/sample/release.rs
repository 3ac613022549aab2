//! The release: particles start at random in a box, fly, and are polished.
//!
//! "Select initial sample randomly; simulate physical motions; stop" ("Practical issues"), once.
//! The preliminary search and the final sample are releases that differ in box and number.

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::evaluation::Batch;
use super::flight::{ARRIVAL, Arena, fly};
use super::newton::{Point, Polish, polish_to_rounding};
use super::particle::{Motion, Particle};
use super::random::Stream;
use super::statistics::Tally;
use crate::engine::{Field, Monitor};
use crate::geometry::Bounds;

/// Particles that share calls of the field. The number is fixed because it decides nothing but
/// speed: about the size at which a chunk stays in the first cache and a call's overhead is
/// small.
const CHUNK: u64 = 256;

/// How many starts a particle tries until it finds one where the field is defined.
const START_ATTEMPTS: u64 = 16;

/// Points may move this many arrival distances during the polish: at a zero of multiplicity m
/// the surface is m times as far as |h| / |∇h| says.
const LEASH: f64 = 10.0;

/// One release of particles.
pub(super) struct Release<'a> {
    pub(super) field: &'a dyn Field,
    pub(super) motion: &'a dyn Motion,
    /// Where random starts come from.
    pub(super) stream: Stream,
    /// The number of particles.
    pub(super) count: u64,
    /// The box of the starts, whose diagonal is the unit of length.
    pub(super) bounds: Bounds,
    /// Particles beyond this box are given up.
    pub(super) reach: Bounds,
    /// Points must lie in this box, if there is one.
    pub(super) within: Option<Bounds>,
    /// The largest |h| / |∇h| of a point, relative to the diagonal.
    pub(super) tolerance: f64,
    /// The largest number of steps.
    pub(super) iteration_limit: u32,
}

/// Releases the particles and returns the points of those that reached the surface, in order of
/// the particles' indices, and the counts. `progress` hears the fraction that is done. `None`
/// if the monitor cancelled.
pub(super) fn release(
    release: &Release,
    monitor: &dyn Monitor,
    progress: &(dyn Fn(f64) + Sync),
) -> Option<(Vec<Point>, Tally)> {
    let chunks = release.count.div_ceil(CHUNK);
    let done = AtomicUsize::new(0);
    let parts: Vec<(Vec<Point>, Tally)> = (0..chunks)
        .into_par_iter()
        .map(|chunk| {
            let first = chunk * CHUNK;
            let last = (first + CHUNK).min(release.count);
            let part = release_chunk(release, first..last, &|| monitor.cancelled());
            let finished = done.fetch_add(1, Ordering::Relaxed) + 1;
            progress(finished as f64 / chunks as f64);
            part
        })
        .collect();
    if monitor.cancelled() {
        return None;
    }
    let mut points = Vec::new();
    let mut tally = Tally::default();
    for (part, counts) in parts {
        points.extend(part);
        tally.add(&counts);
    }
    Some((points, tally))
}

/// The particles with these indices, from start to polish.
fn release_chunk(
    release: &Release,
    indices: std::ops::Range<u64>,
    cancelled: &dyn Fn() -> bool,
) -> (Vec<Point>, Tally) {
    let mut tally = Tally::default();
    let diagonal = release.bounds.diagonal();
    let arena = Arena {
        reach: release.reach,
        diagonal,
        arrival: ARRIVAL.max(release.tolerance) * diagonal,
        iteration_limit: release.iteration_limit,
    };
    let particles = start(release, indices, &mut tally);
    let field = release.field;
    let arrived = fly(
        field,
        release.motion,
        &arena,
        particles,
        &mut tally,
        cancelled,
    );
    let wanted = Polish {
        tolerance: release.tolerance * diagonal,
        leash: LEASH * arena.arrival,
        diagonal,
    };
    let near = arrived.iter().map(|particle| Point {
        position: particle.position,
        here: particle.here,
    });
    let (polished, evaluations) = polish_to_rounding(field, &wanted, near);
    tally.evaluations += evaluations;
    let mut points = Vec::with_capacity(polished.len());
    for point in polished {
        match point {
            None => tally.dropped.unconverged += 1,
            Some(point) if is_outside(release.within, point.position) => tally.dropped.left += 1,
            Some(point) => points.push(point),
        }
    }
    (points, tally)
}

fn is_outside(bounds: Option<Bounds>, position: DVec3) -> bool {
    bounds.is_some_and(|bounds| !bounds.contains(position))
}

/// The particles with these indices, each at rest at a random place of the box. Where the field
/// is undefined at a place, the particle tries another; one that finds none is dropped.
fn start(release: &Release, indices: std::ops::Range<u64>, tally: &mut Tally) -> Vec<Particle> {
    let mut started = Vec::new();
    let mut waiting: Vec<u64> = indices.collect();
    let mut batch = Batch::default();
    for attempt in 0..START_ATTEMPTS {
        if waiting.is_empty() {
            break;
        }
        tally.evaluations += waiting.len() as u64;
        let place = |&index: &u64| start_of(release, index, attempt);
        let evaluations = batch.evaluate(release.field, waiting.iter().map(place));
        let mut undefined = Vec::new();
        for (index, here) in waiting.iter().zip(evaluations) {
            if here.is_defined() {
                started.push(Particle::at_rest(*index, place(index), here));
            } else {
                undefined.push(*index);
            }
        }
        tally.undefined_evaluations += undefined.len() as u64;
        waiting = undefined;
    }
    tally.dropped.undefined += waiting.len() as u64;
    started
}

/// Where particle `index` starts at its `attempt`-th try: uniform in the box, and a function of
/// the stream and these two numbers only.
fn start_of(release: &Release, index: u64, attempt: u64) -> DVec3 {
    let place = 3 * (index * START_ATTEMPTS + attempt);
    let fraction = DVec3::new(
        release.stream.unit(place),
        release.stream.unit(place + 1),
        release.stream.unit(place + 2),
    );
    release.bounds.min + fraction * release.bounds.size()
}
