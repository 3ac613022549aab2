//! Marching squares: the level set of a field in R2 as joined polylines.
//!
//! As in marching cubes the grid is worked off in slabs of rows, in parallel, and vertices are
//! the roots on crossed edges, numbered such that the numbers of a slab go on with those of the
//! next. The rule for a square is the one that marching cubes applies to the faces of a cube:
//! every run of inside corners on the way around it is cut off by one segment. As segments are
//! oriented, with the inside on their left, every vertex has at most one successor and
//! polylines are found by following it.

use std::ops::Range;

use glam::DVec3;

use super::edge_roots::{self, Accuracy, Edge};
use super::grid::{Grid, Layer, Seen, Sweep, for_each_difference, for_each_slab};
use super::{Found, Job, PolygonizeError, Shape, Statistics, uniform_grid};
use crate::engine::{Field, Monitor};
use crate::geometry::{Curves, Polyline};

/// The level set as polylines: closed, or open with their ends at the box if it cuts them and
/// there is no cap.
pub(super) fn march(job: &Job) -> Result<Found, PolygonizeError> {
    let grid = &uniform_grid(job.options)?;
    let (field, accuracy, monitor) = (job.field, job.accuracy, job.monitor);
    let pieces = for_each_slab(grid, "marching squares", monitor, |cells| {
        Slab::new(grid).march(field, accuracy, cells, monitor)
    })?;
    let mut positions = Vec::new();
    let mut segments = Vec::new();
    let mut seen = Seen::default();
    let mut statistics = Statistics::default();
    for piece in pieces {
        let below = positions.len();
        segments.extend(
            piece
                .segments
                .iter()
                .map(|segment| segment.map(|vertex| vertex + below)),
        );
        positions.extend(piece.positions);
        seen = seen.and(piece.seen);
        statistics = statistics.and(piece.statistics);
    }
    let curves = Curves {
        dimension: 2,
        polylines: join(&positions, &segments),
    };
    let cells = grid.cells();
    let statistics = Statistics {
        cells,
        ..statistics
    };
    Ok((Shape::Curves(curves), seen, statistics))
}

/// Joins segments to polylines, in the order of their first vertices, open ones first.
fn join(positions: &[DVec3], segments: &[[usize; 2]]) -> Vec<Polyline> {
    let mut successor = vec![None; positions.len()];
    let mut has_predecessor = vec![false; positions.len()];
    for &[from, to] in segments {
        successor[from] = Some(to);
        has_predecessor[to] = true;
    }
    let starts = (0..positions.len()).filter(|&vertex| !has_predecessor[vertex]);
    let mut polylines = Vec::new();
    for first in starts.chain(0..positions.len()) {
        let mut points = vec![positions[first]];
        let mut last = first;
        while let Some(next) = successor[last].take() {
            points.push(positions[next]);
            last = next;
        }
        // A vertex whose successor has been followed already is a point and no start.
        if points.len() > 1 {
            polylines.extend(tidied(points, last == first));
        }
    }
    polylines
}

/// The polyline without repeated points; `None` if nothing of a length is left. The points of a
/// closed one end with the first.
fn tidied(mut points: Vec<DVec3>, closed: bool) -> Option<Polyline> {
    // Roots at a grid point are the same on all edges there.
    points.dedup();
    if closed && points.len() > 1 {
        points.pop();
    }
    let least = if closed { 3 } else { 2 };
    (points.len() >= least).then_some(Polyline { points, closed })
}

/// What a slab yields. Segments name vertices by their number within the slab; numbers from the
/// count of its own vertices on are those of the next slab.
struct Piece {
    positions: Vec<DVec3>,
    segments: Vec<[usize; 2]>,
    seen: Seen,
    statistics: Statistics,
}

/// A row of grid points with the numbers of the vertices on the edges in it, by the edge's left
/// end; of no meaning on an edge that is not crossed.
struct Row {
    layer: Layer,
    vertices: Vec<usize>,
}

/// A slab in the course of the work.
struct Slab<'a> {
    grid: &'a Grid,
    /// The crossed edges: vertex after vertex.
    edges: Vec<Edge>,
    segments: Vec<[usize; 2]>,
    cut_by_box: bool,
}

impl<'a> Slab<'a> {
    fn new(grid: &'a Grid) -> Self {
        Slab {
            grid,
            edges: Vec::new(),
            segments: Vec::new(),
            cut_by_box: false,
        }
    }

