//! Enclosures of boxes, one or many: a tape over intervals.
//!
//! The steps are those of the graph itself, in which every operation keeps its own interval rule;
//! lowered ones would enclose less tightly. Boxes are taken 64 at a time or, if there are few, one
//! by one by [`super::single`]; the bits are the same. A box alone is left to machine code
//! ([`crate::engine::jit::bounds`]) where that suits, which is faster and tighter.

use super::bounds::{Bounds, BoundsBlock};
use super::number::{LANES, Number, lend};
use super::single::{self, Line};
use super::{Kernels, LARGEST_MEMORY, dispatch, run_block};
use crate::engine::Tier;
use crate::engine::jit::bounds::{self, BoxCode, BoxNumber};
use crate::engine::lower::{self, Lowered, Operand};
use crate::engine::tape::{self, Tape};
use crate::graph::interval::Enclosure;
use crate::graph::{Graph, Interval, NodeId};
use std::sync::OnceLock;

/// So many boxes take longer one by one than as a block.
const FEW: usize = 8;

/// The longest list of steps that is compiled for single boxes without being asked for; it takes
/// some 20 µs a step.
const QUICKLY_COMPILED: usize = 512;

/// What encloses some roots of a graph.
pub(in crate::engine) struct Enclosures {
    lowered: Lowered,
    tape: Tape,
    /// The tape for one box.
    lines: Vec<Line>,
    /// The scalars, if there are no parameters.
    fixed: Option<Scalars>,
    /// Machine code for one box.
    code: OnceLock<Option<Box<BoxCode>>>,
}

/// What is the same for all boxes: the parameters, what depends on them alone, and constants.
pub(in crate::engine) struct Scalars {
    bounds: Vec<Bounds>,
    /// The same for machine code.
    numbers: Vec<BoxNumber>,
}

impl Enclosures {
    /// For these roots, as functions of so many coordinates and parameters.
    pub(in crate::engine) fn new(
        graph: &Graph,
        roots: &[NodeId],
        (dimension, parameters): (usize, usize),
    ) -> Enclosures {
        let lowered = lower::list(graph, roots, dimension, parameters);
        let tape = tape::assemble(&lowered);
        let fixed = (parameters == 0)
            .then(|| Scalars::new(uniforms(&lowered, std::iter::empty()), &tape.constants));
        Enclosures {
            lines: single::lines(&tape),
            lowered,
            tape,
            fixed,
            code: OnceLock::new(),
        }
    }

    /// With these values of the first parameters and ranges of those that follow; what is missing
    /// is undefined.
    pub(in crate::engine) fn scalars(&self, q: &[f64], ranges: &[Enclosure]) -> Scalars {
        let numbers = q.iter().map(|&number| Enclosure::of_number(number));
        let parameters = numbers.chain(ranges.iter().copied());
        Scalars::new(uniforms(&self.lowered, parameters), &self.tape.constants)
    }

    /// All outputs over one box, by machine code; false if it is not for this tier or these steps.
    /// Which it is depends on them alone, so that the same box is always enclosed in the same way.
    pub(in crate::engine) fn run_alone(
        &self,
        tier: Tier,
        sides: &[Interval],
        scalars: &Scalars,
        outputs: &mut [Enclosure],
    ) -> bool {
        let is_meant = match tier {
            Tier::Automatic => self.lowered.steps.len() <= QUICKLY_COMPILED,
            tier => tier == Tier::MachineCode,
        };
        if !is_meant || !bounds::suits(&self.lowered) {
            return false;
        }
        let new = || bounds::compile(&self.lowered).ok().map(Box::new);
        let code = self.code.get_or_init(new);
        code.as_ref()
            .is_some_and(|code| code.run(sides, &scalars.numbers, outputs))
    }

    /// All outputs over as many boxes as the shortest column has; a missing column has none.
    /// Returns false, with the outputs as they were,
    /// if the tape is too large to run.
    pub(in crate::engine) fn run(
        &self,
        kernels: Kernels,
        sides: &[&[Interval]],
        scalars: &Scalars,
        outputs: &mut [&mut [Enclosure]],
    ) -> bool {
        let (dimension, results) = (self.lowered.dimension, self.lowered.outputs.len());
        if self.tape.registers * size_of::<BoundsBlock>() > LARGEST_MEMORY {
            return false;
        }
        if sides.len() < dimension || outputs.len() < results {
            return true;
        }
        let (sides, outputs) = (&sides[..dimension], &mut outputs[..results]);
        let lengths = sides.iter().map(|column| column.len());
        let lengths = lengths.chain(outputs.iter().map(|column| column.len()));
        let count = lengths.min().unwrap_or(0);
        let rest = count % LANES;
        let in_blocks = if rest <= FEW { count - rest } else { count };
        if in_blocks > 0 {
            self.run_blocks(kernels, in_blocks, sides, scalars, outputs);
        }
        if in_blocks < count {
            self.run_single(kernels, in_blocks..count, sides, scalars, outputs);
        }
        true
    }

