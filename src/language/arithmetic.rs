//! Operations on values: elementwise on lists, pointwise on fields, with guaranteed enclosures
//! on intervals, traced into the graph on symbols, and computed on numbers. All by the one table
//! of operations.

use super::field;
use super::tracer::Tracer;
use super::value::{Condition, Outcome, Value, failure, wrong_kind};
use crate::diagnostic::{Code, Diagnostic};
use crate::graph::interval::Enclosure;
use crate::graph::{Interval, NodeId, Op};
use crate::syntax::tree::ComparisonOperator;

/// Applies an operation of the table to values.
///
/// A number, symbol or interval spreads over a list; lists must have equal lengths.
pub fn apply(graph: &mut Tracer, op: Op, operands: &[Value]) -> Outcome<Value> {
    elementwise(graph, operands, &mut |graph, scalars| {
        apply_to_scalars(graph, op, scalars)
    })
}

/// Applies `scalar_rule` to corresponding scalars of the operands, through fields and lists.
pub fn elementwise(
    graph: &mut Tracer,
    operands: &[Value],
    scalar_rule: &mut dyn FnMut(&mut Tracer, &[Value]) -> Outcome<Value>,
) -> Outcome<Value> {
    if operands.iter().any(|value| matches!(value, Value::Unknown)) {
        return Ok(Value::Unknown);
    }
    if operands
        .iter()
        .any(|value| matches!(value, Value::Field(_)))
    {
        return field::lift(graph, operands, &mut |graph, bodies| {
            elementwise(graph, bodies, scalar_rule)
        });
    }
    let Some(length) = common_length(operands)? else {
        return scalar_rule(graph, operands);
    };
    let mut elements = Vec::with_capacity(length);
    let mut scalars = Vec::with_capacity(operands.len());
    for index in 0..length {
        scalars.clear();
        scalars.extend(operands.iter().map(|operand| match operand {
            Value::List(list) => list[index].clone(),
            scalar => scalar.clone(),
        }));
        elements.push(elementwise(graph, &scalars, scalar_rule)?);
    }
    Ok(Value::list(elements))
}

/// The length of the lists among the operands; `None` if there are none.
fn common_length(operands: &[Value]) -> Outcome<Option<usize>> {
    let mut common = None;
    for operand in operands {
        if let Value::List(list) = operand {
            match common {
                Some(length) if length != list.len() => {
                    let message =
                        format!("lists of different lengths, {length} and {}", list.len());
                    return Err(failure(Code::LengthsDiffer, message));
                }
                _ => common = Some(list.len()),
            }
        }
    }
    Ok(common)
}

fn apply_to_scalars(graph: &mut Tracer, op: Op, scalars: &[Value]) -> Outcome<Value> {
    if let Some(odd) = scalars.iter().find(|value| {
        !matches!(
            value,
            Value::Number(_) | Value::Symbol(_) | Value::Interval(_)
        )
    }) {
        return Err(wrong_kind("a number", odd));
    }
    if scalars
        .iter()
        .any(|value| matches!(value, Value::Interval(_)))
    {
        let intervals = scalars
            .iter()
            .map(interval_of)
            .collect::<Outcome<Vec<_>>>()?;
        return Ok(Value::Interval(enclose(op, &intervals)));
    }
    if scalars
        .iter()
        .any(|value| matches!(value, Value::Symbol(_)))
    {
        let nodes: Vec<NodeId> = scalars
            .iter()
            .map(|value| node_of(graph, value))
            .collect::<Outcome<_>>()?;
        let node = graph.apply(op, &nodes);
        return Ok(value_of_node(graph, node));
    }
    let numbers: Vec<f64> = scalars.iter().map(number_of).collect::<Outcome<_>>()?;
    Ok(Value::Number(evaluate(op, &numbers)))
}

/// The result of an operation on numbers.
fn evaluate(op: Op, numbers: &[f64]) -> f64 {
    let mut operands = [0.0; 3];
    for (operand, number) in operands.iter_mut().zip(numbers) {
        *operand = *number;
    }
    op.value(operands)
}

/// The range of an operation on intervals.
fn enclose(op: Op, intervals: &[Interval]) -> Interval {
    let operands: Vec<Enclosure> = intervals
        .iter()
        .map(|interval| Enclosure::of_interval(*interval))
        .collect();
    (op.operation().interval)(&operands).range
}

