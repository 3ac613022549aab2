//! Scopes: what a name is bound to.

use std::cell::{Cell, RefCell};
use std::rc::{Rc, Weak};
use std::sync::Arc;

use rustc_hash::FxHashMap;

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
}

/// What a name stands for.
#[derive(Clone, Debug)]
pub enum Binding {
    /// A constant.
    Constant(Value),
    /// A `var`, which may be assigned.
    Variable(Value),
    /// A definition of the file that needs actions, and is run when it is first asked for.
    Lazy(Rc<Statement>),
    /// A definition of the library, and the scope to evaluate it in when it is first asked for.
    Library(&'static Entry, Weak<Scope>),
}

impl Default for Scope {
    fn default() -> Self {
        Scope {
            bindings: RefCell::default(),
            parent: None,
            age: Scope::now(),
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

    /// Whether the name is bound in this very scope.
    pub fn binds(&self, name: &str) -> bool {
        self.bindings.borrow().contains_key(name)
    }

    /// The names that are bound in this very scope, sorted.
    pub fn own_names(&self) -> Vec<Arc<str>> {
        let mut names: Vec<Arc<str>> = self.bindings.borrow().keys().cloned().collect();
        names.sort();
        names
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
