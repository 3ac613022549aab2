//! A session's host for tests in this process: it keeps warnings and forgets what is printed.

use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Instant;

use imp::diagnostic::{Code, Diagnostic, SourceId};
use imp::engine::Monitor;
use imp::language::Host;

/// Listens to a session.
pub(crate) struct Listener {
    /// What the session warned of.
    pub(crate) warnings: Rc<RefCell<Vec<Diagnostic>>>,
    /// When long work is asked to end.
    pub(crate) deadline: Deadline,
}

/// Asks long work to end from this moment on.
pub(crate) struct Deadline(pub(crate) Instant);

impl Host for Listener {
    fn print(&mut self, _line: &str) {}

    fn warn(&mut self, warning: Diagnostic) {
        self.warnings.borrow_mut().push(warning);
    }

    fn wrote(&mut self, _path: &Path) {}

    fn read_source(&mut self, path: &Path) -> Result<(SourceId, Arc<str>), Diagnostic> {
        let message = format!("`{}` is not read here", path.display());
        Err(Diagnostic::error(Code::CannotRead, message))
    }

    fn monitor(&self) -> &dyn Monitor {
        &self.deadline
    }
}

impl Monitor for Deadline {
    fn progress(&self, _phase: &str, _fraction: f64) {}

    fn cancelled(&self) -> bool {
        Instant::now() >= self.0
    }
}
