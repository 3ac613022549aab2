//! Imp's engine beside fidget's, in one process: values, gradients and bounds of the same fields.
//!
//! First says how far the results of the two are apart, then prints a Markdown table of speeds
//! and ratios. See the README beside it for the options.

mod measure;
mod options;
mod own;
mod peer;
mod points;
mod subjects;

#[path = "../../../tests/engine_common/fields.rs"]
mod fields;

use std::process::ExitCode;

use fidget::jit::JitFunction;
use fidget::vm::VmFunction;

use measure::{Contender, Outcome, compete};
use options::Options;
use own::What;
use subjects::{Subject, subjects};

/// Points of a batch; each contender's better one counts.
const BATCHES: [usize; 2] = [512, 4096];

/// Boxes of a batch.
const BOXES: usize = 64;

/// Where results are compared.
const COMPARED: usize = 4096;

/// fidget's two ways to evaluate, of which the better counts.
const PEERS: [&str; 2] = ["JIT", "VM"];

fn main() -> ExitCode {
    let options = match Options::read(std::env::args().skip(1)) {
        Ok(options) => options,
        Err(message) => {
            eprintln!("{message}");
            return ExitCode::from(2);
        }
    };
    let subjects = match subjects(options.prospero.as_deref()) {
        Ok(subjects) => subjects,
        Err(message) => {
            eprintln!("{message}");
            return ExitCode::FAILURE;
        }
    };
    println!("Imp's kernels: {:?}; {} rounds\n", options.kernels, options.rounds);
    if options.prospero.is_none() {
        println!("prospero is left out: neither `--prospero FILE` nor PROSPERO names its file\n");
    }
    let chosen = |subject: &&Subject| {
        let only = options.only.as_deref();
        only.is_none_or(|only| subject.name.contains(only))
    };
    let subjects: Vec<&Subject> = subjects.iter().filter(chosen).collect();
    for subject in &subjects {
        compare(subject, &options);
    }
    println!(
        "\nMillion points or boxes a second.\n\n\
         | field | what | threads | Imp | fidget JIT | fidget VM | ratio | goal | |\n\
         | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | --- |"
    );
    for subject in &subjects {
        for &threads in &options.threads {
            values(subject, threads, &options);
            gradients(subject, threads, &options);
            bounds(subject, threads, &options);
        }
    }
    ExitCode::SUCCESS
}

/// The largest differences between the two programs' results, relative to results beyond 1.
fn compare(subject: &Subject, options: &Options) {
    let own = |what| own::results(subject, options.kernels, what, COMPARED);
    let values = peer::value_results::<VmFunction>(subject, COMPARED);
    let compiled = peer::value_results::<JitFunction>(subject, COMPARED);
    let gradients = peer::gradient_results::<VmFunction>(subject, COMPARED);
    let bounds = own::bound_results(subject, options.kernels, BOXES);
    let peer_bounds = peer::bound_results::<VmFunction>(subject, BOXES);
    println!(
        "{}: largest difference of F {:.1e} (f32), {:.1e} (f64), to its JIT {:.1e}; of F_x {:.1e} \
         (f32), {:.1e} (f64); of bounds {:.1e}",
        subject.name,
        difference(&own(What::Values32), &values),
        difference(&own(What::Values64), &values),
        difference(&own(What::Values64), &compiled),
        difference(&own(What::Gradients32), &gradients),
        difference(&own(What::Gradients64), &gradients),
        difference(&bounds, &peer_bounds),
    );
}

/// NaN where only one of two numbers is.
fn difference(first: &[f64], second: &[f64]) -> f64 {
    assert_eq!(first.len(), second.len());
    let pairs = first.iter().zip(second);
    let differences = pairs
        .filter(|(a, b)| !(a.is_nan() && b.is_nan()) && a != b)
        .map(|(a, b)| (a - b).abs() / b.abs().max(1.0));
    let worse = |a: f64, b: f64| if a >= b { a } else { b };
    differences.fold(0.0, worse)
}

/// Contenders with every size of batch.
fn contenders(
    label: &'static str,
    threads: usize,
    task: impl Fn(usize) -> measure::Task,
) -> impl Iterator<Item = Contender> {
    BATCHES.map(|count| Contender::new(label, threads, count, || task(count))).into_iter()
}

