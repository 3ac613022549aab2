//! `with`: the same under other parameters or settings.
//!
//! Parameters are data, so a field is given other values for them as it is. Settings shape the
//! graph: for another value of one, the definitions that the subject needs are run again, in a
//! scope of their own, and the subject is evaluated there.

use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::diagnostic::{Code, Diagnostic, Span, suggest};
use crate::graph::NodeId;
use crate::language::function::At;
use crate::language::mention;
use crate::language::parameters;
use crate::language::scope::{Binding, Scope};
use crate::language::session::Session;
use crate::language::settings;
use crate::language::unit::Unit;
use crate::language::value::{Outcome, Value, failure};
use crate::syntax::tree::{Expression, Name};

/// Of so many changes of settings the definitions are kept, so that a `with` in a loop runs them
/// once; the oldest go.
const KEPT_WORLDS: usize = 64;

/// An error that has more places than this is not told of more `with`s.
const MOST_LABELS: usize = 3;

/// See [`Session::world_key`].
pub(in crate::language) type WorldKey = (Arc<str>, Vec<usize>, Vec<(Arc<str>, String)>);

/// Definitions that have been run under certain settings, and what came of them.
#[derive(Clone, Debug)]
pub(in crate::language) struct World {
    unit: Rc<Unit>,
    parameters: parameters::Parameters,
    settings: settings::Settings,
    modules: FxHashMap<PathBuf, Rc<Unit>>,
    numbers: FxHashMap<NodeId, f64>,
}

impl World {
    /// Its files.
    pub(in crate::language) fn units(&self) -> Vec<Rc<Unit>> {
        let modules = self.modules.values().cloned();
        modules.chain([Rc::clone(&self.unit)]).collect()
    }

    /// Nothing has been run in it yet.
    fn new(session: &Session, unit: &Unit) -> World {
        World {
            unit: unit.fresh(&session.prelude()),
            parameters: session.parameters.clone(),
            settings: session.settings.clone(),
            modules: FxHashMap::default(),
            numbers: FxHashMap::default(),
        }
    }
}

/// A setting's full name and the value that it is given.
type Change = (Arc<str>, Value);

