//! Identities that a new node is simplified by.
//!
//! Only those that give the same bits for every input, NaN, infinities and signed zeros included
//! (the sign of a zero that `chain_product` gives is the one thing left open). What a reader
//! may miss, and why it is left out:
//!
//! * 0·u, u − u, u/u, u^0: not 0 or 1 where u is infinite or NaN;
//! * u + 0 and 0 − u: −0 + 0 is 0, and 0 − 0 is not −0;
//! * −(a − b) = b − a: differs in the sign of zero where a = b;
//! * reassociation, distribution, a/c as a·(1/c) unless c is a power of two: they round
//!   differently;
//! * √(u²) = |u|, exp(log u) = u and their like: overflow, domain, rounding;
//! * u^0.5 = √u: differ at −0 and −∞;
//! * any operation with a NaN operand: the result would no longer depend on its variables, and
//!   their derivatives would be 0 beside a value that is NaN.

use super::operation::value::{is_integer_power, is_power_of_two};
use super::{Graph, Node, NodeId, Op};

/// A node that is always equal to the operation on these operands and simpler, if a rule knows
/// one. Not all operands are constants.
pub(super) fn simpler(graph: &mut Graph, op: Op, operands: [NodeId; 3]) -> Option<NodeId> {
    let [a, b, c] = operands;
    match op {
        Op::Add => add(graph, a, b),
        Op::Subtract => subtract(graph, a, b),
        Op::Multiply => multiply(graph, a, b),
        Op::Divide => divide(graph, a, b),
        Op::Power => power(graph, a, b),
        Op::IntegerPower => integer_power(graph, a, b),
        Op::Negate => operand_of(graph, Op::Negate, a),
        Op::IsNumber if is_truth(graph, a) => Some(graph.constant(1.0)),
        Op::Square | Op::Cos | Op::Cosh | Op::IsNumber => {
            let even = without_sign(graph, a)?;
            Some(graph.apply(op, &[even]))
        }
        Op::Abs => abs(graph, a),
        Op::Floor | Op::Ceil | Op::Round => is_integral(graph, a).then_some(a),
        Op::Min | Op::Max => (a == b).then_some(a),
        Op::Less => (a == b).then(|| graph.constant(0.0)),
        Op::LessEqual | Op::Equal => (a == b).then(|| graph.apply(Op::IsNumber, &[a])),
        Op::Select => select(graph, a, b, c),
        Op::ChainProduct => chain_product(graph, a, b),
        _ => None,
    }
}

fn add(graph: &mut Graph, a: NodeId, b: NodeId) -> Option<NodeId> {
    if is_constant(graph, b, -0.0) {
        Some(a)
    } else if is_constant(graph, a, -0.0) {
        Some(b)
    } else if let Some(opposite) = operand_of(graph, Op::Negate, b) {
        Some(graph.apply(Op::Subtract, &[a, opposite]))
    } else {
        let opposite = operand_of(graph, Op::Negate, a)?;
        Some(graph.apply(Op::Subtract, &[b, opposite]))
    }
}

fn subtract(graph: &mut Graph, a: NodeId, b: NodeId) -> Option<NodeId> {
    if is_constant(graph, b, 0.0) {
        Some(a)
    } else if is_constant(graph, a, -0.0) {
        Some(graph.apply(Op::Negate, &[b]))
    } else {
        let opposite = operand_of(graph, Op::Negate, b)?;
        Some(graph.apply(Op::Add, &[a, opposite]))
    }
}

fn multiply(graph: &mut Graph, a: NodeId, b: NodeId) -> Option<NodeId> {
    if a == b {
        return Some(graph.apply(Op::Square, &[a]));
    }
    if let Some([a, b]) = both_operands_of_negate(graph, a, b) {
        return Some(graph.apply(Op::Multiply, &[a, b]));
    }
    multiply_by_constant(graph, a, b).or_else(|| multiply_by_constant(graph, b, a))
}

/// a·c where c is a constant.
fn multiply_by_constant(graph: &mut Graph, a: NodeId, c: NodeId) -> Option<NodeId> {
    let factor = graph.constant_value(c)?;
    if factor == 1.0 {
        Some(a)
    } else if factor == -1.0 {
        Some(graph.apply(Op::Negate, &[a]))
    } else {
        let opposite = operand_of(graph, Op::Negate, a)?;
        let factor = graph.constant(-factor);
        Some(graph.apply(Op::Multiply, &[opposite, factor]))
    }
}

fn divide(graph: &mut Graph, a: NodeId, b: NodeId) -> Option<NodeId> {
    if let Some([a, b]) = both_operands_of_negate(graph, a, b) {
        return Some(graph.apply(Op::Divide, &[a, b]));
    }
    let divisor = graph.constant_value(b)?;
    if let Some(reciprocal) = exact_reciprocal(divisor) {
        let reciprocal = graph.constant(reciprocal);
        return Some(graph.apply(Op::Multiply, &[a, reciprocal]));
    }
    let opposite = operand_of(graph, Op::Negate, a)?;
    let divisor = graph.constant(-divisor);
    Some(graph.apply(Op::Divide, &[opposite, divisor]))
}

