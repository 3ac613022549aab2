//! One run of one file: everything that evaluation needs and changes.

use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};

use indexmap::IndexMap;
use rustc_hash::FxHashMap;

use super::builtin;
use super::evaluate::{World, WorldKey};
use super::field::FieldValue;
use super::function::{Argument, FunctionValue};
use super::library;
use super::limits::Limits;
use super::module::Modules;
use super::parameters::Parameters;
use super::resolve;
use super::scope::{Binding, Scope};
use super::settings::Settings;
use super::tracer::Tracer;
use super::unit::Unit;
use super::value::{Outcome, Value, failure};
use crate::diagnostic::suggest;
use crate::diagnostic::{Code, Diagnostic, SourceId, Span};
use crate::engine::{self, Monitor, Tier};
use crate::graph::NodeId;
use crate::syntax::tree::{Expression, Statement, StatementKind, Tree};

/// Where a session's output goes: a terminal, a test, an editor.
pub trait Host {
    /// A line that the script prints.
    fn print(&mut self, line: &str);

    /// Something that the person should know, while the script goes on.
    fn warn(&mut self, warning: Diagnostic);

    /// A file was written.
    fn wrote(&mut self, path: &std::path::Path);

    /// Reads a file that is imported, and keeps its text for messages.
    fn read_source(&mut self, path: &std::path::Path) -> Result<(SourceId, Arc<str>), Diagnostic>;

    /// Who watches long work.
    fn monitor(&self) -> &dyn Monitor;
}

/// How much of a file is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Everything, top to bottom.
    Run,
    /// Everything but actions; definitions that need them are run when they are first asked
    /// for. For commands that ask one thing of a file.
    Define,
    /// Everything but actions: what they would make is unknown.
    Check,
}

/// A part of the program that is evaluated although it is not known whether it is meant: what
/// was there before it began must not be changed by it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Branch {
    /// Scopes younger than this belong to the branch.
    pub(super) since: u64,
    pub(super) kind: BranchKind,
}

/// Why it is not known whether a part of the program is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BranchKind {
    /// Its condition depends on the point or on parameters, or it is a field's body.
    Traced,
    /// Its condition or list is unknown.
    Unknown,
}

/// One run of one file.
pub struct Session {
    pub(super) graph: Tracer,
    pub(super) parameters: Parameters,
    pub(super) limits: Limits,
    pub(super) host: Box<dyn Host>,
    pub(super) mode: Mode,
    pub(super) settings: Settings,
    /// Values given from outside for parameters and settings, by name.
    pub(super) given: IndexMap<String, Expression>,
    /// The same, once they have been evaluated.
    pub(super) given_values: FxHashMap<Arc<str>, Value>,
    /// The settings that a `with` has changed where definitions are run again.
    pub(super) overriding: FxHashMap<Arc<str>, Value>,
    /// What is known of the roots that were found last, beyond the numbers.
    pub isolated: Option<crate::polygonize::Roots>,
    /// How many `with`s are running definitions again, one inside the other.
    pub(super) runs_again: u32,
    /// What has been made under other settings.
    pub(super) worlds: IndexMap<WorldKey, World>,
    /// The main file, if it is one.
    pub(super) main_file: Option<PathBuf>,
    /// Where imported files may lie.
    pub(super) readable_directories: Vec<PathBuf>,
    pub(super) modules: Modules,
    /// Where files may be written; the first one is where relative paths start.
    pub(super) output_directories: Vec<PathBuf>,
    /// Whether actions are done; otherwise what they would make is unknown.
    pub(super) acting: bool,
    /// The innermost branch that is evaluated without being decided.
    pub(super) branch: Option<Branch>,
    pub(super) depth: u64,
    pub(super) steps: u64,
    /// Work that was done since the last look at the clock, in expressions.
    pub(super) unseen_work: u64,
    /// The last comparison of plain values that did not hold, for assertions to tell.
    pub(super) failed_comparison: Option<(Span, Value, Value)>,
    /// When the session was made.
    pub(super) begun: Instant,
    /// When what is being run has to end.
    pub(super) deadline: Option<Instant>,
    /// Bytes that have been printed and written.
    pub(super) output_bytes: u64,
    /// Numbers of nodes under the session's parameters, for scripts that ask for them.
    pub(super) plain_numbers: FxHashMap<NodeId, f64>,
    /// Fields that need actions, in [`Mode::Define`].
    pub(super) postponed: Vec<Statement>,
    /// The main file.
    pub(super) main: Rc<Unit>,
    /// The file whose statements are being run.
    pub(super) unit: Rc<Unit>,
    /// The main file's fields, in order.
    pub(super) fields: IndexMap<Arc<str>, FieldValue>,
    has_warned_of_refusal: bool,
    spent: IndexMap<&'static str, Spent>,
}

/// What the calls of a function have taken.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spent {
    /// How many there were.
    pub calls: u64,
    /// How long all of them took.
    pub time: Duration,
}

