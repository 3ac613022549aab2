//! A graph as text: one line a node, in evaluation order, and the roots at the end.
//!
//! ```text
//! n0 = x
//! n1 = square n0
//! n2 = 0.25
//! n3 = subtract n1 n2
//! output n3
//! ```
//!
//! Nodes are numbered in the order in which an evaluation from the first root's first operand on
//! needs them, so the text depends on the expressions alone and not on what else is in the graph.

use std::fmt::Write;

use super::{Graph, Node, NodeId};

/// The roots and all that they are made of, as in the module's example. Parameters are named by
/// their places, `q0`; numbers have all the digits that tell them apart.
pub fn text(graph: &Graph, roots: &[NodeId]) -> String {
    let mut numbers = vec![0; graph.len()];
    let mut text = String::new();
    for (number, id) in evaluation_order(graph, roots).into_iter().enumerate() {
        numbers[id.index()] = number;
        // Writing to a string cannot fail, here and below.
        let _ = write!(text, "n{number} = ");
        let node = graph.node(id);
        let _ = match node {
            Node::Constant(bits) => write!(text, "{:?}", f64::from_bits(bits)),
            Node::Coordinate(axis) => match ["x", "y", "z"].get(usize::from(axis)) {
                Some(name) => write!(text, "{name}"),
                None => write!(text, "x{axis}"),
            },
            Node::Parameter(index) => write!(text, "q{index}"),
            Node::Apply(op, _) => write!(text, "{}", op.name()),
        };
        push_numbers(&mut text, node.operands(), &numbers);
    }
    text.push_str("output");
    push_numbers(&mut text, roots, &numbers);
    text
}

/// Ends a line with numbered nodes.
fn push_numbers(text: &mut String, nodes: &[NodeId], numbers: &[usize]) {
    for id in nodes {
        let _ = write!(text, " n{}", numbers[id.index()]);
    }
    text.push('\n');
}

/// The nodes that the roots are made of, operands first and from the left: depth-first, with the
/// way back on a stack of its own.
fn evaluation_order(graph: &Graph, roots: &[NodeId]) -> Vec<NodeId> {
    let mut order = Vec::new();
    let mut entered = vec![false; graph.len()];
    // The nodes on the way down, and how many of their operands have been entered.
    let mut path: Vec<(NodeId, usize)> = Vec::new();
    for &root in roots {
        if !std::mem::replace(&mut entered[root.index()], true) {
            path.push((root, 0));
        }
        while let Some((id, place)) = path.pop() {
            match graph.node(id).operands().get(place) {
                Some(&operand) => {
                    path.push((id, place + 1));
                    if !std::mem::replace(&mut entered[operand.index()], true) {
                        path.push((operand, 0));
                    }
                }
                None => order.push(id),
            }
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::Op;

    #[test]
    fn a_graph_prints_as_one_line_a_node_whatever_else_is_in_the_session() {
        let mut graph = Graph::new();
        let other = graph.parameter(7);
        graph.apply(Op::Sin, &[other]);
        let quarter = graph.constant(0.1);
        let q = graph.parameter(0);
        let x = graph.coordinate(0);
        let square = graph.apply(Op::Square, &[x]);
        let sum = graph.apply(Op::Add, &[square, q]);
        let scaled = graph.apply(Op::Multiply, &[sum, quarter]);
        let tiny = graph.constant(-5e-324);
        let least = graph.apply(Op::Max, &[scaled, tiny]);
        assert_eq!(
            text(&graph, &[least, square]),
            "n0 = x\nn1 = square n0\nn2 = q0\nn3 = add n1 n2\nn4 = 0.1\nn5 = multiply n3 n4\n\
             n6 = -5e-324\nn7 = max n5 n6\noutput n7 n1\n"
        );
    }

    #[test]
    fn constants_print_so_that_they_can_be_told_apart() {
        let mut graph = Graph::new();
        let values = [-0.0, 0.0, 1e300, f64::NAN, f64::NEG_INFINITY];
        let roots = values.map(|value| graph.constant(value));
        assert_eq!(
            text(&graph, &roots),
            "n0 = -0.0\nn1 = 0.0\nn2 = 1e300\nn3 = NaN\nn4 = -inf\noutput n0 n1 n2 n3 n4\n"
        );
    }
}
