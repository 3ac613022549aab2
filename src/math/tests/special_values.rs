//! Zeros, infinities, NaN, subnormal numbers and the ends of domains, in both types.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use super::super as math;
use super::functions::{BINARY, UNARY};

const INFINITY: f64 = f64::INFINITY;
const NAN: f64 = f64::NAN;

/// The same number with the same sign, or both NaN.
fn assert_same(name: &str, arguments: &[f64], value: f64, expected: f64) {
    let same = value.to_bits() == expected.to_bits() || (value.is_nan() && expected.is_nan());
    assert!(same, "{name}{arguments:?} is {value}, not {expected}");
}

/// (function, argument, value); the value in f32 is the one in f64 rounded.
#[rustfmt::skip]
const OF_ONE: &[(&str, f64, f64)] = &[
    ("exp", 0.0, 1.0), ("exp", -0.0, 1.0), ("exp", INFINITY, INFINITY), ("exp", -INFINITY, 0.0),
    ("exp", 5e-324, 1.0), ("exp", 1e300, INFINITY), ("exp", -1e300, 0.0), ("exp", 1000.0, INFINITY),
    ("log", 1.0, 0.0), ("log", 0.0, -INFINITY), ("log", -0.0, -INFINITY), ("log", -1.0, NAN),
    ("log", INFINITY, INFINITY), ("log", -INFINITY, NAN),
    ("sin", 0.0, 0.0), ("sin", -0.0, -0.0), ("sin", INFINITY, NAN), ("sin", -INFINITY, NAN),
    ("cos", 0.0, 1.0), ("cos", -0.0, 1.0), ("cos", INFINITY, NAN), ("cos", -INFINITY, NAN),
    ("tan", 0.0, 0.0), ("tan", -0.0, -0.0), ("tan", INFINITY, NAN), ("tan", -INFINITY, NAN),
    ("asin", 0.0, 0.0), ("asin", -0.0, -0.0), ("asin", 1.0, FRAC_PI_2), ("asin", -1.0, -FRAC_PI_2),
    ("asin", 1.5, NAN), ("asin", -INFINITY, NAN), ("asin", INFINITY, NAN),
    ("acos", 1.0, 0.0), ("acos", -1.0, PI), ("acos", 0.0, FRAC_PI_2), ("acos", -0.0, FRAC_PI_2),
    ("acos", -1.5, NAN), ("acos", INFINITY, NAN), ("acos", -INFINITY, NAN),
    ("atan", 0.0, 0.0), ("atan", -0.0, -0.0), ("atan", 1.0, FRAC_PI_4), ("atan", -1.0, -FRAC_PI_4),
    ("atan", INFINITY, FRAC_PI_2), ("atan", -INFINITY, -FRAC_PI_2), ("atan", 1e300, FRAC_PI_2),
    ("sinh", 0.0, 0.0), ("sinh", -0.0, -0.0), ("sinh", INFINITY, INFINITY),
    ("sinh", -INFINITY, -INFINITY), ("sinh", 1e3, INFINITY), ("sinh", -1e3, -INFINITY),
    ("cosh", 0.0, 1.0), ("cosh", -0.0, 1.0), ("cosh", INFINITY, INFINITY),
    ("cosh", -INFINITY, INFINITY), ("cosh", -1e3, INFINITY),
    ("tanh", 0.0, 0.0), ("tanh", -0.0, -0.0), ("tanh", INFINITY, 1.0), ("tanh", -INFINITY, -1.0),
    ("tanh", 30.0, 1.0), ("tanh", -1e300, -1.0),
];

/// (function, arguments, value); C99 annex F, but NaN in any operand gives NaN.
#[rustfmt::skip]
const OF_TWO: &[(&str, f64, f64, f64)] = &[
    ("pow", 0.0, 0.0, 1.0), ("pow", NAN, 0.0, NAN), ("pow", 1.0, NAN, NAN), ("pow", 2.0, NAN, NAN),
    ("pow", INFINITY, 0.0, 1.0), ("pow", -3.0, -0.0, 1.0), ("pow", 1.0, INFINITY, 1.0),
    ("pow", -1.0, INFINITY, 1.0), ("pow", -1.0, -INFINITY, 1.0), ("pow", 2.0, INFINITY, INFINITY),
    ("pow", 2.0, -INFINITY, 0.0), ("pow", 0.5, INFINITY, 0.0), ("pow", 0.5, -INFINITY, INFINITY),
    ("pow", 0.0, 3.0, 0.0), ("pow", -0.0, 3.0, -0.0), ("pow", -0.0, 2.0, 0.0),
    ("pow", 0.0, -1.0, INFINITY), ("pow", -0.0, -1.0, -INFINITY), ("pow", -0.0, -0.5, INFINITY),
    ("pow", INFINITY, 2.0, INFINITY), ("pow", INFINITY, -2.0, 0.0),
    ("pow", -INFINITY, 3.0, -INFINITY), ("pow", -INFINITY, -3.0, -0.0),
    ("pow", -2.0, 0.5, NAN), ("pow", -2.0, 3.0, -8.0), ("pow", -2.0, 4.0, 16.0),
    ("pow", 2.0, 10.0, 1024.0), ("pow", 9.0, 0.5, 3.0), ("pow", 10.0, 1e6, INFINITY),
    ("pow", 10.0, -1e6, 0.0), ("pow", -1.0, 4503599627370497.0, -1.0), ("pow", -1.0, 1e300, 1.0),
    ("atan2", 0.0, 0.0, 0.0), ("atan2", -0.0, 0.0, -0.0), ("atan2", 0.0, -0.0, PI),
    ("atan2", -0.0, -0.0, -PI), ("atan2", 0.0, 1.0, 0.0), ("atan2", -0.0, 1.0, -0.0),
    ("atan2", 0.0, -1.0, PI), ("atan2", -0.0, -1.0, -PI), ("atan2", 1.0, 0.0, FRAC_PI_2),
    ("atan2", 1.0, -0.0, FRAC_PI_2), ("atan2", -1.0, 0.0, -FRAC_PI_2),
    ("atan2", 1.0, 1.0, FRAC_PI_4), ("atan2", -1.0, -1.0, -3.0 * FRAC_PI_4),
    ("atan2", INFINITY, INFINITY, FRAC_PI_4), ("atan2", INFINITY, -INFINITY, 3.0 * FRAC_PI_4),
    ("atan2", 1.0, INFINITY, 0.0), ("atan2", -1.0, -INFINITY, -PI),
    ("atan2", INFINITY, 1.0, FRAC_PI_2), ("atan2", NAN, 1.0, NAN), ("atan2", 1.0, NAN, NAN),
    ("hypot", 0.0, -0.0, 0.0), ("hypot", 3.0, -4.0, 5.0), ("hypot", INFINITY, 1.0, INFINITY),
    ("hypot", -INFINITY, NAN, NAN), ("hypot", NAN, INFINITY, NAN), ("hypot", 0.0, -7.0, 7.0),
];