fn power(graph: &mut Graph, a: NodeId, b: NodeId) -> Option<NodeId> {
    match graph.constant_value(b)? {
        0.5 => Some(graph.apply(Op::SquareRoot, &[a])),
        exponent if is_integer_power(exponent) => Some(graph.apply(Op::IntegerPower, &[a, b])),
        _ => None,
    }
}

/// Keeps the promise that an integer power has a constant integer exponent, other than 1 and 2.
fn integer_power(graph: &mut Graph, a: NodeId, b: NodeId) -> Option<NodeId> {
    match graph.constant_value(b) {
        Some(exponent) if is_integer_power(exponent) => {
            if exponent == 1.0 {
                Some(a)
            } else if exponent == 2.0 {
                Some(graph.apply(Op::Square, &[a]))
            } else if exponent % 2.0 == 0.0 {
                let even = without_sign(graph, a)?;
                Some(graph.apply(Op::IntegerPower, &[even, b]))
            } else {
                None
            }
        }
        _ => Some(graph.apply(Op::Power, &[a, b])),
    }
}

fn abs(graph: &mut Graph, a: NodeId) -> Option<NodeId> {
    match graph.node(a) {
        Node::Apply(Op::Abs | Op::Square | Op::Exp | Op::Hypot, _) => Some(a),
        Node::Apply(Op::Negate, [opposite, ..]) => Some(graph.apply(Op::Abs, &[opposite])),
        _ => None,
    }
}

fn select(graph: &mut Graph, condition: NodeId, a: NodeId, b: NodeId) -> Option<NodeId> {
    if let Some(condition) = graph.constant_value(condition) {
        return Some(if condition != 0.0 { a } else { b });
    }
    if a == b {
        return Some(a);
    }
    // A branch that asks for the same condition again is decided.
    if let Node::Apply(Op::Select, [again, inner, _]) = graph.node(a)
        && again == condition
    {
        return Some(graph.apply(Op::Select, &[condition, inner, b]));
    }
    if let Node::Apply(Op::Select, [again, _, inner]) = graph.node(b)
        && again == condition
    {
        return Some(graph.apply(Op::Select, &[condition, a, inner]));
    }
    let Node::Apply(op, [tested, ..]) = graph.node(condition) else {
        return None;
    };
    if op.is_truth() && is_constant(graph, a, 1.0) && is_constant(graph, b, 0.0) {
        Some(condition)
    } else if op == Op::IsNumber && tested == a && is_constant(graph, b, f64::NAN) {
        Some(a)
    } else {
        None
    }
}

fn chain_product(graph: &mut Graph, a: NodeId, b: NodeId) -> Option<NodeId> {
    if a == b {
        return Some(graph.apply(Op::Square, &[a]));
    }
    if let Some([a, b]) = both_operands_of_negate(graph, a, b) {
        return Some(graph.apply(Op::ChainProduct, &[a, b]));
    }
    for (factor, other) in [(a, b), (b, a)] {
        if let Some(value) = graph.constant_value(factor) {
            if value == 0.0 {
                return Some(graph.constant(0.0));
            }
            if value.is_finite() {
                return Some(graph.apply(Op::Multiply, &[other, factor]));
            }
        }
        if is_truth(graph, factor) {
            let zero = graph.constant(0.0);
            return Some(graph.apply(Op::Select, &[factor, other, zero]));
        }
    }
    None
}

/// Whether the node is this constant, to the bit.
fn is_constant(graph: &Graph, id: NodeId, value: f64) -> bool {
    graph.node(id) == Node::of_number(value)
}

/// Whether the node is a comparison: 1 or 0.
fn is_truth(graph: &Graph, id: NodeId) -> bool {
    matches!(graph.node(id), Node::Apply(op, _) if op.is_truth())
}

/// Whether the node has only integral, infinite and NaN values.
fn is_integral(graph: &Graph, id: NodeId) -> bool {
    matches!(
        graph.node(id),
        Node::Apply(Op::Floor | Op::Ceil | Op::Round | Op::Sign, _)
    )
}

/// The operand of a node that is this operation of one operand.
fn operand_of(graph: &Graph, op: Op, id: NodeId) -> Option<NodeId> {
    match graph.node(id) {
        Node::Apply(found, [operand, ..]) if found == op => Some(operand),
        _ => None,
    }
}

/// What two opposites are opposite of.
fn both_operands_of_negate(graph: &Graph, a: NodeId, b: NodeId) -> Option<[NodeId; 2]> {
    Some([
        operand_of(graph, Op::Negate, a)?,
        operand_of(graph, Op::Negate, b)?,
    ])
}

/// The operand of −u or |u|: what an even function may take instead.
fn without_sign(graph: &Graph, id: NodeId) -> Option<NodeId> {
    operand_of(graph, Op::Negate, id).or_else(|| operand_of(graph, Op::Abs, id))
}

/// 1/c where that is exact, so that dividing by c and multiplying by it round alike.
fn exact_reciprocal(c: f64) -> Option<f64> {
    let reciprocal = 1.0 / c;
    let is_exact = is_power_of_two(c) && reciprocal.is_finite();
    is_exact.then_some(reciprocal)
}

#[cfg(test)]
mod tests;
