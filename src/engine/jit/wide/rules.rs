//! Which instructions compute a step.
//!
//! The bits are those of [`super::super::emit`] and of the block tier: nothing is contracted or
//! reassociated. Operands are exchanged only where that changes nothing but a NaN's payload.

use super::assembler::{self as asm, Assembler, Mask, Register, Source, Vectors};
use super::registers::{Registers, ValueId};
use crate::graph::operation::Instruction;

/// An operand of a step.
#[derive(Clone, Copy, Debug)]
pub(super) enum Operand {
    /// It differs from point to point.
    Value(ValueId),
    /// It is the same for all points, and in memory.
    Same(Source),
    /// The operation has fewer.
    None,
}

/// The registers that values may have; the three above are for use inside of a step.
pub(super) fn allocated(vectors: Vectors) -> u32 {
    if vectors.is_512 { 29 } else { 13 }
}

/// Predicates of comparisons.
const EQUAL: u8 = 0;
const LESS: u8 = 1;
const LESS_EQUAL: u8 = 2;
const UNORDERED: u8 = 3;
/// True for NaN.
const NOT_EQUAL: u8 = 4;
const ORDERED: u8 = 7;

/// Directions of rounding.
const DOWN: u8 = 1;
const UP: u8 = 2;

/// (a ∧ b) ∨ ((a ∨ b) ∧ ¬c), as a table: bit 4a + 2b + c.
const LARGER_LOGIC: u8 = 0b1101_0100;

/// The bits of a number, rounded to the kind of the vectors.
pub(super) fn bits(vectors: Vectors, number: f64) -> u64 {
    match vectors.is_f64 {
        true => number.to_bits(),
        false => (number as f32).to_bits().into(),
    }
}

/// Where values are known not to be 0: mask registers k1 to k6, each for one value, so that the
/// selects of a gradient that share a condition share its comparison. The oldest goes first.
#[derive(Default)]
pub(super) struct Masks {
    values: [Option<ValueId>; 6],
    oldest: usize,
}

impl Masks {
    /// The mask of the value, if there is one. It stays when the next one is made.
    fn known(&mut self, value: ValueId) -> Option<Mask> {
        let place = self.values.iter().position(|&known| known == Some(value))?;
        if place == self.oldest {
            self.oldest = (place + 1) % self.values.len();
        }
        Some(place as Mask + 1)
    }

    /// A mask for the value, to be computed.
    fn make(&mut self, value: ValueId) -> Mask {
        let place = self.oldest;
        self.oldest = (place + 1) % self.values.len();
        self.values[place] = Some(value);
        place as Mask + 1
    }
}

/// The mask register for numbers that are the same for all points.
const SCRATCH_MASK: Mask = 7;

/// Writes steps.
pub(super) struct Rules<'a> {
    pub(super) code: &'a mut Assembler,
    pub(super) registers: &'a mut Registers,
    pub(super) masks: &'a mut Masks,
}

