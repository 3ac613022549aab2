//! Enclosures of boxes, one or many: a tape over intervals.
//!
//! The steps are those of the graph itself, in which every operation keeps its own interval rule;
//! lowered ones would enclose less tightly. Boxes are taken 64 at a time in blocks; a box alone
//! takes the table's interval rules or, if there are many such, machine code
//! ([`crate::engine::jit::bounds`]), which has the same bits: tighter ones than blocks.

use super::bounds::{Bounds, BoundsBlock};
use super::choices::Pass;
use super::number::{LANES, Number, lend};
use super::{LARGEST_MEMORY, dispatch};
use crate::engine::Tier;
use crate::engine::jit::bounds::{self, BoxCode, BoxNumber};
use crate::engine::lower::{self, Lowered, Operand};
use crate::engine::tape::{self, Tape};
use crate::graph::interval::Enclosure;
use crate::graph::{Graph, Interval, NodeId};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// After so many single boxes they are compiled: the code takes some 20 µs a step to make and
/// then saves about 25 ns a step.
const WORTH_COMPILING: usize = 800;

/// The longest list of steps that is compiled without being asked for: more would be an
/// interruption.
const LARGEST_CODE: usize = 1 << 14;

/// What encloses some roots of a graph.
pub(in crate::engine) struct Enclosures {
    lowered: Lowered,
    tape: Tape,
    /// The scalars, if there are no parameters.
    fixed: Option<Scalars>,
    /// Machine code for one box.
    code: OnceLock<Option<Box<BoxCode>>>,
    /// How many boxes came alone.
    singles: AtomicUsize,
}

