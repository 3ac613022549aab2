//! Derivatives as functions of the language: exact, and nesting, because their results are
//! graphs again.

use std::rc::Rc;

use super::{Arguments, Builtin, pure};
use crate::diagnostic::Code;
use crate::graph::{Node, NodeId, Op, derive};
use crate::language::arithmetic::{apply, node_of, value_of_node};
use crate::language::field::{FieldValue, derivatives, differentiate, lift, rebuild};
use crate::language::function::{At, FunctionValue};
use crate::language::session::Session;
use crate::language::tracer::{Tracer, first_axis};
use crate::language::value::{Outcome, Value, failure};

pub(super) const TABLE: &[Builtin] = &[
    pure(
        "grad",
        &["f"],
        "The gradient F_x of a field: a function from points to vectors. Of a field with several components, a row for each.",
        |session, arguments| operator(session, arguments, derivatives),
    ),
    pure(
        "jacobian",
        &["f"],
        "The matrix of first derivatives of a field: a row for each component.",
        |session, arguments| {
            operator(session, arguments, |graph, body, coordinates| {
                let rows = derivatives(graph, body, coordinates)?;
                Ok(match body {
                    Value::List(_) => rows,
                    _ => Value::list(vec![rows]),
                })
            })
        },
    ),
    pure(
        "hessian",
        &["f"],
        "The matrix of second derivatives of a field.",
        |session, arguments| operator(session, arguments, hessian_rows),
    ),
    pure(
        "laplacian",
        &["f"],
        "The sum of the unmixed second derivatives of a field.",
        |session, arguments| operator(session, arguments, laplacian),
    ),
    pure(
        "dimension",
        &["f"],
        "The number of coordinates of a field; of a function, that of the field that `as_field` makes of it.",
        |_, arguments| match arguments.value("f") {
            Value::Field(field) => Ok(Value::Number(field.dimension() as f64)),
            Value::Function(function) => Ok(Value::Number(assumed_dimension(
                function.parameter_count(),
            ) as f64)),
            other => Err(arguments.expected("a field", "f", &other)),
        },
    ),
    pure(
        "parameter_count",
        &["f"],
        "How many arguments a function or field takes: a field takes its coordinates.",
        |_, arguments| match arguments.value("f") {
            Value::Field(field) => Ok(Value::Number(field.dimension() as f64)),
            Value::Function(function) => Ok(Value::Number(function.parameter_count() as f64)),
            other => Err(arguments.expected("a function or a field", "f", &other)),
        },
    ),
    pure(
        "as_field",
        &["f", "dimension = 3"],
        "The field of a function of a point, or of as many coordinates as there are dimensions; a number is the field that has this value everywhere. A field stays as it is.",
        as_field,
    ),
    pure(
        "diff",
        &["f", "variable"],
        "The derivative of a field, or of an expression inside one, by a parameter or coordinate; by a list of them, the list of derivatives: entries of F_q.",
        diff,
    ),
];

/// An operator on a field; on a function, it waits for the point (see
/// [`FunctionValue::Derivative`]).
pub(super) fn operator(
    session: &mut Session,
    arguments: &Arguments,
    rule: impl Fn(&mut Tracer, &Value, &[NodeId]) -> Outcome<Value>,
) -> Outcome<Value> {
    let subject = arguments.first_name();
    match arguments.value(subject) {
        Value::Field(field) => differentiate(&mut session.graph, &field, rule),
        Value::Function(function) => Ok(waiting(arguments, function, &[])),
        other => Err(arguments.expected("a field or a function", subject, &other)),
    }
}

/// In how many dimensions a function with so many parameters lives: one for each coordinate, or
/// one for a point in space.
fn assumed_dimension(parameters: usize) -> usize {
    if parameters == 2 { 2 } else { 3 }
}

fn as_field(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let given = arguments.count(session, "dimension")?;
    let asked = given.unwrap_or(3) as usize;
    if !(1..=3).contains(&asked) {
        let message = format!("fields live in 1, 2 or 3 dimensions, not in {asked}");
        return Err(arguments.bad("dimension", message));
    }
    let place = arguments.place("f");
    let field = match arguments.value("f") {
        Value::Field(field) => field,
        Value::Function(function) => {
            let parameters = function.parameter_count();
            let dimension = match given {
                None => assumed_dimension(parameters),
                Some(_) => asked,
            };
            let as_point = parameters == 1 && dimension > 1;
            session.function_as_field(&function, dimension, as_point, place)?
        }
        number @ (Value::Number(_) | Value::Symbol(_)) => {
            FieldValue::new(asked, session.graph.level, number, None)?
        }
        other => return Err(arguments.expected("a field or a function", "f", &other)),
    };
    if given.is_some() && field.dimension() != asked {
        let message = format!(
            "expected a field in R{asked}, but this one is in R{}",
            field.dimension()
        );
        return Err(failure(Code::WrongDimension, message).at(place, "this field"));
    }
    Ok(Value::Field(field))
}

