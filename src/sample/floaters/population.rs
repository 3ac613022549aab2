//! The floaters and how they move: equation 5 for a surface that stands still.
//!
//! ```text
//! ṗ^i = P^i - (F_x · P^i + φ F) / (F_x · F_x) F_x                (5)
//! ```
//!
//! with Euler steps, all floaters at once from the same state, so that neither their order nor
//! the number of threads matters. What the paper does not need and general fields do:
//!
//! * A step is at most half a radius long, and one that ends far off the surface, on the back of
//!   a thin sheet, or where F is undefined is not taken; that floater becomes more careful.
//! * The box is a wall: a floater that is pushed against it slides along, so that a surface which
//!   the box cuts is sampled up to the cut.
//! * Where the gradient vanishes the floater stays motionless (the paper's rule).

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::neighbours::{Neighbours, Site, order};
use super::repulsion::{CUTOFF, Pairing, Repulsion, Source, desired_energy, repulsions};
use crate::engine::Field;
use crate::geometry::Bounds;
use crate::sample::Rules;
use crate::sample::creases::Creases;
use crate::sample::evaluation::{Batch, Evaluation};
use crate::sample::newton::Point;
use crate::sample::statistics::Tally;

/// Floaters that share a task and calls of the field: fixed, and decides nothing but speed.
const CHUNK: usize = 256;

/// No step is longer than this many radii.
const LONGEST_STEP: f64 = 0.5;

/// A floater may be off the surface by this part of its radius.
const FARTHEST_OFF: f64 = 0.5;

/// The least courage: a floater that is refused or thrown to and fro moves this much slower.
const SLOWEST: f64 = 0.01;

/// Where the surface meets a side of the box at a smaller angle (the sine), the way along the side
/// to the surface is too long to go.
const STEEPEST: f64 = 0.2;

/// A surface whose angle with a side of the box is smaller (the cosine) lies in it.
const ALONG_WALL: f64 = 0.99;

/// A step on which the normal turns farther (the cosine) crosses a crease.
const CREASE: f64 = 0.7;

/// A step on which the normal turns farther leads to the back of a sheet and is not taken.
const BACK: f64 = -0.5;

/// For so many steps after it has met a crease a floater counts as being there.
const CREASE_MEMORY: u32 = 100;

/// How much farther lists of neighbours reach, for floaters that move little in a step.
const SKIN: f64 = 0.25;

/// Floaters nearer than so many radii are on the same piece of the surface, unless one is on the back.
const CONNECTED: f64 = 4.0;

/// The widest and the mean spacing differ by no more than this factor, nor do the mean and the
/// narrowest.
const HEAVIEST: f64 = 32.0;

/// The largest population before the area is known: a hundred times what a smooth surface takes.
const COARSE_CAPACITY: usize = 50_000;

/// One floater.
#[derive(Clone, Copy, Debug)]
pub(super) struct Floater {
    /// p
    pub(super) position: DVec3,
    /// F and F_x there.
    pub(super) here: Evaluation,
    /// F_x / |F_x|
    pub(super) normal: DVec3,
    /// σ: the repulsion radius.
    pub(super) radius: f64,
    /// The spacing that is wanted here, in units of the mean one.
    pub(super) weight: f64,
    /// The last step along the surface, while there is inertia.
    pub(super) step: DVec3,
    /// The part of its step that a floater dares to take, at most 1.
    pub(super) courage: f64,
    /// |ṗ| along the surface.
    pub(super) speed: f64,
    /// D / α
    pub(super) energy: f64,
    /// Steps for which it still counts as being on a crease.
    pub(super) on_crease: u32,
    /// Whether it stays where it is, on a crease or a corner.
    pub(super) is_fixed: bool,
}

impl Floater {
    /// A floater at rest.
    pub(super) fn at_rest(point: Point, radius: f64) -> Self {
        Floater {
            position: point.position,
            here: point.here,
            normal: point.here.normal(),
            radius,
            weight: 1.0,
            step: DVec3::ZERO,
            courage: 1.0,
            speed: 0.0,
            energy: 0.0,
            on_crease: 0,
            is_fixed: false,
        }
    }

