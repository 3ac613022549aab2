//! The walk through one task: cells within cells, depth first.

use super::{Cell, Explorer, Specialized, Subdivision};
use crate::engine::block::Kernels;
use crate::engine::prune::{
    BOXES, Batch, LONG, Nest, Passes, Region, Scalars, Sequence, Specialiser, Trunk,
};
use crate::engine::{CompiledField, Monitor};
use crate::graph::interval::{Enclosure, Interval, Regularity};
use glam::DVec3;

/// What all tasks share.
pub(super) struct Walk<'a, E> {
    pub(super) field: &'a CompiledField,
    pub(super) trunk: &'a Trunk,
    pub(super) subdivision: &'a Subdivision,
    pub(super) explorer: &'a E,
    pub(super) monitor: &'a dyn Monitor,
    /// Whether the field is small enough to be bounded.
    pub(super) can_bound: bool,
}

/// What is known of up to [`BOXES`] tasks before they begin.
#[derive(Default)]
pub(super) struct Root {
    batch: Batch,
    lanes: Lanes,
}

/// What an interval pass tells of its boxes.
struct Lanes {
    enclosures: [Enclosure; BOXES],
    /// The boxes that are decided, a bit each.
    decided: u64,
    /// Those that need no settling; see [`crate::engine::block::Pass::tame`].
    tame: u64,
}

impl Default for Lanes {
    fn default() -> Lanes {
        Lanes {
            enclosures: [UNKNOWN; BOXES],
            decided: 0,
            tame: 0,
        }
    }
}

/// What is always true.
const UNKNOWN: Enclosure = Enclosure {
    range: Interval::ENTIRE,
    regularity: Regularity::Partial,
};

/// A thread's memory, kept from task to task.
pub(super) struct Workspace {
    scalars: Scalars,
    passes: Passes,
    specialiser: Specialiser,
    levels: Vec<Level>,
    /// The sequences by the levels of the cells that they are for.
    sequences: Vec<Sequence>,
    path: Vec<Region>,
    /// How many regions there have been.
    regions: u64,
    nest: Option<Box<Nest>>,
    kernels: Kernels,
}

/// What is known of the cells of a level that have the same parent.
#[derive(Default)]
pub(super) struct Level {
    cells: Vec<Cell>,
    /// The coordinates of their faces.
    faces: [Vec<f64>; 3],
    batch: Batch,
    lanes: Lanes,
}

/// How the field is given in some cell.
#[derive(Clone, Copy)]
struct Given {
    /// The level whose sequence it is; none: the trunk's.
    sequence: Option<usize>,
    tame: bool,
}

impl Workspace {
    /// For a trunk with these scalars.
    pub(super) fn new(kernels: Kernels, scalars: Scalars) -> Workspace {
        Workspace {
            scalars,
            passes: Passes::new(kernels),
            specialiser: Specialiser::default(),
            levels: Vec::new(),
            sequences: Vec::new(),
            path: Vec::new(),
            regions: 0,
            nest: None,
            kernels,
        }
    }
}

