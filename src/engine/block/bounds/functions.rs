//! Elementary functions of enclosures, monotone whole or in pieces.
//!
//! The ends are values of the vector functions of [`crate::math`], whose errors are below one
//! unit in the last place, moved outward by two; where the argument is known to give an exact
//! value (sin 0, exp 0, log 1) they stay. The bound of the true value is also one of every value
//! that is computed inside: that one is a neighbour of the true one at most. Constant bounds of
//! a function (a cosine is at most 1) limit its ends.

use std::f64::consts::{FRAC_PI_2, PI};

use super::rounding::{function_above, function_below, greatest, least};
use super::{BOXES, Bounds, BoundsBlock, DEFINED, EMPTY, Lanes, PARTIAL};
use crate::engine::block::number::Number;
use crate::graph::operation::value::is_power_of_two;
use crate::math::slice;

/// The smallest numbers known to be above π and π/2; the constants themselves are below.
const ABOVE_PI: f64 = PI.next_up();
const ABOVE_HALF_PI: f64 = FRAC_PI_2.next_up();

/// Both ends side by side, so that one loop computes a function of both.
#[inline(always)]
pub(super) fn side_by_side(low: &Lanes, high: &Lanes) -> [f64; 2 * BOXES] {
    let mut ends = [0.0; 2 * BOXES];
    ends[..BOXES].copy_from_slice(low);
    ends[BOXES..].copy_from_slice(high);
    ends
}

/// An increasing function with values in a range, on the part of its operand that lies in a
/// domain; exact at one argument.
macro_rules! increasing {
    ($name:ident, $out:expr, $a:expr, in $domain:expr, to $range:expr, exact at $exact:expr) => {{
        let (out, a): (&mut BoundsBlock, &BoundsBlock) = ($out, $a);
        let ((first, last), (smallest, largest)): ((f64, f64), (f64, f64)) = ($domain, $range);
        let mut ends = side_by_side(&a.low, &a.high);
        for end in &mut ends {
            *end = greatest(least(*end, last), first);
        }
        let mut values = [0.0; 2 * BOXES];
        slice::$name(&mut values, &ends);
        for lane in 0..BOXES {
            let low = function_below(values[lane], ends[lane] == $exact);
            let high = function_above(values[BOXES + lane], ends[BOXES + lane] == $exact);
            let result = Bounds {
                low: greatest(low, smallest),
                high: least(high, largest),
                regularity: a.regularity[lane],
            };
            let is_inside = (a.low[lane] >= first) & (a.high[lane] <= last);
            let is_outside = (a.low[lane] > last) | (a.high[lane] < first);
            let result = result.unless(is_inside, PARTIAL).unless(!is_outside, EMPTY);
            Bounds::set(out, lane, result);
        }
    }};
}

/// All numbers.
const LINE: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);
/// Numbers from 0 on.
const NOT_NEGATIVE: (f64, f64) = (0.0, f64::INFINITY);
/// [−1, 1].
const UNIT: (f64, f64) = (-1.0, 1.0);

/// e^a.
#[inline(always)]
pub(super) fn exp(out: &mut BoundsBlock, a: &BoundsBlock) {
    increasing!(exp, out, a, in LINE, to NOT_NEGATIVE, exact at 0.0);
}

/// The logarithm of the numbers that have one; 0 has none.
#[inline(always)]
pub(super) fn log(out: &mut BoundsBlock, a: &BoundsBlock) {
    increasing!(log, out, a, in NOT_NEGATIVE, to LINE, exact at 1.0);
    for lane in 0..BOXES {
        let result = Bounds::get(out, lane)
            .unless(a.low[lane] > 0.0, PARTIAL)
            .unless(a.high[lane] > 0.0, EMPTY);
        Bounds::set(out, lane, result);
    }
}

/// The angle with this sine.
#[inline(always)]
pub(super) fn asin(out: &mut BoundsBlock, a: &BoundsBlock) {
    let half_turn = (-ABOVE_HALF_PI, ABOVE_HALF_PI);
    increasing!(asin, out, a, in UNIT, to half_turn, exact at 0.0);
}

/// The angle with this tangent.
#[inline(always)]
pub(super) fn atan(out: &mut BoundsBlock, a: &BoundsBlock) {
    let half_turn = (-ABOVE_HALF_PI, ABOVE_HALF_PI);
    increasing!(atan, out, a, in LINE, to half_turn, exact at 0.0);
}

/// The hyperbolic sine.
#[inline(always)]
pub(super) fn sinh(out: &mut BoundsBlock, a: &BoundsBlock) {
    increasing!(sinh, out, a, in LINE, to LINE, exact at 0.0);
}

