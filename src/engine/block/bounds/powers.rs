//! Powers of enclosures.

use super::functions::side_by_side;
use super::rounding::{function_above, function_below, greatest, least, magnitude_product};
use super::rounding::{product_above, product_below};
use super::{Bounds, BoundsBlock, EMPTY, PARTIAL};
use crate::engine::block::number::Number;
use crate::graph::Op;
use crate::graph::operation::value::{by_squaring, is_integer_power};
use crate::math::slice;

/// Magnitudes and the direction in which each is rounded: 1 for up, −1 for down.
type Directed<const BOXES: usize> = ([[f64; BOXES]; 2], [[f64; BOXES]; 2]);

/// Products lane by lane, rounded in the first one's direction.
#[inline(always)]
fn multiply<const BOXES: usize>(
    (a, direction): Directed<BOXES>,
    (b, _): Directed<BOXES>,
) -> Directed<BOXES> {
    let mut product = a;
    let others = b.as_flattened().iter().zip(direction.as_flattened());
    for (product, (&b, &direction)) in product.as_flattened_mut().iter_mut().zip(others) {
        *product = magnitude_product(*product, b, direction);
    }
    (product, direction)
}

/// a^n, where n is usually an integer constant: repeated multiplication of the ends, rounded
/// outward, which also bounds what repeated multiplication computes.
#[inline(always)]
pub(super) fn integer_power<const BOXES: usize>(
    out: &mut BoundsBlock<BOXES>,
    a: &BoundsBlock<BOXES>,
    exponent: Bounds,
) {
    let n = exponent.low;
    let is_integer = n == exponent.high && is_integer_power(n) && !exponent.is_empty();
    if !is_integer {
        power(out, a, &BoundsBlock::of(exponent));
    } else if n == 0.0 {
        *out = *a;
        out.low = [1.0; BOXES];
        out.high = [1.0; BOXES];
    } else {
        let is_even = n % 2.0 == 0.0;
        let (low, high) = powers(a, n.abs() as u32, is_even);
        for lane in 0..BOXES {
            let a = a.lane(lane);
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
            out.put(lane, result);
        }
    }
}

/// Bounds of a^n for n ≥ 1: from below at the lower end and from above at the upper one.
#[inline(always)]
fn powers<const BOXES: usize>(
    a: &BoundsBlock<BOXES>,
    n: u32,
    is_even: bool,
) -> ([f64; BOXES], [f64; BOXES]) {
    let (mut low, mut high) = (a.low, a.high);
    if is_even {
        for lane in 0..BOXES {
            let magnitude = a.lane(lane).absolute();
            (low[lane], high[lane]) = (magnitude.low, magnitude.high);
        }
    }
    let ends = side_by_side(&low, &high);
    let (mut magnitudes, mut directions) = (ends, [[1.0; BOXES]; 2]);
    for end in 0..2 {
        for lane in 0..BOXES {
            // Upward for a number is downward for the magnitude of a negative one.
            let is_negative = ends[end][lane] < 0.0;
            let is_downward = (end == 0) != is_negative;
            directions[end][lane] = if is_downward { -1.0 } else { 1.0 };
            magnitudes[end][lane] = ends[end][lane].abs();
        }
    }
    let (magnitudes, _) = by_squaring((magnitudes, directions), n, multiply);
    for lane in 0..BOXES {
        low[lane] = signed(magnitudes[0][lane], ends[0][lane]);
        high[lane] = signed(magnitudes[1][lane], ends[1][lane]);
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
#[allow(
    clippy::needless_range_loop,
    reason = "several columns are read at the same lane"
)]
pub(super) fn power<const BOXES: usize>(
    out: &mut BoundsBlock<BOXES>,
    a: &BoundsBlock<BOXES>,
    b: &BoundsBlock<BOXES>,
) {
    let (mut bases, mut exponents) = ([[0.0; BOXES]; 4], [[0.0; BOXES]; 4]);
    for lane in 0..BOXES {
        let (a, b) = (a.lane(lane), b.lane(lane));
        for corner in 0..4 {
            let base = if corner < 2 { a.low } else { a.high };
            bases[corner][lane] = greatest(base, 0.0);
            exponents[corner][lane] = if corner % 2 == 0 { b.low } else { b.high };
        }
    }
    let mut corners = [[0.0; BOXES]; 4];
    slice::pow(
        corners.as_flattened_mut(),
        bases.as_flattened(),
        exponents.as_flattened(),
    );
    let mut all_ordinary = true;
    for lane in 0..BOXES {
        let (a, b) = (a.lane(lane), b.lane(lane));
        all_ordinary &= is_ordinary(a, b);
        let [p, q, r, s] = [0, 1, 2, 3].map(|corner: usize| corners[corner][lane]);
        let low = least(least(p, q), least(r, s));
        let high = greatest(greatest(p, q), greatest(r, s));
        let low = greatest(function_below(low, false), 0.0);
        let high = function_above(high, false);
        let is_defined = (a.low > 0.0) | ((a.low == 0.0) & (b.low > 0.0));
        let result = Bounds::smooth(low, high, a, b).unless(is_defined, PARTIAL);
        out.put(lane, result);
    }
    if !all_ordinary {
        for lane in 0..BOXES {
            let (a, b) = (a.lane(lane), b.lane(lane));
            if !is_ordinary(a, b) {
                out.put(lane, Bounds::by_rule(Op::Power, &[a, b]));
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
    !has_integer_end
        & (a.high > 0.0)
        & ((a.low >= 0.0) | !has_integer)
        & !a.is_empty()
        & !b.is_empty()
}
