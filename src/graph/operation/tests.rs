//! Tests of the table as a whole, and of value rules at their special points.

use proptest::prelude::*;

use super::{Derivative, MachineCode};
use crate::graph::test_support::{any_value, cases, evaluate, same};
use crate::graph::{Graph, NodeId, Op};

#[test]
fn every_entry_is_named_and_documented_and_its_rules_agree_on_the_arity() {
    for (index, &op) in Op::ALL.iter().enumerate() {
        let operation = op.operation();
        assert_eq!(op as usize, index);
        assert!(
            operation.documentation.ends_with('.'),
            "{}",
            operation.documentation
        );
        assert!(!operation.documentation.starts_with(' '));
        assert_eq!(
            Op::ALL
                .iter()
                .filter(|other| other.name() == op.name())
                .count(),
            1
        );
        match operation.derivative {
            Derivative::Partials(partials) => assert_eq!(partials.len(), op.arity(), "{op:?}"),
            Derivative::Branch {
                taken, otherwise, ..
            } => {
                assert!(taken < op.arity() && otherwise < op.arity());
            }
            Derivative::Zero => {}
        }
    }
}

/// The result of an operation's lowering on these numbers, which stand in it as coordinates; an
/// integer power's exponent as a constant.
fn lowered(op: Op, operands: [f64; 3]) -> f64 {
    let MachineCode::Lower(lower) = op.operation().code else {
        panic!("{op:?} has no lowering");
    };
    let mut graph = Graph::new();
    let mut nodes: Vec<NodeId> = (0..3).map(|axis| graph.coordinate(axis)).collect();
    if op == Op::IntegerPower {
        nodes[1] = graph.constant(operands[1]);
    }
    let root = lower(&mut graph, &nodes[..op.arity()]);
    evaluate(&graph, root, &operands, &[])
}

proptest! {
    #![proptest_config(cases(4000))]

    #[test]
    fn lowerings_give_the_bits_of_the_value_rules(a in any_value(), b in any_value()) {
        for op in [Op::Sign, Op::Round, Op::Modulo] {
            let expected = op.value([a, b, 0.0]);
            prop_assert!(same(lowered(op, [a, b, 0.0]), expected), "{op:?} {a:?} {b:?}");
        }
    }

    #[test]
    fn lowered_integer_powers_give_the_bits_of_power(
        a in any_value(),
        n in prop_oneof![-12i32..12, -1024i32..=1024],
    ) {
        let operands = [a, f64::from(n), 0.0];
        prop_assert!(same(lowered(Op::IntegerPower, operands), Op::Power.value(operands)));
    }
}

#[test]
fn powers_follow_their_rules_at_special_points() {
    let power = |a, b| Op::Power.value([a, b, 0.0]);
    assert_eq!(power(0.0, 0.0), 1.0);
    assert_eq!(power(f64::INFINITY, 0.0), 1.0);
    assert_eq!(power(0.0, -1.0), f64::INFINITY);
    assert_eq!(power(-2.0, 3.0), -8.0);
    assert_eq!(power(-2.0, -2.0), 0.25);
    assert!(power(-8.0, 1.0 / 3.0).is_nan());
    assert!(power(f64::NAN, 0.0).is_nan());
    assert!(power(1.0, f64::NAN).is_nan());
    // By squaring: x⁵ = x·x⁴ and x³ = x·x², each product rounded.
    let x: f64 = 1.1;
    assert_eq!(power(x, 5.0), x * ((x * x) * (x * x)));
    assert_eq!(power(x, -3.0), 1.0 / (x * (x * x)));
    // √2 to the nearest, and an exponent that is too large for repeated multiplication.
    assert_eq!(power(2.0, 0.5), std::f64::consts::SQRT_2);
    assert_eq!(power(-1.0, 1025.0), -1.0);
}

#[test]
fn rounding_is_to_the_nearest_and_halves_go_away_from_zero() {
    let cases = [
        (0.5, 1.0),
        (-0.5, -1.0),
        (1.5, 2.0),
        (2.5, 3.0),
        (-2.5, -3.0),
        (0.49999999999999994, 0.0),
        (-0.49999999999999994, -0.0),
        (-0.0, -0.0),
        (4503599627370495.5, 4503599627370496.0),
        (9007199254740993.0, 9007199254740993.0),
        (f64::NEG_INFINITY, f64::NEG_INFINITY),
    ];
    for (a, expected) in cases {
        assert!(same(Op::Round.value([a, 0.0, 0.0]), expected), "{a}");
    }
}

#[test]
fn minimum_and_maximum_keep_nan_and_order_the_zeros() {
    for (a, b) in [(0.0, -0.0), (-0.0, 0.0)] {
        assert!(same(Op::Min.value([a, b, 0.0]), -0.0));
        assert!(same(Op::Max.value([a, b, 0.0]), 0.0));
    }
    for op in [Op::Min, Op::Max, Op::Hypot] {
        assert!(op.value([f64::NAN, f64::INFINITY, 0.0]).is_nan());
        assert!(op.value([f64::NEG_INFINITY, f64::NAN, 0.0]).is_nan());
    }
    assert_eq!(Op::Hypot.value([3.0, -4.0, 0.0]), 5.0);
}

#[test]
fn comparisons_with_nan_are_false_and_an_exact_zero_absorbs_in_a_chain_product() {
    for op in [Op::Less, Op::LessEqual, Op::Equal] {
        assert_eq!(op.value([f64::NAN, f64::NAN, 0.0]), 0.0);
        assert_eq!(op.value([1.0, f64::NAN, 0.0]), 0.0);
    }
    for other in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1.0] {
        assert_eq!(Op::ChainProduct.value([0.0, other, 0.0]), 0.0);
        assert_eq!(Op::ChainProduct.value([other, -0.0, 0.0]), 0.0);
    }
    assert_eq!(
        Op::ChainProduct.value([2.0, f64::INFINITY, 0.0]),
        f64::INFINITY
    );
    assert_eq!(Op::Modulo.value([-1.0, 3.0, 0.0]), 2.0);
    assert_eq!(Op::Modulo.value([1.0, -3.0, 0.0]), -2.0);
}
