//! Births in the middle between neighbours: from a good pattern a finer one.
//!
//! In the ideal pattern the middles between nearest neighbours, together with the floaters, are
//! the ideal pattern of half the spacing. A pattern with few defects therefore has as few after four
//! times as many floaters were made, and what remains for repulsion is to follow the surface's
//! shape: that is how a subdivision surface keeps its extraordinary vertices. Fission at random
//! places makes new defects with every generation instead, which only long rest heals.

use glam::DVec3;

use super::population::{Floater, Population};
use crate::sample::evaluation::Evaluation;
use crate::sample::newton::Point;

/// Pairs farther apart than so many radii are no neighbours: in the ideal pattern the nearest are
/// at 2, the second nearest at 3.46.
const FARTHEST: f64 = 2.9;

/// Newborns have so much room, in radii of the parents: in the ideal pattern they are 1 from each
/// other and from their parents.
const ROOM: f64 = 0.72;

impl Population<'_> {
    /// Puts a floater in the middle between any two neighbours, the nearest pairs first, wherever
    /// there is room, and halves all radii. Returns how many were born.
    ///
    /// The cost is linear in the floaters, but for sorting their pairs.
    pub(super) fn refine(&mut self) -> usize {
        self.meet();
        let middles = self.middles();
        let places: Vec<DVec3> = middles.iter().map(|middle| middle.place).collect();
        let there = self.landed(&places);
        let parents = self.floaters.len();
        // The newborns beside a floater, for those that come later.
        let mut beside: Vec<Vec<u32>> = vec![Vec::new(); parents];
        let mut newborn: Vec<Floater> = Vec::with_capacity(middles.len());
        for (middle, point) in middles.iter().zip(there) {
            let [first, second] = middle.parents;
            let (one, other) = (
                &self.floaters[first as usize],
                &self.floaters[second as usize],
            );
            let normal = point.here.normal();
            let is_good = point.here.is_defined()
                && (one.is_fixed || normal.dot(one.normal) > 0.0)
                && point.position.distance(middle.place) < 0.5 * one.radius;
            let room = ROOM * one.radius.min(other.radius);
            // Who is near on the back of a thin sheet takes no room from it.
            let is_near = |other: &Floater| {
                other.position.distance_squared(point.position) < room * room
                    && (other.is_fixed || other.normal.dot(normal) > 0.0)
            };
            let mut around = self.neighbours.of(first as usize).iter().chain([&first]);
            let is_taken = around.any(|&near| {
                let mut children = beside[near as usize].iter();
                is_near(&self.floaters[near as usize])
                    || children.any(|&child| is_near(&newborn[child as usize]))
            });
            if !is_good || is_taken {
                continue;
            }
            let mut child = Floater::at_rest(point, 0.5 * (one.radius + other.radius));
            child.weight = 0.5 * (one.weight + other.weight);
            for parent in middle.parents {
                beside[parent as usize].push(newborn.len() as u32);
            }
            newborn.push(child);
        }
        let born = newborn.len();
        self.floaters.extend(newborn);
        for floater in &mut self.floaters {
            floater.step = DVec3::ZERO;
            floater.radius *= 0.5;
        }
        self.changed();
        born
    }

    /// The middles between neighbours on one sheet, the nearest pairs first.
    fn middles(&self) -> Vec<Middle> {
        let mut middles = Vec::with_capacity(4 * self.floaters.len());
        let in_space = self.bounds.dimension == 3;
        for (index, own) in self.floaters.iter().enumerate() {
            let later = self.neighbours.of(index).iter();
            for &other in later.filter(|&&other| other as usize > index) {
                let with = &self.floaters[other as usize];
                let distance = own.position.distance(with.position);
                let relative = distance / (0.5 * (own.radius + with.radius));
                let same_sheet = own.is_fixed || with.is_fixed || own.normal.dot(with.normal) > 0.0;
                // In space the middle between two on creases is on the crease, or off the surface.
                let on_crease = in_space && own.is_fixed && with.is_fixed;
                if relative < FARTHEST && same_sheet && !on_crease {
                    middles.push(Middle {
                        parents: [index as u32, other],
                        place: own.position.midpoint(with.position),
                        relative,
                    });
                }
            }
        }
        middles.sort_unstable_by(|one, other| {
            let by_distance = one.relative.total_cmp(&other.relative);
            by_distance.then(one.parents.cmp(&other.parents))
        });
        middles
    }

    /// One of Newton's steps from each place to the surface, within the box.
    fn landed(&mut self, places: &[DVec3]) -> Vec<Point> {
        let bounds = self.bounds;
        let step = |(&place, here): (&DVec3, &Evaluation)| {
            let normal = here.normal();
            let distance = here.value / here.gradient.dot(normal);
            let landed = place - distance * normal;
            if landed.is_finite() {
                landed.clamp(bounds.min, bounds.max)
            } else {
                place
            }
        };
        let here = self.evaluate(places);
        let landed: Vec<DVec3> = places.iter().zip(&here).map(step).collect();
        let here = self.evaluate(&landed);
        let points = landed.into_iter().zip(here);
        points
            .map(|(position, here)| Point { position, here })
            .collect()
    }
}

/// A place between two floaters.
struct Middle {
    parents: [u32; 2],
    place: DVec3,
    /// The distance of the parents, in radii.
    relative: f64,
}
