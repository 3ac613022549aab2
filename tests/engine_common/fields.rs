//! A few fields of different size, built through the graph's own interface.

// Each program that includes this file uses a part of it.
#![allow(dead_code)]

use imp::graph::{Graph, NodeId, Op};

/// A field with a q to evaluate it at.
pub(crate) struct Example {
    /// What it is called in reports.
    pub(crate) name: &'static str,
    /// Holds the root.
    pub(crate) graph: Graph,
    /// The field, a function of three coordinates.
    pub(crate) root: NodeId,
    /// The parameters.
    pub(crate) q: Vec<f64>,
}

/// (√(x² + y²) − R)² + z² − r², with R and r as parameters.
pub(crate) fn torus() -> Example {
    let mut graph = Graph::new();
    let [x, y, z] = [0, 1, 2].map(|axis| graph.coordinate(axis));
    let [major, minor] = [0, 1].map(|index| graph.parameter(index));
    let squares = [x, y, z, minor].map(|node| graph.apply(Op::Square, &[node]));
    let plane = graph.apply(Op::Add, &[squares[0], squares[1]]);
    let radius = graph.apply(Op::SquareRoot, &[plane]);
    let ring = graph.apply(Op::Subtract, &[radius, major]);
    let ring = graph.apply(Op::Square, &[ring]);
    let sum = graph.apply(Op::Add, &[ring, squares[2]]);
    let root = graph.apply(Op::Subtract, &[sum, squares[3]]);
    Example {
        name: "torus",
        graph,
        root,
        q: vec![1.0, 0.3],
    }
}

/// b − Σ exp(−|p − cᵢ|²/sᵢ²) with `count` Gaussians: 4·count + 1 parameters (each Gaussian's
/// centre and size, at last b).
pub(crate) fn blobs(count: usize) -> Example {
    let mut graph = Graph::new();
    let mut q = Vec::new();
    let mut sum = None;
    for index in 0..count {
        let phase = index as f64;
        let centre = [
            0.31 * phase % 1.7 - 0.85,
            0.47 * phase % 1.5 - 0.75,
            0.23 * phase % 1.1 - 0.55,
        ];
        let size = 0.25 + 0.07 * phase % 0.2;
        let place = q.len();
        let distance = squared_distance(&mut graph, |graph, axis| graph.parameter(place + axis));
        let size_node = graph.parameter(place + 3);
        let squared_size = graph.apply(Op::Square, &[size_node]);
        let quotient = graph.apply(Op::Divide, &[distance, squared_size]);
        let exponent = graph.apply(Op::Negate, &[quotient]);
        let gaussian = graph.apply(Op::Exp, &[exponent]);
        sum = Some(sum.map_or(gaussian, |sum| graph.apply(Op::Add, &[sum, gaussian])));
        q.extend(centre);
        q.push(size);
    }
    let threshold = graph.parameter(q.len());
    q.push(0.5);
    let root = match sum {
        Some(sum) => graph.apply(Op::Subtract, &[threshold, sum]),
        None => threshold,
    };
    Example {
        name: "blobs",
        graph,
        root,
        q,
    }
}

/// Union and difference of `count` spheres: every third one is cut away. One parameter, by which
/// all spheres grow.
pub(crate) fn spheres(count: usize) -> Example {
    let mut graph = Graph::new();
    let growth = graph.parameter(0);
    let mut solid = None;
    for index in 0..count {
        let phase = index as f64;
        let centre = [
            (2.4 * phase) % 1.9 - 0.95,
            (1.7 * phase) % 1.8 - 0.9,
            (0.9 * phase) % 2.0 - 1.0,
        ];
        let distance = squared_distance(&mut graph, |graph, axis| graph.constant(centre[axis]));
        let distance = graph.apply(Op::SquareRoot, &[distance]);
        let radius = graph.constant(0.1 + 0.03 * phase % 0.1);
        let radius = graph.apply(Op::Add, &[radius, growth]);
        let sphere = graph.apply(Op::Subtract, &[distance, radius]);
        solid = Some(match solid {
            None => sphere,
            Some(solid) if index % 3 == 2 => {
                let outside = graph.apply(Op::Negate, &[sphere]);
                graph.apply(Op::Max, &[solid, outside])
            }
            Some(solid) => graph.apply(Op::Min, &[solid, sphere]),
        });
    }
    let root = solid.unwrap_or(growth);
    Example {
        name: "spheres",
        graph,
        root,
        q: vec![0.02],
    }
}

/// |p − c|², where `centre` makes the components of c.
fn squared_distance(
    graph: &mut Graph,
    mut centre: impl FnMut(&mut Graph, usize) -> NodeId,
) -> NodeId {
    let squares = [0, 1, 2].map(|axis| {
        let coordinate = graph.coordinate(axis);
        let centre = centre(graph, axis);
        let difference = graph.apply(Op::Subtract, &[coordinate, centre]);
        graph.apply(Op::Square, &[difference])
    });
    let plane = graph.apply(Op::Add, &[squares[0], squares[1]]);
    graph.apply(Op::Add, &[plane, squares[2]])
}