/// What scopes and functions hold of each other is freed with the session: values that it gave are
/// not to be called any more.
impl Drop for Session {
    fn drop(&mut self) {
        let worlds = self.worlds.values().flat_map(World::units);
        let modules = self.modules.units_in_order();
        for unit in worlds.chain(modules).chain([Rc::clone(&self.main)]) {
            unit.clear();
        }
    }
}

impl Session {
    /// A session that has read nothing yet. `input_directory` is where relative paths of files
    /// that are read start; `output_directories` says where files may be written, and relative
    /// paths of those start at the first one.
    pub fn new(
        host: Box<dyn Host>,
        mode: Mode,
        limits: Limits,
        input_directory: PathBuf,
        output_directories: Vec<PathBuf>,
    ) -> Session {
        let prelude = Rc::new(Scope::default());
        for builtin in builtin::all() {
            let function = FunctionValue::Builtin(builtin);
            prelude.bind(
                &Arc::from(builtin.name),
                Binding::Constant(Value::Function(function)),
            );
        }
        for (name, value) in builtin::CONSTANTS {
            prelude.bind(&Arc::from(*name), Binding::Constant(Value::Number(*value)));
        }
        let main = Unit::new(&library::scope(&prelude), Arc::from(""), input_directory);
        Session {
            graph: Tracer::default(),
            parameters: Parameters::default(),
            limits,
            host,
            mode,
            settings: Settings::default(),
            given: IndexMap::new(),
            given_values: FxHashMap::default(),
            overriding: FxHashMap::default(),
            isolated: None,
            runs_again: 0,
            worlds: IndexMap::new(),
            main_file: None,
            readable_directories: vec![main.directory.clone(), PathBuf::from(".")],
            modules: Modules::default(),
            output_directories,
            acting: mode == Mode::Run,
            branch: None,
            depth: 0,
            steps: 0,
            unseen_work: 0,
            failed_comparison: None,
            begun: Instant::now(),
            deadline: None,
            output_bytes: 0,
            plain_numbers: FxHashMap::default(),
            postponed: Vec::new(),
            unit: Rc::clone(&main),
            main,
            fields: IndexMap::new(),
            has_warned_of_refusal: false,
            spent: IndexMap::new(),
        }
    }

    /// Lets this tier alone evaluate the fields that are compiled from now on.
    pub fn set_tier(&mut self, tier: Tier) {
        self.graph.tier = tier;
    }

    /// Says which file the main one is, so that one that imports it closes a circle.
    pub fn set_file(&mut self, file: &Path) {
        self.main_file = Some(file.to_owned());
    }

    /// Allows imports from more directories than the main file's and the present one.
    pub fn allow_reading(&mut self, directories: &[PathBuf]) {
        self.readable_directories.extend_from_slice(directories);
    }

    /// Allows writing in another directory, too.
    pub fn allow_writing(&mut self, directory: &Path) {
        self.output_directories.push(directory.to_owned());
    }

    /// Gives the parameter or setting `name` another value than the file does. Takes effect when
    /// the file is run; an unknown name is an error then.
    pub fn set(&mut self, name: &str, value: Expression) {
        self.given.insert(name.to_string(), value);
    }

    /// The scope around those of files: what the program itself defines.
    pub(super) fn prelude(&self) -> Rc<Scope> {
        let parent = self.main.scope.parent();
        parent.map_or_else(|| Rc::clone(&self.main.scope), Rc::clone)
    }

    /// Whether the statements that are being run are the main file's.
    pub(super) fn is_in_main(&self) -> bool {
        Rc::ptr_eq(&self.unit, &self.main)
    }

    /// Runs a whole tree in the session's mode.
    ///
    /// Names are checked first, so all misspelt ones are reported together; evaluation ends with
    /// its first error.
    pub fn run(&mut self, tree: &Tree) -> Result<(), Vec<Diagnostic>> {
        self.start_clock();
        let result = self.run_statements(tree);
        self.warn_of_refused_machine_code();
        result
    }

    fn run_statements(&mut self, tree: &Tree) -> Result<(), Vec<Diagnostic>> {
        let directory = self.main.directory.clone();
        let imports = self.read_imports(tree, &directory)?;
        let (mut errors, warnings) = resolve::resolve_with_warnings(tree, &self.main.scope);
        errors.extend(self.resolve_modules());
        if !errors.is_empty() {
            return Err(errors);
        }
        // Whoever asks one thing of a file is not told about the rest of it.
        if self.mode != Mode::Define {
            warnings.into_iter().for_each(|w| self.host.warn(w));
        }
        let first = self.main.statements.borrow().len();
        self.main
            .statements
            .borrow_mut()
            .extend_from_slice(&tree.statements);
        self.check_given(&imports).map_err(|error| vec![*error])?;
        self.main.imports.borrow_mut().extend(imports);
        let globals = Rc::clone(&self.main.scope);
        for (place, statement) in tree.statements.iter().enumerate() {
            self.top_statement(statement, &globals)
                .map_err(|error| vec![*error])?;
            self.main.done.set(first + place + 1);
        }
        if self.mode == Mode::Check {
            for test in self.tests() {
                self.run_test(&test)?;
            }
        }
        self.acting = self.mode != Mode::Check;
        for field in std::mem::take(&mut self.postponed) {
            self.define_field(&field, &globals)
                .map_err(|error| vec![*error])?;
        }
        Ok(())
    }

