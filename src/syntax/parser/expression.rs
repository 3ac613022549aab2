//! Expressions: operators by precedence, and the operands between them.

use std::sync::Arc;

use chumsky::pratt::{infix, left, postfix, prefix, right};
use chumsky::prelude::*;

use super::build::{self, Deep, DeepExpression, Postfix, gather, node};
use super::error::{Expectation, SyntaxError};
use super::input::{Place, Rule, name, pick, rest_of_brackets, token};
use super::operand::operand;
use super::pattern::parameter;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::syntax::token::Token;
use crate::syntax::tree::{
    Argument, BinaryOperator, Block, Clause, ComparisonOperator, Expression, ExpressionKind,
    Function, FunctionParameter, Name, UnaryOperator,
};

/// The rule for an expression; `block` is the rule for `{ statements }`.
pub(super) fn expression<'source>(
    block: Rule<'source, Deep<Block>>,
) -> Rule<'source, DeepExpression> {
    recursive(|expression| {
        let expression = expression.boxed();
        operators(
            operand(expression.clone(), block),
            postfixes(expression.clone()),
            bindings(expression.clone()),
            function_head(expression),
        )
    })
    .boxed()
}

/// Operators, from loosest to tightest as in the table of the language. A function `x -> …` is a
/// prefix: its body reaches as far as it can.
fn operators<'source>(
    operand: Rule<'source, DeepExpression>,
    postfixes: Rule<'source, (Deep<Postfix>, Span)>,
    bindings: Rule<'source, (Deep<Vec<(Name, Expression)>>, Span)>,
    function_head: Rule<'source, (Deep<Vec<FunctionParameter>>, Span)>,
) -> Rule<'source, DeepExpression> {
    use BinaryOperator as B;
    operand
        .pratt((
            prefix(0, function_head, function),
            infix(
                left(1),
                pipe_operator(),
                |left, _, right, place: &mut Place<'source, '_>| build::pipe(left, right, place),
            ),
            postfix(2, bindings, with),
            infix(
                left(3),
                binary_operator(&[(Token::Or, B::Or)]),
                build::binary,
            ),
            infix(
                left(4),
                binary_operator(&[(Token::And, B::And)]),
                build::binary,
            ),
            prefix(5, negation(), build::unary),
            infix(left(6), comparison_operator(), build::comparison),
            infix(left(7), range_operator(), range),
            infix(
                left(8),
                binary_operator(&[(Token::Bar, B::Union)]),
                build::binary,
            ),
            infix(
                left(9),
                binary_operator(&[(Token::Ampersand, B::Intersection)]),
                build::binary,
            ),
            infix(
                left(10),
                binary_operator(&[(Token::Backslash, B::Difference)]),
                build::binary,
            ),
            infix(
                left(11),
                binary_operator(&[(Token::Plus, B::Add), (Token::Minus, B::Subtract)]),
                build::binary,
            ),
            infix(
                left(12),
                binary_operator(&[
                    (Token::Star, B::Multiply),
                    (Token::Slash, B::Divide),
                    (Token::Percent, B::Modulo),
                    (Token::At, B::MatrixMultiply),
                ]),
                build::binary,
            ),
            prefix(13, sign(), build::unary),
            infix(
                right(14),
                binary_operator(&[(Token::Caret, B::Power)]),
                build::binary,
            ),
            postfix(15, postfixes, build::postfix),
        ))
        .boxed()
}

fn binary_operator<'source>(
    table: &'static [(Token, BinaryOperator)],
) -> Rule<'source, BinaryOperator> {
    pick(Expectation::Operator, move |token| {
        table
            .iter()
            .find(|(written, _)| *written == token)
            .map(|&(_, operator)| operator)
    })
    .boxed()
}

fn pipe_operator<'source>() -> Rule<'source, ()> {
    token(Token::Pipe, Expectation::Operator).boxed()
}

fn comparison_operator<'source>() -> Rule<'source, ComparisonOperator> {
    pick(Expectation::Operator, |token| {
        Some(match token {
            Token::Equal => ComparisonOperator::Equal,
            Token::NotEqual => ComparisonOperator::NotEqual,
            Token::Less => ComparisonOperator::Less,
            Token::LessEqual => ComparisonOperator::LessEqual,
            Token::Greater => ComparisonOperator::Greater,
            Token::GreaterEqual => ComparisonOperator::GreaterEqual,
            _ => return None,
        })
    })
    .boxed()
}

fn range_operator<'source>() -> Rule<'source, (Token, Span)> {
    pick(Expectation::Operator, |token| {
        matches!(token, Token::DotDot | Token::By).then_some(token)
    })
    .map_with(|token, place: &mut Place<'source, '_>| (token, place.span()))
    .boxed()
}

fn negation<'source>() -> Rule<'source, (UnaryOperator, Span)> {
    token(Token::Not, Expectation::Expression)
        .map_with(|(), place: &mut Place<'source, '_>| (UnaryOperator::Not, place.span()))
        .boxed()
}

