//! One run of floaters, from seeds to rest.

use super::balance::{Gap, number_for, spacing_for};
use super::fission::{Dice, Target};
use super::population::{Floater, Motion, Population, SETTLING, SPREADING, WARY};
use crate::engine::Monitor;
use crate::geometry::Bounds;
use crate::sample::creases::Creases;
use crate::sample::newton::Point;
use crate::sample::{Method, Options, SampleError, Varying, out_of_range};

/// The number of points without any wish: a surface, a curve.
const DEFAULT_COUNT: (u64, u64) = (2000, 500);

/// The coarse radius, in units of the surface's diameter: some hundred floaters.
const COARSE: (f64, f64) = (1.0 / 30.0, 1.0 / 100.0);

/// The paper's σ̂ in units of the spacing that it leads to. Radii end between δ σ̂ and σ̂, with
/// neighbours at two radii.
const PAPER_RADIUS: f64 = 0.6;

/// σ^max / σ̂ where there are many floaters from the beginning.
pub(super) const LARGEST: f64 = 1.5;

/// The population may grow to so many times what the area asks for.
const SPARE_CAPACITY: f64 = 2.0;

/// Steps of adaptive repulsion for one desired radius, at most.
const POPULATE_LIMIT: u32 = 80;

/// It has come to rest when so many steps changed the population by no more than this part: before
/// refinement, and where the paper's method is all there is.
const QUIET: (usize, f64) = (5, 0.02);
const QUIET_TO_THE_END: (usize, f64) = (40, 0.005);

/// Radii end below σ̂, by the paper's rules, or a little above.
const TOO_LARGE: f64 = 1.2;

/// The first generation has at least so many floaters, and Turk's about so many.
const FIRST_GENERATION: f64 = 200.0;
const FIRST_OF_TURK: f64 = 100.0;

/// Numbers that differ by more than this factor are made alike by fission and death before births and
/// deaths in the balance, which are few at a time.
const FEWEST_TO_BALANCE: f64 = 0.8;

/// The area of a surface of which there are few floaters is known badly, and so is the radius that
/// leads to a number: so often it is tried.
const ATTEMPTS_TO_START: u32 = 4;

/// Steps after which a generation is in order: the first, and one whose pattern comes from its parents'.
const FIRST_STEPS: u32 = 120;
const NEXT_STEPS: u32 = 12;

/// Rounds of balance, at most, and steps in each.
const ROUNDS: u32 = 12;
const ROUND_STEPS: u32 = 12;

/// A number this close to the one that fits the spacing is left alone.
const NEAR_ENOUGH: f64 = 0.004;

/// Repulsion carries floaters to where they are missing, but slowly, and to no other component: if
/// more than this part of them is misplaced, they die and others are born; a handful is the grain of the
/// pattern.
const MISPLACED: (f64, f64) = (0.01, 4.0);

/// Equilibrium: the root mean square step of the floaters, in radii, on smooth parts of the
/// surface and on creases. Pairs at defects that pass the cutoff keep it at 3e-3 to 4e-3.
const AT_REST: (f64, f64) = (5e-3, 2e-2);

/// Smooth surfaces come to rest within so many steps.
const PATIENCE: u32 = 60;

/// Steps to equilibrium, at most.
const SETTLE_LIMIT: u32 = 400;

/// How often balance begins anew because floaters had to be merged.
const ATTEMPTS: u32 = 4;

/// The number of points without any wish, in this dimension.
pub(in crate::sample) fn default_count(dimension: usize) -> u64 {
    match dimension {
        2 => DEFAULT_COUNT.1,
        _ => DEFAULT_COUNT.0,
    }
}

/// What was asked for.
#[derive(Clone, Copy)]
enum Goal {
    Spacing(f64),
    Count(u64),
}

/// One run of floaters.
pub(super) struct Run<'a> {
    pub(super) population: Population<'a>,
    /// Creases and corners, on which floaters stay.
    pub(super) creases: Option<Creases>,
    pub(super) dice: Dice,
    pub(super) monitor: &'a dyn Monitor,
    pub(super) options: &'a Options,
    pub(super) births: u64,
    pub(super) deaths: u64,
    /// See [`crate::sample::Statistics::pieces`].
    pub(super) pieces: Option<u64>,
    /// How many floaters the area was first measured with, and the area.
    pub(super) surveyed: Option<(usize, f64)>,
}

