//! Intervals, lists of steps, comprehensions and elements.

use std::rc::Rc;

use super::call::unnamed;
use super::statement::element_place;
use crate::diagnostic::{Code, Span};
use crate::graph::Interval;
use crate::language::field;
use crate::language::function::{At, Rule};
use crate::language::limits::exceeded;
use crate::language::scope::Scope;
use crate::language::session::Session;
use crate::language::value::{Outcome, Value, failure};
use crate::syntax::tree::{Clause, Expression};

impl Session {
    /// Appends the elements of a comprehension; false where one of its lists is unknown.
    pub(super) fn comprehension(
        &mut self,
        element: &Expression,
        clauses: &[Clause],
        scope: &Rc<Scope>,
        elements: &mut Vec<Value>,
    ) -> Outcome<bool> {
        let Some((clause, rest)) = clauses.split_first() else {
            if elements.len() as u64 >= self.limits.elements {
                return exceeded(
                    Code::LengthLimit,
                    "the list is too long",
                    "elements",
                    self.limits.elements,
                )
                .at(element.span, "one element more");
            }
            elements.push(self.usable(element, scope)?);
            return Ok(true);
        };
        match clause {
            Clause::For { pattern, iterable } => {
                let Some(list) = self.elements(iterable, scope)? else {
                    let inner = Scope::inside(scope);
                    self.bind(pattern, Value::Unknown, iterable.span, &inner)?;
                    self.comprehension(element, rest, &inner, elements)?;
                    return Ok(false);
                };
                let mut known = true;
                for value in list.iter() {
                    self.step(iterable.span)?;
                    let inner = Scope::inside(scope);
                    self.bind(pattern, value.clone(), iterable.span, &inner)?;
                    known &= self.comprehension(element, rest, &inner, elements)?;
                }
                Ok(known)
            }
            Clause::If(condition) => match self.plain_condition(condition, scope)? {
                Some(true) => self.comprehension(element, rest, scope, elements),
                Some(false) => Ok(true),
                None => Ok(false),
            },
        }
    }

    pub(super) fn interval(
        &mut self,
        low: &Expression,
        high: &Expression,
        span: Span,
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        let (Some(low), Some(high)) = (self.number(low, scope)?, self.number(high, scope)?) else {
            return Ok(Value::Unknown);
        };
        if low <= high {
            return Ok(Value::Interval(Interval::new(low, high)));
        }
        Err(failure(
            Code::BadValue,
            format!("the interval {low}..{high} has no members"),
        )
        .at(span, "the lower end comes first"))
    }

    pub(super) fn steps(
        &mut self,
        interval: &Expression,
        step: &Expression,
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        let ends = match self.usable(interval, scope)? {
            Value::Interval(ends) => ends,
            Value::Unknown => return Ok(Value::Unknown),
            other => {
                return Err(failure(
                    Code::WrongKind,
                    format!("`by` follows an interval, but this is {}", other.kind()),
                )
                .at(interval.span, other.kind()));
            }
        };
        let Some(distance) = self.number(step, scope)? else {
            return Ok(Value::Unknown);
        };
        let length = ends.high - ends.low;
        if !(distance > 0.0 && distance.is_finite() && length.is_finite()) {
            return Err(failure(
                Code::BadValue,
                "a step must be greater than 0 and finite, and so must be the way",
            )
            .at(step.span, "this step"));
        }
        // A step that divides the interval up to rounding reaches its upper end.
        let count = (length / distance * (1.0 + 1e-12)).floor();
        if count >= self.limits.elements as f64 {
            return exceeded(
                Code::LengthLimit,
                "the list is too long",
                "elements",
                self.limits.elements,
            )
            .at(step.span, "this step is too small");
        }
        let scale = decimal_scale(ends.low, distance);
        let element = |index: f64| match scale {
            Some(scale) => {
                ((ends.low * scale).round() + index * (distance * scale).round()) / scale
            }
            None => ends.low + index * distance,
        };
        Ok(Value::numbers(
            (0..=count as u64).map(|index| element(index as f64).min(ends.high)),
        ))
    }

    pub(super) fn index(
        &mut self,
        subject: &Expression,
        index: &Expression,
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        let value = self.usable(subject, scope)?;
        let Some(place) = self.whole_number(index, scope)? else {
            return Ok(Value::Unknown);
        };
        self.element(value, place, subject.span, index.span)
    }

    /// `value[place]`
    pub(super) fn element(
        &mut self,
        value: Value,
        place: i64,
        subject: Span,
        index: Span,
    ) -> Outcome<Value> {
        match value {
            Value::Unknown => Ok(Value::Unknown),
            Value::List(elements) => {
                let place = element_place(place, elements.len()).at(index, "outside the list")?;
                Ok(elements[place].clone())
            }
            Value::Function(_) => {
                let operands = [unnamed(value, subject)];
                self.pointwise(&Rule::Element(place), &operands, subject)
                    .map(|value| value.unwrap_or(Value::Unknown))
            }
            Value::Field(ref field) if matches!(field.body(), Value::List(_)) => {
                let pick = |body: &Value| match body {
                    Value::List(components) => {
                        let place = element_place(place, components.len())?;
                        Ok(components[place].clone())
                    }
                    scalar => Ok(scalar.clone()),
                };
                field::lift(&mut self.graph, &[value], &mut |_, bodies| pick(&bodies[0]))
                    .at(index, "outside the components")
            }
            other => Err(failure(
                Code::WrongKind,
                format!("only lists have elements, but this is {}", other.kind()),
            )
            .at(subject, other.kind())),
        }
    }
}

/// The power of ten that makes whole numbers of both, if they are short decimals: then their
/// sums, made of whole numbers, are decimals too, and 0.3..0.9 by 0.2 passes through 0.7 and not
/// through 0.7000000000000001.
fn decimal_scale(low: f64, step: f64) -> Option<f64> {
    let fits = |number: f64, scale: f64| {
        let whole = (number * scale).round();
        whole.abs() < 1e15 && whole / scale == number
    };
    (0..=12)
        .map(|digits| {
            [
                1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12,
            ][digits]
        })
        .find(|&scale| fits(low, scale) && fits(step, scale))
}
