//! Modules: `import "path.imp" as name`.
//!
//! All files that are imported, directly or not, are read and parsed before anything runs, so a
//! missing file, a mistake in one or a circle is known at once. A module's definitions are run
//! when the first import of it is reached; a file that is imported twice is one module.

use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::resolve;
use super::scope::Scope;
use super::session::{Mode, Session};
use super::unit::Unit;
use super::value::{Outcome, Value, failure};
use crate::diagnostic::{Code, Diagnostic, Span, shorten, suggest};
use crate::file;
use crate::syntax::parse;
use crate::syntax::tree::{Literal, Name, Statement, StatementKind, Tree};

/// How many files may import each other in a row.
const LONGEST_CHAIN: usize = 100;

/// Names that are reached as `name.member`.
#[derive(Debug)]
pub struct Module {
    /// The name before the dot.
    pub name: Arc<str>,
    /// Its members.
    pub scope: Rc<Scope>,
    /// What it is about.
    pub documentation: Option<Arc<str>>,
}

impl Module {
    /// The members that have values, in alphabetical order.
    pub fn members(&self) -> Vec<(Arc<str>, Value)> {
        self.scope.values_here()
    }
}

/// The files that have been read, and what has been made of them.
#[derive(Debug, Default)]
pub(super) struct Modules {
    files: FxHashMap<PathBuf, ModuleFile>,
    /// Their folders, as they were reached: where their relative paths start.
    folders: FxHashMap<PathBuf, PathBuf>,
    /// What stands before the names of their parameters and settings.
    prefixes: FxHashMap<PathBuf, Arc<str>>,
    /// The modules whose definitions have been run, by their paths.
    pub(super) units: FxHashMap<PathBuf, Rc<Unit>>,
}

/// A file that is imported somewhere.
#[derive(Debug)]
struct ModuleFile {
    tree: Tree,
    /// The first import of it.
    imported: Span,
    /// Where its own imports lead.
    imports: FxHashMap<Arc<str>, PathBuf>,
}

/// A file on the way from the main one to the one that is being read.
struct Link {
    path: PathBuf,
    /// As messages call it.
    name: String,
    /// Where it is imported.
    span: Span,
}

impl Modules {
    /// The modules whose definitions have been run, in the order of their paths.
    pub(super) fn units_in_order(&self) -> Vec<Rc<Unit>> {
        let mut units: Vec<_> = self.units.iter().collect();
        units.sort_by_key(|(path, _)| *path);
        units.into_iter().map(|(_, unit)| Rc::clone(unit)).collect()
    }
}

impl Session {
    /// Reads what a tree imports, and what that imports. `file` is the tree's own path, if it has
    /// one; relative paths start at `directory`.
    pub(super) fn read_imports(
        &mut self,
        tree: &Tree,
        directory: &Path,
    ) -> Result<FxHashMap<Arc<str>, PathBuf>, Vec<Diagnostic>> {
        let mut chain = Vec::new();
        if let Some(file) = &self.main_file {
            chain.push(Link {
                path: absolute(file).unwrap_or_else(|_| file.clone()),
                name: file.display().to_string(),
                span: Span::NOWHERE,
            });
        }
        self.read_imports_of(tree, directory, &mut chain)
    }

    fn read_imports_of(
        &mut self,
        tree: &Tree,
        directory: &Path,
        chain: &mut Vec<Link>,
    ) -> Result<FxHashMap<Arc<str>, PathBuf>, Vec<Diagnostic>> {
        let mut imports = FxHashMap::default();
        let mut errors = Vec::new();
        for statement in &tree.statements {
            let StatementKind::Import { path, name } = &statement.kind else {
                continue;
            };
            match self.read_module(path, directory, chain) {
                Ok(found) => drop(imports.insert(Arc::clone(&name.text), found)),
                Err(mut found) => errors.append(&mut found),
            }
        }
        match errors.is_empty() {
            true => Ok(imports),
            false => Err(errors),
        }
    }

