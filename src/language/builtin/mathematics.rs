//! Mathematics on numbers and vectors: the elementary functions of the table of operations, and
//! compositions of them.

use std::sync::LazyLock;

use super::{Arguments, Builtin, Call, mathematical};
use crate::diagnostic::Code;
use crate::graph::Op;
use crate::language::arithmetic::{apply, elementwise};
use crate::language::session::Session;
use crate::language::tracer::Tracer;
use crate::language::value::{Outcome, Value, failure, wrong_kind};

/// Operations that are written with signs, or that have a richer function below.
const NOT_FUNCTIONS: &[Op] = &[
    Op::Add,
    Op::Subtract,
    Op::Multiply,
    Op::Divide,
    Op::Negate,
    Op::Square,
    Op::Power,
    Op::IntegerPower,
    Op::Min,
    Op::Max,
    Op::Round,
    Op::Less,
    Op::LessEqual,
    Op::Equal,
    Op::IsNumber,
    Op::Select,
    Op::ChainProduct,
];

/// The functions that the table of operations gives, made once.
pub(super) fn operations() -> &'static [Builtin] {
    static OPERATIONS: LazyLock<Vec<Builtin>> = LazyLock::new(|| {
        let functions = Op::ALL.iter().filter(|op| !NOT_FUNCTIONS.contains(op));
        functions
            .map(|&op| Builtin {
                name: op.name(),
                parameters: match op.arity() {
                    1 => &["x"],
                    2 if op == Op::Atan2 => &["y", "x"],
                    2 => &["a", "b"],
                    _ => &["a", "b", "c"],
                },
                documentation: op.operation().documentation,
                acts: false,
                lifts: true,
                call: Call::Operation(op),
            })
            .collect()
    });
    &OPERATIONS
}

/// Applies an operation to the arguments in order.
pub(super) fn apply_operation(
    session: &mut Session,
    op: Op,
    arguments: &Arguments,
) -> Outcome<Value> {
    apply(&mut session.graph, op, &arguments.values())
}

