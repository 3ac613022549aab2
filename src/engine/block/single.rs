//! A tape for one number at a time: for a few boxes, of which a block would be a waste.
//!
//! The formulas are those of [`super::table`], so the bits are the same. Registers, coordinates and
//! outputs lie in one list, so that an operand is a place of it, or one of the list of scalars.

use super::number::Number;
use super::table::{self, Code};
use crate::engine::tape::{Instruction, Place, Tape};

/// Marks a place in the list of scalars.
const SCALAR: u32 = 1 << 31;

/// Axes of a point.
const AXES: usize = 3;

/// One instruction.
#[derive(Clone, Copy, Debug)]
pub(in crate::engine) struct Line {
    code: Code,
    out: u32,
    /// Those beyond the arity repeat the first.
    operands: [u32; 3],
}

/// The instructions of a tape and its copies, as lines. (Memory is registers, then coordinates,
/// then outputs.)
pub(super) fn lines(tape: &Tape) -> Vec<Line> {
    let first_output = (tape.registers + AXES) as u32;
    let instructions = tape.instructions.iter().map(|instruction| Line {
        code: instruction.code,
        out: match instruction.output() {
            Some(output) => first_output + output as u32,
            None => instruction.out,
        },
        operands: operands(tape, instruction),
    });
    let copies = tape.copies.iter().map(|&(output, place)| {
        let place = match place {
            Place::Scalar(index) => SCALAR | index,
            Place::Coordinate(axis) => tape.registers as u32 + u32::from(axis),
            Place::Register(register) => register,
        };
        Line {
            code: Code::Splat,
            out: first_output + output,
            operands: [place; 3],
        }
    });
    instructions.chain(copies).collect()
}

/// Where an instruction finds its operands.
fn operands(tape: &Tape, instruction: &Instruction) -> [u32; 3] {
    let facts = instruction.code.facts();
    let sources = [instruction.a, instruction.b, instruction.c];
    let place = |operand: usize| match (facts.scalars >> operand & 1, sources[operand].coordinate())
    {
        (1, _) => SCALAR | sources[operand].0,
        (_, Some(axis)) => (tape.registers + axis) as u32,
        (_, None) => sources[operand].0,
    };
    // What stands beyond the arity may be a place of anything.
    [0, 1, 2].map(|operand| place(if operand < facts.arity { operand } else { 0 }))
}

/// How many numbers of memory a tape with so many outputs needs.
pub(super) fn memory(tape: &Tape, outputs: usize) -> usize {
    tape.registers + AXES + outputs
}

/// The coordinates' places.
pub(super) fn coordinates<'a, N>(tape: &Tape, memory: &'a mut [N]) -> &'a mut [N] {
    &mut memory[tape.registers..tape.registers + AXES]
}

/// The outputs' places.
pub(super) fn outputs<'a, N>(tape: &Tape, memory: &'a [N]) -> &'a [N] {
    &memory[tape.registers + AXES..]
}

/// Executes the lines.
#[inline(always)]
pub(super) fn run<N: Number>(lines: &[Line], scalars: &[N], memory: &mut [N]) {
    for line in lines {
        let operands = line.operands.map(|place| match place & SCALAR {
            0 => memory[place as usize],
            _ => scalars[(place & !SCALAR) as usize],
        });
        memory[line.out as usize] = table::single(line.code, operands);
    }
}