    /// Reads one file and what it imports, unless that has been done.
    fn read_module(
        &mut self,
        literal: &Literal,
        directory: &Path,
        chain: &mut Vec<Link>,
    ) -> Result<PathBuf, Vec<Diagnostic>> {
        let shown = directory.join(&*literal.text);
        let link = Link {
            path: self
                .readable_path(&shown, literal)
                .map_err(|error| vec![with_chain(*error, chain)])?,
            name: shown.display().to_string(),
            span: literal.span,
        };
        let path = link.path.clone();
        if let Some(start) = chain.iter().position(|known| known.path == path) {
            return Err(vec![circle(&chain[start..], &link)]);
        }
        if self.modules.files.contains_key(&path) {
            return Ok(path);
        }
        if chain.len() > LONGEST_CHAIN {
            let message = format!("more than {LONGEST_CHAIN} files import each other in a row");
            let error = Diagnostic::error(Code::RecursionLimit, message);
            return Err(vec![error.label(literal.span, "one more here")]);
        }
        let (source, text) = self.host.read_source(&shown).map_err(|error| {
            vec![with_chain(
                error.label(literal.span, "imported here"),
                chain,
            )]
        })?;
        let parsed = parse(source, &text);
        if !parsed.diagnostics.is_empty() {
            return Err(imported(parsed.diagnostics, literal.span));
        }
        chain.push(link);
        let folder = shown.parent().unwrap_or(Path::new("")).to_owned();
        let imports = self.read_imports_of(&parsed.tree, &folder, chain);
        chain.pop();
        let file = ModuleFile {
            tree: parsed.tree,
            imported: literal.span,
            imports: imports?,
        };
        self.modules.files.insert(path.clone(), file);
        self.modules.folders.insert(path.clone(), folder);
        Ok(path)
    }

    /// The path without symbolic links, if it lies where imports may.
    fn readable_path(&self, path: &Path, literal: &Literal) -> Outcome<PathBuf> {
        let failed = |error: std::io::Error| {
            let message = format!("cannot read `{}`: {error}", shorten(&literal.text));
            let error = failure(Code::CannotRead, message);
            Box::new(error.label(literal.span, "imported here"))
        };
        if literal.text.is_empty() || literal.text.contains(char::is_control) {
            let error = failure(Code::CannotRead, "this is not the name of a file");
            return Err(Box::new(error.label(literal.span, "imported here")));
        }
        let target = absolute(path).map_err(failed)?;
        for directory in &self.readable_directories {
            if target.starts_with(absolute(directory).map_err(failed)?) {
                return Ok(target);
            }
        }
        let message = format!(
            "`{}` lies outside the folders from which files may be imported",
            shorten(&literal.text)
        );
        let error = failure(Code::OutsideInput, message)
            .label(literal.span, "imported here")
            .help(
                "these are the folder of the main file and the present one, and what is in them; \
                 allow another with `--allow-read DIR`",
            );
        Err(Box::new(error))
    }

    /// What is wrong with the names of the modules.
    pub(super) fn resolve_modules(&self) -> Vec<Diagnostic> {
        let mut files: Vec<(&PathBuf, &ModuleFile)> = self.modules.files.iter().collect();
        files.sort_by_key(|(path, _)| *path);
        let outer = self.prelude();
        files
            .into_iter()
            .flat_map(|(_, file)| imported(resolve::resolve(&file.tree, &outer), file.imported))
            .collect()
    }

    /// The names of the parameters and settings of all modules, as they will be called when the
    /// imports are reached.
    pub(super) fn names_in_modules(&self, imports: &FxHashMap<Arc<str>, PathBuf>) -> Vec<String> {
        let mut names = Vec::new();
        let mut seen = Vec::new();
        let main = self.main.statements.borrow();
        self.names_of_imports(&main, imports, "", &mut seen, &mut names);
        names
    }

