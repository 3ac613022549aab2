//! Marching tetrahedra: topology and measures of known surfaces with every split, and manifolds
//! from any signs.

use std::f64::consts::PI;

use crate::support::{self, Made, cube};
use crate::surfaces::{
    SURFACES, assert_closed, assert_same_on_threads, compiled, polygonized, random_signs, space,
    survive_wicked_fields,
};
use glam::DVec3;
use imp::engine::{Field, Monitor, Silent};
use imp::geometry::Mesh;
use imp::polygonize::{Method, Options, PolygonizeError, Split};

fn surface(field: &dyn Field, options: &Options) -> Result<Made<Mesh>, PolygonizeError> {
    support::mesh(field, (Method::Tetrahedra, options), &Silent)
}

fn splits() -> impl Iterator<Item = Split> {
    Split::TABLE.iter().map(|&(split, _)| split)
}

#[test]
fn known_surfaces_have_their_topology_and_measures() {
    for known in SURFACES {
        let found = polygonized(known, Method::Tetrahedra, &known.options());
        known.check(&found);
    }
}

#[test]
fn every_split_gives_the_same_topology_and_measures() {
    for known in &SURFACES[..4] {
        for split in splits() {
            let options = Options {
                split,
                ..known.options()
            };
            let found = polygonized(known, Method::Tetrahedra, &options);
            known.check(&found);
        }
    }
}

#[test]
fn splits_evaluate_each_point_of_their_lattice_once() {
    let field = compiled("x^2 + y^2 + z^2 - 1");
    for (split, points) in [
        (Split::Five, 9 * 9 * 9),
        (Split::Six, 9 * 9 * 9),
        (Split::Twelve, 9 * 9 * 9 + 8 * 8 * 8),
        (Split::Centred, 9 * 9 * 9 + 8 * 8 * 8),
        (Split::TwentyFour, 9 * 9 * 9 + 8 * 8 * 8 + 3 * 9 * 8 * 8),
    ] {
        // With only eight layers there is one slab. Half of the points are inside.
        let options = Options {
            split,
            cell: 0.25,
            iso: -1e9,
            ..Options::new(cube(3, -1.0, 1.0))
        };
        match surface(&field, &options) {
            Err(PolygonizeError::NoSurface { above, .. }) => assert_eq!(above, points),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn caps_have_the_area_and_volume_of_what_the_box_cuts() {
    // The ball of radius 1 in the cube |x|, |y|, |z| ≤ 0.9: six spherical caps of height 0.1 are
    // missing, and do not meet.
    let field = compiled("x^2 + y^2 + z^2 - 1");
    let volume = 4.0 * PI / 3.0 - 6.0 * PI * 0.01 * (3.0 - 0.1) / 3.0;
    let area = 4.0 * PI - 6.0 * 2.0 * PI * 0.1 + 6.0 * PI * 0.19;
    for split in splits() {
        let options = Options {
            split,
            cell: 0.03,
            cap: true,
            ..Options::new(cube(3, -0.9, 0.9))
        };
        let found = surface(&field, &options).unwrap();
        assert_eq!(assert_closed("ball", &found).genus(), Some(0));
        assert!(found.statistics.cut_by_box);
        assert!((found.shape.volume() / volume - 1.0).abs() < 2e-3);
        assert!((found.shape.area() / area - 1.0).abs() < 2e-3);
        // Vertices off the sphere lie in a side exactly, with its normal.
        for (position, normal) in found.shape.positions.iter().zip(&found.shape.normals) {
            if (position.length() - 1.0).abs() > 1e-6 {
                let side = position.abs().max_position();
                assert_eq!(position[side].abs(), 0.9);
                assert_eq!(*normal, DVec3::AXES[side] * position[side].signum());
            }
        }
    }
}

#[test]
fn a_capped_gyroid_has_two_handles() {
    let field = compiled("cos(x)*sin(y) + cos(y)*sin(z) + cos(z)*sin(x)");
    for split in splits() {
        let options = Options {
            split,
            cell: 2.0 * PI / 31.0,
            cap: true,
            ..Options::new(cube(3, -PI, PI))
        };
        let found = surface(&field, &options).unwrap();
        assert_eq!(assert_closed("gyroid", &found).genus(), Some(2));
        // By symmetry half of the cube, exactly.
        assert!((found.shape.volume() / (4.0 * PI * PI * PI) - 1.0).abs() < 4e-3);
    }
}

#[test]
fn planes_through_points_of_the_lattice_are_exact() {
    for normal in [
        DVec3::Z,
        DVec3::new(1.0, 1.0, 0.0),
        DVec3::new(1.0, -1.0, 1.0),
    ] {
        for normal in [normal, -normal] {
            let plane = space(move |p| (p.dot(normal), normal));
            for split in splits() {
                let options = Options {
                    split,
                    cell: 0.25,
                    cap: true,
                    ..Options::new(cube(3, -1.0, 1.0))
                };
                let found = surface(&plane, &options).unwrap();
                assert_closed("plane", &found);
                // It halves the box.
                assert!((found.shape.volume() - 4.0).abs() < 1e-12);
                let open = Options {
                    cap: false,
                    ..options
                };
                let topology = surface(&plane, &open).unwrap().shape.topology();
                assert!(topology.manifold && topology.oriented);
                assert_eq!((topology.components, topology.boundary_loops), (1, 1));
            }
        }
    }
}

#[test]
fn random_signs_give_closed_manifolds_with_every_split() {
    // 10,000 grids.
    for seed in 0..2000 {
        let cells = 2 + seed as usize % 2;
        let field = random_signs(seed, cells);
        for split in splits() {
            let options = Options {
                split,
                cell: 1.0,
                cap: true,
                ..Options::new(cube(3, 0.0, cells as f64))
            };
            let found = surface(&field, &options).unwrap();
            assert_closed(&format!("seed {seed}, {split:?}"), &found);
            assert_eq!(found.statistics.poor_roots, 0);
        }
    }
}

#[test]
fn wicked_fields_give_closed_manifolds() {
    for split in splits() {
        survive_wicked_fields(Method::Tetrahedra, |options| Options { split, ..options });
    }
}

#[test]
fn thread_counts_give_the_same_mesh() {
    let field = compiled("cos(x)*sin(y) + cos(y)*sin(z) + cos(z)*sin(x)");
    for split in [Split::Six, Split::Centred] {
        let options = Options {
            split,
            cell: 2.0 * PI / 40.0,
            cap: true,
            ..Options::new(cube(3, -PI, PI))
        };
        assert_same_on_threads(|| surface(&field, &options).unwrap());
    }
}

#[test]
fn a_cancelled_run_ends() {
    struct Impatient;
    impl Monitor for Impatient {
        fn progress(&self, _phase: &str, _fraction: f64) {}

        fn cancelled(&self) -> bool {
            true
        }
    }
    let field = compiled("x^2 + y^2 + z^2 - 1");
    for method in [Method::Tetrahedra, Method::Octree, Method::Continuation] {
        let options = Options::new(cube(3, -1.3, 1.3));
        let result = support::mesh(&field, (method, &options), &Impatient);
        assert_eq!(result, Err(PolygonizeError::Cancelled));
    }
}
