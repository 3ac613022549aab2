//! Sine, cosine and tangent.
//!
//! |x| = n·π/2 + r with |r| ≤ π/4 (a little more in f32), r as a sum of two numbers: the
//! reduction of Cody and Waite ("Software Manual for the Elementary Functions", 1980, chapter 8)
//! with fused multiply-adds, for |x| up to 2²⁰. Larger arguments are not fast: reducing them
//! takes hundreds of digits of π. Then sin r = r + r³·S(r²) and cos r = 1 − r²/2 + r⁴·C(r²), each
//! kept as a sum of two numbers until the end. The sign of x is put on last, so that the
//! functions are odd or even to the last bit.

use super::double::{Double, choose, ordered_sum, product, quotient, sum};
use super::float::Float;
use super::polynomial::horner;

/// The constants of the circular functions in one type.
pub trait Trigonometric: Float {
    /// The largest magnitude of a fast argument.
    const LARGEST_ANGLE: Self;
    /// 2/π.
    const TWO_OVER_PI: Self;

    /// |x| − n·π/2 to about twice the precision, for an integer n ≤ 2²⁰ near |x|·2/π.
    fn reduce(x: Self, n: Self) -> Double<Self>;
    /// S(z) = (sin √z − √z) / √z³.
    fn sine_tail(z: Self) -> Self;
    /// C(z) = (cos √z − 1 + z/2) / z².
    fn cosine_tail(z: Self) -> Self;
}

impl Trigonometric for f64 {
    const LARGEST_ANGLE: Self = 1_048_576.0; // 2²⁰
    const TWO_OVER_PI: Self = std::f64::consts::FRAC_2_PI;

    /// π/2 in 53, 33 and 53 bits. The first difference is exact by cancellation, because both
    /// sides are multiples of 2^−53; the product with the second part fits in 53 bits, so that
    /// the rounding error of the second difference is found exactly.
    #[inline(always)]
    fn reduce(x: f64, n: f64) -> Double<f64> {
        const SECOND: f64 = 6.12323399538461e-17;
        const THIRD: f64 = 3.5215598651832e-27;
        let first = (-n).mul_add(std::f64::consts::FRAC_PI_2, x);
        let high = (-n).mul_add(SECOND, first);
        let error = (-n).mul_add(SECOND, first - high);
        Double {
            high,
            low: (-n).mul_add(THIRD, error),
        }
    }

    /// Degree 5 on z ≤ (π/4)², minimax by Remez's algorithm, leading coefficients rounded first and
    /// the others refitted; error relative to sin 2^−57.9.
    #[inline(always)]
    fn sine_tail(z: f64) -> f64 {
        horner(
            z,
            [
                -0.16666666666666632,
                0.008333333333322424,
                -0.00019841269829782364,
                2.7557313677155198e-06,
                -2.5050755300713367e-08,
                1.5896616580957045e-10,
            ],
        )
    }

    /// Degree 5 on z ≤ (π/4)², minimax by Remez's algorithm; error relative to cos 2^−59.7.
    #[inline(always)]
    fn cosine_tail(z: f64) -> f64 {
        horner(
            z,
            [
                0.041666666666666595,
                -0.0013888888888873058,
                2.4801587288852144e-05,
                -2.755731417940961e-07,
                2.087570085556485e-09,
                -1.1358537141030406e-11,
            ],
        )
    }
}

impl Trigonometric for f32 {
    const LARGEST_ANGLE: Self = 1_048_576.0;
    const TWO_OVER_PI: Self = std::f32::consts::FRAC_2_PI;

    /// π/2 in three times 24 bits. The first difference is exact by cancellation; 20 bits of n
    /// leave no room for an exact product with the second part, so that its error is carried.
    #[inline(always)]
    fn reduce(x: f32, n: f32) -> Double<f32> {
        const SECOND: f32 = -4.371139e-08;
        const THIRD: f32 = -1.7151245e-15;
        let first = (-n).mul_add(std::f32::consts::FRAC_PI_2, x);
        let second = product(-n, SECOND);
        let Double { high, low } = sum(first, second.high);
        Double {
            high,
            low: (-n).mul_add(THIRD, low + second.low),
        }
    }

