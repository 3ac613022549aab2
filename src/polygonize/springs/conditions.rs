//! The three conditions of a triangulation that is ε-subordinated to a level set (section 3 of the
//! paper), measured.

use glam::DVec3;

use super::super::{Job, Shape};
use super::complex::{Complex, PAIRS};
use super::motion::{EPSILON, distances};
use crate::geometry::{Quality, radius_ratio};

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
    /// The mean radius ratio of these simplices.
    pub mean_ratio: f64,
    /// The least.
    pub worst_ratio: f64,
}

/// The polygons of a triangulation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Polygons {
    /// The shape of the triangles; none in R2, where the polygons are segments.
    pub quality: Option<Quality>,
    /// The shortest of their sides.
    pub shortest: f64,
    /// The longest.
    pub longest: f64,
}

impl Polygons {
    /// Of a mesh or of curves.
    pub(super) fn of(shape: &Shape) -> Self {
        let quality = match shape {
            Shape::Mesh(mesh) => mesh.quality(),
            _ => None,
        };
        if let Some(quality) = quality {
            return Polygons {
                shortest: quality.shortest_edge,
                longest: quality.longest_edge,
                quality: Some(quality),
            };
        }
        let Shape::Curves(curves) = shape else {
            return Polygons::default();
        };
        let lengths = curves.polylines.iter().flat_map(|polyline| {
            let points = &polyline.points;
            let end = points.last().filter(|_| polyline.closed);
            let ends = end.map(|end| end.distance(points[0]));
            let pairs = points.windows(2).map(|pair| pair[0].distance(pair[1]));
            pairs.chain(ends)
        });
        let (shortest, longest) = lengths.fold((f64::INFINITY, 0.0), |(least, most), length| {
            (f64::min(least, length), f64::max(most, length))
        });
        Polygons {
            quality: None,
            shortest: shortest.min(longest),
            longest,
        }
    }
}

/// How an adapted triangulation came out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Subordination {
    /// The simplices that the level set intersects.
    pub simplices: usize,
    /// Explicit Euler steps.
    pub steps: usize,
    /// Whether equilibrium was reached: the energy decreases no more.
    pub at_rest: bool,
    /// The energy of springs and forces along the gradient, before and after, with springs of
    /// stiffness 1.
    pub energy: [f64; 2],
    /// The conditions in the Freudenthal triangulation.
    pub before: Conditions,
    /// The conditions in the adapted one.
    pub after: Conditions,
    /// The polygons in the Freudenthal triangulation and those that are given.
    pub polygons: [Polygons; 2],
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
    let (mut sum_of_ratios, mut worst_ratio) = (0.0, f64::INFINITY);
    for (simplex, &(distance, normal)) in complex.simplices.iter().zip(&centres) {
        let corners = &simplex[..complex.corners()];
        let far = |&node: &u32| nodes[node as usize].0.abs() >= TRANSVERSAL * epsilon;
        sums[0] += usize::from(corners.iter().all(far));
        let ratio = ratio(complex, simplex);
        sum_of_ratios += ratio;
        worst_ratio = f64::min(worst_ratio, ratio);
        sums[1] += usize::from(ratio >= REGULAR);
        let is_parallel = distance.abs() < epsilon && is_parallel(complex, simplex, normal);
        sums[2] += usize::from(is_parallel);
    }
    let [transversal, regular, parallel] = sums.map(|sum| sum as f64 / count);
    Conditions {
        transversal,
        regular,
        parallel,
        mean_ratio: sum_of_ratios / count,
        worst_ratio,
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
