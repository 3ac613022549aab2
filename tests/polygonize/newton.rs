//! Interval Newton isolation: each root proven or flagged, none missed, none invented.

use std::f64::consts::{PI, SQRT_2};

use crate::expression::{Expression, compiled};
use crate::support::cube;
use imp::engine::Silent;
use imp::graph::Op;
use imp::polygonize::{Method, Options, PolygonizeError, Reason, Roots, Shape, polygonize};

/// What the method finds on an interval; no roots where there are none.
fn solve((low, high): (f64, f64), make: impl FnOnce(Expression) -> Expression) -> Roots {
    let field = compiled(1, |coordinates| make(coordinates[0].clone()));
    match polygonize(&field, &Options::new(cube(1, low, high)), &Silent) {
        Ok(found) => {
            assert_eq!(found.method, Method::Newton);
            match found.shape {
                Shape::Roots(roots) => roots,
                other => panic!("{other:?}"),
            }
        }
        Err(PolygonizeError::NoSurface { .. }) => Roots::default(),
        Err(error) => panic!("{error}"),
    }
}

/// Asserts that the roots are these, to `units` in the last place of the larger of them and 1.
fn assert_values(found: &Roots, expected: &[f64], units: f64) {
    assert_eq!(found.roots.len(), expected.len(), "{found:?}");
    for (root, expected) in found.roots.iter().zip(expected) {
        let error = (root.value - expected).abs();
        let allowed = units * f64::EPSILON * expected.abs().max(f64::MIN_POSITIVE);
        assert!(error <= allowed, "{root:?} instead of {expected}");
        let (low, high) = root.enclosure;
        assert!(low <= root.value && root.value <= high, "{root:?}");
    }
}

/// Asserts that the roots are these, all proven and nothing undecided; `units` is what rounding of
/// the expected values allows.
fn assert_proven(found: &Roots, expected: &[f64], units: f64) {
    assert_values(found, expected, units);
    assert!(found.is_proven(), "{found:?}");
    for (root, expected) in found.roots.iter().zip(expected) {
        let margin = units * f64::EPSILON * expected.abs();
        let (low, high) = root.enclosure;
        assert!(
            low - margin <= *expected && *expected <= high + margin,
            "{root:?} {expected}"
        );
    }
}

/// The reasons of what is undecided.
fn reasons(found: &Roots) -> Vec<Reason> {
    found.undecided.iter().map(|part| part.reason).collect()
}

fn exponential(x: Expression) -> Expression {
    x.apply(Op::Exp, &[])
}

#[test]
fn simple_roots_are_proven() {
    assert_proven(&solve((-3.0, 5.0), |x| 2.0 * x - 1.0), &[0.5], 0.0);
    assert_proven(
        &solve((-2.0, 2.0), |x| x.square() - 2.0),
        &[-SQRT_2, SQRT_2],
        1.0,
    );
    let cubic = |x: Expression| x.clone() * (x.clone() - 1.0) * (x + 1.0);
    assert_proven(&solve((-2.0, 2.0), cubic), &[-1.0, 0.0, 1.0], 0.0);
    assert_proven(&solve((-1.7, 2.3), cubic), &[-1.0, 0.0, 1.0], 0.0);
    let sine: Vec<f64> = (-3..=3).map(|k| f64::from(k) * PI).collect();
    assert_proven(&solve((-10.0, 10.1), |x| x.sine()), &sine, 2.0);
    // x = cos x at Dottie's number.
    let dottie = |x: Expression| x.apply(Op::Cos, &[]) - x;
    assert_proven(&solve((-1.0, 2.0), dottie), &[0.739_085_133_215_160_6], 1.0);
    let logarithm = |x: Expression| x.apply(Op::Log, &[]) - 1.0;
    assert_proven(&solve((0.5, 10.0), logarithm), &[std::f64::consts::E], 1.0);
}

#[test]
fn where_there_is_none_none_is_found_and_that_is_proven() {
    for found in [
        solve((-1.0, 1.0), |x| x.square() + 1e-9),
        solve((-1.0, 1.0), |x| x.square() + 1e-17),
        solve((-30.0, 30.0), exponential),
        solve((-1.0, 1.0), |x| x.abs() + 0.5),
        solve((-2.0, 2.0), |x| 2.0 + x.sine()),
        solve((1.5, 3.0), |x| x.square() - 2.0),
    ] {
        assert_eq!(found, Roots::default());
    }
}

