//! What sampling depends on, and what it refuses.

use crate::fields::*;
use glam::DVec3;
use imp::engine::{Monitor, Silent};
use imp::geometry::Samples;
use imp::sample::{Method, Options, SampleError, sample};

/// All bits of a sample.
fn bits(samples: &Samples) -> Vec<u64> {
    let vectors = samples.positions.iter().chain(&samples.normals);
    let numbers = samples.radii.iter().chain(&samples.residuals).copied();
    vectors
        .flat_map(|vector| vector.to_array())
        .chain(numbers)
        .map(f64::to_bits)
        .collect()
}

#[test]
fn the_number_of_threads_does_not_change_a_bit() {
    for method in [Method::Kinematic, Method::Dynamic] {
        let options = Options {
            method,
            ..particles()
        };
        let outcomes = [1, 2, 4].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            pool.build().unwrap().install(|| run(&blobs(), &options))
        });
        for outcome in &outcomes[1..] {
            assert_eq!(bits(&outcome.samples), bits(&outcomes[0].samples));
            assert_eq!(outcome.statistics, outcomes[0].statistics);
        }
    }
}

#[test]
fn the_seed_decides_the_points() {
    let with_seed = |seed| {
        let options = Options {
            seed,
            ..particles()
        };
        bits(&run(&torus(), &options).samples)
    };
    assert_eq!(with_seed(7), with_seed(7));
    assert_ne!(with_seed(7), with_seed(8));
}

#[test]
fn a_particle_depends_on_its_index_and_not_on_how_many_there_are() {
    let with_count = |count| {
        let options = Options {
            count: Some(count),
            search_limit: 0,
            ..particles()
        };
        run(&sphere(DVec3::ZERO, 1.0), &options).samples.positions
    };
    // Not a multiple of the chunk's size.
    assert_eq!(with_count(300), with_count(1_000)[..300]);
}

#[test]
fn options_out_of_range_are_refused_by_name() {
    let field = torus();
    let refused = |options: Options| match sample(&field, &options, &Silent) {
        Err(SampleError::Option { option, .. }) => option,
        other => panic!("{other:?}"),
    };
    let default = particles;
    let count = Some(0);
    assert_eq!(refused(Options { count, ..default() }), "count");
    for tolerance in [0.0, -1.0, 0.5, f64::NAN, f64::INFINITY] {
        assert_eq!(
            refused(Options {
                tolerance,
                ..default()
            }),
            "tolerance"
        );
    }
    for friction in [0.0, -0.1, 1.5, f64::NAN] {
        assert_eq!(
            refused(Options {
                friction,
                ..default()
            }),
            "friction"
        );
    }
    let iteration_limit = 0;
    assert_eq!(
        refused(Options {
            iteration_limit,
            ..default()
        }),
        "iteration_limit"
    );
    for half in [1e-200, 1e200, -1.0, f64::NAN] {
        let mut bounds = cube(3, 1.0);
        bounds.min = DVec3::splat(-half);
        bounds.max = DVec3::splat(half);
        let bounds = Some(bounds);
        assert_eq!(
            refused(Options {
                bounds,
                ..default()
            }),
            "bounds"
        );
    }
}

#[test]
fn more_particles_than_are_allowed_are_refused() {
    let field = torus();
    let refused = |count, count_limit| {
        let options = Options {
            count: Some(count),
            count_limit,
            ..Options::default()
        };
        match sample(&field, &options, &Silent) {
            Err(SampleError::TooMany { count, limit }) => (count, limit),
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(refused(6, 5), (6, 5));
    assert_eq!(refused(u64::MAX, Options::MOST), (u64::MAX, Options::MOST));
}

#[test]
fn bounds_must_have_the_dimension_of_the_field() {
    let options = Options {
        bounds: Some(cube(2, 1.0)),
        ..particles()
    };
    let error = sample(&torus(), &options, &Silent).unwrap_err();
    assert_eq!(
        error,
        SampleError::Dimension {
            bounds: 2,
            field: 3
        }
    );
}

#[test]
fn a_cancelled_run_says_so() {
    struct Impatient;
    impl Monitor for Impatient {
        fn progress(&self, _phase: &str, _fraction: f64) {}

        fn cancelled(&self) -> bool {
            true
        }
    }
    let error = sample(&torus(), &particles(), &Impatient).unwrap_err();
    assert_eq!(error, SampleError::Cancelled);
}

#[test]
fn fewer_steps_than_needed_are_reported() {
    let options = Options {
        iteration_limit: 2,
        bounds: Some(cube(3, 2.0)),
        ..particles()
    };
    let statistics = run(&blobs(), &options).statistics;
    assert_eq!(statistics.iterations, 2);
    assert!(statistics.dropped.unconverged > 1_000 && !statistics.converged);
}
