//! Floaters: adaptive repulsion (Witkin and Heckbert, "Using particles to sample and control
//! implicit surfaces", SIGGRAPH 1994).
//!
//! Particles on the surface repel each other until they are evenly spread. In reading order: the
//! neighbours of each (`neighbours`), what they do to it (`repulsion`, equations 9 to 13), how it
//! then moves (`population`, equation 5), the paper's rules of birth and death (`fission`), and
//! the control of the number (`balance`). Here they come together:
//!
//! 1. Seeds, on every component of the zero set (`seeds`); thinned out they are the first floaters.
//! 2. Adaptive repulsion with a radius for each floater, births and deaths, first to a coarse
//!    spacing, which tells the area, then to ever finer ones, each halving the radius squared.
//! 3. Balance: the exact number is made, and repulsion with one radius for all, half the
//!    spacing, brings them to equilibrium. That is where neighbours are about two radii apart,
//!    "to guarantee strong repulsion" (section 4.3).
//! 4. Newton's polish puts every floater on F = 0 to the tolerance.
//!
//! It has converged when the number is the one asked for, nobody was born or died any more, and
//! the root mean square step is a few thousandths of the radius. The cost is linear in the number
//! of floaters: about 150 evaluations each.
//!
//! Limits: points on creases lie on either side rather than exactly on the edge.

pub(super) mod balance;
mod fission;
mod neighbours;
mod population;
mod repulsion;
mod seeds;

use glam::DVec3;

use super::newton::{Point, Polish, polish};
use super::random::Stream;
use super::statistics::{Dropped, Statistics, Tally};
use super::{Method, Options, Outcome, SampleError, Varying, out_of_range};
use crate::engine::{Field, Monitor};
use crate::geometry::{Bounds, Samples};
use balance::{number_for, spacing_for};
use fission::Dice;
use population::{Floater, Population, SETTLING};
use seeds::{RELEASED, Seeds, seeds};

/// The purpose of the random stream; the preliminary search and the seeds take smaller numbers.
const FISSION_STREAM: u64 = 2 << 32;

/// The number of points without any wish: a surface, a curve.
const DEFAULT_COUNT: (u64, u64) = (2000, 500);

/// The number of points without any wish, in this dimension.
pub(super) fn default_count(dimension: usize) -> u64 {
    match dimension {
        2 => DEFAULT_COUNT.1,
        _ => DEFAULT_COUNT.0,
    }
}

/// The coarse radius, in units of the surface's diameter: some hundred floaters.
const COARSE: (f64, f64) = (1.0 / 40.0, 1.0 / 100.0);

/// The paper's σ̂ in units of the spacing that it leads to. Radii end between δ σ̂ and σ̂, with
/// neighbours at two radii.
const PAPER_RADIUS: f64 = 0.6;

/// The population may grow to so many times what the area asks for.
const SPARE_CAPACITY: f64 = 2.0;

/// Steps of adaptive repulsion for one desired radius, at most.
const POPULATE_LIMIT: u32 = 80;
/// Floaters that relaxation begins with, more or less.
const FIRST_GENERATION: f64 = 100.0;

/// It has come to rest when so many steps
const QUIET_STEPS: usize = 5;
/// changed the population by no more than this part.
const QUIET_CHANGES: f64 = 0.02;

/// Rounds of balance, at most, and steps in each.
const ROUNDS: u32 = 8;
const ROUND_STEPS: u32 = 16;

/// A number this close to the one that fits the spacing is left alone.
const NEAR_ENOUGH: f64 = 0.004;

/// Where the spacing varies, repulsion carries floaters to where they are missing, but slowly:
/// if more than this part of them is misplaced, they die and others are born.
const MISPLACED: f64 = 0.01;

/// Equilibrium: the root mean square step of the floaters, in radii, on smooth parts of the
/// surface and on creases.
const AT_REST: (f64, f64) = (4e-3, 2e-2);

/// Steps to equilibrium, at most.
const SETTLE_LIMIT: u32 = 400;

/// How often balance begins anew because floaters had to be merged.
const ATTEMPTS: u32 = 2;

/// What was asked for.
#[derive(Clone, Copy)]
enum Goal {
    Spacing(f64),
    Count(u64),
}

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
    let mut run = Run {
        population: Population::new(field, located.bounds),
        dice: Dice::new(Stream::new(options.seed, FISSION_STREAM)),
        monitor,
        options,
        births: 0,
        deaths: 0,
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
        searches: located.rounds,
        settled: located.settled,
        max_residual: samples.residuals.iter().copied().fold(0.0, f64::max),
        proof,
        nan_points: search_tally.undefined_evaluations + tally.undefined_evaluations,
        singular,
        energy: run.population.energy(),
        ..Statistics::new(located.bounds)
    };
    Ok(Outcome {
        samples,
        statistics,
    })
}

