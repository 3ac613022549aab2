//! The smallest change of the parameters that satisfies linear constraints: equations 7 and 8 of Witkin
//! and Heckbert.
//!
//! Minimise ½ |d − D|² in the metric M subject to aᵢ · d = cᵢ, where aᵢ is F_q at a control point. With
//! Lagrange's multipliers, d = D − M⁻¹ Σ λʲ aʲ and Σⱼ (aⁱ M⁻¹ aʲ) λʲ = aⁱ · D − cⁱ. The matrix is
//! scaled to a diagonal of ones, since rows of F_q differ by any power of ten, and factored by
//! Cholesky. That it succeeds proves nothing: with a condition of 1e16 the multipliers are noise of any
//! size. So the condition is estimated, and where it is bad, or there are more constraints than
//! parameters, the least change is taken among those that violate the constraints least: the
//! pseudo-inverse, from eigenvalues of the smaller Gram matrix with the negligible ones left out.

use rayon::prelude::*;

use super::dense::{Cholesky, Symmetric, dot};
use super::freedom::Freedom;
use super::metric::{Frame, Metric};
use super::rows::SparseRows;

/// Of a matrix with a larger condition the multipliers have fewer than four digits, which one
/// refinement doubles. The same threshold cuts eigenvalues: they are known to about 1e-14 of the
/// largest, and below 1e-12 (1e-6 in terms of rows) a unit of mismatch between two constraints would
/// cost a million units of change.
const LARGEST_CONDITION: f64 = 1e12;

/// In the sense of least squares no constraint has more than this times the weight that the median one
/// has, or less than one part in so many of it: both would let eigenvalues be cut that matter.
const LARGEST_WEIGHT: f64 = 1e3;

/// How often the problem is solved again because parameters would have left their ranges. In each round
/// at least one is held at its bound, usually all that have to be.
const ROUNDS: usize = 12;

/// How a change was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solver {
    /// All constraints can be satisfied, and the system said so clearly. Also where there was none.
    Cholesky,
    /// The constraints contradict or repeat each other, nearly do, or are more than there are free
    /// parameters: the change violates them least.
    LeastSquares,
}

/// What is to be solved.
pub(super) struct Problem<'a> {
    /// The aᵢ.
    pub(super) rows: &'a SparseRows,
    /// The cᵢ.
    pub(super) targets: &'a [f64],
    /// What a violation of each constraint counts in the sense of least squares; 0 for one that is to
    /// be ignored altogether.
    pub(super) weights: &'a [f64],
    /// D
    pub(super) desired: &'a [f64],
    pub(super) metric: &'a Metric,
    pub(super) freedom: &'a Freedom,
    /// How far each parameter may go, down and up.
    pub(super) room: &'a [[f64; 2]],
}

/// The solution.
pub(super) struct Change {
    /// d, always finite; exactly 0 for what is frozen.
    pub(super) step: Vec<f64>,
    pub(super) solver: Solver,
    /// How many constraints are independent of each other.
    pub(super) rank: usize,
    /// Whether some free parameter has to do with each constraint.
    pub(super) is_reachable: Vec<bool>,
}

/// Solves the problem. Parameters that would leave their room stop at its end and are held there while
/// the others are found again.
pub(super) fn least_change(problem: &Problem) -> Change {
    let count = problem.desired.len();
    let frozen = |place| problem.freedom.is_frozen(place).then_some(0.0);
    let mut fixed: Vec<Option<f64>> = (0..count).map(frozen).collect();
    let mut change = solve(problem, &fixed);
    for _ in 0..ROUNDS {
        let mut is_changed = false;
        for (place, fixed) in fixed.iter_mut().enumerate() {
            let [low, high] = problem.room[place];
            let step = change.step[place];
            if fixed.is_none() && (step < low || step > high) {
                *fixed = Some(step.clamp(low, high));
                is_changed = true;
            }
        }
        if !is_changed {
            return change;
        }
        let is_reachable = change.is_reachable;
        change = solve(problem, &fixed);
        change.is_reachable = is_reachable;
    }
    for (step, &[low, high]) in change.step.iter_mut().zip(problem.room) {
        *step = step.clamp(low, high);
    }
    change
}