    /// The first `count` boxes, in blocks. Lanes that are left over repeat the last box: they cost
    /// what it costs.
    fn run_blocks(
        &self,
        kernels: Kernels,
        count: usize,
        sides: &[&[Interval]],
        scalars: &Scalars,
        outputs: &mut [&mut [Enclosure]],
    ) {
        let memory = self.tape.registers + sides.len() + outputs.len();
        Bounds::with_memory(memory, |memory| {
            let (registers, columns) = memory.split_at_mut(self.tape.registers);
            let (points, found) = columns.split_at_mut(sides.len());
            for start in (0..count).step_by(LANES) {
                let lanes = LANES.min(count - start);
                for (block, column) in points.iter_mut().zip(sides) {
                    let column = &column[start..start + lanes];
                    for lane in 0..LANES {
                        let side = column[lane.min(lanes - 1)];
                        Bounds::set(block, lane, Bounds::of_side(side));
                    }
                }
                run_block(
                    &self.tape,
                    kernels,
                    points,
                    &scalars.bounds,
                    registers,
                    found,
                );
                for (block, column) in found.iter().zip(outputs.iter_mut()) {
                    for (lane, enclosure) in column[start..start + lanes].iter_mut().enumerate() {
                        *enclosure = Bounds::get(block, lane).into();
                    }
                }
            }
        });
    }

    /// These boxes, one by one.
    fn run_single(
        &self,
        kernels: Kernels,
        boxes: std::ops::Range<usize>,
        sides: &[&[Interval]],
        scalars: &Scalars,
        outputs: &mut [&mut [Enclosure]],
    ) {
        thread_local! {
            static KEPT: std::cell::Cell<Vec<Bounds>> = const { std::cell::Cell::new(Vec::new()) };
        }
        let memory = single::memory(&self.tape, outputs.len());
        KEPT.with(|kept| {
            lend(kept, memory, Bounds::of_side(Interval::EMPTY), |memory| {
                for index in boxes {
                    let coordinates = single::coordinates(&self.tape, memory);
                    for (coordinate, column) in coordinates.iter_mut().zip(sides) {
                        *coordinate = Bounds::of_side(column[index]);
                    }
                    dispatch::run_single(kernels, &self.lines, &scalars.bounds, memory);
                    let found = single::outputs(&self.tape, memory);
                    for (&bounds, column) in found.iter().zip(outputs.iter_mut()) {
                        column[index] = bounds.into();
                    }
                }
            });
        });
    }

    /// The scalars, if they do not depend on any parameter.
    pub(in crate::engine) fn fixed_scalars(&self) -> Option<&Scalars> {
        self.fixed.as_ref()
    }
}

impl Scalars {
    fn new(mut uniforms: Vec<Enclosure>, constants: &[f64]) -> Scalars {
        let numbers = uniforms.iter().map(|&uniform| uniform.into()).collect();
        uniforms.extend(constants.iter().map(|&number| Enclosure::of_number(number)));
        Scalars {
            bounds: uniforms.into_iter().map(Bounds::from).collect(),
            numbers,
        }
    }
}

/// The bounds of what is the same for all boxes: parameters, what depends on them alone, and
/// constants. A missing parameter is NaN.
pub(in crate::engine) fn scalars(lowered: &Lowered, q: &[f64], constants: &[f64]) -> Vec<Bounds> {
    let numbers = q.iter().map(|&number| Enclosure::of_number(number));
    Scalars::new(uniforms(lowered, numbers), constants).bounds
}

/// Parameters and what depends on them alone.
fn uniforms(lowered: &Lowered, parameters: impl Iterator<Item = Enclosure>) -> Vec<Enclosure> {
    let mut uniforms: Vec<Enclosure> = parameters.take(lowered.parameters).collect();
    uniforms.resize(lowered.parameters, Enclosure::of_number(f64::NAN));
    for step in &lowered.uniform_steps {
        let operands = step.operands.map(|operand| match operand {
            Operand::Uniform(index) => uniforms[index as usize],
            Operand::Constant(number) => Enclosure::of_number(number),
            // Neither occurs in what depends on q alone.
            Operand::Coordinate(_) | Operand::Register(_) => Enclosure::of_number(f64::NAN),
        });
        let rule = step.operation.operation().interval;
        uniforms.push(rule(&operands[..step.operands().len()]));
    }
    uniforms
}