fn sign<'source>() -> Rule<'source, (UnaryOperator, Span)> {
    pick(Expectation::Expression, |token| match token {
        Token::Minus => Some(UnaryOperator::Negate),
        Token::Bang => Some(UnaryOperator::Complement),
        _ => None,
    })
    .map_with(|operator, place: &mut Place<'source, '_>| (operator, place.span()))
    .boxed()
}

/// `lo..hi` and `interval by step`. Neither can be chained, and only an interval has steps.
fn range<'source>(
    left: DeepExpression,
    (operator, span): (Token, Span),
    right: DeepExpression,
    place: &mut Place<'source, '_>,
) -> DeepExpression {
    let after_interval = matches!(*left.value.kind, ExpressionKind::Interval { .. });
    let after_range = after_interval || matches!(*left.value.kind, ExpressionKind::Steps { .. });
    let mistake = match operator {
        Token::DotDot if after_range => Some("an interval has two ends, `lo..hi`"),
        Token::By if !after_interval => Some("`by` stands after an interval, `lo..hi by step`"),
        _ => None,
    };
    if let Some(message) = mistake {
        let diagnostic =
            Diagnostic::error(Code::UnexpectedToken, message).label(span, "not expected here");
        place.emit(SyntaxError::said(diagnostic, span));
    }
    if operator == Token::DotDot {
        build::interval(left, right, place)
    } else {
        build::steps(left, right, place)
    }
}

/// `(…)`, `[…]` or `.name` behind an operand, and where it ends.
fn postfixes<'source>(
    expression: Rule<'source, DeepExpression>,
) -> Rule<'source, (Deep<Postfix>, Span)> {
    let call = token(Token::OpenParenthesis, Expectation::Operator)
        .ignore_then(
            arguments(expression.clone())
                .then_ignore(token(
                    Token::CloseParenthesis,
                    Expectation::CloseParenthesis,
                ))
                .recover_with(via_parser(
                    rest_of_brackets().map(|()| Deep::new(Vec::new(), 0)),
                )),
        )
        .map(|arguments| arguments.map(Postfix::Call));
    let index = token(Token::OpenBracket, Expectation::Operator)
        .ignore_then(
            expression
                .then_ignore(token(Token::CloseBracket, Expectation::CloseBracket))
                .recover_with(via_parser(skipped_brackets())),
        )
        .map(|index| index.map(Postfix::Index));
    let property = token(Token::Dot, Expectation::Operator)
        .ignore_then(name(Expectation::PropertyName))
        .map(|name| Deep::new(Postfix::Property(name), 0));
    choice((call.boxed(), index.boxed(), property.boxed()))
        .map_with(|postfix, place: &mut Place<'source, '_>| (postfix, place.span()))
        .boxed()
}

/// An error in place of what brackets enclose; the opening one was read.
pub(super) fn skipped_brackets<'source>() -> Rule<'source, DeepExpression> {
    rest_of_brackets()
        .map_with(|(), place: &mut Place<'source, '_>| Deep::new(build::error(place.span()), 1))
        .boxed()
}

/// Arguments between the parentheses of a call. The first may be a bare comprehension.
fn arguments<'source>(
    expression: Rule<'source, DeepExpression>,
) -> Rule<'source, Deep<Vec<Argument>>> {
    let named = pick(Expectation::Expression, |token| {
        (token == Token::Name).then_some(())
    })
    .map_with(|(), place: &mut Place<'source, '_>| place.span())
    .then_ignore(token(Token::Assign, Expectation::Operator))
    .map_with(|span, place: &mut Place<'source, '_>| place.state().name(span))
    .then(expression.clone())
    .map(|(name, value)| {
        value.map(|value| Argument {
            name: Some(name),
            value,
        })
    })
    .boxed();
    let positional = element(expression)
        .map(|value| value.map(|value| Argument { name: None, value }))
        .boxed();
    named
        .or(positional)
        .separated_by(token(Token::Comma, Expectation::Comma))
        .allow_trailing()
        .collect::<Vec<_>>()
        .map(gather)
        .validate(|arguments, _, emitter| {
            if let Some(span) = crowded_comprehension(&arguments.value) {
                let diagnostic = Diagnostic::error(
                    Code::UnexpectedToken,
                    "a bare comprehension is the only argument without a name",
                )
                .label(span, "more than one argument here")
                .help("put it in brackets: `[e for x in xs]`");
                emitter.emit(SyntaxError::said(diagnostic, span));
            }
            arguments
        })
        .boxed()
}

/// The place of a bare comprehension that is not the first and only argument without a name.
fn crowded_comprehension(arguments: &[Argument]) -> Option<Span> {
    let positional = |argument: &&Argument| argument.name.is_none();
    let index = arguments
        .iter()
        .position(|argument| positional(&argument) && is_bare(&argument.value))?;
    let alone = index == 0 && arguments.iter().filter(positional).count() == 1;
    (!alone).then(|| arguments[index].value.span)
}

