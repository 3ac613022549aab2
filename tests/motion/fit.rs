//! Fits.

use glam::DVec3;
use nalgebra::{DMatrix, DVector};

use imp::engine::{CompiledField, Field, Monitor, Silent};
use imp::graph::Op;
use imp::motion::{End, Fit, FitOptions, Freedom, MotionError, fit};

use crate::expressions::Random;
use crate::fields::{at, blobs, field, on_surface, perturbed, sphere, sphere_distance};

fn fitted(field: &CompiledField, points: &[DVec3]) -> Fit {
    fitted_with(field, points, &Freedom::all(field.parameters().len()))
}

fn fitted_with(field: &CompiledField, points: &[DVec3], freedom: &Freedom) -> Fit {
    fit(field, points, freedom, &FitOptions::default(), &Silent).unwrap()
}

fn assert_near(found: &[f64], truth: &[f64], tolerance: f64) {
    assert_eq!(found.len(), truth.len());
    for (found, truth) in found.iter().zip(truth) {
        assert!((found - truth).abs() <= tolerance, "{found} {truth}");
    }
}

/// Points at distance 1.5 from (3, -2, 1) and by up to `noise` off.
fn around_a_sphere(count: usize, noise: f64, seed: u64) -> Vec<DVec3> {
    let random = &mut Random(seed);
    let mut point = || {
        let mut number = || random.uniform(-1.0, 1.0);
        let direction = DVec3::new(number(), number(), number()).normalize();
        DVec3::new(3.0, -2.0, 1.0) + (1.5 + noise * number()) * direction
    };
    (0..count).map(|_| point()).collect()
}

#[test]
fn a_sphere_is_found_from_far_away() {
    let points = around_a_sphere(50, 0.0, 1);
    for field in [
        sphere(&[0.0, 0.0, 0.0, 0.1]),
        sphere_distance(&[0.0, 0.0, 0.0, 0.1]),
    ] {
        let found = fitted(&field, &points);
        assert_near(&found.q, &[3.0, -2.0, 1.0, 1.5], 1e-12);
        assert_eq!((found.end, found.rank), (End::OnSurface, 4));
        assert!(found.undetermined.is_empty());
        assert!(found.max <= 1e-12 && found.rms <= found.max);
    }
}

#[test]
fn noisy_points_have_the_sphere_of_least_distances() {
    let points = around_a_sphere(200, 0.05, 2);
    // By Gauss and Newton with singular values; F = |x - c| - r has |F_x| = 1, so its distances are
    // exact.
    let mut q = DVector::from_vec(vec![2.9, -2.1, 1.1, 1.4]);
    for _ in 0..60 {
        let mut jacobian = DMatrix::zeros(points.len(), 4);
        let mut residuals = DVector::zeros(points.len());
        for (index, point) in points.iter().enumerate() {
            let from = *point - DVec3::new(q[0], q[1], q[2]);
            residuals[index] = from.length() - q[3];
            let normal = from / from.length();
            let row = [-normal.x, -normal.y, -normal.z, -1.0];
            (0..4).for_each(|place| jacobian[(index, place)] = row[place]);
        }
        q -= jacobian.pseudo_inverse(1e-12).unwrap() * residuals;
    }
    let found = fitted(&sphere_distance(&[2.0, 0.0, 0.0, 1.0]), &points);
    assert_eq!(found.end, End::Stationary);
    // The sum of squares is flat to rounding within the root of ε of its least value.
    assert_near(&found.q, q.as_slice(), 1e-8);
    let centre = DVec3::new(q[0], q[1], q[2]);
    let distances = points
        .iter()
        .map(|point| ((*point - centre).length() - q[3]).abs());
    let squares: f64 = distances.clone().map(|distance| distance * distance).sum();
    assert!((found.rms - (squares / 200.0).sqrt()).abs() < 1e-9);
    assert!((found.max - distances.fold(0.0, f64::max)).abs() < 1e-7);

    // In terms of squares the result is where Σ (d² - r²)/d² vanishes. With d = r + e and variance σ²
    // of e the mean of 1/d² is (1 + 3σ²/r²)/r², which makes the radius less by 3σ²/2r = 0.05²/2r.
    let algebraic = fitted(&sphere(&[2.0, 0.0, 0.0, 1.0]), &points);
    assert_eq!(algebraic.end, End::Stationary);
    assert_near(&algebraic.q[..3], &q.as_slice()[..3], 1e-3);
    assert!((algebraic.q[3].abs() - (q[3] - 0.05 * 0.05 / 3.0)).abs() < 2e-4);
}

