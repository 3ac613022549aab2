//! Polynomials with constant coefficients.

use super::float::Float;

/// c₀ + c₁x + c₂x² + … by Horner's rule: one fused multiply-add a coefficient.
#[inline(always)]
pub(super) fn horner<T: Float, const N: usize>(x: T, coefficients: [T; N]) -> T {
    strided::<T, N, 1>(x, 0, coefficients)
}

/// c₀ + c₁x + c₂x² + … as the sum of even powers and that of odd ones (each by Horner's rule), so
/// that the chain of dependent operations is half as long.
#[inline(always)]
pub(super) fn in_two_parts<T: Float, const N: usize>(x: T, coefficients: [T; N]) -> T {
    let square = x * x;
    let even = strided::<T, N, 2>(square, 0, coefficients);
    strided::<T, N, 2>(square, 1, coefficients).mul_add(x, even)
}

/// c₀ + c₁x + c₂x² + … in four such parts (G. Estrin, "Organization of computer systems", 1960,
/// with Horner's rule in x⁴): for long polynomials.
#[inline(always)]
pub(super) fn in_four_parts<T: Float, const N: usize>(x: T, coefficients: [T; N]) -> T {
    let square = x * x;
    let fourth = square * square;
    let parts: [T; 4] =
        std::array::from_fn(|index| strided::<T, N, 4>(fourth, index, coefficients));
    let low = parts[1].mul_add(x, parts[0]);
    let high = parts[3].mul_add(x, parts[2]);
    high.mul_add(square, low)
}

/// The sum of every S-th coefficient from the first on, times the powers of the variable.
#[inline(always)]
fn strided<T: Float, const N: usize, const S: usize>(x: T, first: usize, c: [T; N]) -> T {
    let mut index = first + (N - 1 - first) / S * S;
    let mut sum = c[index];
    while index > first {
        index -= S;
        sum = sum.mul_add(x, c[index]);
    }
    sum
}
