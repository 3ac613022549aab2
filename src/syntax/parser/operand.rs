//! Operands: literals, names, strings, and what stands in brackets.

use chumsky::prelude::*;

use super::build::{self, Deep, DeepExpression, gather, node, optional};
use super::error::{Expectation, SyntaxError};
use super::expression::{clauses, skipped_brackets};
use super::input::{Place, Rule, pick, token};
use crate::diagnostic::{Code, Diagnostic, shorten};
use crate::syntax::number::{escape_value, number_value, precision_value};
use crate::syntax::token::Token;
use crate::syntax::tree::{Block, Clause, ExpressionKind, Literal, TextPart};

/// The rule for what operators stand between.
pub(super) fn operand<'source>(
    expression: Rule<'source, DeepExpression>,
    block: Rule<'source, Deep<Block>>,
) -> Rule<'source, DeepExpression> {
    let block_value = block
        .map_with(|block, place: &mut Place<'source, '_>| {
            let span = block.value.span;
            node(ExpressionKind::Block(block.value), span, block.depth, place)
        })
        .boxed();
    choice((
        simple(),
        group(expression.clone()),
        list(expression.clone()),
        text(expression.clone()),
        conditional(expression, block_value.clone()),
        block_value.labelled(Expectation::Expression).boxed(),
    ))
    .boxed()
}

/// Numbers, names, `true` and `false`.
fn simple<'source>() -> Rule<'source, DeepExpression> {
    pick(Expectation::Expression, |token| {
        matches!(
            token,
            Token::Number | Token::Name | Token::True | Token::False
        )
        .then_some(token)
    })
    .map_with(|token, place: &mut Place<'source, '_>| {
        let span = place.span();
        let kind = match token {
            Token::True => ExpressionKind::Bool(true),
            Token::False => ExpressionKind::Bool(false),
            Token::Name => ExpressionKind::Name(place.state().name(span)),
            _ => ExpressionKind::Number(number(place)),
        };
        node(kind, span, 0, place)
    })
    .boxed()
}

/// The value of the number at a place. One that is too large is an error.
fn number(place: &mut Place<'_, '_>) -> f64 {
    let span = place.span();
    let written = place.state().slice(span);
    let value = number_value(written).unwrap_or(f64::NAN);
    if value.is_infinite() {
        let message = format!("`{}` is too large for a number", shorten(written));
        let diagnostic = Diagnostic::error(Code::BadNumber, message)
            .label(span, "too large")
            .help("the largest number is about 1.8e308");
        place.emit(SyntaxError::said(diagnostic, span));
    }
    value
}

/// `(e)`
fn group<'source>(expression: Rule<'source, DeepExpression>) -> Rule<'source, DeepExpression> {
    token(Token::OpenParenthesis, Expectation::Expression)
        .ignore_then(
            expression
                .then_ignore(token(
                    Token::CloseParenthesis,
                    Expectation::CloseParenthesis,
                ))
                .recover_with(via_parser(skipped_brackets())),
        )
        .map_with(|inner, place: &mut Place<'source, '_>| {
            let span = place.span();
            node(ExpressionKind::Group(inner.value), span, inner.depth, place)
        })
        .boxed()
}

/// What stands behind the first expression in square brackets.
enum ListRest {
    Elements(Vec<DeepExpression>),
    Clauses(Deep<Vec<Clause>>),
}

/// `[a, b, c]` or `[e for x in xs]`
fn list<'source>(expression: Rule<'source, DeepExpression>) -> Rule<'source, DeepExpression> {
    let elements = token(Token::Comma, Expectation::Comma)
        .ignore_then(
            expression
                .clone()
                .separated_by(token(Token::Comma, Expectation::Comma))
                .allow_trailing()
                .collect::<Vec<_>>(),
        )
        .or_not()
        .map(|elements| ListRest::Elements(elements.unwrap_or_default()));
    let rest = clauses(expression.clone())
        .map(ListRest::Clauses)
        .or(elements)
        .boxed();
    let inside = expression
        .then(rest)
        .or_not()
        .then_ignore(token(Token::CloseBracket, Expectation::CloseBracket))
        .recover_with(via_parser(
            skipped_brackets().map(|error| Some((error, ListRest::Elements(Vec::new())))),
        ));
    token(Token::OpenBracket, Expectation::Expression)
        .ignore_then(inside)
        .map_with(|inside, place: &mut Place<'source, '_>| {
            let span = place.span();
            let elements = match inside {
                None => Vec::new(),
                Some((element, ListRest::Clauses(clauses))) => {
                    return build::comprehension(element, clauses, span, place);
                }
                Some((first, ListRest::Elements(mut rest))) => {
                    rest.insert(0, first);
                    rest
                }
            };
            let elements = gather(elements);
            let kind = ExpressionKind::List(elements.value);
            node(kind, span, elements.depth, place)
        })
        .boxed()
}

