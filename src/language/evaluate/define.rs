//! Definitions: parameters, functions, fields.

use std::rc::Rc;
use std::sync::Arc;

use crate::diagnostic::{Code, Span};
use crate::geometry::Bounds;
use crate::language::arithmetic::solid_of;
use crate::language::field::{FieldValue, bounds_of};
use crate::language::function::{At, Closure, FunctionValue};
use crate::language::parameters::{self, Parameter};
use crate::language::scope::{Binding, Scope};
use crate::language::session::{BranchKind, Session};
use crate::language::tracer::DEEPEST_LEVEL;
use crate::language::value::{Outcome, Value, failure};
use crate::syntax::tree::{Coordinates, Expression, Function, Name, Statement, StatementKind};

impl Session {
    /// `param name = value in range`: new components of q, bound as symbols.
    pub(super) fn define_parameter(
        &mut self,
        name: &Name,
        value: &Expression,
        range: Option<&Expression>,
        statement: &Statement,
        scope: &Rc<Scope>,
    ) -> Outcome<()> {
        let default = self.usable(value, scope)?;
        let default = self.plain(default, value.span)?;
        let range = match range {
            Some(range) => Some(self.parameter_range(range, scope)?),
            None => None,
        };
        let (shape, span) = match self.settings.get(&*name.text).cloned() {
            Some(setting) => {
                let globals = Rc::clone(&self.globals);
                let given = self.usable(&setting, &globals)?;
                let given = self.plain(given, setting.span)?;
                if !parameters::same_shape(&given, &default) {
                    let message = format!(
                        "the parameter `{}` is {}, and is set to {} of another shape",
                        name.text,
                        default.kind(),
                        given.kind()
                    );
                    return Err(failure(Code::WrongKind, message).at(setting.span, "this value"));
                }
                (given, setting.span)
            }
            None => (default, value.span),
        };
        let components = parameters::components(&shape).at(span, shape.kind())?;
        parameters::check_range(&name.text, &components, range).at(span, "outside its range")?;
        let first = self.parameters.values().len();
        let mut next = first;
        let graph = &mut self.graph;
        let symbols = parameters::fill(&shape, &mut || {
            next += 1;
            Value::Symbol(graph.parameter(next - 1))
        });
        let definition = Parameter {
            first,
            value: shape,
            range,
            documentation: statement.documentation.clone(),
        };
        self.parameters.define(&name.text, definition, components);
        scope.bind(&name.text, Binding::Constant(symbols));
        Ok(())
    }

    fn parameter_range(&mut self, range: &Expression, scope: &Rc<Scope>) -> Outcome<(f64, f64)> {
        match self.usable(range, scope)? {
            Value::Interval(interval) => Ok((interval.low, interval.high)),
            other => Err(failure(
                Code::WrongKind,
                format!(
                    "the range of a parameter is an interval, but this is {}",
                    other.kind()
                ),
            )
            .at(range.span, other.kind())),
        }
    }

    /// `fn name(…)`: a closure over the scope that it stands in.
    pub(super) fn define_function(
        &mut self,
        name: &Name,
        function: &Arc<Function>,
        statement: &Statement,
        scope: &Rc<Scope>,
    ) {
        let closure = Closure {
            name: Some(Arc::clone(&name.text)),
            function: Arc::clone(function),
            scope: Rc::clone(scope),
            documentation: statement.documentation.clone(),
        };
        let value = Value::Function(FunctionValue::Closure(Rc::new(closure)));
        scope.bind(&name.text, Binding::Constant(value));
    }

    /// `field name(…) over … = body`: traces the body once.
    pub(crate) fn define_field(&mut self, statement: &Statement, scope: &Rc<Scope>) -> Outcome<()> {
        let StatementKind::Field {
            name,
            coordinates,
            domain,
            body,
        } = &statement.kind
        else {
            return Ok(());
        };
        let inner = Scope::inside(scope);
        let dimension = match coordinates {
            Coordinates::Named(names) => {
                let symbols = self.coordinate_symbols(names.len());
                for (name, symbol) in names.iter().zip(symbols) {
                    inner.bind(&name.text, Binding::Constant(symbol));
                }
                names.len()
            }
            Coordinates::Point { name, dimension } => {
                let point = self.coordinate_symbols(*dimension);
                inner.bind(&name.text, Binding::Constant(Value::list(point)));
                *dimension
            }
        };
        let domain = self.domain(domain, dimension, scope)?;
        let traced = self.trace(body.span, |session| session.usable(body, &inner))?;
        if traced.is_unknown() {
            scope.bind(&name.text, Binding::Constant(Value::Unknown));
            return Ok(());
        }
        let solid = solid_of(&self.graph, &traced).at(body.span, "as the body of a field")?;
        let field = FieldValue::new(dimension, self.graph.level, solid, domain)
            .at(body.span, "the body of the field")?
            .named(&name.text, statement.documentation.clone());
        if Rc::ptr_eq(scope, &self.globals) {
            self.fields.insert(Arc::clone(&name.text), field.clone());
        }
        scope.bind(&name.text, Binding::Constant(Value::Field(field)));
        Ok(())
    }

    fn domain(
        &mut self,
        sides: &[Expression],
        dimension: usize,
        scope: &Rc<Scope>,
    ) -> Outcome<Option<Bounds>> {
        let (Some(first), Some(last)) = (sides.first(), sides.last()) else {
            return Ok(None);
        };
        let span = first.span.to(last.span);
        let mut values = Vec::new();
        for side in sides {
            let value = self.usable(side, scope)?;
            values.push(value);
        }
        let value = match values.as_slice() {
            [single] => single.clone(),
            _ => Value::list(values),
        };
        if value.is_unknown() {
            return Ok(None);
        }
        bounds_of(&value, dimension)
            .map(Some)
            .at(span, "the domain")
    }

    /// The symbols of a point's coordinates.
    pub(crate) fn coordinate_symbols(&mut self, dimension: usize) -> Vec<Value> {
        let nodes = self.graph.coordinates(dimension);
        nodes.into_iter().map(Value::Symbol).collect()
    }

    /// Evaluates a field's body: nothing may act, nothing structural may depend on symbols, and
    /// nothing outside may be assigned.
    pub(crate) fn trace<T>(
        &mut self,
        span: Span,
        evaluate: impl FnOnce(&mut Session) -> Outcome<T>,
    ) -> Outcome<T> {
        if self.graph.level == DEEPEST_LEVEL {
            let message = format!("fields are nested deeper than {DEEPEST_LEVEL}");
            return Err(failure(Code::RecursionLimit, message).at(span, "this body"));
        }
        self.graph.level += 1;
        let result = self.branch(BranchKind::Traced, evaluate);
        self.graph.level -= 1;
        result
    }
}
