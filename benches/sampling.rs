//! Every sampler on every kind of zero set, the floaters beside the paper's own algorithm and beside
//! uniform points of which Poisson elimination leaves some, and the growth of time and memory with
//! the number of floaters. One thread.
//!
//! Distances between nearest neighbours are given in units of the ideal spacing: that of the
//! hexagonal pattern on a surface, equal parts of a curve. Areas and lengths for that are estimated
//! by random lines, to a few thousandths.

// A benchmark's report belongs on standard output.
#![allow(clippy::print_stdout, missing_docs)]

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use imp::diagnostic::{Diagnostic, SourceId};
use imp::engine::{CompiledField, Monitor, Silent};
use imp::geometry::{Bounds, nearest_distances};
use imp::language::{Host, Limits, Mode, Session};
use imp::sample::{Method, Options, Outcome, Rules, sample, sample_curve};
use imp::syntax::parse;

/// A name, the box and the field `f`.
const SHAPES: [(&str, [f64; 3], &str); 11] = [
    ("sphere", [1.5, 1.5, 1.5], "field f(p in R3) = norm(p) - 1"),
    (
        "torus",
        [1.5, 1.5, 1.5],
        "field f(x, y, z) = (sqrt(x^2 + y^2) - 1)^2 + z^2 - 0.09",
    ),
    (
        "ellipsoid 10:1",
        [1.2, 1.2, 10.5],
        "field f(x, y, z) = x^2 + y^2 + (z/10)^2 - 1",
    ),
    (
        "14 Gaussians",
        [3.0, 3.0, 3.0],
        "let places = [[1.2*sin(13*k + 1), 1.2*sin(78*k + 2), 1.2*sin(38*k + 3)] for k in range(14)]
field f(p in R3) = 0.5 - sum(exp(-norm2(p - c)/0.2) for c in places)",
    ),
    (
        "spheres 1, 0.05",
        [6.0, 2.0, 2.0],
        "field f(x, y, z) = min(norm([x + 3, y, z]) - 1, norm([x - 5, y, z]) - 0.05)",
    ),
    (
        "two sheets",
        [1.0, 1.0, 1.0],
        "field f(x, y, z) = abs(z - 0.113) - 0.02",
    ),
    (
        "cube",
        [1.3, 1.3, 1.3],
        "field f(x, y, z) = max(abs(x), abs(y), abs(z)) - 1",
    ),
    (
        "cone",
        [1.1, 1.1, 1.0],
        "field f(x, y, z) = x^2 + y^2 - z^2",
    ),
    (
        "gyroid in ball",
        [6.3, 6.3, 6.3],
        "field f(x, y, z) = max(sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x), norm([x, y, z]) - 6)",
    ),
    (
        "Cassini ovals",
        [2.0, 2.0, 0.0],
        "field f(x, y) = (x^2 + y^2)^2 - 2*(x^2 - y^2) + 1 - 0.98",
    ),
    (
        "trefoil",
        [4.0, 4.0, 4.0],
        "field f(x, y, z) = {
    let s = x^2 + y^2 + z^2
    let a = 2*x/(1 + s)
    let b = 2*y/(1 + s)
    let c = 2*z/(1 + s)
    let d = (1 - s)/(1 + s)
    [a^3 - 3*a*b^2 - (c^2 - d^2), 3*a^2*b - b^3 - 2*c*d]
}",
    ),
];

/// Listens to nothing.
struct Deaf;

impl Host for Deaf {
    fn print(&mut self, _line: &str) {}

    fn warn(&mut self, _warning: Diagnostic) {}

    fn wrote(&mut self, _path: &Path) {}

    fn read_source(&mut self, path: &Path) -> Result<(SourceId, Arc<str>), Diagnostic> {
        panic!("{} is not read here", path.display())
    }

    fn monitor(&self) -> &dyn Monitor {
        &Silent
    }
}

/// A zero set in a box.
struct Shape {
    name: &'static str,
    fields: Vec<CompiledField>,
    bounds: Bounds,
    /// Its area or length.
    size: Option<f64>,
}

fn shapes() -> Vec<Shape> {
    SHAPES.iter().map(read).collect()
}

