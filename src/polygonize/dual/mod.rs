//! Manifold dual contouring: a vertex for each loop in which the surface passes through a cell,
//! a facet around each crossed edge. Sharp edges and corners are kept, for vertices lie on them.
//!
//! T. Ju, F. Losasso, S. Schaefer, J. Warren, "Dual contouring of Hermite data", SIGGRAPH 2002;
//! several vertices in a cell as in G. M. Nielson, "Dual marching cubes", 2004, and where that
//! fails to be manifold as `loops` says.
//!
//! The driver over boxes proves most of the box empty (`lattice` says how it is divided); what is
//! left are blocks of cells, each done on its own with the field as it is pruned there (`block`).
//! Vertices are placed on the surface (`place`, `quadric`), then joined (`facets`), and badly
//! shaped triangles improved (`improve`). Flips make sharp edges edges of the mesh (`flips`), those
//! that no cell has seen are cut into it (`creases`), and what is thin beside them is improved again
//! (`thin`). What is folded even so is mended or counted (`merge`, `repair`). Cost and memory grow
//! with the surface.

mod around;
mod block;
mod creases;
mod facets;
mod flips;
mod improve;
mod lattice;
mod loops;
mod merge;
mod place;
mod quadric;
mod repair;
mod scattered;
mod sharp_points;
mod sharpen;
mod thin;

use rayon::prelude::*;

use self::around::Around;
use self::block::{Block, Plan, Workshop};
use self::facets::{Blocks, triangulate};
use self::lattice::Lattice;
use self::place::Vertex;
use self::scattered::Scattered;
pub(super) use self::sharp_points::{Loop, SharpPoint, are_smooth, sharp_points};
use self::sharpen::{Known, sharpen};
use super::columns::Evaluate;
use super::grid::Seen;
use super::{Found, Job, PolygonizeError, Shape, Statistics};
use crate::engine::{Cell, Explorer, Field, Specialized, explore};
use crate::geometry::Mesh;
use crate::graph::interval::Enclosure;

/// The mesh of the level set by dual contouring.
pub(super) fn march(job: &Job) -> Result<Found, PolygonizeError> {
    let lattice = Lattice::new(job.options)?;
    let plan = Plan {
        lattice: &lattice,
        accuracy: job.accuracy,
    };
    let tasks = match job.field.compiled() {
        Some(field) => {
            let survey = Survey { plan: &plan };
            explore(field, &lattice.subdivision, &survey, job.monitor)
        }
        None => every_block(&plan, job),
    };
    if job.monitor.cancelled() {
        return Err(PolygonizeError::Cancelled);
    }
    let mut statistics = Statistics::default();
    let mut seen = Seen::default();
    let mut list = Vec::new();
    for task in tasks {
        seen = seen.and(task.seen).and(task.workshop.seen);
        statistics = statistics.and(task.workshop.roots);
        statistics.evaluations += task.workshop.evaluations;
        list.extend(task.blocks);
    }
    statistics.nan_points = seen.nan;
    statistics.cells = lattice.solid_cells();
    let (mesh, more) = join(job, &plan, list)?;
    statistics.evaluations += more.evaluations;
    statistics.cut_by_box = more.cut_by_box;
    statistics.max_residual = more.max_residual;
    statistics.folded_facets = more.folded_facets;
    statistics.intersecting_facets = more.intersecting_facets;
    Ok((Shape::Mesh(mesh), seen, statistics))
}

/// Facets below this shape are improved, where 1 is equilateral, and beside sharp edges, once these
/// are edges of the mesh, triangles below the second.
const GOOD: f64 = 0.6;
const FAIR: f64 = 0.4;