/// Whether a comprehension stands without brackets: then it begins with its element.
fn is_bare(expression: &Expression) -> bool {
    match &*expression.kind {
        ExpressionKind::Comprehension { element, .. } => {
            element.span.start == expression.span.start
        }
        _ => false,
    }
}

/// `e`, or `e for x in xs if c …` as a comprehension.
fn element<'source>(expression: Rule<'source, DeepExpression>) -> Rule<'source, DeepExpression> {
    expression
        .clone()
        .then(clauses(expression).or_not())
        .map_with(|(element, clauses), place: &mut Place<'source, '_>| {
            let span = place.span();
            match clauses {
                Some(clauses) => build::comprehension(element, clauses, span, place),
                None => element,
            }
        })
        .boxed()
}

/// `for x in xs`, then any number of `for` and `if`.
pub(super) fn clauses<'source>(
    expression: Rule<'source, DeepExpression>,
) -> Rule<'source, Deep<Vec<Clause>>> {
    let each = token(Token::For, Expectation::Comprehension)
        .ignore_then(super::pattern::pattern(Expectation::Pattern))
        .then_ignore(token(Token::In, Expectation::InAfterPattern))
        .then(expression.clone())
        .map(|(pattern, iterable)| iterable.map(|iterable| Clause::For { pattern, iterable }))
        .boxed();
    let condition = token(Token::If, Expectation::Clause)
        .ignore_then(expression)
        .map(|condition| condition.map(Clause::If))
        .boxed();
    each.clone()
        .then(each.or(condition).repeated().collect::<Vec<_>>())
        .map(|(first, mut rest)| {
            rest.insert(0, first);
            gather(rest)
        })
        .boxed()
}

/// `with { name = e, … }` and where it ends.
fn bindings<'source>(
    expression: Rule<'source, DeepExpression>,
) -> Rule<'source, (Deep<Vec<(Name, Expression)>>, Span)> {
    let separator = pick(Expectation::Comma, |token| {
        matches!(token, Token::Comma | Token::Newline | Token::Semicolon).then_some(())
    });
    let separators = separator.clone().repeated();
    let binding = name(Expectation::BindingName)
        .then_ignore(token(Token::Assign, Expectation::EqualsAfterName))
        .then(expression)
        .map(|(name, value)| value.map(|value| (name, value)))
        .boxed();
    let all = binding
        .separated_by(separator.repeated().at_least(1))
        .allow_leading()
        .allow_trailing()
        .collect::<Vec<_>>()
        .map(gather)
        .then_ignore(separators)
        .then_ignore(token(Token::CloseBrace, Expectation::CloseBrace))
        .recover_with(via_parser(
            rest_of_brackets().map(|()| Deep::new(Vec::new(), 0)),
        ));
    token(Token::With, Expectation::Operator)
        .ignore_then(token(Token::OpenBrace, Expectation::OpenBindings))
        .ignore_then(all)
        .map_with(|bindings, place: &mut Place<'source, '_>| (bindings, place.span()))
        .boxed()
}

fn with<'source>(
    subject: DeepExpression,
    (bindings, end): (Deep<Vec<(Name, Expression)>>, Span),
    place: &mut Place<'source, '_>,
) -> DeepExpression {
    let span = subject.value.span.to(end);
    let both = subject.and(bindings);
    let (subject, bindings) = both.value;
    let kind = ExpressionKind::With { subject, bindings };
    node(kind, span, both.depth, place)
}

/// `x ->` or `(x, [a, b], k = 1) ->`: the parameters and where they start.
fn function_head<'source>(
    expression: Rule<'source, DeepExpression>,
) -> Rule<'source, (Deep<Vec<FunctionParameter>>, Span)> {
    let single = token(Token::LambdaName, Expectation::Expression)
        .map_with(|(), place: &mut Place<'source, '_>| {
            let span = place.span();
            let name = place.state().name(span);
            Deep::new(vec![super::pattern::plain_parameter(name)], 0)
        })
        .boxed();
    let several = token(Token::LambdaParenthesis, Expectation::Expression)
        .ignore_then(
            parameter(expression)
                .separated_by(token(Token::Comma, Expectation::Comma))
                .allow_trailing()
                .collect::<Vec<_>>()
                .map(gather)
                .then_ignore(token(
                    Token::CloseParenthesis,
                    Expectation::CloseParenthesis,
                ))
                .recover_with(via_parser(
                    rest_of_brackets().map(|()| Deep::new(Vec::new(), 0)),
                )),
        )
        .boxed();
    single
        .or(several)
        .then_ignore(token(Token::Arrow, Expectation::Arrow))
        .map_with(|parameters, place: &mut Place<'source, '_>| (parameters, place.span()))
        .boxed()
}

fn function<'source>(
    (parameters, start): (Deep<Vec<FunctionParameter>>, Span),
    body: DeepExpression,
    place: &mut Place<'source, '_>,
) -> DeepExpression {
    let span = start.to(body.value.span);
    let both = parameters.and(body);
    let (parameters, body) = both.value;
    let kind = ExpressionKind::Lambda(Arc::new(Function { parameters, body }));
    node(kind, span, both.depth, place)
}