/// A number or interval as an interval.
pub fn interval_of(value: &Value) -> Outcome<Interval> {
    match value {
        Value::Number(number) => Ok(Interval::point(*number)),
        Value::Interval(interval) => Ok(*interval),
        other => Err(wrong_kind("a number or an interval", other)),
    }
}

/// A number or symbol as a node.
pub fn node_of(graph: &mut Tracer, value: &Value) -> Outcome<NodeId> {
    match value {
        Value::Number(number) => Ok(graph.constant(*number)),
        Value::Symbol(node) => Ok(*node),
        other => Err(wrong_kind("a number", other)),
    }
}

/// A plain number.
pub fn number_of(value: &Value) -> Outcome<f64> {
    match value {
        Value::Number(number) => Ok(*number),
        other => Err(wrong_kind("a number", other)),
    }
}

/// A node as a value: constants become plain numbers again.
pub fn value_of_node(graph: &Tracer, node: NodeId) -> Value {
    match graph.constant_value(node) {
        Some(number) => Value::Number(number),
        None => Value::Symbol(node),
    }
}

/// `left operator right`: a bool, or a condition where symbols are involved.
pub fn compare(
    graph: &mut Tracer,
    operator: ComparisonOperator,
    left: &Value,
    right: &Value,
) -> Outcome<Value> {
    use ComparisonOperator::{Equal, NotEqual};
    match (left, right) {
        (Value::Unknown, _) | (_, Value::Unknown) => Ok(Value::Unknown),
        (Value::Field(_), _) | (_, Value::Field(_)) => field::lift(
            graph,
            &[left.clone(), right.clone()],
            &mut |graph, bodies| {
                let condition = compare(graph, operator, &bodies[0], &bodies[1])?;
                solid_of(graph, &condition)
            },
        ),
        (Value::Number(left), Value::Number(right)) => {
            Ok(Value::Bool(compare_numbers(operator, *left, *right)))
        }
        (Value::Symbol(_) | Value::Number(_), Value::Symbol(_) | Value::Number(_)) => {
            compare_symbols(graph, operator, left, right)
        }
        (Value::Interval(left), Value::Interval(right)) if matches!(operator, Equal | NotEqual) => {
            Ok(Value::Bool((left == right) == (operator == Equal)))
        }
        (Value::Interval(_) | Value::Number(_), Value::Interval(_) | Value::Number(_)) => {
            compare_intervals(operator, interval_of(left)?, interval_of(right)?)
        }
        _ if matches!(operator, Equal | NotEqual) => {
            let equal = plainly_equal(left, right)?;
            Ok(Value::Bool(equal == (operator == Equal)))
        }
        (Value::Number(_) | Value::Symbol(_) | Value::Interval(_), other) => {
            Err(wrong_kind("a number to compare", other))
        }
        (other, _) => Err(wrong_kind("a number to compare", other)),
    }
}

fn compare_numbers(operator: ComparisonOperator, left: f64, right: f64) -> bool {
    match operator {
        ComparisonOperator::Equal => left == right,
        ComparisonOperator::NotEqual => left != right,
        ComparisonOperator::Less => left < right,
        ComparisonOperator::LessEqual => left <= right,
        ComparisonOperator::Greater => left > right,
        ComparisonOperator::GreaterEqual => left >= right,
    }
}

fn compare_symbols(
    graph: &mut Tracer,
    operator: ComparisonOperator,
    left: &Value,
    right: &Value,
) -> Outcome<Value> {
    let (left, right) = (node_of(graph, left)?, node_of(graph, right)?);
    let one = graph.constant(1.0);
    let truth = match operator {
        ComparisonOperator::Equal => graph.apply(Op::Equal, &[left, right]),
        ComparisonOperator::NotEqual => {
            let equal = graph.apply(Op::Equal, &[left, right]);
            graph.apply(Op::Subtract, &[one, equal])
        }
        ComparisonOperator::Less => graph.apply(Op::Less, &[left, right]),
        ComparisonOperator::LessEqual => graph.apply(Op::LessEqual, &[left, right]),
        ComparisonOperator::Greater => graph.apply(Op::Less, &[right, left]),
        ComparisonOperator::GreaterEqual => graph.apply(Op::LessEqual, &[right, left]),
    };
    let solid = match operator {
        ComparisonOperator::NotEqual => None,
        ComparisonOperator::Equal | ComparisonOperator::Less | ComparisonOperator::LessEqual => {
            Some(graph.apply(Op::Subtract, &[left, right]))
        }
        ComparisonOperator::Greater | ComparisonOperator::GreaterEqual => {
            Some(graph.apply(Op::Subtract, &[right, left]))
        }
    };
    Ok(Value::Condition(Condition { truth, solid }))
}

