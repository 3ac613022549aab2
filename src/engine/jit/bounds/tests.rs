//! Code for enclosures of one box against the table's interval rules and against values.

use super::*;
use crate::engine::lower;
use crate::engine::test_expressions::{PARAMETERS, Random, SPECIAL, direct, expression};
use crate::graph::interval::enclose;
use crate::graph::{Graph, NodeId};

/// Cuts everywhere.
const SHORT: Lengths = Lengths { whole: 0, chunk: 3 };

/// What is the same for all boxes, as the code takes it: parameters, and by the table's rules
/// what is computed of them alone.
fn uniforms(lowered: &Lowered, q: &[f64]) -> Vec<BoxNumber> {
    let mut found: Vec<Enclosure> = q.iter().map(|&q| Enclosure::of_number(q)).collect();
    for step in &lowered.uniform_steps {
        let operands = step.operands.map(|operand| match operand {
            Operand::Uniform(index) => found[index as usize],
            Operand::Constant(number) => Enclosure::of_number(number),
            _ => unreachable!("a uniform depends on no point"),
        });
        found.push((step.operation.operation().interval)(
            &operands[..step.operation.arity()],
        ));
    }
    found.into_iter().map(BoxNumber::from).collect()
}

/// A side: ordinary, of one number, with special ends, unbounded, or empty.
fn side(random: &mut Random) -> Interval {
    let number = |random: &mut Random| match random.below(3) {
        0 => random.choose(SPECIAL),
        _ => random.uniform(-2.0, 2.0),
    };
    match random.below(8) {
        0 => Interval::point(number(random)),
        1 | 2 => {
            let (a, b) = (number(random), number(random));
            Interval::new(a.min(b), a.max(b))
        }
        3 if random.below(4) == 0 => random.choose(&[Interval::ENTIRE, Interval::EMPTY]),
        _ => {
            let low = random.uniform(-2.0, 2.0);
            Interval::new(low, low + random.uniform(0.0, 0.5))
        }
    }
}

/// A finite number in a side that is not empty.
fn inside(side: Interval, random: &mut Random) -> f64 {
    let [low, high] = [side.low, side.high].map(|end| end.clamp(f64::MIN, f64::MAX));
    let between = random.uniform(0.0, 1.0);
    let fraction = random.choose(&[0.0, 1.0, between]);
    (low * (1.0 - fraction) + high * fraction).clamp(low, high)
}

/// The processor rounds as little as possible, and the table's rules as it does.
fn assert_same(found: &[Enclosure], expected: &[Enclosure], what: &str) {
    for (output, (found, expected)) in found.iter().zip(expected).enumerate() {
        let is_same = match expected.range.is_empty() {
            true => found.range.is_empty(),
            false => found.range == expected.range,
        };
        let is_same = is_same && found.regularity == expected.regularity;
        assert!(
            is_same,
            "{what}, output {output}: {found:?}, not {expected:?}"
        );
    }
}

/// What the code finds.
fn run(code: &BoxCode, sides: &[Interval; 3], uniforms: &[BoxNumber]) -> Vec<Enclosure> {
    let mut found = Vec::new();
    code.run(sides, uniforms, |output, enclosure| {
        assert_eq!(output, found.len());
        found.push(enclosure);
    });
    found
}

#[test]
fn single_operations_have_the_enclosures_of_the_table() {
    let mut graph = Graph::new();
    let [x, y, z] = [0, 1, 2].map(|axis| graph.coordinate(axis));
    let constants = [3.0, -0.75, 0.0, f64::INFINITY].map(|number| graph.constant(number));
    let mut roots: Vec<NodeId> = Vec::new();
    for &op in Op::ALL {
        roots.push(match op {
            Op::IntegerPower => graph.apply(op, &[x, constants[0]]),
            _ => graph.apply(op, &[x, y, z][..op.arity()]),
        });
        if op.arity() == 2 && op != Op::IntegerPower {
            for constant in constants {
                roots.push(graph.apply(op, &[x, constant]));
                roots.push(graph.apply(op, &[constant, y]));
            }
        }
    }
    let lowered = lower::list(&graph, &roots, 3, 0);
    for lengths in [LENGTHS, SHORT] {
        let code = compile_with(&lowered, lengths).unwrap();
        let random = &mut Random(1);
        for index in 0..3_000 {
            let sides: [Interval; 3] = std::array::from_fn(|_| side(random));
            let expected = enclose(&graph, &roots, &sides, |_| f64::NAN);
            let found = run(&code, &sides, &[]);
            assert_same(&found, &expected, &format!("box {index} {sides:?}"));
        }
    }
}

#[test]
fn random_expressions_hold_their_values() {
    for seed in 0..600 {
        let mut graph = Graph::new();
        let roots = [2 * seed, 2 * seed + 1].map(|seed| expression(&mut graph, seed));
        let lowered = lower::list(&graph, &roots, 3, PARAMETERS);
        let random = &mut Random(seed);
        for lengths in [LENGTHS, SHORT] {
            let code = compile_with(&lowered, lengths).unwrap();
            for _ in 0..20 {
                let sides: [Interval; 3] = std::array::from_fn(|_| side(random));
                let mut q = [0.7, -1.3, 2.5];
                if random.below(8) == 0 {
                    q[random.below(3)] = random.choose(SPECIAL);
                }
                let found = run(&code, &sides, &uniforms(&lowered, &q));
                let expected = enclose(&graph, &roots, &sides, |place| q[place as usize]);
                let what = format!("expression {seed}, {sides:?}, {q:?}");
                assert_same(&found, &expected, &what);
                if sides.iter().any(|side| side.is_empty()) {
                    continue;
                }
                for _ in 0..4 {
                    let point = sides.map(|side| inside(side, random));
                    let values = direct(&graph, &graph.reachable(&roots), point, &q);
                    let defined = values.iter().all(|value| value.is_finite());
                    for (found, value) in found.iter().zip(direct(&graph, &roots, point, &q)) {
                        let holds = found.range.contains(value);
                        assert!(!defined || holds, "{what}: {value} is not in {found:?}");
                    }
                }
            }
        }
    }
}
