//! Tests of enclosures: nothing escapes, ends are tight, regularity is true.

use std::f64::consts::PI;

use proptest::prelude::*;

use super::{Enclosure, Interval, Regularity, enclose};
use crate::graph::test_support::{any_number, cases, evaluate, expression};
use crate::graph::{Graph, NodeId, Op};

/// Sides of boxes: of any width, and down to single numbers.
fn any_side() -> impl Strategy<Value = Interval> {
    let between = |a: f64, b: f64| Interval::new(a.min(b), a.max(b));
    prop_oneof![
        6 => (any_number(), any_number()).prop_map(move |(a, b)| between(a, b)),
        3 => (any_number(), 0.0..1.0).prop_map(move |(a, w)| between(a, a + w * a.abs())),
        1 => any_number().prop_map(move |a| between(a, a)),
        1 => any_number().prop_map(move |a| between(a, f64::INFINITY)),
    ]
}

/// The number at this fraction of the way through a side.
fn inside(side: Interval, fraction: f64) -> f64 {
    let [low, high] = [side.low, side.high].map(|end| end.clamp(f64::MIN, f64::MAX));
    let number = low * (1.0 - fraction) + high * fraction;
    number.clamp(low, high)
}

proptest! {
    #![proptest_config(cases(30_000))]

    #[test]
    fn no_value_escapes_its_enclosure(
        op in prop::sample::select(Op::ALL),
        sides in [any_side(), any_side(), any_side()],
        fractions in prop::collection::vec(prop::array::uniform3(0.0..=1.0), 6),
        exponent in -9i32..10,
    ) {
        let mut sides = sides;
        if op == Op::IntegerPower {
            sides[1] = Interval::point(f64::from(exponent));
        }
        let operands = sides.map(Enclosure::of_interval);
        let enclosure = (op.operation().interval)(&operands[..op.arity()]);
        let ends = [[0.0; 3], [1.0; 3], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]];
        for fractions in fractions.iter().chain(&ends) {
            let point: Vec<f64> =
                sides.iter().zip(fractions).map(|(side, t)| inside(*side, *t)).collect();
            let value = op.value([point[0], point[1], point[2]]);
            if value.is_finite() {
                prop_assert!(
                    enclosure.range.contains(value),
                    "{op:?} {sides:?} at {point:?}: {value:?} is not in {enclosure:?}"
                );
            }
            if value.is_nan() {
                prop_assert_eq!(enclosure.regularity, Regularity::Partial, "{:?} {:?}", op, sides);
            }
        }
    }
}

proptest! {
    #![proptest_config(cases(3000))]

    #[test]
    fn no_value_of_a_random_expression_escapes(
        steps in prop::collection::vec((prop::sample::select(Op::ALL), any::<[u8; 3]>()), 1..10),
        sides in [any_side(), any_side(), any_side()],
        fractions in prop::collection::vec(prop::array::uniform3(0.0..=1.0), 6),
    ) {
        let mut graph = Graph::new();
        let mut nodes: Vec<NodeId> = (0..3).map(|axis| graph.coordinate(axis)).collect();
        nodes.extend([0.5, 3.0].map(|value| graph.constant(value)));
        for (op, places) in steps {
            let operands = places.map(|place| nodes[nodes.len() - 1 - usize::from(place) % nodes.len()]);
            nodes.push(graph.apply(op, &operands[..op.arity()]));
        }
        let enclosures = enclose(&graph, &nodes, &sides, |_| 0.0);
        for fractions in fractions {
            let point: Vec<f64> =
                sides.iter().zip(fractions).map(|(side, t)| inside(*side, t)).collect();
            for (&node, enclosure) in nodes.iter().zip(&enclosures) {
                let value = evaluate(&graph, node, &point, &[]);
                if value.is_infinite() {
                    // Overflow and poles are not real numbers; what follows from them is not
                    // either.
                    break;
                }
                prop_assert!(value.is_nan() || enclosure.range.contains(value), "{value}");
            }
        }
    }
}

