//! The parser's alphabet: tokens with our spans as chumsky's input, and the rules for one token.

use std::sync::Arc;

use chumsky::extra::{Full, SimpleState};
use chumsky::input::{InputRef, MapExtra, MappedInput};
use chumsky::prelude::*;
use rustc_hash::FxHashMap;

use super::error::{Expectation, SyntaxError};
use crate::diagnostic::{SourceId, Span};
use crate::syntax::token::{Spanned, Token};
use crate::syntax::tree::Name;

impl chumsky::span::Span for Span {
    type Context = SourceId;
    type Offset = u32;

    fn new(source: SourceId, range: std::ops::Range<u32>) -> Self {
        Span {
            source,
            start: range.start,
            // A rule that takes no token has a span that ends before it starts.
            end: range.end.max(range.start),
        }
    }

    fn context(&self) -> SourceId {
        self.source
    }

    fn start(&self) -> u32 {
        self.start
    }

    fn end(&self) -> u32 {
        self.end
    }
}

/// What the parser reads.
pub(super) type Input<'source> = MappedInput<'source, Token, Span, &'source [Spanned]>;

/// What goes with it.
pub(super) type Extra<'source> = Full<SyntaxError, SimpleState<State<'source>>, ()>;

/// A rule of the grammar. Each is boxed, which keeps the types short and compilation quick.
pub(super) type Rule<'source, T> =
    chumsky::Boxed<'source, 'source, Input<'source>, T, Extra<'source>>;

/// Where a rule is when it builds a node.
pub(super) type Place<'source, 'parse> = MapExtra<'source, 'parse, Input<'source>, Extra<'source>>;

/// What the rules share.
pub(super) struct State<'source> {
    /// The source text, which says what a name or number is.
    pub(super) text: &'source str,
    /// Doc comments by the first byte of what they stand above, ascending.
    pub(super) documentation: &'source [(u32, Arc<str>)],
    /// Each name is kept once.
    pub(super) names: FxHashMap<&'source str, Arc<str>>,
    /// The first expression that was nested too deep.
    pub(super) too_deep: Option<Span>,
}

impl<'source> State<'source> {
    /// The characters under a span.
    pub(super) fn slice(&self, span: Span) -> &'source str {
        &self.text[span.start as usize..span.end as usize]
    }

    /// The name that is written at a span.
    pub(super) fn name(&mut self, span: Span) -> Name {
        let written = self.slice(span);
        let text = self
            .names
            .entry(written)
            .or_insert_with(|| written.into())
            .clone();
        Name { text, span }
    }

    /// The doc comment of what begins at a byte.
    pub(super) fn documentation(&self, start: u32) -> Option<Arc<str>> {
        let index = self
            .documentation
            .binary_search_by_key(&start, |&(place, _)| place)
            .ok()?;
        Some(self.documentation[index].1.clone())
    }
}

/// One token that `pick` accepts, as what `pick` makes of it; takes nothing otherwise.
pub(super) fn pick<'source, T>(
    expectation: Expectation,
    pick: impl Fn(Token) -> Option<T> + Clone,
) -> impl Parser<'source, Input<'source>, T, Extra<'source>> + Clone {
    custom(
        move |input: &mut InputRef<'source, '_, Input<'source>, Extra<'source>>| match input
            .peek()
            .and_then(&pick)
        {
            Some(value) => {
                input.skip();
                Ok(value)
            }
            None => Err(SyntaxError::expected(expectation, next_span(input))),
        },
    )
}

/// Like [`pick`], for the operators between, before and behind operands. Very many of them are tried
/// and do not fit, so they leave it to [`operand`](super::operand) and to the guard of
/// [`postfixes`](super::expression) to say so.
pub(super) fn operator<'source, T>(
    pick: impl Fn(Token) -> Option<T> + Clone,
) -> impl Parser<'source, Input<'source>, T, Extra<'source>> + Clone {
    custom(
        move |input: &mut InputRef<'source, '_, Input<'source>, Extra<'source>>| {
            let value = input.peek().and_then(&pick).ok_or(SyntaxError::UNSAID)?;
            input.skip();
            Ok(value)
        },
    )
}

/// Looks whether the next token is one of those, and takes nothing.
pub(super) fn look<'source>(
    expectation: Expectation,
    fits: impl Fn(Token) -> bool + Clone,
) -> impl Parser<'source, Input<'source>, (), Extra<'source>> + Clone {
    custom(
        move |input: &mut InputRef<'source, '_, Input<'source>, Extra<'source>>| {
            if input.peek().is_some_and(&fits) {
                Ok(())
            } else {
                Err(SyntaxError::expected(expectation, next_span(input)))
            }
        },
    )
}

/// That token.
pub(super) fn token<'source>(
    token: Token,
    expectation: Expectation,
) -> impl Parser<'source, Input<'source>, (), Extra<'source>> + Clone {
    pick(expectation, move |found| (found == token).then_some(()))
}

/// A name.
pub(super) fn name<'source>(
    expectation: Expectation,
) -> impl Parser<'source, Input<'source>, Name, Extra<'source>> + Clone {
    token(Token::Name, expectation).map_with(|(), place: &mut Place<'source, '_>| {
        let span = place.span();
        place.state().name(span)
    })
}

/// Skips the rest of what a bracket that was just read encloses, and the bracket that closes it.
/// Brackets are balanced, so it always fits after an open one.
pub(super) fn rest_of_brackets<'source>()
-> impl Parser<'source, Input<'source>, (), Extra<'source>> + Clone {
    custom(
        |input: &mut InputRef<'source, '_, Input<'source>, Extra<'source>>| {
            let mut open = 1_usize;
            while let Some(token) = input.next() {
                if token.closer().is_some() {
                    open += 1;
                } else if token.is_closer() {
                    open -= 1;
                    if open == 0 {
                        return Ok(());
                    }
                }
            }
            Err(SyntaxError::expected(
                Expectation::CloseParenthesis,
                next_span(input),
            ))
        },
    )
}

/// Skips to the end of the statement, over at least one token.
pub(super) fn rest_of_statement<'source>()
-> impl Parser<'source, Input<'source>, (), Extra<'source>> + Clone {
    custom(
        |input: &mut InputRef<'source, '_, Input<'source>, Extra<'source>>| {
            let mut open = 0_usize;
            let mut skipped = false;
            while let Some(token) = input.peek() {
                let ends = matches!(token, Token::Newline | Token::Semicolon) || token.is_closer();
                if open == 0 && ends {
                    break;
                }
                if token.closer().is_some() {
                    open += 1;
                } else if token.is_closer() {
                    open -= 1;
                }
                input.skip();
                skipped = true;
            }
            if skipped {
                Ok(())
            } else {
                Err(SyntaxError::expected(
                    Expectation::EndOfStatement,
                    next_span(input),
                ))
            }
        },
    )
}

/// The place of the next token, which is not taken; of the end where there is none.
pub(super) fn next_span<'source>(
    input: &mut InputRef<'source, '_, Input<'source>, Extra<'source>>,
) -> Span {
    let before = input.save();
    input.skip();
    let span = input.span_since(before.cursor());
    input.rewind(before);
    span
}
