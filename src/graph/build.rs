//! The graph itself, and how nodes come into it: every node once, constants folded, identities
//! that are exact in IEEE arithmetic applied.

use rustc_hash::FxHashMap;

use super::{Node, NodeId, Op, simplify};

/// A hash-consed list of nodes, each after its operands. It only grows.
///
/// Memory is 16 bytes a node for the list and about 40 for the index that finds equal nodes.
/// Asking for a node that exists gives the one that is there, so equal expressions are the same
/// node, and comparing expressions is comparing ids.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    nodes: Vec<Node>,
    /// Every node's place. The operands of a commutative operation are sorted in the key, so
    /// that a + b and b + a are one node; the list keeps the order in which it was first written.
    index: FxHashMap<Node, NodeId>,
}

impl Graph {
    /// The empty graph.
    pub fn new() -> Self {
        Self::default()
    }

    /// The number of nodes.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether there is no node.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The node of this id, which must come from this graph.
    pub fn node(&self, id: NodeId) -> Node {
        self.nodes[id.index()]
    }

    /// The node of a number.
    pub fn constant(&mut self, value: f64) -> NodeId {
        self.insert(Node::of_number(value))
    }

    /// The number that this node is, if it is a constant.
    pub fn constant_value(&self, id: NodeId) -> Option<f64> {
        match self.node(id) {
            Node::Constant(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    /// The coordinate of this axis: 0, 1, 2 for x, y, z. Further ones, up to 255, are bound
    /// variables of whoever builds expressions, and are replaced before these are evaluated.
    pub fn coordinate(&mut self, axis: usize) -> NodeId {
        debug_assert!(axis < 256, "an axis is a byte");
        self.insert(Node::Coordinate(axis as u8))
    }

    /// The parameter at this place of the session's list.
    pub fn parameter(&mut self, index: usize) -> NodeId {
        self.insert(Node::Parameter(narrow(index)))
    }

    /// The operation on these operands, or a simpler node that has the same bits for every input.
    /// The number of operands must be the operation's arity.
    pub fn apply(&mut self, op: Op, operands: &[NodeId]) -> NodeId {
        debug_assert_eq!(operands.len(), op.arity(), "operands of {}", op.name());
        let first = operands[0];
        let operand = |place| operands.get(place).copied().unwrap_or(first);
        let operands = [first, operand(1), operand(2)];
        let simpler = self
            .folded(op, operands)
            .or_else(|| simplify::simpler(self, op, operands));
        simpler.unwrap_or_else(|| self.insert(Node::Apply(op, operands)))
    }

    /// The operation's value if all operands are constants.
    fn folded(&mut self, op: Op, operands: [NodeId; 3]) -> Option<NodeId> {
        let [a, b, c] = operands.map(|id| self.constant_value(id));
        let value = op.value([a?, b?, c?]);
        Some(self.constant(value))
    }

    /// The place of this node, new or not.
    fn insert(&mut self, node: Node) -> NodeId {
        let next = NodeId(narrow(self.nodes.len()));
        let id = *self.index.entry(key(node)).or_insert(next);
        if id == next {
            self.nodes.push(node);
        }
        id
    }
}

/// The node as the index knows it.
fn key(node: Node) -> Node {
    match node {
        Node::Apply(op, [a, b, _]) if op.is_commutative() && b < a => Node::Apply(op, [b, a, b]),
        _ => node,
    }
}

/// An index as it is stored. It always fits: 2^32 nodes or parameters would take 200 gigabytes,
/// and the language's limits end far below.
fn narrow(index: usize) -> u32 {
    index as u32
}
