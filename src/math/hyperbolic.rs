//! The hyperbolic functions.
//!
//! |x| = n·ln 2 + r as for eˣ, and by the addition theorem
//! sinh |x| = K·cosh r + B·sinh r and cosh |x| = B·cosh r + K·sinh r, where
//! B = cosh(n ln 2) = 2^(n−1) + 2^(−n−1) and K = sinh(n ln 2) = 2^(n−1) − 2^(−n−1). Nothing cancels:
//! for n = 0, K = 0 and sinh |x| = sinh r, with all its digits.

use super::double::{Double, ordered_sum, product, quotient};
use super::exponential::{Exponential, remainder};
use super::polynomial::horner;

/// The constants of the hyperbolic functions in one type.
pub trait Hyperbolic: Exponential {
    /// The largest magnitude for which 2^(−n−1) is normal.
    const LARGEST_HYPERBOLIC: Self;
    /// A magnitude from which tanh rounds to 1.
    const SATURATION: Self;

    /// S(z) = (sinh √z − √z) / √z³ on z ≤ (ln 2 / 2)².
    fn hyperbolic_sine_tail(z: Self) -> Self;
    /// C(z) = (cosh √z − 1) / z on z ≤ (ln 2 / 2)².
    fn hyperbolic_cosine_tail(z: Self) -> Self;
}

impl Hyperbolic for f64 {
    const LARGEST_HYPERBOLIC: Self = 707.0;
    const SATURATION: Self = 22.0;

    /// Degree 4, minimax by Remez's algorithm; error of the sine 2^−60.7 r.
    #[inline(always)]
    fn hyperbolic_sine_tail(z: f64) -> f64 {
        horner(
            z,
            [
                0.16666666666666677,
                0.008333333333321624,
                0.00019841269886134252,
                2.7557244209320833e-06,
                2.510903439763822e-08,
            ],
        )
    }

    /// Degree 5, minimax by Remez's algorithm; error of the cosine 2^−67.6.
    #[inline(always)]
    fn hyperbolic_cosine_tail(z: f64) -> f64 {
        horner(
            z,
            [
                0.5,
                0.041666666666666685,
                0.0013888888888873472,
                2.4801587348768036e-05,
                2.755725223050789e-07,
                2.0921632372615093e-09,
            ],
        )
    }
}

impl Hyperbolic for f32 {
    const LARGEST_HYPERBOLIC: Self = 86.0;
    const SATURATION: Self = 10.0;

    /// Degree 2, minimax by Remez's algorithm; error of the sine 2^−30.9 r.
    #[inline(always)]
    fn hyperbolic_sine_tail(z: f32) -> f32 {
        horner(z, [0.16666667, 0.008333289, 0.00019904948])
    }

    /// Degree 2, minimax by Remez's algorithm; error of the cosine 2^−29.9.
    #[inline(always)]
    fn hyperbolic_cosine_tail(z: f32) -> f32 {
        horner(z, [0.5, 0.041666266, 0.0013946219])
    }
}

/// Whether [`sinh`] and [`cosh`] are good for x.
#[inline(always)]
pub(super) fn is_moderate<T: Hyperbolic>(x: T) -> bool {
    x.abs() <= T::LARGEST_HYPERBOLIC
}

/// sinh x for moderate x.
#[inline(always)]
pub(super) fn sinh<T: Hyperbolic>(x: T) -> T {
    sine_and_cosine(x.abs()).0.high.flip_sign_by(x)
}

/// cosh x for moderate x.
#[inline(always)]
pub(super) fn cosh<T: Hyperbolic>(x: T) -> T {
    sine_and_cosine(x.abs()).1.high
}

/// tanh x for every x.
#[inline(always)]
pub(super) fn tanh<T: Hyperbolic>(x: T) -> T {
    let magnitude = if x.abs() > T::SATURATION {
        T::SATURATION
    } else {
        x.abs()
    };
    let (sine, cosine) = sine_and_cosine(magnitude);
    quotient(sine, cosine).flip_sign_by(x)
}

/// sinh x and cosh x for moderate x ≥ 0, each as its rounded value and a correction.
#[inline(always)]
fn sine_and_cosine<T: Hyperbolic>(x: T) -> (Double<T>, Double<T>) {
    let n = x.mul_add(T::LOG2_E, T::ROUNDER) - T::ROUNDER;
    let r = remainder(n, x, -T::ZERO);
    let z = r.high * r.high;
    let sine_tail = (r.high * z).mul_add(T::hyperbolic_sine_tail(z), r.low);
    let cosine_tail = z * T::hyperbolic_cosine_tail(z);
    let rising = (n + (T::BIASED_ROUNDER - T::ONE)).power_of_two();
    let falling = ((T::BIASED_ROUNDER - T::ONE) - n).power_of_two();
    let b = ordered_sum(rising, falling);
    let k = ordered_sum(rising, -falling);
    let tails = (sine_tail, cosine_tail);
    (
        combination(k, b, r.high, tails),
        combination(b, k, r.high, tails),
    )
}

/// p·cosh r + q·sinh r, where cosh r = 1 + cosine tail and sinh r = r + sine tail, added up with the
/// largest parts first.
#[inline(always)]
fn combination<T: Hyperbolic>(
    p: Double<T>,
    q: Double<T>,
    r: T,
    (sine_tail, cosine_tail): (T, T),
) -> Double<T> {
    let linear = product(r, q.high);
    let leading = ordered_sum(p.high, linear.high);
    let low = r.mul_add(q.low, linear.low + p.low);
    let low = sine_tail.mul_add(q.high, cosine_tail.mul_add(p.high, low));
    ordered_sum(leading.high, leading.low + low)
}