    /// Where the floater wants to go under a desired velocity, and how fast along the surface.
    /// Remembers its step and its speed.
    pub(super) fn aim(&mut self, bounds: &Bounds, desired: DVec3, motion: &Motion) -> DVec3 {
        if self.is_fixed || self.normal == DVec3::ZERO {
            self.speed = 0.0;
            return self.position;
        }
        let mut normal = self.normal;
        let tangential = |vector: DVec3, normal: DVec3| vector - vector.dot(normal) * normal;
        let mut velocity = tangential(desired, normal);
        let mut inertia = motion.inertia * self.step;
        if (*motion == WARY || self.on_crease > 0) && inertia.dot(velocity) < 0.0 {
            // It has passed its equilibrium, or is thrown to and fro over a crease.
            inertia = DVec3::ZERO;
            self.courage = (0.7 * self.courage).max(SLOWEST);
        } else {
            self.courage = (1.1 * self.courage).min(1.0);
        }
        inertia = tangential(inertia, normal);
        let off = -self.here.value / self.here.gradient.dot(normal);
        let mut distance = off;
        for axis in 0..bounds.dimension {
            let at_low = self.position[axis] <= bounds.min[axis];
            let at_high = self.position[axis] >= bounds.max[axis];
            let step = velocity[axis] * motion.time_step + distance * normal[axis];
            if (at_low && step < 0.0) || (at_high && step > 0.0) {
                // The wall takes this component; the rest keeps to the curve of the cut.
                let mut within = normal;
                within[axis] = 0.0;
                let mut length = within.length();
                if length < STEEPEST {
                    // In an edge of the box it would be a long way: the other side lets go.
                    within = self.normal;
                    within[axis] = 0.0;
                    length = within.length();
                    distance = off;
                    inertia = DVec3::ZERO;
                }
                if length < STEEPEST {
                    continue;
                }
                distance /= length;
                normal = within / length;
                velocity[axis] = 0.0;
                inertia[axis] = 0.0;
                velocity = tangential(velocity, normal);
                inertia = tangential(inertia, normal);
            }
        }
        self.speed = velocity.length();
        let longest = LONGEST_STEP * self.radius;
        let step = self.courage * motion.time_step * velocity + inertia;
        self.step = step.clamp_length_max(longest);
        let correction = (motion.correction * distance).clamp(-longest, longest);
        (self.position + self.step + correction * normal).clamp(bounds.min, bounds.max)
    }

    /// Takes a floater to where it wanted to go, unless that is no good place for it. Returns
    /// whether it went.
    pub(super) fn arrive(&mut self, place: DVec3, there: Evaluation) -> bool {
        if self.is_fixed {
            return true;
        }
        let normal = there.normal();
        let turn = normal.dot(self.normal);
        let good = there.is_defined()
            && there.distance() <= (FARTHEST_OFF * self.radius).max(self.here.distance())
            && turn > BACK;
        self.on_crease = if turn < CREASE {
            CREASE_MEMORY
        } else {
            self.on_crease.saturating_sub(1)
        };
        if turn < CREASE {
            self.step = DVec3::ZERO;
            self.courage = (0.7 * self.courage).max(SLOWEST);
        }
        if good {
            self.position = place;
            self.here = there;
            self.normal = normal;
        } else {
            self.step = DVec3::ZERO;
            self.courage = (0.5 * self.courage).max(SLOWEST);
        }
        good
    }

    /// What it is to others, its radius times a factor.
    fn source(&self, factor: f64) -> Source {
        Source {
            position: self.position,
            normal: self.normal,
            radius: factor * self.radius,
            on_crease: self.is_fixed || self.on_crease > 0,
        }
    }
}

/// How a population moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Motion {
    /// Δt
    pub(super) time_step: f64,
    /// The part of the last step that is added to the next.
    pub(super) inertia: f64,
    /// φ Δt: the part of the distance to the surface that is corrected in a step.
    pub(super) correction: f64,
}

/// σ in units of a floater's radius, which is half the spacing, in motions other than the paper's.
/// A little more than half the spacing evens out the holes of defects: the largest hole over the
/// least distance is smallest with 1.1 to 1.2.
const SOFTNESS: f64 = 1.1;

/// α of these motions, which their time steps fit, and the cutoff, in σ: at the same distance as
/// [`CUTOFF`] half spacings.
const SOFT: (f64, f64) = (6.0, CUTOFF / SOFTNESS);

/// Motion over long ways. Inertia (the heavy ball of Polyak, "Some methods of speeding up the
/// convergence of iteration methods", 1964) carries waves through the pattern. Steps of 0.08 set
/// the shortest waves going.
pub(super) const SPREADING: Motion = Motion {
    time_step: 0.06,
    inertia: 0.9,
    correction: 1.0,
};

/// Motion to rest, when most is in its place: the waves are damped.
pub(super) const SETTLING: Motion = Motion {
    time_step: 0.04,
    inertia: 0.8,
    correction: 1.0,
};

