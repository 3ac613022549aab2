//! The exchange: every point in turn is taken away, and one comes in where the gap is widest.
//!
//! A point that stayed where it was would stay again, as long as nothing has changed around it and no
//! gap elsewhere is wider than the one that it fills: it is passed over, so that later passes cost
//! little. The cost of one exchange does not depend on the number of points but for the heap.

use std::collections::BinaryHeap;

use glam::DVec3;
use rayon::prelude::*;

use super::{Cloud, Key};

/// How often each point may be moved, in the end.
pub(super) const PASSES: usize = 2;

/// The points are at rest when a pass moves no more than this part of them.
const STILL: f64 = 0.01;

/// How often the caller is asked whether to go on: after so many exchanges.
const ASK: usize = 1 << 12;

/// Gaps at least so wide, in ideal spacings, are worth finding the exact middle of.
const WIDE: f64 = 0.7;

/// Narrower gaps, in ideal spacings, are not kept in the heap: whoever leaves makes a wider one.
const NARROW: f64 = 0.7;

/// Points as close as this, in ideal spacings, lie in the same gap.
const GAP: f64 = 0.3;

/// The sample and what is left of the cloud, each point with the nearest other one in the sample.
pub(super) struct Exchange<'a> {
    cloud: &'a mut Cloud,
    /// The squared distance to the nearest other point in the sample, and which; where there is
    /// none in reach the reach and the point itself.
    nearest: Vec<(f64, u32)>,
    /// Points outside of the sample, the farthest from it first. Entries whose distance is no longer
    /// right are passed over.
    gaps: BinaryHeap<Key>,
    /// Whether something has changed around a point of the sample since its last turn.
    restless: Vec<bool>,
}

