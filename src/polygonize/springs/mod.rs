//! Adapted triangulations: a mesh of springs that fits itself to the level set, then marching
//! triangles or tetrahedra on it.
//!
//! L. Velho, J. de Miranda Gomes, D. Terzopoulos, "Implicit Manifolds, Triangulations and Dynamics".
//! Of the paper: the
//! Freudenthal triangulation and the choice of simplices, nodes and springs (section 4); the
//! attracting and repelling forces along the gradient, the rest length 2 ε and explicit Euler steps
//! (section 5); the polygons, one or two a simplex (section 7); the three conditions of
//! ε-subordination (section 3), which are measured. Not of the paper: nodes are kept from crossing the
//! level and simplices from turning over, so that the topology is that of the grid; and in R3 the
//! triangles are made better afterwards, by flips of edges and by moving vertices along the surface
//! to the middle of their neighbours.

mod complex;
mod conditions;
mod cut;
mod motion;

use self::complex::Complex;
use super::{Found, Job, PolygonizeError, Statistics};

pub use conditions::{Conditions, Polygons, Subordination};

/// The most simplices: their nodes and springs have numbers.
const LIMIT: usize = 1 << 27;

/// The level set by an adapted triangulation.
pub(super) fn adapt(job: &Job) -> Result<Found, PolygonizeError> {
    let (mut complex, seen, statistics) = Complex::new(job)?;
    let before = conditions::measure(job, &complex);
    let (plain, plainly) = cut::cut(job, &complex, false)?;
    let motion = motion::relax(job, &mut complex)?;
    let (shape, found) = cut::cut(job, &complex, true)?;
    let subordination = Subordination {
        simplices: complex.simplices.len(),
        steps: motion.steps,
        at_rest: motion.at_rest,
        energy: motion.energy,
        before,
        after: conditions::measure(job, &complex),
        polygons: [Polygons::of(&plain), Polygons::of(&shape)],
    };
    let evaluations = motion.evaluations + 2 * complex.simplices.len();
    let mut statistics = statistics.and(Statistics {
        evaluations: found.evaluations + plainly.evaluations + evaluations,
        ..found
    });
    statistics.subordination = Some(subordination);
    Ok((shape, seen, statistics))
}
