//! Birth and death by the paper's rules (Witkin and Heckbert, section 4.4).
//!
//! A floater near equilibrium, |ṗ| < γ σ, splits if its radius is huge, σ > σ^max, or if it is
//! adequately energized and its radius is above the desired one, D > ν Ê and σ > σ̂. It dies if
//! σ < δ σ̂ and R > σ / (δ σ̂), R random. Both halves get the radius σ / √2.
//!
//! The halves start half a radius to either side: a push alone, as in the paper, leaves two
//! floaters in one place, where the energy of both is so high that the feedback throws their
//! radii about. Nobody dies beside one who dies in the same step, nor alone, so that neither a
//! crowd nor a small component can vanish.

use glam::DVec3;

use super::population::{Floater, PAPER, Population};
use super::repulsion::{Pairing, desired_energy};
use crate::sample::random::Stream;

/// γ: the speed, in radii a unit of time, below which a floater is near equilibrium.
const EQUILIBRIUM: f64 = 4.0;
/// ν: the part of Ê above which a floater is adequately energized.
const ENERGIZED: f64 = 0.2;
/// δ: the part of σ̂ below which a floater may die.
const CROWDED: f64 = 0.7;
/// σ^max / σ̂. (The paper also lets single floaters claim half the surface, which is for
/// starts from one seed; here there are many.)
const LARGEST: f64 = 1.5;
/// The least radius, in units of σ̂: the feedback must not let one vanish.
const SMALLEST: f64 = 0.2;
/// The least and the greatest factor by which a radius changes in a step.
const CHANGE: (f64, f64) = (0.75, 1.25);
/// How far either half moves away in a fission, in radii of the parent.
const APART: f64 = 0.5;

/// What a step of adaptive repulsion has changed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Changes {
    pub(super) births: u64,
    pub(super) deaths: u64,
}

/// A stream of random numbers that is read in order.
pub(super) struct Dice {
    stream: Stream,
    place: u64,
}

impl Dice {
    pub(super) fn new(stream: Stream) -> Self {
        Dice { stream, place: 0 }
    }

    fn unit(&mut self) -> f64 {
        self.place += 1;
        self.stream.unit(self.place)
    }

    /// A random direction in the tangent plane (or along the tangent).
    fn tangent(&mut self, normal: DVec3, dimension: usize) -> DVec3 {
        if dimension == 2 {
            return DVec3::new(-normal.y, normal.x, 0.0);
        }
        // Uniform in the ball, then projected: uniform in angle by symmetry.
        for _ in 0..32 {
            let point = 2.0 * DVec3::new(self.unit(), self.unit(), self.unit()) - DVec3::ONE;
            if point.length_squared() > 1.0 {
                continue;
            }
            let tangent = point - point.dot(normal) * normal;
            if tangent.length_squared() > 1e-4 {
                return tangent.normalize();
            }
        }
        normal.any_orthonormal_vector()
    }
}