/// What is the same for all boxes: the parameters, what depends on them alone, and constants.
pub(in crate::engine) struct Scalars {
    bounds: Vec<Bounds>,
    /// The same but for constants, for the table's rules.
    uniforms: Vec<Enclosure>,
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
            lowered,
            tape,
            fixed,
            code: OnceLock::new(),
            singles: AtomicUsize::new(0),
        }
    }

    /// With these values of the first parameters and ranges of those that follow; what is missing
    /// is undefined.
    pub(in crate::engine) fn scalars(&self, q: &[f64], ranges: &[Enclosure]) -> Scalars {
        let numbers = q.iter().map(|&number| Enclosure::of_number(number));
        let parameters = numbers.chain(ranges.iter().copied());
        Scalars::new(uniforms(&self.lowered, parameters), &self.tape.constants)
    }

    /// All outputs over as many boxes as the shortest column has; a missing column has none.
    /// One box alone, unless blocks are asked for, gets the tightest ends, by machine code or by the
    /// table's rules; so do many of a tape that is too large to run.
    pub(in crate::engine) fn run(
        &self,
        tier: Tier,
        sides: &[&[Interval]],
        scalars: &Scalars,
        outputs: &mut [&mut [Enclosure]],
    ) {
        let (dimension, results) = (self.lowered.dimension, self.lowered.outputs.len());
        if sides.len() < dimension || outputs.len() < results {
            return;
        }
        let (sides, outputs) = (&sides[..dimension], &mut outputs[..results]);
        let lengths = sides.iter().map(|column| column.len());
        let lengths = lengths.chain(outputs.iter().map(|column| column.len()));
        let count = lengths.min().unwrap_or(0);
        let is_alone = count == 1 && !matches!(tier, Tier::Block(_));
        let is_too_large = self.tape.registers * size_of::<BoundsBlock>() > LARGEST_MEMORY;
        if is_alone || is_too_large || tier == Tier::Interpreter {
            for index in 0..count {
                self.run_alone(tier, index, sides, scalars, outputs);
            }
        } else {
            self.run_blocks(tier, count, sides, scalars, outputs);
        }
    }

    /// One of the boxes. Machine code and rules give the same bits.
    fn run_alone(
        &self,
        tier: Tier,
        index: usize,
        sides: &[&[Interval]],
        scalars: &Scalars,
        outputs: &mut [&mut [Enclosure]],
    ) {
        let mut place = [Interval::EMPTY; 3];
        for (side, column) in place.iter_mut().zip(sides) {
            *side = column[index];
        }
        let mut write = |output: usize, enclosure: Enclosure| {
            let Interval { low, high } = enclosure.range;
            outputs[output][index] = Enclosure {
                // An end of 0 is not shown as −0, which is the same.
                range: Interval {
                    low: low + 0.0,
                    high: high + 0.0,
                },
                ..enclosure
            };
        };
        match self.code(tier) {
            Some(code) => code.run(&place, &scalars.numbers, write),
            None => self.run_rules(&place, &scalars.uniforms, &mut write),
        }
    }

    /// The machine code for one box, where it can be made and is worth it.
    fn code(&self, tier: Tier) -> Option<&BoxCode> {
        if tier == Tier::Automatic
            && let Some(code) = self.code.get()
        {
            return code.as_deref();
        }
        let is_worth_it = match tier {
            Tier::MachineCode => true,
            Tier::Automatic => {
                self.lowered.steps.len() <= LARGEST_CODE
                    && self.singles.fetch_add(1, Ordering::Relaxed) >= WORTH_COMPILING
            }
            _ => false,
        };
        let new = || bounds::compile(&self.lowered).ok().map(Box::new);
        is_worth_it
            .then(|| self.code.get_or_init(new).as_deref())
            .flatten()
    }

    /// All outputs over a box, by the table's interval rules.
    fn run_rules(
        &self,
        sides: &[Interval; 3],
        uniforms: &[Enclosure],
        write: &mut impl FnMut(usize, Enclosure),
    ) {
        thread_local! {
            static KEPT: std::cell::Cell<Vec<Enclosure>> =
                const { std::cell::Cell::new(Vec::new()) };
        }
        let length = self.lowered.steps.len();
        KEPT.with(|kept| {
            lend(kept, length, Enclosure::of_number(0.0), |registers| {
                for (index, step) in self.lowered.steps.iter().enumerate() {
                    let (done, rest) = registers.split_at_mut(index);
                    let at = |operand| enclosure(operand, sides, uniforms, done);
                    let [a, b, c] = step.operands;
                    rest[0] = match step.operation.arity() {
                        1 => (step.operation.operation().interval)(&[at(a)]),
                        2 => (step.operation.operation().interval)(&[at(a), at(b)]),
                        _ => (step.operation.operation().interval)(&[at(a), at(b), at(c)]),
                    };
                }
                for (output, &operand) in self.lowered.outputs.iter().enumerate() {
                    write(output, enclosure(operand, sides, uniforms, registers));
                }
            });
        });
    }

    /// The first `count` boxes, in blocks.
    fn run_blocks(
        &self,
        tier: Tier,
        count: usize,
        sides: &[&[Interval]],
        scalars: &Scalars,
        outputs: &mut [&mut [Enclosure]],
    ) {
        let kernels = tier.kernels();
        Bounds::with_memory(3 + self.tape.registers + outputs.len(), |memory| {
            let Some((boxes, memory)) = memory.split_first_chunk_mut::<3>() else {
                return;
            };
            let (registers, found) = memory.split_at_mut(self.tape.registers);
            for start in (0..count).step_by(LANES) {
                let range = start..count.min(start + LANES);
                let mut columns: [&[Interval]; 3] = [&[]; 3];
                for (part, column) in columns.iter_mut().zip(sides) {
                    *part = &column[range.clone()];
                }
                dispatch::load(kernels, boxes, &columns[..sides.len()]);
                let mut pass = Pass {
                    tape: &self.tape,
                    boxes,
                    scalars: &scalars.bounds,
                    registers,
                    outputs: found,
                    decisions: &mut [],
                    settle: false,
                    tame: 0,
                };
                pass.run(kernels);
                for (block, column) in found.iter().zip(outputs.iter_mut()) {
                    dispatch::store(kernels, &mut column[range.clone()], block);
                }
            }
        });
    }

    /// The scalars, if they do not depend on any parameter.
    pub(in crate::engine) fn fixed_scalars(&self) -> Option<&Scalars> {
        self.fixed.as_ref()
    }
}

/// An operand over a box.
fn enclosure(
    operand: Operand,
    sides: &[Interval; 3],
    uniforms: &[Enclosure],
    registers: &[Enclosure],
) -> Enclosure {
    match operand {
        Operand::Constant(number) => Enclosure::of_number(number),
        Operand::Uniform(index) => uniforms[index as usize],
        Operand::Coordinate(axis) => Enclosure::of_interval(sides[usize::from(axis)]),
        Operand::Register(register) => registers[register as usize],
    }
}

impl Scalars {
    fn new(uniforms: Vec<Enclosure>, constants: &[f64]) -> Scalars {
        let constants = constants.iter().map(|&number| Enclosure::of_number(number));
        let all = uniforms.iter().copied().chain(constants);
        Scalars {
            bounds: all.map(Bounds::from).collect(),
            numbers: uniforms.iter().map(|&uniform| uniform.into()).collect(),
            uniforms,
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
        // What depends on q alone has no coordinates and no registers.
        let operands = step
            .operands
            .map(|operand| enclosure(operand, &[Interval::EMPTY; 3], &uniforms, &[]));
        let rule = step.operation.operation().interval;
        uniforms.push(rule(&operands[..step.operands().len()]));
    }
    uniforms
}
