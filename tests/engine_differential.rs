//! Derivatives against differences, on 1,000 random expressions that use every operation.

#[path = "engine_common/expressions.rs"]
mod expressions;

#[path = "engine_common/results.rs"]
mod results;

use expressions::{PARAMETERS, Random, direct, expression, points};
use imp::engine::{CompiledField, Program};
use imp::graph::{Graph, Node, NodeId, Op};
use results::Results;
use std::sync::Arc;

const EXPRESSIONS: u64 = 1_000;

/// Runs `check` on the expressions of one quarter; the quarters run in parallel.
fn quarter(number: u64, mut check: impl FnMut(u64)) {
    for seed in (number..EXPRESSIONS).step_by(4) {
        check(seed);
    }
}

#[test]
fn expressions_use_every_operation() {
    let mut uses = vec![0; Op::ALL.len()];
    for seed in 0..EXPRESSIONS {
        let mut graph = Graph::new();
        let root = expression(&mut graph, seed);
        for id in graph.reachable(&[root]) {
            if let Node::Apply(op, _) = graph.node(id) {
                uses[op as usize] += 1;
            }
        }
    }
    for (op, uses) in Op::ALL.iter().zip(uses) {
        assert!(uses >= 50, "{} occurs only {uses} times", op.name());
    }
}

/// A derivative by differences, with an estimate of its error: from two first steps, so that an
/// accidental agreement over a jump is no estimate.
fn differences(f: impl Fn(f64) -> f64) -> (f64, f64) {
    let (coarse, fine) = (ridders(&f, 0.02), ridders(&f, 0.003));
    (fine.0, (fine.0 - coarse.0).abs() + coarse.1.max(fine.1))
}

/// Richardson extrapolation of central differences to step 0 (Ridders 1982): the derivative at 0
/// and its error.
fn ridders(f: &impl Fn(f64) -> f64, step: f64) -> (f64, f64) {
    const ROWS: usize = 10;
    const SHRINK: f64 = 1.4;
    let mut table = [[0.0; ROWS]; ROWS];
    let mut best = (f64::NAN, f64::INFINITY);
    let mut step = step;
    for row in 0..ROWS {
        table[row][0] = (f(step) - f(-step)) / (2.0 * step);
        let mut factor = SHRINK * SHRINK;
        for order in 1..=row {
            let (coarse, fine) = (table[row - 1][order - 1], table[row][order - 1]);
            table[row][order] = (fine * factor - coarse) / (factor - 1.0);
            factor *= SHRINK * SHRINK;
            let error = (table[row][order] - fine)
                .abs()
                .max((table[row][order] - coarse).abs());
            if error < best.1 {
                best = (table[row][order], error);
            }
        }
        step /= SHRINK;
    }
    best
}

/// Whether everything that the root is made of is finite and no operation is where its partial
/// derivative is infinite: there differences tell nothing.
fn is_well_conditioned(graph: &Graph, parts: &[NodeId], point: [f64; 3], q: &[f64]) -> bool {
    let values = direct(graph, parts, point, q);
    let value = |id: NodeId| values[parts.binary_search(&id).unwrap()];
    parts.iter().all(|&id| {
        let smooth = match graph.node(id) {
            Node::Apply(Op::Asin | Op::Acos, [a, ..]) => value(a).abs() < 1.0 - 1e-9,
            Node::Apply(Op::SquareRoot | Op::Log, [a, ..]) => value(a) > 1e-9,
            Node::Apply(Op::Power, [a, ..]) => value(a).abs() > 1e-9,
            Node::Apply(Op::Hypot | Op::Atan2, [a, b, _]) => value(a).hypot(value(b)) > 1e-9,
            _ => true,
        };
        smooth && value(id).is_finite()
    })
}

/// Compares F_x and F_q with differences on one quarter; returns how many comparisons were made
/// of derivatives that are not 0, and how many in all.
fn compare_derivatives(number: u64) -> (usize, usize) {
    let (mut nonzero, mut all) = (0, 0);
    quarter(number, |seed| {
        let mut graph = Graph::new();
        let root = expression(&mut graph, seed);
        let parts = graph.reachable(&[root]);
        let program = Arc::new(Program::new(&graph, &[root], 3));
        let random = &mut Random(seed ^ 0xd1ff);
        for _ in 0..2 {
            let q: [f64; PARAMETERS] = std::array::from_fn(|_| random.uniform(-2.0, 2.0));
            let own: Vec<f64> = program
                .parameters()
                .iter()
                .map(|&p| q[p as usize])
                .collect();
            let points = points(random, 8, 0);
            let results = Results::of(&CompiledField::new(program.clone(), own), &points);
            let mut variables: Vec<usize> = vec![0, 1, 2];
            variables.extend(program.parameters().iter().map(|&index| 3 + index as usize));
            for index in 0..points[0].len() {
                let point = points.each_ref().map(|column| column[index]);
                if !is_well_conditioned(&graph, &parts, point, &q) {
                    continue;
                }
                for (column, &variable) in results.columns().skip(1).zip(&variables) {
                    let along = |offset: f64| {
                        let (mut point, mut q) = (point, q);
                        match variable {
                            axis @ 0..3 => point[axis] += offset,
                            parameter => q[parameter - 3] += offset,
                        }
                        direct(&graph, &[root], point, &q)[0]
                    };
                    let (expected, error) = differences(along);
                    let scale = expected.abs().max(1.0);
                    if error < 1e-7 * scale && expected.abs() < 1e6 {
                        let found = column[index];
                        let tolerance = 100.0 * error + 1e-8 * scale;
                        assert!(
                            (found - expected).abs() <= tolerance,
                            "seed {seed}, variable {variable} at {point:?} {q:?}: {found} but by differences {expected} ± {error:e}"
                        );
                        all += 1;
                        nonzero += usize::from(expected.abs() > 1e-6);
                    }
                }
            }
        }
    });
    (nonzero, all)
}

#[test]
fn derivatives_are_those_of_differences_in_quarters_0_and_2() {
    let (nonzero, all) = compare_derivatives(0);
    assert!(nonzero > 2_000 && all > 6_000, "{nonzero} of {all}");
    let (nonzero, all) = compare_derivatives(2);
    assert!(nonzero > 2_000 && all > 6_000, "{nonzero} of {all}");
}

#[test]
fn derivatives_are_those_of_differences_in_quarters_1_and_3() {
    let (nonzero, all) = compare_derivatives(1);
    assert!(nonzero > 2_000 && all > 6_000, "{nonzero} of {all}");
    let (nonzero, all) = compare_derivatives(3);
    assert!(nonzero > 2_000 && all > 6_000, "{nonzero} of {all}");
}
