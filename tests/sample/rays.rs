//! Rays: their points are uniformly distributed, and their estimates as good as they say.

use std::f64::consts::PI;

use glam::DVec3;
use imp::engine::{Field, Silent};
use imp::geometry::Bounds;
use imp::sample::{Estimate, Method, Options, Outcome, SampleError, sample};

use crate::fields::*;
use crate::trace::compiled;

fn options(bounds: Option<Bounds>, count: u64, seed: u64) -> Options {
    Options {
        method: Method::Rays,
        bounds,
        count: Some(count),
        seed,
        ..Options::default()
    }
}

/// How many standard errors an estimate is off.
fn off(estimate: Option<Estimate>, truth: f64) -> f64 {
    let Estimate { value, error } = estimate.unwrap();
    assert!(error > 0.0);
    (value - truth) / error
}

#[test]
fn areas_and_volumes_are_right_within_four_standard_errors() {
    let torus = 4.0 * PI * PI * 0.3;
    // A prolate spheroid with semi-axes 0.15, 0.15, 1.5.
    let (a, c) = (0.15_f64, 1.5_f64);
    let e = (1.0 - a * a / (c * c)).sqrt();
    let spheroid = 2.0 * PI * a * a * (1.0 + c / (a * e) * e.asin());
    let cases: [(&dyn Field, Bounds, f64, f64); 3] = [
        (
            &ellipsoid(&[1.0; 3]),
            cube(3, 1.4),
            4.0 * PI,
            4.0 * PI / 3.0,
        ),
        (&compiled_torus(), cube(3, 1.4), torus, 2.0 * PI * PI * 0.09),
        (
            &ellipsoid(&[a, a, c]),
            cube(3, 1.6),
            spheroid,
            4.0 * PI / 3.0 * a * a * c,
        ),
    ];
    for (field, bounds, area, volume) in cases {
        for seed in 0..5 {
            let outcome = run(field, &options(Some(bounds), 4000, seed));
            let lines = outcome.statistics.lines.unwrap();
            assert_eq!(outcome.samples.positions.len(), 4000);
            assert!(outcome.statistics.max_residual < 1e-13 * bounds.diagonal());
            assert!(off(lines.area, area).abs() < 4.0, "{seed} {lines:?}");
            assert!(off(lines.volume, volume).abs() < 4.0, "{seed} {lines:?}");
        }
    }
}

#[test]
fn lengths_and_areas_in_the_plane_are_right_too() {
    // The ellipse with semi-axes 1 and 1/2: the perimeter by the trapezoidal rule, which converges
    // exponentially for periodic functions.
    let steps = 1000;
    let speed = |step: i32| {
        let angle = 2.0 * PI * f64::from(step) / f64::from(steps);
        angle.sin().hypot(0.5 * angle.cos())
    };
    let length = (0..steps).map(speed).sum::<f64>() * 2.0 * PI / f64::from(steps);
    for seed in 0..5 {
        let outcome = run(
            &ellipsoid(&[1.0, 0.5]),
            &options(Some(cube(2, 1.2)), 4000, seed),
        );
        let lines = outcome.statistics.lines.unwrap();
        assert!(off(lines.area, length).abs() < 4.0, "{lines:?}");
        assert!(off(lines.volume, 0.5 * PI).abs() < 4.0, "{lines:?}");
    }
}

#[test]
fn standard_errors_are_what_they_say() {
    // Over 100 seeds, squares of errors in units of the standard error add up to chi-square with
    // 100 degrees of freedom: 100 ± 14. Four deviations.
    let field = ellipsoid(&[1.0; 3]);
    let (mut area, mut volume) = (0.0, 0.0);
    for seed in 0..100 {
        let outcome = run(&field, &options(Some(cube(3, 1.2)), 100, seed));
        let lines = outcome.statistics.lines.unwrap();
        area += off(lines.area, 4.0 * PI).powi(2);
        volume += off(lines.volume, 4.0 * PI / 3.0).powi(2);
    }
    for sum in [area, volume] {
        assert!((44.0..157.0).contains(&sum), "{area} {volume}");
    }
}

#[test]
fn what_the_box_cuts_off_does_not_count() {
    // The half of the ball above z = 0: half the sphere, half the ball.
    let bounds = Bounds::from_sides(&[(-1.2, 1.2), (-1.2, 1.2), (0.0, 1.2)]);
    let outcome = run(&ellipsoid(&[1.0; 3]), &options(bounds, 4000, 1));
    let lines = outcome.statistics.lines.unwrap();
    assert!(off(lines.area, 2.0 * PI).abs() < 4.0, "{lines:?}");
    assert!(off(lines.volume, 2.0 * PI / 3.0).abs() < 4.0, "{lines:?}");
    assert!(outcome.samples.positions.iter().all(|p| p.z >= 0.0));
}

