//! The `imp` program: everything is in the library's [`imp::shell`].

use std::process::ExitCode;

fn main() -> ExitCode {
    imp::shell::main()
}
