//! The language server, asked by a client that speaks the protocol over pipes.

mod addresses;
mod answers;
mod bad_input;
mod client;
mod edits;
mod renames;
