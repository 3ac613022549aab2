//! Extended marching cubes: sharp edges and corners, and otherwise the mesh of marching cubes.

use crate::dual::{distance, drilled_cube, turned_back};
use crate::support::{self, Made, cube};
use crate::surfaces::{
    SURFACES, assert_closed, assert_same_on_threads, compiled, polygonized, random_signs, space,
    survive_wicked_fields,
};
use glam::DVec3;
use imp::engine::{Field, Silent};
use imp::geometry::Mesh;
use imp::polygonize::{Method, Options};

/// The options for a cube around 0 with so many cells along a side.
fn options(half: f64, cells: usize) -> Options {
    Options {
        cell: 2.0 * half / cells as f64,
        cap: true,
        ..support::open(cube(3, -half, half))
    }
}

fn extended(field: &dyn Field, options: &Options) -> Made<Mesh> {
    support::mesh(field, (Method::Extended, options), &Silent).unwrap()
}

fn triangles(mesh: &Mesh) -> Vec<[DVec3; 3]> {
    let position = |corner: u32| mesh.positions[corner as usize];
    mesh.triangles.iter().map(|own| own.map(position)).collect()
}

/// Fails if a triangle does not face outward at its centre.
fn assert_no_facet_is_turned(field: &dyn Field, mesh: &Mesh) {
    for corners in triangles(mesh) {
        let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let (_, gradient) = field.value_gradient(centre);
        assert!(normal.dot(gradient) > 0.0, "{corners:?}");
    }
}

#[test]
fn sharp_edges_and_corners_are_on_the_mesh_and_no_facet_is_turned() {
    let field = drilled_cube();
    for cells in [24, 41] {
        let made = extended(&field, &options(1.6, cells));
        let topology = assert_closed("drilled cube", &made);
        assert_eq!((topology.components, topology.genus()), (1, Some(1)));
        assert_no_facet_is_turned(&field, &made.shape);
        let triangles = triangles(&made.shape);
        for (axis, side, step) in
            (0..3).flat_map(|a| (0..4).flat_map(move |b| (0..=60).map(move |c| (a, b, c))))
        {
            let mut point = DVec3::ZERO;
            point[axis] = -0.8 + 1.6 * f64::from(step) / 60.0;
            point[(axis + 1) % 3] = if side & 1 == 0 { -0.8 } else { 0.8 };
            point[(axis + 2) % 3] = if side & 2 == 0 { -0.8 } else { 0.8 };
            let point = turned_back(point);
            let nearest = triangles.iter().map(|&own| distance(point, own));
            let away = nearest.fold(f64::INFINITY, f64::min);
            assert!(away < 1e-6, "{cells}: {point} is {away} away");
        }
    }
}

/// The volume and the area of the octahedron with corners at distance 1 are 4/3 and 4√3: they are
/// only met if nothing is cut off.
#[test]
fn an_octahedron_is_exact() {
    let field = compiled("abs(x) + abs(y) + abs(z) - 1");
    for cells in [17, 24, 41, 50] {
        let made = extended(&field, &options(1.5, cells));
        let topology = assert_closed("octahedron", &made);
        assert_eq!((topology.components, topology.genus()), (1, Some(0)));
        let (area, volume) = (made.shape.area(), made.shape.volume());
        assert!((volume - 4.0 / 3.0).abs() < 1e-9, "{cells}: {volume}");
        assert!((area - 4.0 * 3f64.sqrt()).abs() < 1e-9, "{cells}: {area}");
    }
}

/// The drilled cube's rims are circles of radius 0.4: new vertices lie on them, though the planes at
/// the roots around do not meet there.
#[test]
fn vertices_lie_on_curved_edges() {
    let made = extended(&drilled_cube(), &options(1.6, 41));
    let rim = |point: &&DVec3| {
        // Turned back: the axis of the hole.
        let along = point.dot(turned_back(DVec3::Z));
        let across = (point.length_squared() - along * along).sqrt();
        (along.abs() - 0.8).abs() < 1e-8 && (across - 0.4).abs() < 1e-8
    };
    // A circle of this length crosses as many cells along each axis as its diameter has, at least.
    let on_rims = made.shape.positions.iter().filter(rim).count();
    assert!(
        on_rims >= 2 * 2 * (0.8 / (3.2 / 41.0)) as usize,
        "{on_rims}"
    );
}

#[test]
fn a_smooth_surface_has_the_mesh_of_marching_cubes() {
    let field = compiled("x^2 + y^2 + z^2 - 1");
    let options = options(1.3, 40);
    let made = extended(&field, &options);
    let cubes = support::mesh(&field, (Method::Cubes, &options), &Silent).unwrap();
    assert_eq!(made, cubes);
}

#[test]
fn known_surfaces_have_their_topology_and_measures() {
    for known in SURFACES {
        let found = polygonized(known, Method::Extended, &known.options());
        known.check(&found);
    }
}

/// A wedge of 90 degrees through a box of side 2, its edge off all axes: the cap has corners where the
/// edge leaves the box. One is cut off, by less than a cell, where its cell in the side does not
/// have roots of both planes.
#[test]
fn a_cap_has_corners_where_sharp_edges_leave_the_box() {
    let [one, two] = [DVec3::X, DVec3::Y].map(turned_back);
    let field = space(move |p| {
        let (a, b) = (p.dot(one), p.dot(two));
        if a > b { (a, one) } else { (b, two) }
    });
    // The line on which both planes are leaves through two sides, where its direction is longest.
    let direction = one.cross(two);
    let exit = direction / direction.abs().max_element();
    let (mut met, mut all) = (0, 0);
    for cells in 16..24 {
        let made = extended(&field, &options(1.0, cells));
        assert_closed("wedge", &made);
        for corner in [exit, -exit] {
            let distances = (made.shape.positions.iter()).map(|point| point.distance(corner));
            let nearest = distances.fold(f64::INFINITY, f64::min);
            assert!(nearest < 2.0 / cells as f64, "{corner} is {nearest} away");
            met += usize::from(nearest < 1e-9);
            all += 1;
        }
    }
    assert!(2 * met >= all, "{met} of {all}");
}

#[test]
fn whatever_a_field_is_like_the_mesh_is_closed() {
    survive_wicked_fields(Method::Extended, |options| options);
    for seed in 0..100 {
        let field = random_signs(seed, 3);
        let options = Options {
            cell: 0.5,
            cap: true,
            ..support::open(cube(3, 0.0, 3.0))
        };
        assert_closed("random signs", &extended(&field, &options));
    }
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let field = drilled_cube();
    assert_same_on_threads(|| extended(&field, &options(1.6, 30)));
}
