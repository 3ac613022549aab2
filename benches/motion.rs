//! Equations 7 and 8 for many pins and parameters, and fits: residuals, times, and how far the
//! parameters that were found are from the true ones.
//!
//! Fields are b − Σ exp(−|x − cᵢ|²/sᵢ²) with known parameters. Points lie on them to rounding, and fits
//! begin with centres and sizes that are changed by up to a tenth of the sizes. Then frames a second of floaters
//! that follow blobs which five control points drag, and how evenly floaters cover them; and blobs
//! that part, merge and are stretched.

// A benchmark's report belongs on standard output.
#![allow(clippy::print_stdout, missing_docs)]

use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;

use imp::engine::{CompiledField, Field, Program, Silent};
use imp::geometry::{Bounds, nearest_distances};
use imp::graph::{Graph, Op};
use imp::motion::{
    Control, FitOptions, Freedom, Measure, Pin, Rows, Setting, Simulation, advance, fit, follow,
};
use imp::sample::Options;

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

/// A surface at rest with so many floaters.
fn simulation(field: &CompiledField, half: f64, count: u64) -> Simulation {
    let setting = Setting {
        options: Options {
            count: Some(count),
            bounds: Bounds::from_sides(&[(-half, half); 3]),
            ..Options::default()
        },
        walls: false,
        freedom: Freedom::all(field.parameters().len()),
        measure: Measure::Sensitivity,
        rest: None,
    };
    let q = field.parameters().to_vec();
    let program = Arc::clone(field.program());
    Simulation::new(program, q, setting, &Silent).unwrap().0
}

/// Sixty frames in which five control points are dragged by a fifth of the blobs' size.
fn frames(name: &str, field: &CompiledField, half: f64, count: u64) {
    let mut simulation = simulation(field, half, count);
    let random = &mut Random(15);
    for pin in on_surface(field, 5) {
        let index = simulation.pin(pin);
        let goal = pin + 0.05 * random.point();
        simulation.drag(index, goal, 1.8).unwrap();
    }
    let spacing = 2.0 * simulation.followers().desired_radius() / 1.1;
    let (mut births, mut deaths, mut parts) = (0, 0, 0);
    let (mut residual, mut pinned) = (0.0_f64, 0.0_f64);
    let mut phases = [0.0; 3];
    let begun = Instant::now();
    for _ in 0..60 {
        let frame = Instant::now();
        let step = simulation.step(0.03, None, &Silent).unwrap();
        let whole = frame.elapsed().as_secs_f64();
        let mut rest = whole;
        for (phase, time) in &step.followed.times.0 {
            let place = if phase == "move" { 1 } else { 2 };
            phases[place] += time.as_secs_f64();
            rest -= time.as_secs_f64();
        }
        phases[0] += rest;
        births += step.followed.births;
        deaths += step.followed.deaths;
        parts += step.followed.parts;
        let residuals = simulation.followers().samples().residuals;
        residual = residuals.into_iter().fold(residual, f64::max);
        pinned = simulation
            .pins()
            .iter()
            .fold(pinned, |most, pin| most.max(pin.2));
    }
    let seconds = begun.elapsed().as_secs_f64() / 60.0;
    let [control, moving, repulsion] = phases.map(|phase| 1e3 * phase / 60.0);
    println!(
        "| {name} | {count} | {} | {:.0} | {control:.2} | {moving:.2} | {repulsion:.2} | {births} | {deaths} | {parts} | {:.1e} | {:.1e} |",
        field.parameters().len(),
        1.0 / seconds,
        residual / spacing,
        pinned / spacing,
    );
}

/// 0.5 − exp(−|x − c|²) − exp(−|x − d|²), the distance stretched along x by a factor: parameters are c, d on the
/// x-axis and the factor.
fn pair() -> CompiledField {
    let mut graph = Graph::new();
    let [x, y, z] = [0, 1, 2].map(|axis| graph.coordinate(axis));
    let factor = graph.parameter(2);
    let mut root = graph.constant(0.5);
    for index in 0..2 {
        let centre = graph.parameter(index);
        let off = graph.apply(Op::Subtract, &[x, centre]);
        let off = graph.apply(Op::Divide, &[off, factor]);
        let squares = [off, y, z].map(|side| graph.apply(Op::Square, &[side]));
        let sum = graph.apply(Op::Add, &[squares[0], squares[1]]);
        let sum = graph.apply(Op::Add, &[sum, squares[2]]);
        let exponent = graph.apply(Op::Negate, &[sum]);
        let blob = graph.apply(Op::Exp, &[exponent]);
        root = graph.apply(Op::Subtract, &[root, blob]);
    }
    let program = Program::new(&graph, &[root], 3);
    CompiledField::new(Arc::new(program), vec![0.0, 0.0, 1.0])
}

