//! The reference interpreter: executes the steps one by one with the table's value rules.
//!
//! It computes the uniforms of every kernel, serves where no machine code can be made, and is
//! what machine code is tested against, bit for bit.

use super::lower::{Lowered, Operand, Step};

/// Everything that is the same for all points: q, then what the kernel computes of q alone.
/// Missing parameters are NaN, superfluous ones are ignored.
pub(super) fn uniforms(lowered: &Lowered, q: &[f64]) -> Vec<f64> {
    let mut uniforms = Vec::with_capacity(lowered.uniforms());
    uniforms.extend(q.iter().take(lowered.parameters));
    uniforms.resize(lowered.parameters, f64::NAN);
    for step in &lowered.uniform_steps {
        uniforms.push(result(step, &[], &uniforms, &[]));
    }
    uniforms
}

/// All outputs at one point, into `outputs`. `registers` is memory to work in.
pub(super) fn evaluate(
    lowered: &Lowered,
    point: &[f64; 3],
    uniforms: &[f64],
    registers: &mut Vec<f64>,
    mut output: impl FnMut(usize, f64),
) {
    registers.clear();
    for step in &lowered.steps {
        registers.push(result(step, point, uniforms, registers));
    }
    for (index, &operand) in lowered.outputs.iter().enumerate() {
        output(index, value(operand, point, uniforms, registers));
    }
}

/// The result of one step.
fn result(step: &Step, point: &[f64], uniforms: &[f64], registers: &[f64]) -> f64 {
    let operands = step
        .operands
        .map(|operand| value(operand, point, uniforms, registers));
    step.operation.value(operands)
}

/// The value of an operand. Operands refer to what exists by construction of the steps.
fn value(operand: Operand, point: &[f64], uniforms: &[f64], registers: &[f64]) -> f64 {
    match operand {
        Operand::Constant(number) => number,
        Operand::Uniform(index) => uniforms[index as usize],
        Operand::Coordinate(axis) => point[usize::from(axis)],
        Operand::Register(index) => registers[index as usize],
    }
}