/// Motion with restarts, for floaters that do not come to rest: at creases waves never end.
pub(super) const WARY: Motion = Motion {
    time_step: 0.06,
    inertia: 0.85,
    correction: 1.0,
};

/// Motion to the surface only.
const LANDING: Motion = Motion {
    time_step: 0.0,
    inertia: 0.0,
    correction: 1.0,
};

/// Newton's steps of the landing: each doubles the digits, from two or more.
const LANDING_STEPS: u32 = 4;

/// All floaters of a surface, and what has been done to them.
pub(super) struct Population<'a> {
    pub(super) field: &'a dyn Field,
    /// The box: no floater leaves it.
    pub(super) bounds: Bounds,
    pub(super) floaters: Vec<Floater>,
    /// The spacing that is wanted, where it is not the same everywhere, and its mean.
    pub(super) wanted: Option<(&'a dyn Field, f64)>,
    /// No floater splits when there are so many: on a surface that is rough at the scale of the
    /// spacing, floaters find no neighbours on their sheet and would split for ever.
    pub(super) capacity: usize,
    pub(super) rules: Rules,
    /// Lists of neighbours reach farther than needed by this part of the cutoff: none where every step
    /// makes its own.
    pub(super) skin: f64,
    pub(super) neighbours: Neighbours,
    /// Where floaters were when the lists were made, and how far they saw; empty when lists have to
    /// be made anew.
    listed: Vec<Site>,
    pub(super) tally: Tally,
}

impl<'a> Population<'a> {
    /// A population of nobody.
    pub(super) fn new(field: &'a dyn Field, bounds: Bounds, rules: Rules) -> Self {
        Population {
            field,
            bounds,
            floaters: Vec::new(),
            wanted: None,
            capacity: COARSE_CAPACITY,
            rules,
            skin: SKIN,
            neighbours: Neighbours::default(),
            listed: Vec::new(),
            tally: Tally::default(),
        }
    }

    /// Puts fixed floaters on creases and in corners, at a spacing times the weights there, in the
    /// place of those that there are.
    pub(super) fn pin(&mut self, creases: &Creases, spacing: f64) {
        let wanted = self.wanted;
        let weight = |place: DVec3| match wanted {
            None => 1.0,
            Some((wanted, mean)) => {
                let weight = wanted.value(place) / mean;
                weight.clamp(1.0 / HEAVIEST, HEAVIEST)
            }
        };
        let points = creases.points(&|place| spacing * weight(place));
        let places: Vec<DVec3> = points.iter().map(|point| point.position).collect();
        let there = self.evaluate(&places);
        self.floaters.retain(|floater| !floater.is_fixed);
        for (point, here) in points.iter().zip(there) {
            let position = point.position;
            let weight = weight(position);
            let mut floater = Floater::at_rest(Point { position, here }, 0.5 * spacing * weight);
            // Between those of its sides, so that the tangent plane leads to all of them.
            let between = point.normals.iter().sum::<DVec3>();
            floater.normal = between.try_normalize().unwrap_or(floater.normal);
            floater.weight = weight;
            floater.is_fixed = true;
            self.floaters.push(floater);
        }
        self.changed();
    }

    /// Lets floaters on creases and in corners go.
    pub(super) fn unpin(&mut self) {
        for floater in &mut self.floaters {
            floater.is_fixed = false;
        }
    }

    /// How many floaters are on creases and in corners.
    pub(super) fn pinned(&self) -> u64 {
        self.floaters
            .iter()
            .filter(|floater| floater.is_fixed)
            .count() as u64
    }

    /// To be called when floaters were added or removed.
    pub(super) fn changed(&mut self) {
        self.listed.clear();
    }

    /// Whether the lists still hold every neighbour: two floaters may approach each other, each by
    /// half of what the lists reach farther than is needed.
    fn is_listed(&self) -> bool {
        if self.listed.len() != self.floaters.len() {
            return false;
        }
        let placed = || self.floaters.iter().zip(&self.listed);
        let spare = placed().map(|(floater, listed)| listed.reach - CUTOFF * floater.radius);
        let leash = 0.5 * spare.fold(f64::INFINITY, f64::min);
        let near = |(floater, listed): (&Floater, &Site)| {
            floater.position.distance_squared(listed.position) <= leash * leash
        };
        leash >= 0.0 && placed().all(near)
    }

