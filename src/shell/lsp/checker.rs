//! Checks texts beside the conversation: on a thread of its own, the newest text of each file
//! only, within limits that no text can exceed.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use rustc_hash::FxHashMap;

use super::server::Event;
use crate::assist::Known;
use crate::assist::project::plain;
use crate::diagnostic::{Code, Diagnostic, SourceId, Sources};
use crate::engine::Monitor;
use crate::language::{Host, Limits, Mode, Session, Value};
use crate::syntax::parse;

/// Bytes of the checking thread's stack. What a text makes may be dropped one inside the other,
/// at most as deep as the limit of steps allows.
const STACK: usize = 512 << 20;

/// Seconds that a check may take.
const SECONDS: u64 = 3;

/// A text that is to be checked.
pub(super) struct Job {
    pub(super) path: PathBuf,
    pub(super) version: i64,
    pub(super) text: Arc<str>,
    /// The texts of all open files.
    pub(super) texts: FxHashMap<PathBuf, Arc<str>>,
    /// Folders from which files may be imported, besides the file's own.
    pub(super) folders: Vec<PathBuf>,
}

/// What was found in a text.
pub(super) struct Findings {
    pub(super) path: PathBuf,
    pub(super) version: i64,
    pub(super) diagnostics: Vec<Diagnostic>,
    /// The texts that the diagnostics speak of; the file itself is the first.
    pub(super) sources: Sources,
    /// The names that have values; those of modules with their point.
    pub(super) values: Vec<Known>,
}

/// The thread that checks, seen from the conversation.
pub(super) struct Checker {
    shared: Arc<Shared>,
}