#[test]
fn a_plane_is_that_of_linear_regression() {
    // F = z - a x - b y - c, where all points have the same slope: least squares in z.
    let plane = field(3, &[0.0; 3], |graph| {
        let [x, y, z] = [0, 1, 2].map(|axis| graph.coordinate(axis));
        let [a, b, c] = [0, 1, 2].map(|index| graph.parameter(index));
        let along = [
            graph.apply(Op::Multiply, &[a, x]),
            graph.apply(Op::Multiply, &[b, y]),
            c,
        ];
        along
            .into_iter()
            .fold(z, |sum, part| graph.apply(Op::Subtract, &[sum, part]))
    });
    let random = &mut Random(4);
    let mut number = || random.uniform(-1.0, 1.0);
    let points: Vec<DVec3> = (0..60)
        .map(|_| {
            let (x, y) = (number(), number());
            DVec3::new(x, y, 2.0 * x - 3.0 * y + 5.0 + 0.1 * number())
        })
        .collect();
    let rows = DMatrix::from_fn(60, 3, |row, column| match column {
        2 => 1.0,
        axis => points[row][axis],
    });
    let heights = DVector::from_iterator(60, points.iter().map(|point| point.z));
    let truth = rows.pseudo_inverse(1e-12).unwrap() * heights;
    let found = fitted(&plane, &points);
    assert_eq!(found.end, End::Stationary);
    assert_near(&found.q, truth.as_slice(), 1e-9);
}

#[test]
fn three_points_make_a_circle_and_two_leave_it_open() {
    // Through (0, 0), (4, 0) and (0, 2): centre (2, 1), radius √5.
    let points = [DVec3::ZERO, 4.0 * DVec3::X, 2.0 * DVec3::Y];
    let start = sphere(&[1.0, 1.0, 1.0]);
    let found = fitted(&start, &points);
    assert_near(&found.q, &[2.0, 1.0, 5.0_f64.sqrt()], 1e-12);
    // Through two of them any circle with its centre on x = 2.
    let found = fitted(&start, &points[..2]);
    assert_eq!((found.end, found.rank), (End::OnSurface, 2));
    assert!((found.q[0] - 2.0).abs() < 1e-12);
    assert_eq!(found.undetermined, [1, 2]);
    // A single one, and as many as none.
    let found = fitted(&start, &points[2..]);
    assert_eq!((found.end, found.rank), (End::OnSurface, 1));
    assert_eq!(fitted(&start, &[]).end, End::Undefined);
}

#[test]
fn parameters_of_blobs_are_recovered() {
    let truth = blobs();
    let points = on_surface(&truth, 1000, 1.2, &mut Random(7));
    let start = at(&truth, &perturbed(truth.parameters(), 0.03, &mut Random(8)));
    let found = fitted(&start, &points);
    assert!(found.converged(), "{:?}", found.end);
    assert!(found.max < 1e-11, "{:e}", found.max);
    assert_eq!((found.rank, found.undetermined.len()), (57, 0));
    assert_near(&found.q, truth.parameters(), 1e-7);
}

#[test]
fn few_points_leave_most_of_blobs_open() {
    let truth = blobs();
    let points = on_surface(&truth, 10, 1.2, &mut Random(7));
    let q = perturbed(truth.parameters(), 0.03, &mut Random(8));
    let found = fitted(&at(&truth, &q), &points);
    assert_eq!((found.end, found.rank), (End::OnSurface, 10));
    assert!(found.undetermined.len() > 40);
}

