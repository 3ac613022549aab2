//! Newton's method for F_x = 0, from the middles of suspicious cells.
//!
//! A singular point need not be isolated, and F_xx need not be regular there, so a step is
//! −F_xx⁺ F_x with the pseudo-inverse: along a curve of singular points the method converges to
//! the nearest one. Where F_xx vanishes too, as on Taubin's heart, convergence is linear (the
//! distance is halved at a zero of F of third order), hence the number of rounds.

use glam::{DMat3, DVec3};

use super::Cancelled;
use super::cells::Cells;
use crate::engine::{CompiledField, Monitor};
use crate::geometry::Bounds;

/// Rounds of the method: enough to halve a distance down to rounding errors.
const ROUNDS: usize = 60;

/// Cells from which it starts at most; of more, evenly chosen ones.
const MOST_STARTS: usize = 4096;

/// Eigenvalues of F_xx below this part of the largest count as 0.
const RANK: f64 = 1e-9;

/// |F_x| below this part of the typical one is a vanishing gradient.
const LEVEL: f64 = 1e-7;

/// |F| below this part of the typical |F_x| times the box's diagonal is a zero.
const ZERO: f64 = 1e-10;

/// Sweeps of Jacobi's method; each makes the rest quadratically smaller.
const SWEEPS: usize = 8;

/// A start, where it has come to and the best point on its way.
struct Particle {
    start: DVec3,
    place: DVec3,
    best: Option<Found>,
}

/// A point at which the gradient nearly vanishes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    /// The point.
    pub(super) point: DVec3,
    /// |F_x| there.
    pub(super) slope: f64,
    value: f64,
}

/// The points of the zero set with a vanishing gradient to which the method converges from the
/// cells' middles, in the order of the cells. `slope` is the typical |F_x|.
pub(super) fn converge(
    field: &CompiledField,
    bounds: &Bounds,
    cells: &Cells,
    slope: f64,
    monitor: &dyn Monitor,
) -> Result<Vec<Found>, Cancelled> {
    let stride = cells.centers.len().div_ceil(MOST_STARTS).max(1);
    let starts = cells.centers.iter().step_by(stride);
    let mut moving: Vec<Particle> = starts
        .map(|&start| Particle {
            start,
            place: start,
            best: None,
        })
        .collect();
    let reach = 4.0 * cells.diagonal();
    let finest = f64::EPSILON * (bounds.diagonal() + bounds.center().length());
    let mut still = Vec::new();
    for round in 0..ROUNDS {
        if monitor.cancelled() {
            return Err(Cancelled);
        }
        monitor.progress("inspecting", 0.5 + 0.5 * round as f64 / ROUNDS as f64);
        let derivatives = derivatives(field, cells.dimension, &moving);
        let mut next = Vec::with_capacity(moving.len());
        for (mut particle, (value, gradient, hessian)) in moving.into_iter().zip(derivatives) {
            let length = gradient.length();
            if length.is_nan() || value.is_nan() {
                continue;
            }
            if particle.best.is_none_or(|best| length < best.slope) {
                particle.best = Some(Found {
                    point: particle.place,
                    slope: length,
                    value,
                });
            }
            let step = newton_step(gradient, hessian).clamp_length_max(0.5 * reach);
            particle.place += step;
            let strayed = particle.place.distance(particle.start) > reach;
            // A step of 0 although the gradient is not 0: F_xx tells nothing, as at a kink.
            let stuck = step.length() <= finest && length > LEVEL * slope;
            match step.length() <= finest {
                _ if strayed || stuck || !step.is_finite() => {}
                true => still.push(particle),
                false => next.push(particle),
            }
        }
        moving = next;
        if moving.is_empty() {
            break;
        }
    }
    still.append(&mut moving);
    // The order of the cells, whenever they came to rest.
    still.sort_by(|a, b| lexicographic(a.start, b.start));
    let margin = 1e-9 * bounds.diagonal();
    let found = still.into_iter().filter_map(|particle| particle.best);
    Ok(found
        .filter(|found| {
            found.slope <= LEVEL * slope
                && found.value.abs() <= ZERO * slope * bounds.diagonal()
                && within(bounds, found.point, margin)
        })
        .collect())
}

/// The order by x, then y, then z.
pub(super) fn lexicographic(a: DVec3, b: DVec3) -> std::cmp::Ordering {
    let pairs = a.to_array().into_iter().zip(b.to_array());
    pairs.fold(std::cmp::Ordering::Equal, |order, (a, b)| {
        order.then(a.total_cmp(&b))
    })
}

fn within(bounds: &Bounds, point: DVec3, margin: f64) -> bool {
    point.cmpge(bounds.min - margin).all() && point.cmple(bounds.max + margin).all()
}