/// A comparison of intervals has an answer only where it is the same for all their members.
fn compare_intervals(
    operator: ComparisonOperator,
    left: Interval,
    right: Interval,
) -> Outcome<Value> {
    use ComparisonOperator::*;
    let (op, operands, negated) = match operator {
        Less => (Op::Less, [left, right], false),
        LessEqual => (Op::LessEqual, [left, right], false),
        Greater => (Op::Less, [right, left], false),
        GreaterEqual => (Op::LessEqual, [right, left], false),
        Equal => (Op::Equal, [left, right], false),
        NotEqual => (Op::Equal, [left, right], true),
    };
    let truth = enclose(op, &operands);
    match (truth.low, truth.high) {
        (1.0, 1.0) => Ok(Value::Bool(!negated)),
        (0.0, 0.0) => Ok(Value::Bool(negated)),
        _ => Err(failure(
            Code::NotACondition,
            "the comparison holds for some members of the intervals and not for others",
        )),
    }
}

fn plainly_equal(left: &Value, right: &Value) -> Outcome<bool> {
    match (left, right) {
        (Value::Number(left), Value::Number(right)) => Ok(left == right),
        (Value::Bool(left), Value::Bool(right)) => Ok(left == right),
        (Value::Text(left), Value::Text(right)) => Ok(left == right),
        (Value::Interval(left), Value::Interval(right)) => Ok(left == right),
        (Value::List(left), Value::List(right)) => {
            if left.len() != right.len() {
                return Ok(false);
            }
            for (left, right) in left.iter().zip(right.iter()) {
                if !plainly_equal(left, right)? {
                    return Ok(false);
                }
            }
            Ok(true)
        }
        (left, right) => Err(failure(
            Code::WrongKind,
            format!("cannot compare {} with {}", left.kind(), right.kind()),
        )),
    }
}

/// `left and right` (`conjunction`) or `left or right`, where neither is decided by the other.
pub fn combine(
    graph: &mut Tracer,
    conjunction: bool,
    left: &Value,
    right: &Value,
) -> Outcome<Value> {
    match (left, right) {
        (Value::Unknown, _) | (_, Value::Unknown) => Ok(Value::Unknown),
        // A relation of fields is the field of the solid where it holds.
        (Value::Field(_), Value::Field(_)) => {
            let op = if conjunction { Op::Max } else { Op::Min };
            apply(graph, op, &[left.clone(), right.clone()])
        }
        (Value::Bool(decided), other) | (other, Value::Bool(decided)) => {
            check_condition(other)?;
            Ok(if *decided == conjunction {
                other.clone()
            } else {
                Value::Bool(*decided)
            })
        }
        (Value::Condition(left), Value::Condition(right)) => {
            let (truth, solid) = if conjunction {
                (Op::Min, Op::Max)
            } else {
                (Op::Max, Op::Min)
            };
            Ok(Value::Condition(Condition {
                truth: graph.apply(truth, &[left.truth, right.truth]),
                solid: left
                    .solid
                    .zip(right.solid)
                    .map(|(left, right)| graph.apply(solid, &[left, right])),
            }))
        }
        (left, right) => {
            check_condition(left)?;
            check_condition(right)?;
            Err(wrong_kind("a condition", left))
        }
    }
}

/// `not value`.
pub fn negate_condition(graph: &mut Tracer, value: &Value) -> Outcome<Value> {
    match value {
        Value::Unknown => Ok(Value::Unknown),
        Value::Bool(value) => Ok(Value::Bool(!value)),
        field @ Value::Field(_) => apply(graph, Op::Negate, std::slice::from_ref(field)),
        Value::Condition(condition) => {
            let one = graph.constant(1.0);
            Ok(Value::Condition(Condition {
                truth: graph.apply(Op::Subtract, &[one, condition.truth]),
                solid: condition
                    .solid
                    .map(|solid| graph.apply(Op::Negate, &[solid])),
            }))
        }
        other => Err(not_a_condition(other)),
    }
}

fn check_condition(value: &Value) -> Outcome<()> {
    match value {
        Value::Bool(_) | Value::Condition(_) | Value::Field(_) => Ok(()),
        other => Err(not_a_condition(other)),
    }
}

