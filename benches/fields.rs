//! How fast fields are compiled and evaluated: torus, 14 Gaussians with 57 parameters, and a
//! solid of 100 spheres; F, F with F_x, and F with F_x and F_q; one thread and two.
//!
//! Criterion measures each alone; a table at the end sets them against the interpreter, measured
//! alternately in the same run, so that its ratios hold on a busy machine too.

// A benchmark's report belongs on standard output.
#![allow(clippy::print_stdout, missing_docs)]

#[path = "../tests/engine_common/fields.rs"]
mod fields;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use fields::Example;
use imp::engine::{CompiledField, Field, Program, Tier};
use rayon::ThreadPool;
use rayon::prelude::*;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The points of a call: its columns stay in the cache until they have been used.
const BLOCK: usize = 256;

/// The kernels.
const KERNELS: [(&str, Kernel); 3] = [
    ("F", Kernel::Values),
    ("F, F_x", Kernel::Gradients),
    ("F, F_x, F_q", Kernel::ParameterGradients),
];

#[derive(Clone, Copy)]
enum Kernel {
    Values,
    Gradients,
    ParameterGradients,
}

fn examples() -> [Example; 3] {
    [fields::torus(), fields::blobs(14), fields::spheres(100)]
}

fn field(example: &Example, tier: Tier) -> CompiledField {
    let program = Program::with_tier(&example.graph, &[example.root], 3, tier);
    CompiledField::new(Arc::new(program), example.q.clone())
}

/// `count` points in [−1, 1]³, without order.
fn points(count: usize) -> [Vec<f64>; 3] {
    [0.371, 0.733, 0.193].map(|f| (0..count).map(|i| (i as f64 * f) % 2.0 - 1.0).collect())
}

/// The columns of results of one block, used again for every block.
struct Results {
    values: Vec<f64>,
    gradients: Vec<Vec<f64>>,
    parameters: Vec<Vec<f64>>,
}

impl Results {
    fn new(field: &CompiledField, length: usize) -> Results {
        Results {
            values: vec![0.0; length],
            gradients: vec![vec![0.0; length]; field.dimension()],
            parameters: vec![vec![0.0; length]; field.parameters().len()],
        }
    }

    /// Evaluates one block and uses a result.
    fn evaluate(&mut self, field: &CompiledField, kernel: Kernel, points: &[&[f64]]) -> f64 {
        match kernel {
            Kernel::Values => field.values(points, &mut self.values),
            Kernel::Gradients => {
                let mut gradients = columns(&mut self.gradients);
                field.gradients(points, &mut self.values, &mut gradients);
            }
            Kernel::ParameterGradients => {
                let mut gradients = columns(&mut self.gradients);
                let mut parameters = columns(&mut self.parameters);
                field.parameter_gradients(
                    points,
                    &mut self.values,
                    &mut gradients,
                    &mut parameters,
                );
            }
        }
        self.values[0]
    }
}

fn columns(columns: &mut [Vec<f64>]) -> Vec<&mut [f64]> {
    columns.iter_mut().map(|column| &mut column[..]).collect()
}

/// Evaluates all points in blocks on the threads of the pool.
fn evaluate_all(pool: &ThreadPool, field: &CompiledField, kernel: Kernel, points: &[Vec<f64>; 3]) {
    let blocks = points[0].len() / BLOCK;
    pool.install(|| {
        (0..blocks).into_par_iter().for_each_init(
            || Results::new(field, BLOCK),
            |results, block| {
                let range = block * BLOCK..(block + 1) * BLOCK;
                let points = points.each_ref().map(|column| &column[range.clone()]);
                std::hint::black_box(results.evaluate(field, kernel, &points));
            },
        );
    });
}

fn pool(threads: usize) -> ThreadPool {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("threads can be started")
}

/// From a graph to the first result: derivatives, lowering, machine code.
fn compile_once(example: &Example, kernel: Kernel) {
    let field = field(example, Tier::MachineCode);
    let first = Results::new(&field, 1).evaluate(&field, kernel, &[&[0.1], &[0.2], &[0.3]]);
    std::hint::black_box(first);
}

fn compile(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("compile");
    for example in examples() {
        for (name, kernel) in KERNELS {
            let id = BenchmarkId::new(example.name, name);
            group.bench_function(id, |bencher| {
                bencher.iter(|| compile_once(&example, kernel));
            });
        }
    }
    group.finish();
}

/// Points per second.
fn evaluate(criterion: &mut Criterion) {
    let points = points(64 * BLOCK);
    for threads in [1, 2] {
        let pool = pool(threads);
        let mut group = criterion.benchmark_group(format!("evaluate, threads: {threads}"));
        group.throughput(Throughput::Elements(points[0].len() as u64));
        for example in examples() {
            let field = field(&example, Tier::MachineCode);
            for (name, kernel) in KERNELS {
                let id = BenchmarkId::new(example.name, name);
                group.bench_function(id, |bencher| {
                    bencher.iter(|| evaluate_all(&pool, &field, kernel, &points));
                });
            }
        }
        group.finish();
    }
}

/// The table of ratios.
fn compare(_: &mut Criterion) {
    let [one, two] = [1, 2].map(pool);
    let points = points(16 * BLOCK);
    println!(
        "\n                         compile |  million points a second  | times the interpreter"
    );
    println!(
        "field    what                 ms |   1 thread  |   2 threads |  1 thread   2 threads"
    );
    for example in examples() {
        for (name, kernel) in KERNELS {
            let compiled = field(&example, Tier::MachineCode);
            let interpreted = field(&example, Tier::Interpreter);
            let [mut compilation, mut slow, mut single, mut double] = [Duration::MAX; 4];
            for _ in 0..15 {
                compilation = compilation.min(time(|| compile_once(&example, kernel)));
                slow = slow.min(time(|| evaluate_all(&one, &interpreted, kernel, &points)));
                single = single.min(time(|| evaluate_all(&one, &compiled, kernel, &points)));
                double = double.min(time(|| evaluate_all(&two, &compiled, kernel, &points)));
            }
            let [slow, single, double] = [slow, single, double]
                .map(|time| points[0].len() as f64 / time.as_secs_f64() / 1e6);
            println!(
                "{:8} {name:12} {:11.2} | {single:11.3} | {double:11.3} | {:9.1}   {:9.1}",
                example.name,
                compilation.as_secs_f64() * 1e3,
                single / slow,
                double / slow
            );
        }
    }
}

fn time(work: impl FnOnce()) -> Duration {
    let start = Instant::now();
    work();
    start.elapsed()
}

criterion_group! {
    name = fields_of_all_sizes;
    config = Criterion::default()
        .sample_size(20)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1));
    targets = compile, evaluate, compare
}
criterion_main!(fields_of_all_sizes);