/// The enclosure of an expression over a square.
fn over(text: &str, x: (f64, f64), y: (f64, f64)) -> Enclosure {
    let mut graph = Graph::new();
    let root = expression(&mut graph, text);
    let sides = [Interval::new(x.0, x.1), Interval::new(y.0, y.1)];
    enclose(&graph, &[root], &sides, |_| f64::NAN)[0]
}

fn range(text: &str, low: f64, high: f64) -> (f64, f64) {
    let range = over(text, (low, high), (0.0, 0.0)).range;
    (range.low, range.high)
}

#[test]
fn arithmetic_is_the_tightest_possible() {
    let tenth = Interval::point(0.1);
    let third = Interval::point(1.0) / Interval::point(3.0);
    assert_eq!(
        (third.low, third.high),
        (1.0 / 3.0, (1.0f64 / 3.0).next_up())
    );
    let sum = tenth + Interval::point(0.2);
    assert_eq!(
        (sum.low, sum.high),
        (0.3f64.next_up().next_down(), 0.1 + 0.2)
    );
    assert_eq!(range("sqrt x", -1.0, 4.0), (0.0, 2.0));
    assert_eq!(
        range("sqrt x", 2.0, 2.0),
        (2f64.sqrt().next_down(), 2f64.sqrt())
    );
    assert_eq!(range("multiply x 3", -2.0, 5.0), (-6.0, 15.0));
    assert_eq!(range("multiply x x", -2.0, 1.0), (0.0, 4.0));
    assert_eq!(range("power x 3", -2.0, 3.0), (-8.0, 27.0));
    assert_eq!(range("power x 4", -2.0, 1.0), (0.0, 16.0));
    assert_eq!(
        range("add x 1e308", 1e308, 1.7e308),
        (f64::MAX, f64::INFINITY)
    );
    assert_eq!(range("multiply x 1e-200", 1e-200, 1.0), (0.0, 1e-200));
}

#[test]
fn undefined_arguments_are_left_out() {
    assert_eq!(
        range("divide 1 x", -1.0, 2.0),
        (f64::NEG_INFINITY, f64::INFINITY)
    );
    assert_eq!(range("divide 1 x", 0.0, 2.0), (0.5, f64::INFINITY));
    assert_eq!(
        range("divide x x", 0.0, 0.0),
        (f64::INFINITY, f64::NEG_INFINITY)
    );
    assert_eq!(
        range("log x", -2.0, 0.0),
        (f64::INFINITY, f64::NEG_INFINITY)
    );
    assert_eq!(range("log x", -2.0, 1.0), (f64::NEG_INFINITY, 0.0));
    assert_eq!(
        range("power x -1", -1.0, 2.0),
        (f64::NEG_INFINITY, f64::INFINITY)
    );
    assert_eq!(range("power x -2", -1.0, 0.5), (1.0, f64::INFINITY));
    assert_eq!(range("power x 0.5", -1.0, 1.0), (0.0, 1.0));
    let (low, high) = range("acos x", -2.0, 1.0);
    assert!(low == 0.0 && (PI..=PI.next_up()).contains(&high));
    let infinite = Enclosure::of_number(f64::INFINITY);
    assert_eq!(infinite.regularity, Regularity::Partial);
}

#[test]
fn waves_reach_one_exactly_where_a_crest_lies_inside() {
    assert_eq!(range("sin x", 1.0, 2.0).1, 1.0);
    assert!(range("sin x", 1.0, 1.5).1 < 1.0);
    assert_eq!(range("sin x", 4.0, 5.0).0, -1.0);
    assert_eq!(range("cos x", -0.5, 0.5).1, 1.0);
    assert_eq!(range("cos x", 3.0, 3.5).0, -1.0);
    assert_eq!(range("sin x", 0.0, 6.2), (-1.0, 1.0));
    assert_eq!(range("sin x", 1e300, 1.1e300), (-1.0, 1.0));
    // From just after a crest almost round to the next one: the same quarter at both ends.
    assert!(range("sin x", 1.6, 7.8).1 < 1.0);
    assert_eq!(range("sin x", 1.5, 7.7), (-1.0, 1.0));
    assert_eq!(range("tan x", 1.0, 2.0), (f64::NEG_INFINITY, f64::INFINITY));
    let (low, high) = range("tan x", -1.0, 1.0);
    assert!(-1.5575 < low && high < 1.5575);
}

