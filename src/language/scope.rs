//! Scopes: what a name is bound to.

use std::cell::{Cell, OnceCell, RefCell};
use std::rc::{Rc, Weak};
use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::unit::Unit;
use super::value::Value;
use crate::library::Entry;
use crate::syntax::tree::Statement;

thread_local! {
    static NEXT_AGE: Cell<u64> = const { Cell::new(0) };
}

/// The bindings of one block, call or file, and the scope around it.
#[derive(Debug)]
pub struct Scope {
    bindings: RefCell<FxHashMap<Arc<str>, Binding>>,
    parent: Option<Rc<Scope>>,
    /// Scopes are numbered as they are made, so that it can be told whether a `var` is older
    /// than a branch that assigns it.
    age: u64,
    /// The file whose own names are bound here.
    unit: OnceCell<Rc<Unit>>,
}

/// What a name stands for.
#[derive(Clone, Debug)]
pub enum Binding {
    /// A constant.
    Constant(Value),
    /// A `var`, which may be assigned.
    Variable(Value),
    /// A definition of that file that needs actions, and is run when it is first asked for.
    Lazy(Rc<Statement>, Rc<Unit>),
    /// A definition of the library, and the scope to evaluate it in when it is first asked for.
    Library(&'static Entry, Weak<Scope>),
}

impl Default for Scope {
    fn default() -> Self {
        Scope {
            bindings: RefCell::default(),
            parent: None,
            age: Scope::now(),
            unit: OnceCell::new(),
        }
    }
}

impl Scope {
    /// An empty scope inside `parent`.
    pub fn inside(parent: &Rc<Scope>) -> Rc<Scope> {
        Rc::new(Scope {
            parent: Some(Rc::clone(parent)),
            ..Scope::default()
        })
    }

    /// The age of the next scope: every scope that exists is less.
    pub fn now() -> u64 {
        let age = NEXT_AGE.get();
        NEXT_AGE.set(age + 1);
        age
    }

    /// Binds the name here; what it was bound to before in this very scope is replaced.
    pub fn bind(&self, name: &Arc<str>, binding: Binding) {
        self.bindings.borrow_mut().insert(Arc::clone(name), binding);
    }

    /// Forgets what the name was bound to here.
    pub(super) fn unbind(&self, name: &str) {
        self.bindings.borrow_mut().remove(name);
    }

    /// What is bound here, without what is around, to be put back by [`Scope::replace`].
    pub(super) fn copied(&self) -> FxHashMap<Arc<str>, Binding> {
        self.bindings.borrow().clone()
    }

    /// Binds these names here and no others.
    pub(super) fn replace(&self, bindings: FxHashMap<Arc<str>, Binding>) {
        drop(self.bindings.replace(bindings));
    }

    /// What the name means here.
    pub fn find(&self, name: &str) -> Option<Binding> {
        let mut scope = self;
        loop {
            if let Some(binding) = scope.bindings.borrow().get(name) {
                return Some(binding.clone());
            }
            scope = scope.parent.as_ref()?;
        }
    }

    /// Changes a `var` in place: `change` gets its present value and the age of its scope.
    /// `None` if the name is not a `var` that is visible here.
    pub fn update<T>(&self, name: &str, change: impl FnOnce(&mut Value, u64) -> T) -> Option<T> {
        let mut scope = self;
        loop {
            if let Some(binding) = scope.bindings.borrow_mut().get_mut(name) {
                return match binding {
                    Binding::Variable(value) => Some(change(value, scope.age)),
                    _ => None,
                };
            }
            scope = scope.parent.as_ref()?;
        }
    }

    /// What the name means here, without what is around.
    pub(super) fn find_here(&self, name: &str) -> Option<Binding> {
        self.bindings.borrow().get(name).cloned()
    }

    /// The names that are bound here, without those around, sorted.
    pub(super) fn names_here(&self) -> Vec<Arc<str>> {
        let mut names: Vec<Arc<str>> = self.bindings.borrow().keys().cloned().collect();
        names.sort();
        names
    }

    /// The names that have values here, without those around, sorted.
    pub(super) fn values_here(&self) -> Vec<(Arc<str>, Value)> {
        let bindings = self.bindings.borrow();
        let mut values: Vec<(Arc<str>, Value)> = bindings
            .iter()
            .filter_map(|(name, binding)| match binding {
                Binding::Constant(value) | Binding::Variable(value) => {
                    Some((Arc::clone(name), value.clone()))
                }
                Binding::Lazy(..) | Binding::Library(..) => None,
            })
            .collect();
        values.sort_by(|(left, _), (right, _)| left.cmp(right));
        values
    }

    /// The scope around this one.
    pub(super) fn parent(&self) -> Option<&Rc<Scope>> {
        self.parent.as_ref()
    }

    /// Makes this the scope of a file's own names.
    pub(super) fn belongs_to(&self, unit: &Rc<Unit>) {
        // A scope is made for one file, so it is set once.
        let _ = self.unit.set(Rc::clone(unit));
    }

    /// The file in which this scope lies; none in the program's own.
    pub(super) fn unit(&self) -> Option<Rc<Unit>> {
        let mut scope = self;
        loop {
            if let Some(unit) = scope.unit.get() {
                return Some(Rc::clone(unit));
            }
            scope = scope.parent.as_ref()?;
        }
    }

    /// This scope and those around it up to `outer`, copied and put into `instead`.
    pub(super) fn moved(self: &Rc<Scope>, outer: &Rc<Scope>, instead: &Rc<Scope>) -> Rc<Scope> {
        if Rc::ptr_eq(self, outer) {
            return Rc::clone(instead);
        }
        let around = match &self.parent {
            Some(parent) => parent.moved(outer, instead),
            None => Rc::clone(instead),
        };
        let copy = Scope::inside(&around);
        copy.bindings.replace(self.bindings.borrow().clone());
        copy
    }

    /// The `var`s that are bound here, and their values.
    pub(super) fn variables(&self) -> Vec<(Arc<str>, Value)> {
        let bindings = self.bindings.borrow();
        let mut variables: Vec<(Arc<str>, Value)> = bindings
            .iter()
            .filter_map(|(name, binding)| match binding {
                Binding::Variable(value) => Some((Arc::clone(name), value.clone())),
                _ => None,
            })
            .collect();
        variables.sort_by(|(left, _), (right, _)| left.cmp(right));
        variables
    }

    /// Forgets what is bound here, and in the modules that are bound here. Functions and the scopes
    /// that they were made in hold each other, so without this neither would ever be freed.
    pub(super) fn clear(&self) {
        for binding in self.bindings.take().into_values() {
            if let Binding::Constant(Value::Module(module)) = binding {
                module.scope.clear();
            }
        }
    }

    /// The names that are bound here and around, sorted.
    pub fn names(&self) -> Vec<Arc<str>> {
        let mut names: Vec<Arc<str>> = Vec::new();
        let mut scope = Some(self);
        while let Some(current) = scope {
            names.extend(current.bindings.borrow().keys().cloned());
            scope = current.parent.as_deref();
        }
        names.sort();
        names.dedup();
        names
    }
}
