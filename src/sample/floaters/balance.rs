//! The number of floaters, and the area they stand for.
//!
//! Adaptive repulsion leaves a population whose number depends on its history, by some tens of
//! percent. Here all floaters get one radius, so that the energy of each tells the density around
//! it; the sum of the inverse densities is the area of the surface (the length of the curve), and
//! the area tells the number that fits a spacing, or the spacing that fits a number. Floaters are
//! then added where the density is least, as far as there is room, or removed where it is
//! greatest.

use glam::DVec3;

use super::population::{Floater, Population};
use super::repulsion::{Pairing, density, desired_energy};
use crate::sample::newton::{Point, Polish, polish};

/// The area of the hexagonal cell of a floater whose nearest neighbours are 1 away: √3 / 2.
const HEXAGON: f64 = 0.866_025_403_784_438_6;

/// Places tried for a birth: some turn out to be bad when they are put on the surface.
const SPARE: usize = 3;

/// Who has nobody within so many radii has a part of the surface for itself and must not go.
const COMPANY: f64 = 2.6;

/// Floaters closer than so many radii are one too many. In equilibrium the least distance is
/// about 1.6.
const COINCIDENT: f64 = 0.5;
/// The same for two on a crease, between whose sides there may be no repulsion.
const COINCIDENT_ON_CREASE: f64 = 0.9;

/// Radii that differ by less tell the same area.
const NEAR_ENOUGH: f64 = 1e-3;

/// A floater whose density is so many times that of the ideal pattern is one too many.
const OVERCROWDED: f64 = 1.5;

/// Where a floater may be born, in radii. In a triangle of the ideal pattern the middle is at 1.15;
/// a vacant place is at 2.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gap {
    /// So far from its parent a newborn floater starts.
    distance: f64,
    /// There is room if nobody is nearer.
    room: f64,
}

/// Rounds of balance in which a narrow gap is as wide as it should be; and the part of it that goes with
/// each round after these, and that is left at last: floaters closer than half a radius would be merged.
const PATIENT_ROUNDS: u32 = 2;
const IMPATIENCE: f64 = 0.1;
const NARROWEST: f64 = 0.55;

impl Gap {
    /// Where one is missing in the pattern.
    pub(super) const VACANT: Gap = Gap {
        distance: 1.8,
        room: 1.6,
    };

    /// Between three neighbours, though they are in their places: to make up the number. On a rough
    /// surface, or between the edges of a cube, there may be no such place: the later the round, the
    /// less room is asked for.
    pub(super) fn narrow(round: u32) -> Gap {
        let late = round.saturating_sub(PATIENT_ROUNDS);
        let part = (1.0 - IMPATIENCE * f64::from(late)).max(NARROWEST);
        Gap {
            distance: 1.2 * part,
            room: 0.9 * part,
        }
    }
}

/// The same for one beside a floater on a crease: it may lie between two of them on the crease, a
/// radius from each.
const COINCIDENT_WITH_FIXED: f64 = 1.1;

/// From a corner of a cube the way to the middle of a side is inclined by 0.82 (the sine), that through the
/// cube by 1.
const THROUGH: f64 = 0.9;

/// From a crease the way to the sides is longer, because they are inclined.
const OFF_CREASE: f64 = 1.4;

/// Cosine and sine of twelve directions.
const DIRECTIONS: [(f64, f64); 12] = {
    const H: f64 = HEXAGON;
    [
        (1.0, 0.0),
        (H, 0.5),
        (0.5, H),
        (0.0, 1.0),
        (-0.5, H),
        (-H, 0.5),
        (-1.0, 0.0),
        (-H, -0.5),
        (-0.5, -H),
        (0.0, -1.0),
        (0.5, -H),
        (H, -0.5),
    ]
};

/// The number of floaters (not rounded) that cover an area with this spacing.
pub(in crate::sample) fn number_for(dimension: usize, area: f64, spacing: f64) -> f64 {
    if dimension == 2 {
        area / spacing
    } else {
        area / (HEXAGON * spacing * spacing)
    }
}

/// The spacing of so many floaters on an area, in the ideal pattern.
pub(in crate::sample) fn spacing_for(dimension: usize, area: f64, number: f64) -> f64 {
    if dimension == 2 {
        area / number
    } else {
        (area / (HEXAGON * number)).sqrt()
    }
}

/// The part of its inverse density that a floater in a side of the box owns: half a cell. In
/// the ideal pattern it lacks two neighbours of six, or one of two.
fn at_wall_part(dimension: usize) -> f64 {
    if dimension == 2 { 0.447 } else { 0.426 }
}

