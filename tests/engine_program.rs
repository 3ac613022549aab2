//! Programs and compiled fields as samplers, polygonizers and the language use them.

#[path = "engine_common/fields.rs"]
mod fields;

use fields::Example;
use glam::DVec3;
use imp::engine::{CompiledField, Field, Kernels, Program, Tier};
use imp::graph::interval::Interval;
use imp::graph::{Graph, NodeId, Op};
use rayon::prelude::*;
use std::sync::Arc;

fn compile(example: &Example) -> CompiledField {
    let program = Program::new(&example.graph, &[example.root], 3);
    CompiledField::new(Arc::new(program), example.q.clone())
}

/// F, F_x and F_q at one point.
fn derivatives(field: &CompiledField, point: [f64; 3]) -> (f64, Vec<f64>, Vec<f64>) {
    let points = point.map(|coordinate| [coordinate]);
    let mut value = [0.0];
    let mut gradient = vec![[0.0]; field.dimension()];
    let mut parameters = vec![[0.0]; field.parameters().len()];
    let mut gradients: Vec<&mut [f64]> = gradient.iter_mut().map(|c| &mut c[..]).collect();
    let mut parameter_gradients: Vec<&mut [f64]> =
        parameters.iter_mut().map(|c| &mut c[..]).collect();
    let columns = points.each_ref().map(|column| &column[..]);
    field.parameter_gradients(
        &columns,
        &mut value,
        &mut gradients,
        &mut parameter_gradients,
    );
    (value[0], gradient.concat(), parameters.concat())
}

/// A field of x, y, z that `build` makes of the coordinates.
fn field_of(build: impl FnOnce(&mut Graph, [NodeId; 3]) -> NodeId) -> CompiledField {
    let mut graph = Graph::new();
    let coordinates = [0, 1, 2].map(|axis| graph.coordinate(axis));
    let root = build(&mut graph, coordinates);
    CompiledField::new(Arc::new(Program::new(&graph, &[root], 3)), Vec::new())
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-14 * b.abs().max(1.0)
}

#[test]
fn the_torus_has_its_closed_form_derivatives() {
    let field = compile(&fields::torus());
    assert_eq!(field.program().tier(1), Tier::MachineCode);
    for [x, y, z] in [[1.3, 0.0, 0.1], [0.2, -0.7, 0.25], [-1.1, 0.4, -0.2]] {
        let (value, gradient, parameters) = derivatives(&field, [x, y, z]);
        let rho = (x * x + y * y).sqrt();
        assert!(close(value, (rho - 1.0).powi(2) + z * z - 0.09));
        let expected = [
            2.0 * (rho - 1.0) * x / rho,
            2.0 * (rho - 1.0) * y / rho,
            2.0 * z,
        ];
        for (found, expected) in gradient.into_iter().zip(expected) {
            assert!(close(found, expected), "{found} is not {expected}");
        }
        assert!(close(parameters[0], -2.0 * (rho - 1.0)));
        assert!(close(parameters[1], -0.6));
        let (alone, normal) = field.value_gradient(DVec3::new(x, y, z));
        assert_eq!(alone, value);
        assert!(close(normal.x, expected[0]) && close(normal.z, expected[2]));
    }
}

#[test]
fn blobs_have_their_closed_form_derivatives() {
    let example = fields::blobs(3);
    let field = compile(&example);
    let point = [0.1, -0.2, 0.3];
    let (value, gradient, parameters) = derivatives(&field, point);
    let mut expected = (0.5, [0.0; 3]);
    for (index, blob) in example.q.chunks_exact(4).enumerate() {
        let size = blob[3];
        let difference: [f64; 3] = std::array::from_fn(|axis| point[axis] - blob[axis]);
        let squared: f64 = difference.iter().map(|d| d * d).sum();
        let gaussian = (-squared / (size * size)).exp();
        expected.0 -= gaussian;
        for axis in 0..3 {
            let slope = 2.0 * difference[axis] / (size * size) * gaussian;
            expected.1[axis] += slope;
            assert!(close(parameters[4 * index + axis], -slope));
        }
        assert!(close(
            parameters[4 * index + 3],
            -2.0 * squared / size.powi(3) * gaussian
        ));
    }
    assert!(close(value, expected.0));
    for (found, expected) in gradient.into_iter().zip(expected.1) {
        assert!(close(found, expected));
    }
    assert_eq!(parameters[12], 1.0);
}

