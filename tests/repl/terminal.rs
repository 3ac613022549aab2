//! A terminal with the program in it: a pseudo-terminal, and a screen on which what comes is drawn.

use std::io::{Read, Write};
use std::num::NonZeroU16;
use std::sync::{Arc, Condvar, Mutex};
use std::time::{Duration, Instant};

use portable_pty::{Child, CommandBuilder, MasterPty, PtySize, native_pty_system};
use tempfile::TempDir;
use vt100::{Cell, Color, Parser};

/// Whatever is waited for comes sooner, however busy the machine is.
const PATIENCE: Duration = Duration::from_secs(120);

/// How the prompt looks when nothing is typed.
const PROMPT: &str = "imp>";

/// How the program is started.
pub(crate) struct Setup {
    pub(crate) columns: u16,
    pub(crate) rows: u16,
    pub(crate) environment: Vec<(String, String)>,
}

impl Default for Setup {
    fn default() -> Self {
        Setup {
            columns: 100,
            rows: 50,
            environment: vec![
                ("TERM".into(), "xterm-256color".into()),
                ("COLORTERM".into(), "truecolor".into()),
            ],
        }
    }
}

impl Setup {
    pub(crate) fn with(mut self, name: &str, value: &str) -> Setup {
        self.environment.push((name.into(), value.into()));
        self
    }

    pub(crate) fn sized(mut self, columns: u16, rows: u16) -> Setup {
        (self.columns, self.rows) = (columns, rows);
        self
    }
}

struct Screen {
    parser: Parser,
    /// All bytes that came.
    raw: Vec<u8>,
    is_closed: bool,
}

/// The program in a terminal.
pub(crate) struct Terminal {
    screen: Arc<(Mutex<Screen>, Condvar)>,
    writer: Option<Box<dyn Write + Send>>,
    child: Box<dyn Child + Send + Sync>,
    /// The other end, which has to stay open.
    _master: Box<dyn MasterPty + Send>,
    rows: u16,
    columns: u16,
    /// Where it runs, and its history lies.
    pub(crate) folder: Arc<TempDir>,
}

impl Terminal {
    /// The program in a new folder, once it shows its prompt.
    pub(crate) fn new() -> Terminal {
        Terminal::start(Setup::default(), Arc::new(tempfile::tempdir().unwrap()))
    }

    /// The program, once it shows its prompt.
    pub(crate) fn start(setup: Setup, folder: Arc<TempDir>) -> Terminal {
        let size = PtySize {
            rows: setup.rows,
            cols: setup.columns,
            pixel_width: 0,
            pixel_height: 0,
        };
        let pair = native_pty_system().openpty(size).unwrap();
        let mut command = CommandBuilder::new(env!("CARGO_BIN_EXE_imp"));
        command.env_clear();
        command.env("HOME", folder.path());
        command.env("PATH", "/nowhere");
        for (name, value) in &setup.environment {
            command.env(name, value);
        }
        command.cwd(folder.path());
        let child = pair.slave.spawn_command(command).unwrap();
        drop(pair.slave);
        let size = |length| NonZeroU16::new(length).unwrap();
        let parser = Parser::new(size(setup.rows), size(setup.columns), 10_000);
        let screen = Screen {
            parser,
            raw: Vec::new(),
            is_closed: false,
        };
        let screen = Arc::new((Mutex::new(screen), Condvar::new()));
        let shared = Arc::clone(&screen);
        let mut reader = pair.master.try_clone_reader().unwrap();
        std::thread::spawn(move || {
            let mut bytes = [0; 4096];
            loop {
                let count = reader.read(&mut bytes).unwrap_or(0);
                let mut screen = shared.0.lock().unwrap();
                screen.parser.process(&bytes[..count]);
                screen.raw.extend_from_slice(&bytes[..count]);
                screen.is_closed = count == 0;
                shared.1.notify_all();
                if count == 0 {
                    break;
                }
            }
        });
        let writer = pair.master.take_writer().unwrap();
        let mut terminal = Terminal {
            screen,
            writer: Some(writer),
            child,
            _master: pair.master,
            rows: setup.rows,
            columns: setup.columns,
            folder,
        };
        terminal.wait_for_prompt();
        terminal
    }

