//! Differential geometry as functions of the language: normals, curvatures, divergence and curl.
//!
//! A field is negative inside, so its gradient points outwards, and so does the normal
//! n = grad F / |grad F|. Curvatures are those of the level set through the point, positive where
//! it bends away from the outside, as a ball's surface does: the mean curvature of |p| - r is 1/r.
//! The formulas are those of R. Goldman, Curvature formulas for implicit curves and surfaces,
//! Computer Aided Geometric Design 22 (2005), sections 3 and 4, where mean curvature has the
//! opposite sign. Where the gradient vanishes they are not numbers.

use super::calculus::{hessian_rows, operator};
use super::{Builtin, pure};
use crate::diagnostic::Code;
use crate::graph::{NodeId, Op};
use crate::language::arithmetic::{apply, matrix_product, node_of, value_of_node};
use crate::language::field::derivatives;
use crate::language::tracer::Tracer;
use crate::language::value::{Outcome, Value, failure};

pub(super) const TABLE: &[Builtin] = &[
    pure(
        "normal",
        &["f"],
        "The unit normal of a field's level sets, grad(f)/norm(grad(f)). It points outwards, since f < 0 inside.",
        |session, arguments| operator(session, arguments, normal),
    ),
    pure(
        "mean_curvature",
        &["f"],
        "The mean curvature of a field's level sets: in R3 half the divergence of the normal, (k1 + k2)/2, in R2 the curvature of the curve. Positive where the surface bends away from the outside: 1 for norm(p) - 1 at its zeros.",
        |session, arguments| operator(session, arguments, mean_curvature),
    ),
    pure(
        "gaussian_curvature",
        &["f"],
        "The Gaussian curvature k1*k2 of a field's level sets in R3: positive where they are like a ball, negative where they are like a saddle.",
        |session, arguments| operator(session, arguments, gaussian_curvature),
    ),
    pure(
        "k1",
        &["f"],
        "The larger principal curvature of a field's level sets in R3, with the sign of `mean_curvature`. It has no derivative where k1 = k2.",
        |session, arguments| {
            operator(session, arguments, |graph, body, coordinates| {
                principal(graph, body, coordinates, Op::Add)
            })
        },
    ),
    pure(
        "k2",
        &["f"],
        "The smaller principal curvature of a field's level sets in R3, with the sign of `mean_curvature`. It has no derivative where k1 = k2.",
        |session, arguments| {
            operator(session, arguments, |graph, body, coordinates| {
                principal(graph, body, coordinates, Op::Subtract)
            })
        },
    ),
    pure(
        "div",
        &["v"],
        "The divergence of a vector field, the sum of the derivatives of its components by their own coordinates: div(grad(f)) is laplacian(f).",
        |session, arguments| operator(session, arguments, divergence),
    ),
    pure(
        "curl",
        &["v"],
        "The curl of a vector field: a vector in R3; in R2 the number d v.y/dx - d v.x/dy.",
        |session, arguments| operator(session, arguments, curl),
    ),
];

/// The gradient of a scalar body, its squared length and its length.
struct Slope {
    gradient: Value,
    squared: Value,
    length: Value,
}

impl Slope {
    fn of(graph: &mut Tracer, body: &Value, coordinates: &[NodeId]) -> Outcome<Slope> {
        scalar(body)?;
        let gradient = derivatives(graph, body, coordinates)?;
        let squared = matrix_product(graph, &gradient, &gradient)?;
        let length = apply(graph, Op::SquareRoot, std::slice::from_ref(&squared))?;
        Ok(Slope {
            gradient,
            squared,
            length,
        })
    }
}

fn normal(graph: &mut Tracer, body: &Value, coordinates: &[NodeId]) -> Outcome<Value> {
    let slope = Slope::of(graph, body, coordinates)?;
    apply(graph, Op::Divide, &[slope.gradient, slope.length])
}