impl<E: Explorer> Walk<'_, E> {
    /// Bounds the cells of up to [`BOXES`] tasks.
    pub(super) fn bound_tasks(&self, workspace: &mut Workspace, cells: &[Cell]) -> Root {
        let mut root = Root::default();
        let whole = Given {
            sequence: None,
            tame: false,
        };
        let Workspace {
            scalars,
            passes,
            sequences,
            ..
        } = workspace;
        let place = (&mut root.batch, &mut root.lanes);
        self.bound((passes, scalars), sequences, whole, cells, place);
        root
    }

    /// Explores a task, whose cell has been bounded in this lane.
    pub(super) fn task(
        &self,
        workspace: &mut Workspace,
        task: &mut E::Task,
        cell: &Cell,
        (root, lane): (&Root, usize),
    ) {
        let whole = Given {
            sequence: None,
            tame: root.lanes.tame >> lane & 1 == 1,
        };
        workspace.path.clear();
        let place = Place {
            root: &root.batch,
            lane,
            enclosure: root.lanes.enclosures[lane],
            is_decided: root.lanes.decided >> lane & 1 == 1,
        };
        self.cell(workspace, task, cell, whole, place);
    }

    /// Bounds cells of equal parent, whose field is given, and finds what they decide.
    fn bound(
        &self,
        (passes, scalars): (&mut Passes, &Scalars),
        sequences: &[Sequence],
        given: Given,
        cells: &[Cell],
        (batch, lanes): (&mut Batch, &mut Lanes),
    ) {
        *lanes = Lanes::default();
        if self.can_bound {
            for (lane, cell) in cells.iter().enumerate() {
                passes.set(lane, cell.low, cell.high);
            }
            let sequence = self.sequence(sequences, given);
            let prunes = self.prunes(sequence, &cells[0]);
            let decisions = match prunes {
                true => batch.prepare(sequence.len()),
                false => &mut [],
            };
            lanes.tame = passes.run(sequence, scalars, decisions, !given.tame);
            for lane in 0..cells.len() {
                lanes.enclosures[lane] = passes.enclosure(lane);
            }
            for (lane, cell) in cells.iter().enumerate() {
                let is_decided = self.explorer.decides(cell, &lanes.enclosures[lane]);
                lanes.decided |= u64::from(is_decided) << lane;
            }
            if prunes {
                let all = u64::MAX >> (BOXES - cells.len());
                batch.mark(sequence, all & !lanes.decided);
            }
        }
    }

    /// Whether the sequence is pruned for cells of this one's level.
    fn prunes(&self, sequence: &Sequence, cell: &Cell) -> bool {
        sequence.has_choices && (!self.is_leaf(cell) || sequence.len() >= LONG)
    }

    /// Whether the cell is of the last level.
    fn is_leaf(&self, cell: &Cell) -> bool {
        cell.level + 1 >= self.subdivision.splits.len()
    }

    /// The sequence that is given.
    fn sequence<'s>(&'s self, sequences: &'s [Sequence], given: Given) -> &'s Sequence {
        match given.sequence.and_then(|place| sequences.get(place)) {
            Some(sequence) => sequence,
            None => self.trunk.sequence(),
        }
    }

    /// Explores a cell. `given` is the field of its parent.
    fn cell(
        &self,
        workspace: &mut Workspace,
        task: &mut E::Task,
        cell: &Cell,
        given: Given,
        place: Place<'_>,
    ) {
        let explorer = self.explorer;
        if !explorer.wants(task, cell) {
            return;
        }
        if place.is_decided {
            explorer.decided(task, cell, &place.enclosure);
        } else if self.is_leaf(cell) {
            let scalars = workspace.scalars.len();
            let depth = workspace.path.len();
            let given = self.specialise(workspace, cell, given, place);
            let sequence = self.sequence(&workspace.sequences, given);
            let mut field = Specialized {
                field: self.field,
                cell,
                sequence: self.can_bound.then_some(sequence),
                scalars: &workspace.scalars,
                kernels: workspace.kernels,
                pruned: Pruned {
                    trunk: self.trunk,
                    root: place.root,
                    path: &workspace.path,
                    levels: &workspace.levels,
                    sequences: &workspace.sequences,
                },
                nest: &mut workspace.nest,
            };
            explorer.leaf(task, cell, &place.enclosure, &mut field);
            workspace.path.truncate(depth);
            workspace.scalars.truncate(scalars);
        } else if !self.monitor.cancelled() {
            let scalars = workspace.scalars.len();
            let depth = workspace.path.len();
            let given = self.specialise(workspace, cell, given, place);
            self.children(workspace, task, cell, given, place.root);
            workspace.path.truncate(depth);
            workspace.scalars.truncate(scalars);
        }
    }

    /// The field for a cell, pruned if that is worth it.
    fn specialise(
        &self,
        workspace: &mut Workspace,
        cell: &Cell,
        given: Given,
        place: Place<'_>,
    ) -> Given {
        let level = cell.level;
        if workspace.sequences.len() <= level {
            workspace
                .sequences
                .resize_with(level + 1, Sequence::default);
        }
        let (outer, inner) = workspace.sequences.split_at_mut(level);
        let parent = self.sequence(outer, given);
        if !(self.can_bound && self.prunes(parent, cell)) {
            return given;
        }
        let batch = match level {
            0 => place.root,
            _ => &workspace.levels[level].batch,
        };
        let (scalars, child) = (&mut workspace.scalars, &mut inner[0]);
        let is_shorter =
            workspace
                .specialiser
                .specialise(parent, (batch, place.lane), scalars, child);
        if !is_shorter {
            return given;
        }
        workspace.regions += 1;
        workspace.path.push(Region {
            number: workspace.regions,
            level,
            lane: place.lane,
            parent: given.sequence,
            is_defined: place.enclosure.regularity >= Regularity::Defined,
        });
        Given {
            sequence: Some(level),
            ..given
        }
    }

    /// Explores the children of a cell, whose field is given.
    fn children(
        &self,
        workspace: &mut Workspace,
        task: &mut E::Task,
        cell: &Cell,
        given: Given,
        root: &Batch,
    ) {
        let level = cell.level + 1;
        if workspace.levels.len() <= level {
            workspace.levels.resize_with(level + 1, Level::default);
        }
        let mut children = self.subdivision.children(Some(cell));
        let faces = &mut workspace.levels[level].faces;
        self.subdivision.faces(cell, faces);
        let split = [0, 1, 2].map(|axis| faces[axis].len() - 1);
        loop {
            let Workspace {
                levels,
                passes,
                scalars,
                sequences,
                ..
            } = &mut *workspace;
            let Level {
                cells,
                faces,
                batch,
                lanes,
            } = &mut levels[level];
            cells.clear();
            cells.extend(children.by_ref().take(BOXES).map(|index| {
                let face = |axis: usize, upper: usize| {
                    faces[axis][index[axis] - cell.index[axis] * split[axis] + upper]
                };
                Cell {
                    level,
                    index,
                    low: DVec3::new(face(0, 0), face(1, 0), face(2, 0)),
                    high: DVec3::new(face(0, 1), face(1, 1), face(2, 1)),
                }
            }));
            if cells.is_empty() {
                return;
            }
            self.bound((passes, scalars), sequences, given, cells, (batch, lanes));
            for lane in 0..cells.len() {
                let Level { cells, lanes, .. } = &workspace.levels[level];
                let cell = cells[lane];
                let place = Place {
                    root,
                    lane,
                    enclosure: lanes.enclosures[lane],
                    is_decided: lanes.decided >> lane & 1 == 1,
                };
                let given = Given {
                    tame: given.tame || lanes.tame >> lane & 1 == 1,
                    ..given
                };
                self.cell(workspace, task, &cell, given, place);
            }
        }
    }
}

/// What an interval pass tells of one cell.
#[derive(Clone, Copy)]
struct Place<'a> {
    /// What tasks decide of the trunk's sequence.
    root: &'a Batch,
    /// The cell's lane in the batch of its level.
    lane: usize,
    enclosure: Enclosure,
    is_decided: bool,
}

/// What has been decided on the way to a cell.
pub(super) struct Pruned<'a> {
    trunk: &'a Trunk,
    /// About tasks.
    root: &'a Batch,
    /// About the cells of other levels.
    levels: &'a [Level],
    sequences: &'a [Sequence],
    /// The boxes that sequences were pruned for, from the outermost.
    pub(super) path: &'a [Region],
}

impl Pruned<'_> {
    /// The sequence of which the region has decided choices, and the batch that tells which.
    pub(super) fn decisions(&self, region: &Region) -> (&Sequence, &Batch) {
        let sequence = region.parent.and_then(|place| self.sequences.get(place));
        let batch = match region.level {
            0 => self.root,
            level => &self.levels[level].batch,
        };
        (sequence.unwrap_or(self.trunk.sequence()), batch)
    }
}
