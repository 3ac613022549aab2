//! One opened file: its text, its session and what is heard from it.

use std::cell::RefCell;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::Instant;

use serde_json::{Map, Value as Json};

use super::arguments::Common;
use super::output::{self, colored, report};
use super::progress::TerminalProgress;
use crate::diagnostic::render::render;
use crate::diagnostic::{Code, Diagnostic, Sources};
use crate::engine::{Monitor, compilations};
use crate::language::{FieldValue, Host, Limits, Mode, Session, Value};
use crate::syntax::tree::{Expression, Tree};
use crate::syntax::{parse, parse_expression};

/// A file that has been read and parsed, with the session that runs it.
pub(super) struct Workspace {
    pub(super) session: Session,
    pub(super) tree: Tree,
    pub(super) heard: Rc<Heard>,
    common: Common,
    begun: Instant,
}

/// What a session says, shared between the session's host and the command.
pub(super) struct Heard {
    pub(super) sources: RefCell<Sources>,
    pub(super) printed: RefCell<Vec<String>>,
    pub(super) written: RefCell<Vec<PathBuf>>,
    pub(super) warnings: RefCell<Vec<Diagnostic>>,
}

/// The host of a session that runs at the command line.
struct Terminal {
    heard: Rc<Heard>,
    progress: TerminalProgress,
    common: Common,
}

impl Host for Terminal {
    fn print(&mut self, line: &str) {
        self.progress.clear();
        if self.common.json {
            self.heard.printed.borrow_mut().push(line.to_string());
        } else {
            output::data(line);
        }
    }

    fn warn(&mut self, warning: Diagnostic) {
        let mut warnings = self.heard.warnings.borrow_mut();
        // A loop says the same at every round: once is enough.
        let known = warnings
            .iter()
            .any(|known| known.code == warning.code && known.labels == warning.labels);
        if known {
            return;
        }
        if !self.common.quiet && !self.common.json {
            self.progress.clear();
            let sources = self.heard.sources.borrow();
            let text = render(
                std::slice::from_ref(&warning),
                &sources,
                colored(&self.common),
            );
            output::error_text(&text);
        }
        warnings.push(warning);
    }

    fn wrote(&mut self, path: &Path) {
        self.progress.clear();
        if !self.common.quiet && !self.common.json {
            output::error_text(&format!("wrote {}", path.display()));
        }
        self.heard.written.borrow_mut().push(path.to_path_buf());
    }

    fn monitor(&self) -> &dyn Monitor {
        &self.progress
    }
}

impl Workspace {
    /// Reads and parses a file and makes a session for it; `None` is no file at all.
    ///
    /// What is wrong has been reported when this fails; the error is the exit code.
    pub(super) fn open(file: Option<&Path>, common: &Common, mode: Mode) -> Result<Workspace, u8> {
        let begun = Instant::now();
        set_threads(common);
        let mut sources = Sources::default();
        let fail = |error: Diagnostic, sources: &Sources| report(&[error], sources, common);
        let limits = limits(common).map_err(|error| fail(error, &sources))?;
        let directories = output_directories(common).map_err(|error| fail(error, &sources))?;
        let tree = match file {
            None => Tree::default(),
            Some(file) => {
                let (name, text) = read(file).map_err(|error| fail(error, &sources))?;
                let id = sources.add(name, text);
                let parsed = parse(id, &sources.get(id).text);
                if !parsed.diagnostics.is_empty() {
                    return Err(report(&parsed.diagnostics, &sources, common));
                }
                parsed.tree
            }
        };
        let heard = Rc::new(Heard {
            sources: RefCell::new(sources),
            printed: RefCell::default(),
            written: RefCell::default(),
            warnings: RefCell::default(),
        });
        let host = Terminal {
            heard: Rc::clone(&heard),
            progress: TerminalProgress::new(common.quiet || common.json),
            common: common.clone(),
        };
        let session = Session::new(Box::new(host), mode, limits, directories);
        let mut workspace = Workspace {
            session,
            tree,
            heard,
            common: common.clone(),
            begun,
        };
        workspace.apply_settings()?;
        Ok(workspace)
    }

    /// Runs the file in the session's mode.
    pub(super) fn run(&mut self) -> Result<(), u8> {
        let result = self.session.run(&self.tree);
        result.map_err(|errors| self.fail(&errors))
    }

    /// Parses an expression from the command line; `origin` is what errors call its text.
    pub(super) fn parse(&mut self, origin: &str, text: &str) -> Result<Expression, u8> {
        let id = self.heard.sources.borrow_mut().add(origin, text);
        parse_expression(id, text).map_err(|errors| self.fail(&errors))
    }

