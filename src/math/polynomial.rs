//! Polynomials with constant coefficients, in several orders of summation.
//!
//! Horner's rule is the shortest and the most accurate, but each of its operations waits for the
//! one before; of a long chain too few lanes fit into the processor's window at a time. Long
//! polynomials are therefore summed in parts that do not wait for each other, wherever that was
//! measured to be faster.

use super::float::Float;

/// c₀ + c₁x + c₂x² + … by Horner's rule: one fused multiply-add a coefficient.
#[inline(always)]
pub(super) fn horner<T: Float, const N: usize>(x: T, coefficients: [T; N]) -> T {
    every::<1, T, N>(x, 0, coefficients)
}

/// c₀ + c₁x + c₂x² + … as the sum of the even powers and that of the odd ones, each by Horner's
/// rule in x².
#[inline(always)]
pub(super) fn in_two_parts<T: Float, const N: usize>(x: T, coefficients: [T; N]) -> T {
    let square = x * x;
    let even = every::<2, T, N>(square, 0, coefficients);
    every::<2, T, N>(square, 1, coefficients).mul_add(x, even)
}

/// c₀ + c₁x + c₂x² + … in four such parts, by Horner's rule in x⁴, joined as G. Estrin does
/// ("Organization of computer systems: the fixed plus variable structure computer", 1960).
#[inline(always)]
pub(super) fn in_four_parts<T: Float, const N: usize>(x: T, coefficients: [T; N]) -> T {
    let square = x * x;
    let fourth = square * square;
    let part = |first| every::<4, T, N>(fourth, first, coefficients);
    let low = part(1).mul_add(x, part(0));
    let high = part(3).mul_add(x, part(2));
    high.mul_add(square, low)
}

/// Every S-th coefficient from the first on, as a polynomial by Horner's rule.
#[inline(always)]
fn every<const S: usize, T: Float, const N: usize>(x: T, first: usize, coefficients: [T; N]) -> T {
    let mut index = first + (N - 1 - first) / S * S;
    let mut sum = coefficients[index];
    while index > first {
        index -= S;
        sum = sum.mul_add(x, coefficients[index]);
    }
    sum
}
