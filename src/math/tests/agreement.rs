//! One value, a slice and every instruction set give the same bits.

use super::arguments::{self, Random, exponents};
use super::functions::{BINARY, UNARY};

const SPECIAL: [f64; 12] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::NAN,
    5e-324,
    -1e-310,
    1e308,
    1e22,
    -745.0,
];

/// Whether two f64 are the same number, or both NaN.
fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

/// Arguments of every kind with special ones strewn in, so that some blocks need a fallback.
fn mixture(count: usize, single: bool, seed: u64) -> Vec<f64> {
    let mut random = Random(seed);
    let mut values = Vec::with_capacity(count);
    for index in 0..count {
        let function = &UNARY[index % UNARY.len()];
        values.push(match index % 29 {
            7 => SPECIAL[random.bits() as usize % SPECIAL.len()],
            8 => random.spread(exponents(single)),
            _ => arguments::one(function, index, &mut random, single),
        });
    }
    values
}

fn narrowed(values: &[f64]) -> Vec<f32> {
    values.iter().map(|&value| value as f32).collect()
}

#[test]
fn slices_of_any_length_have_the_bits_of_single_values() {
    for length in (0..70).chain([1000]) {
        let (a, b) = (mixture(length, false, 5), mixture(length, false, 6));
        let (a_single, b_single) = (narrowed(&a), narrowed(&b));
        let (mut out, mut out_single) = (vec![0.0; length], vec![0.0; length]);
        for function in UNARY {
            (function.double_slice)(&mut out, &a);
            (function.single_slice)(&mut out_single, &a_single);
            for lane in 0..length {
                let (x, x_single) = (a[lane], a_single[lane]);
                let single = f64::from((function.single)(x_single));
                assert!(
                    same(out[lane], (function.double)(x)),
                    "{} {x}",
                    function.name
                );
                assert!(
                    same(f64::from(out_single[lane]), single),
                    "{} {x}",
                    function.name
                );
            }
        }
        for function in BINARY {
            (function.double_slice)(&mut out, &a, &b);
            (function.single_slice)(&mut out_single, &a_single, &b_single);
            for lane in 0..length {
                let (x, y) = (a[lane], b[lane]);
                let single = f64::from((function.single)(a_single[lane], b_single[lane]));
                assert!(
                    same(out[lane], (function.double)(x, y)),
                    "{} {x} {y}",
                    function.name
                );
                assert!(
                    same(f64::from(out_single[lane]), single),
                    "{} {x} {y}",
                    function.name
                );
            }
        }
    }
}

#[test]
fn slices_fill_as_many_lanes_as_all_of_them_have() {
    let mut out = [-1.0; 3];
    crate::math::slice::exp(&mut out, &[0.0, 0.0]);
    assert_eq!(out, [1.0, 1.0, -1.0]);
    crate::math::slice::hypot(&mut out, &[3.0, 3.0, 3.0], &[4.0]);
    assert_eq!(out, [5.0, 1.0, -1.0]);
}

#[test]
fn odd_and_even_functions_are_so_to_the_last_bit() {
    for function in UNARY {
        let odd = ["sin", "tan", "asin", "atan", "sinh", "tanh"].contains(&function.name);
        let even = ["cos", "cosh"].contains(&function.name);
        for x in mixture(20_000, false, 7) {
            let (right, left) = ((function.double)(x), (function.double)(-x));
            assert!(!odd || same(left, -right), "{} {x}", function.name);
            assert!(!even || same(left, right), "{} {x}", function.name);
        }
    }
}

#[test]
fn ranges_are_kept() {
    let half_pi = std::f64::consts::FRAC_PI_2;
    let pi = std::f64::consts::PI;
    for function in UNARY {
        let (least, largest) = match function.name {
            "exp" => (0.0, f64::INFINITY),
            "sin" | "cos" | "tanh" => (-1.0, 1.0),
            "asin" | "atan" => (-half_pi, half_pi),
            "acos" => (0.0, pi),
            "cosh" => (1.0, f64::INFINITY),
            _ => continue,
        };
        for x in mixture(20_000, false, 8) {
            let value = (function.double)(x);
            let inside = least <= value && value <= largest;
            assert!(inside || value.is_nan(), "{} {x}", function.name);
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod instruction_sets {
    //! The formulas compiled for more than the baseline.

    use super::super::super::slice;
    use super::{mixture, narrowed};

    /// Each function over slices with some target features, as bits of the results.
    macro_rules! with_features {
        ($name:ident, $features:literal) => {
            #[target_feature(enable = $features)]
            fn $name(a: &[f64], b: &[f64]) -> Vec<Vec<u64>> {
                all_bits(a, b)
            }
        };
    }

    with_features!(with_avx2, "avx2,fma");
    with_features!(with_avx512, "avx512f,avx512dq,avx512vl,avx512bw,avx2,fma");

    #[inline(always)]
    fn all_bits(a: &[f64], b: &[f64]) -> Vec<Vec<u64>> {
        let (a_single, b_single) = (narrowed(a), narrowed(b));
        let mut results = Vec::new();
        let (mut out, mut out_single) = (vec![0.0; a.len()], vec![0.0; a.len()]);
        macro_rules! collect {
            ($($function:ident)+; $($binary:ident)+) => {
                $(
                    slice::$function(&mut out, a);
                    slice::$function(&mut out_single, &a_single);
                    results.push(bits(&out, &out_single));
                )+
                $(
                    slice::$binary(&mut out, a, b);
                    slice::$binary(&mut out_single, &a_single, &b_single);
                    results.push(bits(&out, &out_single));
                )+
            };
        }
        collect!(exp log sin cos tan asin acos atan sinh cosh tanh; atan2 pow hypot);
        results
    }

    /// NaN all look the same.
    fn bits(double: &[f64], single: &[f32]) -> Vec<u64> {
        let widened = single.iter().map(|&value| f64::from(value));
        let values = double.iter().copied().chain(widened);
        let canonical = values.map(|value| if value.is_nan() { f64::NAN } else { value });
        canonical.map(f64::to_bits).collect()
    }

    #[test]
    #[allow(unsafe_code)]
    fn give_the_same_bits() {
        let (a, b) = (mixture(20_000, false, 9), mixture(20_000, true, 10));
        let baseline = all_bits(&a, &b);
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            // SAFETY: the processor has the features.
            assert!(baseline == unsafe { with_avx2(&a, &b) });
        }
        let avx512 = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512bw");
        if avx512 {
            // SAFETY: the processor has the features.
            assert!(baseline == unsafe { with_avx512(&a, &b) });
        }
    }
}
