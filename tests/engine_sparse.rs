//! Parameters that matter in a box: a field of 300 blobs of compact support has 1,200 of them, and
//! a small box sees a few.

#[path = "engine_common/expressions.rs"]
#[allow(dead_code)]
mod expressions;

use expressions::{Random, same};
use glam::DVec3;
use imp::engine::{CompiledField, Field, Program};
use imp::graph::{Graph, NodeId, Op};
use std::sync::Arc;

const BLOBS: usize = 300;

/// ½ − Σ max(0, 1 − |x − cᵢ|²/rᵢ²)³, whose parameters are cᵢ and rᵢ, in this order.
fn blobs() -> (CompiledField, Vec<[f64; 4]>) {
    let random = &mut Random(11);
    let mut graph = Graph::new();
    let mut sum = graph.constant(0.0);
    let mut balls = Vec::new();
    for index in 0..BLOBS {
        let centre = |graph: &mut Graph, axis| graph.parameter(4 * index + axis);
        let squares: [NodeId; 3] = std::array::from_fn(|axis| {
            let centre = centre(&mut graph, axis);
            let coordinate = graph.coordinate(axis);
            let difference = graph.apply(Op::Subtract, &[coordinate, centre]);
            graph.apply(Op::Square, &[difference])
        });
        let plane = graph.apply(Op::Add, &[squares[0], squares[1]]);
        let distance = graph.apply(Op::Add, &[plane, squares[2]]);
        let radius = graph.parameter(4 * index + 3);
        let radius = graph.apply(Op::Square, &[radius]);
        let quotient = graph.apply(Op::Divide, &[distance, radius]);
        let [zero, one, three] = [0.0, 1.0, 3.0].map(|number| graph.constant(number));
        let weight = graph.apply(Op::Subtract, &[one, quotient]);
        let weight = graph.apply(Op::Max, &[zero, weight]);
        let blob = graph.apply(Op::IntegerPower, &[weight, three]);
        sum = graph.apply(Op::Add, &[sum, blob]);
        let mut coordinate = || random.uniform(-1.0, 1.0);
        balls.push([coordinate(), coordinate(), coordinate(), 0.2]);
    }
    let half = graph.constant(0.5);
    let root = graph.apply(Op::Subtract, &[half, sum]);
    let program = Arc::new(Program::new(&graph, &[root], 3));
    (CompiledField::new(program, balls.concat()), balls)
}

#[test]
fn a_small_box_sees_a_few_of_1200_parameters() {
    let (field, balls) = blobs();
    assert_eq!(field.parameters().len(), 1200);
    let random = &mut Random(12);
    for _ in 0..6 {
        let low = DVec3::from_array(std::array::from_fn(|_| random.uniform(-1.0, 0.9)));
        let high = low + 0.1;
        let sparse = field.sparse_parameters(low, high);
        let places = sparse.places();

        // A blob matters in the box if its ball meets it, and may seem to if the ball all but does.
        let distance = |ball: &[f64; 4]| {
            let centre = DVec3::new(ball[0], ball[1], ball[2]);
            (centre - centre.clamp(low, high)).length()
        };
        for (index, ball) in balls.iter().enumerate() {
            let is_seen = places.binary_search(&(4 * index)).is_ok();
            let distance = distance(ball);
            assert!(is_seen || distance > ball[3], "{index}");
            assert!(!is_seen || distance < ball[3] + 1e-12, "{index}");
        }
        assert!(places.len() < 120, "{}", places.len());

        // F_q is that of the whole field, and exactly 0 in the other components.
        let mut points = [const { Vec::new() }; 3];
        for _ in 0..100 {
            for (axis, column) in points.iter_mut().enumerate() {
                column.push(random.uniform(low[axis], high[axis]));
            }
        }
        let points = points.each_ref().map(|column| &column[..]);
        let mut whole = vec![vec![0.25; 100]; 4 + 1200];
        let mut part = vec![vec![0.5; 100]; 4 + places.len()];
        let mut columns: Vec<&mut [f64]> = whole.iter_mut().map(|c| &mut c[..]).collect();
        let (values, rest) = columns.split_at_mut(1);
        let (gradients, parameters) = rest.split_at_mut(3);
        field.parameter_gradients(&points, values[0], gradients, parameters);
        let mut columns: Vec<&mut [f64]> = part.iter_mut().map(|c| &mut c[..]).collect();
        let (values, rest) = columns.split_at_mut(1);
        let (gradients, parameters) = rest.split_at_mut(3);
        sparse.parameter_gradients(&points, values[0], gradients, parameters);
        let mut next = 4;
        for (place, column) in whole.iter().enumerate() {
            let matters = place < 4 || places.binary_search(&(place - 4)).is_ok();
            if !matters {
                assert!(column.iter().all(|&derivative| derivative == 0.0));
                continue;
            }
            let found = if place < 4 { &part[place] } else { &part[next] };
            next += usize::from(place >= 4);
            for (&found, &expected) in found.iter().zip(column) {
                assert!(same(found, expected), "{place}: {found:e} {expected:e}");
            }
        }
        assert_eq!(next, part.len());
        // What is left costs what the few blobs cost: some 60 operations each, and F_x.
        assert!(sparse.size() < 40 * places.len(), "{}", sparse.size());
    }
}

#[test]
fn where_the_field_is_undefined_all_parameters_matter() {
    let mut graph = Graph::new();
    let x = graph.coordinate(0);
    let [a, b] = [0, 1].map(|index| graph.parameter(index));
    let root = graph.apply(Op::SquareRoot, &[x]);
    let zero = graph.constant(0.0);
    let product = graph.apply(Op::Multiply, &[a, x]);
    let ramp = graph.apply(Op::Max, &[product, zero]);
    let sum = graph.apply(Op::Add, &[root, ramp]);
    let sum = graph.apply(Op::Add, &[sum, b]);
    let program = Arc::new(Program::new(&graph, &[sum], 1));
    let field = CompiledField::new(program, vec![-1.0, 0.5]);
    let places = |low: f64, high: f64| {
        let sparse = field.sparse_parameters(DVec3::splat(low), DVec3::splat(high));
        sparse.places().to_vec()
    };
    // max(−x, 0) is 0 for positive x; below 0 everything is NaN, which every derivative shows.
    assert_eq!(places(0.5, 1.0), [1]);
    assert_eq!(places(-1.0, 1.0), [0, 1]);
}
