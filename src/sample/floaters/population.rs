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

use glam::DVec3;
use rayon::prelude::*;

use super::neighbours::{Neighbours, Site, order};
use super::repulsion::{CUTOFF, FEEDBACK, Pairing, Repulsion, Source, TIME_STEP};
use crate::engine::Field;
use crate::geometry::Bounds;
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

/// A step on which the normal turns farther (the cosine) crosses a crease.
const CREASE: f64 = 0.7;

/// A step on which the normal turns farther leads to the back of a sheet and is not taken.
const BACK: f64 = -0.5;

/// For so many steps after it has met a crease a floater counts as being there.
const CREASE_MEMORY: u32 = 100;

/// Lists of neighbours reach farther than needed by this part of the cutoff.
const SKIN: f64 = 0.25;

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
        }
    }

    fn source(&self) -> Source {
        Source {
            position: self.position,
            normal: self.normal,
            radius: self.radius,
            on_crease: self.on_crease > 0,
        }
    }
}

/// How a population moves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    /// Δt
    pub(super) time_step: f64,
    /// The part of the last step that is added to the next.
    pub(super) inertia: f64,
    /// φ Δt: the part of the distance to the surface that is corrected in a step.
    pub(super) correction: f64,
}

/// The paper's motion: no inertia.
pub(super) const PAPER: Motion = Motion {
    time_step: TIME_STEP,
    inertia: 0.0,
    correction: FEEDBACK * TIME_STEP,
};

/// Motion to equilibrium: inertia makes up for small steps, and Newton's whole step to the
/// surface costs no more than a part of it.
pub(super) const SETTLING: Motion = Motion {
    time_step: 2.0 * TIME_STEP,
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
    pub(super) neighbours: Neighbours,
    /// Where floaters were when the lists were made; empty when they have to be made anew.
    listed_at: Vec<DVec3>,
    /// How far floaters may go from there before the lists are wrong.
    leash: f64,
    pub(super) tally: Tally,
}

impl<'a> Population<'a> {
    /// A population of nobody.
    pub(super) fn new(field: &'a dyn Field, bounds: Bounds) -> Self {
        Population {
            field,
            bounds,
            floaters: Vec::new(),
            wanted: None,
            capacity: COARSE_CAPACITY,
            neighbours: Neighbours::default(),
            listed_at: Vec::new(),
            leash: 0.0,
            tally: Tally::default(),
        }
    }

    /// To be called when floaters were added, removed or given other radii.
    pub(super) fn changed(&mut self) {
        self.listed_at.clear();
    }

