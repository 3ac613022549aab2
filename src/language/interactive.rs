//! A session that is entered piece by piece, as in a notebook.
//!
//! What was entered is kept as the statements of the main file, and the session is at any time what
//! running them from top to bottom gives. A definition may be given again: the new one replaces the
//! old, and what depends on the old one, directly or not, is run again behind it. What takes actions
//! for that (samples, meshes) is made again when it is next asked for. An input that fails leaves
//! the session as it was.

mod renewal;

use std::collections::VecDeque;
use std::rc::Rc;
use std::sync::Arc;

use indexmap::IndexMap;
use rustc_hash::FxHashMap;

use super::field::FieldValue;
use super::mention::{self, Names};
use super::parameters::Parameters;
use super::resolve::{self, defined_names};
use super::scope::Binding;
use super::session::{Mode, Session};
use super::settings::Settings;
use super::unit::Unit;
use super::value::{Outcome, Value};
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::syntax::tree::{Statement, StatementKind, Tree};
use renewal::Renewal;

/// Names of `var`s and their values.
type Variables = Vec<(Arc<str>, Value)>;

/// The state of a session at one time, to go back to.
pub struct Snapshot {
    bindings: FxHashMap<Arc<str>, Binding>,
    statements: Vec<Statement>,
    imports: FxHashMap<Arc<str>, std::path::PathBuf>,
    parameters: Parameters,
    settings: Settings,
    fields: IndexMap<Arc<str>, FieldValue>,
    /// The `var`s of modules.
    variables: Vec<(Rc<Unit>, Variables)>,
}

/// What was typed at one time: statements that are run one after the other.
pub struct Input {
    statements: VecDeque<Statement>,
    /// Names that wait for a definition that comes later in the input.
    waiting: Names,
}

/// What came of one statement.
pub struct Entered {
    /// The statement.
    pub statement: Statement,
    /// The value of an expression, else nothing.
    pub value: Value,
    /// The names of the definitions that were run again because of it, in order.
    pub renewed: Vec<Arc<str>>,
}

impl Input {
    /// The statement that comes next.
    pub fn next_statement(&self) -> Option<&Statement> {
        self.statements.front()
    }

    /// Puts another statement in the place of the next.
    pub fn replace_next(&mut self, statement: Statement) {
        if let Some(next) = self.statements.front_mut() {
            *next = statement;
        }
    }
}

impl Session {
    /// The present state, at the cost of a copy of its names.
    pub fn snapshot(&self) -> Snapshot {
        let units = self.modules.units_in_order();
        let variables = units.into_iter().map(|unit| {
            let variables = unit.scope.variables();
            (unit, variables)
        });
        Snapshot {
            bindings: self.main.scope.copied(),
            statements: self.main.statements.borrow().clone(),
            imports: self.main.imports.borrow().clone(),
            parameters: self.parameters.clone(),
            settings: self.settings.clone(),
            fields: self.fields.clone(),
            variables: variables.collect(),
        }
    }

    /// Goes back to an earlier state.
    pub fn restore(&mut self, snapshot: Snapshot) {
        self.main.scope.replace(snapshot.bindings);
        self.main.done.set(snapshot.statements.len());
        self.main.statements.replace(snapshot.statements);
        self.main.imports.replace(snapshot.imports);
        self.parameters = snapshot.parameters;
        self.settings = snapshot.settings;
        self.fields = snapshot.fields;
        for (unit, variables) in snapshot.variables {
            for (name, value) in variables {
                unit.scope.bind(&name, Binding::Variable(value));
            }
        }
        self.forget_what_was_computed();
    }

    /// Takes in a file: its definitions are run, and of the rest what changes `var`s. What needs
    /// actions is made when it is first asked for.
    pub fn take_in(&mut self, tree: &Tree) -> Result<(), Vec<Diagnostic>> {
        self.start_clock();
        let directory = self.main.directory.clone();
        let imports = self.read_imports(tree, &directory)?;
        let mut errors = resolve::resolve(tree, &self.main.scope);
        errors.extend(self.resolve_modules());
        if !errors.is_empty() {
            return Err(errors);
        }
        let statements = tree.statements.clone();
        *self.main.statements.borrow_mut() = statements.clone();
        let given = self.check_given(&imports);
        self.main.imports.borrow_mut().extend(imports);
        given.map_err(|error| vec![*error])?;
        let effects = mention::effects(&statements);
        for (place, statement) in statements.iter().enumerate() {
            let changes = !effects[place].changed.is_empty();
            self.run_again(statement, changes)
                .map_err(|error| vec![*error])?;
            self.main.done.set(place + 1);
        }
        self.warn_of_refused_machine_code();
        Ok(())
    }

    /// Checks the names of an input before anything of it is run, and reads what it imports.
    pub fn begin(&mut self, tree: &Tree) -> Result<Input, Vec<Diagnostic>> {
        let (errors, warnings) = resolve::resolve_input(tree, &self.main.scope, &[]);
        if !errors.is_empty() {
            return Err(errors);
        }
        for warning in warnings {
            self.host.warn(warning);
        }
        Ok(Input {
            statements: tree.statements.iter().cloned().collect(),
            waiting: Names::default(),
        })
    }

