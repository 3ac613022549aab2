//! Values as JSON.

use serde_json::{Map, Number, Value as Json};

use super::product;
use super::show::show;
use super::value::Value;
use crate::geometry::Spacing;

/// The value as JSON: numbers with all their digits, NaN and infinities as `"nan"`, `"inf"` and
/// `"-inf"`, intervals as `{"lo", "hi"}`, products as objects with the properties of their
/// summaries.
pub fn json(value: &Value) -> Json {
    match value {
        Value::Number(number) => json_number(*number),
        Value::Bool(value) => Json::Bool(*value),
        Value::Text(text) => Json::String(text.to_string()),
        Value::List(elements) => elements.iter().map(json).collect(),
        Value::Interval(interval) if interval.is_empty() => Json::Null,
        Value::Interval(interval) => {
            let mut ends = Map::new();
            ends.insert("lo".into(), json_number(interval.low));
            ends.insert("hi".into(), json_number(interval.high));
            Json::Object(ends)
        }
        product if product.is_product() => {
            let properties = product::summary(value);
            // In JSON the spacing is one object, with all that is known of it.
            let others = properties.iter();
            let others = others.filter(|(name, _)| !name.starts_with("spacing_"));
            let mut object: Map<String, Json> = others
                .map(|(name, value)| (json_name(name).to_string(), json_property(name, value)))
                .collect();
            if let Value::Samples(set) = value
                && let Some(spacing) = set.spacing()
            {
                object.insert("spacing".into(), json_spacing(spacing));
            }
            Json::Object(object)
        }
        other => Json::String(show(other, None)),
    }
}

/// In a script `points` are the points themselves; a summary says how many there are.
fn json_name(name: &str) -> &str {
    match name {
        "count" => "points",
        other => other,
    }
}

/// Boxes are lists of pairs in summaries, as other programs expect them.
fn json_property(name: &str, value: &Value) -> Json {
    match value {
        Value::List(sides) if name == "bounds" => sides
            .iter()
            .map(|side| match side {
                Value::Interval(side) => {
                    Json::Array(vec![json_number(side.low), json_number(side.high)])
                }
                other => json(other),
            })
            .collect(),
        other => json(other),
    }
}

fn json_spacing(spacing: &Spacing) -> Json {
    let mut object = Map::new();
    object.insert("mean".into(), json_number(spacing.mean));
    object.insert("deviation".into(), json_number(spacing.deviation));
    object.insert("min".into(), json_number(spacing.min));
    object.insert("max".into(), json_number(spacing.max));
    Json::Object(object)
}

/// A number; whole ones that fit are written without a point.
pub fn json_number(number: f64) -> Json {
    if number.is_nan() {
        return Json::String("nan".into());
    }
    if number.is_infinite() {
        return Json::String(if number > 0.0 { "inf" } else { "-inf" }.into());
    }
    // Negative zero has no whole number of its own.
    if number.floor() == number
        && number.abs() < 1e15
        && !(number == 0.0 && number.is_sign_negative())
    {
        return Json::Number(Number::from(number as i64));
    }
    Number::from_f64(number).map_or(Json::Null, Json::Number)
}
