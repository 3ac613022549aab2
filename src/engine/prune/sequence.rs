//! Sequences: steps that can be pruned, with the tape that executes them.
//!
//! Steps are in static single assignment: a step's result has the step's place in the list.
//! Arithmetic is fused as in every tape; choices stay alone, so that each can be decided by
//! itself. The tape has the instructions of the steps in the same order, one for each.

use super::Origin;
use crate::engine::block::{Code, Kernel, Kind};
use crate::engine::lower::{Lowered, Operand};
use crate::engine::tape::fuse::{Choices, fuse, is_symmetric};
use crate::engine::tape::{COORDINATE, Instruction, OUTPUT, Place, Source, Tape};
use crate::graph::NodeId;
use rustc_hash::FxHashMap;

/// Marks an operand that is a place of the list of scalars. One that is marked by neither this
/// nor [`COORDINATE`] is the result of the step at that place.
pub(super) const SCALAR: u32 = 1 << 30;

/// Whether the operand is the result of a step.
#[inline(always)]
pub(super) fn is_step(operand: u32) -> bool {
    operand < SCALAR
}

/// Whether the operand is a scalar.
#[inline(always)]
pub(super) fn is_scalar(operand: u32) -> bool {
    operand & (SCALAR | COORDINATE) == SCALAR
}

/// The operand's place in the list of scalars, if it is one.
pub(in crate::engine) fn scalar_place(operand: u32) -> Option<usize> {
    is_scalar(operand).then_some((operand & !SCALAR) as usize)
}

/// One operation.
#[derive(Clone, Copy, Debug)]
pub(in crate::engine) struct Step {
    /// The operands, of which the code's arity count; the others repeat the first.
    pub(super) operands: [u32; 3],
    /// What to do.
    pub(super) code: Code,
    /// Which choice it is.
    pub(super) origin: Origin,
}

/// Steps in the order of their execution.
#[derive(Default)]
pub(in crate::engine) struct Sequence {
    pub(super) steps: Vec<Step>,
    /// Where each output is found.
    pub(in crate::engine) outputs: Vec<u32>,
    /// What executes the steps.
    pub(in crate::engine) tape: Tape,
    /// Whether a step is a choice: if none is, there is nothing to prune.
    pub(in crate::engine) has_choices: bool,
}

impl Sequence {
    /// The same with some of the outputs only. Steps that only others need stay.
    pub(in crate::engine) fn with_outputs(&self, places: impl Iterator<Item = usize>) -> Sequence {
        let mut sequence = Sequence {
            steps: self.steps.clone(),
            outputs: places.map(|place| self.outputs[place]).collect(),
            ..Sequence::default()
        };
        Allocator::default().assign(&mut sequence);
        sequence
    }

    /// Whether a step or an output reads the coordinate of this axis.
    pub(in crate::engine) fn depends_on(&self, axis: usize) -> bool {
        let coordinate = COORDINATE | axis as u32;
        let reads = |step: &Step| {
            let [a, b, c] = step.operands;
            (a == coordinate) | (b == coordinate) | (c == coordinate)
        };
        self.steps.iter().any(reads) || self.outputs.contains(&coordinate)
    }

    /// The number of steps.
    pub(in crate::engine) fn len(&self) -> usize {
        self.steps.len()
    }
}

/// The whole sequence of a function, with the constants that follow the uniforms in its list of
/// scalars: 0, 1 and those of the function. `nodes` are those of the steps, and `origin` tells
/// which choices they are.
pub(super) fn whole(
    lowered: &Lowered,
    nodes: &[NodeId],
    origin: impl Fn(NodeId) -> Origin,
) -> (Sequence, Vec<f64>) {
    let mut constants = vec![0.0, 1.0];
    let mut places: FxHashMap<u64, u32> = FxHashMap::default();
    for (place, constant) in constants.iter().enumerate() {
        places.insert(f64::to_bits(*constant), place as u32);
    }
    let mut sequence = Sequence::default();
    let mut values = vec![0; lowered.steps.len()];
    let mut operand = |operand: Operand, values: &[u32]| match operand {
        Operand::Coordinate(axis) => COORDINATE | u32::from(axis),
        Operand::Register(step) => values[step as usize],
        Operand::Uniform(index) => SCALAR | index,
        Operand::Constant(number) => {
            let place = *places.entry(number.to_bits()).or_insert_with(|| {
                constants.push(number);
                constants.len() as u32 - 1
            });
            SCALAR | (lowered.uniforms() as u32 + place)
        }
    };
    for (step, fused) in fuse(lowered, Choices::Alone).into_iter().enumerate() {
        if let Some(fused) = fused {
            let operands = fused.operands.map(|found| operand(found, &values));
            let origin = origin(nodes[step]);
            let origin = match fused.operands[0] == lowered.steps[step].operands[0] {
                true => origin,
                false => origin.exchanged(fused.kernel),
            };
            let kernel = (fused.kernel, origin);
            values[step] = encode(&mut sequence.steps, kernel, fused.arity, operands);
        }
    }
    let outputs = lowered.outputs.iter();
    sequence.outputs = outputs.map(|&output| operand(output, &values)).collect();
    Allocator::default().assign(&mut sequence);
    (sequence, constants)
}

