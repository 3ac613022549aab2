//! Walking the tree: statements, expressions, calls.
//!
//! One evaluator serves scripts and fields: a field's body is evaluated once with symbols for
//! coordinates and parameters, which leaves its graph; a script's statements run with numbers.

mod call;
mod choice;
mod concrete;
mod define;
mod expression;
mod pointwise;
mod sequence;
mod statement;
mod with;

pub(super) use with::{World, WorldKey};
