//! Imp's engine beside fidget's, in one process: values, gradients, bounds and
//! pictures of the same fields.
//!
//! First says how far the results of the two are apart, then prints a Markdown table of speeds
//! and ratios. See the README beside it for the options.

mod measure;
mod meshes;
mod options;
mod own;
mod peer;
mod pictures;
mod points;
mod subjects;

#[path = "../../../tests/engine_common/fields.rs"]
mod fields;

use std::fmt;
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

/// Relative differences above this are no rounding errors.
const KINK: f64 = 1e-3;

/// Where results are compared.
const COMPARED: usize = 4096;

/// fidget's two ways to evaluate, of which the better counts.
const PEERS: [&str; 2] = ["JIT", "VM"];

/// The same without copying the input.
const INNER: [&str; 2] = ["inner JIT", "inner VM"];

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
    println!(
        "Imp's tier: {:?}; {} rounds\n",
        options.tier, options.rounds
    );
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
        let compared = pictures::compare(subject, &options);
        if let Err(message) = compared.and_then(|()| meshes::compare(subject, &options)) {
            eprintln!("{message}");
            return ExitCode::FAILURE;
        }
    }
    println!(
        "\nMillion points or boxes a second.\n\n\
         | field | what | threads | Imp | fidget JIT | fidget VM | ratio | goal | | inner JIT \
         | inner VM | ratio |\n\
         | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | --- | ---: | ---: | ---: |"
    );
    for subject in &subjects {
        for &threads in &options.threads {
            values(subject, threads, &options);
            gradients(subject, threads, &options);
            bounds(subject, threads, &options);
            let made = pictures::pictures(subject, threads, &options);
            if let Err(message) = made.and_then(|()| meshes::meshes(subject, threads, &options)) {
                eprintln!("{message}");
                return ExitCode::FAILURE;
            }
        }
    }
    ExitCode::SUCCESS
}

/// The largest differences between the two programs' results, relative to results beyond 1.
fn compare(subject: &Subject, options: &Options) {
    let own = |what| own::results(subject, options.tier, what, COMPARED);
    let values = peer::value_results::<VmFunction>(subject, COMPARED);
    let compiled = peer::value_results::<JitFunction>(subject, COMPARED);
    let gradients = peer::gradient_results::<VmFunction>(subject, COMPARED);
    let bounds = own::bound_results(subject, options.tier, BOXES);
    let peer_bounds = peer::bound_results::<VmFunction>(subject, BOXES);
    println!(
        "{}: largest difference of F {} (f32), {} (f64), to its JIT {}; of F_x {} (f32), {} \
         (f64); of bounds {}",
        subject.name,
        difference(&own(What::Values32), &values),
        difference(&own(What::Values64), &values),
        difference(&own(What::Values64), &compiled),
        difference(&own(What::Gradients32), &gradients),
        difference(&own(What::Gradients64), &gradients),
        difference(&bounds, &peer_bounds),
    );
}

/// The largest difference, relative to numbers beyond 1; NaN where only one of two numbers is.
/// Beside it how many differ by more than [`KINK`]: at a kink of the field, where rounding or the
/// rule for ties decides which branch is differentiated.
fn difference(first: &[f64], second: &[f64]) -> Difference {
    assert_eq!(first.len(), second.len());
    let mut difference = Difference {
        largest: 0.0,
        elsewhere: 0,
    };
    for (&a, &b) in first.iter().zip(second) {
        if a == b || (a.is_nan() && b.is_nan()) {
            continue;
        }
        let apart = (a - b).abs() / b.abs().max(1.0);
        if apart > KINK {
            difference.elsewhere += 1;
        } else if apart.is_nan() || apart > difference.largest {
            difference.largest = apart;
        }
    }
    difference
}

/// How far apart numbers are.
struct Difference {
    largest: f64,
    elsewhere: usize,
}

impl fmt::Display for Difference {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{:.1e}", self.largest)?;
        match self.elsewhere {
            0 => Ok(()),
            count => write!(formatter, " (and {count} on another branch)"),
        }
    }
}

/// Contenders with every size of batch.
fn contenders(
    label: &'static str,
    threads: usize,
    task: impl Fn(usize) -> measure::Task,
) -> impl Iterator<Item = Contender> {
    BATCHES
        .map(|count| Contender::new(label, threads, count, || task(count)))
        .into_iter()
}

fn values(subject: &Subject, threads: usize, options: &Options) {
    let own = |what| move |count| own::evaluate(subject, options.tier, what, count);
    let outcome = compete(
        contenders("f32", threads, own(What::Values32))
            .chain(contenders("f64", threads, own(What::Values64)))
            .chain(contenders("JIT", threads, |count| {
                peer::shape_values::<JitFunction>(subject, count)
            }))
            .chain(contenders("VM", threads, |count| {
                peer::shape_values::<VmFunction>(subject, count)
            }))
            .chain(contenders("inner JIT", threads, |count| {
                peer::values::<JitFunction>(subject, count)
            }))
            .chain(contenders("inner VM", threads, |count| {
                peer::values::<VmFunction>(subject, count)
            }))
            .collect(),
        options.rounds,
    );
    let row = Row::new(subject, threads, &outcome);
    row.print("F, f32", "f32", Goal::Peer(subject.goal));
    row.print("F, f64, to our f32", "f64", Goal::Own("f32", 0.4));
}

