//! Marching cubes with vertices merged at grid points: the same surface, with better triangles.

use crate::support::{Closure, Made, cube, mesh};
use crate::trilinear::Grid;
use glam::DVec3;
use imp::engine::{Field, Silent};
use imp::geometry::{Bounds, Mesh};
use imp::polygonize::{Method, Options};

fn made(field: &dyn Field, bounds: Bounds, cells: f64, snap: bool) -> Made<Mesh> {
    let options = Options {
        cell: bounds.size().x / cells,
        cap: true,
        snap,
        ..Options::new(bounds)
    };
    mesh(field, (Method::Cubes, &options), &Silent).unwrap()
}

/// Twice the inradius divided by the circumradius of every triangle, ascending: 1 if equilateral.
fn radius_ratios(mesh: &Mesh) -> Vec<f64> {
    let ratio = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
        let [p, q, r] = [b.distance(c), c.distance(a), a.distance(b)];
        (q + r - p) * (r + p - q) * (p + q - r) / (p * q * r)
    };
    let mut ratios: Vec<f64> = mesh.triangles.iter().map(ratio).collect();
    ratios.sort_by(f64::total_cmp);
    ratios
}

fn smooth_fields() -> [(Box<dyn Field>, Bounds); 3] {
    let field = |function: fn(DVec3) -> (f64, DVec3)| -> Box<dyn Field> {
        Box::new(Closure {
            dimension: 3,
            function,
        })
    };
    let torus = |p: DVec3| {
        let rho = p.x.hypot(p.y);
        let across = (rho - 1.0) / rho;
        let gradient = 2.0 * DVec3::new(across * p.x, across * p.y, p.z);
        ((rho - 1.0).powi(2) + p.z * p.z - 0.16, gradient)
    };
    let tanglecube = |p: DVec3| {
        let terms = p * p * p * p - 5.0 * p * p;
        (terms.element_sum() + 11.8, 4.0 * p * p * p - 10.0 * p)
    };
    [
        (
            field(|p| (p.length_squared() - 1.0, 2.0 * p)),
            cube(3, -1.3, 1.3),
        ),
        (field(torus), cube(3, -1.6, 1.6)),
        (field(tanglecube), cube(3, -2.8, 2.8)),
    ]
}

#[test]
fn slivers_disappear_and_the_surface_stays() {
    for (number, (field, bounds)) in smooth_fields().into_iter().enumerate() {
        let [plain, snapped] = [false, true].map(|snap| made(&*field, bounds, 64.0, snap));
        let (before, after) = (plain.shape.topology(), snapped.shape.topology());
        assert!(after.watertight && after.manifold && after.oriented);
        assert_eq!(before.components, after.components, "field {number}");
        let euler = [&before, &after].map(|topology| topology.euler_characteristic());
        assert_eq!(euler[0], euler[1], "field {number}");
        // Vertices are on the surface, and no facet is turned over.
        for (position, normal) in snapped.shape.positions.iter().zip(&snapped.shape.normals) {
            let (value, gradient) = field.value_gradient(*position);
            assert!(value.abs() / gradient.length() <= 1e-9 * bounds.diagonal());
            assert!(normal.distance(gradient.normalize()) < 1e-12);
        }
        for triangle in &snapped.shape.triangles {
            let at = |vertex: usize| snapped.shape.positions[triangle[vertex] as usize];
            let across = (at(1) - at(0)).cross(at(2) - at(0));
            assert!(across.dot(snapped.shape.normals[triangle[0] as usize]) > 0.0);
        }
        let worst_percent = |mesh: &Mesh| {
            let ratios = radius_ratios(mesh);
            ratios[ratios.len() / 100]
        };
        assert!(worst_percent(&plain.shape) < 0.05, "field {number}");
        assert!(worst_percent(&snapped.shape) > 0.5, "field {number}");
        assert!(snapped.shape.triangles.len() < plain.shape.triangles.len());
        // Facets with sides e lie up to e²/12r inside a tube of radius r, whose volume is r/2 times
        // its area: 0.4 % of the torus.
        assert!((snapped.shape.volume() / plain.shape.volume() - 1.0).abs() < 4e-3);
    }
}

/// Where merging would join or pinch sheets it is left out.
#[test]
fn random_grids_keep_their_topology() {
    let mut state = 88_172_645_463_325_252u64;
    for seed in 0..1000 {
        let grid = Grid::closed(6, || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        });
        let field = grid.field();
        let bounds = cube(3, 0.0, 5.0);
        let [plain, snapped] = [false, true].map(|snap| made(&field, bounds, 5.0, snap));
        let invariants = |mesh: &Mesh| {
            let topology = mesh.topology();
            assert!(topology.watertight && topology.manifold && topology.oriented);
            (topology.components, topology.euler_characteristic())
        };
        assert_eq!(
            invariants(&plain.shape),
            invariants(&snapped.shape),
            "{seed}"
        );
    }
}

/// Thin plates and touching sheets share grid points, but not vertices.
#[test]
fn sheets_closer_than_a_cell_stay_apart() {
    let plate = Closure {
        dimension: 3,
        function: |p: DVec3| ((p.z - 0.01).abs() - 0.04, DVec3::Z * (p.z - 0.01).signum()),
    };
    let found = made(&plate, cube(3, -1.0, 1.0), 20.0, true);
    let topology = found.shape.topology();
    assert!(topology.watertight && topology.manifold && topology.oriented);
    assert_eq!(found.shape.genus(), Some(0));
    assert!((found.shape.volume() - 4.0 * 0.08).abs() < 1e-6);
}