#[test]
fn parameters_keep_their_session_wide_names() {
    let mut graph = Graph::new();
    let [unused, late, early, x] = [
        graph.parameter(5),
        graph.parameter(9),
        graph.parameter(2),
        graph.coordinate(0),
    ];
    graph.apply(Op::Add, &[unused, x]);
    let product = graph.apply(Op::Multiply, &[late, x]);
    let root = graph.apply(Op::Subtract, &[product, early]);
    let program = Arc::new(Program::new(&graph, &[root], 1));
    assert_eq!(program.parameters(), [2, 9]);
    let field = CompiledField::new(program, vec![10.0, 3.0]);
    let (value, gradient, parameters) = derivatives(&field, [4.0, 0.0, 0.0]);
    assert_eq!(
        (value, gradient, parameters),
        (2.0, vec![3.0], vec![-1.0, 4.0])
    );
}

#[test]
fn delicate_points_follow_the_rules() {
    let abs = field_of(|graph, [x, ..]| graph.apply(Op::Abs, &[x]));
    assert_eq!(derivatives(&abs, [0.0; 3]).1, [0.0; 3]);
    let norm = field_of(|graph, [x, y, _]| {
        let squares = [x, y].map(|c| graph.apply(Op::Square, &[c]));
        let sum = graph.apply(Op::Add, &squares);
        graph.apply(Op::SquareRoot, &[sum])
    });
    assert_eq!(derivatives(&norm, [0.0; 3]).1, [0.0; 3]);
    for op in [Op::Min, Op::Max] {
        let choice = field_of(|graph, [x, y, _]| graph.apply(op, &[x, y]));
        let (_, tie, _) = derivatives(&choice, [2.0, 2.0, 0.0]);
        assert_eq!(tie, [1.0, 0.0, 0.0], "{}", op.name());
        let (value, gradient, _) = derivatives(&choice, [f64::NAN, 2.0, 0.0]);
        assert!(value.is_nan() && gradient[0].is_nan() && gradient[1].is_nan());
    }
    let log = field_of(|graph, [x, ..]| graph.apply(Op::Log, &[x]));
    let (value, gradient, _) = derivatives(&log, [-1.0, 0.0, 0.0]);
    assert!(value.is_nan() && gradient[0].is_nan());
    let branch = field_of(|graph, [x, y, _]| {
        let bad = graph.apply(Op::Log, &[x]);
        let condition = graph.apply(Op::Less, &[x, y]);
        graph.apply(Op::Select, &[condition, y, bad])
    });
    let (value, gradient, _) = derivatives(&branch, [-1.0, 3.0, 0.0]);
    assert_eq!((value, gradient), (3.0, vec![0.0, 1.0, 0.0]));
}

/// Columns of `count` points in [−1, 1]³.
fn columns(count: usize) -> [Vec<f64>; 3] {
    [0.37, 0.73, 0.19].map(|f| (0..count).map(|i| (i as f64 * f) % 2.0 - 1.0).collect())
}

#[test]
fn results_do_not_depend_on_the_batch() {
    for example in [fields::torus(), fields::blobs(14), fields::spheres(100)] {
        let field = compile(&example);
        for count in [0, 1, 2, 63, 64, 65, 200] {
            let points = columns(count);
            let points = points.each_ref().map(|column| &column[..]);
            let mut values = vec![0.0; count];
            let mut gradients = [vec![0.0; count], vec![0.0; count], vec![0.0; count]];
            let [a, b, c] = &mut gradients;
            field.gradients(&points, &mut values, &mut [a, b, c]);
            for index in 0..count {
                let point = DVec3::new(points[0][index], points[1][index], points[2][index]);
                let (value, gradient) = field.value_gradient(point);
                assert_eq!(value, values[index]);
                assert_eq!(value, field.value(point));
                let batch = [0, 1, 2].map(|axis| gradients[axis][index]);
                assert_eq!(gradient.to_array(), batch);
            }
        }
    }
}

#[test]
fn threads_share_a_field() {
    let field = compile(&fields::blobs(14));
    let points = columns(4_000);
    let alone: Vec<f64> = (0..4_000)
        .map(|i| field.value(DVec3::new(points[0][i], points[1][i], points[2][i])))
        .collect();
    // A second field, so that the threads also compete for its compilation.
    let field = compile(&fields::blobs(14));
    let together: Vec<Vec<f64>> = (0..40)
        .into_par_iter()
        .map(|chunk| {
            let range = 100 * chunk..100 * (chunk + 1);
            let points = points.each_ref().map(|column| &column[range.clone()]);
            let mut values = vec![0.0; 100];
            field.values(&points, &mut values);
            values
        })
        .collect();
    assert_eq!(alone, together.concat());
}

