//! Meshes brick by brick: their union is the mesh that is made in one piece.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::support::{Closure, cube};
use glam::DVec3;
use imp::engine::{CompiledField, Field, Program, Silent};
use imp::geometry::{Bounds, Mesh};
use imp::graph::{Graph, NodeId, Op};
use imp::polygonize::{Brick, Bricks, Method, Options, PolygonizeError, Shape, polygonize};

/// The bits of a point.
type Bits = [u64; 3];

fn bits(point: DVec3) -> Bits {
    point.to_array().map(f64::to_bits)
}

/// Vertices and oriented triangles by exact positions, with the normals that each vertex has.
#[derive(Debug, Default, PartialEq)]
struct Union {
    vertices: BTreeMap<Bits, BTreeSet<Bits>>,
    /// How often each triangle occurs, its least corner first.
    triangles: BTreeMap<[Bits; 3], usize>,
}

impl Union {
    fn add(&mut self, mesh: &Mesh) {
        for (&position, &normal) in mesh.positions.iter().zip(&mesh.normals) {
            let normals = self.vertices.entry(bits(position)).or_default();
            normals.insert(bits(normal));
        }
        for triangle in &mesh.triangles {
            let mut corners = triangle.map(|vertex| bits(mesh.positions[vertex as usize]));
            // Of no area: left where merging vertices would change the topology.
            if corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0] {
                continue;
            }
            let least = (0..3).min_by_key(|&corner| corners[corner]).unwrap();
            corners.rotate_left(least);
            *self.triangles.entry(corners).or_default() += 1;
        }
    }
}