/// The blocks as one mesh, and what that took.
fn join(job: &Job, plan: &Plan, list: Vec<Block>) -> Result<(Mesh, Statistics), PolygonizeError> {
    let count: usize = list.iter().map(|block| block.vertices.len()).sum();
    if u32::try_from(count).is_err() {
        return Err(PolygonizeError::TooManyVertices { vertices: count });
    }
    let cut_by_box = list.iter().any(|block| is_cut(plan.lattice, block));
    let mut blocks = Blocks::new(list);
    let mut vertices = blocks.vertices();
    let mut evaluations = blocks.turn_doubled_faces(plan, job.field, &mut vertices);
    let facets = blocks.facets(plan.lattice);
    let around = Around::new(&facets, vertices.len());
    let bent = blocks.bent();
    let known = Known {
        blocks: &blocks,
        cells: &blocks.cells(),
        bent: &bent,
        facets: &facets,
        around: &around,
    };
    let mut field = Scattered::new(job.field, plan.lattice);
    evaluations += sharpen(&mut field, plan, &known, &mut vertices);
    drop(blocks);
    evaluations += improve::relax((job, &mut field), (&facets, &around), GOOD, &mut vertices);
    let mut triangles = triangulate(&facets, &vertices);
    evaluations += flips::flip((job, &mut field), &mut triangles, &vertices);
    let all = (job, plan, &mut field);
    let (is_split, more) = creases::split(all, &mut triangles, &mut vertices);
    evaluations += more;
    if is_split {
        evaluations += flips::flip((job, &mut field), &mut triangles, &vertices);
    }
    evaluations += even_out((job, &mut field), &mut triangles, &mut vertices);
    let cell = plan.lattice.side.min_element();
    merge::join_coinciding(&triangles, &mut vertices, cell);
    let moved = merge::merge(&triangles, &mut vertices);
    let mut mesh = Mesh {
        positions: vertices.iter().map(|vertex| vertex.position).collect(),
        normals: vertices.iter().map(|vertex| vertex.normal).collect(),
        triangles,
    };
    merge::collapse(&mut mesh, &moved);
    mesh.drop_unused_vertices();
    let repaired = repair::repair((job, &mut field), &mut mesh);
    let intersecting = match repaired.folded {
        0 => 0,
        _ => mesh.self_intersecting_triangles(),
    };
    let residual = |vertex: &place::Vertex| vertex.residual;
    let statistics = Statistics {
        evaluations: evaluations + repaired.evaluations,
        folded_facets: repaired.folded,
        intersecting_facets: intersecting,
        cut_by_box,
        // NaN, of vertices where F is not smooth or not defined, takes no part.
        max_residual: vertices.iter().map(residual).fold(0.0, f64::max),
        ..Statistics::default()
    };
    Ok((mesh, statistics))
}

/// Better triangles beside sharp edges, once these are edges of the mesh; returns the number of
/// evaluations.
fn even_out(
    (job, field): (&Job, &mut Scattered),
    triangles: &mut [[u32; 3]],
    vertices: &mut [Vertex],
) -> usize {
    if vertices.iter().all(|vertex| vertex.rank == 1) {
        return 0;
    }
    thin::flip(FAIR, triangles, vertices);
    let around = Around::new(triangles, vertices.len());
    improve::relax((job, field), (&*triangles, &around), FAIR, vertices)
}

/// Whether the box cuts the level set in this block.
fn is_cut(lattice: &Lattice, block: &Block) -> bool {
    let base = block.place.map(|place| place * lattice::BLOCK);
    block.signs.active_cells().any(|cell| {
        (0..3).any(|axis| {
            let cell = base[axis] + cell[axis];
            cell == 0 || cell + 1 == lattice.cells(axis)
        })
    })
}

/// What comes of a task.
struct Task {
    blocks: Vec<Block>,
    workshop: Workshop,
    /// What is known of the points of cells without a surface.
    seen: Seen,
}

impl Task {
    fn new() -> Task {
        Task {
            blocks: Vec::new(),
            workshop: Workshop::default(),
            seen: Seen::default(),
        }
    }

    fn add(&mut self, plan: &Plan, place: [usize; 3], field: &mut impl Evaluate) {
        self.blocks.extend(self.workshop.block(plan, place, field));
    }
}

/// Explores the lattice of a field that can be bounded.
struct Survey<'a> {
    plan: &'a Plan<'a>,
}

impl Explorer for Survey<'_> {
    type Task = Task;

    fn begin(&self, _: &Cell) -> Task {
        Task::new()
    }

    fn wants(&self, _: &mut Task, cell: &Cell) -> bool {
        self.plan.lattice.covered(cell).is_some()
    }

    fn decides(&self, cell: &Cell, enclosure: &Enclosure) -> bool {
        let (range, iso) = (enclosure.range, self.plan.accuracy.iso);
        if range.is_empty() || range.low > iso {
            return true;
        }
        // What is inside at the side of the box is closed there.
        let lattice = self.plan.lattice;
        range.high < iso && !(lattice.cap && lattice.touches_side(cell))
    }

    fn decided(&self, task: &mut Task, cell: &Cell, enclosure: &Enclosure) {
        let Some(ranges) = self.plan.lattice.covered(cell) else {
            return;
        };
        let points: usize = ranges.iter().map(|[first, end]| end - first).product();
        let place = if enclosure.range.is_empty() {
            &mut task.seen.nan
        } else if enclosure.range.low > self.plan.accuracy.iso {
            &mut task.seen.outside
        } else {
            &mut task.seen.inside
        };
        *place += points;
    }

    fn leaf(&self, task: &mut Task, cell: &Cell, _: &Enclosure, field: &mut Specialized<'_>) {
        task.add(self.plan, cell.index, field);
    }
}

/// All blocks, for a field that cannot be bounded.
fn every_block(plan: &Plan, job: &Job) -> Vec<Task> {
    let [x, y, z] = [0, 1, 2].map(|axis| plan.lattice.cells(axis).div_ceil(lattice::BLOCK));
    let layer = |z: usize| {
        let mut task = Task::new();
        for place in (0..y).flat_map(|y| (0..x).map(move |x| [x, y, z])) {
            if job.monitor.cancelled() {
                break;
            }
            let mut field: &dyn Field = job.field;
            task.add(plan, place, &mut field);
        }
        task
    };
    (0..z).into_par_iter().map(layer).collect()
}
