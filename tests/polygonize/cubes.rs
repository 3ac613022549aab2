//! Surfaces with known topology and measures.

use std::f64::consts::PI;

use crate::support::{self, Closure, Made, cube};
use crate::surfaces::compiled;
use glam::DVec3;
use imp::engine::{Field, Monitor, Silent};
use imp::geometry::{Mesh, Topology};
use imp::polygonize::{Method, Options, PolygonizeError};

fn surface(
    field: &dyn Field,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Made<Mesh>, PolygonizeError> {
    support::mesh(field, (Method::Cubes, options), monitor)
}

/// A field in R3, from a closure that returns F and F_x.
fn space<F: Fn(DVec3) -> (f64, DVec3) + Send + Sync>(function: F) -> Closure<F> {
    Closure {
        dimension: 3,
        function,
    }
}

fn sphere() -> impl Field {
    space(|p| (p.length_squared() - 1.0, 2.0 * p))
}

/// The torus with radii 1 and 0.4 around the z axis.
fn torus() -> impl Field {
    space(|p| {
        let rho = p.x.hypot(p.y);
        let gradient = 2.0 * DVec3::new((rho - 1.0) * p.x / rho, (rho - 1.0) * p.y / rho, p.z);
        ((rho - 1.0).powi(2) + p.z * p.z - 0.16, gradient)
    })
}

fn tanglecube(c: f64) -> impl Field {
    space(move |p| {
        let terms = p * p * p * p - 5.0 * p * p;
        (terms.element_sum() + c, 4.0 * p * p * p - 10.0 * p)
    })
}

fn gyroid() -> impl Field {
    space(|p| {
        let (s, c) = (p.map(f64::sin), p.map(f64::cos));
        let gradient = DVec3::new(
            c.z * c.x - s.x * s.y,
            c.x * c.y - s.y * s.z,
            c.y * c.z - s.z * s.x,
        );
        (c.x * s.y + c.y * s.z + c.z * s.x, gradient)
    })
}

/// Three interlocked rings.
fn orthocircles() -> impl Field {
    // One ring in the plane of the first two coordinates: its value and gradient.
    let ring = |a: f64, b: f64, c: f64| {
        let disk = a * a + b * b - 1.0;
        (
            disk * disk + c * c,
            [4.0 * disk * a, 4.0 * disk * b, 2.0 * c],
        )
    };
    space(move |p| {
        let (f, [fx, fy, fz]) = ring(p.x, p.y, p.z);
        let (g, [gy, gz, gx]) = ring(p.y, p.z, p.x);
        let (h, [hz, hx, hy]) = ring(p.z, p.x, p.y);
        let [f_x, g_x, h_x] = [[fx, fy, fz], [gx, gy, gz], [hx, hy, hz]].map(DVec3::from_array);
        let thickness = 0.075 * 0.075;
        let value = f * g * h - thickness * (1.0 + 3.0 * p.length_squared());
        (
            value,
            f_x * g * h + f * g_x * h + f * g * h_x - 6.0 * thickness * p,
        )
    })
}

/// The surface over `low..high` in every axis with this many cells along each.
fn run(field: &dyn Field, (low, high): (f64, f64), cells: usize, cap: bool) -> Made<Mesh> {
    let options = Options {
        cell: (high - low) / cells as f64,
        cap,
        ..support::open(cube(3, low, high))
    };
    surface(field, &options, &Silent).unwrap()
}

/// The topology, after checks that hold for every closed surface.
fn closed(found: &Made<Mesh>) -> Topology {
    let topology = found.shape.topology();
    assert!(
        topology.watertight && topology.manifold && topology.oriented,
        "{topology:?}"
    );
    assert_eq!(found.statistics.poor_roots, 0);
    assert_eq!(found.shape.normals.len(), found.shape.positions.len());
    topology
}

fn assert_relative(found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found / expected - 1.0).abs() <= tolerance,
        "{found} instead of {expected}"
    );
}

