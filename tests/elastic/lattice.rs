//! Lattices: volume, area and Euler characteristic of known solids, and errors.

use std::f64::consts::PI;

use glam::DVec3;
use imp::elastic::{Division, ElasticError, Lattice};
use imp::engine::{Field, Silent};
use imp::geometry::Bounds;

use crate::solids::{ball, cube, cuboid, solid, torus};

fn lattice(field: &dyn Field, bounds: Bounds, cell: f64) -> Lattice {
    let division = Division {
        cell,
        ..Division::new(bounds)
    };
    Lattice::new(field, &division, &Silent).unwrap()
}

fn error(field: &dyn Field, bounds: Bounds, cell: f64) -> ElasticError {
    let division = Division {
        cell,
        ..Division::new(bounds)
    };
    Lattice::new(field, &division, &Silent).unwrap_err()
}

/// What holds for every lattice in space.
fn check(lattice: &Lattice) {
    let mesh = lattice.mesh();
    let topology = mesh.topology();
    assert!(topology.watertight && topology.manifold && topology.oriented);
    let volume = lattice.volume();
    assert!((mesh.volume() - volume).abs() < 1e-12 * volume);
    assert!(lattice.least_quality() >= 0.03);
    // Each simplex by itself, with no use of the program's own measure.
    for simplex in &lattice.simplices {
        let [a, b, c, d] = simplex.map(|node| lattice.nodes[node as usize]);
        assert!((b - a).cross(c - a).dot(d - a) > 0.0);
    }
}

/// The error of the volume falls with the square of the cell for a smooth solid, with the cell where edges
/// are cut off; that of the area with the cell, since steep neighbours of the boundary's facets do not
/// vanish faster.
#[test]
fn volumes_and_areas_are_those_of_closed_forms() {
    let sides = DVec3::new(0.8, 0.73, 1.1);
    let faces = sides.x * sides.y + sides.y * sides.z + sides.z * sides.x;
    let cases = [
        (ball(3, 1.0), 1.23, 4.0 / 3.0 * PI, 4.0 * PI, 2, 0.01),
        (
            torus(1.0, 0.4),
            1.57,
            2.0 * PI * PI * 0.16,
            4.0 * PI * PI * 0.4,
            0,
            0.02,
        ),
        (
            cuboid(3, sides),
            1.23,
            8.0 * sides.element_product(),
            8.0 * faces,
            2,
            0.02,
        ),
    ];
    for (field, half, volume, area, euler, tolerance) in cases {
        let lattice = lattice(&field, cube(3, half), 0.1);
        check(&lattice);
        let mesh = lattice.mesh();
        assert!((lattice.volume() / volume - 1.0).abs() < tolerance);
        assert!((mesh.area() / area - 1.0).abs() < 0.04);
        assert_eq!(mesh.euler_characteristic(), euler);
        assert_eq!((lattice.remarks.pieces, lattice.remarks.cut), (1, 0));
    }
}

/// Of a box of whole cells only simplices at its edges are lost, whose corners all lie on the surface: less
/// than half of the square of a cell along every edge.
#[test]
fn a_box_that_fits_the_grid_loses_parts_of_its_edges_only() {
    let half = DVec3::new(0.5, 0.75, 1.0);
    let lattice = lattice(&cuboid(3, half), cube(3, 1.5), 0.25);
    check(&lattice);
    let edges = 4.0 * (1.0 + 1.5 + 2.0);
    let lost = 3.0 - lattice.volume();
    assert!((0.0..0.5 * 0.25 * 0.25 * edges).contains(&lost), "{lost}");
    let steps = lattice.nodes.iter().map(|&node| node / 0.25);
    assert!(
        steps
            .into_iter()
            .all(|step| (step - step.round()).length() < 1e-12)
    );
}

