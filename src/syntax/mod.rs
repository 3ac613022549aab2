//! From text to tree.
//!
//! [`parse`] never fails: it returns a [`tree::Tree`], with error nodes where it could not
//! understand, and the list of what is wrong. logos and chumsky are known to this room only.

pub mod tree;