/// F, F_x and F_xx at the places of all particles.
fn derivatives(
    field: &CompiledField,
    dimension: usize,
    particles: &[Particle],
) -> Vec<(f64, DVec3, DMat3)> {
    let count = particles.len();
    let points: Vec<Vec<f64>> = (0..dimension)
        .map(|axis| {
            particles
                .iter()
                .map(|particle| particle.place[axis])
                .collect()
        })
        .collect();
    let columns: Vec<&[f64]> = points.iter().map(Vec::as_slice).collect();
    let mut values = vec![f64::NAN; count];
    let mut gradients = vec![vec![f64::NAN; count]; dimension];
    let mut hessians = vec![vec![f64::NAN; count]; dimension * (dimension + 1) / 2];
    field.hessians(
        &columns,
        &mut values,
        &mut gradients
            .iter_mut()
            .map(Vec::as_mut_slice)
            .collect::<Vec<_>>(),
        &mut hessians
            .iter_mut()
            .map(Vec::as_mut_slice)
            .collect::<Vec<_>>(),
    );
    (0..count)
        .map(|index| {
            let mut gradient = DVec3::ZERO;
            let mut hessian = DMat3::ZERO;
            let mut entries = hessians.iter();
            for row in 0..dimension {
                gradient[row] = gradients[row][index];
                for column in row..dimension {
                    let entry = entries.next().map_or(f64::NAN, |entry| entry[index]);
                    hessian.col_mut(row)[column] = entry;
                    hessian.col_mut(column)[row] = entry;
                }
            }
            (values[index], gradient, hessian)
        })
        .collect()
}

/// −F_xx⁺ F_x.
fn newton_step(gradient: DVec3, hessian: DMat3) -> DVec3 {
    let (values, vectors) = eigen(hessian);
    let largest = values.abs().max_element();
    let mut step = DVec3::ZERO;
    for axis in 0..3 {
        if values[axis].abs() > RANK * largest {
            let direction = vectors.col(axis);
            step -= direction * (direction.dot(gradient) / values[axis]);
        }
    }
    step
}

/// The eigenvalues of a symmetric matrix, and its eigenvectors as columns, by Jacobi's cyclic
/// method (Golub and Van Loan, Matrix Computations, section 8.5).
fn eigen(matrix: DMat3) -> (DVec3, DMat3) {
    let (mut matrix, mut vectors) = (matrix, DMat3::IDENTITY);
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let off = matrix.col(q)[p];
            if off == 0.0 || !off.is_finite() {
                continue;
            }
            let theta = (matrix.col(q)[q] - matrix.col(p)[p]) / (2.0 * off);
            let tangent = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
            let sine = tangent * cosine;
            let mut rotation = DMat3::IDENTITY;
            rotation.col_mut(p)[p] = cosine;
            rotation.col_mut(q)[q] = cosine;
            rotation.col_mut(q)[p] = sine;
            rotation.col_mut(p)[q] = -sine;
            matrix = rotation.transpose() * matrix * rotation;
            vectors *= rotation;
        }
    }
    let diagonal = DVec3::new(matrix.col(0)[0], matrix.col(1)[1], matrix.col(2)[2]);
    (diagonal, vectors)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvalues_of_a_known_matrix() {
        // The path on three nodes: 0, 1 and 3 are the eigenvalues of its Laplacian.
        let matrix = DMat3::from_cols(
            DVec3::new(1.0, -1.0, 0.0),
            DVec3::new(-1.0, 2.0, -1.0),
            DVec3::new(0.0, -1.0, 1.0),
        );
        let (values, vectors) = eigen(matrix);
        let mut sorted = values.to_array();
        sorted.sort_by(f64::total_cmp);
        for (found, expected) in sorted.into_iter().zip([0.0, 1.0, 3.0]) {
            assert!((found - expected).abs() < 1e-14, "{sorted:?}");
        }
        let rebuilt = vectors * DMat3::from_diagonal(values) * vectors.transpose();
        assert!(
            (rebuilt - matrix)
                .to_cols_array()
                .iter()
                .all(|e| e.abs() < 1e-14)
        );
    }

    #[test]
    fn a_singular_matrix_moves_only_where_it_tells() {
        let hessian = DMat3::from_diagonal(DVec3::new(2.0, 4.0, 0.0));
        let step = newton_step(DVec3::new(2.0, 2.0, 1.0), hessian);
        assert_eq!(step, DVec3::new(-1.0, -0.5, 0.0));
        assert_eq!(newton_step(DVec3::ONE, DMat3::ZERO), DVec3::ZERO);
    }
}