impl<'a> Exchange<'a> {
    /// Of points of the cloud.
    pub(super) fn new(cloud: &'a mut Cloud, sample: &[u32]) -> Exchange<'a> {
        sample.iter().for_each(|&index| cloud.cells.choose(index));
        let number = cloud.positions.len() as u32;
        let fixed: &Cloud = cloud;
        let nearest: Vec<(f64, u32)> = (0..number)
            .into_par_iter()
            .map(|index| fixed.nearest_chosen(index))
            .collect();
        let mut exchange = Exchange {
            cloud,
            nearest,
            gaps: BinaryHeap::new(),
            restless: vec![true; number as usize],
        };
        (0..number).for_each(|index| exchange.enter(index));
        exchange
    }

    /// Moves each point of the sample, in turn, to the widest gap that there is without it, until few
    /// move any more; the least distance does not fall. `None` if `ask` says to stop.
    pub(super) fn run(
        &mut self,
        sample: &mut [u32],
        passes: usize,
        ask: &dyn Fn(f64) -> bool,
    ) -> Option<()> {
        let number = sample.len();
        for pass in 0..passes {
            let mut moved = 0;
            for (turn, index) in sample.iter_mut().enumerate() {
                if self.may_move(*index) {
                    self.restless[*index as usize] = false;
                    self.remove(*index);
                    let gap = self.widest().unwrap_or(*index);
                    self.insert(gap);
                    if gap != *index {
                        self.disturb(*index);
                        self.disturb(gap);
                        moved += 1;
                        *index = gap;
                    }
                }
                let done = (pass * number + turn) as f64 / (passes * number) as f64;
                if turn % ASK == 0 && !ask(done) {
                    return None;
                }
            }
            if moved as f64 <= STILL * number as f64 {
                break;
            }
        }
        Some(())
    }

    /// The middles of wide gaps, near points of the cloud and of the sample: places equally far from
    /// the three nearest points of the sample (on a curve: the two nearest), not yet on the surface.
    pub(super) fn middles(&self) -> Vec<DVec3> {
        let wide = WIDE * self.cloud.spacing;
        let candidates = (0..self.cloud.positions.len() as u32).into_par_iter();
        let middles = candidates.filter_map(|index| {
            let (square, _) = self.nearest[index as usize];
            let looks = square >= wide * wide && self.is_widest_around(index);
            looks.then(|| self.middle(index)).flatten()
        });
        middles.collect()
    }

    /// Whether no point close by is farther from the sample: one in each gap.
    fn is_widest_around(&self, index: u32) -> bool {
        let close = GAP * self.cloud.spacing;
        let own = self.nearest[index as usize].0;
        let mut is_widest = true;
        self.cloud.neighbours(index, |other, square| {
            is_widest &= square > close * close || self.nearest[other as usize].0 <= own;
        });
        is_widest
    }

    fn middle(&self, index: u32) -> Option<DVec3> {
        let cloud: &Cloud = self.cloud;
        let position = cloud.positions[index as usize];
        // The three nearest, ascending.
        let mut near = [(f64::INFINITY, DVec3::ZERO); 3];
        cloud.chosen_neighbours(index, |other, square| {
            let mut entry = (square, cloud.positions[other as usize]);
            for place in &mut near {
                if entry.0 < place.0 {
                    std::mem::swap(place, &mut entry);
                }
            }
        });
        let [a, b, c] = near.map(|(_, position)| position);
        let middle = match cloud.dimension {
            2 => (near[1].0 < f64::INFINITY).then(|| a.midpoint(b)),
            _ if near[2].0 < f64::INFINITY => circumcentre(a, b, c),
            _ => None,
        }?;
        let near_enough = middle.distance(position) <= 0.5 * cloud.spacing;
        let wider = middle.distance_squared(a) > near[0].0;
        (near_enough && wider).then_some(middle)
    }

    /// Whether a point of the sample might leave its place: something has changed around it, or there
    /// is a gap wider than the one that it fills.
    fn may_move(&mut self, index: u32) -> bool {
        let own = self.nearest[index as usize].0;
        let widest = self.widest();
        self.restless[index as usize]
            || widest.is_some_and(|gap| self.nearest[gap as usize].0 > own)
    }

    /// Notes that something has changed here.
    fn disturb(&mut self, index: u32) {
        let restless = &mut self.restless;
        restless[index as usize] = true;
        self.cloud
            .chosen_neighbours(index, |other, _| restless[other as usize] = true);
    }

    /// Puts a point outside of the sample into the heap, if it lies in a gap.
    fn enter(&mut self, index: u32) {
        let value = self.nearest[index as usize].0;
        let narrow = NARROW * self.cloud.spacing;
        if value >= narrow * narrow && !self.cloud.cells.is_chosen(index) {
            self.gaps.push(Key { value, index });
        }
    }

    /// The point outside of the sample that is farthest from it.
    fn widest(&mut self) -> Option<u32> {
        while let Some(&Key { value, index }) = self.gaps.peek() {
            let outside = !self.cloud.cells.is_chosen(index);
            if outside && value == self.nearest[index as usize].0 {
                return Some(index);
            }
            self.gaps.pop();
        }
        None
    }

    fn remove(&mut self, index: u32) {
        self.cloud.cells.release(index);
        self.enter(index);
        let mut bereft = Vec::new();
        // Whose nearest it was are neighbours: their distances need not be measured again.
        self.cloud.cells.near(index, |other| {
            if other != index && self.nearest[other as usize].1 == index {
                bereft.push(other);
            }
        });
        for other in bereft {
            self.nearest[other as usize] = self.cloud.nearest_chosen(other);
            self.enter(other);
        }
    }

    fn insert(&mut self, index: u32) {
        self.cloud.cells.choose(index);
        let mut closer = Vec::new();
        self.cloud.neighbours(index, |other, square| {
            if square < self.nearest[other as usize].0 {
                closer.push((other, square));
            }
        });
        for (other, square) in closer {
            self.nearest[other as usize] = (square, index);
            self.enter(other);
        }
    }
}

/// The point in the plane of a triangle that is equally far from its corners.
fn circumcentre(a: DVec3, b: DVec3, c: DVec3) -> Option<DVec3> {
    let (to_b, to_c) = (b - a, c - a);
    let across = to_b.cross(to_c);
    let offset =
        to_c.length_squared() * across.cross(to_b) + to_b.length_squared() * to_c.cross(across);
    let centre = a + offset / (2.0 * across.length_squared());
    centre.is_finite().then_some(centre)
}