/// Thirty steps along a path of q, and steps at rest until the pattern is even again.
fn tracking(name: &str, from: [f64; 3], to: [f64; 3]) {
    let field = CompiledField::new(Arc::clone(pair().program()), from.to_vec());
    let mut simulation = simulation(&field, 4.0, 2000);
    let spacing = 2.0 * simulation.followers().desired_radius() / 1.1;
    let spread = |simulation: &Simulation| {
        let distances = nearest_distances(&simulation.followers().samples().positions);
        let mean = distances.iter().sum::<f64>() / distances.len() as f64;
        let squares: f64 = distances.iter().map(|d| (d - mean) * (d - mean)).sum();
        (squares / distances.len() as f64).sqrt() / mean
    };
    let at_first = spread(&simulation);
    let (mut residual, mut worst, mut lost) = (0.0_f64, 0.0_f64, 0);
    let begun = Instant::now();
    let mut step = |simulation: &mut Simulation, part: f64| {
        let q: Vec<f64> = from
            .iter()
            .zip(to)
            .map(|(a, b)| a + part * (b - a))
            .collect();
        let step = simulation.step(0.03, Some(&q), &Silent).unwrap();
        lost += step.followed.lost;
        let residuals = simulation.followers().samples().residuals;
        residual = residuals.into_iter().fold(residual, f64::max);
        let now = spread(simulation);
        worst = worst.max(now);
        (now, step.followed.births + step.followed.deaths)
    };
    for frame in 1..=30 {
        step(&mut simulation, f64::from(frame) / 30.0);
    }
    let seconds = begun.elapsed().as_secs_f64();
    let count = simulation.followers().len();
    let mut recovery = None;
    let mut now = (0.0, 0);
    for frame in 1..=60 {
        now = step(&mut simulation, 1.0);
        if recovery.is_none() && now.0 < 0.1 && now.1 as f64 <= 0.002 * count as f64 {
            recovery = Some(frame);
        }
    }
    let recovery = recovery.map_or("more than 60".to_owned(), |frame| frame.to_string());
    println!(
        "| {name} | 2000 | {count} | {} | {:.1e} | {at_first:.3} | {worst:.3} | {:.3} | {recovery} | {lost} | {:.0} |",
        simulation.followers().len(),
        residual / spacing,
        now.0,
        1e3 * seconds / 30.0,
    );
}

fn main() {
    let few = blobs(14, 0.4, true);
    let many = blobs(300, 0.14, false);
    println!(
        "| field | floaters | parameters | frames a second | control, ms | carried, ms | repelled, ms | births | deaths | parts | residual / spacing | of pins |"
    );
    println!(
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
    );
    for count in [1000, 10_000, 50_000] {
        frames("14 blobs", &few, 2.0, count);
    }
    frames("300 blobs", &many, 2.0, 10_000);
    println!(
        "\n| surface | floaters | after 30 steps | in the end | largest residual / spacing | deviation of neighbours' distances at first | at worst | in the end | steps to recover | lost | ms a step |"
    );
    println!("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
    tracking("parting", [0.0, 0.0, 1.0], [-2.0, 2.0, 1.0]);
    tracking("merging", [-2.0, 2.0, 1.0], [0.0, 0.0, 1.0]);
    tracking("stretched 10:1", [0.0, 0.0, 1.0], [0.0, 0.0, 10.0]);
    println!();
    controlled_and_fitted(&few, &many);
}

fn controlled_and_fitted(few: &CompiledField, many: &CompiledField) {
    println!(
        "| field | pins | parameters | entries a row | F_q, ms | equation 7, ms (least) | solver | residual speed | step, ms | residual |"
    );
    println!("| --- | ---: | ---: | ---: | ---: | ---: | --- | ---: | ---: | ---: |");
    control("14 blobs", few, 1);
    control("14 blobs", few, 5);
    control("300 blobs", many, 10);
    control("300 blobs", many, 100);
    println!(
        "\n| field | parameters | points | ms | iterations | end | rms | largest | rank | undetermined | error of q |"
    );
    println!("| --- | ---: | ---: | ---: | ---: | --- | ---: | ---: | ---: | ---: | ---: |");
    for count in [10, 100, 1000] {
        fitting("14 blobs", few, 0.4, count);
    }
    fitting("300 blobs", many, 0.14, 2900);
}
