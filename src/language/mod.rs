//! The language: from tree to values, graphs and what a script does.
