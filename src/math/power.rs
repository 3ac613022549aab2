//! Powers with any exponent, and the hypotenuse.
//!
//! xʸ = e^(y·ln x), with ln x as a sum of two numbers good to about 65 bits (38 in f32), because
//! the exponential turns the absolute error of y·ln x, which is up to 745 (104), into a relative
//! one. ln m for √½ ≤ m < √2 comes from s = (m − 1)/(m + 1) as 2s + s³·(2/3 + s²·T(s²)) (P. T. P.
//! Tang, "Table-driven implementation of the logarithm function", ACM TOMS 16 (1990), without
//! the table), with all but T in doubled precision.

use super::double::{Double, ordered_sum, product};
use super::exponential::{Exponential, exp_of_sum};
use super::float::Float;
use super::logarithm::Logarithm;
use super::polynomial::horner;

/// The constants of powers in one type.
pub trait Power: Exponential + Logarithm {
    /// 2/3 rounded, and what is missing.
    const TWO_THIRDS: Double<Self>;
    /// An exponent so large that xʸ is 0, 1 or infinite, while y·ln x does not overflow.
    const LARGEST_EXPONENT: Self;
    /// Below it integers and fractions can be told apart by a sum with [`Float::ROUNDER`].
    const LARGEST_ODD_EXPONENT: Self;
    /// The interval of numbers of which sums of squares and their errors neither overflow nor
    /// underflow.
    const SQUARE_SAFE: (Self, Self);

    /// T(z) = (2 artanh √z − 2√z − 2/3 √z³) / √z⁵ on √z ≤ (√2 − 1)/(√2 + 1).
    fn artanh_tail(z: Self) -> Self;
}

impl Power for f64 {
    const TWO_THIRDS: Double<f64> = Double {
        high: 0.6666666666666666,
        low: 3.700743415417188e-17,
    };
    const LARGEST_EXPONENT: Self = 1.2676506002282294e30; // 2¹⁰⁰
    const LARGEST_ODD_EXPONENT: Self = 1_125_899_906_842_624.0; // 2⁵⁰
    const SQUARE_SAFE: (f64, f64) = (1e-130, 1e150);

    /// Degree 7, minimax by Remez's algorithm; error relative to the logarithm 2^−66.4.
    #[inline(always)]
    fn artanh_tail(z: f64) -> f64 {
        horner(
            z,
            [
                0.3999999999999998,
                0.28571428571445057,
                0.222222222175487,
                0.18181818868892186,
                0.15384556963356447,
                0.13336314024065737,
                0.11674884581666144,
                0.11988483921365554,
            ],
        )
    }
}

impl Power for f32 {
    const TWO_THIRDS: Double<f32> = Double {
        high: 0.6666667,
        low: -1.9868216e-08,
    };
    const LARGEST_EXPONENT: Self = 1_099_511_627_776.0; // 2⁴⁰
    const LARGEST_ODD_EXPONENT: Self = 2_097_152.0; // 2²¹
    const SQUARE_SAFE: (f32, f32) = (1e-15, 1e18);

    /// Degree 3, minimax by Remez's algorithm; error relative to the logarithm 2^−38.6.
    #[inline(always)]
    fn artanh_tail(z: f32) -> f32 {
        horner(z, [0.39999998, 0.28571874, 0.2218506, 0.1946711])
    }
}

/// Whether [`pow`] is good for these operands: |x| is normal, and y not so large that its parity
/// is hard to tell if x is negative.
#[inline(always)]
pub(super) fn is_ordinary_power<T: Power>(x: T, y: T) -> bool {
    let normal = x.abs() >= T::SMALLEST_NORMAL && x.abs() < T::INFINITY;
    normal && (x > T::ZERO || y.abs() < T::LARGEST_ODD_EXPONENT)
}

