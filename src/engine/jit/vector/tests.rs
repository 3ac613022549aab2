//! Code for many points against the interpreter (f64) and the block tier (f32), bit for bit.

use super::*;
use crate::engine::test_expressions::{PARAMETERS, Random, SPECIAL, expression, points};
use crate::engine::{interpret, lower, tape};
use crate::graph::{Graph, NodeId, Op};

#[path = "../../../../tests/engine_common/fields.rs"]
mod fields;

/// Cuts everywhere.
const SHORT: Lengths = Lengths { whole: 0, chunk: 3 };

/// A type, and what it must agree with.
trait Tested: Vectorised + std::fmt::Debug {
    /// The outputs, columns as long as the points'.
    fn expected(lowered: &Lowered, points: &[Vec<Self>], uniforms: &[f64]) -> Vec<Vec<Self>>;
    /// The bits, with one NaN.
    fn bits(self) -> u64;
}

impl Tested for f64 {
    fn expected(lowered: &Lowered, points: &[Vec<f64>], uniforms: &[f64]) -> Vec<Vec<f64>> {
        let count = points[0].len();
        let mut columns = vec![vec![0.0; count]; lowered.outputs.len()];
        for index in 0..count {
            let point = std::array::from_fn(|axis| points[axis][index]);
            let output = |output: usize, value| columns[output][index] = value;
            interpret::evaluate(lowered, &point, uniforms, &mut Vec::new(), output);
        }
        columns
    }

    fn bits(self) -> u64 {
        if self.is_nan() { f64::NAN } else { self }.to_bits()
    }
}

impl Tested for f32 {
    fn expected(lowered: &Lowered, points: &[Vec<f32>], uniforms: &[f64]) -> Vec<Vec<f32>> {
        let count = points[0].len();
        let mut columns = vec![vec![0.0; count]; lowered.outputs.len()];
        let tape = tape::assemble(lowered);
        let scalars = uniforms.iter().chain(&tape.constants);
        let scalars: Vec<f32> = scalars.map(|&scalar| scalar as f32).collect();
        let points: Vec<&[f32]> = points.iter().map(|column| &column[..]).collect();
        let mut outputs: Vec<&mut [f32]> = columns.iter_mut().map(|c| &mut c[..]).collect();
        let kernels = Kernels::Baseline;
        assert!(block::run(
            &tape,
            kernels,
            count,
            &points,
            &scalars,
            &mut outputs
        ));
        columns
    }

    fn bits(self) -> u64 {
        if self.is_nan() { f32::NAN } else { self }.to_bits().into()
    }
}

/// The outputs of the first `count` points, in columns that are longer by one.
fn run<T: Tested>(
    code: &VectorCode<T>,
    count: usize,
    points: &[Vec<T>],
    uniforms: &[f64],
) -> Vec<Vec<T>> {
    let mut outputs = vec![vec![T::rounded(0.25); count + 1]; code.outputs];
    let mut columns: Vec<&mut [T]> = outputs.iter_mut().map(|column| &mut column[..]).collect();
    let points: Vec<&[T]> = points.iter().map(|column| &column[..count]).collect();
    let uniforms: Vec<T> = uniforms
        .iter()
        .map(|&uniform| T::rounded(uniform))
        .collect();
    assert!(code.run(count, &points, &uniforms, &mut columns));
    outputs
}

/// Compares the code with what it must agree with, in batches of these lengths.
fn check<T: Tested>(
    lowered: &Lowered,
    lengths: Lengths,
    points: &[Vec<f64>; 3],
    counts: impl IntoIterator<Item = usize> + Clone,
    what: &str,
) {
    for kernels in possible() {
        let what = format!("{what}, {kernels:?}");
        let code: VectorCode<T> = compile_with(lowered, kernels, lengths).unwrap();
        check_code(&code, lowered, points, counts.clone(), &what);
    }
}

/// The kernels that this processor can execute.
fn possible() -> impl Iterator<Item = Kernels> {
    let is_possible = |kernels: &Kernels| kernels.or_narrower() == *kernels;
    Kernels::ALL.into_iter().filter(is_possible)
}

