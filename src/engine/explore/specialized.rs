//! The field as it is pruned for the surroundings of a leaf.

use super::Cell;
use super::walk::Pruned;
use crate::engine::block::{self, Kernels};
use crate::engine::prune::{Nest, Scalars, Sequence, Trunk};
use crate::engine::{CompiledField, Field};

/// A field for points of one cell: values and gradients have the bits of the whole field's, and
/// cost what the parts of it that are near cost. Gradients are right elsewhere, too, at the whole
/// field's cost; of values nothing is said there.
///
/// As many points are evaluated as the shortest column has; a missing column has none.
pub struct Specialized<'a> {
    pub(super) field: &'a CompiledField,
    pub(super) cell: &'a Cell,
    /// None if the field is too large for blocks.
    pub(super) sequence: Option<&'a Sequence>,
    pub(super) scalars: &'a Scalars,
    pub(super) kernels: Kernels,
    /// What the sequence was pruned by.
    pub(super) pruned: Pruned<'a>,
    /// What prunes the gradient, once that has been asked for.
    pub(super) nest: &'a mut Option<Box<Nest>>,
}

/// Whether pruned sequences compute a function at so many points. Without choices they are as long
/// as the whole, which for blocks of points may have machine code.
fn is_pruned(trunk: &Trunk, count: usize) -> bool {
    trunk.sequence().has_choices || count < block::LANES
}

