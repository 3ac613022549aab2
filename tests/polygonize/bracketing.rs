//! Roots of functions of one variable.

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::support::{self, Closure, Made, cube};
use glam::DVec3;
use imp::engine::{Field, Monitor, Silent};
use imp::polygonize::{Method, Options, PolygonizeError, Shape};

fn roots(
    field: &dyn Field,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Made<Vec<f64>>, PolygonizeError> {
    let method = (Method::Bracketing, options);
    support::made(field, method, monitor, |shape| match shape {
        Shape::Roots(roots) => Some(roots.values()),
        _ => None,
    })
}

/// A field in R1, from a closure that returns F and its derivative.
fn line(
    function: impl Fn(f64) -> (f64, f64) + Send + Sync,
) -> Closure<impl Fn(DVec3) -> (f64, DVec3) + Send + Sync> {
    Closure {
        dimension: 1,
        function: move |p: DVec3| {
            let (value, derivative) = function(p.x);
            (value, DVec3::new(derivative, 0.0, 0.0))
        },
    }
}

/// The roots in an interval on a grid with this many cells.
fn find(
    field: &dyn Field,
    low: f64,
    high: f64,
    cells: usize,
) -> Result<Made<Vec<f64>>, PolygonizeError> {
    let options = Options {
        cell: (high - low) / cells as f64,
        ..Options::new(cube(1, low, high))
    };
    roots(field, &options, &Silent)
}

/// Asserts that the roots are these to the default tolerance.
fn assert_roots(field: &dyn Field, (low, high): (f64, f64), cells: usize, expected: &[f64]) {
    let found = find(field, low, high, cells).unwrap();
    assert_eq!(found.shape.len(), expected.len(), "{:?}", found.shape);
    for (root, expected) in found.shape.iter().zip(expected) {
        let error = (root - expected).abs();
        assert!(error <= 1e-9 * (high - low), "{root} instead of {expected}");
    }
    assert_eq!(found.statistics.poor_roots, 0);
    assert!(found.statistics.max_residual <= 1e-9 * (high - low));
    assert_eq!(found.statistics.cells, cells);
}

#[test]
fn all_simple_roots_are_found_in_order() {
    let sine = line(|x| (x.sin(), x.cos()));
    let expected: Vec<f64> = (-3..=3)
        .map(|k| f64::from(k) * std::f64::consts::PI)
        .collect();
    assert_roots(&sine, (-10.0, 10.1), 64, &expected);
}

#[test]
fn several_slabs_give_what_one_would() {
    let fast = line(|x| ((100.0 * x).sin(), 100.0 * (100.0 * x).cos()));
    let expected: Vec<f64> = (1..=318)
        .map(|k| f64::from(k) * std::f64::consts::PI / 100.0)
        .collect();
    assert_roots(&fast, (0.001, 10.0), 5000, &expected);
}

#[test]
fn roots_at_grid_points_and_at_the_ends_are_found_once_and_exactly() {
    let cubic = line(|x| (x * (x - 1.0) * (x + 1.0), 3.0 * x * x - 1.0));
    for cells in [2, 4, 8, 64] {
        let found = find(&cubic, -1.0, 1.0, cells).unwrap();
        assert_eq!(found.shape, [-1.0, 0.0, 1.0]);
        assert!(found.statistics.cut_by_box);
    }
}

#[test]
fn steep_fields_are_solved_to_the_tolerance() {
    let exponential = line(|x| {
        let e = (40.0 * (x - 1.0)).exp();
        (e - 1.0, 40.0 * e)
    });
    let power = line(|x| (x.powi(20) - 1.0, 20.0 * x.powi(19)));
    for cells in [1, 2, 3, 10] {
        assert_roots(&exponential, (0.1, 1.9), cells, &[1.0]);
        assert_roots(&power, (0.0, 2.3), cells, &[1.0]);
    }
    let step = line(|x| {
        (
            (1e9 * (x - 0.3)).tanh(),
            1e9 / (1e9 * (x - 0.3)).cosh().powi(2),
        )
    });
    assert_roots(&step, (-1.0, 1.0), 3, &[0.3]);
}

#[test]
fn a_flat_root_is_found_to_the_tolerance_of_its_residual() {
    // |F| / |F'| = |x - 0.3| / 5, so the root may be off by five times the tolerance.
    let quintic = line(|x| ((x - 0.3).powi(5), 5.0 * (x - 0.3).powi(4)));
    let found = find(&quintic, -1.0, 1.0, 3).unwrap();
    assert_eq!(found.shape.len(), 1);
    assert!((found.shape[0] - 0.3).abs() <= 5.0 * 2e-9);
}

#[test]
fn kinks_do_not_mislead() {
    // Slope 1 on the left, 1000 on the right: Newton alone would swing about.
    let kinked = line(|x| {
        let slope = if x < 0.4 { 1.0 } else { 1000.0 };
        (slope * (x - 0.4) + 1e-4, slope)
    });
    assert_roots(&kinked, (-1.0, 1.0), 4, &[0.4 - 1e-4]);
}

#[test]
fn a_level_other_than_zero_is_a_shifted_field() {
    let square = line(|x| (x * x, 2.0 * x));
    let options = Options {
        iso: 2.0,
        ..Options::new(cube(1, 0.0, 2.0))
    };
    let found = roots(&square, &options, &Silent).unwrap();
    assert_eq!(found.shape.len(), 1);
    assert!((found.shape[0] - std::f64::consts::SQRT_2).abs() < 2e-9);
}

#[test]
fn poles_jumps_and_ends_of_the_domain_are_counted_and_are_no_roots() {
    let pole = line(|x| (1.0 / (x - 0.3), -1.0 / (x - 0.3).powi(2)));
    let jump = line(|x| ((x - 0.3).signum(), 0.0));
    let sloping_jump = line(|x| ((x - 0.3).signum() + x, 1.0));
    let end_of_domain = line(|x| ((x - 0.3).sqrt() - 2.0, 0.5 / (x - 0.3).sqrt()));
    let logarithm = line(|x| ((x - 0.3).ln(), 1.0 / (x - 0.3)));
    let fields: [&dyn Field; 5] = [&pole, &jump, &sloping_jump, &end_of_domain, &logarithm];
    // A second, true root shows that the poor one does not hide it.
    for field in fields {
        let both = line(|x| {
            let point = DVec3::new(x, 0.0, 0.0);
            let (value, gradient) = field.value_gradient(point);
            let product = -value * (x + 0.5);
            (product, -gradient.x * (x + 0.5) - value)
        });
        for cells in [5, 64] {
            match find(field, -1.0, 1.0, cells) {
                Err(PolygonizeError::NoSurface { .. }) => {}
                other => panic!("{other:?}"),
            }
            if !field.value_gradient(DVec3::NEG_X).0.is_nan() {
                let found = find(&both, -1.0, 1.0, cells).unwrap();
                assert!((found.shape[0] + 0.5).abs() < 1e-8);
                assert_eq!(found.statistics.poor_roots, 1);
            }
        }
    }
}

#[test]
fn poles_at_grid_points_are_no_roots() {
    // F at the grid point 0 is infinite or huge, of either sign.
    let reciprocal = line(|x| (1.0 / x, -1.0 / (x * x)));
    let negative = line(|x| (-1.0 / x, 1.0 / (x * x)));
    let cubic = line(|x| (x.powi(-3), -3.0 * x.powi(-4)));
    let beside = line(|x| (1.0 / (x - 1e-17), -1.0 / (x - 1e-17).powi(2)));
    let cubic_beside = line(|x| ((x - 1e-15).powi(-3), -3.0 * (x - 1e-15).powi(-4)));
    let fields: [&dyn Field; 5] = [&reciprocal, &negative, &cubic, &beside, &cubic_beside];
    for (number, field) in fields.into_iter().enumerate() {
        for (low, high) in [(-1.0, 1.0), (-1.0, 1.1)] {
            for cells in [2, 7, 64] {
                let result = find(field, low, high, cells);
                assert!(
                    matches!(result, Err(PolygonizeError::NoSurface { .. })),
                    "field {number} with {cells} cells up to {high}: {result:?}"
                );
            }
        }
    }
    // The tangent at the grid point π/2 is finite, 1.6e16. Its roots are found beside the pole.
    let tangent = line(|x| (x.tan(), 1.0 + x.tan().powi(2)));
    let pole = std::f64::consts::FRAC_PI_2;
    let found = find(&tangent, pole - 2.0, pole + 2.0, 64).unwrap();
    assert_eq!(found.shape.len(), 2);
    assert!(found.shape[0].abs() < 1e-14);
    assert!((found.shape[1] - 2.0 * pole).abs() < 1e-14);
    assert_eq!(found.statistics.good_roots, 2);
    assert_eq!(found.statistics.poor_roots, 1);
    assert_eq!(found.statistics.domain_ends, 0);
}

#[test]
fn the_end_of_the_domain_is_a_root_only_if_the_field_tends_to_the_level() {
    // The slope of all is infinite at 0, so that |F| / |F'| tends to 0 with x.
    let above = line(|x| (x.sqrt() - 0.5, 0.5 / x.sqrt()));
    let rising = line(|x| (-0.5 - x.sqrt(), -0.5 / x.sqrt()));
    let steep = line(|x| (-0.5 - 10.0 * x.sqrt(), -5.0 / x.sqrt()));
    let tending = line(|x| (-x.sqrt(), -0.5 / x.sqrt()));
    let boxes = [1.0, 1.1].map(|high| [2, 7, 64].map(|cells| (high, cells)));
    for (high, cells) in boxes.into_iter().flatten() {
        // The quotient comes within the larger tolerance long before the bracket is exhausted.
        for tolerance in [1e-15, 1e-6] {
            let run = |field: &dyn Field| {
                let options = Options {
                    cell: (high + 1.0) / f64::from(cells),
                    tolerance,
                    ..Options::new(cube(1, -1.0, high))
                };
                roots(field, &options, &Silent)
            };
            for field in [&rising as &dyn Field, &steep] {
                let result = run(field);
                assert!(
                    matches!(result, Err(PolygonizeError::NoSurface { .. })),
                    "{cells} cells up to {high} to {tolerance}: {result:?}"
                );
            }
            let found = run(&above).unwrap();
            assert_eq!(found.shape.len(), 1, "{:?}", found.shape);
            assert!((found.shape[0] - 0.25).abs() < 10.0 * tolerance);
            let statistics = found.statistics;
            assert_eq!((statistics.poor_roots, statistics.domain_ends), (1, 1));
            let found = run(&tending).unwrap();
            assert_eq!(found.shape.len(), 1, "{:?}", found.shape);
            assert!(found.shape[0].abs() < 10.0 * tolerance);
            assert_eq!(found.statistics.poor_roots, 0);
        }
    }
}

#[test]
fn the_second_of_three_roots_and_rounding_at_grid_points_are_no_poles() {
    // The first candidate is at the falling root, 0.4, up to rounding.
    let cubic = line(|x| {
        let y = x - 0.4;
        (100.0 * y * (y * y - 0.01), 100.0 * (3.0 * y * y - 0.01))
    });
    let found = find(&cubic, -0.6, 1.4, 1).unwrap();
    assert_eq!(found.shape.len(), 1);
    let distances = [0.3, 0.4, 0.5].map(|root: f64| (found.shape[0] - root).abs());
    assert!(distances.into_iter().any(|distance| distance < 1e-14));
    assert_eq!(found.statistics.poor_roots, 0);
    // All grid points are roots up to rounding, so that the signs there are arbitrary.
    let sine = line(|x| {
        let angle = 4.0 * std::f64::consts::PI * x;
        (angle.sin(), 4.0 * std::f64::consts::PI * angle.cos())
    });
    let found = find(&sine, -3.0, 5.0, 16).unwrap();
    assert_eq!(found.statistics.poor_roots, 0);
    for root in found.shape {
        assert!((4.0 * root - (4.0 * root).round()).abs() < 1e-14, "{root}");
    }
}

#[test]
fn a_jump_at_zero_takes_no_more_bisections_than_elsewhere() {
    // Numbers are dense near 0; the search ends at their spacing on the edge, not at 0.
    let evaluations = AtomicUsize::new(0);
    let sign = line(|x| {
        evaluations.fetch_add(1, Ordering::Relaxed);
        (x.signum(), 0.0)
    });
    let result = find(&sign, -1.0, 1.1, 7);
    assert!(matches!(result, Err(PolygonizeError::NoSurface { .. })));
    let count = evaluations.load(Ordering::Relaxed);
    assert!(count < 8 + 70, "{count}");
}

#[test]
fn nothing_found_says_what_was_seen() {
    let options = Options::new(cube(1, -1.0, 1.0));
    let seen = |field: &dyn Field| match roots(field, &options, &Silent) {
        Err(PolygonizeError::NoSurface {
            below,
            above,
            undefined,
            ..
        }) => [below, above, undefined],
        other => panic!("{other:?}"),
    };
    assert_eq!(seen(&line(|x| (x * x + 1.0, 2.0 * x))), [0, 65, 0]);
    assert_eq!(seen(&line(|x| (-x * x - 1.0, -2.0 * x))), [65, 0, 0]);
    assert_eq!(seen(&line(|_| (f64::NAN, f64::NAN))), [0, 0, 65]);
    let message = roots(&line(|x| (x * x + 1.0, 2.0 * x)), &options, &Silent).unwrap_err();
    let expected = "F does not cross 0 in the box: F ≥ 0 at all 65 grid points";
    assert_eq!(message.to_string(), expected);
}

#[test]
fn options_that_make_no_sense_are_refused() {
    let field = line(|x| (x, 1.0));
    let good = Options::new(cube(1, -1.0, 1.0));
    let bad = |change: fn(&mut Options)| {
        let mut options = good.clone();
        change(&mut options);
        roots(&field, &options, &Silent).unwrap_err()
    };
    for (name, change) in [
        ("cell", (|options| options.cell = 0.0) as fn(&mut Options)),
        ("cell", |options| options.cell = f64::NAN),
        ("cell", |options| options.cell = -1.0),
        ("tolerance", |options| options.tolerance = 0.0),
        ("tolerance", |options| options.tolerance = f64::INFINITY),
        ("iso", |options| options.iso = f64::NAN),
        ("bounds", |options| options.bounds.max.x = f64::INFINITY),
        ("bounds", |options| options.bounds.max.x = -1.0),
        ("bounds", |options| options.bounds.max.x = f64::NAN),
        ("bounds", |options| options.bounds = cube(1, -1e308, 1e308)),
        ("bounds", |options| options.bounds = cube(1, 0.0, 1e200)),
    ] {
        match bad(change) {
            PolygonizeError::BadOption { option, .. } => assert_eq!(option, name),
            error => panic!("{error}"),
        }
    }
    let error = bad(|options| options.bounds.max.x = -3.0);
    let expected = "bounds must have sides of positive length, not -2";
    assert_eq!(error.to_string(), expected);
    let error = bad(|options| options.cell = 7.0);
    let expected = "the cell is 7, which is more than the longest side of the box, 2";
    assert_eq!(error.to_string(), expected);
    let error = bad(|options| options.cell = 1e-300);
    assert!(
        matches!(error, PolygonizeError::TooManyCells { .. }),
        "{error}"
    );
    let error = bad(|options| options.bounds = cube(2, -1.0, 1.0));
    assert!(
        matches!(error, PolygonizeError::WrongDimension { .. }),
        "{error}"
    );
}

#[test]
fn cells_fit_the_interval_exactly() {
    let field = line(|x| (x - 0.05, 1.0));
    let cells = |cell: f64| {
        let options = Options {
            cell,
            ..Options::new(cube(1, 0.0, 1.0))
        };
        roots(&field, &options, &Silent).unwrap().statistics.cells
    };
    // 1 / 0.1 and 1 / (1/49) are integers, though not in floating point; 0.3 needs four cells.
    assert_eq!(cells(0.1), 10);
    assert_eq!(cells(1.0 / 49.0), 49);
    assert_eq!(cells(0.3), 4);
    assert_eq!(cells(1.0), 1);
}
