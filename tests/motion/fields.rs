//! Fields with parameters, and points on their zero sets.

use std::sync::Arc;

use glam::DVec3;

use imp::engine::{CompiledField, Field, Program};
use imp::graph::{Graph, NodeId, Op};

use crate::examples;
use crate::expressions::Random;

/// The field of a root that is made in a graph.
pub(crate) fn field(
    dimension: usize,
    q: &[f64],
    root: impl FnOnce(&mut Graph) -> NodeId,
) -> CompiledField {
    let mut graph = Graph::new();
    let root = root(&mut graph);
    let program = Program::new(&graph, &[root], dimension);
    assert_eq!(program.parameters().len(), q.len());
    CompiledField::new(Arc::new(program), q.to_vec())
}

/// The same program with another q.
pub(crate) fn at(field: &CompiledField, q: &[f64]) -> CompiledField {
    CompiledField::new(Arc::clone(field.program()), q.to_vec())
}

/// |x − c|² in `dimension` coordinates, where c are the parameters from 0.
fn squared_distance(graph: &mut Graph, dimension: usize) -> NodeId {
    let mut sum = graph.constant(0.0);
    for axis in 0..dimension {
        let coordinate = graph.coordinate(axis);
        let centre = graph.parameter(axis);
        let difference = graph.apply(Op::Subtract, &[coordinate, centre]);
        let square = graph.apply(Op::Square, &[difference]);
        sum = graph.apply(Op::Add, &[sum, square]);
    }
    sum
}

/// |x − c|² − r² with q = (c, r), in two or three coordinates.
pub(crate) fn sphere(q: &[f64]) -> CompiledField {
    let dimension = q.len() - 1;
    field(dimension, q, |graph| {
        let distance = squared_distance(graph, dimension);
        let radius = graph.parameter(dimension);
        let radius = graph.apply(Op::Square, &[radius]);
        graph.apply(Op::Subtract, &[distance, radius])
    })
}

/// |x − c| − r with q = (c, r).
pub(crate) fn sphere_distance(q: &[f64]) -> CompiledField {
    let dimension = q.len() - 1;
    field(dimension, q, |graph| {
        let distance = squared_distance(graph, dimension);
        let distance = graph.apply(Op::SquareRoot, &[distance]);
        let radius = graph.parameter(dimension);
        graph.apply(Op::Subtract, &[distance, radius])
    })
}

/// Fourteen Gaussian blobs with 57 parameters.
pub(crate) fn blobs() -> CompiledField {
    let example = examples::blobs(14);
    let program = Program::new(&example.graph, &[example.root], 3);
    CompiledField::new(Arc::new(program), example.q)
}

/// Points on the zero set: from random places within `half` of the origin along random directions to
/// where F changes its sign, by bisection to rounding.
pub(crate) fn on_surface(
    field: &dyn Field,
    count: usize,
    half: f64,
    random: &mut Random,
) -> Vec<DVec3> {
    let mut point = || DVec3::from_array(std::array::from_fn(|_| random.uniform(-half, half)));
    let mut points = Vec::new();
    while points.len() < count {
        let (mut inside, mut outside) = (point(), point());
        if field.value(inside) >= 0.0 || field.value(outside) <= 0.0 {
            continue;
        }
        for _ in 0..60 {
            let middle = 0.5 * (inside + outside);
            if field.value(middle) < 0.0 {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        points.push(inside);
    }
    points
}

/// q with each parameter changed by at most `part`, uniformly.
pub(crate) fn perturbed(q: &[f64], part: f64, random: &mut Random) -> Vec<f64> {
    q.iter().map(|q| q + random.uniform(-part, part)).collect()
}
