//! The three conditions of a triangulation that is ε-subordinated to a level set (section 3 of the
//! paper), measured.

use glam::DVec3;

use super::super::Job;
use super::complex::{Complex, PAIRS};
use super::motion::{EPSILON, distances};

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
        sums[1] += usize::from(radius_ratio(complex, simplex) >= REGULAR);
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

/// The dimension times inradius over circumradius: 1 for the regular simplex, 0 for a flat one.
fn radius_ratio(complex: &Complex, simplex: &[u32; 4]) -> f64 {
    let at = |corner: usize| complex.nodes[simplex[corner] as usize];
    let measure = complex.measure(simplex, &complex.nodes);
    let length = |a: usize, b: usize| at(a).distance(at(b));
    if complex.dimension == 2 {
        // 2 r / R with r = A / s and R = a b c / 4 A; `measure` is 2 A and the sum of sides 2 s.
        let [a, b, c] = [length(1, 2), length(2, 0), length(0, 1)];
        return 4.0 * measure * measure / ((a + b + c) * a * b * c);
    }
    // 3 r / R with r = 3 V / S, R = |Σ a² (b × c)| / 12 V for edges a, b, c from one corner.
    let [a, b, c] = [at(1) - at(0), at(2) - at(0), at(3) - at(0)];
    let vector = a.length_squared() * b.cross(c)
        + b.length_squared() * c.cross(a)
        + c.length_squared() * a.cross(b);
    let area = |[i, j, k]: [usize; 3]| 0.5 * (at(j) - at(i)).cross(at(k) - at(i)).length();
    let areas: f64 = FACES.iter().map(|&face| area(face)).sum();
    3.0 * measure * measure / (areas * vector.length())
}