#[test]
fn a_sphere_has_its_area_and_volume_and_outward_normals() {
    let found = run(&sphere(), (-1.3, 1.3), 64, false);
    assert_eq!(closed(&found).genus(), Some(0));
    assert_eq!(found.shape.components(), 1);
    assert_relative(found.shape.area(), 4.0 * PI, 1e-3);
    assert_relative(found.shape.volume(), 4.0 * PI / 3.0, 1e-3);
    let diagonal = 2.6 * 3f64.sqrt();
    for (position, normal) in found.shape.positions.iter().zip(&found.shape.normals) {
        assert!((position.length() - 1.0).abs() <= 2e-9 * diagonal);
        assert!(position.distance(*normal) <= 2e-9 * diagonal);
    }
    assert!(found.statistics.max_residual <= 1e-9 * diagonal);
    assert_eq!(found.statistics.cells, 64 * 64 * 64);
    assert!(!found.statistics.cut_by_box);
}

#[test]
fn a_torus_has_one_handle() {
    let found = run(&torus(), (-1.6, 1.6), 64, false);
    assert_eq!(closed(&found).genus(), Some(1));
    assert_relative(found.shape.area(), 4.0 * PI * PI * 0.4, 2e-3);
    assert_relative(found.shape.volume(), 2.0 * PI * PI * 0.16, 3e-3);
}

#[test]
fn orthocircles_have_seven_handles() {
    // The tubes are thin: the measures need 128 cells to come within 0.5 %.
    let found = run(&orthocircles(), (-1.4, 1.4), 128, false);
    assert_eq!(closed(&found).genus(), Some(7));
    assert_eq!(found.shape.components(), 1);
    assert_relative(found.shape.area(), 18.983, 5e-3);
    assert_relative(found.shape.volume(), 1.7731, 5e-3);
}

#[test]
fn the_tanglecube_passes_through_its_topologies() {
    // (c, components, χ) on either side of the critical values 18.75, 12.5, 6.25 and 0.
    for (c, components, euler) in [(15.0, 8, 16), (11.8, 1, -8), (3.0, 2, 4), (-1.0, 1, 2)] {
        let found = run(&tanglecube(c), (-2.8, 2.8), 48, false);
        let topology = closed(&found);
        assert_eq!(topology.components, components, "c = {c}");
        assert_eq!(topology.euler_characteristic(), euler, "c = {c}");
    }
    // The measures come within 0.1 % at 128 cells.
    let found = run(&tanglecube(11.8), (-2.8, 2.8), 128, false);
    assert_eq!(closed(&found).genus(), Some(5));
    assert_relative(found.shape.area(), 100.941, 1e-3);
    assert_relative(found.shape.volume(), 29.944, 1e-3);
}