/// Runs of text and escapes, at least one.
fn characters<'source>(expectation: Expectation) -> Rule<'source, String> {
    pick(expectation, |token| {
        matches!(token, Token::TextRun | Token::TextEscape).then_some(token)
    })
    .map_with(|token, place: &mut Place<'source, '_>| {
        let span = place.span();
        (token, place.state().slice(span))
    })
    .repeated()
    .at_least(1)
    .fold(String::new(), |mut characters, (token, written)| {
        match escape_value(written) {
            Some(character) if token == Token::TextEscape => characters.push(character),
            _ => characters.push_str(written),
        }
        characters
    })
    .boxed()
}

/// A string without interpolations.
pub(super) fn literal<'source>(expectation: Expectation) -> Rule<'source, Literal> {
    token(Token::StringStart, expectation)
        .ignore_then(characters(Expectation::PlainText).or_not())
        .then_ignore(token(Token::StringEnd, Expectation::PlainText))
        .map_with(|characters, place: &mut Place<'source, '_>| Literal {
            text: characters.unwrap_or_default().into(),
            span: place.span(),
        })
        .boxed()
}

/// `"…{e:.3}…"`: runs of text and escapes become one literal each.
fn text<'source>(expression: Rule<'source, DeepExpression>) -> Rule<'source, DeepExpression> {
    let characters = characters(Expectation::CloseInterpolation)
        .map(|characters| Deep::new(TextPart::Literal(characters.into()), 0))
        .boxed();
    let precision = token(Token::Format, Expectation::Format)
        .map_with(|(), place: &mut Place<'source, '_>| {
            let span = place.span();
            precision_value(place.state().slice(span))
        })
        .or_not()
        .map(Option::flatten);
    let interpolation = token(Token::InterpolationStart, Expectation::CloseInterpolation)
        .ignore_then(
            expression
                .then(precision)
                .then_ignore(token(
                    Token::InterpolationEnd,
                    Expectation::CloseInterpolation,
                ))
                .recover_with(via_parser(skipped_brackets().map(|error| (error, None)))),
        )
        .map(|(value, precision)| value.map(|value| TextPart::Interpolation { value, precision }))
        .boxed();
    token(Token::StringStart, Expectation::Expression)
        .ignore_then(characters.or(interpolation).repeated().collect::<Vec<_>>())
        .then_ignore(token(Token::StringEnd, Expectation::CloseInterpolation))
        .map_with(|parts, place: &mut Place<'source, '_>| {
            let span = place.span();
            let parts = gather(parts);
            node(ExpressionKind::Text(parts.value), span, parts.depth, place)
        })
        .boxed()
}

/// `if c then a else b`, or `if c { … } else { … }` with or without the `else`.
fn conditional<'source>(
    expression: Rule<'source, DeepExpression>,
    block: Rule<'source, DeepExpression>,
) -> Rule<'source, DeepExpression> {
    recursive(|conditional| {
        let short = token(Token::Then, Expectation::Then)
            .ignore_then(expression.clone())
            .then_ignore(token(Token::Else, Expectation::Else))
            .then(expression.clone())
            .map(|(consequence, alternative)| (consequence, Some(alternative)))
            .boxed();
        let otherwise = token(Token::Else, Expectation::Else)
            .ignore_then(
                conditional
                    .or(block.clone())
                    .labelled(Expectation::IfOrBlock),
            )
            .or_not();
        let long = block.then(otherwise).boxed();
        token(Token::If, Expectation::Expression)
            .ignore_then(expression)
            .then(short.or(long))
            .map_with(|(condition, branches), place: &mut Place<'source, '_>| {
                let span = place.span();
                let (consequence, alternative) = branches;
                let all = condition.and(consequence).and(optional(alternative));
                let ((condition, consequence), alternative) = all.value;
                let kind = ExpressionKind::If {
                    condition,
                    consequence,
                    alternative,
                };
                node(kind, span, all.depth, place)
            })
            .boxed()
    })
    .boxed()
}
