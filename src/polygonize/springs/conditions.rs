//! The three conditions of a triangulation that is ε-subordinated to a level set (section 3 of the
//! paper), measured.

use glam::DVec3;

use super::super::Job;
use super::complex::{Complex, PAIRS};
use super::motion::{EPSILON, distances};
use crate::geometry::radius_ratio;

/// Nodes nearer to the level set, relative to ε, are not transversal to it.
const TRANSVERSAL: f64 = 0.1;

/// The least radius ratio of a regular simplex: that of the Freudenthal tetrahedron is 0.717 and that
/// of its triangle 0.828.
const REGULAR: f64 = 0.5;

/// The faces of a simplex of codimension 1, by the corners they have: triangles and sides.
const FACES: [[usize; 3]; 4] = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]];

/// What share of the simplices that the level set intersects satisfies each condition of
/// ε-subordination. ε is 0.35 times the side of a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Conditions {
    /// (1) No node is nearer to the level set than ε / 10, to first order.
    pub transversal: f64,
    /// (2) The radius ratio, dimension times inradius over circumradius, is at least 1/2.
    pub regular: f64,
    /// (3) The level set is nearer than ε to the barycentre, and its tangent there makes an angle
    /// with one of the faces of codimension 1 whose sine is at most 0.35.
    pub parallel: f64,
}

/// How an adapted triangulation came out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Subordination {
    /// The simplices that the level set intersects.
    pub simplices: usize,
    /// Explicit Euler steps.
    pub steps: usize,
    /// Whether equilibrium was reached: no node would move farther than a thousandth of a cell in the
    /// next step.
    pub at_rest: bool,
    /// The energy of springs and forces along the gradient, before and after, with springs of
    /// stiffness 1.
    pub energy: [f64; 2],
    /// The conditions in the Freudenthal triangulation.
    pub before: Conditions,
    /// The conditions in the adapted one.
    pub after: Conditions,
}

/// Measures the conditions.
pub(super) fn measure(job: &Job, complex: &Complex) -> Conditions {
    let count = complex.simplices.len() as f64;
    if count == 0.0 {
        return Conditions::default();
    }
    let epsilon = EPSILON * complex.spacing;
    let nodes = distances(job, &complex.nodes);
    let centres: Vec<DVec3> = complex
        .simplices
        .iter()
        .map(|simplex| {
            let corners = &simplex[..complex.corners()];
            let sum: DVec3 = corners
                .iter()
                .map(|&node| complex.nodes[node as usize])
                .sum();
            sum / corners.len() as f64
        })
        .collect();
    let centres = distances(job, &centres);
    let mut sums = [0usize; 3];
    for (simplex, &(distance, normal)) in complex.simplices.iter().zip(&centres) {
        let corners = &simplex[..complex.corners()];
        let far = |&node: &u32| nodes[node as usize].0.abs() >= TRANSVERSAL * epsilon;
        sums[0] += usize::from(corners.iter().all(far));
        sums[1] += usize::from(ratio(complex, simplex) >= REGULAR);
        let is_parallel = distance.abs() < epsilon && is_parallel(complex, simplex, normal);
        sums[2] += usize::from(is_parallel);
    }
    let [transversal, regular, parallel] = sums.map(|sum| sum as f64 / count);
    Conditions {
        transversal,
        regular,
        parallel,
    }
}

fn is_parallel(complex: &Complex, simplex: &[u32; 4], normal: DVec3) -> bool {
    let at = |corner: usize| complex.nodes[simplex[corner] as usize];
    match complex.dimension {
        2 => PAIRS[..3].iter().any(|&[from, to]| {
            let along = (at(to) - at(from)).normalize_or_zero();
            normal != DVec3::ZERO && along.dot(normal).abs() <= EPSILON
        }),
        _ => FACES.iter().any(|&[a, b, c]| {
            let across = (at(b) - at(a)).cross(at(c) - at(a)).normalize_or_zero();
            normal != DVec3::ZERO
                && across.cross(normal).length() <= EPSILON
                && across != DVec3::ZERO
        }),
    }
}

/// The radius ratio of a simplex.
fn ratio(complex: &Complex, simplex: &[u32; 4]) -> f64 {
    // The last corner of a triangle is repeated.
    let [a, b, c, d] = *simplex;
    let corners = [a, b, c, if complex.dimension == 2 { c } else { d }];
    radius_ratio(
        complex.dimension,
        corners.map(|node| complex.nodes[node as usize]),
    )
}
