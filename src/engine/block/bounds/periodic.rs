//! Sine, cosine and tangent of enclosures.
//!
//! Whether a crest, a trough or a pole lies inside is told by counting turns: the ends over 2π
//! (over π for poles), moved outward by more than they can be wrong. Where a crest is taken for
//! inside that is a little outside, the function there differs from 1 by less than its rounding
//! error, as long as the ends are moderate. Where they are not, up to half a ulp of an end is
//! no small angle, and a box that is not a whole turn wide is left to the table's rule.

use std::f64::consts::{FRAC_1_PI, PI};

use super::functions::side_by_side;
use super::rounding::{function_above, function_below, greatest, least};
use super::{Bounds, BoundsBlock, PARTIAL};
use crate::graph::Op;
use crate::math::slice;

/// A magnitude up to which turns are counted closely, 2^20.
const MODERATE: f64 = 1_048_576.0;

/// Lower and upper bounds of the turns that the ends are, given turns per unit, at most 1/π. Four
/// roundings (of the constant, of the product, of the sum here and of that with a phase) err by
/// less than |end|·2^-53·4/π + 2^-53.
#[inline(always)]
fn turns(a: Bounds, per_unit: f64) -> (f64, f64) {
    const RELATIVE: f64 = f64::EPSILON;
    const ABSOLUTE: f64 = 4.0 * f64::EPSILON;
    let slack_low = a.low.abs().mul_add(RELATIVE, ABSOLUTE);
    let slack_high = a.high.abs().mul_add(RELATIVE, ABSOLUTE);
    (a.low * per_unit - slack_low, a.high * per_unit + slack_high)
}

/// How many numbers k + phase with an integer k may lie in between.
#[inline(always)]
fn passes((low, high): (f64, f64), phase: f64) -> f64 {
    (high - phase).floor() - (low - phase).floor()
}

/// Whether an end is finite but so large that turns are not counted closely.
#[inline(always)]
fn is_huge(a: Bounds) -> bool {
    let magnitude = greatest(-a.low, a.high);
    (magnitude > MODERATE) & (magnitude < f64::INFINITY) & !a.is_empty()
}

/// The sine: 1 a quarter turn on, −1 three quarters.
#[inline(always)]
pub(super) fn sin<const BOXES: usize>(out: &mut BoundsBlock<BOXES>, a: &BoundsBlock<BOXES>) {
    let ends = side_by_side(&a.low, &a.high);
    let mut values = [[0.0; BOXES]; 2];
    slice::sin(values.as_flattened_mut(), ends.as_flattened());
    wave(Op::Sin, out, a, &values, (0.25, 0.75));
}

/// The cosine: 1 at whole turns, −1 at half ones.
#[inline(always)]
pub(super) fn cos<const BOXES: usize>(out: &mut BoundsBlock<BOXES>, a: &BoundsBlock<BOXES>) {
    let ends = side_by_side(&a.low, &a.high);
    let mut values = [[0.0; BOXES]; 2];
    slice::cos(values.as_flattened_mut(), ends.as_flattened());
    wave(Op::Cos, out, a, &values, (0.0, 0.5));
}

/// A function of which are given the values at the ends, that is 1 at the phase `crest`, −1 at
/// `trough` and monotone between.
#[inline(always)]
#[allow(
    clippy::needless_range_loop,
    reason = "several columns are read at the same lane"
)]
fn wave<const BOXES: usize>(
    op: Op,
    out: &mut BoundsBlock<BOXES>,
    a: &BoundsBlock<BOXES>,
    values: &[[f64; BOXES]; 2],
    (crest, trough): (f64, f64),
) {
    let mut any_huge = false;
    for lane in 0..BOXES {
        let a = a.lane(lane);
        any_huge |= is_huge(a);
        let turns = turns(a, 0.5 * FRAC_1_PI);
        let (first, last) = (values[0][lane], values[1][lane]);
        // Exact at 0, which is an extreme of the cosine.
        let (first_exact, last_exact) = (a.low == 0.0, a.high == 0.0);
        let low = least(
            function_below(first, first_exact),
            function_below(last, last_exact),
        );
        let high = greatest(
            function_above(first, first_exact),
            function_above(last, last_exact),
        );
        let has_trough = passes(turns, trough) >= 1.0;
        let has_crest = passes(turns, crest) >= 1.0;
        let low = greatest(low, -1.0);
        let high = least(high, 1.0);
        let result = Bounds {
            low: if has_trough { -1.0 } else { low },
            high: if has_crest { 1.0 } else { high },
            ..a
        };
        out.put(lane, result);
    }
    if any_huge {
        by_rule(op, out, a);
    }
}

/// The tangent; all numbers if there is a pole inside.
#[inline(always)]
#[allow(
    clippy::needless_range_loop,
    reason = "several columns are read at the same lane"
)]
pub(super) fn tan<const BOXES: usize>(out: &mut BoundsBlock<BOXES>, a: &BoundsBlock<BOXES>) {
    let ends = side_by_side(&a.low, &a.high);
    let mut values = [[0.0; BOXES]; 2];
    slice::tan(values.as_flattened_mut(), ends.as_flattened());
    let mut any_huge = false;
    for lane in 0..BOXES {
        let a = a.lane(lane);
        any_huge |= is_huge(a);
        let (first, last) = (values[0][lane], values[1][lane]);
        // A pole that may be inside is there if the tangent is smaller behind it; one branch away
        // it could be as large.
        let poles = passes(turns(a, FRAC_1_PI), 0.5);
        let is_narrow = a.high - a.low < 0.9 * PI;
        let rises = (poles == 1.0) & is_narrow & (first < last);
        let has_pole = (poles >= 1.0) & !rises;
        let low = function_below(first, a.low == 0.0);
        let high = function_above(last, a.high == 0.0);
        let result = Bounds {
            low: if has_pole { f64::NEG_INFINITY } else { low },
            high: if has_pole { f64::INFINITY } else { high },
            ..a
        };
        out.put(lane, result.unless(!has_pole, PARTIAL));
    }
    if any_huge {
        by_rule(Op::Tan, out, a);
    }
}

/// The table's rule for the lanes with huge ends.
#[cold]
fn by_rule<const BOXES: usize>(op: Op, out: &mut BoundsBlock<BOXES>, a: &BoundsBlock<BOXES>) {
    for lane in 0..BOXES {
        let a = a.lane(lane);
        if is_huge(a) {
            out.put(lane, Bounds::by_rule(op, &[a]));
        }
    }
}
