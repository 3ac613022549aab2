//! `imp completions`

use clap::CommandFactory;

use super::arguments::{Arguments, Completions};
use super::output;

/// Prints the script with which a shell completes words of the command line.
pub(super) fn completions(command: &Completions) {
    let mut script = Vec::new();
    let mut program = Arguments::command();
    clap_complete::generate(command.shell, &mut program, "imp", &mut script);
    output::data_as_it_is(&String::from_utf8_lossy(&script));
}
