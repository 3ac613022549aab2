//! Files as units: the main file, and the modules that it imports.

use std::cell::{Cell, RefCell};
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::scope::Scope;
use crate::syntax::tree::Statement;

/// A file whose statements are run, with the scope that they bind names in.
#[derive(Debug)]
pub struct Unit {
    /// What stands before the names of its parameters and settings in the session: nothing for
    /// the main file, `bracket.` for a module that it imports under that name.
    pub(super) prefix: Arc<str>,
    pub(super) scope: Rc<Scope>,
    /// Where relative paths of what it reads start.
    pub(super) directory: PathBuf,
    /// Its statements; of the main file, those of all runs.
    pub(super) statements: RefCell<Vec<Statement>>,
    /// Where its imports lead, by the names that they have in it.
    pub(super) imports: RefCell<FxHashMap<Arc<str>, PathBuf>>,
    /// How many of its statements have been run.
    pub(super) done: Cell<usize>,
}

impl Unit {
    /// A unit whose names stand in a new scope inside `outer`.
    pub(super) fn new(outer: &Rc<Scope>, prefix: Arc<str>, directory: PathBuf) -> Rc<Unit> {
        let unit = Rc::new(Unit {
            prefix,
            scope: Scope::inside(outer),
            directory,
            statements: RefCell::default(),
            imports: RefCell::default(),
            done: Cell::new(0),
        });
        unit.scope.belongs_to(&unit);
        unit
    }

    /// The same file with nothing run yet.
    pub(super) fn fresh(&self, outer: &Rc<Scope>) -> Rc<Unit> {
        let unit = Unit::new(outer, Arc::clone(&self.prefix), self.directory.clone());
        unit.statements.replace(self.statements.borrow().clone());
        unit.imports.replace(self.imports.borrow().clone());
        unit
    }

    /// The name under which the session knows a parameter or setting of this file.
    pub(super) fn full_name(&self, name: &str) -> Arc<str> {
        format!("{}{name}", self.prefix).into()
    }

    /// Forgets everything, when nobody will ask for it any more.
    pub(super) fn clear(&self) {
        self.statements.take();
        let mut scope = Some(&self.scope);
        while let Some(current) = scope {
            current.clear();
            scope = current.parent();
        }
    }

    /// The statement at a place in the file.
    pub(super) fn statement(&self, place: usize) -> Option<Statement> {
        self.statements.borrow().get(place).cloned()
    }
}