    /// Sends keys.
    pub(crate) fn send(&mut self, keys: &str) {
        let writer = self.writer.as_mut().unwrap();
        writer.write_all(keys.as_bytes()).unwrap();
        writer.flush().unwrap();
    }

    /// Sends keys that may be so many that the program has to read while they are written.
    pub(crate) fn send_much(&mut self, keys: String) {
        let mut writer = self.writer.take().unwrap();
        let sender = std::thread::spawn(move || {
            writer.write_all(keys.as_bytes()).unwrap();
            writer.flush().unwrap();
            writer
        });
        self.writer = Some(sender.join().unwrap());
    }

    /// Types text that fits on the line and waits until it is there.
    pub(crate) fn type_text(&mut self, text: &str) {
        self.send(text);
        let expected = format!("{PROMPT} {text}");
        let expected = expected.trim_end().to_string();
        self.wait(&expected, |screen| screen.line == expected);
    }

    /// Types a line, and waits until what came of it is there.
    pub(crate) fn enter(&mut self, line: &str) {
        self.type_text(line);
        self.send("\r");
        self.wait_for_prompt();
    }

    /// Waits until nothing stands behind the prompt.
    pub(crate) fn wait_for_prompt(&mut self) {
        self.wait("the prompt", |screen| {
            screen.line == PROMPT && screen.column == 5
        });
    }

    /// Waits until the text stands somewhere on the screen.
    pub(crate) fn wait_for(&mut self, text: &str) {
        self.wait(text, |screen| screen.contents.contains(text));
    }

    /// Waits until the screen is as it should be.
    pub(crate) fn wait(&mut self, what: &str, is_there: impl Fn(&Seen) -> bool) {
        let begun = Instant::now();
        let (lock, changed) = &*self.screen;
        let mut screen = lock.lock().unwrap();
        loop {
            let seen = Seen::of(&screen.parser, self.columns);
            if is_there(&seen) {
                return;
            }
            let left = PATIENCE.saturating_sub(begun.elapsed());
            assert!(
                !left.is_zero() && !screen.is_closed,
                "{what:?} does not come:\n{}\n(at {:?})",
                seen.contents,
                seen.line
            );
            screen = changed.wait_timeout(screen, left).unwrap().0;
        }
    }

    /// What the screen shows.
    pub(crate) fn contents(&self) -> String {
        self.screen.0.lock().unwrap().parser.screen().contents()
    }

    /// What came since the program began.
    pub(crate) fn raw(&self) -> String {
        let screen = self.screen.0.lock().unwrap();
        String::from_utf8_lossy(&screen.raw).into_owned()
    }

    /// What stands in a cell: its letter, foreground and background.
    pub(crate) fn cell(&self, row: u16, column: u16) -> (String, Color, Color) {
        let screen = self.screen.0.lock().unwrap();
        let cell: &Cell = screen.parser.screen().cell(row, column).unwrap();
        (cell.contents().to_string(), cell.fgcolor(), cell.bgcolor())
    }

    pub(crate) fn rows(&self) -> u16 {
        self.rows
    }

    pub(crate) fn columns(&self) -> u16 {
        self.columns
    }

    /// Types no more: the end of the input is sent.
    pub(crate) fn end_input(&mut self) {
        self.writer = None;
    }

    /// The exit code, once the program has ended.
    pub(crate) fn exit_code(&mut self) -> u32 {
        let begun = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status.exit_code();
            }
            assert!(
                begun.elapsed() < PATIENCE,
                "it does not end:\n{}",
                self.contents()
            );
            std::thread::yield_now();
        }
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        // It has ended already, most of the time.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// What the screen shows at one time.
pub(crate) struct Seen {
    pub(crate) contents: String,
    /// The line in which the cursor is.
    pub(crate) line: String,
    pub(crate) column: u16,
}

impl Seen {
    fn of(parser: &Parser, columns: u16) -> Seen {
        let screen = parser.screen();
        let (row, column) = screen.cursor_position();
        let line = screen.rows(0, columns).nth(row.into()).unwrap_or_default();
        Seen {
            contents: screen.contents(),
            line: line.trim_end().to_string(),
            column,
        }
    }
}
