//! From symbols to plain values: where a script prints, decides, counts or measures.

use std::rc::Rc;

use crate::diagnostic::{Code, Span};
use crate::graph::{Node, NodeId};
use crate::language::arithmetic::not_a_condition;
use crate::language::function::At;
use crate::language::list::List;
use crate::language::scope::Scope;
use crate::language::session::Session;
use crate::language::value::{Outcome, Value, failure};
use crate::syntax::tree::Expression;

impl Session {
    /// The expression's value, which must be one.
    pub(crate) fn usable(&mut self, expression: &Expression, scope: &Rc<Scope>) -> Outcome<Value> {
        match self.expression(expression, scope)? {
            Value::Nothing => Err(failure(Code::WrongKind, "a value is needed here")
                .at(expression.span, "this gives no value")),
            value => Ok(value),
        }
    }

    /// The value with every symbol replaced by its number under the present parameters.
    ///
    /// Fails where a symbol depends on coordinates, and inside a field's body: what is decided
    /// there once and for all must not depend on parameters.
    pub(crate) fn plain(&mut self, value: Value, span: Span) -> Outcome<Value> {
        match value {
            Value::Symbol(node) => Ok(Value::Number(self.plain_number(node, span)?)),
            Value::Condition(condition) => Ok(Value::Bool(
                self.plain_number(condition.truth, span)? != 0.0,
            )),
            Value::List(elements) if elements.iter().any(Value::is_symbolic) => elements
                .iter()
                .map(|element| self.plain(element.clone(), span))
                .collect::<Outcome<_>>()
                .map(Value::list),
            other => Ok(other),
        }
    }

    /// The number that a node is under the present parameters. Linear in the nodes it needs.
    fn plain_number(&mut self, node: NodeId, span: Span) -> Outcome<f64> {
        if self.graph.level == 0 {
            return Ok(self.number_of_node(node));
        }
        let on_point = !self.graph.support(&[node]).coordinates.is_empty();
        let what = if on_point { "the point" } else { "parameters" };
        let mut error = failure(
            Code::NotConcrete,
            format!("a plain number is needed here, but this depends on {what}"),
        )
        .at(span, &format!("depends on {what}"));
        error.help = Some(
            "inside a field, counts, indices and loops must be known when the field is made".into(),
        );
        Err(error)
    }

    /// A condition under the present parameters, in a field's body too; one that depends on the
    /// point, and any other value, stays as it is.
    pub(crate) fn present(&mut self, value: Value) -> Value {
        match value {
            Value::Condition(condition)
                if self
                    .graph
                    .support(&[condition.truth])
                    .coordinates
                    .is_empty() =>
            {
                Value::Bool(self.number_of_node(condition.truth) != 0.0)
            }
            other => other,
        }
    }

    /// The number of a node without coordinates. Each node is computed once in a session, since
    /// parameters don't change while it lasts.
    fn number_of_node(&mut self, node: NodeId) -> f64 {
        let q = self.parameters.values();
        let numbers = &mut self.plain_numbers;
        let mut pending = vec![node];
        while let Some(&id) = pending.last() {
            let number = match self.graph.node(id) {
                _ if numbers.contains_key(&id) => {
                    pending.pop();
                    continue;
                }
                Node::Constant(bits) => f64::from_bits(bits),
                Node::Coordinate(_) => f64::NAN,
                Node::Parameter(index) => q[index as usize],
                Node::Apply(op, operands) => {
                    let missing = operands
                        .iter()
                        .find(|operand| !numbers.contains_key(operand));
                    if let Some(&operand) = missing {
                        pending.push(operand);
                        continue;
                    }
                    op.value(operands.map(|operand| numbers[&operand]))
                }
            };
            numbers.insert(id, number);
            pending.pop();
        }
        numbers[&node]
    }

    /// The expression as a plain number; `None` where it is unknown.
    pub(crate) fn number(
        &mut self,
        expression: &Expression,
        scope: &Rc<Scope>,
    ) -> Outcome<Option<f64>> {
        let value = self.expression(expression, scope)?;
        match self.plain(value, expression.span)? {
            Value::Number(number) => Ok(Some(number)),
            Value::Unknown => Ok(None),
            other => Err(failure(
                Code::WrongKind,
                format!("expected a number, found {}", other.kind()),
            )
            .at(expression.span, other.kind())),
        }
    }

    /// The expression as a whole number; `None` where it is unknown.
    pub(crate) fn whole_number(
        &mut self,
        expression: &Expression,
        scope: &Rc<Scope>,
    ) -> Outcome<Option<i64>> {
        let Some(number) = self.number(expression, scope)? else {
            return Ok(None);
        };
        // Beyond 2^53 neighbouring whole numbers are no longer told apart.
        if number.floor() == number && number.abs() <= 9_007_199_254_740_992.0 {
            return Ok(Some(number as i64));
        }
        Err(failure(
            Code::BadValue,
            format!("expected a whole number, found {number}"),
        )
        .at(expression.span, "not a whole number"))
    }

    /// The expression as a plain condition; `None` where it is unknown.
    pub(crate) fn plain_condition(
        &mut self,
        expression: &Expression,
        scope: &Rc<Scope>,
    ) -> Outcome<Option<bool>> {
        let value = self.expression(expression, scope)?;
        match self.plain(value, expression.span)? {
            Value::Bool(holds) => Ok(Some(holds)),
            Value::Unknown => Ok(None),
            other => Err(not_a_condition(&other).at(expression.span, other.kind())),
        }
    }

    /// The elements of the list that a loop walks; `None` where it is unknown.
    pub(crate) fn elements(
        &mut self,
        iterable: &Expression,
        scope: &Rc<Scope>,
    ) -> Outcome<Option<List>> {
        match self.usable(iterable, scope)? {
            Value::List(elements) => Ok(Some(elements)),
            Value::Unknown => Ok(None),
            Value::Interval(_) => {
                let mut error = failure(
                    Code::BareInterval,
                    "a loop walks a list, but this is an interval",
                )
                .at(iterable.span, "an interval has no first and next element");
                error.help = Some(
                    "write `range(n)` for 0, 1, … n-1, or `lo..hi by step` for evenly spaced numbers"
                        .into(),
                );
                Err(error)
            }
            other => Err(failure(
                Code::WrongKind,
                format!("a loop walks a list, but this is {}", other.kind()),
            )
            .at(iterable.span, other.kind())),
        }
    }
}
