//! Sums and products with their rounding errors, and numbers as unevaluated sums of two.
//!
//! Source of the formulas: T. J. Dekker, "A floating-point technique for extending the available
//! precision", Numerische Mathematik 18 (1971); D. E. Knuth, TAOCP 2, section 4.2.2; T. Ogita,
//! S. M. Rump, S. Oishi, "Accurate sum and dot product", SIAM J. Sci. Comput. 26 (2005).

use std::ops::Neg;

use super::float::Float;

/// high + low, where low is small against high.
#[derive(Clone, Copy)]
pub struct Double<T> {
    /// The leading part.
    pub high: T,
    /// The correction.
    pub low: T,
}

/// a + b with its rounding error, if |b| ≤ |a| or a = 0 (Dekker's Fast2Sum).
#[inline(always)]
pub(super) fn ordered_sum<T: Float>(a: T, b: T) -> Double<T> {
    let high = a + b;
    Double {
        high,
        low: (a - high) + b,
    }
}

/// a + b with its rounding error (Knuth's TwoSum).
#[inline(always)]
pub(super) fn sum<T: Float>(a: T, b: T) -> Double<T> {
    let high = a + b;
    let b_part = high - a;
    Double {
        high,
        low: (a - (high - b_part)) + (b - b_part),
    }
}

/// a · b with its rounding error.
#[inline(always)]
pub(super) fn product<T: Float>(a: T, b: T) -> Double<T> {
    let high = a * b;
    Double {
        high,
        low: a.mul_add(b, -high),
    }
}

/// a/b, rounded after a correction: to within 0.51 ulp or so, if high is high + low rounded.
#[inline(always)]
pub(super) fn quotient<T: Float>(a: Double<T>, b: Double<T>) -> T {
    let reciprocal = T::ONE / b.high;
    let quotient = a.high * reciprocal;
    let remainder = (-quotient).mul_add(b.high, a.high) + (-quotient).mul_add(b.low, a.low);
    remainder.mul_add(reciprocal, quotient)
}

/// The first if the condition holds, else the second, part by part so that it becomes blends.
#[inline(always)]
pub(super) fn choose<T: Float>(condition: bool, a: Double<T>, b: Double<T>) -> Double<T> {
    Double {
        high: if condition { a.high } else { b.high },
        low: if condition { a.low } else { b.low },
    }
}

impl<T: Float> Neg for Double<T> {
    type Output = Double<T>;

    #[inline(always)]
    fn neg(self) -> Double<T> {
        Double {
            high: -self.high,
            low: -self.low,
        }
    }
}
