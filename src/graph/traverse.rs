//! Walks over the graph: what an expression consists of, what it depends on, and what it becomes
//! when leaves are replaced. All walks run along the list of nodes, so depth costs no stack.

use rustc_hash::{FxHashMap, FxHashSet};

use super::{Graph, Node, NodeId};

/// What an expression depends on.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Support {
    /// Whether x, y, z occur.
    pub coordinates: [bool; 3],
    /// The parameters that occur, ascending.
    pub parameters: Vec<u32>,
}

impl Graph {
    /// All nodes that the roots are made of, themselves included, ascending: each after its
    /// operands. The cost depends on their number, not on the size of the graph.
    pub fn reachable(&self, roots: &[NodeId]) -> Vec<NodeId> {
        let mut seen = FxHashSet::default();
        let mut nodes = Vec::new();
        for &root in roots {
            if seen.insert(root) {
                nodes.push(root);
            }
        }
        let mut visited = 0;
        while visited < nodes.len() {
            for &operand in self.node(nodes[visited]).operands() {
                if seen.insert(operand) {
                    nodes.push(operand);
                }
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
                Node::Coordinate(axis) => support.coordinates[axis as usize] = true,
                Node::Parameter(index) => support.parameters.push(index),
                Node::Constant(_) | Node::Apply(..) => {}
            }
        }
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
        let mut replaced = FxHashMap::default();
        for id in nodes {
            let new = match self.node(id) {
                Node::Constant(_) => id,
                leaf @ (Node::Coordinate(_) | Node::Parameter(_)) => {
                    replacement(leaf).unwrap_or(id)
                }
                Node::Apply(op, operands) => {
                    let new = operands.map(|operand| replaced[&operand]);
                    if new == operands {
                        id
                    } else {
                        self.apply(op, &new[..op.arity()])
                    }
                }
            };
            replaced.insert(id, new);
        }
        roots.iter().map(|root| replaced[root]).collect()
    }
}
