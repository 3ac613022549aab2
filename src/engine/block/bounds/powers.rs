//! Powers of enclosures.

use super::functions::side_by_side;
use super::rounding::{function_above, function_below, greatest, least, magnitude_product};
use super::rounding::{product_above, product_below};
use super::{BOXES, Bounds, BoundsBlock, EMPTY, Lanes, PARTIAL};
use crate::engine::block::number::Number;
use crate::graph::Op;
use crate::graph::operation::value::{by_squaring, is_integer_power};
use crate::math::slice;

/// Magnitudes and the direction in which each is rounded: 1 for up, −1 for down.
type Directed = ([f64; 2 * BOXES], [f64; 2 * BOXES]);

/// Products lane by lane, rounded in the first one's direction.
#[inline(always)]
fn multiply((a, direction): Directed, (b, _): Directed) -> Directed {
    let mut product = a;
    for (product, (b, direction)) in product.iter_mut().zip(b.iter().zip(&direction)) {
        *product = magnitude_product(*product, *b, *direction);
    }
    (product, direction)
}

/// a^n, where n is usually an integer constant: repeated multiplication of the ends, rounded
/// outward, which also bounds what repeated multiplication computes.
#[inline(always)]
pub(super) fn integer_power(out: &mut BoundsBlock, a: &BoundsBlock, exponent: Bounds) {
    let n = exponent.low;
    let is_integer = n == exponent.high && is_integer_power(n) && !exponent.is_empty();
    if !is_integer {
        power(out, a, &exponent.splat());
    } else if n == 0.0 {
        *out = *a;
        out.low = [1.0; BOXES];
        out.high = [1.0; BOXES];
    } else {
        let is_even = n % 2.0 == 0.0;
        let (low, high) = powers(a, n.abs() as u32, is_even);
        for lane in 0..BOXES {
            let a = Bounds::get(a, lane);
            let direct = Bounds {
                low: low[lane],
                high: high[lane],
                ..a
            };
            let result = if n > 0.0 {
                direct
            } else {
                reciprocal(direct, a, is_even)
            };
            Bounds::set(out, lane, result);
        }
    }
}

/// Bounds of a^n for n ≥ 1: from below at the lower end and from above at the upper one.
#[inline(always)]
fn powers(a: &BoundsBlock, n: u32, is_even: bool) -> (Lanes, Lanes) {
    let (mut low, mut high) = (a.low, a.high);
    if is_even {
        for lane in 0..BOXES {
            let magnitude = Bounds::get(a, lane).absolute();
            (low[lane], high[lane]) = (magnitude.low, magnitude.high);
        }
    }
    let ends = side_by_side(&low, &high);
    let (mut magnitudes, mut directions) = (ends, [1.0; 2 * BOXES]);
    for end in 0..2 * BOXES {
        // Upward for a number is downward for the magnitude of a negative one.
        let is_low = end < BOXES;
        let is_negative = ends[end] < 0.0;
        directions[end] = if is_low != is_negative { -1.0 } else { 1.0 };
        magnitudes[end] = ends[end].abs();
    }
    let (magnitudes, _) = by_squaring((magnitudes, directions), n, multiply);
    for lane in 0..BOXES {
        low[lane] = signed(magnitudes[lane], ends[lane]);
        high[lane] = signed(magnitudes[BOXES + lane], ends[BOXES + lane]);
    }
    (low, high)
}

/// The magnitude with the sign of the number of which it is a power; a power of 0 is exact.
#[inline(always)]
fn signed(magnitude: f64, base: f64) -> f64 {
    let not_negative = if base == 0.0 { 0.0 } else { magnitude };
    if base < 0.0 { -magnitude } else { not_negative }
}

/// 1/p, where p is the power of a. It decreases on both sides of 0; an end that is 0 is the end of
/// a side.
#[inline(always)]
fn reciprocal(p: Bounds, a: Bounds, is_even: bool) -> Bounds {
    let low = if p.high == 0.0 {
        f64::NEG_INFINITY
    } else {
        product_below(1.0 / p.high)
    };
    let high = if p.low == 0.0 {
        f64::INFINITY
    } else {
        product_above(1.0 / p.low)
    };
    let crosses = (a.low < 0.0) & (a.high > 0.0) & !is_even;
    let is_positive = is_even | (a.low >= 0.0);
    let is_negative = !is_even & (a.high <= 0.0);
    let low = if is_positive { greatest(low, 0.0) } else { low };
    let high = if is_negative { least(high, 0.0) } else { high };
    let result = Bounds {
        low: if crosses { f64::NEG_INFINITY } else { low },
        high: if crosses { f64::INFINITY } else { high },
        ..a
    };
    result
        .unless(!a.has_zero(), PARTIAL)
        .unless(!a.is_zero(), EMPTY)
}

/// a^b. Of positive numbers the power is monotone in both, so that the extremes are at corners.
/// What has integers among its exponents (other than constants) is left to the table's rule.
#[inline(always)]
pub(super) fn power(out: &mut BoundsBlock, a: &BoundsBlock, b: &BoundsBlock) {
    let (mut bases, mut exponents) = ([0.0; 4 * BOXES], [0.0; 4 * BOXES]);
    for lane in 0..BOXES {
        let (a, b) = (Bounds::get(a, lane), Bounds::get(b, lane));
        for corner in 0..4 {
            let base = if corner < 2 { a.low } else { a.high };
            bases[corner * BOXES + lane] = greatest(base, 0.0);
            let is_first = corner % 2 == 0;
            exponents[corner * BOXES + lane] = if is_first { b.low } else { b.high };
        }
    }
    let mut corners = [0.0; 4 * BOXES];
    slice::pow(&mut corners, &bases, &exponents);
    let mut all_ordinary = true;
    for lane in 0..BOXES {
        let (a, b) = (Bounds::get(a, lane), Bounds::get(b, lane));
        all_ordinary &= is_ordinary(a, b);
        let corner = |place: usize| corners[place * BOXES + lane];
        let low = least(least(corner(0), corner(1)), least(corner(2), corner(3)));
        let high = greatest(
            greatest(corner(0), corner(1)),
            greatest(corner(2), corner(3)),
        );
        let low = greatest(function_below(low, false), 0.0);
        let high = function_above(high, false);
        let is_defined = (a.low > 0.0) | ((a.low == 0.0) & (b.low > 0.0));
        let result = Bounds::smooth(low, high, a, b).unless(is_defined, PARTIAL);
        Bounds::set(out, lane, result);
    }
    if !all_ordinary {
        for lane in 0..BOXES {
            let (a, b) = (Bounds::get(a, lane), Bounds::get(b, lane));
            if !is_ordinary(a, b) {
                Bounds::set(out, lane, Bounds::by_rule(Op::Power, &[a, b]));
            }
        }
    }
}

/// Whether the corners tell the power: there are positive bases, exponents that are computed by
/// repeated multiplication are not at the ends, and negative bases have no power.
#[inline(always)]
fn is_ordinary(a: Bounds, b: Bounds) -> bool {
    let has_integer_end = is_integer_power(b.low) | is_integer_power(b.high);
    let has_integer = b.low.ceil() <= b.high;
    !has_integer_end & (a.high > 0.0) & ((a.low >= 0.0) | !has_integer)
        & !a.is_empty()
        & !b.is_empty()
}
