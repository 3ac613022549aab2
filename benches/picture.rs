//! How long pictures take: height maps of 512³ and a bitmap of 1024², on one thread.
//!
//! `IMP_PROSPERO=FILE cargo bench --bench picture` adds the field of a `.vm` file, in the plane
//! and extruded. The table gives medians and the shortest times of some rounds.

// A benchmark's report belongs on standard output.
#![allow(clippy::print_stdout, missing_docs)]

#[path = "../tests/engine_common/fields.rs"]
mod fields;

use std::sync::Arc;
use std::time::Instant;

use imp::engine::{CompiledField, Program, Silent};
use imp::geometry::Bounds;
use imp::graph::{Graph, NodeId, Op};
use imp::picture::{Aim, Camera, View, bitmap, height_map};

const ROUNDS: usize = 9;

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    pool.unwrap().install(measure);
}

fn measure() {
    let sphere = field(3, |graph, p| {
        let squares = p.map(|coordinate| graph.apply(Op::Square, &[coordinate]));
        let sum = graph.apply(Op::Add, &[squares[0], squares[1]]);
        let sum = graph.apply(Op::Add, &[sum, squares[2]]);
        let distance = graph.apply(Op::SquareRoot, &[sum]);
        let radius = graph.constant(1.0);
        graph.apply(Op::Subtract, &[distance, radius])
    });
    let gyroid = field(3, |graph, p| {
        let four = graph.constant(4.0);
        let angles = p.map(|coordinate| graph.apply(Op::Multiply, &[four, coordinate]));
        let terms = [0, 1, 2].map(|axis: usize| {
            let sine = graph.apply(Op::Sin, &[angles[axis]]);
            let cosine = graph.apply(Op::Cos, &[angles[(axis + 1) % 3]]);
            graph.apply(Op::Multiply, &[sine, cosine])
        });
        let sum = graph.apply(Op::Add, &[terms[0], terms[1]]);
        graph.apply(Op::Add, &[sum, terms[2]])
    });
    let example = |example: fields::Example| {
        let program = Program::new(&example.graph, &[example.root], 3);
        CompiledField::new(Arc::new(program), example.q)
    };
    let mut solids = vec![
        ("sphere", sphere),
        ("CSG of 100 spheres", example(fields::spheres(100))),
        ("14 Gaussians", example(fields::blobs(14))),
        ("gyroid", gyroid),
    ];
    if let Some(path) = std::env::var_os("IMP_PROSPERO") {
        let read = |graph: &mut Graph, p| {
            let allowed = imp::file::Allowed {
                lines: u64::MAX,
                bytes: u64::MAX,
            };
            match imp::file::load(path.as_ref(), graph, p, allowed) {
                Ok(imp::file::Loaded::Field(found)) => found.root,
                other => panic!("{other:?}"),
            }
        };
        let plane = field(2, read);
        let bounds = Bounds::from_sides(&[(-1.0, 1.0); 2]).unwrap();
        report("prospero, 1024² pixels", || {
            let map = bitmap(&plane, &bounds, [1024; 2], &Silent);
            map.unwrap().sides.len()
        });
        solids.push((
            "prospero, extruded",
            field(3, |graph, p| {
                let root = read(graph, p);
                let height = graph.apply(Op::Abs, &[p[2]]);
                let half = graph.constant(0.5);
                let height = graph.apply(Op::Subtract, &[height, half]);
                graph.apply(Op::Max, &[root, height])
            }),
        ));
    }
    for (name, solid) in solids {
        let camera = Camera::new(&Aim {
            bounds: Bounds::from_sides(&[(-1.0, 1.0); 3]).unwrap(),
            view: View::named("top").unwrap(),
            perspective: None,
            size: [512; 2],
        });
        report(&format!("{name}, 512³ voxels"), || {
            let map = height_map(&solid, &camera, &Silent).unwrap();
            map.hits.len()
        });
    }
}

/// A field from the graph that `make` builds of the coordinates.
fn field(dimension: usize, make: impl FnOnce(&mut Graph, [NodeId; 3]) -> NodeId) -> CompiledField {
    let mut graph = Graph::new();
    let coordinates = [0, 1, 2].map(|axis| graph.coordinate(axis));
    let root = make(&mut graph, coordinates);
    CompiledField::new(
        Arc::new(Program::new(&graph, &[root], dimension)),
        Vec::new(),
    )
}

fn report(name: &str, mut work: impl FnMut() -> usize) {
    let mut times: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let begun = Instant::now();
            std::hint::black_box(work());
            1e3 * begun.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_unstable_by(f64::total_cmp);
    println!(
        "{name:32} median {:8.1} ms, shortest {:8.1} ms",
        times[ROUNDS / 2],
        times[0]
    );
}