#[test]
fn the_shortest_column_counts() {
    for tier in [Tier::MachineCode, Tier::Interpreter] {
        let example = fields::torus();
        let program = Program::with_tier(&example.graph, &[example.root], 3, tier);
        let field = CompiledField::new(Arc::new(program), example.q);
        let (long, short) = ([1.0; 5], [1.0; 3]);
        let mut values = [7.0; 4];
        field.values(&[&long, &short, &long], &mut values);
        assert!(values[..3].iter().all(|&value| value != 7.0));
        assert_eq!(values[3], 7.0);
        let mut values = [7.0; 4];
        field.values(&[&long, &long], &mut values);
        field.gradients(&[&long, &long, &long], &mut values, &mut []);
        assert_eq!(values, [7.0; 4]);
    }
}

#[test]
fn a_program_evaluates_all_its_roots() {
    let mut graph = Graph::new();
    let [x, y] = [0, 1].map(|axis| graph.coordinate(axis));
    let a = graph.parameter(3);
    let constant = graph.constant(2.5);
    let sum = graph.apply(Op::Add, &[x, a]);
    let product = graph.apply(Op::Multiply, &[x, y]);
    let scaled = graph.apply(Op::Exp, &[a]);
    let roots = [sum, product, constant, x, a, scaled, sum];
    for tier in [Tier::MachineCode, Tier::Interpreter] {
        let program = Program::with_tier(&graph, &roots, 2, tier);
        let mut outputs = [0.0; 7];
        program.evaluate(&[3.0, 4.0], &[0.0], &mut outputs);
        assert_eq!(outputs, [3.0, 12.0, 2.5, 3.0, 0.0, 1.0, 3.0]);
        let mut first = [0.0; 2];
        program.evaluate(&[3.0], &[], &mut first);
        assert!(first[0].is_nan() && first[1].is_nan());
        let mut columns = vec![vec![0.0; 2]; 7];
        let mut outputs: Vec<&mut [f64]> = columns.iter_mut().map(|c| &mut c[..]).collect();
        program.evaluate_batch(&[&[3.0, 1.0], &[4.0, 6.0]], &[1.0], &mut outputs);
        assert_eq!(columns[1], [12.0, 6.0]);
        assert_eq!(columns[0], [4.0, 2.0]);
    }
}

#[test]
fn long_programs_are_compiled_in_pieces_and_very_long_ones_run_in_blocks() {
    // F = xₙ of the logistic map xₖ₊₁ = 3.7 xₖ (1 − xₖ): three operations a step, no cancellation.
    let iterate = |graph: &mut Graph, steps: usize| {
        let mut x = graph.coordinate(0);
        let one = graph.constant(1.0);
        let rate = graph.constant(3.7);
        for _ in 0..steps {
            let rest = graph.apply(Op::Subtract, &[one, x]);
            let product = graph.apply(Op::Multiply, &[x, rest]);
            x = graph.apply(Op::Multiply, &[rate, product]);
        }
        x
    };
    for (steps, tier) in [
        (4_000, Tier::MachineCode),
        (100_000, Tier::Block(Kernels::widest())),
    ] {
        let mut graph = Graph::new();
        let root = iterate(&mut graph, steps);
        let program = Program::with_tier(&graph, &[root], 1, Tier::MachineCode);
        assert_eq!(program.tier(1), tier);
        let mut expected = 0.3;
        for _ in 0..steps {
            expected = 3.7 * (expected * (1.0 - expected));
        }
        let mut found = [0.0];
        program.evaluate(&[0.3], &[], &mut found);
        assert_eq!(found[0], expected);
    }
}

#[test]
fn enclosures_contain_the_values() {
    let example = fields::blobs(14);
    let program = Program::new(&example.graph, &[example.root], 3);
    let sides = [
        Interval::new(-0.3, 0.2),
        Interval::new(0.0, 0.4),
        Interval::new(-0.1, 0.1),
    ];
    let mut enclosure = [Interval::EMPTY];
    program.enclose(&sides, &example.q, &mut enclosure);
    let mut value = [0.0];
    for index in 0..200 {
        let point = [0.37, 0.73, 0.19].map(|f| (f64::from(index) * f) % 1.0);
        let point: [f64; 3] = std::array::from_fn(|axis| {
            sides[axis].low + point[axis] * (sides[axis].high - sides[axis].low)
        });
        program.evaluate(&point, &example.q, &mut value);
        assert!(enclosure[0].contains(value[0]));
    }
    assert!(enclosure[0].high - enclosure[0].low < 20.0, "{enclosure:?}");
    program.enclose(&sides[..1], &example.q, &mut enclosure);
    assert!(enclosure[0].is_empty());
}

