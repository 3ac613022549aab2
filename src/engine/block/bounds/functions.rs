//! Elementary functions of enclosures, monotone whole or in pieces.
//!
//! The ends are values of the vector functions of [`crate::math`], whose errors are below one
//! unit in the last place, moved outward by two; where the argument is known to give an exact
//! value (sin 0, exp 0, log 1) they stay. The bound of the true value is also one of every value
//! that is computed inside: that one is a neighbour of the true one at most. Constant bounds of
//! a function (a cosine is at most 1) limit its ends.

use std::f64::consts::{FRAC_PI_2, PI};

use super::rounding::{function_above, function_below, greatest, least};
use super::{Bounds, BoundsBlock, DEFINED, EMPTY, PARTIAL};
use super::{periodic, powers};
use crate::engine::block::number::Number;
use crate::graph::Op;
use crate::graph::operation::value::is_power_of_two;
use crate::math::slice;

/// The smallest numbers known to be above π and π/2; the constants themselves are below.
const ABOVE_PI: f64 = PI.next_up();
const ABOVE_HALF_PI: f64 = FRAC_PI_2.next_up();

/// Both ends side by side, so that one loop computes a function of both.
#[inline(always)]
pub(super) fn side_by_side<const BOXES: usize>(
    low: &[f64; BOXES],
    high: &[f64; BOXES],
) -> [[f64; BOXES]; 2] {
    [*low, *high]
}

/// An increasing function with values in a range, on the part of its operand that lies in a
/// domain; exact at one argument.
macro_rules! increasing {
    ($name:ident, $out:expr, $a:expr, in $domain:expr, to $range:expr, exact at $exact:expr) => {{
        let (out, a): (&mut BoundsBlock<BOXES>, &BoundsBlock<BOXES>) = ($out, $a);
        let ((first, last), (smallest, largest)): ((f64, f64), (f64, f64)) = ($domain, $range);
        let mut ends = side_by_side(&a.low, &a.high);
        for end in ends.as_flattened_mut() {
            *end = greatest(least(*end, last), first);
        }
        let mut values = [[0.0; BOXES]; 2];
        slice::$name(values.as_flattened_mut(), ends.as_flattened());
        for lane in 0..BOXES {
            let low = function_below(values[0][lane], ends[0][lane] == $exact);
            let high = function_above(values[1][lane], ends[1][lane] == $exact);
            let result = Bounds {
                low: greatest(low, smallest),
                high: least(high, largest),
                regularity: a.regularity[lane],
            };
            let is_inside = (a.low[lane] >= first) & (a.high[lane] <= last);
            let is_outside = (a.low[lane] > last) | (a.high[lane] < first);
            let result = result.unless(is_inside, PARTIAL).unless(!is_outside, EMPTY);
            out.put(lane, result);
        }
    }};
}

/// A function of one operand.
#[inline(always)]
pub(super) fn of_one<const BOXES: usize>(
    op: Op,
    out: &mut BoundsBlock<BOXES>,
    a: &BoundsBlock<BOXES>,
) {
    match op {
        Op::Exp => exp(out, a),
        Op::Log => log(out, a),
        Op::Sin => periodic::sin(out, a),
        Op::Cos => periodic::cos(out, a),
        Op::Tan => periodic::tan(out, a),
        Op::Asin => asin(out, a),
        Op::Acos => acos(out, a),
        Op::Atan => atan(out, a),
        Op::Sinh => sinh(out, a),
        Op::Cosh => cosh(out, a),
        Op::Tanh => tanh(out, a),
        Op::Sign => sign(out, a),
        Op::Round => round(out, a),
        _ => {
            for lane in 0..BOXES {
                out.put(lane, Bounds::by_rule(op, &[a.lane(lane)]));
            }
        }
    }
}

/// A function of two operands.
#[inline(always)]
pub(super) fn of_two<const BOXES: usize>(
    op: Op,
    out: &mut BoundsBlock<BOXES>,
    a: &BoundsBlock<BOXES>,
    b: &BoundsBlock<BOXES>,
) {
    match op {
        Op::Power | Op::IntegerPower => powers::power(out, a, b),
        Op::Atan2 => atan2(out, a, b),
        Op::Hypot => hypot(out, a, b),
        Op::Modulo => modulo(out, a, b),
        _ => {
            for lane in 0..BOXES {
                out.put(lane, Bounds::by_rule(op, &[a.lane(lane), b.lane(lane)]));
            }
        }
    }
}

