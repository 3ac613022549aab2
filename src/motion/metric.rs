//! What a small change of the parameters is: the metric tensor M, by which |q̇|² is q̇ · M q̇.
//!
//! With the identity, a parameter that moves the whole surface by its own length costs as much as one
//! that nobody sees. The metric of [`sensitivity`] measures what is seen.

use glam::DVec3;

use super::MotionError;
use super::dense::{Cholesky, Symmetric};
use super::rows::{Rows, SparseRows, length};
use crate::engine::{CompiledField, Field};

/// Parameters by which a surface moves less than this part of what the most effective one moves it, in
/// the root mean square, count as if they moved it so much. Otherwise what moves nothing would cost
/// nothing and run away.
const LEAST_SENSITIVITY: f64 = 0.01;

/// The place of a parameter that takes no part.
const NOWHERE: u32 = u32::MAX;

/// A symmetric, positive definite tensor over the parameters.
#[derive(Clone, Debug)]
pub struct Metric(Kind);

#[derive(Clone, Debug)]
enum Kind {
    Identity,
    Diagonal(Vec<f64>),
    Full(Symmetric),
}

impl Metric {
    /// All parameters alike.
    pub fn identity() -> Metric {
        Metric(Kind::Identity)
    }

    /// A weight for each parameter: the larger, the less it moves.
    ///
    /// # Errors
    ///
    /// A weight that is not positive and finite.
    pub fn diagonal(weights: Vec<f64>) -> Result<Metric, MotionError> {
        match weights
            .iter()
            .all(|&weight| weight > 0.0 && weight.is_finite())
        {
            true => Ok(Metric(Kind::Diagonal(weights))),
            false => Err(MotionError::Metric),
        }
    }

    /// A whole matrix, row by row. Steps cost m³/3 operations for m parameters, so it is for few.
    ///
    /// # Errors
    ///
    /// Rows of other lengths than there are rows; a matrix that is not symmetric or, to rounding, not
    /// positive definite.
    pub fn full(rows: &[Vec<f64>]) -> Result<Metric, MotionError> {
        let mut matrix = Symmetric::zero(rows.len());
        for (place, row) in rows.iter().enumerate() {
            let is_symmetric = |(other, &entry): (usize, &f64)| {
                rows.get(other).and_then(|row| row.get(place)) == Some(&entry)
            };
            if row.len() != rows.len() || !row.iter().enumerate().all(is_symmetric) {
                return Err(MotionError::Metric);
            }
            matrix.row_mut(place).copy_from_slice(row);
        }
        match Cholesky::new(matrix.clone()) {
            Some(_) => Ok(Metric(Kind::Full(matrix))),
            None => Err(MotionError::Metric),
        }
    }

    /// Checks that it is for this number of parameters.
    pub(super) fn check(&self, expected: usize) -> Result<(), MotionError> {
        let found = match &self.0 {
            Kind::Identity => expected,
            Kind::Diagonal(weights) => weights.len(),
            Kind::Full(matrix) => matrix.size(),
        };
        match found == expected {
            true => Ok(()),
            false => Err(MotionError::Length {
                what: "the metric",
                found,
                expected,
            }),
        }
    }

    /// Coordinates in which the parameters at these ascending places have the metric of Euclid. None
    /// where rounding makes the part of the matrix indefinite.
    pub(super) fn frame(&self, free: Vec<usize>, count: usize) -> Option<Frame> {
        let mut index = vec![NOWHERE; count];
        for (own, &place) in free.iter().enumerate() {
            index[place] = own as u32;
        }
        let axes = match &self.0 {
            Kind::Identity => Axes::Scaled(vec![1.0; free.len()]),
            Kind::Diagonal(weights) => {
                let scale = |&place: &usize| 1.0 / weights[place].sqrt();
                Axes::Scaled(free.iter().map(scale).collect())
            }
            Kind::Full(matrix) => {
                let mut part = Symmetric::zero(free.len());
                for (row, &place) in free.iter().enumerate() {
                    for (column, &other) in free[..=row].iter().enumerate() {
                        part.row_mut(row)[column] = matrix.at(place, other);
                    }
                }
                Axes::Skew(Cholesky::new(part)?)
            }
        };
        Some(Frame { free, index, axes })
    }
}