    /// Runs the next statement of an input; `None` at its end. Whoever gets an error goes back to a
    /// [`Snapshot`] from before the input.
    pub fn step_through(&mut self, input: &mut Input) -> Option<Result<Entered, Vec<Diagnostic>>> {
        let statement = input.statements.pop_front()?;
        self.start_clock();
        let modules = matches!(statement.kind, StatementKind::Import { .. })
            .then(|| std::mem::take(&mut self.modules));
        let entered = self.enter_statement(statement, input);
        if let (Err(_), Some(modules)) = (&entered, modules) {
            self.modules = modules;
        }
        self.postponed.clear();
        self.warn_of_refused_machine_code();
        Some(entered)
    }

    fn enter_statement(
        &mut self,
        statement: Statement,
        input: &mut Input,
    ) -> Result<Entered, Vec<Diagnostic>> {
        let new: Names = names_of(&statement).into_iter().collect();
        let renewal = self.renewal(&new, input)?;
        let again = match renewal {
            Some(renewal) => self.make_room(renewal, &statement, &new, input)?,
            None => Vec::new(),
        };
        let globals = Rc::clone(&self.main.scope);
        self.read_its_import(&statement)?;
        let value = self
            .statement(&statement, &globals)
            .and_then(|value| match &statement.kind {
                StatementKind::Expression(expression) => self.plain(value, expression.span),
                _ => Ok(value),
            })
            .map_err(|error| vec![*error])?;
        if matches!(statement.kind, StatementKind::Parameter { .. }) {
            self.forget_what_was_computed();
        }
        if self.is_kept(&statement) {
            self.keep(statement.clone());
        }
        input.waiting.retain(|name| !new.contains(name));
        let mut renewed = Vec::new();
        for (dependent, changes) in again {
            self.renew(&dependent, changes, &statement, input)?;
            renewed.extend(names_of(&dependent));
        }
        Ok(Entered {
            statement,
            value,
            renewed,
        })
    }

    /// What follows if the names are bound already, or something waits for them.
    fn renewal(&self, new: &Names, input: &Input) -> Result<Option<Renewal>, Vec<Diagnostic>> {
        let statements = self.main.statements.borrow();
        let is_bound = statements
            .iter()
            .flat_map(defined_names)
            .any(|name| new.contains(&name.text));
        if !is_bound && input.waiting.is_disjoint(new) {
            return Ok(None);
        }
        let renewal = Renewal::of(&statements, new);
        match &renewal.orphan {
            None => Ok(Some(renewal)),
            Some(orphan) => {
                let message = format!("`{orphan}` would be left without its definition");
                let error = Diagnostic::error(Code::BoundTwice, message);
                Err(vec![error.help(
                    "it was bound together with what is bound again here: bind both again",
                )])
            }
        }
    }

    /// Takes away what is to be replaced and what depends on it; gives what is to be run again.
    fn make_room(
        &mut self,
        renewal: Renewal,
        statement: &Statement,
        new: &Names,
        input: &mut Input,
    ) -> Result<Vec<(Statement, bool)>, Vec<Diagnostic>> {
        let globals = Rc::clone(&self.main.scope);
        for name in &in_order(&renewal.names) {
            globals.unbind(name);
            self.fields.shift_remove(name);
        }
        for name in &in_order(new) {
            if !matches!(statement.kind, StatementKind::Parameter { .. }) {
                self.parameters.forget(name);
            }
            self.settings.forget(name);
        }
        self.forget_what_was_computed();
        let later: Names = input.statements.iter().flat_map(names_of).collect();
        let names = in_order(&renewal.names);
        let (errors, _) = resolve::resolve_input(&alone(statement), &globals, &names);
        if let Some(span) = errors.first().and_then(Diagnostic::span) {
            return Err(vec![circle(span)]);
        }
        self.main.done.set(renewal.kept.len());
        self.main.statements.replace(renewal.kept);
        let mut again = renewal.again;
        // What comes again in this very input need not be run as it was.
        again.retain(|(dependent, _)| {
            let names = names_of(dependent);
            let comes_again = !names.is_empty() && names.iter().all(|name| later.contains(name));
            if comes_again {
                input.waiting.extend(names);
            }
            !comes_again
        });
        Ok(again)
    }

    /// Runs again what depends on a definition, unless it waits for another that is still to come.
    fn renew(
        &mut self,
        dependent: &Statement,
        changes: bool,
        cause: &Statement,
        input: &mut Input,
    ) -> Result<(), Vec<Diagnostic>> {
        let effects = mention::effects(std::slice::from_ref(dependent));
        let waits = effects
            .iter()
            .any(|effects| !effects.mentioned.is_disjoint(&input.waiting));
        if waits {
            input.waiting.extend(names_of(dependent));
        } else {
            self.run_again(dependent, changes)
                .map_err(|error| vec![because_of(*error, cause)])?;
        }
        self.keep(dependent.clone());
        Ok(())
    }

