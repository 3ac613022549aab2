//! The machine-code rules of single operations.
//!
//! Nothing here contracts a product and a sum to one rounding or reassociates, so the bits are
//! those of the table's value rules, on every processor, for one number or a vector of them.
//!
//! Choices are made with masks, in vectors: of one number in such whose first lane counts. The
//! comparison of two scalars ends in a jump, and the jumps of a solid's hundred minima are
//! mispredicted at every point.

use crate::graph::Op;
use crate::graph::operation::{Instruction, MachineCode};
use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::types::{F32X4, F64, F64X2, I32X4, I64X2};
use cranelift_codegen::ir::{ConstantData, Endianness, InstBuilder, MemFlagsData, Type, Value};
use cranelift_frontend::FunctionBuilder;

/// How many points the code computes at a time, and in which precision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lanes {
    /// One, in f64.
    One,
    /// Two, in f64.
    Two,
    /// Four, in f32.
    Four,
}

impl Lanes {
    /// The type of numbers in the code.
    pub(super) fn numbers(self) -> Type {
        match self {
            Lanes::One => F64,
            Lanes::Two => F64X2,
            Lanes::Four => F32X4,
        }
    }

    /// The logarithm to base 2 of the bytes of one number.
    pub(super) fn shift(self) -> i32 {
        match self {
            Lanes::One | Lanes::Two => 3,
            Lanes::Four => 2,
        }
    }

    /// The bytes of one number.
    pub(super) fn size(self) -> i32 {
        1 << self.shift()
    }

    /// The bytes of all lanes.
    pub(super) fn bytes(self) -> i32 {
        self.numbers().bytes() as i32
    }

    /// What loads and stores of numbers may assume.
    pub(super) fn memory(self) -> MemFlagsData {
        match self {
            Lanes::One => MemFlagsData::trusted(),
            // Columns begin where their numbers may, not where vectors would.
            Lanes::Two | Lanes::Four => MemFlagsData::new().with_notrap(),
        }
    }

    /// The vectors that masks are made of.
    fn vector(self) -> Type {
        match self {
            Lanes::One | Lanes::Two => F64X2,
            Lanes::Four => F32X4,
        }
    }

    /// The type of masks.
    fn mask(self) -> Type {
        match self {
            Lanes::One | Lanes::Two => I64X2,
            Lanes::Four => I32X4,
        }
    }

    /// A number in the vectors that masks are made of.
    fn widen(self, builder: &mut FunctionBuilder, number: Value) -> Value {
        match self {
            Lanes::One => builder.ins().splat(F64X2, number),
            Lanes::Two | Lanes::Four => number,
        }
    }

    /// The number in such a vector.
    fn narrow(self, builder: &mut FunctionBuilder, vector: Value) -> Value {
        match self {
            Lanes::One => builder.ins().extractlane(vector, 0),
            Lanes::Two | Lanes::Four => vector,
        }
    }

    /// The same number for all lanes.
    pub(super) fn constant(self, builder: &mut FunctionBuilder, number: f64) -> Value {
        let bytes: Vec<u8> = match self {
            Lanes::One => return builder.ins().f64const(number),
            Lanes::Two => number.to_le_bytes().repeat(2),
            Lanes::Four => (number as f32).to_le_bytes().repeat(4),
        };
        let place = builder
            .func
            .dfg
            .constants
            .insert(ConstantData::from(&bytes[..]));
        builder.ins().vconst(self.numbers(), place)
    }
}

/// A number in the code, with the masks that are known of it.
#[derive(Clone, Copy)]
pub(super) struct Number {
    /// The number.
    pub(super) value: Value,
    /// All ones where it is not 0, else all zeros.
    pub(super) nonzero: Option<Value>,
}

impl From<Value> for Number {
    fn from(value: Value) -> Number {
        Number {
            value,
            nonzero: None,
        }
    }
}

/// The instruction of a native operation; `None` for one that is called.
pub(super) fn native(op: Op) -> Option<Instruction> {
    match op.operation().code {
        MachineCode::Native(instruction) => Some(instruction),
        MachineCode::Host | MachineCode::Lower(_) => None,
    }
}

