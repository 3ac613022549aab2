//! What this room's tests share: expressions in Polish notation, and their values by the table's
//! value rules.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use super::{Graph, Node, NodeId, Op};

/// The node of an expression in Polish notation, `subtract square x 0.25`: the names of
/// operations, the coordinates `x y z`, parameters such as `q0`, and numbers.
pub(super) fn expression(graph: &mut Graph, text: &str) -> NodeId {
    let mut stack = Vec::new();
    for word in text.split_whitespace().rev() {
        let node = if let Some(&op) = Op::ALL.iter().find(|op| op.name() == word) {
            let operands: Vec<NodeId> = (0..op.arity()).map(|_| stack.pop().unwrap()).collect();
            graph.apply(op, &operands)
        } else if let Some(axis) = ["x", "y", "z"].iter().position(|name| *name == word) {
            graph.coordinate(axis)
        } else if let Some(index) = word.strip_prefix('q') {
            graph.parameter(index.parse().unwrap())
        } else {
            graph.constant(word.parse().unwrap())
        };
        stack.push(node);
    }
    assert_eq!(stack.len(), 1, "{text} is one expression");
    stack[0]
}

/// The root's value at a point, by the value rules.
pub(super) fn evaluate(graph: &Graph, root: NodeId, point: &[f64], q: &[f64]) -> f64 {
    let nodes = graph.reachable(&[root]);
    let mut values: Vec<f64> = Vec::with_capacity(nodes.len());
    for &id in &nodes {
        let value = match graph.node(id) {
            Node::Constant(bits) => f64::from_bits(bits),
            Node::Coordinate(axis) => point[axis as usize],
            Node::Parameter(index) => q[index as usize],
            Node::Apply(op, operands) => {
                op.value(operands.map(|id| values[nodes.binary_search(&id).unwrap()]))
            }
        };
        values.push(value);
    }
    values[nodes.len() - 1]
}

/// The value at `point` of an expression in Polish notation.
pub(super) fn value_of(text: &str, point: &[f64]) -> f64 {
    let mut graph = Graph::new();
    let root = expression(&mut graph, text);
    evaluate(&graph, root, point, &[])
}

/// Whether two results are the same: to the bit, all NaN being one.
pub(super) fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

/// So many cases, the same ones in every run.
pub(super) fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        rng_seed: RngSeed::Fixed(20_260_101),
        failure_persistence: None,
        max_global_rejects: 1_000_000,
        ..ProptestConfig::default()
    }
}

/// Numbers of all kinds: everyday ones, integers and halves, multiples of π/4, any bit pattern,
/// and those at which functions do something special.
pub(super) fn any_number() -> impl Strategy<Value = f64> {
    use std::f64::consts::FRAC_PI_4;
    const SPECIAL: &[f64] = &[
        0.0,
        -0.0,
        1.0,
        -1.0,
        0.5,
        -0.5,
        2.0,
        1e-300,
        -1e-300,
        1e300,
        -1e300,
        5e-324,
        -5e-324,
        f64::MIN_POSITIVE,
        f64::MAX,
        f64::MIN,
        0.49999999999999994,
    ];
    prop_oneof![
        3 => -10.0..10.0,
        2 => (-20i32..20).prop_map(|n| f64::from(n) / 2.0),
        1 => (-9i32..9).prop_map(|n| f64::from(n) * FRAC_PI_4),
        1 => any::<u64>().prop_map(f64::from_bits).prop_filter("finite", |a| a.is_finite()),
        1 => proptest::sample::select(SPECIAL),
    ]
}

/// [`any_number`], the infinities and NaN.
pub(super) fn any_value() -> impl Strategy<Value = f64> {
    const BEYOND: &[f64] = &[f64::INFINITY, f64::NEG_INFINITY, f64::NAN];
    prop_oneof![9 => any_number(), 1 => proptest::sample::select(BEYOND)]
}
