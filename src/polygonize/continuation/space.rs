//! Continuation: marching cubes in those cells of the grid that are reached from seeds along the
//! level set, from a cell to each neighbour across a side that the level set crosses (G. Wyvill,
//! C. McPheeters, B. Wyvill, "Data structure for soft objects", The Visual Computer 2, 1986;
//! J. Bloomenthal, "Polygonization of implicit surfaces", Computer Aided Geometric Design 5, 1988).
//! Cost and memory grow with the surface.
//!
//! Without given seeds every crossed cell of every box is one that is not proven to be inside or
//! outside (`seeds`): then nothing is missed that the grid shows, and the mesh is that of
//! marching cubes to the last bit. From given seeds only the components are found that cells
//! connect to them.
//!
//! A generation of cells is evaluated together, in parallel.

use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

use super::seeds;
use crate::geometry::Mesh;
use crate::polygonize::cubes::{EDGES, FIRST_CENTRE, cell_triangles};
use crate::polygonize::edge_roots::{self, Edge, Root};
use crate::polygonize::grid::{Grid, Seen};
use crate::polygonize::projection::{self, Start};
use crate::polygonize::{Found, Job, PolygonizeError, Shape, Statistics, cell_counts, check_cells};

/// How many points or roots make one piece of parallel work.
const CHUNK: usize = 2048;

/// A cell or a point, by its indices; ghosts included.
pub(super) type Index = [u32; 3];

/// The corners of a cell's side: those with this bit along the axis.
fn side(axis: usize, end: usize) -> u8 {
    const UPPER: [u8; 3] = [0b1010_1010, 0b1100_1100, 0b1111_0000];
    if end == 1 { UPPER[axis] } else { !UPPER[axis] }
}

/// The mesh of the level set by marching cubes from seeds: oriented and manifold, watertight
/// unless the box cuts it and there is no cap.
pub(super) fn march(job: &Job) -> Result<Found, PolygonizeError> {
    let options = job.options;
    let counts = cell_counts(options);
    // An index has 32 bits, the number of a cell 64.
    if counts.iter().any(|&count| count > 1e6) {
        return Err(PolygonizeError::TooManyCells {
            needed: counts.iter().product(),
            limit: options.cell_limit,
        });
    }
    // A surface crosses about as many cells as the sides of the box have.
    let [x, y, z] = [counts[0], counts[1], counts[2]];
    check_cells(2.0 * (x * y + y * z + z * x), options)?;
    let counts: Vec<usize> = counts.into_iter().map(|count| count as usize).collect();
    let grid = Grid::new(&options.bounds, &counts, options.cap);
    let mut survey = Survey::new(job, &grid);
    let seeds = if options.seeds.is_empty() {
        seeds::everywhere(&mut survey)?
    } else {
        seeds::given(&mut survey)?
    };
    survey.visit(seeds)?;
    let mut statistics = Statistics {
        cells: survey.crossed.len(),
        evaluations: survey.seen.points() + survey.repeated,
        nan_points: survey.seen.nan,
        may_miss_components: !options.seeds.is_empty(),
        ..Statistics::default()
    };
    let seen = survey.seen;
    let (mesh, more) = survey.into_mesh()?;
    statistics = statistics.and(more);
    Ok((Shape::Mesh(mesh), seen, statistics))
}

/// What is known of the grid.
pub(super) struct Survey<'a> {
    pub(super) job: &'a Job<'a>,
    pub(super) grid: &'a Grid,
    /// F − iso by the number of the point, ghosts aside.
    pub(super) values: FxHashMap<u64, f64>,
    /// Cells that were asked for.
    visited: FxHashSet<u64>,
    /// Those that the level set crosses, with their cases.
    crossed: Vec<(u64, u8)>,
    /// How often F was seen to be what at the points in `values` and others.
    pub(super) seen: Seen,
    /// Evaluations at points that were counted before.
    pub(super) repeated: usize,
}

impl<'a> Survey<'a> {
    fn new(job: &'a Job<'a>, grid: &'a Grid) -> Self {
        Survey {
            job,
            grid,
            values: FxHashMap::default(),
            visited: FxHashSet::default(),
            crossed: Vec::new(),
            seen: Seen::default(),
            repeated: 0,
        }
    }

    /// The number of cells along an axis, ghosts included.
    pub(super) fn cells(&self, axis: usize) -> u32 {
        (self.grid.points(axis) - 1) as u32
    }

