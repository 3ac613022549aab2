//! Marching cubes: the surface of a field in R3 as a mesh.
//!
//! The grid is worked off in slabs, in parallel; a slab holds two layers of points at a time, so
//! that memory grows with the surface and with one layer, never with the whole grid. Every
//! crossed edge is a vertex; the triangles of a cell come from the case table, by the numbers of
//! its edges, and the roots on the edges are found afterwards, all together. In every cell the
//! surface has the topology of the trilinear function with the values of F − iso at the corners;
//! where that takes a vertex in the cell, it is put on F = iso by Newton's method. A slab numbers the
//! edges in its uppermost layer last, in the same order in which the slab above it numbers them
//! first: added to the number of vertices of all slabs below, both numbers are the same.

mod interior;
mod loops;
mod patches;
mod snap;
mod table;

use std::ops::Range;

use glam::DVec3;

pub(super) use self::loops::{EDGES, ambiguous_faces, is_in_face, loops};
use self::loops::{ends, is_inside};
use self::patches::Centre;
pub(super) use self::patches::FIRST_CENTRE;
use self::table::TABLE;
use super::edge_roots::{self, Edge};
use super::grid::{Grid, Layer, Seen, Sweep, for_each_difference, for_each_slab};
use super::projection::{self, Start};
use super::signs::Signs;
use super::{Found, Job, PolygonizeError, Shape, Statistics, uniform_grid};
use crate::geometry::Mesh;

/// The mesh of the level set by marching cubes: oriented and manifold, with shared vertices,
/// watertight unless the box cuts it and there is no cap.
pub(super) fn march(job: &Job) -> Result<Found, PolygonizeError> {
    let grid = uniform_grid(job.options)?;
    let (mesh, seen, statistics) = march_through(job, &grid)?;
    Ok((Shape::Mesh(mesh), seen, statistics))
}

/// The same for a grid, or a brick of one: the vertices of bricks on the faces that they share are
/// the same to the last bit, since a root is determined by the ends of its edge.
pub(super) fn march_through(
    job: &Job,
    grid: &Grid,
) -> Result<(Mesh, Seen, Statistics), PolygonizeError> {
    let Rough {
        mut mesh,
        near,
        seen,
        mut statistics,
        ..
    } = rough(job, grid, false)?;
    if job.options.snap {
        let [low, high] = grid.cell(grid.first_point());
        let reach = 0.5 * (high - low);
        let (evaluations, residual) = snap::merge(&mut mesh, &near, reach, job);
        statistics.evaluations += evaluations;
        statistics.max_residual = statistics.max_residual.max(residual);
    }
    // Where the surface runs through a grid point, the roots on all edges there are that point,
    // and so are the cap's vertices at the edges of the box.
    mesh.collapse_degenerate_edges();
    Ok((mesh, seen, statistics))
}

/// The cells' triangles as they come from the cases.
pub(super) struct Rough {
    /// With edges of length zero where the surface runs through grid points.
    pub(super) mesh: Mesh,
    /// The cells with triangles, in the order of these, if they are wanted.
    pub(super) cells: Vec<CellTriangles>,
    /// For every vertex the grid point that it may be merged into; empty if none is to be.
    near: Vec<Option<DVec3>>,
    pub(super) seen: Seen,
    pub(super) statistics: Statistics,
}

/// Which triangles are a cell's: those up to the next cell's first.
#[derive(Clone, Copy, Debug)]
pub(super) struct CellTriangles {
    /// The number of the first one.
    pub(super) first: usize,
    /// The cell's lowest grid point.
    pub(super) start: [u32; 3],
}

/// Marches through a grid; `with_cells` to be told whose the triangles are.
pub(super) fn rough(job: &Job, grid: &Grid, with_cells: bool) -> Result<Rough, PolygonizeError> {
    let (field, accuracy, monitor) = (job.field, job.accuracy, job.monitor);
    let signs = &Signs::of_grid(field, accuracy.iso, grid, monitor);
    let pieces = for_each_slab(grid, "marching cubes", monitor, |cells| {
        let sweep = Sweep::new(field, accuracy.iso, grid, monitor).with_signs(signs.as_ref());
        Slab::new(grid, job.options.snap, with_cells).march(sweep, job, cells)
    })?;
    let mut rough = join(pieces)?;
    rough.statistics.cells = grid.cells();
    Ok(rough)
}

/// What a slab yields. Triangles name vertices by their number within the slab; numbers from
/// the count of its own vertices on are those of the slab above.
struct Piece {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    cells: Vec<CellTriangles>,
    /// See [`Rough::near`].
    near: Vec<Option<DVec3>>,
    seen: Seen,
    statistics: Statistics,
}

