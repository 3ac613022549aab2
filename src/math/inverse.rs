//! The inverse circular functions.
//!
//! asin x = x + x³·R(x²) for |x| ≤ 1/2; beyond, asin x = π/2 − 2 asin √((1 − x)/2) with the square
//! root as a sum of two numbers (Cody and Waite, chapter 10). atan is taken of a quotient in
//! [0, 1], above 1/2 by atan(a/b) = π/4 + atan((a − b)/(a + b)), where a − b is exact; then
//! atan t = t + t³·P(t²).

use super::double::{Double, choose, ordered_sum, product};
use super::float::Float;
use super::polynomial::{horner, in_two_parts};

/// The constants of the inverse circular functions in one type.
pub trait InverseTrigonometric: Float {
    /// π rounded, and what is missing.
    const PI: Double<Self>;
    /// π/2 rounded, and what is missing.
    const HALF_PI: Double<Self>;
    /// π/4 rounded, and what is missing.
    const QUARTER_PI: Double<Self>;
    /// A power of two from which atan rounds to π/2.
    const LARGE: Self;
    /// The interval in which neither a quotient of two numbers nor the remainder of the division
    /// leaves the normal numbers.
    const QUOTIENT_SAFE: (Self, Self);

    /// R(z) = (asin √z − √z) / √z³ on z ≤ 1/4.
    fn arcsine_tail(z: Self) -> Self;
    /// P(z) = (atan √z − √z) / √z³ on z ≤ 1/4.
    fn arctangent_tail(z: Self) -> Self;
}

impl InverseTrigonometric for f64 {
    const PI: Double<f64> = Double {
        high: std::f64::consts::PI,
        low: 1.2246467991473532e-16,
    };
    const HALF_PI: Double<f64> = Double {
        high: std::f64::consts::FRAC_PI_2,
        low: 6.123233995736766e-17,
    };
    const QUARTER_PI: Double<f64> = Double {
        high: std::f64::consts::FRAC_PI_4,
        low: 3.061616997868383e-17,
    };
    const LARGE: Self = 1.2676506002282294e30; // 2¹⁰⁰
    const QUOTIENT_SAFE: (f64, f64) = (1e-280, 1e280);

    /// Degree 12, minimax by Remez's algorithm; error relative to asin 2^−58.9.
    #[inline(always)]
    fn arcsine_tail(z: f64) -> f64 {
        in_two_parts(
            z,
            [
                0.1666666666666676,
                0.07499999999970791,
                0.04464285717462084,
                0.030381942707330977,
                0.022372215000624675,
                0.017351611780918458,
                0.013980823304599583,
                0.011398890025256809,
                0.01078037508993418,
                0.0037059547236394925,
                0.0217085328300833,
                -0.02100057304862121,
                0.032629552813520674,
            ],
        )
    }

    /// Degree 11, minimax by Remez's algorithm; error relative to atan 2^−57.6.
    #[inline(always)]
    fn arctangent_tail(z: f64) -> f64 {
        in_two_parts(
            z,
            [
                -0.3333333333333298,
                0.19999999999903184,
                -0.14285714276391842,
                0.1111111065987255,
                -0.09090896250174661,
                0.07692073991430416,
                -0.06663811368109757,
                0.05858303682132234,
                -0.05122025754300629,
                0.04186557325626397,
                -0.02743575811153766,
                0.010117387084370015,
            ],
        )
    }
}

impl InverseTrigonometric for f32 {
    const PI: Double<f32> = Double {
        high: std::f32::consts::PI,
        low: -8.742278e-08,
    };
    const HALF_PI: Double<f32> = Double {
        high: std::f32::consts::FRAC_PI_2,
        low: -4.371139e-08,
    };
    const QUARTER_PI: Double<f32> = Double {
        high: std::f32::consts::FRAC_PI_4,
        low: -2.1855694e-08,
    };
    const LARGE: Self = 1.1529215e18; // 2⁶⁰
    const QUOTIENT_SAFE: (f32, f32) = (1e-30, 1e30);

    /// Degree 4, minimax by Remez's algorithm; error relative to asin 2^−27.4.
    #[inline(always)]
    fn arcsine_tail(z: f32) -> f32 {
        horner(
            z,
            [0.16666752, 0.07495298, 0.045470346, 0.024179664, 0.04216606],
        )
    }

    /// Degree 5, minimax by Remez's algorithm; error relative to atan 2^−27.8.
    #[inline(always)]
    fn arctangent_tail(z: f32) -> f32 {
        horner(
            z,
            [
                -0.33333328,
                0.19999489,
                -0.14272077,
                0.10940977,
                -0.07984045,
                0.038723025,
            ],
        )
    }
}

/// asin x for every x; NaN where |x| > 1.
#[inline(always)]
pub(super) fn asin<T: InverseTrigonometric>(x: T) -> T {
    let (steep, s, tail) = arcsine_parts(x.abs());
    let small = s + tail;
    let twice = ordered_sum(T::HALF_PI.high, -(s + s));
    let large = twice.high + (twice.low + (T::HALF_PI.low - (tail + tail)));
    (if steep { large } else { small }).flip_sign_by(x)
}