    /// The number of a point, or of the cell above it: in the order of layers and rows.
    pub(super) fn key(&self, [x, y, z]: Index) -> u64 {
        let [width, height] = [0, 1].map(|axis| self.grid.points(axis) as u64);
        (u64::from(z) * height + u64::from(y)) * width + u64::from(x)
    }

    /// The indices of a number.
    fn index(&self, key: u64) -> Index {
        let [width, height] = [0, 1].map(|axis| self.grid.points(axis) as u64);
        [
            (key % width) as u32,
            (key / width % height) as u32,
            (key / (width * height)) as u32,
        ]
    }

    fn is_ghost(&self, point: Index) -> bool {
        (0..3).any(|axis| self.grid.is_ghost(axis, point[axis] as usize))
    }

    /// F − iso at a point that was evaluated; infinite at ghosts.
    pub(super) fn value(&self, point: Index) -> f64 {
        if self.is_ghost(point) {
            return f64::INFINITY;
        }
        let known = self.values.get(&self.key(point));
        known.copied().unwrap_or(f64::NAN)
    }

    /// The case of a cell whose corners were evaluated.
    pub(super) fn case(&self, cell: Index) -> u8 {
        let flag = |number: usize| u8::from(self.value(corner(cell, number)) < 0.0) << number;
        (0..8).map(flag).sum()
    }

    /// F − iso at points that are no ghosts.
    pub(super) fn evaluated(&self, points: &[Index]) -> Result<Vec<f64>, PolygonizeError> {
        let Job {
            field,
            accuracy,
            monitor,
            ..
        } = *self.job;
        let coordinates = &self.grid.coordinates;
        let parts = points.par_chunks(CHUNK).flat_map_iter(|points| {
            let mut values = vec![0.0; points.len()];
            if !monitor.cancelled() {
                let columns = [0, 1, 2].map(|axis| {
                    let along = points.iter().map(|point| point[axis] as usize);
                    along.map(|index| coordinates[axis][index]).collect()
                });
                let columns: [Vec<f64>; 3] = columns;
                field.values(&columns.each_ref().map(Vec::as_slice), &mut values);
            }
            values.into_iter().map(move |value| value - accuracy.iso)
        });
        let values = parts.collect();
        match monitor.cancelled() {
            true => Err(PolygonizeError::Cancelled),
            false => Ok(values),
        }
    }

    /// Evaluates F at those of the points that are not known.
    pub(super) fn learn(
        &mut self,
        points: impl Iterator<Item = Index>,
    ) -> Result<(), PolygonizeError> {
        let unknown =
            |&point: &Index| !self.is_ghost(point) && !self.values.contains_key(&self.key(point));
        let mut points: Vec<u64> = points
            .filter(unknown)
            .map(|point| self.key(point))
            .collect();
        points.par_sort_unstable();
        points.dedup();
        let places: Vec<Index> = points.iter().map(|&key| self.index(key)).collect();
        let values = self.evaluated(&places)?;
        self.seen = self.seen.and(Seen::of_values(&values));
        self.values.extend(points.into_iter().zip(values));
        Ok(())
    }

    /// Visits the cells and, from each that the level set crosses, its neighbours across the
    /// sides that it crosses.
    fn visit(&mut self, seeds: Vec<Index>) -> Result<(), PolygonizeError> {
        let mut generation: Vec<u64> = seeds.into_iter().map(|cell| self.key(cell)).collect();
        generation.retain(|&cell| self.visited.insert(cell));
        while !generation.is_empty() {
            generation.sort_unstable();
            let cells: Vec<Index> = generation.iter().map(|&key| self.index(key)).collect();
            self.learn(
                cells
                    .iter()
                    .flat_map(|&cell| (0..8).map(move |c| corner(cell, c))),
            )?;
            generation = Vec::new();
            for cell in cells {
                let case = self.case(cell);
                if case == 0 || case == 255 {
                    continue;
                }
                self.crossed.push((self.key(cell), case));
                for axis in 0..3 {
                    for end in [0, 1] {
                        let flags = case & side(axis, end);
                        let next = self.neighbour(cell, axis, end);
                        if let Some(next) = next
                            && flags != 0
                            && flags != side(axis, end)
                            && self.visited.insert(self.key(next))
                        {
                            generation.push(self.key(next));
                        }
                    }
                }
            }
            check_cells(self.crossed.len() as f64, self.job.options)?;
            // Nobody knows how many there will be.
            self.job.monitor.progress("following the surface", 0.0);
        }
        Ok(())
    }