/// All numbers.
const LINE: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);
/// Numbers from 0 on.
const NOT_NEGATIVE: (f64, f64) = (0.0, f64::INFINITY);
/// [−1, 1].
const UNIT: (f64, f64) = (-1.0, 1.0);

/// e^a.
#[inline(always)]
pub(super) fn exp<const BOXES: usize>(out: &mut BoundsBlock<BOXES>, a: &BoundsBlock<BOXES>) {
    increasing!(exp, out, a, in LINE, to NOT_NEGATIVE, exact at 0.0);
}

/// The logarithm of the numbers that have one; 0 has none.
#[inline(always)]
pub(super) fn log<const BOXES: usize>(out: &mut BoundsBlock<BOXES>, a: &BoundsBlock<BOXES>) {
    increasing!(log, out, a, in NOT_NEGATIVE, to LINE, exact at 1.0);
    for lane in 0..BOXES {
        let result = out
            .lane(lane)
            .unless(a.low[lane] > 0.0, PARTIAL)
            .unless(a.high[lane] > 0.0, EMPTY);
        out.put(lane, result);
    }
}

/// The angle with this sine.
#[inline(always)]
pub(super) fn asin<const BOXES: usize>(out: &mut BoundsBlock<BOXES>, a: &BoundsBlock<BOXES>) {
    let half_turn = (-ABOVE_HALF_PI, ABOVE_HALF_PI);
    increasing!(asin, out, a, in UNIT, to half_turn, exact at 0.0);
}

/// The angle with this tangent.
#[inline(always)]
pub(super) fn atan<const BOXES: usize>(out: &mut BoundsBlock<BOXES>, a: &BoundsBlock<BOXES>) {
    let half_turn = (-ABOVE_HALF_PI, ABOVE_HALF_PI);
    increasing!(atan, out, a, in LINE, to half_turn, exact at 0.0);
}

/// The hyperbolic sine.
#[inline(always)]
pub(super) fn sinh<const BOXES: usize>(out: &mut BoundsBlock<BOXES>, a: &BoundsBlock<BOXES>) {
    increasing!(sinh, out, a, in LINE, to LINE, exact at 0.0);
}

/// The hyperbolic cosine, which increases with the magnitude.
#[inline(always)]
pub(super) fn cosh<const BOXES: usize>(out: &mut BoundsBlock<BOXES>, a: &BoundsBlock<BOXES>) {
    let mut magnitude = *a;
    for lane in 0..BOXES {
        magnitude.put(lane, a.lane(lane).absolute());
    }
    increasing!(cosh, out, &magnitude, in NOT_NEGATIVE, to (1.0, f64::INFINITY), exact at 0.0);
}

/// The hyperbolic tangent.
#[inline(always)]
pub(super) fn tanh<const BOXES: usize>(out: &mut BoundsBlock<BOXES>, a: &BoundsBlock<BOXES>) {
    increasing!(tanh, out, a, in LINE, to UNIT, exact at 0.0);
}

/// The angle in [0, π] with this cosine: it decreases.
#[inline(always)]
pub(super) fn acos<const BOXES: usize>(out: &mut BoundsBlock<BOXES>, a: &BoundsBlock<BOXES>) {
    let mut ends = side_by_side(&a.high, &a.low);
    for end in ends.as_flattened_mut() {
        *end = greatest(least(*end, 1.0), -1.0);
    }
    let mut values = [[0.0; BOXES]; 2];
    slice::acos(values.as_flattened_mut(), ends.as_flattened());
    for lane in 0..BOXES {
        let low = function_below(values[0][lane], ends[0][lane] == 1.0);
        let high = function_above(values[1][lane], ends[1][lane] == 1.0);
        let result = Bounds {
            low: greatest(low, 0.0),
            high: least(high, ABOVE_PI),
            regularity: a.regularity[lane],
        };
        let is_inside = (a.low[lane] >= -1.0) & (a.high[lane] <= 1.0);
        let is_outside = (a.low[lane] > 1.0) | (a.high[lane] < -1.0);
        let result = result.unless(is_inside, PARTIAL).unless(!is_outside, EMPTY);
        out.put(lane, result);
    }
}

