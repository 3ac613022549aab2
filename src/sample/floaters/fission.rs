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

use super::population::{Floater, Population};
use super::repulsion::Pairing;
use crate::sample::Rules;
use crate::sample::random::Stream;

/// The least radius, in units of σ̂: the feedback must not let one vanish.
const SMALLEST: f64 = 0.2;
/// The least and the greatest factor by which a radius changes in a step.
const CHANGE: (f64, f64) = (0.75, 1.25);
/// How far either half moves away in a fission, in radii of the parent.
const APART: f64 = 0.5;

/// The radii that floaters are to get.
#[derive(Clone, Copy, Debug)]
pub(super) struct Target {
    /// σ̂
    pub(super) desired: f64,
    /// σ^max
    pub(super) largest: f64,
    /// Whether nobody splits beside one who splits in the same step. Floaters of one radius on a
    /// surface that grows would else all split at once.
    pub(super) in_turn: bool,
}

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
    pub(super) fn adapt(&mut self, target: Target, dice: &mut Dice) -> Changes {
        let dimension = self.bounds.dimension;
        let (bounds, rules, motion) = (self.bounds, self.rules, self.paper_motion());
        let energy = self.desired_energy();
        self.weigh();
        self.meet();
        let felt = self.feel(Pairing::Energies);
        let mut places = Vec::with_capacity(2 * felt.len());
        for (floater, felt) in self.floaters.iter_mut().zip(&felt) {
            places.push(floater.aim(&bounds, felt.velocity, &motion));
            floater.energy = felt.energy;
            let rate = felt.radius_rate(floater.radius, energy, &rules);
            let radius = floater.radius + motion.time_step * rate;
            let (shrink, grow) = CHANGE;
            floater.radius = radius
                .clamp(shrink * floater.radius, grow * floater.radius)
                .clamp(
                    SMALLEST * target.desired * floater.weight,
                    1.01 * target.largest * floater.weight,
                );
        }
        let dying = self.dying(target.desired, dice);
        let room = self.capacity.saturating_sub(felt.len());
        let parents = self.fertile(target, energy);
        let parents = &parents[..parents.len().min(room)];
        for &parent in parents {
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
            let mut child = self.floaters[parent as usize];
            if child.arrive(places[place], there[place]) {
                child.radius *= std::f64::consts::FRAC_1_SQRT_2;
                newborn.push(child);
                self.floaters[parent as usize].radius = child.radius;
            }
        }
        for ((floater, &place), &there) in self.floaters.iter_mut().zip(&places).zip(&there) {
            floater.arrive(place, there);
        }
        let mut alive = dying.iter().map(|dies| !dies);
        self.floaters.retain(|_| alive.next().unwrap_or(true));
        let changes = Changes {
            births: newborn.len() as u64,
            deaths: dying.iter().filter(|&&dies| dies).count() as u64,
        };
        if changes.births + changes.deaths > 0 {
            self.changed();
        }
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
            let mut child = self.floaters[parent];
            let second = parent + parents;
            let can_split = !child.is_fixed && child.normal != DVec3::ZERO;
            if can_split && child.arrive(places[second], there[second]) {
                self.floaters[parent].arrive(places[parent], there[parent]);
                self.floaters.push(child);
            }
        }
        self.changed();
        self.floaters.len() - parents
    }

    /// Who splits.
    fn fertile(&self, target: Target, energy: f64) -> Vec<u32> {
        let mut splits = vec![false; self.floaters.len()];
        for (index, floater) in self.floaters.iter().enumerate() {
            let mut near = self.neighbours.of(index).iter();
            splits[index] = is_fertile(floater, target, energy, &self.rules)
                && !(target.in_turn && near.any(|&other| splits[other as usize]));
        }
        let all = 0..self.floaters.len() as u32;
        all.filter(|&index| splits[index as usize]).collect()
    }

    /// Who dies.
    fn dying(&self, desired_radius: f64, dice: &mut Dice) -> Vec<bool> {
        let mut dying = vec![false; self.floaters.len()];
        for (index, floater) in self.floaters.iter().enumerate() {
            let crowded = self.rules.delta * desired_radius * floater.weight;
            if !floater.is_fixed
                && floater.speed < self.rules.gamma * floater.radius
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
fn is_fertile(floater: &Floater, target: Target, energy: f64, rules: &Rules) -> bool {
    let desired = target.desired * floater.weight;
    let energized = floater.energy > rules.nu * energy && floater.radius > desired;
    !floater.is_fixed
        && floater.speed < rules.gamma * floater.radius
        && floater.normal != DVec3::ZERO
        && (floater.radius > target.largest * floater.weight || energized)
}
