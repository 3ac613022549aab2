//! The settings of a session: numbers, bools and strings that shape the graphs themselves.

use std::sync::Arc;

use indexmap::IndexMap;

use super::list::List;
use super::show::show;
use super::value::{Outcome, Value, failure};
use crate::diagnostic::Code;
use crate::graph::Interval;

/// All settings, in the order of their definitions.
#[derive(Clone, Debug, Default)]
pub struct Settings {
    definitions: IndexMap<Arc<str>, Setting>,
}

/// One `setting`.
#[derive(Clone, Debug)]
pub struct Setting {
    /// Its value in the file, or as set from outside.
    pub value: Value,
    /// What it may be.
    pub range: Option<SettingRange>,
    /// Its doc comment.
    pub documentation: Option<Arc<str>>,
}

/// What a setting may be.
#[derive(Clone, Debug)]
pub enum SettingRange {
    /// A number between two ends, both included.
    Between(Interval),
    /// One of these.
    OneOf(List),
}

impl SettingRange {
    /// As it is written in the language.
    pub fn shown(&self) -> String {
        match self {
            SettingRange::Between(interval) => show(&Value::Interval(*interval), None),
            SettingRange::OneOf(values) => show(&Value::List(values.clone()), None),
        }
    }

    fn contains(&self, value: &Value) -> bool {
        match (self, value) {
            (SettingRange::Between(interval), Value::Number(number)) => {
                (interval.low..=interval.high).contains(number)
            }
            (SettingRange::Between(_), _) => false,
            (SettingRange::OneOf(values), value) => values.iter().any(|one| same(one, value)),
        }
    }
}

impl Settings {
    /// Adds a setting, or gives it another value where the definitions are run again.
    pub fn define(&mut self, name: &Arc<str>, setting: Setting) {
        self.definitions.insert(Arc::clone(name), setting);
    }

    /// Forgets the setting of that name, if there is one.
    pub(super) fn forget(&mut self, name: &str) {
        self.definitions.shift_remove(name);
    }

    /// The setting of that name.
    pub fn get(&self, name: &str) -> Option<&Setting> {
        self.definitions.get(name)
    }

    /// Names and definitions, in order.
    pub fn iter(&self) -> impl Iterator<Item = (&Arc<str>, &Setting)> {
        self.definitions.iter()
    }
}

/// Fails where the value is none that a setting may have: neither number, bool nor string, or
/// outside the range.
pub fn check(name: &str, value: &Value, range: Option<&SettingRange>) -> Outcome<()> {
    if !matches!(value, Value::Number(_) | Value::Bool(_) | Value::Text(_)) {
        let message = format!(
            "a setting is a number, a bool or a string, but this is {}",
            value.kind()
        );
        return Err(failure(Code::WrongKind, message));
    }
    match range {
        Some(range) if !range.contains(value) => {
            let (what, allowed) = (quoted(value), range.shown());
            let message = match range {
                SettingRange::Between(_) => {
                    format!("the setting `{name}` has the value {what}, outside {allowed}")
                }
                SettingRange::OneOf(_) => {
                    format!("the setting `{name}` has the value {what}, which is none of {allowed}")
                }
            };
            Err(failure(Code::OutsideRange, message))
        }
        _ => Ok(()),
    }
}

/// A value as it is written in the language: strings have quotes.
pub fn quoted(value: &Value) -> String {
    match value {
        Value::Text(text) => format!("\"{text}\""),
        other => show(other, None),
    }
}

/// Whether two values are equal numbers, bools or strings.
pub(super) fn same(left: &Value, right: &Value) -> bool {
    match (left, right) {
        (Value::Number(left), Value::Number(right)) => left == right,
        (Value::Bool(left), Value::Bool(right)) => left == right,
        (Value::Text(left), Value::Text(right)) => left == right,
        _ => false,
    }
}

/// Whether two values are of the same kind, so that one may be set in place of the other.
pub(super) fn same_kind(left: &Value, right: &Value) -> bool {
    std::mem::discriminant(left) == std::mem::discriminant(right)
}
