//! The natural logarithm.
//!
//! x = 2ᵉ·m with √½ ≤ m < √2, and with f = m − 1 (exact) ln m = f − f²/2 + f³·P(f), where f − f²/2
//! is kept as a sum of two numbers. There is no division and no table: a division of eight lanes
//! costs more than the longer polynomial. The reduction is that of Cody and Waite, chapter 5.

use super::double::{Double, ordered_sum, product};
use super::float::Float;
use super::polynomial::{in_four_parts, in_two_parts};

/// The constants of ln x in one type.
pub trait Logarithm: Float {
    /// ln 2 with so many trailing zeros that a product with any exponent is exact.
    const LN2_SHORT: Self;
    /// What is missing to ln 2.
    const LN2_REST: Self;
    /// A power of two that makes subnormal numbers normal.
    const SUBNORMAL_SCALE: Self;
    /// Its exponent.
    const SUBNORMAL_EXPONENT: Self;

    /// 2P(f) = (ln(1 + f) − f + f²/2) / (f³/2) on √½ − 1 ≤ f ≤ √2 − 1.
    fn logarithm_tail(f: Self) -> Self;
}

impl Logarithm for f64 {
    const LN2_SHORT: Self = 0.6931471805598903;
    const LN2_REST: Self = 5.497923018708371e-14;
    const SUBNORMAL_SCALE: Self = 18_014_398_509_481_984.0; // 2⁵⁴
    const SUBNORMAL_EXPONENT: Self = 54.0;

    /// Degree 19, minimax by Remez's algorithm; error relative to ln(1 + f) 2^−57.9.
    #[inline(always)]
    fn logarithm_tail(f: f64) -> f64 {
        in_four_parts(
            f,
            [
                0.6666666666666691,
                -0.4999999999999784,
                0.39999999999892266,
                -0.3333333333382882,
                0.28571428587683206,
                -0.24999999964041558,
                0.22222221032061173,
                -0.20000000766144918,
                0.1818186701225786,
                -0.16666691536151074,
                0.15383428944216543,
                -0.14283999821001211,
                0.13350296231378184,
                -0.12539605757839684,
                0.11635565748777509,
                -0.10653538924400593,
                0.10831901610693755,
                -0.12550111519425824,
                0.11393830484381527,
                -0.04855292533883422,
            ],
        )
    }
}

impl Logarithm for f32 {
    const LN2_SHORT: Self = 0.693_145_75;
    const LN2_REST: Self = 1.428_606_8e-6;
    const SUBNORMAL_SCALE: Self = 33_554_432.0; // 2²⁵
    const SUBNORMAL_EXPONENT: Self = 25.0;

    /// Degree 8, minimax by Remez's algorithm; error relative to ln(1 + f) 2^−28.2.
    #[inline(always)]
    fn logarithm_tail(f: f32) -> f32 {
        in_two_parts(
            f,
            [
                0.66666627,
                -0.5000002,
                0.40004236,
                -0.33335984,
                0.2843915,
                -0.2481132,
                0.23776162,
                -0.23350461,
                0.13492627,
            ],
        )
    }
}

/// ln x for every x: −∞ at ±0, NaN below.
#[inline(always)]
pub(super) fn log<T: Logarithm>(x: T) -> T {
    let subnormal = x < T::SMALLEST_NORMAL;
    let scaled = if subnormal { x * T::SUBNORMAL_SCALE } else { x };
    let (exponent, m) = scaled.exponent_and_significand();
    let e = if subnormal {
        exponent - T::SUBNORMAL_EXPONENT
    } else {
        exponent
    };
    let f = m - T::ONE;
    let half_square = product(f * T::HALF, f);
    let leading = ordered_sum(f, -half_square.high);
    let half_cube = half_square.high * f;
    let tail = half_cube.mul_add(T::logarithm_tail(f), leading.low - half_square.low);
    let Double { high, low } = ordered_sum(e * T::LN2_SHORT, leading.high);
    let logarithm = high + (low + e.mul_add(T::LN2_REST, tail));
    let outside = if x == T::ZERO { -T::INFINITY } else { T::NAN };
    let inside = if x < T::INFINITY { logarithm } else { x };
    if x > T::ZERO { inside } else { outside }
}