impl Rules<'_> {
    /// Computes a step and returns the register of its result, whose next use is given. The uses
    /// of the operands are noted.
    pub(super) fn compute(
        &mut self,
        instruction: Instruction,
        operands: &[Operand; 3],
        result: (ValueId, u32),
    ) -> Register {
        match instruction {
            Instruction::Add => self.commutative(asm::ADD, operands, result),
            Instruction::Multiply => self.commutative(asm::MULTIPLY, operands, result),
            Instruction::Subtract => self.ordered(asm::SUBTRACT, operands, result),
            Instruction::Divide => self.ordered(asm::DIVIDE, operands, result),
            Instruction::Square => {
                let a = self.register(operands, 0);
                let out = self.result(operands, result);
                let source = Source::Register(a);
                self.code.instruction(asm::MULTIPLY, out, a, source);
                out
            }
            Instruction::Negate => self.with_sign(asm::EXCLUSIVE_OR, true, operands, result),
            Instruction::Abs => self.with_sign(asm::AND, false, operands, result),
            Instruction::SquareRoot => {
                let a = self.source(operands, 0);
                let out = self.result(operands, result);
                self.code.instruction(asm::SQUARE_ROOT, out, 0, a);
                out
            }
            Instruction::Floor => self.round(DOWN, operands, result),
            Instruction::Ceil => self.round(UP, operands, result),
            Instruction::Min => self.smaller(operands, result),
            Instruction::Max => self.larger(operands, result),
            Instruction::Less => self.compare(LESS, operands, result),
            Instruction::LessEqual => self.compare(LESS_EQUAL, operands, result),
            Instruction::Equal => self.compare(EQUAL, operands, result),
            Instruction::IsNumber => {
                let twice = [operands[0], operands[0], Operand::None];
                self.compare(ORDERED, &twice, result)
            }
            Instruction::Select => self.select(operands, result),
            Instruction::ChainProduct => self.chain_product(operands, result),
        }
    }

    /// A register for use inside of a step, of three.
    fn scratch(&self, index: usize) -> Register {
        allocated(self.code.vectors) as Register + index as Register
    }

    /// An operand where it is.
    fn source(&mut self, operands: &[Operand; 3], index: usize) -> Source {
        match operands[index] {
            Operand::Value(value) => self.registers.source(self.code, value),
            Operand::Same(source) => source,
            Operand::None => Source::Register(0),
        }
    }

    /// An operand in a register: its own, or the scratch register of its place (0 or 1).
    fn register(&mut self, operands: &[Operand; 3], index: usize) -> Register {
        let scratch = self.scratch(index.min(1));
        match operands[index] {
            Operand::Value(value) => self.registers.register(self.code, value, scratch),
            Operand::Same(source) => {
                self.code.load(scratch, source);
                scratch
            }
            Operand::None => scratch,
        }
    }

    /// The register of the result. Operands that are not used again make room for it, so it is
    /// written when none of them is read any more.
    fn result(&mut self, operands: &[Operand; 3], (value, next): (ValueId, u32)) -> Register {
        let values = operands.iter().filter_map(|&operand| match operand {
            Operand::Value(value) => Some(value),
            Operand::Same(_) | Operand::None => None,
        });
        self.registers.release(values);
        self.registers.result(self.code, value, next)
    }

    /// a ∘ b
    fn ordered(
        &mut self,
        opcode: asm::Opcode,
        operands: &[Operand; 3],
        result: (ValueId, u32),
    ) -> Register {
        let a = self.register(operands, 0);
        let b = self.source(operands, 1);
        let out = self.result(operands, result);
        self.code.instruction(opcode, out, a, b);
        out
    }

    /// a ∘ b = b ∘ a: the operand that is in a register comes first.
    fn commutative(
        &mut self,
        opcode: asm::Opcode,
        operands: &[Operand; 3],
        result: (ValueId, u32),
    ) -> Register {
        let is_held = |operand: Operand| match operand {
            Operand::Value(value) => self.registers.held(value).is_some(),
            _ => false,
        };
        let is_value = |operand: Operand| matches!(operand, Operand::Value(_));
        let [a, b, none] = *operands;
        let exchanged = match (is_held(a), is_held(b)) {
            (false, true) => true,
            (false, false) => !is_value(a) && is_value(b),
            _ => false,
        };
        match exchanged {
            true => self.ordered(opcode, &[b, a, none], result),
            false => self.ordered(opcode, operands, result),
        }
    }

    /// The number's bits with the sign's bit alone, or with all others.
    fn with_sign(
        &mut self,
        opcode: asm::Opcode,
        is_sign: bool,
        operands: &[Operand; 3],
        result: (ValueId, u32),
    ) -> Register {
        let a = self.register(operands, 0);
        let sign = bits(self.code.vectors, -0.0);
        let mask = match is_sign {
            true => sign,
            false => sign - 1,
        };
        let mask = self.code.constant(mask);
        let out = self.result(operands, result);
        self.code.instruction(opcode, out, a, mask);
        out
    }

    fn round(
        &mut self,
        direction: u8,
        operands: &[Operand; 3],
        result: (ValueId, u32),
    ) -> Register {
        let a = self.source(operands, 0);
        let out = self.result(operands, result);
        self.code.round(out, a, direction);
        out
    }

    /// Two minima, which differ where the operands are equal or one is NaN; there the union of
    /// bits is −0 if one is −0, and NaN if one is NaN.
    fn smaller(&mut self, operands: &[Operand; 3], result: (ValueId, u32)) -> Register {
        let [a, b] = [0, 1].map(|index| self.register(operands, index));
        let first = self.scratch(2);
        let code = &mut *self.code;
        code.instruction(asm::MINIMUM, first, a, Source::Register(b));
        let out = self.result(operands, result);
        let code = &mut *self.code;
        code.instruction(asm::MINIMUM, out, b, Source::Register(a));
        code.instruction(asm::OR, out, out, Source::Register(first));
        out
    }

    /// Two maxima, likewise: of numbers the intersection of bits, which is 0 if one is 0 and the
    /// other −0, and something that is NaN if one is NaN.
    fn larger(&mut self, operands: &[Operand; 3], result: (ValueId, u32)) -> Register {
        let [a, b] = [0, 1].map(|index| self.register(operands, index));
        let first = self.scratch(2);
        let source = Source::Register(b);
        self.code.instruction(asm::MAXIMUM, first, a, source);
        let out = self.result(operands, result);
        let source = Source::Register(a);
        self.code.instruction(asm::MAXIMUM, out, b, source);
        if self.code.vectors.is_512 {
            let sign = bits(self.code.vectors, -0.0);
            let sign = self.code.constant(sign);
            self.code
                .immediate(asm::TERNARY_LOGIC, out, first, sign, LARGER_LOGIC);
            return out;
        }
        // Where one operand is NaN the two maxima are the operands. These are read by now.
        let undefined = self.scratch(0);
        let other = Source::Register(out);
        let code = &mut *self.code;
        code.immediate(asm::COMPARE, undefined, first, other, UNORDERED);
        code.instruction(asm::AND, first, first, other);
        code.instruction(asm::OR, out, first, Source::Register(undefined));
        out
    }

    /// 1 where the comparison holds, else 0.
    fn compare(
        &mut self,
        predicate: u8,
        operands: &[Operand; 3],
        result: (ValueId, u32),
    ) -> Register {
        let a = self.register(operands, 0);
        let b = self.source(operands, 1);
        let one = bits(self.code.vectors, 1.0);
        let one = self.code.constant(one);
        if self.code.vectors.is_512 {
            let mask = self.masks.make(result.0);
            self.code.immediate(asm::COMPARE, mask, a, b, predicate);
            let out = self.result(operands, result);
            self.code.load_masked(out, one, mask);
            return out;
        }
        let out = self.result(operands, result);
        self.code.immediate(asm::COMPARE, out, a, b, predicate);
        self.code.instruction(asm::AND, out, out, one);
        out
    }

    /// b where a ≠ 0 or NaN, else c.
    fn select(&mut self, operands: &[Operand; 3], result: (ValueId, u32)) -> Register {
        if self.code.vectors.is_512 {
            let mask = self.nonzero_mask(operands, 0);
            let c = self.register(operands, 2);
            let b = self.source(operands, 1);
            let out = self.result(operands, result);
            self.code.blend(out, c, b, mask);
            return out;
        }
        let mask = self.scratch(2);
        self.nonzero(operands, 0, mask);
        let c = self.register(operands, 2);
        let b = self.source(operands, 1);
        let out = self.result(operands, result);
        self.code.choose(out, c, b, mask);
        out
    }

    /// 0 where a = 0 or b = 0, else a·b.
    fn chain_product(&mut self, operands: &[Operand; 3], result: (ValueId, u32)) -> Register {
        if self.code.vectors.is_512 {
            let of_a = self.nonzero_mask(operands, 0);
            let of_b = self.nonzero_mask(operands, 1);
            let [a, b] = [0, 1].map(|index| self.register(operands, index));
            let out = self.result(operands, result);
            let code = &mut *self.code;
            code.masked(asm::MULTIPLY, out, a, Source::Register(b), of_a);
            code.masked(asm::LOAD, out, 0, Source::Register(out), of_b);
            return out;
        }
        let [a, b] = [0, 1].map(|index| self.register(operands, index));
        let (product, zero) = (self.scratch(2), self.code.constant(0));
        let out = self.result(operands, result);
        let code = &mut *self.code;
        code.instruction(asm::MULTIPLY, product, a, Source::Register(b));
        // The register of the result may be that of one operand, which then is compared first.
        let [first, second] = if out == b { [b, a] } else { [a, b] };
        code.immediate(asm::COMPARE, out, first, zero, NOT_EQUAL);
        if first != second {
            code.instruction(asm::AND, product, product, Source::Register(out));
            code.immediate(asm::COMPARE, out, second, zero, NOT_EQUAL);
        }
        code.instruction(asm::AND, out, out, Source::Register(product));
        out
    }

    /// 256 bits: a vector of masks, set where the operand is not 0.
    fn nonzero(&mut self, operands: &[Operand; 3], index: usize, mask: Register) {
        let a = self.register(operands, index);
        let zero = self.code.constant(0);
        self.code.immediate(asm::COMPARE, mask, a, zero, NOT_EQUAL);
    }

    /// 512 bits: the mask register that is set where the operand is not 0.
    fn nonzero_mask(&mut self, operands: &[Operand; 3], index: usize) -> Mask {
        let mask = match operands[index] {
            Operand::Value(value) => match self.masks.known(value) {
                Some(mask) => return mask,
                None => self.masks.make(value),
            },
            _ => SCRATCH_MASK,
        };
        let a = self.register(operands, index);
        let zero = self.code.constant(0);
        self.code.immediate(asm::COMPARE, mask, a, zero, NOT_EQUAL);
        mask
    }
}
