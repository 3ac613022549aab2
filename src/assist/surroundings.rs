//! Names with what is known of them, and what lies around a text: the names of a session, the
//! folder in which its files are, texts that are newer than their files.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::complete::Kind;
use crate::language::function::FunctionValue;
use crate::language::product;
use crate::language::show::show;
use crate::language::value::Value;

/// The longest value that is shown beside a name, in characters.
const LONGEST_VALUE: usize = 60;

/// What a text stands in.
#[derive(Clone, Debug, Default)]
pub struct Surroundings {
    /// Names that are bound outside of the text, as in a session that has run other texts.
    pub names: Vec<Known>,
    /// Where relative paths start.
    pub directory: PathBuf,
    /// Texts that are newer than the files at these paths.
    pub texts: FxHashMap<PathBuf, Arc<str>>,
}

impl Surroundings {
    /// The text of a file; nothing if it cannot be read or is larger than a megabyte.
    pub fn text(&self, path: &Path) -> Option<Arc<str>> {
        const LARGEST: u64 = 1_000_000;
        if let Some(text) = self.texts.get(path) {
            return Some(Arc::clone(text));
        }
        let data = std::fs::metadata(path).ok()?;
        if !data.is_file() || data.len() > LARGEST {
            return None;
        }
        std::fs::read_to_string(path).ok().map(Arc::from)
    }
}

/// A name and what is known of it.
#[derive(Clone, Debug)]
pub struct Known {
    /// The name.
    pub name: Arc<str>,
    /// What it is.
    pub kind: Kind,
    /// In a few words: a signature, or a kind and a value.
    pub detail: String,
    /// What its author says of it.
    pub documentation: Option<Arc<str>>,
    /// If it is a function: its parameters, with their defaults.
    pub parameters: Vec<String>,
    /// What can be written behind `name.`; nothing where that is not known.
    pub members: Vec<Known>,
}

impl Known {
    /// A name of which only its kind and a few words are known.
    pub fn new(name: impl Into<Arc<str>>, kind: Kind, detail: impl Into<String>) -> Known {
        Known {
            name: name.into(),
            kind,
            detail: detail.into(),
            documentation: None,
            parameters: Vec::new(),
            members: Vec::new(),
        }
    }

    /// A name that is bound to this value.
    pub fn with_value(name: &Arc<str>, value: &Value) -> Known {
        let (kind, detail) = match value {
            Value::Function(function) => (Kind::Function, function_signature(function)),
            Value::Field(field) => {
                let domain = field.domain().map(product::sides);
                let over = domain.map(|sides| format!(" over {}", show(&sides, None)));
                let dimension = field.dimension();
                let over = over.unwrap_or_default();
                (Kind::Field, format!("a field in R{dimension}{over}"))
            }
            Value::Module(_) => (Kind::Module, value.kind().to_owned()),
            other => (Kind::Variable, kind_and_value(other)),
        };
        let mut known = Known::new(Arc::clone(name), kind, detail);
        if let Value::Function(_) = value {
            known.parameters = parameters(&known.detail);
        }
        let properties = product::property_names(value).into_iter();
        known.members = properties
            .map(|property| Known::new(property, Kind::Property, value.kind()))
            .collect();
        known
    }
}

/// What a value is, and what it is equal to if that is short.
pub fn kind_and_value(value: &Value) -> String {
    let is_plain = matches!(
        value,
        Value::Number(_) | Value::Bool(_) | Value::Text(_) | Value::Interval(_) | Value::List(_)
    );
    let is_long = matches!(value, Value::List(list) if list.leaves() > LONGEST_VALUE as u64)
        || matches!(value, Value::Text(text) if text.len() > 4 * LONGEST_VALUE);
    if !is_plain || is_long {
        return value.kind().to_owned();
    }
    let shown = show(value, None);
    match shown.chars().count() <= LONGEST_VALUE && !shown.contains(char::is_control) {
        true => format!("{} = {shown}", value.kind()),
        false => value.kind().to_owned(),
    }
}

fn function_signature(function: &FunctionValue) -> String {
    match function {
        FunctionValue::Closure(closure) => closure.signature(),
        FunctionValue::Builtin(builtin) => builtin.signature(),
        other => other.name().to_owned(),
    }
}

/// The parameters in a signature `name(a, b = [1, 2], rest..)`, with their defaults.
pub(super) fn parameters(signature: &str) -> Vec<String> {
    parameter_ranges(signature)
        .into_iter()
        .map(|range| signature[range].to_owned())
        .collect()
}

/// Where the parameters in a signature stand.
pub fn parameter_ranges(signature: &str) -> Vec<std::ops::Range<usize>> {
    let mut ranges = Vec::new();
    let Some(open) = signature.find('(') else {
        return ranges;
    };
    let mut depth = 0;
    let mut in_text = false;
    let mut start = open + 1;
    for (place, letter) in signature[open..].char_indices() {
        let place = open + place;
        match letter {
            '"' => in_text = !in_text,
            _ if in_text => {}
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth -= 1,
            _ => {}
        }
        if !in_text && (depth == 0 || (depth == 1 && letter == ',')) {
            let part = &signature[start..place];
            let lead = part.len() - part.trim_start().len();
            if !part.trim().is_empty() {
                ranges.push(start + lead..start + lead + part.trim().len());
            }
            start = place + 1;
        }
        if depth == 0 {
            break;
        }
    }
    ranges
}

/// The name of a parameter that is written with its default or dots.
pub(super) fn parameter_name(parameter: &str) -> &str {
    let end = parameter.find(['=', '.', '…', ' ']);
    parameter[..end.unwrap_or(parameter.len())].trim()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_are_split_at_their_commas() {
        let found = parameters("f(a, b = [1, 2], c = \",)\", rest.., last = g(1, 2)) = a");
        assert_eq!(
            found,
            ["a", "b = [1, 2]", "c = \",)\"", "rest..", "last = g(1, 2)"]
        );
        let names: Vec<&str> = found.iter().map(|one| parameter_name(one)).collect();
        assert_eq!(names, ["a", "b", "c", "rest", "last"]);
        assert!(parameters("pi").is_empty());
        assert!(parameters("f()").is_empty());
        assert_eq!(parameters("f(a, b"), ["a"]);
    }
}
