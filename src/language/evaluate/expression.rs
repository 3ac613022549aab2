//! Expressions.

use std::rc::Rc;

use crate::diagnostic::{Code, Span, suggest};
use crate::graph::{Interval, Op};
use crate::language::arithmetic;
use crate::language::function::{At, Closure, FunctionValue};
use crate::language::limits::exceeded;
use crate::language::parameters;
use crate::language::product;
use crate::language::scope::{Binding, Scope};
use crate::language::session::Session;
use crate::language::show;
use crate::language::value::{Outcome, Value, failure};
use crate::syntax::tree::{
    BinaryOperator, Clause, ComparisonOperator, Expression, ExpressionKind, Name, TextPart,
    UnaryOperator,
};

use super::concrete::not_a_condition;
use super::statement::element_place;

/// Stack that an expression's evaluation may need before the next look at what is left, and what
/// is added when it runs short: deep recursion grows the stack instead of ending the process.
const STACK_RESERVE: usize = 256 * 1024;
const STACK_GROWTH: usize = 8 * 1024 * 1024;

impl Session {
    /// The value of an expression.
    pub(crate) fn expression(
        &mut self,
        expression: &Expression,
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        stacker::maybe_grow(STACK_RESERVE, STACK_GROWTH, || {
            self.expression_kind(expression, scope)
        })
    }

    fn expression_kind(&mut self, expression: &Expression, scope: &Rc<Scope>) -> Outcome<Value> {
        let span = expression.span;
        match &*expression.kind {
            ExpressionKind::Number(number) => Ok(Value::Number(*number)),
            ExpressionKind::Bool(value) => Ok(Value::Bool(*value)),
            ExpressionKind::Text(parts) => self.text(parts, scope),
            ExpressionKind::Name(name) => self.lookup(name, scope),
            ExpressionKind::List(elements) => elements
                .iter()
                .map(|element| self.usable(element, scope))
                .collect::<Outcome<_>>()
                .map(Value::list),
            ExpressionKind::Comprehension { element, clauses } => {
                let mut elements = Vec::new();
                let known = self.comprehension(element, clauses, scope, &mut elements)?;
                Ok(if known {
                    Value::list(elements)
                } else {
                    Value::Unknown
                })
            }
            ExpressionKind::Group(inner) => self.expression(inner, scope),
            ExpressionKind::Unary { operator, operand } => self.unary(*operator, operand, scope),
            ExpressionKind::Binary {
                operator,
                left,
                right,
            } => self.binary(*operator, left, right, span, scope),
            ExpressionKind::Comparison { first, rest } => self.comparison(first, rest, span, scope),
            ExpressionKind::Interval { low, high } => self.interval(low, high, span, scope),
            ExpressionKind::Steps { interval, step } => self.steps(interval, step, scope),
            ExpressionKind::With { subject, bindings } => self.with(subject, bindings, scope),
            ExpressionKind::Pipe { left, right } => self.pipe(left, right, span, scope),
            ExpressionKind::Call { callee, arguments } => {
                self.call_expression(callee, arguments, None, span, scope)
            }
            ExpressionKind::Index { subject, index } => self.index(subject, index, scope),
            ExpressionKind::Property { subject, name } => {
                let value = self.usable(subject, scope)?;
                match product::property(&value, &name.text) {
                    Some(found) => Ok(found),
                    None => Err(product::unknown_property(&value, name)),
                }
            }
            ExpressionKind::Lambda(function) => {
                Ok(Value::Function(FunctionValue::Closure(Rc::new(Closure {
                    name: None,
                    function: function.clone(),
                    scope: Rc::clone(scope),
                    documentation: None,
                }))))
            }
            ExpressionKind::If {
                condition,
                consequence,
                alternative,
            } => self.choice(condition, consequence, alternative.as_ref(), span, scope),
            ExpressionKind::Block(block) => self.block(block, scope),
            // Reported by the parser; whoever runs a tree with errors gets nothing to use.
            ExpressionKind::Error => Ok(Value::Unknown),
        }
    }

    /// What a name means here.
    pub(crate) fn lookup(&mut self, name: &Name, scope: &Rc<Scope>) -> Outcome<Value> {
        match scope.find(&name.text) {
            Some((_, Binding::Constant(value) | Binding::Variable(value))) => Ok(value),
            Some((home, Binding::Lazy(value))) => {
                home.bind(&name.text, Binding::Busy);
                let found = self.usable(&value, &home)?;
                home.bind(&name.text, Binding::Constant(found.clone()));
                Ok(found)
            }
            Some((_, Binding::Busy)) => Err(failure(
                Code::UnknownName,
                format!("`{}` is defined by itself", name.text),
            )
            .at(name.span, "asked for while it is being evaluated")),
            None => {
                let mut error = failure(
                    Code::UnknownName,
                    format!("`{}` is not defined yet", name.text),
                )
                .at(name.span, "unknown here");
                let names = scope.names();
                error.help = suggest::nearest(&name.text, names.iter().map(|name| &**name))
                    .map(|near| format!("did you mean `{near}`?"));
                Err(error)
            }
        }
    }

