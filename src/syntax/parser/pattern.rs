//! Patterns and parameters: what `let`, `for`, `fn` and `x -> …` bind.

use chumsky::prelude::*;

use super::build::{Deep, DeepExpression, optional};
use super::error::Expectation;
use super::input::{Place, Rule, name, token};
use crate::syntax::token::Token;
use crate::syntax::tree::{FunctionParameter, Name, Pattern};

/// A name, or a list of patterns as in `[a, [b, c]]`.
pub(super) fn pattern<'source>(expectation: Expectation) -> Rule<'source, Pattern> {
    recursive(|pattern| {
        let name = name(expectation).map(Pattern::Name);
        name.boxed().or(list_of(pattern.boxed(), expectation))
    })
    .boxed()
}

/// A list of patterns.
pub(super) fn list_pattern<'source>(expectation: Expectation) -> Rule<'source, Pattern> {
    list_of(pattern(expectation), expectation)
}

fn list_of<'source>(
    pattern: Rule<'source, Pattern>,
    expectation: Expectation,
) -> Rule<'source, Pattern> {
    token(Token::OpenBracket, expectation)
        .ignore_then(
            pattern
                .separated_by(token(Token::Comma, Expectation::Comma))
                .allow_trailing()
                .collect::<Vec<_>>(),
        )
        .then_ignore(token(Token::CloseBracket, Expectation::CloseBracket))
        .map_with(|elements, place: &mut Place<'source, '_>| Pattern::List(elements, place.span()))
        .boxed()
}

/// A pattern, with or without a default, or `name..`, which takes any number of arguments.
pub(super) fn parameter<'source>(
    expression: Rule<'source, DeepExpression>,
) -> Rule<'source, Deep<FunctionParameter>> {
    let rest = name(Expectation::ParameterName)
        .then_ignore(token(Token::DotDot, Expectation::Comma))
        .map(|name| {
            Deep::new(
                FunctionParameter {
                    rest: true,
                    ..plain_parameter(name)
                },
                0,
            )
        })
        .boxed();
    let single = pattern(Expectation::ParameterName)
        .then(
            token(Token::Assign, Expectation::Comma)
                .ignore_then(expression)
                .or_not(),
        )
        .map(|(pattern, default)| {
            optional(default).map(|default| FunctionParameter {
                pattern,
                default,
                rest: false,
            })
        })
        .boxed();
    rest.or(single).boxed()
}

/// A parameter that is one name without a default.
pub(super) fn plain_parameter(name: Name) -> FunctionParameter {
    FunctionParameter {
        pattern: Pattern::Name(name),
        default: None,
        rest: false,
    }
}
