//! One opened file: its text, its session and what is heard from it.

use std::cell::{Cell, RefCell};
use std::fs::File;
use std::io::{self, Read};
use std::mem::ManuallyDrop;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::{Map, Value as Json};

use super::arguments::Common;
use super::output::{self, escaped, report};
use super::progress::TerminalProgress;
use crate::diagnostic::{Code, Diagnostic, SourceId, Sources};
use crate::engine::Monitor;
use crate::language::{FieldValue, Host, Limits, Mode, Session, Value};
use crate::syntax::tree::{Expression, Tree};
use crate::syntax::{parse, parse_expression};

/// The file name that stands for standard input.
pub(super) const STANDARD_INPUT: &str = "-";

/// How some editors begin a text file.
pub(super) const BYTE_ORDER_MARK: char = '\u{feff}';

/// Bytes of the largest source file that is read. Spans count bytes in 32 bits.
const LARGEST_SOURCE: u64 = 256_000_000;

/// A file that has been read and parsed, with the session that runs it.
pub(super) struct Workspace {
    /// Never dropped: the process ends with it, and long chains of functions and scopes would be
    /// dropped one inside the other.
    pub(super) session: ManuallyDrop<Session>,
    pub(super) tree: Tree,
    pub(super) heard: Rc<Heard>,
    common: Common,
    pub(super) begun: Instant,
    /// What reading and parsing took.
    pub(super) parsing: Duration,
}

/// What a session says, shared between the session's host and the command.
pub(super) struct Heard {
    pub(super) sources: RefCell<Sources>,
    pub(super) printed: RefCell<Vec<String>>,
    /// Whether what the script prints is kept in `printed` instead of being shown.
    pub(super) gathers: Cell<bool>,
    pub(super) written: RefCell<Vec<PathBuf>>,
    /// Whether every file that is written is told of.
    pub(super) tells_of_files: Cell<bool>,
    /// The files that were imported.
    pub(super) read: RefCell<Vec<PathBuf>>,
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
        if self.heard.gathers.get() {
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
        if !self.common.quiet {
            self.progress.clear();
            let sources = self.heard.sources.borrow();
            output::messages(std::slice::from_ref(&warning), &sources, &self.common);
        }
        warnings.push(warning);
    }

    fn wrote(&mut self, path: &Path) {
        if self.heard.tells_of_files.get() {
            self.progress.clear();
            let name = path.display().to_string();
            output::note(&format!("wrote {}", escaped(&name)), &self.common);
        }
        self.heard.written.borrow_mut().push(path.to_path_buf());
    }