/// (|g|² tr H - gᵀ H g) / ((d - 1) |g|³): Goldman's (3.6) and (4.2) with the other sign.
fn mean_curvature(graph: &mut Tracer, body: &Value, coordinates: &[NodeId]) -> Outcome<Value> {
    let bends = coordinates.len().saturating_sub(1);
    if bends == 0 {
        return Err(dimension("curvature is defined in R2 and R3"));
    }
    let slope = Slope::of(graph, body, coordinates)?;
    let rows = hessian_rows(graph, body, coordinates)?;
    let bent = matrix_product(graph, &rows, &slope.gradient)?;
    let along = matrix_product(graph, &slope.gradient, &bent)?;
    let trace = diagonal_sum(graph, &rows)?;
    let whole = apply(graph, Op::Multiply, &[slope.squared.clone(), trace])?;
    let difference = apply(graph, Op::Subtract, &[whole, along])?;
    let cube = apply(graph, Op::Multiply, &[slope.squared, slope.length])?;
    let count = Value::Number(bends as f64);
    let scale = apply(graph, Op::Multiply, &[count, cube])?;
    apply(graph, Op::Divide, &[difference, scale])
}

/// gᵀ adj(H) g / |g|⁴: Goldman's (4.1).
fn gaussian_curvature(graph: &mut Tracer, body: &Value, coordinates: &[NodeId]) -> Outcome<Value> {
    in_space(coordinates, "Gaussian curvature")?;
    let slope = Slope::of(graph, body, coordinates)?;
    let rows = hessian_rows(graph, body, coordinates)?;
    let adjugate = adjugate(graph, &rows)?;
    let bent = matrix_product(graph, &adjugate, &slope.gradient)?;
    let above = matrix_product(graph, &slope.gradient, &bent)?;
    let below = apply(graph, Op::Multiply, &[slope.squared.clone(), slope.squared])?;
    apply(graph, Op::Divide, &[above, below])
}

/// H ± (k1 - k2)/2.
///
/// With P = I - n nᵀ the matrix S = P (hess F) P / |g| has the eigenvalues k1, k2 and 0, so
/// D = S - H P has ±(k1 - k2)/2 and 0, and half the sum of the squares of its elements is
/// ((k1 - k2)/2)². Unlike H² - K this is no difference of large numbers where k1 and k2 are near.
fn principal(graph: &mut Tracer, body: &Value, coordinates: &[NodeId], sign: Op) -> Outcome<Value> {
    in_space(coordinates, "principal curvature")?;
    let mean = mean_curvature(graph, body, coordinates)?;
    let slope = Slope::of(graph, body, coordinates)?;
    let rows = hessian_rows(graph, body, coordinates)?;
    let normal = apply(graph, Op::Divide, &[slope.gradient, slope.length.clone()])?;
    let across = projection(graph, &normal)?;
    let left = matrix_product(graph, &across, &rows)?;
    let both = matrix_product(graph, &left, &across)?;
    let shape = apply(graph, Op::Divide, &[both, slope.length])?;
    let mean_part = apply(graph, Op::Multiply, &[mean.clone(), across])?;
    let deviation = apply(graph, Op::Subtract, &[shape, mean_part])?;
    let mut total = Value::Number(0.0);
    for row in elements(&deviation) {
        let square = matrix_product(graph, row, row)?;
        total = apply(graph, Op::Add, &[total, square])?;
    }
    let half = apply(graph, Op::Multiply, &[Value::Number(0.5), total])?;
    let spread = apply(graph, Op::SquareRoot, &[half])?;
    apply(graph, sign, &[mean, spread])
}

fn divergence(graph: &mut Tracer, body: &Value, coordinates: &[NodeId]) -> Outcome<Value> {
    let rows = vector_derivatives(graph, body, coordinates)?;
    diagonal_sum(graph, &rows)
}

fn curl(graph: &mut Tracer, body: &Value, coordinates: &[NodeId]) -> Outcome<Value> {
    let rows = vector_derivatives(graph, body, coordinates)?;
    let mut difference = |i: usize, j: usize| {
        let (first, second) = (entry(&rows, i, j), entry(&rows, j, i));
        apply(graph, Op::Subtract, &[first, second])
    };
    match coordinates.len() {
        2 => difference(1, 0),
        3 => Ok(Value::list(vec![
            difference(2, 1)?,
            difference(0, 2)?,
            difference(1, 0)?,
        ])),
        _ => Err(dimension("the curl is defined in R2 and R3")),
    }
}

