//! A function near infinity, as a function near 0.
//!
//! With x = u/t, where t > 0 and the largest |u_i| is 1, a large sphere is a small t. For a function
//! of degree d, G(u, t) = t^d·F(u/t) has the sign of F and, where F is a polynomial, is one too:
//! its terms of highest degree remain at t = 0. So what a polynomial does far away, where its terms
//! are differences of infinities, can be seen by interval arithmetic on a bounded set. (In the
//! plane this is projective geometry's line at infinity.) Functions without a degree, such as
//! exp, are computed of F's own operands: there unbounded intervals serve.

use super::operation::Scaling;
use super::{Graph, Node, NodeId, Op};
use rustc_hash::FxHashMap;

/// A node of F as t^−degree·scaled.
#[derive(Clone, Copy)]
struct Projected {
    degree: f64,
    scaled: NodeId,
}

/// G of a root F: `direction` are the nodes that take the place of the coordinates, and `t` that
/// of t. Costs time in proportion to F's graph.
pub fn projective(graph: &mut Graph, root: NodeId, direction: &[NodeId], t: NodeId) -> NodeId {
    let mut map: FxHashMap<NodeId, Projected> = FxHashMap::default();
    for id in graph.reachable(&[root]) {
        let projected = match graph.node(id) {
            Node::Coordinate(axis) => Projected {
                degree: 1.0,
                scaled: direction.get(usize::from(axis)).copied().unwrap_or(id),
            },
            Node::Constant(_) | Node::Parameter(_) => Projected {
                degree: 0.0,
                scaled: id,
            },
            Node::Apply(op, operands) => {
                let operands = operands.map(|operand| map[&operand]);
                apply(graph, op, &operands[..op.arity()], t)
            }
        };
        map.insert(id, projected);
    }
    map[&root].scaled
}

/// An operation on such operands.
fn apply(graph: &mut Graph, op: Op, operands: &[Projected], t: NodeId) -> Projected {
    let degree = |place: usize| operands[place].degree;
    let (degree, share) = match op.operation().scaling {
        Scaling::Shared => (largest(operands), Some(largest(operands))),
        Scaling::Invariant => (0.0, Some(largest(operands))),
        Scaling::Chosen => {
            let common = largest(&operands[1..]);
            let mut nodes = vec![at_degree(graph, operands[0], 0.0, t)];
            for &operand in &operands[1..] {
                nodes.push(at_degree(graph, operand, common, t));
            }
            let scaled = graph.apply(op, &nodes);
            return Projected {
                degree: common,
                scaled,
            };
        }
        Scaling::Product => (degree(0) + degree(1), None),
        Scaling::Quotient => (degree(0) - degree(1), None),
        Scaling::Power(exponent) => (exponent * degree(0), None),
        Scaling::PowerOfOperand => match graph.constant_value(operands[1].scaled) {
            Some(exponent) if operands[1].degree == 0.0 && exponent.is_finite() => {
                (exponent * degree(0), None)
            }
            _ => (0.0, Some(0.0)),
        },
        Scaling::None => (0.0, Some(0.0)),
    };
    let nodes: Vec<NodeId> = operands
        .iter()
        .map(|&operand| match share {
            Some(common) => at_degree(graph, operand, common, t),
            None => operand.scaled,
        })
        .collect();
    Projected {
        degree,
        scaled: graph.apply(op, &nodes),
    }
}

/// The highest degree.
fn largest(operands: &[Projected]) -> f64 {
    let degrees = operands.iter().map(|operand| operand.degree);
    degrees.fold(f64::NEG_INFINITY, f64::max)
}

/// The node with which t^−degree is left: multiplied or divided by a power of t.
fn at_degree(graph: &mut Graph, operand: Projected, degree: f64, t: NodeId) -> NodeId {
    let exponent = degree - operand.degree;
    if exponent == 0.0 {
        return operand.scaled;
    }
    let power = match exponent.abs() {
        1.0 => t,
        2.0 => graph.apply(Op::Square, &[t]),
        magnitude => {
            let is_whole = magnitude.fract() == 0.0 && magnitude < 1e6;
            let op = if is_whole {
                Op::IntegerPower
            } else {
                Op::Power
            };
            let magnitude = graph.constant(magnitude);
            graph.apply(op, &[t, magnitude])
        }
    };
    let op = if exponent > 0.0 {
        Op::Multiply
    } else {
        Op::Divide
    };
    graph.apply(op, &[operand.scaled, power])
}
