//! Small meshes of known shape for the tests of this room.

use std::f64::consts::TAU;

use glam::DVec3;

use super::Mesh;

/// A mesh without normals.
pub(super) fn mesh(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Mesh {
    Mesh {
        positions: positions.iter().copied().map(DVec3::from_array).collect(),
        normals: Vec::new(),
        triangles: triangles.to_vec(),
    }
}

/// The cube [0, side]³, moved by `offset`.
pub(super) fn cube(side: f64, offset: DVec3) -> Mesh {
    let positions = (0..8u32).map(|corner| {
        let bits = DVec3::new(
            f64::from(corner & 1),
            f64::from(corner >> 1 & 1),
            f64::from(corner >> 2),
        );
        offset + side * bits
    });
    // The four corners of each face, counter-clockwise from outside.
    let faces: [[u32; 4]; 6] = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    Mesh {
        positions: positions.collect(),
        normals: Vec::new(),
        triangles: faces
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect(),
    }
}

/// The tetrahedron with corners at the origin and the three unit points.
pub(super) fn tetrahedron() -> Mesh {
    mesh(
        &[
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
        ],
        &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    )
}

/// The octahedron with corners at ±1 on the axes.
pub(super) fn octahedron() -> Mesh {
    mesh(
        &[
            [1.0, 0.0, 0.0],
            [-1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, -1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 0.0, -1.0],
        ],
        &[
            [0, 2, 4],
            [2, 1, 4],
            [1, 3, 4],
            [3, 0, 4],
            [2, 0, 5],
            [1, 2, 5],
            [3, 1, 5],
            [0, 3, 5],
        ],
    )
}

/// A torus about the z axis: a ring of `around` × `across` quadrilaterals, halved.
pub(super) fn torus(major: f64, minor: f64, around: u32, across: u32) -> Mesh {
    let mut torus = Mesh::default();
    for i in 0..around {
        for j in 0..across {
            let u = TAU * f64::from(i) / f64::from(around);
            let v = TAU * f64::from(j) / f64::from(across);
            let radius = major + minor * v.cos();
            torus.positions.push(DVec3::new(
                radius * u.cos(),
                radius * u.sin(),
                minor * v.sin(),
            ));
            let vertex = |i: u32, j: u32| i % around * across + j % across;
            let (a, b) = (vertex(i, j), vertex(i + 1, j));
            let (c, d) = (vertex(i + 1, j + 1), vertex(i, j + 1));
            torus.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    torus
}

/// A flat disk: `rim` triangles around a centre.
pub(super) fn disk(rim: u32) -> Mesh {
    let on_rim = |k: u32| {
        let angle = TAU * f64::from(k) / f64::from(rim);
        DVec3::new(angle.cos(), angle.sin(), 0.0)
    };
    Mesh {
        positions: std::iter::once(DVec3::ZERO)
            .chain((0..rim).map(on_rim))
            .collect(),
        normals: Vec::new(),
        triangles: (0..rim).map(|k| [0, 1 + k, 1 + (k + 1) % rim]).collect(),
    }
}

/// A strip of five triangles with one half twist (the least triangulation of the Möbius strip).
pub(super) fn moebius_strip() -> Mesh {
    let mut strip = disk(5);
    strip.positions.remove(0);
    strip.triangles = (0..5).map(|k| [k, (k + 1) % 5, (k + 2) % 5]).collect();
    strip
}

/// Both meshes side by side, sharing nothing.
pub(super) fn disjoint_union(first: Mesh, second: &Mesh) -> Mesh {
    let offset = first.positions.len() as u32;
    let mut union = first;
    union.positions.extend(&second.positions);
    union.triangles.extend(
        second
            .triangles
            .iter()
            .map(|triangle| triangle.map(|vertex| vertex + offset)),
    );
    union
}

/// The mesh turned inside out.
pub(super) fn inverted(mut mesh: Mesh) -> Mesh {
    for [_, b, c] in &mut mesh.triangles {
        std::mem::swap(b, c);
    }
    mesh
}

/// The mesh with each triangle divided into four at the middles of its sides.
pub(super) fn refined(mesh: Mesh) -> Mesh {
    let mut refined = Mesh {
        positions: mesh.positions,
        ..Mesh::default()
    };
    let mut middles = std::collections::BTreeMap::new();
    for [a, b, c] in mesh.triangles {
        let [d, e, f] = [(a, b), (b, c), (c, a)].map(|(from, to)| {
            *middles
                .entry((from.min(to), from.max(to)))
                .or_insert_with(|| {
                    let ends = [from, to].map(|vertex| refined.positions[vertex as usize]);
                    refined.positions.push(ends[0].midpoint(ends[1]));
                    refined.positions.len() as u32 - 1
                })
        });
        refined
            .triangles
            .extend([[a, d, f], [d, b, e], [f, e, c], [d, e, f]]);
    }
    refined
}

/// The unit square, divided into so many squares each way, halved, and mapped.
pub(super) fn grid(cells: u32, map: impl Fn(f64, f64) -> DVec3) -> Mesh {
    let mut grid = Mesh::default();
    let at = |k: u32| f64::from(k) / f64::from(cells);
    for (i, j) in (0..=cells).flat_map(|i| (0..=cells).map(move |j| (i, j))) {
        grid.positions.push(map(at(i), at(j)));
        if i < cells && j < cells {
            let a = i * (cells + 1) + j;
            let b = a + cells + 1;
            grid.triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
        }
    }
    grid
}