/// xʸ for ordinary operands; NaN if y is NaN, or if x is negative and y not an integer.
#[inline(always)]
pub(super) fn pow<T: Power>(x: T, y: T) -> T {
    let logarithm = log_in_two_parts(x.abs());
    let exponent = if y > T::LARGEST_EXPONENT {
        T::LARGEST_EXPONENT
    } else {
        y
    };
    let least = -T::LARGEST_EXPONENT;
    let exponent = if exponent < least { least } else { exponent };
    let Double { high, low } = product(exponent, logarithm.high);
    let low = exponent.mul_add(logarithm.low, low);
    // The correction of a clamped argument is meaningless.
    let inside = high < T::CEILING && high > T::FLOOR;
    let magnitude = exp_of_sum(high, if inside { low } else { T::ZERO });
    let rounded = y + T::ROUNDER;
    let integer = rounded - T::ROUNDER == y;
    let signed = if rounded.is_odd_sum() {
        -magnitude
    } else {
        magnitude
    };
    let of_negative = if integer { signed } else { T::NAN };
    if x < T::ZERO { of_negative } else { magnitude }
}

/// ln x for normal x > 0, as a sum of two numbers.
#[inline(always)]
fn log_in_two_parts<T: Power>(x: T) -> Double<T> {
    let (e, m) = x.exponent_and_significand();
    // s = f / (2 + f) with f = m − 1.
    let f = m - T::ONE;
    let denominator = ordered_sum(T::TWO, f);
    let reciprocal = T::ONE / denominator.high;
    let s = f * reciprocal;
    let remainder = (-s).mul_add(denominator.low, (-s).mul_add(denominator.high, f));
    let s = Double {
        high: s,
        low: remainder * reciprocal,
    };
    // z = s², c = 2/3 + z·T(z), v = z·c, w = s·v.
    let z = product(s.high, s.high);
    let z_low = (s.high + s.high).mul_add(s.low, z.low);
    let tail = T::artanh_tail(z.high);
    let c = fused_sum(z.high, tail, T::TWO_THIRDS);
    let c_low = z_low.mul_add(tail, c.low);
    let v = product(z.high, c.high);
    let v_low = z_low.mul_add(c.high, z.high.mul_add(c_low, v.low));
    let w = product(s.high, v.high);
    let w_low = s.low.mul_add(v.high, s.high.mul_add(v_low, w.low));
    // e·ln 2 + 2s + w, largest parts first.
    let fraction = ordered_sum(s.high + s.high, w.high);
    let fraction_low = fraction.low + (s.low + s.low + w_low);
    let leading = ordered_sum(e * T::LN2_SHORT, fraction.high);
    let low = leading.low + e.mul_add(T::LN2_REST, fraction_low);
    ordered_sum(leading.high, low)
}

/// a·b + c, where |a·b| is smaller than c.
#[inline(always)]
fn fused_sum<T: Float>(a: T, b: T, c: Double<T>) -> Double<T> {
    let high = a.mul_add(b, c.high);
    Double {
        high,
        low: a.mul_add(b, c.high - high) + c.low,
    }
}

/// Whether [`hypot`] is good for these operands.
#[inline(always)]
pub(super) fn has_safe_squares<T: Power>(a: T, b: T) -> bool {
    let (least, largest) = T::SQUARE_SAFE;
    let is_safe = |a: T| (a >= least && a <= largest) || a == T::ZERO;
    is_safe(a.abs()) && is_safe(b.abs())
}

/// √(a² + b²) for operands with safe squares.
#[inline(always)]
pub(super) fn hypot<T: Float>(a: T, b: T) -> T {
    let (a, b) = (a.abs(), b.abs());
    let larger = if a > b { a } else { b };
    let smaller = if a > b { b } else { a };
    let (a, b) = (product(larger, larger), product(smaller, smaller));
    let sum = ordered_sum(a.high, b.high);
    let root = sum.high.sqrt();
    let remainder = (-root).mul_add(root, sum.high) + (sum.low + (a.low + b.low));
    (remainder * T::HALF).mul_add(root.rough_reciprocal(), root)
}
