//! Directed rounding of + − × ÷ √ without touching the processor's rounding mode.
//!
//! The rounding error of each of these is itself a number that can be computed exactly (Muller et
//! al., Handbook of Floating-Point Arithmetic, 2nd ed., sections 4.3 and 4.4), so an end moves
//! outward only when the result was inexact in that direction: ends are the tightest. Where a
//! result is so small that its error may not be representable, the error is computed of operands
//! scaled by powers of two. Zeros times infinity are 0: an infinite end stands for unbounded
//! finite numbers.

/// Below this, the error of a product or quotient may underflow: 2^-960.
const SMALL: f64 = f64::from_bits((1023 - 960) << 52);

/// a + b rounded down.
pub(super) fn add_down(a: f64, b: f64) -> f64 {
    let sum = a + b;
    if sum.is_infinite() {
        return if a.is_finite() && b.is_finite() {
            overflow_down(sum)
        } else {
            sum
        };
    }
    let (large, small) = if a.abs() < b.abs() { (b, a) } else { (a, b) };
    let error = small - (sum - large);
    if error < 0.0 { sum.next_down() } else { sum }
}

/// a + b rounded up.
pub(super) fn add_up(a: f64, b: f64) -> f64 {
    -add_down(-a, -b)
}

/// a·b rounded down.
pub(super) fn multiply_down(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 {
        return 0.0;
    }
    let product = a * b;
    if product.is_infinite() {
        return if a.is_finite() && b.is_finite() {
            overflow_down(product)
        } else {
            product
        };
    }
    let error = match product.abs() < SMALL {
        true => small_product_error(a, b, product),
        false => a.mul_add(b, -product),
    };
    if error < 0.0 {
        product.next_down()
    } else {
        product
    }
}

/// a·b rounded up.
pub(super) fn multiply_up(a: f64, b: f64) -> f64 {
    -multiply_down(-a, b)
}

/// a/b rounded down; b is not 0, and not both are infinite.
pub(super) fn divide_down(a: f64, b: f64) -> f64 {
    if a == 0.0 || b.is_infinite() {
        // A finite number over an unbounded one comes as close to 0 as one likes.
        return 0.0;
    }
    let quotient = a / b;
    if quotient.is_infinite() {
        return if a.is_finite() {
            overflow_down(quotient)
        } else {
            quotient
        };
    }
    let error = match quotient.abs() < SMALL || a.abs() < SMALL {
        true => small_quotient_error(a, b, quotient),
        false => (-quotient).mul_add(b, a),
    };
    let is_above = if b > 0.0 { error < 0.0 } else { error > 0.0 };
    if is_above {
        quotient.next_down()
    } else {
        quotient
    }
}

/// a/b rounded up; b is not 0, and not both are infinite.
pub(super) fn divide_up(a: f64, b: f64) -> f64 {
    -divide_down(-a, b)
}

/// √a rounded down; a is not negative.
pub(super) fn square_root_down(a: f64) -> f64 {
    let (root, error) = square_root(a);
    if error < 0.0 { root.next_down() } else { root }
}

/// √a rounded up; a is not negative.
pub(super) fn square_root_up(a: f64) -> f64 {
    let (root, error) = square_root(a);
    if error > 0.0 { root.next_up() } else { root }
}

/// √a rounded to nearest, and a number with the sign of a − (√a)².
fn square_root(a: f64) -> (f64, f64) {
    /// 2^120 and its root: moves the smallest numbers to where the error is representable.
    const SCALE: (f64, f64) = (
        f64::from_bits((1023 + 120) << 52),
        f64::from_bits((1023 + 60) << 52),
    );
    let root = a.sqrt();
    if a == 0.0 || a.is_infinite() {
        (root, 0.0)
    } else if a < SMALL {
        let scaled = root * SCALE.1;
        (root, (-scaled).mul_add(scaled, a * SCALE.0))
    } else {
        (root, (-root).mul_add(root, a))
    }
}

/// What a finite result that overflowed to this infinity is when rounded down.
fn overflow_down(infinity: f64) -> f64 {
    if infinity > 0.0 { f64::MAX } else { infinity }
}

/// A number with the sign of a·b − product, for a product so small that its error may not be
/// representable.
fn small_product_error(a: f64, b: f64, product: f64) -> f64 {
    let ((a, first), (b, second)) = (significand(a), significand(b));
    a.mul_add(b, -scaled(product, -(first + second)))
}

/// A number with the sign of a − quotient·b, likewise.
fn small_quotient_error(a: f64, b: f64, quotient: f64) -> f64 {
    let ((a, first), (b, second)) = (significand(a), significand(b));
    // With a = a'·2^m and b = b'·2^n the quotient is 2^(m−n) times that of a' and b'.
    (-scaled(quotient, second - first)).mul_add(b, a)
}

/// (s, e) with x = s·2^e and 1 ≤ |s| < 2, for a finite x that is not 0.
fn significand(x: f64) -> (f64, i32) {
    const FRACTION: u32 = f64::MANTISSA_DIGITS - 1;
    /// 2^64, which makes subnormal numbers normal.
    const LIFT: f64 = (1u128 << 64) as f64;
    let (x, lifted) = match x.is_subnormal() {
        true => (x * LIFT, 64),
        false => (x, 0),
    };
    let exponent = ((x.to_bits() >> FRACTION) & 0x7ff) as i32 - 1023;
    let fraction = x.to_bits() & !(0x7ff << FRACTION);
    let significand = f64::from_bits(fraction | 1f64.to_bits());
    (significand, exponent - lifted)
}

/// x·2^exponent for what neither overflows nor underflows, nor does half way.
fn scaled(x: f64, exponent: i32) -> f64 {
    let power = |exponent: i32| f64::from_bits(((1023 + exponent) as u64) << 52);
    let third = exponent / 3;
    x * power(third) * power(third) * power(exponent - 2 * third)
}
