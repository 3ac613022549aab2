//! The exchange of the closest points for the widest gaps.

use std::collections::BinaryHeap;

use rayon::prelude::*;

use super::{Cloud, Key};

/// Exchanges for each point, at most.
const MOST: usize = 4;

/// How often the caller is asked whether to go on: after so many exchanges.
const ASK: usize = 1 << 12;

/// Points in and out of the sample, each with the nearest that is in.
struct Sample<'a> {
    cloud: &'a Cloud,
    is_in: Vec<bool>,
    /// The squared distance to the nearest other point in the sample, and which; where there is
    /// none in reach the reach and the point itself.
    nearest: Vec<(f64, u32)>,
    /// Of points that are in, the closest to others first; of those that are out the farthest. Entries
    /// whose distance is no longer right are passed over.
    close: BinaryHeap<Key>,
    gaps: BinaryHeap<Key>,
}

/// Improves a sample, given and handed back as ascending places in the cloud; `None` if `ask` says
/// to stop. Each exchange lowers the number of pairs at the least distance or closer, so it ends.
pub(super) fn exchange(
    cloud: &Cloud,
    sample: Vec<u32>,
    ask: &dyn Fn(f64) -> bool,
) -> Option<Vec<u32>> {
    let most = MOST * sample.len();
    let mut sample = Sample::new(cloud, &sample);
    for turn in 0..most {
        let (Some(close), Some(gap)) = (sample.closest(), sample.widest()) else {
            break;
        };
        if sample.nearest[gap as usize].0 <= sample.nearest[close as usize].0 {
            break;
        }
        sample.remove(close);
        sample.insert(gap);
        if turn % ASK == 0 && !ask(turn as f64 / most as f64) {
            return None;
        }
    }
    let indices = (0..cloud.positions.len() as u32).filter(|&index| sample.is_in[index as usize]);
    Some(indices.collect())
}

impl<'a> Sample<'a> {
    fn new(cloud: &'a Cloud, inside: &[u32]) -> Sample<'a> {
        let number = cloud.positions.len();
        let mut is_in = vec![false; number];
        for &index in inside {
            is_in[index as usize] = true;
        }
        let nearest: Vec<(f64, u32)> = (0..number as u32)
            .into_par_iter()
            .map(|index| nearest(cloud, &is_in, index))
            .collect();
        let mut sample = Sample {
            cloud,
            is_in,
            nearest,
            close: BinaryHeap::new(),
            gaps: BinaryHeap::new(),
        };
        (0..number as u32).for_each(|index| sample.enter(index));
        sample
    }

    /// Puts a point into its heap.
    fn enter(&mut self, index: u32) {
        let value = self.nearest[index as usize].0;
        if self.is_in[index as usize] {
            let value = -value;
            self.close.push(Key { value, index });
        } else {
            self.gaps.push(Key { value, index });
        }
    }

    /// The point of the sample that is closest to another one.
    fn closest(&mut self) -> Option<u32> {
        while let Some(key) = self.close.peek() {
            let index = key.index as usize;
            if self.is_in[index] && -key.value == self.nearest[index].0 {
                return Some(key.index);
            }
            self.close.pop();
        }
        None
    }

    /// The point outside of the sample that is farthest from it.
    fn widest(&mut self) -> Option<u32> {
        while let Some(key) = self.gaps.peek() {
            let index = key.index as usize;
            if !self.is_in[index] && key.value == self.nearest[index].0 {
                return Some(key.index);
            }
            self.gaps.pop();
        }
        None
    }

    fn remove(&mut self, index: u32) {
        self.is_in[index as usize] = false;
        self.enter(index);
        let mut bereft = Vec::new();
        self.cloud.neighbours(index, |other, _| {
            if self.nearest[other as usize].1 == index {
                bereft.push(other);
            }
        });
        for other in bereft {
            self.nearest[other as usize] = nearest(self.cloud, &self.is_in, other);
            self.enter(other);
        }
    }

    fn insert(&mut self, index: u32) {
        self.is_in[index as usize] = true;
        self.enter(index);
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

/// The squared distance from a point to the nearest other one in the sample, and which that is.
fn nearest(cloud: &Cloud, is_in: &[bool], index: u32) -> (f64, u32) {
    let mut nearest = (cloud.spacing * cloud.spacing, index);
    cloud.neighbours(index, |other, square| {
        if is_in[other as usize] && square < nearest.0 {
            nearest = (square, other);
        }
    });
    nearest
}
