//! A tape: the steps of a kernel as instructions on a small set of registers.
//!
//! It stands between the lowered steps and [`super::block`], which executes it. Making one takes
//! time in proportion to the steps, a few nanoseconds each: `fuse` joins operations whose
//! intermediate result nobody else needs, and what is left gets registers by a linear scan along
//! the straight line, so that there are as many as values are alive at a time (and one, since no
//! instruction writes to a register that it reads). A result that no other instruction needs is
//! written to the output at once.

pub(super) mod fuse;

use super::block::{Code, Kind};
use super::lower::{Lowered, Operand};
use fuse::Fused;
use rustc_hash::FxHashMap;

/// Marks an [`Instruction::out`] that is an output, not a register.
pub(super) const OUTPUT: u32 = 1 << 31;

/// Marks a [`Source`] that is a coordinate.
pub(super) const COORDINATE: u32 = 1 << 31;

/// Where an instruction finds an operand: a register, a coordinate or, if the instruction's code
/// has a scalar there, a place of the list of scalars.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Source(pub(super) u32);

impl Source {
    /// The coordinate's axis, if it is one.
    #[inline(always)]
    pub(super) fn coordinate(self) -> Option<usize> {
        (self.0 & COORDINATE != 0).then_some((self.0 & !COORDINATE) as usize)
    }
}

/// One instruction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instruction {
    /// What to do.
    pub(super) code: Code,
    /// The register that is written, or an output.
    pub(super) out: u32,
    /// The first operand.
    pub(super) a: Source,
    /// The second one, if the code has it.
    pub(super) b: Source,
    /// The third one, if the code has it.
    pub(super) c: Source,
}

impl Instruction {
    /// The output that is written, if it is no register.
    #[inline(always)]
    pub(super) fn output(&self) -> Option<usize> {
        (self.out & OUTPUT != 0).then_some((self.out & !OUTPUT) as usize)
    }
}

/// Where a result is that no instruction writes to its output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// In the list of scalars.
    Scalar(u32),
    /// It is a coordinate.
    Coordinate(u8),
    /// In a register, when the last instruction has been executed.
    Register(u32),
}

/// Instructions in the order of their execution.
#[derive(Clone, Debug, Default)]
pub(super) struct Tape {
    /// What to execute.
    pub(super) instructions: Vec<Instruction>,
    /// What to copy to outputs in the end: output and place.
    pub(super) copies: Vec<(u32, Place)>,
    /// How many registers there are.
    pub(super) registers: usize,
    /// The constants. The list of scalars is what [`super::interpret::uniforms`] makes, then
    /// these.
    pub(super) constants: Vec<f64>,
}

/// The tape of a kernel.
pub(super) fn assemble(lowered: &Lowered) -> Tape {
    let mut assembler = Assembler {
        uniforms: lowered.uniforms(),
        places: FxHashMap::default(),
        constants: Vec::new(),
        values: vec![NONE; lowered.steps.len()],
        drafts: Vec::with_capacity(lowered.steps.len()),
    };
    for (step, fused) in fuse::fuse(lowered, fuse::Choices::Fused)
        .into_iter()
        .enumerate()
    {
        if let Some(fused) = fused {
            assembler.values[step] = assembler.draft(&fused);
        }
    }
    let outputs: Vec<Place> = lowered
        .outputs
        .iter()
        .map(|&output| match output {
            Operand::Coordinate(axis) => Place::Coordinate(axis),
            Operand::Register(step) => Place::Register(assembler.values[step as usize]),
            Operand::Constant(_) | Operand::Uniform(_) => {
                Place::Scalar(assembler.source(output).1.0)
            }
        })
        .collect();
    let mut tape = allocate(assembler.drafts, &outputs);
    tape.constants = assembler.constants;
    tape
}

/// No value.
const NONE: u32 = u32::MAX;

/// Turns fused steps into instructions whose registers are *values*: one for each instruction.
struct Assembler {
    /// The number of scalars that are no constants.
    uniforms: usize,
    /// The constants' places by their bits.
    places: FxHashMap<u64, u32>,
    constants: Vec<f64>,
    /// The value that each step became.
    values: Vec<u32>,
    drafts: Vec<Draft>,
}

/// An instruction before registers are known. Its own value is its place in the list.
struct Draft {
    code: Code,
    operands: [(Kind, Source); 3],
    arity: usize,
}

