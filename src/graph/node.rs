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

/// One node. Unused operand places of an operation repeat its first operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Node {
    /// A number, as its bits (so that −0 and 0 differ); every NaN is stored as one NaN.
    Constant(u64),
    /// A coordinate of the point: 0, 1, 2 for x, y, z.
    Coordinate(u8),
    /// A component of q, by its place in the session's list of parameters.
    Parameter(u32),
    /// An operation; [`Op::arity`] of the operands count.
    Apply(Op, [NodeId; 3]),
}