    /// Brings floaters into the order of space and lists neighbours, if that is not done.
    pub(super) fn meet(&mut self) {
        if self.is_listed() {
            return;
        }
        let site = |floater: &Floater| Site {
            position: floater.position,
            reach: (1.0 + self.skin) * CUTOFF * floater.radius,
        };
        let unsorted: Vec<Site> = self.floaters.iter().map(site).collect();
        let order = order(&unsorted);
        self.floaters = order
            .iter()
            .map(|&index| self.floaters[index as usize])
            .collect();
        self.listed = self.floaters.iter().map(site).collect();
        self.neighbours = Neighbours::new(&self.listed);
    }

    /// For each floater whether it is the first of a piece of the surface: of those that are connected
    /// by neighbours on one sheet.
    pub(super) fn first_of_each_piece(&mut self) -> Vec<bool> {
        self.meet();
        let number = self.floaters.len();
        let mut seen = vec![false; number];
        let mut is_first = vec![false; number];
        for first in 0..number {
            is_first[first] = !seen[first];
            let mut open = vec![first];
            while let Some(index) = open.pop() {
                if std::mem::replace(&mut seen[index], true) {
                    continue;
                }
                let own = &self.floaters[index];
                let near = self
                    .neighbours
                    .of(index)
                    .iter()
                    .map(|&other| other as usize);
                open.extend(near.filter(|&other| {
                    let other = &self.floaters[other];
                    other.position.distance(own.position) < CONNECTED * own.radius
                        && other.normal.dot(own.normal) > BACK
                }));
            }
        }
        is_first
    }

    /// Weighs floaters where they are: by the wanted spacing there. One whose place has none keeps
    /// the weight it has.
    pub(super) fn weigh(&mut self) {
        let Some((wanted, mean)) = self.wanted else {
            return;
        };
        let columns: [Vec<f64>; 3] = std::array::from_fn(|axis| {
            self.floaters
                .iter()
                .map(|floater| floater.position[axis])
                .collect()
        });
        let columns = columns.each_ref().map(Vec::as_slice);
        let mut spacings = vec![f64::NAN; self.floaters.len()];
        wanted.values(&columns[..self.bounds.dimension], &mut spacings);
        for (floater, spacing) in self.floaters.iter_mut().zip(spacings) {
            let weight = spacing / mean;
            if weight > 0.0 && weight.is_finite() {
                floater.weight = weight.clamp(1.0 / HEAVIEST, HEAVIEST);
            }
        }
    }

    /// Weighs floaters anew after a step, and lets their radii follow.
    fn reweigh(&mut self) {
        if self.wanted.is_none() {
            return;
        }
        let before: Vec<f64> = self.floaters.iter().map(|floater| floater.weight).collect();
        self.weigh();
        for (floater, before) in self.floaters.iter_mut().zip(before) {
            floater.radius *= floater.weight / before;
        }
    }

    /// What floaters need to know of each other: a list of its own, because that is the smaller
    /// part of them.
    fn sources(&self, factor: f64) -> Vec<Source> {
        let sources = self.floaters.iter();
        sources.map(|floater| floater.source(factor)).collect()
    }

    /// What each floater feels, in order; needs [`Population::meet`].
    pub(super) fn feel(&self, pairing: Pairing) -> Vec<Repulsion> {
        let sources = self.sources(1.0);
        let (neighbours, force) = (&self.neighbours, (self.rules.alpha, CUTOFF));
        (0..sources.len().div_ceil(CHUNK))
            .into_par_iter()
            .flat_map_iter(|chunk| {
                let range = chunk_range(chunk, sources.len());
                repulsions(&sources, range, neighbours, pairing, force)
            })
            .collect()
    }

    /// Ê / α
    pub(super) fn desired_energy(&self) -> f64 {
        let ideal = || desired_energy(self.bounds.dimension);
        self.rules.energy.unwrap_or_else(ideal)
    }

    /// The paper's motion: no inertia.
    pub(super) fn paper_motion(&self) -> Motion {
        Motion {
            time_step: self.rules.time_step,
            inertia: 0.0,
            correction: self.rules.phi * self.rules.time_step,
        }
    }

    /// Evaluates the field at the places, in order.
    pub(super) fn evaluate(&mut self, places: &[DVec3]) -> Vec<Evaluation> {
        let field = self.field;
        let evaluations: Vec<Evaluation> = places
            .par_chunks(CHUNK)
            .flat_map_iter(|chunk| {
                let mut batch = Batch::default();
                let there = batch.evaluate(field, chunk.iter().copied());
                there.collect::<Vec<_>>()
            })
            .collect();
        self.tally.evaluations += places.len() as u64;
        let undefined = evaluations.iter().filter(|there| !there.is_defined());
        self.tally.undefined_evaluations += undefined.count() as u64;
        evaluations
    }

