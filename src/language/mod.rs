//! The language: from the tree to values, graphs and what a script does.
//!
//! A [`Session`] runs one file. Its definitions are traced into one graph; its statements run
//! top to bottom with plain values. [`resolve`] first finds every misspelt or doubly bound name;
//! [`evaluate`] then walks the tree. Functions of the language that are not written in Rust's
//! operators live in [`builtin`], which checks arguments and calls the rooms below.

pub mod arithmetic;
pub mod builtin;
mod degrees;
pub mod evaluate;
pub mod field;
pub mod function;
mod inspection;
pub mod interactive;
pub mod json;
pub mod library;
pub mod limits;
pub mod list;
mod mention;
pub mod module;
pub mod parameters;
pub mod product;
pub mod reference;
pub mod resolve;
pub mod scope;
pub mod session;
pub mod settings;
pub mod show;
pub mod testing;
pub mod tracer;
pub mod unit;
pub mod value;

pub use field::FieldValue;
pub use interactive::{Entered, Input, Snapshot, names_of};
pub use limits::Limits;
pub use session::{Host, Mode, Session, Spent};
pub use value::{Outcome, Value};