/// The constraints that are left, in a frame with Euclid's metric, each divided by its length.
struct System {
    rows: SparseRows,
    targets: Vec<f64>,
    weights: Vec<f64>,
}

/// Solves the problem with some parameters' changes given.
fn solve(problem: &Problem, fixed: &[Option<f64>]) -> Change {
    let count = fixed.len();
    let mut change = Change {
        step: fixed.iter().map(|fixed| fixed.unwrap_or(0.0)).collect(),
        solver: Solver::Cholesky,
        rank: 0,
        is_reachable: vec![false; problem.rows.count()],
    };
    let free: Vec<usize> = (0..count).filter(|&place| fixed[place].is_none()).collect();
    for &place in &free {
        change.step[place] = problem.desired[place];
    }
    // A part of a positive definite matrix is one, too, if rounding does not interfere.
    let Some(frame) = problem.metric.frame(free, count) else {
        return change;
    };
    let system = System::new(problem, &frame, &mut change);
    if system.rows.count() == 0 {
        return change;
    }
    let well_posed = (system.rows.count() <= frame.free.len())
        .then(|| system.multipliers())
        .flatten();
    let coordinates = match well_posed {
        Some(multipliers) => {
            change.rank = system.rows.count();
            system.combination(&multipliers, frame.free.len())
        }
        None => {
            change.solver = Solver::LeastSquares;
            let (coordinates, rank) = system.pseudo_inverse(frame.free.len());
            change.rank = rank;
            coordinates
        }
    };
    if coordinates.iter().all(|coordinate| coordinate.is_finite()) {
        frame.add_to(coordinates, &mut change.step);
    }
    change
}

impl System {
    /// What the present step leaves of the constraints, for those that free parameters have to do with.
    fn new(problem: &Problem, frame: &Frame, change: &mut Change) -> System {
        let mut raw = SparseRows::default();
        let mut system = System {
            rows: SparseRows::default(),
            targets: Vec::new(),
            weights: Vec::new(),
        };
        for index in 0..problem.rows.count() {
            frame.push(problem.rows.row(index), &mut raw);
            let (places, entries) = raw.row(index);
            let largest = entries
                .iter()
                .fold(0.0_f64, |sum, entry| sum.max(entry.abs()));
            let squares: f64 = entries.iter().map(|e| (e / largest) * (e / largest)).sum();
            let length = largest * squares.sqrt();
            let left = problem.targets[index] - problem.rows.product(index, &change.step);
            let target = left / length;
            let weight = problem.weights[index];
            if !(length > 0.0 && length.is_finite() && target.is_finite() && weight > 0.0) {
                continue;
            }
            change.is_reachable[index] = true;
            let unit = entries.iter().map(|entry| entry / length);
            system.rows.push(places.iter().copied().zip(unit));
            system.targets.push(target);
            system.weights.push(weight * length);
        }
        limit_to_median(&mut system.weights, LARGEST_WEIGHT);
        system
    }

    /// The multipliers that satisfy all constraints, if the matrix is well conditioned.
    fn multipliers(&self) -> Option<Vec<f64>> {
        let factor = Cholesky::new(self.gram(&vec![1.0; self.targets.len()]))?;
        if factor.condition() > LARGEST_CONDITION {
            return None;
        }
        let mut multipliers = factor.solve(&self.targets);
        // One refinement, with what the rows themselves say is left.
        let width = self.width();
        let coordinates = self.combination(&multipliers, width);
        let left: Vec<f64> = (0..self.targets.len())
            .map(|index| self.targets[index] - self.rows.product(index, &coordinates))
            .collect();
        for (multiplier, correction) in multipliers.iter_mut().zip(factor.solve(&left)) {
            *multiplier += correction;
        }
        Some(multipliers)
    }

