//! One function of a program: its steps, and its machine code where there is some.

use super::jit::{self, MachineCode};
use super::lower::{self, Lowered};
use super::{Backend, interpret};
use crate::graph::{Graph, NodeId};

/// What computes some roots of a graph, ready to run.
pub(super) struct Kernel {
    lowered: Lowered,
    /// `None` to interpret.
    code: Option<MachineCode>,
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
        let lowered = lower::lower(graph, roots, dimension, parameters);
        let code = match backend {
            Backend::MachineCode => jit::compile(&lowered).ok(),
            Backend::Interpreter => None,
        };
        Kernel { lowered, code }
    }

    /// What runs.
    pub(super) fn backend(&self) -> Backend {
        match self.code {
            Some(_) => Backend::MachineCode,
            None => Backend::Interpreter,
        }
    }

    /// What [`Kernel::run`] needs to know of q: q itself and what depends on it alone.
    pub(super) fn uniforms(&self, q: &[f64]) -> Vec<f64> {
        interpret::uniforms(&self.lowered, q)
    }

    /// All outputs at as many points as the shortest column has; a missing column has none.
    pub(super) fn run(&self, points: &[&[f64]], uniforms: &[f64], outputs: &mut [&mut [f64]]) {
        let count = self.shortest(points, outputs);
        let done = match &self.code {
            Some(code) => code.run(count, points, uniforms, outputs),
            None => false,
        };
        if !done {
            self.interpret(count, points, uniforms, outputs);
        }
    }

    /// The number of points that all needed columns have.
    fn shortest(&self, points: &[&[f64]], outputs: &[&mut [f64]]) -> usize {
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
