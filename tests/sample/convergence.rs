//! Particles of every kind arrive, without a step size or a box being given.

use glam::DVec3;
use imp::engine::{Field, Silent};
use imp::sample::{Method, Options, Potential, SampleError, sample};

use crate::fields::*;

/// Surfaces that are smooth, singular, creased, cut out of an endless one, and a curve.
fn scenes() -> Vec<(&'static str, Box<dyn Field>)> {
    let egg = |p: DVec3| {
        let (across, bulge) = (p.x * p.x + p.y * p.y, 1.0 / (1.0 + 0.2 * p.z));
        let along = p.z - 0.2 * across * bulge * bulge;
        let gradient = DVec3::new(2.0 * p.x * bulge, 2.0 * p.y * bulge, along);
        (across * bulge + 0.5 * p.z * p.z - 1.0, gradient)
    };
    let cassini = |p: DVec3| {
        // The product of the squared distances from (±1, 0) is 1.02.
        let [one, other] = [p - DVec3::X, p + DVec3::X];
        let [near, far] = [one, other].map(DVec3::length_squared);
        (near * far - 1.02, 2.0 * (one * far + other * near))
    };
    let gyroid_in_ball = |p: DVec3| {
        let q = 3.0 * p;
        let [sx, sy, sz] = q.to_array().map(f64::sin);
        let [cx, cy, cz] = q.to_array().map(f64::cos);
        let gyroid = sx * cy + sy * cz + sz * cx;
        let slope = DVec3::new(cx * cy - sz * sx, cy * cz - sx * sy, cz * cx - sy * sz);
        let ball = p.length() - 1.5;
        match gyroid > ball {
            true => (gyroid, 3.0 * slope),
            false => (ball, p.normalize()),
        }
    };
    let cube = |p: DVec3| {
        let side = p.abs().to_array();
        let axis = (0..3).fold(
            0,
            |most, axis| if side[axis] > side[most] { axis } else { most },
        );
        (side[axis] - 1.0, p[axis].signum() * DVec3::AXES[axis])
    };
    vec![
        ("sphere", Box::new(sphere(DVec3::ZERO, 1.0))),
        ("torus", Box::new(torus())),
        ("egg", Box::new(field(3, egg))),
        ("blobs", Box::new(blobs())),
        ("heart", Box::new(heart())),
        ("cassini", Box::new(field(2, cassini))),
        ("gyroid", Box::new(field(3, gyroid_in_ball))),
        ("cube", Box::new(field(3, cube))),
    ]
}

#[test]
fn ninety_nine_in_a_hundred_particles_arrive_to_the_last_digits() {
    for (name, field) in scenes() {
        for method in [Method::Kinematic, Method::Dynamic] {
            for potential in [Potential::Absolute, Potential::Square] {
                let options = Options {
                    method,
                    potential,
                    count: Some(1000),
                    tolerance: 1e-12,
                    ..Options::default()
                };
                let outcome = sample(&*field, &options, &Silent).unwrap();
                let told = &outcome.statistics;
                let case = format!("{name} {method:?} {potential:?}: {told:?}");
                assert!(told.points >= 990 && told.settled, "{case}");
                assert!(
                    told.max_residual <= 1e-12 * told.bounds.diagonal(),
                    "{case}"
                );
                // A step costs one evaluation; starts and the polish take the rest.
                assert!(told.evaluations > told.steps, "{case}");
                assert!(
                    2 * told.steps > told.evaluations || name == "heart",
                    "{case}"
                );
            }
        }
    }
}

#[test]
fn the_square_potential_finds_the_same_points_of_a_curve_and_spurious_ones_as_well() {
    let run = |potential| {
        let options = Options {
            method: Method::Kinematic,
            potential,
            bounds: Some(cube(2, 3.0)),
            ..Options::default()
        };
        sample(&spurious_circle(), &options, &Silent).unwrap()
    };
    for potential in [Potential::Absolute, Potential::Square] {
        let outcome = run(potential);
        assert!(outcome.statistics.dropped.spurious > 100);
        let on_circle = |p: &DVec3| (p.length() - 1.0).abs() < 1e-7;
        assert!(outcome.samples.positions.iter().all(on_circle));
        assert!(outcome.statistics.points > 300);
    }
}

#[test]
fn other_methods_have_no_potential() {
    let options = Options {
        potential: Potential::Square,
        ..Options::default()
    };
    let error = sample(&torus(), &options, &Silent).unwrap_err();
    let SampleError::Option { option, .. } = error else {
        panic!("{error}");
    };
    assert_eq!(option, "potential");
}
