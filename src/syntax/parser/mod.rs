//! From tokens to the tree.
//!
//! chumsky rules over the token slice: `statement` and `expression` are the grammar, `operand` and
//! `pattern` its parts, `input` the rules for single tokens, `build` the nodes and `error` the words
//! for what did not fit. A mistake costs the statement in which it stands, or only the brackets
//! around it, and parsing goes on behind.

mod build;
mod error;
mod expression;
mod input;
mod operand;
mod pattern;
mod statement;

use std::sync::Arc;

use chumsky::extra::SimpleState;
use chumsky::input::Input as _;
use chumsky::prelude::*;
use rustc_hash::FxHashMap;

use self::input::State;
use super::MAXIMUM_COLLECTED;
use super::nesting::too_deep;
use super::token::Spanned;
use super::tree::Statement;
use crate::diagnostic::{Diagnostic, Span};

/// Parses laid-out tokens with balanced brackets. `end` is the place of the end of the file.
/// Takes time linear in the number of tokens.
pub(super) fn parse(
    text: &str,
    tokens: &[Spanned],
    documentation: &[(u32, Arc<str>)],
    end: Span,
) -> (Vec<Statement>, Vec<Diagnostic>) {
    let mut state = SimpleState(State {
        text,
        documentation,
        names: FxHashMap::default(),
        too_deep: None,
    });
    let input = tokens.split_token_span(end);
    let (statements, errors) = statement::file()
        .parse_with_state(input, &mut state)
        .into_output_errors();
    let mut diagnostics: Vec<Diagnostic> = errors
        .into_iter()
        .take(MAXIMUM_COLLECTED)
        .map(|error| error::describe(error, text, tokens, end))
        .collect();
    diagnostics.extend(state.too_deep.map(too_deep));
    (statements.unwrap_or_default(), diagnostics)
}

#[cfg(test)]
mod tests;
