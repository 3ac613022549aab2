//! What an editor and the interactive prompt need to know about a text while it is being written,
//! without any protocol: its colours, what could be written at a place, what a name means and where
//! else it stands.
//!
//! Colours and completions read words ([`crate::syntax::words`]), because the text at the cursor is
//! nearly always broken there; the index reads the tree.

mod complete;
mod folds;
mod highlight;
pub mod index;
mod outline;
pub mod project;
mod scan;
mod surroundings;
pub mod vocabulary;

pub use complete::{Call, Completion, Kind, call_at, complete};
pub use folds::{Fold, folds};
pub use highlight::{Class, Highlight, highlight};
pub use surroundings::{Known, Surroundings, kind_and_value, parameter_ranges};
