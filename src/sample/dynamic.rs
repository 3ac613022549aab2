//! The dynamic method: F = -sign(h) ∇h is a force on a particle in a dissipative medium.
//!
//! The equation of motion of a unit mass is d²x/dt² + γ dx/dt + sign(h) ∇h = 0, integrated with
//! the paper's variant of Euler's method (Figueiredo and Gomes, "Physically-based sampling"):
//!
//! ```text
//! y ← h(x)                      remember current level
//! v ← v + δ (F(x) - γ v)        Euler predictor
//! x ← x + δ v                   modified Euler predictor
//! if sign(y) ≠ sign(h(x))       check crossing
//!     δ ← δ/2                   step control
//!     v ← 0                     re-start from rest
//! ```
//!
//! The paper leaves δ and γ to trial and error. Both have units (δ is a time, and h is a length
//! squared over a time squared), so no fixed numbers can serve all fields. Here
//!
//! ```text
//! δ = √min(|h|, 0.1 L |∇h|) / |∇h|        γ = c / δ
//! ```
//!
//! so that the first displacement from rest, δ² |∇h|, is min(|h| / |∇h|, 0.1 L) exactly as in
//! the kinematic case, and c, the `friction` of the options, is the dimensionless part of the
//! velocity that a step takes away. δ only falls afterwards, thus γ δ ≤ c ≤ 1 and friction can
//! never reverse a velocity: the discrete motion is stable against friction for every field
//! and every scale. Every displacement is held to 0.1 L by shortening v itself, which keeps a
//! particle that has rolled down a long slope from leaving with the gathered speed.
//!
//! With h² instead of h the force is -h ∇h, with h in units of its value at the release.
//!
//! The inertia is what this method is for: a particle with little friction rolls through
//! shallow minima of |h| that hold a kinematic one.

use crate::geometry::length;
use glam::DVec3;

use super::Potential;
use super::particle::{Motion, Particle, first_displacement, shortening};

/// The dynamic rule of motion.
pub(super) struct Dynamic {
    /// c: the part of the velocity that friction takes in the first step, in (0, 1].
    pub(super) friction: f64,
    /// What the force is the slope of.
    pub(super) potential: Potential,
}

impl Motion for Dynamic {
    /// Re-starting "particles from rest when they seem not to be converging to equilibrium" is
    /// the paper's own advice. It costs the particle its inertia, thus it is given several
    /// oscillations in a minimum of |h| before.
    fn patience(&self) -> u32 {
        32
    }

    fn release(&self, particle: &mut Particle, diagonal: f64) {
        let displacement = first_displacement(particle, diagonal);
        particle.step = (displacement / particle.slope()).min(f64::MAX).sqrt();
        particle.friction = self.friction / particle.step;
        particle.velocity = DVec3::ZERO;
        particle.unit = particle.here.value.abs();
    }

    fn predict(&self, particle: &mut Particle, diagonal: f64) -> DVec3 {
        let acceleration = particle.force(self.potential) - particle.friction * particle.velocity;
        particle.velocity += particle.step * acceleration;
        let displacement = particle.step * length(particle.velocity);
        particle.velocity *= shortening(displacement, diagonal);
        particle.position + particle.step * particle.velocity
    }

    fn cross(&self, particle: &mut Particle) {
        particle.step /= 2.0;
        particle.velocity = DVec3::ZERO;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::evaluation::Evaluation;

    /// A particle at x = 1 where h = 4 and dh/dx = 2, released with c = 0.25 in a box with
    /// diagonal 100: δ = √4 / 2 = 1 and γ = 0.25.
    fn released() -> (Dynamic, Particle) {
        let motion = Dynamic {
            friction: 0.25,
            potential: Potential::Absolute,
        };
        let here = Evaluation {
            value: 4.0,
            gradient: 2.0 * DVec3::X,
        };
        let mut particle = Particle::at_rest(0, DVec3::X, here);
        motion.release(&mut particle, 100.0);
        (motion, particle)
    }

    #[test]
    fn the_first_displacement_is_newtons() {
        let (motion, mut particle) = released();
        assert_eq!((particle.step, particle.friction), (1.0, 0.25));
        assert_eq!(motion.predict(&mut particle, 100.0), -DVec3::X);
    }

    #[test]
    fn velocity_gathers_and_friction_takes_its_part() {
        let (motion, mut particle) = released();
        particle.position = motion.predict(&mut particle, 100.0);
        assert_eq!(particle.velocity, -2.0 * DVec3::X);
        // v ← -2 + 1 (-2 - 0.25 (-2)) = -3.5 under the same force.
        particle.position = motion.predict(&mut particle, 100.0);
        assert_eq!(particle.velocity, -3.5 * DVec3::X);
        assert_eq!(particle.position, -4.5 * DVec3::X);
    }

    #[test]
    fn a_crossing_halves_the_step_and_restarts_from_rest() {
        let (motion, mut particle) = released();
        motion.predict(&mut particle, 100.0);
        motion.cross(&mut particle);
        assert_eq!((particle.step, particle.velocity), (0.5, DVec3::ZERO));
        assert_eq!(particle.friction, 0.25);
    }

    #[test]
    fn the_cap_shortens_the_velocity_itself() {
        let (motion, mut particle) = released();
        let at = motion.predict(&mut particle, 10.0);
        assert_eq!(at, DVec3::ZERO);
        assert_eq!(particle.velocity, -DVec3::X);
    }

    #[test]
    fn the_motion_does_not_depend_on_units() {
        // h scaled by 2^40, space by 2^20: the same orbit, scaled, to the last bit.
        let orbit = |potential: Potential, level: f64, space: f64| {
            let motion = Dynamic {
                friction: 0.125,
                potential,
            };
            let here = |x: f64| Evaluation {
                value: level * (x * x - 2.0),
                gradient: DVec3::X * (2.0 * level * x / space),
            };
            let mut particle = Particle::at_rest(0, 3.0 * space * DVec3::X, here(3.0));
            motion.release(&mut particle, 64.0 * space);
            for _ in 0..3 {
                particle.position = motion.predict(&mut particle, 64.0 * space);
                particle.here = here(particle.position.x / space);
            }
            particle.position.x / space
        };
        for potential in [Potential::Absolute, Potential::Square] {
            let (level, space) = (2.0_f64.powi(40), 2.0_f64.powi(20));
            let plain = orbit(potential, 1.0, 1.0);
            assert_eq!(plain, orbit(potential, level, space));
        }
    }
}
