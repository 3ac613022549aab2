//! Plane curves.

use std::f64::consts::PI;

use crate::support::{self, Closure, Made, cube};
use glam::DVec3;
use imp::engine::{Field, Monitor, Silent};
use imp::geometry::Curves;
use imp::polygonize::{Method, Options, PolygonizeError};

fn contours(
    field: &dyn Field,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Made<Curves>, PolygonizeError> {
    support::curves(field, (Method::Squares, options), monitor)
}

/// A field in R2.
fn plane(
    function: impl Fn(f64, f64) -> (f64, [f64; 2]) + Send + Sync,
) -> Closure<impl Fn(DVec3) -> (f64, DVec3) + Send + Sync> {
    Closure {
        dimension: 2,
        function: move |p: DVec3| {
            let (value, [x, y]) = function(p.x, p.y);
            (value, DVec3::new(x, y, 0.0))
        },
    }
}

/// The circle of radius 1.
fn circle() -> impl Field {
    plane(|x, y| (x * x + y * y - 1.0, [2.0 * x, 2.0 * y]))
}

/// The Cassini oval with foci (±1, 0) and product of distances b².
fn cassini(b: f64) -> impl Field {
    plane(move |x, y| {
        let (left, right) = ((x - 1.0).powi(2) + y * y, (x + 1.0).powi(2) + y * y);
        let gradient = [
            2.0 * (x - 1.0) * right + 2.0 * (x + 1.0) * left,
            2.0 * y * (left + right),
        ];
        (left * right - b.powi(4), gradient)
    })
}

fn run(field: &dyn Field, low: f64, high: f64, cells: usize, cap: bool) -> Made<Curves> {
    let options = Options {
        cell: (high - low) / cells as f64,
        cap,
        ..Options::new(cube(2, low, high))
    };
    contours(field, &options, &Silent).unwrap()
}

/// The signed areas of all polylines together.
fn area(contours: &Made<Curves>) -> f64 {
    let polylines = contours.shape.polylines.iter();
    polylines.map(|polyline| polyline.signed_area()).sum()
}

#[test]
fn a_circle_is_one_closed_counter_clockwise_polyline() {
    let found = run(&circle(), -1.3, 1.3, 64, false);
    assert_eq!(found.shape.polylines.len(), 1);
    assert!(found.shape.polylines[0].closed);
    assert!(!found.statistics.cut_by_box);
    // Inscribed polygon with sides of at most 1.5 cells: relative error below (1.5 h)² / 24.
    assert!((found.shape.length() / (2.0 * PI) - 1.0).abs() < 2e-4);
    assert!((area(&found) / PI - 1.0).abs() < 4e-4);
    for point in &found.shape.polylines[0].points {
        assert!((point.length() - 1.0).abs() <= 1e-9 * 2.6 * 1.5);
    }
}

#[test]
fn cassini_ovals_split_and_join() {
    // The lemniscate (b = 1) has length 2ϖ, where ϖ = 2.622057554... is the lemniscate constant
    // for unit half-width; here the half-width is √2, hence 2√2 ϖ = 7.416298709, and area 2.
    let lemniscate = run(&cassini(1.0), -2.0, 2.0, 200, false);
    assert!((lemniscate.shape.length() / 7.416_298_709 - 1.0).abs() < 1e-3);
    assert!((area(&lemniscate) / 2.0 - 1.0).abs() < 1e-3);

    let two = run(&cassini(0.9), -2.0, 2.0, 101, false);
    assert_eq!(two.shape.polylines.len(), 2);
    let one = run(&cassini(1.1), -2.0, 2.0, 101, false);
    assert_eq!(one.shape.polylines.len(), 1);
    assert!(
        two.shape
            .polylines
            .iter()
            .chain(&one.shape.polylines)
            .all(|oval| oval.closed)
    );
}

#[test]
fn the_box_leaves_curves_open_or_caps_them() {
    // The box cuts the disk of radius 1 to the square |x|, |y| ≤ 0.8 with four rounded corners.
    let open = run(&circle(), -0.8, 0.8, 40, false);
    assert_eq!(open.shape.polylines.len(), 4);
    assert!(open.shape.polylines.iter().all(|polyline| !polyline.closed));
    assert!(open.statistics.cut_by_box);
    let arc = 4.0 * (0.8f64.asin() - 0.8f64.acos());
    assert!((open.shape.length() / arc - 1.0).abs() < 1e-3);

    let capped = run(&circle(), -0.8, 0.8, 40, true);
    assert_eq!(capped.shape.polylines.len(), 1);
    assert!(capped.shape.polylines[0].closed);
    assert!(capped.statistics.cut_by_box);
    assert_eq!(capped.statistics.poor_roots, 0);
    // Four sides of 2 · 0.6 in all and the arcs; the area by integration in the first quadrant.
    assert!((capped.shape.length() / (arc + 4.0 * 1.2) - 1.0).abs() < 1e-3);
    let segment = |x: f64| 0.5 * (x * (1.0 - x * x).sqrt() + x.asin());
    let quarter = 0.6 * 0.8 + segment(0.8) - segment(0.6);
    assert!((area(&capped) / (4.0 * quarter) - 1.0).abs() < 1e-3);
    let bounds = cube(2, -0.8, 0.8);
    assert!(
        capped.shape.polylines[0]
            .points
            .iter()
            .all(|&point| bounds.contains(point))
    );
}

#[test]
fn a_level_through_grid_points_makes_no_repeated_points() {
    // |x| + |y| = 1 and a grid with all its corners and many points on the sides.
    let diamond = plane(|x, y| (x.abs() + y.abs() - 1.0, [x.signum(), y.signum()]));
    let found = run(&diamond, -2.0, 2.0, 16, false);
    assert_eq!(found.shape.polylines.len(), 1);
    let points = &found.shape.polylines[0].points;
    assert_eq!(points.len(), 16);
    assert_eq!(found.shape.length(), 4.0 * std::f64::consts::SQRT_2);
    assert_eq!(area(&found), 2.0);
}

#[test]
fn inside_corners_across_a_diagonal_are_separated() {
    // The saddle xy on one square: inside at two opposite corners.
    let saddle = plane(|x, y| (x * y + 0.01, [y, x]));
    let found = run(&saddle, -1.0, 1.0, 1, false);
    assert_eq!(found.shape.polylines.len(), 2);
    // Each segment has its inside corner, (1, −1) or (−1, 1), on the left.
    for polyline in &found.shape.polylines {
        let (from, to) = (polyline.points[0], polyline.points[1]);
        let corner = if from.x + to.x > 0.0 {
            DVec3::new(1.0, -1.0, 0.0)
        } else {
            DVec3::new(-1.0, 1.0, 0.0)
        };
        assert!((to - from).cross(corner - from).z > 0.0);
    }
}

#[test]
fn many_random_squares_give_closed_disjoint_curves() {
    // A random sign at every grid point, by a hash of its indices; capped, so that all is closed.
    for seed in 0..500u64 {
        let corner = move |i: i64, j: i64| {
            let mixed =
                (seed << 16 ^ (i as u64) << 8 ^ j as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            if (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 63 == 0 {
                -1.0
            } else {
                1.0
            }
        };
        let field = plane(move |x, y| {
            let (i, j) = (x.floor().min(5.0), y.floor().min(5.0));
            let (u, v) = (x - i, y - j);
            let (i, j) = (i as i64, j as i64);
            let low = corner(i, j) * (1.0 - u) + corner(i + 1, j) * u;
            let high = corner(i, j + 1) * (1.0 - u) + corner(i + 1, j + 1) * u;
            let slope = (corner(i + 1, j) - corner(i, j)) * (1.0 - v)
                + (corner(i + 1, j + 1) - corner(i, j + 1)) * v;
            (low * (1.0 - v) + high * v, [slope, high - low])
        });
        let options = Options {
            cell: 1.0,
            cap: true,
            ..Options::new(cube(2, 0.0, 6.0))
        };
        let found = contours(&field, &options, &Silent).unwrap();
        assert!(found.shape.polylines.iter().all(|polyline| polyline.closed));
        // The solid area by counting: a lone corner within a square takes 1/8, and so on; the
        // sum over squares is what the signed areas must come to.
        let mut expected = 0.0;
        for (i, j) in (0..6).flat_map(|i| (0..6).map(move |j| (i, j))) {
            let inside = |i, j| corner(i, j) < 0.0;
            let corners = [
                inside(i, j),
                inside(i + 1, j),
                inside(i + 1, j + 1),
                inside(i, j + 1),
            ];
            let count = corners.iter().filter(|&&corner| corner).count();
            expected += [
                0.0,
                0.125,
                if corners[0] == corners[2] { 0.25 } else { 0.5 },
                0.875,
                1.0,
            ][count];
        }
        assert!((area(&found) - expected).abs() < 1e-9, "seed {seed}");
    }
}

#[test]
fn undefined_regions_count_as_outside_and_are_counted() {
    // A disk of which F is defined only for x < 0.5: the end of the domain closes the curve.
    let field = plane(|x, y| {
        if x < 0.5 {
            (x * x + y * y - 1.0, [2.0 * x, 2.0 * y])
        } else {
            (f64::NAN, [f64::NAN; 2])
        }
    });
    let found = run(&field, -1.3, 1.3, 50, false);
    assert_eq!(found.shape.polylines.len(), 1);
    assert!(found.shape.polylines[0].closed);
    assert_eq!(
        found.statistics.nan_points,
        51 * (0..=50)
            .filter(|&i| -1.3 + 0.052 * f64::from(i) >= 0.5)
            .count()
    );
    assert!(found.statistics.poor_roots > 0);
    assert_eq!(found.statistics.domain_ends, found.statistics.poor_roots);
    let expected = PI - (PI / 3.0 - 0.5 * 0.75f64.sqrt());
    assert!((area(&found) / expected - 1.0).abs() < 1e-2);
}

#[test]
fn poles_and_jumps_alone_are_no_curve() {
    let pole = plane(|x, _| (1.0 / x, [-1.0 / (x * x), 0.0]));
    let jump = plane(|x, _| (if x > 0.01 { 1.0 } else { -1.0 }, [0.0; 2]));
    for field in [&pole as &dyn Field, &jump] {
        for (high, cap) in [(1.0, false), (1.0, true), (1.1, false), (1.1, true)] {
            let options = Options {
                cap,
                ..Options::new(cube(2, -1.0, high))
            };
            let result = contours(field, &options, &Silent);
            assert!(
                matches!(result, Err(PolygonizeError::NoSurface { .. })),
                "{result:?}"
            );
        }
    }
}

#[test]
fn thread_counts_give_the_same_curves() {
    let results: Vec<Made<Curves>> = [1, 2, 4]
        .into_iter()
        .map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| run(&cassini(1.05), -2.0, 2.0, 333, true))
        })
        .collect();
    assert_eq!(results[0], results[1]);
    assert_eq!(results[0], results[2]);
}

#[test]
fn a_field_without_a_zero_is_an_error() {
    let field = plane(|x, y| (x * x + y * y + 1.0, [2.0 * x, 2.0 * y]));
    let error = contours(&field, &Options::new(cube(2, -1.0, 1.0)), &Silent).unwrap_err();
    let PolygonizeError::NoSurface {
        below: 0,
        above: 4225,
        undefined: 0,
        ..
    } = error
    else {
        panic!("{error:?}");
    };
}