fn one_piece(field: &dyn Field, options: &Options) -> Mesh {
    match polygonize(field, options, &Silent).unwrap().shape {
        Shape::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

fn all_bricks(field: &dyn Field, options: &Options, side: usize) -> Vec<Brick> {
    let mut bricks = Bricks::new(field, options, side).unwrap();
    let mut all = Vec::new();
    while let Some(brick) = bricks.advance(&Silent).unwrap() {
        all.push(brick);
    }
    bricks.finish().unwrap();
    all
}

fn check(name: &str, field: &dyn Field, options: &Options, sides: &[usize]) {
    let mut whole = Union::default();
    whole.add(&one_piece(field, options));
    for &side in sides {
        let bricks = all_bricks(field, options, side);
        let places: BTreeSet<[usize; 3]> = bricks.iter().map(|brick| brick.place).collect();
        assert_eq!(places.len(), bricks.len(), "{name}, {side}");
        let mut union = Union::default();
        for brick in &bricks {
            assert!(!brick.mesh.triangles.is_empty());
            union.add(&brick.mesh);
        }
        assert!(
            whole.vertices.keys().eq(union.vertices.keys()) && whole.triangles == union.triangles,
            "{name}: bricks of {side} differ: {} and {} vertices, {} and {} triangles",
            whole.vertices.len(),
            union.vertices.len(),
            whole.triangles.len(),
            union.triangles.len()
        );
        for (position, normals) in &whole.vertices {
            // Where the surface runs through a grid point, roots on several edges are that point:
            // of them one is left in the whole, and one in each brick.
            let there = &union.vertices[position];
            let point = |bits: &Bits| DVec3::from_array(bits.map(f64::from_bits));
            let near = |one: &Bits| {
                normals
                    .iter()
                    .any(|own| point(own).distance(point(one)) < 1e-9)
            };
            assert!(
                normals.is_subset(there) && there.iter().all(near),
                "{name}, {side}"
            );
        }
    }
}

fn gyroid() -> impl Field {
    Closure {
        dimension: 3,
        function: |p: DVec3| {
            let (s, c) = (p.map(f64::sin), p.map(f64::cos));
            let gradient = DVec3::new(
                c.z * c.x - s.x * s.y,
                c.x * c.y - s.y * s.z,
                c.y * c.z - s.z * s.x,
            );
            (c.x * s.y + c.y * s.z + c.z * s.x, gradient)
        },
    }
}

fn torus() -> impl Field {
    Closure {
        dimension: 3,
        function: |p: DVec3| {
            let rho = p.x.hypot(p.y);
            let gradient = 2.0 * DVec3::new((rho - 1.0) * p.x / rho, (rho - 1.0) * p.y / rho, p.z);
            ((rho - 1.0).powi(2) + p.z * p.z - 0.16, gradient)
        },
    }
}

/// The sphere of radius 1, compiled, so that enclosures prove bricks to be empty.
fn sphere() -> CompiledField {
    let mut graph = Graph::new();
    let coordinates = [0, 1, 2].map(|axis| graph.coordinate(axis));
    let squares: [NodeId; 3] = coordinates.map(|node| graph.apply(Op::Square, &[node]));
    let plane = graph.apply(Op::Add, &[squares[0], squares[1]]);
    let square = graph.apply(Op::Add, &[plane, squares[2]]);
    let one = graph.constant(1.0);
    let root = graph.apply(Op::Subtract, &[square, one]);
    CompiledField::new(Arc::new(Program::new(&graph, &[root], 3)), Vec::new())
}

fn options(bounds: Bounds, cells: f64, cap: bool) -> Options {
    Options {
        method: Some(Method::Cubes),
        cell: bounds.size().max_element() / cells,
        cap,
        ..Options::new(bounds)
    }
}

#[test]
fn the_union_of_bricks_is_the_mesh_in_one_piece() {
    use std::f64::consts::PI;
    for cap in [true, false] {
        let box_of_gyroid = cube(3, -PI, PI);
        check(
            "gyroid",
            &gyroid(),
            &options(box_of_gyroid, 30.0, cap),
            &[7, 11, 16, 29, 30, 64],
        );
        let around = Bounds::from_sides(&[(-1.5, 1.5), (-1.45, 1.6), (-0.5, 0.55)]).unwrap();
        check("torus", &torus(), &options(around, 41.0, cap), &[5, 13, 17]);
        // Cut through, with roots in grid points and in the sides of the box.
        let half = Bounds::from_sides(&[(-1.0, 1.0), (0.0, 1.0), (-0.5, 1.5)]).unwrap();
        check(
            "torus cut",
            &torus(),
            &options(half, 40.0, cap),
            &[6, 10, 21],
        );
        check(
            "sphere",
            &sphere(),
            &options(cube(3, -1.0, 1.0), 20.0, cap),
            &[1, 3, 8, 10],
        );
        check(
            "sphere around",
            &sphere(),
            &options(cube(3, -2.0, 2.0), 48.0, cap),
            &[5, 12, 24],
        );
        check(
            "inside",
            &sphere(),
            &options(cube(3, -0.6, 0.9), 20.0, cap),
            &[4, 7],
        );
    }
}

#[test]
fn bricks_without_surface_are_passed_over_unseen() {
    let field = sphere();
    let options = options(cube(3, -8.0, 8.0), 64.0, true);
    let bricks = all_bricks(&field, &options, 8);
    // The sphere is in the eight bricks around the middle.
    assert_eq!(bricks.len(), 8);
    assert!(
        bricks
            .iter()
            .all(|brick| brick.place.iter().all(|&at| at == 3 || at == 4))
    );
    let mut made = Bricks::new(&field, &options, 8).unwrap();
    while made.advance(&Silent).unwrap().is_some() {}
    let statistics = made.finish().unwrap();
    assert_eq!(statistics.cells, 64 * 64 * 64);
    // Nothing is evaluated in the other 504 bricks, of 729 points each.
    assert!(
        statistics.evaluations < 8 * 729 + 8 * 2000,
        "{}",
        statistics.evaluations
    );
}

#[test]
fn what_is_not_possible_in_bricks_is_refused() {
    let (field, bounds) = (sphere(), cube(3, -2.0, 2.0));
    let new = |options: &Options, side| Bricks::new(&field, options, side).err();
    let dual = Options {
        method: Some(Method::Dual),
        ..options(bounds, 8.0, true)
    };
    let method = Method::Dual;
    assert_eq!(new(&dual, 4), Some(PolygonizeError::NotInBricks { method }));
    let snapped = Options {
        snap: true,
        ..options(bounds, 8.0, true)
    };
    let method = Method::Cubes;
    assert_eq!(
        new(&snapped, 4),
        Some(PolygonizeError::NotInBricks { method })
    );
    let fine = Options {
        cell_limit: usize::MAX,
        ..options(bounds, 1024.0, true)
    };
    assert!(matches!(
        new(&fine, 1),
        Some(PolygonizeError::TooManyBricks { .. })
    ));
    // The limit of cells is one of a brick.
    let limited = Options {
        cell_limit: 1000,
        ..options(bounds, 64.0, true)
    };
    assert_eq!(new(&limited, 10), None);
    assert!(matches!(
        new(&limited, 11),
        Some(PolygonizeError::TooManyCells { .. })
    ));
    // Nothing is in the box.
    let empty = options(cube(3, 2.0, 3.0), 16.0, true);
    let mut bricks = Bricks::new(&field, &empty, 5).unwrap();
    assert!(bricks.advance(&Silent).unwrap().is_none());
    assert!(matches!(
        bricks.finish(),
        Err(PolygonizeError::NoSurface { below: 0, .. })
    ));
}
