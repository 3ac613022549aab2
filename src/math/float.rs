//! What the formulas need of a floating-point type: IEEE operations and a few tricks with bits.
//!
//! Everything here is branch-free and made of operations that exist for vectors on every
//! processor (there is no conversion between floating-point numbers and 64-bit integers below
//! AVX-512), so that a loop over lanes is compiled to vector code, and every operation is exact
//! or correctly rounded by IEEE 754, so that vector code of any width gives the same bits.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A binary floating-point type, f32 or f64, of precision p (24 or 53 bits).
pub trait Float:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// 0.
    const ZERO: Self;
    /// 1/2.
    const HALF: Self;
    /// 1.
    const ONE: Self;
    /// 2.
    const TWO: Self;
    /// Infinity.
    const INFINITY: Self;
    /// A quiet NaN.
    const NAN: Self;
    /// The smallest normal number.
    const SMALLEST_NORMAL: Self;
    /// 1.5 · 2^(p−1): a sum of it and a number below 2^(p−2) is rounded to an integer, which then
    /// stands in the low bits of the sum in two's complement.
    const ROUNDER: Self;
    /// [`Float::ROUNDER`] plus the exponent bias.
    const BIASED_ROUNDER: Self;
    /// [`Float::ROUNDER`] plus twice the exponent bias.
    const TWICE_BIASED_ROUNDER: Self;

    /// self · factor + addend, rounded once.
    fn mul_add(self, factor: Self, addend: Self) -> Self;
    /// The magnitude.
    fn abs(self) -> Self;
    /// The square root, correctly rounded.
    fn sqrt(self) -> Self;
    /// The value with its sign flipped where the other's sign bit is set.
    fn flip_sign_by(self, other: Self) -> Self;
    /// Whether the sign bit is set.
    fn has_sign_bit(self) -> bool;
    /// Whether the integer in a sum with [`Float::ROUNDER`] is odd.
    fn is_odd_sum(self) -> bool;
    /// A number with its sign bit set where the integer in a sum with [`Float::ROUNDER`] is 2 or
    /// 3 modulo 4.
    fn sign_of_half_turns(self) -> Self;
    /// 2ⁿ, where self is [`Float::BIASED_ROUNDER`] + n and 2ⁿ is a normal number.
    fn power_of_two(self) -> Self;
    /// 2^(n − m), where self is n more than [`Float::TWICE_BIASED_ROUNDER`] and `other` m more than
    /// [`Float::BIASED_ROUNDER`].
    fn power_of_two_without(self, other: Self) -> Self;
    /// (e, m) with self = 2ᵉ·m and √½ ≤ m < √2, for a normal positive number.
    fn exponent_and_significand(self) -> (Self, Self);
    /// 1/self to 0.3 % for a positive number far from overflow and underflow; something finite
    /// for 0. It serves to turn a remainder into a correction of some ulp.
    fn rough_reciprocal(self) -> Self;
}

/// Both types differ only in their widths and constants: the type, its bits, 1.5 · 2^(p−1), the
/// exponent bias, and the number from which bits are subtracted for a reciprocal, found by search:
/// with it the Newton step leaves the least maximum error.
macro_rules! float {
    ($float:ident, $bits:ident, $rounder:expr, $bias:expr, $reciprocal:expr) => {
        impl Float for $float {
            const ZERO: Self = 0.0;
            const HALF: Self = 0.5;
            const ONE: Self = 1.0;
            const TWO: Self = 2.0;
            const INFINITY: Self = $float::INFINITY;
            const NAN: Self = $float::NAN;
            const SMALLEST_NORMAL: Self = $float::MIN_POSITIVE;
            const ROUNDER: Self = $rounder;
            const BIASED_ROUNDER: Self = $rounder + $bias;
            const TWICE_BIASED_ROUNDER: Self = $rounder + 2.0 * $bias;

            #[inline(always)]
            fn mul_add(self, factor: Self, addend: Self) -> Self {
                $float::mul_add(self, factor, addend)
            }

            #[inline(always)]
            fn abs(self) -> Self {
                $float::abs(self)
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                $float::sqrt(self)
            }

            #[inline(always)]
            fn flip_sign_by(self, other: Self) -> Self {
                let sign = other.to_bits() & (1 << ($bits::BITS - 1));
                Self::from_bits(self.to_bits() ^ sign)
            }

            #[inline(always)]
            fn has_sign_bit(self) -> bool {
                self.is_sign_negative()
            }

            #[inline(always)]
            fn is_odd_sum(self) -> bool {
                self.to_bits() & 1 != 0
            }

            #[inline(always)]
            fn sign_of_half_turns(self) -> Self {
                Self::from_bits(self.to_bits() << ($bits::BITS - 2))
            }

            #[inline(always)]
            fn power_of_two(self) -> Self {
                Self::from_bits(self.to_bits() << ($float::MANTISSA_DIGITS - 1))
            }

            #[inline(always)]
            fn power_of_two_without(self, other: Self) -> Self {
                let difference = self.to_bits().wrapping_sub(other.to_bits());
                Self::from_bits(difference << ($float::MANTISSA_DIGITS - 1))
            }

            /// The bits are moved so that the exponent field changes at √½ instead of 1. The
            /// exponent becomes a number without a conversion: as the last bits of 2^(p−1).
            #[inline(always)]
            fn exponent_and_significand(self) -> (Self, Self) {
                const FRACTION: u32 = $float::MANTISSA_DIGITS - 1;
                const ROOT_HALF: $bits = std::$float::consts::FRAC_1_SQRT_2.to_bits();
                const TWO_TO_FRACTION: $float = ((1 as $bits) << FRACTION) as $float;
                let one = (1.0 as $float).to_bits();
                let moved = self.to_bits().wrapping_add(one - ROOT_HALF);
                let exponent = Self::from_bits((moved >> FRACTION) | TWO_TO_FRACTION.to_bits());
                let fraction = (moved & ((1 << FRACTION) - 1)).wrapping_add(ROOT_HALF);
                (
                    exponent - (TWO_TO_FRACTION + $bias),
                    Self::from_bits(fraction),
                )
            }

            /// Subtracting the bits from a constant negates the exponent and approximates the
            /// reciprocal of the significand by straight lines; a Newton step follows.
            #[inline(always)]
            fn rough_reciprocal(self) -> Self {
                let y = Self::from_bits(($reciprocal as $bits).wrapping_sub(self.to_bits()));
                y * self.mul_add(-y, 2.0)
            }
        }
    };
}

float!(
    f64,
    u64,
    6_755_399_441_055_744.0,
    1023.0,
    0x7FDE_6200_0000_0000_u64
);
float!(f32, u32, 12_582_912.0, 127.0, 0x7EF3_1000_u32);
