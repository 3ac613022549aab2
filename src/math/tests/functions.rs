//! What is tested: each function in both types, with its truths, arguments and error bounds.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, FRAC_PI_4, LN_2, PI, SQRT_2};

use super::super as math;
use super::reference::{self, Wide};

/// A function of one number.
pub(super) struct Unary {
    pub(super) name: &'static str,
    pub(super) double: fn(f64) -> f64,
    pub(super) single: fn(f32) -> f32,
    pub(super) double_slice: fn(&mut [f64], &[f64]),
    pub(super) single_slice: fn(&mut [f32], &[f32]),
    /// The correctly rounded value.
    pub(super) nearest: fn(f64) -> f64,
    pub(super) reference: fn(f64) -> Wide,
    /// The usual arguments.
    pub(super) usual: (f64, f64),
    /// All arguments that do not simply overflow or saturate.
    pub(super) wide: (f64, f64),
    /// Numbers near which something changes.
    pub(super) centres: &'static [f64],
    /// Bounds of the error in ulp, for f64 and f32.
    pub(super) bounds: (f64, f64),
}

/// A function of two numbers.
pub(super) struct Binary {
    pub(super) name: &'static str,
    pub(super) double: fn(f64, f64) -> f64,
    pub(super) single: fn(f32, f32) -> f32,
    pub(super) double_slice: fn(&mut [f64], &[f64], &[f64]),
    pub(super) single_slice: fn(&mut [f32], &[f32], &[f32]),
    /// The correctly rounded value.
    pub(super) nearest: fn(f64, f64) -> f64,
    pub(super) reference: fn(f64, f64) -> Wide,
    /// Bounds of the error in ulp, for f64 and f32.
    pub(super) bounds: (f64, f64),
}

macro_rules! unary {
    ($name:ident, $usual:expr, $wide:expr, $centres:expr, $bounds:expr) => {
        Unary {
            name: stringify!($name),
            double: math::$name,
            single: math::$name,
            double_slice: math::slice::$name,
            single_slice: math::slice::$name,
            nearest: core_math::$name,
            reference: reference::$name,
            usual: $usual,
            wide: $wide,
            centres: $centres,
            bounds: $bounds,
        }
    };
}

macro_rules! binary {
    ($name:ident, $bounds:expr) => {
        Binary {
            name: stringify!($name),
            double: math::$name,
            single: math::$name,
            double_slice: math::slice::$name,
            single_slice: math::slice::$name,
            nearest: core_math::$name,
            reference: reference::$name,
            bounds: $bounds,
        }
    };
}

const LN2_HALVES: &[f64] = &[LN_2 * 0.5, -LN_2 * 0.5, LN_2, LN_2 * 25.5, LN_2 * -77.5];
const QUARTER_TURNS: &[f64] = &[
    FRAC_PI_4,
    FRAC_PI_2,
    PI,
    3.0 * FRAC_PI_2,
    21.5 * FRAC_PI_2,
    32.0 * PI,
    12_345.0 * FRAC_PI_2,
    1_048_576.0,
    2.0e6,
    1e22,
];
const ROOTS: &[f64] = &[1.0, SQRT_2, FRAC_1_SQRT_2, 2.0, 1e-3];

pub(super) const UNARY: &[Unary] = &[
    unary!(exp, (-20.0, 5.0), (-746.0, 710.0), LN2_HALVES, (0.77, 0.92)),
    unary!(log, (1e-6, 50.0), (0.0, 1e6), ROOTS, (0.68, 0.68)),
    unary!(
        sin,
        (-30.0, 30.0),
        (-1.7e6, 1.7e6),
        QUARTER_TURNS,
        (0.75, 0.75)
    ),
    unary!(
        cos,
        (-30.0, 30.0),
        (-1.7e6, 1.7e6),
        QUARTER_TURNS,
        (0.75, 0.75)
    ),
    unary!(
        tan,
        (-30.0, 30.0),
        (-1.7e6, 1.7e6),
        QUARTER_TURNS,
        (0.88, 0.88)
    ),
    unary!(
        asin,
        (-1.0, 1.0),
        (-1.0, 1.0),
        &[0.5, 1.0, -1.0],
        (0.68, 0.68)
    ),
    unary!(
        acos,
        (-1.0, 1.0),
        (-1.0, 1.0),
        &[0.5, 1.0, -1.0, -0.5],
        (0.65, 0.67)
    ),
    unary!(
        atan,
        (-5.0, 5.0),
        (-1e3, 1e3),
        &[0.5, 1.0, 2.0, -1.0],
        (0.75, 0.75)
    ),
    unary!(sinh, (-6.0, 6.0), (-711.0, 711.0), LN2_HALVES, (0.86, 0.8)),
    unary!(cosh, (-6.0, 6.0), (-711.0, 711.0), LN2_HALVES, (0.75, 0.77)),
    unary!(tanh, (-6.0, 6.0), (-25.0, 25.0), LN2_HALVES, (0.72, 0.74)),
];

pub(super) const BINARY: &[Binary] = &[
    binary!(atan2, (0.76, 0.76)),
    binary!(pow, (0.78, 0.78)),
    binary!(hypot, (0.51, 0.51)),
];