impl Specialized<'_> {
    /// The number of coordinates.
    pub fn dimension(&self) -> usize {
        self.field.dimension()
    }

    /// The field that was pruned.
    pub fn whole(&self) -> &CompiledField {
        self.field
    }

    /// The number of operations for one point, fused ones counted once; 0 if it is not known.
    pub fn size(&self) -> usize {
        self.sequence.map_or(0, Sequence::len)
    }

    /// Whether F may change along this axis in the cell.
    pub fn depends_on(&self, axis: usize) -> bool {
        self.sequence
            .is_none_or(|sequence| sequence.depends_on(axis))
    }

    /// F at every point; `points` has a column per axis.
    pub fn values(&mut self, points: &[&[f64]], values: &mut [f64]) {
        let Some((points, count)) = self.columns(points, values.len()) else {
            return;
        };
        let done = self.pruned_values(count).is_some_and(|sequence| {
            block::run(
                &sequence.tape,
                self.kernels,
                count,
                points,
                &self.scalars.double,
                &mut [&mut values[..count]],
            )
        });
        if !done {
            self.field.values(points, values);
        }
    }

    /// The same in single precision. Of points whose coordinates were rounded it is not certain
    /// that they are in the cell; there, and where two parts of the field differ by less than
    /// rounding, the result may be that of a neighbouring part.
    pub fn values_f32(&mut self, points: &[&[f32]], values: &mut [f32]) {
        let Some((points, count)) = self.columns(points, values.len()) else {
            return;
        };
        let values = &mut values[..count];
        let done = match self.pruned_values(count) {
            Some(sequence) => block::run(
                &sequence.tape,
                self.kernels,
                count,
                points,
                &self.scalars.single,
                &mut [values],
            ),
            None => self.field.values_f32(points, values),
        };
        if !done {
            self.values_of_rounded(points, values);
        }
    }

    /// The values of a field that is too large for blocks, rounded.
    fn values_of_rounded(&self, points: &[&[f32]], values: &mut [f32]) {
        let wide: Vec<Vec<f64>> = points
            .iter()
            .map(|column| column.iter().map(|&x| x.into()).collect())
            .collect();
        let wide: Vec<&[f64]> = wide.iter().map(|column| &column[..]).collect();
        let mut found = vec![0.0; values.len()];
        self.field.values(&wide, &mut found);
        for (value, found) in values.iter_mut().zip(found) {
            *value = found as f32;
        }
    }

    /// F and F_x at every point; `gradients` has a column per axis. The first call in a part of
    /// the subdivision prunes the steps of F_x for it.
    pub fn gradients(
        &mut self,
        points: &[&[f64]],
        values: &mut [f64],
        gradients: &mut [&mut [f64]],
    ) {
        let dimension = self.field.dimension();
        let lengths = gradients.iter().map(|column| column.len());
        let shortest = lengths.chain([values.len()]).min().unwrap_or(0);
        let Some((points, count)) = self.columns(points, shortest) else {
            return;
        };
        let kernels = self.kernels;
        let trunk = self.field.program().gradient_trunk();
        let pruned = match gradients.len() >= dimension && is_pruned(trunk, count) {
            true => self.pruned_gradients(),
            false => None,
        };
        let done = pruned.is_some_and(|(sequence, scalars)| {
            // At most four columns, so that nothing is allocated.
            let mut outputs: [&mut [f64]; 4] = Default::default();
            outputs[0] = &mut values[..count];
            for (output, column) in outputs[1..].iter_mut().zip(gradients.iter_mut()) {
                *output = &mut column[..count];
            }
            block::run(
                &sequence.tape,
                kernels,
                count,
                points,
                &scalars.double,
                &mut outputs[..=dimension],
            )
        });
        match done {
            true => self.correct_outside(points, &mut values[..count], gradients),
            false => self.field.gradients(points, values, gradients),
        }
    }

    /// Replaces what was found at points that are not in the cell by what the whole field is there.
    fn correct_outside(&self, points: &[&[f64]], values: &mut [f64], gradients: &mut [&mut [f64]]) {
        let Cell { low, high, .. } = self.cell;
        let is_outside = |&index: &usize| {
            let mut columns = points.iter().enumerate();
            columns
                .any(|(axis, column)| !(low[axis] <= column[index] && column[index] <= high[axis]))
        };
        let outside: Vec<usize> = (0..values.len()).filter(is_outside).collect();
        if outside.is_empty() {
            return;
        }
        let columns = points.iter();
        let columns = columns.map(|column| outside.iter().map(|&index| column[index]).collect());
        let columns: Vec<Vec<f64>> = columns.collect();
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let mut found = vec![vec![0.0; outside.len()]; 1 + points.len()];
        let mut found: Vec<&mut [f64]> = found.iter_mut().map(Vec::as_mut_slice).collect();
        let (own, slopes) = found.split_at_mut(1);
        self.field.gradients(&columns, own[0], slopes);
        for (place, &index) in outside.iter().enumerate() {
            values[index] = own[0][place];
            for (column, slope) in gradients.iter_mut().zip(&*slopes) {
                column[index] = slope[place];
            }
        }
    }

    /// F and F_x, pruned for the cell, with their scalars; none if they cannot be.
    pub(super) fn pruned_gradients(&mut self) -> Option<(&Sequence, &Scalars)> {
        let program = self.field.program();
        let trunk = program.gradient_trunk();
        if !trunk.is_runnable() {
            return None;
        }
        let nest = self.nest.get_or_insert_with(|| {
            let q = self.field.parameters();
            Box::new(Nest::new(trunk, q, program.choices()))
        });
        let decisions = |region: &_| self.pruned.decisions(region);
        Some(nest.within(trunk, self.pruned.path, decisions))
    }

    /// What computes F at so many points, if that is not the whole field.
    fn pruned_values(&self, count: usize) -> Option<&Sequence> {
        let trunk = self.field.program().value_trunk();
        self.sequence.filter(|_| is_pruned(trunk, count))
    }

    /// The columns that the field needs, if all are there, and how many points they have.
    fn columns<'p, T>(
        &self,
        points: &'p [&'p [T]],
        results: usize,
    ) -> Option<(&'p [&'p [T]], usize)> {
        let points = points.get(..self.field.dimension())?;
        let lengths = points.iter().map(|column| column.len());
        Some((points, lengths.chain([results]).min().unwrap_or(0)))
    }
}