    /// Marches through the rows of cells of the slab.
    fn march(
        mut self,
        field: &dyn Field,
        accuracy: Accuracy,
        cells: Range<usize>,
        monitor: &dyn Monitor,
    ) -> Piece {
        let mut sweep = Sweep::new(field, accuracy.iso, self.grid, monitor);
        let row = |sweep: &Sweep| Row {
            layer: sweep.layer(),
            vertices: vec![0; self.grid.points(0)],
        };
        let (mut lower, mut upper) = (row(&sweep), row(&sweep));
        let mut between = vec![0; self.grid.points(0)];

        let mut seen = sweep.evaluate(cells.start, &mut lower.layer);
        let mut evaluations = seen.points();
        self.number_row(&sweep, &mut lower, cells.start);
        let mut own_vertices = self.edges.len();
        for index in cells.clone() {
            if monitor.cancelled() {
                break;
            }
            let above = sweep.evaluate(index + 1, &mut upper.layer);
            evaluations += above.points();
            self.number_between(&sweep, [&lower.layer, &upper.layer], index, &mut between);
            own_vertices = self.edges.len();
            self.number_row(&sweep, &mut upper, index + 1);
            let highest = index + 2 == self.grid.points(1);
            if index + 1 < cells.end || highest {
                own_vertices = self.edges.len();
                seen = seen.and(above);
            }
            self.add_segments([&lower, &upper], &between);
            std::mem::swap(&mut lower, &mut upper);
        }
        self.edges.truncate(own_vertices);
        let (roots, more) = edge_roots::solve(&mut { field }, accuracy, &self.edges, monitor);
        Piece {
            positions: roots.iter().map(|root| root.position).collect(),
            segments: self.segments,
            seen,
            statistics: Statistics {
                evaluations: evaluations + more,
                nan_points: seen.nan,
                cut_by_box: self.cut_by_box,
                ..Statistics::of_roots(&roots)
            },
        }
    }

    /// Numbers the vertices on the edges in a row.
    fn number_row(&mut self, sweep: &Sweep, row: &mut Row, j: usize) {
        let flags = &row.layer.inside;
        for_each_difference(&flags[..flags.len() - 1], &flags[1..], |i| {
            let values = [
                sweep.value(&row.layer, i, 0),
                sweep.value(&row.layer, i + 1, 0),
            ];
            row.vertices[i] = self.add_vertex([i, j], 0, values);
        });
    }

    /// Numbers the vertices on the edges along y between two rows, of which `j` is the lower.
    fn number_between(
        &mut self,
        sweep: &Sweep,
        [lower, upper]: [&Layer; 2],
        j: usize,
        vertices: &mut [usize],
    ) {
        for_each_difference(&lower.inside, &upper.inside, |i| {
            let values = [sweep.value(lower, i, 0), sweep.value(upper, i, 0)];
            vertices[i] = self.add_vertex([i, j], 1, values);
        });
    }

    /// Adds the vertex on the crossed edge along `axis` from the grid point `start`, with F − iso
    /// at both ends. Returns its number.
    fn add_vertex(&mut self, start: [usize; 2], axis: usize, values: [f64; 2]) -> usize {
        self.cut_by_box |= self.grid.is_cut(&start, axis);
        self.edges.push(self.grid.edge(&start, axis, values));
        self.edges.len() - 1
    }

    /// Adds the segments of the squares between two rows.
    fn add_segments(&mut self, [lower, upper]: [&Row; 2], between: &[usize]) {
        let [low, high] = [lower, upper].map(|row| &row.layer.inside);
        for i in 0..between.len() - 1 {
            // The corners counter-clockwise, and the vertex on the edge from each to the next.
            let corners = [low[i], low[i + 1], high[i + 1], high[i]];
            let vertices = [
                lower.vertices[i],
                between[i + 1],
                upper.vertices[i],
                between[i],
            ];
            for entry in 0..4 {
                // A run of inside corners begins after the edge `entry`; it is cut off by the
                // segment back from the edge where it ends.
                if corners[entry] == 1 || corners[(entry + 1) % 4] == 0 {
                    continue;
                }
                let exit = (entry + 1..entry + 4).find(|&exit| corners[(exit + 1) % 4] == 0);
                self.segments
                    .extend(exit.map(|exit| [vertices[exit % 4], vertices[entry]]));
            }
        }
    }
}