#[test]
fn steep_and_flat_fields_are_solved_to_the_last_digit() {
    let steep = |x: Expression| exponential(40.0 * (x - 1.0)) - 1.0;
    assert_proven(&solve((0.1, 1.9), steep), &[1.0], 0.0);
    assert_proven(&solve((-50.0, 10.0), steep), &[1.0], 0.0);
    assert_proven(&solve((0.0, 2.3), |x| x.power(20) - 1.0), &[1.0], 1.0);
    assert_proven(
        &solve((-7.0, 2.3), |x| x.power(20) - 1.0),
        &[-1.0, 1.0],
        1.0,
    );
    let step = |x: Expression| (1e9 * (x - 0.3)).apply(Op::Tanh, &[]);
    assert_proven(&solve((-1.0, 1.0), step), &[0.3], 0.0);
    // Slope 1e-9 beside the root at 0.
    assert_proven(&solve((-1.0, 1.0), |x| x.power(3) + 1e-9 * x), &[0.0], 0.0);
}

#[test]
fn clustered_roots_are_told_apart() {
    let pair = |gap: f64| move |x: Expression| (x.clone() - 0.5) * (x - (0.5 + gap));
    for gap in [1e-3, 1e-6, 1e-9, 1e-12] {
        assert_proven(&solve((0.0, 1.0), pair(gap)), &[0.5, 0.5 + gap], 1.0);
    }
    let tight = |x: Expression| (x - 1.0).square() - 1e-20;
    assert_proven(&solve((0.0, 3.0), tight), &[1.0 - 1e-10, 1.0 + 1e-10], 2.0);
    // Five within 4e-9, about 1/8.
    let five = |x: Expression| {
        (-2..=2).fold(x.number(1.0), |product, k| {
            product * (x.clone() - (0.125 + 1e-9 * f64::from(k)))
        })
    };
    let expected: Vec<f64> = (-2..=2).map(|k| 0.125 + 1e-9 * f64::from(k)).collect();
    assert_proven(&solve((-1.0, 1.0), five), &expected, 1.0);
}

#[test]
fn oscillations_are_resolved() {
    let reciprocal = |x: Expression| (1.0 / x).sine();
    let expected: Vec<f64> = (1..=31).rev().map(|k| 1.0 / (f64::from(k) * PI)).collect();
    assert_proven(&solve((0.01, 1.0), reciprocal), &expected, 2.0);
    let fast = |x: Expression| (100.0 * x).sine();
    let expected: Vec<f64> = (1..=318).map(|k| f64::from(k) * PI / 100.0).collect();
    assert_proven(&solve((0.001, 10.0), fast), &expected, 3.0);
    let expected: Vec<f64> = (1..=3183).map(|k| f64::from(k) * PI).collect();
    assert_proven(&solve((0.5, 1e4), |x| x.sine()), &expected, 3.0);
}

#[test]
fn wilkinsons_polynomial_is_solved_as_a_product_and_flagged_where_rounding_hides_its_roots() {
    let expected: Vec<f64> = (1..=20).map(f64::from).collect();
    let product = |x: Expression| {
        (1..=20).fold(x.number(1.0), |product, k| {
            product * (x.clone() - f64::from(k))
        })
    };
    assert_proven(&solve((0.0, 21.0), product), &expected, 0.0);
    // Expanded, by Horner's rule: rounding moves the middle roots by 0.01 and more (Wilkinson, 1963).
    let mut coefficients = vec![1.0_f64];
    for k in 1..=20 {
        let mut next = vec![0.0; coefficients.len() + 1];
        for (place, coefficient) in coefficients.iter().enumerate() {
            next[place + 1] += coefficient;
            next[place] -= f64::from(k) * coefficient;
        }
        coefficients = next;
    }
    let horner = |x: Expression| {
        coefficients
            .iter()
            .rev()
            .fold(x.number(0.0), |sum, &coefficient| {
                sum * x.clone() + coefficient
            })
    };
    let found = solve((0.0, 21.0), horner);
    for expected in expected {
        let near = |low: f64, high: f64| low - 0.1 <= expected && expected <= high + 0.1;
        let proven = found
            .roots
            .iter()
            .any(|root| root.proven && near(root.enclosure.0, root.enclosure.1));
        let flagged = found.undecided.iter().any(|part| near(part.low, part.high));
        assert!(proven || flagged, "{expected}");
    }
}