#[test]
fn special_arguments_have_the_values_of_the_standard() {
    for &(name, x, expected) in OF_ONE {
        let function = UNARY.iter().find(|function| function.name == name);
        let function = function.expect("is in the table");
        assert_same(name, &[x], (function.double)(x), expected);
        let single = (function.single)(x as f32);
        assert_same(name, &[x], single.into(), (expected as f32).into());
    }
    for &(name, a, b, expected) in OF_TWO {
        let function = BINARY.iter().find(|function| function.name == name);
        let function = function.expect("is in the table");
        assert_same(name, &[a, b], (function.double)(a, b), expected);
        let exact_in_f32 = f64::from(b as f32) == b || !b.is_finite() || b.is_nan();
        if exact_in_f32 {
            let single = (function.single)(a as f32, b as f32);
            assert_same(name, &[a, b], single.into(), (expected as f32).into());
        }
    }
}

#[test]
fn nan_gives_nan() {
    for function in UNARY {
        assert!((function.double)(NAN).is_nan(), "{}", function.name);
        assert!((function.single)(f32::NAN).is_nan(), "{}", function.name);
    }
    for function in BINARY {
        for (a, b) in [
            (NAN, 1.0),
            (1.0, NAN),
            (NAN, 0.0),
            (0.0, NAN),
            (NAN, INFINITY),
        ] {
            assert!((function.double)(a, b).is_nan(), "{}", function.name);
            let single = (function.single)(a as f32, b as f32);
            assert!(single.is_nan(), "{}", function.name);
        }
    }
}

/// f(x) = x + O(x³) to the last bit of a subnormal number.
#[test]
fn functions_through_the_origin_keep_subnormal_numbers() {
    for function in UNARY {
        if ["sin", "tan", "asin", "atan", "sinh", "tanh"].contains(&function.name) {
            for bits in [1u32, 2, 3, 0x1234, 0x7F_FFFF] {
                let single = f32::from_bits(bits);
                assert_eq!((function.single)(single), single, "{}", function.name);
                let double = f64::from_bits(u64::from(bits) << 20 | 1);
                assert_eq!((function.double)(double), double, "{}", function.name);
            }
        }
    }
    assert!(math::log(-5e-324_f64).is_nan() && math::log(-1e-45_f32).is_nan());
    assert_eq!(
        math::log(f64::from_bits(1)),
        core_math::log(f64::from_bits(1))
    );
}

/// Where results overflow, vanish or become subnormal; the ends are ln of the largest number and
/// of half the smallest one.
#[test]
fn exponentials_go_to_infinity_and_zero_where_they_should() {
    assert_eq!(math::exp(709.782712893384), 1.7976931348622732e308);
    assert_eq!(math::exp(709.7827128933841), INFINITY);
    assert_eq!(math::exp(-745.1332191019411), 5e-324);
    assert_eq!(math::exp(-745.1332191019412), 0.0);
    assert_eq!(math::exp(88.72284_f32), f32::INFINITY);
    assert_eq!(math::exp(-103.97207_f32), 1e-45);
    assert_eq!(math::exp(-103.97209_f32), 0.0);
    assert_eq!(math::pow(2.0, -1074.0), 5e-324);
    assert_eq!(math::pow(2.0, 1023.0), 2f64.powi(1023));
    assert_eq!(math::pow(2.0, 1024.0), INFINITY);
    assert_eq!(math::pow(2.0_f32, 128.0), f32::INFINITY);
}

/// Quotients of which one operand over- or underflows the fast formula.
#[test]
fn angles_and_lengths_survive_huge_and_tiny_operands() {
    for (a, b) in [
        (1e308, -1e308),
        (5e-324, 5e-324),
        (1e-320, 1e-310),
        (-1e308, 1e-308),
    ] {
        assert_eq!(math::atan2(a, b), core_math::atan2(a, b));
        assert_eq!(math::hypot(a, b), core_math::hypot(a, b));
    }
    let huge = 2f64.powi(1000);
    assert_eq!(math::hypot(3.0 * huge, 4.0 * huge), 5.0 * huge);
    assert_eq!(math::hypot(3.0 / huge, 4.0 / huge), 5.0 / huge);
}