#[test]
fn a_tier_is_chosen_by_the_size_of_a_batch() {
    let example = fields::torus();
    let program = Program::new(&example.graph, &[example.root], 3);
    assert_eq!(program.tier(512), Tier::Block(Kernels::widest()));
    assert_eq!(program.tier(1), Tier::MachineCode);
    // A million points pay for vectors, whatever their width.
    for _ in 0..2_000 {
        let mut values = [0.0; 512];
        program.evaluate_batch(&[&[0.5; 512][..]; 3], &example.q, &mut [&mut values]);
    }
    assert_eq!(program.tier(512), Tier::Vector(Kernels::widest()));
    assert_eq!(program.tier(1), Tier::MachineCode);
    // 2,800 steps take longer to compile than a few points take in blocks.
    let example = fields::spheres(400);
    let program = Program::new(&example.graph, &[example.root], 3);
    assert_eq!(program.tier(1), Tier::Block(Kernels::widest()));
    for _ in 0..300 {
        let mut values = [0.0; 16];
        program.evaluate_batch(&[&[0.5; 16][..]; 3], &example.q, &mut [&mut values]);
    }
    assert_eq!(program.tier(1), Tier::MachineCode);
    for (name, tier) in Tier::ALL {
        assert_eq!(Tier::named(name), Some(tier));
    }
    assert_eq!(Tier::named("vector"), Some(Tier::Vector(Kernels::Avx512)));
    assert_eq!(Tier::named("block"), Some(Tier::Block(Kernels::Avx512)));
    assert_eq!(Tier::named("avx512"), None);
}

#[test]
fn hessians_are_those_of_the_closed_form() {
    // x² y + exp(z)·x: F_xx = (2y, 2x, e^z; 0, 0; e^z·x).
    let mut graph = Graph::new();
    let [x, y, z] = [0, 1, 2].map(|axis| graph.coordinate(axis));
    let square = graph.apply(Op::Square, &[x]);
    let first = graph.apply(Op::Multiply, &[square, y]);
    let exp = graph.apply(Op::Exp, &[z]);
    let second = graph.apply(Op::Multiply, &[exp, x]);
    let root = graph.apply(Op::Add, &[first, second]);
    let program = Program::new(&graph, &[root], 3);
    let field = CompiledField::new(Arc::new(program), Vec::new());
    for count in [1, 100] {
        let points = [0.5, -2.0, 0.0].map(|side| vec![side; count]);
        let points = points.each_ref().map(|column| &column[..]);
        let mut columns = vec![vec![f64::NAN; count]; 10];
        let mut outputs: Vec<&mut [f64]> = columns.iter_mut().map(|c| &mut c[..]).collect();
        let (values, rest) = outputs.split_at_mut(1);
        let (gradients, hessians) = rest.split_at_mut(3);
        field.hessians(&points, values[0], gradients, hessians);
        // With e⁰ = 1 everything is exact.
        let expected = [0.0, -1.0, 0.25, 0.5, -4.0, 1.0, 1.0, 0.0, 0.0, 0.5];
        for (column, expected) in columns.iter().zip(expected) {
            assert!(column.iter().all(|&found| found == expected));
        }
    }
}

#[test]
fn every_tier_serves_every_dimension() {
    for dimension in 1..=3 {
        let mut graph = Graph::new();
        let mut root = graph.constant(0.0);
        for axis in 0..dimension {
            let coordinate = graph.coordinate(axis);
            let exp = graph.apply(Op::Exp, &[coordinate]);
            root = graph.apply(Op::Add, &[root, exp]);
        }
        for (name, tier) in Tier::ALL {
            let program = Program::with_tier(&graph, &[root], dimension, tier);
            // e⁰ is 1, exactly, wherever it is computed; 130 points are two blocks and a rest.
            let columns = vec![vec![0.0; 130]; dimension];
            let columns: Vec<&[f64]> = columns.iter().map(|column| &column[..]).collect();
            let mut values = vec![0.0; 130];
            program.evaluate_batch(&columns, &[], &mut [&mut values]);
            assert_eq!(
                values,
                vec![dimension as f64; 130],
                "{name} in R{dimension}"
            );
        }
    }
}
