//! A stand-in for the driver over boxes until it is there: the same contract, without pruning and one
//! box at a time.

use super::{CompiledField, Field, Monitor};
use crate::graph::Interval;
use crate::graph::interval::{Enclosure, Regularity};
use glam::DVec3;
use rayon::prelude::*;

/// A box of the subdivision.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// How deep.
    pub level: usize,
    /// Which one.
    pub index: [usize; 3],
    /// The lower corner.
    pub low: DVec3,
    /// The upper corner.
    pub high: DVec3,
}

/// How a box is subdivided.
#[derive(Clone, Debug)]
pub struct Subdivision {
    /// The lower corner.
    pub low: DVec3,
    /// The upper corner.
    pub high: DVec3,
    /// Tasks per axis, then children per axis.
    pub splits: Vec<[usize; 3]>,
    /// Which axes are gone through downward.
    pub descending: [bool; 3],
}

/// Who explores.
pub trait Explorer: Sync {
    /// What a task gathers.
    type Task: Send;
    /// Begins a task.
    fn begin(&self, cell: &Cell) -> Self::Task;
    /// Whether the cell is wanted.
    fn wants(&self, _task: &mut Self::Task, _cell: &Cell) -> bool {
        true
    }
    /// Whether the enclosure is enough.
    fn decides(&self, _cell: &Cell, enclosure: &Enclosure) -> bool {
        !enclosure.range.contains(0.0)
    }
    /// Takes a decided cell.
    fn decided(&self, task: &mut Self::Task, cell: &Cell, enclosure: &Enclosure);
    /// Takes a leaf.
    fn leaf(
        &self,
        task: &mut Self::Task,
        cell: &Cell,
        enclosure: &Enclosure,
        field: &mut Specialized<'_>,
    );
}

/// The field in a cell.
pub struct Specialized<'a> {
    field: &'a CompiledField,
}

impl Specialized<'_> {
    /// F.
    pub fn values(&mut self, points: &[&[f64]], values: &mut [f64]) {
        self.field.values(points, values);
    }

    /// F in f32.
    pub fn values_f32(&mut self, points: &[&[f32]], values: &mut [f32]) {
        self.field
            .program()
            .evaluate_batch_f32(points, self.field.parameters(), &mut [values]);
    }

    /// F and F_x.
    pub fn gradients(
        &mut self,
        points: &[&[f64]],
        values: &mut [f64],
        gradients: &mut [&mut [f64]],
    ) {
        self.field.gradients(points, values, gradients);
    }
}

/// Explores the field.
pub fn explore<E: Explorer>(
    field: &CompiledField,
    subdivision: &Subdivision,
    explorer: &E,
    monitor: &dyn Monitor,
) -> Vec<E::Task> {
    let root = Cell {
        level: 0,
        index: [0; 3],
        low: subdivision.low,
        high: subdivision.high,
    };
    let tasks = children(&root, subdivision.splits[0], [false; 3]);
    tasks
        .par_iter()
        .map(|cell| {
            let mut task = explorer.begin(cell);
            if !monitor.cancelled() {
                visit(field, subdivision, explorer, &mut task, cell);
            }
            task
        })
        .collect()
}

fn visit<E: Explorer>(
    field: &CompiledField,
    subdivision: &Subdivision,
    explorer: &E,
    task: &mut E::Task,
    cell: &Cell,
) {
    if !explorer.wants(task, cell) {
        return;
    }
    let sides: Vec<[Interval; 1]> = (0..field.dimension())
        .map(|axis| [Interval::new(cell.low[axis], cell.high[axis])])
        .collect();
    let sides: Vec<&[Interval]> = sides.iter().map(|side| &side[..]).collect();
    let mut enclosure = [Enclosure {
        range: Interval::ENTIRE,
        regularity: Regularity::Partial,
    }];
    field
        .program()
        .enclose_batch(&sides, field.parameters(), &mut [&mut enclosure]);
    if explorer.decides(cell, &enclosure[0]) {
        explorer.decided(task, cell, &enclosure[0]);
    } else if cell.level == subdivision.splits.len() {
        explorer.leaf(task, cell, &enclosure[0], &mut Specialized { field });
    } else {
        let split = subdivision.splits[cell.level];
        for child in children(cell, split, subdivision.descending) {
            visit(field, subdivision, explorer, task, &child);
        }
    }
}

fn children(cell: &Cell, split: [usize; 3], descending: [bool; 3]) -> Vec<Cell> {
    let counts = split.map(|count| count.max(1));
    let size = (cell.high - cell.low) / DVec3::from_array(counts.map(|count| count as f64));
    let order = |axis: usize, place: usize| match descending[axis] {
        true => counts[axis] - 1 - place,
        false => place,
    };
    let mut children = Vec::new();
    for z in 0..counts[2] {
        for y in 0..counts[1] {
            for x in 0..counts[0] {
                let place = [order(0, x), order(1, y), order(2, z)];
                let offset = DVec3::from_array(place.map(|place| place as f64));
                let low = cell.low + offset * size;
                children.push(Cell {
                    level: cell.level + 1,
                    index: [0, 1, 2].map(|axis| cell.index[axis] * counts[axis] + place[axis]),
                    low,
                    high: low + size,
                });
            }
        }
    }
    children
}
