//! The expression graph: what a field's body becomes.
//!
//! One hash-consed, immutable, topologically ordered list of nodes over coordinates x and
//! parameters q. [`operation`] is the one table of operations; `build`, `simplify` and `traverse`
//! make the [`Graph`], simplify it exactly and walk over it; [`mod@derive`] differentiates by source
//! transformation; [`interval`] is the arithmetic of guaranteed enclosures that the table's
//! interval rules are written in; [`projective`] is a function seen from infinity; [`mod@print`] shows a graph as text.

mod build;
pub mod derive;
pub mod interval;
mod node;
pub mod operation;
pub mod print;
pub mod projective;
mod simplify;
#[cfg(test)]
mod test_support;
mod traverse;

pub use build::Graph;
pub use interval::Interval;
pub use node::{Node, NodeId};
pub use operation::Op;
pub use traverse::Support;