    fn text(&mut self, parts: &[TextPart], scope: &Rc<Scope>) -> Outcome<Value> {
        let mut text = String::new();
        for part in parts {
            match part {
                TextPart::Literal(literal) => text.push_str(literal),
                TextPart::Interpolation { value, precision } => {
                    let found = self.usable(value, scope)?;
                    let plain = self.plain(found, value.span)?;
                    if plain.is_unknown() {
                        return Ok(Value::Unknown);
                    }
                    text.push_str(&show::show(&plain, *precision));
                }
            }
        }
        Ok(Value::text(text))
    }

    /// Appends the elements of a comprehension; false where one of its lists is unknown.
    fn comprehension(
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

    fn unary(
        &mut self,
        operator: UnaryOperator,
        operand: &Expression,
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        let value = self.usable(operand, scope)?;
        match (operator, &value) {
            (UnaryOperator::Negate, _) | (UnaryOperator::Complement, Value::Field(_)) => {
                arithmetic::apply(&mut self.graph, Op::Negate, &[value])
            }
            _ => arithmetic::negate_condition(&mut self.graph, &value),
        }
        .at(operand.span, "this operand")
    }

    fn binary(
        &mut self,
        operator: BinaryOperator,
        left: &Expression,
        right: &Expression,
        span: Span,
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        if let BinaryOperator::And | BinaryOperator::Or = operator {
            return self.connective(operator == BinaryOperator::And, left, right, scope);
        }
        let operands = [self.usable(left, scope)?, self.usable(right, scope)?];
        let graph = &mut self.graph;
        let result = match operator {
            BinaryOperator::Add => arithmetic::apply(graph, Op::Add, &operands),
            BinaryOperator::Subtract => arithmetic::apply(graph, Op::Subtract, &operands),
            BinaryOperator::Multiply => arithmetic::apply(graph, Op::Multiply, &operands),
            BinaryOperator::Divide => arithmetic::apply(graph, Op::Divide, &operands),
            BinaryOperator::Modulo => arithmetic::apply(graph, Op::Modulo, &operands),
            BinaryOperator::Power => arithmetic::apply(graph, Op::Power, &operands),
            BinaryOperator::MatrixMultiply => {
                arithmetic::matrix_product(graph, &operands[0], &operands[1])
            }
            BinaryOperator::Union => arithmetic::apply(graph, Op::Min, &operands),
            BinaryOperator::Intersection => arithmetic::apply(graph, Op::Max, &operands),
            BinaryOperator::Difference => {
                let [subject, removed] = operands.clone();
                arithmetic::apply(graph, Op::Negate, &[removed])
                    .and_then(|outside| arithmetic::apply(graph, Op::Max, &[subject, outside]))
            }
            BinaryOperator::And | BinaryOperator::Or => unreachable!("handled above"),
        };
        self.check_graph(span)?;
        result.map_err(|error| {
            let label = |value: &Value| format!("this is {}", value.kind());
            if error.labels.is_empty() {
                let (first, second) = (label(&operands[0]), label(&operands[1]));
                Box::new(error.label(left.span, first).label(right.span, second))
            } else {
                error
            }
        })
    }

    fn connective(
        &mut self,
        conjunction: bool,
        left: &Expression,
        right: &Expression,
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        let first = self.usable(left, scope)?;
        if let Value::Bool(decided) = first
            && decided != conjunction
        {
            return Ok(first);
        }
        let second = self.usable(right, scope)?;
        for (value, place) in [(&first, left), (&second, right)] {
            if !matches!(value, Value::Bool(_) | Value::Condition(_) | Value::Unknown) {
                return Err(not_a_condition(value, place.span));
            }
        }
        arithmetic::combine(&mut self.graph, conjunction, &first, &second)
    }

    fn comparison(
        &mut self,
        first: &Expression,
        rest: &[(ComparisonOperator, Expression)],
        span: Span,
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        let mut left = self.usable(first, scope)?;
        let mut all: Option<Value> = None;
        for (operator, operand) in rest {
            let right = self.usable(operand, scope)?;
            let holds = arithmetic::compare(&mut self.graph, *operator, &left, &right)
                .at(span, "this comparison")?;
            all = Some(match all {
                None => holds,
                Some(before @ Value::Field(_)) => {
                    arithmetic::apply(&mut self.graph, Op::Max, &[before, holds])?
                }
                Some(before) => arithmetic::combine(&mut self.graph, true, &before, &holds)
                    .at(span, "this comparison")?,
            });
            left = right;
        }
        Ok(all.unwrap_or(Value::Bool(true)))
    }

    fn interval(
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

    fn steps(
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
        if distance.is_nan() || distance <= 0.0 || !length.is_finite() {
            return Err(failure(
                Code::BadValue,
                "a step must be greater than 0, from end to end",
            )
            .at(step.span, "this step"));
        }
        // A step that divides the interval up to rounding reaches its upper end.
        let count = (length / distance + 1e-9).floor();
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
            (0..=count as u64).map(|index| element(index as f64)),
        ))
    }

