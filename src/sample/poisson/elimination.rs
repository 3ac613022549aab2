//! Weighted sample elimination (Yuksel 2015, algorithm 1 with the weight function of section 3).

use std::collections::BinaryHeap;

use rayon::prelude::*;

use super::{Cloud, Key};

/// The paper's exponent α of the weight of a neighbour.
const WEIGHT_EXPONENT: i32 = 8;

/// The paper's β and γ, which limit the weight of very close neighbours (equation 4).
const LIMIT_FACTOR: f64 = 0.65;
const LIMIT_EXPONENT: f64 = 1.5;

/// How often the caller is asked whether to go on: after so many eliminations.
const ASK: usize = 1 << 14;

/// Which points are left, ascending, when so many are; `None` if `ask` says to stop.
pub(super) fn eliminate(
    cloud: &Cloud,
    count: usize,
    ask: &dyn Fn(f64) -> bool,
) -> Option<Vec<u32>> {
    let number = cloud.positions.len();
    // In the paper's words: spacing is 2 r_max, and `closest` is 2 r_min.
    let ratio = count as f64 / number as f64;
    let limit = 1.0 - crate::math::scalar::pow(ratio, LIMIT_EXPONENT);
    let closest = cloud.spacing * LIMIT_FACTOR * limit;
    let weigh = |square: f64| {
        let part = (1.0 - square.sqrt().max(closest) / cloud.spacing).max(0.0);
        (0..WEIGHT_EXPONENT).fold(1.0, |power, _| power * part)
    };
    let mut weights: Vec<f64> = (0..number as u32)
        .into_par_iter()
        .map(|index| {
            let mut weight = 0.0;
            cloud.neighbours(index, |_, square| weight += weigh(square));
            weight
        })
        .collect();
    let mut heap: BinaryHeap<Key> = (weights.iter().zip(0..))
        .map(|(&value, index)| Key { value, index })
        .collect();
    let mut is_left = vec![true; number];
    let mut left = number;
    while left > count {
        let Some(key) = heap.pop() else {
            break;
        };
        let weight = weights[key.index as usize];
        if weight != key.value {
            // It has lost neighbours since; weights only fall.
            heap.push(Key {
                value: weight,
                ..key
            });
            continue;
        }
        is_left[key.index as usize] = false;
        left -= 1;
        cloud.neighbours(key.index, |other, square| {
            let weight = &mut weights[other as usize];
            *weight = (*weight - weigh(square)).max(0.0);
        });
        if left.is_multiple_of(ASK) && !ask((number - left) as f64 / (number - count) as f64) {
            return None;
        }
    }
    let indices = (0..number as u32).filter(|&index| is_left[index as usize]);
    Some(indices.collect())
}