impl Draft {
    /// The values that it reads.
    fn values(&self) -> impl Iterator<Item = u32> {
        let operands = self.operands.into_iter().take(self.arity);
        operands
            .filter(|(kind, source)| *kind == Kind::Lanes && source.coordinate().is_none())
            .map(|(_, source)| source.0)
    }
}

impl Assembler {
    /// Appends the instruction of a fused step, after others that make lanes of scalars where it
    /// has no code for them, and returns its value.
    fn draft(&mut self, fused: &Fused) -> u32 {
        let mut operands = fused.operands.map(|operand| self.source(operand));
        let arity = fused.arity;
        loop {
            let kinds = operands.map(|(kind, _)| kind);
            if let Some(code) = fused.kernel.code(&kinds[..arity]) {
                return self.push(code, operands, arity);
            }
            let scalar = kinds[..arity].iter().position(|&kind| kind == Kind::Scalar);
            // Every kernel has a code for lanes alone, so there is a scalar if none was found.
            let place = scalar.unwrap_or(0);
            let splat = self.push(Code::Splat, [operands[place]; 3], 1);
            operands[place] = (Kind::Lanes, Source(splat));
        }
    }

    /// Appends an instruction and returns its value.
    fn push(&mut self, code: Code, operands: [(Kind, Source); 3], arity: usize) -> u32 {
        self.drafts.push(Draft {
            code,
            operands,
            arity,
        });
        self.drafts.len() as u32 - 1
    }

    /// Where an operand is found.
    fn source(&mut self, operand: Operand) -> (Kind, Source) {
        match operand {
            Operand::Coordinate(axis) => (Kind::Lanes, Source(COORDINATE | u32::from(axis))),
            Operand::Register(step) => (Kind::Lanes, Source(self.values[step as usize])),
            Operand::Uniform(index) => (Kind::Scalar, Source(index)),
            Operand::Constant(number) => {
                let next = (self.uniforms + self.constants.len()) as u32;
                let place = *self.places.entry(number.to_bits()).or_insert(next);
                if place == next {
                    self.constants.push(number);
                }
                (Kind::Scalar, Source(place))
            }
        }
    }
}

/// Gives registers to the values of all drafts.
fn allocate(drafts: Vec<Draft>, outputs: &[Place]) -> Tape {
    let mut last_use = vec![NONE; drafts.len()];
    for (index, draft) in drafts.iter().enumerate() {
        for value in draft.values() {
            last_use[value as usize] = index as u32;
        }
    }
    // A value that is only an output is written there, the first time.
    let mut targets = vec![NONE; drafts.len()];
    let mut tape = Tape::default();
    let mut kept = vec![false; drafts.len()];
    for (output, &place) in outputs.iter().enumerate() {
        match place {
            Place::Register(value) if last_use[value as usize] == NONE => {
                let target = &mut targets[value as usize];
                if *target == NONE {
                    *target = OUTPUT | output as u32;
                } else {
                    kept[value as usize] = true;
                }
            }
            Place::Register(value) => kept[value as usize] = true,
            Place::Scalar(_) | Place::Coordinate(_) => {}
        }
    }
    for (target, kept) in targets.iter_mut().zip(&kept) {
        if *kept {
            *target = NONE;
        }
    }
    let mut free: Vec<u32> = Vec::new();
    for (index, draft) in drafts.iter().enumerate() {
        if targets[index] == NONE {
            targets[index] = free.pop().unwrap_or_else(|| {
                tape.registers += 1;
                tape.registers as u32 - 1
            });
        }
        let [a, b, c] = draft.operands.map(|(kind, source)| match kind {
            Kind::Lanes if source.coordinate().is_none() => Source(targets[source.0 as usize]),
            _ => source,
        });
        tape.instructions.push(Instruction {
            code: draft.code,
            out: targets[index],
            a,
            b,
            c,
        });
        // Only now, so that the instruction does not write to a register that it reads.
        for value in draft.values() {
            let value = value as usize;
            if last_use[value] == index as u32 && !kept[value] {
                free.push(targets[value]);
                // An operand that occurs twice is freed once.
                last_use[value] = NONE;
            }
        }
    }
    for (output, &place) in outputs.iter().enumerate() {
        let place = match place {
            Place::Register(value) if targets[value as usize] & OUTPUT != 0 => continue,
            Place::Register(value) => Place::Register(targets[value as usize]),
            other => other,
        };
        tape.copies.push((output as u32, place));
    }
    tape
}

#[cfg(test)]
mod tests;