/// The pieces as one mesh.
fn join(pieces: Vec<Piece>) -> Result<Rough, PolygonizeError> {
    let vertices: usize = pieces.iter().map(|piece| piece.positions.len()).sum();
    let triangles = pieces.iter().map(|piece| piece.triangles.len()).sum();
    if u32::try_from(vertices).is_err() {
        return Err(PolygonizeError::TooManyVertices { vertices });
    }
    let mut seen = Seen::default();
    let mut statistics = Statistics::default();
    let (mut near, mut cells) = (Vec::new(), Vec::new());
    let mut mesh = Mesh {
        positions: Vec::with_capacity(vertices),
        normals: Vec::with_capacity(vertices),
        triangles: Vec::with_capacity(triangles),
    };
    for piece in pieces {
        let below = mesh.positions.len() as u32;
        let before = mesh.triangles.len();
        cells.extend(piece.cells.iter().map(|cell| CellTriangles {
            first: before + cell.first,
            ..*cell
        }));
        let numbered = |triangle: &[u32; 3]| triangle.map(|vertex| vertex + below);
        mesh.triangles.extend(piece.triangles.iter().map(numbered));
        mesh.positions.extend(piece.positions);
        mesh.normals.extend(piece.normals);
        near.extend(piece.near);
        seen = seen.and(piece.seen);
        statistics = statistics.and(piece.statistics);
    }
    Ok(Rough {
        mesh,
        cells,
        near,
        seen,
        statistics,
    })
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
    /// Whether roots are merged at grid points.
    snap: bool,
    /// Whether `cells` is wanted.
    with_cells: bool,
    /// Points along x and y.
    points: [usize; 2],
    /// The crossed edges: vertex after vertex.
    edges: Vec<Edge>,
    /// The vertices that close the surface at the box, with their normals.
    caps: Vec<(usize, DVec3)>,
    /// The vertices inside cells, and where F = iso is sought for them.
    centres: Vec<(usize, Start)>,
    triangles: Vec<[u32; 3]>,
    cells: Vec<CellTriangles>,
    cut_by_box: bool,
}

impl<'a> Slab<'a> {
    fn new(grid: &'a Grid, snap: bool, with_cells: bool) -> Self {
        Slab {
            grid,
            snap,
            with_cells,
            points: [grid.points(0), grid.points(1)],
            edges: Vec::new(),
            caps: Vec::new(),
            centres: Vec::new(),
            triangles: Vec::new(),
            cells: Vec::new(),
            cut_by_box: false,
        }
    }

    /// Marches through the layers of cells of the slab.
    fn march(mut self, mut sweep: Sweep, job: &Job, cells: Range<usize>) -> Piece {
        let plane = |sweep: &Sweep| {
            let layer = sweep.layer();
            let vertices = [vec![0; layer.inside.len()], vec![0; layer.inside.len()]];
            Plane { layer, vertices }
        };
        let (mut lower, mut upper) = (plane(&sweep), plane(&sweep));
        let mut between = vec![0; lower.layer.inside.len()];
        let mut cases = vec![0; (self.points[0] - 1) * (self.points[1] - 1)];

        let mut seen = sweep.evaluate(cells.start, &mut lower.layer);
        self.number_plane(&sweep, &mut lower, cells.start);
        let mut own_vertices = self.edges.len();
        for index in cells.clone() {
            if job.monitor.cancelled() {
                break;
            }
            let above = sweep.evaluate(index + 1, &mut upper.layer);
            self.number_between(&sweep, [&lower.layer, &upper.layer], index, &mut between);
            self.find_cases([&lower.layer, &upper.layer], &mut cases);
            let variants = self.number_centres(&sweep, [&lower.layer, &upper.layer], index, &cases);
            own_vertices = self.edges.len();
            self.number_plane(&sweep, &mut upper, index + 1);
            let highest = index + 2 == self.grid.points(2);
            if index + 1 < cells.end || highest {
                own_vertices = self.edges.len();
                seen = seen.and(above);
            }
            if self.with_cells {
                self.note_cells(index, &cases, &variants);
            }
            self.triangulate([&lower, &upper], &between, &cases, &variants);
            std::mem::swap(&mut lower, &mut upper);
        }
        self.edges.truncate(own_vertices);
        self.caps.retain(|&(vertex, _)| vertex < own_vertices);
        self.finish(job, seen, sweep.evaluations())
    }

