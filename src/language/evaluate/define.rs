//! Definitions: parameters, functions, fields.

use std::rc::Rc;
use std::sync::Arc;

use super::with::depends;
use crate::diagnostic::{Code, Span};
use crate::geometry::Bounds;
use crate::language::arithmetic::solid_of;
use crate::language::field::{FieldValue, bounds_of};
use crate::language::function::{At, Closure, FunctionValue};
use crate::language::parameters::{self, Parameter};
use crate::language::scope::{Binding, Scope};
use crate::language::session::{BranchKind, Session};
use crate::language::settings::{self, Setting, SettingRange};
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
        let full_name = self.unit.full_name(&name.text);
        let (shape, span) = match self.given(&full_name)? {
            Some((given, span)) => {
                if !parameters::same_shape(&given, &default) {
                    let message = format!(
                        "the parameter `{full_name}` is {}, and is set to {} of another shape",
                        default.kind(),
                        given.kind()
                    );
                    return Err(failure(Code::WrongKind, message).at(span, "this value"));
                }
                (given, span)
            }
            None => (default, value.span),
        };
        let components = parameters::components(&shape).at(span, shape.kind())?;
        parameters::check_range(&full_name, &components, range).at(span, "outside its range")?;
        let first = self.first_component(&full_name, &shape, name.span)?;
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
        self.parameters.define(&full_name, definition, components);
        scope.bind(&name.text, Binding::Constant(symbols));
        Ok(())
    }

    /// The place in q of a new parameter. One that is given again keeps its place if it keeps its
    /// shape. Where definitions are run again for a setting, parameters keep their places, so they
    /// must keep their shapes.
    fn first_component(&self, name: &str, shape: &Value, span: Span) -> Outcome<usize> {
        if self.runs_again == 0 {
            return Ok(match self.parameters.get(name) {
                Ok(before) if parameters::same_shape(&before.value, shape) => before.first,
                _ => self.parameters.values().len(),
            });
        }
        let before = self.parameters.get(name).at(span, "not defined before")?;
        if parameters::same_shape(&before.value, shape) {
            return Ok(before.first);
        }
        let message = format!("the setting changes the shape of the parameter `{name}`");
        let mut error = failure(Code::WrongKind, message).at(span, "this parameter");
        error.help = Some("such a setting can be changed from outside only, by `--set`".into());
        Err(error)
    }

    /// What was given from outside for a parameter or setting, and where that is written.
    fn given(&mut self, full_name: &str) -> Outcome<Option<(Value, Span)>> {
        let Some(expression) = self.given.get(full_name).cloned() else {
            return Ok(None);
        };
        if let Some(value) = self.given_values.get(full_name) {
            return Ok(Some((value.clone(), expression.span)));
        }
        let globals = Rc::clone(&self.main.scope);
        let value = self.usable(&expression, &globals)?;
        let value = self.plain(value, expression.span)?;
        let value_kept = value.clone();
        self.given_values.insert(full_name.into(), value_kept);
        Ok(Some((value, expression.span)))
    }

    /// `setting name = value in range`
    pub(super) fn define_setting(
        &mut self,
        name: &Name,
        value: &Expression,
        range: Option<&Expression>,
        statement: &Statement,
        scope: &Rc<Scope>,
    ) -> Outcome<()> {
        let default = self.usable(value, scope)?;
        if default.is_symbolic() {
            return Err(depends(&name.text, value.span));
        }
        if default.is_unknown() {
            scope.bind(&name.text, Binding::Constant(Value::Unknown));
            return Ok(());
        }
        let range = match range {
            Some(range) => Some(self.setting_range(range, scope)?),
            None => None,
        };
        let full_name = self.unit.full_name(&name.text);
        let setting = Setting {
            value: default.clone(),
            range,
            documentation: statement.documentation.clone(),
        };
        let (chosen, span) = match self.overriding.get(&full_name) {
            Some(value) => (value.clone(), name.span),
            None => self
                .given(&full_name)?
                .unwrap_or((default.clone(), value.span)),
        };
        settings::check(&full_name, &default, None).at(value.span, default.kind())?;
        self.settings.define(&full_name, setting.clone());
        self.check_setting(&full_name, &chosen, span)?;
        let value = chosen.clone();
        self.settings
            .define(&full_name, Setting { value, ..setting });
        scope.bind(&name.text, Binding::Constant(chosen));
        Ok(())
    }

    fn setting_range(&mut self, range: &Expression, scope: &Rc<Scope>) -> Outcome<SettingRange> {
        match self.usable(range, scope)? {
            Value::Interval(interval) => Ok(SettingRange::Between(interval)),
            Value::List(values) if !values.is_empty() => {
                for value in values.iter() {
                    settings::check("", value, None).at(range.span, "one of its elements")?;
                }
                Ok(SettingRange::OneOf(values))
            }
            other => Err(failure(
                Code::WrongKind,
                format!(
                    "the range of a setting is an interval or a list of values, but this is {}",
                    other.kind()
                ),
            )
            .at(range.span, other.kind())),
        }
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
        if Rc::ptr_eq(scope, &self.main.scope) {
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
