//! Adapted triangulations: circles, spheres, tori and cylinders with their measures and the quality of
//! their polygons.

use std::f64::consts::{PI, TAU};

use crate::support::{Closure, cube};
use glam::DVec3;
use imp::engine::{Field, Silent};
use imp::polygonize::{Method, Options, PolygonizeError, Polygonized, Shape, polygonize};

fn distance_squared(point: DVec3) -> (f64, DVec3) {
    (point.length_squared() - 1.0, 2.0 * point)
}

fn torus(point: DVec3) -> (f64, DVec3) {
    let away = point.x.hypot(point.y);
    let out = away - 1.0;
    let gradient = DVec3::new(out * point.x / away, out * point.y / away, point.z);
    (out * out + point.z * point.z - 0.16, 2.0 * gradient)
}

fn cylinder(point: DVec3) -> (f64, DVec3) {
    distance_squared(point.with_z(0.0))
}

fn adapted(field: &dyn Field, cells: f64, cap: bool) -> Result<Polygonized, PolygonizeError> {
    let options = Options {
        method: Some(Method::Springs),
        cell: 3.2 / cells,
        cap,
        ..Options::new(cube(field.dimension(), -1.6, 1.6))
    };
    polygonize(field, &options, &Silent)
}

#[test]
fn circles_are_one_curve_and_their_triangulations_subordinated() {
    let circle = Closure {
        dimension: 2,
        function: distance_squared,
    };
    for cells in [6.0, 12.0, 60.0, 80.0] {
        let found = adapted(&circle, cells, false).unwrap();
        let Shape::Curves(curves) = &found.shape else {
            panic!("no curves")
        };
        assert_eq!(curves.closed_components(), 1);
        // A chord c of the unit circle is shorter than its arc by c² / 24, and none is longer than
        // two sides of a cell.
        let error = 1.0 - curves.length() / TAU;
        assert!(error > 0.0 && error < (6.4 / cells) * (6.4 / cells) / 24.0);
        let subordination = found.statistics.subordination.unwrap();
        assert!(subordination.at_rest);
        assert_eq!(subordination.after.transversal, 1.0);
        assert!(subordination.after.parallel > subordination.before.parallel);
    }
}

#[test]
fn surfaces_have_their_topology_and_good_triangles() {
    type Known = (fn(DVec3) -> (f64, DVec3), usize, f64, f64);
    let known: [Known; 2] = [
        (distance_squared, 0, 4.0 * PI, 4.0 * PI / 3.0),
        (torus, 1, 1.6 * PI * PI, 0.32 * PI * PI),
    ];
    for (function, genus, area, volume) in known {
        let field = Closure {
            dimension: 3,
            function,
        };
        let found = adapted(&field, 32.0, true).unwrap();
        let Shape::Mesh(mesh) = &found.shape else {
            panic!("no mesh")
        };
        let topology = mesh.topology();
        assert!(topology.watertight && topology.manifold);
        assert_eq!((topology.components, topology.genus()), (1, Some(genus)));
        // Chords as long as a cell h, a radius of curvature 0.4: h² / 4 R² of it at most.
        assert!((mesh.area() / area - 1.0).abs() < 0.016);
        assert!((mesh.volume() / volume - 1.0).abs() < 0.016);
        let quality = mesh.quality().unwrap();
        assert!(quality.mean_ratio >= 0.85 && quality.hundredth_ratio >= 0.4);
        let subordination = found.statistics.subordination.unwrap();
        assert!(subordination.at_rest);
        assert!(subordination.energy[1] < subordination.energy[0]);
        let [plain, adapted] = subordination.polygons;
        assert_eq!(adapted.quality, Some(quality));
        assert!(plain.quality.unwrap().mean_ratio < 0.7);
        assert!(adapted.shortest > 2.0 * plain.shortest);
        assert_eq!(subordination.after.transversal, 1.0);
    }
}

#[test]
fn cylinders_are_open_at_the_box_or_refused() {
    let field = Closure {
        dimension: 3,
        function: cylinder,
    };
    let found = adapted(&field, 16.0, false).unwrap();
    let Shape::Mesh(mesh) = &found.shape else {
        panic!("no mesh")
    };
    assert!(found.statistics.cut_by_box);
    assert_eq!(mesh.topology().boundary_loops, 2);
    assert!((mesh.area() / (TAU * 3.2) - 1.0).abs() < 0.01);
    assert!(matches!(
        adapted(&field, 16.0, true),
        Err(PolygonizeError::BadOption { option: "cap", .. })
    ));
}
