//! Floaters: adaptive repulsion (Witkin and Heckbert, "Using particles to sample and control
//! implicit surfaces", SIGGRAPH 1994).
//!
//! Particles on the surface repel each other until they are evenly spread. In reading order: the
//! neighbours of each (`neighbours`), what they do to it (`repulsion`, equations 9 to 13), how it
//! then moves (`population`, equation 5), the paper's rules of birth and death (`fission`), and
//! the control of the number (`balance`). Here they come together:
//!
//! 1. Seeds, on every component of the zero set (`seeds`); thinned out they are the first floaters.
//! 2. Adaptive repulsion with a radius for each floater, births and deaths, to a coarse
//!    spacing, which tells the area (`run`).
//! 3. On creases and in corners, which are known ([`super::creases`]), floaters are put at the wanted spacing
//!    and stay.
//! 4. A first generation comes to rest; then every generation is made of the last by births in the
//!    middle between neighbours (`refinement`).
//! 5. Balance: the exact number is made, and repulsion with one radius for all, about half the
//!    spacing, brings them to equilibrium. That is where neighbours are about two radii apart,
//!    "to guarantee strong repulsion" (section 4.3).
//! 6. Newton's polish puts every floater on F = 0 to the tolerance.
//!
//! Floaters on a surface that moves are [`Followers`] (`follow`).
//!
//! With [`Options::exact`] the paper's adaptive repulsion from one seed a component is all of it.
//!
//! It has converged when the number is the one asked for, nobody was born or died any more, and
//! the root mean square step is a few thousandths of the radius. The cost is linear in the number
//! of floaters: about 70 evaluations each.

pub(super) mod balance;
mod fission;
mod follow;
mod neighbours;
mod population;
mod refinement;
mod repulsion;
mod run;
mod seeds;

use glam::DVec3;

use super::creases::creases;
use super::newton::{Point, Polish, polish_to_rounding};
use super::random::Stream;
use super::statistics::{Creased, Dropped, Statistics, Tally};
use super::{Options, Outcome, SampleError, out_of_range};
use crate::engine::{Field, Monitor};
use crate::geometry::{Bounds, Samples};
use fission::Dice;
pub use follow::{Followed, Followers};
use population::{Floater, Population};
use run::Run;
pub(super) use run::default_count;
use seeds::{RELEASED, Seeds, seeds};

/// The purpose of the random stream; the preliminary search and the seeds take smaller numbers.
const FISSION_STREAM: u64 = 2 << 32;

/// Samples the zero set of a field in R2 or R3 by floaters.
pub(super) fn floaters(
    field: &dyn Field,
    start_box: Bounds,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Outcome, SampleError> {
    let dimension = start_box.dimension;
    if dimension == 1 {
        let expected = "\"kinematic\" or \"dynamic\" for the roots of a field in R1";
        return Err(out_of_range("method", expected, "\"floaters\"".to_owned()));
    }
    let mut search_tally = Tally::default();
    let Seeds {
        points: seeds,
        located,
        proof,
    } = seeds(field, start_box, options, monitor, &mut search_tally)?;
    let bounds = located.bounds;
    let tolerance = options.tolerance * bounds.diagonal();
    let creases = match field
        .compiled()
        .filter(|_| !options.exact && !seeds.is_empty())
    {
        Some(compiled) => {
            let found = creases(compiled, bounds, tolerance, monitor);
            Some(found.ok_or(SampleError::Cancelled)?)
        }
        None => None,
    };
    let creased = creases.as_ref().map(Creased::new);
    let mut run = Run {
        creases: creases.filter(|creases| !creases.corners.is_empty() || !creases.arcs.is_empty()),
        population: Population::new(field, located.bounds, options.rules),
        dice: Dice::new(Stream::new(options.seed, FISSION_STREAM)),
        monitor,
        options,
        births: 0,
        deaths: 0,
        pieces: None,
        surveyed: None,
    };
    let settled = run.run(&seeds)?;
    let (samples, dropped) = finish(&mut run.population, options);
    let tally = run.population.tally;
    let singular = samples
        .normals
        .iter()
        .filter(|&&n| n == DVec3::ZERO)
        .count() as u64;
    let statistics = Statistics {
        started: if seeds.is_empty() {
            RELEASED
        } else {
            run.population.floaters.len() as u64
        },
        points: samples.positions.len() as u64,
        iterations: tally.iterations,
        steps: search_tally.steps + tally.steps,
        evaluations: search_tally.evaluations + tally.evaluations,
        dropped,
        converged: settled && located.settled && dropped.total() == 0,
        births: Some(run.births),
        deaths: Some(run.deaths),
        pieces: run.pieces,
        searches: located.rounds,
        settled: located.settled,
        max_residual: samples.residuals.iter().copied().fold(0.0, f64::max),
        proof,
        nan_points: search_tally.undefined_evaluations + tally.undefined_evaluations,
        singular,
        energy: run.population.energy(),
        creases: creased.map(|creased| Creased {
            points: run.population.pinned(),
            ..creased
        }),
        ..Statistics::new(located.bounds)
    };
    Ok(Outcome {
        samples,
        statistics,
    })
}

/// Puts every floater on the surface, within the box, and makes the sample.
fn finish(population: &mut Population, options: &Options) -> (Samples, Dropped) {
    population.land(0.0);
    let bounds = population.bounds;
    let diagonal = bounds.diagonal();
    let radius = |floaters: &[Floater]| floaters.first().map_or(0.0, |first| first.radius);
    let wanted = Polish {
        tolerance: options.tolerance * diagonal,
        leash: radius(&population.floaters).max(10.0 * options.tolerance * diagonal),
        diagonal,
    };
    let points = population.floaters.iter().map(|floater| Point {
        position: floater.position,
        here: floater.here,
    });
    let (polished, evaluations) = polish_to_rounding(population.field, &wanted, points);
    population.tally.evaluations += evaluations;
    // The polish knows no walls: what it puts beyond by a rounding is put back.
    let inside = |position: DVec3| position.clamp(bounds.min, bounds.max);
    let places: Vec<DVec3> = polished
        .iter()
        .flatten()
        .map(|point| inside(point.position))
        .collect();
    let there = population.evaluate(&places);
    let mut samples = Samples {
        dimension: bounds.dimension,
        ..Samples::default()
    };
    let mut dropped = Dropped {
        unconverged: polished.iter().filter(|point| point.is_none()).count() as u64,
        ..Dropped::default()
    };
    let radii = population.floaters.iter().zip(&polished);
    let radii = radii
        .filter(|(_, point)| point.is_some())
        .map(|(floater, _)| floater.radius);
    for ((position, here), radius) in places.into_iter().zip(there).zip(radii) {
        if here.distance() <= wanted.tolerance {
            samples.positions.push(position);
            samples.normals.push(here.normal());
            samples.residuals.push(here.distance());
            samples.radii.push(radius);
        } else {
            dropped.left += 1;
        }
    }
    (samples, dropped)
}