#[test]
fn points_are_uniform_on_the_sphere_in_a_box_off_its_centre() {
    // Archimedes: every slice of the same height holds the same number.
    let bounds = Bounds::from_sides(&[(-1.1, 3.0), (-1.5, 1.1), (-1.2, 1.7)]);
    let positions = run(&ellipsoid(&[1.0; 3]), &options(bounds, 10_000, 3))
        .samples
        .positions;
    for axis in 0..3 {
        let mut slices = [0_u32; 10];
        for p in &positions {
            slices[((5.0 * (p[axis] + 1.0)) as usize).min(9)] += 1;
        }
        // Points come in pairs on a line, which may share a slice: a deviation of at most √2 · 30.
        assert!(
            slices.iter().all(|n| n.abs_diff(1000) < 5 * 43),
            "{slices:?}"
        );
    }
}

#[test]
fn parallel_rays_see_the_shadow_and_their_weights_the_area() {
    for direction in [DVec3::Z, DVec3::new(0.0, 3.0, -4.0)] {
        let options = Options {
            direction: Some(direction),
            ..options(Some(cube(3, 1.1)), 20_000, 2)
        };
        let outcome = run(&ellipsoid(&[1.0; 3]), &options);
        let along = direction.normalize();
        let samples = &outcome.samples;
        assert_eq!(samples.weights.len(), 20_000);
        // In the shadow, a disk, the mean of 1 − ρ² = (n·d)² is 1/2, and that of its square 1/3:
        // deviation √(1/12), of two dependent points.
        let squares = samples.normals.iter().map(|n| n.dot(along).powi(2));
        let mean = squares.sum::<f64>() / 20_000.0;
        assert!((mean - 0.5).abs() < 5.0 * (2.0_f64 / 12.0 / 20_000.0).sqrt());
        // Weighed, the mean of (n·d)² is that over the sphere, 1/3: Σ|n·d| / Σ 1/|n·d|, whose
        // denominator fluctuates by several per cent.
        let weighed: f64 = (samples.normals.iter().zip(&samples.weights))
            .map(|(n, weight)| weight * n.dot(along).powi(2))
            .sum();
        let mean = weighed / samples.weights.iter().sum::<f64>();
        assert!((mean - 1.0 / 3.0).abs() < 0.03, "{mean}");
        let lines = outcome.statistics.lines.unwrap();
        assert_eq!(lines.area, None);
        assert!(off(lines.volume, 4.0 * PI / 3.0).abs() < 4.0);
    }
}

#[test]
fn a_spacing_asks_for_as_many_points_as_the_ideal_pattern_has() {
    let options = Options {
        count: None,
        spacing: Some(0.05),
        ..options(Some(cube(3, 1.2)), 1, 0)
    };
    let number = run(&ellipsoid(&[1.0; 3]), &options).samples.positions.len() as f64;
    let ideal = 4.0 * PI / (0.75_f64.sqrt() * 0.05 * 0.05);
    assert!((number / ideal - 1.0).abs() < 0.15, "{number} {ideal}");
    let fine = Options {
        spacing: Some(1e-6),
        ..options
    };
    let refused = sample(&ellipsoid(&[1.0; 3]), &fine, &Silent).unwrap_err();
    assert!(matches!(
        refused,
        SampleError::Option {
            option: "spacing",
            ..
        }
    ));
}

/// All bits of the points.
fn bits(outcome: &Outcome) -> Vec<u64> {
    let positions = outcome.samples.positions.iter();
    let coordinates = positions.flat_map(|p| p.to_array());
    coordinates.map(f64::to_bits).collect()
}

#[test]
fn methods_with_lines_give_the_same_bits_for_any_number_of_threads() {
    for method in [Method::Rays, Method::Grid, Method::Poisson] {
        let options = Options {
            method,
            ..options(Some(cube(3, 1.4)), 700, 5)
        };
        let outcomes = [1, 2, 4].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let field = compiled_torus();
            pool.build().unwrap().install(|| run(&field, &options))
        });
        for outcome in &outcomes[1..] {
            assert_eq!(bits(outcome), bits(&outcomes[0]), "{method:?}");
            assert_eq!(outcome.samples, outcomes[0].samples);
            assert_eq!(outcome.statistics, outcomes[0].statistics);
        }
    }
}

