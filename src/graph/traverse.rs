//! Walks over the graph: what an expression consists of, what it depends on, and what it becomes
//! when leaves are replaced. All walks run along the list of nodes, so depth costs no stack.

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
    /// operands. Time and memory grow with the largest root's id.
    pub fn reachable(&self, roots: &[NodeId]) -> Vec<NodeId> {
        let length = roots.iter().map(|root| root.index() + 1).max().unwrap_or(0);
        let mut marked = vec![false; length];
        for root in roots {
            marked[root.index()] = true;
        }
        for index in (0..length).rev() {
            if marked[index] {
                for operand in self.node(NodeId(index as u32)).operands() {
                    marked[operand.index()] = true;
                }
            }
        }
        let marked = marked.iter().enumerate().filter(|(_, marked)| **marked);
        marked.map(|(index, _)| NodeId(index as u32)).collect()
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
        let length = nodes.last().map_or(0, |last| last.index() + 1);
        let mut replaced: Vec<u32> = vec![0; length];
        for id in nodes {
            let new = match self.node(id) {
                Node::Constant(_) => id,
                leaf @ (Node::Coordinate(_) | Node::Parameter(_)) => {
                    replacement(leaf).unwrap_or(id)
                }
                Node::Apply(op, operands) => {
                    let new = operands.map(|operand| NodeId(replaced[operand.index()]));
                    if new == operands {
                        id
                    } else {
                        self.apply(op, &new[..op.arity()])
                    }
                }
            };
            replaced[id.index()] = new.0;
        }
        let root = |root: &NodeId| NodeId(replaced[root.index()]);
        roots.iter().map(root).collect()
    }
}
