//! The block tier against a reference, to the last bit: values and derivatives in f64, values in
//! f32, with the kernels of every instruction set, for random expressions that use every
//! operation and batches of all lengths.

#[path = "engine_common/expressions.rs"]
#[allow(dead_code)]
mod expressions;
#[path = "engine_common/fields.rs"]
mod fields;
#[path = "engine_common/reference.rs"]
mod reference;

use expressions::{PARAMETERS, Random, SPECIAL, direct, expression, points};
use imp::engine::{CompiledField, Field, Kernels, Program, Tier};
use imp::graph::interval::{Enclosure, Regularity, enclose};
use imp::graph::{Graph, Interval, NodeId, Op, derive};
use reference::{Real, evaluate};
use std::sync::Arc;

const EXPRESSIONS: u64 = 3_000;

/// The instruction sets that this processor can execute.
fn kernels() -> impl Iterator<Item = Kernels> {
    Kernels::ALL
        .into_iter()
        .filter(|kernels| kernels.or_narrower() == *kernels)
}

fn program(graph: &Graph, roots: &[NodeId], kernels: Kernels) -> Program {
    let program = Program::with_tier(graph, roots, 3, Tier::Block(kernels));
    assert_eq!(program.tier(1), Tier::Block(kernels));
    program
}

/// The values of the program's own parameters.
fn own(program: &Program, q: &[f64]) -> Vec<f64> {
    let parameters = program.parameters().iter();
    parameters.map(|&index| q[index as usize]).collect()
}

fn slices<T>(columns: &[Vec<T>]) -> Vec<&[T]> {
    columns.iter().map(|column| &column[..]).collect()
}

fn slices_mut<T>(columns: &mut [Vec<T>]) -> Vec<&mut [T]> {
    columns.iter_mut().map(|column| &mut column[..]).collect()
}

/// Compares columns of results with the roots' values at the points.
fn compare<T: Real>(
    found: &[Vec<T>],
    (graph, roots): (&Graph, &[NodeId]),
    points: &[Vec<T>],
    q: &[f64],
    what: &str,
) {
    assert_eq!(found.len(), roots.len());
    for index in 0..points[0].len() {
        let point: [T; 3] = std::array::from_fn(|axis| points[axis][index]);
        let expected = evaluate(graph, roots, point, q);
        for (output, (column, expected)) in found.iter().zip(expected).enumerate() {
            assert!(
                column[index].same(expected),
                "{what}, output {output} at {:e} {:e} {:e}: {:e} instead of {expected:e}",
                point[0],
                point[1],
                point[2],
                column[index],
            );
        }
    }
}

fn random_q(random: &mut Random, special: bool) -> [f64; PARAMETERS] {
    std::array::from_fn(|_| match special {
        false => random.uniform(-2.0, 2.0),
        true => random.choose(SPECIAL),
    })
}

/// Values of one quarter of the expressions, in both types and with all kernels.
fn compare_values(quarter: u64) {
    for seed in (quarter..EXPRESSIONS).step_by(4) {
        let mut graph = Graph::new();
        let root = expression(&mut graph, seed);
        let random = &mut Random(seed ^ 0xb10c);
        let q = random_q(random, seed % 8 < 2);
        let double = points(random, 45, 30);
        let single = double
            .each_ref()
            .map(|column| column.iter().map(|&x| x as f32).collect::<Vec<_>>());
        for kernels in kernels() {
            let program = program(&graph, &[root], kernels);
            let own = own(&program, &q);
            let what = format!("seed {seed}, {kernels:?}");
            let mut found = vec![vec![0.5; double[0].len()]];
            program.evaluate_batch(&slices(&double), &own, &mut slices_mut(&mut found));
            compare(&found, (&graph, &[root]), &double, &q, &what);
            let mut found = vec![vec![0.5; single[0].len()]];
            assert!(program.evaluate_batch_f32(
                &slices(&single),
                &own,
                &mut slices_mut(&mut found)
            ));
            compare(
                &found,
                (&graph, &[root]),
                &single,
                &q,
                &format!("f32, {what}"),
            );
        }
    }
}