/// One run of floaters.
struct Run<'a> {
    population: Population<'a>,
    dice: Dice,
    monitor: &'a dyn Monitor,
    options: &'a Options,
    births: u64,
    deaths: u64,
}

impl Run<'_> {
    /// From seeds to equilibrium; returns whether that was reached.
    fn run(&mut self, seeds: &[Point]) -> Result<bool, SampleError> {
        let dimension = self.population.bounds.dimension;
        let positions = seeds.iter().map(|seed| seed.position);
        let Some(around) = Bounds::of_points(dimension, positions) else {
            return Ok(true);
        };
        let coarse = match dimension {
            2 => COARSE.1,
            _ => COARSE.0,
        };
        self.weigh_seeds(seeds)?;
        let mean = self.population.wanted.map(|(_, mean)| mean);
        let goal = match (self.options.spacing.or(mean), self.options.count) {
            (Some(_), Some(count)) => Goal::Count(count),
            (Some(spacing), _) => Goal::Spacing(spacing),
            (None, count) => Goal::Count(count.unwrap_or(default_count(dimension))),
        };
        // A zero set that is a single point has no diameter.
        let smallest = 1e-6 * self.population.bounds.diagonal();
        let coarse = coarse * around.diagonal().max(smallest);
        let mut radius = match goal {
            Goal::Spacing(spacing) => coarse.max(PAPER_RADIUS * spacing),
            Goal::Count(_) => coarse,
        };
        let seed = |&seed: &Point| Floater::at_rest(seed, radius);
        self.population.floaters = seeds.iter().map(seed).collect();
        self.population.level(radius);
        self.thin_seeds();
        self.populate(radius)?;
        let area = self.population.measure();
        let spacing = match goal {
            Goal::Spacing(spacing) => spacing,
            Goal::Count(count) => spacing_for(dimension, area, count as f64),
        };
        let expected = number_for(dimension, area, spacing);
        let limit = self.options.count_limit;
        if expected > limit as f64 {
            return Err(out_of_range(
                "spacing",
                &format!("larger, for at most {limit} points"),
                format!("{spacing} (which takes about {expected:.0})"),
            ));
        }
        self.population.capacity = (SPARE_CAPACITY * expected) as usize + seeds.len();
        if self.options.method == Method::Relax {
            self.relax(expected)?;
            return self.come_to_rest(goal);
        }
        let finest = PAPER_RADIUS * spacing;
        if radius < finest {
            self.populate(finest)?;
        }
        while radius > finest {
            radius = (radius * std::f64::consts::FRAC_1_SQRT_2).max(finest);
            self.populate(radius)?;
        }
        self.come_to_rest(goal)
    }

    /// Relaxation and global fissioning (Turk, "Generating textures on arbitrary surfaces using
    /// reaction-diffusion", SIGGRAPH 1991, as Witkin and Heckbert tell it in section 4.2): all
    /// floaters have one radius, come to rest, and split all at once, with the radius over √2.
    fn relax(&mut self, expected: f64) -> Result<(), SampleError> {
        let dimension = self.population.bounds.dimension;
        let generations = (expected / FIRST_GENERATION)
            .log2()
            .round()
            .clamp(0.0, 60.0) as u32;
        let first = (expected / (1_u64 << generations) as f64).round().max(1.0);
        self.balance(Goal::Count(first as u64))?;
        // Neighbours come nearer by √2 on a surface, by 2 on a curve.
        let shrink = if dimension == 2 {
            0.5
        } else {
            std::f64::consts::FRAC_1_SQRT_2
        };
        let mut radius = 0.5 * spacing_for(dimension, self.population.measure(), first);
        self.settle()?;
        for _ in 0..generations {
            self.births += self.population.split_all(&mut self.dice) as u64;
            radius *= shrink;
            self.population.level(radius);
            self.settle()?;
        }
        Ok(())
    }

    /// The right number, at rest; returns whether that was reached.
    fn come_to_rest(&mut self, goal: Goal) -> Result<bool, SampleError> {
        for _ in 0..ATTEMPTS {
            let balanced = self.balance(goal)?;
            let rests = self.settle()?;
            let merged = self.population.merge();
            self.deaths += merged as u64;
            if merged == 0 {
                return Ok(balanced && rests);
            }
        }
        Ok(false)
    }

    /// Learns the mean of the wanted spacing, which must be a positive number at every seed.
    fn weigh_seeds(&mut self, seeds: &[Point]) -> Result<(), SampleError> {
        let Some(Varying(wanted)) = &self.options.varying else {
            return Ok(());
        };
        let mut sum = 0.0;
        for seed in seeds {
            let spacing = wanted.value(seed.position);
            if !(spacing > 0.0 && spacing.is_finite()) {
                let place = &seed.position.to_array()[..self.population.bounds.dimension];
                let found = format!("{spacing} at {place:?}");
                let expected = "greater than 0 and finite everywhere on the zero set";
                return Err(out_of_range("spacing", expected, found));
            }
            sum += spacing;
        }
        self.population.wanted = Some((&**wanted, sum / seeds.len() as f64));
        Ok(())
    }

    /// Of seeds closer than a spacing one is enough; the earlier one stays.
    fn thin_seeds(&mut self) {
        let population = &mut self.population;
        population.meet();
        let mut stays = vec![true; population.floaters.len()];
        for index in 0..stays.len() {
            let own = &population.floaters[index];
            let mut near = population.neighbours.of(index).iter().map(|&o| o as usize);
            stays[index] = !near.any(|other| {
                let other_floater = &population.floaters[other];
                let close = other_floater.position.distance(own.position) < 1.6 * own.radius;
                other < index && stays[other] && close && own.normal.dot(other_floater.normal) > 0.0
            });
        }
        let before = population.floaters.len();
        let mut places = stays.into_iter();
        population.floaters.retain(|_| places.next() != Some(false));
        population.changed();
        self.deaths += (before - population.floaters.len()) as u64;
    }

    /// The paper's adaptive repulsion until births and deaths have all but ceased.
    fn populate(&mut self, radius: f64) -> Result<(), SampleError> {
        let mut recent = [u64::MAX / 8; QUIET_STEPS];
        for step in 0..POPULATE_LIMIT {
            self.ask("populate", f64::from(step) / f64::from(POPULATE_LIMIT))?;
            let changes = self.population.adapt(radius, &mut self.dice);
            self.births += changes.births;
            self.deaths += changes.deaths;
            recent[step as usize % QUIET_STEPS] = changes.births + changes.deaths;
            let number = self.population.floaters.len();
            if recent.iter().sum::<u64>() as f64 <= QUIET_CHANGES * number as f64 {
                break;
            }
        }
        // The number that is missing or too many is the business of the balance.
        Ok(())
    }

    /// Makes the number right, in rounds of births or deaths with repulsion between.
    fn balance(&mut self, goal: Goal) -> Result<bool, SampleError> {
        let dimension = self.population.bounds.dimension;
        for round in 0..ROUNDS {
            let area = self.population.measure();
            let present = self.population.floaters.len();
            let (target, near_enough) = match goal {
                Goal::Count(count) => {
                    let last = round + 1 == ROUNDS;
                    let slack = if last { NEAR_ENOUGH } else { 0.0 };
                    (count as f64, slack * count as f64)
                }
                Goal::Spacing(spacing) => {
                    let number = number_for(dimension, area, spacing).round().max(1.0);
                    (number, (NEAR_ENOUGH * number).max(1.0))
                }
            };
            let difference = target - present as f64;
            let radius = 0.5 * spacing_for(dimension, area, target);
            self.population.level(radius);
            self.population.meet();
            let merged = self.population.merge();
            self.deaths += merged as u64;
            let misplaced = self.population.misplaced();
            let well_placed = misplaced <= MISPLACED * target;
            if merged == 0 && round > 0 && difference.abs() <= near_enough && well_placed {
                return Ok(true);
            }
            self.population.meet();
            if !well_placed && round + 1 < ROUNDS {
                self.deaths += self.population.remove(misplaced as usize) as u64;
                self.population.meet();
            }
            let difference = target - self.population.floaters.len() as f64;
            if difference > 0.0 {
                self.births += self.population.add(difference as usize) as u64;
            } else if difference < 0.0 {
                self.deaths += self.population.remove(-difference as usize) as u64;
            }
            for _ in 0..ROUND_STEPS {
                self.ask("balance", f64::from(round) / f64::from(ROUNDS))?;
                self.population.step(&SETTLING);
            }
        }
        Ok(false)
    }

    /// Repulsion with one radius until nobody moves any more.
    fn settle(&mut self) -> Result<bool, SampleError> {
        for step in 0..SETTLE_LIMIT {
            if self.population.tally.iterations >= self.options.iteration_limit {
                break;
            }
            self.ask("settle", f64::from(step) / f64::from(SETTLE_LIMIT))?;
            let unrest = self.population.step(&SETTLING);
            if unrest.smooth < AT_REST.0 && unrest.creases < AT_REST.1 {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Tells the monitor how far it is, and asks it whether to go on.
    fn ask(&self, phase: &str, fraction: f64) -> Result<(), SampleError> {
        if self.monitor.cancelled() {
            return Err(SampleError::Cancelled);
        }
        self.monitor.progress(phase, fraction);
        Ok(())
    }
}

/// Puts every floater on the surface, within the box, and makes the sample.
fn finish(population: &mut Population, options: &Options) -> (Samples, Dropped) {
    population.land();
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
    let (polished, evaluations) = polish(population.field, &wanted, points);
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
