//! Curves in space, on which two fields vanish, by continuation and by tetrahedra.

use std::f64::consts::{PI, TAU};

use imp::engine::Silent;
use imp::geometry::{Bounds, Curves};
use imp::polygonize::{Method, Options, PolygonizeError, Shape, Statistics, polygonize_curve};

use crate::support::cube;
use crate::surfaces::compiled;

const BOTH: [Method; 2] = [Method::Continuation, Method::Tetrahedra];

fn curves(
    formulas: [&str; 2],
    bounds: Bounds,
    method: Method,
) -> Result<(Curves, Statistics), PolygonizeError> {
    let fields = formulas.map(compiled);
    let options = Options {
        method: Some(method),
        cell: bounds.size().max_element() / 48.0,
        ..Options::new(bounds)
    };
    let found = polygonize_curve([&fields[0], &fields[1]], &options, &Silent)?;
    match found.shape {
        Shape::Curves(curves) => Ok((curves, found.statistics)),
        other => panic!("{other:?}"),
    }
}

/// Fails unless both methods find so many closed curves of this length.
fn check(formulas: [&str; 2], side: f64, closed: usize, length: f64) {
    // Chords no longer than two cells, which are a 12th of the side, on curves with a radius of
    // curvature of a quarter of the side at the least, are too short by less than 1/24 of the square of a third.
    for method in BOTH {
        let (curves, statistics) = curves(formulas, cube(3, -side, side), method).unwrap();
        let found = curves.length();
        assert!(found < length * (1.0 + 1e-9), "{method:?} {found} {length}");
        assert!(
            found > length * (1.0 - 1.0 / 216.0),
            "{method:?} {found} {length}"
        );
        assert_eq!(curves.closed_components(), closed, "{method:?}");
        assert_eq!(curves.components(), closed, "{method:?}");
        assert_eq!(statistics.poor_roots, 0);
        assert!(!statistics.cut_by_box);
        assert!(statistics.max_residual <= 1e-9 * 2.0 * side * 3.0_f64.sqrt());
        assert_eq!(curves.dimension, 3);
    }
}

#[test]
fn circles_and_ellipses_have_their_lengths() {
    let plane = "x + y + z - 0.5";
    let radius = (1.0 - 0.25 / 3.0_f64).sqrt();
    check(["x^2 + y^2 + z^2 - 1", plane], 1.5, 1, TAU * radius);
    check(["x^2 + y^2 - 1", "z^2 - 0.3"], 1.5, 2, 2.0 * TAU);
    // A cylinder cut at 45 degrees: an ellipse with the half axes 1 and √2, whose length is that of an
    // arc of the sine, by the trapezoidal rule, which converges faster than any power here.
    let steps = 64;
    let sum: f64 = (0..steps)
        .map(|step| (1.0 + (TAU * f64::from(step) / f64::from(steps)).sin().powi(2)).sqrt())
        .sum();
    let length = sum * TAU / f64::from(steps);
    check(["x^2 + y^2 - 1", "z - x"], 1.5, 1, length);
}

#[test]
fn vivianis_curve_crosses_itself_once() {
    let formulas = ["x^2 + y^2 + z^2 - 4", "(x - 1)^2 + y^2 - 1"];
    for method in BOTH {
        let (curves, statistics) = curves(formulas, cube(3, -2.3, 2.45), method).unwrap();
        assert!(
            (curves.length() / 15.28079 - 1.0).abs() < 5e-3,
            "{}",
            curves.length()
        );
        assert_eq!(statistics.crossings, 1, "{method:?}");
        assert!(curves.polylines.iter().all(|polyline| polyline.closed));
    }
}

#[test]
fn the_trefoil_is_one_loop() {
    let real = "(x^2 + y^2 + z^2 + 1)*((x^2 + y^2 + z^2 - 1)^2 - 4*z^2) + 8*(x^3 - 3*x*y^2)";
    let imaginary = "(x^2 + y^2 + z^2 + 1)*4*z*(x^2 + y^2 + z^2 - 1) + 8*(3*x^2*y - y^3)";
    check([real, imaginary], 2.4, 1, 20.643 * (1.0 + 2.5e-5));
}

#[test]
fn curves_end_at_the_box() {
    for method in BOTH {
        let bounds = cube(3, -1.0, 1.0);
        let (curves, statistics) = curves(["x - y", "z - 0.25*x"], bounds, method).unwrap();
        // From (-1, -1, -0.25) to (1, 1, 0.25).
        assert!((curves.length() - 8.25_f64.sqrt()).abs() < 1e-9);
        assert_eq!((curves.components(), curves.closed_components()), (1, 0));
        assert!(statistics.cut_by_box);
        let ends = &curves.polylines[0].points;
        for end in [ends.first(), ends.last()] {
            assert!((end.unwrap().abs().max_element() - 1.0).abs() < 1e-9);
        }
    }
}

#[test]
fn grids_whose_points_lie_on_the_curve_break_nothing() {
    // The circle and the line pass through grid points, edges and faces.
    let bounds = cube(3, -1.5, 1.5);
    let (circle, _) = curves(["x^2 + y^2 + z^2 - 1", "z"], bounds, Method::Tetrahedra).unwrap();
    assert_eq!((circle.components(), circle.closed_components()), (1, 1));
    assert!((circle.length() / (2.0 * PI) - 1.0).abs() < 5e-3);
    let (line, _) = curves(["x", "y"], bounds, Method::Tetrahedra).unwrap();
    assert_eq!(line.components(), 1);
    assert!((line.length() - 3.0).abs() < 1e-9);
}

#[test]
fn what_has_no_curve_is_refused() {
    let bounds = cube(3, -1.0, 1.0);
    for method in BOTH {
        let apart = curves(["x^2 + y^2 + z^2 - 0.2", "x - 0.9"], bounds, method);
        assert_eq!(apart.unwrap_err(), PolygonizeError::NoCurve);
    }
    let wrong = curves(["x", "y"], bounds, Method::Dual).unwrap_err();
    assert_eq!(
        wrong,
        PolygonizeError::NotForCurves {
            method: Method::Dual
        }
    );
}