    fn names_of_imports<'a>(
        &'a self,
        statements: &[Statement],
        imports: &FxHashMap<Arc<str>, PathBuf>,
        prefix: &str,
        seen: &mut Vec<&'a PathBuf>,
        names: &mut Vec<String>,
    ) {
        for statement in statements {
            let StatementKind::Import { name, .. } = &statement.kind else {
                continue;
            };
            let file = imports
                .get(&name.text)
                .and_then(|path| self.modules.files.get_key_value(path));
            let Some((path, file)) = file.filter(|(path, _)| !seen.contains(path)) else {
                continue;
            };
            seen.push(path);
            let prefix = format!("{prefix}{}.", name.text);
            for statement in &file.tree.statements {
                if let StatementKind::Parameter { name, .. } | StatementKind::Setting { name, .. } =
                    &statement.kind
                {
                    names.push(format!("{prefix}{}", name.text));
                }
            }
            self.names_of_imports(&file.tree.statements, &file.imports, &prefix, seen, names);
        }
    }

    /// Runs the definitions of the module that an import of the present unit leads to, unless
    /// that has been done.
    pub(super) fn import(
        &mut self,
        name: &Name,
        documentation: Option<Arc<str>>,
        span: Span,
    ) -> Outcome<Value> {
        let path = self.unit.imports.borrow().get(&name.text).cloned();
        let unit = match path {
            Some(path) => self.module(&path, name).map_err(|error| {
                let is_elsewhere = error.span().is_some_and(|at| at.source != span.source);
                match is_elsewhere {
                    true => Box::new(error.label(span, "imported here")),
                    false => error,
                }
            })?,
            None => {
                let error = failure(Code::CannotRead, "nothing has been read for this import");
                return Err(Box::new(error.label(span, "here")));
            }
        };
        Ok(Value::Module(Rc::new(Module {
            name: Arc::clone(&name.text),
            scope: Rc::clone(&unit.scope),
            documentation,
        })))
    }

    fn module(&mut self, path: &Path, name: &Name) -> Outcome<Rc<Unit>> {
        if let Some(unit) = self.modules.units.get(path) {
            return Ok(Rc::clone(unit));
        }
        // The first way to a module names it, also where definitions are run again.
        let prefix = match self.modules.prefixes.get(path) {
            Some(prefix) => Arc::clone(prefix),
            None => format!("{}.", self.unit.full_name(&name.text)).into(),
        };
        self.modules
            .prefixes
            .insert(path.to_owned(), Arc::clone(&prefix));
        let folder = self.modules.folders.get(path).cloned().unwrap_or_default();
        let unit = Unit::new(&self.prelude(), prefix, folder);
        if let Some(file) = self.modules.files.get(path) {
            unit.statements.replace(file.tree.statements.clone());
            unit.imports.replace(file.imports.clone());
        }
        let places = 0..unit.statements.borrow().len();
        self.run_definitions(&unit, places)?;
        self.modules.units.insert(path.to_owned(), Rc::clone(&unit));
        Ok(unit)
    }

    /// Runs some of a unit's statements, without those that only do something. What needs
    /// actions is run when it is first asked for.
    pub(super) fn run_definitions(
        &mut self,
        unit: &Rc<Unit>,
        places: impl IntoIterator<Item = usize>,
    ) -> Outcome<()> {
        let outer = std::mem::replace(&mut self.unit, Rc::clone(unit));
        let acting = std::mem::take(&mut self.acting);
        let level = std::mem::take(&mut self.graph.level);
        let branch = self.branch.take();
        let mode = self.mode;
        if mode == Mode::Run {
            self.mode = Mode::Define;
        }
        let mut result = Ok(());
        for place in places {
            let Some(statement) = unit.statement(place) else {
                break;
            };
            if !matches!(
                statement.kind,
                StatementKind::Expression(_) | StatementKind::Test { .. }
            ) {
                result = self.top_statement(&statement, &unit.scope);
            }
            if result.is_err() {
                break;
            }
            unit.done.set(place + 1);
        }
        self.mode = mode;
        self.branch = branch;
        self.graph.level = level;
        self.acting = acting;
        self.unit = outer;
        result
    }

    /// `module.name`
    pub(super) fn member(&mut self, module: &Module, name: &Name) -> Outcome<Value> {
        if module.scope.find_here(&name.text).is_some() {
            return self.lookup(name, &module.scope);
        }
        let mut error = failure(
            Code::UnknownProperty,
            format!("the module `{}` has no `{}`", module.name, name.text),
        );
        *error = (*error).label(name.span, "unknown");
        let names = module.scope.names_here();
        error.help = match suggest::nearest(&name.text, names.iter().map(|name| &**name)) {
            Some(near) => Some(format!("did you mean `{near}`?")),
            None if names.is_empty() => Some("the module defines nothing".into()),
            None => Some(format!("it defines {}", shorten(&names.join(", ")))),
        };
        Err(error)
    }
}

/// A path from the root of the file system, without symbolic links.
fn absolute(path: &Path) -> std::io::Result<PathBuf> {
    file::resolve(&std::env::current_dir()?.join(path))
}

/// The error for a file that imports itself. `chain` begins with that file.
fn circle(chain: &[Link], link: &Link) -> Diagnostic {
    let names: Vec<String> = chain
        .iter()
        .chain([link])
        .map(|link| format!("`{}`", link.name))
        .collect();
    let message = format!("files import each other in a circle: {}", names.join(" → "));
    let mut error =
        Diagnostic::error(Code::ImportCircle, message).label(link.span, "this closes the circle");
    for before in chain.iter().skip(1) {
        error = error.label(before.span, "on the way");
    }
    error.help("move what both need into a third file")
}

/// Says, with the first of a module's errors, where it is imported.
fn imported(mut errors: Vec<Diagnostic>, span: Span) -> Vec<Diagnostic> {
    if let Some(first) = errors.first_mut() {
        *first = first.clone().label(span, "imported here");
    }
    errors
}

/// Says by which files one was reached.
fn with_chain(error: Diagnostic, chain: &[Link]) -> Diagnostic {
    chain.iter().rev().fold(error, |error, link| {
        error.label(link.span, "in a file that is imported here")
    })
}
