//! Lists.

use super::{Arguments, Builtin, pure};
use crate::diagnostic::Code;
use crate::language::function::{Argument, function_of};
use crate::language::limits::exceeded;
use crate::language::product;
use crate::language::session::Session;
use crate::language::value::{Outcome, Value, failure};

pub(super) const TABLE: &[Builtin] = &[
    pure(
        "len",
        &["list"],
        "The number of elements of a list, points of samples, pieces of a curve set, or characters of a string.",
        |_, arguments| {
            let value = arguments.value("list");
            let length = match &value {
                Value::List(elements) => elements.len(),
                Value::Text(text) => text.chars().count(),
                other => product::length(other)
                    .ok_or_else(|| arguments.expected("a list", "list", other))?,
            };
            Ok(Value::Number(length as f64))
        },
    ),
    pure(
        "range",
        &["first", "end =", "step = 1"],
        "range(n) is the list 0, 1, … n-1; range(a, b) is a, a+1, … below b; range(a, b, s) goes in steps of s.",
        range,
    ),
    pure(
        "zip",
        &["lists…"],
        "The list of the lists' first elements, second elements, and so on.",
        zip,
    ),
    pure(
        "map",
        &["list", "f"],
        "The list of f's values on the elements.",
        |session, arguments| {
            let list = arguments.list("list")?;
            let place = arguments.place("list");
            let function = arguments.value("f");
            list.iter()
                .map(|element| {
                    let argument = Argument {
                        name: None,
                        value: element.clone(),
                        span: place,
                    };
                    let value = session.call_value(
                        &function,
                        vec![argument],
                        arguments.place("f"),
                        arguments.span,
                    )?;
                    match value {
                        Value::Nothing => {
                            Err(arguments.expected("a function that gives a value", "f", &value))
                        }
                        value => Ok(value),
                    }
                })
                .collect::<Outcome<_>>()
                .map(Value::list)
        },
    ),
    pure(
        "filter",
        &["list", "f"],
        "The elements for which f holds.",
        filter,
    ),
    pure(
        "concat",
        &["lists…"],
        "The elements of all the lists, one after the other.",
        |_, arguments| {
            let mut all = Vec::new();
            for argument in arguments.rest() {
                match &argument.value {
                    Value::List(elements) => all.extend(elements.iter().cloned()),
                    other => return Err(arguments.expected("lists", "lists…", other)),
                }
            }
            Ok(Value::list(all))
        },
    ),
    pure(
        "append",
        &["list", "value"],
        "The list with one more element at its end.",
        |_, arguments| {
            let mut elements = arguments.list("list")?.to_vec();
            elements.push(arguments.value("value"));
            Ok(Value::list(elements))
        },
    ),
    pure(
        "reverse",
        &["list"],
        "The elements from the last to the first.",
        |_, arguments| {
            let list = arguments.list("list")?;
            Ok(Value::list(list.iter().rev().cloned().collect()))
        },
    ),
    pure(
        "sort",
        &["list"],
        "The numbers of a list in ascending order.",
        |session, arguments| {
            let list = Value::List(arguments.list("list")?);
            let plain = session.plain(list, arguments.place("list"))?;
            let Value::List(elements) = plain else {
                return Ok(plain);
            };
            let mut numbers = elements
                .iter()
                .map(|element| match element {
                    Value::Number(number) => Ok(*number),
                    other => Err(arguments.expected("a list of numbers", "list", other)),
                })
                .collect::<Outcome<Vec<f64>>>()?;
            numbers.sort_by(f64::total_cmp);
            Ok(Value::numbers(numbers))
        },
    ),
    pure(
        "transpose",
        &["matrix"],
        "The matrix whose rows are the columns of the given one.",
        |_, arguments| {
            let rows = arguments.list("matrix")?;
            transpose(&rows, arguments, "matrix")
        },
    ),
];

fn range(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let first = arguments.number(session, "first")?.unwrap_or(0.0);
    let (start, end) = match arguments.number(session, "end")? {
        Some(end) => (first, end),
        None => (0.0, first),
    };
    let step = arguments.number(session, "step")?.unwrap_or(1.0);
    if step == 0.0 || !step.is_finite() {
        return Err(arguments.bad("step", format!("a step of {step} never arrives")));
    }
    if !start.is_finite() || !end.is_finite() {
        return Err(arguments.bad("first", "a range needs finite ends".into()));
    }
    let count = ((end - start) / step).ceil().max(0.0);
    if count > session.limits.elements as f64 {
        return exceeded(
            Code::LengthLimit,
            "the list is too long",
            "elements",
            session.limits.elements,
        );
    }
    Ok(Value::numbers(
        (0..count as u64).map(|index| start + index as f64 * step),
    ))
}

fn zip(_: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let lists: Vec<Value> = arguments
        .rest()
        .iter()
        .map(|argument| argument.value.clone())
        .collect();
    transpose(&lists, arguments, "lists…")
}

fn transpose(rows: &[Value], arguments: &Arguments, name: &str) -> Outcome<Value> {
    let mut lists = Vec::with_capacity(rows.len());
    for row in rows {
        match row {
            Value::List(elements) => lists.push(elements),
            other => return Err(arguments.expected("lists", name, other)),
        }
    }
    let length = lists.first().map_or(0, |list| list.len());
    if let Some(other) = lists.iter().find(|list| list.len() != length) {
        return Err(failure(
            Code::LengthsDiffer,
            format!("lists of different lengths, {length} and {}", other.len()),
        ));
    }
    Ok(Value::list(
        (0..length)
            .map(|index| Value::list(lists.iter().map(|list| list[index].clone()).collect()))
            .collect(),
    ))
}

fn filter(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let list = arguments.list("list")?;
    let function = arguments.value("f");
    function_of(&function)?;
    let mut kept = Vec::new();
    for element in list.iter() {
        let argument = Argument {
            name: None,
            value: element.clone(),
            span: arguments.place("list"),
        };
        let holds = session.call_value(
            &function,
            vec![argument],
            arguments.place("f"),
            arguments.span,
        )?;
        match session.plain(holds, arguments.place("f"))? {
            Value::Bool(true) => kept.push(element.clone()),
            Value::Bool(false) => {}
            Value::Unknown => return Ok(Value::Unknown),
            other => return Err(arguments.expected("a condition", "f", &other)),
        }
    }
    Ok(Value::list(kept))
}
