//! The engine: a graph made ready to be evaluated, fast.
//!
//! A [`Program`] holds the lowered graph of one field and, built on first use, its machine code;
//! a [`CompiledField`] is a program with values for its parameters. Samplers and polygonizers
//! know only the [`Field`] trait and the [`Monitor`] to which they report.
//!
//! The way through: `program` makes the derivatives, `lower` turns each wanted set of functions
//! into a list of steps, and `kernel` runs the list by the `tier` that suits: `jit` (machine code),
//! `block` (the steps as a `tape`, each run over many points) or `interpret` (the reference).
//! `explore` leads samplers
//! and polygonizers through a subdivision of space, with tapes that `prune` shortens for its
//! parts; `extent` finds a box around a zero set; `pieces` tells of which smooth functions a field
//! is made, and where they meet; `sparse` finds the parameters that matter in a box.

mod field;
mod monitor;

mod program;

mod slopes;

mod tier;

mod block;

mod tape;

mod prune;

mod explore;

mod extent;

mod pieces;

mod sparse;

mod compiled;

mod kernel;

mod lower;

mod interpret;

mod jit;

#[cfg(test)]
#[allow(dead_code)]
#[path = "../../tests/engine_common/expressions.rs"]
mod test_expressions;

pub use block::Kernels;
pub use compiled::CompiledField;
pub use explore::{Cell, Excerpt, Explorer, Specialized, Subdivision, explore};
pub use extent::{Extent, extent};
pub use field::Field;
pub use jit::{compilations, compiling, refusal};
pub use monitor::{Monitor, Silent};
pub use pieces::{Meeting, Pieces, pieces};
pub use program::Program;
pub use sparse::SparseParameters;
pub use tier::Tier;