/// The Jacobian of a body with as many components as there are coordinates.
fn vector_derivatives(graph: &mut Tracer, body: &Value, coordinates: &[NodeId]) -> Outcome<Value> {
    match body {
        Value::List(components) if components.len() == coordinates.len() => {
            components.iter().try_for_each(scalar)?;
            derivatives(graph, body, coordinates)
        }
        Value::List(components) => Err(dimension(&format!(
            "a vector field in R{0} has {0} components, but this has {1}",
            coordinates.len(),
            components.len()
        ))),
        // On a line a vector is a number.
        scalar if coordinates.len() == 1 => {
            let slope = derivatives(graph, scalar, coordinates)?;
            Ok(Value::list(vec![slope]))
        }
        _ => Err(dimension(
            "expected a vector field, such as `grad(f)`, but the value of this is one number",
        )),
    }
}

fn scalar(body: &Value) -> Outcome<()> {
    match body {
        Value::List(components) => Err(dimension(&format!(
            "expected a field whose value is one number, but this one has {} components",
            components.len()
        ))),
        _ => Ok(()),
    }
}

fn in_space(coordinates: &[NodeId], what: &str) -> Outcome<()> {
    match coordinates.len() {
        3 => Ok(()),
        _ => Err(dimension(&format!("{what} is defined in R3"))),
    }
}

fn dimension(message: &str) -> Box<crate::diagnostic::Diagnostic> {
    failure(Code::WrongDimension, message)
}

/// I - n nᵀ
fn projection(graph: &mut Tracer, normal: &Value) -> Outcome<Value> {
    let normal = elements(normal);
    let mut rows = Vec::with_capacity(normal.len());
    for (i, left) in normal.iter().enumerate() {
        let mut row = Vec::with_capacity(normal.len());
        for (j, right) in normal.iter().enumerate() {
            let product = apply(graph, Op::Multiply, &[left.clone(), right.clone()])?;
            let unit = Value::Number(if i == j { 1.0 } else { 0.0 });
            row.push(apply(graph, Op::Subtract, &[unit, product])?);
        }
        rows.push(Value::list(row));
    }
    Ok(Value::list(rows))
}

/// The adjugate of a symmetric matrix of three rows.
fn adjugate(graph: &mut Tracer, rows: &Value) -> Outcome<Value> {
    let mut minor = |i: usize, j: usize| {
        let pick = |k: usize| ((k + 1) % 3, (k + 2) % 3);
        let ((i1, i2), (j1, j2)) = (pick(i), pick(j));
        let operands = [entry(rows, i1, j1), entry(rows, i2, j2)];
        let left = apply(graph, Op::Multiply, &operands)?;
        let operands = [entry(rows, i1, j2), entry(rows, i2, j1)];
        let right = apply(graph, Op::Multiply, &operands)?;
        apply(graph, Op::Subtract, &[left, right])
    };
    let mut all = Vec::with_capacity(3);
    for i in 0..3 {
        all.push(Value::list(vec![minor(i, 0)?, minor(i, 1)?, minor(i, 2)?]));
    }
    Ok(Value::list(all))
}

fn diagonal_sum(graph: &mut Tracer, rows: &Value) -> Outcome<Value> {
    let mut total = Value::Number(0.0);
    for place in 0..elements(rows).len() {
        total = apply(graph, Op::Add, &[total, entry(rows, place, place)])?;
    }
    let node = node_of(graph, &total)?;
    Ok(value_of_node(graph, node))
}

fn elements(list: &Value) -> &[Value] {
    match list {
        Value::List(elements) => elements,
        scalar => std::slice::from_ref(scalar),
    }
}

/// An element of a matrix that has it.
fn entry(rows: &Value, i: usize, j: usize) -> Value {
    let row = elements(rows).get(i).map_or(&[][..], elements);
    row.get(j).cloned().unwrap_or(Value::Unknown)
}
