//! The engine: a graph made ready to be evaluated, fast.
//!
//! A `Program` holds the lowered graph of one field and, built on first use, its machine code;
//! a `CompiledField` is a program with values for its parameters. Samplers and polygonizers
//! know only the [`Field`] trait and the [`Monitor`] to which they report.

mod field;
mod monitor;

pub use field::Field;
pub use monitor::{Monitor, Silent};