#[test]
fn a_factor_of_f_is_not_made_small() {
    // s (|x - c|² - r²), where s = 0 would satisfy everything.
    let scaled = field(3, &[0.2, -0.1, 0.3, 2.0, 1.0], |graph| {
        let mut sum = graph.constant(0.0);
        for axis in 0..3 {
            let coordinate = graph.coordinate(axis);
            let centre = graph.parameter(axis);
            let difference = graph.apply(Op::Subtract, &[coordinate, centre]);
            let square = graph.apply(Op::Square, &[difference]);
            sum = graph.apply(Op::Add, &[sum, square]);
        }
        let radius = graph.parameter(3);
        let radius = graph.apply(Op::Square, &[radius]);
        let sum = graph.apply(Op::Subtract, &[sum, radius]);
        let factor = graph.parameter(4);
        graph.apply(Op::Multiply, &[factor, sum])
    });
    let found = fitted(&scaled, &around_a_sphere(40, 0.0, 3));
    assert_eq!(found.end, End::OnSurface);
    assert_near(&found.q[..3], &[3.0, -2.0, 1.0], 1e-11);
    assert!((found.q[3].abs() - 1.5).abs() < 1e-11);
    assert!(found.q[4].abs() > 0.1, "{}", found.q[4]);
    assert_eq!((found.rank, &found.undetermined[..]), (4, &[4][..]));
    // Also where no sphere meets the points.
    let noisy = fitted(&scaled, &around_a_sphere(40, 0.05, 3));
    assert!(noisy.converged(), "{:?}", noisy.end);
    assert_near(&noisy.q[..3], &[3.0, -2.0, 1.0], 0.05);
    assert!(noisy.q[4].abs() > 0.1, "{}", noisy.q[4]);
}

#[test]
fn where_there_is_no_surface_that_is_said() {
    // q (x - 1) with q = 0, and q itself.
    let nothing = field(1, &[0.0], |graph| {
        let x = graph.coordinate(0);
        let one = graph.constant(1.0);
        let difference = graph.apply(Op::Subtract, &[x, one]);
        let factor = graph.parameter(0);
        graph.apply(Op::Multiply, &[factor, difference])
    });
    let points = [2.0 * DVec3::X, 3.0 * DVec3::X];
    let found = fitted(&nothing, &points);
    assert_eq!((found.end, &found.q[..]), (End::Flat, &[0.0][..]));
    let found = fitted(&at(&nothing, &[1.0]), &points);
    assert!(!matches!(found.end, End::OnSurface | End::Flat));
    assert!(found.q[0].abs() > 0.1, "{:?}", found.q);
    let constant = field(2, &[3.0], |graph| graph.parameter(0));
    assert_eq!(fitted(&constant, &points).end, End::Flat);
}

#[test]
fn parameters_that_cannot_be_told_apart_are_named() {
    // x² + y² - (q₀ + q₁)² + 0 q₂: only a sum is determined, and q₂ not at all.
    let circle = field(2, &[1.0, 2.0, 7.0], |graph| {
        let squares = [0, 1].map(|axis| {
            let coordinate = graph.coordinate(axis);
            graph.apply(Op::Square, &[coordinate])
        });
        let [a, b, c] = [0, 1, 2].map(|index| graph.parameter(index));
        let radius = graph.apply(Op::Add, &[a, b]);
        let radius = graph.apply(Op::Square, &[radius]);
        let sum = graph.apply(Op::Add, &squares);
        let zero = graph.constant(0.0);
        let nothing = graph.apply(Op::Multiply, &[zero, c]);
        let sum = graph.apply(Op::Subtract, &[sum, radius]);
        graph.apply(Op::Add, &[sum, nothing])
    });
    let points: Vec<DVec3> = (0..7)
        .map(|index| 2.0 * DVec3::new(f64::cos(index.into()), f64::sin(index.into()), 0.0))
        .collect();
    let found = fitted(&circle, &points);
    assert_eq!((found.rank, &found.undetermined[..]), (1, &[0, 1, 2][..]));
    // From 3 to 2, by the same amount each.
    assert_near(&found.q, &[0.5, 1.5, 7.0], 1e-12);
}

