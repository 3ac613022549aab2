//! F and F_x at many points near the surface, in no order: points of one block are evaluated
//! together, by the field as it is pruned there.
//!
//! What comes after the blocks (sharp edges, better triangles, flips) asks for points all over the
//! surface, in some tens of lists. A large field with min and max is tens of times shorter in any one
//! block, so the lattice is explored for the blocks that a list is the first to have points in, and
//! F and F_x as they are there are kept for the others: some kilobytes for a block with a surface.
//! Results have the bits of the whole field's.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

use super::lattice::Lattice;
use crate::engine::{Cell, CompiledField, Excerpt, Explorer, Field, Silent, Specialized, explore};
use crate::graph::interval::Enclosure;
use crate::polygonize::columns::Evaluate;

/// Fewer points are not worth an exploration.
const MANY: usize = 512;

/// Leaves that one task evaluates.
const LEAVES: usize = 8;

/// So many points are evaluated together where the field is not pruned.
const BATCH: usize = 1024;

/// The field, for lists of points.
pub(super) struct Scattered<'a> {
    field: &'a dyn Field,
    /// The field again, if it is to be pruned.
    pruned: Option<&'a CompiledField>,
    lattice: &'a Lattice,
    /// The coordinates of the faces between leaves, per axis.
    faces: [Vec<f64>; 3],
    /// F and F_x in the leaves that had points before; none where they cannot be pruned.
    excerpts: FxHashMap<[usize; 3], Option<Excerpt>>,
}

impl<'a> Scattered<'a> {
    /// The field near the surface in a lattice.
    pub(super) fn new(field: &'a dyn Field, lattice: &'a Lattice) -> Scattered<'a> {
        let pruned = field.compiled().filter(|field| field.program().is_pruned());
        Scattered {
            field,
            pruned,
            lattice,
            faces: lattice.subdivision.leaf_faces(),
            excerpts: FxHashMap::default(),
        }
    }

    /// Puts the points in the order of the leaves that they are in.
    fn sort(&self, points: &[&[f64]]) -> Sorted {
        let subdivision = &self.lattice.subdivision;
        let cells = subdivision.cells(subdivision.splits.len() - 1);
        let per_size = DVec3::from_array(cells.map(|count| count as f64))
            / (subdivision.high - subdivision.low);
        // The number of a point's leaf, from 1 on, above the number of the point.
        let key = |number: usize| {
            let point = at(points, number);
            let place = (point - subdivision.low) * per_size;
            // What is negative or not a number becomes 0, and then is not in that cell.
            let index = [0, 1, 2].map(|axis| (place[axis] as usize).min(cells[axis] - 1));
            let is_inside = (0..3).all(|axis| {
                let faces = &self.faces[axis][index[axis]..];
                faces[0] <= point[axis] && point[axis] <= faces[1]
            });
            let leaf = (index[2] * cells[1] + index[1]) * cells[0] + index[0] + 1;
            (if is_inside { leaf as u64 } else { 0 }, number)
        };
        let numbers = (0..points[0].len()).into_par_iter();
        let mut order: Vec<(u64, usize)> = numbers.map(key).collect();
        order.par_sort_unstable();
        let mut leaves: Vec<Leaf> = Vec::new();
        let mut lost = 0;
        for chunk in order.chunk_by(|one, other| one.0 == other.0) {
            let first = leaves.last().map_or(lost, |(_, range)| range.end);
            match chunk[0].0.checked_sub(1) {
                None => lost = chunk.len(),
                Some(leaf) => {
                    let leaf = leaf as usize;
                    let (x, rest) = (leaf % cells[0], leaf / cells[0]);
                    let index = [x, rest % cells[1], rest / cells[1]];
                    leaves.push((index, first..first + chunk.len()));
                }
            }
        }
        Sorted {
            numbers: order.into_iter().map(|(_, number)| number).collect(),
            lost,
            leaves,
        }
    }

    /// Prunes the field for those of the leaves that had no points before.
    fn prune(&mut self, field: &CompiledField, leaves: &[Leaf]) {
        let new = leaves.iter().map(|(index, _)| *index);
        let new: Vec<[usize; 3]> = new
            .filter(|leaf| !self.excerpts.contains_key(leaf))
            .collect();
        if new.is_empty() {
            return;
        }
        let subdivision = &self.lattice.subdivision;
        let levels = 0..subdivision.splits.len();
        let search = Search {
            wanted: levels
                .map(|level| self.lattice.around(level, &new))
                .collect(),
        };
        let found = explore(field, subdivision, &search, &Silent);
        self.excerpts.extend(found.into_iter().flatten());
    }

    /// F and F_x at the points, found leaf by leaf.
    fn explored(&mut self, field: &CompiledField, points: &[&[f64]]) -> Vec<Found> {
        let sorted = self.sort(points);
        self.prune(field, &sorted.leaves);
        let leaves = sorted.leaves.par_chunks(LEAVES).map(|leaves| {
            let mut found = Found::default();
            for (leaf, range) in leaves {
                let numbers = &sorted.numbers[range.clone()];
                match self.excerpts.get(leaf) {
                    Some(Some(excerpt)) => {
                        found.evaluate(points, numbers, |points, values, gradients| {
                            excerpt.gradients(points, values, gradients);
                        });
                    }
                    _ => found.evaluate_whole(self.field, points, numbers),
                }
            }
            found
        });
        let mut found: Vec<Found> = leaves.collect();
        let mut rest = Found::default();
        rest.evaluate_whole(self.field, points, &sorted.numbers[..sorted.lost]);
        found.push(rest);
        found
    }

    /// The same by the whole field, in parallel.
    fn whole(&self, points: &[&[f64]]) -> Vec<Found> {
        let numbers: Vec<usize> = (0..points[0].len()).collect();
        let found = numbers.par_chunks(BATCH).map(|numbers| {
            let mut found = Found::default();
            found.evaluate_whole(self.field, points, numbers);
            found
        });
        found.collect()
    }
}

