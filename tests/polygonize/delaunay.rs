//! Meshes whose vertices are samples: restricted Delaunay triangulations.

use std::f64::consts::PI;

use glam::DVec3;
use imp::engine::{CompiledField, Field, Monitor, Silent};
use imp::geometry::{Mesh, Quality};
use imp::polygonize::{Method, Options, PolygonizeError};
use imp::sample::{self, sample};

use crate::support::{self, Made, cube, open};
use crate::surfaces::{assert_closed, compiled};

/// Floaters on a surface in a cube from -side to side.
fn floaters(field: &CompiledField, side: f64, count: u64) -> Vec<DVec3> {
    let options = sample::Options {
        bounds: Some(cube(3, -side, side)),
        count: Some(count),
        ..sample::Options::default()
    };
    sample(field, &options, &Silent).unwrap().samples.positions
}

fn joined(
    field: &dyn Field,
    side: f64,
    samples: Vec<DVec3>,
) -> Result<Made<Mesh>, PolygonizeError> {
    let options = Options {
        samples,
        ..open(cube(3, -side, side))
    };
    support::mesh(field, (Method::Delaunay, &options), &Silent)
}

fn quality(mesh: &Mesh) -> Quality {
    mesh.quality().unwrap()
}

#[test]
fn floaters_become_the_vertices_of_good_triangles() {
    let surfaces = [
        ("x^2 + y^2 + z^2 - 1", 0),
        ("(sqrt(x^2 + y^2) - 1)^2 + z^2 - 0.16", 1),
        ("x^2 + 4*y^2 + 9*z^2 - 1", 0),
        (
            "0.5 - exp(-4*((x - 0.5)^2 + y^2 + z^2)) - exp(-4*((x + 0.5)^2 + y^2 + z^2))",
            0,
        ),
        ("max(abs(x), abs(y), abs(z)) - 0.7", 0),
    ];
    for (formula, genus) in surfaces {
        let field = compiled(formula);
        let samples = floaters(&field, 1.6, 1500);
        let made = joined(&field, 1.6, samples.clone()).unwrap();
        let topology = assert_closed(formula, &made);
        assert_eq!(
            (topology.components, topology.genus()),
            (1, Some(genus)),
            "{formula}"
        );
        // Every sample, and nothing else, is a vertex; closed surfaces have χ = V − F/2.
        assert_eq!(
            made.statistics.inserted + made.statistics.left_out,
            0,
            "{formula}"
        );
        assert_eq!(topology.vertices, samples.len());
        assert_eq!(made.shape.self_intersecting_triangles(), 0);
        assert!(quality(&made.shape).hundredth_ratio >= 0.5, "{formula}");
        assert!(made.statistics.max_residual <= 1e-9 * 1.6 * 12.0_f64.sqrt());
        for (position, normal) in made.shape.positions.iter().zip(&made.shape.normals) {
            assert!(
                samples
                    .iter()
                    .any(|sample| sample.distance(*position) < 1e-8)
            );
            let gradient = field.value_gradient(*position).1;
            assert!(normal.dot(gradient.normalize()) > 1.0 - 1e-12);
        }
    }
}

#[test]
fn edges_and_corners_of_a_cube_are_kept() {
    let field = compiled("max(abs(x), abs(y), abs(z)) - 0.7");
    let made = joined(&field, 1.0, floaters(&field, 1.0, 1500)).unwrap();
    // The cube of side 1.4, whose edges have vertices all along, loses nothing.
    assert!((made.shape.volume() - 1.4_f64.powi(3)).abs() < 1e-9);
    assert!((made.shape.area() - 6.0 * 1.4 * 1.4).abs() < 1e-9);
}

/// Where a gyroid meets a ball there are sharp edges, which floaters mark; both methods see the same solid.
#[test]
fn the_gyroid_in_a_ball_has_the_topology_of_dual_contouring() {
    let formula = "max(sqrt(x^2 + y^2 + z^2) - 1, \
                   sin(3.5*x)*cos(3.5*y) + sin(3.5*y)*cos(3.5*z) + sin(3.5*z)*cos(3.5*x))";
    let field = compiled(formula);
    let made = joined(&field, 1.1, floaters(&field, 1.1, 3000)).unwrap();
    let topology = assert_closed(formula, &made);
    let options = Options {
        cell: 0.04,
        ..open(cube(3, -1.1, 1.1))
    };
    let dual = support::mesh(&field, (Method::Dual, &options), &Silent).unwrap();
    let expected = dual.shape.topology();
    assert_eq!((topology.components, topology.genus()), (1, Some(2)));
    assert_eq!((expected.components, expected.genus()), (1, Some(2)));
    assert!((made.shape.volume() / dual.shape.volume() - 1.0).abs() < 0.01);
    assert!((made.shape.area() / dual.shape.area() - 1.0).abs() < 0.01);
    assert!(quality(&made.shape).hundredth_ratio > 0.4);
}

/// Points that lie evenly on the unit sphere, in a spiral.
fn spiral(count: usize) -> Vec<DVec3> {
    let angle = PI * (3.0 - 5.0_f64.sqrt());
    let point = |number: usize| {
        let z = 1.0 - (2.0 * number as f64 + 1.0) / count as f64;
        let around = angle * number as f64;
        let radius = (1.0 - z * z).sqrt();
        DVec3::new(radius * around.cos(), radius * around.sin(), z)
    };
    (0..count).map(point).collect()
}

