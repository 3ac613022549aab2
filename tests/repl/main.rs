//! The session of `imp repl`: at a terminal, which is a pseudo-terminal here, and through a pipe.

#[path = "../common/mod.rs"]
mod common;

mod commands;
mod definitions;
mod editing;
mod piped;
mod recorded;
mod rough;
mod terminal;