#[test]
fn values_are_exact_in_quarter_0() {
    compare_values(0);
}

#[test]
fn values_are_exact_in_quarter_1() {
    compare_values(1);
}

#[test]
fn values_are_exact_in_quarter_2() {
    compare_values(2);
}

#[test]
fn values_are_exact_in_quarter_3() {
    compare_values(3);
}

#[test]
fn derivatives_are_exact() {
    for seed in 0..600 {
        let mut graph = Graph::new();
        let root = expression(&mut graph, seed);
        let random = &mut Random(seed ^ 0xdeb1);
        let q = random_q(random, false);
        let points = points(random, 50, 20);
        for kernels in kernels() {
            let program = Arc::new(program(&graph, &[root], kernels));
            let mut variables: Vec<NodeId> = (0..3).map(|axis| graph.coordinate(axis)).collect();
            for &index in program.parameters() {
                variables.push(graph.parameter(index as usize));
            }
            let mut nodes = vec![root];
            nodes.extend(derive::reverse(&mut graph, root, &variables));
            let field = CompiledField::new(program.clone(), own(&program, &q));
            let mut found = vec![vec![0.5; points[0].len()]; nodes.len()];
            let mut outputs = slices_mut(&mut found);
            let (values, rest) = outputs.split_at_mut(1);
            let (gradients, parameters) = rest.split_at_mut(3);
            field.parameter_gradients(&slices(&points), values[0], gradients, parameters);
            let what = format!("seed {seed}, {kernels:?}");
            compare(&found, (&graph, &nodes), &points, &q, &what);
        }
    }
}

#[test]
fn fields_of_hundreds_of_operations_are_exact() {
    for mut example in [fields::torus(), fields::blobs(14), fields::spheres(100)] {
        let random = &mut Random(7);
        let points = points(random, 600, 40);
        for kernels in kernels() {
            let program = Arc::new(program(&example.graph, &[example.root], kernels));
            let mut variables: Vec<NodeId> =
                (0..3).map(|axis| example.graph.coordinate(axis)).collect();
            for &index in program.parameters() {
                variables.push(example.graph.parameter(index as usize));
            }
            let mut nodes = vec![example.root];
            nodes.extend(derive::reverse(
                &mut example.graph,
                example.root,
                &variables,
            ));
            let field = CompiledField::new(program, example.q.clone());
            let mut found = vec![vec![0.5; points[0].len()]; nodes.len()];
            let mut outputs = slices_mut(&mut found);
            let (values, rest) = outputs.split_at_mut(1);
            let (gradients, parameters) = rest.split_at_mut(3);
            field.parameter_gradients(&slices(&points), values[0], gradients, parameters);
            let what = format!("{}, {kernels:?}", example.name);
            compare(&found, (&example.graph, &nodes), &points, &example.q, &what);
        }
    }
}

#[test]
fn batches_of_any_length_give_the_same_bits_and_write_nothing_else() {
    let mut graph = Graph::new();
    let roots: Vec<NodeId> = (40..48).map(|seed| expression(&mut graph, seed)).collect();
    let q = [0.3, -1.2, 0.7];
    let points = points(&mut Random(3), 900, 124);
    let mut whole = Vec::new();
    for index in 0..1024 {
        let point = points.each_ref().map(|column| column[index]);
        whole.push(evaluate(&graph, &roots, point, &q));
    }
    for kernels in kernels() {
        let program = program(&graph, &roots, kernels);
        let own = own(&program, &q);
        for length in [
            0, 1, 2, 63, 64, 65, 127, 128, 129, 255, 256, 511, 512, 513, 1000, 1024,
        ] {
            for start in [0, 1024 - length] {
                let part: Vec<&[f64]> = points
                    .iter()
                    .map(|column| &column[start..start + length])
                    .collect();
                // Longer than the points: the rest must stay.
                let mut found = vec![vec![0.25; length + 3]; roots.len()];
                program.evaluate_batch(&part, &own, &mut slices_mut(&mut found));
                for (output, column) in found.iter().enumerate() {
                    for (index, &value) in column[..length].iter().enumerate() {
                        let expected = whole[start + index][output];
                        assert!(
                            value.same(expected),
                            "{kernels:?}, {length} from {start}, {index}: {value:e} {expected:e}"
                        );
                    }
                    assert_eq!(column[length..], [0.25; 3]);
                }
            }
        }
    }
}

