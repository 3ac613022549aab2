//! Value rules that are longer than a formula.
//!
//! They fix what an operation means on numbers, to the last bit: constant folding, the reference
//! interpreter and host calls from machine code use these functions, and a lowering
//! (`lower`) must reproduce them exactly. NaN in any operand gives NaN, except where a
//! comparison, `select` or `chain_product` says otherwise.

use crate::math::scalar;

/// The largest magnitude of an exponent that is taken by repeated multiplication.
pub const LARGEST_INTEGER_POWER: f64 = 1024.0;

/// Whether this exponent is taken by repeated multiplication: an integer of magnitude at most
/// [`LARGEST_INTEGER_POWER`].
pub fn is_integer_power(exponent: f64) -> bool {
    exponent.abs() <= LARGEST_INTEGER_POWER && exponent.floor() == exponent
}

/// Whether a power of this exponent has a rule of its own: repeated multiplication or the square
/// root, both without elementary functions.
pub fn is_algebraic_power(exponent: f64) -> bool {
    is_integer_power(exponent) || exponent == 0.5
}

/// Whether a number is ± a power of two, subnormal ones aside: it has no fraction bits.
pub(in crate::graph) fn is_power_of_two(a: f64) -> bool {
    a.is_normal() && a.to_bits() & ((1 << (f64::MANTISSA_DIGITS - 1)) - 1) == 0
}

/// a^b. Integer exponents by repeated multiplication, ½ by the square root, every other one by
/// [`scalar::pow`].
pub(in crate::graph) fn power(base: f64, exponent: f64) -> f64 {
    if base.is_nan() || exponent.is_nan() {
        f64::NAN
    } else if is_integer_power(exponent) {
        integer_power(base, exponent)
    } else if exponent == 0.5 {
        base.sqrt()
    } else {
        scalar::pow(base, exponent)
    }
}

/// x^n for an integer n of which [`is_integer_power`] holds; x^-n is 1 / x^n.
pub(in crate::graph) fn integer_power(base: f64, exponent: f64) -> f64 {
    if base.is_nan() || exponent == 0.0 {
        return if base.is_nan() { f64::NAN } else { 1.0 };
    }
    let magnitude = by_squaring(base, exponent.abs() as u32, |a, b| a * b);
    if exponent < 0.0 {
        1.0 / magnitude
    } else {
        magnitude
    }
}

/// The one order in which a power of at least 1 is multiplied together: the squares x, x², x⁴, …
/// that the exponent's binary digits name, from the least significant one on. Values and lowered
/// graphs both follow it, so they agree to the last bit.
pub(in crate::graph) fn by_squaring<T: Copy>(
    base: T,
    exponent: u32,
    mut multiply: impl FnMut(T, T) -> T,
) -> T {
    let mut square = base;
    let mut product = None;
    let mut digits = exponent;
    loop {
        if digits & 1 == 1 {
            product = Some(product.map_or(square, |product| multiply(product, square)));
        }
        digits >>= 1;
        if digits == 0 {
            return product.unwrap_or(square);
        }
        square = multiply(square, square);
    }
}

/// −1, 0 or 1; a zero keeps its sign.
pub(super) fn sign(a: f64) -> f64 {
    if 0.0 < a {
        1.0
    } else if a < 0.0 {
        -1.0
    } else {
        a
    }
}

/// The nearest integer, halves away from zero. In both branches the difference is exact wherever
/// it decides.
pub(super) fn round(a: f64) -> f64 {
    let (floor, ceil) = (a.floor(), a.ceil());
    if a < 0.0 {
        if 0.5 <= ceil - a { floor } else { ceil }
    } else if 0.5 <= a - floor {
        ceil
    } else {
        floor
    }
}

/// The floored remainder a − b·⌊a/b⌋, each step rounded.
pub(super) fn modulo(a: f64, b: f64) -> f64 {
    a - b * (a / b).floor()
}

/// The smaller one; −0 is smaller than 0.
pub(super) fn min(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() {
        f64::NAN
    } else if a < b || (a == b && a.is_sign_negative()) {
        a
    } else {
        b
    }
}

/// The larger one; 0 is larger than −0.
pub(super) fn max(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() {
        f64::NAN
    } else if b < a || (a == b && b.is_sign_negative()) {
        a
    } else {
        b
    }
}

/// √(a² + b²). Unlike the C function it is NaN for an infinite and a NaN side.
pub(super) fn hypot(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() {
        f64::NAN
    } else {
        scalar::hypot(a, b)
    }
}

/// The angle of the point (b, a); 0 at the origin. Unlike the C function it
/// takes −0 for 0, so that it is one function of real numbers: a bound of its values on a box is
/// a bound whatever the signs of zeros.
pub(super) fn atan2(a: f64, b: f64) -> f64 {
    scalar::atan2(a + 0.0, b + 0.0)
}

/// 1 for true, 0 for false.
pub(super) fn truth(holds: bool) -> f64 {
    if holds { 1.0 } else { 0.0 }
}

/// a·b in the chain rule: an exactly zero factor absorbs infinity and NaN.
pub(super) fn chain_product(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 { 0.0 } else { a * b }
}