/// An operator applied to a function, which waits for the point.
fn waiting(arguments: &Arguments, function: FunctionValue, others: &[&str]) -> Value {
    let others = others.iter().filter_map(|name| arguments.given(name));
    Value::Function(FunctionValue::Derivative {
        operator: arguments.builtin(),
        function: Rc::new(function),
        others: others.cloned().collect(),
    })
}

fn laplacian(graph: &mut Tracer, body: &Value, coordinates: &[NodeId]) -> Outcome<Value> {
    if let Value::List(components) = body {
        return components
            .iter()
            .map(|component| laplacian(graph, component, coordinates))
            .collect::<Outcome<_>>()
            .map(Value::list);
    }
    let root = node_of(graph, body)?;
    let mut total = Value::Number(0.0);
    for (axis, row) in derive::hessian(graph, root, coordinates).iter().enumerate() {
        let second = value_of_node(graph, row[axis]);
        total = apply(graph, Op::Add, &[total, second])?;
    }
    Ok(total)
}

/// The matrix of second derivatives.
pub(super) fn hessian_rows(
    graph: &mut Tracer,
    body: &Value,
    coordinates: &[NodeId],
) -> Outcome<Value> {
    let root = node_of(graph, body)?;
    let rows = derive::hessian(graph, root, coordinates);
    Ok(Value::list(
        rows.into_iter()
            .map(|row| {
                Value::list(
                    row.into_iter()
                        .map(|node| value_of_node(graph, node))
                        .collect(),
                )
            })
            .collect(),
    ))
}

fn diff(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let variable = arguments.value("variable");
    let mut variables = Vec::new();
    collect_variables(&session.graph, &variable, &mut variables)
        .at(arguments.place("variable"), "not a variable")?;
    match arguments.value("f") {
        // A coordinate stands for the field's own one: diff(f, p.x) is f's derivative by x,
        // wherever p is the point.
        field @ Value::Field(_) => lift(&mut session.graph, &[field], &mut |graph, bodies| {
            let own = own_coordinates(graph, &variables);
            by_variables(graph, &bodies[0], &variable, &own)
        }),
        Value::Function(function) => Ok(waiting(arguments, function, &["variable"])),
        scalar @ (Value::Number(_) | Value::Symbol(_) | Value::List(_)) => {
            by_variables(&mut session.graph, &scalar, &variable, &variables)
        }
        other => Err(arguments.expected("a field, a function or an expression", "f", &other)),
    }
}

/// The variables, with coordinates of any level replaced by those of the present one.
fn own_coordinates(graph: &mut Tracer, variables: &[NodeId]) -> Vec<NodeId> {
    let first = first_axis(graph.level);
    variables
        .iter()
        .map(|&variable| match graph.node(variable) {
            Node::Coordinate(axis) => graph.coordinate(first + usize::from(axis) % 3),
            _ => variable,
        })
        .collect()
}

/// The derivatives of `body` in the shape of `variable`: `variables` are its leaves.
fn by_variables(
    graph: &mut Tracer,
    body: &Value,
    variable: &Value,
    variables: &[NodeId],
) -> Outcome<Value> {
    if let Value::List(components) = body {
        return components
            .iter()
            .map(|component| by_variables(graph, component, variable, variables))
            .collect::<Outcome<_>>()
            .map(Value::list);
    }
    let root = node_of(graph, body)?;
    let partials = derive::reverse(graph, root, variables);
    let mut partials = partials.into_iter().map(|node| value_of_node(graph, node));
    Ok(rebuild(variable, &mut partials))
}

fn collect_variables(graph: &Tracer, variable: &Value, variables: &mut Vec<NodeId>) -> Outcome<()> {
    match variable {
        Value::List(elements) => elements
            .iter()
            .try_for_each(|element| collect_variables(graph, element, variables)),
        Value::Symbol(node)
            if matches!(graph.node(*node), Node::Coordinate(_) | Node::Parameter(_)) =>
        {
            variables.push(*node);
            Ok(())
        }
        other => {
            let mut error = failure(
                Code::NotAVariable,
                format!(
                    "a derivative is taken by a parameter or a coordinate, but this is {}",
                    match other {
                        Value::Symbol(_) => "an expression of them",
                        other => other.kind(),
                    }
                ),
            );
            error.help =
                Some("write the parameter itself, as in `diff(f, r)` or `diff(f, c[0].x)`".into());
            Err(error)
        }
    }
}
