//! The grammar of Imp, a language for implicit geometry, for tree-sitter.
//!
//! ```ignore
//! let mut parser = tree_sitter::Parser::new();
//! parser.set_language(&tree_sitter_imp::LANGUAGE.into())?;
//! let tree = parser.parse("field ball(p in R3) = norm(p) - 1", None);
//! ```

use tree_sitter_language::LanguageFn;

unsafe extern "C" {
    fn tree_sitter_imp() -> *const ();
}

/// The language.
// SAFETY: the generated function of that name takes nothing and gives the language's tables, which
// are constant.
pub const LANGUAGE: LanguageFn = unsafe { LanguageFn::from_raw(tree_sitter_imp) };

/// What kinds of nodes there are, as JSON.
pub const NODE_TYPES: &str = include_str!("../../src/node-types.json");

/// How nodes are coloured.
pub const HIGHLIGHTS_QUERY: &str = include_str!("../../queries/highlights.scm");

/// Where names are bound and where they are seen.
pub const LOCALS_QUERY: &str = include_str!("../../queries/locals.scm");

/// What can be folded.
pub const FOLDS_QUERY: &str = include_str!("../../queries/folds.scm");

/// What a file defines and what it calls.
pub const TAGS_QUERY: &str = include_str!("../../queries/tags.scm");
