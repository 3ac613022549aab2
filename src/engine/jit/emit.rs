//! The machine-code rules of single operations.
//!
//! Nothing here contracts a product and a sum to one rounding or reassociates, so the bits are
//! those of the table's value rules, on every processor.
//!
//! Choices are made with masks, in vectors whose first lane counts: the comparison of two scalars
//! ends in a jump, and the jumps of a solid's hundred minima are mispredicted at every point.

use crate::graph::Op;
use crate::graph::operation::{Instruction, MachineCode};
use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::types::{F64X2, I64X2};
use cranelift_codegen::ir::{Endianness, InstBuilder, MemFlagsData, Value};
use cranelift_frontend::FunctionBuilder;

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
        Instruction::Min => ins.fmin(a, b),
        Instruction::Max => ins.fmax(a, b),
        Instruction::Less => return compare(builder, FloatCC::LessThan, a, b),
        Instruction::LessEqual => return compare(builder, FloatCC::LessThanOrEqual, a, b),
        Instruction::Equal => return compare(builder, FloatCC::Equal, a, b),
        Instruction::IsNumber => return compare(builder, FloatCC::Equal, a, a),
        Instruction::Select => {
            let mask = nonzero(builder, &mut operands[0]);
            let [b, c] = [b, c].map(|arm| builder.ins().splat(F64X2, arm));
            let mask = builder.ins().bitcast(F64X2, lanes(), mask);
            let chosen = builder.ins().bitselect(mask, b, c);
            builder.ins().extractlane(chosen, 0)
        }
        Instruction::ChainProduct => {
            let product = ins.fmul(a, b);
            let a = nonzero(builder, &mut operands[0]);
            let b = nonzero(builder, &mut operands[1]);
            let both = builder.ins().band(a, b);
            masked(builder, both, product)
        }
    };
    Number::from(value)
}

/// 1.0 where the comparison holds, else 0.0. Where only a select uses it, the number is not
/// computed: instructions without a use are dropped.
fn compare(builder: &mut FunctionBuilder, comparison: FloatCC, a: Value, b: Value) -> Number {
    let [a, b] = [a, b].map(|operand| builder.ins().splat(F64X2, operand));
    let mask = builder.ins().fcmp(comparison, a, b);
    let one = builder.ins().f64const(1.0);
    Number {
        value: masked(builder, mask, one),
        nonzero: Some(mask),
    }
}

/// The number where the mask is set, else 0.
fn masked(builder: &mut FunctionBuilder, mask: Value, number: Value) -> Value {
    let number = builder.ins().splat(F64X2, number);
    let bits = builder.ins().bitcast(I64X2, lanes(), number);
    let bits = builder.ins().band(bits, mask);
    let number = builder.ins().bitcast(F64X2, lanes(), bits);
    builder.ins().extractlane(number, 0)
}

/// Where the number is not 0; a NaN is not.
fn nonzero(builder: &mut FunctionBuilder, number: &mut Number) -> Value {
    if let Some(mask) = number.nonzero {
        return mask;
    }
    let zero = builder.ins().f64const(0.0);
    let [value, zero] = [number.value, zero].map(|value| builder.ins().splat(F64X2, value));
    let mask = builder.ins().fcmp(FloatCC::NotEqual, value, zero);
    number.nonzero = Some(mask);
    mask
}

/// How lanes are counted when a vector's bits are taken for another type.
fn lanes() -> MemFlagsData {
    MemFlagsData::new().with_endianness(Endianness::Little)
}
