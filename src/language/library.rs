//! The library's names in the scope of every file, and their values when they are asked for.

use std::rc::Rc;
use std::sync::Arc;

use super::module::Module;
use super::scope::{Binding, Scope};
use super::session::Session;
use super::value::{Outcome, Value};
use crate::diagnostic::{Diagnostic, Span};
use crate::library::{self, Entry, Namespace};
use crate::syntax::parse;

/// A scope with all names of the library inside `prelude`. Nothing is evaluated.
pub(super) fn scope(prelude: &Rc<Scope>) -> Rc<Scope> {
    let outer = Scope::inside(prelude);
    for Namespace { name, title } in library::namespaces() {
        let module = Module {
            name: Arc::from(name),
            scope: Scope::inside(&outer),
            documentation: Some(Arc::from(title)),
        };
        let name = Arc::clone(&module.name);
        outer.bind(&name, Binding::Constant(Value::Module(Rc::new(module))));
    }
    for entry in library::entries() {
        let place = match entry.namespace.and_then(|name| outer.find(name)) {
            Some(Binding::Constant(Value::Module(module))) => Rc::clone(&module.scope),
            _ => Rc::clone(&outer),
        };
        place.bind(&entry.name, Binding::Library(entry, Rc::downgrade(&place)));
    }
    outer
}

impl Session {
    /// The value of a definition of the library, evaluated in its `scope` the first time.
    ///
    /// All its places are [`Span::NOWHERE`], so what fails in it is reported at the call in the
    /// user's file.
    pub(super) fn library_value(&mut self, entry: &Entry, scope: &Rc<Scope>) -> Outcome<Value> {
        let parsed = parse(Span::NOWHERE.source, entry.text);
        if let Some(error) = parsed.diagnostics.into_iter().next() {
            return Err(Box::new(Diagnostic {
                labels: Vec::new(),
                message: format!("in the library's `{}`: {}", entry.name, error.message),
                ..error
            }));
        }
        let level = std::mem::take(&mut self.graph.level);
        let branch = self.branch.take();
        let done = parsed
            .tree
            .statements
            .iter()
            .try_for_each(|statement| self.statement(statement, scope).map(drop));
        self.graph.level = level;
        self.branch = branch;
        done?;
        match scope.find(&entry.name) {
            Some(Binding::Constant(value)) => Ok(value),
            _ => Ok(Value::Unknown),
        }
    }
}