#[derive(Default)]
struct Shared {
    waiting: Mutex<VecDeque<Job>>,
    ready: Condvar,
    /// The file that is being checked, and whether its result is no longer wanted.
    current: Mutex<Option<PathBuf>>,
    stale: AtomicBool,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A thread that panicked while it held this left a whole value behind.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Checker {
    /// Starts the thread; what it finds goes to `events`.
    pub(super) fn start(events: Sender<Event>) -> io::Result<Checker> {
        let shared = Arc::new(Shared::default());
        let of_thread = Arc::clone(&shared);
        std::thread::Builder::new()
            .name("check".into())
            .stack_size(STACK)
            .spawn(move || of_thread.work(&events))?;
        Ok(Checker { shared })
    }

    /// Has a text checked as soon as possible, instead of older texts of the same file.
    pub(super) fn ask(&self, job: Job) {
        let mut waiting = lock(&self.shared.waiting);
        if lock(&self.shared.current).as_ref() == Some(&job.path) {
            self.shared.stale.store(true, Ordering::Relaxed);
        }
        match waiting.iter_mut().find(|other| other.path == job.path) {
            Some(older) => *older = job,
            None => waiting.push_back(job),
        }
        self.shared.ready.notify_one();
    }

    /// Forgets a file.
    pub(super) fn forget(&self, path: &Path) {
        lock(&self.shared.waiting).retain(|job| job.path != path);
    }
}

impl Shared {
    fn work(self: Arc<Self>, events: &Sender<Event>) {
        loop {
            let mut waiting = lock(&self.waiting);
            let job = loop {
                if let Some(job) = waiting.pop_front() {
                    break job;
                }
                waiting = self
                    .ready
                    .wait(waiting)
                    .unwrap_or_else(PoisonError::into_inner);
            };
            *lock(&self.current) = Some(job.path.clone());
            self.stale.store(false, Ordering::Relaxed);
            drop(waiting);
            // A mistake in this program must not end the conversation.
            let found = catch_unwind(AssertUnwindSafe(|| check(job, &self)));
            *lock(&self.current) = None;
            let Ok(findings) = found else { continue };
            let is_wanted = !self.stale.load(Ordering::Relaxed);
            if is_wanted && events.send(Event::Checked(findings)).is_err() {
                return;
            }
        }
    }
}

/// Parses a text, looks at its names and evaluates it without acting.
fn check(job: Job, shared: &Arc<Shared>) -> Findings {
    let mut sources = Sources::default();
    let id = sources.add(job.path.display().to_string(), Arc::clone(&job.text));
    let parsed = parse(id, &job.text);
    let heard = Rc::new(Heard {
        sources: RefCell::new(sources),
        warnings: RefCell::default(),
    });
    let mut diagnostics = parsed.diagnostics;
    let mut values = Vec::new();
    if diagnostics.is_empty() {
        let host = Editor {
            heard: Rc::clone(&heard),
            texts: job.texts,
            watch: Watch(Arc::clone(shared)),
        };
        let directory = job.path.parent().unwrap_or(Path::new("")).to_owned();
        let mut session =
            Session::new(Box::new(host), Mode::Check, limits(), directory, Vec::new());
        session.set_file(&job.path);
        session.allow_reading(&job.folders);
        if let Err(errors) = session.run(&parsed.tree) {
            diagnostics = errors;
        }
        values = named_values(&session);
    }
    diagnostics.append(&mut heard.warnings.borrow_mut());
    diagnostics.retain(|diagnostic| diagnostic.code != Code::Cancelled);
    let sources = heard.sources.borrow().clone();
    Findings {
        path: job.path,
        version: job.version,
        diagnostics,
        sources,
        values,
    }
}

/// What a text may use up while it is being written.
fn limits() -> Limits {
    Limits {
        nodes: 1_000_000,
        elements: 1_000_000,
        characters: 1_000_000,
        steps: 200_000,
        seconds: SECONDS,
        input: 20_000_000,
        ..Limits::default()
    }
}

/// The names that have values, and those of modules.
fn named_values(session: &Session) -> Vec<Known> {
    // In the session a parameter is a symbol; here its value is wanted.
    let parameters: FxHashMap<&str, &Value> = session
        .parameters()
        .iter()
        .map(|(name, parameter)| (&**name, &parameter.value))
        .collect();
    let known = |name: &Arc<str>, value: &Value| {
        let value = parameters.get(&**name).copied().unwrap_or(value);
        Known::with_value(name, value)
    };
    let mut all = Vec::new();
    for (name, value) in session.values() {
        if let Value::Module(module) = &value {
            for (member, value) in module.members() {
                let full = Arc::from(format!("{name}.{member}"));
                all.push(known(&full, &value));
            }
        }
        all.push(known(&name, &value));
    }
    all
}

/// What a session says while a text is checked.
struct Heard {
    sources: RefCell<Sources>,
    warnings: RefCell<Vec<Diagnostic>>,
}

/// The host of a session that checks a text.
struct Editor {
    heard: Rc<Heard>,
    texts: FxHashMap<PathBuf, Arc<str>>,
    watch: Watch,
}

struct Watch(Arc<Shared>);

impl Monitor for Watch {
    fn progress(&self, _phase: &str, _fraction: f64) {}

    fn cancelled(&self) -> bool {
        self.0.stale.load(Ordering::Relaxed)
    }
}

impl Host for Editor {
    fn print(&mut self, _line: &str) {}

    fn warn(&mut self, warning: Diagnostic) {
        const MOST: usize = 100;
        let mut warnings = self.heard.warnings.borrow_mut();
        // A loop says the same at every round.
        let is_known = warnings
            .iter()
            .any(|known| known.code == warning.code && known.labels == warning.labels);
        if !is_known && warnings.len() < MOST {
            warnings.push(warning);
        }
    }

    fn wrote(&mut self, _path: &Path) {}

    fn read_source(&mut self, path: &Path) -> Result<(SourceId, Arc<str>), Diagnostic> {
        let (name, text) = match self.texts.get(&plain(path)) {
            Some(text) => (path.display().to_string(), Arc::clone(text)),
            None => {
                let (name, text) = crate::shell::workspace::read_import(path)?;
                (name, text.into())
            }
        };
        let mut sources = self.heard.sources.borrow_mut();
        let id = sources.add(name, Arc::clone(&text));
        Ok((id, text))
    }

    fn monitor(&self) -> &dyn Monitor {
        &self.watch
    }
}
