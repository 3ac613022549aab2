//! The driver: a recursive subdivision of a box, in which a field is bounded, decided and pruned.
//!
//! [`explore`] splits a box into tasks and each of them into cells within cells. Where the field's
//! enclosure decides a cell it ends there; in the cells of the last level that are left it hands
//! out the field as pruned for the surroundings or, where that is long, for the cell itself. What
//! is done with them is the [`Explorer`]'s.
//!
//! Enclosures that are at least `Defined` hold for what is computed in f64, too: where a number may
//! overflow in a cell, its enclosure is `Partial`.
//!
//! All cells of one parent go through one interval pass, 64 at a time, with the parent's pruned
//! tape. Tasks run in parallel, cells of a task one after the other, so that an explorer may use
//! what it has found (as a renderer does that goes from front to back).

mod excerpt;
mod specialized;
mod walk;

use super::prune::Trunk;
use super::{CompiledField, Field, Monitor};
use crate::graph::interval::Enclosure;
pub use excerpt::Excerpt;
use glam::DVec3;
use rayon::prelude::*;
pub use specialized::Specialized;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use walk::{Root, Walk, Workspace};

/// A part of the box that is explored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// How often the box was split: a task's cell is at level 0.
    pub level: usize,
    /// The cell's place among all cells of its level, per axis.
    pub index: [usize; 3],
    /// Its lower corner. Neighbours share the coordinates of their faces exactly.
    pub low: DVec3,
    /// Its upper corner.
    pub high: DVec3,
}

/// How a box is split.
#[derive(Clone, Debug, PartialEq)]
pub struct Subdivision {
    /// The lower corner of the box. Axes beyond the field's dimension do not matter.
    pub low: DVec3,
    /// The upper corner.
    pub high: DVec3,
    /// Into how many parts cells are split per axis, by levels: the box into tasks, a task into
    /// cells, and so on. Cells of the last level are leaves. A split into 64 costs hardly more
    /// than one into fewer; 0 counts as 1.
    pub splits: Vec<[usize; 3]>,
    /// For each axis, whether cells are visited from the upper end to the lower one. z changes
    /// slowest and x fastest.
    pub descending: [bool; 3],
}

impl Subdivision {
    /// The number of cells per axis at a level.
    pub fn cells(&self, level: usize) -> [usize; 3] {
        let mut cells = [1; 3];
        for split in self.splits.iter().take(level + 1) {
            for (cells, &split) in cells.iter_mut().zip(split) {
                *cells *= split.max(1);
            }
        }
        cells
    }

    /// The cell at a place of a level.
    pub fn cell(&self, level: usize, index: [usize; 3]) -> Cell {
        let cells = self.cells(level);
        let face = |upper: usize| {
            let face = |axis| self.face(axis, index[axis] + upper, cells[axis]);
            DVec3::from_array(std::array::from_fn(face))
        };
        Cell {
            level,
            index,
            low: face(0),
            high: face(1),
        }
    }

    /// The coordinates of the faces of leaves per axis, from the lower side of the box to the upper.
    pub fn leaf_faces(&self) -> [Vec<f64>; 3] {
        let cells = self.cells(self.splits.len().saturating_sub(1));
        [0, 1, 2].map(|axis| {
            let faces = 0..=cells[axis];
            faces
                .map(|face| self.face(axis, face, cells[axis]))
                .collect()
        })
    }

    /// The coordinate of a face between cells, of which the axis has so many. The same face has
    /// the same coordinate at all levels.
    fn face(&self, axis: usize, index: usize, cells: usize) -> f64 {
        let (low, high) = (self.low[axis], self.high[axis]);
        if index == 0 {
            return low;
        }
        if index >= cells {
            return high;
        }
        // Quotients of equal rational numbers are equal, so levels agree.
        let part = index as f64 / cells as f64;
        let width = high - low;
        let face = if width.is_finite() {
            low + width * part
        } else {
            low * (1.0 - part) + high * part
        };
        face.clamp(low.min(high), high.max(low))
    }

    /// The coordinates of the faces of a cell's children, and of those between them.
    fn faces(&self, parent: &Cell, faces: &mut [Vec<f64>; 3]) {
        let level = parent.level + 1;
        let cells = self.cells(level);
        for (axis, faces) in faces.iter_mut().enumerate() {
            let split = self.splits.get(level).map_or(1, |split| split[axis].max(1));
            let first = parent.index[axis] * split;
            faces.clear();
            faces.extend((0..=split).map(|place| self.face(axis, first + place, cells[axis])));
        }
    }

