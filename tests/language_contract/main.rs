//! What the language promises, from the user's end: a module for each part of it.

#[path = "../common/mod.rs"]
mod common;

mod calculus;
mod contract;
mod limits;
mod meshes;
mod modules;
mod operators;
mod settings;
mod testing;
