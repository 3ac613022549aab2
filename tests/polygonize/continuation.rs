//! Continuation from seeds.

use std::f64::consts::PI;

use crate::support::{self, Made, cube};
use crate::surfaces::{
    SURFACES, assert_closed, assert_same_on_threads, compiled, space, survive_wicked_fields,
};
use glam::DVec3;
use imp::engine::{Field, Silent};
use imp::geometry::Mesh;
use imp::polygonize::{Method, Options, PolygonizeError};

fn surface(field: &dyn Field, options: &Options) -> Result<Made<Mesh>, PolygonizeError> {
    support::mesh(field, (Method::Continuation, options), &Silent)
}

/// By marching cubes.
fn reference(field: &dyn Field, options: &Options) -> Made<Mesh> {
    support::mesh(field, (Method::Cubes, options), &Silent).unwrap()
}

#[test]
fn without_seeds_it_is_marching_cubes() {
    for known in SURFACES {
        let field = compiled(known.formula);
        for cap in [false, true] {
            // A box that cuts the surface, too.
            for bounds in [1.0, 0.71] {
                let mut options = known.options();
                options.bounds = options.bounds.scaled(bounds);
                options.cap = cap;
                let found = surface(&field, &options).unwrap();
                let reference = reference(&field, &options);
                assert!(found.shape == reference.shape, "{}", known.name);
                let (one, other) = (found.statistics, reference.statistics);
                assert_eq!(one.cut_by_box, other.cut_by_box);
                assert_eq!(one.good_roots, other.good_roots);
                assert!(!one.may_miss_components);
                if bounds == 1.0 {
                    known.check(&found);
                }
            }
        }
    }
}

#[test]
fn cells_of_the_whole_boundary_are_capped() {
    // A hollow in a box that is full: the cap is a component of its own, without a root.
    let field = compiled("0.25 - x^2 - y^2 - z^2");
    let options = Options {
        cap: true,
        cell: 0.1,
        ..Options::new(cube(3, -1.0, 1.0))
    };
    let found = surface(&field, &options).unwrap();
    assert_eq!(assert_closed("hollow", &found).components, 2);
    assert_eq!(found.shape, reference(&field, &options).shape);
}

#[test]
fn work_grows_with_the_surface() {
    let field = compiled("x^2 + y^2 + z^2 - 1");
    let cells = |count: f64| {
        let options = Options {
            cell: 3.0 / count,
            ..Options::new(cube(3, -1.5, 1.5))
        };
        let seeded = Options {
            seeds: vec![DVec3::ZERO],
            ..options.clone()
        };
        let found = surface(&field, &options).unwrap();
        let from_seed = surface(&field, &seeded).unwrap();
        assert_eq!(found.shape, from_seed.shape);
        // A plane of normal n passes through |n|₁ cells for each square of their side, on the
        // sphere 3/2 in the mean.
        let crossed = 1.5 * 4.0 * PI / (options.cell * options.cell);
        let cells = from_seed.statistics.cells as f64;
        assert!((cells / crossed - 1.0).abs() < 0.05, "{}", cells / crossed);
        // About two points a cell, one that roots need, with the search a few more.
        assert!(from_seed.statistics.evaluations as f64 <= 8.0 * cells);
        found.statistics.evaluations as f64
    };
    let growth = cells(128.0) / cells(64.0);
    assert!(growth < 4.5, "{growth}");
}

#[test]
fn seeds_choose_components() {
    // Eight blobs around (±√2.5, ±√2.5, ±√2.5).
    let field = compiled("x^4 - 5*x^2 + y^4 - 5*y^2 + z^4 - 5*z^2 + 15");
    let mut options = Options {
        cell: 0.1,
        ..Options::new(cube(3, -2.8, 2.8))
    };
    let all = surface(&field, &options).unwrap();
    assert_eq!(assert_closed("blobs", &all).components, 8);
    let middle = DVec3::splat(2.5f64.sqrt());
    // In the middle of a blob, beside it on an axis' ray, and twice the same.
    for (seeds, components) in [
        (vec![middle], 1),
        (vec![middle * DVec3::new(1.0, 1.0, 0.1)], 1),
        (vec![middle, middle + 0.1 * DVec3::X], 1),
        (vec![middle, -middle], 2),
    ] {
        options.seeds = seeds;
        let found = surface(&field, &options).unwrap();
        assert_eq!(assert_closed("blobs", &found).components, components);
        assert!(found.statistics.may_miss_components);
        let share = found.shape.volume() / all.shape.volume();
        // Cells are cut alike, but not all their triangles are mirror images.
        assert!((share - components as f64 / 8.0).abs() < 1e-3, "{share}");
    }
}

#[test]
fn seeds_that_lead_nowhere_are_errors() {
    let field = compiled("(x - 0.5)^2 + (y - 0.5)^2 + (z - 0.5)^2 - 0.01");
    let mut options = Options {
        cell: 0.05,
        seeds: vec![DVec3::splat(-0.5)],
        ..Options::new(cube(3, -1.0, 1.0))
    };
    match surface(&field, &options) {
        Err(PolygonizeError::LostSeed { seed }) => assert_eq!(seed, DVec3::splat(-0.5)),
        other => panic!("{other:?}"),
    }
    options.seeds = vec![DVec3::splat(1.5)];
    match surface(&field, &options) {
        Err(PolygonizeError::SeedOutside { seed }) => assert_eq!(seed, DVec3::splat(1.5)),
        other => panic!("{other:?}"),
    }
}

#[test]
fn fields_without_enclosures_and_random_signs_give_marching_cubes() {
    for seed in 0..300 {
        let points = 3 + seed as usize % 3;
        let field = crate::cubes::random_signs(seed, points);
        for cap in [false, true] {
            let options = Options {
                cell: 1.0,
                cap,
                ..Options::new(cube(3, 0.0, points as f64 - 1.0))
            };
            let found = surface(&field, &options).unwrap();
            assert!(
                found.shape == reference(&field, &options).shape,
                "seed {seed}"
            );
        }
    }
    let nowhere = space(|_| (1.0, DVec3::ZERO));
    match surface(&nowhere, &support::open(cube(3, -1.0, 1.0))) {
        Err(PolygonizeError::NoSurface { above, .. }) => assert_eq!(above, 65 * 65 * 65),
        other => panic!("{other:?}"),
    }
}

#[test]
fn wicked_fields_give_closed_manifolds() {
    survive_wicked_fields(Method::Continuation, |options| options);
}

#[test]
fn thread_counts_give_the_same_mesh() {
    let field = compiled("cos(x)*sin(y) + cos(y)*sin(z) + cos(z)*sin(x)");
    let options = Options {
        cell: 2.0 * PI / 40.0,
        cap: true,
        ..Options::new(cube(3, -PI, PI))
    };
    assert_same_on_threads(|| surface(&field, &options).unwrap());
}