fn read((name, half, text): &(&'static str, [f64; 3], &str)) -> Shape {
    let mut session = Session::new(
        Box::new(Deaf),
        Mode::Define,
        Limits::default(),
        PathBuf::new(),
        Vec::new(),
    );
    let parsed = parse(SourceId(0), text);
    session.run(&parsed.tree).unwrap();
    let found = session.fields().get("f").cloned().unwrap();
    let fields = found.surfaces(session.graph(), &[]).unwrap();
    let sides: Vec<(f64, f64)> = half[..found.dimension()]
        .iter()
        .map(|&half| (-half, half))
        .collect();
    let mut shape = Shape {
        name,
        fields,
        bounds: Bounds::from_sides(&sides).unwrap(),
        size: None,
    };
    let rays = (shape.fields.len() == 1).then(|| shape.run(Method::Rays, 100_000, |_| ()));
    shape.size = rays.and_then(|(outcome, _)| Some(outcome?.statistics.lines?.area?.value));
    shape
}

impl Shape {
    /// A sample and the seconds that it took; none if the method is not for this shape.
    fn run(
        &self,
        method: Method,
        count: u64,
        change: impl Fn(&mut Options),
    ) -> (Option<Outcome>, f64) {
        let mut options = Options {
            method,
            count: Some(count),
            bounds: Some(self.bounds),
            ..Options::default()
        };
        change(&mut options);
        let begun = Instant::now();
        let outcome = match self.fields.as_slice() {
            [one, other] => sample_curve([one, other], &options, &Silent),
            [field, ..] => sample(field, &options, &Silent),
            [] => unreachable!(),
        };
        (outcome.ok(), begun.elapsed().as_secs_f64())
    }

    /// The spacing of so many points in the ideal pattern.
    fn ideal(&self, outcome: &Outcome) -> Option<f64> {
        let number = outcome.samples.positions.len() as f64;
        let walked = outcome.statistics.curves.as_ref();
        let length = walked.map(|curves| curves.length());
        match (self.bounds.dimension, self.size) {
            (3, Some(area)) => Some((area / (0.75_f64.sqrt() * number)).sqrt()),
            (_, size) => Some(size.or(length)? / number),
        }
    }
}

/// The mean, deviation and minimum of the distances to the nearest neighbours.
fn nearest(outcome: &Outcome) -> [f64; 3] {
    let distances = nearest_distances(&outcome.samples.positions);
    let number = distances.len() as f64;
    let mean = distances.iter().sum::<f64>() / number;
    let squares = distances.iter().map(|distance| (distance - mean).powi(2));
    let least = distances.iter().copied().fold(f64::INFINITY, f64::min);
    [mean, (squares.sum::<f64>() / number).sqrt(), least]
}

fn row(shape: &Shape, name: &str, (outcome, seconds): (Option<Outcome>, f64)) {
    let Some(outcome) = outcome.filter(|outcome| !outcome.samples.positions.is_empty()) else {
        return;
    };
    let statistics = &outcome.statistics;
    let ideal = shape.ideal(&outcome).unwrap_or(f64::NAN);
    let [mean, deviation, least] = nearest(&outcome).map(|distance| distance / ideal);
    let number = outcome.samples.positions.len();
    println!(
        "| {} | {name} | {number} | {} | {:.0} | {:.0} | {:.1e} | {mean:.3} | {deviation:.3} | {least:.3} | {} |",
        shape.name,
        statistics.iterations,
        1e3 * seconds,
        statistics.evaluations as f64 / number as f64,
        statistics.max_residual / shape.bounds.diagonal(),
        if statistics.converged { "yes" } else { "no" },
    );
}

/// The largest memory that this process has held, in megabytes (proc(5), status).
fn peak_memory() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|line| line.starts_with("VmHWM"))?;
    let kilobytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kilobytes / 1024.0)
}

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    pool.unwrap().install(measure);
}

fn measure() {
    let shapes = shapes();
    println!(
        "| shape | method | points | iterations | ms | evaluations a point | residual / box | nn mean | deviation | minimum | converged |"
    );
    println!("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | --- |");
    for shape in &shapes {
        for (method, name) in Method::NAMES {
            row(shape, name, shape.run(*method, 2000, |_| ()));
        }
        if shape.fields.len() == 1 {
            // The radius by which the paper's algorithm leaves about as many.
            let spacing = shape.size.map(|size| match shape.bounds.dimension {
                3 => (size / (0.75_f64.sqrt() * 2000.0)).sqrt(),
                _ => size / 2000.0,
            });
            let exact = |options: &mut Options| {
                options.count = None;
                options.exact = true;
                options.rules = Rules {
                    sigma: spacing.map(|spacing| 0.6 * spacing),
                    ..Rules::default()
                };
            };
            row(
                shape,
                "the paper's",
                shape.run(Method::Floaters, 2000, exact),
            );
        }
    }
    println!(
        "\n| floaters on 14 Gaussians | seconds | iterations | µs a point and iteration | MB |"
    );
    println!("| ---: | ---: | ---: | ---: | ---: |");
    for number in [1_000, 10_000, 100_000, 1_000_000] {
        let (outcome, seconds) = shapes[3].run(Method::Floaters, number, |_| ());
        let Some(outcome) = outcome else { continue };
        let steps = outcome.statistics.steps as f64;
        println!(
            "| {number} | {seconds:.3} | {} | {:.3} | {:.0} |",
            outcome.statistics.iterations,
            1e6 * seconds / steps,
            peak_memory().unwrap_or(f64::NAN)
        );
    }
}
