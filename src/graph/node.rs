//! Nodes and their names.

use super::Op;

/// A node of one [`super::Graph`]. Operands always have smaller ids than the node that uses
/// them, so ascending order is evaluation order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeId(pub(crate) u32);

impl NodeId {
    /// The position in the graph's list of nodes.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// One node, 16 bytes. Unused operand places of an operation repeat its first operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Node {
    /// A number, as its bits (so that −0 and 0 differ); every NaN is stored as one NaN.
    Constant(u64),
    /// A coordinate of the point: 0, 1, 2 for x, y, z; further ones are bound variables.
    Coordinate(u8),
    /// A component of q, by its place in the session's list of parameters.
    Parameter(u32),
    /// An operation; [`Op::arity`] of the operands count.
    Apply(Op, [NodeId; 3]),
}

impl Node {
    /// The constant of this value; whatever the NaN, it is the same node.
    pub(super) fn of_number(value: f64) -> Node {
        let value = if value.is_nan() { f64::NAN } else { value };
        Node::Constant(value.to_bits())
    }

    /// The operands that count: none for a leaf.
    pub fn operands(&self) -> &[NodeId] {
        match self {
            Node::Apply(op, operands) => &operands[..op.arity()],
            Node::Constant(_) | Node::Coordinate(_) | Node::Parameter(_) => &[],
        }
    }
}
