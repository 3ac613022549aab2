//! Marching cubes: the surface of a field in R3 as a mesh.
//!
//! The grid is worked off in slabs, in parallel; a slab holds two layers of points at a time, so
//! that memory grows with the surface and with one layer, never with the whole grid. Every
//! crossed edge is a vertex; the triangles of a cell come from the case table, by the numbers of
//! its edges, and the roots on the edges are found afterwards, all together. A slab numbers the
//! edges in its uppermost layer last, in the same order in which the slab above it numbers them
//! first: added to the number of vertices of all slabs below, both numbers are the same.

mod table;

use std::ops::Range;

use glam::DVec3;

use self::table::CaseTable;
pub(super) use self::table::{EDGES, TABLE};
use super::edge_roots::{self, Accuracy, Edge};
use super::grid::{Grid, Layer, Seen, Sweep, for_each_difference, for_each_slab};
use super::{Found, Job, PolygonizeError, Shape, Statistics, uniform_grid};
use crate::engine::{Field, Monitor};
use crate::geometry::Mesh;

/// The mesh of the level set by marching cubes: oriented and manifold, with shared vertices,
/// watertight unless the box cuts it and there is no cap.
pub(super) fn march(job: &Job) -> Result<Found, PolygonizeError> {
    let grid = &uniform_grid(job.options)?;
    let (field, accuracy, monitor) = (job.field, job.accuracy, job.monitor);
    let pieces = for_each_slab(grid, "marching cubes", monitor, |cells| {
        Slab::new(grid).march(field, accuracy, cells, monitor)
    })?;
    let (mesh, seen, statistics) = join(pieces)?;
    let cells = grid.cells();
    let statistics = Statistics {
        cells,
        ..statistics
    };
    Ok((Shape::Mesh(mesh), seen, statistics))
}

/// What a slab yields. Triangles name vertices by their number within the slab; numbers from
/// the count of its own vertices on are those of the slab above.
struct Piece {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    seen: Seen,
    statistics: Statistics,
}

/// The pieces as one mesh.
fn join(pieces: Vec<Piece>) -> Result<(Mesh, Seen, Statistics), PolygonizeError> {
    let vertices: usize = pieces.iter().map(|piece| piece.positions.len()).sum();
    let triangles = pieces.iter().map(|piece| piece.triangles.len()).sum();
    if u32::try_from(vertices).is_err() {
        return Err(PolygonizeError::TooManyVertices { vertices });
    }
    let mut seen = Seen::default();
    let mut statistics = Statistics::default();
    let mut mesh = Mesh {
        positions: Vec::with_capacity(vertices),
        normals: Vec::with_capacity(vertices),
        triangles: Vec::with_capacity(triangles),
    };
    for piece in pieces {
        let below = mesh.positions.len() as u32;
        let numbered = |triangle: &[u32; 3]| triangle.map(|vertex| vertex + below);
        mesh.triangles.extend(piece.triangles.iter().map(numbered));
        mesh.positions.extend(piece.positions);
        mesh.normals.extend(piece.normals);
        seen = seen.and(piece.seen);
        statistics = statistics.and(piece.statistics);
    }
    // Where the surface runs through a grid point, the roots on all edges there are that point,
    // and so are the cap's vertices at the edges of the box.
    mesh.collapse_degenerate_edges();
    Ok((mesh, seen, statistics))
}

/// A layer of grid points with the vertices on the edges in it.
struct Plane {
    layer: Layer,
    /// The numbers of the vertices on the edges along x and y, by the edge's lower end; of no
    /// meaning on an edge that is not crossed.
    vertices: [Vec<u32>; 2],
}

/// A slab in the course of the work.
struct Slab<'a> {
    grid: &'a Grid,
    /// Points along x and y.
    points: [usize; 2],
    /// The crossed edges: vertex after vertex.
    edges: Vec<Edge>,
    /// The vertices that close the surface at the box, with their normals.
    caps: Vec<(usize, DVec3)>,
    triangles: Vec<[u32; 3]>,
    cut_by_box: bool,
}

