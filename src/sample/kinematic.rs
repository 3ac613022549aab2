//! The kinematic method: F = -sign(h) ∇h is the velocity of a particle.
//!
//! The equation of motion is dx/dt + sign(h) ∇h = 0, integrated with Euler's method and a step
//! of each particle's own (Figueiredo and Gomes, "Physically-based sampling"):
//!
//! ```text
//! y ← h(x)                      remember current level
//! x ← x + δ F(x)                Euler predictor
//! if sign(y) ≠ sign(h(x))       check crossing
//!     δ ← δ/2                   step control
//! ```
//!
//! The paper leaves the initial δ open ("Practical issues": better estimates would take the
//! gradient into account, in a way similar to Newton's method). Here
//!
//! ```text
//! δ = min(|h|, 0.1 L |∇h|) / |∇h|²
//! ```
//!
//! with L the diagonal of the search box: the first displacement δ |∇h| is Newton's estimate
//! |h| / |∇h| of the distance to the surface, but at most 0.1 L. That is the right step where
//! h is close to linear, it changes neither with the scale of h nor with that of space, and it
//! needs nothing but what is evaluated anyway. As the gradient may grow on the way, every later
//! displacement is held to 0.1 L too.
//!
//! For h² instead of h the force falls with h and does not jump on the surface ("Physically-based
//! sampling"). With h in units of its first value the same δ serves: where h is close to linear
//! δ |∇h|² is 1, every step is Newton's, and where it is not, crossings halve the step as they do for h.

use crate::geometry::length;
use glam::DVec3;

use super::Potential;
use super::particle::{Motion, Particle, first_displacement, shortening};

/// The kinematic rule of motion.
pub(super) struct Kinematic {
    /// What particles move down.
    pub(super) potential: Potential,
}

impl Motion for Kinematic {
    /// The orbit of a particle leads straight down |h|. When |h| has not halved in sixteen
    /// steps, δ no longer fits the place (the gradient has fallen since), or nothing is there.
    fn patience(&self) -> u32 {
        16
    }

    fn release(&self, particle: &mut Particle, diagonal: f64) {
        // The quotient overflows when the gradient is close to underflow; the cap on the
        // displacement makes any large step as good as another.
        let step = first_displacement(particle, diagonal) / particle.slope();
        particle.step = step.min(f64::MAX);
        particle.unit = particle.here.value.abs();
    }

    fn predict(&self, particle: &mut Particle, diagonal: f64) -> DVec3 {
        let force = particle.force(self.potential);
        let displacement = particle.step * length(force);
        let step = particle.step * shortening(displacement, diagonal);
        particle.position + step * force
    }

    fn cross(&self, particle: &mut Particle) {
        particle.step /= 2.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::evaluation::Evaluation;

    const PLAIN: Kinematic = Kinematic {
        potential: Potential::Absolute,
    };

    /// A particle at x = 1 where h and dh/dx are as given.
    fn particle(value: f64, slope: f64) -> Particle {
        let here = Evaluation {
            value,
            gradient: slope * DVec3::X,
        };
        Particle::at_rest(0, DVec3::X, here)
    }

    #[test]
    fn the_first_step_is_newtons_where_the_surface_is_near() {
        // h = 3 (x - 0.5) at x = 1: the root is hit at once, from either sign of h.
        for sign in [1.0, -1.0] {
            let mut particle = particle(1.5 * sign, 3.0 * sign);
            PLAIN.release(&mut particle, 100.0);
            assert_eq!(particle.step, 1.5 / 9.0);
            assert_eq!(PLAIN.predict(&mut particle, 100.0), 0.5 * DVec3::X);
        }
    }

    #[test]
    fn no_displacement_exceeds_a_tenth_of_the_diagonal() {
        let mut particle = particle(1.0, 1e-200);
        PLAIN.release(&mut particle, 2.0);
        let at = PLAIN.predict(&mut particle, 2.0);
        assert!((at.x - 0.8).abs() < 1e-15);
        // The gradient grows by 200 orders of magnitude while δ stays.
        particle.here.gradient = DVec3::X;
        let at = PLAIN.predict(&mut particle, 2.0);
        assert!((at.x - 0.8).abs() < 1e-15);
        // A subnormal gradient makes the quotient overflow, not the displacement.
        particle.here.gradient = 1e-310 * DVec3::X;
        PLAIN.release(&mut particle, 2.0);
        assert!(PLAIN.predict(&mut particle, 2.0).is_finite());
    }

    #[test]
    fn the_square_potential_pulls_in_proportion_to_the_level() {
        let square = Kinematic {
            potential: Potential::Square,
        };
        // h = 3 (x - 0.5) from x = 1: the first step is Newton's, at half the level it is half.
        let mut particle = particle(1.5, 3.0);
        square.release(&mut particle, 100.0);
        assert_eq!(square.predict(&mut particle, 100.0), 0.5 * DVec3::X);
        particle.here.value = 0.75;
        assert_eq!(square.predict(&mut particle, 100.0), 0.75 * DVec3::X);
        // In no unit of h does the force underflow.
        particle.here.value = 1e-300;
        particle.here.gradient = 2e-300 * DVec3::X;
        square.release(&mut particle, 100.0);
        assert_eq!(square.predict(&mut particle, 100.0), 0.5 * DVec3::X);
    }

    #[test]
    fn a_crossing_halves_the_step() {
        let mut particle = particle(1.5, 3.0);
        PLAIN.release(&mut particle, 100.0);
        let step = particle.step;
        PLAIN.cross(&mut particle);
        assert_eq!(particle.step, step / 2.0);
    }
}
