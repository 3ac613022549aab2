//! The algorithm of Witkin and Heckbert to the letter: from one seed a component to the end.

use std::f64::consts::TAU;

use glam::DVec3;
use imp::engine::Silent;
use imp::geometry::nearest_distances;
use imp::sample::{Method, Options, Outcome, Rules, SampleError, sample};

use crate::fields::{cube, torus};
use crate::trace::compiled;

/// The paper's algorithm with the radius σ̂.
fn exact(sigma: f64, seeds: Vec<DVec3>) -> Options {
    Options {
        exact: true,
        seeds,
        bounds: Some(cube(3, 2.0)),
        rules: Rules {
            sigma: Some(sigma),
            ..Rules::default()
        },
        ..Options::default()
    }
}

fn run(sigma: f64) -> Outcome {
    let options = exact(sigma, vec![DVec3::new(1.3, 0.0, 0.0)]);
    sample(&torus(), &options, &Silent).unwrap()
}

#[test]
fn one_seed_fills_a_torus() {
    // The diameter is 2.6 √2, and the paper's σ̂ a twentieth of it.
    let sigma = 2.6 * 2.0_f64.sqrt() / 20.0;
    let outcome = run(sigma);
    assert!(outcome.statistics.converged, "{:?}", outcome.statistics);
    assert!(outcome.statistics.max_residual < 1e-9);
    let points = &outcome.samples.positions;
    // Radii end between δ σ̂ and σ̂, with neighbours about two radii apart: nobody is farther from
    // a floater than they are from each other.
    for place in 0..400 {
        let (along, around) = (f64::from(place % 20), f64::from(place / 20));
        let (u, v) = (along * TAU / 20.0, around * TAU / 20.0);
        let radius = 1.0 + 0.3 * v.cos();
        let place = DVec3::new(radius * u.cos(), radius * u.sin(), 0.3 * v.sin());
        let nearest = points.iter().map(|point| point.distance(place));
        assert!(nearest.fold(f64::INFINITY, f64::min) < 2.0 * sigma);
    }
    let distances = nearest_distances(points);
    let mean = distances.iter().sum::<f64>() / distances.len() as f64;
    assert!(mean > 1.2 * sigma && mean < 2.2 * sigma, "{mean}");
    let least = distances.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(least > 0.6 * mean, "{least} {mean}");
    // Half the radius, four times as many, by a third more or less: the number has a history.
    let finer = run(0.5 * sigma).samples.positions.len() as f64;
    let ratio = finer / points.len() as f64;
    assert!(ratio > 3.0 && ratio < 5.4, "{ratio}");
}

#[test]
fn every_component_has_a_seed() {
    let field = &compiled(
        "field f(x, y, z) = min(norm([x + 0.8, y, z]) - 0.7, norm([x - 0.8, y, z]) - 0.3)",
    )[0];
    let outcome = sample(field, &exact(0.1, Vec::new()), &Silent).unwrap();
    let statistics = &outcome.statistics;
    assert!(statistics.converged, "{statistics:?}");
    let left = outcome
        .samples
        .positions
        .iter()
        .filter(|p| p.x < 0.2)
        .count() as f64;
    let right = outcome.samples.positions.len() as f64 - left;
    // Areas are as the squares of the radii.
    let ratio = left / right / (0.7_f64 / 0.3).powi(2);
    assert!(ratio > 0.6 && ratio < 1.6, "{ratio}");
}

#[test]
fn parameters_decide_and_are_checked() {
    let refused = |change: &dyn Fn(&mut Options)| {
        let mut options = exact(0.2, Vec::new());
        change(&mut options);
        match sample(&torus(), &options, &Silent) {
            Err(SampleError::Option { option, .. }) => option,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(refused(&|options| options.rules.alpha = 0.0), "alpha");
    assert_eq!(refused(&|options| options.rules.nu = f64::NAN), "nu");
    assert_eq!(refused(&|options| options.count = Some(100)), "count");
    assert_eq!(refused(&|options| options.exact = false), "sigma");
    assert_eq!(refused(&|options| options.method = Method::Relax), "exact");
    // Without enough steps it says that it has not come to an end.
    let mut options = exact(0.1, vec![DVec3::new(1.3, 0.0, 0.0)]);
    options.iteration_limit = 5;
    let outcome = sample(&torus(), &options, &Silent).unwrap();
    assert!(!outcome.statistics.converged && outcome.statistics.iterations == 5);
    // Nor where floaters that are too large find no place to split: on a cube.
    let cube = &compiled("field f(x, y, z) = max(abs(x), abs(y), abs(z)) - 1")[0];
    let outcome = sample(cube, &exact(0.1, vec![DVec3::new(1.0, 0.1, 0.2)]), &Silent).unwrap();
    let few = outcome.samples.positions.len() < 400;
    assert!(!(few && outcome.statistics.converged));
}

#[test]
fn one_seed_fills_a_curve() {
    let circle = &compiled("field f(x, y) = norm([x, y]) - 1")[0];
    let options = Options {
        bounds: Some(cube(2, 2.0)),
        ..exact(0.005, vec![DVec3::new(1.0, 0.0, 0.0)])
    };
    let outcome = sample(circle, &options, &Silent).unwrap();
    let statistics = &outcome.statistics;
    assert!(statistics.converged, "{statistics:?}");
    // Neighbours are one to two and a half radii apart all around.
    let number = outcome.samples.positions.len() as f64;
    assert!(number > TAU / 0.0125 && number < TAU / 0.005, "{number}");
}
