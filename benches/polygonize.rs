//! Polygonizers on a few fields and grids of three sizes: time, evaluations and triangles, and the
//! time as a part of that for sampling the whole grid. One thread.

// A benchmark's report belongs on standard output.
#![allow(clippy::print_stdout, missing_docs)]

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use imp::diagnostic::{Diagnostic, SourceId};
use imp::engine::{CompiledField, Field, Monitor, Silent};
use imp::geometry::Bounds;
use imp::language::{Host, Limits, Mode, Session};
use imp::polygonize::{Method, Options, Shape, polygonize};
use imp::syntax::parse;

/// A name, half the side of the box and the field `f`.
const SHAPES: [(&str, f64, &str); 4] = [
    ("sphere", 1.3, "field f(x, y, z) = x^2 + y^2 + z^2 - 1"),
    (
        "torus",
        1.6,
        "field f(x, y, z) = (sqrt(x^2 + y^2) - 1)^2 + z^2 - 0.16",
    ),
    (
        "gyroid in ball",
        6.1,
        "field f(x, y, z) = max(sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x), norm([x, y, z]) - 6)",
    ),
    (
        "cube minus cylinder",
        1.5,
        "field f(x, y, z) = max(abs(x + 0.2*y) - 1, abs(y - 0.2*x) - 1, abs(z) - 1, 0.5 - sqrt(x^2 + y^2))",
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

fn read(text: &str) -> CompiledField {
    let mut session = Session::new(
        Box::new(Deaf),
        Mode::Define,
        Limits::default(),
        PathBuf::new(),
        Vec::new(),
    );
    session.run(&parse(SourceId(0), text).tree).unwrap();
    let found = session.fields().get("f").cloned().unwrap();
    let fields = found.surfaces(session.graph(), &[]).unwrap();
    fields.into_iter().next().unwrap()
}

/// The least time of a few runs, in milliseconds, and what the last one made.
fn least<T>(mut work: impl FnMut() -> T) -> (f64, T) {
    let mut timed = || {
        let begun = Instant::now();
        let made = work();
        (1e3 * begun.elapsed().as_secs_f64(), made)
    };
    let mut best = timed();
    for _ in 0..4 {
        let next = timed();
        best = (best.0.min(next.0), next.1);
    }
    best
}

/// The time for F at all points of a grid, row by row.
fn sampling(field: &CompiledField, half: f64, cells: usize) -> f64 {
    let along: Vec<f64> = (0..=cells)
        .map(|step| half * (2.0 * step as f64 / cells as f64 - 1.0))
        .collect();
    let mut values = vec![0.0; along.len()];
    let mut sum = 0.0;
    let (time, ()) = least(|| {
        for &z in &along {
            let zs = vec![z; along.len()];
            for &y in &along {
                let ys = vec![y; along.len()];
                field.values(&[&along, &ys, &zs], &mut values);
                sum += values[0];
            }
        }
    });
    assert!(sum.is_finite());
    time
}

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    pool.unwrap().install(measure);
}

fn measure() {
    println!(
        "| shape | cells | method | ms | / sampling | evaluations | / points | triangles | million triangles a second |"
    );
    println!("| --- | ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: |");
    for (name, half, text) in SHAPES {
        let field = read(text);
        for cells in [64, 128, 256] {
            let whole = sampling(&field, half, cells);
            let spatial = Method::TABLE.iter().filter(|entry| entry.2.contains(&3));
            for &(method, method_name, _) in spatial {
                for snap in [false, true] {
                    if snap && method != Method::Cubes {
                        continue;
                    }
                    let bounds = Bounds::from_sides(&[(-half, half); 3]).unwrap();
                    let options = Options {
                        method: Some(method),
                        cell: 2.0 * half / cells as f64,
                        snap,
                        ..Options::new(bounds)
                    };
                    let (time, found) = least(|| polygonize(&field, &options, &Silent).unwrap());
                    let Shape::Mesh(mesh) = found.shape else {
                        continue;
                    };
                    let evaluations = found.statistics.evaluations;
                    println!(
                        "| {name} | {cells}³ | {method_name}{} | {time:.1} | {:.2} | {evaluations} | {:.3} | {} | {:.1} |",
                        if snap { ", snap" } else { "" },
                        time / whole,
                        evaluations as f64 / ((cells + 1) as f64).powi(3),
                        mesh.triangles.len(),
                        mesh.triangles.len() as f64 / time / 1e3,
                    );
                }
            }
        }
    }
}