impl Population<'_> {
    /// One step of adaptive repulsion towards the desired radius σ̂ (times each floater's weight): floaters move, radii change,
    /// some floaters split and some die.
    pub(super) fn adapt(&mut self, desired_radius: f64, dice: &mut Dice) -> Changes {
        let dimension = self.bounds.dimension;
        let energy = desired_energy(dimension);
        self.changed();
        self.weigh();
        self.meet();
        let felt = self.feel(Pairing::Energies);
        let mut places = Vec::with_capacity(2 * felt.len());
        for (index, felt) in felt.iter().enumerate() {
            let place = self.aim(index, felt.velocity, &PAPER);
            places.push(place);
            let floater = &mut self.floaters[index];
            floater.energy = felt.energy;
            let radius =
                floater.radius + PAPER.time_step * felt.radius_rate(floater.radius, energy);
            let (shrink, grow) = CHANGE;
            let desired = desired_radius * floater.weight;
            floater.radius = radius
                .clamp(shrink * floater.radius, grow * floater.radius)
                .clamp(SMALLEST * desired, (LARGEST * 1.01) * desired);
        }
        let dying = self.dying(desired_radius, dice);
        let room = self.capacity.saturating_sub(felt.len());
        let parents: Vec<u32> = (0..felt.len() as u32)
            .filter(|&index| is_fertile(&self.floaters[index as usize], desired_radius, energy))
            .take(room)
            .collect();
        for &parent in &parents {
            let floater = self.floaters[parent as usize];
            let apart = APART * floater.radius * dice.tangent(floater.normal, dimension);
            let place = &mut places[parent as usize];
            let (low, high) = (self.bounds.min, self.bounds.max);
            let second = (*place - apart).clamp(low, high);
            *place = (*place + apart).clamp(low, high);
            places.push(second);
        }
        let there = self.evaluate(&places);
        let mut newborn = Vec::with_capacity(parents.len());
        for (&parent, place) in parents.iter().zip(felt.len()..) {
            // The second half is a copy that goes its own way.
            let original = self.floaters[parent as usize];
            let index = self.floaters.len();
            self.floaters.push(original);
            if self.arrive(index, places[place], there[place]) {
                let mut child = self.floaters[index];
                child.radius *= std::f64::consts::FRAC_1_SQRT_2;
                newborn.push(child);
                self.floaters[parent as usize].radius = child.radius;
            }
            self.floaters.truncate(index);
        }
        for index in 0..felt.len() {
            self.arrive(index, places[index], there[index]);
        }
        let mut alive = dying.iter().map(|dies| !dies);
        self.floaters.retain(|_| alive.next().unwrap_or(true));
        let changes = Changes {
            births: newborn.len() as u64,
            deaths: dying.iter().filter(|&&dies| dies).count() as u64,
        };
        self.floaters.extend(newborn);
        self.tally.steps += felt.len() as u64;
        self.tally.iterations += 1;
        changes
    }

    /// Every floater splits in two halves (Turk's global fissioning), as far as both find a place.
    /// Returns how many were born.
    pub(super) fn split_all(&mut self, dice: &mut Dice) -> usize {
        let dimension = self.bounds.dimension;
        let parents = self.floaters.len();
        let (low, high) = (self.bounds.min, self.bounds.max);
        let offsets: Vec<DVec3> = self
            .floaters
            .iter()
            .map(|floater| APART * floater.radius * dice.tangent(floater.normal, dimension))
            .collect();
        let halves = self.floaters.iter().zip(&offsets);
        let places: Vec<DVec3> = halves
            .clone()
            .map(|(floater, &offset)| (floater.position + offset).clamp(low, high))
            .chain(halves.map(|(floater, &offset)| (floater.position - offset).clamp(low, high)))
            .collect();
        let there = self.evaluate(&places);
        for parent in 0..parents {
            let original = self.floaters[parent];
            if original.normal == DVec3::ZERO {
                continue;
            }
            let index = self.floaters.len();
            self.floaters.push(original);
            let second = parent + parents;
            if self.arrive(index, places[second], there[second]) {
                self.arrive(parent, places[parent], there[parent]);
            } else {
                self.floaters.truncate(index);
            }
        }
        self.changed();
        self.floaters.len() - parents
    }

    /// Who dies.
    fn dying(&self, desired_radius: f64, dice: &mut Dice) -> Vec<bool> {
        let mut dying = vec![false; self.floaters.len()];
        for (index, floater) in self.floaters.iter().enumerate() {
            let crowded = CROWDED * desired_radius * floater.weight;
            if floater.speed < EQUILIBRIUM * floater.radius
                && floater.radius < crowded
                && dice.unit() > floater.radius / crowded
            {
                let mut near = self.neighbours.of(index).iter();
                let alone = floater.energy == 0.0;
                dying[index] = !alone && !near.any(|&other| dying[other as usize]);
            }
        }
        dying
    }
}

/// Whether a floater splits.
fn is_fertile(floater: &Floater, desired_radius: f64, energy: f64) -> bool {
    let desired_radius = desired_radius * floater.weight;
    let energized = floater.energy > ENERGIZED * energy && floater.radius > desired_radius;
    floater.speed < EQUILIBRIUM * floater.radius
        && floater.normal != DVec3::ZERO
        && (floater.radius > LARGEST * desired_radius || energized)
}
