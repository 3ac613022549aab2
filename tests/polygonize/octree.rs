//! Marching tetrahedra in an octree.

use std::f64::consts::PI;

use crate::support::{self, Made, cube};
use crate::surfaces::{
    SURFACES, assert_closed, assert_same_on_threads, compiled, polygonized, random_signs,
    survive_wicked_fields,
};
use imp::engine::{Field, Silent};
use imp::geometry::Mesh;
use imp::polygonize::{Method, Options, PolygonizeError, Split};

fn surface(field: &dyn Field, options: &Options) -> Result<Made<Mesh>, PolygonizeError> {
    support::mesh(field, (Method::Octree, options), &Silent)
}

#[test]
fn known_surfaces_have_their_topology_and_measures() {
    for known in SURFACES {
        let found = polygonized(known, Method::Octree, &known.options());
        known.check(&found);
    }
}

#[test]
fn leaves_fill_the_box_in_three_colours_and_grow_with_the_surface() {
    let field = compiled("x^2 + y^2 + z^2 - 1");
    let mut counts = Vec::new();
    for cells in [64u32, 128] {
        let options = Options {
            cell: 3.0 / f64::from(cells),
            // Nothing is flat to that.
            error: Some(1e-15),
            ..Options::new(cube(3, -1.5, 1.5))
        };
        let found = surface(&field, &options).unwrap();
        assert_closed("sphere", &found);
        let leaves = found.statistics.leaves;
        let finest = cells.ilog2() as usize - 3;
        // Eight cells along each axis at the coarsest level: leaves fill the box.
        let all = [leaves.interior, leaves.exterior, leaves.boundary];
        let volume: usize = (0..=finest)
            .map(|level| {
                all.map(|counts| counts[level]).iter().sum::<usize>() << (3 * (finest - level))
            })
            .sum();
        assert_eq!(volume, 512 << (3 * finest));
        // Only boundary leaves reach the finest level here, or what is beside one.
        assert_eq!(leaves.boundary[..finest].iter().sum::<usize>(), 0);
        // A plane of normal n passes through |n|₁ cells for each square of their side, on the
        // sphere 3/2 in the mean. A mean-value form excludes nearly all others.
        let area = 4.0 * PI / (options.cell * options.cell);
        let boundary = leaves.boundary[finest] as f64;
        assert!(
            boundary > 1.45 * area && boundary < 1.75 * area,
            "{}",
            boundary / area
        );
        counts.push((boundary, found.statistics.evaluations as f64));
    }
    // O(1/h²) cells and evaluations.
    let growth = counts[1].0 / counts[0].0;
    assert!(growth > 3.8 && growth < 4.2, "{growth}");
    // The same, but for what coarse levels cost.
    let growth = counts[1].1 / counts[0].1;
    assert!(growth > 3.0 && growth < 4.4, "{growth}");
}

#[test]
fn larger_leaves_are_where_the_surface_is_flat() {
    // The rounded edges of a box: its sides are planes.
    let field = compiled(
        "sqrt(max(abs(x) - 0.7, 0)^2 + max(abs(y) - 0.7, 0)^2 + max(abs(z) - 0.7, 0)^2) - 0.21",
    );
    let options = Options {
        cell: 2.2 / 64.0,
        ..Options::new(cube(3, -1.1, 1.1))
    };
    let fine = support::mesh(
        &field,
        (
            Method::Tetrahedra,
            &Options {
                split: Split::TwentyFour,
                ..options.clone()
            },
        ),
        &Silent,
    )
    .unwrap();
    let adapted = surface(&field, &options).unwrap();
    assert_eq!(assert_closed("box", &adapted).genus(), Some(0));
    assert!(adapted.shape.triangles.len() * 2 < fine.shape.triangles.len());
    let leaves = adapted.statistics.leaves.boundary;
    assert!(
        leaves[0] > 0 && leaves[1] > 0 && leaves[3] > 0,
        "{leaves:?}"
    );
    // The edges of a cube of 1.4, rounded by 0.21.
    let (side, r) = (1.4, 0.21);
    let volume = side * side * side
        + 6.0 * side * side * r
        + 3.0 * PI * r * r * side
        + 4.0 / 3.0 * PI * r * r * r;
    assert!((adapted.shape.volume() / volume - 1.0).abs() < 1e-3);
}

