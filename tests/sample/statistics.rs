//! What samplers tell of their runs.

use imp::engine::Silent;
use imp::sample::{Method, Options, Times, sample};

use crate::fields::*;

#[test]
fn the_energy_of_floaters_at_rest_is_that_of_the_ideal_pattern() {
    // Six neighbours at two radii and six at √12 on a surface, two and two (at four) on a curve:
    // defects and curvature change it by a few per cent.
    let on_surface = 6.0 * ((-2.0_f64).exp() + (-6.0_f64).exp());
    let on_curve = 2.0 * ((-2.0_f64).exp() + (-8.0_f64).exp());
    for (dimension, ideal) in [(2, on_curve), (3, on_surface)] {
        let options = Options {
            count: Some(500),
            bounds: Some(cube(dimension, 1.2)),
            ..Options::default()
        };
        let ball = field(dimension, |p| (p.length() - 1.0, p.normalize()));
        let energy = run(&ball, &options).statistics.energy.unwrap();
        assert!((energy / ideal - 1.0).abs() < 0.05, "{energy}");
    }
    assert_eq!(run(&torus(), &particles()).statistics.energy, None);
}

#[test]
fn phases_are_timed_and_do_not_make_runs_different() {
    let phases = |method, count| {
        let options = Options {
            method,
            count: Some(count),
            bounds: Some(cube(3, 1.5)),
            ..Options::default()
        };
        let first = sample(&compiled_torus(), &options, &Silent).unwrap();
        let second = sample(&compiled_torus(), &options, &Silent).unwrap();
        assert_eq!(first, second);
        let Times(times) = first.statistics.times;
        assert!(times.iter().all(|(_, time)| !time.is_zero()), "{times:?}");
        let names = times.into_iter().map(|(name, _)| name);
        names.collect::<Vec<String>>()
    };
    assert_eq!(phases(Method::Kinematic, 100), ["search", "sample"]);
    let poisson = phases(Method::Poisson, 200);
    assert_eq!(poisson, ["rays", "eliminate", "exchange"]);
    let floaters = phases(Method::Floaters, 200);
    assert!(floaters.contains(&"settle".to_owned()), "{floaters:?}");
}