/// Emits an instruction; the operands that it has no use for repeat the first. Masks that it
/// needs are noted in the operands.
pub(super) fn emit(
    builder: &mut FunctionBuilder,
    lanes: Lanes,
    instruction: Instruction,
    operands: &mut [Number; 3],
) -> Number {
    let [a, b, c] = operands.map(|operand| operand.value);
    let ins = builder.ins();
    let value = match instruction {
        Instruction::Add => ins.fadd(a, b),
        Instruction::Subtract => ins.fsub(a, b),
        Instruction::Multiply => ins.fmul(a, b),
        Instruction::Divide => ins.fdiv(a, b),
        Instruction::Negate => ins.fneg(a),
        Instruction::Square => ins.fmul(a, a),
        Instruction::SquareRoot => ins.sqrt(a),
        Instruction::Abs => ins.fabs(a),
        Instruction::Floor => ins.floor(a),
        Instruction::Ceil => ins.ceil(a),
        Instruction::Min if lanes == Lanes::One => ins.fmin(a, b),
        Instruction::Min => smaller(builder, lanes, a, b),
        Instruction::Max if lanes == Lanes::One => ins.fmax(a, b),
        Instruction::Max => larger(builder, lanes, a, b),
        Instruction::Less => return compare(builder, lanes, FloatCC::LessThan, a, b),
        Instruction::LessEqual => return compare(builder, lanes, FloatCC::LessThanOrEqual, a, b),
        Instruction::Equal => return compare(builder, lanes, FloatCC::Equal, a, b),
        Instruction::IsNumber => return compare(builder, lanes, FloatCC::Equal, a, a),
        Instruction::Select => {
            let mask = nonzero(builder, lanes, &mut operands[0]);
            let [b, c] = [b, c].map(|arm| lanes.widen(builder, arm));
            let mask = builder.ins().bitcast(lanes.vector(), little(), mask);
            let chosen = builder.ins().bitselect(mask, b, c);
            lanes.narrow(builder, chosen)
        }
        Instruction::ChainProduct => {
            let product = ins.fmul(a, b);
            let a = nonzero(builder, lanes, &mut operands[0]);
            let b = nonzero(builder, lanes, &mut operands[1]);
            let both = builder.ins().band(a, b);
            masked(builder, lanes, both, product)
        }
    };
    Number::from(value)
}

/// The smaller numbers of two vectors. The two minimum instructions differ where the operands are
/// equal or one is NaN; there the union of bits is −0 if one is −0, and NaN if one is NaN.
/// Cranelift's own minimum spends six more instructions on a canonical NaN.
fn smaller(builder: &mut FunctionBuilder, lanes: Lanes, a: Value, b: Value) -> Value {
    let first = minimum(builder, lanes, a, b);
    let second = minimum(builder, lanes, b, a);
    let [first, second] = [first, second].map(|one| bits(builder, lanes, one));
    let union = builder.ins().bor(first, second);
    builder.ins().bitcast(lanes.vector(), little(), union)
}

/// The larger numbers, likewise: of numbers the intersection of bits, which is 0 if one is 0 and
/// the other −0; where one is NaN all bits, which are a NaN too.
fn larger(builder: &mut FunctionBuilder, lanes: Lanes, a: Value, b: Value) -> Value {
    let first = maximum(builder, lanes, a, b);
    let second = maximum(builder, lanes, b, a);
    let [first, second] = [first, second].map(|one| bits(builder, lanes, one));
    let common = builder.ins().band(first, second);
    let undefined = builder.ins().fcmp(FloatCC::Unordered, a, b);
    let union = builder.ins().bor(common, undefined);
    builder.ins().bitcast(lanes.vector(), little(), union)
}

/// a < b ? a : b, one instruction on x86-64.
pub(super) fn minimum(builder: &mut FunctionBuilder, lanes: Lanes, a: Value, b: Value) -> Value {
    let mask = builder.ins().fcmp(FloatCC::LessThan, a, b);
    let mask = builder.ins().bitcast(lanes.vector(), little(), mask);
    builder.ins().bitselect(mask, a, b)
}

/// b < a ? a : b, one instruction on x86-64.
pub(super) fn maximum(builder: &mut FunctionBuilder, lanes: Lanes, a: Value, b: Value) -> Value {
    let mask = builder.ins().fcmp(FloatCC::LessThan, b, a);
    let mask = builder.ins().bitcast(lanes.vector(), little(), mask);
    builder.ins().bitselect(mask, a, b)
}

/// 1.0 where the comparison holds, else 0.0. Where only a select uses it, the number is not
/// computed: instructions without a use are dropped.
fn compare(
    builder: &mut FunctionBuilder,
    lanes: Lanes,
    comparison: FloatCC,
    a: Value,
    b: Value,
) -> Number {
    let [a, b] = [a, b].map(|operand| lanes.widen(builder, operand));
    let mask = builder.ins().fcmp(comparison, a, b);
    let one = lanes.constant(builder, 1.0);
    Number {
        value: masked(builder, lanes, mask, one),
        nonzero: Some(mask),
    }
}

/// The number where the mask is set, else 0.
fn masked(builder: &mut FunctionBuilder, lanes: Lanes, mask: Value, number: Value) -> Value {
    let number = lanes.widen(builder, number);
    let bits = bits(builder, lanes, number);
    let bits = builder.ins().band(bits, mask);
    let number = builder.ins().bitcast(lanes.vector(), little(), bits);
    lanes.narrow(builder, number)
}

/// Where the number is not 0; a NaN is not.
fn nonzero(builder: &mut FunctionBuilder, lanes: Lanes, number: &mut Number) -> Value {
    if let Some(mask) = number.nonzero {
        return mask;
    }
    let zero = lanes.constant(builder, 0.0);
    let [value, zero] = [number.value, zero].map(|value| lanes.widen(builder, value));
    let mask = builder.ins().fcmp(FloatCC::NotEqual, value, zero);
    number.nonzero = Some(mask);
    mask
}

/// The bits of a vector of numbers, as masks are.
fn bits(builder: &mut FunctionBuilder, lanes: Lanes, numbers: Value) -> Value {
    builder.ins().bitcast(lanes.mask(), little(), numbers)
}

/// How lanes are counted when a vector's bits are taken for another type.
pub(super) fn little() -> MemFlagsData {
    MemFlagsData::new().with_endianness(Endianness::Little)
}