#[test]
fn nodes_of_the_boundary_lie_on_the_surface() {
    let field = ball(3, 1.0);
    let lattice = lattice(&field, cube(3, 1.23), 0.15);
    let off = |point: &DVec3| (point.length() - 1.0).abs() > 1e-6;
    let far = lattice
        .mesh()
        .positions
        .iter()
        .filter(|point| off(point))
        .count();
    assert_eq!(far, lattice.remarks.off_surface);
    assert!(far < lattice.mesh().positions.len() / 50);
}

#[test]
fn a_disk_is_divided_into_triangles_within_one_curve() {
    let lattice = lattice(&ball(2, 1.0), cube(2, 1.23), 0.05);
    assert!((lattice.volume() / PI - 1.0).abs() < 2e-3);
    let curves = lattice.curves();
    assert_eq!(curves.components(), 1);
    // Counter-clockwise.
    assert!((curves.polylines[0].signed_area() - lattice.volume()).abs() < 1e-12);
    // Some nodes that belong on the circle are a part of a cell, 0.05, inside of it.
    assert!((curves.length() / (2.0 * PI) - 1.0).abs() < 0.02);
}

/// Two squares that have a corner in common there are no single solid.
#[test]
fn a_joint_of_one_point_is_taken_apart() {
    let chess = solid(2, |p| (-p.x * p.y, DVec3::new(-p.y, -p.x, 0.0)));
    let lattice = lattice(&chess, cube(2, 1.0), 0.5);
    assert_eq!(lattice.remarks.pieces, 2);
    assert_eq!(lattice.curves().components(), 2);
    assert!((lattice.volume() - 2.0).abs() < 1e-12);
}

#[test]
fn what_cannot_be_divided_is_refused() {
    let sphere = ball(3, 1.0);
    let is_cell = |cell| {
        matches!(
            error(&sphere, cube(3, 1.2), cell),
            ElasticError::Cell { .. }
        )
    };
    assert!([2.5, 0.0, -1.0, f64::NAN].into_iter().all(is_cell));
    let small = error(&sphere, cube(3, 1.2), 1e-5);
    assert!(matches!(
        small,
        ElasticError::TooManyCells {
            limit: 4_194_304,
            ..
        }
    ));
    let nothing = solid(3, |p| (p.length() + 1.0, p / p.length()));
    assert!(matches!(
        error(&nothing, cube(3, 1.0), 0.1),
        ElasticError::Empty { undefined: 0, .. }
    ));
    let undefined = solid(3, |_| (f64::NAN, DVec3::NAN));
    assert!(matches!(
        error(&undefined, cube(3, 1.0), 0.5),
        ElasticError::Empty {
            points: 125,
            undefined: 125
        }
    ));
    assert!(matches!(
        error(&sphere, cube(3, 0.3), 0.1),
        ElasticError::Full { .. }
    ));
    let sheet = solid(3, |p| (p.z.abs() - 0.01, DVec3::Z * p.z.signum()));
    assert!(matches!(
        error(&sheet, cube(3, 1.0), 0.25),
        ElasticError::Thin { .. }
    ));
    assert!(matches!(
        error(&sphere, cube(2, 1.0), 0.25),
        ElasticError::Dimension {
            field: 3,
            bounds: 2
        }
    ));
}

/// Where the field ends, the solid does: the half x < 0 of a ball that is undefined beyond.
#[test]
fn a_solid_ends_where_its_field_does() {
    let half = solid(3, |p| match p.x <= 0.0 {
        true => (p.length_squared() - 1.0, 2.0 * p),
        false => (f64::NAN, DVec3::NAN),
    });
    let lattice = lattice(&half, cube(3, 1.23), 0.1);
    assert!(lattice.remarks.undefined > 0);
    assert!((lattice.volume() / (2.0 / 3.0 * PI) - 1.0).abs() < 0.05);
    assert!(lattice.nodes.iter().all(|node| node.x < 1e-6));
}

#[test]
fn lattices_do_not_depend_on_threads() {
    let make = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap()
            .install(|| lattice(&torus(1.0, 0.4), cube(3, 1.57), 0.15))
    };
    assert_eq!(make(1), make(3));
}