impl Run<'_> {
    /// From seeds to equilibrium; returns whether that was reached.
    pub(super) fn run(&mut self, seeds: &[Point]) -> Result<bool, SampleError> {
        let dimension = self.population.bounds.dimension;
        let positions = seeds.iter().map(|seed| seed.position);
        let Some(around) = Bounds::of_points(dimension, positions) else {
            return Ok(true);
        };
        // A zero set that is a single point has no diameter, and given seeds tell of none.
        let box_diagonal = self.population.bounds.diagonal();
        let diameter = match self.options.seeds.is_empty() {
            true => around.diagonal().max(1e-6 * box_diagonal),
            false => box_diagonal,
        };
        self.weigh_seeds(seeds)?;
        if self.options.exact {
            return self.follow_paper(seeds, diameter);
        }
        let goal = self.goal();
        let coarse = diameter * if dimension == 2 { COARSE.1 } else { COARSE.0 };
        let radius = match goal {
            Goal::Spacing(spacing) => coarse.max(PAPER_RADIUS * spacing),
            Goal::Count(_) => coarse,
        };
        self.begin(seeds, radius);
        self.populate(Target::many(radius), POPULATE_LIMIT, QUIET)?;
        let firsts = self.population.first_of_each_piece();
        self.pieces = Some(firsts.iter().filter(|&&first| first).count() as u64);
        let area = self.population.measure();
        self.surveyed = Some((self.population.floaters.len(), area));
        let spacing = match goal {
            Goal::Spacing(spacing) => spacing,
            Goal::Count(count) => spacing_for(dimension, area, count as f64),
        };
        let expected = number_for(dimension, area, spacing);
        self.check_limit(expected, spacing)?;
        self.population.capacity = (SPARE_CAPACITY * expected) as usize + seeds.len();
        match self.options.method {
            Method::Relax => self.relax(expected)?,
            _ => self.grow(expected)?,
        }
        self.come_to_rest(goal)
    }

    fn goal(&self) -> Goal {
        let dimension = self.population.bounds.dimension;
        let mean = self.population.wanted.map(|(_, mean)| mean);
        match (self.options.spacing.or(mean), self.options.count) {
            (Some(_), Some(count)) => Goal::Count(count),
            (Some(spacing), _) => Goal::Spacing(spacing),
            (None, count) => Goal::Count(count.unwrap_or(default_count(dimension))),
        }
    }

    fn check_limit(&self, expected: f64, spacing: f64) -> Result<(), SampleError> {
        let limit = self.options.count_limit;
        if expected <= limit as f64 {
            return Ok(());
        }
        Err(out_of_range(
            "spacing",
            &format!("larger, for at most {limit} points"),
            format!("{spacing} (which takes about {expected:.0})"),
        ))
    }

    /// Seeds become floaters, as many as fit in with this radius.
    fn begin(&mut self, seeds: &[Point], radius: f64) {
        let seed = |&seed: &Point| Floater::at_rest(seed, radius);
        self.population.floaters = seeds.iter().map(seed).collect();
        self.population.level(radius);
        self.population.changed();
        self.thin_seeds();
    }

    /// The paper's method from one floater a component to the end: adaptive repulsion with fission
    /// and death, and no other means. Returns whether births and deaths have ceased.
    fn follow_paper(&mut self, seeds: &[Point], diameter: f64) -> Result<bool, SampleError> {
        let rules = self.options.rules;
        let dimension = self.population.bounds.dimension;
        let from_spacing = self.options.spacing.map(|spacing| PAPER_RADIUS * spacing);
        let desired = rules.sigma.or(from_spacing).unwrap_or(diameter / 50.0);
        let largest = rules
            .sigma_max
            .unwrap_or((0.5 * diameter).max(LARGEST * desired));
        let coarse = diameter * if dimension == 2 { COARSE.1 } else { COARSE.0 };
        // The surface is part of a sphere of its diameter, but may be folded.
        let size = if dimension == 2 {
            diameter
        } else {
            diameter * diameter
        };
        let most = 100.0 * number_for(dimension, size, desired);
        let limit = self.options.count_limit as f64;
        self.begin(seeds, coarse);
        self.population.capacity = most.min(limit) as usize;
        self.keep_one_of_each_piece();
        for floater in &mut self.population.floaters {
            floater.radius = desired;
        }
        self.population.changed();
        let target = Target {
            desired,
            largest,
            in_turn: false,
        };
        let limit = self.options.iteration_limit;
        loop {
            let left = limit.saturating_sub(self.population.tally.iterations);
            let is_quiet = self.populate(target, left, QUIET_TO_THE_END)?;
            // Who is too large is still growing, or should have split, but found no place, as at
            // sharp edges.
            let floaters = &self.population.floaters;
            let too_large =
                |floater: &&Floater| floater.radius > TOO_LARGE * desired * floater.weight;
            let growing = floaters.iter().filter(too_large).count();
            let is_done = growing as f64 <= QUIET.1 * floaters.len() as f64;
            if is_done || !is_quiet {
                return Ok(is_quiet);
            }
        }
    }

    /// From a first generation in good order to the final number: middles between neighbours become
    /// floaters, generation by generation, each four times as many (on a curve twice) as the last.
    fn grow(&mut self, expected: f64) -> Result<(), SampleError> {
        let factor = match self.population.bounds.dimension {
            2 => 2.0,
            _ => 4.0,
        };
        let (mut number, mut generations) = (expected, 0);
        while number >= factor * FIRST_GENERATION {
            number /= factor;
            generations += 1;
        }
        number = number.round().max(1.0);
        self.start(number)?;
        self.steps("settle", FIRST_STEPS, &SPREADING)?;
        self.repair()?;
        for _ in 0..generations {
            self.births += self.population.refine() as u64;
            number *= factor;
            self.pin(number)?;
            self.steps("refine", NEXT_STEPS, &SPREADING)?;
            self.repair()?;
        }
        Ok(())
    }

    /// Makes a first generation of so many.
    fn start(&mut self, number: f64) -> Result<(), SampleError> {
        for _ in 0..ATTEMPTS_TO_START {
            let ratio = self.population.floaters.len() as f64 / number;
            if (FEWEST_TO_BALANCE..=1.0 / FEWEST_TO_BALANCE).contains(&ratio) {
                break;
            }
            let area = self.measure();
            let spacing = spacing_for(self.population.bounds.dimension, area, number);
            self.populate(Target::many(PAPER_RADIUS * spacing), POPULATE_LIMIT, QUIET)?;
        }
        self.pin(number)?;
        self.balance(Goal::Count(number as u64))?;
        Ok(())
    }

    /// Puts floaters on creases and in corners, as far apart as so many are on the whole surface.
    /// Those of before are taken away.
    fn pin(&mut self, number: f64) -> Result<(), SampleError> {
        let area = self.measure();
        let spacing = spacing_for(self.population.bounds.dimension, area, number);
        let Some(creases) = &self.creases else {
            return Ok(());
        };
        self.ask("creases", 0.0)?;
        self.population.pin(creases, spacing);
        if self.population.pinned() as f64 > number {
            // There are more corners than floaters.
            self.population.unpin();
        }
        self.deaths += self.population.merge() as u64;
        Ok(())
    }

    /// Measures the area by the energies of floaters that have one radius: not where there are fewer
    /// than it was first measured with, because then they know less of it.
    fn measure(&mut self) -> f64 {
        let measured = self.population.measure();
        match self.surveyed {
            Some((number, area)) if self.population.floaters.len() < number => area,
            _ => measured,
        }
    }

    /// Floaters are born where there is room for one, and die where there are far too many.
    fn repair(&mut self) -> Result<(), SampleError> {
        for _ in 0..ROUNDS {
            self.population.measure();
            let deaths = self.population.cull();
            self.population.meet();
            let births = self.population.add(usize::MAX, Gap::VACANT);
            self.births += births as u64;
            self.deaths += deaths as u64;
            if births + deaths == 0 {
                return Ok(());
            }
            self.steps("refine", NEXT_STEPS / 2, &SPREADING)?;
        }
        Ok(())
    }

    /// Relaxation and global fissioning (Turk, "Generating textures on arbitrary surfaces using
    /// reaction-diffusion", SIGGRAPH 1991, as Witkin and Heckbert tell it in section 4.2): all
    /// floaters have one radius, come to rest, and split all at once, with the radius over √2.
    fn relax(&mut self, expected: f64) -> Result<(), SampleError> {
        let dimension = self.population.bounds.dimension;
        let generations = (expected / FIRST_OF_TURK).log2().round().clamp(0.0, 60.0) as u32;
        let first = (expected / (1_u64 << generations) as f64).round().max(1.0);
        self.start(first)?;
        // Neighbours come nearer by √2 on a surface, by 2 on a curve.
        let shrink = if dimension == 2 {
            0.5
        } else {
            std::f64::consts::FRAC_1_SQRT_2
        };
        let mut radius = 0.5 * spacing_for(dimension, self.measure(), first);
        self.settle()?;
        self.repair()?;
        let mut number = first;
        for _ in 0..generations {
            number *= 2.0;
            self.births += self.population.split_all(&mut self.dice) as u64;
            radius *= shrink;
            self.population.level(radius);
            self.pin(number)?;
            self.settle()?;
            self.repair()?;
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
                // The energies are those of half the spacing.
                self.population.measure();
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

    /// Of floaters that are connected by neighbours on one sheet the first one stays.
    fn keep_one_of_each_piece(&mut self) {
        let number = self.population.floaters.len();
        let firsts = self.population.first_of_each_piece();
        self.pieces = Some(firsts.iter().filter(|&&first| first).count() as u64);
        let mut stays = firsts.into_iter();
        self.population
            .floaters
            .retain(|_| stays.next() == Some(true));
        self.population.changed();
        self.deaths += (number - self.population.floaters.len()) as u64;
    }

    /// The paper's adaptive repulsion until births and deaths have all but ceased; returns whether
    /// they have.
    fn populate(
        &mut self,
        target: Target,
        limit: u32,
        (steps, part): (usize, f64),
    ) -> Result<bool, SampleError> {
        let mut recent = vec![u64::MAX >> 16; steps];
        for step in 0..limit {
            self.ask("populate", f64::from(step) / f64::from(limit))?;
            let changes = self.population.adapt(target, &mut self.dice);
            self.births += changes.births;
            self.deaths += changes.deaths;
            recent[step as usize % steps] = changes.births + changes.deaths;
            let number = self.population.floaters.len();
            if recent.iter().sum::<u64>() as f64 <= part * number as f64 {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Makes the number right, in rounds of births or deaths with repulsion between.
    fn balance(&mut self, goal: Goal) -> Result<bool, SampleError> {
        let dimension = self.population.bounds.dimension;
        for round in 0..ROUNDS {
            let area = self.measure();
            let present = self.population.floaters.len();
            let (target, near_enough) = match goal {
                Goal::Count(count) => (count as f64, 0.0),
                Goal::Spacing(spacing) => {
                    let number = number_for(dimension, area, spacing).round().max(1.0);
                    // Where the surface is too rough to be measured, its area seems to grow with
                    // every floater.
                    let number = number.min(self.population.capacity as f64);
                    (number, (NEAR_ENOUGH * number).max(1.0))
                }
            };
            let difference = target - present as f64;
            let radius = 0.5 * spacing_for(dimension, area, target);
            self.population.level(radius);
            let merged = self.population.merge();
            self.deaths += merged as u64;
            let misplaced = self.population.misplaced();
            let well_placed = misplaced <= (MISPLACED.0 * target).max(MISPLACED.1);
            if merged == 0 && difference.abs() <= near_enough && well_placed {
                return Ok(true);
            }
            self.population.meet();
            if !well_placed && round + 1 < ROUNDS {
                self.deaths += self.population.remove(misplaced as usize) as u64;
                self.population.meet();
            }
            let difference = target - self.population.floaters.len() as f64;
            if difference > 0.0 {
                let gap = Gap::narrow(round);
                self.births += self.population.add(difference as usize, gap) as u64;
            } else if difference < 0.0 {
                let mut removed = self.population.remove(-difference as usize);
                if removed == 0 && round > 0 {
                    removed = self.population.remove_last(-difference as usize);
                }
                self.deaths += removed as u64;
            }
            self.steps("balance", ROUND_STEPS, &SPREADING)?;
        }
        Ok(false)
    }

    /// So many steps of repulsion.
    fn steps(&mut self, phase: &str, number: u32, motion: &Motion) -> Result<(), SampleError> {
        for step in 0..number {
            self.ask(phase, f64::from(step) / f64::from(number))?;
            self.population.step(motion);
        }
        Ok(())
    }

    /// Repulsion with one radius until nobody moves any more.
    fn settle(&mut self) -> Result<bool, SampleError> {
        for step in 0..SETTLE_LIMIT {
            if self.population.tally.iterations >= self.options.iteration_limit {
                break;
            }
            self.ask("settle", f64::from(step) / f64::from(SETTLE_LIMIT))?;
            let motion = if step < PATIENCE { &SETTLING } else { &WARY };
            let unrest = self.population.step(motion);
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

impl Target {
    /// The radii where there are many floaters from the beginning.
    fn many(desired: f64) -> Target {
        Target {
            desired,
            largest: LARGEST * desired,
            in_turn: false,
        }
    }
}
