//! Arithmetic on functions: `f | g`, `f + 0.1` and `norm(grad(f))` are functions again, which take
//! the arguments of f and g. With a field among the operands the result is a field.

use std::rc::Rc;

use crate::diagnostic::{Code, Span};
use crate::language::function::{Argument, At, FunctionValue, Pointwise, Rule};
use crate::language::session::Session;
use crate::language::value::{Outcome, Value, failure};

impl Session {
    /// What the rule makes of operands with a function among them; `None` where there is none, or
    /// where another operand is of a kind that no rule takes, so that the rule says it itself.
    pub(super) fn pointwise(
        &mut self,
        rule: &Rule,
        operands: &[Argument],
        span: Span,
    ) -> Outcome<Option<Value>> {
        let applies = |value: &Value| match value {
            // What `print` or `len` give is no number.
            Value::Function(FunctionValue::Builtin(builtin)) => builtin.lifts,
            Value::Number(_)
            | Value::Bool(_)
            | Value::Symbol(_)
            | Value::Condition(_)
            | Value::Interval(_)
            | Value::List(_)
            | Value::Function(_)
            | Value::Field(_) => true,
            _ => false,
        };
        let values = || operands.iter().map(|operand| &operand.value);
        if !values().any(Value::has_function) || !values().all(applies) {
            return Ok(None);
        }
        let Some(dimension) = values().find_map(field_dimension) else {
            let pointwise = Pointwise {
                rule: rule.clone(),
                operands: operands.to_vec(),
            };
            let function = FunctionValue::Pointwise(Rc::new(pointwise));
            return Ok(Some(Value::Function(function)));
        };
        let mut fields = Vec::with_capacity(operands.len());
        for operand in operands {
            let value = self.mapped(&operand.value, &mut |session, function| {
                let as_point = function.parameter_count() < 2;
                session
                    .function_as_field(function, dimension, as_point, operand.span)
                    .map(Value::Field)
            })?;
            fields.push(Argument {
                value,
                ..operand.clone()
            });
        }
        self.apply_rule(rule, fields, span).map(Some)
    }

    /// Calls every function among the operands with the same arguments, and applies the rule.
    pub(super) fn call_pointwise(
        &mut self,
        pointwise: &Pointwise,
        arguments: &[Argument],
        span: Span,
    ) -> Outcome<Value> {
        self.step(span)?;
        let mut operands = Vec::with_capacity(pointwise.operands.len());
        for operand in &pointwise.operands {
            let value = self.mapped(&operand.value, &mut |session, function| match session
                .call_function(function, arguments.to_vec(), span)?
            {
                Value::Nothing => Err(failure(Code::WrongKind, "a value is needed here")
                    .at(operand.span, "this function gives none")),
                value => Ok(value),
            })?;
            operands.push(Argument {
                value,
                ..operand.clone()
            });
        }
        self.apply_rule(&pointwise.rule, operands, span)
    }

    fn apply_rule(&mut self, rule: &Rule, operands: Vec<Argument>, span: Span) -> Outcome<Value> {
        match (rule, operands.as_slice()) {
            (Rule::Builtin(builtin), _) => self.call_builtin(builtin, operands, span),
            (Rule::Unary(operator), [operand]) => {
                self.apply_unary(*operator, &operand.value, operand.span)
            }
            (Rule::Binary(operator), [left, right]) => {
                let values = [left.value.clone(), right.value.clone()];
                self.apply_binary(*operator, values, [left.span, right.span])
            }
            (Rule::Comparison(operator), [left, right]) => {
                let values = [left.value.clone(), right.value.clone()];
                let spans = [left.span, right.span];
                let [_, holds] = self.apply_comparison(*operator, values, spans, span)?;
                Ok(holds)
            }
            (Rule::Property(name), [operand]) => match self.property(&operand.value, name)? {
                Some(value) => Ok(value),
                None => Err(crate::language::product::unknown_property(
                    &operand.value,
                    name,
                )),
            },
            (Rule::Element(place), [operand]) => {
                self.element(operand.value.clone(), *place, operand.span, span)
            }
            _ => Err(failure(
                Code::WrongKind,
                "an operation without its operands",
            )),
        }
    }

    /// The value with every function in it replaced.
    fn mapped(
        &mut self,
        value: &Value,
        replace: &mut dyn FnMut(&mut Session, &FunctionValue) -> Outcome<Value>,
    ) -> Outcome<Value> {
        match value {
            Value::Function(function) => replace(self, function),
            Value::List(elements) if elements.has_function() => elements
                .iter()
                .map(|element| self.mapped(element, replace))
                .collect::<Outcome<_>>()
                .map(Value::list),
            other => Ok(other.clone()),
        }
    }
}

/// The dimension of the first field in a value.
fn field_dimension(value: &Value) -> Option<usize> {
    match value {
        Value::Field(field) => Some(field.dimension()),
        Value::List(elements) if elements.has_function() => {
            elements.iter().find_map(field_dimension)
        }
        _ => None,
    }
}