#[test]
fn seeds_decide_the_lines() {
    let with = |seed| {
        bits(&run(
            &compiled_torus(),
            &options(Some(cube(3, 1.4)), 300, seed),
        ))
    };
    assert_eq!(with(7), with(7));
    assert_ne!(with(7), with(8));
}

#[test]
fn what_lines_cannot_do_is_refused_by_name() {
    let refused = |field: &dyn Field, options: Options| match sample(field, &options, &Silent) {
        Err(SampleError::Option { option, .. }) => option,
        other => panic!("{other:?}"),
    };
    let sphere = ellipsoid(&[1.0; 3]);
    for method in [Method::Rays, Method::Grid, Method::Poisson] {
        let options = Options {
            method,
            ..options(None, 10, 0)
        };
        assert_eq!(refused(&sphere, options), "bounds");
    }
    for method in [Method::Rays, Method::Poisson] {
        let options = Options {
            method,
            ..options(Some(cube(1, 2.0)), 10, 0)
        };
        assert_eq!(refused(&ellipsoid(&[1.0]), options), "method");
    }
    for direction in [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY] {
        let options = Options {
            direction: Some(direction),
            ..options(Some(cube(3, 2.0)), 10, 0)
        };
        assert_eq!(refused(&sphere, options), "direction");
    }
    let options = Options {
        method: Method::Poisson,
        direction: Some(DVec3::X),
        ..options(Some(cube(3, 2.0)), 10, 0)
    };
    assert_eq!(refused(&sphere, options), "direction");
}

#[test]
fn a_box_without_a_surface_gives_nothing_after_65536_lines() {
    let away = Bounds::from_sides(&[(2.0, 3.0); 3]);
    let outcome = run(&ellipsoid(&[1.0; 3]), &options(away, 10, 0));
    assert!(outcome.samples.positions.is_empty());
    let lines = outcome.statistics.lines.unwrap();
    assert_eq!(lines.drawn, 65_536);
    assert_eq!(lines.volume.unwrap().value, 0.0);
}

/// The estimates of area, or length, by each method of lines, with 3000 points at most.
fn by_lines(text: &str, half: f64) -> Vec<imp::sample::Lines> {
    let field = &compiled(text)[0];
    let methods = [Method::Rays, Method::Poisson, Method::Grid];
    let lines = methods.map(|method| {
        let options = Options {
            method,
            ..options(Some(cube(field.dimension(), half)), 500, 0)
        };
        let statistics = sample(field, &options, &Silent).unwrap().statistics;
        // Whatever is met, the work is in proportion to the lines.
        assert!(statistics.evaluations < 3_000_000, "{text}: {statistics:?}");
        statistics.lines.unwrap()
    });
    lines.to_vec()
}

#[test]
fn double_roots_are_counted_or_nothing_is_estimated() {
    for (text, truth) in [
        ("field f(p in R3) = (norm(p) - 1)^2", 4.0 * PI),
        ("field f(p in R3) = (norm2(p) - 1)^2", 4.0 * PI),
        ("field f(p in R3) = abs(norm(p) - 1)", 4.0 * PI),
        ("field f(x, y) = (sqrt(x^2 + y^2) - 1)^2", 2.0 * PI),
    ] {
        for lines in by_lines(text, 1.5) {
            if lines.area.is_some() {
                assert!(off(lines.area, truth).abs() < 4.0, "{text}: {lines:?}");
            }
            assert_eq!(lines.vanishing, 0);
        }
    }
    // The roots of a square are found, all of them.
    let lines = &by_lines("field f(p in R3) = (norm(p) - 1)^2", 1.5)[0];
    assert!(
        lines.area.is_some() && lines.undecided < lines.touching / 100,
        "{lines:?}"
    );
}

#[test]
fn a_region_on_which_the_field_is_zero_has_no_area() {
    for text in [
        "field f(p in R3) = 0*p.x",
        "field f(p in R3) = max(norm(p) - 1, 0)",
        "field f(p in R3) = min(norm(p) - 1, 0)",
        "field f(x, y) = max(sqrt(x^2 + y^2) - 1, 0)",
    ] {
        for lines in by_lines(text, 1.5) {
            assert!(
                lines.area.is_none() && lines.vanishing > 0,
                "{text}: {lines:?}"
            );
        }
    }
    // A single plane in which grid lines lie is none.
    let lines = &by_lines("field f(p in R3) = p.z - 0.1", 1.5)[0];
    assert!(lines.area.is_some() && lines.vanishing == 0);
}
