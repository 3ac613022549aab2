//! Walks over the graph: what an expression consists of, what it depends on, and what it becomes
//! when leaves are replaced. All walks run along the list of nodes, so depth costs no stack.

use super::{Graph, Node, NodeId};

/// What an expression depends on.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Support {
    /// The coordinates that occur, by their axes, ascending.
    pub coordinates: Vec<u8>,
    /// The parameters that occur, ascending.
    pub parameters: Vec<u32>,
}

impl Graph {
    /// All nodes that the roots are made of, themselves included, ascending: each after its
    /// operands. The time depends on their number, not on the size of the graph.
    pub fn reachable(&self, roots: &[NodeId]) -> Vec<NodeId> {
        let mut seen = vec![false; self.len()];
        let mut nodes = Vec::new();
        let mut see = |id: NodeId, nodes: &mut Vec<NodeId>| {
            if !std::mem::replace(&mut seen[id.index()], true) {
                nodes.push(id);
            }
        };
        for &root in roots {
            see(root, &mut nodes);
        }
        let mut visited = 0;
        while visited < nodes.len() {
            for &operand in self.node(nodes[visited]).operands() {
                see(operand, &mut nodes);
            }
            visited += 1;
        }
        nodes.sort_unstable();
        nodes
    }

    /// The coordinates and parameters that the roots depend on.
    pub fn support(&self, roots: &[NodeId]) -> Support {
        let mut support = Support::default();
        for id in self.reachable(roots) {
            match self.node(id) {
                Node::Coordinate(axis) => support.coordinates.push(axis),
                Node::Parameter(index) => support.parameters.push(index),
                Node::Constant(_) | Node::Apply(..) => {}
            }
        }
        support.coordinates.sort_unstable();
        support.parameters.sort_unstable();
        support
    }

    /// The roots with leaves replaced: `replacement` is asked once for every coordinate and
    /// parameter that occurs, and `None` keeps it. What changes is simplified anew.
    pub fn substitute(
        &mut self,
        roots: &[NodeId],
        mut replacement: impl FnMut(Node) -> Option<NodeId>,
    ) -> Vec<NodeId> {
        let nodes = self.reachable(roots);
        let mut replaced = NodeMap::new(self);
        for id in nodes {
            let new = match self.node(id) {
                Node::Constant(_) => id,
                leaf @ (Node::Coordinate(_) | Node::Parameter(_)) => {
                    replacement(leaf).unwrap_or(id)
                }
                Node::Apply(op, operands) => {
                    let new = operands.map(|operand| replaced.get(operand).unwrap_or(operand));
                    if new == operands {
                        id
                    } else {
                        self.apply(op, &new[..op.arity()])
                    }
                }
            };
            replaced.set(id, new);
        }
        let root = |&root: &NodeId| replaced.get(root).unwrap_or(root);
        roots.iter().map(root).collect()
    }
}

/// One node for some nodes of a graph: 4 bytes for every node of the graph, which the operating
/// system provides, zeroed, when they are first used.
pub(super) struct NodeMap {
    /// One more than the other node's id; 0 for none.
    places: Vec<u32>,
}

impl NodeMap {
    /// Nothing yet for the nodes that are in the graph now.
    pub(super) fn new(graph: &Graph) -> NodeMap {
        NodeMap {
            places: vec![0; graph.len()],
        }
    }

    /// What was last set for a node.
    pub(super) fn get(&self, id: NodeId) -> Option<NodeId> {
        self.places[id.index()].checked_sub(1).map(NodeId)
    }

    /// Sets the node for another one.
    pub(super) fn set(&mut self, id: NodeId, other: NodeId) {
        self.places[id.index()] = other.0 + 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::test_support::expression;
    use crate::graph::{Op, derive, print};

    #[test]
    fn reachable_nodes_come_after_their_operands_and_only_once() {
        let mut graph = Graph::new();
        expression(&mut graph, "exp z");
        let root = expression(&mut graph, "add multiply x y sin multiply x y");
        let nodes = graph.reachable(&[root, root]);
        assert_eq!(nodes.len(), 5);
        assert!(nodes.is_sorted() && nodes.last() == Some(&root));
        assert!(graph.reachable(&[]).is_empty());
    }

    #[test]
    fn support_names_coordinates_and_parameters() {
        let mut graph = Graph::new();
        let roots = ["add q5 multiply x q2", "exp z"].map(|text| expression(&mut graph, text));
        let support = graph.support(&roots);
        assert_eq!(support.coordinates, [true, false, true]);
        assert_eq!(support.parameters, [2, 5]);
    }

    #[test]
    fn substitution_replaces_leaves_at_once_and_simplifies() {
        let mut graph = Graph::new();
        let root = expression(&mut graph, "add power x q0 exp y");
        let [x, y, three] = ["x", "y", "3"].map(|text| expression(&mut graph, text));
        let swapped = graph.substitute(&[root, three], |leaf| match leaf {
            Node::Coordinate(0) => Some(y),
            Node::Coordinate(1) => Some(x),
            Node::Parameter(0) => Some(three),
            _ => None,
        });
        let expected = expression(&mut graph, "add integer_power y 3 exp x");
        assert_eq!(swapped, [expected, three]);
        let length = graph.len();
        assert_eq!(graph.substitute(&[root], |_| None), [root]);
        assert_eq!(graph.len(), length);
    }

    #[test]
    fn a_million_nodes_of_depth_need_no_stack() {
        let work = || {
            let mut graph = Graph::new();
            let [x, half] = [graph.coordinate(0), graph.constant(0.5)];
            let mut root = x;
            for _ in 0..1_000_000 {
                root = graph.apply(Op::Exp, &[root]);
            }
            let adjoint = derive::reverse(&mut graph, root, &[x])[0];
            let tangent = derive::forward(&mut graph, &[root], x)[0];
            assert_eq!(
                graph.reachable(&[adjoint]).len(),
                graph.reachable(&[tangent]).len()
            );
            assert!(print::text(&graph, &[root]).lines().count() > 1_000_000);
            let replaced = graph.substitute(&[root], |_| Some(half));
            assert_eq!(graph.constant_value(replaced[0]), Some(f64::INFINITY));
        };
        let thread = std::thread::Builder::new()
            .stack_size(128 * 1024)
            .spawn(work);
        thread.unwrap().join().unwrap();
    }
}