    /// Brings floaters into the order of space and lists neighbours, if that is not done.
    pub(super) fn meet(&mut self) {
        let placed = self.floaters.iter().zip(&self.listed_at);
        let near = |(floater, &place): (&Floater, &DVec3)| {
            floater.position.distance_squared(place) <= self.leash * self.leash
        };
        if self.listed_at.len() == self.floaters.len() && placed.into_iter().all(near) {
            return;
        }
        let site = |floater: &Floater| Site {
            position: floater.position,
            reach: (1.0 + SKIN) * CUTOFF * floater.radius,
        };
        let unsorted: Vec<Site> = self.floaters.iter().map(site).collect();
        let order = order(&unsorted);
        self.floaters = order
            .iter()
            .map(|&index| self.floaters[index as usize])
            .collect();
        let sites: Vec<Site> = self.floaters.iter().map(site).collect();
        self.neighbours = Neighbours::new(&sites);
        let radii = self.floaters.iter().map(|floater| floater.radius);
        // Two floaters may approach each other, each by half of the skin.
        self.leash = 0.5 * SKIN * CUTOFF * radii.fold(f64::INFINITY, f64::min);
        self.listed_at = sites.into_iter().map(|site| site.position).collect();
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

    /// What each floater feels, in order; needs [`Population::meet`].
    pub(super) fn feel(&self, pairing: Pairing) -> Vec<Repulsion> {
        // A list of its own, because what neighbours need of a floater is the smaller part.
        let sources: Vec<Source> = self.floaters.iter().map(Floater::source).collect();
        sources
            .par_iter()
            .with_min_len(CHUNK)
            .enumerate()
            .map(|(index, &own)| {
                let others = self.neighbours.of(index).iter();
                Repulsion::new(own, others.map(|&other| sources[other as usize]), pairing)
            })
            .collect()
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

    /// Where the floater wants to go under a desired velocity, and how fast along the surface.
    /// Remembers its step and its speed.
    pub(super) fn aim(&mut self, index: usize, desired: DVec3, motion: &Motion) -> DVec3 {
        let bounds = self.bounds;
        let floater = &mut self.floaters[index];
        if floater.normal == DVec3::ZERO {
            floater.speed = 0.0;
            return floater.position;
        }
        let mut normal = floater.normal;
        let tangential = |vector: DVec3, normal: DVec3| vector - vector.dot(normal) * normal;
        let mut velocity = tangential(desired, normal);
        let mut inertia = motion.inertia * floater.step;
        if inertia.dot(velocity) < 0.0 {
            // It has passed its equilibrium, or is thrown to and fro over a crease.
            inertia = DVec3::ZERO;
            floater.courage = (0.7 * floater.courage).max(SLOWEST);
        } else {
            floater.courage = (1.1 * floater.courage).min(1.0);
        }
        inertia = tangential(inertia, normal);
        let mut distance = -floater.here.value / floater.here.gradient.dot(normal);
        for axis in 0..bounds.dimension {
            let at_low = floater.position[axis] <= bounds.min[axis];
            let at_high = floater.position[axis] >= bounds.max[axis];
            let step = velocity[axis] * motion.time_step + distance * normal[axis];
            if (at_low && step < 0.0) || (at_high && step > 0.0) {
                // The wall takes this component; the rest keeps to the curve of the cut.
                let mut within = normal;
                within[axis] = 0.0;
                let length = within.length();
                if length < 0.05 {
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
        floater.speed = velocity.length();
        let longest = LONGEST_STEP * floater.radius;
        let step = floater.courage * motion.time_step * velocity + inertia;
        floater.step = step.clamp_length_max(longest);
        let correction = (motion.correction * distance).clamp(-longest, longest);
        (floater.position + floater.step + correction * normal).clamp(bounds.min, bounds.max)
    }

    /// Takes a floater to where it wanted to go, unless that is no good place for it. Returns
    /// whether it went.
    pub(super) fn arrive(&mut self, index: usize, place: DVec3, there: Evaluation) -> bool {
        let floater = &mut self.floaters[index];
        let normal = there.normal();
        let turn = normal.dot(floater.normal);
        let good = there.is_defined()
            && there.distance() <= (FARTHEST_OFF * floater.radius).max(floater.here.distance())
            && turn > BACK;
        floater.on_crease = if turn < CREASE {
            CREASE_MEMORY
        } else {
            floater.on_crease.saturating_sub(1)
        };
        if turn < CREASE {
            floater.step = DVec3::ZERO;
            floater.courage = (0.7 * floater.courage).max(SLOWEST);
        }
        if good {
            floater.position = place;
            floater.here = there;
            floater.normal = normal;
        } else {
            floater.step = DVec3::ZERO;
            floater.courage = (0.5 * floater.courage).max(SLOWEST);
        }
        good
    }

    /// Brings floaters onto the surface without moving them along it. Those in a side of the box
    /// stay in it.
    pub(super) fn land(&mut self) {
        for _ in 0..LANDING_STEPS {
            let places: Vec<DVec3> = (0..self.floaters.len())
                .map(|index| self.aim(index, DVec3::ZERO, &LANDING))
                .collect();
            let there = self.evaluate(&places);
            for (index, (&place, &there)) in places.iter().zip(&there).enumerate() {
                let is_nearer = there.distance() <= self.floaters[index].here.distance();
                if is_nearer {
                    self.arrive(index, place, there);
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

    /// Whether a floater lies in a side of the box.
    pub(super) fn at_wall(&self, floater: &Floater) -> bool {
        let (low, high) = (self.bounds.min, self.bounds.max);
        (0..self.bounds.dimension).any(|axis| {
            let place = floater.position[axis];
            place <= low[axis] || place >= high[axis]
        })
    }

    /// One step of all floaters.
    pub(super) fn step(&mut self, motion: &Motion) -> Unrest {
        self.meet();
        let felt = self.feel(Pairing::of_mean_radius(self.bounds.dimension));
        for (floater, felt) in self.floaters.iter_mut().zip(&felt) {
            floater.energy = felt.energy;
        }
        let places: Vec<DVec3> = felt
            .iter()
            .enumerate()
            .map(|(index, felt)| self.aim(index, felt.velocity, motion))
            .collect();
        let there = self.evaluate(&places);
        let mut unrest = Unrest::default();
        for (index, (&place, &there)) in places.iter().zip(&there).enumerate() {
            let before = self.floaters[index].position;
            if self.arrive(index, place, there) {
                let moved = place.distance(before);
                unrest.add(&self.floaters[index], moved);
            }
        }
        self.reweigh();
        self.tally.steps += places.len() as u64;
        self.tally.iterations += 1;
        unrest.mean(places.len())
    }
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
