//! The functions of one value, and how each is made of its formula and its exact fallback.

use super::entry::{Binary, Unary, binary, unary};
use super::{Elementary, exponential, hyperbolic, inverse, logarithm, power, trigonometric};

/// The functions of one number: name, type that stands for it, formula, and for formulas that are
/// not always good the test and the fallback.
macro_rules! unary_functions {
    ($($(#[$doc:meta])* $name:ident $marker:ident $family:ident $(, $is_fast:ident $exact:ident)?;)+) => {$(
        $(#[$doc])*
        #[inline(always)]
        pub fn $name<T: Elementary>(x: T) -> T {
            unary::<$marker, T>(x)
        }

        pub(super) struct $marker;

        impl<T: Elementary> Unary<T> for $marker {
            #[inline(always)]
            fn fast(x: T) -> T {
                $family::$name(x)
            }

            $(
                #[inline(always)]
                fn is_fast(x: T) -> bool {
                    $family::$is_fast(x)
                }

                fn exact(x: T) -> T {
                    T::$exact(x)
                }
            )?
        }
    )+};
}

/// The functions of two numbers, likewise.
macro_rules! binary_functions {
    ($($(#[$doc:meta])* $name:ident($a:ident, $b:ident) $marker:ident $family:ident, $is_fast:ident $exact:ident;)+) => {$(
        $(#[$doc])*
        #[inline(always)]
        pub fn $name<T: Elementary>($a: T, $b: T) -> T {
            binary::<$marker, T>($a, $b)
        }

        pub(super) struct $marker;

        impl<T: Elementary> Binary<T> for $marker {
            #[inline(always)]
            fn fast($a: T, $b: T) -> T {
                $family::$name($a, $b)
            }

            #[inline(always)]
            fn is_fast($a: T, $b: T) -> bool {
                $family::$is_fast($a, $b)
            }

            fn exact($a: T, $b: T) -> T {
                T::$exact($a, $b)
            }
        }
    )+};
}

unary_functions! {
    /// eˣ.
    exp Exp exponential;
    /// ln x; −∞ at ±0, NaN below.
    log Log logarithm;
    /// sin x, x in radians.
    sin Sin trigonometric, is_moderate exact_sin;
    /// cos x, x in radians.
    cos Cos trigonometric, is_moderate exact_cos;
    /// tan x, x in radians.
    tan Tan trigonometric, is_moderate exact_tan;
    /// asin x, from −π/2 to π/2; NaN where |x| > 1.
    asin Asin inverse;
    /// acos x, from 0 to π; NaN where |x| > 1.
    acos Acos inverse;
    /// atan x, from −π/2 to π/2.
    atan Atan inverse;
    /// sinh x.
    sinh Sinh hyperbolic, is_moderate exact_sinh;
    /// cosh x.
    cosh Cosh hyperbolic, is_moderate exact_cosh;
    /// tanh x.
    tanh Tanh hyperbolic;
}

binary_functions! {
    /// The angle of the point (x, y), from −π to π.
    atan2(y, x) Atan2 inverse, has_safe_quotient exact_atan2;
    /// xʸ; NaN if an operand is NaN, or if x is negative and y not an integer.
    pow(x, y) Pow power, is_ordinary_power exact_pow;
    /// √(a² + b²); NaN if an operand is NaN.
    hypot(a, b) Hypot power, has_safe_squares exact_hypot;
}