fn gradients(subject: &Subject, threads: usize, options: &Options) {
    let own = |what| move |count| own::evaluate(subject, options.tier, what, count);
    let mut all: Vec<Contender> = contenders("f32", threads, own(What::Gradients32))
        .chain(contenders("f64", threads, own(What::Gradients64)))
        .chain(contenders("JIT", threads, |count| {
            peer::shape_gradients::<JitFunction>(subject, count)
        }))
        .chain(contenders("VM", threads, |count| {
            peer::shape_gradients::<VmFunction>(subject, count)
        }))
        .chain(contenders("inner JIT", threads, |count| {
            peer::gradients::<JitFunction>(subject, count)
        }))
        .chain(contenders("inner VM", threads, |count| {
            peer::gradients::<VmFunction>(subject, count)
        }))
        .collect();
    let parameters = subject.q.len();
    if parameters > 0 {
        all.extend(contenders("q", threads, own(What::ParameterGradients)));
    }
    let outcome = compete(all, options.rounds);
    let row = Row::new(subject, threads, &outcome);
    row.print("F, F_x, f32", "f32", Goal::Peer(Some(3.0)));
    row.print("F, F_x, f64", "f64", Goal::Peer(None));
    if parameters > 0 {
        let what = format!("F, F_x, F_q ({parameters}), f64");
        let goal = (parameters == 57).then_some(12.0 * threads as f64);
        row.print(&what, "q", Goal::Speed(goal));
    }
}

fn bounds(subject: &Subject, threads: usize, options: &Options) {
    let contender =
        |label, task: &dyn Fn() -> measure::Task| Contender::new(label, threads, BOXES, task);
    let tier = options.tier;
    let outcome = compete(
        vec![
            contender("together", &|| own::bounds_together(subject, tier, BOXES)),
            contender("alone", &|| own::bounds_alone(subject, tier, BOXES)),
            contender("JIT", &|| peer::shape_bounds::<JitFunction>(subject, BOXES)),
            contender("VM", &|| peer::shape_bounds::<VmFunction>(subject, BOXES)),
            contender("inner JIT", &|| peer::bounds::<JitFunction>(subject, BOXES)),
            contender("inner VM", &|| peer::bounds::<VmFunction>(subject, BOXES)),
        ],
        options.rounds,
    );
    let row = Row::new(subject, threads, &outcome);
    row.print("bounds, 64 boxes", "together", Goal::Peer(Some(10.0)));
    row.print("bounds, one box", "alone", Goal::Peer(Some(1.5)));
}

/// What a speed should reach.
#[derive(Clone, Copy)]
enum Goal {
    /// A ratio to the better one of fidget's.
    Peer(Option<f64>),
    /// A ratio to another one of ours.
    Own(&'static str, f64),
    /// So many million a second.
    Speed(Option<f64>),
}

/// What the rows of one competition share.
struct Row<'a> {
    subject: &'a Subject,
    threads: usize,
    outcome: &'a Outcome,
}

impl<'a> Row<'a> {
    fn new(subject: &'a Subject, threads: usize, outcome: &'a Outcome) -> Row<'a> {
        Row {
            subject,
            threads,
            outcome,
        }
    }

    /// Prints the speed of `label` beside what it is compared with.
    fn print(&self, what: &str, label: &str, goal: Goal) {
        let speed = self.outcome.rate(label);
        let (ratio, goal, is_beside_peer) = match goal {
            Goal::Peer(goal) => (self.outcome.ratio(label, &PEERS), goal, true),
            Goal::Own(other, goal) => (self.outcome.ratio(label, &[other]), Some(goal), false),
            Goal::Speed(goal) => (speed, goal, false),
        };
        let verdict = match (ratio, goal) {
            (Some(ratio), Some(goal)) if ratio < goal => "short",
            (Some(_), Some(_)) => "reached",
            _ => "",
        };
        let beside = |number: Option<f64>| shown(number.filter(|_| is_beside_peer));
        let peer = |label| beside(self.outcome.rate(label));
        println!(
            "| {} | {what} | {} | {} | {} | {} | {} | {} | {verdict} | {} | {} | {} |",
            self.subject.name,
            self.threads,
            shown(speed),
            peer("JIT"),
            peer("VM"),
            shown(ratio),
            goal.map_or(String::new(), |goal| goal.to_string()),
            peer("inner JIT"),
            peer("inner VM"),
            beside(self.outcome.ratio(label, &INNER)),
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