    /// Runs a statement that is not new: a definition without actions, and what changes a `var` with
    /// them. What changes nothing has been done.
    fn run_again(&mut self, statement: &Statement, changes: bool) -> Outcome<()> {
        let globals = Rc::clone(&self.main.scope);
        self.read_its_import(statement)
            .map_err(|mut errors| Box::new(errors.remove(0)))?;
        match &statement.kind {
            StatementKind::Expression(_)
            | StatementKind::For { .. }
            | StatementKind::While { .. }
            | StatementKind::Variable { .. }
            | StatementKind::Assignment { .. } => match changes {
                true => self.statement(statement, &globals).map(drop),
                false => Ok(()),
            },
            _ => {
                let mode = std::mem::replace(&mut self.mode, Mode::Define);
                let acting = std::mem::take(&mut self.acting);
                let result = self.top_statement(statement, &globals);
                self.mode = mode;
                self.acting = acting;
                self.postponed.clear();
                result
            }
        }
    }

    /// Reads the file that the statement imports, if it is an import.
    fn read_its_import(&mut self, statement: &Statement) -> Result<(), Vec<Diagnostic>> {
        if !matches!(statement.kind, StatementKind::Import { .. }) {
            return Ok(());
        }
        let directory = self.main.directory.clone();
        let imports = self.read_imports(&alone(statement), &directory)?;
        let errors = self.resolve_modules();
        if !errors.is_empty() {
            return Err(errors);
        }
        self.main.imports.borrow_mut().extend(imports);
        Ok(())
    }

    /// Whether a statement is part of what the session is: a definition, a test, or what changes a
    /// `var`.
    fn is_kept(&self, statement: &Statement) -> bool {
        if matches!(statement.kind, StatementKind::Test { .. }) {
            return true;
        }
        let mut all = self.main.statements.borrow().clone();
        all.push(statement.clone());
        let effects = mention::effects(&all);
        effects
            .last()
            .is_some_and(|effects| !effects.changed.is_empty())
    }

    fn keep(&mut self, statement: Statement) {
        let mut statements = self.main.statements.borrow_mut();
        statements.push(statement);
        self.main.done.set(statements.len());
    }

    /// Forgets what depends on values of parameters or on the order of statements.
    fn forget_what_was_computed(&mut self) {
        self.worlds.clear();
        self.plain_numbers.clear();
        self.failed_comparison = None;
    }

    /// The statements that make the session what it is, in order.
    pub fn statements(&self) -> Vec<Statement> {
        self.main.statements.borrow().clone()
    }

    /// What a name of the session stands for; `None` for a name that it does not bind, and an
    /// unknown value where it has not been made yet.
    pub fn bound(&self, name: &str) -> Option<Value> {
        match self.main.scope.find_here(name)? {
            Binding::Constant(value) | Binding::Variable(value) => Some(value),
            Binding::Lazy(..) | Binding::Library(..) => Some(Value::Unknown),
        }
    }

    /// Whether a definition of the session binds the name.
    pub fn defines(&self, name: &str) -> bool {
        let statements = self.main.statements.borrow();
        let mut names = statements.iter().flat_map(defined_names);
        names.any(|known| &*known.text == name)
    }

    /// The names that the session itself binds, sorted.
    pub fn own_names(&self) -> Vec<Arc<str>> {
        self.main.scope.names_here()
    }

    /// All names that can be written at the top, sorted.
    pub fn names(&self) -> Vec<Arc<str>> {
        self.main.scope.names()
    }

    /// Binds a name to a value without keeping how it came about.
    pub fn remember(&mut self, name: &str, value: Value) {
        self.main
            .scope
            .bind(&Arc::from(name), Binding::Constant(value));
    }

    /// Binds the name of a definition to a value that it is known to have, and keeps the definition.
    pub fn keep_as(&mut self, statement: Statement, name: &str, value: Value) {
        self.remember(name, value);
        self.keep(statement);
    }
}

/// The names that a statement binds.
pub fn names_of(statement: &Statement) -> Vec<Arc<str>> {
    let names = defined_names(statement).into_iter();
    names.map(|name| Arc::clone(&name.text)).collect()
}

fn in_order(names: &Names) -> Vec<Arc<str>> {
    let mut names: Vec<Arc<str>> = names.iter().cloned().collect();
    names.sort();
    names
}

fn alone(statement: &Statement) -> Tree {
    Tree {
        statements: vec![statement.clone()],
        comments: Vec::new(),
    }
}

/// The error for a definition that uses what it replaces.
fn circle(span: Span) -> Diagnostic {
    Diagnostic::error(
        Code::UnknownName,
        "the new definition uses what it replaces, or what is made of that",
    )
    .label(span, "replaced by this very definition")
    .help("give the new one another name, or bind it with `var` and assign it")
}

/// Says with which new definition something cannot be made again.
fn because_of(error: Diagnostic, cause: &Statement) -> Diagnostic {
    let place = defined_names(cause)
        .first()
        .map_or(cause.span, |name| name.span);
    let mut error = error.label(place, "because this is given again");
    if error.help.is_none() {
        error.help = Some(
            "what depends on a definition is run again with the new one: give both in one input, \
             with `;` between them, or take another name"
                .into(),
        );
    }
    error
}