    /// The cell across a side, if there is one.
    fn neighbour(&self, cell: Index, axis: usize, end: usize) -> Option<Index> {
        let mut next = cell;
        next[axis] = match end {
            0 => cell[axis].checked_sub(1)?,
            _ => cell[axis] + 1,
        };
        (next[axis] < self.cells(axis)).then_some(next)
    }

    /// The number of an edge of a cell, in the order in which marching cubes numbers vertices:
    /// layer by layer, first the edges in it row by row, then those to the next, then what is
    /// inside of cells.
    fn edge_key(&self, cell: Index, edge: usize) -> u64 {
        let (first, axis) = EDGES[edge];
        let [x, y, z] = corner(cell, first).map(u64::from);
        let [width, height] = [0, 1].map(|axis| self.grid.points(axis) as u64);
        let (between, turn) = if axis == 2 { (1, 0) } else { (0, axis as u64) };
        (((3 * z + between) * height + y) * 2 + turn) * width + x
    }

    /// The number of the vertices inside a cell, in the same order.
    fn centre_key(&self, [x, y, z]: Index) -> u64 {
        let [width, height] = [0, 1].map(|axis| self.grid.points(axis) as u64);
        let [x, y, z] = [x, y, z].map(u64::from);
        ((3 * z + 2) * height + y) * 2 * width + x
    }

    /// Where an edge of this number begins, and its axis.
    fn edge_place(&self, key: u64) -> ([usize; 3], usize) {
        let [width, height] = [0, 1].map(|axis| self.grid.points(axis) as u64);
        let (x, row) = (key % width, key / width);
        let (turn, row) = (row % 2, row / 2);
        let (y, layer) = (row % height, row / height);
        let axis = if layer % 3 == 1 { 2 } else { turn as usize };
        ([x, y, layer / 3].map(|index| index as usize), axis)
    }

    /// The surface in the crossed cells.
    fn into_mesh(mut self) -> Result<(Mesh, Statistics), PolygonizeError> {
        self.visited = FxHashSet::default();
        self.crossed.par_sort_unstable();
        let parts: Vec<CellVertices> = self
            .crossed
            .par_iter()
            .map(|&(cell, case)| self.vertices_of(self.index(cell), case))
            .collect();
        let mut vertices: Vec<(u64, u8)> =
            parts.par_iter().flat_map_iter(CellVertices::all).collect();
        vertices.par_sort_unstable();
        vertices.dedup();
        if u32::try_from(vertices.len()).is_err() {
            return Err(PolygonizeError::TooManyVertices {
                vertices: vertices.len(),
            });
        }
        // The starts by cell are in the order of the vertices that are inside of cells.
        let starts: Vec<Start> = parts
            .iter()
            .flat_map(|part| part.starts.iter().copied())
            .collect();
        let (roots, statistics) = self.roots(&vertices, &starts)?;
        let mut mesh = Mesh {
            positions: roots.iter().map(|root| root.position).collect(),
            normals: roots.iter().map(|root| root.normal).collect(),
            triangles: Vec::new(),
        };
        let triangles = parts.par_iter().flat_map_iter(|part| {
            // Every vertex of a triangle was numbered.
            let number = |name: u8| {
                let found = vertices.binary_search(&part.name(name));
                found.unwrap_or_else(|place| place) as u32
            };
            let own = part.triangles.iter();
            own.map(|triangle| triangle.map(number)).collect::<Vec<_>>()
        });
        mesh.triangles = triangles.collect();
        mesh.collapse_degenerate_edges();
        Ok((mesh, statistics))
    }

    /// The triangles of a crossed cell and its vertices.
    fn vertices_of(&self, cell: Index, case: u8) -> CellVertices {
        let values = std::array::from_fn(|number| self.value(corner(cell, number)));
        let place = self.grid.cell(cell.map(|index| index as usize));
        let (triangles, starts) = cell_triangles(case, &values, place);
        CellVertices {
            triangles,
            starts,
            edges: std::array::from_fn(|edge| self.edge_key(cell, edge)),
            case,
            centre: self.centre_key(cell),
        }
    }

