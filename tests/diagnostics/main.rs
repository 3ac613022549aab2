//! Errors and warnings as people and programs see them: their pages, their forms, wrong programs
//! and the messages they get; and the guide, whose programs must give none.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/host.rs"]
mod host;

mod explain;
mod forms;
mod guide;
mod inspection;
mod output;
mod wrong_programs;
