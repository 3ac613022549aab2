//! Reading lines at a terminal: rustyline with this program's helper and history.

use std::borrow::Cow;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use rustyline::config::Configurer;
use rustyline::error::ReadlineError;
use rustyline::history::FileHistory;
use rustyline::{
    Behavior, Cmd, ColorMode, CompletionType, ConditionalEventHandler, Config, Event, EventContext,
    EventHandler, KeyCode, Modifiers, RepeatCount,
};

use super::super::arguments::Common;
use super::super::output;
use super::helper::Assistant;
use super::history;
use super::screen::Colors;
use super::session::Repl;
use crate::assist::{Kind, Known};
use crate::diagnostic::{Code, Diagnostic};

/// A file that keeps nothing, which needs no saying.
const NOTHING: &str = "/dev/null";

/// The prompt.
const PROMPT: &str = "imp> ";

/// More than so many bytes are not taken from the keyboard, where the editor looks at the whole line
/// for each letter. What is pasted at once may be longer.
pub(super) const LONGEST_TYPED: usize = 32_768;

/// Longer inputs are not kept in the history.
const LONGEST_KEPT: usize = 16_384;

/// So many lines in a row may be unreadable before the input counts as lost.
const PATIENCE: usize = 1_000;

/// Reads what a person types.
pub(super) struct Editor {
    editor: rustyline::Editor<Assistant, FileHistory>,
    file: Option<PathBuf>,
    common: Common,
    /// What was typed before the first line was read.
    pub(super) typed_ahead: String,
    /// Whether letters of the present line were not taken.
    is_cut: Arc<AtomicBool>,
    /// Whether an input was left in its middle by the end of input.
    is_left: Arc<AtomicBool>,
}

/// Takes no more letters for a line that is long already, and leaves an input that is not whole
/// when Ctrl-D is typed on an empty line of it; notes that.
struct Keys {
    is_cut: Arc<AtomicBool>,
    is_left: Arc<AtomicBool>,
}

impl ConditionalEventHandler for Keys {
    fn handle(
        &self,
        event: &Event,
        _count: RepeatCount,
        _is_positive: bool,
        context: &EventContext,
    ) -> Option<Cmd> {
        let ends = matches!(event.get(0), Some(key) if matches!(key.0, KeyCode::Char('d' | 'D'))
            && key.1 == Modifiers::CTRL);
        let line = context.line();
        if ends && line.ends_with('\n') && context.pos() == line.len() {
            self.is_left.store(true, Ordering::Relaxed);
            return Some(Cmd::Interrupt);
        }
        let is_letter = matches!(event.get(0), Some(key) if matches!(key.0, KeyCode::Char(letter)
            if key.1.is_empty() && !letter.is_control()));
        let is_cut = is_letter && context.line().len() > LONGEST_TYPED;
        if is_cut {
            self.is_cut.store(true, Ordering::Relaxed);
        }
        is_cut.then_some(Cmd::Noop)
    }
}

impl Editor {
    /// An editor for the session's terminal.
    pub(super) fn new(repl: &Repl, common: &Common) -> Result<Editor, Box<Diagnostic>> {
        let has_colors = repl.screen.colors != Colors::None;
        let config = Config::builder()
            .behavior(Behavior::Stdio)
            .completion_type(CompletionType::List)
            .color_mode(match has_colors {
                true => ColorMode::Forced,
                false => ColorMode::Disabled,
            })
            .history_ignore_space(true)
            .bracketed_paste(true)
            .tab_stop(4)
            .build();
        let failed = |error: ReadlineError| Box::new(not_read(&error));
        let mut editor = rustyline::Editor::with_config(config).map_err(failed)?;
        editor
            .set_max_history_size(history::LONGEST)
            .map_err(failed)?;
        editor.set_helper(Some(Assistant::new(has_colors)));
        let is_cut = Arc::new(AtomicBool::new(false));
        let is_left = Arc::new(AtomicBool::new(false));
        let handler = EventHandler::Conditional(Box::new(Keys {
            is_cut: Arc::clone(&is_cut),
            is_left: Arc::clone(&is_left),
        }));
        editor.bind_sequence(Event::Any, handler);
        Ok(Editor {
            editor,
            file: history::file(),
            common: common.clone(),
            typed_ahead: String::new(),
            is_cut,
            is_left,
        })
    }

