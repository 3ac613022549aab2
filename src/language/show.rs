//! Values as text: what `print` and `{…}` show.

use super::field::FieldValue;
use super::function::FunctionValue;
use super::product;
use super::value::Value;

/// The value as a person reads it. Numbers have the fewest digits that give the same number
/// again, or `precision` digits after the point.
pub fn show(value: &Value, precision: Option<usize>) -> String {
    match value {
        Value::Number(number) => show_number(*number, precision),
        Value::Bool(value) => value.to_string(),
        Value::Text(text) => text.to_string(),
        Value::Interval(interval) if interval.is_empty() => "the empty interval".into(),
        Value::Interval(interval) => format!(
            "{}..{}",
            show_number(interval.low, precision),
            show_number(interval.high, precision)
        ),
        Value::List(elements) => {
            let shown: Vec<String> = elements
                .iter()
                .map(|element| match element {
                    Value::Text(text) => format!("\"{text}\""),
                    other => show(other, precision),
                })
                .collect();
            format!("[{}]", shown.join(", "))
        }
        Value::Function(function) => show_function(function),
        Value::Field(field) => show_field(field),
        Value::Samples(_)
        | Value::Mesh(_)
        | Value::Curves(_)
        | Value::Image(_)
        | Value::Simulation(_)
        | Value::Fit(_)
        | Value::Fall(_)
        | Value::Solid(_) => show_product(value, precision),
        Value::Report(set) if set.bricks.is_some() => show_product(value, precision),
        Value::Report(_) => table(&product::summary(value), precision),
        Value::Module(module) => format!("the module {}", module.name),
        Value::Symbol(_) | Value::Condition(_) | Value::Nothing | Value::Unknown => {
            value.kind().to_string()
        }
    }
}

/// A number: `1`, `0.1`, `1e-20`, `inf`, `nan`.
pub fn show_number(number: f64, precision: Option<usize>) -> String {
    if number.is_nan() {
        return "nan".into();
    }
    if number.is_infinite() {
        return if number > 0.0 { "inf" } else { "-inf" }.into();
    }
    match precision {
        Some(digits) => format!("{number:.digits$}"),
        None if number != 0.0 && !(1e-5..1e17).contains(&number.abs()) => format!("{number:e}"),
        None => format!("{number}"),
    }
}

fn show_function(function: &FunctionValue) -> String {
    match function {
        FunctionValue::Builtin(builtin) => format!("the function {}", builtin.signature()),
        FunctionValue::Closure(closure) => match &closure.name {
            Some(name) => format!("the function {name}"),
            None => "a function".into(),
        },
        FunctionValue::Derivative {
            operator, function, ..
        } => {
            format!("{}({})", operator.name, show_function(function))
        }
        FunctionValue::Pointwise(_) => "a function".into(),
    }
}

fn show_field(field: &FieldValue) -> String {
    let components = match field.components() {
        1 => String::new(),
        components => format!(", {components} components"),
    };
    match field.name() {
        Some(name) => format!("the field {name} in R{}{components}", field.dimension()),
        None => format!("a field in R{}{components}", field.dimension()),
    }
}

fn show_product(value: &Value, precision: Option<usize>) -> String {
    let properties: Vec<String> = product::summary(value)
        .iter()
        .map(|(name, value)| format!("{name} {}", show(value, precision)))
        .collect();
    let kind = value
        .kind()
        .trim_start_matches("a ")
        .trim_start_matches("an ");
    format!("{kind}: {}", properties.join(", "))
}

/// Names and values, one pair on a line.
pub fn table(rows: &[(&'static str, Value)], precision: Option<usize>) -> String {
    let width = rows.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    let lines: Vec<String> = rows
        .iter()
        .map(|(name, value)| format!("{name:width$}  {}", show(value, precision)))
        .collect();
    lines.join("\n")
}
