//! One particle, and the rule by which a method moves it.

use crate::geometry::length;
use glam::DVec3;

use super::Potential;
use super::evaluation::Evaluation;

/// No displacement is longer than this part of the diagonal of the search box.
///
/// Newton's estimate is as large as one likes where h is flat (the far field of a Gaussian). A
/// tenth of the diagonal crosses the box in a few steps and still samples the field often
/// enough on the way to notice the surface.
const LONGEST_DISPLACEMENT: f64 = 0.1;

/// A particle in flight.
#[derive(Clone, Copy, Debug)]
pub(super) struct Particle {
    /// Which one it is; its start depends on nothing else but the seed.
    pub(super) index: u64,
    /// x
    pub(super) position: DVec3,
    /// h(x) and ∇h(x): the present level, remembered for the crossing check.
    pub(super) here: Evaluation,
    /// δ: its own integration step.
    pub(super) step: f64,
    /// v; 0 in the kinematic case.
    pub(super) velocity: DVec3,
    /// γ; 0 in the kinematic case.
    pub(super) friction: f64,
    /// |h| when it was last released, the unit of h in the square potential.
    pub(super) unit: f64,
}

impl Particle {
    /// A particle at rest that has not been given a step yet.
    pub(super) fn at_rest(index: u64, position: DVec3, here: Evaluation) -> Self {
        Particle {
            index,
            position,
            here,
            step: 0.0,
            velocity: DVec3::ZERO,
            friction: 0.0,
            unit: here.value.abs(),
        }
    }

    /// F, the modified gradient field that points towards the surface ("Physically-based sampling",
    /// Figure 5): -sign(h) ∇h, or for h² instead of h half of its gradient, -h ∇h.
    ///
    /// There h is told in units of |h| at the release. That is a choice of the unit of time, made so
    /// that both forces are the same at first: one rule for δ serves both, and nothing underflows.
    pub(super) fn force(&self, potential: Potential) -> DVec3 {
        let part = match potential {
            Potential::Absolute => self.here.value.signum(),
            Potential::Square if self.unit > 0.0 => self.here.value / self.unit,
            Potential::Square => 0.0,
        };
        -part * self.here.gradient
    }

    /// |∇h|
    pub(super) fn slope(&self) -> f64 {
        length(self.here.gradient)
    }
}

/// A method of motion: what the two algorithms of the paper do differently.
///
/// A step of either is: remember the level, predict, evaluate there, and if the sign of h has
/// changed, call [`Motion::cross`]. Lengths are compared with `diagonal`, L, the diagonal of the
/// search box.
pub(super) trait Motion: Sync {
    /// How many steps a particle may go without halving |h| or crossing the surface before it
    /// is released anew where it is.
    fn patience(&self) -> u32;

    /// Releases the particle from rest where it is, with a step suited to the place. Expects a
    /// gradient that does not vanish.
    fn release(&self, particle: &mut Particle, diagonal: f64);

    /// The Euler predictor: where the particle goes next. Changes the velocity only.
    fn predict(&self, particle: &mut Particle, diagonal: f64) -> DVec3;

    /// The particle has crossed the surface: step control.
    fn cross(&self, particle: &mut Particle);
}

/// The length of the first displacement of a particle: min(|h| / |∇h|, 0.1 L), that is Newton's
/// estimate of the distance to the surface, within the cap.
pub(super) fn first_displacement(particle: &Particle, diagonal: f64) -> f64 {
    particle
        .here
        .distance()
        .min(LONGEST_DISPLACEMENT * diagonal)
}

/// The factor (at most 1) that shortens a displacement of the given length to the cap.
pub(super) fn shortening(displacement: f64, diagonal: f64) -> f64 {
    let cap = LONGEST_DISPLACEMENT * diagonal;
    if displacement > cap {
        cap / displacement
    } else {
        1.0
    }
}
