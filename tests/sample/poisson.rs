//! Poisson-disk samples: exactly as many as wanted, none close to another, no gap.

use std::f64::consts::PI;

use glam::DVec3;
use imp::engine::Field;
use imp::geometry::Samples;
use imp::graph::Op;
use imp::sample::{Method, Options};

use crate::fields::*;

fn poisson(field: &dyn Field, half: f64, count: u64) -> Samples {
    let options = Options {
        method: Method::Poisson,
        bounds: Some(cube(field.dimension(), half)),
        count: Some(count),
        seed: 1,
        ..Options::default()
    };
    let outcome = run(field, &options);
    assert_eq!(outcome.samples.positions.len() as u64, count);
    assert!(outcome.statistics.converged);
    assert!(outcome.statistics.max_residual < 1e-12);
    outcome.samples
}

fn least_distance(positions: &[DVec3]) -> f64 {
    let mut least = f64::INFINITY;
    for (index, one) in positions.iter().enumerate() {
        for other in &positions[..index] {
            least = least.min(one.distance(*other));
        }
    }
    least
}

/// The largest distance from any of the places to the nearest point.
fn cover(positions: &[DVec3], places: impl Iterator<Item = DVec3>) -> f64 {
    let nearest = |place: DVec3| {
        let distances = positions.iter().map(|p| p.distance(place));
        distances.fold(f64::INFINITY, f64::min)
    };
    places.map(nearest).fold(0.0, f64::max)
}

/// Places all over the unit sphere: a Fibonacci lattice.
fn lattice(number: u32) -> impl Iterator<Item = DVec3> {
    let turn = PI * (3.0 - 5.0_f64.sqrt());
    (0..number).map(move |index| {
        let z = 1.0 - (2.0 * f64::from(index) + 1.0) / f64::from(number);
        let (sine, cosine) = (turn * f64::from(index)).sin_cos();
        let ring = (1.0 - z * z).sqrt();
        DVec3::new(ring * cosine, ring * sine, z)
    })
}

#[test]
fn points_on_the_sphere_are_apart_and_leave_no_gap() {
    let count = 600;
    let samples = poisson(&ellipsoid(&[1.0; 3]), 1.2, count);
    // The spacing of the hexagonal pattern on the same area.
    let ideal = (4.0 * PI / (0.75_f64.sqrt() * count as f64)).sqrt();
    let least = least_distance(&samples.positions);
    assert!(least >= 0.79 * ideal, "{}", least / ideal);
    // The covering radius over the packing radius.
    let ratio = cover(&samples.positions, lattice(20_000)) / (0.5 * least);
    assert!(ratio <= 2.2, "{ratio}");
}

#[test]
fn points_on_a_curve_are_apart_too() {
    let samples = poisson(&ellipsoid(&[1.0, 1.0]), 1.2, 200);
    let ideal = 2.0 * PI / 200.0;
    let least = least_distance(&samples.positions);
    assert!(least >= 0.75 * ideal, "{}", least / ideal);
    let places = (0..5000).map(|step| {
        let (sine, cosine) = (2.0 * PI * f64::from(step) / 5000.0).sin_cos();
        DVec3::new(cosine, sine, 0.0)
    });
    assert!(cover(&samples.positions, places) <= 0.8 * ideal);
}

#[test]
fn close_sheets_are_sampled_each_for_itself() {
    // |z| = 0.005, much closer than the points of one sheet.
    let field = compiled(3, |graph, [_, _, z]| {
        let magnitude = graph.apply(Op::Abs, &[z]);
        let half = graph.constant(0.005);
        graph.apply(Op::Subtract, &[magnitude, half])
    });
    let samples = poisson(&field, 1.0, 400);
    for sign in [-1.0, 1.0] {
        let sheet: Vec<DVec3> = (samples.positions.iter().copied())
            .filter(|p| p.z * sign > 0.0)
            .collect();
        // A random split would deviate by 10.
        assert!(sheet.len().abs_diff(200) <= 12, "{}", sheet.len());
        let ideal = (4.0 / (0.75_f64.sqrt() * 200.0)).sqrt();
        assert!(least_distance(&sheet) >= 0.75 * ideal);
        let places = (0..2500).map(|step| {
            let (column, row) = (f64::from(step % 50), f64::from(step / 50));
            DVec3::new(
                0.02 + 0.04 * column - 1.0,
                0.02 + 0.04 * row - 1.0,
                sign * 0.005,
            )
        });
        assert!(cover(&sheet, places) <= ideal);
    }
}

#[test]
fn fewer_points_than_make_a_pattern_are_no_problem() {
    for count in [1, 2, 3, 7] {
        poisson(&compiled_torus(), 1.4, count);
    }
}
