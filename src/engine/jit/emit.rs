//! The machine-code rules of single operations.
//!
//! Nothing here contracts a product and a sum to one rounding or reassociates, so the bits are
//! those of the table's value rules, on every processor.

use crate::graph::Op;
use crate::graph::operation::{Instruction, MachineCode};
use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::{InstBuilder, Value};
use cranelift_frontend::FunctionBuilder;

/// A value in the code, and its truth as a bit where a comparison made it.
pub(super) type Emitted = (Value, Option<Value>);

/// The instruction of a native operation; `None` for one that is called.
pub(super) fn native(op: Op) -> Option<Instruction> {
    match op.operation().code {
        MachineCode::Native(instruction) => Some(instruction),
        MachineCode::Host | MachineCode::Lower(_) => None,
    }
}

/// Emits an instruction. `truth` is the bit of the first operand, if it has one.
pub(super) fn emit(
    builder: &mut FunctionBuilder,
    instruction: Instruction,
    operands: [Value; 3],
    truth: Option<Value>,
) -> Emitted {
    let [a, b, c] = operands;
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
        Instruction::IsNumber => return compare(builder, FloatCC::Ordered, a, a),
        Instruction::Select => {
            let truth = truth.unwrap_or_else(|| is_not_zero(builder, a));
            builder.ins().select(truth, b, c)
        }
        Instruction::ChainProduct => chain_product(builder, a, b),
    };
    (value, None)
}

/// 1.0 where the comparison holds, else 0.0. Where only select uses it, the number is not
/// computed: instructions without a use are dropped.
fn compare(builder: &mut FunctionBuilder, comparison: FloatCC, a: Value, b: Value) -> Emitted {
    let truth = builder.ins().fcmp(comparison, a, b);
    let one = builder.ins().f64const(1.0);
    let zero = builder.ins().f64const(0.0);
    (builder.ins().select(truth, one, zero), Some(truth))
}

/// The product, or 0 where a factor is 0 (whatever the other one is).
fn chain_product(builder: &mut FunctionBuilder, a: Value, b: Value) -> Value {
    let product = builder.ins().fmul(a, b);
    let (a, b) = (is_not_zero(builder, a), is_not_zero(builder, b));
    let both = builder.ins().band(a, b);
    let zero = builder.ins().f64const(0.0);
    builder.ins().select(both, product, zero)
}

/// Whether a ≠ 0; a NaN is not zero.
fn is_not_zero(builder: &mut FunctionBuilder, a: Value) -> Value {
    let zero = builder.ins().f64const(0.0);
    builder.ins().fcmp(FloatCC::NotEqual, a, zero)
}