    fn read_source(&mut self, path: &Path) -> Result<(SourceId, Arc<str>), Diagnostic> {
        self.heard.read.borrow_mut().push(path.to_path_buf());
        let (name, text) = read_import(path)?;
        let text: Arc<str> = text.into();
        let id = self.heard.sources.borrow_mut().add(name, Arc::clone(&text));
        Ok((id, text))
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
        let mut sources = Sources::default();
        let fail = |error: Diagnostic, sources: &Sources| report(&[error], sources, common);
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
        let parsing = begun.elapsed();
        let heard = Rc::new(Heard {
            sources: RefCell::new(sources),
            printed: RefCell::default(),
            gathers: Cell::new(common.json),
            written: RefCell::default(),
            tells_of_files: Cell::new(true),
            read: RefCell::default(),
            warnings: RefCell::default(),
        });
        let host = Terminal {
            heard: Rc::clone(&heard),
            progress: TerminalProgress::new(!output::takes_notes(common)),
            common: common.clone(),
        };
        let mut session = Session::new(
            Box::new(host),
            mode,
            limits(common),
            input_directory(file),
            output_directories(common),
        );
        session.set_tier(common.tier);
        session.allow_reading(&common.allow_read);
        if let Some(file) = file.filter(|file| *file != Path::new(STANDARD_INPUT)) {
            session.set_file(file);
        }
        let mut workspace = Workspace {
            session: ManuallyDrop::new(session),
            tree,
            heard,
            common: common.clone(),
            begun,
            parsing,
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

    /// The ends of the command's JSON object.
    pub(super) fn finish_json(&self, object: &mut Map<String, Json>) {
        output::finish_json(object, self.begun, &self.heard.warnings.borrow());
    }

    fn apply_settings(&mut self) -> Result<(), u8> {
        for setting in self.common.set.clone() {
            let origin = format!("<--set {}>", setting.name);
            let expression = self.parse(&origin, &setting.text)?;
            self.session.set(&setting.name, expression);
        }
        Ok(())
    }
}

/// The limits, as the command line sets them.
pub(super) fn limits(common: &Common) -> Limits {
    let mut limits = Limits::default();
    for limit in &common.limit {
        // The command line has been checked for the name.
        limits.set(&limit.name, limit.value);
    }
    limits
}

/// Where relative paths of what the script reads start: the script's folder.
fn input_directory(file: Option<&Path>) -> PathBuf {
    file.and_then(Path::parent)
        .unwrap_or(Path::new(""))
        .to_owned()
}

/// Where the script may write, first the directory where relative paths start.
fn output_directories(common: &Common) -> Vec<PathBuf> {
    let first = common.out.clone().unwrap_or_else(|| PathBuf::from("."));
    std::iter::once(first)
        .chain(common.allow_write.iter().cloned())
        .collect()
}

/// What messages call a file.
pub(super) fn source_name(file: &Path) -> String {
    if file == Path::new(STANDARD_INPUT) {
        "<stdin>".to_string()
    } else {
        file.display().to_string()
    }
}

/// The name and text of a file, without the byte order mark with which some editors begin it: it
/// says nothing here. `-` is standard input.
pub(super) fn read(file: &Path) -> Result<(String, String), Diagnostic> {
    let (name, mut text) = read_whole(file)?;
    if text.starts_with(BYTE_ORDER_MARK) {
        text.drain(..BYTE_ORDER_MARK.len_utf8());
    }
    Ok((name, text))
}

/// The same for a file that a script imports: a pipe or a device could keep it waiting for ever.
pub(super) fn read_import(file: &Path) -> Result<(String, String), Diagnostic> {
    let is_special = std::fs::metadata(file).is_ok_and(|data| !data.is_file() && !data.is_dir());
    if is_special {
        let message = format!("`{}` is not a regular file", source_name(file));
        return Err(Diagnostic::error(Code::CannotRead, message));
    }
    read(file)
}

/// The name and the whole text of a file; `-` is standard input.
pub(super) fn read_whole(file: &Path) -> Result<(String, String), Diagnostic> {
    let name = source_name(file);
    let refused = |reason: String| Diagnostic::error(Code::CannotRead, reason);
    if file.is_dir() {
        return Err(
            refused(format!("`{name}` is a directory")).help("name a file that ends with `.imp`")
        );
    }
    let bytes =
        read_bytes(file).map_err(|error| refused(format!("cannot read `{name}`: {error}")))?;
    if bytes.len() as u64 > LARGEST_SOURCE {
        return Err(refused(format!(
            "`{name}` is larger than {} MB, the most that a source file may have",
            LARGEST_SOURCE / 1_000_000
        )));
    }
    String::from_utf8(bytes)
        .map_err(|error| {
            let at = error.utf8_error().valid_up_to();
            let message = format!("`{name}` is not UTF-8 text: byte {at} cannot be read");
            Diagnostic::error(Code::NotText, message).help("save it as UTF-8")
        })
        .map(|text| (name, text))
}

/// At most one byte more than a source file may have: some files never end.
fn read_bytes(file: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    if file == Path::new(STANDARD_INPUT) {
        let stdin = io::stdin().lock();
        stdin.take(LARGEST_SOURCE + 1).read_to_end(&mut bytes)?;
    } else {
        let file = File::open(file)?;
        file.take(LARGEST_SOURCE + 1).read_to_end(&mut bytes)?;
    }
    Ok(bytes)
}