    /// Reads the history of earlier sessions. Where it cannot be kept that is said once.
    pub(super) fn open_history(&mut self) {
        let Some(file) = &self.file else {
            return;
        };
        if file == Path::new(NOTHING) {
            self.file = None;
            return;
        }
        if let Err(error) = prepare(file).and_then(|()| match self.editor.load_history(file) {
            Err(ReadlineError::Io(error)) if error.kind() != ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        }) {
            self.give_up_history(&error.to_string());
        }
    }

    /// Keeps an input in the history.
    pub(super) fn remember(&mut self, text: &str) {
        if text.len() > LONGEST_KEPT || text.trim().is_empty() {
            return;
        }
        // A history that cannot be extended in memory has no room, and that is no error.
        let is_new = self.editor.add_history_entry(text).unwrap_or(false);
        let Some(file) = self.file.clone().filter(|_| is_new) else {
            return;
        };
        if let Err(error) = self.editor.append_history(&file) {
            self.give_up_history(&error.to_string());
        }
    }

    fn give_up_history(&mut self, reason: &str) {
        if let Some(file) = self.file.take() {
            let name = output::escaped(&file.display().to_string());
            let text = format!("the history is not kept: `{name}`: {reason}");
            output::note(&text, &self.common);
        }
    }

    /// Learns the names of the session, for completions and colours.
    pub(super) fn learn(&mut self, repl: &Repl) {
        let Some(assistant) = self.editor.helper_mut() else {
            return;
        };
        let session = &repl.workspace.session;
        let parameters = session.parameters().iter().map(|(name, _)| name);
        let settings = session.settings().iter().map(|(name, _)| name);
        assistant.parameters = parameters
            .chain(settings)
            .map(|name| name.to_string())
            .collect();
        let names = session.own_names().into_iter();
        assistant.surroundings.names = names
            .filter_map(|name| {
                let value = session.bound(&name)?;
                let mut known = Known::with_value(&name, &value);
                if assistant.parameters.iter().any(|own| **own == *name) {
                    known.kind = Kind::Parameter;
                }
                Some(known)
            })
            .collect();
    }

    /// The next input; nothing at the end of all input. Ctrl-C begins the input anew.
    pub(super) fn read(&mut self) -> Result<Option<String>, Box<Diagnostic>> {
        for _ in 0..PATIENCE {
            let typed = std::mem::take(&mut self.typed_ahead);
            match self.editor.readline_with_initial(PROMPT, (&typed, "")) {
                Ok(_) if self.is_cut.swap(false, Ordering::Relaxed) => {
                    output::error_text(&format!(
                        "the line is longer than {LONGEST_TYPED} bytes, so it was not run: put it \
                         in a file for `:load`"
                    ));
                }
                Ok(text) => return Ok(Some(text)),
                Err(ReadlineError::Eof) => return Ok(None),
                Err(ReadlineError::Interrupted | ReadlineError::Signal(_)) => {
                    self.is_cut.store(false, Ordering::Relaxed);
                    if self.is_left.swap(false, Ordering::Relaxed) {
                        output::error_text("the input was not whole, so it was not run");
                    }
                }
                Err(ReadlineError::Io(error)) if error.kind() == ErrorKind::InvalidData => {
                    output::error_text("what was typed is not UTF-8 text");
                }
                // The terminal is gone.
                #[cfg(unix)]
                Err(ReadlineError::Errno(_)) => return Ok(None),
                Err(ReadlineError::Io(error)) if error.raw_os_error().is_some() => return Ok(None),
                Err(error) => return Err(Box::new(not_read(&error))),
            }
        }
        Ok(None)
    }
}

/// Makes the folder of the history, and sees whether its file can be read and written. What is no
/// text in it is replaced.
fn prepare(file: &Path) -> std::io::Result<()> {
    if let Some(folder) = file
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
    {
        std::fs::create_dir_all(folder)?;
    }
    // Others may never end, or wait for somebody at their other end.
    match std::fs::metadata(file) {
        Ok(found) if !found.is_file() => {
            return Err(std::io::Error::other("it is not a regular file"));
        }
        Ok(found) if found.len() > history::LARGEST => {
            return Err(std::io::Error::other("it is too large"));
        }
        _ => {}
    }
    let mut options = std::fs::OpenOptions::new();
    options.append(true).create(true).open(file)?;
    let bytes = std::fs::read(file)?;
    match String::from_utf8_lossy(&bytes) {
        Cow::Borrowed(_) => Ok(()),
        Cow::Owned(text) => std::fs::write(file, text),
    }
}

fn not_read(error: &ReadlineError) -> Diagnostic {
    Diagnostic::error(
        Code::CannotRead,
        format!("cannot read what is typed: {error}"),
    )
}