/// The hyperbolic cosine, which increases with the magnitude.
#[inline(always)]
pub(super) fn cosh(out: &mut BoundsBlock, a: &BoundsBlock) {
    let mut magnitude = *a;
    for lane in 0..BOXES {
        Bounds::set(&mut magnitude, lane, Bounds::get(a, lane).absolute());
    }
    increasing!(cosh, out, &magnitude, in NOT_NEGATIVE, to (1.0, f64::INFINITY), exact at 0.0);
}

/// The hyperbolic tangent.
#[inline(always)]
pub(super) fn tanh(out: &mut BoundsBlock, a: &BoundsBlock) {
    increasing!(tanh, out, a, in LINE, to UNIT, exact at 0.0);
}

/// The angle in [0, π] with this cosine: it decreases.
#[inline(always)]
pub(super) fn acos(out: &mut BoundsBlock, a: &BoundsBlock) {
    let mut ends = side_by_side(&a.high, &a.low);
    for end in &mut ends {
        *end = greatest(least(*end, 1.0), -1.0);
    }
    let mut values = [0.0; 2 * BOXES];
    slice::acos(&mut values, &ends);
    for lane in 0..BOXES {
        let low = function_below(values[lane], ends[lane] == 1.0);
        let high = function_above(values[BOXES + lane], ends[BOXES + lane] == 1.0);
        let result = Bounds {
            low: greatest(low, 0.0),
            high: least(high, ABOVE_PI),
            regularity: a.regularity[lane],
        };
        let is_inside = (a.low[lane] >= -1.0) & (a.high[lane] <= 1.0);
        let is_outside = (a.low[lane] > 1.0) | (a.high[lane] < -1.0);
        let result = result.unless(is_inside, PARTIAL).unless(!is_outside, EMPTY);
        Bounds::set(out, lane, result);
    }
}

/// √(a² + b²), which increases with both magnitudes; the other one if one is 0.
#[inline(always)]
pub(super) fn hypot(out: &mut BoundsBlock, a: &BoundsBlock, b: &BoundsBlock) {
    let (mut first, mut second) = (*a, *b);
    for lane in 0..BOXES {
        Bounds::set(&mut first, lane, Bounds::get(a, lane).absolute());
        Bounds::set(&mut second, lane, Bounds::get(b, lane).absolute());
    }
    let first_ends = side_by_side(&first.low, &first.high);
    let second_ends = side_by_side(&second.low, &second.high);
    let mut values = [0.0; 2 * BOXES];
    slice::hypot(&mut values, &first_ends, &second_ends);
    let is_exact = |end: usize| (first_ends[end] == 0.0) | (second_ends[end] == 0.0);
    for lane in 0..BOXES {
        let low = function_below(values[lane], is_exact(lane));
        let high = function_above(values[BOXES + lane], is_exact(BOXES + lane));
        let regularity = least(a.regularity[lane], b.regularity[lane]);
        let result = Bounds {
            low: greatest(low, 0.0),
            high,
            regularity,
        };
        Bounds::set(out, lane, result);
    }
}

/// The corners of a box at which the angle is smallest and largest, as (y, x), unless the box
/// crosses the negative x axis from below: there angles jump. Any edge is a straight line, along
/// which the angle is monotone.
#[inline(always)]
fn extreme_corners(y: Bounds, x: Bounds) -> [(f64, f64); 2] {
    let (is_above, is_below) = (y.low >= 0.0, y.high <= 0.0);
    let (has_left, has_right) = (x.low < 0.0, x.high > 0.0);
    let first_y_above = if has_right { y.low } else { y.high };
    let first_y_below = if has_left { y.high } else { y.low };
    let first = (
        if is_above {
            first_y_above
        } else {
            first_y_below
        },
        if is_above { x.high } else { x.low },
    );
    // Of boxes above, (y.low or y.high, x.low); of boxes below, (y.high or y.low, x.high); right
    // of the axis across both, (y.high, x.low).
    let last_y_above = if has_left { y.low } else { y.high };
    let last_y_below = if has_right { y.high } else { y.low };
    let last = (
        if is_above {
            last_y_above
        } else if is_below {
            last_y_below
        } else {
            y.high
        },
        if is_below & !is_above { x.high } else { x.low },
    );
    // −0 counts as 0.
    [first, last].map(|(y, x)| (y + 0.0, x + 0.0))
}