    /// The roots on the edges and inside the cells of these vertices.
    fn roots(
        &self,
        vertices: &[(u64, u8)],
        starts: &[Start],
    ) -> Result<(Vec<Root>, Statistics), PolygonizeError> {
        let Job {
            field,
            accuracy,
            monitor,
            ..
        } = *self.job;
        let is_edge = |vertex: &&(u64, u8)| vertex.1 == 0;
        let edges: Vec<u64> = vertices
            .iter()
            .filter(is_edge)
            .map(|vertex| vertex.0)
            .collect();
        let solved: Vec<(Vec<Root>, Statistics)> = edges
            .par_chunks(CHUNK)
            .map(|keys| self.edge_roots(keys))
            .collect();
        let inside: Vec<(Vec<Root>, usize)> = starts
            .par_chunks(CHUNK)
            .map(|starts| projection::project(field, accuracy, starts, monitor))
            .collect();
        if monitor.cancelled() {
            return Err(PolygonizeError::Cancelled);
        }
        let mut statistics = Statistics::default();
        let mut on_edges = Vec::with_capacity(edges.len());
        for (roots, more) in solved {
            on_edges.extend(roots);
            statistics = statistics.and(more);
        }
        let mut in_cells = Vec::with_capacity(starts.len());
        for (roots, evaluations) in inside {
            let more = Statistics::of_roots(&roots);
            statistics = statistics.and(Statistics {
                evaluations,
                ..more
            });
            in_cells.extend(roots);
        }
        let (mut on_edges, mut in_cells) = (on_edges.into_iter(), in_cells.into_iter());
        let roots = vertices.iter().filter_map(|vertex| match is_edge(&vertex) {
            true => on_edges.next(),
            false => in_cells.next(),
        });
        Ok((roots.collect(), statistics))
    }

    /// The roots on the edges of these numbers.
    fn edge_roots(&self, keys: &[u64]) -> (Vec<Root>, Statistics) {
        let Job {
            field,
            accuracy,
            monitor,
            ..
        } = *self.job;
        let places: Vec<_> = keys.iter().map(|&key| self.edge_place(key)).collect();
        let edges: Vec<Edge> = places.iter().map(|place| self.edge(*place)).collect();
        let (mut roots, evaluations) = edge_roots::solve(&mut { field }, accuracy, &edges, monitor);
        let mut statistics = Statistics {
            evaluations,
            ..Statistics::of_roots(&roots)
        };
        for ((start, axis), root) in places.iter().zip(&mut roots) {
            statistics.cut_by_box |= self.grid.is_cut(start, *axis);
            if self.grid.leads_to_ghost(start, *axis) {
                root.normal = self.grid.outward(root.position);
            }
        }
        (roots, statistics)
    }

    /// The edge from a point along an axis.
    fn edge(&self, (start, axis): ([usize; 3], usize)) -> Edge {
        let mut ends = [start.map(|index| index as u32); 2];
        ends[1][axis] += 1;
        self.grid
            .edge(&start, axis, ends.map(|end| self.value(end)))
    }
}

/// The surface in a crossed cell. A vertex is named by the number of its edge and 0 or, inside
/// the cell, by the number of the cell and a count from 1.
struct CellVertices {
    triangles: &'static [[u8; 3]],
    starts: Vec<Start>,
    edges: [u64; 12],
    case: u8,
    centre: u64,
}

impl CellVertices {
    /// The vertex that triangles name so.
    fn name(&self, name: u8) -> (u64, u8) {
        match name.checked_sub(FIRST_CENTRE) {
            Some(number) => (self.centre, number + 1),
            None => (self.edges[usize::from(name)], 0),
        }
    }

    /// All vertices: on the crossed edges, and inside.
    fn all(&self) -> impl Iterator<Item = (u64, u8)> + '_ {
        let crossed = |&edge: &u8| {
            let (lower, axis) = EDGES[usize::from(edge)];
            (self.case >> lower ^ self.case >> (lower | 1 << axis)) & 1 == 1
        };
        let inside = (0..self.starts.len() as u8).map(|number| number + FIRST_CENTRE);
        (0..12)
            .filter(crossed)
            .chain(inside)
            .map(|name| self.name(name))
    }
}

/// The point at a corner of a cell.
pub(super) fn corner(cell: Index, number: usize) -> Index {
    [0, 1, 2].map(|axis| cell[axis] + (number >> axis & 1) as u32)
}