    /// Brings floaters onto the surface without moving them along it, until all are within the
    /// tolerance or it takes too long. Those in a side of the box stay in it.
    pub(super) fn land(&mut self, tolerance: f64) {
        for _ in 0..LANDING_STEPS {
            let bounds = self.bounds;
            let is_off = |floater: &Floater| floater.here.distance() > tolerance;
            let off: Vec<usize> = (0..self.floaters.len())
                .filter(|&index| is_off(&self.floaters[index]))
                .collect();
            if off.is_empty() {
                break;
            }
            let places: Vec<DVec3> = off
                .iter()
                .map(|&index| self.floaters[index].aim(&bounds, DVec3::ZERO, &LANDING))
                .collect();
            let there = self.evaluate(&places);
            for ((&index, place), there) in off.iter().zip(places).zip(there) {
                let floater = &mut self.floaters[index];
                if there.distance() <= floater.here.distance() {
                    floater.arrive(place, there);
                }
            }
        }
        self.changed();
    }

    /// The mean of D/α; none without floaters.
    pub(super) fn energy(&self) -> Option<f64> {
        let energies = self.floaters.iter().map(|floater| floater.energy);
        let sum: f64 = energies.sum();
        (!self.floaters.is_empty()).then(|| sum / self.floaters.len() as f64)
    }

    /// Whether a floater lies where a side of the box cuts the surface. A surface that lies in the side
    /// goes on there.
    pub(super) fn at_wall(&self, floater: &Floater) -> bool {
        let (low, high) = (self.bounds.min, self.bounds.max);
        (0..self.bounds.dimension).any(|axis| {
            let place = floater.position[axis];
            let is_in_side = place <= low[axis] || place >= high[axis];
            is_in_side && floater.normal[axis].abs() < ALONG_WALL
        })
    }

    /// One step of all floaters.
    pub(super) fn step(&mut self, motion: &Motion) -> Unrest {
        self.meet();
        let sources = self.sources(SOFTNESS);
        let pairing = Pairing::of_mean_radius(self.bounds.dimension);
        let (field, bounds, neighbours) = (self.field, self.bounds, &self.neighbours);
        let parts: Vec<(Unrest, u64)> = self
            .floaters
            .par_chunks_mut(CHUNK)
            .enumerate()
            .map_init(Batch::default, |batch, (chunk, floaters)| {
                let range = chunk_range(chunk, sources.len());
                let felt = repulsions(&sources, range, neighbours, pairing, SOFT);
                let places: Vec<DVec3> = floaters
                    .iter_mut()
                    .zip(&felt)
                    .map(|(floater, felt)| {
                        floater.energy = felt.energy;
                        floater.aim(&bounds, felt.velocity, motion)
                    })
                    .collect();
                let there = batch.evaluate(field, places.iter().copied());
                let (mut unrest, mut undefined) = (Unrest::default(), 0);
                for ((floater, &place), there) in floaters.iter_mut().zip(&places).zip(there) {
                    undefined += u64::from(!there.is_defined());
                    let before = floater.position;
                    if floater.arrive(place, there) {
                        unrest.add(floater, place.distance(before));
                    }
                }
                (unrest, undefined)
            })
            .collect();
        let mut unrest = Unrest::default();
        for (part, undefined) in parts {
            unrest.smooth += part.smooth;
            unrest.creases += part.creases;
            self.tally.undefined_evaluations += undefined;
        }
        self.reweigh();
        let number = self.floaters.len();
        self.tally.evaluations += number as u64;
        self.tally.steps += number as u64;
        self.tally.iterations += 1;
        unrest.mean(number)
    }
}

/// The floaters of a chunk.
fn chunk_range(chunk: usize, number: usize) -> Range<usize> {
    let first = chunk * CHUNK;
    first..(first + CHUNK).min(number)
}

/// How much floaters still move in a step: root mean squares, in radii.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Unrest {
    /// Of those on smooth parts of the surface.
    pub(super) smooth: f64,
    /// Of those on creases, which never lie quite still: their normals jump.
    pub(super) creases: f64,
}

impl Unrest {
    fn add(&mut self, floater: &Floater, moved: f64) {
        let relative = moved / floater.radius;
        let part = if floater.on_crease > 0 {
            &mut self.creases
        } else {
            &mut self.smooth
        };
        *part += relative * relative;
    }

    fn mean(self, number: usize) -> Self {
        let root = |sum: f64| (sum / number.max(1) as f64).sqrt();
        Unrest {
            smooth: root(self.smooth),
            creases: root(self.creases),
        }
    }
}