impl Population<'_> {
    /// Gives all floaters one radius, times their weights.
    pub(super) fn level(&mut self, radius: f64) {
        self.weigh();
        for floater in &mut self.floaters {
            floater.radius = radius * floater.weight;
        }
    }

    /// Measures the area of the surface, or the length of the curve, in units of the square (the
    /// length) of the weights there; the floaters then have one radius times their weights, half of
    /// the ideal spacing, and the energies that belong to it.
    ///
    /// For evenly spread floaters the result is good to about a percent; it comes out too large
    /// for components that are smaller than the spacing.
    pub(super) fn measure(&mut self) -> f64 {
        let dimension = self.bounds.dimension;
        let number = self.floaters.len() as f64;
        self.weigh();
        let radii = self
            .floaters
            .iter()
            .map(|floater| floater.radius / floater.weight);
        let mean = radii.sum::<f64>() / number;
        let mut radius = mean;
        let mut area = 0.0;
        // The second round corrects the radius, the third what the radius did to the area.
        for _ in 0..3 {
            self.level(radius);
            self.meet();
            let felt = self.feel(Pairing::of_mean_radius(self.bounds.dimension));
            area = 0.0;
            for (index, felt) in felt.iter().enumerate() {
                // In its own unit of length, its weight, it has the radius of all.
                let own = 1.0 / density(dimension, felt.energy, radius);
                let at_wall = self.at_wall(&self.floaters[index]);
                area += if at_wall {
                    at_wall_part(dimension) * own
                } else {
                    own
                };
                self.floaters[index].energy = felt.energy;
            }
            let next = 0.5 * spacing_for(dimension, area, number);
            let next = next.clamp(0.5 * radius, 2.0 * radius);
            if (next / radius - 1.0).abs() < NEAR_ENOUGH {
                break;
            }
            radius = next;
        }
        area
    }

    /// How many floaters are where the density is too high for the spacing that is wanted there;
    /// 0 where that is the same everywhere, because repulsion sees to it. Needs the energies of
    /// [`Population::measure`].
    pub(super) fn misplaced(&self) -> f64 {
        if self.wanted.is_none() {
            return 0.0;
        }
        let inside = self
            .floaters
            .iter()
            .filter(|floater| !self.at_wall(floater));
        let densities: Vec<f64> = inside.map(|floater| 1.0 + floater.energy).collect();
        let mean = densities.iter().sum::<f64>() / densities.len() as f64;
        let excess = densities
            .iter()
            .map(|density| (density / mean - 1.0).max(0.0));
        excess.sum()
    }

    /// Removes floaters where the density is greatest, no two neighbours at once and nobody who
    /// is alone. Needs energies that belong to the present neighbours. Returns how many.
    pub(super) fn remove(&mut self, excess: usize) -> usize {
        self.remove_above(0.0, excess)
    }

    /// Removes the last floaters, though each has a part of the surface to itself, but for fixed ones.
    /// Returns how many.
    pub(super) fn remove_last(&mut self, excess: usize) -> usize {
        let number = self.floaters.len();
        let is_free = |&index: &usize| !self.floaters[index].is_fixed;
        let last = (0..number).rev().filter(is_free).take(excess).last();
        let first_to_go = last.unwrap_or(number);
        let mut index = 0;
        self.floaters.retain(|floater| {
            index += 1;
            index <= first_to_go || floater.is_fixed
        });
        self.changed();
        number - self.floaters.len()
    }

    /// Removes floaters that are far too close to each other, which repulsion would not part: those
    /// of a component that is smaller than was thought. Needs the energies of
    /// [`Population::measure`]. Returns how many.
    pub(super) fn cull(&mut self) -> usize {
        let ideal = 1.0 + desired_energy(self.bounds.dimension);
        self.remove_above(OVERCROWDED * ideal - 1.0, usize::MAX)
    }

    /// Removes floaters as [`Population::remove`] does, none with less than an energy.
    fn remove_above(&mut self, least: f64, excess: usize) -> usize {
        let mut dying = vec![false; self.floaters.len()];
        let mut removed = 0;
        for index in self.by_energy().into_iter().rev() {
            if removed == excess {
                break;
            }
            let own = self.floaters[index];
            if own.is_fixed {
                continue;
            }
            if own.energy < least {
                break;
            }
            let near = |other: u32| {
                let distance = self.floaters[other as usize]
                    .position
                    .distance(own.position);
                distance < COMPANY * own.radius
            };
            let others = self.neighbours.of(index).iter().copied();
            let mut near = others.filter(|&other| near(other)).peekable();
            let alone = near.peek().is_none() || own.energy == 0.0;
            if !alone && !near.any(|other| dying[other as usize]) {
                dying[index] = true;
                removed += 1;
            }
        }
        let mut dying = dying.into_iter();
        self.floaters.retain(|_| dying.next() != Some(true));
        self.changed();
        removed
    }

    /// Removes floaters that have come so close to another that repulsion no longer parts them:
    /// in a corner of the box, or on a crease, to which both sides push. Of two the later one in
    /// order goes. Returns how many.
    pub(super) fn merge(&mut self) -> usize {
        self.meet();
        let mut dying = vec![false; self.floaters.len()];
        for index in 0..dying.len() {
            let own = &self.floaters[index];
            let mut near = self
                .neighbours
                .of(index)
                .iter()
                .map(|&other| other as usize);
            let is_on_crease = |floater: &Floater| floater.is_fixed || floater.on_crease > 0;
            dying[index] = near.any(|other| {
                let with = &self.floaters[other];
                let both_on_crease = is_on_crease(own) && is_on_crease(with);
                let one_on_crease = is_on_crease(own) || is_on_crease(with);
                let closest = if with.is_fixed {
                    COINCIDENT_WITH_FIXED
                } else if both_on_crease {
                    COINCIDENT_ON_CREASE
                } else {
                    COINCIDENT
                };
                !own.is_fixed
                    && (other < index || with.is_fixed)
                    && !dying[other]
                    && own.position.distance(with.position) < closest * own.radius
                    && (one_on_crease || own.normal.dot(with.normal) > 0.0)
            });
        }
        let before = dying.len();
        let mut dying = dying.into_iter();
        self.floaters.retain(|_| dying.next() != Some(true));
        let merged = before - self.floaters.len();
        if merged > 0 {
            self.changed();
        }
        merged
    }

    /// Adds floaters where the density is least and there is room, beside parents that are not
    /// neighbours. Needs energies that belong to the present neighbours. Returns how many.
    pub(super) fn add(&mut self, missing: usize, gap: Gap) -> usize {
        let mut is_parent = vec![false; self.floaters.len()];
        let mut places = Vec::new();
        let mut parents = Vec::new();
        for index in self.by_energy() {
            if places.len() == missing.saturating_mul(SPARE) {
                break;
            }
            let mut near = self.neighbours.of(index).iter();
            if near.any(|&other| is_parent[other as usize]) {
                continue;
            }
            if let Some(place) = self.roomiest(index, gap) {
                is_parent[index] = true;
                parents.push(index);
                places.push(place);
            }
        }
        let there = self.evaluate(&places);
        let points = places.iter().zip(there);
        let points = points.map(|(&position, here)| Point { position, here });
        let radii = parents.iter().map(|&parent| self.floaters[parent].radius);
        let largest = radii.clone().fold(0.0, f64::max);
        let wanted = Polish {
            tolerance: 1e-3 * radii.fold(f64::INFINITY, f64::min),
            leash: largest,
            diagonal: largest,
        };
        let (polished, evaluations) = polish(self.field, &wanted, points);
        self.tally.evaluations += evaluations;
        let before = self.floaters.len();
        for (parent, point) in parents.into_iter().zip(polished) {
            if self.floaters.len() - before == missing {
                break;
            }
            let own = self.floaters[parent];
            if let Some(point) = point
                && self.bounds.contains(point.position)
                && point.here.normal().dot(own.normal) > 0.0
                && self.room(parent, point.position, gap) >= gap.room * own.radius
            {
                let newborn = Floater::at_rest(point, own.radius);
                let weight = own.weight;
                self.floaters.push(Floater { weight, ..newborn });
            }
        }
        self.changed();
        self.floaters.len() - before
    }

    /// Floaters from the lowest energy to the highest.
    fn by_energy(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.floaters.len()).collect();
        let energy = |index: usize| self.floaters[index].energy;
        order.sort_unstable_by(|&a, &b| energy(a).total_cmp(&energy(b)).then(a.cmp(&b)));
        order
    }

    /// The place around a floater that is farthest from everybody, if there is room.
    fn roomiest(&self, index: usize, gap: Gap) -> Option<DVec3> {
        let own = &self.floaters[index];
        if own.normal == DVec3::ZERO {
            return None;
        }
        let (one, other) = if self.bounds.dimension == 2 {
            (DVec3::new(-own.normal.y, own.normal.x, 0.0), DVec3::ZERO)
        } else {
            own.normal.any_orthonormal_pair()
        };
        let mut best = None;
        let mut most = gap.room * own.radius;
        let reach = gap.distance * if own.is_fixed { OFF_CREASE } else { 1.0 };
        let around = DIRECTIONS.iter().map(|(cosine, sine)| {
            let direction = *cosine * one + *sine * other;
            own.position + reach * own.radius * direction
        });
        // Where sides are inclined the tangent plane leads off them, and the middle between two on the
        // edges of one side is on it.
        let others = self.neighbours.of(index).iter().filter(|_| own.is_fixed);
        let half_ways = others
            .map(|&other| 0.5 * (self.floaters[other as usize].position - own.position))
            .filter(|way| way.dot(own.normal).abs() < THROUGH * way.length());
        let middles = half_ways.map(|way| own.position + way);
        for place in around.chain(middles) {
            let place = place.clamp(self.bounds.min, self.bounds.max);
            let room = self.room(index, place, gap);
            if room > most {
                most = room;
                best = Some(place);
            }
        }
        best
    }

    /// The distance from a place to a floater and its neighbours on the same sheet; fixed ones, which
    /// would swallow who is near, count as nearer.
    fn room(&self, index: usize, place: DVec3, gap: Gap) -> f64 {
        let own = &self.floaters[index];
        let others = self.neighbours.of(index).iter();
        let others = others.map(|&other| &self.floaters[other as usize]);
        let same_side = others.filter(|other| other.is_fixed || other.normal.dot(own.normal) > 0.0);
        let with_fixed = gap.room / gap.room.max(COINCIDENT_WITH_FIXED);
        let distance = |other: &Floater| {
            let factor = if other.is_fixed { with_fixed } else { 1.0 };
            factor * other.position.distance(place)
        };
        same_side.map(distance).fold(distance(own), f64::min)
    }
}