/// Coordinates y of some parameters' changes, in which lengths are those of Euclid: y = Lᵀ d with M = L
/// Lᵀ.
pub(super) struct Frame {
    /// The places of the parameters, ascending.
    pub(super) free: Vec<usize>,
    /// Where each parameter of q is among them.
    index: Vec<u32>,
    axes: Axes,
}

enum Axes {
    /// What a coordinate is multiplied with to give the parameter's change.
    Scaled(Vec<f64>),
    /// L
    Skew(Cholesky),
}

impl Frame {
    /// Appends the row a as L⁻¹ a, so that its product with y is that of a with d.
    pub(super) fn push(&self, (places, entries): (&[u32], &[f64]), rows: &mut SparseRows) {
        let own = places.iter().zip(entries).filter_map(|(&place, &entry)| {
            let own = self.index[place as usize];
            (own != NOWHERE).then_some((own, entry))
        });
        match &self.axes {
            Axes::Scaled(scales) => {
                rows.push(own.map(|(own, entry)| (own, entry * scales[own as usize])));
            }
            Axes::Skew(factor) => {
                let mut dense = vec![0.0; self.free.len()];
                own.for_each(|(own, entry)| dense[own as usize] = entry);
                factor.solve_lower(&mut dense);
                let entries = dense.into_iter().enumerate();
                rows.push(entries.map(|(own, entry)| (own as u32, entry)));
            }
        }
    }

    /// Adds the change with these coordinates to a step of q.
    pub(super) fn add_to(&self, mut coordinates: Vec<f64>, step: &mut [f64]) {
        match &self.axes {
            Axes::Scaled(scales) => {
                for (coordinate, scale) in coordinates.iter_mut().zip(scales) {
                    *coordinate *= scale;
                }
            }
            Axes::Skew(factor) => factor.solve_upper(&mut coordinates),
        }
        for (&place, change) in self.free.iter().zip(coordinates) {
            step[place] += change;
        }
    }
}

/// The metric that compensates for how differently parameters move the surface: M_kk is the mean over
/// the points of (F_q_k / |F_x|)², the square of the speed of the surface at a point when parameter k
/// alone changes at speed 1. So q̇ · M q̇ is a squared speed of the surface, and what moves much of it
/// moves little. This is the sensitivity matrix of Witkin and Heckbert's footnote 1, without what is
/// off its diagonal.
///
/// The points are to cover the surface evenly: floaters do. Those at which F_x vanishes or something is
/// undefined are left out; without any other the metric is the identity. Costs one evaluation of F_q at
/// each point.
pub fn sensitivity(field: &CompiledField, points: &[DVec3]) -> Metric {
    let rows = Rows::evaluate(field, points);
    let mut weights = vec![0.0; field.parameters().len()];
    for point in 0..rows.count() {
        let slope = length(rows.gradients[point]);
        if slope > 0.0 && rows.is_defined(point) {
            let (places, entries) = rows.row(point);
            for (&place, entry) in places.iter().zip(entries) {
                let speed = entry / slope;
                weights[place as usize] += speed * speed;
            }
        }
    }
    let largest = weights.iter().copied().fold(0.0, f64::max);
    if !(largest > 0.0 && largest.is_finite()) {
        return Metric::identity();
    }
    let least = LEAST_SENSITIVITY * LEAST_SENSITIVITY * largest;
    let number = rows.count() as f64;
    let weight = |weight: f64| weight.max(least) / number;
    Metric(Kind::Diagonal(weights.into_iter().map(weight).collect()))
}