pub(super) const TABLE: &[Builtin] = &[
    mathematical("pow", &["a", "b"], "a ^ b.", |session, arguments| {
        apply_operation(session, Op::Power, arguments)
    }),
    mathematical(
        "ln",
        &["x"],
        "The natural logarithm: another name of `log`.",
        |session, arguments| apply_operation(session, Op::Log, arguments),
    ),
    mathematical(
        "log2",
        &["x"],
        "The logarithm to base 2: log(x) / log(2).",
        |session, arguments| logarithm(session, arguments, 2.0),
    ),
    mathematical(
        "log10",
        &["x"],
        "The logarithm to base 10: log(x) / log(10).",
        |session, arguments| logarithm(session, arguments, 10.0),
    ),
    mathematical(
        "cbrt",
        &["x"],
        "The cube root, of negative numbers too: sign(x) * abs(x)^(1/3).",
        cube_root,
    ),
    mathematical(
        "round",
        &["x", "radius ="],
        "The nearest whole number, halves away from 0; of a field with a radius, the field x - radius, whose edges are round where x is a distance.",
        |session, arguments| match arguments.given("radius") {
            None => apply_operation(session, Op::Round, arguments),
            Some(_) => apply_operation(session, Op::Subtract, arguments),
        },
    ),
    mathematical(
        "fract",
        &["x"],
        "The fractional part: x - floor(x).",
        |session, arguments| {
            let x = arguments.value("x");
            let floor = apply(&mut session.graph, Op::Floor, std::slice::from_ref(&x))?;
            apply(&mut session.graph, Op::Subtract, &[x, floor])
        },
    ),
    mathematical(
        "min",
        &["values…"],
        "The smallest of its arguments, elementwise on lists; of one list, its smallest element.",
        |session, arguments| extremum(session, arguments, Op::Min),
    ),
    mathematical(
        "max",
        &["values…"],
        "The largest of its arguments, elementwise on lists; of one list, its largest element.",
        |session, arguments| extremum(session, arguments, Op::Max),
    ),
    mathematical(
        "clamp",
        &["x", "low", "high"],
        "The number of low..high that is nearest to x: min(max(x, low), high).",
        |session, arguments| {
            let [x, low, high] = ["x", "low", "high"].map(|name| arguments.value(name));
            clamp(&mut session.graph, x, low, high)
        },
    ),
    mathematical(
        "mix",
        &["a", "b", "t"],
        "a + t*(b - a): a at t = 0, b at t = 1. Also called `lerp` elsewhere.",
        |session, arguments| {
            let [a, b, t] = ["a", "b", "t"].map(|name| arguments.value(name));
            let graph = &mut session.graph;
            let difference = apply(graph, Op::Subtract, &[b, a.clone()])?;
            let part = apply(graph, Op::Multiply, &[t, difference])?;
            apply(graph, Op::Add, &[a, part])
        },
    ),
    mathematical(
        "step",
        &["edge", "x"],
        "0 where x < edge, else 1. With a simulation in the place of the numbers it lets time pass: `step(sim, dt = 0.03, steps = 1)`.",
        |session, arguments| {
            let [edge, x] = ["edge", "x"].map(|name| arguments.value(name));
            apply(&mut session.graph, Op::LessEqual, &[edge, x])
        },
    ),
    mathematical(
        "smoothstep",
        &["low", "high", "x"],
        "0 below low, 1 above high, and t^2*(3 - 2*t) with t = (x - low)/(high - low) between.",
        smoothstep,
    ),
    mathematical(
        "norm",
        &["v"],
        "The Euclidean length of a vector: sqrt(norm2(v)).",
        |session, arguments| norm(&mut session.graph, &arguments.value("v")),
    ),
    mathematical(
        "length",
        &["v"],
        "Another name of `norm`.",
        |session, arguments| norm(&mut session.graph, &arguments.value("v")),
    ),
    mathematical(
        "norm2",
        &["v"],
        "The squared length of a vector: the sum of its elements' squares.",
        |session, arguments| norm2(&mut session.graph, &arguments.value("v")),
    ),
    mathematical(
        "dot",
        &["a", "b"],
        "The scalar product of two vectors.",
        |session, arguments| {
            let operands = [arguments.value("a"), arguments.value("b")];
            let products = apply(&mut session.graph, Op::Multiply, &operands)?;
            sum(&mut session.graph, &products)
        },
    ),
    mathematical(
        "cross",
        &["a", "b"],
        "The vector product of two vectors in space; of two in the plane, its z component.",
        |session, arguments| {
            let operands = [arguments.value("a"), arguments.value("b")];
            through_fields(&mut session.graph, &operands, &mut cross)
        },
    ),
    mathematical(
        "normalize",
        &["v"],
        "The vector divided by its length.",
        |session, arguments| {
            let v = arguments.value("v");
            let length = norm(&mut session.graph, &v)?;
            through_fields(&mut session.graph, &[v, length], &mut |graph, operands| {
                apply(graph, Op::Divide, operands)
            })
        },
    ),
    mathematical(
        "sum",
        &["list"],
        "The sum of a list's elements; of vectors, their vector sum. 0 for an empty list.",
        |session, arguments| sum(&mut session.graph, &arguments.value("list")),
    ),
    mathematical(
        "product",
        &["list"],
        "The product of a list's elements. 1 for an empty list.",
        |session, arguments| {
            through_fields(
                &mut session.graph,
                &[arguments.value("list")],
                &mut |graph, operands| fold(graph, Op::Multiply, &operands[0], Some(1.0)),
            )
        },
    ),
    mathematical(
        "mean",
        &["list"],
        "The sum of a list's elements divided by their number.",
        |session, arguments| {
            let list = arguments.list("list")?;
            let total = fold(
                &mut session.graph,
                Op::Add,
                &Value::List(list.clone()),
                None,
            )?;
            let count = Value::Number(list.len() as f64);
            apply(&mut session.graph, Op::Divide, &[total, count])
        },
    ),
];

/// Applies a rule for whole values (vectors, lists) to operands or to the bodies of fields.
fn through_fields(
    graph: &mut Tracer,
    operands: &[Value],
    rule: &mut dyn FnMut(&mut Tracer, &[Value]) -> Outcome<Value>,
) -> Outcome<Value> {
    crate::language::field::lift(graph, operands, rule)
}

fn logarithm(session: &mut Session, arguments: &Arguments, base: f64) -> Outcome<Value> {
    let graph = &mut session.graph;
    let logarithm = apply(graph, Op::Log, &[arguments.value("x")])?;
    let scale = Value::Number(Op::Log.value([base, 0.0, 0.0]));
    apply(graph, Op::Divide, &[logarithm, scale])
}

fn cube_root(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let graph = &mut session.graph;
    let x = arguments.value("x");
    let sign = apply(graph, Op::Sign, std::slice::from_ref(&x))?;
    let size = apply(graph, Op::Abs, &[x])?;
    let root = apply(graph, Op::Power, &[size, Value::Number(1.0 / 3.0)])?;
    apply(graph, Op::Multiply, &[sign, root])
}

