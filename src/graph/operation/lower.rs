//! Lowerings: operations that processors lack, written in terms of those that they have.
//!
//! Each lowering repeats the operation's value rule step by step, so machine code gives the same
//! bits as [`super::value`].

use super::value::by_squaring;
use crate::graph::{Graph, NodeId, Op};

/// x^n by repeated multiplication; the second operand is a constant.
pub(super) fn integer_power(graph: &mut Graph, operands: &[NodeId]) -> NodeId {
    let (base, exponent) = (operands[0], operands[1]);
    let exponent = graph.constant_value(exponent).unwrap_or(f64::NAN);
    let one = graph.constant(1.0);
    if exponent == 0.0 {
        let undefined = graph.constant(f64::NAN);
        let defined = graph.apply(Op::IsNumber, &[base]);
        return graph.apply(Op::Select, &[defined, one, undefined]);
    }
    let magnitude = by_squaring(base, exponent.abs() as u32, |a, b| {
        graph.apply(Op::Multiply, &[a, b])
    });
    if exponent < 0.0 {
        graph.apply(Op::Divide, &[one, magnitude])
    } else {
        magnitude
    }
}

/// −1, 0 or 1.
pub(super) fn sign(graph: &mut Graph, operands: &[NodeId]) -> NodeId {
    let a = operands[0];
    let [minus_one, zero, one] = [-1.0, 0.0, 1.0].map(|value| graph.constant(value));
    let negative = graph.apply(Op::Less, &[a, zero]);
    let positive = graph.apply(Op::Less, &[zero, a]);
    let not_positive = graph.apply(Op::Select, &[negative, minus_one, a]);
    graph.apply(Op::Select, &[positive, one, not_positive])
}

/// The nearest integer, halves away from zero.
pub(super) fn round(graph: &mut Graph, operands: &[NodeId]) -> NodeId {
    let a = operands[0];
    let [zero, half] = [0.0, 0.5].map(|value| graph.constant(value));
    let floor = graph.apply(Op::Floor, &[a]);
    let ceil = graph.apply(Op::Ceil, &[a]);
    let above = graph.apply(Op::Subtract, &[ceil, a]);
    let below = graph.apply(Op::Subtract, &[a, floor]);
    let down = graph.apply(Op::LessEqual, &[half, above]);
    let up = graph.apply(Op::LessEqual, &[half, below]);
    let if_negative = graph.apply(Op::Select, &[down, floor, ceil]);
    let otherwise = graph.apply(Op::Select, &[up, ceil, floor]);
    let negative = graph.apply(Op::Less, &[a, zero]);
    graph.apply(Op::Select, &[negative, if_negative, otherwise])
}

/// a − b·⌊a/b⌋.
pub(super) fn modulo(graph: &mut Graph, operands: &[NodeId]) -> NodeId {
    let (a, b) = (operands[0], operands[1]);
    let quotient = graph.apply(Op::Divide, &[a, b]);
    let periods = graph.apply(Op::Floor, &[quotient]);
    let offset = graph.apply(Op::Multiply, &[b, periods]);
    graph.apply(Op::Subtract, &[a, offset])
}
