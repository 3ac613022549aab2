//! Calls: of functions, fields, methods and pipelines.

use std::rc::Rc;

use crate::diagnostic::{Code, Span, suggest};
use crate::language::builtin::{Arguments, Builtin, suited};
use crate::language::field::FieldValue;
use crate::language::function::{
    Argument, At, Closure, FunctionValue, Rule, match_arguments, parameter_names,
};
use crate::language::limits::{exceeded, weight};
use crate::language::product;
use crate::language::scope::Scope;
use crate::language::session::{BranchKind, Session};
use crate::language::value::{Outcome, Value, failure};
use crate::syntax::tree::{self, Expression, ExpressionKind, Function, Name, Pattern};

/// How deep functions are followed where it is unknown whether they are called at all, and so
/// where their recursion ends.
const DEEP_ENOUGH: u64 = 100;

impl Session {
    /// `callee(arguments)`, with `first` put before the written arguments. `a.f(b)` calls a
    /// property of `a` if it has one of that name that can be called, else the function `f` with
    /// `a` before the other arguments.
    pub(super) fn call_expression(
        &mut self,
        callee: &Expression,
        arguments: &[tree::Argument],
        first: Option<Argument>,
        span: Span,
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        let mut given: Vec<Argument> = first.into_iter().collect();
        let function = match &*callee.kind {
            ExpressionKind::Property { subject, name } => {
                let value = self.usable(subject, scope)?;
                match self.property(&value, name)? {
                    Some(property) => property,
                    None => {
                        let function = self.method(&value, name, scope)?;
                        given.insert(0, unnamed(value, subject.span));
                        function
                    }
                }
            }
            _ => self.usable(callee, scope)?,
        };
        for argument in arguments {
            given.push(Argument {
                name: argument.name.as_ref().map(|name| name.text.clone()),
                value: self.usable(&argument.value, scope)?,
                span: argument.value.span,
            });
        }
        self.call_value(&function, given, callee.span, span)
    }

    /// `left |> right`.
    pub(super) fn pipe(
        &mut self,
        left: &Expression,
        right: &Expression,
        span: Span,
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        let first = unnamed(self.usable(left, scope)?, left.span);
        match &*right.kind {
            ExpressionKind::Call { callee, arguments } => {
                self.call_expression(callee, arguments, Some(first), span, scope)
            }
            _ => {
                let function = self.usable(right, scope)?;
                self.call_value(&function, vec![first], right.span, span)
            }
        }
    }

    /// The function that `subject.name(…)` calls.
    fn method(&mut self, subject: &Value, name: &Name, scope: &Rc<Scope>) -> Outcome<Value> {
        if scope.find(&name.text).is_some() {
            return self.lookup(name, scope);
        }
        let mut error = failure(
            Code::UnknownProperty,
            format!(
                "{} has no property `{}`, and there is no function of that name",
                subject.kind(),
                name.text
            ),
        )
        .at(name.span, "unknown");
        let names = scope.names();
        let known = names
            .iter()
            .map(|name| &**name)
            .chain(product::property_names(subject));
        error.help =
            suggest::nearest(&name.text, known).map(|near| format!("did you mean `{near}`?"));
        Err(error)
    }

    /// Calls a value. `place` is where the value is written, `span` the whole call.
    pub(crate) fn call_value(
        &mut self,
        callee: &Value,
        arguments: Vec<Argument>,
        place: Span,
        span: Span,
    ) -> Outcome<Value> {
        match callee {
            Value::Unknown => Ok(Value::Unknown),
            Value::Function(function) => self.call_function(function, arguments, span),
            Value::Field(field) => self.call_field(field, arguments, span),
            other => {
                let mut error = failure(
                    Code::NotCallable,
                    format!(
                        "only functions and fields can be called, but this is {}",
                        other.kind()
                    ),
                )
                .at(place, other.kind());
                if matches!(other, Value::Number(_) | Value::Symbol(_) | Value::List(_)) {
                    error.help = Some("to multiply, write `*` between the factors".into());
                }
                Err(error)
            }
        }
    }

