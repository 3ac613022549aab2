//! Floaters whose spacing changes from place to place, and floaters from given seeds.

use std::sync::Arc;

use glam::DVec3;
use imp::engine::{Field, Silent};
use imp::sample::{Options, SampleError, Varying, sample};

use crate::fields::*;

/// The mean distance of each point to its nearest others, of which it has `count`.
fn near(positions: &[DVec3], count: usize) -> Vec<f64> {
    let of = |point: &DVec3| {
        let mut distances: Vec<f64> = positions.iter().map(|p| p.distance(*point)).collect();
        distances.sort_by(f64::total_cmp);
        distances[1..=count].iter().sum::<f64>() / count as f64
    };
    positions.iter().map(of).collect()
}

/// Three times as wide at the one end of the last axis as at the other.
fn graded(dimension: usize) -> (Varying, impl Fn(DVec3) -> f64) {
    let axis = dimension - 1;
    let wanted = move |p: DVec3| 0.02 * (2.0 + p[axis]);
    let slope = DVec3::AXES[axis] * 0.02;
    let field = field(dimension, move |p| (wanted(p), slope));
    (Varying(Arc::new(field)), wanted)
}

#[test]
fn the_spacing_follows_the_one_that_is_wanted() {
    // A hexagonal pattern has six neighbours at the spacing, a curve two.
    for (dimension, neighbours) in [(2, 2), (3, 6)] {
        let ball = field(dimension, |p| (p.length() - 1.0, p.normalize()));
        let (varying, wanted) = graded(dimension);
        let options = Options {
            varying: Some(varying),
            bounds: Some(cube(dimension, 1.2)),
            ..Options::default()
        };
        let outcome = sample(&ball, &options, &Silent).unwrap();
        assert!(outcome.statistics.converged, "{:?}", outcome.statistics);
        let positions = &outcome.samples.positions;
        let mut off: Vec<f64> = near(positions, neighbours)
            .iter()
            .zip(positions)
            .map(|(distance, &position)| (distance / wanted(position) - 1.0).abs())
            .collect();
        off.sort_by(f64::total_cmp);
        // The goal of the literature: 95 % within a tenth.
        let worst = off[off.len() * 95 / 100];
        assert!(worst < 0.1, "{dimension}: {worst}");
    }
}

#[test]
fn with_a_count_only_the_ratios_of_the_spacing_matter() {
    let options = |factor: f64| {
        let wanted = field(3, move |p: DVec3| (factor * (2.0 + p.z), DVec3::Z * factor));
        Options {
            count: Some(500),
            varying: Some(Varying(Arc::new(wanted))),
            bounds: Some(cube(3, 1.2)),
            ..Options::default()
        }
    };
    let run = |factor| sample(&sphere(DVec3::ZERO, 1.0), &options(factor), &Silent).unwrap();
    // Powers of two change no digit.
    let (one, other) = (run(1.0), run(0.0625));
    assert_eq!(one.samples.positions, other.samples.positions);
    assert_eq!(one.statistics.points, 500);
}

#[test]
fn a_spacing_that_is_not_positive_is_refused() {
    let options = Options {
        varying: Some(Varying(Arc::new(field(3, |p| (p.z, DVec3::Z))))),
        bounds: Some(cube(3, 1.2)),
        ..Options::default()
    };
    let error = sample(&sphere(DVec3::ZERO, 1.0), &options, &Silent).unwrap_err();
    assert!(
        matches!(
            error,
            SampleError::Option {
                option: "spacing",
                ..
            }
        ),
        "{error}"
    );
}

/// Two spheres of radius 1, far apart.
fn two_spheres() -> impl Field {
    field(3, |p| {
        let one = (p - DVec3::X * 2.0).length() - 1.0;
        let other = (p + DVec3::X * 2.0).length() - 1.0;
        if one < other {
            (one, (p - DVec3::X * 2.0).normalize())
        } else {
            (other, (p + DVec3::X * 2.0).normalize())
        }
    })
}

#[test]
fn given_seeds_decide_which_components_are_covered() {
    let options = |seeds: Vec<DVec3>| Options {
        count: Some(200),
        seeds,
        bounds: Some(cube(3, 3.5)),
        ..Options::default()
    };
    let run = |seeds| sample(&two_spheres(), &options(seeds), &Silent);
    let left = run(vec![DVec3::new(-2.1, 0.9, 0.0)]).unwrap();
    assert_eq!(left.statistics.points, 200);
    assert!(left.samples.positions.iter().all(|p| p.x < 0.0));
    let both = run(Vec::new()).unwrap();
    let right = both.samples.positions.iter().filter(|p| p.x > 0.0).count();
    assert!((80..=120).contains(&right), "{right}");
    for bad in [DVec3::splat(f64::NAN), DVec3::new(0.0, 3.0, 0.0)] {
        let error = run(vec![bad]).unwrap_err();
        assert!(
            matches!(
                error,
                SampleError::Option {
                    option: "seeds",
                    ..
                }
            ),
            "{error}"
        );
    }
}