/// acos x for every x; NaN where |x| > 1.
#[inline(always)]
pub(super) fn acos<T: InverseTrigonometric>(x: T) -> T {
    let (steep, s, tail) = arcsine_parts(x.abs());
    // The result is base − angle: π/2 − asin x, or 0 + 2 asin √…, or π − 2 asin √….
    let zero = Double {
        high: T::ZERO,
        low: T::ZERO,
    };
    let end = choose(x < T::ZERO, T::PI, zero);
    let base = choose(steep, end, T::HALF_PI);
    let angle = if steep { -(s + s) } else { s }.flip_sign_by(x);
    let correction = if steep { -(tail + tail) } else { tail }.flip_sign_by(x);
    let difference = ordered_sum(base.high, -angle);
    difference.high + (difference.low + (base.low - correction))
}

/// (whether x > 1/2, s, asin s − s), where s is x, or √((1 − x)/2) if x > 1/2, for x ≥ 0. The
/// rounding error of the root is part of the last.
#[inline(always)]
fn arcsine_parts<T: InverseTrigonometric>(x: T) -> (bool, T, T) {
    let steep = x > T::HALF;
    let z = if steep { (T::ONE - x) * T::HALF } else { x * x };
    let root = z.sqrt();
    let root_low = (-root).mul_add(root, z) * root.rough_reciprocal() * T::HALF;
    let s = if steep { root } else { x };
    let low = if steep { root_low } else { T::ZERO };
    (steep, s, (s * z).mul_add(T::arcsine_tail(z), low))
}

/// atan x for every x.
#[inline(always)]
pub(super) fn atan<T: InverseTrigonometric>(x: T) -> T {
    let magnitude = if x.abs() > T::LARGE {
        T::LARGE
    } else {
        x.abs()
    };
    let steep = magnitude > T::ONE;
    let smaller = if steep { T::ONE } else { magnitude };
    let larger = if steep { magnitude } else { T::ONE };
    angle_in_half_plane(smaller, larger, steep, false).flip_sign_by(x)
}

/// Whether [`atan2`] is good for these operands: neither the quotient nor the remainder of the
/// division is undefined or leaves the normal numbers.
#[inline(always)]
pub(super) fn has_safe_quotient<T: InverseTrigonometric>(y: T, x: T) -> bool {
    let (least, largest) = T::QUOTIENT_SAFE;
    let steep = y.abs() > x.abs();
    let smaller = if steep { x.abs() } else { y.abs() };
    let larger = if steep { y.abs() } else { x.abs() };
    (smaller >= least || smaller == T::ZERO) && larger >= least && larger <= largest
}

/// The angle of the point (x, y), from −π to π.
#[inline(always)]
pub(super) fn atan2<T: InverseTrigonometric>(y: T, x: T) -> T {
    let steep = y.abs() > x.abs();
    let smaller = if steep { x.abs() } else { y.abs() };
    let larger = if steep { y.abs() } else { x.abs() };
    angle_in_half_plane(smaller, larger, steep, x.has_sign_bit()).flip_sign_by(y)
}

/// The angle from 0 to π of a point of which are given the magnitudes of the coordinates,
/// whether the ordinate is the larger one, and whether the abscissa is negative.
#[inline(always)]
fn angle_in_half_plane<T: InverseTrigonometric>(
    smaller: T,
    larger: T,
    steep: bool,
    left: bool,
) -> T {
    // The quotient, or the one that belongs to the angle less π/4, as t + t_low.
    let diagonal = smaller + smaller > larger;
    let sum = ordered_sum(larger, smaller);
    let numerator = if diagonal { smaller - larger } else { smaller };
    let denominator = if diagonal { sum.high } else { larger };
    let denominator_low = if diagonal { sum.low } else { T::ZERO };
    let t = numerator / denominator;
    let remainder = (-t).mul_add(denominator_low, (-t).mul_add(denominator, numerator));
    let t_low = remainder * denominator.rough_reciprocal();
    // d atan / dt = 1/(1 + t²) is 1 − t² closely enough for the correction.
    let z = t * t;
    let tail = (t * z).mul_add(T::arctangent_tail(z), (-t_low).mul_add(z, t_low));
    // The result is eighths · π/4 ± (t + tail).
    let eighths = if diagonal { T::ONE } else { T::ZERO };
    let eighths = if steep { T::TWO - eighths } else { eighths };
    let eighths = if left {
        T::TWO + T::TWO - eighths
    } else {
        eighths
    };
    let backwards = steep != left;
    let angle = if backwards { -t } else { t };
    let correction = if backwards { -tail } else { tail };
    let base = product(eighths, T::QUARTER_PI.high);
    let base_low = eighths.mul_add(T::QUARTER_PI.low, base.low);
    let leading = ordered_sum(base.high, angle);
    leading.high + (leading.low + (base_low + correction))
}
