//! Graphs of unusual size and depth, and unusual points: nothing hangs, overflows the stack or
//! fails silently.

use glam::DVec3;
use imp::engine::{CompiledField, Field, Program, Tier};
use imp::graph::{Graph, Interval, NodeId, Op};
use std::sync::Arc;

/// x + q₀ + q₀ + …: a chain of so many sums, each a node of its own.
fn chain(graph: &mut Graph, length: usize) -> NodeId {
    let x = graph.coordinate(0);
    let step = graph.parameter(0);
    let mut sum = x;
    for _ in 0..length {
        sum = graph.apply(Op::Add, &[sum, step]);
    }
    sum
}

fn field(graph: &Graph, root: NodeId, q: Vec<f64>) -> CompiledField {
    CompiledField::new(Arc::new(Program::new(graph, &[root], 1)), q)
}

#[test]
fn a_chain_of_a_million_operations_is_evaluated() {
    const LENGTH: usize = 1_000_000;
    let mut graph = Graph::new();
    let root = chain(&mut graph, LENGTH);
    // A power of two, so that every sum is exact.
    let step = (0.5_f64).powi(20);
    let field = field(&graph, root, vec![step]);
    let expected = 0.5 + LENGTH as f64 * step;
    assert_eq!(field.value(DVec3::X * 0.5), expected);
    let (value, gradient) = field.value_gradient(DVec3::X * 0.5);
    assert_eq!((value, gradient), (expected, DVec3::X));
    let (mut values, mut slopes, mut rates) = ([0.0], [0.0], [0.0]);
    let (slopes, rates) = (&mut [&mut slopes[..]], &mut [&mut rates[..]]);
    field.parameter_gradients(&[&[0.5]], &mut values, slopes, rates);
    assert_eq!(rates[0][0], LENGTH as f64);
    let mut enclosure = [Interval::EMPTY];
    let side = Interval::new(0.0, 1.0);
    field.program().enclose(&[side], &[step], &mut enclosure);
    assert!(enclosure[0].contains(expected) && enclosure[0].contains(expected + 0.5));
}

#[test]
fn five_million_nodes_are_evaluated() {
    const LENGTH: usize = 5_000_000;
    let mut graph = Graph::new();
    let root = chain(&mut graph, LENGTH);
    assert!(graph.len() > LENGTH);
    let step = (0.5_f64).powi(22);
    let field = field(&graph, root, vec![step]);
    drop(graph);
    let points: Vec<f64> = (0..100).map(f64::from).collect();
    let mut values = vec![0.0; 100];
    field.values(&[&points], &mut values);
    for (value, point) in values.iter().zip(&points) {
        assert_eq!(*value, point + LENGTH as f64 * step);
    }
}

#[test]
fn a_hundred_thousand_values_alive_at_a_time_fit() {
    // Σ sin(kx)·cos of the sum of all of them: everything is needed twice.
    let mut graph = Graph::new();
    let x = graph.coordinate(0);
    let terms: Vec<NodeId> = (0..100_000)
        .map(|k| {
            let k = graph.constant(f64::from(k));
            graph.apply(Op::Add, &[x, k])
        })
        .collect();
    let sum = |graph: &mut Graph, terms: &[NodeId]| {
        let mut sum = terms[0];
        for &term in &terms[1..] {
            sum = graph.apply(Op::Add, &[sum, term]);
        }
        sum
    };
    let total = sum(&mut graph, &terms);
    let products: Vec<NodeId> = terms
        .iter()
        .map(|&term| graph.apply(Op::Min, &[term, total]))
        .collect();
    let root = sum(&mut graph, &products);
    // 0 + 1 + … + 99,999 twice, all whole numbers.
    let expected = 4_999_950_000.0;
    for tier in [Tier::Automatic, Tier::MachineCode, Tier::Interpreter] {
        let program = Program::with_tier(&graph, &[root], 1, tier);
        let mut found = [0.0];
        program.evaluate(&[0.0], &[], &mut found);
        assert_eq!(found[0], expected, "{tier:?}");
    }
}

#[test]
fn unusual_points_give_what_arithmetic_gives() {
    let mut graph = Graph::new();
    let x = graph.coordinate(0);
    let nan = graph.constant(f64::NAN);
    let undefined = graph.apply(Op::Add, &[x, nan]);
    let doubled = graph.apply(Op::Add, &[x, x]);
    for tier in Tier::ALL.map(|(_, tier)| tier) {
        let program = Program::with_tier(&graph, &[undefined, doubled], 1, tier);
        for point in [0.0, 5e-324, f64::MAX, f64::INFINITY, f64::NAN] {
            let mut found = [0.0; 2];
            program.evaluate(&[point], &[], &mut found);
            assert!(found[0].is_nan());
            assert_eq!(found[1].to_bits(), (point + point).to_bits(), "{point}");
        }
        let mut enclosures = [Interval::ENTIRE; 2];
        program.enclose(&[Interval::ENTIRE], &[], &mut enclosures);
        assert!(enclosures[0].is_empty());
        assert_eq!(enclosures[1], Interval::ENTIRE);
        program.enclose(&[Interval::EMPTY], &[], &mut enclosures);
        assert!(enclosures[1].is_empty());
    }
}

#[test]
fn a_parameter_that_is_no_number_makes_no_number() {
    let mut graph = Graph::new();
    let root = chain(&mut graph, 3);
    for q in [vec![f64::NAN], vec![], vec![f64::INFINITY], vec![1e308]] {
        let field = field(&graph, root, q.clone());
        let expected = match q.first() {
            Some(q) => 1.0 + q + q + q,
            None => f64::NAN,
        };
        let found = field.value(DVec3::X);
        assert!(found == expected || (found.is_nan() && expected.is_nan()));
    }
}
