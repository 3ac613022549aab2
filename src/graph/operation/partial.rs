//! Derivative rules: the partial derivatives of an operation, built as graph.
//!
//! Every rule is given the operation's operands and its result, which it may use again: sharing
//! is what keeps derivatives small. Where a partial derivative is exactly 0 the chain rule lets it
//! absorb whatever the other factor is ([`super::value::chain_product`]), so rules need not guard
//! against infinities that a zero cancels. A root whose value is NaN has its derivatives set to
//! NaN at the end ([`crate::graph::derive`]), so rules need not repeat the operation's domain.

use crate::graph::{Graph, NodeId, Op};

/// 1.
pub(super) fn one(graph: &mut Graph, _: [NodeId; 3], _: NodeId) -> NodeId {
    graph.constant(1.0)
}

/// −1.
pub(super) fn minus_one(graph: &mut Graph, _: [NodeId; 3], _: NodeId) -> NodeId {
    graph.constant(-1.0)
}

/// a: what a product is multiplied by in its second operand.
pub(super) fn first_operand(_: &mut Graph, [a, ..]: [NodeId; 3], _: NodeId) -> NodeId {
    a
}

/// b: what a product is multiplied by in its first operand.
pub(super) fn second_operand(_: &mut Graph, [_, b, _]: [NodeId; 3], _: NodeId) -> NodeId {
    b
}

/// The result itself: exp′ = exp.
pub(super) fn result(_: &mut Graph, _: [NodeId; 3], result: NodeId) -> NodeId {
    result
}

/// ∂(a/b)/∂a = 1/b, and log′ too, where `b` is the operand.
pub(super) fn reciprocal(graph: &mut Graph, b: NodeId) -> NodeId {
    let one = graph.constant(1.0);
    graph.apply(Op::Divide, &[one, b])
}

/// ∂(a/b)/∂b = −(a/b)/b.
pub(super) fn divisor(graph: &mut Graph, [_, b, _]: [NodeId; 3], result: NodeId) -> NodeId {
    let quotient = graph.apply(Op::Divide, &[result, b]);
    graph.apply(Op::Negate, &[quotient])
}

/// ∂a²/∂a = 2a.
pub(super) fn square(graph: &mut Graph, [a, ..]: [NodeId; 3], _: NodeId) -> NodeId {
    let two = graph.constant(2.0);
    graph.apply(Op::Multiply, &[two, a])
}

/// ∂a^b/∂a = b·a^(b−1), and NaN where a = 0 and b < 0.
pub(super) fn power_base(graph: &mut Graph, [a, b, _]: [NodeId; 3], _: NodeId) -> NodeId {
    let [zero, one] = [0.0, 1.0].map(|value| graph.constant(value));
    let less = graph.apply(Op::Subtract, &[b, one]);
    let power = graph.apply(Op::Power, &[a, less]);
    let slope = graph.apply(Op::ChainProduct, &[b, power]);
    let is_negative = graph.apply(Op::Less, &[b, zero]);
    let at_pole = nan_at_zero(graph, a, slope);
    graph.apply(Op::Select, &[is_negative, at_pole, slope])
}

/// ∂a^b/∂b = a^b·log a.
pub(super) fn power_exponent(graph: &mut Graph, [a, ..]: [NodeId; 3], result: NodeId) -> NodeId {
    let log = graph.apply(Op::Log, &[a]);
    graph.apply(Op::ChainProduct, &[result, log])
}

/// ∂a^n/∂a = n·a^(n−1), and NaN where a = 0 and n < 0.
pub(super) fn integer_power(graph: &mut Graph, [a, n, _]: [NodeId; 3], _: NodeId) -> NodeId {
    let one = graph.constant(1.0);
    let less = graph.apply(Op::Subtract, &[n, one]);
    let power = graph.apply(Op::IntegerPower, &[a, less]);
    let slope = graph.apply(Op::ChainProduct, &[n, power]);
    match graph.constant_value(n) {
        Some(exponent) if exponent < 0.0 => nan_at_zero(graph, a, slope),
        _ => slope,
    }
}

/// NaN where a = 0, else the slope.
fn nan_at_zero(graph: &mut Graph, a: NodeId, slope: NodeId) -> NodeId {
    let [zero, undefined] = [0.0, f64::NAN].map(|value| graph.constant(value));
    let is_zero = graph.apply(Op::Equal, &[a, zero]);
    graph.apply(Op::Select, &[is_zero, undefined, slope])
}

