//! Tests of hash-consing and simplification.

use proptest::prelude::*;

use crate::graph::test_support::{any_value, cases, evaluate, expression, same, value_of};
use crate::graph::{Graph, NodeId, Op};

#[test]
fn equal_expressions_are_one_node() {
    let mut graph = Graph::new();
    let pairs = [
        ("add x y", "add y x"),
        ("multiply sin x y", "multiply y sin x"),
        ("hypot x q0", "hypot q0 x"),
        ("equal x y", "equal y x"),
        ("sin add x y", "sin add y x"),
        ("NaN", "-NaN"),
    ];
    for (a, b) in pairs {
        assert_eq!(expression(&mut graph, a), expression(&mut graph, b), "{a}");
    }
    let different = [
        ("subtract x y", "subtract y x"),
        ("min x y", "min y x"),
        ("0.0", "-0.0"),
        ("q0", "q1"),
    ];
    for (a, b) in different {
        assert_ne!(expression(&mut graph, a), expression(&mut graph, b), "{a}");
    }
    assert_eq!(
        graph.apply(Op::Add, &[NodeId(0), NodeId(1)]).index(),
        2,
        "x, y, and their sum"
    );
}

#[test]
fn exact_identities_simplify() {
    let identities = [
        ("add x -0.0", "x"),
        ("add x negate y", "subtract x y"),
        ("add negate x y", "subtract y x"),
        ("subtract x 0.0", "x"),
        ("subtract -0.0 x", "negate x"),
        ("subtract x negate y", "add x y"),
        ("multiply x 1", "x"),
        ("multiply -1 x", "negate x"),
        ("multiply negate x 3", "multiply x -3"),
        ("multiply negate x negate y", "multiply x y"),
        ("multiply x x", "square x"),
        ("divide x 1", "x"),
        ("divide x -1", "negate x"),
        ("divide x 8", "multiply x 0.125"),
        ("divide negate x 3", "divide x -3"),
        ("divide negate x negate y", "divide x y"),
        ("negate negate x", "x"),
        ("abs negate x", "abs x"),
        ("abs abs x", "abs x"),
        ("abs square x", "square x"),
        ("square negate x", "square x"),
        ("cos abs x", "cos x"),
        ("power x 1", "x"),
        ("power x 2", "square x"),
        ("power x 3", "integer_power x 3"),
        ("power negate x -4", "integer_power x -4"),
        ("power x 0.5", "sqrt x"),
        ("integer_power x 0.25", "power x 0.25"),
        ("integer_power x q0", "power x q0"),
        ("integer_power x 2000", "power x 2000"),
        ("floor round x", "round x"),
        ("min x x", "x"),
        ("less x x", "0"),
        ("less_equal x x", "is_number x"),
        ("equal x x", "is_number x"),
        ("is_number less x y", "1"),
        ("select 2 x y", "x"),
        ("select 0 x y", "y"),
        ("select NaN x y", "x"),
        ("select z x x", "x"),
        ("select less x y 1 0", "less x y"),
        ("select z select z x y 1", "select z x 1"),
        ("select z 1 select z x y", "select z 1 y"),
        ("select is_number x x NaN", "x"),
        ("chain_product 0 x", "0"),
        ("chain_product x -3", "multiply x -3"),
        ("chain_product x less y z", "select less y z x 0"),
        ("sin 0.5", "0.479425538604203"),
    ];
    for (written, simpler) in identities {
        let mut graph = Graph::new();
        let simpler = expression(&mut graph, simpler);
        assert_eq!(expression(&mut graph, written), simpler, "{written}");
    }
}

#[test]
fn what_is_not_exact_is_not_folded() {
    let infinity = f64::INFINITY;
    for (text, x) in [
        ("multiply 0 x", infinity),
        ("subtract x x", infinity),
        ("divide x x", 0.0),
        ("divide 0 x", 0.0),
        ("power x 0", f64::NAN),
        ("chain_product x Infinity", f64::NAN),
    ] {
        assert!(value_of(text, &[x]).is_nan(), "{text}");
    }
    for (text, x, expected) in [
        ("add x 0.0", -0.0, 0.0),
        ("subtract 0.0 x", 0.0, 0.0),
        ("negate subtract x 1", 1.0, -0.0),
        ("divide x 3", 5.0, 5.0 / 3.0),
        ("sqrt square x", 1e200, infinity),
        ("divide x 5e-324", 5e-324, 1.0),
    ] {
        assert!(same(value_of(text, &[x]), expected), "{text}");
    }
}

/// The operations whose zeros have a sign to compare.
fn strict_operations() -> Vec<Op> {
    Op::ALL
        .iter()
        .copied()
        .filter(|&op| op != Op::ChainProduct)
        .collect()
}

proptest! {
    #![proptest_config(cases(3000))]

    #[test]
    fn simplification_never_changes_a_bit(
        steps in prop::collection::vec(
            (prop::sample::select(strict_operations()), any::<[u8; 3]>()), 1..12,
        ),
        constants in prop::collection::vec(any_value(), 3),
        points in prop::collection::vec([any_value(), any_value(), any_value()], 8),
    ) {
        let mut graph = Graph::new();
        let mut nodes: Vec<NodeId> = (0..3).map(|axis| graph.coordinate(axis)).collect();
        for value in [1.0, -1.0, 0.0, 2.0].iter().chain(&constants) {
            nodes.push(graph.constant(*value));
        }
        for (op, places) in &steps {
            let operands = places.map(|place| nodes[nodes.len() - 1 - usize::from(place) % nodes.len()]);
            nodes.push(graph.apply(*op, &operands[..op.arity()]));
        }
        for point in points {
            let mut values: Vec<f64> = point.to_vec();
            values.extend([1.0, -1.0, 0.0, 2.0].iter().chain(&constants));
            for (op, places) in &steps {
                let value = |place: u8| values[values.len() - 1 - usize::from(place) % values.len()];
                values.push(op.value(places.map(value)));
            }
            for (&node, &value) in nodes.iter().zip(&values) {
                prop_assert!(same(evaluate(&graph, node, &point, &[]), value));
            }
        }
    }

    #[test]
    fn a_simplified_chain_product_differs_in_the_sign_of_a_zero_at_most(
        a in any_value(), constant in any_value(),
    ) {
        let mut graph = Graph::new();
        let operands = [graph.coordinate(0), graph.constant(constant)];
        let root = graph.apply(Op::ChainProduct, &operands);
        let (simplified, value) =
            (evaluate(&graph, root, &[a], &[]), Op::ChainProduct.value([a, constant, 0.0]));
        prop_assert!(same(simplified, value) || (simplified == 0.0 && value == 0.0));
    }
}