    /// The value of an expression from the command line, with plain numbers.
    pub(super) fn evaluate(&mut self, origin: &str, text: &str) -> Result<Value, u8> {
        let expression = self.parse(origin, text)?;
        let value = self.session.evaluate(&expression);
        value.map_err(|errors| self.fail(&errors))
    }

    /// The field that the command is about: the only one, or what the text gives.
    pub(super) fn field(&mut self, text: Option<&str>) -> Result<FieldValue, u8> {
        let Some(text) = text else {
            let field = self.session.only_field();
            return field.map_err(|error| self.fail(&[*error]));
        };
        match self.evaluate("<field>", text)? {
            Value::Field(field) => Ok(field),
            other => {
                let message = format!("expected a field, but `{text}` is {}", other.kind());
                Err(self.fail(&[Diagnostic::error(Code::WrongKind, message)]))
            }
        }
    }

    /// Reports errors and gives the exit code.
    pub(super) fn fail(&self, errors: &[Diagnostic]) -> u8 {
        report(errors, &self.heard.sources.borrow(), &self.common)
    }

    /// The ends of every JSON object: compilations, time, warnings.
    pub(super) fn finish_json(&self, object: &mut Map<String, Json>) {
        object.insert("compilations".into(), compilations().into());
        object.insert("seconds".into(), self.begun.elapsed().as_secs_f64().into());
        let warnings = output::warnings_json(&self.heard.warnings.borrow());
        object.insert("warnings".into(), warnings);
    }

    fn apply_settings(&mut self) -> Result<(), u8> {
        for setting in self.common.set.clone() {
            let Some((name, text)) = setting.split_once('=') else {
                let error = usage(format!("`--set {setting}` is not of the form NAME=EXPR"));
                self.fail(&[error]);
                return Err(super::USAGE);
            };
            let expression = self.parse(&format!("<--set {}>", name.trim()), text)?;
            self.session.set(name.trim(), expression);
        }
        Ok(())
    }
}

fn usage(message: String) -> Diagnostic {
    Diagnostic::error(Code::BadValue, message)
}

/// The number of threads can be chosen once, before the first work; a second file of the same
/// command finds it chosen already.
fn set_threads(common: &Common) {
    let _ = rayon::ThreadPoolBuilder::new()
        .num_threads(common.threads)
        .build_global();
}

fn limits(common: &Common) -> Result<Limits, Diagnostic> {
    let mut limits = Limits::default();
    for text in &common.limit {
        let known = text.split_once('=').is_some_and(|(name, value)| {
            value
                .parse()
                .is_ok_and(|value| limits.set(name.trim(), value))
        });
        if !known {
            return Err(usage(format!(
                "`--limit {text}` is not of the form NAME=N, where NAME is one of {}",
                Limits::NAMES.join(", ")
            )));
        }
    }
    Ok(limits)
}

fn output_directories(common: &Common) -> Result<Vec<PathBuf>, Diagnostic> {
    let first = match &common.out {
        Some(directory) => {
            std::fs::create_dir_all(directory).map_err(|error| {
                let message = format!(
                    "cannot make the output directory `{}`: {error}",
                    directory.display()
                );
                Diagnostic::error(Code::CannotWrite, message)
            })?;
            directory.clone()
        }
        None => PathBuf::from("."),
    };
    Ok(std::iter::once(first)
        .chain(common.allow_write.iter().cloned())
        .collect())
}

/// The name and text of a file; `-` is standard input.
fn read(file: &Path) -> Result<(String, String), Diagnostic> {
    let name = if file == Path::new("-") {
        "<stdin>".to_string()
    } else {
        file.display().to_string()
    };
    let mut bytes = Vec::new();
    let read = if file == Path::new("-") {
        std::io::stdin().lock().read_to_end(&mut bytes).map(drop)
    } else if file.is_dir() {
        return Err(
            Diagnostic::error(Code::CannotRead, format!("`{name}` is a directory"))
                .help("name a file that ends with `.imp`"),
        );
    } else {
        std::fs::read(file).map(|content| bytes = content)
    };
    read.map_err(|error| {
        Diagnostic::error(Code::CannotRead, format!("cannot read `{name}`: {error}"))
    })?;
    if bytes.len() > u32::MAX as usize {
        let message = format!("`{name}` is larger than 4 GiB");
        return Err(Diagnostic::error(Code::CannotRead, message));
    }
    match String::from_utf8(bytes) {
        Ok(text) => Ok((name, text)),
        Err(error) => {
            let at = error.utf8_error().valid_up_to();
            Err(Diagnostic::error(
                Code::NotText,
                format!("`{name}` is not UTF-8 text: byte {at} cannot be read"),
            )
            .help("save it as UTF-8"))
        }
    }
}