    /// The value of an expression in the scope of what has been run, with plain numbers.
    pub fn evaluate(&mut self, expression: &Expression) -> Result<Value, Vec<Diagnostic>> {
        let errors = resolve::resolve_expression(expression, &self.main.scope);
        if !errors.is_empty() {
            return Err(errors);
        }
        self.start_clock();
        let globals = Rc::clone(&self.main.scope);
        let value = self
            .expression(expression, &globals)
            .and_then(|value| self.plain(value, expression.span))
            .map_err(|error| vec![*error]);
        self.warn_of_refused_machine_code();
        value
    }

    /// Calls a function of the language with values and named arguments: what a command does
    /// with its flags.
    pub fn call(
        &mut self,
        function: &str,
        subjects: Vec<Value>,
        options: &[(&str, Expression)],
    ) -> Result<Value, Vec<Diagnostic>> {
        let Some(builtin) = builtin::find(function) else {
            let message = format!("there is no function `{function}`");
            return Err(vec![Diagnostic::error(Code::UnknownName, message)]);
        };
        let subjects = subjects.into_iter().map(|value| Argument {
            name: None,
            value,
            span: Span::NOWHERE,
        });
        let mut arguments: Vec<Argument> = subjects.collect();
        for (name, expression) in options {
            arguments.push(Argument {
                name: Some(Arc::from(*name)),
                value: self.evaluate(expression)?,
                span: expression.span,
            });
        }
        self.start_clock();
        let function = FunctionValue::Builtin(builtin);
        let value = self.call_function(&function, arguments, Span::NOWHERE);
        self.warn_of_refused_machine_code();
        value.map_err(|error| vec![*error])
    }

    /// Says, once, that fields are not evaluated by machine code.
    pub(super) fn warn_of_refused_machine_code(&mut self) {
        if let Some(reason) = engine::refusal()
            && !self.has_warned_of_refusal
        {
            self.has_warned_of_refusal = true;
            let message = format!("fields are evaluated without machine code: {reason}");
            let warning = Diagnostic::warning(Code::NoMachineCode, message);
            self.host.warn(warning.help(
                "the results are the same; work on single points, such as sampling, is slower",
            ));
        }
    }

    /// Counts a call of a function that takes long.
    pub(super) fn spend(&mut self, function: &'static str, time: Duration) {
        let spent = self.spent.entry(function).or_default();
        spent.calls += 1;
        spent.time += time;
    }

    /// What the functions have taken that make or write something, in the order of their first
    /// calls.
    pub fn spent(&self) -> &IndexMap<&'static str, Spent> {
        &self.spent
    }

    /// The fields of the file, in order.
    pub fn fields(&self) -> &IndexMap<Arc<str>, FieldValue> {
        &self.fields
    }

    /// The names of the file that have values, in alphabetical order.
    pub fn values(&self) -> Vec<(Arc<str>, Value)> {
        self.main.scope.values_here()
    }

    /// The parameters of the file.
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The expression graph that everything is traced into.
    pub fn graph(&mut self) -> &mut Tracer {
        &mut self.graph
    }

    /// The only field of the file, for commands that are not told which.
    pub fn only_field(&self) -> Outcome<FieldValue> {
        let names: Vec<&str> = self.fields.keys().map(|name| &**name).collect();
        match self.fields.values().next() {
            Some(field) if names.len() == 1 => Ok(field.clone()),
            Some(_) => Err(which_field(
                "the file has several fields",
                format!("name one of them: {}", names.join(", ")),
            )),
            None => Err(which_field(
                "the file has no field",
                "define one, as in `field ball(p in R3) = norm(p) - 1`".into(),
            )),
        }
    }

    /// Fails where something is given from outside for a name that no file defines.
    pub(super) fn check_given(&self, imports: &FxHashMap<Arc<str>, PathBuf>) -> Outcome<()> {
        let mut names = self.names_in_modules(imports);
        let statements = self.main.statements.borrow();
        let own = statements
            .iter()
            .filter_map(|statement| match &statement.kind {
                StatementKind::Parameter { name, .. } | StatementKind::Setting { name, .. } => {
                    Some(name.text.to_string())
                }
                _ => None,
            });
        names.splice(0..0, own);
        let Some(name) = self.given.keys().find(|name| !names.contains(name)) else {
            return Ok(());
        };
        let mut error = failure(
            Code::UnknownParameter,
            format!("there is no parameter or setting `{name}` to set"),
        );
        let known = names.iter().map(String::as_str);
        error.help = Some(match suggest::nearest(name, known) {
            Some(near) => format!("did you mean `{near}`?"),
            None if names.is_empty() => "the file has no parameters and no settings".into(),
            None => format!("what can be set is {}", names.join(", ")),
        });
        Err(error)
    }

    /// The settings of the files.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }
}

fn which_field(message: &str, help: String) -> Box<Diagnostic> {
    let mut error = failure(Code::WhichField, message);
    error.help = Some(help);
    error
}
