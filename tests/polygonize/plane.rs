//! Plane curves by all methods in R2: ambiguous squares, continuation, and what enclosures prove.

use std::f64::consts::PI;

use crate::expression::{Expression, compiled};
use crate::support::{Made, cube, curves};
use glam::DVec3;
use imp::engine::{CompiledField, Field, Silent};
use imp::geometry::Curves;
use imp::polygonize::{Ambiguity, Method, Options, PolygonizeError};

fn plane(make: impl FnOnce(Expression, Expression) -> Expression) -> CompiledField {
    compiled(2, |at| make(at[0].clone(), at[1].clone()))
}

fn circle(radius: f64) -> impl Field {
    plane(move |x, y| x.square() + y.square() - radius * radius)
}

fn trace(field: &dyn Field, options: &Options) -> Made<Curves> {
    curves(field, (Method::Continuation, options), &Silent).unwrap()
}

/// Continuation in a square box with vertices so far apart.
fn traced(field: &dyn Field, (low, high): (f64, f64), cell: f64) -> Made<Curves> {
    let options = Options {
        cell,
        ..Options::new(cube(2, low, high))
    };
    trace(field, &options)
}

fn area(curves: &Curves) -> f64 {
    let polylines = curves.polylines.iter();
    polylines.map(|polyline| polyline.signed_area()).sum()
}

/// Asserts that F < 0 a little to the left of the middle of every segment and F > 0 to the right.
fn assert_oriented(field: &dyn Field, curves: &Curves, aside: f64) {
    for polyline in &curves.polylines {
        for pair in polyline.points.windows(2) {
            let along = pair[1] - pair[0];
            let left = DVec3::new(-along.y, along.x, 0.0).normalize() * aside;
            let middle = 0.5 * (pair[0] + pair[1]);
            assert!(field.value(middle + left) < 0.0, "{pair:?}");
            assert!(field.value(middle - left) > 0.0, "{pair:?}");
        }
    }
}

#[test]
fn ambiguous_squares_follow_the_rule() {
    // Bilinear with the saddle value c at 0; the lower left and upper right corners are inside.
    for (saddle, joined) in [(-0.1, true), (0.1, false)] {
        let field = plane(|x, y| saddle - x * y);
        let options = |ambiguity| Options {
            cell: 2.0,
            ambiguity,
            ..Options::new(cube(2, -1.0, 1.0))
        };
        // Joined, the two segments cut off the corners outside: no segment passes near an inside
        // corner.
        let is_joined = |rule| {
            let options = options(rule);
            let found = curves(&field, (Method::Squares, &options), &Silent).unwrap();
            let polylines = &found.shape.polylines;
            assert_eq!(polylines.len(), 2);
            polylines.iter().all(|polyline| {
                let middle = 0.5 * (polyline.points[0] + polyline.points[1]);
                middle.x * middle.y < 0.0
            })
        };
        assert_eq!(is_joined(Ambiguity::Saddle), joined);
        assert_eq!(is_joined(Ambiguity::Subdivide), joined);
        assert!(is_joined(Ambiguity::Join));
        assert!(!is_joined(Ambiguity::Separate));
    }
}

#[test]
fn the_field_itself_decides_where_squares_are_subdivided() {
    // A bump at the centre makes F negative there, and joins what the bilinear interpolant, which
    // is 0.1 at its saddle, does not.
    let bridged = plane(|x, y| {
        let bump = (-8.0 * (x.square() + y.square())).apply(imp::graph::Op::Exp, &[]);
        0.1 - x * y - bump
    });
    let joined = |rule| {
        let options = Options {
            cell: 2.0,
            ambiguity: rule,
            ..Options::new(cube(2, -1.0, 1.0))
        };
        let found = curves(&bridged, (Method::Squares, &options), &Silent).unwrap();
        let first = &found.shape.polylines[0].points;
        let middle = 0.5 * (first[0] + first[1]);
        middle.x * middle.y < 0.0
    };
    assert!(!joined(Ambiguity::Saddle));
    assert!(joined(Ambiguity::Subdivide));
}