#[test]
fn angles_jump_across_the_negative_axis_only() {
    let angle = |x, y| over("atan2 y x", x, y);
    let around = angle((-2.0, -1.0), (-1.0, 1.0));
    assert_eq!(around.range, Interval::new(-PI.next_up(), PI.next_up()));
    assert_eq!(around.regularity, Regularity::Defined);
    let above = angle((-2.0, -1.0), (0.0, 1.0));
    assert!(above.range.low > 2.35 && above.regularity == Regularity::Continuous);
    assert_eq!(
        angle((0.0, 1.0), (0.0, 1.0)).regularity,
        Regularity::Defined
    );
    assert_eq!(angle((1.0, 2.0), (0.0, 0.0)).range, Interval::new(0.0, 0.0));
    assert_eq!(angle((0.0, 0.0), (0.0, 0.0)).range, Interval::new(0.0, 0.0));
}

#[test]
fn remainders_stay_within_the_period() {
    assert_eq!(range("mod x 1", 0.25, 3.5), (0.0, 1.0));
    assert_eq!(range("mod x 1", 3.25, 3.5), (0.25, 0.5));
    assert_eq!(
        over("mod x 1", (3.25, 3.5), (0.0, 0.0)).regularity,
        Regularity::Continuous
    );
    assert_eq!(
        over("mod x 1", (3.25, 4.5), (0.0, 0.0)).regularity,
        Regularity::Defined
    );
    assert_eq!(range("mod x -1", 0.25, 3.5), (-1.0, 0.0));
}

#[test]
fn comparisons_and_choices_know_what_is_certain() {
    assert_eq!(range("less x 2", 0.0, 1.0), (1.0, 1.0));
    assert_eq!(range("less x 2", 2.0, 3.0), (0.0, 0.0));
    assert_eq!(range("less_equal x 2", 0.0, 2.0), (1.0, 1.0));
    assert_eq!(range("less x 2", 1.0, 3.0), (0.0, 1.0));
    assert_eq!(range("equal x 2", 2.0, 2.0), (1.0, 1.0));
    assert_eq!(range("equal x 2", 3.0, 4.0), (0.0, 0.0));
    assert_eq!(range("select less x 2 exp x 7", 3.0, 4.0), (7.0, 7.0));
    assert_eq!(range("select less x 2 x 7", 1.0, 3.0), (1.0, 7.0));
    // Where √x is NaN the comparison is false: the other branch cannot be left out.
    assert_eq!(range("less sqrt x 5", -1.0, 1.0), (0.0, 1.0));
    assert_eq!(range("select less sqrt x 5 1 9", -1.0, 1.0), (1.0, 9.0));
    // NaN is not 0, so it chooses the first branch.
    assert_eq!(range("select sqrt x 1 9", -1.0, 0.0), (1.0, 9.0));
    let jump = over("select less x 2 x 7", (1.0, 3.0), (0.0, 0.0));
    assert_eq!(jump.regularity, Regularity::Defined);
}

#[test]
fn regularity_tells_poles_steps_and_smooth_functions_apart() {
    let regularity = |text, low, high| over(text, (low, high), (0.0, 1.0)).regularity;
    assert_eq!(regularity("divide 1 x", -1.0, 1.0), Regularity::Partial);
    assert_eq!(regularity("divide 1 x", 1.0, 2.0), Regularity::Continuous);
    assert_eq!(regularity("tan x", 1.0, 2.0), Regularity::Partial);
    assert_eq!(regularity("floor x", 0.5, 1.5), Regularity::Defined);
    assert_eq!(regularity("floor x", 0.5, 0.9), Regularity::Continuous);
    assert_eq!(regularity("exp floor x", 0.5, 1.5), Regularity::Defined);
    assert_eq!(regularity("power x 3", -1.0, 1.0), Regularity::Continuous);
    assert_eq!(regularity("power x 0.5", -1.0, 1.0), Regularity::Partial);
    assert_eq!(regularity("max abs x y", -1.0, 1.0), Regularity::Continuous);
    let gated = "select is_number exp x exp x NaN";
    assert_eq!(regularity(gated, 0.0, 1.0), Regularity::Continuous);
}
