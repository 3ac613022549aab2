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

use rustc_hash::FxHashMap;

use super::{Graph, Node, NodeId};

/// The roots and all that they are made of, as in the module's example. Parameters are named by
/// their places, `q0`; numbers have all the digits that tell them apart.
pub fn text(graph: &Graph, roots: &[NodeId]) -> String {
    let order = evaluation_order(graph, roots);
    let mut numbers = FxHashMap::default();
    let mut lines = String::new();
    for (number, &id) in order.iter().enumerate() {
        numbers.insert(id, number);
        let node = graph.node(id);
        let what = match node {
            Node::Constant(bits) => format!("{:?}", f64::from_bits(bits)),
            Node::Coordinate(axis) => ["x", "y", "z"][usize::from(axis) % 3].to_string(),
            Node::Parameter(index) => format!("q{index}"),
            Node::Apply(op, _) => named(op.name(), node.operands(), &numbers),
        };
        // Writing to a string cannot fail.
        let _ = writeln!(lines, "n{number} = {what}");
    }
    lines.push_str(&named("output", roots, &numbers));
    lines.push('\n');
    lines
}

/// A word and numbered nodes.
fn named(word: &str, nodes: &[NodeId], numbers: &FxHashMap<NodeId, usize>) -> String {
    let mut words = word.to_string();
    for id in nodes {
        // Writing to a string cannot fail.
        let _ = write!(words, " n{}", numbers[id]);
    }
    words
}

/// The nodes that the roots are made of, operands first and from the left: depth-first, with the
/// way back on a stack of its own.
fn evaluation_order(graph: &Graph, roots: &[NodeId]) -> Vec<NodeId> {
    let mut order = Vec::new();
    // How many operands of a node have been asked for.
    let mut asked: FxHashMap<NodeId, usize> = FxHashMap::default();
    let mut path: Vec<NodeId> = Vec::new();
    for &root in roots {
        let mut next = (!asked.contains_key(&root)).then_some(root);
        loop {
            if let Some(id) = next.take() {
                asked.insert(id, 0);
                path.push(id);
            }
            let Some(&id) = path.last() else {
                break;
            };
            let node = graph.node(id);
            let place = asked.entry(id).or_default();
            match node.operands().get(*place) {
                Some(operand) => {
                    *place += 1;
                    next = (!asked.contains_key(operand)).then_some(*operand);
                }
                None => {
                    order.push(id);
                    path.pop();
                }
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