#[test]
fn the_error_bounds_the_distance_to_the_surface() {
    let field = compiled("x^2 + y^2 + z^2 - 1");
    let mut triangles = Vec::new();
    for error in [1e-2, 2.5e-3, 6e-4] {
        let options = Options {
            cell: 2.6 / 256.0,
            error: Some(error),
            ..Options::new(cube(3, -1.3, 1.3))
        };
        let found = surface(&field, &options).unwrap();
        assert_eq!(assert_closed("sphere", &found).genus(), Some(0));
        let farthest = found.shape.triangles.iter().map(|triangle| {
            let [a, b, c] = triangle.map(|vertex| found.shape.positions[vertex as usize]);
            1.0 - ((a + b + c) / 3.0).length()
        });
        assert!(farthest.fold(0.0, f64::max) <= error);
        triangles.push(found.shape.triangles.len() as f64);
    }
    // Errors shrink with the square of the cells, so triangles grow as 1/error.
    for pair in triangles.windows(2) {
        let growth = pair[1] / pair[0];
        assert!(growth > 2.5 && growth < 6.5, "{triangles:?}");
    }
}

#[test]
fn caps_close_what_the_box_cuts() {
    let field = compiled("x^2 + y^2 + z^2 - 1");
    let volume = 4.0 * PI / 3.0 - 6.0 * PI * 0.01 * (3.0 - 0.1) / 3.0;
    for error in [1e-4, 1e-2] {
        let options = Options {
            cell: 0.02,
            cap: true,
            error: Some(error),
            ..Options::new(cube(3, -0.9, 0.9))
        };
        let found = surface(&field, &options).unwrap();
        assert_eq!(assert_closed("ball", &found).genus(), Some(0));
        assert!((found.shape.volume() / volume - 1.0).abs() < 2e-2);
    }
    let gyroid = compiled("cos(x)*sin(y) + cos(y)*sin(z) + cos(z)*sin(x)");
    let options = Options {
        cell: PI / 32.0,
        cap: true,
        ..Options::new(cube(3, -PI, PI))
    };
    let found = surface(&gyroid, &options).unwrap();
    assert_eq!(assert_closed("gyroid", &found).genus(), Some(2));
    assert!((found.shape.volume() / (4.0 * PI * PI * PI) - 1.0).abs() < 4e-3);
}

#[test]
fn without_enclosures_it_is_the_split_into_24() {
    for seed in 0..200 {
        let field = random_signs(seed, 2);
        let options = Options {
            cell: 1.0,
            cap: true,
            split: Split::TwentyFour,
            ..Options::new(cube(3, 0.0, 2.0))
        };
        let found = surface(&field, &options).unwrap();
        assert_closed("random signs", &found);
        let split = support::mesh(&field, (Method::Tetrahedra, &options), &Silent).unwrap();
        assert_eq!(found.shape.topology(), split.shape.topology());
        assert!((found.shape.volume() - split.shape.volume()).abs() < 1e-12);
    }
}

#[test]
fn wicked_fields_give_closed_manifolds() {
    survive_wicked_fields(Method::Octree, |options| options);
    // With a coarse error and several levels.
    survive_wicked_fields(Method::Octree, |options| Options {
        cell: options.cell / 4.0,
        error: Some(options.cell),
        ..options
    });
}

#[test]
fn too_many_cells_are_refused_before_the_work() {
    let field = compiled("x^2 + y^2 + z^2 - 1");
    let options = Options {
        cell: 1e-5,
        error: Some(1e-14),
        ..Options::new(cube(3, -1.3, 1.3))
    };
    match surface(&field, &options) {
        Err(PolygonizeError::TooManyCells { needed, .. }) => assert!(needed > 1e9, "{needed}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn thread_counts_give_the_same_mesh() {
    let field = compiled("cos(x)*sin(y) + cos(y)*sin(z) + cos(z)*sin(x)");
    let options = Options {
        cell: 2.0 * PI / 64.0,
        error: Some(0.02),
        cap: true,
        ..Options::new(cube(3, -PI, PI))
    };
    assert_same_on_threads(|| surface(&field, &options).unwrap());
}
