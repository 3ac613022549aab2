//! Solids as tetrahedra of even shape: measures, topology and how they hang together.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use glam::DVec3;
use imp::elastic::{Division, Lattice, Relaxation};
use imp::engine::{Field, Silent};
use imp::geometry::Bounds;

use crate::solids::{ball, cube, cuboid, solid, torus};

fn relaxed(field: &dyn Field, bounds: Bounds, cell: f64) -> (Lattice, Relaxation) {
    let division = Division {
        cell,
        ..Division::new(bounds)
    };
    let mut lattice = Lattice::new(field, &division, &Silent).unwrap();
    let relaxation = lattice.relax(field, &bounds, &Silent).unwrap();
    (lattice, relaxation)
}

/// Inner faces are those of exactly two simplices, outer ones those of the boundary; and the simplices fill
/// what the boundary encloses.
fn check(lattice: &Lattice) {
    let dimension = lattice.dimension;
    let mut faces: BTreeMap<Vec<u32>, usize> = BTreeMap::new();
    let mut volume = 0.0;
    for simplex in &lattice.simplices {
        let [a, b, c, d] = simplex.map(|node| lattice.nodes[node as usize]);
        let measure = match dimension {
            2 => (b - a).perp_dot_z(c - a) / 2.0,
            _ => (b - a).cross(c - a).dot(d - a) / 6.0,
        };
        assert!(measure > 0.0);
        volume += measure;
        for left_out in 0..=dimension {
            let mut face: Vec<u32> = simplex[..=dimension].to_vec();
            face.remove(left_out);
            face.sort_unstable();
            *faces.entry(face).or_default() += 1;
        }
    }
    let alone = faces.values().filter(|&&count| count == 1).count();
    assert!(faces.values().all(|&count| count <= 2));
    assert_eq!(alone, lattice.boundary.len());
    assert!((lattice.volume() - volume).abs() < 1e-12 * volume);
    let enclosed = match dimension {
        2 => lattice.curves().enclosed_area().unwrap(),
        _ => {
            let topology = lattice.mesh().topology();
            assert!(topology.watertight && topology.manifold && topology.oriented);
            lattice.mesh().volume()
        }
    };
    assert!((enclosed - volume).abs() < 1e-12 * volume);
}

trait Plane {
    fn perp_dot_z(self, other: DVec3) -> f64;
}

impl Plane for DVec3 {
    fn perp_dot_z(self, other: DVec3) -> f64 {
        self.x * other.y - self.y * other.x
    }
}

/// How far the nodes of the boundary are from F = 0, to first order.
fn farthest(lattice: &Lattice, field: &dyn Field) -> f64 {
    let nodes = lattice.boundary.iter().flatten();
    let distances = nodes.map(|&node| {
        let point = lattice.nodes[node as usize].to_array();
        let columns: Vec<&[f64]> = point[..lattice.dimension].chunks(1).collect();
        let mut value = [0.0];
        let mut slopes = vec![[0.0]; lattice.dimension];
        let mut slots: Vec<&mut [f64]> = slopes.iter_mut().map(|slot| &mut slot[..]).collect();
        field.gradients(&columns, &mut value, &mut slots);
        let squares: f64 = slopes.iter().map(|[slope]| slope * slope).sum();
        value[0].abs() / squares.sqrt()
    });
    distances.fold(0.0, f64::max)
}

fn worst(lattice: &Lattice) -> (f64, f64, f64) {
    let ratios = lattice.solid().radius_ratios();
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    (mean, ratios[ratios.len() / 100], ratios[0])
}

