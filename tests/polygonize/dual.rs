//! Dual contouring: topology, measures, sharp edges, and that it is manifold on any input.

use std::f64::consts::PI;

use glam::DVec3;
use imp::engine::{Field, Silent};
use imp::geometry::{FieldValues, Mesh};
use imp::polygonize::{Method, Options, PolygonizeError};

use crate::support::{self, Closure, Made, cube};

fn space<F: Fn(DVec3) -> (f64, DVec3) + Send + Sync>(function: F) -> Closure<F> {
    Closure {
        dimension: 3,
        function,
    }
}

fn dual(field: &dyn Field, options: &Options) -> Result<Made<Mesh>, PolygonizeError> {
    support::mesh(field, (Method::Dual, options), &Silent)
}

/// The options for a cube around 0 with so many cells along a side.
fn options(half: f64, cells: usize) -> Options {
    Options {
        cell: 2.0 * half / cells as f64,
        cap: true,
        ..support::open(cube(3, -half, half))
    }
}

fn sphere() -> impl Field {
    space(|p| (p.length() - 1.0, p.normalize_or_zero()))
}

fn torus() -> impl Field {
    space(|p| {
        let rho = p.x.hypot(p.y);
        let gradient = 2.0 * DVec3::new((rho - 1.0) * p.x / rho, (rho - 1.0) * p.y / rho, p.z);
        ((rho - 1.0).powi(2) + p.z * p.z - 0.16, gradient)
    })
}

/// A turn that no axis goes along with, and its inverse.
fn turned(p: DVec3) -> DVec3 {
    let (s, c) = 0.5f64.sin_cos();
    let a = DVec3::new(c * p.x - s * p.y, s * p.x + c * p.y, p.z);
    DVec3::new(a.x, c * a.y - s * a.z, s * a.y + c * a.z)
}

pub(crate) fn turned_back(b: DVec3) -> DVec3 {
    let (s, c) = 0.5f64.sin_cos();
    let a = DVec3::new(b.x, c * b.y + s * b.z, -s * b.y + c * b.z);
    DVec3::new(c * a.x + s * a.y, -s * a.x + c * a.y, a.z)
}

/// A cube of half side 0.8 with a hole of radius 0.4, turned off the axes.
pub(crate) fn drilled_cube() -> impl Field {
    space(|p| {
        let b = turned(p);
        let side = b.abs().max_element();
        let axis = (0..3).find(|&axis| b[axis].abs() == side).unwrap_or(0);
        let (hull, hole) = (side - 0.8, 0.4 - b.x.hypot(b.y));
        if hull > hole {
            let mut normal = DVec3::ZERO;
            normal[axis] = b[axis].signum();
            (hull, turned_back(normal))
        } else {
            let outward = DVec3::new(-b.x, -b.y, 0.0) / b.x.hypot(b.y);
            (hole, turned_back(outward))
        }
    })
}

