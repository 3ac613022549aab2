//! The engine: a graph made ready to be evaluated, fast.
//!
//! A [`Program`] holds the lowered graph of one field and, built on first use, its machine code;
//! a [`CompiledField`] is a program with values for its parameters. Samplers and polygonizers
//! know only the [`Field`] trait and the [`Monitor`] to which they report.
//!
//! The way through: `program` makes the derivatives, `lower` turns each wanted set of functions
//! into a list of steps, and `kernel` runs the list: by `jit` (machine code), by `block` (the
//! steps as a `tape`, each run over many points) or by `interpret` (the reference).

mod explore;
mod field;
mod monitor;

mod program;

mod block;

mod tape;

mod compiled;

mod kernel;

mod lower;

mod interpret;

mod jit;

pub use block::Kernels;
pub use compiled::CompiledField;
pub use explore::{Cell, Explorer, Specialized, Subdivision, explore};
pub use field::Field;
pub use jit::compilations;
pub use monitor::{Monitor, Silent};
pub use program::{Backend, Program};