    /// The children of a cell at the next level, or the tasks, in the order of their visits.
    fn children(&self, parent: Option<&Cell>) -> impl Iterator<Item = [usize; 3]> + use<> {
        let level = parent.map_or(0, |cell| cell.level + 1);
        let split = self.splits.get(level).copied().unwrap_or([1; 3]);
        let split = split.map(|parts| parts.max(1));
        let first = match parent {
            Some(cell) => std::array::from_fn(|axis| cell.index[axis] * split[axis]),
            None => [0; 3],
        };
        let descending = self.descending;
        (0..split[0] * split[1] * split[2]).map(move |number| {
            let places = [
                number % split[0],
                number / split[0] % split[1],
                number / (split[0] * split[1]),
            ];
            std::array::from_fn(|axis| {
                let place = match descending[axis] {
                    true => split[axis] - 1 - places[axis],
                    false => places[axis],
                };
                first[axis] + place
            })
        })
    }
}

/// Who explores: decides what to do with cells. Methods are called by several threads at a time,
/// those about one task by one after the other.
pub trait Explorer: Sync {
    /// The state of one task and its result.
    type Task: Send;

    /// Starts a task.
    fn begin(&self, cell: &Cell) -> Self::Task;

    /// Whether the cell, and what is in it, is of interest: it is false where what was found
    /// before hides it.
    fn wants(&self, _task: &mut Self::Task, _cell: &Cell) -> bool {
        true
    }

    /// Whether the enclosure of F on the cell says enough. By default where F has no zero: 0 is
    /// not in its range, or F is nowhere defined.
    fn decides(&self, _cell: &Cell, enclosure: &Enclosure) -> bool {
        enclosure.range.is_empty() || !enclosure.range.contains(0.0)
    }

    /// Takes a cell that is decided.
    fn decided(&self, task: &mut Self::Task, cell: &Cell, enclosure: &Enclosure);

    /// Takes a cell of the last level that is not decided, with the field for points in it.
    fn leaf(
        &self,
        task: &mut Self::Task,
        cell: &Cell,
        enclosure: &Enclosure,
        field: &mut Specialized<'_>,
    );
}

/// As many tasks are bounded together.
const TASKS: usize = 1 << 12;

/// Explores the subdivision and returns the tasks in the order of visits; see
/// [`Subdivision::descending`]. They do not depend on the number of threads. A cancelled
/// exploration returns tasks that are not finished. Where a field is too large to be bounded,
/// nothing is decided and every cell of the last level is a leaf.
pub fn explore<E: Explorer>(
    field: &CompiledField,
    subdivision: &Subdivision,
    explorer: &E,
    monitor: &dyn Monitor,
) -> Vec<E::Task> {
    if subdivision.splits.is_empty() {
        return Vec::new();
    }
    let trunk = field.program().value_trunk();
    let walk = Walk {
        field,
        trunk,
        subdivision,
        explorer,
        monitor,
        can_bound: trunk.is_runnable(),
    };
    let cells: Vec<Cell> = subdivision
        .children(None)
        .map(|index| subdivision.cell(0, index))
        .collect();
    let workspaces = Workspaces::new(field, trunk);
    let finished = AtomicUsize::new(0);
    let report = cells.len().div_ceil(1000);
    let mut tasks = Vec::with_capacity(cells.len());
    for cells_together in cells.chunks(TASKS) {
        let roots: Vec<Root> = cells_together
            .par_chunks(super::prune::BOXES)
            .map(|chunk| workspaces.with(|workspace| walk.bound_tasks(workspace, chunk)))
            .collect();
        let each = (0..cells_together.len()).into_par_iter().map(|index| {
            let cell = &cells_together[index];
            let mut task = explorer.begin(cell);
            let (root, lane) = (
                &roots[index / super::prune::BOXES],
                index % super::prune::BOXES,
            );
            workspaces.with(|workspace| walk.task(workspace, &mut task, cell, (root, lane)));
            let finished = 1 + finished.fetch_add(1, Ordering::Relaxed);
            if finished.is_multiple_of(report) {
                monitor.progress("exploring", finished as f64 / cells.len() as f64);
            }
            task
        });
        tasks.par_extend(each);
    }
    tasks
}

/// The threads' workspaces, made when there are too few.
struct Workspaces<'a> {
    field: &'a CompiledField,
    trunk: &'a Trunk,
    idle: Mutex<Vec<Box<Workspace>>>,
}

impl<'a> Workspaces<'a> {
    fn new(field: &'a CompiledField, trunk: &'a Trunk) -> Workspaces<'a> {
        Workspaces {
            field,
            trunk,
            idle: Mutex::new(Vec::new()),
        }
    }

    /// Lends a workspace to `work`.
    fn with<T>(&self, work: impl FnOnce(&mut Workspace) -> T) -> T {
        // A thread that panicked has not touched the list meanwhile.
        let idle = || {
            self.idle
                .lock()
                .unwrap_or_else(|poisoned| poisoned.into_inner())
        };
        let found = idle().pop();
        let mut workspace = found.unwrap_or_else(|| {
            let kernels = self.field.program().block_kernels();
            let scalars = self.trunk.scalars(self.field.parameters());
            Box::new(Workspace::new(kernels, scalars))
        });
        let result = work(&mut workspace);
        idle().push(workspace);
        result
    }
}
