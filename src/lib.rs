//! Imp: a small language for implicit geometry, and a fast, trustworthy program for it.
//!
//! The folders are the way through, in reading order: text becomes tokens and a tree
//! ([`syntax`]), the tree is traced into one expression graph ([`language`], [`graph`]), the
//! graph is differentiated and compiled to machine code ([`engine`]), samplers and polygonizers
//! evaluate that code ([`sample`], [`polygonize`]) and what they make ([`geometry`]) goes to
//! files ([`mod@file`]). [`shell`] is the command line on top. `ARCHITECTURE.md` says who may use
//! whom.

// Under the name that the programs in `tests/` know, so that unit tests can share their modules.
#[cfg(test)]
extern crate self as imp;

pub mod diagnostic;
pub mod syntax;

pub mod formatter;

pub mod math;

pub mod graph;

pub mod engine;

pub mod geometry;

pub mod continuation;

pub mod sample;

pub mod motion;

pub mod elastic;

pub mod polygonize;

pub mod inspect;

pub mod picture;

pub mod file;

pub mod library;

pub mod language;

pub mod assist;

pub mod shell;