impl Evaluate for Scattered<'_> {
    fn dimension(&self) -> usize {
        self.field.dimension()
    }

    fn values(&mut self, points: &[&[f64]], values: &mut [f64]) {
        self.field.values(points, values);
    }

    fn gradients(&mut self, points: &[&[f64]], values: &mut [f64], gradients: &mut [&mut [f64]]) {
        let found = match self.pruned {
            Some(field) if values.len() >= MANY => self.explored(field, points),
            _ => self.whole(points),
        };
        for found in found {
            for (place, number) in found.numbers.into_iter().enumerate() {
                values[number] = found.values[place];
                for (axis, column) in gradients.iter_mut().enumerate() {
                    column[number] = found.gradients[axis][place];
                }
            }
        }
    }

    fn compiled(&self) -> Option<&CompiledField> {
        self.field.compiled()
    }
}

/// The point with this number.
fn at(points: &[&[f64]], number: usize) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(|axis| points[axis][number]))
}

/// The place of a leaf, and where the numbers of its points are.
type Leaf = ([usize; 3], Range<usize>);

/// Points by leaves.
struct Sorted {
    /// The numbers of all points: first of those in no leaf, then leaf by leaf.
    numbers: Vec<usize>,
    /// How many are in no leaf.
    lost: usize,
    /// The leaves with points.
    leaves: Vec<Leaf>,
}

/// F and F_x at some of the points.
#[derive(Default)]
struct Found {
    /// The points.
    numbers: Vec<usize>,
    values: Vec<f64>,
    gradients: [Vec<f64>; 3],
}

impl Found {
    /// Adds those with these numbers.
    fn evaluate(
        &mut self,
        points: &[&[f64]],
        numbers: &[usize],
        gradients: impl FnOnce(&[&[f64]], &mut [f64], &mut [&mut [f64]]),
    ) {
        let columns: Vec<Vec<f64>> = (points.iter())
            .map(|column| numbers.iter().map(|&number| column[number]).collect())
            .collect();
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let first = self.values.len();
        self.numbers.extend_from_slice(numbers);
        self.values.resize(self.numbers.len(), 0.0);
        for column in &mut self.gradients {
            column.resize(self.numbers.len(), 0.0);
        }
        let mut found = self.gradients.each_mut().map(|column| &mut column[first..]);
        gradients(&columns, &mut self.values[first..], &mut found);
    }

    /// The same by the whole field.
    fn evaluate_whole(&mut self, field: &dyn Field, points: &[&[f64]], numbers: &[usize]) {
        self.evaluate(points, numbers, |points, values, gradients| {
            field.gradients(points, values, gradients);
        });
    }
}

/// Keeps F and F_x in some leaves.
struct Search {
    /// The leaves, and for each level above them the cells that they are in.
    wanted: Vec<FxHashSet<[usize; 3]>>,
}

impl Explorer for Search {
    type Task = Vec<([usize; 3], Option<Excerpt>)>;

    fn begin(&self, _: &Cell) -> Self::Task {
        Vec::new()
    }

    fn wants(&self, _: &mut Self::Task, cell: &Cell) -> bool {
        self.wanted[cell.level].contains(&cell.index)
    }

    fn decides(&self, _: &Cell, _: &Enclosure) -> bool {
        false
    }

    fn decided(&self, _: &mut Self::Task, _: &Cell, _: &Enclosure) {}

    fn leaf(
        &self,
        found: &mut Self::Task,
        cell: &Cell,
        _: &Enclosure,
        field: &mut Specialized<'_>,
    ) {
        found.push((cell.index, field.excerpt()));
    }
}