    /// Finds the roots on the crossed edges.
    fn finish(self, job: &Job, seen: Seen, evaluations: usize) -> Piece {
        let (field, accuracy, monitor) = (job.field, job.accuracy, job.monitor);
        let (mut roots, mut more) =
            edge_roots::solve(&mut { field }, accuracy, &self.edges, monitor);
        for (vertex, normal) in self.caps {
            roots[vertex].normal = normal;
        }
        let (vertices, starts): (Vec<usize>, Vec<Start>) = self.centres.into_iter().unzip();
        let (centres, further) = projection::project(field, accuracy, &starts, monitor);
        more += further;
        for (vertex, centre) in vertices.into_iter().zip(centres) {
            roots[vertex] = centre;
        }
        let near = match self.snap {
            true => (self.edges.iter().zip(&roots))
                .map(|(edge, root)| snap::near_end(self.grid, edge, root))
                .collect(),
            false => Vec::new(),
        };
        Piece {
            near,
            positions: roots.iter().map(|root| root.position).collect(),
            normals: roots.iter().map(|root| root.normal).collect(),
            triangles: self.triangles,
            cells: self.cells,
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

    /// The cases of the cells between two layers, row by row.
    fn find_cases(&self, [lower, upper]: [&Layer; 2], cases: &mut [u8]) {
        let columns = self.points[0];
        for (j, cases) in cases.chunks_mut(columns - 1).enumerate() {
            let row = |j: usize| j * columns..(j + 1) * columns;
            let [near, far] = [row(j), row(j + 1)];
            find_cases(
                [
                    &lower.inside[near.clone()],
                    &lower.inside[far.clone()],
                    &upper.inside[near],
                    &upper.inside[far],
                ],
                cases,
            );
        }
    }

    /// Decides the ambiguous cells between two layers, of which `k` is the lower, and numbers the
    /// vertices inside them. Returns these cells in the order of `cases`.
    fn number_centres(
        &mut self,
        sweep: &Sweep,
        layers: [&Layer; 2],
        k: usize,
        cases: &[u8],
    ) -> Vec<Variant> {
        let table = &*TABLE;
        let mut variants = Vec::new();
        for_each_mixed(cases, |number, case| {
            if !table.is_ambiguous(case) {
                return;
            }
            let (i, j) = (number % (self.points[0] - 1), number / (self.points[0] - 1));
            let values = [0, 1, 2, 3, 4, 5, 6, 7].map(|corner: usize| {
                sweep.value(layers[corner >> 2], i + (corner & 1), j + (corner >> 1 & 1))
            });
            let (triangles, starts) = cell_triangles(case, &values, self.grid.cell([i, j, k]));
            variants.push(Variant {
                triangles,
                first_centre: self.edges.len() as u32,
            });
            for start in starts {
                // No length: nothing is sought along it.
                let (axis, outside) = (0, start.point.x);
                self.edges.push(Edge {
                    inside: start.point,
                    axis,
                    outside,
                    inside_value: 0.0,
                    outside_value: 0.0,
                });
                self.centres.push((self.edges.len() - 1, start));
            }
        });
        variants
    }

    /// Notes the cells between two layers, of which `k` is the lower, to which triangles are about
    /// to be added.
    fn note_cells(&mut self, k: usize, cases: &[u8], variants: &[Variant]) {
        let along_x = self.points[0] - 1;
        let table = &*TABLE;
        let mut variants = variants.iter();
        let mut first = self.triangles.len();
        for_each_mixed(cases, |number, case| {
            let start = [number % along_x, number / along_x, k].map(|index| index as u32);
            self.cells.push(CellTriangles { first, start });
            first += match table.is_ambiguous(case) {
                false => table.triangles(case).len(),
                true => variants.next().map_or(0, |own| own.triangles.len()),
            };
        });
    }

    /// Adds the triangles of the cells between two layers.
    fn triangulate(
        &mut self,
        planes: [&Plane; 2],
        between: &[u32],
        cases: &[u8],
        variants: &[Variant],
    ) {
        let columns = self.points[0];
        let table = &*TABLE;
        let vertices = EdgeVertices {
            lists: EDGES.map(|(corner, axis)| match axis {
                2 => between,
                // Corners 4 to 7 are those in the upper plane.
                _ => &planes[corner >> 2].vertices[axis],
            }),
            offsets: EDGES.map(|(corner, _)| (corner & 1) + (corner >> 1 & 1) * columns),
        };
        let mut variants = variants.iter();
        let triangles = &mut self.triangles;
        for_each_mixed(cases, |number, case| {
            // A row has one point more than cells.
            let start = number + number / (columns - 1);
            let vertex = |edge: u8| vertices.at(edge, start);
            if !table.is_ambiguous(case) {
                let own = table.triangles(case).iter();
                triangles.extend(own.map(|triangle| triangle.map(vertex)));
            } else if let Some(variant) = variants.next() {
                let vertex = |name: u8| match name.checked_sub(FIRST_CENTRE) {
                    Some(centre) => variant.first_centre + u32::from(centre),
                    None => vertex(name),
                };
                let own = variant.triangles.iter();
                triangles.extend(own.map(|triangle| triangle.map(vertex)));
            }
        });
    }
}

/// A cell that signs do not decide.
struct Variant {
    triangles: &'static [[u8; 3]],
    /// The number of its first vertex that is not on an edge.
    first_centre: u32,
}

/// The triangles of a cell, given F − iso at its corners and its lowest and highest corner, and
/// where the level set is sought for the vertices inside of it: triangles name edges and, from
/// [`FIRST_CENTRE`] on, these.
pub(super) fn cell_triangles(
    case: u8,
    values: &[f64; 8],
    cell: [DVec3; 2],
) -> (&'static [[u8; 3]], Vec<Start>) {
    let table = &*TABLE;
    if !table.is_ambiguous(case) {
        return (table.triangles(case), Vec::new());
    }
    let (patches, tunnel) = table.variant(case, values);
    let centres = patches.centres.iter().map(|centre| {
        let place = match (centre, tunnel) {
            (Centre::Neck(number), Some(tunnel)) => tunnel.neck()[*number],
            (Centre::Neck(_), None) => DVec3::splat(0.5),
            (Centre::Loop(edges), _) => middle(edges, values),
        };
        start(cell, place, case)
    });
    (&patches.triangles, centres.collect())
}

/// Where the level set is sought for a vertex at a place in a cell, given as a part of its sides.
/// It must stay off the cell's faces, by a hundredth of its sides.
fn start([low, high]: [DVec3; 2], place: DVec3, case: u8) -> Start {
    let size = high - low;
    let margin = 0.01 * size;
    let at = |corner: usize| DVec3::from_array([0, 1, 2].map(|axis| (corner >> axis & 1) as f64));
    let nearest = |inside: bool| {
        let corners = (0..8).filter(|&corner| is_inside(case, corner) == inside);
        let distance = |corner: usize| at(corner).distance_squared(place);
        let nearer = |one: usize, other: usize| match distance(other) < distance(one) {
            true => other,
            false => one,
        };
        low + at(corners.reduce(nearer).unwrap_or_default()) * size
    };
    Start {
        point: low + place * size,
        low: low + margin,
        high: high - margin,
        ends: [nearest(true), nearest(false)],
    }
}

/// About the middle of a loop through these edges of the unit cube, given the values at the
/// corners: the mean of the zeros of the linear function on each edge.
fn middle(edges: &[u8], values: &[f64; 8]) -> DVec3 {
    let crossing = |&edge: &u8| {
        let [low, high] = ends(usize::from(edge));
        let part = values[low] / (values[low] - values[high]);
        let part = if part.is_finite() { part } else { 0.5 };
        let corner = DVec3::from_array([0, 1, 2].map(|axis| (low >> axis & 1) as f64));
        corner + part * DVec3::AXES[EDGES[usize::from(edge)].1]
    };
    edges.iter().map(crossing).sum::<DVec3>() / edges.len() as f64
}

/// Where the numbers of the vertices on a cell's twelve edges stand: `lists[edge]` at the cell's
/// lowest corner plus `offsets[edge]`.
struct EdgeVertices<'a> {
    lists: [&'a [u32]; 12],
    offsets: [usize; 12],
}

impl EdgeVertices<'_> {
    /// The vertex on an edge of the cell whose lowest corner is the point with this number.
    fn at(&self, edge: u8, start: usize) -> u32 {
        let edge = usize::from(edge);
        self.lists[edge][start + self.offsets[edge]]
    }
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

/// Calls `visit` with the number and the case of every cell that is neither wholly inside nor
/// wholly outside.
fn for_each_mixed(cases: &[u8], mut visit: impl FnMut(usize, u8)) {
    // Most cells are not: many are looked at together.
    const WIDTH: usize = 16;
    let mut look = |first: usize, cases: &[u8]| {
        for (offset, &case) in cases.iter().enumerate() {
            if case != 0 && case != 255 {
                visit(first + offset, case);
            }
        }
    };
    let (chunks, rest) = cases.as_chunks::<WIDTH>();
    for (number, cases) in chunks.iter().enumerate() {
        if *cases != [0; WIDTH] && *cases != [255; WIDTH] {
            look(number * WIDTH, cases);
        }
    }
    look(chunks.len() * WIDTH, rest);
}
