//! One function of a program: its steps, their tape, their machine code where it pays, and the
//! choice between them.

use super::block;
use super::jit::vector::{self, VectorCode, Vectorised};
use super::jit::{self, MachineCode};
use super::lower::{self, Lowered};
use super::tape::{self, Tape};
use super::{Kernels, Tier, interpret};
use crate::graph::{Graph, NodeId};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// From so many points in a batch on, blocks are at least as fast as machine code. Block after
/// block costs the same however few of its lanes are used; machine code costs by the point.
const BULK: usize = 24;

/// Kernels up to this length, in steps, are compiled the first time that they get few points: it
/// takes a few milliseconds.
const QUICKLY_COMPILED: usize = 1024;

/// Longer ones when they have got so many points in small batches. A step takes some 5 µs to
/// compile, and then saves about 1.5 ns at each point.
const WORTH_COMPILING: usize = 3000;

/// After so many points in large batches, vectors of 256 or 512 bits are compiled: a step takes
/// some 0.1 µs, and then saves about 0.02 ns at each point.
const WORTH_WIDE_VECTORS: usize = 1 << 12;

/// The points for whose savings a kernel of one step would pay for what compiling takes however
/// short the kernel is, some 8 µs.
const WORTH_A_MODULE: usize = 1 << 19;

/// Vectors wait for functions. Where these are more than one step in so many, blocks are level.
const STEPS_PER_FUNCTION: usize = 3;

/// After so many points in large batches, Cranelift compiles vectors of 128 bits, for some 10 µs
/// per step.
const WORTH_VECTORS: usize = 1 << 18;

/// The longest kernel that Cranelift compiles to vectors without being asked for, in steps: more
/// would be an interruption.
const LARGEST_VECTORS: usize = 1 << 14;

/// One function of a program, ready to run.
pub(super) struct Kernel {
    tier: Tier,
    lowered: Lowered,
    /// How many of its steps are functions, for which processors have no instruction.
    functions: usize,
    tape: Tape,
    machine_code: OnceLock<Option<Box<MachineCode>>>,
    vectors: OnceLock<Option<Box<VectorCode<f64>>>>,
    vectors_f32: OnceLock<Option<Box<VectorCode<f32>>>>,
    /// How many points came in batches that are too small for blocks.
    singles: AtomicUsize,
    /// How many points came in larger ones.
    bulk: AtomicUsize,
}

/// What runs a batch.
enum Executor<'a> {
    MachineCode(&'a MachineCode),
    Vector(&'a VectorCode<f64>),
    Block(Kernels),
    Interpreter,
}

impl Kernel {
    /// Lowers the roots. Nothing is compiled before it is used.
    pub(super) fn new(
        graph: &Graph,
        roots: &[NodeId],
        (dimension, parameters): (usize, usize),
        tier: Tier,
    ) -> Kernel {
        let make = match tier {
            // Blocks have kernels for what processors have no instructions for.
            Tier::Block(_) => lower::list,
            _ => lower::lower,
        };
        let lowered = make(graph, roots, dimension, parameters);
        Kernel {
            tier,
            tape: tape::assemble(&lowered),
            functions: jit::functions(&lowered),
            lowered,
            machine_code: OnceLock::new(),
            vectors: OnceLock::new(),
            vectors_f32: OnceLock::new(),
            singles: AtomicUsize::new(0),
            bulk: AtomicUsize::new(0),
        }
    }

    /// What runs a batch of so many points.
    pub(super) fn tier(&self, count: usize) -> Tier {
        match self.executor(count) {
            Executor::MachineCode(_) => Tier::MachineCode,
            Executor::Vector(_) => Tier::Vector(self.tier.kernels()),
            Executor::Block(kernels) => Tier::Block(kernels),
            Executor::Interpreter => Tier::Interpreter,
        }
    }

    /// What runs a batch of so many points. The bits do not depend on it.
    fn executor(&self, count: usize) -> Executor<'_> {
        let is_few = count < BULK;
        let compiled = match self.tier {
            Tier::MachineCode => self.machine_code().map(Executor::MachineCode),
            Tier::Vector(_) => self.vectors(&self.vectors).map(Executor::Vector),
            Tier::Automatic if is_few && self.is_worth_compiling(count) => {
                self.machine_code().map(Executor::MachineCode)
            }
            Tier::Automatic if !is_few && self.are_vectors_worth_it(count) => {
                self.vectors(&self.vectors).map(Executor::Vector)
            }
            Tier::Automatic | Tier::Block(_) => None,
            Tier::Interpreter => Some(Executor::Interpreter),
        };
        compiled.unwrap_or(Executor::Block(self.tier.kernels()))
    }

    /// The kernel compiled for single points. A refusal is remembered, and said; see
    /// [`jit::refusal`].
    fn machine_code(&self) -> Option<&MachineCode> {
        let new = || jit::compile(&self.lowered).ok().map(Box::new);
        self.machine_code.get_or_init(new).as_deref()
    }

    /// The kernel compiled to vectors of this type, which are kept in `place`.
    fn vectors<'a, T: Vectorised>(
        &self,
        place: &'a OnceLock<Option<Box<VectorCode<T>>>>,
    ) -> Option<&'a VectorCode<T>> {
        let kernels = self.tier.kernels();
        let new = || vector::compile(&self.lowered, kernels).ok().map(Box::new);
        place.get_or_init(new).as_deref()
    }

    /// Whether compiling to vectors pays for large batches, of which this one has `count` points.
    fn are_vectors_worth_it(&self, count: usize) -> bool {
        let steps = self.lowered.steps.len();
        let worth = match vector::are_wide(self.tier.kernels()) {
            true if self.functions * STEPS_PER_FUNCTION > steps => return false,
            true => WORTH_WIDE_VECTORS + WORTH_A_MODULE / steps.max(1),
            false if steps > LARGEST_VECTORS => return false,
            false => WORTH_VECTORS,
        };
        self.bulk.fetch_add(count, Ordering::Relaxed) >= worth
    }

    /// Whether compiling pays for small batches, of which this one has `count` points.
    fn is_worth_compiling(&self, count: usize) -> bool {
        let is_short = self.lowered.steps.len() <= QUICKLY_COMPILED;
        is_short || self.singles.fetch_add(count, Ordering::Relaxed) >= WORTH_COMPILING
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
        let done = match self.executor(count) {
            Executor::MachineCode(code) => code.run(count, points, uniforms, outputs),
            Executor::Vector(code) => code.run(count, points, uniforms, outputs),
            Executor::Block(kernels) => self.run_blocks(kernels, count, points, uniforms, outputs),
            Executor::Interpreter => false,
        };
        if !done {
            self.interpret(count, points, uniforms, outputs);
        }
    }

    /// All outputs in f32 at as many points as the shortest column has; a missing column has
    /// none. `uniforms` are those of [`Kernel::uniforms`], rounded. Returns false, with the
    /// outputs as they were, if the tape is too large to run.
    pub(super) fn run_f32(
        &self,
        points: &[&[f32]],
        uniforms: &[f32],
        outputs: &mut [&mut [f32]],
    ) -> bool {
        let count = self.shortest(points, outputs);
        let in_vectors = match self.tier {
            Tier::Automatic => count >= BULK && self.are_vectors_worth_it(count),
            tier => matches!(tier, Tier::Vector(_)),
        };
        if in_vectors
            && let Some(code) = self.vectors(&self.vectors_f32)
            && code.run(count, points, uniforms, outputs)
        {
            return true;
        }
        self.run_blocks(self.tier.kernels(), count, points, uniforms, outputs)
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
