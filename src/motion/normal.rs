//! The normal equations of a fit: Jᵀ J and Jᵀ r for the sparse rows of J, with columns scaled to length
//! 1.

use rayon::prelude::*;

use super::dense::Symmetric;
use super::rows::{Rows, SparseRows};

/// Entries of the scaled J below this part of the largest one in their row are left out of Jᵀ J: it is
/// still the product of a matrix with itself, 1e-9 away, and directions of steps are all that it is
/// for. Jᵀ r has all.
const NEGLIGIBLE: f64 = 1e-9;

/// Rows of the matrix that one task computes.
const BAND: usize = 16;

/// The place of a parameter that takes no part.
const NOWHERE: u32 = u32::MAX;

/// ½|r + J d|² with unknowns y = D d, where D has the lengths of the columns of J.
pub(super) struct Normal {
    /// D⁻¹ Jᵀ J D⁻¹
    pub(super) matrix: Symmetric,
    /// D⁻¹ Jᵀ r
    pub(super) slope: Vec<f64>,
    /// D; 0 for parameters that move nothing.
    pub(super) scales: Vec<f64>,
    /// |r|²
    pub(super) squares: f64,
}

impl Normal {
    /// The equations for the rows wᵢ F_q and residuals wᵢ F of all points, in the parameters at the
    /// ascending places `free` of `count`. Costs the sum of the squared numbers of entries of the rows.
    pub(super) fn new(rows: &Rows, weights: &[f64], free: &[usize], count: usize) -> Normal {
        let mut index = vec![NOWHERE; count];
        for (own, &place) in free.iter().enumerate() {
            index[place] = own as u32;
        }
        let index = &index;
        let own_row = |point: usize| {
            let (places, entries) = rows.row(point);
            let weight = weights[point];
            let own = places.iter().zip(entries).map(move |(&place, &entry)| {
                let own = index[place as usize];
                (own, weight * entry)
            });
            own.filter(|&(own, _)| own != NOWHERE)
        };
        let mut normal = Normal {
            matrix: Symmetric::zero(free.len()),
            slope: vec![0.0; free.len()],
            scales: vec![0.0; free.len()],
            squares: 0.0,
        };
        for (point, (weight, value)) in weights.iter().zip(&rows.values).enumerate() {
            let residual = weight * value;
            normal.squares += residual * residual;
            for (own, entry) in own_row(point) {
                normal.scales[own as usize] += entry * entry;
                normal.slope[own as usize] += entry * residual;
            }
        }
        for (scale, slope) in normal.scales.iter_mut().zip(&mut normal.slope) {
            *scale = scale.sqrt();
            *slope = if *scale > 0.0 { *slope / *scale } else { 0.0 };
        }
        let mut scaled = SparseRows::default();
        for point in 0..rows.count() {
            let own = own_row(point).map(|(own, entry)| (own, entry / normal.scales[own as usize]));
            // An entry may be so small that its square is 0.
            let own = own.filter(|(_, entry)| entry.is_finite());
            let largest = own
                .clone()
                .fold(0.0_f64, |sum, (_, entry)| sum.max(entry.abs()));
            scaled.push(own.filter(|(_, entry)| entry.abs() > NEGLIGIBLE * largest));
        }
        normal.multiply(&scaled);
        normal
    }

    /// The matrix: each band of it takes its part of all rows, in their order, so that sums do not
    /// depend on threads.
    fn multiply(&mut self, rows: &SparseRows) {
        let size = self.slope.len();
        let bands = self.matrix.entries_mut().par_chunks_mut(BAND * size.max(1));
        bands.enumerate().for_each(|(band, lines)| {
            let (begin, end) = ((BAND * band) as u32, (BAND * (band + 1)) as u32);
            for point in 0..rows.count() {
                let (places, entries) = rows.row(point);
                let first = places.partition_point(|&place| place < begin);
                for at in first..places.len() {
                    if places[at] >= end {
                        break;
                    }
                    let line = &mut lines[(places[at] - begin) as usize * size..][..size];
                    let factor = entries[at];
                    for (&place, &entry) in places[..=at].iter().zip(&entries[..=at]) {
                        line[place as usize] += factor * entry;
                    }
                }
            }
        });
    }

    /// Makes residuals of r / ρ(d), of which ρ(0) = 1 and t is the derivative by d: J becomes J − r tᵀ.
    /// Here t is given by place of the unknown, not scaled.
    pub(super) fn normalise(&mut self, logarithmic: &[f64]) {
        let scaled = |(&t, &scale): (&f64, &f64)| if scale > 0.0 { t / scale } else { 0.0 };
        let t: Vec<f64> = logarithmic.iter().zip(&self.scales).map(scaled).collect();
        for row in 0..t.len() {
            let (slope, squares) = (&self.slope, self.squares);
            for (column, entry) in self.matrix.row_mut(row)[..=row].iter_mut().enumerate() {
                *entry +=
                    squares * t[row] * t[column] - slope[row] * t[column] - t[row] * slope[column];
            }
        }
        for (slope, t) in self.slope.iter_mut().zip(&t) {
            *slope -= self.squares * t;
        }
    }

    /// Takes an unknown out: its step will be 0.
    pub(super) fn hold(&mut self, unknown: usize) {
        let size = self.slope.len();
        self.slope[unknown] = 0.0;
        self.matrix.row_mut(unknown)[..=unknown].fill(0.0);
        for row in unknown..size {
            self.matrix.row_mut(row)[unknown] = 0.0;
        }
    }

    /// The matrix with `damping` added to its diagonal.
    pub(super) fn damped(&self, damping: f64) -> Symmetric {
        let mut matrix = self.matrix.clone();
        for place in 0..matrix.size() {
            matrix.row_mut(place)[place] += damping;
        }
        matrix
    }

    /// By how much the change with these scaled unknowns lowers ½|r + J d|².
    pub(super) fn reduction(&self, unknowns: &[f64]) -> f64 {
        let product = self.matrix.product(unknowns);
        let part = |((y, slope), product): ((&f64, &f64), f64)| -(slope + 0.5 * product) * y;
        let parts = unknowns.iter().zip(&self.slope).zip(product);
        parts.map(part).sum()
    }
}
