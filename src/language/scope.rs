//! Scopes: what a name is bound to.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::value::Value;
use crate::syntax::tree::Expression;

/// The bindings of one block, call or file, and the scope around it.
#[derive(Debug, Default)]
pub struct Scope {
    bindings: RefCell<FxHashMap<Arc<str>, Binding>>,
    parent: Option<Rc<Scope>>,
}

/// What a name stands for.
#[derive(Clone, Debug)]
pub enum Binding {
    /// A constant.
    Constant(Value),
    /// A `var`, which may be assigned.
    Variable(Value),
    /// A `let` of the file that is evaluated when it is first asked for.
    Lazy(Expression),
    /// A lazy one whose evaluation is under way: asking for it again is a cycle.
    Busy,
}

impl Scope {
    /// An empty scope inside `parent`.
    pub fn inside(parent: &Rc<Scope>) -> Rc<Scope> {
        Rc::new(Scope {
            bindings: RefCell::default(),
            parent: Some(Rc::clone(parent)),
        })
    }

    /// Binds the name here; what it was bound to before in this very scope is replaced.
    pub fn bind(&self, name: &Arc<str>, binding: Binding) {
        self.bindings.borrow_mut().insert(Arc::clone(name), binding);
    }

    /// What the name means here, and in which scope it is bound.
    pub fn find(self: &Rc<Self>, name: &str) -> Option<(Rc<Scope>, Binding)> {
        let mut scope = self;
        loop {
            if let Some(binding) = scope.bindings.borrow().get(name) {
                return Some((Rc::clone(scope), binding.clone()));
            }
            scope = scope.parent.as_ref()?;
        }
    }

    /// Changes a `var` in place: `change` gets its present value. `None` if the name is not a
    /// `var` that is visible here.
    pub fn update<T>(&self, name: &str, change: impl FnOnce(&mut Value) -> T) -> Option<T> {
        let mut scope = self;
        loop {
            if let Some(binding) = scope.bindings.borrow_mut().get_mut(name) {
                return match binding {
                    Binding::Variable(value) => Some(change(value)),
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
