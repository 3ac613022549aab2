//! The grammars in `grammar/` against the parser and against each other: sentences made from the
//! formal grammar, programs, and what editors read.

mod corpus;
mod editors;
mod generator;
mod highlights;
mod layout;
mod notation;
mod random;
mod sentences;
mod tree_sitter;
