//! What a program may use up. Every limit has a name, which its error gives and by which a flag
//! raises it.

use std::time::{Duration, Instant};

use super::function::At;
use super::session::Session;
use super::value::{Outcome, Value, failure};
use crate::diagnostic::{Code, Span};
use crate::engine::Monitor;

macro_rules! limits {
    ($($(#[doc = $documentation:literal])* $name:ident: $default:expr,)*) => {
        /// The limits of one session.
        #[derive(Clone, Debug)]
        pub struct Limits {
            $($(#[doc = $documentation])* pub $name: u64,)*
        }

        impl Default for Limits {
            fn default() -> Self {
                Limits { $($name: $default,)* }
            }
        }

        impl Limits {
            /// The names of all limits.
            pub const NAMES: &[&str] = &[$(stringify!($name),)*];

            /// Sets the limit of that name; false if there is none.
            pub fn set(&mut self, name: &str, value: u64) -> bool {
                match name {
                    $(stringify!($name) => self.$name = value,)*
                    _ => return false,
                }
                true
            }
        }
    };
}

limits! {
    /// Calls within calls.
    recursion: 5_000,
    /// Nodes in the expression graph.
    nodes: 10_000_000,
    /// Elements of one list, sublists included; all lists together may have four times as many.
    elements: 5_000_000,
    /// Bytes of one string.
    characters: 10_000_000,
    /// Calls and loop rounds of the whole program.
    steps: 200_000_000,
    /// Cells of one polygonization.
    cells: 2_000_000_000,
    /// Particles of one sampling: ten million points take about a gigabyte.
    particles: 10_000_000,
    /// Seconds that a run of the file, or a test, or an expression may take.
    seconds: 3_600,
    /// Bytes of all that is printed and written to files.
    bytes: 10_000_000_000,
    /// Bytes of one mesh that is loaded: its file and the mesh are in memory together.
    input: 1_000_000_000,
}

/// After as much work as so many expressions take the clock is looked at.
const WORK_PER_LOOK: u64 = 1 << 12;

/// How much work it may be to do something with a value, in expressions: as much as it has
/// elements, and of fields and functions nobody knows how much.
pub(super) fn weight(value: &Value) -> u64 {
    match value {
        Value::List(list) => list.leaves(),
        Value::Field(_) | Value::Function(_) => WORK_PER_LOOK,
        _ => 0,
    }
}

/// Someone who watches long work, with the time at which it has to end.
pub(super) struct Deadline<'a> {
    monitor: &'a dyn Monitor,
    end: Option<Instant>,
}

impl<'a> Deadline<'a> {
    pub(super) fn new(monitor: &'a dyn Monitor, end: Option<Instant>) -> Self {
        Deadline { monitor, end }
    }
}

impl Monitor for Deadline<'_> {
    fn progress(&self, phase: &str, fraction: f64) {
        self.monitor.progress(phase, fraction);
    }

    fn cancelled(&self) -> bool {
        self.monitor.cancelled() || self.end.is_some_and(|end| Instant::now() >= end)
    }
}

impl Session {
    /// Starts the clock of what is to be run.
    pub(super) fn start_clock(&mut self) {
        // A limit beyond what a clock can hold is none.
        let allowed = Duration::from_secs(self.limits.seconds);
        self.deadline = Instant::now().checked_add(allowed);
    }

    /// Who watches long work: the host, and the clock.
    pub(super) fn monitor(&self) -> Deadline<'_> {
        Deadline::new(self.host.monitor(), self.deadline)
    }

    /// Counts work, in expressions; now and then it looks at the clock, and fails where the time is
    /// over.
    #[inline]
    pub(super) fn count_work(&mut self, amount: u64, span: Span) -> Outcome<()> {
        self.unseen_work = self.unseen_work.saturating_add(amount);
        if self.unseen_work < WORK_PER_LOOK {
            return Ok(());
        }
        self.unseen_work = 0;
        self.check_time(span)
    }

    /// Fails where the time is over, or whoever watches wants an end.
    pub(super) fn check_time(&self, span: Span) -> Outcome<()> {
        if self.host.monitor().cancelled() {
            let message = "the computation was stopped";
            return Err(failure(Code::Cancelled, message).at(span, "was running here"));
        }
        match self.deadline {
            Some(end) if Instant::now() >= end => exceeded(
                Code::TimeLimit,
                "the program takes too many seconds",
                "seconds",
                self.limits.seconds,
            )
            .at(span, "still running here"),
            _ => Ok(()),
        }
    }

    /// Counts bytes that are printed or written, and fails where they are too many.
    pub(super) fn count_output(&mut self, bytes: u64, span: Span) -> Outcome<()> {
        self.output_bytes = self.output_bytes.saturating_add(bytes);
        if self.output_bytes <= self.limits.bytes {
            return Ok(());
        }
        exceeded(
            Code::OutputLimit,
            "the program prints and writes too much",
            "bytes",
            self.limits.bytes,
        )
        .at(span, "this would be more")
    }

    /// How many bytes may still be printed or written.
    pub(super) fn output_left(&self) -> u64 {
        self.limits.bytes.saturating_sub(self.output_bytes)
    }
}

/// The error for a limit that was hit.
pub fn exceeded<T>(code: Code, what: &str, name: &str, limit: u64) -> Outcome<T> {
    let mut error = failure(code, format!("{what} (the limit is {limit})"));
    error.help = Some(format!("raise it with `--limit {name}=N` if this is meant"));
    Err(error)
}
