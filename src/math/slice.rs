//! The functions of each lane of a slice, as many as all slices have.
//!
//! The loops become vector code for the target features of the function into which they are
//! inlined, and give the same bits as the functions of one value.

use super::Elementary;
use super::entry::{map, map_pairs};
use super::functions;

/// A function over slices for each function of one number.
macro_rules! unary_slices {
    ($($(#[$doc:meta])* $name:ident $marker:ident;)+) => {$(
        $(#[$doc])*
        #[inline(always)]
        pub fn $name<T: Elementary>(out: &mut [T], x: &[T]) {
            map::<functions::$marker, T>(out, x);
        }
    )+};
}

/// A function over slices for each function of two numbers.
macro_rules! binary_slices {
    ($($(#[$doc:meta])* $name:ident($a:ident, $b:ident) $marker:ident;)+) => {$(
        $(#[$doc])*
        #[inline(always)]
        pub fn $name<T: Elementary>(out: &mut [T], $a: &[T], $b: &[T]) {
            map_pairs::<functions::$marker, T>(out, $a, $b);
        }
    )+};
}

unary_slices! {
    /// [`exp`](super::exp) of each lane.
    exp Exp;
    /// [`log`](super::log) of each lane.
    log Log;
    /// [`sin`](super::sin) of each lane.
    sin Sin;
    /// [`cos`](super::cos) of each lane.
    cos Cos;
    /// [`tan`](super::tan) of each lane.
    tan Tan;
    /// [`asin`](super::asin) of each lane.
    asin Asin;
    /// [`acos`](super::acos) of each lane.
    acos Acos;
    /// [`atan`](super::atan) of each lane.
    atan Atan;
    /// [`sinh`](super::sinh) of each lane.
    sinh Sinh;
    /// [`cosh`](super::cosh) of each lane.
    cosh Cosh;
    /// [`tanh`](super::tanh) of each lane.
    tanh Tanh;
}

binary_slices! {
    /// [`atan2`](super::atan2) of each pair.
    atan2(y, x) Atan2;
    /// [`pow`](super::pow) of each pair.
    pow(x, y) Pow;
    /// [`hypot`](super::hypot) of each pair.
    hypot(a, b) Hypot;
}