#[test]
fn roots_at_the_ends_count() {
    let found = solve((0.0, 1.0), |x| x);
    assert_proven(&found, &[0.0], 0.0);
    let cubic = |x: Expression| x.clone() * (x.clone() - 1.0) * (x + 1.0);
    assert_proven(&solve((-1.0, 1.0), cubic), &[-1.0, 0.0, 1.0], 0.0);
    // f64's π is below π, where the sine is 1.2e-16.
    let found = solve((0.0, PI), |x| x.sine());
    assert_values(&found, &[0.0, PI], 0.0);
    assert_eq!(reasons(&found), [Reason::End]);
    assert!(found.roots[0].proven && !found.roots[1].proven);
    let found = solve((SQRT_2, 2.0), |x| x.square() - 2.0);
    assert_values(&found, &[SQRT_2], 2.0);
    assert_eq!(reasons(&found), [Reason::End]);
    // A double root at an end.
    let found = solve((0.0, 1.0), |x| x.square());
    assert_values(&found, &[0.0], 0.0);
    assert_eq!(reasons(&found), [Reason::End]);
}

#[test]
fn multiple_roots_are_found_to_rounding_and_flagged() {
    let found = solve((-1.0, 1.0), |x| x.square());
    assert_values(&found, &[0.0], 0.0);
    assert_eq!(reasons(&found), [Reason::Touches]);
    let found = solve((0.0, 1.0), |x| (x - 0.3).square());
    assert_values(&found, &[0.3], 0.0);
    assert_eq!(reasons(&found), [Reason::Touches]);
    let found = solve((-1.0, 1.3), |x| (x - 0.3).power(3));
    assert_values(&found, &[0.3], 0.0);
    assert_eq!(reasons(&found), [Reason::Multiple]);
    // Expanded, F is rounding within 1e-8 of the root.
    let expanded = |x: Expression| x.square() - (2.0 / 3.0) * x + 1.0 / 9.0;
    let found = solve((-1.0, 1.0), expanded);
    assert_eq!(reasons(&found), [Reason::Touches], "{found:?}");
    assert_eq!(found.roots.len(), 1);
    assert!((found.roots[0].value - 1.0 / 3.0).abs() < 1e-7, "{found:?}");
    // A double root between two simple ones.
    let quartic = |x: Expression| x.square() * (x.square() - 1.0);
    let found = solve((-2.0, 2.0), quartic);
    assert_values(&found, &[-1.0, 0.0, 1.0], 0.0);
    assert_eq!(reasons(&found), [Reason::Touches]);
    let proven: Vec<bool> = found.roots.iter().map(|root| root.proven).collect();
    assert_eq!(proven, [true, false, true]);
}

#[test]
fn kinks_are_proven_where_the_field_crosses_and_flagged_where_it_touches() {
    assert_proven(&solve((-1.0, 1.0), |x| x.abs() - 0.5), &[-0.5, 0.5], 0.0);
    let kinked = |x: Expression| {
        let left = x.clone() - 0.4;
        left.min(&(1000.0 * left.clone())) + 1e-4
    };
    let found = solve((-1.0, 1.0), kinked);
    assert_proven(&found, &[0.4 - 1e-7], 4.0);
    // The root is in the kink itself, where the enclosure of the slope is wider than both slopes.
    let crossing = |x: Expression| {
        let shifted = x - 0.25;
        shifted.max(&(3.0 * shifted.clone()))
    };
    let found = solve((-1.0, 1.0), crossing);
    assert_values(&found, &[0.25], 0.0);
    assert_eq!(reasons(&found), [Reason::Multiple]);
    let found = solve((-1.0, 1.0), |x| (x - 0.125).abs());
    assert_values(&found, &[0.125], 0.0);
    assert_eq!(reasons(&found), [Reason::Touches]);
}