impl<'a> Slab<'a> {
    fn new(grid: &'a Grid) -> Self {
        Slab {
            grid,
            points: [grid.points(0), grid.points(1)],
            edges: Vec::new(),
            caps: Vec::new(),
            triangles: Vec::new(),
            cut_by_box: false,
        }
    }

    /// Marches through the layers of cells of the slab.
    fn march(
        mut self,
        field: &dyn Field,
        accuracy: Accuracy,
        cells: Range<usize>,
        monitor: &dyn Monitor,
    ) -> Piece {
        let mut sweep = Sweep::new(field, accuracy.iso, self.grid, monitor);
        let plane = |sweep: &Sweep| {
            let layer = sweep.layer();
            let vertices = [vec![0; layer.inside.len()], vec![0; layer.inside.len()]];
            Plane { layer, vertices }
        };
        let (mut lower, mut upper) = (plane(&sweep), plane(&sweep));
        let mut between = vec![0; lower.layer.inside.len()];
        let mut cases = vec![0; self.points[0] - 1];

        let mut seen = sweep.evaluate(cells.start, &mut lower.layer);
        let mut evaluations = seen.points();
        self.number_plane(&sweep, &mut lower, cells.start);
        let mut own_vertices = self.edges.len();
        for index in cells.clone() {
            if monitor.cancelled() {
                break;
            }
            let above = sweep.evaluate(index + 1, &mut upper.layer);
            evaluations += above.points();
            self.number_between(&sweep, [&lower.layer, &upper.layer], index, &mut between);
            own_vertices = self.edges.len();
            self.number_plane(&sweep, &mut upper, index + 1);
            let highest = index + 2 == self.grid.points(2);
            if index + 1 < cells.end || highest {
                own_vertices = self.edges.len();
                seen = seen.and(above);
            }
            self.triangulate([&lower, &upper], &between, &mut cases);
            std::mem::swap(&mut lower, &mut upper);
        }
        self.edges.truncate(own_vertices);
        self.caps.retain(|&(vertex, _)| vertex < own_vertices);
        self.finish(field, accuracy, (seen, evaluations), monitor)
    }

    /// Finds the roots on the crossed edges.
    fn finish(
        self,
        field: &dyn Field,
        accuracy: Accuracy,
        (seen, evaluations): (Seen, usize),
        monitor: &dyn Monitor,
    ) -> Piece {
        let (mut roots, more) = edge_roots::solve(field, accuracy, &self.edges, monitor);
        for (vertex, normal) in self.caps {
            roots[vertex].normal = normal;
        }
        Piece {
            positions: roots.iter().map(|root| root.position).collect(),
            normals: roots.iter().map(|root| root.normal).collect(),
            triangles: self.triangles,
            seen,
            statistics: Statistics {
                evaluations: evaluations + more,
                nan_points: seen.nan,
                cut_by_box: self.cut_by_box,
                ..Statistics::of_roots(&roots)
            },
        }
    }

    /// Numbers the vertices on the edges in a layer, row by row.
    fn number_plane(&mut self, sweep: &Sweep, plane: &mut Plane, k: usize) {
        let Plane { layer, vertices } = plane;
        let [columns, rows] = self.points;
        for j in 0..rows {
            let row = &layer.inside[j * columns..(j + 1) * columns];
            for_each_difference(&row[..columns - 1], &row[1..], |i| {
                let values = [sweep.value(layer, i, j), sweep.value(layer, i + 1, j)];
                vertices[0][j * columns + i] = self.add_vertex([i, j, k], 0, values);
            });
            if j + 1 < rows {
                let next = &layer.inside[(j + 1) * columns..(j + 2) * columns];
                for_each_difference(row, next, |i| {
                    let values = [sweep.value(layer, i, j), sweep.value(layer, i, j + 1)];
                    vertices[1][j * columns + i] = self.add_vertex([i, j, k], 1, values);
                });
            }
        }
    }

