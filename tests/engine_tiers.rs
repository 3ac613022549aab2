//! All tiers with all instruction sets against each other and against the value rules, to the last
//! bit, on 10,000 random expressions; of every tenth also F_x and F_q.

#[path = "engine_common/expressions.rs"]
mod expressions;

#[path = "engine_common/results.rs"]
mod results;

use expressions::{PARAMETERS, Random, SPECIAL, direct, expression, points, same};
use imp::engine::{CompiledField, Field, Program, Tier};
use imp::graph::{Graph, NodeId, derive};
use results::{Results, assert_same};
use std::sync::Arc;

const EXPRESSIONS: u64 = 10_000;

/// The expressions of which derivatives are compared too.
const WITH_DERIVATIVES: u64 = 10;

/// The expression's nodes for F, F_x and F_q, as [`Results::columns`] has them.
fn derivatives(graph: &mut Graph, root: NodeId, parameters: &[u32]) -> Vec<NodeId> {
    let mut variables: Vec<NodeId> = (0..3).map(|axis| graph.coordinate(axis)).collect();
    variables.extend(
        parameters
            .iter()
            .map(|&index| graph.parameter(index as usize)),
    );
    let mut nodes = vec![root];
    nodes.extend(derive::reverse(graph, root, &variables));
    nodes
}

/// The tiers that this processor can execute as they are.
fn tiers() -> impl Iterator<Item = (&'static str, Tier)> {
    let is_possible = |&(_, tier): &(&str, Tier)| match tier {
        Tier::Block(kernels) | Tier::Vector(kernels) => kernels.or_narrower() == kernels,
        _ => true,
    };
    Tier::ALL.into_iter().filter(is_possible)
}

/// F alone, or F, F_x and F_q.
fn columns(program: Program, q: &[f64], points: &[Vec<f64>; 3], all: bool) -> Vec<Vec<f64>> {
    let field = CompiledField::new(Arc::new(program), q.to_vec());
    if all {
        return Results::of(&field, points).columns().cloned().collect();
    }
    let mut values = vec![0.0; points[0].len()];
    field.values(&points.each_ref().map(|column| &column[..]), &mut values);
    vec![values]
}

/// Compares the tiers on one quarter and counts the numbers that were compared.
fn compare_tiers(quarter: u64) -> usize {
    let mut compared = 0;
    for seed in (quarter..EXPRESSIONS).step_by(4) {
        let mut graph = Graph::new();
        let root = expression(&mut graph, seed);
        let random = &mut Random(seed ^ 0x5eed);
        let is_special = random.uniform(0.0, 3.0) < 1.0;
        let all: [f64; PARAMETERS] = std::array::from_fn(|_| match is_special {
            false => random.uniform(-2.0, 2.0),
            true => random.choose(SPECIAL),
        });
        let points = points(random, 12, 20);
        let with_derivatives = (seed / 4).is_multiple_of(WITH_DERIVATIVES);
        let new = |tier| Program::with_tier(&graph, &[root], 3, tier);
        let reference = new(Tier::Interpreter);
        let parameters = reference.parameters().to_vec();
        let q: Vec<f64> = parameters.iter().map(|&p| all[p as usize]).collect();
        let expected = columns(reference, &q, &points, with_derivatives);
        for (name, tier) in tiers() {
            let program = new(tier);
            if tier != Tier::Automatic {
                assert_eq!(program.tier(points[0].len()), tier);
            }
            let found = columns(program, &q, &points, with_derivatives);
            for (a, b) in found.iter().zip(&expected) {
                assert_same(a, b, &format!("seed {seed}: {name} and interpreter"));
                compared += a.len();
            }
        }
        let nodes = match with_derivatives {
            true => derivatives(&mut graph, root, &parameters),
            false => vec![root],
        };
        for index in 0..points[0].len() {
            let point = points.each_ref().map(|column| column[index]);
            let by_rule = direct(&graph, &nodes, point, &all);
            for (column, by_rule) in expected.iter().zip(by_rule) {
                let found = column[index];
                assert!(
                    same(found, by_rule),
                    "seed {seed} at {point:?}: {found:e}, by rule {by_rule:e}"
                );
            }
        }
    }
    compared
}

// Each quarter has 2,500 expressions, 32 points, and on every processor four tiers.
const NUMBERS: usize = 4 * 32 * 2_500;

#[test]
fn tiers_agree_bit_for_bit_in_quarter_0() {
    assert!(compare_tiers(0) > NUMBERS);
}

#[test]
fn tiers_agree_bit_for_bit_in_quarter_1() {
    assert!(compare_tiers(1) > NUMBERS);
}

#[test]
fn tiers_agree_bit_for_bit_in_quarter_2() {
    assert!(compare_tiers(2) > NUMBERS);
}

#[test]
fn tiers_agree_bit_for_bit_in_quarter_3() {
    assert!(compare_tiers(3) > NUMBERS);
}
