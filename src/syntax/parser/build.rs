//! Nodes of the tree, with a bound on its depth.
//!
//! While a tree grows each part carries its depth. An expression that would be deeper than
//! [`MAXIMUM_DEPTH`] becomes an error node, and so does everything around it; the first such place
//! is reported. So whoever walks a tree may recurse, a long sum too, which nests to the left.

use std::sync::Arc;

use super::input::Place;
use crate::diagnostic::Span;
use crate::syntax::nesting::MAXIMUM_DEPTH;
use crate::syntax::tree::{
    Argument, BinaryOperator, Clause, ComparisonOperator, Expression, ExpressionKind, Name,
    UnaryOperator,
};

/// A part of the tree and its depth.
#[derive(Clone, Debug)]
pub(super) struct Deep<T> {
    pub(super) value: T,
    pub(super) depth: u32,
}

/// An expression and its depth.
pub(super) type DeepExpression = Deep<Expression>;

impl<T> Deep<T> {
    pub(super) fn new(value: T, depth: u32) -> Self {
        Deep { value, depth }
    }

    /// Another part of the same depth.
    pub(super) fn map<U>(self, change: impl FnOnce(T) -> U) -> Deep<U> {
        Deep::new(change(self.value), self.depth)
    }

    /// Two parts as one, as deep as the deeper.
    pub(super) fn and<U>(self, other: Deep<U>) -> Deep<(T, U)> {
        Deep::new((self.value, other.value), self.depth.max(other.depth))
    }
}

/// Parts of one thing, as deep as the deepest.
pub(super) fn gather<T>(parts: Vec<Deep<T>>) -> Deep<Vec<T>> {
    let depth = parts.iter().map(|part| part.depth).max().unwrap_or(0);
    Deep::new(parts.into_iter().map(|part| part.value).collect(), depth)
}

/// A part that may be missing.
pub(super) fn optional<T>(part: Option<Deep<T>>) -> Deep<Option<T>> {
    match part {
        Some(part) => part.map(Some),
        None => Deep::new(None, 0),
    }
}

/// The expression of that kind at `span`, whose deepest part has the depth `parts`.
pub(super) fn node(
    kind: ExpressionKind,
    span: Span,
    parts: u32,
    place: &mut Place<'_, '_>,
) -> DeepExpression {
    if parts < MAXIMUM_DEPTH {
        let kind = Arc::new(kind);
        return Deep::new(Expression { kind, span }, parts + 1);
    }
    place.state().too_deep.get_or_insert(span);
    Deep::new(error(span), MAXIMUM_DEPTH)
}

/// An expression that was reported as an error.
pub(super) fn error(span: Span) -> Expression {
    Expression {
        kind: Arc::new(ExpressionKind::Error),
        span,
    }
}

pub(super) fn unary(
    (operator, start): (UnaryOperator, Span),
    operand: DeepExpression,
    place: &mut Place<'_, '_>,
) -> DeepExpression {
    let span = start.to(operand.value.span);
    let kind = ExpressionKind::Unary {
        operator,
        operand: operand.value,
    };
    node(kind, span, operand.depth, place)
}

pub(super) fn binary(
    left: DeepExpression,
    operator: BinaryOperator,
    right: DeepExpression,
    place: &mut Place<'_, '_>,
) -> DeepExpression {
    let span = left.value.span.to(right.value.span);
    let depth = left.depth.max(right.depth);
    let kind = ExpressionKind::Binary {
        operator,
        left: left.value,
        right: right.value,
    };
    node(kind, span, depth, place)
}

/// `a < b`, or one more comparison of a chain: a left operand without parentheses that is itself a
/// comparison gets longer.
pub(super) fn comparison(
    mut left: DeepExpression,
    operator: ComparisonOperator,
    right: DeepExpression,
    place: &mut Place<'_, '_>,
) -> DeepExpression {
    let span = left.value.span.to(right.value.span);
    if let Some(ExpressionKind::Comparison { rest, .. }) = Arc::get_mut(&mut left.value.kind) {
        rest.push((operator, right.value));
        left.value.span = span;
        left.depth = left.depth.max(right.depth.saturating_add(1));
        return if left.depth > MAXIMUM_DEPTH {
            node(ExpressionKind::Error, span, MAXIMUM_DEPTH, place)
        } else {
            left
        };
    }
    let depth = left.depth.max(right.depth);
    let kind = ExpressionKind::Comparison {
        first: left.value,
        rest: vec![(operator, right.value)],
    };
    node(kind, span, depth, place)
}

pub(super) fn interval(
    low: DeepExpression,
    high: DeepExpression,
    place: &mut Place<'_, '_>,
) -> DeepExpression {
    let span = low.value.span.to(high.value.span);
    let depth = low.depth.max(high.depth);
    let kind = ExpressionKind::Interval {
        low: low.value,
        high: high.value,
    };
    node(kind, span, depth, place)
}

pub(super) fn steps(
    interval: DeepExpression,
    step: DeepExpression,
    place: &mut Place<'_, '_>,
) -> DeepExpression {
    let span = interval.value.span.to(step.value.span);
    let depth = interval.depth.max(step.depth);
    let kind = ExpressionKind::Steps {
        interval: interval.value,
        step: step.value,
    };
    node(kind, span, depth, place)
}

pub(super) fn pipe(
    left: DeepExpression,
    (): (),
    right: DeepExpression,
    place: &mut Place<'_, '_>,
) -> DeepExpression {
    let span = left.value.span.to(right.value.span);
    let depth = left.depth.max(right.depth);
    let kind = ExpressionKind::Pipe {
        left: left.value,
        right: right.value,
    };
    node(kind, span, depth, place)
}

/// `element for x in xs …` at `span`, with or without brackets.
pub(super) fn comprehension(
    element: DeepExpression,
    clauses: Deep<Vec<Clause>>,
    span: Span,
    place: &mut Place<'_, '_>,
) -> DeepExpression {
    let depth = element.depth.max(clauses.depth);
    let kind = ExpressionKind::Comprehension {
        element: element.value,
        clauses: clauses.value,
    };
    node(kind, span, depth, place)
}

/// What stands behind an operand and binds tighter than any operator.
#[derive(Clone, Debug)]
pub(super) enum Postfix {
    Call(Vec<Argument>),
    Index(Expression),
    Property(Name),
}

pub(super) fn postfix(
    subject: DeepExpression,
    (postfix, end): (Deep<Postfix>, Span),
    place: &mut Place<'_, '_>,
) -> DeepExpression {
    let span = subject.value.span.to(end);
    let depth = subject.depth.max(postfix.depth);
    let subject = subject.value;
    let kind = match postfix.value {
        Postfix::Call(arguments) => ExpressionKind::Call {
            callee: subject,
            arguments,
        },
        Postfix::Index(index) => ExpressionKind::Index { subject, index },
        Postfix::Property(name) => ExpressionKind::Property { subject, name },
    };
    node(kind, span, depth, place)
}
