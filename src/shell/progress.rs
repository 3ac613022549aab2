//! A progress bar at a terminal.

use std::io::{IsTerminal, stderr};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use super::interrupt;
use crate::engine::Monitor;

/// Work shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_millis(500);

/// Shows how far long work is, on standard error, if that is a terminal.
pub(super) struct TerminalProgress {
    enabled: bool,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    phase: String,
    begun: Option<Instant>,
    bar: Option<ProgressBar>,
}

impl TerminalProgress {
    pub(super) fn new(quiet: bool) -> Self {
        TerminalProgress {
            enabled: !quiet && stderr().is_terminal(),
            state: Mutex::default(),
        }
    }

    /// Takes the bar away, so that other text can be written.
    pub(super) fn clear(&self) {
        if let Ok(mut state) = self.state.lock() {
            if let Some(bar) = state.bar.take() {
                bar.finish_and_clear();
            }
            state.begun = None;
        }
    }
}

impl Monitor for TerminalProgress {
    fn cancelled(&self) -> bool {
        interrupt::is_pending()
    }

    fn progress(&self, phase: &str, fraction: f64) {
        if !self.enabled {
            return;
        }
        let Ok(mut state) = self.state.lock() else {
            return;
        };
        if state.phase != phase {
            state.phase = phase.to_string();
            state.begun.get_or_insert_with(Instant::now);
            if let Some(bar) = &state.bar {
                bar.set_message(phase.to_string());
            }
        }
        let begun = *state.begun.get_or_insert_with(Instant::now);
        if state.bar.is_none() && begun.elapsed() > PATIENCE && fraction < 1.0 {
            let bar = ProgressBar::new(1000);
            // The template is a constant that indicatif understands; without it the default
            // style would do as well.
            if let Ok(style) = ProgressStyle::with_template("{msg:16} {wide_bar} {percent:>3} %") {
                bar.set_style(style);
            }
            bar.set_message(phase.to_string());
            state.bar = Some(bar);
        }
        if let Some(bar) = &state.bar {
            bar.set_position((1000.0 * fraction.clamp(0.0, 1.0)) as u64);
            if fraction >= 1.0 {
                bar.finish_and_clear();
                state.bar = None;
                state.begun = None;
            }
        }
    }
}