    fn call_field(
        &mut self,
        field: &FieldValue,
        arguments: Vec<Argument>,
        span: Span,
    ) -> Outcome<Value> {
        if let Some(named) = arguments.iter().find(|argument| argument.name.is_some()) {
            return Err(failure(
                Code::UnknownArgument,
                "a field is called with a point or with coordinates, without names",
            )
            .at(named.span, "given by name"));
        }
        let values: Vec<Value> = arguments
            .into_iter()
            .map(|argument| argument.value)
            .collect();
        self.check_time(span)?;
        let plain = self.graph.level == 0;
        let mut values = values;
        if plain
            && values
                .iter()
                .any(|value| matches!(value, Value::Interval(_)))
        {
            for value in &mut values {
                *value = self.plain(value.clone(), span)?;
            }
        }
        field
            .call(&mut self.graph, &values, self.parameters.values(), plain)
            .at(span, "in this call")
    }

    /// Calls a function.
    pub(crate) fn call_function(
        &mut self,
        function: &FunctionValue,
        arguments: Vec<Argument>,
        span: Span,
    ) -> Outcome<Value> {
        match function {
            FunctionValue::Closure(closure) => self.call_closure(closure, arguments, span),
            FunctionValue::Builtin(builtin) => self.call_builtin(builtin, arguments, span),
            FunctionValue::Derivative {
                operator,
                function,
                others,
            } => self.call_derivative(operator, function, others, arguments, span),
            FunctionValue::Pointwise(pointwise) => self.call_pointwise(pointwise, &arguments, span),
        }
    }

    fn call_closure(
        &mut self,
        closure: &Rc<Closure>,
        arguments: Vec<Argument>,
        span: Span,
    ) -> Outcome<Value> {
        self.step(span)?;
        if let Some(branch) = self.branch
            && branch.kind == BranchKind::Unknown
            && self.depth > DEEP_ENOUGH
        {
            return Ok(Value::Unknown);
        }
        if self.depth >= self.limits.recursion {
            return exceeded(
                Code::RecursionLimit,
                "functions call each other too deeply",
                "recursion",
                self.limits.recursion,
            )
            .at(span, "this call");
        }
        let scope = Scope::inside(&closure.scope);
        self.depth += 1;
        // A module's functions find files where the module does.
        let outer = match self.modules.units.is_empty() {
            true => None,
            false => scope
                .unit()
                .map(|unit| std::mem::replace(&mut self.unit, unit)),
        };
        let value = self
            .bind_arguments(closure, arguments, span, &scope)
            .and_then(|()| self.expression(&closure.function.body, &scope));
        if let Some(outer) = outer {
            self.unit = outer;
        }
        self.depth -= 1;
        // What fails inside the library has no place but this call.
        value.map_err(|error| {
            let label = format!("in this call of `{}`", closure.shown_name());
            error.at(span, &label)
        })
    }

    fn bind_arguments(
        &mut self,
        closure: &Closure,
        mut arguments: Vec<Argument>,
        span: Span,
        scope: &Rc<Scope>,
    ) -> Outcome<()> {
        let function = &closure.function;
        let shown = closure.shown_name();
        let rest = take_rest(function, &mut arguments);
        let places = match_arguments(shown, &parameter_names(function), arguments)
            .at(span, "in this call")?;
        for (parameter, argument) in function.parameters.iter().zip(places) {
            if parameter.rest {
                let list = Value::list(rest.iter().map(|rest| rest.value.clone()).collect());
                self.bind(&parameter.pattern, list, span, scope)?;
                continue;
            }
            let (value, place) = match (argument, &parameter.default) {
                (Some(argument), _) => (argument.value, argument.span),
                (None, Some(default)) => (self.usable(default, scope)?, default.span),
                (None, None) => {
                    let name = match &parameter.pattern {
                        Pattern::Name(name) => format!(" `{}`", name.text),
                        Pattern::List(..) => String::new(),
                    };
                    return Err(failure(
                        Code::MissingArgument,
                        format!("`{shown}` needs the argument{name}"),
                    )
                    .at(span, "not given here"));
                }
            };
            self.bind(&parameter.pattern, value, place, scope)?;
        }
        Ok(())
    }

