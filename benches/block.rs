//! The block tier and vectors against machine code and the interpreter: torus, 14 Gaussians with 57
//! parameters, a solid of 100 spheres and a gyroid, in f64 and f32.
//!
//! A table first, whose columns are measured alternately in one run, so that its ratios hold on a
//! busy machine too; then Criterion measures the block tier alone, by instruction set.

// A benchmark's report belongs on standard output.
#![allow(clippy::print_stdout, missing_docs)]

#[path = "../tests/engine_common/fields.rs"]
mod fields;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use fields::Example;
use imp::engine::{CompiledField, Field, Kernels, Program, Tier};
use imp::graph::interval::Enclosure;
use imp::graph::{Graph, Interval, NodeId, Op};
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

/// The points of a call, as a sampler or a picture would have them.
const BATCH: usize = 512;

/// Calls per round, so that a round takes at least some microseconds.
const CALLS: usize = 8;

const ROUNDS: usize = 41;

/// What is evaluated.
const FUNCTIONS: [&str; 3] = ["F", "F, F_x", "F, F_x, F_q"];

/// sin x cos y + sin y cos z + sin z cos x, with a frequency as parameter.
fn gyroid() -> Example {
    let mut graph = Graph::new();
    let frequency = graph.parameter(0);
    let angles: [NodeId; 3] = std::array::from_fn(|axis| {
        let coordinate = graph.coordinate(axis);
        graph.apply(Op::Multiply, &[frequency, coordinate])
    });
    let terms: [NodeId; 3] = std::array::from_fn(|axis| {
        let sine = graph.apply(Op::Sin, &[angles[axis]]);
        let cosine = graph.apply(Op::Cos, &[angles[(axis + 1) % 3]]);
        graph.apply(Op::Multiply, &[sine, cosine])
    });
    let sum = graph.apply(Op::Add, &[terms[0], terms[1]]);
    let root = graph.apply(Op::Add, &[sum, terms[2]]);
    Example {
        name: "gyroid",
        graph,
        root,
        q: vec![4.0],
    }
}

fn examples() -> [Example; 4] {
    [
        fields::torus(),
        fields::spheres(100),
        fields::blobs(14),
        gyroid(),
    ]
}

/// A field with columns for a batch of points and its results.
struct Subject {
    field: CompiledField,
    points: [Vec<f64>; 3],
    outputs: Vec<Vec<f64>>,
}

impl Subject {
    fn new(example: &Example, tier: Tier) -> Subject {
        let program = Program::with_tier(&example.graph, &[example.root], 3, tier);
        let field = CompiledField::new(Arc::new(program), example.q.clone());
        Subject {
            points: points(),
            outputs: vec![vec![0.0; BATCH]; 4 + example.q.len()],
            field,
        }
    }

    /// Evaluates the batch: F, with F_x or with F_x and F_q.
    fn evaluate(&mut self, function: usize) {
        let points = self.points.each_ref().map(|column| &column[..]);
        let mut outputs: Vec<&mut [f64]> = self.outputs.iter_mut().map(|o| &mut o[..]).collect();
        let (values, gradients) = outputs.split_at_mut(1);
        let (gradients, parameters) = gradients.split_at_mut(3);
        match function {
            0 => self.field.values(&points, values[0]),
            1 => self.field.gradients(&points, values[0], gradients),
            _ => (self.field).parameter_gradients(&points, values[0], gradients, parameters),
        }
        black_box(&mut self.outputs);
    }
}

/// F in f32.
struct Single {
    program: Program,
    q: Vec<f64>,
    points: [Vec<f32>; 3],
    output: Vec<f32>,
}

impl Single {
    fn new(example: &Example, tier: Tier) -> Single {
        Single {
            program: Program::with_tier(&example.graph, &[example.root], 3, tier),
            q: example.q.clone(),
            points: points().map(|column| column.iter().map(|&x| x as f32).collect()),
            output: vec![0.0; BATCH],
        }
    }

    fn evaluate(&mut self) {
        let points = self.points.each_ref().map(|column| &column[..]);
        let outputs = &mut [&mut self.output[..]];
        black_box(self.program.evaluate_batch_f32(&points, &self.q, outputs));
    }
}

/// Points in [−1, 1]³, without order.
fn points() -> [Vec<f64>; 3] {
    [0.371, 0.733, 0.193].map(|f| (0..BATCH).map(|i| (i as f64 * f) % 2.0 - 1.0).collect())
}