/// The error falls with the square of the cell; nodes are on the surface, simplices well-shaped.
#[test]
fn smooth_solids_have_their_volumes_and_even_simplices() {
    let ring = Bounds::from_sides(&[(-1.57, 1.57), (-1.57, 1.57), (-0.57, 0.57)]).unwrap();
    type Case = (&'static str, Box<dyn Field>, Bounds, f64, i64);
    let cases: [Case; 3] = [
        (
            "ball",
            Box::new(ball(3, 1.0)),
            cube(3, 1.23),
            4.0 / 3.0 * PI,
            1,
        ),
        ("disk", Box::new(ball(2, 1.0)), cube(2, 1.23), PI, 1),
        (
            "ring",
            Box::new(torus(1.0, 0.4)),
            ring,
            2.0 * PI * PI * 0.16,
            0,
        ),
    ];
    for (name, field, bounds, volume, euler) in cases {
        let mut errors = Vec::new();
        for cell in [0.2, 0.1] {
            let (lattice, relaxation) = relaxed(&*field, bounds, cell);
            check(&lattice);
            assert_eq!(lattice.euler_characteristic(), euler, "{name}");
            assert_eq!(lattice.remarks.off_surface, 0, "{name} {cell}");
            assert!(farthest(&lattice, &*field) < 1e-5 * cell, "{name} {cell}");
            let (mean, hundredth, least) = worst(&lattice);
            assert!(
                mean > 0.68 && hundredth > 0.45 && least > 0.3,
                "{name} {cell}: {mean} {hundredth} {least}"
            );
            assert!(relaxation.energy[1] < relaxation.energy[0], "{name} {cell}");
            errors.push((volume - lattice.volume()) / volume);
        }
        // The boundary's chords are inside or near: about cell²/R² / 2 at most.
        assert!(
            errors[0] > 0.0 && errors[0] < 2.0 * 0.04,
            "{name} {errors:?}"
        );
        assert!(errors[1] < 0.36 * errors[0], "{name} {errors:?}");
    }
}

#[test]
fn edges_lose_little_and_thin_holes_remain() {
    let half = DVec3::new(0.8, 0.73, 0.9);
    let (lattice, _) = relaxed(&cuboid(3, half), cube(3, 1.1), 0.1);
    check(&lattice);
    assert_eq!(lattice.euler_characteristic(), 1);
    let volume = 8.0 * half.element_product();
    let edges = 8.0 * half.element_sum();
    let lost = volume - lattice.volume();
    assert!(lost > -1e-3 && lost < 0.5 * 0.01 * edges, "{lost}");
    // A shell has a boundary of two spheres and the Euler characteristic of a sphere.
    let shell = solid(3, |p: DVec3| {
        let length = p.length();
        let side = if length > 0.75 { 1.0 } else { -1.0 };
        ((length - 0.75).abs() - 0.25, side * p / length)
    });
    let (lattice, _) = relaxed(&shell, cube(3, 1.13), 0.12);
    check(&lattice);
    assert_eq!(lattice.euler_characteristic(), 2);
    let volume = 4.0 / 3.0 * PI * (1.0 - 0.125);
    assert!((lattice.volume() - volume).abs() < 0.03 * volume);
}

#[test]
fn what_the_box_cuts_ends_in_its_sides() {
    let (lattice, _) = relaxed(
        &ball(3, 1.0),
        Bounds::from_sides(&[(0.0, 1.2), (-1.2, 1.2), (-1.2, 1.2)]).unwrap(),
        0.15,
    );
    check(&lattice);
    assert!(lattice.remarks.cut > 0);
    assert_eq!(lattice.euler_characteristic(), 1);
    let least = lattice
        .nodes
        .iter()
        .map(|node| node.x)
        .fold(f64::INFINITY, f64::min);
    assert_eq!(least, 0.0);
    assert!((lattice.volume() - 2.0 / 3.0 * PI).abs() < 0.04 * 2.0 / 3.0 * PI);
    // A ring without its middle in R2.
    let ring = solid(2, |p: DVec3| {
        let length = p.length();
        let side = if length > 0.7 { 1.0 } else { -1.0 };
        ((length - 0.7).abs() - 0.3, side * p / length)
    });
    let (lattice, _) = relaxed(&ring, cube(2, 1.1), 0.1);
    check(&lattice);
    assert_eq!(lattice.euler_characteristic(), 0);
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let build = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().unwrap();
        pool.install(|| relaxed(&torus(1.0, 0.4), cube(3, 1.6), 0.2))
    };
    assert_eq!(build(1), build(4));
}
