//! Outward rounding without the processor's rounding modes: the same bits on every machine.
//!
//! A correctly rounded result is within half a unit in the last place of the true one, so its
//! neighbour is a bound. With u = 2^-53 and STEP = 5/4·u the fused multiply-add x ∓ STEP·|x|, in
//! which nothing but the result is rounded, is that neighbour: STEP·|x| is between 5/8 and 5/4 of
//! a unit in the last place (of the finer units below, if x is a power of two), so the nearest
//! number is exactly one away. It costs two instructions, and leaves zeros and infinities in
//! their place. (S. M. Rump, P. Zimmermann, S. Boldo, G. Melquiond, "Computing predecessor and
//! successor in rounding to nearest", BIT 49 (2009), do the same without fused operations.)
//! Subnormal numbers may stay, because the sums that gave them are exact; what else can be
//! subnormal and inexact moves by [`SMALLEST`] besides, which changes nothing large.

/// The relative step: a little more than half a unit in the last place.
const STEP: f64 = 1.25 * UNIT;

/// 2^-53, the largest relative rounding error.
const UNIT: f64 = f64::EPSILON / 2.0;

/// The smallest positive number.
const SMALLEST: f64 = f64::from_bits(1);

/// The smaller number; the second one where either is NaN or they are equal.
#[inline(always)]
pub(super) fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The larger number, likewise.
#[inline(always)]
pub(super) fn greatest(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// A lower bound of a sum from its rounded value. A sum of finite numbers that overflowed is at
/// least the largest one.
#[inline(always)]
pub(super) fn sum_below(sum: f64) -> f64 {
    let sum = least(f64::MAX, sum);
    (-sum.abs()).mul_add(STEP, sum)
}

/// An upper bound of a sum.
#[inline(always)]
pub(super) fn sum_above(sum: f64) -> f64 {
    let sum = greatest(f64::MIN, sum);
    sum.abs().mul_add(STEP, sum)
}

/// A lower bound of a product, which may have underflowed.
#[inline(always)]
pub(super) fn product_below(product: f64) -> f64 {
    sum_below(product) - SMALLEST
}

/// An upper bound of a product.
#[inline(always)]
pub(super) fn product_above(product: f64) -> f64 {
    sum_above(product) + SMALLEST
}

/// A lower bound of a quotient. If it was rounded to 0 (and not to −0) it is not negative.
#[inline(always)]
pub(super) fn quotient_below(quotient: f64) -> f64 {
    let step = if quotient.to_bits() == 0 {
        0.0
    } else {
        SMALLEST
    };
    sum_below(quotient) - step
}

/// A lower bound of a square root.
#[inline(always)]
pub(super) fn root_below(root: f64) -> f64 {
    (-root).mul_add(STEP, root)
}

/// An upper bound of a square root.
#[inline(always)]
pub(super) fn root_above(root: f64) -> f64 {
    root.mul_add(STEP, root)
}

/// A lower bound, not negative, of the square of a magnitude.
#[inline(always)]
pub(super) fn square_below(magnitude: f64) -> f64 {
    let square = least(f64::MAX, magnitude * magnitude);
    greatest((-square).mul_add(STEP, square) - SMALLEST, 0.0)
}

/// An upper bound of the square of a magnitude; that of 0 is exact.
#[inline(always)]
pub(super) fn square_above(magnitude: f64) -> f64 {
    let square = magnitude * magnitude;
    let moved = square.mul_add(STEP, square) + SMALLEST;
    if magnitude == 0.0 { 0.0 } else { moved }
}

/// The step for the square of a rounded sum: together they err by (1 ± u)³, and the step itself
/// is rounded once, so that 4 u and a little would be just enough.
const TRIPLE_STEP: f64 = 4.5 * UNIT;

/// A lower bound, not negative, of the square of a sum whose rounded magnitude this is.
#[inline(always)]
pub(super) fn sum_square_below(magnitude: f64) -> f64 {
    let square = least(f64::MAX, magnitude * magnitude);
    greatest((-square).mul_add(TRIPLE_STEP, square) - SMALLEST, 0.0)
}

/// An upper bound of the square of a sum whose rounded magnitude this is; sums that are 0 are
/// exact.
#[inline(always)]
pub(super) fn sum_square_above(magnitude: f64) -> f64 {
    let square = magnitude * magnitude;
    let moved = square.mul_add(TRIPLE_STEP, square) + SMALLEST;
    if magnitude == 0.0 { 0.0 } else { moved }
}

/// A lower bound of a function that errs by less than a unit in the last place: two steps down,
/// none if the value is known to be exact.
#[inline(always)]
pub(super) fn function_below(value: f64, is_exact: bool) -> f64 {
    let once = sum_below(value);
    let twice = (-once.abs()).mul_add(STEP, once) - 2.0 * SMALLEST;
    if is_exact { value } else { twice }
}

/// An upper bound of such a function.
#[inline(always)]
pub(super) fn function_above(value: f64, is_exact: bool) -> f64 {
    -function_below(-value, is_exact)
}

/// A bound of a product of magnitudes: from above where `upward` is 1, from below, and not
/// negative, where it is −1.
#[inline(always)]
pub(super) fn magnitude_product(a: f64, b: f64, upward: f64) -> f64 {
    let product = a * b;
    let product = if upward < 0.0 {
        least(f64::MAX, product)
    } else {
        product
    };
    let moved = product.mul_add(upward * STEP, upward.mul_add(SMALLEST, product));
    greatest(moved, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of every size, powers of two and their neighbours among them.
    fn numbers() -> impl Iterator<Item = f64> {
        let powers = (1u64..2046).map(|exponent| f64::from_bits(exponent << 52));
        powers.flat_map(|power| {
            [
                power,
                power.next_up(),
                power.next_up().next_up(),
                power * 1.25,
                power * 1.5,
                power * (2.0 - f64::EPSILON),
            ]
        })
    }

    #[test]
    fn a_sum_moves_to_its_neighbour() {
        for x in numbers() {
            assert_eq!(sum_below(x), x.next_down(), "{x:e}");
            assert_eq!(sum_above(-x), -x.next_down(), "{x:e}");
            assert_eq!(sum_above(x), x.next_up(), "{x:e}");
            assert_eq!(sum_below(-x), -x.next_up(), "{x:e}");
            assert_eq!(root_below(x), x.next_down(), "{x:e}");
            assert_eq!(root_above(x), x.next_up(), "{x:e}");
        }
        assert_eq!(sum_below(f64::INFINITY), f64::MAX.next_down());
        assert_eq!(sum_above(f64::INFINITY), f64::INFINITY);
        assert_eq!(sum_below(f64::NEG_INFINITY), f64::NEG_INFINITY);
        assert_eq!(sum_above(f64::MAX), f64::INFINITY);
        assert_eq!((sum_below(0.0), sum_above(0.0)), (0.0, 0.0));
    }

    #[test]
    fn products_move_by_the_smallest_number_where_they_may_have_underflowed() {
        assert_eq!(product_below(0.0), -SMALLEST);
        assert_eq!(product_above(-0.0), SMALLEST);
        assert_eq!(quotient_below(0.0), 0.0);
        assert_eq!(quotient_below(-0.0), -SMALLEST);
        for x in numbers().filter(|x| *x > 1e-307) {
            assert_eq!(product_below(x), x.next_down(), "{x:e}");
            assert_eq!(product_above(x), x.next_up(), "{x:e}");
        }
        assert_eq!(square_below(1e-170), 0.0);
        assert_eq!(square_above(1e-170), SMALLEST);
        assert_eq!(square_above(0.0), 0.0);
        assert_eq!(magnitude_product(1e-200, 1e-200, 1.0), SMALLEST);
        assert_eq!(magnitude_product(1e-200, 1e-200, -1.0), 0.0);
    }

    #[test]
    fn functions_move_by_two_steps_unless_they_are_exact() {
        for x in numbers().filter(|x| (1e-300..1e300).contains(x)) {
            assert_eq!(function_below(x, false), x.next_down().next_down());
            assert_eq!(function_above(x, false), x.next_up().next_up());
        }
        assert_eq!(function_below(1.0, true), 1.0);
        assert!(function_below(0.0, false) < 0.0);
    }
}
