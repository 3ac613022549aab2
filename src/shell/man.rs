//! `imp man`

use clap::CommandFactory;
use clap_mangen::Man;

use super::arguments::{Arguments, Manual};
use super::output;
use crate::diagnostic::suggest::nearest;
use crate::diagnostic::{Code, Diagnostic, Sources};

/// Prints the manual page of the program or of a command; fails with an exit code.
pub(super) fn man(command: &Manual) -> Result<(), u8> {
    let mut program = Arguments::command();
    // Only now the commands know their whole names.
    program.build();
    let page = match &command.command {
        None => program,
        Some(name) => program
            .find_subcommand(name)
            .cloned()
            .ok_or_else(|| unknown(name, &program))?,
    };
    let mut text = Vec::new();
    let rendered = Man::new(page).render(&mut text);
    rendered.map_err(|error| {
        let message = format!("cannot make the manual page: {error}");
        fail(Diagnostic::error(Code::CannotWrite, message))
    })?;
    output::data_as_it_is(&String::from_utf8_lossy(&text));
    Ok(())
}

fn unknown(name: &str, program: &clap::Command) -> u8 {
    let names = program.get_subcommands().map(clap::Command::get_name);
    let error = Diagnostic::error(Code::Usage, format!("there is no command `{name}`"));
    fail(match nearest(name, names) {
        Some(other) => error.help(format!("did you mean `{other}`?")),
        None => error.help("`imp --help` lists the commands"),
    })
}

fn fail(error: Diagnostic) -> u8 {
    let code = error.code.exit_code();
    output::messages_as(
        super::arguments::MessageFormat::Human,
        &[error],
        &Sources::default(),
        false,
    );
    code
}
