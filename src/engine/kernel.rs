//! One function of a program: its steps, their tape, and their machine code where there is some.

use super::block::{self, Kernels};
use super::jit::{self, MachineCode};
use super::lower::{self, Lowered};
use super::tape::{self, Tape};
use super::{Backend, interpret};
use crate::graph::{Graph, NodeId};

/// What computes some roots of a graph, ready to run.
pub(super) struct Kernel {
    lowered: Lowered,
    tape: Tape,
    executor: Executor,
}

/// What executes the steps.
enum Executor {
    MachineCode(Box<MachineCode>),
    Block(Kernels),
    Interpreter,
}

impl Kernel {
    /// Lowers the roots and compiles them, if that is wanted and possible; where machine code is
    /// refused, whatever the reason, the interpreter gives the same bits.
    pub(super) fn new(
        graph: &Graph,
        roots: &[NodeId],
        (dimension, parameters): (usize, usize),
        backend: Backend,
    ) -> Kernel {
        let make = match backend {
            // Blocks have kernels for what processors have no instructions for.
            Backend::Block(_) => lower::list,
            Backend::MachineCode | Backend::Interpreter => lower::lower,
        };
        let lowered = make(graph, roots, dimension, parameters);
        let executor = match backend {
            Backend::MachineCode => match jit::compile(&lowered) {
                Ok(code) => Executor::MachineCode(Box::new(code)),
                Err(_) => Executor::Interpreter,
            },
            Backend::Block(kernels) => Executor::Block(kernels.or_narrower()),
            Backend::Interpreter => Executor::Interpreter,
        };
        Kernel {
            tape: tape::assemble(&lowered),
            lowered,
            executor,
        }
    }

    /// What runs.
    pub(super) fn backend(&self) -> Backend {
        match self.executor {
            Executor::MachineCode(_) => Backend::MachineCode,
            Executor::Block(kernels) => Backend::Block(kernels),
            Executor::Interpreter => Backend::Interpreter,
        }
    }

    /// What [`Kernel::run`] needs to know of q: q itself and what depends on it alone.
    pub(super) fn uniforms(&self, q: &[f64]) -> Vec<f64> {
        let mut uniforms = interpret::uniforms(&self.lowered, q);
        uniforms.extend(&self.tape.constants);
        uniforms
    }

    /// All outputs at as many points as the shortest column has; a missing column has none.
    pub(super) fn run(&self, points: &[&[f64]], uniforms: &[f64], outputs: &mut [&mut [f64]]) {
        let count = self.shortest(points, outputs);
        let done = match &self.executor {
            Executor::MachineCode(code) => code.run(count, points, uniforms, outputs),
            Executor::Block(kernels) => self.run_blocks(*kernels, count, points, uniforms, outputs),
            Executor::Interpreter => false,
        };
        if !done {
            self.interpret(count, points, uniforms, outputs);
        }
    }

    /// All outputs in f32 at as many points as the shortest column has; a missing column has
    /// none. Returns false, with the outputs as they were, if the tape is too large to run.
    pub(super) fn run_f32(
        &self,
        points: &[&[f32]],
        uniforms: &[f64],
        outputs: &mut [&mut [f32]],
    ) -> bool {
        let kernels = match self.executor {
            Executor::Block(kernels) => kernels,
            Executor::MachineCode(_) | Executor::Interpreter => Kernels::widest(),
        };
        let scalars: Vec<f32> = uniforms.iter().map(|&uniform| uniform as f32).collect();
        let count = self.shortest(points, outputs);
        self.run_blocks(kernels, count, points, &scalars, outputs)
    }

    /// The first `count` points by the tape; false if it is too large.
    fn run_blocks<T: block::Float>(
        &self,
        kernels: Kernels,
        count: usize,
        points: &[&[T]],
        scalars: &[T],
        outputs: &mut [&mut [T]],
    ) -> bool {
        let (dimension, results) = (self.lowered.dimension, self.lowered.outputs.len());
        if count == 0 {
            return true;
        }
        block::run(
            &self.tape,
            kernels,
            count,
            &points[..dimension],
            scalars,
            &mut outputs[..results],
        )
    }

    /// The number of points that all needed columns have.
    fn shortest<T>(&self, points: &[&[T]], outputs: &[&mut [T]]) -> usize {
        let (coordinates, results) = (self.lowered.dimension, self.lowered.outputs.len());
        if points.len() < coordinates || outputs.len() < results {
            return 0;
        }
        let coordinates = points[..coordinates].iter().map(|column| column.len());
        let results = outputs[..results].iter().map(|column| column.len());
        coordinates.chain(results).min().unwrap_or(0)
    }

    /// The same by the interpreter.
    fn interpret(
        &self,
        count: usize,
        points: &[&[f64]],
        uniforms: &[f64],
        outputs: &mut [&mut [f64]],
    ) {
        let mut registers = Vec::with_capacity(self.lowered.steps.len());
        for index in 0..count {
            let mut point = [0.0; 3];
            let columns = points.iter().take(self.lowered.dimension);
            for (coordinate, column) in point.iter_mut().zip(columns) {
                *coordinate = column[index];
            }
            interpret::evaluate(
                &self.lowered,
                &point,
                uniforms,
                &mut registers,
                |output, value| {
                    outputs[output][index] = value;
                },
            );
        }
    }

    /// The kernel in Cranelift's intermediate representation.
    pub(super) fn clif(&self, name: &str) -> String {
        jit::text(name, &self.lowered)
    }
}