impl Session {
    /// `subject with {name = value, …}`
    pub(super) fn with(
        &mut self,
        subject: &Expression,
        bindings: &[(Name, Expression)],
        span: Span,
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        given_once(bindings)?;
        let mut settings = Vec::new();
        let mut of_parameters = Vec::new();
        let mut unknown = false;
        for (name, expression) in bindings {
            let full_name = self.full_name(name, scope)?;
            if self.settings.get(&full_name).is_none() {
                of_parameters.push((full_name, name, expression));
                continue;
            }
            let value = self.usable(expression, scope)?;
            unknown |= value.is_unknown();
            self.check_setting(&full_name, &value, expression.span)?;
            settings.push((full_name, value));
        }
        let value = match settings.is_empty() {
            true => self.usable(subject, scope)?,
            false if unknown => self.usable(subject, scope).map(|_| Value::Unknown)?,
            false => self.again(subject, settings, span, scope)?,
        };
        let mut changes = Vec::new();
        for (full_name, name, expression) in of_parameters {
            match self.parameter_change(&full_name, name, expression, scope)? {
                Some(change) => changes.extend(change),
                None => unknown = true,
            }
        }
        match value {
            Value::Unknown => Ok(Value::Unknown),
            _ if unknown => Ok(Value::Unknown),
            Value::Field(field) => Ok(Value::Field(field.with(changes))),
            value if changes.is_empty() && !bindings.is_empty() => Ok(value),
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

    /// The components of q that one binding changes; `None` where the value is unknown.
    fn parameter_change(
        &mut self,
        full_name: &str,
        name: &Name,
        expression: &Expression,
        scope: &Rc<Scope>,
    ) -> Outcome<Option<Vec<(usize, f64)>>> {
        let parameter = self
            .parameters
            .get(full_name)
            .map_err(|error| self.or_setting(error, full_name))
            .at(name.span, "not a parameter")?
            .clone();
        let value = self.usable(expression, scope)?;
        let value = self.plain(value, expression.span)?;
        if value.is_unknown() {
            return Ok(None);
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
        let numbered = components.into_iter().enumerate();
        Ok(Some(
            numbered
                .map(|(place, value)| (parameter.first + place, value))
                .collect(),
        ))
    }

    /// The name under which the session knows what is called `name` in this scope.
    fn full_name(&self, name: &Name, scope: &Scope) -> Outcome<Arc<str>> {
        let Some((modules, last)) = name.text.rsplit_once('.') else {
            let unit = scope.unit().unwrap_or_else(|| Rc::clone(&self.main));
            return Ok(unit.full_name(&name.text));
        };
        let mut around: Option<Rc<Scope>> = None;
        for module in modules.split('.') {
            let found = match &around {
                None => scope.find(module),
                Some(inner) => inner.find_here(module),
            };
            let Some(Binding::Constant(Value::Module(found))) = found else {
                let message = format!("there is no module `{module}` here");
                return Err(failure(Code::UnknownName, message).at(name.span, "not a module"));
            };
            around = Some(Rc::clone(&found.scope));
        }
        match around.and_then(|scope| scope.unit()) {
            Some(unit) => Ok(unit.full_name(last)),
            None => Ok(Arc::clone(&name.text)),
        }
    }

    /// Adds to an error about an unknown parameter that it may be a setting that is meant.
    fn or_setting(&self, mut error: Box<Diagnostic>, name: &str) -> Box<Diagnostic> {
        let settings = self.settings.iter().map(|(name, _)| &**name);
        if let Some(near) = suggest::nearest(name, settings) {
            error.help = Some(format!("did you mean the setting `{near}`?"));
        }
        error
    }

    /// Fails unless a setting may have this value.
    pub(super) fn check_setting(&self, name: &str, value: &Value, span: Span) -> Outcome<()> {
        let Some(setting) = self.settings.get(name) else {
            return Ok(());
        };
        if value.is_symbolic() {
            return Err(depends(name, span));
        }
        if value.is_unknown() {
            return Ok(());
        }
        if !settings::same_kind(value, &setting.value) {
            let message = format!(
                "the setting `{name}` is {}, and is given {}",
                setting.value.kind(),
                value.kind()
            );
            return Err(failure(Code::WrongKind, message).at(span, value.kind()));
        }
        settings::check(name, value, setting.range.as_ref()).at(span, "outside its range")
    }

    /// The subject as it is where settings have other values.
    fn again(
        &mut self,
        subject: &Expression,
        changes: Vec<Change>,
        span: Span,
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        self.step(span)?;
        let unit = scope.unit().unwrap_or_else(|| Rc::clone(&self.main));
        check_locals(subject, scope, &unit)?;
        let done = unit.done.get();
        let places = {
            let statements = unit.statements.borrow();
            mention::needed(&statements[..done.min(statements.len())], [subject])
        };
        let outside = self.parameters.clone();
        let overriding = self.overriding.clone();
        self.overriding.extend(changes);
        let key = self.world_key(&unit, &places);
        let world = match self.worlds.get(&key) {
            Some(world) => world.clone(),
            None => World::new(self, &unit),
        };
        let is_new = world.unit.done.get() == 0;
        let fresh = Rc::clone(&world.unit);
        let before = self.enter(world);
        self.runs_again += 1;
        let scope = scope.moved(&unit.scope, &fresh.scope);
        let made = match is_new {
            true => self
                .run_definitions(&fresh, places)
                .map_err(|error| because_of(error, span)),
            false => Ok(()),
        };
        let is_made = made.is_ok();
        let value = made
            .and_then(|()| self.usable(subject, &scope))
            .and_then(|value| self.settled(value, &outside, subject.span));
        self.runs_again -= 1;
        let world = self.enter(before);
        self.overriding = overriding;
        if is_made {
            if self.worlds.len() >= KEPT_WORLDS {
                self.worlds.shift_remove_index(0);
            }
            self.worlds.insert(key, world);
        }
        value
    }

    /// What decides what definitions that are run again give: whose they are, which ones, and
    /// the settings.
    fn world_key(&self, unit: &Unit, places: &[usize]) -> WorldKey {
        let mut changes: Vec<(Arc<str>, String)> = self
            .overriding
            .iter()
            .map(|(name, value)| (Arc::clone(name), settings::quoted(value)))
            .collect();
        changes.sort();
        (Arc::clone(&unit.prefix), places.to_vec(), changes)
    }

    /// Goes over to other definitions, and gives the present ones.
    fn enter(&mut self, world: World) -> World {
        World {
            unit: std::mem::replace(&mut self.unit, world.unit),
            parameters: std::mem::replace(&mut self.parameters, world.parameters),
            settings: std::mem::replace(&mut self.settings, world.settings),
            modules: std::mem::replace(&mut self.modules.units, world.modules),
            numbers: std::mem::replace(&mut self.plain_numbers, world.numbers),
        }
    }

    /// A value for use outside of the definitions that were run again: parameters whose defaults
    /// depend on a setting have other values in it than they have outside.
    fn settled(
        &mut self,
        value: Value,
        outside: &parameters::Parameters,
        span: Span,
    ) -> Outcome<Value> {
        let here = self.parameters.values().iter().enumerate();
        let differences: Vec<(usize, f64)> = here
            .zip(outside.values())
            .filter(|((_, here), outside)| here.to_bits() != outside.to_bits())
            .map(|((index, here), _)| (index, *here))
            .collect();
        if differences.is_empty() {
            return Ok(value);
        }
        match value {
            Value::Field(field) => Ok(Value::Field(field.with_defaults(&differences))),
            Value::List(elements) => elements
                .iter()
                .map(|element| self.settled(element.clone(), outside, span))
                .collect::<Outcome<_>>()
                .map(Value::list),
            symbol @ (Value::Symbol(_) | Value::Condition(_)) => self.plain(symbol, span),
            Value::Function(_) | Value::Module(_) => {
                let name = self.parameters.component_name(differences[0].0);
                let message = format!(
                    "the parameter `{name}` has another default under this setting, which {} \
                     cannot take along",
                    value.kind()
                );
                let mut error = failure(Code::NotConcrete, message).at(span, value.kind());
                error.help = Some("apply `with` to a field that is made of it".into());
                Err(error)
            }
            other => Ok(other),
        }
    }
}

/// The error for a setting whose value depends on the point or on parameters.
pub(super) fn depends(name: &str, span: Span) -> Box<Diagnostic> {
    let message = format!("the setting `{name}` depends on the point or on parameters");
    let mut error = failure(Code::NotConcrete, message).at(span, "not a plain value");
    error.help = Some(
        "a setting shapes the graph: its value must be known before; what may change later is a \
         `param`"
            .into(),
    );
    error
}

/// Says for which `with` definitions were run again, for the innermost few.
fn because_of(error: Box<Diagnostic>, span: Span) -> Box<Diagnostic> {
    match error.labels.len() {
        0..=MOST_LABELS => Box::new(error.label(span, "because of this `with`")),
        _ => error,
    }
}

fn given_once(bindings: &[(Name, Expression)]) -> Outcome<()> {
    for (place, (name, _)) in bindings.iter().enumerate() {
        let before = bindings[..place]
            .iter()
            .find(|(before, _)| before.text == name.text);
        if let Some((before, _)) = before {
            let error = failure(Code::BoundTwice, format!("`{}` is given twice", name.text));
            return Err(Box::new(
                error
                    .label(name.span, "the second time")
                    .label(before.span, "the first time"),
            ));
        }
    }
    Ok(())
}

/// Fails where the subject mentions a field or function that a block or call has made: it would
/// not be made again.
fn check_locals(subject: &Expression, scope: &Rc<Scope>, unit: &Unit) -> Outcome<()> {
    let mut names = FxHashSet::default();
    mention::mentioned(subject, &mut names);
    let mut names: Vec<Arc<str>> = names.into_iter().collect();
    names.sort();
    for name in names {
        let mut around = Some(scope);
        while let Some(local) = around.filter(|local| !Rc::ptr_eq(local, &unit.scope)) {
            match local.find_here(&name) {
                Some(Binding::Constant(value) | Binding::Variable(value)) if is_made(&value) => {
                    let message = format!(
                        "`{name}` was made in a block or call, so it is not made again for \
                         another setting"
                    );
                    let mut error =
                        failure(Code::NotConcrete, message).at(subject.span, "made before");
                    error.help = Some(
                        "apply `with` to a definition at the top of the file, before it is \
                         passed on"
                            .into(),
                    );
                    return Err(error);
                }
                Some(_) => break,
                None => around = local.parent(),
            }
        }
    }
    Ok(())
}

fn is_made(value: &Value) -> bool {
    match value {
        Value::Field(_) | Value::Function(_) => true,
        Value::List(elements) => elements.iter().any(is_made),
        _ => false,
    }
}
