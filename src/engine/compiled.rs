//! A program with values for its parameters: what samplers and polygonizers evaluate.

use super::block::Scalars;
use super::kernel::Kernel;
use super::slopes::SlopeScalars;
use super::{Field, Program};
use crate::graph::derive;
use crate::graph::interval::{Enclosure, Interval};
use crate::graph::{NodeId, Op};
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
    /// The same rounded to f32.
    values_f32: OnceLock<Vec<f32>>,
    gradients_f32: OnceLock<Vec<f32>>,
    hessians: OnceLock<Vec<f64>>,
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
            values_f32: OnceLock::new(),
            gradients_f32: OnceLock::new(),
            hessians: OnceLock::new(),
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
        let enclosures = self.program.enclosures();
        let scalars = self
            .enclosures
            .get_or_init(|| enclosures.scalars(&self.q, &[]));
        enclosures.run(self.program.chosen_tier(), sides, scalars, &mut [values]);
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
            slopes.run(
                self.program.chosen_tier(),
                sides,
                scalars,
                values,
                gradients,
            );
        }
    }

    /// The first derivatives of F along the axes, as fields of their own at the same q, compiled in no
    /// time: see [`Program::derived`].
    pub fn derivatives(&self) -> Vec<CompiledField> {
        let dimension = self.program.dimension();
        let along = |axis: usize| {
            let program = self.program.derived(dimension, |graph, roots, _| {
                let variables: Vec<NodeId> =
                    (0..dimension).map(|axis| graph.coordinate(axis)).collect();
                let gradient = roots
                    .first()
                    .map(|&root| derive::reverse(graph, root, &variables));
                gradient.into_iter().flatten().skip(axis).take(1).collect()
            });
            let places = program.parameters().iter();
            let q = places
                .filter_map(|&place| self.q.get(place as usize).copied())
                .collect();
            CompiledField::new(Arc::new(program), q)
        };
        (0..dimension).map(along).collect()
    }

    /// F less a number: where it is 0, F is that number. See [`Program::derived`].
    pub fn minus(&self, number: f64) -> CompiledField {
        let dimension = self.program.dimension();
        let program = self.program.derived(dimension, |graph, roots, _| {
            let number = graph.constant(number);
            let roots = roots.iter();
            roots
                .map(|&root| graph.apply(Op::Subtract, &[root, number]))
                .collect()
        });
        CompiledField::new(Arc::new(program), self.q.clone())
    }

    /// F at a batch of points in single precision; see [`Program::evaluate_batch_f32`], whose
    /// result this has and which this is faster than where it is called often at one q.
    pub fn values_f32(&self, points: &[&[f32]], values: &mut [f32]) -> bool {
        let kernel = self.program.values();
        let uniforms = self
            .values_f32
            .get_or_init(|| narrow(self.uniforms(kernel, &self.values)));
        kernel.run_f32(points, uniforms, &mut [values])
    }

    /// F and F_x at a batch of points in single precision, in the columns `values` and
    /// `gradients` (one per axis). Like [`CompiledField::values_f32`] otherwise.
    pub fn gradients_f32(
        &self,
        points: &[&[f32]],
        values: &mut [f32],
        gradients: &mut [&mut [f32]],
    ) -> bool {
        let kernel = self.program.gradients();
        let uniforms = self
            .gradients_f32
            .get_or_init(|| narrow(self.uniforms(kernel, &self.gradients)));
        with_columns(values, gradients, |outputs| {
            kernel.run_f32(points, uniforms, outputs)
        })
    }

    /// F, F_x and F_xx at every point; `hessians` has one slice for each entry of the upper
    /// triangle, row by row: in R3 xx, xy, xz, yy, yz, zz.
    pub fn hessians(
        &self,
        points: &[&[f64]],
        values: &mut [f64],
        gradients: &mut [&mut [f64]],
        hessians: &mut [&mut [f64]],
    ) {
        let kernel = self.program.hessians();
        let uniforms = self.uniforms(kernel, &self.hessians);
        let columns = std::iter::once(values).chain(shorter(gradients));
        let mut outputs: Vec<&mut [f64]> = columns.chain(shorter(hessians)).collect();
        kernel.run(points, uniforms, &mut outputs);
    }

    /// The kernel's uniforms at the present q.
    fn uniforms<'a>(&self, kernel: &Kernel, place: &'a OnceLock<Vec<f64>>) -> &'a [f64] {
        place.get_or_init(|| kernel.uniforms(&self.q))
    }
}

impl Field for CompiledField {
    fn compiled(&self) -> Option<&CompiledField> {
        Some(self)
    }

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
        with_columns(values, gradients, |outputs| {
            kernel.run(points, uniforms, outputs);
        });
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

/// Hands F's column and those of F_x on as one list: at most four, so that single points need no
/// allocation.
fn with_columns<T, R>(
    values: &mut [T],
    gradients: &mut [&mut [T]],
    work: impl FnOnce(&mut [&mut [T]]) -> R,
) -> R {
    let mut outputs: [&mut [T]; 4] = Default::default();
    let count = 1 + gradients.len().min(3);
    let columns = std::iter::once(values).chain(shorter(gradients));
    for (output, column) in outputs.iter_mut().zip(columns) {
        *output = column;
    }
    work(&mut outputs[..count])
}

/// The uniforms of a kernel for f32.
fn narrow(uniforms: &[f64]) -> Vec<f32> {
    uniforms.iter().map(|&uniform| uniform as f32).collect()
}

/// The columns, borrowed for a shorter time.
fn shorter<'a, T>(columns: &'a mut [&mut [T]]) -> impl Iterator<Item = &'a mut [T]> {
    columns.iter_mut().map(|column| &mut **column)
}
