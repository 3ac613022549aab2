//! The parameters of a session: names, shapes, ranges and the default q.

use std::sync::Arc;

use indexmap::IndexMap;

use super::value::{Outcome, Value, failure};
use crate::diagnostic::Code;
use crate::diagnostic::suggest;

/// All parameters, in the order of their definitions.
#[derive(Clone, Debug, Default)]
pub struct Parameters {
    definitions: IndexMap<Arc<str>, Parameter>,
    values: Vec<f64>,
}

/// One `param`.
#[derive(Clone, Debug)]
pub struct Parameter {
    /// The place of its first component in q.
    pub first: usize,
    /// A number, or nested lists of numbers: its value in the file, or as set from outside.
    pub value: Value,
    /// Where every component must lie.
    pub range: Option<(f64, f64)>,
    /// Its doc comment.
    pub documentation: Option<Arc<str>>,
}

impl Parameters {
    /// The present q: one number for each component of each parameter.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Adds a parameter whose value has been checked with [`components`] and [`check_range`];
    /// one that is there already, with as many components, gets another value.
    pub fn define(&mut self, name: &Arc<str>, parameter: Parameter, components: Vec<f64>) {
        let end = parameter.first + components.len();
        if end > self.values.len() {
            self.values.resize(end, 0.0);
        }
        self.values[parameter.first..end].copy_from_slice(&components);
        self.definitions.insert(Arc::clone(name), parameter);
    }

    /// Forgets the parameter of that name, if there is one. Its places in q stay.
    pub(super) fn forget(&mut self, name: &str) {
        self.definitions.shift_remove(name);
    }

    /// The parameter of that name.
    pub fn get(&self, name: &str) -> Outcome<&Parameter> {
        self.definitions.get(name).ok_or_else(|| {
            let mut error = failure(
                Code::UnknownParameter,
                format!("there is no parameter `{name}`"),
            );
            let names = self.definitions.keys().map(|name| &**name);
            error.help = suggest::nearest(name, names)
                .map(|near| format!("did you mean `{near}`?"))
                .or_else(|| Some(self.known()));
            error
        })
    }

    /// Names and definitions, in order.
    pub fn iter(&self) -> impl Iterator<Item = (&Arc<str>, &Parameter)> {
        self.definitions.iter()
    }

    /// The name of a component of q, `c[0][1]`.
    pub fn component_name(&self, index: usize) -> String {
        for (name, parameter) in &self.definitions {
            let mut paths = Vec::new();
            component_paths(&parameter.value, name.to_string(), &mut paths);
            if let Some(path) = index
                .checked_sub(parameter.first)
                .and_then(|place| paths.get(place))
            {
                return path.clone();
            }
        }
        format!("q{index}")
    }

    fn known(&self) -> String {
        if self.definitions.is_empty() {
            return "the file has no parameters; define one with `param name = value`".into();
        }
        let names: Vec<&str> = self.definitions.keys().map(|name| &**name).collect();
        format!("the parameters are {}", names.join(", "))
    }
}

/// The numbers in a parameter's value, in order.
///
/// Fails where it is neither a number nor a list of such values.
pub fn components(value: &Value) -> Outcome<Vec<f64>> {
    let mut numbers = Vec::new();
    let mut pending = vec![value];
    while let Some(value) = pending.pop() {
        match value {
            Value::Number(number) => numbers.push(*number),
            Value::List(elements) => pending.extend(elements.iter().rev()),
            other => {
                let message = format!(
                    "a parameter is a number, a vector or a list of these, but this is {}",
                    other.kind()
                );
                return Err(failure(Code::WrongKind, message));
            }
        }
    }
    Ok(numbers)
}

/// Fails where a component lies outside the range.
pub fn check_range(name: &str, components: &[f64], range: Option<(f64, f64)>) -> Outcome<()> {
    let Some((low, high)) = range else {
        return Ok(());
    };
    match components
        .iter()
        .find(|value| !(low..=high).contains(*value))
    {
        None => Ok(()),
        Some(value) => {
            let message =
                format!("the parameter `{name}` has the value {value}, outside {low}..{high}");
            Err(failure(Code::OutsideRange, message))
        }
    }
}

/// Whether two values have the same nesting of lists.
pub fn same_shape(left: &Value, right: &Value) -> bool {
    match (left, right) {
        (Value::List(left), Value::List(right)) => {
            left.len() == right.len()
                && left
                    .iter()
                    .zip(right.iter())
                    .all(|(left, right)| same_shape(left, right))
        }
        (Value::List(_), _) | (_, Value::List(_)) => false,
        _ => true,
    }
}

/// A value of the given shape whose numbers are made by `leaf`, in order.
pub fn fill(shape: &Value, leaf: &mut impl FnMut() -> Value) -> Value {
    match shape {
        Value::List(elements) => {
            Value::list(elements.iter().map(|element| fill(element, leaf)).collect())
        }
        _ => leaf(),
    }
}

fn component_paths(value: &Value, prefix: String, paths: &mut Vec<String>) {
    match value {
        Value::List(elements) => {
            for (index, element) in elements.iter().enumerate() {
                component_paths(element, format!("{prefix}[{index}]"), paths);
            }
        }
        _ => paths.push(prefix),
    }
}
