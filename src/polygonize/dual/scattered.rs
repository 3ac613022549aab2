//! F and F_x at many points near the surface, in no order: points of one block are evaluated
//! together, by the field as it is pruned there.
//!
//! What comes after the blocks (sharp edges, better triangles, flips) asks for points all over the
//! surface. A large field with min and max is tens of times shorter in any one block, so it pays to
//! explore the lattice again for each such list, in the cells with points only. Results have the
//! bits of the whole field's.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

use super::lattice::Lattice;
use crate::engine::{Cell, CompiledField, Explorer, Field, Silent, Specialized, explore};
use crate::graph::interval::Enclosure;
use crate::polygonize::columns::Evaluate;

/// Fewer points are not worth an exploration.
const MANY: usize = 512;

/// So many points are evaluated together where the field is not pruned.
const BATCH: usize = 1024;

/// The field, for lists of points.
pub(super) struct Scattered<'a> {
    field: &'a dyn Field,
    /// The field again, if it is to be pruned.
    pruned: Option<&'a CompiledField>,
    lattice: &'a Lattice,
}

impl<'a> Scattered<'a> {
    /// The field near the surface in a lattice.
    pub(super) fn new(field: &'a dyn Field, lattice: &'a Lattice) -> Scattered<'a> {
        let pruned = field.compiled().filter(|field| field.program().is_pruned());
        Scattered {
            field,
            pruned,
            lattice,
        }
    }

    /// Puts the points in the order of the leaves that they are in.
    fn sort(&self, points: &[&[f64]]) -> Sorted {
        let subdivision = &self.lattice.subdivision;
        let level = subdivision.splits.len() - 1;
        let cells = subdivision.cells(level);
        let size = subdivision.high - subdivision.low;
        // The number of a point's leaf, from 1 on, above the number of the point.
        let key = |number: usize| {
            let point = at(points, number);
            let part = (point - subdivision.low) / size;
            // What is negative or not a number becomes 0, and then is not in that cell.
            let index = |axis: usize| (part[axis] * cells[axis] as f64) as usize;
            let index = [0, 1, 2].map(|axis| index(axis).min(cells[axis] - 1));
            let cell = subdivision.cell(level, index);
            let is_inside = point.cmpge(cell.low).all() && point.cmple(cell.high).all();
            let leaf = (index[2] * cells[1] + index[1]) * cells[0] + index[0] + 1;
            (if is_inside { leaf as u64 } else { 0 }, number)
        };
        let numbers = (0..points[0].len()).into_par_iter();
        let mut order: Vec<(u64, usize)> = numbers.map(key).collect();
        order.par_sort_unstable();
        let mut leaves: Vec<([usize; 3], Range<usize>)> = Vec::new();
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
            leaves: leaves.into_iter().collect(),
        }
    }

    /// F and F_x at the points, found leaf by leaf.
    fn explored(&self, field: &CompiledField, points: &[&[f64]]) -> Vec<Found> {
        let sorted = self.sort(points);
        let subdivision = &self.lattice.subdivision;
        let levels = 0..subdivision.splits.len();
        let search = Search {
            points,
            sorted: &sorted,
            wanted: levels
                .map(|level| sorted.cells(self.lattice, level))
                .collect(),
        };
        let mut found = explore(field, subdivision, &search, &Silent);
        let mut rest = Found::default();
        let mut whole: &dyn Field = self.field;
        rest.evaluate(&mut whole, points, &sorted.numbers[..sorted.lost]);
        found.push(rest);
        found
    }

    /// The same by the whole field, in parallel.
    fn whole(&self, points: &[&[f64]]) -> Vec<Found> {
        let numbers: Vec<usize> = (0..points[0].len()).collect();
        let found = numbers.par_chunks(BATCH).map(|numbers| {
            let mut found = Found::default();
            let mut field: &dyn Field = self.field;
            found.evaluate(&mut field, points, numbers);
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

/// Points by leaves.
struct Sorted {
    /// The numbers of all points: first of those in no leaf, then leaf by leaf.
    numbers: Vec<usize>,
    /// How many are in no leaf.
    lost: usize,
    /// The leaves with points, and where the numbers of theirs are.
    leaves: FxHashMap<[usize; 3], Range<usize>>,
}

impl Sorted {
    /// The cells of a level that leaves with points are in.
    fn cells(&self, lattice: &Lattice, level: usize) -> FxHashSet<[usize; 3]> {
        let leaves = [0, 1, 2].map(|axis| lattice.blocks_of(level, axis));
        let cell = |leaf: &[usize; 3]| [0, 1, 2].map(|axis| leaf[axis] / leaves[axis]);
        self.leaves.keys().map(cell).collect()
    }

    /// The numbers of the points in a leaf.
    fn of(&self, leaf: [usize; 3]) -> &[usize] {
        let range = self.leaves.get(&leaf).cloned().unwrap_or_default();
        &self.numbers[range]
    }
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
    fn evaluate(&mut self, field: &mut impl Evaluate, points: &[&[f64]], numbers: &[usize]) {
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
        let mut gradients = self.gradients.each_mut().map(|column| &mut column[first..]);
        field.gradients(&columns, &mut self.values[first..], &mut gradients);
    }
}

/// Explores the cells with points.
struct Search<'a> {
    points: &'a [&'a [f64]],
    sorted: &'a Sorted,
    /// For each level the cells with points.
    wanted: Vec<FxHashSet<[usize; 3]>>,
}

impl Explorer for Search<'_> {
    type Task = Found;

    fn begin(&self, _: &Cell) -> Found {
        Found::default()
    }

    fn wants(&self, _: &mut Found, cell: &Cell) -> bool {
        self.wanted[cell.level].contains(&cell.index)
    }

    fn decides(&self, _: &Cell, _: &Enclosure) -> bool {
        false
    }

    fn decided(&self, _: &mut Found, _: &Cell, _: &Enclosure) {}

    fn leaf(&self, found: &mut Found, cell: &Cell, _: &Enclosure, field: &mut Specialized<'_>) {
        found.evaluate(field, self.points, self.sorted.of(cell.index));
    }
}