/// The error for something that is neither true nor false.
pub fn not_a_condition(value: &Value) -> Box<Diagnostic> {
    let message = format!("expected a condition, found {}", value.kind());
    failure(Code::NotACondition, message)
}

/// What a relation means as the body of a field: a number that is negative where it holds.
pub fn solid_of(graph: &Tracer, value: &Value) -> Outcome<Value> {
    match value {
        Value::Condition(Condition { solid, .. }) => match solid {
            Some(node) => Ok(value_of_node(graph, *node)),
            None => Err(failure(
                Code::NotAField,
                "`!=` does not describe a solid or a surface",
            )),
        },
        Value::Bool(holds) => Err(failure(
            Code::NotAField,
            format!(
                "the relation is {holds} at every point: it does not depend on the coordinates"
            ),
        )),
        other => Ok(other.clone()),
    }
}

/// The value that is `consequence` where the condition holds and `alternative` elsewhere.
pub fn select(
    graph: &mut Tracer,
    condition: Condition,
    consequence: &Value,
    alternative: &Value,
) -> Outcome<Value> {
    match (consequence, alternative) {
        (Value::Unknown, _) | (_, Value::Unknown) => Ok(Value::Unknown),
        (Value::Field(_), _) | (_, Value::Field(_)) => field::lift(
            graph,
            &[consequence.clone(), alternative.clone()],
            &mut |graph, bodies| select(graph, condition, &bodies[0], &bodies[1]),
        ),
        (Value::List(left), Value::List(right)) if left.len() == right.len() => {
            let elements = left
                .iter()
                .zip(right.iter())
                .map(|(left, right)| select(graph, condition, left, right))
                .collect::<Outcome<_>>()?;
            Ok(Value::list(elements))
        }
        (Value::Condition(_) | Value::Bool(_), Value::Condition(_) | Value::Bool(_)) => {
            let chosen = Value::Condition(condition);
            let not_chosen = negate_condition(graph, &chosen)?;
            let first = combine(graph, true, &chosen, consequence)?;
            let second = combine(graph, true, &not_chosen, alternative)?;
            combine(graph, false, &first, &second)
        }
        (Value::Number(_) | Value::Symbol(_), Value::Number(_) | Value::Symbol(_)) => {
            let consequence = node_of(graph, consequence)?;
            let alternative = node_of(graph, alternative)?;
            let node = graph.apply(Op::Select, &[condition.truth, consequence, alternative]);
            Ok(value_of_node(graph, node))
        }
        (left, right) => Err(failure(
            Code::WrongKind,
            format!(
                "the condition depends on the point or on parameters, so both branches must be \
                 numbers or lists of one shape, but they are {} and {}",
                left.kind(),
                right.kind()
            ),
        )),
    }
}

/// The matrix product of vectors (lists of numbers) and matrices (lists of rows).
pub fn matrix_product(graph: &mut Tracer, left: &Value, right: &Value) -> Outcome<Value> {
    match (left, right) {
        (Value::Unknown, _) | (_, Value::Unknown) => Ok(Value::Unknown),
        (Value::Field(_), _) | (_, Value::Field(_)) => field::lift(
            graph,
            &[left.clone(), right.clone()],
            &mut |graph, bodies| matrix_product(graph, &bodies[0], &bodies[1]),
        ),
        (Value::List(rows), Value::List(_)) if is_matrix(left) => rows
            .iter()
            .map(|row| matrix_product(graph, row, right))
            .collect::<Outcome<_>>()
            .map(Value::list),
        (Value::List(row), Value::List(columns)) => {
            if row.len() != columns.len() {
                let message = format!(
                    "the matrix product of {} and {} elements",
                    row.len(),
                    columns.len()
                );
                return Err(failure(Code::LengthsDiffer, message));
            }
            let mut total = Value::Number(0.0);
            for (index, (left, right)) in row.iter().zip(columns.iter()).enumerate() {
                let product = apply(graph, Op::Multiply, &[left.clone(), right.clone()])?;
                total = if index == 0 {
                    product
                } else {
                    apply(graph, Op::Add, &[total, product])?
                };
            }
            Ok(total)
        }
        (Value::List(_), other) | (other, _) => Err(wrong_kind("a vector or a matrix", other)),
    }
}

/// Whether a value is a list of lists.
pub fn is_matrix(value: &Value) -> bool {
    matches!(value, Value::List(rows) if matches!(rows.first(), Some(Value::List(_))))
}