#[test]
fn no_sample_is_in_front_of_a_triangle_on_a_sphere() {
    // What is Delaunay on a sphere is the convex hull.
    let field = compiled("x^2 + y^2 + z^2 - 1");
    for count in [4, 5, 12, 300] {
        let made = joined(&field, 1.5, spiral(count)).unwrap();
        assert_closed("sphere", &made);
        let mesh = &made.shape;
        assert_eq!(mesh.positions.len(), count);
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
            let normal = (b - a).cross(c - a).normalize();
            for point in &mesh.positions {
                // Samples are on the sphere to 1e-9 of the diagonal.
                assert!(normal.dot(*point - a) < 1e-7);
            }
        }
    }
}

#[test]
fn flat_surfaces_end_at_the_box() {
    let field = compiled("z");
    let mut samples = Vec::new();
    for x in -10..=10 {
        samples.extend((-10..=10).map(|y| DVec3::new(f64::from(x), f64::from(y), 0.0) / 10.0));
    }
    let made = joined(&field, 1.0, samples.clone()).unwrap();
    let topology = made.shape.topology();
    assert!(topology.manifold && topology.oriented && topology.boundary_loops == 1);
    assert!(made.statistics.cut_by_box && made.statistics.inserted == 0);
    assert!(
        (made.shape.area() - 4.0).abs() < 1e-9,
        "{}",
        made.shape.area()
    );
    // Doubles and what is not on the surface are no vertices.
    let count = samples.len();
    samples.extend_from_within(..7);
    samples.push(DVec3::new(0.5, 0.5, 0.5));
    let again = joined(&field, 1.0, samples).unwrap();
    assert_eq!(again.shape.positions.len(), count);
    assert_eq!(again.statistics.left_out, 8);
}

#[test]
fn too_few_samples_are_told_of() {
    let field = compiled("x^2 + y^2 + z^2 - 1");
    let two = joined(&field, 1.5, spiral(2));
    assert_eq!(two.unwrap_err(), PolygonizeError::TooSparse { samples: 2 });
    let off = joined(&field, 1.5, vec![DVec3::ZERO; 3]);
    assert_eq!(off.unwrap_err(), PolygonizeError::NoSamples { samples: 3 });
    let none = joined(&compiled("x^2 + y^2 + z^2 + 1"), 1.5, Vec::new());
    assert!(
        matches!(none, Err(PolygonizeError::NoSurface { .. })),
        "{none:?}"
    );
}

#[test]
fn where_samples_are_too_sparse_vertices_are_added() {
    // The samples know nothing of the second sphere.
    let field = compiled("min(x^2 + y^2 + z^2 - 1, (x - 2.5)^2 + y^2 + z^2 - 1)");
    let made = joined(&field, 4.0, spiral(200)).unwrap();
    let topology = assert_closed("two spheres", &made);
    assert_eq!(topology.components, 2);
    assert!(made.statistics.inserted >= 4);
    let ring = compiled("(sqrt(x^2 + y^2) - 1)^2 + z^2 - 0.04");
    let made = joined(&ring, 1.6, floaters(&ring, 1.6, 40)).unwrap();
    assert_eq!(assert_closed("ring", &made).genus(), Some(1));
}

#[test]
fn without_samples_floaters_have_the_distance_of_a_cell() {
    let field = compiled("x^2 + y^2 + z^2 - 1");
    let options = Options {
        iso: 0.44,
        cell: 0.15,
        ..open(cube(3, -1.5, 1.5))
    };
    let made = support::mesh(&field, (Method::Delaunay, &options), &Silent).unwrap();
    assert_closed("sphere", &made);
    let mean = made.shape.mean_edge_length();
    assert!((mean / 0.15 - 1.0).abs() < 0.1, "{mean}");
    let radii = made.shape.positions.iter().map(|point| point.length());
    assert!(radii.into_iter().all(|radius| (radius - 1.2).abs() < 1e-8));
}

#[test]
fn random_samples_make_a_manifold_too() {
    let field = compiled("(sqrt(x^2 + y^2) - 1)^2 + z^2 - 0.16");
    let options = sample::Options {
        bounds: Some(cube(3, -1.5, 1.5)),
        count: Some(2000),
        method: sample::Method::Rays,
        ..sample::Options::default()
    };
    let samples = sample(&field, &options, &Silent).unwrap().samples.positions;
    let made = joined(&field, 1.5, samples).unwrap();
    assert_eq!(assert_closed("torus", &made).genus(), Some(1));
}

#[test]
fn surfaces_in_the_sides_of_the_box_are_whole() {
    let options = Options {
        cell: 0.1,
        ..open(cube(3, -1.0, 1.0))
    };
    let surfaces = [("x - 1", 4.0), ("max(abs(x), abs(y), abs(z)) - 1", 24.0)];
    for (formula, area) in surfaces {
        let made = support::mesh(&compiled(formula), (Method::Delaunay, &options), &Silent);
        let mesh = made.unwrap().shape;
        assert!((mesh.area() / area - 1.0).abs() < 0.01, "{formula}");
    }
}

/// Wants an end at once.
struct Hasty;

impl Monitor for Hasty {
    fn progress(&self, _phase: &str, _fraction: f64) {}

    fn cancelled(&self) -> bool {
        true
    }
}

#[test]
fn it_can_be_cancelled() {
    let field = compiled("x^2 + y^2 + z^2 - 1");
    let options = Options {
        samples: spiral(50),
        ..open(cube(3, -1.5, 1.5))
    };
    let found = support::mesh(&field, (Method::Delaunay, &options), &Hasty);
    assert_eq!(found.unwrap_err(), PolygonizeError::Cancelled);
}
