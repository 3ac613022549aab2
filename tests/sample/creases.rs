//! Creases and corners of zero sets, against closed forms.

use std::f64::consts::{SQRT_2, TAU};

use glam::DVec3;
use imp::engine::{CompiledField, Field, Silent};
use imp::geometry::Bounds;
use imp::sample::{CreasePoint, Creases, creases};

use crate::trace::compiled;

const TOLERANCE: f64 = 1e-10;

fn field(text: &str) -> CompiledField {
    compiled(text).pop().unwrap()
}

fn cube(dimension: usize, half: f64) -> Bounds {
    Bounds::from_sides(&vec![(-half, half); dimension]).unwrap()
}

fn found(text: &str, bounds: Bounds) -> Creases {
    creases(&field(text), bounds, TOLERANCE, &Silent).unwrap()
}

/// In R3, in the box -2..2 (a little off, so that nothing is in the middle of anything).
fn in_space(body: &str) -> Creases {
    let sides = [(-2.03, 2.01), (-2.02, 2.04), (-2.0, 2.05)];
    found(
        &format!("field f(p in R3) = {body}"),
        Bounds::from_sides(&sides).unwrap(),
    )
}

fn show(creases: &Creases) {
    eprintln!("{:?}", creases.report);
    for crease in &creases.arcs {
        eprintln!("{:?} {} {}", crease.corners, crease.closed, crease.length);
    }
    for corner in &creases.corners {
        eprintln!("{:?}", corner);
    }
}

/// Twelve edges and eight corners of the cube with the half side `half`.
fn check_cube(creases: &Creases, half: f64) {
    show(creases);
    assert_eq!(creases.report.undecided, 0);
    assert_eq!((creases.arcs.len(), creases.corners.len()), (12, 8));
    for crease in &creases.arcs {
        assert!(!crease.closed && crease.corners.iter().all(Option::is_some));
        assert!((crease.length - 2.0 * half).abs() < 1e-9, "{}", crease.length);
    }
    for corner in &creases.corners {
        let off = (corner.position.abs() - DVec3::splat(half)).abs();
        assert!(off.max_element() < 1e-12, "{}", corner.position);
        // The normals of the three faces point outward.
        assert_eq!(corner.normals.len(), 3);
        for axis in 0..3 {
            let normal = DVec3::AXES[axis] * corner.position[axis].signum();
            assert!(corner.normals.iter().any(|n| n.distance(normal) < 1e-9));
        }
    }
}

#[test]
fn a_cube_has_twelve_edges_and_eight_corners() {
    check_cube(&in_space("max(abs(p.x), abs(p.y), abs(p.z)) - 1"), 1.0);
    check_cube(&in_space("max(abs(p)) - 1"), 1.0);
}

#[test]
fn so_has_the_librarys_box_whose_distance_is_another_function_outside() {
    check_cube(&in_space("box(2)(p)"), 1.0);
    check_cube(&in_space("complement(box(1.4))(p)"), 0.7);
}
