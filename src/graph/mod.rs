//! The expression graph: what a field's body becomes.
//!
//! One hash-consed, immutable, topologically ordered list of nodes over coordinates x and
//! parameters q. [`operation`] is the one table of operations; [`build`] makes nodes and
//! simplifies exactly; [`derive`] differentiates by source transformation; [`interval`] is the
//! arithmetic of guaranteed enclosures that the table's interval rules are written in.

mod node;
pub mod operation;

pub use node::{Node, NodeId};
pub use operation::Op;
