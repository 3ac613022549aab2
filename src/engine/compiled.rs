//! A program with values for its parameters: what samplers and polygonizers evaluate.

use super::block::Scalars;
use super::kernel::Kernel;
use super::slopes::SlopeScalars;
use super::{Field, Program};
use crate::graph::interval::{Enclosure, Interval};
use std::sync::{Arc, OnceLock};

/// A program of one root F with its q: a [`Field`].
///
/// In a batch whose columns differ in length, as many points are evaluated as the shortest one
/// has, like `zip`; a missing column counts as empty. A batch of a few hundred points is best:
/// its columns stay in the cache until the caller has used them.
///
/// Cheap to make: what depends on q alone is computed once, when a kernel is first used.
pub struct CompiledField {
    program: Arc<Program>,
    q: Vec<f64>,
    /// The kernels' uniforms at this q.
    values: OnceLock<Vec<f64>>,
    gradients: OnceLock<Vec<f64>>,
    parameter_gradients: OnceLock<Vec<f64>>,
    /// The same for enclosures of F, and of F and F_x.
    enclosures: OnceLock<Scalars>,
    slopes: OnceLock<SlopeScalars>,
}

impl CompiledField {
    /// The program at this q, in the order of [`Program::parameters`]; what is missing is NaN.
    /// The program must have one root. With none or several there is no F: batches stay as they
    /// were.
    pub fn new(program: Arc<Program>, mut q: Vec<f64>) -> CompiledField {
        q.resize(program.parameters().len(), f64::NAN);
        CompiledField {
            program,
            q,
            values: OnceLock::new(),
            gradients: OnceLock::new(),
            parameter_gradients: OnceLock::new(),
            enclosures: OnceLock::new(),
            slopes: OnceLock::new(),
        }
    }

    /// The program, which other fields may share.
    pub fn program(&self) -> &Arc<Program> {
        &self.program
    }

    /// Encloses F over boxes; `sides` has a column per axis. See [`Program::enclose_batch`].
    pub fn enclose(&self, sides: &[&[Interval]], values: &mut [Enclosure]) {
        let new = || self.program.enclosures().scalars(&self.q, &[]);
        let scalars = self.enclosures.get_or_init(new);
        self.program
            .enclose_with(scalars, sides, &self.q, &mut [values]);
    }

    /// Encloses F and F_x over boxes. See [`Program::enclose_gradient_batch`].
    pub fn enclose_gradients(
        &self,
        sides: &[&[Interval]],
        values: &mut [Enclosure],
        gradients: &mut [&mut [Interval]],
    ) {
        if let Some(slopes) = self.program.slopes() {
            let scalars = self.slopes.get_or_init(|| slopes.scalars(&self.q));
            self.program
                .enclose_gradient_with(scalars, sides, &self.q, values, gradients);
        }
    }

    /// The kernel's uniforms at the present q.
    fn uniforms<'a>(&self, kernel: &Kernel, place: &'a OnceLock<Vec<f64>>) -> &'a [f64] {
        place.get_or_init(|| kernel.uniforms(&self.q))
    }
}

impl Field for CompiledField {
    fn dimension(&self) -> usize {
        self.program.dimension()
    }

    fn parameters(&self) -> &[f64] {
        &self.q
    }

    fn values(&self, points: &[&[f64]], values: &mut [f64]) {
        let kernel = self.program.values();
        let uniforms = self.uniforms(kernel, &self.values);
        kernel.run(points, uniforms, &mut [values]);
    }

    fn gradients(&self, points: &[&[f64]], values: &mut [f64], gradients: &mut [&mut [f64]]) {
        let kernel = self.program.gradients();
        let uniforms = self.uniforms(kernel, &self.gradients);
        // At most four columns, so that single points need no allocation.
        let mut outputs: [&mut [f64]; 4] = Default::default();
        let count = 1 + gradients.len().min(3);
        let columns = std::iter::once(values).chain(shorter(gradients));
        for (output, column) in outputs.iter_mut().zip(columns) {
            *output = column;
        }
        kernel.run(points, uniforms, &mut outputs[..count]);
    }

    fn parameter_gradients(
        &self,
        points: &[&[f64]],
        values: &mut [f64],
        gradients: &mut [&mut [f64]],
        parameter_gradients: &mut [&mut [f64]],
    ) {
        let kernel = self.program.parameter_gradients();
        let uniforms = self.uniforms(kernel, &self.parameter_gradients);
        let columns = std::iter::once(values).chain(shorter(gradients));
        let mut outputs: Vec<&mut [f64]> = columns.chain(shorter(parameter_gradients)).collect();
        kernel.run(points, uniforms, &mut outputs);
    }
}

/// The columns, borrowed for a shorter time.
fn shorter<'a>(columns: &'a mut [&mut [f64]]) -> impl Iterator<Item = &'a mut [f64]> {
    columns.iter_mut().map(|column| &mut **column)
}