#[test]
fn frozen_parameters_and_ranges_are_kept() {
    let points = around_a_sphere(50, 0.0, 1);
    let start = sphere_distance(&[0.1 + 0.2, 0.0, 0.0, 0.1]);
    let freedom = Freedom::all(4).with_frozen(0).with_range(3, 0.0, 1.25);
    let found = fitted_with(&start, &points, &freedom);
    assert_eq!(found.q[0].to_bits(), (0.1_f64 + 0.2).to_bits());
    assert!(found.q[3] <= 1.25);
    // A fixed centre off the points: the best radius is the mean distance.
    let freedom = (0..3).fold(Freedom::all(4), Freedom::with_frozen);
    let found = fitted_with(&at(&start, &[3.2, -2.0, 1.0, 0.1]), &points, &freedom);
    let distances = points
        .iter()
        .map(|point| (*point - DVec3::new(3.2, -2.0, 1.0)).length());
    assert!((found.q[3] - distances.sum::<f64>() / 50.0).abs() < 1e-9);
    assert_eq!(found.end, End::Stationary);
    // A range that excludes it ends at the bound.
    let freedom = freedom.with_range(3, 0.0, 1.25);
    let found = fitted_with(&at(&start, &[3.0, -2.0, 1.0, 0.1]), &points, &freedom);
    assert_eq!((found.q[3], found.end), (1.25, End::Stationary));
    assert_eq!(found.at_bounds, [3]);
    assert!((found.max - 0.25).abs() < 1e-12);
    let frozen = (0..4).fold(Freedom::all(4), Freedom::with_frozen);
    let found = fitted_with(&start, &points, &frozen);
    assert_eq!(
        (found.end, found.rank, found.iterations),
        (End::Frozen, 0, 0)
    );
    let wrong = fit(
        &start,
        &points,
        &Freedom::all(3),
        &FitOptions::default(),
        &Silent,
    );
    assert!(matches!(
        wrong,
        Err(MotionError::Length {
            found: 3,
            expected: 4,
            ..
        })
    ));
}

#[test]
fn points_that_are_not_numbers_are_left_out() {
    let mut points = around_a_sphere(50, 0.0, 1);
    points.insert(7, DVec3::NAN);
    points.push(DVec3::INFINITY);
    let found = fitted(&sphere(&[0.0, 0.0, 0.0, 0.1]), &points);
    assert_eq!((found.end, found.undefined), (End::OnSurface, 2));
    assert_near(&found.q, &[3.0, -2.0, 1.0, 1.5], 1e-12);
    let found = fitted(&sphere(&[0.0; 4]), &points[7..8]);
    assert_eq!((found.end, found.undefined), (End::Undefined, 1));
    // A q at which F is undefined everywhere stays.
    let found = fitted(&sphere(&[f64::NAN, 0.0, 0.0, 1.0]), &points);
    assert_eq!((found.end, found.undefined), (End::Undefined, 52));
}

#[test]
fn fits_have_the_same_bits_on_any_number_of_threads() {
    let truth = blobs();
    let points = on_surface(&truth, 300, 1.2, &mut Random(17));
    let start = at(
        &truth,
        &perturbed(truth.parameters(), 0.03, &mut Random(18)),
    );
    let bits = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let found = pool.unwrap().install(|| fitted(&start, &points));
        found.q.iter().map(|q| q.to_bits()).collect::<Vec<u64>>()
    };
    let one = bits(1);
    assert_eq!(bits(2), one);
    assert_eq!(bits(4), one);
}

/// Has had enough.
struct Impatient;

impl Monitor for Impatient {
    fn progress(&self, _phase: &str, _fraction: f64) {}

    fn cancelled(&self) -> bool {
        true
    }
}

#[test]
fn a_fit_can_be_stopped() {
    let points = around_a_sphere(50, 0.0, 1);
    let start = sphere(&[0.0, 0.0, 0.0, 0.1]);
    let freedom = Freedom::all(4);
    let found = fit(
        &start,
        &points,
        &freedom,
        &FitOptions::default(),
        &Impatient,
    )
    .unwrap();
    assert_eq!(
        (found.end, &found.q[..]),
        (End::Cancelled, start.parameters())
    );
    let options = FitOptions {
        iterations: 2,
        ..FitOptions::default()
    };
    let found = fit(&start, &points, &freedom, &options, &Silent).unwrap();
    assert_eq!((found.end, found.iterations), (End::Iterations, 2));
}

/// A first step that a range cuts must not end the search: from far away the best linear guess is a
/// negative radius.
#[test]
fn a_range_on_the_way_does_not_end_the_fit() {
    let points = [
        DVec3::new(1.0, 0.0, 0.0),
        DVec3::new(3.0, 0.0, 0.0),
        DVec3::new(2.0, 1.0, 0.0),
        DVec3::new(2.0, 0.0, 1.0),
    ];
    let field = sphere_distance(&[0.0, 0.0, 0.0, 0.5]);
    let freedom = Freedom::all(4).with_range(3, 0.2, 3.0);
    let fit = fit(&field, &points, &freedom, &FitOptions::default(), &Silent).unwrap();
    assert_eq!(fit.end, End::OnSurface);
    for (found, expected) in fit.q.iter().zip([2.0, 0.0, 0.0, 1.0]) {
        assert!((found - expected).abs() < 1e-9, "{:?}", fit.q);
    }
}