    /// Degree 3 on z ≤ 0.84², because n is one off where rounding |x|·2/π moves it that far;
    /// minimax by Remez's algorithm, leading coefficients rounded first and the others refitted;
    /// error relative to sin 2^−32.3.
    #[inline(always)]
    fn sine_tail(z: f32) -> f32 {
        horner(z, [-0.16666667, 0.008333372, -0.00019849284, 2.7887302e-06])
    }

    /// Degree 2 on z ≤ 0.84², minimax by Remez's algorithm; error relative to cos 2^−30.6.
    #[inline(always)]
    fn cosine_tail(z: f32) -> f32 {
        horner(z, [0.041666634, -0.0013886823, 2.4379602e-05])
    }
}

/// Whether the reduction is good for x.
#[inline(always)]
pub(super) fn is_moderate<T: Trigonometric>(x: T) -> bool {
    x.abs() <= T::LARGEST_ANGLE
}

/// sin x for moderate x.
#[inline(always)]
pub(super) fn sin<T: Trigonometric>(x: T) -> T {
    let turns = x.abs().mul_add(T::TWO_OVER_PI, T::ROUNDER);
    sine_from_quarter(turns, sine_and_cosine(x.abs(), turns)).flip_sign_by(x)
}

/// cos x for moderate x: the sine one quarter turn on.
#[inline(always)]
pub(super) fn cos<T: Trigonometric>(x: T) -> T {
    let turns = x.abs().mul_add(T::TWO_OVER_PI, T::ROUNDER);
    sine_from_quarter(turns + T::ONE, sine_and_cosine(x.abs(), turns))
}

/// tan x for moderate x.
#[inline(always)]
pub(super) fn tan<T: Trigonometric>(x: T) -> T {
    let turns = x.abs().mul_add(T::TWO_OVER_PI, T::ROUNDER);
    let (sine, cosine) = sine_and_cosine(x.abs(), turns);
    let sine = ordered_sum(sine.high, sine.low);
    let cosine = ordered_sum(cosine.high, cosine.low);
    let odd = turns.is_odd_sum();
    let numerator = choose(odd, -cosine, sine);
    let denominator = choose(odd, sine, cosine);
    quotient(numerator, denominator).flip_sign_by(x)
}

/// The sine of the reduced angle after as many quarter turns as stand in the sum with
/// [`Float::ROUNDER`].
#[inline(always)]
fn sine_from_quarter<T: Float>(turns: T, (sine, cosine): (Double<T>, Double<T>)) -> T {
    let value = choose(turns.is_odd_sum(), cosine, sine);
    (value.high + value.low).flip_sign_by(turns.sign_of_half_turns())
}

/// Sine and cosine of x ≥ 0 less the quarter turns that stand in the sum with
/// [`Float::ROUNDER`]. The low parts are up to an eighth of the high ones.
#[inline(always)]
fn sine_and_cosine<T: Trigonometric>(x: T, turns: T) -> (Double<T>, Double<T>) {
    let r = T::reduce(x, turns - T::ROUNDER);
    let z = product(r.high, r.high);
    // 1 − (r + low)²/2 + r⁴·C, and r + r³·S + low·cos r with 1 − z/2 for the cosine.
    let cosine = ordered_sum(T::ONE, z.high * -T::HALF);
    let tail = (z.high * z.high).mul_add(T::cosine_tail(z.high), cosine.low);
    let squares = z.low.mul_add(-T::HALF, tail);
    let cosine_low = (-r.high).mul_add(r.low, squares);
    let sine_low = (r.high * z.high).mul_add(T::sine_tail(z.high), r.low * cosine.high);
    let sine = Double {
        high: r.high,
        low: sine_low,
    };
    (
        sine,
        Double {
            high: cosine.high,
            low: cosine_low,
        },
    )
}
