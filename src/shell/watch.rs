//! `imp watch` and `imp run --watch`: a script that runs again whenever one of its files is saved.
//!
//! Folders are watched instead of files, because many editors put a new file in the place of the
//! old one. A run that is going on when a file is saved is stopped, since another follows. What fails
//! is reported and watched on; an interrupt ends it.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use notify::{Event, EventKind, RecommendedWatcher, RecursiveMode, Watcher};

use super::arguments::Run;
use super::interrupt;
use super::output::{self, escaped};
use super::run::run_once;
use super::workspace::{STANDARD_INPUT, source_name};
use crate::diagnostic::{Code, Diagnostic, Sources};

/// Changes that follow each other as fast as this are one.
const QUIET: Duration = Duration::from_millis(60);

/// How often a file that has gone away for a moment is looked for.
const PATIENCE: Duration = Duration::from_millis(50);

/// The folders that are watched, and what is heard from them.
struct Folders {
    watcher: RecommendedWatcher,
    heard: Receiver<notify::Result<Event>>,
    watched: BTreeSet<PathBuf>,
    /// The files whose change stops a run.
    files: Arc<Mutex<BTreeSet<PathBuf>>>,
}

/// Runs a script again and again until an interrupt; fails with an exit code where nothing can be
/// watched.
pub(super) fn watch(command: &Run) -> Result<(), u8> {
    let fail = |error| output::report(&[error], &Sources::default(), &command.common);
    if command.file == Path::new(STANDARD_INPUT) {
        let error = Diagnostic::error(Code::Usage, "standard input cannot be watched");
        return Err(fail(error.help("name a file")));
    }
    if command.common.json {
        let message = "`--json` is for one run, and a watched script runs many times";
        return Err(fail(Diagnostic::error(Code::Usage, message)));
    }
    let mut folders = Folders::new().map_err(|error| fail(refused(&error)))?;
    let main = absolute(&command.file);
    let mut files = BTreeSet::from([main.clone()]);
    loop {
        folders
            .watch(&files)
            .map_err(|error| fail(refused(&error)))?;
        let begun = Instant::now();
        interrupt::forget_stop();
        let (result, read) = run_once(command);
        let was_stopped = interrupt::forget_stop();
        // A file that could not be read in this round may come back.
        files.extend(read.iter().map(|path| absolute(path)));
        folders
            .watch(&files)
            .map_err(|error| fail(refused(&error)))?;
        let word = match result {
            Ok(()) => "done",
            Err(_) if was_stopped => "stopped",
            Err(_) => "failed",
        };
        let status = format!(
            "{}: {word} after {:.2} s, watching {} file{}",
            escaped(&source_name(&command.file)),
            begun.elapsed().as_secs_f64(),
            files.len(),
            if files.len() == 1 { "" } else { "s" },
        );
        output::note(&status, &command.common);
        folders
            .wait(&files, result.is_err())
            .map_err(|error| fail(refused(&error)))?;
        while !main.is_file() {
            std::thread::sleep(PATIENCE);
        }
    }
}

/// Whether an event tells of more than that a file was read.
fn is_change(event: &Event) -> bool {
    !matches!(event.kind, EventKind::Access(_))
}

fn refused(error: &notify::Error) -> Diagnostic {
    Diagnostic::error(Code::CannotRead, format!("cannot watch files: {error}"))
}

/// A path that stays the same wherever it is looked at from, as the system tells of changes.
fn absolute(path: &Path) -> PathBuf {
    let folder = match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    match (folder.canonicalize(), path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path.to_owned(),
    }
}

impl Folders {
    fn new() -> notify::Result<Folders> {
        let (sender, heard) = channel();
        let files: Arc<Mutex<BTreeSet<PathBuf>>> = Arc::default();
        let of_run = Arc::clone(&files);
        let watcher = notify::recommended_watcher(move |event: notify::Result<Event>| {
            let is_saved = |event: &Event| {
                let files = of_run.lock().unwrap_or_else(PoisonError::into_inner);
                is_change(event) && event.paths.iter().any(|path| files.contains(path))
            };
            if event.as_ref().is_ok_and(is_saved) {
                interrupt::stop();
            }
            // Nobody listens only while the program ends.
            let _ = sender.send(event);
        })?;
        Ok(Folders {
            watcher,
            heard,
            watched: BTreeSet::new(),
            files,
        })
    }

    /// Watches the folders of these files, too.
    fn watch(&mut self, files: &BTreeSet<PathBuf>) -> notify::Result<()> {
        let mut known = self.files.lock().unwrap_or_else(PoisonError::into_inner);
        known.clone_from(files);
        drop(known);
        for folder in files.iter().filter_map(|file| file.parent()) {
            if !self.watched.contains(folder) && folder.is_dir() {
                self.watcher.watch(folder, RecursiveMode::NonRecursive)?;
                self.watched.insert(folder.to_owned());
            }
        }
        Ok(())
    }

    /// Waits until one of these files is saved, and until nothing more changes for a moment. After
    /// a failure any program in the folders counts: it may be one that was missing.
    fn wait(&self, files: &BTreeSet<PathBuf>, after_failure: bool) -> notify::Result<()> {
        let matters = |event: &Event| {
            is_change(event)
                && event.paths.iter().any(|path| {
                    let is_program = path.extension().is_some_and(|name| name == "imp");
                    files.contains(path) || (after_failure && is_program)
                })
        };
        let mut changed = false;
        loop {
            let event = match changed {
                true => self.heard.recv_timeout(QUIET),
                false => self
                    .heard
                    .recv()
                    .map_err(|_| RecvTimeoutError::Disconnected),
            };
            match event {
                Ok(event) => changed |= matters(&event?),
                Err(RecvTimeoutError::Timeout) => return Ok(()),
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(notify::Error::generic("the watcher has ended"));
                }
            }
        }
    }
}