/// The same for code of one width.
fn check_code<T: Tested>(
    code: &VectorCode<T>,
    lowered: &Lowered,
    points: &[Vec<f64>; 3],
    counts: impl IntoIterator<Item = usize>,
    what: &str,
) {
    let uniforms = interpret::uniforms(lowered, &[0.7, -1.3, 2.5][..lowered.parameters]);
    let points = points.each_ref().map(|column| {
        let column: Vec<T> = column.iter().map(|&number| T::rounded(number)).collect();
        column
    });
    let expected = T::expected(lowered, &points, &uniforms);
    for count in counts {
        let found = run(code, count, &points, &uniforms);
        for (output, (found, expected)) in found.iter().zip(&expected).enumerate() {
            for index in 0..count {
                let (found, expected) = (found[index], expected[index]);
                assert_eq!(
                    found.bits(),
                    expected.bits(),
                    "{what}, output {output}, point {index} of {count}: {found:?}, not {expected:?}"
                );
            }
            assert_eq!(
                found[count].bits(),
                T::rounded(0.25).bits(),
                "{what} wrote too far"
            );
        }
    }
}

/// An expression with outputs of every kind.
fn outputs(seed: u64) -> Lowered {
    let mut graph = Graph::new();
    let first = expression(&mut graph, 2 * seed);
    let second = expression(&mut graph, 2 * seed + 1);
    let sine = graph.apply(Op::Sin, &[first]);
    let coordinate = graph.coordinate(1);
    let parameter = graph.parameter(2);
    let root = graph.apply(Op::SquareRoot, &[parameter]);
    let constant = graph.constant(0.1);
    let roots = [
        first, second, sine, coordinate, parameter, root, constant, first,
    ];
    lower::lower(&graph, &roots, 3, PARAMETERS)
}

#[test]
fn random_expressions_have_the_same_bits() {
    for seed in 0..400 {
        let lowered = outputs(seed);
        let points = points(&mut Random(seed), 40, 91);
        let what = format!("expression {seed}");
        for lengths in [WIDE_LENGTHS, SHORT] {
            check::<f64>(&lowered, lengths, &points, [131], &what);
            check::<f32>(&lowered, lengths, &points, [131], &what);
        }
    }
}

/// Every operation of the table on all pairs of special numbers, and a select on them.
#[test]
fn special_numbers_have_the_same_bits() {
    let mut graph = Graph::new();
    let [x, y, z] = [0, 1, 2].map(|axis| graph.coordinate(axis));
    let three = graph.constant(3.0);
    let roots: Vec<NodeId> = (Op::ALL.iter())
        .map(|&op| match op {
            Op::IntegerPower => graph.apply(op, &[x, three]),
            _ => graph.apply(op, &[x, y, z][..op.arity()]),
        })
        .collect();
    let lowered = lower::lower(&graph, &roots, 3, 0);
    let count = SPECIAL.len();
    let of_pairs = |place: fn(usize, usize) -> usize| -> Vec<f64> {
        let pairs = (0..count * count).map(|pair| place(pair / count, pair % count));
        pairs.map(|place| SPECIAL[place % SPECIAL.len()]).collect()
    };
    let points = [
        of_pairs(|a, _| a),
        of_pairs(|_, b| b),
        of_pairs(|a, b| a + 2 * b),
    ];
    check::<f64>(&lowered, LENGTHS, &points, [count * count], "f64");
    check::<f32>(&lowered, LENGTHS, &points, [count * count], "f32");
}

#[test]
fn batches_of_any_length_give_the_same() {
    // Code alone, and code with functions.
    for example in [fields::torus(), fields::blobs(5)] {
        let parameters = example.q.len();
        let lowered = lower::lower(&example.graph, &[example.root], 3, parameters.min(3));
        let points = points(&mut Random(7), 200, 0);
        let counts = || (0..=70).chain([127, 128, 130, 200]);
        for lengths in [WIDE_LENGTHS, SHORT] {
            check::<f64>(&lowered, lengths, &points, counts(), example.name);
            check::<f32>(&lowered, lengths, &points, counts(), example.name);
        }
    }
}