    /// One more than the last place in any row.
    fn width(&self) -> usize {
        let last = |index| {
            self.rows
                .row(index)
                .0
                .last()
                .map_or(0, |&place| 1 + place as usize)
        };
        (0..self.rows.count()).map(last).max().unwrap_or(0)
    }

    /// The products of the rows, each weighed.
    fn gram(&self, weights: &[f64]) -> Symmetric {
        let count = self.rows.count();
        let width = self.width();
        let mut gram = Symmetric::zero(count);
        let rows = gram.entries_mut();
        let work = |(index, entries): (usize, &mut [f64])| {
            let mut dense = vec![0.0; width];
            self.rows.add(index, weights[index], &mut dense);
            for (other, entry) in entries[..=index].iter_mut().enumerate() {
                *entry = weights[other] * self.rows.product(other, &dense);
            }
        };
        parallel_rows(rows, count, work);
        gram
    }

    /// The sum of the rows times the factors, a vector of `width` components.
    fn combination(&self, factors: &[f64], width: usize) -> Vec<f64> {
        let mut sum = vec![0.0; width];
        for (index, &factor) in factors.iter().enumerate() {
            self.rows.add(index, factor, &mut sum);
        }
        sum
    }

    /// The shortest vector of `width` components for which the weighed violations have the least sum of
    /// squares, and the rank.
    fn pseudo_inverse(&self, width: usize) -> (Vec<f64>, usize) {
        let count = self.rows.count();
        let weighed = |index: usize| self.weights[index] * self.targets[index];
        if count <= width {
            // Bᵀ (B Bᵀ)⁺ c
            let side: Vec<f64> = (0..count).map(weighed).collect();
            let (mut factors, rank) = inverse(&self.gram(&self.weights), &side);
            for (factor, weight) in factors.iter_mut().zip(&self.weights) {
                *factor *= weight;
            }
            return (self.combination(&factors, width), rank);
        }
        // (Bᵀ B)⁺ Bᵀ c
        let mut normal = Symmetric::zero(width);
        let mut side = vec![0.0; width];
        for index in 0..count {
            let weight = self.weights[index];
            self.rows.add(index, weight * weighed(index), &mut side);
            let (places, entries) = self.rows.row(index);
            for (&place, entry) in places.iter().zip(entries) {
                let row = normal.row_mut(place as usize);
                self.rows.add(index, weight * weight * entry, row);
            }
        }
        inverse(&normal, &side)
    }
}

/// Runs the work on each row of a square matrix, in parallel where that is worth it.
fn parallel_rows(
    entries: &mut [f64],
    size: usize,
    work: impl Fn((usize, &mut [f64])) + Send + Sync,
) {
    if size < 32 {
        entries.chunks_mut(size.max(1)).enumerate().for_each(work);
    } else {
        entries.par_chunks_mut(size).enumerate().for_each(work);
    }
}

/// The pseudo-inverse of a matrix times a vector, and the rank.
fn inverse(matrix: &Symmetric, side: &[f64]) -> (Vec<f64>, usize) {
    let mut product = vec![0.0; side.len()];
    let mut rank = 0;
    let pairs = matrix.eigen().unwrap_or_default();
    let largest = pairs.iter().map(|pair| pair.0).fold(0.0, f64::max);
    for (value, vector) in pairs {
        if value * LARGEST_CONDITION > largest {
            rank += 1;
            let factor = dot(&vector, side) / value;
            for (product, component) in product.iter_mut().zip(vector) {
                *product += factor * component;
            }
        }
    }
    (product, rank)
}

/// Limits numbers to `factor` times their median and to one part in so many of it.
pub(super) fn limit_to_median(numbers: &mut [f64], factor: f64) {
    let mut sorted = numbers.to_vec();
    sorted.sort_by(f64::total_cmp);
    if let Some(&median) = sorted.get(sorted.len() / 2)
        && median.is_finite()
    {
        for number in numbers {
            *number = number.clamp(median / factor, median * factor);
        }
    }
}