#[test]
fn poles_jumps_and_gaps_are_no_roots() {
    let found = solve((-1.0, 1.0), |x| 1.0 / x);
    assert_eq!(found, Roots::default());
    let tangent = |x: Expression| x.apply(Op::Tan, &[]);
    let found = solve((-4.0, 4.5), tangent);
    assert_values(&found, &[-PI, 0.0, PI], 1.0);
    assert!(found.roots.iter().all(|root| root.proven));
    assert_eq!(reasons(&found), [Reason::Pole, Reason::Pole]);
    for (part, pole) in found.undecided.iter().zip([-0.5 * PI, 0.5 * PI]) {
        assert!(part.low <= pole && pole <= part.high && part.high - part.low < 1e-14);
    }
    let both = |x: Expression| (x.clone() + 0.5) / (x - 0.3);
    let found = solve((-1.0, 1.0), both);
    assert_values(&found, &[-0.5], 0.0);
    assert_eq!(reasons(&found), [Reason::Pole]);
    let jump = |x: Expression| (x.clone() + 0.5) * ((x - 0.3).apply(Op::Floor, &[]) + 0.5);
    let found = solve((-1.0, 1.0), jump);
    assert_values(&found, &[-0.5], 0.0);
    assert_eq!(reasons(&found), [Reason::Jump]);
    // The singularity of sin(x)/x can be removed, but the quotient is not a number there.
    let found = solve((-4.0, 4.0), |x| x.sine() / x);
    assert_values(&found, &[-PI, PI], 1.0);
    assert_eq!(reasons(&found), [Reason::Undefined]);
}

#[test]
fn the_end_of_the_domain_is_a_root_only_if_the_field_is_zero_there() {
    assert_proven(&solve((0.0, 1.0), |x| x.sqrt()), &[0.0], 0.0);
    let found = solve((-1.0, 1.0), |x| x.sqrt());
    assert_values(&found, &[0.0], 0.0);
    assert_eq!(reasons(&found), [Reason::Undefined]);
    let found = solve((0.0, 3.0), |x| (x.square() - 2.0).sqrt());
    assert_values(&found, &[SQRT_2], 2.0);
    assert_eq!(reasons(&found), [Reason::Undefined]);
    let found = solve((-1.0, 1.0), |x| x.sqrt() - 0.5);
    assert_values(&found, &[0.25], 0.0);
    assert!(found.roots[0].proven);
    // Proven to have no zero, by the range.
    assert_eq!(solve((-1.0, 1.0), |x| x.sqrt() + 0.5), Roots::default());
}

#[test]
fn a_stretch_of_zeros_is_named_with_its_ends() {
    let found = solve((-1.0, 2.0), |x| (x.clone() - 1.0).max(&x.number(0.0)));
    assert_eq!(found.roots, []);
    assert_eq!(reasons(&found), [Reason::Vanishes]);
    assert!((found.undecided[0].low + 1.0).abs() < 1e-14);
    assert!((found.undecided[0].high - 1.0).abs() < 1e-14);
}

#[test]
fn huge_and_tiny_intervals_are_no_harder() {
    let cubic = |x: Expression| x.power(3) - x;
    assert_proven(&solve((-1e6, 1e6), cubic), &[-1.0, 0.0, 1.0], 0.0);
    assert_proven(&solve((-1e100, 1e100), |x| x - 3.0), &[3.0], 0.0);
    let tiny = |x: Expression| x.square() - 2e-200;
    let root = 1e-100 * SQRT_2;
    assert_proven(&solve((0.0, 1e-99), tiny), &[root], 2.0);
    // Far from 0, where numbers are 1e-6 apart.
    assert_proven(&solve((1e10 - 1.0, 1e10 + 3.0), |x| x - 1e10), &[1e10], 0.0);
}

#[test]
fn a_level_other_than_zero_is_a_shifted_field() {
    let field = compiled(1, |x| x[0].square());
    let options = Options {
        iso: 2.0,
        ..Options::new(cube(1, 0.0, 2.0))
    };
    let found = polygonize(&field, &options, &Silent).unwrap();
    match found.shape {
        Shape::Roots(roots) => assert_proven(&roots, &[SQRT_2], 1.0),
        other => panic!("{other:?}"),
    }
}

#[test]
fn infinitely_many_roots_end_the_search() {
    let found = solve((0.0, 1.0), |x| (1.0 / x).sine());
    let proven = found.roots.iter().filter(|root| root.proven).count();
    assert!(proven > 1000, "{proven}");
    // What is not proven is near 0, and is named.
    let outermost = found.undecided.last().unwrap();
    assert!(outermost.high < 1e-3, "{outermost:?}");
    let last = found.roots.last().unwrap();
    assert!((last.value * PI - 1.0).abs() < 1e-14);
}
