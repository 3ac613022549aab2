//! Fields with closed forms, gradients by hand, for the tests of the samplers.

use glam::DVec3;
use std::sync::Arc;

use imp::engine::{CompiledField, Field, Program, Silent};
use imp::geometry::Bounds;
use imp::graph::{Graph, NodeId, Op};
use imp::sample::{Method, Options, Outcome, sample};

/// A field from a function that gives F and F_x at a point.
pub(crate) struct Analytic<F> {
    dimension: usize,
    function: F,
}

/// The field of a function of the point that gives F and F_x.
pub(crate) fn field<F>(dimension: usize, function: F) -> Analytic<F>
where
    F: Fn(DVec3) -> (f64, DVec3) + Send + Sync,
{
    Analytic {
        dimension,
        function,
    }
}

impl<F: Fn(DVec3) -> (f64, DVec3) + Send + Sync> Analytic<F> {
    fn at(&self, points: &[&[f64]], place: usize) -> (f64, DVec3) {
        let mut point = DVec3::ZERO;
        for (axis, column) in points.iter().enumerate() {
            point[axis] = column[place];
        }
        (self.function)(point)
    }
}

impl<F: Fn(DVec3) -> (f64, DVec3) + Send + Sync> Field for Analytic<F> {
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn parameters(&self) -> &[f64] {
        &[]
    }

    fn values(&self, points: &[&[f64]], values: &mut [f64]) {
        for (place, value) in values.iter_mut().enumerate() {
            *value = self.at(points, place).0;
        }
    }

    fn gradients(&self, points: &[&[f64]], values: &mut [f64], gradients: &mut [&mut [f64]]) {
        for (place, value) in values.iter_mut().enumerate() {
            let (level, gradient) = self.at(points, place);
            *value = level;
            for (axis, column) in gradients.iter_mut().enumerate() {
                column[place] = gradient[axis];
            }
        }
    }

    fn parameter_gradients(
        &self,
        points: &[&[f64]],
        values: &mut [f64],
        gradients: &mut [&mut [f64]],
        _parameter_gradients: &mut [&mut [f64]],
    ) {
        self.gradients(points, values, gradients);
    }
}

/// |x - c|² - r²
pub(crate) fn sphere(centre: DVec3, radius: f64) -> impl Field {
    field(3, move |p| {
        let q = p - centre;
        (q.length_squared() - radius * radius, 2.0 * q)
    })
}

/// (√(x² + y²) - R)² + z² - r² with R = 1, r = 0.3.
pub(crate) fn torus() -> impl Field {
    field(3, |p| {
        let ring = p.x.hypot(p.y);
        let off = ring - 1.0;
        let outward = DVec3::new(p.x, p.y, 0.0) / ring;
        (
            off * off + p.z * p.z - 0.09,
            2.0 * off * outward + 2.0 * p.z * DVec3::Z,
        )
    })
}

/// Taubin's heart, (x² + 9/4 y² + z² - 1)³ - x² z³ - 9/80 y² z³. Its gradient vanishes on the
/// ellipse x² + 9/4 y² = 1, z = 0, which lies on the surface.
pub(crate) fn heart() -> impl Field {
    field(3, |p| {
        let DVec3 { x, y, z } = p;
        let a = x * x + 2.25 * y * y + z * z - 1.0;
        let b = x * x + 9.0 / 80.0 * y * y;
        let value = a * a * a - b * z * z * z;
        let gradient = DVec3::new(
            6.0 * x * a * a - 2.0 * x * z * z * z,
            13.5 * y * a * a - 9.0 / 40.0 * y * z * z * z,
            6.0 * z * a * a - 3.0 * b * z * z,
        );
        (value, gradient)
    })
}

/// b - Σ exp(-|x - cᵢ|² / sᵢ²): fourteen Gaussian blobs on a helix, overlapping.
pub(crate) fn blobs() -> impl Field {
    let blobs: Vec<(DVec3, f64)> = (0..14)
        .map(|i| {
            let t = f64::from(i) * 0.5;
            (DVec3::new(t.cos(), t.sin(), 0.2 * t - 0.7), 0.35 + 0.01 * t)
        })
        .collect();
    field(3, move |p| {
        let mut value = 0.5;
        let mut gradient = DVec3::ZERO;
        for &(centre, size) in &blobs {
            let q = p - centre;
            let density = (-q.length_squared() / (size * size)).exp();
            value -= density;
            gradient += 2.0 * density / (size * size) * q;
        }
        (value, gradient)
    })
}

/// A polynomial of s = x² + y² that is 0 at r = 1 only and has a positive minimum, 0.5208, at
/// s = 3.5: P' = (s - 2) (s - 3.5), P(1) = 0. A spurious attractor in the form of a circle.
pub(crate) fn spurious_circle() -> impl Field {
    field(2, |p| {
        let s = p.x * p.x + p.y * p.y;
        let value = s * s * s / 3.0 - 2.75 * s * s + 7.0 * s - (1.0 / 3.0 - 2.75 + 7.0);
        (
            value,
            2.0 * (s - 2.0) * (s - 3.5) * DVec3::new(p.x, p.y, 0.0),
        )
    })
}

/// The box with the same side on every axis.
pub(crate) fn cube(dimension: usize, half: f64) -> Bounds {
    Bounds::from_sides(&vec![(-half, half); dimension]).unwrap()
}

/// The options of the particles of Figueiredo and Gomes.
pub(crate) fn particles() -> Options {
    Options {
        method: Method::Kinematic,
        ..Options::default()
    }
}

/// Samples without a monitor, with options that are right.
pub(crate) fn run(field: &dyn Field, options: &Options) -> Outcome {
    sample(field, options, &Silent).unwrap()
}

/// A field of a program, which gives enclosures.
pub(crate) fn compiled(
    dimension: usize,
    make: impl FnOnce(&mut Graph, [NodeId; 3]) -> NodeId,
) -> CompiledField {
    let mut graph = Graph::new();
    let coordinates = [0, 1, 2].map(|axis| graph.coordinate(axis));
    let root = make(&mut graph, coordinates);
    let program = Program::new(&graph, &[root], dimension);
    CompiledField::new(Arc::new(program), Vec::new())
}

/// Σ (x_i / r_i)² − 1 over as many axes as there are radii.
pub(crate) fn ellipsoid(radii: &[f64]) -> CompiledField {
    compiled(radii.len(), |graph, coordinates| {
        let mut sum = graph.constant(-1.0);
        for (coordinate, &radius) in coordinates.into_iter().zip(radii) {
            let radius = graph.constant(radius);
            let part = graph.apply(Op::Divide, &[coordinate, radius]);
            let square = graph.apply(Op::Multiply, &[part, part]);
            sum = graph.apply(Op::Add, &[sum, square]);
        }
        sum
    })
}

/// (√(x² + y²) - R)² + z² - r² with R = 1, r = 0.3, compiled.
pub(crate) fn compiled_torus() -> CompiledField {
    compiled(3, |graph, [x, y, z]| {
        let ring = graph.apply(Op::Hypot, &[x, y]);
        let one = graph.constant(1.0);
        let off = graph.apply(Op::Subtract, &[ring, one]);
        let [off, z] = [off, z].map(|side| graph.apply(Op::Multiply, &[side, side]));
        let sum = graph.apply(Op::Add, &[off, z]);
        let tube = graph.constant(0.09);
        graph.apply(Op::Subtract, &[sum, tube])
    })
}
