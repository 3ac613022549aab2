//! Expressions.

use std::rc::Rc;

use crate::diagnostic::{Code, Diagnostic, Span, suggest};
use crate::graph::Op;
use crate::language::arithmetic::{self, not_a_condition};
use crate::language::field;
use crate::language::function::{At, Closure, FunctionValue};
use crate::language::library::Module;
use crate::language::limits::exceeded;
use crate::language::list::List;
use crate::language::parameters;
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
        let value = stacker::maybe_grow(STACK_RESERVE, STACK_GROWTH, || {
            self.expression_kind(expression, scope)
        })?;
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
            ExpressionKind::With { subject, bindings } => self.with(subject, bindings, scope),
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
            Some(Binding::Lazy(_)) if !self.acting => Ok(Value::Unknown),
            Some(Binding::Lazy(statement)) => {
                // It is run as if it were its turn in the file, whoever asks for it.
                let globals = Rc::clone(&self.globals);
                let level = std::mem::take(&mut self.graph.level);
                let branch = self.branch.take();
                let done = self.statement(&statement, &globals);
                self.graph.level = level;
                self.branch = branch;
                done?;
                match globals.find(&name.text) {
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
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        if let BinaryOperator::And | BinaryOperator::Or = operator {
            return self.connective(operator == BinaryOperator::And, left, right, scope);
        }
        let operands = [self.usable(left, scope)?, self.usable(right, scope)?];
        let operands = self.settle(operands, [left.span, right.span], false)?;
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
            let lists = [&left, &right].map(|value| matches!(value, Value::List(_)));
            let [left_operand, right] =
                self.settle([left, right], [span, operand.span], lists.contains(&true))?;
            left = left_operand;
            let holds = arithmetic::compare(&mut self.graph, *operator, &left, &right)
                .at(span, "this comparison")?;
            all = Some(match all {
                None => holds,
                Some(before) => arithmetic::combine(&mut self.graph, true, &before, &holds)
                    .at(span, "this comparison")?,
            });
            left = right;
        }
        Ok(all.unwrap_or(Value::Bool(true)))
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
        for (place, (name, expression)) in bindings.iter().enumerate() {
            if let Some((before, _)) = bindings[..place]
                .iter()
                .find(|(before, _)| before.text == name.text)
            {
                let message = format!("the parameter `{}` is given twice", name.text);
                let error = failure(Code::BoundTwice, message);
                return Err(Box::new(
                    error
                        .label(name.span, "the second time")
                        .label(before.span, "the first time"),
                ));
            }
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

    /// A property of a value; those of a vector field's vectors are fields.
    pub(super) fn property(&mut self, value: &Value, name: &Name) -> Outcome<Option<Value>> {
        match value {
            Value::Field(field) if product::property(field.body(), &name.text).is_some() => {
                let operands = std::slice::from_ref(value);
                field::lift(&mut self.graph, operands, &mut |_, bodies| {
                    product::property(&bodies[0], &name.text)
                        .ok_or_else(|| product::unknown_property(&bodies[0], name))
                })
                .map(Some)
            }
            Value::Module(module) if module.scope.binds(&name.text) => {
                self.lookup(name, &module.scope).map(Some)
            }
            Value::Module(module) => Err(no_member(module, name)),
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

/// The error for a name that a module does not define.
fn no_member(module: &Module, name: &Name) -> Box<Diagnostic> {
    let message = format!("the module `{}` has no `{}`", module.name, name.text);
    let mut error = failure(Code::UnknownName, message).at(name.span, "unknown");
    let names = module.scope.own_names();
    let nearest = suggest::nearest(&name.text, names.iter().map(|name| &**name));
    error.help = Some(match nearest {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("it has {}", names.join(", ")),
    });
    error
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