/// A long kernel whose values and functions depend on each other across many chunks.
#[test]
fn long_kernels_give_the_same() {
    let ops = [
        Op::Add,
        Op::Multiply,
        Op::Min,
        Op::Subtract,
        Op::Max,
        Op::Select,
        Op::LessEqual,
        Op::ChainProduct,
        Op::Hypot,
        Op::Sin,
    ];
    // Hundreds of values are alive at a time; without functions in one piece, too.
    for (count, ops) in [(3_000, &ops[..]), (3_000, &ops[..8]), (9_000, &ops[..8])] {
        long_kernel_gives_the_same(count, ops);
    }
}

fn long_kernel_gives_the_same(count: usize, ops: &[Op]) {
    let mut graph = Graph::new();
    let random = &mut Random(3);
    let mut nodes: Vec<NodeId> = (0..3).map(|axis| graph.coordinate(axis)).collect();
    for _ in 0..count {
        let op = random.choose(ops);
        let operands: [NodeId; 3] = std::array::from_fn(|_| {
            let recent = nodes.len().min(300);
            nodes[nodes.len() - 1 - random.below(recent)]
        });
        nodes.push(graph.apply(op, &operands[..op.arity()]));
    }
    let roots = &nodes[nodes.len() - 20..];
    let lowered = lower::lower(&graph, roots, 3, 0);
    let points = points(random, 100, 10);
    for lengths in [LENGTHS, WIDE_LENGTHS] {
        check::<f64>(&lowered, lengths, &points, [110], "long, f64");
        check::<f32>(&lowered, lengths, &points, [110], "long, f32");
    }
}

#[test]
fn functions_that_do_not_depend_on_each_other_stand_together() {
    // Σ exp(−(x − c)²) of 14 terms: one group, between the arguments and the sum.
    let example = fields::blobs(14);
    let lowered = lower::lower(&example.graph, &[example.root], 3, example.q.len());
    let stages = stages::stages(
        &lowered,
        Lengths {
            whole: 256,
            chunk: 256,
        },
    );
    assert_eq!(stages.stages, [Stage::Code, Stage::Functions, Stage::Code]);
    assert_eq!(stages.plan.chunks[1].len(), 14);
    // sin sin … x: each is a group, and two slots are enough.
    let mut graph = Graph::new();
    let mut root = graph.coordinate(0);
    for _ in 0..500 {
        root = graph.apply(Op::Sin, &[root]);
    }
    let stages = stages::stages(&lower::lower(&graph, &[root], 1, 0), LENGTHS);
    assert_eq!(stages.stages.len(), 1_001);
    assert!(stages.plan.slots <= 2, "{} slots", stages.plan.slots);
}

#[test]
fn wrong_lengths_are_refused() {
    let lowered = outputs(1);
    let code: VectorCode<f32> = compile(&lowered, Kernels::widest()).unwrap();
    let uniforms = vec![0.5; code.uniforms];
    let (x, short) = ([0.0; 4], [0.0; 3]);
    let mut outputs = vec![vec![0.0; 4]; lowered.outputs.len()];
    let mut columns: Vec<&mut [f32]> = outputs.iter_mut().map(|column| &mut column[..]).collect();
    assert!(code.run(4, &[&x, &x, &x], &uniforms, &mut columns));
    assert!(!code.run(4, &[&x, &x, &short], &uniforms, &mut columns));
    assert!(!code.run(4, &[&x, &x], &uniforms, &mut columns));
    assert!(!code.run(4, &[&x, &x, &x], &uniforms[1..], &mut columns));
    assert!(!code.run(5, &[&x, &x, &x], &uniforms, &mut columns));
    columns.pop();
    assert!(!code.run(4, &[&x, &x, &x], &uniforms, &mut columns));
}
