//! Which choices of different functions are the same.
//!
//! A derivative chooses as its function does: where a minimum is its first operand, the
//! derivative is that operand's. So what an interval pass over the function has decided need not
//! be found out again for the derivative, whose steps are many times as many.

use crate::engine::block::Kernel;
use crate::engine::lower::copy_leaf;
use crate::graph::operation::Derivative;
use crate::graph::{Graph, Node, NodeId, Op};
use rustc_hash::FxHashMap;

/// Which of a function's choices a step is, and stays in every part of the function: so what is
/// decided about it there is known for its other functions, too, such as the derivatives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::engine) struct Origin(u32);

impl Origin {
    /// No choice, or one that nobody else has.
    pub(in crate::engine) const NONE: Origin = Origin(u32::MAX);

    /// Marks a minimum or maximum whose operands are exchanged.
    const EXCHANGED: u32 = 1 << 31;

    /// The choice with this number.
    pub(in crate::engine) fn new(number: usize) -> Origin {
        let number = u32::try_from(number).ok();
        let number = number.filter(|&number| number < Origin::EXCHANGED - 1);
        number.map_or(Origin::NONE, Origin)
    }

    /// The choice's number, and whether the step's operands are exchanged.
    pub(in crate::engine) fn number(self) -> Option<(usize, bool)> {
        let number = (self.0 & !Origin::EXCHANGED) as usize;
        (self != Origin::NONE).then_some((number, self.0 & Origin::EXCHANGED != 0))
    }

    /// The same for exchanged operands of this kernel.
    pub(super) fn exchanged(self, kernel: Kernel) -> Origin {
        let is_between_operands = matches!(kernel, Kernel::Min | Kernel::Max);
        match is_between_operands && self != Origin::NONE {
            true => Origin(self.0 ^ Origin::EXCHANGED),
            false => self,
        }
    }
}

/// Which choices the nodes of `other` are, a graph that holds the root, too, and its
/// derivatives: the root's own, which have their nodes' numbers in `graph`, and those that
/// derivatives have in their place. The number after all of those is that of the question
/// whether the root is a number.
pub(in crate::engine) fn shared_choices(
    graph: &Graph,
    root: NodeId,
    other: &mut Graph,
) -> FxHashMap<NodeId, Origin> {
    let mut shared = FxHashMap::default();
    let mut copies = vec![root; graph.len()];
    for id in graph.reachable(&[root]) {
        copies[id.index()] = match graph.node(id) {
            Node::Apply(op, operands) => {
                let operands = operands.map(|operand| copies[operand.index()]);
                let copy = other.apply(op, &operands[..op.arity()]);
                let origin = Origin::new(id.index());
                shared.insert(copy, origin);
                if let Some(condition) = condition(other, op, operands) {
                    shared.entry(condition).or_insert(origin);
                }
                copy
            }
            leaf => copy_leaf(other, leaf),
        };
    }
    let is_number = other.apply(Op::IsNumber, &[copies[root.index()]]);
    shared.insert(is_number, Origin::new(graph.len()));
    shared
}

/// What the derivative of a minimum or maximum asks: whether it is the first operand.
fn condition(graph: &mut Graph, op: Op, operands: [NodeId; 3]) -> Option<NodeId> {
    let Derivative::Branch {
        condition,
        taken: 0,
        otherwise: 1,
    } = op.operation().derivative
    else {
        return None;
    };
    let condition = condition(graph, operands);
    let is_comparison = matches!(graph.node(condition), Node::Apply(Op::LessEqual, _));
    is_comparison.then_some(condition)
}