/// √(a² + b²), which increases with both magnitudes; the other one if one is 0.
#[inline(always)]
pub(super) fn hypot<const BOXES: usize>(
    out: &mut BoundsBlock<BOXES>,
    a: &BoundsBlock<BOXES>,
    b: &BoundsBlock<BOXES>,
) {
    let (mut first, mut second) = (*a, *b);
    for lane in 0..BOXES {
        first.put(lane, a.lane(lane).absolute());
        second.put(lane, b.lane(lane).absolute());
    }
    let first_ends = side_by_side(&first.low, &first.high);
    let second_ends = side_by_side(&second.low, &second.high);
    let mut values = [[0.0; BOXES]; 2];
    slice::hypot(
        values.as_flattened_mut(),
        first_ends.as_flattened(),
        second_ends.as_flattened(),
    );
    for lane in 0..BOXES {
        let exact =
            [0, 1].map(|end| (first_ends[end][lane] == 0.0) | (second_ends[end][lane] == 0.0));
        let low = function_below(values[0][lane], exact[0]);
        let high = function_above(values[1][lane], exact[1]);
        let regularity = least(a.regularity[lane], b.regularity[lane]);
        let result = Bounds {
            low: greatest(low, 0.0),
            high,
            regularity,
        };
        out.put(lane, result);
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
pub(super) fn atan2<const BOXES: usize>(
    out: &mut BoundsBlock<BOXES>,
    a: &BoundsBlock<BOXES>,
    b: &BoundsBlock<BOXES>,
) {
    let (mut y, mut x) = ([[0.0; BOXES]; 2], [[0.0; BOXES]; 2]);
    for lane in 0..BOXES {
        let [first, last] = extreme_corners(a.lane(lane), b.lane(lane));
        (y[0][lane], x[0][lane]) = first;
        (y[1][lane], x[1][lane]) = last;
    }
    let mut angles = [[0.0; BOXES]; 2];
    slice::atan2(
        angles.as_flattened_mut(),
        y.as_flattened(),
        x.as_flattened(),
    );
    for lane in 0..BOXES {
        let (a, b) = (a.lane(lane), b.lane(lane));
        let has_origin = a.has_zero() & b.has_zero();
        let is_cut = (b.low < 0.0) & (a.low < 0.0) & (a.high >= 0.0);
        let exact = [0, 1].map(|end| (y[end][lane] == 0.0) & (x[end][lane] >= 0.0));
        let low = function_below(angles[0][lane], exact[0]);
        let high = function_above(angles[1][lane], exact[1]);
        let low = greatest(low, if a.low >= 0.0 { 0.0 } else { -ABOVE_PI });
        let high = least(high, if a.high < 0.0 { 0.0 } else { ABOVE_PI });
        let low = if has_origin { least(low, 0.0) } else { low };
        let high = if has_origin {
            greatest(high, 0.0)
        } else {
            high
        };
        let low = if is_cut { -ABOVE_PI } else { low };
        let high = if is_cut { ABOVE_PI } else { high };
        let result = Bounds::smooth(low, high, a, b).unless(!has_origin & !is_cut, DEFINED);
        out.put(lane, result);
    }
}

/// a mod b: where ⌊a/b⌋ is known the ends move with a; else they are 0 and b, widened by as much
/// as the rounded remainder can miss them.
#[inline(always)]
pub(super) fn modulo<const BOXES: usize>(
    out: &mut BoundsBlock<BOXES>,
    a: &BoundsBlock<BOXES>,
    b: &BoundsBlock<BOXES>,
) {
    for lane in 0..BOXES {
        let (a, b) = (a.lane(lane), b.lane(lane));
        let periods = a.divide(b).round_down();
        let stepwise = a.subtract(b.multiply(periods));
        let slack = modulo_slack(a, b);
        let low = greatest(stepwise.low, least(b.low, 0.0) - slack);
        let high = least(stepwise.high, greatest(b.high, 0.0) + slack);
        out.put(
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
pub(super) fn sign<const BOXES: usize>(out: &mut BoundsBlock<BOXES>, a: &BoundsBlock<BOXES>) {
    for lane in 0..BOXES {
        let a = a.lane(lane);
        out.put(lane, stepped(a, sign_of(a.low), sign_of(a.high)));
    }
}

/// The nearest integer, halves away from 0.
#[inline(always)]
pub(super) fn round<const BOXES: usize>(out: &mut BoundsBlock<BOXES>, a: &BoundsBlock<BOXES>) {
    for lane in 0..BOXES {
        let a = a.lane(lane);
        out.put(lane, stepped(a, rounded(a.low), rounded(a.high)));
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