#[test]
fn outputs_may_be_leaves_and_parts_of_each_other() {
    let mut graph = Graph::new();
    let [x, y] = [0, 1].map(|axis| graph.coordinate(axis));
    let q = graph.parameter(0);
    let constant = graph.constant(2.5);
    let uniform = graph.apply(Op::Add, &[q, constant]);
    let sum = graph.apply(Op::Add, &[x, y]);
    let root = graph.apply(Op::Multiply, &[sum, q]);
    let roots = [x, constant, root, sum, uniform, root, q, y, sum];
    let points = points(&mut Random(5), 100, 0);
    for kernels in kernels() {
        let program = program(&graph, &roots, kernels);
        let mut found = vec![vec![0.0; 100]; roots.len()];
        program.evaluate_batch(&slices(&points), &[0.75], &mut slices_mut(&mut found));
        compare(
            &found,
            (&graph, &roots),
            &points,
            &[0.75],
            &format!("{kernels:?}"),
        );
    }
}

#[test]
fn columns_that_are_missing_or_short_count_as_empty() {
    let mut graph = Graph::new();
    let [x, y] = [0, 1].map(|axis| graph.coordinate(axis));
    let root = graph.apply(Op::Add, &[x, y]);
    let program = Program::with_tier(&graph, &[root], 2, Tier::Block(Kernels::widest()));
    let mut output = [7.0; 4];
    program.evaluate_batch(&[&[1.0; 4]], &[], &mut [&mut output]);
    assert_eq!(output, [7.0; 4]);
    program.evaluate_batch(&[&[1.0; 4], &[2.0; 2]], &[], &mut [&mut output]);
    assert_eq!(output, [3.0, 3.0, 7.0, 7.0]);
    program.evaluate_batch(&[&[1.0; 4], &[2.0; 4]], &[], &mut []);
}

/// A box with sides of all kinds, and points in it.
fn random_box(random: &mut Random) -> ([Interval; 3], Vec<[f64; 3]>) {
    let sides: [Interval; 3] = std::array::from_fn(|_| match random.below(8) {
        0 => Interval::ENTIRE,
        1 => {
            let (a, b) = (random.choose(SPECIAL), random.choose(SPECIAL));
            Interval::new(a.min(b), a.max(b))
        }
        2 => Interval::point(random.uniform(-2.0, 2.0)),
        3 => Interval::new(0.0, random.uniform(0.0, 3.0)),
        4 => Interval::new(random.uniform(-3.0, 0.0), 0.0),
        _ => {
            let a = random.uniform(-3.0, 3.0);
            Interval::new(a, a + random.uniform(0.0, 2.0) * random.uniform(0.0, 1.0))
        }
    });
    let point = |random: &mut Random| {
        sides.map(|side| {
            let inside = random.uniform(side.low.max(-1e3), side.high.min(1e3));
            let candidate = match random.below(4) {
                0 => side.low,
                1 => side.high,
                _ => inside,
            };
            if side.contains(candidate) {
                candidate
            } else {
                inside
            }
        })
    };
    let points = (0..8).map(|_| point(random)).collect();
    (sides, points)
}

