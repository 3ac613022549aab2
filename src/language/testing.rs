//! `test "…" { … }`: blocks that are run by whoever asks for them.

use std::rc::Rc;
use std::sync::Arc;

use super::scope::Binding;
use super::session::Session;
use super::unit::Unit;
use crate::diagnostic::{Diagnostic, Span};
use crate::syntax::tree::{Block, StatementKind};

/// A test of the file.
#[derive(Clone, Debug)]
pub struct Test {
    /// What it says that it tests.
    pub name: Arc<str>,
    /// Where its name stands.
    pub span: Span,
    body: Block,
}

impl Session {
    /// The tests of the main file, in order.
    pub fn tests(&self) -> Vec<Test> {
        let statements = self.main.statements.borrow();
        statements
            .iter()
            .filter_map(|statement| match &statement.kind {
                StatementKind::Test { name, body } => Some(Test {
                    name: Arc::clone(&name.text),
                    span: name.span,
                    body: body.clone(),
                }),
                _ => None,
            })
            .collect()
    }

    /// Runs a test of the file that has been run. It sees the file's definitions; what it assigns
    /// to a `var` of a file is taken back afterwards, so that no test sees another.
    pub fn run_test(&mut self, test: &Test) -> Result<(), Vec<Diagnostic>> {
        self.start_clock();
        let units: Vec<Rc<Unit>> = self.modules.units_in_order();
        let units = units.into_iter().chain([Rc::clone(&self.main)]);
        let before: Vec<_> = units.map(|unit| (unit.scope.variables(), unit)).collect();
        let main = Rc::clone(&self.main.scope);
        let result = self.block(&test.body, &main);
        for (variables, unit) in before {
            for (name, value) in variables {
                unit.scope.bind(&name, Binding::Variable(value));
            }
        }
        self.warn_of_refused_machine_code();
        result.map(drop).map_err(|error| vec![*error])
    }
}
