//! Compiled fields beside the same fields as mere functions: where enclosures prove the sign of F
//! it is not evaluated, and the mesh is the same all the same.

use std::sync::Arc;

use crate::support::{cube, mesh};
use imp::engine::{CompiledField, Field, Program, Silent};
use imp::graph::{Graph, NodeId, Op};
use imp::polygonize::{Method, Options};

/// A field that does not say that it is compiled.
struct Mute(CompiledField);

impl Field for Mute {
    fn dimension(&self) -> usize {
        self.0.dimension()
    }

    fn parameters(&self) -> &[f64] {
        self.0.parameters()
    }

    fn values(&self, points: &[&[f64]], values: &mut [f64]) {
        self.0.values(points, values);
    }

    fn gradients(&self, points: &[&[f64]], values: &mut [f64], gradients: &mut [&mut [f64]]) {
        self.0.gradients(points, values, gradients);
    }

    fn parameter_gradients(
        &self,
        points: &[&[f64]],
        values: &mut [f64],
        gradients: &mut [&mut [f64]],
        parameter_gradients: &mut [&mut [f64]],
    ) {
        self.0
            .parameter_gradients(points, values, gradients, parameter_gradients);
    }
}

/// A field of the coordinates.
fn compile(build: impl Fn(&mut Graph, [NodeId; 3]) -> NodeId) -> CompiledField {
    let mut graph = Graph::new();
    let coordinates = [0, 1, 2].map(|axis| graph.coordinate(axis));
    let root = build(&mut graph, coordinates);
    CompiledField::new(Arc::new(Program::new(&graph, &[root], 3)), Vec::new())
}

fn sphere(graph: &mut Graph, coordinates: [NodeId; 3]) -> NodeId {
    let [x, y, z] = coordinates.map(|node| graph.apply(Op::Square, &[node]));
    let plane = graph.apply(Op::Add, &[x, y]);
    graph.apply(Op::Add, &[plane, z])
}

/// √(x² + y² + z²), then the square root of its difference from 1: undefined in the ball.
fn undefined_in_a_ball(graph: &mut Graph, coordinates: [NodeId; 3]) -> NodeId {
    let square = sphere(graph, coordinates);
    let one = graph.constant(1.0);
    let beyond = graph.apply(Op::Subtract, &[square, one]);
    graph.apply(Op::SquareRoot, &[beyond])
}

#[test]
fn proven_signs_change_nothing_but_the_number_of_evaluations() {
    type Build = fn(&mut Graph, [NodeId; 3]) -> NodeId;
    let cases: [(Build, f64, bool); 4] = [
        (sphere, 1.0, false),
        // The box cuts it.
        (sphere, 4.1, true),
        (sphere, 4.1, false),
        (undefined_in_a_ball, 0.75, true),
    ];
    for (number, (build, iso, cap)) in cases.into_iter().enumerate() {
        // Blocks fit the grid or do not.
        for cells in [33, 64] {
            for snap in [false, true] {
                let bounds = cube(3, -1.5, 1.6);
                let options = Options {
                    cell: 3.1 / cells as f64,
                    iso,
                    cap,
                    snap,
                    ..Options::new(bounds)
                };
                let made =
                    |field: &dyn Field| mesh(field, (Method::Cubes, &options), &Silent).unwrap();
                let (pruned, whole) = (made(&compile(build)), made(&Mute(compile(build))));
                assert_eq!(pruned.shape, whole.shape, "field {number}, {cells} cells");
                let (mut few, many) = (pruned.statistics, whole.statistics);
                assert!(few.evaluations < many.evaluations, "field {number}");
                few.evaluations = many.evaluations;
                assert_eq!(few, many, "field {number}, {cells} cells");
            }
        }
    }
}

/// Evaluations grow with the surface: by four where the cells are halved, not by eight.
#[test]
fn evaluations_grow_with_the_surface() {
    let count = |cells: usize| {
        let options = Options {
            cell: 2.6 / cells as f64,
            iso: 1.0,
            ..Options::new(cube(3, -1.3, 1.3))
        };
        let found = mesh(&compile(sphere), (Method::Cubes, &options), &Silent).unwrap();
        found.statistics.evaluations as f64
    };
    let growth = count(128) / count(64);
    assert!(growth > 3.0 && growth < 4.6, "{growth}");
}