#[test]
fn a_field_without_a_zero_is_an_error_that_says_what_was_seen() {
    let options = Options {
        cell: 0.2,
        ..support::open(cube(3, -2.8, 2.8))
    };
    let points = 29 * 29 * 29;
    let nan = space(|_| (f64::NAN, DVec3::NAN));
    for (field, counts) in [
        (&tanglecube(19.0) as &dyn Field, [0, points, 0]),
        (&tanglecube(-500.0), [points, 0, 0]),
        (&nan, [0, 0, points]),
    ] {
        match surface(field, &options, &Silent) {
            Err(PolygonizeError::NoSurface {
                below,
                above,
                undefined,
                ..
            }) => {
                assert_eq!([below, above, undefined], counts);
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_capped_gyroid_is_closed() {
    for cells in [31, 40] {
        let found = run(&gyroid(), (-PI, PI), cells, true);
        let topology = closed(&found);
        assert_eq!(topology.genus(), Some(2));
        assert_eq!(topology.components, 1);
        assert!(found.statistics.cut_by_box);
        assert_relative(found.shape.volume(), 124.025, 2e-3);
        let bounds = cube(3, -PI, PI);
        assert!(
            found
                .shape
                .positions
                .iter()
                .all(|&position| bounds.contains(position))
        );
    }
}

#[test]
fn without_a_cap_the_gyroid_is_open_along_the_box_only() {
    let found = run(&gyroid(), (-PI, PI), 32, false);
    let topology = found.shape.topology();
    assert!(topology.manifold && topology.oriented && !topology.watertight);
    assert!(found.statistics.cut_by_box);
}

#[test]
fn a_capped_ball_has_its_volume_and_area_and_its_caps_lie_in_the_box() {
    // The ball of radius 1 in the cube |x|, |y|, |z| ≤ 0.9: six spherical caps of height 0.1 are
    // missing, and do not meet.
    let found = run(&sphere(), (-0.9, 0.9), 60, true);
    assert_eq!(closed(&found).genus(), Some(0));
    let volume = 4.0 * PI / 3.0 - 6.0 * PI * 0.01 * (3.0 - 0.1) / 3.0;
    let area = 4.0 * PI - 6.0 * 2.0 * PI * 0.1 + 6.0 * PI * 0.19;
    assert_relative(found.shape.volume(), volume, 1e-3);
    assert_relative(found.shape.area(), area, 1e-3);
    // Cap vertices have the normal of their side, the others that of the sphere.
    for (position, normal) in found.shape.positions.iter().zip(&found.shape.normals) {
        if (position.length() - 1.0).abs() > 1e-6 {
            let side = position.abs().max_position();
            assert_eq!(position[side].abs(), 0.9);
            assert_eq!(*normal, DVec3::AXES[side] * position[side].signum());
        }
    }
}

#[test]
fn caps_meet_at_the_edges_and_corners_of_the_box_without_slivers() {
    // The box minus the ball of radius 1/2 about each corner: what a cap does at box edges.
    let field = space(|p| {
        let inner = p.abs() - DVec3::ONE;
        (0.25 - inner.length_squared(), -2.0 * inner * p.signum())
    });
    let found = run(&field, (-1.0, 1.0), 24, true);
    assert_eq!(closed(&found).genus(), Some(0));
    assert_relative(found.shape.volume(), 8.0 - 4.0 * PI / 3.0 / 8.0, 1e-3);
    // And the complement: eight eighths of a ball.
    let field = space(|p| {
        let inner = p.abs() - DVec3::ONE;
        (inner.length_squared() - 0.25, 2.0 * inner * p.signum())
    });
    let corners = run(&field, (-1.0, 1.0), 48, true);
    assert_eq!(closed(&corners).components, 8);
    assert_relative(corners.shape.volume(), 4.0 * PI / 3.0 / 8.0, 5e-3);
    for mesh in [&found.shape, &corners.shape] {
        let mut sides = mesh
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        assert!(sides.all(|(a, b)| mesh.positions[a as usize] != mesh.positions[b as usize]));
    }
}

#[test]
fn planes_through_grid_points_are_without_slivers() {
    let directions = [
        DVec3::Z,
        DVec3::new(1.0, 1.0, 0.0),
        DVec3::new(1.0, -1.0, 1.0),
    ];
    // With 8 cells F is exactly 0 at grid points on the plane, with 10 only up to rounding.
    for (cells, rounding) in [(8, 0.0), (10, 1e-15)] {
        for normal in directions
            .into_iter()
            .flat_map(|direction| [direction, -direction])
        {
            let plane = space(move |p| (p.dot(normal), normal));
            let capped = run(&plane, (-1.0, 1.0), cells, true);
            closed(&capped);
            // Every plane through the centre halves the box.
            assert_relative(capped.shape.volume(), 4.0, 1e-12);
            let open = run(&plane, (-1.0, 1.0), cells, false);
            let topology = open.shape.topology();
            assert!(topology.manifold && topology.oriented);
            assert_eq!((topology.components, topology.boundary_loops), (1, 1));
            let mut positions = open.shape.positions.iter();
            assert!(positions.all(|position| position.dot(normal).abs() <= rounding));
            let area = |&[a, b, c]: &[u32; 3]| {
                let [a, b, c] = [a, b, c].map(|vertex| open.shape.positions[vertex as usize]);
                0.5 * (b - a).cross(c - a).dot(normal.normalize())
            };
            let mut areas = open.shape.triangles.iter().map(area);
            assert!(
                areas.all(|area| area > 1e-3),
                "{cells} cells, normal {normal}"
            );
        }
    }
}

#[test]
fn crossing_planes_become_a_manifold() {
    let planes = space(|p| (p.x * p.y, DVec3::new(p.y, p.x, 0.0)));
    for cells in [8, 9] {
        let found = run(&planes, (-1.0, 1.0), cells, true);
        let topology = found.shape.topology();
        assert!(topology.watertight && topology.manifold && topology.oriented);
        // Two of the four quarters of the box, apart along the z axis, up to a cell's half.
        assert_eq!(topology.components, 2);
        let cell = 2.0 / cells as f64;
        assert!((found.shape.volume() - 4.0).abs() <= 2.0 * cell * cell);
    }
}

/// A field that is a pole, a jump or undefined on the unit sphere, negative within.
fn discontinuous_balls() -> [Box<dyn Field>; 3] {
    let pole = space(|p| {
        let below = p.length_squared() - 1.0;
        (1.0 / below, -2.0 * p / (below * below))
    });
    let jump = space(|p| ((p.length() * 2.0).floor() - 1.5, DVec3::ZERO));
    let undefined = space(|p| {
        let root = (1.0 - p.length_squared()).sqrt();
        (root - 2.0, -p / root)
    });
    [Box::new(pole), Box::new(jump), Box::new(undefined)]
}

#[test]
fn poles_jumps_and_undefined_regions_are_counted_and_still_closed() {
    for (number, field) in discontinuous_balls().into_iter().enumerate() {
        // A ball is cut out of the middle, so that there is a level set.
        let hollow = space(|p| {
            if p.length() < 0.75 {
                (0.25 - p.length_squared(), -2.0 * p)
            } else {
                field.value_gradient(p)
            }
        });
        let found = run(&hollow, (-1.3, 1.3), 24, false);
        let topology = found.shape.topology();
        assert!(topology.watertight && topology.manifold && topology.oriented);
        assert_eq!(topology.components, 2);
        assert_eq!(topology.euler_characteristic(), 4);
        let is_at =
            |radius: f64| move |position: &&DVec3| (position.length() - radius).abs() < 1e-6;
        let positions = &found.shape.positions;
        let statistics = found.statistics;
        let poor = positions.iter().filter(is_at(1.0)).count();
        assert_eq!(statistics.poor_roots, poor);
        let good = positions.iter().filter(is_at(0.5)).count();
        assert_eq!(statistics.good_roots, good);
        assert_eq!(good + poor, positions.len());
        let ends_domain = number == 2;
        assert_eq!(statistics.domain_ends, if ends_domain { poor } else { 0 });
        assert_eq!(statistics.nan_points > 0, ends_domain);
    }
}

#[test]
fn poles_jumps_and_ends_of_the_domain_alone_are_no_surface() {
    let pole = space(|p| (1.0 / p.x, DVec3::new(-1.0 / (p.x * p.x), 0.0, 0.0)));
    let cubic = space(|p| (p.x.powi(-3), DVec3::new(-3.0 * p.x.powi(-4), 0.0, 0.0)));
    let oblique = space(|p| {
        let along = p.x + 0.5 * p.y - 0.25 * p.z;
        (1.0 / along, DVec3::new(1.0, 0.5, -0.25) / -(along * along))
    });
    let jump = space(|p| (if p.x > 0.01 { 1.0 } else { -1.0 }, DVec3::ZERO));
    let end = space(|p| (-0.5 - p.x.sqrt(), DVec3::new(-0.5 / p.x.sqrt(), 0.0, 0.0)));
    let mut fields: Vec<Box<dyn Field>> = discontinuous_balls().into();
    fields.extend([Box::new(pole) as Box<dyn Field>, Box::new(cubic)]);
    fields.extend([
        Box::new(oblique) as Box<dyn Field>,
        Box::new(jump),
        Box::new(end),
    ]);
    for (number, field) in fields.iter().enumerate() {
        // With the first box a grid plane lies exactly at the pole.
        for high in [1.0, 1.1] {
            // Caps are no roots.
            for cap in [false, true] {
                let options = Options {
                    cell: 0.125,
                    cap,
                    ..support::open(cube(3, -1.0, high))
                };
                match surface(field.as_ref(), &options, &Silent) {
                    Err(PolygonizeError::NoSurface { .. }) => {}
                    Err(error) => panic!("field {number} up to {high}: {error}"),
                    Ok(found) => panic!("field {number} up to {high}: {:?}", found.statistics),
                }
            }
        }
    }
}

/// Near 10¹⁰ numbers are 2e-6 apart: as it is computed, the field is a staircase.
#[test]
fn where_rounding_makes_stairs_of_a_continuous_field_there_is_a_surface() {
    let field = compiled("sin(x + 1e10)");
    // The zeros of the sine are the multiples of π, of which this one is next to 10¹⁰.
    let zero = (1e10 / PI).ceil() * PI - 1e10;
    let options = Options {
        cell: 0.125,
        ..support::open(cube(3, -1.0, 1.0))
    };
    for method in [Method::Cubes, Method::Dual, Method::Tetrahedra] {
        let made = support::mesh(&field, (method, &options), &Silent).unwrap();
        assert_eq!(made.statistics.poor_roots, 0, "{method:?}");
        for position in &made.shape.positions {
            // π itself is known to 4e-16, of which there are 3e9.
            assert!((position.x - zero).abs() < 5e-6, "{method:?}: {position}");
        }
        assert!((made.shape.area() - 4.0).abs() < 1e-3, "{method:?}");
    }
}

#[test]
fn the_end_of_the_domain_bounds_the_solid() {
    // Inside is 0 ≤ x < 1/4, an eighth of the box; F is undefined for x < 0.
    let field = space(|p| (p.x.sqrt() - 0.5, DVec3::new(0.5 / p.x.sqrt(), 0.0, 0.0)));
    for cells in [15, 16] {
        let found = run(&field, (-1.0, 1.0), cells, true);
        let topology = found.shape.topology();
        assert!(topology.watertight && topology.manifold && topology.oriented);
        assert_relative(found.shape.volume(), 1.0, 1e-6);
        let statistics = found.statistics;
        let points = (cells + 1) * (cells + 1);
        assert_eq!(statistics.good_roots, points);
        assert_eq!(statistics.poor_roots, points);
        assert_eq!(statistics.domain_ends, points);
        assert!(statistics.max_residual <= 1e-9 * 2.0 * 3f64.sqrt());
    }
}

#[test]
fn boxes_beyond_the_range_of_numbers_are_refused() {
    let field = sphere();
    for sides in [
        [(-1e308, 1e308); 3],
        [(0.0, 1e-300), (0.0, 1e300), (0.0, 1.0)],
        [(1e307, 1.1e307), (0.0, 1.0), (0.0, 1.0)],
    ] {
        let bounds = imp::geometry::Bounds::from_sides(&sides).unwrap();
        match surface(&field, &support::open(bounds), &Silent) {
            Err(PolygonizeError::BadOption { option, .. }) => assert_eq!(option, "bounds"),
            other => panic!("{other:?}"),
        }
    }
    // Boxes barely within the range are worked off, whatever the result.
    for sides in [
        [(0.0, 1e-300), (0.0, 1e150), (0.0, 1.0)],
        [(-1e153, 1e153); 3],
        [(-1e-200, 1e-200); 3],
    ] {
        let bounds = imp::geometry::Bounds::from_sides(&sides).unwrap();
        for cap in [false, true] {
            let options = Options {
                cap,
                ..support::open(bounds)
            };
            let result = surface(&field, &options, &Silent);
            assert!(!matches!(result, Err(PolygonizeError::BadOption { .. })));
        }
    }
}

#[test]
fn steep_fields_have_exact_vertices() {
    let shell = space(|p| {
        let e = (40.0 * (p.length() - 1.0)).exp();
        (e - 1.0, 40.0 * e * p.normalize_or_zero())
    });
    let found = run(&shell, (-1.5, 1.5), 20, false);
    closed(&found);
    assert!(
        found
            .shape
            .positions
            .iter()
            .all(|p| (p.length() - 1.0).abs() < 1e-8)
    );

    let rounded_cube = space(|p| {
        let power = |n| p.map(|x: f64| x.powi(n));
        (power(20).element_sum() - 1.0, 20.0 * power(19))
    });
    let found = run(&rounded_cube, (-1.5, 1.5), 20, false);
    closed(&found);
    // The mesh of a convex body lies inside it, its vertices on its surface.
    assert!(found.shape.volume() < 8.0 && found.shape.volume() > 7.5);
    assert!(found.statistics.max_residual <= 1e-9 * 3.0 * 3f64.sqrt());
}

#[test]
fn levels_are_surfaces_of_the_shifted_field() {
    let distance = space(|p| (p.length(), p.normalize_or_zero()));
    let options = Options {
        iso: 0.75,
        cell: 0.05,
        ..support::open(cube(3, -1.0, 1.0))
    };
    let found = surface(&distance, &options, &Silent).unwrap();
    assert_relative(found.shape.volume(), 4.0 * PI / 3.0 * 0.75f64.powi(3), 3e-3);
}

/// A trilinear field with a random sign at each of `points`³ grid points.
pub(crate) fn random_signs(seed: u64, points: usize) -> impl Field {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut signs = vec![1.0; points * points * points];
    for sign in &mut signs {
        // Marsaglia's xorshift.
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        if state >> 40 & 1 == 1 {
            *sign = -1.0;
        }
    }
    space(move |p| {
        let low = p.floor().min(DVec3::splat(points as f64 - 2.0));
        let weight = p - low;
        let base = [0, 1, 2].map(|axis| low[axis] as usize);
        let (mut value, mut gradient) = (0.0, DVec3::ZERO);
        for corner in 0..8usize {
            let bits = [0, 1, 2].map(|axis| corner >> axis & 1);
            let [i, j, k] = [0, 1, 2].map(|axis| base[axis] + bits[axis]);
            let sign = signs[(k * points + j) * points + i];
            let factor = |axis: usize| {
                if bits[axis] == 1 {
                    weight[axis]
                } else {
                    1.0 - weight[axis]
                }
            };
            let slope = |axis: usize| if bits[axis] == 1 { 1.0 } else { -1.0 };
            let (x, y, z) = (factor(0), factor(1), factor(2));
            value += sign * x * y * z;
            gradient += sign * DVec3::new(slope(0) * y * z, x * slope(1) * z, x * y * slope(2));
        }
        (value, gradient)
    })
}

#[test]
fn random_grids_give_closed_manifolds() {
    for seed in 0..10_000 {
        let points = 3 + seed as usize % 3;
        let field = random_signs(seed, points);
        let options = Options {
            cell: 1.0,
            cap: true,
            ..support::open(cube(3, 0.0, points as f64 - 1.0))
        };
        let found = match surface(&field, &options, &Silent) {
            Ok(found) => found,
            Err(error) => panic!("seed {seed}: {error}"),
        };
        let topology = found.shape.topology();
        assert!(
            topology.watertight && topology.manifold && topology.oriented,
            "seed {seed}"
        );
        let mut sides = found
            .shape
            .triangles
            .iter()
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        let positions = &found.shape.positions;
        assert!(
            sides.all(|(a, b)| positions[a as usize] != positions[b as usize]),
            "seed {seed}"
        );
    }
}

#[test]
fn flat_and_long_boxes_have_any_number_of_slabs() {
    // A cylinder along each axis, in a box with 3 × 3 × 100 cells and the like.
    for axis in 0..3 {
        let field = space(move |p| {
            let across = p * (DVec3::ONE - DVec3::AXES[axis]);
            (across.length_squared() - 1.0, 2.0 * across)
        });
        let sides = [0, 1, 2].map(|side| {
            if side == axis {
                (0.0, 80.0)
            } else {
                (-1.2, 1.2)
            }
        });
        let options = Options {
            cell: 0.8,
            cap: true,
            ..support::open(imp::geometry::Bounds::from_sides(&sides).unwrap())
        };
        let found = surface(&field, &options, &Silent).unwrap();
        assert_eq!(closed(&found).genus(), Some(0));
        assert_eq!(found.statistics.cells, 900);
        // An octagon in the unit circle, the same all along.
        let slice = found.shape.volume() / 80.0;
        assert!(slice > 2.0 && slice < PI, "{slice}");
    }
}

#[test]
fn thread_counts_give_the_same_mesh() {
    let results: Vec<Made<Mesh>> = [1, 2, 4]
        .into_iter()
        .map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| run(&gyroid(), (-PI, PI), 40, true))
        })
        .collect();
    assert_eq!(results[0], results[1]);
    assert_eq!(results[0], results[2]);
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
    let result = surface(&sphere(), &support::open(cube(3, -1.3, 1.3)), &Impatient);
    assert_eq!(result, Err(PolygonizeError::Cancelled));
}

#[test]
fn a_monitor_is_asked_at_every_layer_of_points() {
    struct Counting(std::sync::atomic::AtomicUsize);
    impl Monitor for Counting {
        fn progress(&self, _phase: &str, _fraction: f64) {}

        fn cancelled(&self) -> bool {
            self.0.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            false
        }
    }
    let counting = Counting(Default::default());
    let mut options = support::open(cube(3, -1.3, 1.3));
    options.cell = 0.02;
    surface(&sphere(), &options, &counting).unwrap();
    let (asked, layers) = (counting.0.into_inner(), (2.6 / 0.02) as usize);
    assert!(asked >= layers, "{asked} times");
}