fn clamp(graph: &mut Tracer, x: Value, low: Value, high: Value) -> Outcome<Value> {
    let raised = apply(graph, Op::Max, &[x, low])?;
    apply(graph, Op::Min, &[raised, high])
}

fn smoothstep(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let [low, high, x] = ["low", "high", "x"].map(|name| arguments.value(name));
    let graph = &mut session.graph;
    let offset = apply(graph, Op::Subtract, &[x, low.clone()])?;
    let width = apply(graph, Op::Subtract, &[high, low])?;
    let quotient = apply(graph, Op::Divide, &[offset, width])?;
    let t = clamp(graph, quotient, Value::Number(0.0), Value::Number(1.0))?;
    let square = apply(graph, Op::Multiply, &[t.clone(), t.clone()])?;
    let double = apply(graph, Op::Multiply, &[Value::Number(2.0), t])?;
    let rest = apply(graph, Op::Subtract, &[Value::Number(3.0), double])?;
    apply(graph, Op::Multiply, &[square, rest])
}

fn norm(graph: &mut Tracer, vector: &Value) -> Outcome<Value> {
    let squared = norm2(graph, vector)?;
    apply(graph, Op::SquareRoot, &[squared])
}

fn norm2(graph: &mut Tracer, vector: &Value) -> Outcome<Value> {
    let squares = elementwise(
        graph,
        std::slice::from_ref(vector),
        &mut |graph, scalars| apply(graph, Op::Power, &[scalars[0].clone(), Value::Number(2.0)]),
    )?;
    match squares {
        number @ (Value::Number(_) | Value::Symbol(_) | Value::Interval(_)) => Ok(number),
        squares => sum(graph, &squares),
    }
}

fn sum(graph: &mut Tracer, list: &Value) -> Outcome<Value> {
    through_fields(graph, std::slice::from_ref(list), &mut |graph, operands| {
        fold(graph, Op::Add, &operands[0], Some(0.0))
    })
}

/// Joins the elements of a list from the left.
fn fold(graph: &mut Tracer, op: Op, list: &Value, empty: Option<f64>) -> Outcome<Value> {
    let elements = match list {
        Value::List(elements) => elements,
        Value::Unknown => return Ok(Value::Unknown),
        other => return Err(wrong_kind("a list", other)),
    };
    let Some((first, rest)) = elements.split_first() else {
        return match empty {
            Some(value) => Ok(Value::Number(value)),
            None => Err(failure(Code::EmptyList, "the list is empty")),
        };
    };
    let mut total = first.clone();
    for element in rest {
        total = apply(graph, op, &[total, element.clone()])?;
    }
    // The only element of a list has not been through an operation that checks it.
    match total {
        Value::Bool(_) | Value::Text(_) | Value::Condition(_) | Value::Function(_) => {
            Err(wrong_kind("a list of numbers", &total))
        }
        total => Ok(total),
    }
}

fn extremum(session: &mut Session, arguments: &Arguments, op: Op) -> Outcome<Value> {
    let values: Vec<Value> = arguments
        .rest()
        .iter()
        .map(|argument| argument.value.clone())
        .collect();
    let list = match values.as_slice() {
        [single @ (Value::List(_) | Value::Field(_))] => single.clone(),
        _ => Value::list(values),
    };
    if matches!(list, Value::Field(_)) {
        return through_fields(
            &mut session.graph,
            &[list],
            &mut |graph, operands| match &operands[0] {
                scalar @ (Value::Number(_) | Value::Symbol(_)) => Ok(scalar.clone()),
                vector => fold(graph, op, vector, None),
            },
        );
    }
    fold(&mut session.graph, op, &list, None)
}

fn cross(graph: &mut Tracer, operands: &[Value]) -> Outcome<Value> {
    let [a, b] = [&operands[0], &operands[1]].map(|value| match value {
        Value::List(elements) => Ok(elements.clone()),
        other => Err(wrong_kind("a vector", other)),
    });
    let (a, b) = (a?, b?);
    let mut minor = |i: usize, j: usize| {
        let left = apply(graph, Op::Multiply, &[a[i].clone(), b[j].clone()])?;
        let right = apply(graph, Op::Multiply, &[a[j].clone(), b[i].clone()])?;
        apply(graph, Op::Subtract, &[left, right])
    };
    match (a.len(), b.len()) {
        (2, 2) => minor(0, 1),
        (3, 3) => Ok(Value::list(vec![minor(1, 2)?, minor(2, 0)?, minor(0, 1)?])),
        (left, right) => Err(failure(
            Code::LengthsDiffer,
            format!("the vector product of vectors with {left} and {right} elements"),
        )),
    }
}