fn values(subject: &Subject, threads: usize, options: &Options) {
    let own = |what| move |count| own::evaluate(subject, options.kernels, what, count);
    let outcome = compete(
        contenders("f32", threads, own(What::Values32))
            .chain(contenders("f64", threads, own(What::Values64)))
            .chain(contenders("JIT", threads, |count| peer::values::<JitFunction>(subject, count)))
            .chain(contenders("VM", threads, |count| peer::values::<VmFunction>(subject, count)))
            .collect(),
        options.rounds,
    );
    let row = Row { subject, threads, outcome: &outcome };
    row.print("F, f32", "f32", &PEERS, subject.goal);
    row.print("F, f64 (ratio to f32)", "f64", &["f32"], Some(0.4));
}

fn gradients(subject: &Subject, threads: usize, options: &Options) {
    let own = |what| move |count| own::evaluate(subject, options.kernels, what, count);
    let jit = |count| peer::gradients::<JitFunction>(subject, count);
    let vm = |count| peer::gradients::<VmFunction>(subject, count);
    let mut all: Vec<Contender> = contenders("f32", threads, own(What::Gradients32))
        .chain(contenders("f64", threads, own(What::Gradients64)))
        .chain(contenders("JIT", threads, jit))
        .chain(contenders("VM", threads, vm))
        .collect();
    if !subject.q.is_empty() {
        all.extend(contenders("q", threads, own(What::ParameterGradients)));
    }
    let outcome = compete(all, options.rounds);
    let row = Row { subject, threads, outcome: &outcome };
    row.print("F, F_x, f32", "f32", &PEERS, Some(3.0));
    row.print("F, F_x, f64", "f64", &PEERS, None);
    if !subject.q.is_empty() {
        let what = format!("F, F_x, F_q ({}), f64", subject.q.len());
        row.print(&what, "q", &[], None);
    }
}

fn bounds(subject: &Subject, threads: usize, options: &Options) {
    let contender = |label, task: &dyn Fn() -> measure::Task| {
        Contender::new(label, threads, BOXES, task)
    };
    let kernels = options.kernels;
    let outcome = compete(
        vec![
            contender("together", &|| own::bounds_together(subject, kernels, BOXES)),
            contender("alone", &|| own::bounds_alone(subject, kernels, BOXES)),
            contender("JIT", &|| peer::bounds::<JitFunction>(subject, BOXES)),
            contender("VM", &|| peer::bounds::<VmFunction>(subject, BOXES)),
        ],
        options.rounds,
    );
    let row = Row { subject, threads, outcome: &outcome };
    row.print("bounds, 64 boxes", "together", &PEERS, Some(10.0));
    row.print("bounds, one box", "alone", &PEERS, Some(1.5));
}

/// What the rows of one competition share.
struct Row<'a> {
    subject: &'a Subject,
    threads: usize,
    outcome: &'a Outcome,
}

impl Row<'_> {
    /// Prints the speed of `label`, and its ratio to the best of others with the goal for it.
    fn print(&self, what: &str, label: &str, others: &[&str], goal: Option<f64>) {
        let rate = |label| shown(self.outcome.rate(label));
        let ratio = self.outcome.ratio(label, others);
        let peer = |label| {
            if others.contains(&label) { rate(label) } else { String::new() }
        };
        let verdict = match (ratio, goal) {
            (Some(ratio), Some(goal)) if ratio < goal => "short",
            (Some(_), Some(_)) => "reached",
            _ => "",
        };
        let goal = goal.map_or(String::new(), |goal| format!("{goal}"));
        println!(
            "| {} | {what} | {} | {} | {} | {} | {} | {goal} | {verdict} |",
            self.subject.name,
            self.threads,
            rate(label),
            peer("JIT"),
            peer("VM"),
            shown(ratio),
        );
    }
}

/// Three digits.
fn shown(number: Option<f64>) -> String {
    match number {
        None => String::new(),
        Some(number) if number >= 100.0 => format!("{number:.0}"),
        Some(number) if number >= 10.0 => format!("{number:.1}"),
        Some(number) => format!("{number:.2}"),
    }
}
