//! Expressions: operators by precedence, and the operands between them.

use std::sync::Arc;

use chumsky::pratt::{Associativity, Operator, infix, left, postfix, prefix, right};
use chumsky::prelude::*;

use super::build::{self, Deep, DeepExpression, Postfix, gather, node};
use super::error::{Expectation, SyntaxError};
use super::input::{
    Extra, Input, Place, Rule, look, name, operator, pick, rest_of_brackets, token,
};
use super::operand::operand;
use super::pattern::parameter;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::syntax::token::Token;
use crate::syntax::tree::{
    Argument, BinaryOperator, Block, Clause, ComparisonOperator, Expression, ExpressionKind,
    Function, FunctionParameter, Name, UnaryOperator,
};

/// What `with` binds.
type Bindings = Vec<(Name, Expression)>;

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
    bindings: Rule<'source, (Deep<Bindings>, Span)>,
    function_head: Rule<'source, (Deep<Vec<FunctionParameter>>, Span)>,
) -> Rule<'source, DeepExpression> {
    use BinaryOperator as B;
    operand
        .pratt((
            prefix(0, function_head, function),
            infix(left(1), pipe(), build::pipe),
            postfix(2, bindings, with),
            binary(left(3), &[(Token::Or, B::Or)]),
            binary(left(4), &[(Token::And, B::And)]),
            prefix(5, unary(negation), build::unary),
            infix(left(6), operator(comparison), build::comparison),
            infix(left(7), range_operator(), range),
            binary(left(8), &[(Token::Bar, B::Union)]),
            binary(left(9), &[(Token::Ampersand, B::Intersection)]),
            binary(left(10), &[(Token::Backslash, B::Difference)]),
            binary(
                left(11),
                &[(Token::Plus, B::Add), (Token::Minus, B::Subtract)],
            ),
            binary(
                left(12),
                &[
                    (Token::Star, B::Multiply),
                    (Token::Slash, B::Divide),
                    (Token::Percent, B::Modulo),
                    (Token::At, B::MatrixMultiply),
                ],
            ),
            prefix(13, unary(sign), build::unary),
            binary(right(14), &[(Token::Caret, B::Power)]),
            postfix(15, postfixes, build::postfix),
        ))
        .boxed()
}

/// The binary operators of one level.
fn binary<'source>(
    level: Associativity,
    table: &'static [(Token, BinaryOperator)],
) -> impl Operator<'source, Input<'source>, DeepExpression, Extra<'source>> {
    let operator = operator(move |token| {
        table
            .iter()
            .find(|(written, _)| *written == token)
            .map(|&(_, operator)| operator)
    });
    infix(level, operator, build::binary)
}

/// A prefix operator and where it stands.
fn unary<'source>(
    pick: fn(Token) -> Option<UnaryOperator>,
) -> impl Parser<'source, Input<'source>, (UnaryOperator, Span), Extra<'source>> + Clone {
    operator(pick).map_with(|operator, place: &mut Place<'source, '_>| (operator, place.span()))
}

fn negation(token: Token) -> Option<UnaryOperator> {
    (token == Token::Not).then_some(UnaryOperator::Not)
}

fn sign(token: Token) -> Option<UnaryOperator> {
    match token {
        Token::Minus => Some(UnaryOperator::Negate),
        Token::Bang => Some(UnaryOperator::Complement),
        _ => None,
    }
}

fn comparison(token: Token) -> Option<ComparisonOperator> {
    Some(match token {
        Token::Equal => ComparisonOperator::Equal,
        Token::NotEqual => ComparisonOperator::NotEqual,
        Token::Less => ComparisonOperator::Less,
        Token::LessEqual => ComparisonOperator::LessEqual,
        Token::Greater => ComparisonOperator::Greater,
        Token::GreaterEqual => ComparisonOperator::GreaterEqual,
        _ => return None,
    })
}

fn pipe<'source>() -> impl Parser<'source, Input<'source>, (), Extra<'source>> + Clone {
    operator(|token| (token == Token::Pipe).then_some(()))
}

/// `..` or `by`, and where it stands.
fn range_operator<'source>()
-> impl Parser<'source, Input<'source>, (Token, Span), Extra<'source>> + Clone {
    operator(|token| matches!(token, Token::DotDot | Token::By).then_some(token))
        .map_with(|operator, place: &mut Place<'source, '_>| (operator, place.span()))
}

/// `lo..hi` or `interval by step`.
fn range<'source>(
    left: DeepExpression,
    (operator, span): (Token, Span),
    right: DeepExpression,
    place: &mut Place<'source, '_>,
) -> DeepExpression {
    if operator == Token::By {
        return build::steps(left, right, place);
    }
    if matches!(
        *left.value.kind,
        ExpressionKind::Interval { .. } | ExpressionKind::Steps { .. }
    ) {
        let diagnostic =
            Diagnostic::error(Code::UnexpectedToken, "an interval has two ends, `lo..hi`")
                .label(span, "not expected here");
        place.emit(SyntaxError::said(diagnostic, span));
    }
    build::interval(left, right, place)
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
    let any = choice((call.boxed(), index.boxed(), property.boxed())).boxed();
    look(Expectation::Operator, |token| {
        matches!(
            token,
            Token::OpenParenthesis | Token::OpenBracket | Token::Dot
        )
    })
    .ignore_then(any)
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
) -> Rule<'source, (Deep<Bindings>, Span)> {
    let separates =
        |token| matches!(token, Token::Comma | Token::Newline | Token::Semicolon).then_some(());
    let separators = pick(Expectation::Comma, separates).repeated().at_least(1);
    let member = token(Token::Dot, Expectation::EqualsAfterName)
        .ignore_then(name(Expectation::PropertyName));
    let path = name(Expectation::BindingName)
        .foldl(member.repeated(), |path, member| Name {
            text: format!("{}.{}", path.text, member.text).into(),
            span: path.span.to(member.span),
        })
        .boxed();
    let binding = path
        .then_ignore(token(Token::Assign, Expectation::EqualsAfterName))
        .then(expression)
        .map(|(name, value)| value.map(|value| (name, value)))
        .boxed();
    let all = operator(separates)
        .repeated()
        .ignore_then(
            binding
                .separated_by(separators)
                .allow_trailing()
                .collect::<Vec<_>>()
                .map(gather),
        )
        .then_ignore(token(Token::CloseBrace, Expectation::CloseBrace))
        .recover_with(via_parser(
            rest_of_brackets().map(|()| Deep::new(Vec::new(), 0)),
        ));
    operator(|token| (token == Token::With).then_some(()))
        .ignore_then(token(Token::OpenBrace, Expectation::OpenBindings))
        .ignore_then(all)
        .map_with(|bindings, place: &mut Place<'source, '_>| (bindings, place.span()))
        .boxed()
}

fn with<'source>(
    subject: DeepExpression,
    (bindings, end): (Deep<Bindings>, Span),
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
    let single = operator(|token| (token == Token::LambdaName).then_some(()))
        .map_with(|(), place: &mut Place<'source, '_>| {
            let span = place.span();
            let name = place.state().name(span);
            Deep::new(vec![super::pattern::plain_parameter(name)], 0)
        })
        .boxed();
    let several = operator(|token| (token == Token::LambdaParenthesis).then_some(()))
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