/// Batches of boxes for one quarter of the expressions: their enclosures hold those of the
/// table's rules, are no more regular, hold the values at points, and are the same with all
/// kernels. Returns how many ranges were compared and how many were equally tight, to a relative
/// difference of 1e-9. (The bounds of regularity and range by the rules' are no theorem, but hold
/// for these seeds; that the values are contained is one.)
fn compare_enclosures(quarter: u64) -> (usize, usize) {
    let (mut compared, mut tight) = (0, 0);
    for seed in (quarter..EXPRESSIONS).step_by(4) {
        let mut graph = Graph::new();
        let root = expression(&mut graph, seed);
        let parts = graph.reachable(&[root]);
        let random = &mut Random(seed ^ 0xb0c5);
        let q = random_q(random, seed % 8 < 2);
        let boxes: Vec<_> = (0..70).map(|_| random_box(random)).collect();
        let column = |axis: usize| boxes.iter().map(|(sides, _)| sides[axis]).collect();
        let columns: [Vec<Interval>; 3] = std::array::from_fn(column);
        let mut first: Option<Vec<Enclosure>> = None;
        for kernels in kernels() {
            let program = program(&graph, &[root], kernels);
            let unset = Enclosure::of_number(0.123);
            let mut found = vec![vec![unset; boxes.len()]];
            program.enclose_batch(
                &slices(&columns),
                &own(&program, &q),
                &mut slices_mut(&mut found),
            );
            assert!(
                *first.get_or_insert(found[0].clone()) == found[0],
                "seed {seed}: {kernels:?}"
            );
        }
        for ((sides, points), found) in boxes.iter().zip(first.unwrap()) {
            let ruled = enclose(&graph, &[root], sides, |index| q[index as usize])[0];
            let what = format!("seed {seed} on {sides:?} with {q:?}: {found:?} and {ruled:?}");
            assert!(found.regularity <= ruled.regularity, "{what}");
            let (range, rule) = (found.range, ruled.range);
            // The rule's own ends may lie outside of the true range by a few units.
            let reach = |a: f64| 1e-12 * a.abs().min(f64::MAX) + 1e-300;
            assert!(
                rule.is_empty()
                    || (range.low <= rule.low + reach(rule.low)
                        && rule.high - reach(rule.high) <= range.high),
                "{what}"
            );
            compared += 1;
            let close =
                |a: f64, b: f64| a == b || (a - b).abs() <= 1e-9 * a.abs().max(b.abs()).max(1e-300);
            tight += usize::from(close(range.low, rule.low) && close(range.high, rule.high));
            let is_in_box = |point: &&[f64; 3]| {
                let mut pairs = point.iter().zip(sides);
                pairs.all(|(&x, side)| x.is_finite() && side.contains(x))
            };
            for &point in points.iter().filter(is_in_box) {
                // An infinite intermediate result is undefined, whatever becomes of it.
                let values = direct(&graph, &parts, point, &q);
                let value = values[values.len() - 1];
                if values.iter().any(|value| value.is_infinite()) {
                    continue;
                }
                if value.is_nan() {
                    assert!(
                        found.regularity == Regularity::Partial,
                        "NaN at {point:?}: {what}"
                    );
                } else if values.iter().all(|value| value.is_finite()) {
                    assert!(range.contains(value), "{value:e} at {point:?}: {what}");
                }
            }
        }
    }
    (compared, tight)
}

#[test]
fn enclosures_hold_values_and_rules_in_quarter_0() {
    let (compared, tight) = compare_enclosures(0);
    assert!(
        compared > 50_000 && tight > compared / 10 * 9,
        "{tight} of {compared}"
    );
}

#[test]
fn enclosures_hold_values_and_rules_in_quarter_1() {
    let (compared, tight) = compare_enclosures(1);
    assert!(
        compared > 50_000 && tight > compared / 10 * 9,
        "{tight} of {compared}"
    );
}

#[test]
fn enclosures_hold_values_and_rules_in_quarter_2() {
    let (compared, tight) = compare_enclosures(2);
    assert!(
        compared > 50_000 && tight > compared / 10 * 9,
        "{tight} of {compared}"
    );
}

#[test]
fn enclosures_hold_values_and_rules_in_quarter_3() {
    let (compared, tight) = compare_enclosures(3);
    assert!(
        compared > 50_000 && tight > compared / 10 * 9,
        "{tight} of {compared}"
    );
}
