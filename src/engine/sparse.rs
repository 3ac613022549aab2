//! Which parameters matter in a box, and derivatives by those alone.
//!
//! Most parameters of a large field belong to a part of it that is not there: F_q is identically
//! 0 for them. An interval pass over the steps of F, F_x and F_q finds most of these, since an
//! exact 0 absorbs whatever it is multiplied with in the chain rule, and pruning leaves the steps
//! of the others.

use super::block;
use super::prune::{Scalars, Sequence, prune, scalar_place};
use super::{CompiledField, Field};
use glam::DVec3;

/// The derivatives of a field in a box, by the parameters that can matter there. Made by
/// [`CompiledField::sparse_parameters`].
pub struct SparseParameters<'a> {
    field: &'a CompiledField,
    places: Vec<usize>,
    /// None if the field is too large for blocks.
    pruned: Option<(Sequence, Scalars)>,
}

impl CompiledField {
    /// Finds the parameters that matter in the box: F_q is exactly 0 at all its points for the
    /// others. (Not all that are 0 there are found; where F may be undefined none is.) Takes one
    /// pass over the steps of F, F_x and F_q; evaluation then costs what the parameters that
    /// matter cost.
    pub fn sparse_parameters(&self, low: DVec3, high: DVec3) -> SparseParameters<'_> {
        let program = self.program();
        let trunk = program.parameter_trunk();
        let parameters = self.parameters().len();
        if !trunk.is_runnable() {
            return SparseParameters {
                field: self,
                places: (0..parameters).collect(),
                pruned: None,
            };
        }
        let kernels = program.block_kernels();
        let (pruned, scalars) = prune(trunk, self.parameters(), kernels, [low, high]);
        let sequence = pruned.as_ref().unwrap_or(trunk.sequence());
        let first = 1 + program.dimension();
        let is_zero =
            |operand: u32| scalar_place(operand).is_some_and(|place| scalars.double[place] == 0.0);
        let places: Vec<usize> = (0..parameters)
            .filter(|place| !is_zero(sequence.outputs[first + place]))
            .collect();
        let outputs = (0..first).chain(places.iter().map(|place| first + place));
        let pruned = Some((sequence.with_outputs(outputs), scalars));
        SparseParameters {
            field: self,
            places,
            pruned,
        }
    }
}

impl SparseParameters<'_> {
    /// The places in q of the parameters that can matter, ascending.
    pub fn places(&self) -> &[usize] {
        &self.places
    }

    /// The number of operations for one point, fused ones counted once; 0 if it is not known.
    pub fn size(&self) -> usize {
        self.pruned
            .as_ref()
            .map_or(0, |(sequence, _)| sequence.len())
    }

    /// F, F_x and the components of F_q that can matter, in the order of
    /// [`SparseParameters::places`], at points of the box: the bits of
    /// [`Field::parameter_gradients`], which gives 0 for the other parameters. As many points are
    /// evaluated as the shortest column has.
    pub fn parameter_gradients(
        &self,
        points: &[&[f64]],
        values: &mut [f64],
        gradients: &mut [&mut [f64]],
        parameter_gradients: &mut [&mut [f64]],
    ) {
        let dimension = self.field.dimension();
        if points.len() < dimension
            || gradients.len() < dimension
            || parameter_gradients.len() < self.places.len()
        {
            return;
        }
        let mut outputs: Vec<&mut [f64]> = vec![values];
        outputs.extend(
            gradients[..dimension]
                .iter_mut()
                .map(|column| &mut **column),
        );
        let wanted = parameter_gradients[..self.places.len()].iter_mut();
        outputs.extend(wanted.map(|column| &mut **column));
        let points = &points[..dimension];
        let lengths = points.iter().map(|column| column.len());
        let count = lengths
            .chain(outputs.iter().map(|column| column.len()))
            .min()
            .unwrap_or(0);
        let done = match &self.pruned {
            Some((sequence, scalars)) => block::run(
                &sequence.tape,
                self.field.program().block_kernels(),
                count,
                points,
                &scalars.double,
                &mut outputs,
            ),
            None => false,
        };
        if !done {
            // Here every parameter matters.
            let (values, rest) = outputs.split_at_mut(1);
            let (gradients, parameters) = rest.split_at_mut(dimension);
            self.field
                .parameter_gradients(points, values[0], gradients, parameters);
        }
    }
}
