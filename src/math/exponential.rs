//! eˣ.
//!
//! x = n·ln 2 + r with |r| ≤ ln 2 / 2 (W. J. Cody, W. Waite, "Software Manual for the Elementary
//! Functions", 1980, chapter 6: ln 2 in two parts, n·(high part) subtracted exactly, here by a
//! fused multiply-add), eʳ = 1 + r + r²·Q(r), and 2ⁿ in two factors, so that overflow and
//! gradual underflow come out by themselves.
//!
//! In f64 the sum is taken in parts, as enclosures rely on little more than half a unit in the
//! last place. In f32 it is a polynomial of one fused operation a coefficient: a third fewer
//! operations, and 0.91 units at most.

use super::double::{Double, ordered_sum};
use super::float::Float;
use super::polynomial::horner;

/// The constants of eˣ in one type.
pub trait Exponential: Float {
    /// An argument beyond which eˣ overflows; 2ⁿ stays within two normal factors.
    const CEILING: Self;
    /// An argument below which eˣ rounds to 0.
    const FLOOR: Self;
    /// 1 / ln 2.
    const LOG2_E: Self;
    /// ln 2 rounded.
    const LN2: Self;
    /// What is missing to ln 2.
    const LN2_LOW: Self;

    /// Q(r) = (eʳ − 1 − r) / r² on |r| ≤ ln 2 / 2.
    fn exponential_tail(r: Self) -> Self;

    /// eʳ for r = x − n·ln 2, as accurate as [`exp`] is.
    fn exponential_of_remainder(n: Self, x: Self) -> Self;
}

impl Exponential for f64 {
    const CEILING: Self = 710.0;
    const FLOOR: Self = -746.0;
    const LOG2_E: Self = std::f64::consts::LOG2_E;
    const LN2: Self = std::f64::consts::LN_2;
    const LN2_LOW: Self = 2.319_046_813_846_299_6e-17;

    /// Degree 9, minimax by Remez's algorithm; error relative to eʳ 2^−57.3.
    #[inline(always)]
    fn exponential_tail(r: f64) -> f64 {
        horner(
            r,
            [
                0.5,
                0.16666666666666433,
                0.041666666666604,
                0.008333333333499981,
                0.0013888888926777458,
                0.0001984126946629001,
                2.4801508708274688e-05,
                2.7557640865689612e-06,
                2.762517585824627e-07,
                2.4978357596945065e-08,
            ],
        )
    }

    #[inline(always)]
    fn exponential_of_remainder(n: f64, x: f64) -> f64 {
        of_sum(n, x, -0.0)
    }
}

impl Exponential for f32 {
    const CEILING: Self = 89.0;
    const FLOOR: Self = -104.5;
    const LOG2_E: Self = std::f32::consts::LOG2_E;
    const LN2: Self = std::f32::consts::LN_2;
    const LN2_LOW: Self = -1.904_654_2e-9;

    /// Degree 4, minimax by Remez's algorithm; error relative to eʳ 2^−28.0.
    #[inline(always)]
    fn exponential_tail(r: f32) -> f32 {
        horner(
            r,
            [0.49999994, 0.16666521, 0.04166839, 0.00836871, 0.0013814595],
        )
    }

    #[inline(always)]
    fn exponential_of_remainder(n: f32, x: f32) -> f32 {
        let r = (-n).mul_add(Self::LN2_LOW, (-n).mul_add(Self::LN2, x));
        let slope = Self::exponential_tail(r).mul_add(r, 1.0);
        slope.mul_add(r, 1.0)
    }
}

/// eˣ for every x.
#[inline(always)]
pub(super) fn exp<T: Exponential>(x: T) -> T {
    let (x, n, sum) = reduced(x);
    scaled(T::exponential_of_remainder(n, x), n, sum)
}

/// e^(x + low) for every x, where |low| is at most some ulp of x.
#[inline(always)]
pub(super) fn exp_of_sum<T: Exponential>(x: T, low: T) -> T {
    let (x, n, sum) = reduced(x);
    scaled(of_sum(n, x, low), n, sum)
}

/// x within the limits between which eˣ varies, n, the integer nearest to x / ln 2, and the sum in
/// whose low bits n stands, with twice the exponent bias.
#[inline(always)]
fn reduced<T: Exponential>(x: T) -> (T, T, T) {
    // Comparisons in this direction let NaN pass.
    let x = if x > T::CEILING { T::CEILING } else { x };
    let x = if x < T::FLOOR { T::FLOOR } else { x };
    let sum = x.mul_add(T::LOG2_E, T::TWICE_BIASED_ROUNDER);
    (x, sum - T::TWICE_BIASED_ROUNDER, sum)
}

/// eʳ for r = x + low − n·ln 2, with little more than half a unit in the last place.
#[inline(always)]
fn of_sum<T: Exponential>(n: T, x: T, low: T) -> T {
    let r = remainder(n, x, low);
    let sum = ordered_sum(T::ONE, r.high);
    // e^(r + r.low) is eʳ + r.low·eʳ, with 1 + r for the last factor.
    let tail = (r.high * r.high).mul_add(T::exponential_tail(r.high), r.low * sum.high);
    sum.high + (sum.low + tail)
}

/// 2ⁿ·power, where n stands in the sum.
#[inline(always)]
fn scaled<T: Exponential>(power: T, n: T, sum: T) -> T {
    let half = n.mul_add(T::HALF, T::BIASED_ROUNDER);
    power * half.power_of_two() * sum.power_of_two_without(half)
}

/// x + low − n·ln 2, where n is the integer nearest to x / ln 2. The first difference is exact by
/// cancellation.
#[inline(always)]
pub(super) fn remainder<T: Exponential>(n: T, x: T, low: T) -> Double<T> {
    ordered_sum((-n).mul_add(T::LN2, x), (-n).mul_add(T::LN2_LOW, low))
}