/// Appends a step, after others that make lanes of scalars where the kernel has no code for them,
/// and returns its place.
pub(super) fn encode(
    steps: &mut Vec<Step>,
    (kernel, mut origin): (Kernel, Origin),
    arity: usize,
    mut operands: [u32; 3],
) -> u32 {
    loop {
        for place in arity..3 {
            operands[place] = operands[0];
        }
        let kinds = |operands: [u32; 3]| {
            operands.map(|operand| match is_scalar(operand) {
                true => Kind::Scalar,
                false => Kind::Lanes,
            })
        };
        let mut code = kernel.code(&kinds(operands)[..arity]);
        if code.is_none() && is_symmetric(kernel) {
            let [a, b, c] = operands;
            let exchanged = [b, a, if arity > 2 { c } else { b }];
            code = kernel.code(&kinds(exchanged)[..arity]);
            if code.is_some() {
                operands = exchanged;
                origin = origin.exchanged(kernel);
            }
        }
        if let Some(code) = code {
            steps.push(Step {
                operands,
                code,
                origin,
            });
            return steps.len() as u32 - 1;
        }
        // Every kernel has a code for lanes alone, so there is a scalar if none was found.
        let scalar = operands[..arity]
            .iter()
            .position(|&operand| is_scalar(operand));
        let place = scalar.unwrap_or(0);
        steps.push(Step {
            operands: [operands[place]; 3],
            code: Code::Splat,
            origin: Origin::NONE,
        });
        operands[place] = steps.len() as u32 - 1;
    }
}

/// No register, no step.
const NONE: u32 = u32::MAX;

/// Gives registers to sequences; keeps its memory from one to the next.
///
/// Nobody can tell which operands are steps and which of those are needed no more, so that is
/// computed without branches: every list has a place after those of the steps, which all other
/// operands share.
#[derive(Default)]
pub(super) struct Allocator {
    /// The last step that needs each step's result.
    last_use: Vec<u32>,
    /// The register of each step's result.
    registers: Vec<u32>,
    free: Vec<u32>,
}

impl Allocator {
    /// Makes the tape of the sequence's steps. Every step must be needed.
    pub(super) fn assign(&mut self, sequence: &mut Sequence) {
        let Sequence {
            steps,
            outputs,
            tape,
            has_choices,
        } = sequence;
        let count = steps.len();
        self.find_last_uses(steps, outputs);
        self.registers.resize(count + 1, 0);
        self.free.resize(count + 1, 0);
        let last_use = &self.last_use[..count + 1];
        let registers = &mut self.registers[..count + 1];
        let free = &mut self.free[..count + 1];
        let (mut waiting, mut total) = (0_usize, 0);
        *has_choices = false;
        // A single output is written by the last step, which nobody else needs.
        let last = count.wrapping_sub(1) as u32;
        let writes = outputs.len() == 1 && outputs.first() == Some(&last);
        tape.instructions.clear();
        let instructions = steps.iter().zip(0..).map(|(step, index): (&Step, u32)| {
            *has_choices |= step.code.facts().choice.is_some();
            let is_output = writes & (index == last);
            let is_new = waiting == 0;
            waiting = waiting.saturating_sub(1);
            let register = if is_new { total } else { free[waiting] };
            total += u32::from(is_new & !is_output);
            registers[index as usize] = register;
            let [a, b, c] = step.operands;
            let places = step.operands.map(|operand| (operand as usize).min(count));
            let found = places.map(|place| registers[place]);
            // Only now, so that the instruction does not write to a register that it reads. An
            // operand that occurs twice is freed once, and those beyond the arity repeat the first.
            let is_first = [true, b != a, (c != a) & (c != b)];
            for operand in 0..3 {
                free[waiting] = found[operand];
                let is_last = last_use[places[operand]] == index;
                waiting += usize::from(is_last & is_first[operand]);
            }
            let source = |operand: u32, register: u32| match (operand as usize) < count {
                true => Source(register),
                false => Source(operand & !SCALAR),
            };
            Instruction {
                code: step.code,
                out: if is_output { OUTPUT } else { register },
                a: source(a, found[0]),
                b: source(b, found[1]),
                c: source(c, found[2]),
            }
        });
        tape.instructions.extend(instructions);
        tape.registers = total as usize;
        tape.copies.clear();
        for (output, &operand) in outputs.iter().enumerate() {
            let place = match scalar_place(operand) {
                Some(place) => Place::Scalar(place as u32),
                None if is_step(operand) => {
                    if writes {
                        continue;
                    }
                    Place::Register(self.registers[operand as usize])
                }
                None => Place::Coordinate((operand & !COORDINATE) as u8),
            };
            tape.copies.push((output as u32, place));
        }
    }

    /// For every step the last one that needs its result, or none if it is an output.
    fn find_last_uses(&mut self, steps: &[Step], outputs: &[u32]) {
        let count = steps.len();
        self.last_use.clear();
        self.last_use.resize(count + 1, NONE);
        let last_use = &mut self.last_use[..count + 1];
        for (step, index) in steps.iter().zip(0..) {
            for operand in step.operands {
                last_use[(operand as usize).min(count)] = index;
            }
        }
        for &output in outputs {
            last_use[(output as usize).min(count)] = NONE;
        }
        last_use[count] = NONE;
    }
}