    /// Numbers the vertices on the edges along z between two layers, of which `k` is the lower.
    fn number_between(
        &mut self,
        sweep: &Sweep,
        [lower, upper]: [&Layer; 2],
        k: usize,
        vertices: &mut [u32],
    ) {
        for_each_difference(&lower.inside, &upper.inside, |at| {
            let (i, j) = (at % self.points[0], at / self.points[0]);
            let values = [sweep.value(lower, i, j), sweep.value(upper, i, j)];
            vertices[at] = self.add_vertex([i, j, k], 2, values);
        });
    }

    /// Adds the vertex on the crossed edge along `axis` from the grid point `start`, with F − iso
    /// at both ends. Returns its number.
    fn add_vertex(&mut self, start: [usize; 3], axis: usize, values: [f64; 2]) -> u32 {
        let edge = self.grid.edge(&start, axis, values);
        if self.grid.leads_to_ghost(&start, axis) {
            self.caps
                .push((self.edges.len(), self.grid.outward(edge.inside)));
        }
        self.cut_by_box |= self.grid.is_cut(&start, axis);
        self.edges.push(edge);
        // A number beyond the range wraps, but is not used: then the vertices are too many.
        (self.edges.len() - 1) as u32
    }

    /// Adds the triangles of the cells between two layers. `cases` is a row of scratch.
    fn triangulate(&mut self, planes: [&Plane; 2], between: &[u32], cases: &mut [u8]) {
        let table = &*TABLE;
        let [columns, rows] = self.points;
        let vertices = EdgeVertices {
            lists: EDGES.map(|(corner, axis)| match axis {
                2 => between,
                // Corners 4 to 7 are those in the upper plane.
                _ => &planes[corner >> 2].vertices[axis],
            }),
            offsets: EDGES.map(|(corner, _)| (corner & 1) + (corner >> 1 & 1) * columns),
        };
        for j in 0..rows - 1 {
            let row = |plane: usize, j: usize| {
                &planes[plane].layer.inside[j * columns..(j + 1) * columns]
            };
            find_cases([row(0, j), row(0, j + 1), row(1, j), row(1, j + 1)], cases);
            add_triangles(table, cases, &vertices, j * columns, &mut self.triangles);
        }
    }
}

/// Where the numbers of the vertices on a cell's twelve edges stand: `lists[edge]` at the cell's
/// lowest corner plus `offsets[edge]`.
struct EdgeVertices<'a> {
    lists: [&'a [u32]; 12],
    offsets: [usize; 12],
}

/// The cases of a row of cells, from the flags of the four rows of points around it in the order
/// of the corners.
fn find_cases(rows: [&[u8]; 4], cases: &mut [u8]) {
    let count = cases.len();
    let [a, b, c, d] = rows.map(|row| &row[..count + 1]);
    for (i, case) in cases.iter_mut().enumerate() {
        let corners = |i: usize| a[i] | b[i] << 2 | c[i] << 4 | d[i] << 6;
        *case = corners(i) | corners(i + 1) << 1;
    }
}

/// Adds the triangles of a row of cells, whose first has its lowest corner at `start`.
fn add_triangles(
    table: &CaseTable,
    cases: &[u8],
    vertices: &EdgeVertices,
    start: usize,
    triangles: &mut Vec<[u32; 3]>,
) {
    let mut add = |first: usize, cases: &[u8]| {
        for (offset, &case) in cases.iter().enumerate() {
            let cell = start + first + offset;
            triangles.extend(table.triangles(case).iter().map(|triangle| {
                triangle.map(|edge| {
                    let edge = usize::from(edge);
                    vertices.lists[edge][cell + vertices.offsets[edge]]
                })
            }));
        }
    };
    // Most cells are empty: many are looked at together.
    const WIDTH: usize = 16;
    let (chunks, rest) = cases.as_chunks::<WIDTH>();
    for (number, cases) in chunks.iter().enumerate() {
        if *cases != [0; WIDTH] && *cases != [255; WIDTH] {
            add(number * WIDTH, cases);
        }
    }
    add(chunks.len() * WIDTH, rest);
}
