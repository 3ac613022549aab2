//! Equations 7 and 8 for many pins and parameters, and fits: residuals, times, and how far the
//! parameters that were found are from the true ones.
//!
//! Fields are b − Σ exp(−|x − cᵢ|²/sᵢ²) with known parameters. Points lie on them to rounding, and fits
//! begin with centres and sizes that are changed by up to a tenth of the sizes.

// A benchmark's report belongs on standard output.
#![allow(clippy::print_stdout, missing_docs)]

use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;

use imp::engine::{CompiledField, Field, Program, Silent};
use imp::graph::{Graph, Op};
use imp::motion::{Control, FitOptions, Freedom, Pin, Rows, advance, fit, follow};

/// A sequence of random numbers (splitmix64).
struct Random(u64);

impl Random {
    fn uniform(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        low + (high - low) * (z >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn point(&mut self) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| self.uniform(-1.0, 1.0)))
    }
}

/// Blobs at random places in a cube with side 2, with centres and sizes as parameters, and the bias if
/// it is one.
fn blobs(count: usize, size: f64, has_bias: bool) -> CompiledField {
    let random = &mut Random(11);
    let mut graph = Graph::new();
    let mut q = Vec::new();
    let mut root = graph.constant(0.5);
    if has_bias {
        root = graph.parameter(4 * count);
    }
    for index in 0..count {
        let mut sum = graph.constant(0.0);
        for axis in 0..3 {
            let coordinate = graph.coordinate(axis);
            let centre = graph.parameter(4 * index + axis);
            let difference = graph.apply(Op::Subtract, &[coordinate, centre]);
            let square = graph.apply(Op::Square, &[difference]);
            sum = graph.apply(Op::Add, &[sum, square]);
        }
        let width = graph.parameter(4 * index + 3);
        let width = graph.apply(Op::Square, &[width]);
        let quotient = graph.apply(Op::Divide, &[sum, width]);
        let exponent = graph.apply(Op::Negate, &[quotient]);
        let blob = graph.apply(Op::Exp, &[exponent]);
        root = graph.apply(Op::Subtract, &[root, blob]);
        q.extend(random.point().to_array());
        q.push(size * random.uniform(0.8, 1.2));
    }
    if has_bias {
        q.push(0.5);
    }
    CompiledField::new(Arc::new(Program::new(&graph, &[root], 3)), q)
}

/// Points on the zero set, by bisection between random places.
fn on_surface(field: &CompiledField, count: usize) -> Vec<DVec3> {
    let random = &mut Random(12);
    let mut points = Vec::new();
    while points.len() < count {
        let (mut inside, mut outside) = (random.point(), 1.5 * random.point());
        if field.value(inside) >= 0.0 || field.value(outside) <= 0.0 {
            continue;
        }
        for _ in 0..60 {
            let middle = 0.5 * (inside + outside);
            if field.value(middle) < 0.0 {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        points.push(inside);
    }
    points
}

/// The least and the median of the milliseconds that some calls take.
fn milliseconds(calls: usize, mut work: impl FnMut()) -> [f64; 2] {
    let mut times: Vec<f64> = (0..calls)
        .map(|_| {
            let begun = Instant::now();
            work();
            1e3 * begun.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    [times[0], times[calls / 2]]
}

fn control(name: &str, field: &CompiledField, count: usize) {
    let parameters = field.parameters().len();
    let random = &mut Random(13);
    let pins: Vec<Pin> = on_surface(field, count)
        .into_iter()
        .map(|position| Pin {
            position,
            velocity: random.point(),
        })
        .collect();
    let points: Vec<DVec3> = pins.iter().map(|pin| pin.position).collect();
    let desired = vec![0.0; parameters];
    let settings = Control::new(parameters, 1e-10);
    let rows = Rows::evaluate(field, &points);
    let entries: usize = (0..count).map(|index| rows.row(index).0.len()).sum();
    let evaluation = milliseconds(41, || {
        Rows::evaluate(field, &points);
    });
    let whole = milliseconds(41, || {
        follow(field, &pins, &desired, &settings).unwrap();
    });
    let step = milliseconds(21, || {
        advance(field, &pins, &desired, &settings, 0.01).unwrap();
    });
    let found = follow(field, &pins, &desired, &settings).unwrap();
    let made = advance(field, &pins, &desired, &settings, 0.01).unwrap();
    let left = found
        .pins
        .iter()
        .map(|pin| pin.residual)
        .fold(0.0, f64::max);
    let off = made.pins.iter().map(|pin| pin.residual).fold(0.0, f64::max);
    println!(
        "| {name} | {count} | {parameters} | {:.0} | {:.2} | {:.2} ({:.2}) | {:?} | {left:.1e} | {:.2} | {off:.1e} |",
        entries as f64 / count as f64,
        evaluation[1],
        whole[1],
        whole[0],
        found.solver,
        step[1],
    );
}

fn fitting(name: &str, field: &CompiledField, size: f64, count: usize) {
    let truth = field.parameters();
    let points = on_surface(field, count);
    let random = &mut Random(14);
    let mut change = || random.uniform(-0.1, 0.1) * size;
    let start: Vec<f64> = truth.iter().map(|q| q + change()).collect();
    let start = CompiledField::new(Arc::clone(field.program()), start);
    let freedom = Freedom::all(truth.len());
    let options = FitOptions::default();
    let begun = Instant::now();
    let found = fit(&start, &points, &freedom, &options, &Silent).unwrap();
    let seconds = begun.elapsed().as_secs_f64();
    let errors = found
        .q
        .iter()
        .zip(truth)
        .map(|(q, truth)| (q - truth).abs());
    println!(
        "| {name} | {} | {count} | {:.1} | {} | {:?} | {:.1e} | {:.1e} | {} | {} | {:.1e} |",
        truth.len(),
        1e3 * seconds,
        found.iterations,
        found.end,
        found.rms,
        found.max,
        found.rank,
        found.undetermined.len(),
        errors.fold(0.0, f64::max),
    );
}

fn main() {
    let few = blobs(14, 0.4, true);
    let many = blobs(300, 0.14, false);
    println!(
        "| field | pins | parameters | entries a row | F_q, ms | equation 7, ms (least) | solver | residual speed | step, ms | residual |"
    );
    println!("| --- | ---: | ---: | ---: | ---: | ---: | --- | ---: | ---: | ---: |");
    control("14 blobs", &few, 1);
    control("14 blobs", &few, 5);
    control("300 blobs", &many, 10);
    control("300 blobs", &many, 100);
    println!(
        "\n| field | parameters | points | ms | iterations | end | rms | largest | rank | undetermined | error of q |"
    );
    println!("| --- | ---: | ---: | ---: | ---: | --- | ---: | ---: | ---: | ---: | ---: |");
    for count in [10, 100, 1000] {
        fitting("14 blobs", &few, 0.4, count);
    }
    fitting("300 blobs", &many, 0.14, 2900);
}