/// The distance from a point to a triangle.
pub(crate) fn distance(point: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let segment = |a: DVec3, b: DVec3| {
        let along = ((point - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        point.distance(a + along * (b - a))
    };
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let foot = point - normal * normal.dot(point - a);
    let sides = [(a, b), (b, c), (c, a)];
    let within = |(from, to): &(DVec3, DVec3)| (*to - *from).cross(foot - *from).dot(normal) >= 0.0;
    if normal != DVec3::ZERO && sides.iter().all(within) {
        return point.distance(foot);
    }
    let along = sides.iter().map(|&(from, to)| segment(from, to));
    along.fold(f64::INFINITY, f64::min)
}

fn assert_sound(mesh: &Mesh, genus: usize, components: usize, name: &str) {
    let topology = mesh.topology();
    assert!(
        topology.watertight && topology.manifold,
        "{name}: {topology:?}"
    );
    assert_eq!(topology.genus(), Some(genus), "{name}");
    assert_eq!(topology.components, components, "{name}");
}

#[test]
fn sphere_and_torus_have_their_topology_area_and_volume() {
    let made = dual(&sphere(), &options(1.3, 40)).unwrap();
    assert_sound(&made.shape, 0, 1, "sphere");
    // Chords of length h fall short of an arc of curvature 1 by h²/8, areas by some of it twice.
    let error = (2.6f64 / 40.0).powi(2) / 2.0;
    assert!((made.shape.area() / (4.0 * PI) - 1.0).abs() < error);
    assert!((made.shape.volume() / (4.0 * PI / 3.0) - 1.0).abs() < error);
    // Every vertex is on the surface.
    let diagonal = 2.6 * 3f64.sqrt();
    for position in &made.shape.positions {
        assert!((position.length() - 1.0).abs() <= 1e-9 * diagonal);
    }
    let made = dual(&torus(), &options(1.5, 48)).unwrap();
    assert_sound(&made.shape, 1, 1, "torus");
    let error = (3.0f64 / 48.0).powi(2) / (2.0 * 0.4f64.powi(2));
    assert!((made.shape.area() / (4.0 * PI * PI * 0.4) - 1.0).abs() < error);
    assert!((made.shape.volume() / (2.0 * PI * PI * 0.16) - 1.0).abs() < error);
}

#[test]
fn sharp_edges_and_corners_are_on_the_mesh_and_no_facet_is_flipped() {
    let field = drilled_cube();
    for cells in [24, 41] {
        let made = dual(&field, &options(1.6, cells)).unwrap();
        let mesh = &made.shape;
        assert_sound(mesh, 1, 1, "drilled cube");
        let triangles: Vec<[DVec3; 3]> = (mesh.triangles.iter())
            .map(|corners| corners.map(|corner| mesh.positions[corner as usize]))
            .collect();
        let worst = |points: &mut dyn Iterator<Item = DVec3>| {
            let nearest = |point| {
                let distances = triangles.iter().map(|&triangle| distance(point, triangle));
                distances.fold(f64::INFINITY, f64::min)
            };
            points.map(nearest).fold(0.0, f64::max)
        };
        let edges = (0..3).flat_map(|axis| {
            (0..4).flat_map(move |side| {
                (0..=60).map(move |step| {
                    let mut point = DVec3::ZERO;
                    point[axis] = -0.8 + 1.6 * f64::from(step) / 60.0;
                    point[(axis + 1) % 3] = if side & 1 == 0 { -0.8 } else { 0.8 };
                    point[(axis + 2) % 3] = if side & 2 == 0 { -0.8 } else { 0.8 };
                    turned_back(point)
                })
            })
        });
        let distance = worst(&mut edges.into_iter());
        assert!(
            distance < 1e-6,
            "{cells}: the cube's edges are {distance} away"
        );
        for corners in &triangles {
            let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let (_, gradient) = field.value_gradient(centre);
            assert!(normal.dot(gradient) > 0.0, "{corners:?}");
        }
    }
}

/// |x| + |y| + |z| = 1.
fn octahedron() -> impl Field {
    space(|p| (p.abs().element_sum() - 1.0, p.signum()))
}

/// A cone with its apex at (0, 0, 1) on a disk of radius 1 at z = −1.
fn cone() -> impl Field {
    space(|p| {
        let radius = p.x.hypot(p.y);
        let side = radius - (1.0 - p.z) / 2.0;
        if side >= -p.z - 1.0 {
            let outward = DVec3::new(p.x, p.y, 0.0).normalize_or_zero();
            (side, outward + 0.5 * DVec3::Z)
        } else {
            (-p.z - 1.0, DVec3::NEG_Z)
        }
    })
}

/// A cube around a point, given its half side.
fn hull(p: DVec3, centre: f64, half: f64) -> (f64, DVec3) {
    let from = p - centre;
    let side = from.abs().max_element();
    let axis = (0..3).find(|&axis| from[axis].abs() == side).unwrap_or(0);
    let mut normal = DVec3::ZERO;
    normal[axis] = from[axis].signum();
    (side - half, normal)
}

/// Two cubes that overlap, with corners in points of a lattice of tenths.
fn cubes() -> impl Field {
    space(|p| {
        let (one, other) = (hull(p, -0.3, 0.6), hull(p, 0.3, 0.5));
        if one.0 <= other.0 { one } else { other }
    })
}

/// A gyroid in a ball: where both meet at a small angle it has blades thinner than a cell.
fn blades() -> impl Field {
    space(|p| {
        let (ball, k) = (p.length_squared() - 0.81, 6.0);
        let [(sx, cx), (sy, cy), (sz, cz)] = (k * p).to_array().map(f64::sin_cos);
        let gyroid = sx * cy + sy * cz + sz * cx;
        let gradient = DVec3::new(cx * cy - sz * sx, cy * cz - sx * sy, cz * cx - sy * sz);
        if ball >= gyroid {
            (ball, 2.0 * p)
        } else {
            (gyroid, k * gradient)
        }
    })
}

/// How many facets have no area or are turned against F_x at their centre.
fn folded(field: &dyn Field, mesh: &Mesh) -> usize {
    let values = |points: &[DVec3]| {
        let pairs = points.iter().map(|&point| field.value_gradient(point));
        let (values, gradients) = pairs.unzip();
        FieldValues { values, gradients }
    };
    let deviation = mesh.deviation(&values(&mesh.positions), &values(&mesh.facet_centers()));
    deviation.turned + mesh.quality().unwrap().degenerate
}

/// Fails unless a closed surface without handles has no facet that is folded or meets another.
fn assert_good(field: &dyn Field, made: &Made<Mesh>, name: &str) {
    assert_sound(&made.shape, 0, 1, name);
    assert_eq!(folded(field, &made.shape), 0, "{name}");
    assert_eq!(made.statistics.folded_facets, 0, "{name}");
    let pairs = made.shape.self_intersections();
    assert!(pairs.is_empty(), "{name}: {pairs:?}");
}

/// The greatest distance of some points from a mesh.
fn farthest(points: impl Iterator<Item = DVec3>, mesh: &Mesh) -> f64 {
    let distances = points.map(|point| {
        let triangles = mesh.triangles.iter();
        let corners = triangles.map(|own| own.map(|corner| mesh.positions[corner as usize]));
        let distances = corners.map(|corners| distance(point, corners));
        distances.fold(f64::INFINITY, f64::min)
    });
    distances.fold(0.0, f64::max)
}

#[test]
fn an_octahedron_folds_nothing_and_is_exact_wherever_its_edges_lie() {
    let field = octahedron();
    // With 33 cells the edges run through the middle of cells, else along their faces.
    for cells in [16, 20, 31, 33, 50, 64] {
        let made = dual(&field, &options(1.5, cells)).unwrap();
        let (mesh, name) = (&made.shape, format!("octahedron, {cells} cells"));
        assert_good(&field, &made, &name);
        let corners = (0..6).map(|corner| {
            let mut point = DVec3::ZERO;
            point[corner / 2] = if corner % 2 == 0 { -1.0 } else { 1.0 };
            point
        });
        let distance = farthest(corners, mesh);
        assert!(distance < 1e-9, "{name}: a corner is {distance} away");
        let worst = mesh.quality().unwrap().hundredth_ratio;
        assert!(worst > 0.05, "{name}: {worst}");
        // Eight equilateral triangles with sides of length √2.
        assert!((mesh.area() - 4.0 * 3f64.sqrt()).abs() < 1e-9, "{name}");
        assert!((mesh.volume() - 4.0 / 3.0).abs() < 1e-9, "{name}");
        let edges = (0..12).flat_map(|edge| {
            (0..=20).map(move |step| {
                let along = f64::from(step) / 20.0;
                let sign = |bit: i32| if edge >> bit & 1 == 0 { -1.0 } else { 1.0 };
                let axis = edge as usize / 4;
                let mut point = DVec3::ZERO;
                point[axis] = sign(0) * along;
                point[(axis + 1) % 3] = sign(1) * (1.0 - along);
                point
            })
        });
        let distance = farthest(edges, mesh);
        assert!(distance < 1e-9, "{name}: an edge is {distance} away");
    }
}

#[test]
fn apexes_and_corners_on_lattice_points_fold_nothing() {
    let field = cone();
    for cells in [16, 31, 33, 50, 64] {
        let made = dual(&field, &options(1.5, cells)).unwrap();
        let name = format!("cone, {cells} cells");
        assert_good(&field, &made, &name);
        let distance = farthest([DVec3::Z].into_iter(), &made.shape);
        assert!(distance < 1e-6, "{name}: the apex is {distance} away");
        let worst = made.shape.quality().unwrap().hundredth_ratio;
        assert!(worst > 0.3, "{name}: {worst}");
    }
    let field = cubes();
    for cells in [16, 31, 32, 50] {
        let made = dual(&field, &options(1.6, cells)).unwrap();
        let name = format!("two cubes, {cells} cells");
        assert_good(&field, &made, &name);
        // Sides of 1.2 and 1, of which (−0.2..0.3)³ is in both.
        let volume = 1.2f64.powi(3) + 1.0 - 0.5f64.powi(3);
        assert!((made.shape.volume() - volume).abs() < 1e-9, "{name}");
    }
}

#[test]
fn facets_that_stay_folded_are_counted() {
    let field = blades();
    for cells in [24, 50] {
        let made = dual(&field, &options(1.1, cells)).unwrap();
        let topology = made.shape.topology();
        assert!(topology.watertight && topology.manifold, "{topology:?}");
        // Otherwise there is nothing to be counted.
        assert!(made.statistics.folded_facets > 0, "{cells}");
        assert_eq!(made.statistics.folded_facets, folded(&field, &made.shape));
    }
}

/// A number between −1 and 1 for each point of a grid (SplitMix64).
fn noise(seed: u64, [x, y, z]: [i64; 3]) -> f64 {
    let mut state = seed
        .wrapping_mul(0x9E37_79B9_7F4A_7C15)
        .wrapping_add((x as u64).wrapping_mul(0xBF58_476D_1CE4_E5B9))
        .wrapping_add((y as u64).wrapping_mul(0x94D0_49BB_1331_11EB))
        .wrapping_add((z as u64).wrapping_mul(0xD6E8_FEB8_6659_FD93));
    state = (state ^ state >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    state = (state ^ state >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    2.0 * ((state ^ state >> 31) >> 11) as f64 / (1u64 << 53) as f64 - 1.0
}

/// The trilinear interpolant of noise at integer points, with its gradient.
fn trilinear(seed: u64, p: DVec3) -> (f64, DVec3) {
    let base = p.floor();
    let t = p - base;
    let (mut value, mut gradient) = (0.0, DVec3::ZERO);
    for corner in 0..8 {
        let upper = [corner & 1, corner >> 1 & 1, corner >> 2 & 1];
        let at = [0, 1, 2].map(|axis| base[axis] as i64 + upper[axis]);
        let weight = [0, 1, 2].map(|axis| {
            if upper[axis] == 1 {
                t[axis]
            } else {
                1.0 - t[axis]
            }
        });
        let slope = upper.map(|upper| if upper == 1 { 1.0 } else { -1.0 });
        let own = noise(seed, at);
        value += own * weight[0] * weight[1] * weight[2];
        gradient += own
            * DVec3::new(
                slope[0] * weight[1] * weight[2],
                weight[0] * slope[1] * weight[2],
                weight[0] * weight[1] * slope[2],
            );
    }
    (value, gradient)
}

#[test]
fn random_signs_always_give_closed_manifolds() {
    for seed in 0..400 {
        let field = space(move |p| trilinear(seed, p));
        let options = Options {
            cell: 1.0,
            cap: true,
            ..support::open(cube(3, 0.0, 4.0))
        };
        let made = dual(&field, &options).unwrap();
        let topology = made.shape.topology();
        assert!(
            topology.watertight && topology.manifold,
            "{seed}: {topology:?}"
        );
    }
}

#[test]
fn without_a_cap_surfaces_end_in_the_sides_of_the_box() {
    let options = Options {
        cell: 0.1,
        ..support::open(cube(3, -0.8, 0.8))
    };
    let made = dual(&sphere(), &options).unwrap();
    assert!(made.statistics.cut_by_box);
    let topology = made.shape.topology();
    assert!(topology.manifold && topology.oriented, "{topology:?}");
    // The sphere of radius 1 reaches through each of the six sides, but through no edge of the
    // box: the corners of the box are outside, the middles of its edges, at 1.13, too.
    assert_eq!(topology.boundary_loops, 6);
    let furthest = made.shape.positions.iter().map(|p| p.abs().max_element());
    assert_eq!(furthest.fold(0.0, f64::max), 0.8);
}

#[test]
fn a_cap_closes_the_surface_along_the_box_with_sharp_rims() {
    let plane = space(|p| (p.dot(DVec3::new(0.6, 0.0, 0.8)), DVec3::new(0.6, 0.0, 0.8)));
    let made = dual(&plane, &options(1.0, 16)).unwrap();
    assert_sound(&made.shape, 0, 1, "half a box");
    // Half of the box, whose faces are flat: exact but for rounding.
    assert!(
        (made.shape.volume() - 4.0).abs() < 1e-12,
        "{}",
        made.shape.volume()
    );
}

#[test]
fn bad_fields_give_closed_manifolds_or_an_error() {
    type Function = fn(DVec3) -> (f64, DVec3);
    let fields: [(&str, Function); 6] = [
        ("crossing planes", |p| {
            (p.x * p.y, DVec3::new(p.y, p.x, 0.0))
        }),
        ("pole", |p| {
            let r = p.length_squared() - 1.0;
            (1.0 / r, -2.0 * p / (r * r))
        }),
        ("nan region", |p| {
            let root = (p.x + 0.3).sqrt();
            let gradient = 2.0 * p + DVec3::X * (0.5 / root);
            (p.length_squared() - 1.0 + root, gradient)
        }),
        ("zero on a region", |p| {
            let r = p.length() - 1.0;
            (
                r.max(0.0),
                if r > 0.0 { p.normalize() } else { DVec3::ZERO },
            )
        }),
        ("heart", |p| {
            let a = p.x * p.x + 2.25 * p.y * p.y + p.z * p.z - 1.0;
            let z3 = p.z.powi(3);
            let value = a.powi(3) - p.x * p.x * z3 - 0.1125 * p.y * p.y * z3;
            let inner = DVec3::new(2.0 * p.x, 4.5 * p.y, 2.0 * p.z) * (3.0 * a * a);
            let outer = DVec3::new(
                2.0 * p.x * z3,
                0.225 * p.y * z3,
                3.0 * p.z * p.z * (p.x * p.x + 0.1125 * p.y * p.y),
            );
            (value, inner - outer)
        }),
        ("through grid points", |p| {
            (p.abs().element_sum() - 1.0, p.signum())
        }),
    ];
    for (name, function) in fields {
        match dual(&space(function), &options(1.5, 24)) {
            Ok(made) => {
                let topology = made.shape.topology();
                assert!(
                    topology.watertight && topology.manifold,
                    "{name}: {topology:?}"
                );
                assert!(made.shape.positions.iter().all(|p| p.is_finite()), "{name}");
            }
            Err(PolygonizeError::NoSurface { .. }) => {
                assert!(matches!(name, "pole" | "zero on a region"), "{name}");
            }
            Err(error) => panic!("{name}: {error}"),
        }
    }
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let field = drilled_cube();
    let results = [1, 2, 4].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| dual(&field, &options(1.6, 30)).unwrap())
    });
    assert_eq!(results[0], results[1]);
    assert_eq!(results[0], results[2]);
}
