//! The flight: particles move by a rule until each has met its fate.
//!
//! The equations of motion are uncoupled, so that every particle keeps its own time and step
//! ("Physically-based sampling"). A flight takes a chunk of them together for one reason only:
//! a field is fastest when it is evaluated at many points in one call. Particles that have met
//! their fate leave the chunk at once.

use glam::DVec3;

use super::evaluation::{Batch, Evaluation};
use super::particle::{Motion, Particle};
use super::statistics::Tally;
use crate::engine::Field;
use crate::geometry::Bounds;

/// The part of the diagonal at which a particle counts as close to the surface; Newton's
/// method does the rest faster. The step halving gains one or two bits a crossing, Newton
/// doubles them, and within this distance it stays near.
pub(super) const ARRIVAL: f64 = 1e-4;

/// How often a particle is released anew in vain before it counts as caught by a spurious
/// attractor.
const VAIN_RELEASES: u32 = 5;

/// A particle that crosses to and fro in steps below this part of the diagonal, and still has
/// no zero near, sits at a jump of h.
const STALLED: f64 = 1e-10;

/// Where particles fly.
pub(super) struct Arena {
    /// Those that leave this box are given up.
    pub(super) reach: Bounds,
    /// L: the diagonal of the search box, which is the unit of length.
    pub(super) diagonal: f64,
    /// A particle stops when |h| / |∇h| is at most this.
    pub(super) arrival: f64,
    /// The largest number of steps.
    pub(super) iteration_limit: u32,
}

/// How a flight may end.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fate {
    /// Close to the surface.
    Arrived,
    /// At a place where the gradient vanishes and h does not.
    Spurious,
    /// At a jump of h, at the border of where h is defined, or out of steps.
    Unconverged,
    /// Out of reach.
    Left,
}

/// A particle and how it has been doing since it made progress.
struct Flyer {
    particle: Particle,
    /// |h| when it last made progress.
    level: f64,
    /// Steps since then or since it was last released anew.
    idle: u32,
    /// Releases since then.
    releases: u32,
    /// Whether it has run against the border of where h is defined since then.
    blocked: bool,
    /// Whether its last step ended in a crossing or at such a border and was too short to
    /// matter.
    stalled: bool,
}

/// Lets the particles fly until each has arrived or is given up, and returns those that have
/// arrived, in order of their indices.
///
/// Every particle must start where the field is defined. `cancelled` is asked once a step; the
/// result is then incomplete.
pub(super) fn fly(
    field: &dyn Field,
    motion: &dyn Motion,
    arena: &Arena,
    particles: Vec<Particle>,
    tally: &mut Tally,
    cancelled: &dyn Fn() -> bool,
) -> Vec<Particle> {
    let mut arrived = Vec::with_capacity(particles.len());
    let mut flyers: Vec<Flyer> = particles.into_iter().map(Flyer::new).collect();
    let mut batch = Batch::default();
    let mut trials: Vec<DVec3> = Vec::with_capacity(flyers.len());
    let mut iteration = 0;
    land(
        &mut flyers,
        &mut arrived,
        arena,
        tally,
        Flyer::fate_at_start,
    );
    for flyer in &mut flyers {
        motion.release(&mut flyer.particle, arena.diagonal);
    }
    while !flyers.is_empty() && iteration < arena.iteration_limit && !cancelled() {
        trials.clear();
        for flyer in &mut flyers {
            trials.push(motion.predict(&mut flyer.particle, arena.diagonal));
        }
        let evaluations = batch.evaluate(field, trials.iter().copied());
        for ((flyer, &trial), there) in flyers.iter_mut().zip(&trials).zip(evaluations) {
            tally.undefined_evaluations += u64::from(!there.is_defined());
            flyer.advance(motion, arena, trial, there);
        }
        iteration += 1;
        tally.steps += trials.len() as u64;
        tally.evaluations += trials.len() as u64;
        land(&mut flyers, &mut arrived, arena, tally, Flyer::fate);
    }
    tally.iterations = tally.iterations.max(iteration);
    tally.dropped.unconverged += flyers.len() as u64;
    arrived.sort_unstable_by_key(|particle| particle.index);
    arrived
}

/// Takes those out of the flyers who have met their fate, and counts or keeps them.
fn land(
    flyers: &mut Vec<Flyer>,
    arrived: &mut Vec<Particle>,
    arena: &Arena,
    tally: &mut Tally,
    fate: fn(&Flyer, &Arena) -> Option<Fate>,
) {
    flyers.retain(|flyer| {
        let Some(fate) = fate(flyer, arena) else {
            return true;
        };
        match fate {
            Fate::Arrived => arrived.push(flyer.particle),
            Fate::Spurious => tally.dropped.spurious += 1,
            Fate::Unconverged => tally.dropped.unconverged += 1,
            Fate::Left => tally.dropped.left += 1,
        }
        false
    });
}

impl Flyer {
    fn new(particle: Particle) -> Self {
        Flyer {
            particle,
            level: particle.here.value.abs(),
            idle: 0,
            releases: 0,
            blocked: false,
            stalled: false,
        }
    }

    /// The second half of a step: goes where the rule predicted, checks the crossing, and
    /// releases the particle anew when it gets nowhere.
    fn advance(&mut self, motion: &dyn Motion, arena: &Arena, trial: DVec3, there: Evaluation) {
        let particle = &mut self.particle;
        let displacement = trial.distance(particle.position);
        let crossed = particle.here.value.signum() != there.value.signum();
        self.idle += 1;
        self.stalled = (crossed || !there.is_defined()) && displacement < STALLED * arena.diagonal;
        if there.is_defined() {
            particle.position = trial;
            particle.here = there;
            let level = there.value.abs();
            if crossed {
                motion.cross(particle);
            }
            if crossed || level <= 0.5 * self.level {
                self.level = level;
                self.idle = 0;
                self.releases = 0;
                self.blocked = false;
            }
        } else {
            // Undefined counts as outside: the particle stays and tries again more carefully,
            // exactly as if it had crossed.
            motion.cross(particle);
            self.blocked = true;
        }
        if self.idle >= motion.patience() && particle.slope() > 0.0 {
            motion.release(particle, arena.diagonal);
            self.idle = 0;
            self.releases += 1;
        }
    }

    /// The fate that the place alone decides, so that it holds before the first step too.
    fn fate_at_start(&self, arena: &Arena) -> Option<Fate> {
        if self.particle.here.distance() <= arena.arrival {
            Some(Fate::Arrived)
        } else if self.particle.slope() == 0.0 {
            Some(Fate::Spurious)
        } else {
            None
        }
    }

    /// The fate of a particle after a step.
    fn fate(&self, arena: &Arena) -> Option<Fate> {
        if !arena.reach.contains(self.particle.position) {
            return Some(Fate::Left);
        }
        if let Some(fate) = self.fate_at_start(arena) {
            return Some(fate);
        }
        if self.releases >= VAIN_RELEASES {
            return Some(if self.blocked {
                Fate::Unconverged
            } else {
                Fate::Spurious
            });
        }
        self.stalled.then_some(Fate::Unconverged)
    }
}
