//! The strings that functions understand, for those who complete them.

use super::Builtin;
use crate::picture::View;
use crate::polygonize;
use crate::sample::{Method, Potential};

/// The strings that a function takes for a parameter, if there are only some.
pub fn choices(function: &Builtin, parameter: &str) -> Vec<&'static str> {
    match (function.name, parameter) {
        ("polygonize", "method") => polygonize::Method::TABLE
            .iter()
            .map(|(_, name, _)| *name)
            .collect(),
        ("polygonize", "ambiguity") => polygonize::Ambiguity::NAMES
            .iter()
            .map(|(_, name)| *name)
            .collect(),
        ("polygonize", "split") => vec!["bcc"],
        ("sample", "method") => Method::NAMES.iter().map(|(_, name)| *name).collect(),
        ("sample", "potential") => Potential::NAMES.iter().map(|(_, name)| *name).collect(),
        ("sample", "adapt") => vec!["curvature"],
        ("thin", "keep") => vec!["representative", "barycenter"],
        ("plot", "style") => vec!["shaded", "fill"],
        ("plot", "view") => View::names().collect(),
        _ => Vec::new(),
    }
}