/// The median time of each piece of work for a batch, in nanoseconds; they take turns.
fn medians(work: &mut [Box<dyn FnMut() + '_>]) -> Vec<f64> {
    let mut times = vec![Vec::new(); work.len()];
    for _ in 0..ROUNDS {
        for (work, times) in work.iter_mut().zip(&mut times) {
            let start = Instant::now();
            for _ in 0..CALLS {
                work();
            }
            times.push(start.elapsed().as_secs_f64() * 1e9 / CALLS as f64);
        }
    }
    let median = |mut times: Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    times.into_iter().map(median).collect()
}

fn compare(_: &mut Criterion) {
    println!(
        "\nMillion points a second, one thread, batches of {BATCH}; f32 is of F alone.\n\
         field    what         interpreter  machine code |  baseline    AVX2 AVX-512 (blocks) | \
         baseline    AVX2 AVX-512 (vectors) |  baseline    AVX2 AVX-512 (blocks, f32) | \
         baseline    AVX2 AVX-512 (vectors, f32) |"
    );
    for example in examples() {
        for (function, name) in FUNCTIONS.iter().enumerate() {
            let tiers = [Tier::Interpreter, Tier::MachineCode];
            let wide = [
                Kernels::ALL.map(Tier::Block),
                Kernels::ALL.map(Tier::Vector),
            ];
            let tiers = tiers.into_iter().chain(wide.into_iter().flatten());
            let mut work: Vec<Box<dyn FnMut()>> = Vec::new();
            for tier in tiers {
                let mut subject = Subject::new(&example, tier);
                work.push(Box::new(move || subject.evaluate(function)));
            }
            if function == 0 {
                for tier in wide.into_iter().flatten() {
                    let mut single = Single::new(&example, tier);
                    work.push(Box::new(move || single.evaluate()));
                }
            }
            let speeds: Vec<f64> = (medians(&mut work).iter())
                .map(|time| BATCH as f64 / time * 1e3)
                .collect();
            print!(
                "{:8} {name:12} {:11.3} {:13.2} | ",
                example.name, speeds[0], speeds[1]
            );
            for group in speeds[2..].chunks(3) {
                print!("{:9.2} {:7.2} {:16.2} | ", group[0], group[1], group[2]);
            }
            println!();
        }
    }
}

/// 64 boxes at once against one after the other.
fn enclose(_: &mut Criterion) {
    println!("\nMillion boxes a second: alone; in batches of 64 by baseline, AVX2, AVX-512");
    let sides: [Vec<Interval>; 3] = points().map(|column| {
        let sides = column.iter().take(64).map(|&x| Interval::new(x, x + 0.05));
        sides.collect()
    });
    let [x, y, z] = sides.each_ref().map(|column| &column[..]);
    for example in examples() {
        let program = |kernels| {
            let tier = Tier::Block(kernels);
            Program::with_tier(&example.graph, &[example.root], 3, tier)
        };
        let alone = program(Kernels::widest());
        let mut work: Vec<Box<dyn FnMut()>> = vec![Box::new(|| {
            for index in 0..64 {
                let mut output = [Interval::EMPTY];
                alone.enclose(&[x[index], y[index], z[index]], &example.q, &mut output);
                black_box(output);
            }
        })];
        for kernels in Kernels::ALL {
            let (program, q) = (program(kernels), &example.q);
            let mut output = [Enclosure::of_number(0.0); 64];
            work.push(Box::new(move || {
                program.enclose_batch(&[x, y, z], q, &mut [&mut output]);
                black_box(&mut output);
            }));
        }
        let times = medians(&mut work);
        print!("{:8}", example.name);
        for time in times {
            print!(" {:9.3}", 64.0 / time * 1e3);
        }
        println!();
    }
}

fn evaluate(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("block");
    group.throughput(Throughput::Elements(BATCH as u64));
    for example in examples() {
        for kernels in Kernels::ALL {
            let mut subject = Subject::new(&example, Tier::Block(kernels));
            let id = BenchmarkId::new(format!("{} f64", example.name), format!("{kernels:?}"));
            group.bench_function(id, |bencher| bencher.iter(|| subject.evaluate(0)));
            let mut single = Single::new(&example, Tier::Block(kernels));
            let id = BenchmarkId::new(format!("{} f32", example.name), format!("{kernels:?}"));
            group.bench_function(id, |bencher| bencher.iter(|| single.evaluate()));
        }
    }
    group.finish();
}

criterion_group! {
    name = blocks;
    config = Criterion::default()
        .sample_size(20)
        .warm_up_time(std::time::Duration::from_millis(200))
        .measurement_time(std::time::Duration::from_millis(600));
    targets = compare, enclose, evaluate
}
criterion_main!(blocks);