/// The angle of points (b, a), 0 at the origin.
#[inline(always)]
pub(super) fn atan2(out: &mut BoundsBlock, a: &BoundsBlock, b: &BoundsBlock) {
    let (mut y, mut x) = ([0.0; 2 * BOXES], [0.0; 2 * BOXES]);
    for lane in 0..BOXES {
        let [first, last] = extreme_corners(Bounds::get(a, lane), Bounds::get(b, lane));
        (y[lane], x[lane]) = first;
        (y[BOXES + lane], x[BOXES + lane]) = last;
    }
    let mut angles = [0.0; 2 * BOXES];
    slice::atan2(&mut angles, &y, &x);
    for lane in 0..BOXES {
        let (a, b) = (Bounds::get(a, lane), Bounds::get(b, lane));
        let has_origin = a.has_zero() & b.has_zero();
        let is_cut = (b.low < 0.0) & (a.low < 0.0) & (a.high >= 0.0);
        let is_exact = |end: usize| (y[end] == 0.0) & (x[end] >= 0.0);
        let low = function_below(angles[lane], is_exact(lane));
        let high = function_above(angles[BOXES + lane], is_exact(BOXES + lane));
        let low = greatest(low, if a.low >= 0.0 { 0.0 } else { -ABOVE_PI });
        let high = least(high, if a.high < 0.0 { 0.0 } else { ABOVE_PI });
        let low = if has_origin { least(low, 0.0) } else { low };
        let high = if has_origin { greatest(high, 0.0) } else { high };
        let low = if is_cut { -ABOVE_PI } else { low };
        let high = if is_cut { ABOVE_PI } else { high };
        let result = Bounds::smooth(low, high, a, b).unless(!has_origin & !is_cut, DEFINED);
        Bounds::set(out, lane, result);
    }
}

/// a mod b: where ⌊a/b⌋ is known the ends move with a; else they are 0 and b, widened by as much
/// as the rounded remainder can miss them.
#[inline(always)]
pub(super) fn modulo(out: &mut BoundsBlock, a: &BoundsBlock, b: &BoundsBlock) {
    for lane in 0..BOXES {
        let (a, b) = (Bounds::get(a, lane), Bounds::get(b, lane));
        let periods = a.divide(b).round_down();
        let stepwise = a.subtract(b.multiply(periods));
        let slack = modulo_slack(a, b);
        let low = greatest(stepwise.low, least(b.low, 0.0) - slack);
        let high = least(stepwise.high, greatest(b.high, 0.0) + slack);
        Bounds::set(
            out,
            lane,
            Bounds {
                low,
                high,
                regularity: stepwise.regularity,
            },
        );
    }
}

/// How far the computed remainder can lie outside of [0, b]. The quotient, the product and the
/// difference each round once, to 2^-53 of |a| + |b| (times 4 for the sum of all, and 2 to be
/// safe; as much again for the rounding of the bound itself), and the quotient may underflow. If b
/// is a power of two only that is left.
#[inline(always)]
fn modulo_slack(a: Bounds, b: Bounds) -> f64 {
    const SMALLEST: f64 = f64::from_bits(1);
    let dividend = a.absolute().high;
    let divisor = b.absolute().high;
    let underflow = if divisor <= 1.0 {
        0.0
    } else {
        divisor * SMALLEST
    };
    let slack = (dividend + divisor) * (8.0 * f64::EPSILON) + underflow + SMALLEST;
    let is_exact = (b.low == b.high) & is_power_of_two(b.low);
    if is_exact { underflow } else { slack }
}

/// −1, 0 or 1.
#[inline(always)]
pub(super) fn sign(out: &mut BoundsBlock, a: &BoundsBlock) {
    for lane in 0..BOXES {
        let a = Bounds::get(a, lane);
        Bounds::set(out, lane, stepped(a, sign_of(a.low), sign_of(a.high)));
    }
}

/// The nearest integer, halves away from 0.
#[inline(always)]
pub(super) fn round(out: &mut BoundsBlock, a: &BoundsBlock) {
    for lane in 0..BOXES {
        let a = Bounds::get(a, lane);
        Bounds::set(out, lane, stepped(a, rounded(a.low), rounded(a.high)));
    }
}

/// The result of an exact function that never decreases, but jumps.
#[inline(always)]
fn stepped(a: Bounds, low: f64, high: f64) -> Bounds {
    Bounds { low, high, ..a }.unless(low == high, DEFINED)
}

#[inline(always)]
fn sign_of(a: f64) -> f64 {
    let not_positive = if a < 0.0 { -1.0 } else { a };
    if a > 0.0 { 1.0 } else { not_positive }
}

#[inline(always)]
fn rounded(a: f64) -> f64 {
    let (floor, ceil) = (a.floor(), a.ceil());
    let if_negative = if ceil - a >= 0.5 { floor } else { ceil };
    let otherwise = if a - floor >= 0.5 { ceil } else { floor };
    if a < 0.0 { if_negative } else { otherwise }
}