    pub(super) fn call_builtin(
        &mut self,
        builtin: &'static Builtin,
        arguments: Vec<Argument>,
        span: Span,
    ) -> Outcome<Value> {
        let builtin = suited(builtin, &arguments, self.graph.level == 0);
        let unknown = arguments.iter().any(|argument| argument.value.is_unknown());
        let weights = arguments.iter().map(|argument| weight(&argument.value));
        self.count_work(weights.sum(), span)?;
        if builtin.lifts
            && !unknown
            && let Some(function) = self.pointwise(&Rule::Builtin(builtin), &arguments, span)?
        {
            return Ok(function);
        }
        let arguments = Arguments::new(builtin, arguments, span)?;
        if builtin.acts {
            if self.graph.level > 0 {
                return Err(failure(
                    Code::WrongKind,
                    format!("`{}` acts, so it cannot stand inside a field", builtin.name),
                )
                .at(span, "inside a field's body"));
            }
            if !self.acting {
                return Ok(Value::Unknown);
            }
            self.check_time(span)?;
        }
        if unknown {
            return Ok(Value::Unknown);
        }
        let value = builtin.apply(self, &arguments).or_else(|error| {
            // Work that the clock has ended says only that it was cancelled.
            if error.code == Code::Cancelled {
                self.check_time(span)?;
            }
            Err(error)
        });
        let value = value.at(span, "in this call")?;
        if let Value::List(list) = &value {
            // Long lists take long to make: a step for every few elements.
            self.steps += list.leaves() / 16;
            self.count_work(list.leaves(), span)?;
        }
        Ok(value)
    }

    /// `grad(f)(p)` for a function f: the point tells in how many dimensions f lives.
    fn call_derivative(
        &mut self,
        operator: &'static Builtin,
        function: &Rc<FunctionValue>,
        others: &[Argument],
        arguments: Vec<Argument>,
        span: Span,
    ) -> Outcome<Value> {
        let dimension = match arguments.as_slice() {
            [
                Argument {
                    value: Value::List(point),
                    ..
                },
            ] => point.len(),
            coordinates => coordinates.len(),
        };
        let as_point = matches!(
            arguments.as_slice(),
            [Argument {
                value: Value::List(_),
                ..
            }]
        );
        if !(1..=3).contains(&dimension) {
            return Err(failure(
                Code::WrongDimension,
                "derivatives are taken in 1, 2 or 3 dimensions",
            )
            .at(span, "in this call"));
        }
        let field = self.function_as_field(function, dimension, as_point, span)?;
        let mut operands = vec![unnamed(Value::Field(field), span)];
        operands.extend_from_slice(others);
        let derivative = self.call_builtin(operator, operands, span)?;
        self.call_value(&derivative, arguments, span, span)
    }

    /// Traces a function as the field p -> function(p), or function(x, y, z).
    pub(crate) fn function_as_field(
        &mut self,
        function: &FunctionValue,
        dimension: usize,
        as_point: bool,
        span: Span,
    ) -> Outcome<FieldValue> {
        let coordinates = self.coordinate_symbols(dimension);
        let arguments = if as_point {
            vec![unnamed(Value::list(coordinates), span)]
        } else {
            coordinates
                .into_iter()
                .map(|coordinate| unnamed(coordinate, span))
                .collect()
        };
        let body = self.trace(span, |session| {
            session.call_function(function, arguments, span)
        })?;
        let body =
            crate::language::arithmetic::solid_of(&self.graph, &body).at(span, "as a field")?;
        FieldValue::new(dimension, self.graph.level, body, None).at(span, "as a field")
    }
}

/// Takes the arguments that belong to the parameter `name..`, if there is one: all without a
/// name from its place on.
fn take_rest(function: &Function, arguments: &mut Vec<Argument>) -> Vec<Argument> {
    let Some(first) = function
        .parameters
        .iter()
        .position(|parameter| parameter.rest)
    else {
        return Vec::new();
    };
    let mut place = 0;
    let is_rest = |argument: &Argument| {
        place += usize::from(argument.name.is_none());
        argument.name.is_none() && place > first
    };
    let (rest, others) = std::mem::take(arguments).into_iter().partition(is_rest);
    *arguments = others;
    rest
}

pub(super) fn unnamed(value: Value, span: Span) -> Argument {
    Argument {
        name: None,
        value,
        span,
    }
}
