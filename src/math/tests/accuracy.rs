//! The errors, in units in the last place of the true value.

use super::arguments::{self, Random};
use super::functions::{BINARY, Binary, UNARY, Unary};
use super::reference::Wide;

/// Below this the low parts of the reference would underflow.
const REFERENCE_FROM: f64 = 1e-280;

/// A unit in the last place of a number of this precision and least exponent.
fn unit(x: f64, precision: i32, least: i32) -> f64 {
    let exponent = ((x.abs().to_bits() >> 52) as i32 - 1022 - precision).max(least);
    // In two factors, the product of which may be subnormal.
    2f64.powi(exponent / 2) * 2f64.powi(exponent - exponent / 2)
}

/// The error of an f64 in ulp; at most 1/2 if it is the nearest one, and infinite if one of both
/// is a NaN, an infinity or of the other sign and the other is not.
fn double_error(value: f64, nearest: f64, reference: impl FnOnce() -> Wide) -> f64 {
    if value.to_bits() == nearest.to_bits() || (value.is_nan() && nearest.is_nan()) {
        return 0.5;
    }
    let comparable = value.is_finite() && nearest.is_finite();
    if !comparable || value.is_sign_negative() != nearest.is_sign_negative() {
        return f64::INFINITY;
    }
    let ulp = unit(nearest, 53, -1074);
    if nearest.abs() < REFERENCE_FROM {
        // Neighbours of the nearest pass, whatever the bound.
        let steps = (value - nearest).abs() / ulp;
        return if steps <= 1.0 { 0.5 } else { steps };
    }
    let reference = reference();
    ((value - reference.high) - reference.low).abs() / ulp
}

/// The error of an f32 in ulp, where the truth is good to an f64.
fn single_error(value: f32, truth: f64) -> f64 {
    let nearest = truth as f32;
    if value.to_bits() == nearest.to_bits() || (value.is_nan() && nearest.is_nan()) {
        return 0.5;
    }
    if !value.is_finite() || !nearest.is_finite() {
        return f64::INFINITY;
    }
    if value.is_sign_negative() != nearest.is_sign_negative() {
        return f64::INFINITY;
    }
    (f64::from(value) - truth).abs() / unit(truth, 24, -149)
}

/// The worst of many errors must be within the bound; and not all of them perfect, or nothing
/// was measured.
fn assert_within(name: &str, errors: impl Iterator<Item = (f64, (f64, f64))>, bound: f64) {
    let mut worst = (0.0, (f64::NAN, f64::NAN));
    for (error, arguments) in errors {
        assert!(
            error <= bound,
            "{name}{arguments:?}: error {error} ulp, bound {bound}"
        );
        if worst.0 < error {
            worst = (error, arguments);
        }
    }
    assert!(worst.0 >= 0.5, "{name}: nothing measured");
}

fn check_unary(function: &Unary, count: usize) {
    let mut random = Random(1);
    let errors = (0..count).map(|index| {
        let x = arguments::one(function, index, &mut random, false);
        let nearest = (function.nearest)(x);
        let error = double_error((function.double)(x), nearest, || (function.reference)(x));
        (error, (x, 0.0))
    });
    assert_within(function.name, errors, function.bounds.0);

    let mut random = Random(2);
    let errors = (0..count).map(|index| {
        let x = arguments::one(function, index, &mut random, true) as f32;
        let truth = (function.nearest)(f64::from(x));
        let error = single_error((function.single)(x), truth);
        (error, (f64::from(x), 0.0))
    });
    assert_within(function.name, errors, function.bounds.1);
}

fn check_binary(
    function: &Binary,
    arguments: impl Fn(usize, &mut Random, bool) -> (f64, f64),
    count: usize,
) {
    let mut random = Random(3);
    let errors = (0..count).map(|index| {
        let (a, b) = arguments(index, &mut random, false);
        let nearest = (function.nearest)(a, b);
        let reference = || (function.reference)(a, b);
        let error = double_error((function.double)(a, b), nearest, reference);
        (error, (a, b))
    });
    assert_within(function.name, errors, function.bounds.0);

    let mut random = Random(4);
    let errors = (0..count).map(|index| {
        let (a, b) = arguments(index, &mut random, true);
        let (a, b) = (a as f32, b as f32);
        let truth = (function.nearest)(f64::from(a), f64::from(b));
        let error = single_error((function.single)(a, b), truth);
        (error, (f64::from(a), f64::from(b)))
    });
    assert_within(function.name, errors, function.bounds.1);
}

/// One test for each function, so that they run in parallel.
macro_rules! unary_tests {
    ($($test:ident $name:literal;)+) => {$(
        #[test]
        fn $test() {
            let found = UNARY.iter().find(|function| function.name == $name);
            check_unary(found.expect("is in the table"), 200_000);
        }
    )+};
}

unary_tests! {
    exp_is_accurate "exp";
    log_is_accurate "log";
    sin_is_accurate "sin";
    cos_is_accurate "cos";
    tan_is_accurate "tan";
    asin_is_accurate "asin";
    acos_is_accurate "acos";
    atan_is_accurate "atan";
    sinh_is_accurate "sinh";
    cosh_is_accurate "cosh";
    tanh_is_accurate "tanh";
}

#[test]
fn every_function_of_one_number_has_an_accuracy_test() {
    assert_eq!(UNARY.len(), 11);
}

#[test]
fn atan2_is_accurate() {
    check_binary(&BINARY[0], arguments::point, 200_000);
}

#[test]
fn pow_is_accurate() {
    check_binary(&BINARY[1], arguments::power, 200_000);
}

#[test]
fn hypot_is_accurate() {
    check_binary(&BINARY[2], arguments::point, 200_000);
}

/// The reference itself, against values from tables (Abramowitz and Stegun, 1964, tables 1.1
/// and 4.1) to 25 digits or so, as exact sums of two numbers.
#[test]
fn the_reference_is_right_beyond_double_precision() {
    let e = super::reference::exp(1.0);
    assert_eq!(
        (e.high, e.low),
        (std::f64::consts::E, 1.4456468917292502e-16)
    );
    let ln10 = super::reference::log(10.0);
    assert_eq!(ln10.high, std::f64::consts::LN_10);
    assert!((ln10.low - -2.1707562233822494e-16).abs() < 1e-30);
    let pi = super::reference::acos(-1.0);
    assert_eq!(pi.high, std::f64::consts::PI);
    assert!((pi.low - 1.2246467991473532e-16).abs() < 1e-30);
}