/// ∂√a/∂a = 0.5/√a.
pub(super) fn square_root(graph: &mut Graph, _: [NodeId; 3], result: NodeId) -> NodeId {
    let half = graph.constant(0.5);
    graph.apply(Op::Divide, &[half, result])
}

/// cos′ = −sin.
pub(super) fn cos(graph: &mut Graph, [a, ..]: [NodeId; 3], _: NodeId) -> NodeId {
    let sin = graph.apply(Op::Sin, &[a]);
    graph.apply(Op::Negate, &[sin])
}

/// tan′ = 1 + tan².
pub(super) fn tan(graph: &mut Graph, _: [NodeId; 3], result: NodeId) -> NodeId {
    let one = graph.constant(1.0);
    let square = graph.apply(Op::Square, &[result]);
    graph.apply(Op::Add, &[one, square])
}

/// asin′ = 1/√((1 − a)(1 + a)): the product does not cancel near ±1, as 1 − a² does.
pub(super) fn asin(graph: &mut Graph, [a, ..]: [NodeId; 3], _: NodeId) -> NodeId {
    let one = graph.constant(1.0);
    let below = graph.apply(Op::Subtract, &[one, a]);
    let above = graph.apply(Op::Add, &[one, a]);
    let product = graph.apply(Op::Multiply, &[below, above]);
    let root = graph.apply(Op::SquareRoot, &[product]);
    reciprocal(graph, root)
}

/// acos′ = −asin′.
pub(super) fn acos(graph: &mut Graph, operands: [NodeId; 3], result: NodeId) -> NodeId {
    let opposite = asin(graph, operands, result);
    graph.apply(Op::Negate, &[opposite])
}

/// atan′ = 1/(1 + a²).
pub(super) fn atan(graph: &mut Graph, [a, ..]: [NodeId; 3], _: NodeId) -> NodeId {
    let one = graph.constant(1.0);
    let square = graph.apply(Op::Square, &[a]);
    let sum = graph.apply(Op::Add, &[one, square]);
    reciprocal(graph, sum)
}

/// ∂atan2(a, b)/∂a = b/(a² + b²).
pub(super) fn atan2_first(graph: &mut Graph, [a, b, _]: [NodeId; 3], _: NodeId) -> NodeId {
    let norm2 = sum_of_squares(graph, a, b);
    graph.apply(Op::Divide, &[b, norm2])
}

/// ∂atan2(a, b)/∂b = −a/(a² + b²).
pub(super) fn atan2_second(graph: &mut Graph, [a, b, _]: [NodeId; 3], _: NodeId) -> NodeId {
    let norm2 = sum_of_squares(graph, a, b);
    let slope = graph.apply(Op::Divide, &[a, norm2]);
    graph.apply(Op::Negate, &[slope])
}

fn sum_of_squares(graph: &mut Graph, a: NodeId, b: NodeId) -> NodeId {
    let [a, b] = [a, b].map(|side| graph.apply(Op::Square, &[side]));
    graph.apply(Op::Add, &[a, b])
}

/// tanh′ = 1/cosh², which keeps its digits where 1 − tanh² loses them.
pub(super) fn tanh(graph: &mut Graph, [a, ..]: [NodeId; 3], _: NodeId) -> NodeId {
    let cosh = graph.apply(Op::Cosh, &[a]);
    let reciprocal = reciprocal(graph, cosh);
    graph.apply(Op::Square, &[reciprocal])
}

/// ∂(a mod b)/∂b = −⌊a/b⌋.
pub(super) fn modulus(graph: &mut Graph, [a, b, _]: [NodeId; 3], _: NodeId) -> NodeId {
    let quotient = graph.apply(Op::Divide, &[a, b]);
    let periods = graph.apply(Op::Floor, &[quotient]);
    graph.apply(Op::Negate, &[periods])
}

/// ∂hypot(a, b)/∂a = a/hypot(a, b), and 0 at the origin.
pub(super) fn hypot(graph: &mut Graph, side: NodeId, result: NodeId) -> NodeId {
    let zero = graph.constant(0.0);
    let at_origin = graph.apply(Op::Equal, &[result, zero]);
    let cosine = graph.apply(Op::Divide, &[side, result]);
    graph.apply(Op::Select, &[at_origin, zero, cosine])
}