    fn with(
        &mut self,
        subject: &Expression,
        bindings: &[(Name, Expression)],
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        let subject_value = self.usable(subject, scope)?;
        let mut changes = Vec::new();
        let mut unknown = false;
        for (name, expression) in bindings {
            let parameter = self
                .parameters
                .get(&name.text)
                .at(name.span, "not a parameter")?
                .clone();
            let value = self.usable(expression, scope)?;
            let value = self.plain(value, expression.span)?;
            if value.is_unknown() {
                unknown = true;
                continue;
            }
            if !parameters::same_shape(&value, &parameter.value) {
                let message = format!(
                    "the parameter `{}` is {}, and is given {} of another shape",
                    name.text,
                    parameter.value.kind(),
                    value.kind()
                );
                return Err(failure(Code::WrongKind, message).at(expression.span, "this value"));
            }
            let components = parameters::components(&value).at(expression.span, value.kind())?;
            parameters::check_range(&name.text, &components, parameter.range)
                .at(expression.span, "outside its range")?;
            changes.extend(
                components
                    .into_iter()
                    .enumerate()
                    .map(|(place, value)| (parameter.first + place, value)),
            );
        }
        match subject_value {
            Value::Unknown => Ok(Value::Unknown),
            _ if unknown => Ok(Value::Unknown),
            Value::Field(field) => Ok(Value::Field(field.with(changes))),
            other => Err(failure(
                Code::WrongKind,
                format!(
                    "`with` changes the parameters of a field, but this is {}",
                    other.kind()
                ),
            )
            .at(subject.span, other.kind())),
        }
    }

    fn index(
        &mut self,
        subject: &Expression,
        index: &Expression,
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        let value = self.usable(subject, scope)?;
        let Some(place) = self.whole_number(index, scope)? else {
            return Ok(Value::Unknown);
        };
        match value {
            Value::Unknown => Ok(Value::Unknown),
            Value::List(elements) => {
                let place =
                    element_place(place, elements.len()).at(index.span, "outside the list")?;
                Ok(elements[place].clone())
            }
            other => Err(failure(
                Code::WrongKind,
                format!("only lists have elements, but this is {}", other.kind()),
            )
            .at(subject.span, other.kind())),
        }
    }

    fn choice(
        &mut self,
        condition: &Expression,
        consequence: &Expression,
        alternative: Option<&Expression>,
        span: Span,
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        let missing = || {
            failure(
                Code::WrongKind,
                "this `if` has no `else`, so it may have no value",
            )
            .at(span, "without an `else`")
        };
        match self.usable(condition, scope)? {
            Value::Bool(true) => self.expression(consequence, scope),
            Value::Bool(false) => match alternative {
                Some(alternative) => self.expression(alternative, scope),
                None => Ok(Value::Nothing),
            },
            Value::Condition(decided) => {
                let alternative = alternative.ok_or_else(missing)?;
                let first = self.usable(consequence, scope)?;
                let second = self.usable(alternative, scope)?;
                arithmetic::select(&mut self.graph, decided, &first, &second)
                    .at(span, "both branches are needed")
            }
            Value::Unknown => {
                self.expression(consequence, scope)?;
                if let Some(alternative) = alternative {
                    self.expression(alternative, scope)?;
                }
                Ok(Value::Unknown)
            }
            other => Err(not_a_condition(&other, condition.span)),
        }
    }

    /// Checks the graph's size against its limit.
    pub(crate) fn check_graph(&self, span: Span) -> Outcome<()> {
        if self.graph.len() as u64 <= self.limits.nodes {
            return Ok(());
        }
        exceeded(
            Code::NodeLimit,
            "the expression graph is too large",
            "nodes",
            self.limits.nodes,
        )
        .at(span, "while tracing this")
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