#[test]
fn a_saddle_through_grid_points_gives_joined_oriented_polylines() {
    let field = plane(|x, y| x * y);
    for rule in Ambiguity::NAMES.iter().map(|(rule, _)| *rule) {
        for cells in [2.0, 3.0, 8.0] {
            let options = Options {
                cell: 2.0 / cells,
                ambiguity: rule,
                ..Options::new(cube(2, -1.0, 1.0))
            };
            let found = curves(&field, (Method::Squares, &options), &Silent).unwrap();
            let length = found.shape.length();
            assert!((length - 4.0).abs() < 1.5 * options.cell, "{length}");
        }
    }
}

#[test]
fn a_circle_is_followed_once_and_closed() {
    let found = traced(&circle(1.0), (-1.3, 1.3), 0.05);
    let [polyline] = &found.shape.polylines[..] else {
        panic!("{:?}", found.shape.polylines.len());
    };
    assert!(polyline.closed);
    assert!(found.statistics.proven && !found.statistics.cut_by_box);
    // A regular polygon with 126 sides: 2π / 0.05 rounded up.
    let sides = polyline.points.len();
    assert_eq!(sides, 126);
    let angle = PI / sides as f64;
    let perimeter = 2.0 * sides as f64 * angle.sin();
    assert!((found.shape.length() - perimeter).abs() < 1e-8);
    let inscribed = sides as f64 * angle.sin() * angle.cos();
    assert!((area(&found.shape) - inscribed).abs() < 1e-8);
    for point in &polyline.points {
        assert!((point.length() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn a_level_other_than_zero_is_another_circle() {
    let options = Options {
        iso: 3.0,
        cell: 0.05,
        ..Options::new(cube(2, -3.0, 3.0))
    };
    let found = trace(&circle(1.0), &options);
    assert!((found.shape.length() / (4.0 * PI) - 1.0).abs() < 1e-3);
    assert!(found.statistics.proven);
}

/// The Cassini oval with foci (±1, 0) and product of distances b².
fn cassini(b: f64) -> impl Field {
    plane(move |x, y| {
        let square = x.square() + y.square();
        square.square() - 2.0 * (x.square() - y.square()) + (1.0 - b.powi(4))
    })
}

#[test]
fn cassini_ovals_have_one_or_two_loops() {
    for (b, loops) in [(0.9, 2), (0.999, 2), (1.001, 1), (1.2, 1), (1.6, 1)] {
        let field = cassini(b);
        let found = traced(&field, (-2.2, 2.2), 0.02);
        assert_eq!(found.shape.polylines.len(), loops, "{b}");
        assert!(found.shape.polylines.iter().all(|polyline| polyline.closed));
        assert!(found.statistics.proven, "{b}");
        assert_oriented(&field, &found.shape, 4e-3);
    }
}

#[test]
fn the_lemniscate_is_two_lobes_that_meet_in_a_crossing() {
    let field = cassini(1.0);
    let found = traced(&field, (-2.2, 2.2), 0.01);
    // 2ϖ √2 for foci at ±1; each lobe has the area 1.
    let length = 2.0 * 2.622_057_554_292_119 * std::f64::consts::SQRT_2;
    assert!((found.shape.length() / length - 1.0).abs() < 1e-4);
    assert!(
        (area(&found.shape) - 2.0).abs() < 1e-3,
        "{}",
        area(&found.shape)
    );
    assert_eq!(found.shape.polylines.len(), 2);
    for polyline in &found.shape.polylines {
        assert!(polyline.closed);
        assert!((polyline.signed_area() - 1.0).abs() < 1e-3);
        let nearest = polyline.points.iter().map(|point| point.length());
        assert!(nearest.fold(f64::INFINITY, f64::min) < 1e-6);
    }
}

#[test]
fn crossing_lines_turn_such_that_the_inside_stays_on_the_left() {
    let field = plane(|x, y| x * y);
    let found = traced(&field, (-1.0, 1.25), 0.1);
    assert!(
        (found.shape.length() - 4.5).abs() < 1e-6,
        "{}",
        found.shape.length()
    );
    assert_eq!(found.shape.polylines.len(), 2);
    assert_oriented(&field, &found.shape, 1e-4);
}

#[test]
fn a_cusp_is_a_vertex() {
    let field = plane(|x, y| y.square() - x.power(3));
    let found = traced(&field, (-1.0, 1.0), 0.05);
    let [polyline] = &found.shape.polylines[..] else {
        panic!("{:?}", found.shape.polylines);
    };
    assert!(!polyline.closed);
    // Neil's parabola y² = x³ from the cusp to x = 1: (13√13 − 8) / 27 for each branch.
    let length = 2.0 * (13.0 * 13.0_f64.sqrt() - 8.0) / 27.0;
    assert!(
        (found.shape.length() / length - 1.0).abs() < 1e-3,
        "{}",
        found.shape.length()
    );
    let nearest = polyline.points.iter().map(|point| point.length());
    assert!(nearest.fold(f64::INFINITY, f64::min) < 1e-3);
    let ends = [polyline.points[0], *polyline.points.last().unwrap()];
    assert!(
        ends.iter()
            .all(|end| end.x == 1.0 && (end.y.abs() - 1.0).abs() < 1e-12)
    );
    assert!(found.statistics.cut_by_box);
}

#[test]
fn all_components_are_found_and_that_is_proven() {
    // Two circles 1e-4 apart, and a third of radius 0.01.
    let field = plane(|x, y| {
        let ring = |cx: f64, cy: f64, r: f64| {
            (x.clone() - cx).square() + (y.clone() - cy).square() - r * r
        };
        ring(-0.500_05, 0.0, 0.5)
            .min(&ring(0.500_05, 0.0, 0.5))
            .min(&ring(0.3, 0.9, 0.01))
    });
    let found = traced(&field, (-1.3, 1.3), 0.05);
    assert_eq!(found.shape.polylines.len(), 3);
    assert!(found.statistics.proven);
    let expected = PI * (0.25 + 0.25 + 1e-4);
    assert!((area(&found.shape) / expected - 1.0).abs() < 3e-3);
    // An annulus of width 0.02: two circles, the inner one clockwise.
    let annulus = plane(|x, y| (x.square() + y.square() - 1.0).square() - 4e-4);
    let found = traced(&annulus, (-1.3, 1.3), 0.02);
    assert_eq!(found.shape.polylines.len(), 2);
    let mut areas: Vec<f64> = found
        .shape
        .polylines
        .iter()
        .map(|polyline| polyline.signed_area())
        .collect();
    areas.sort_by(f64::total_cmp);
    assert!(
        (areas[0] + PI * 0.98).abs() < 1e-3,
        "{areas:?} {:?}",
        found.statistics
    );
    assert!((areas[1] - PI * 1.02).abs() < 1e-3);
    assert!(found.statistics.proven);
}

#[test]
fn curves_that_leave_the_box_end_exactly_on_its_sides_and_can_be_closed() {
    let field = circle(1.0);
    let options = |cap| Options {
        cell: 0.02,
        cap,
        ..Options::new(imp::geometry::Bounds::from_sides(&[(-0.5, 1.5), (-1.5, 1.5)]).unwrap())
    };
    let open = trace(&field, &options(false));
    let [polyline] = &open.shape.polylines[..] else {
        panic!("{:?}", open.shape.polylines.len());
    };
    assert!(!polyline.closed && open.statistics.cut_by_box);
    let ends = [polyline.points[0], *polyline.points.last().unwrap()];
    assert!(ends.iter().all(|end| end.x == -0.5));
    assert!(
        ends.iter()
            .all(|end| (end.y.abs() - 0.75_f64.sqrt()).abs() < 1e-12)
    );
    let closed = trace(&field, &options(true));
    assert_eq!(closed.shape.polylines.len(), 1);
    assert!(closed.shape.polylines[0].closed);
    // The disk without the segment beyond x = −1/2: π − (π/3 − √3/4).
    let expected = PI - (PI / 3.0 - 3.0_f64.sqrt() / 4.0);
    assert!((area(&closed.shape) / expected - 1.0).abs() < 1e-3);
    // In a square inside of the disk nothing is cut; in one across it the corners are rounded off.
    let options = Options {
        cell: 0.02,
        cap: true,
        ..Options::new(cube(2, -0.9, 0.9))
    };
    let rounded = trace(&field, &options);
    assert_eq!(rounded.shape.polylines.len(), 1);
    // Four segments beyond 0.9 are missing: each acos 0.9 − 0.9 √0.19.
    let segment = 0.9_f64.acos() - 0.9 * 0.19_f64.sqrt();
    assert!((area(&rounded.shape) / (PI - 4.0 * segment) - 1.0).abs() < 1e-3);
    let with_hole = plane(|x, y| 0.25 - x.square() - y.square());
    let options = Options {
        cell: 0.02,
        cap: true,
        ..Options::new(cube(2, -1.0, 1.0))
    };
    let found = trace(&with_hole, &options);
    assert_eq!(found.shape.polylines.len(), 2);
    assert!((area(&found.shape) - (4.0 - 0.25 * PI)).abs() < 1e-3);
}

#[test]
fn ends_of_the_domain_and_empty_boxes_are_told() {
    // Half a circle: the root of y is not a number below.
    let half = plane(|x, y| x.square() + y.clone().square() - 1.0 + 0.0 * y.sqrt());
    let found = traced(&half, (-1.3, 1.3), 0.05);
    assert!(!found.shape.polylines.is_empty());
    assert!(
        found
            .shape
            .polylines
            .iter()
            .all(|polyline| !polyline.closed)
    );
    assert!(
        (found.shape.length() - PI).abs() < 1e-2,
        "{}",
        found.shape.length()
    );
    let options = Options::new(cube(2, -0.5, 0.5));
    let none = curves(&circle(1.0), (Method::Continuation, &options), &Silent);
    match none {
        Err(PolygonizeError::NoSurface { below, above, .. }) => {
            assert_eq!((below, above), (17 * 17, 0));
        }
        other => panic!("{other:?}"),
    }
}

fn quadtree(field: &dyn Field, bounds: (f64, f64), (cell, error): (f64, f64)) -> Made<Curves> {
    let options = Options {
        cell,
        error: Some(error),
        ..Options::new(cube(2, bounds.0, bounds.1))
    };
    curves(field, (Method::Quadtree, &options), &Silent).unwrap()
}

#[test]
fn a_quadtree_is_as_near_to_the_curve_as_was_asked_and_has_no_cracks() {
    for error in [1e-2, 1e-3, 1e-4, 1e-5] {
        let found = quadtree(&circle(1.0), (-1.3, 1.4), (0.7, error));
        let [polyline] = &found.shape.polylines[..] else {
            panic!("{:?}", found.shape.polylines.len());
        };
        assert!(polyline.closed && found.statistics.proven);
        let points = &polyline.points;
        for (at, point) in points.iter().enumerate() {
            assert!((point.length() - 1.0).abs() < 1e-8);
            let next = points[(at + 1) % points.len()];
            let sagitta = 1.0 - (0.5 * (*point + next)).length();
            assert!(sagitta <= 1.5 * error, "{sagitta} {error}");
        }
        assert!((area(&found.shape) - PI).abs() <= 2.0 * PI * error);
        // 2π over chords of √(8 error), times cells that may be half as long as would do.
        let fewest = PI / (2.0 * error).sqrt();
        assert!(
            (points.len() as f64) < 5.0 * fewest + 20.0,
            "{}",
            points.len()
        );
    }
}

#[test]
fn a_quadtree_finds_what_is_thin_and_knows_that_it_has_all() {
    let annulus = plane(|x, y| ((x.square() + y.square()).sqrt() - 1.0).abs() - 0.5e-3);
    let found = quadtree(&annulus, (-1.3, 1.4), (0.05, 1e-3));
    assert_eq!(found.shape.polylines.len(), 2);
    assert!(found.shape.polylines.iter().all(|polyline| polyline.closed));
    assert!((area(&found.shape) - 2e-3 * PI).abs() < 1e-4);
    assert!(found.statistics.proven, "{}", found.statistics.undecided);
    // A circle of radius 0.01 between the grid points of the coarse cells.
    let small = plane(|x, y| (x - 0.033).square() + (y - 0.071).square() - 1e-4);
    let found = quadtree(&small, (-1.0, 1.0), (0.5, 1e-4));
    assert_eq!(found.shape.polylines.len(), 1);
    assert!(found.statistics.proven);
    for (b, loops) in [(0.9, 2), (0.999, 2), (1.001, 1), (1.2, 1)] {
        let found = quadtree(&cassini(b), (-2.2, 2.3), (0.2, 1e-3));
        assert_eq!(found.shape.polylines.len(), loops, "{b}");
        assert!(found.statistics.proven, "{b}");
    }
}

#[test]
fn a_quadtree_stops_where_the_curve_is_singular_and_says_so() {
    let lemniscate = quadtree(&cassini(1.0), (-2.2, 2.3), (0.2, 1e-3));
    assert!(!lemniscate.statistics.proven);
    assert!((area(&lemniscate.shape) - 2.0).abs() < 5e-3);
    let cusp = plane(|x, y| y.square() - x.power(3));
    let found = quadtree(&cusp, (-1.0, 1.0), (0.2, 1e-4));
    let length = 2.0 * (13.0 * 13.0_f64.sqrt() - 8.0) / 27.0;
    assert!((found.shape.length() / length - 1.0).abs() < 1e-2);
    assert!(!found.statistics.proven && found.statistics.cut_by_box);
    // Cut by the box and closed along it.
    let options = Options {
        cell: 0.2,
        cap: true,
        ..Options::new(cube(2, -0.9, 0.9))
    };
    let rounded = curves(&circle(1.0), (Method::Quadtree, &options), &Silent).unwrap();
    let segment = 0.9_f64.acos() - 0.9 * 0.19_f64.sqrt();
    assert!((area(&rounded.shape) / (PI - 4.0 * segment) - 1.0).abs() < 2e-3);
    assert_eq!(rounded.shape.polylines.len(), 1);
}

#[test]
fn flat_regions_and_regions_without_values_have_no_curve_inside() {
    // 0 in a disk and positive outside: nothing is inside.
    let flat = plane(|x, y| {
        let outside = x.square() + y.square() - 0.5;
        outside.max(&outside.number(0.0))
    });
    let options = Options {
        cell: 0.25,
        ..Options::new(cube(2, -1.0, 1.0))
    };
    for method in [Method::Squares, Method::Quadtree, Method::Continuation] {
        let found = curves(&flat, (method, &options), &Silent);
        assert!(
            matches!(found, Err(PolygonizeError::NoSurface { .. })),
            "{method:?}"
        );
    }
    // Negative in the disk and not a number outside: the solid ends where it is defined.
    let dome = plane(|x, y| -(0.5 - x.square() - y.square()).sqrt() - 0.1);
    for method in [Method::Squares, Method::Quadtree] {
        match curves(&dome, (method, &options), &Silent) {
            Err(PolygonizeError::NoSurface { undefined, .. }) => assert!(undefined > 0),
            found => panic!("{found:?}"),
        }
    }
    // The half of a disk on which the field is defined, closed by a line.
    let half = plane(|x, y| x.square() + y.square() - 0.5 + 0.0 * y.sqrt());
    let found = curves(&half, (Method::Quadtree, &options), &Silent).unwrap();
    assert!(
        (area(&found.shape) - 0.25 * PI).abs() < 1e-2,
        "{}",
        area(&found.shape)
    );
    assert!(!found.statistics.proven && found.statistics.nan_points > 0);
}
