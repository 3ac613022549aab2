//! Expressions.

use std::rc::Rc;

use super::call::unnamed;
use crate::diagnostic::{Code, Span, suggest};
use crate::graph::Op;
use crate::language::arithmetic::{self, not_a_condition};
use crate::language::field;
use crate::language::function::{At, Closure, FunctionValue, Rule};
use crate::language::limits::{exceeded, weight};
use crate::language::list::List;
use crate::language::product;
use crate::language::scope::{Binding, Scope};
use crate::language::session::Session;
use crate::language::show;
use crate::language::value::{Outcome, Value, failure};
use crate::syntax::tree::{
    BinaryOperator, ComparisonOperator, Expression, ExpressionKind, Name, TextPart, UnaryOperator,
};

/// Stack that an expression's evaluation may need before the next look at what is left, and what
/// is added when it runs short: deep recursion grows the stack instead of ending the process.
const STACK_RESERVE: usize = 256 * 1024;
const STACK_GROWTH: usize = 8 * 1024 * 1024;

/// How deep lists may be nested: what walks over a list may recurse.
const DEEPEST_LIST: u32 = 64;

impl Session {
    /// The value of an expression.
    pub(crate) fn expression(
        &mut self,
        expression: &Expression,
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        self.count_work(1, expression.span)?;
        let value = stacker::maybe_grow(STACK_RESERVE, STACK_GROWTH, || {
            self.expression_kind(expression, scope)
        })
        .at(expression.span, "here")?;
        self.check_size(&value, expression.span)?;
        Ok(value)
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
            } => self.binary(*operator, left, right, scope),
            ExpressionKind::Comparison { first, rest } => self.comparison(first, rest, span, scope),
            ExpressionKind::Interval { low, high } => self.interval(low, high, span, scope),
            ExpressionKind::Steps { interval, step } => self.steps(interval, step, scope),
            ExpressionKind::With { subject, bindings } => self.with(subject, bindings, span, scope),
            ExpressionKind::Pipe { left, right } => self.pipe(left, right, span, scope),
            ExpressionKind::Call { callee, arguments } => {
                self.call_expression(callee, arguments, None, span, scope)
            }
            ExpressionKind::Index { subject, index } => self.index(subject, index, scope),
            ExpressionKind::Property { subject, name } => {
                let value = self.usable(subject, scope)?;
                match self.property(&value, name)? {
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
            Some(Binding::Constant(value) | Binding::Variable(value)) => Ok(value),
            Some(Binding::Library(entry, scope)) => match scope.upgrade() {
                Some(scope) => self.library_value(entry, &scope).at(name.span, "here"),
                None => Ok(Value::Unknown),
            },
            Some(Binding::Lazy(..)) if !self.acting => Ok(Value::Unknown),
            Some(Binding::Lazy(statement, unit)) => {
                // It is run as if it were its turn in its file, whoever asks for it.
                let outer = std::mem::replace(&mut self.unit, Rc::clone(&unit));
                let level = std::mem::take(&mut self.graph.level);
                let branch = self.branch.take();
                let done = self.statement(&statement, &unit.scope);
                self.graph.level = level;
                self.branch = branch;
                self.unit = outer;
                done?;
                match unit.scope.find(&name.text) {
                    Some(Binding::Constant(value) | Binding::Variable(value)) => Ok(value),
                    _ => Ok(Value::Unknown),
                }
            }
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

    fn unary(
        &mut self,
        operator: UnaryOperator,
        operand: &Expression,
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        let value = self.usable(operand, scope)?;
        self.count_work(weight(&value), operand.span)?;
        let operands = [unnamed(value, operand.span)];
        match self.pointwise(&Rule::Unary(operator), &operands, operand.span)? {
            Some(function) => Ok(function),
            None => self.apply_unary(operator, &operands[0].value, operand.span),
        }
    }

    pub(super) fn apply_unary(
        &mut self,
        operator: UnaryOperator,
        value: &Value,
        span: Span,
    ) -> Outcome<Value> {
        let negates = match operator {
            UnaryOperator::Negate => true,
            // A number is the value of a field: `!` turns its inside out.
            UnaryOperator::Complement => matches!(
                value,
                Value::Field(_) | Value::Number(_) | Value::Symbol(_) | Value::Interval(_)
            ),
            UnaryOperator::Not => false,
        };
        match negates {
            true => arithmetic::apply(&mut self.graph, Op::Negate, std::slice::from_ref(value)),
            false => arithmetic::negate_condition(&mut self.graph, value),
        }
        .at(span, "this operand")
    }

    fn binary(
        &mut self,
        operator: BinaryOperator,
        left: &Expression,
        right: &Expression,
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        if let BinaryOperator::And | BinaryOperator::Or = operator {
            return self.connective(operator == BinaryOperator::And, left, right, scope);
        }
        let values = [self.usable(left, scope)?, self.usable(right, scope)?];
        let spans = [left.span, right.span];
        self.count_work(weight(&values[0]) + weight(&values[1]), left.span)?;
        if values.iter().any(Value::has_function) && !values.iter().any(Value::is_unknown) {
            let [first, second] = values.clone();
            let operands = [unnamed(first, left.span), unnamed(second, right.span)];
            let span = left.span.to(right.span);
            if let Some(function) = self.pointwise(&Rule::Binary(operator), &operands, span)? {
                return Ok(function);
            }
        }
        self.apply_binary(operator, values, spans)
    }

    pub(super) fn apply_binary(
        &mut self,
        operator: BinaryOperator,
        operands: [Value; 2],
        spans: [Span; 2],
    ) -> Outcome<Value> {
        let operands = self.settle(operands, spans, false)?;
        let operands = self.solids(operator, operands, spans)?;
        let graph = &mut self.graph;
        let result = match operator {
            BinaryOperator::Add => arithmetic::apply(graph, Op::Add, &operands),
            BinaryOperator::Subtract => arithmetic::apply(graph, Op::Subtract, &operands),
            BinaryOperator::Multiply => arithmetic::apply(graph, Op::Multiply, &operands),
            BinaryOperator::Divide => arithmetic::apply(graph, Op::Divide, &operands),
            BinaryOperator::Modulo => arithmetic::apply(graph, Op::Modulo, &operands),
            BinaryOperator::Power => arithmetic::apply(graph, Op::Power, &operands),
            BinaryOperator::MatrixMultiply => {
                self.matrix_product(&operands[0], &operands[1], spans[0])
            }
            BinaryOperator::Union => arithmetic::apply(graph, Op::Min, &operands),
            BinaryOperator::Intersection => arithmetic::apply(graph, Op::Max, &operands),
            BinaryOperator::Difference => {
                let [subject, removed] = operands.clone();
                arithmetic::apply(graph, Op::Negate, &[removed])
                    .and_then(|outside| arithmetic::apply(graph, Op::Max, &[subject, outside]))
            }
            BinaryOperator::And | BinaryOperator::Or => {
                let conjunction = operator == BinaryOperator::And;
                arithmetic::combine(graph, conjunction, &operands[0], &operands[1])
            }
        };
        let result = result.map(|value| within(operator, &operands, value));
        result.map_err(|error| {
            let label = |value: &Value| format!("this is {}", value.kind());
            if error.labels.is_empty() {
                let (first, second) = (label(&operands[0]), label(&operands[1]));
                Box::new(error.label(spans[0], first).label(spans[1], second))
            } else {
                error
            }
        })
    }

    /// The product of matrices and vectors, row by row with a look at the clock between them.
    fn matrix_product(&mut self, left: &Value, right: &Value, span: Span) -> Outcome<Value> {
        let (Value::List(rows), Value::List(columns)) = (left, right) else {
            return arithmetic::matrix_product(&mut self.graph, left, right);
        };
        if !arithmetic::is_matrix(left) {
            return arithmetic::matrix_product(&mut self.graph, left, right);
        }
        rows.iter()
            .map(|row| {
                self.count_work(columns.leaves(), span)?;
                arithmetic::matrix_product(&mut self.graph, row, right)
            })
            .collect::<Outcome<_>>()
            .map(Value::list)
    }

    /// Relations between the signs of solids are the solids where they hold.
    fn solids(
        &mut self,
        operator: BinaryOperator,
        operands: [Value; 2],
        spans: [Span; 2],
    ) -> Outcome<[Value; 2]> {
        use BinaryOperator::{Difference, Intersection, Union};
        if !matches!(operator, Union | Intersection | Difference) {
            return Ok(operands);
        }
        let [left, right] = operands;
        let solid = |value: Value, span: Span| match value {
            Value::Condition(_) => {
                arithmetic::solid_of(&self.graph, &value).at(span, "this relation")
            }
            other => Ok(other),
        };
        Ok([solid(left, spans[0])?, solid(right, spans[1])?])
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
        if first.has_function() || second.has_function() {
            let operator = match conjunction {
                true => BinaryOperator::And,
                false => BinaryOperator::Or,
            };
            let operands = [
                unnamed(first.clone(), left.span),
                unnamed(second.clone(), right.span),
            ];
            let span = left.span.to(right.span);
            if let Some(function) = self.pointwise(&Rule::Binary(operator), &operands, span)? {
                return Ok(function);
            }
        }
        for (value, place) in [(&first, left), (&second, right)] {
            if !matches!(
                value,
                Value::Bool(_) | Value::Condition(_) | Value::Field(_) | Value::Unknown
            ) {
                return Err(not_a_condition(value).at(place.span, value.kind()));
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
            self.count_work(weight(&left) + weight(&right), operand.span)?;
            let spans = [span, operand.span];
            let compared = left.clone();
            let [right, holds] = match [&left, &right].iter().any(|one| one.has_function()) {
                true => self.compare_functions(*operator, [left, right], spans, span)?,
                false => self.apply_comparison(*operator, [left, right], spans, span)?,
            };
            match holds {
                Value::Bool(false) => {
                    self.failed_comparison = Some((span, compared, right.clone()));
                }
                // An older failure at this place is no longer true.
                _ => self.failed_comparison = None,
            }
            all = Some(match all {
                None => holds,
                Some(before) => self.both(before, holds, span)?,
            });
            left = right;
        }
        Ok(all.unwrap_or(Value::Bool(true)))
    }

    /// The right operand, as it was compared, and whether the comparison holds.
    pub(super) fn apply_comparison(
        &mut self,
        operator: ComparisonOperator,
        operands: [Value; 2],
        spans: [Span; 2],
        span: Span,
    ) -> Outcome<[Value; 2]> {
        let lists = operands.iter().any(|value| matches!(value, Value::List(_)));
        let [left, right] = self.settle(operands, spans, lists)?;
        let holds = arithmetic::compare(&mut self.graph, operator, &left, &right)
            .at(span, "this comparison")?;
        Ok([right, holds])
    }

    fn compare_functions(
        &mut self,
        operator: ComparisonOperator,
        [left, right]: [Value; 2],
        spans: [Span; 2],
        span: Span,
    ) -> Outcome<[Value; 2]> {
        let operands = [
            unnamed(left.clone(), spans[0]),
            unnamed(right.clone(), spans[1]),
        ];
        match self.pointwise(&Rule::Comparison(operator), &operands, span)? {
            Some(holds) => Ok([right, holds]),
            None => self.apply_comparison(operator, [left, right], spans, span),
        }
    }

    /// The conjunction of neighbouring comparisons.
    fn both(&mut self, before: Value, holds: Value, span: Span) -> Outcome<Value> {
        if before.has_function() || holds.has_function() {
            let operands = [unnamed(before.clone(), span), unnamed(holds.clone(), span)];
            let and = Rule::Binary(BinaryOperator::And);
            if let Some(function) = self.pointwise(&and, &operands, span)? {
                return Ok(function);
            }
        }
        arithmetic::combine(&mut self.graph, true, &before, &holds).at(span, "this comparison")
    }

    /// A property of a value; those of a vector field's vectors are fields.
    pub(super) fn property(&mut self, value: &Value, name: &Name) -> Outcome<Option<Value>> {
        match value {
            Value::Module(module) => self.member(module, name).map(Some),
            Value::Function(_) if product::is_swizzle(&name.text) => {
                let operands = [unnamed(value.clone(), name.span)];
                self.pointwise(&Rule::Property(name.clone()), &operands, name.span)
            }
            Value::Field(field) if product::property(field.body(), &name.text).is_some() => {
                let operands = std::slice::from_ref(value);
                field::lift(&mut self.graph, operands, &mut |_, bodies| {
                    product::property(&bodies[0], &name.text)
                        .ok_or_else(|| product::unknown_property(&bodies[0], name))
                })
                .map(Some)
            }
            other => Ok(product::property(other, &name.text)),
        }
    }

    /// In a script, where operands meet whose operation needs plain numbers (intervals, or lists
    /// that are `compared`), parameters are taken at their present values.
    fn settle(
        &mut self,
        operands: [Value; 2],
        spans: [Span; 2],
        compared: bool,
    ) -> Outcome<[Value; 2]> {
        let needs_plain = |value: &Value| match value {
            Value::Interval(_) => true,
            Value::List(elements) => elements
                .iter()
                .any(|element| matches!(element, Value::Interval(_))),
            _ => false,
        };
        if self.graph.level > 0 || !(compared || operands.iter().any(needs_plain)) {
            return Ok(operands);
        }
        let [left, right] = operands;
        Ok([self.plain(left, spans[0])?, self.plain(right, spans[1])?])
    }

    /// Checks what an expression has made against the limits.
    fn check_size(&mut self, value: &Value, span: Span) -> Outcome<()> {
        if self.graph.len() as u64 > self.limits.nodes {
            let limit = self.limits.nodes;
            let what = "the expression graph is too large";
            return exceeded(Code::NodeLimit, what, "nodes", limit).at(span, "while tracing this");
        }
        match value {
            Value::List(list) if list.depth() > DEEPEST_LIST => Err(failure(
                Code::LengthLimit,
                format!("lists are nested deeper than {DEEPEST_LIST}"),
            )
            .at(span, "this list")),
            Value::List(list)
                if list.leaves() > self.limits.elements
                    || List::alive() > 4 * self.limits.elements =>
            {
                let limit = self.limits.elements;
                exceeded(
                    Code::LengthLimit,
                    "the lists are too long",
                    "elements",
                    limit,
                )
                .at(span, "this list")
            }
            Value::Text(text) if text.len() as u64 > self.limits.characters => {
                let limit = self.limits.characters;
                exceeded(
                    Code::LengthLimit,
                    "the string is too long",
                    "characters",
                    limit,
                )
                .at(span, "this string")
            }
            _ => Ok(()),
        }
    }
}

/// An intersection lies in either operand and a difference in its first, so one box is enough to
/// know where to look.
fn within(operator: BinaryOperator, operands: &[Value; 2], value: Value) -> Value {
    let domain = |operand: &Value| match operand {
        Value::Field(field) => field.domain(),
        _ => None,
    };
    match value {
        Value::Field(field) if field.domain().is_none() => {
            let domain = match operator {
                BinaryOperator::Intersection => domain(&operands[0]).or(domain(&operands[1])),
                BinaryOperator::Difference => domain(&operands[0]),
                _ => None,
            };
            Value::Field(field.with_domain(domain))
        }
        other => other,
    }
}
