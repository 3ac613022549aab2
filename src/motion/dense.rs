//! Dense symmetric systems: Cholesky's factorisation in blocks and in parallel, its condition, its
//! rank.
//!
//! Every entry is computed by the same operations in the same order for any number of threads.

use nalgebra::{DMatrix, SymmetricEigen};
use rayon::prelude::*;

/// Columns that are eliminated together: a panel of 1,200 rows then takes half a megabyte.
const BLOCK: usize = 48;

/// Rows that one task updates.
const ROWS: usize = 8;

/// A symmetric matrix, row by row, of which the lower triangle counts.
#[derive(Clone, Debug)]
pub(super) struct Symmetric {
    size: usize,
    entries: Vec<f64>,
}

impl Symmetric {
    /// The zero matrix.
    pub(super) fn zero(size: usize) -> Symmetric {
        Symmetric {
            size,
            entries: vec![0.0; size * size],
        }
    }

    /// The number of rows.
    pub(super) fn size(&self) -> usize {
        self.size
    }

    /// An entry of the lower triangle: `column <= row`.
    pub(super) fn at(&self, row: usize, column: usize) -> f64 {
        self.entries[row * self.size + column]
    }

    /// A row; its entries up to the diagonal count.
    pub(super) fn row_mut(&mut self, row: usize) -> &mut [f64] {
        &mut self.entries[row * self.size..][..self.size]
    }

    /// All entries, row by row.
    pub(super) fn entries_mut(&mut self) -> &mut [f64] {
        &mut self.entries
    }

    /// The product with a vector.
    pub(super) fn product(&self, vector: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; self.size];
        for row in 0..self.size {
            let entries = &self.entries[row * self.size..][..=row];
            product[row] += dot(entries, &vector[..=row]);
            for (column, entry) in entries[..row].iter().enumerate() {
                product[column] += entry * vector[row];
            }
        }
        product
    }

    /// The largest sum of the absolute entries of a row: the norm that goes with the largest component,
    /// and for symmetric matrices also the one that goes with their sum.
    fn norm(&self) -> f64 {
        let mut sums = vec![0.0; self.size];
        for row in 0..self.size {
            for column in 0..=row {
                let entry = self.at(row, column).abs();
                sums[row] += entry;
                if column < row {
                    sums[column] += entry;
                }
            }
        }
        sums.into_iter().fold(0.0, f64::max)
    }

    /// Eigenvalues with their eigenvectors, in no special order; none if the iteration does not
    /// converge, as with entries that are not finite.
    pub(super) fn eigen(&self) -> Option<Vec<(f64, Vec<f64>)>> {
        if self.entries.iter().any(|entry| !entry.is_finite()) {
            return None;
        }
        let matrix = DMatrix::from_fn(self.size, self.size, |row, column| {
            self.at(row.max(column), row.min(column))
        });
        let rounds = 100 * self.size.max(10);
        let eigen = SymmetricEigen::try_new(matrix, f64::EPSILON, rounds)?;
        let vectors = eigen.eigenvectors.column_iter();
        let pairs = eigen.eigenvalues.iter().zip(vectors);
        Some(
            pairs
                .map(|(&value, vector)| (value, vector.iter().copied().collect()))
                .collect(),
        )
    }
}

/// A matrix as L Lᵀ.
#[derive(Clone, Debug)]
pub(super) struct Cholesky {
    lower: Symmetric,
    /// The norm of the matrix.
    norm: f64,
}

impl Cholesky {
    /// Factors the matrix: n³/3 operations on all threads. None where it is not positive definite to
    /// rounding.
    pub(super) fn new(mut matrix: Symmetric) -> Option<Cholesky> {
        let size = matrix.size;
        let norm = matrix.norm();
        let mut begin = 0;
        while begin < size {
            let end = (begin + BLOCK).min(size);
            factor_block(&mut matrix, begin, end)?;
            let (above, below) = matrix.entries.split_at_mut(end * size);
            eliminate(&above[begin * size..], below, [begin, end], size);
            begin = end;
        }
        Some(Cholesky {
            lower: matrix,
            norm,
        })
    }

    /// L⁻¹ b, in place.
    pub(super) fn solve_lower(&self, vector: &mut [f64]) {
        for row in 0..self.lower.size {
            let entries = &self.lower.entries[row * self.lower.size..][..=row];
            let sum = dot(&entries[..row], &vector[..row]);
            vector[row] = (vector[row] - sum) / entries[row];
        }
    }

    /// L⁻ᵀ b, in place.
    pub(super) fn solve_upper(&self, vector: &mut [f64]) {
        for row in (0..self.lower.size).rev() {
            let entries = &self.lower.entries[row * self.lower.size..][..=row];
            let solved = vector[row] / entries[row];
            vector[row] = solved;
            for (value, entry) in vector[..row].iter_mut().zip(entries) {
                *value -= entry * solved;
            }
        }
    }

    /// The solution for a right-hand side.
    pub(super) fn solve(&self, side: &[f64]) -> Vec<f64> {
        let mut solution = side.to_vec();
        self.solve_lower(&mut solution);
        self.solve_upper(&mut solution);
        solution
    }

    /// An estimate of the condition number in the 1-norm, hardly ever too small by more than a factor
    /// of 3: Higham, "Accuracy and Stability of Numerical Algorithms", algorithm 15.1. Some solutions.
    pub(super) fn condition(&self) -> f64 {
        let size = self.lower.size;
        let mut vector = vec![1.0 / size as f64; size];
        let mut estimate = 0.0_f64;
        for _ in 0..5 {
            let solution = self.solve(&vector);
            let norm: f64 = solution.iter().map(|value| value.abs()).sum();
            if norm.is_nan() {
                return f64::INFINITY;
            }
            estimate = estimate.max(norm);
            let signs: Vec<f64> = solution.iter().map(|value| value.signum()).collect();
            let slope = self.solve(&signs);
            let bound = dot(&slope, &vector);
            let largest = |best: usize, next: usize| match slope[next].abs() > slope[best].abs() {
                true => next,
                false => best,
            };
            let place = (0..size).fold(0, largest);
            if size == 0 || slope[place].abs() <= bound {
                break;
            }
            vector.fill(0.0);
            vector[place] = 1.0;
        }
        estimate * self.norm
    }
}

/// Factors a block on the diagonal, whose rows are complete up to it.
fn factor_block(matrix: &mut Symmetric, begin: usize, end: usize) -> Option<()> {
    let size = matrix.size;
    for row in begin..end {
        let (above, rest) = matrix.entries.split_at_mut(row * size);
        let here = &mut rest[..size];
        let original = here[row];
        for column in begin..row {
            let other = &above[column * size..][..size];
            let sum = dot(&here[begin..column], &other[begin..column]);
            here[column] = (here[column] - sum) / other[column];
        }
        let pivot = original - dot(&here[begin..row], &here[begin..row]);
        // What is left of the diagonal must be more than the rounding of what was taken away.
        let is_positive = pivot > f64::EPSILON * original.abs() && pivot.is_finite();
        if !is_positive {
            return None;
        }
        here[row] = pivot.sqrt();
    }
    Some(())
}

/// Computes the columns `begin..end` of L below a factored block, and takes their product off the rest.
/// `block` begins with the block's first row, `below` with the first row under it.
fn eliminate(block: &[f64], below: &mut [f64], [begin, end]: [usize; 2], size: usize) {
    below.par_chunks_mut(ROWS * size).for_each(|rows| {
        for row in rows.chunks_mut(size) {
            for column in begin..end {
                let other = &block[(column - begin) * size..][..size];
                let sum = dot(&row[begin..column], &other[begin..column]);
                row[column] = (row[column] - sum) / other[column];
            }
        }
    });
    let width = end - begin;
    let panel: Vec<f64> = below
        .chunks(size)
        .flat_map(|row| &row[begin..end])
        .copied()
        .collect();
    let chunks = below.par_chunks_mut(ROWS * size).enumerate();
    chunks.for_each(|(chunk, rows)| {
        for (offset, row) in rows.chunks_mut(size).enumerate() {
            let index = ROWS * chunk + offset;
            let own = &panel[index * width..][..width];
            subtract_products(&mut row[end..=end + index], own, &panel, width);
        }
    });
}

/// Takes the product of `own` with each row of the panel off the entries.
fn subtract_products(entries: &mut [f64], own: &[f64], panel: &[f64], width: usize) {
    let (groups, rest) = entries.as_chunks_mut::<4>();
    for (group, others) in groups.iter_mut().zip(panel.chunks(4 * width)) {
        // Four products at a time read `own` once.
        let (first, second) = others.split_at(2 * width);
        let (first, second) = (first.split_at(width), second.split_at(width));
        let mut sums = [[0.0; 4]; 4];
        let (lanes, _) = own.as_chunks::<4>();
        let columns = [first.0, first.1, second.0, second.1];
        let [a, b, c, d] = columns.map(|column| column.as_chunks::<4>().0);
        for ((((own, a), b), c), d) in lanes.iter().zip(a).zip(b).zip(c).zip(d) {
            for lane in 0..4 {
                sums[0][lane] += own[lane] * a[lane];
                sums[1][lane] += own[lane] * b[lane];
                sums[2][lane] += own[lane] * c[lane];
                sums[3][lane] += own[lane] * d[lane];
            }
        }
        for ((entry, sums), column) in group.iter_mut().zip(sums).zip(columns) {
            let mut sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
            for lane in 4 * lanes.len()..width {
                sum += own[lane] * column[lane];
            }
            *entry -= sum;
        }
    }
    let done = 4 * groups.len();
    for (entry, other) in rest.iter_mut().zip(panel.chunks(width).skip(done)) {
        *entry -= dot(own, other);
    }
}

/// The product of two vectors.
pub(super) fn dot(one: &[f64], other: &[f64]) -> f64 {
    let (ones, last) = one.as_chunks::<4>();
    let (others, rest) = other.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for (one, other) in ones.iter().zip(others) {
        for lane in 0..4 {
            sums[lane] += one[lane] * other[lane];
        }
    }
    let mut sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
    for (one, other) in last.iter().zip(rest) {
        sum += one * other;
    }
    sum
}

/// Which unknowns a positive semidefinite matrix with a diagonal of ones does not determine, and its
/// rank: Cholesky's factorisation with the largest pivot first (Higham, "Accuracy and Stability of
/// Numerical Algorithms", section 10.3), until what is left is at most `threshold`. Vectors that the
/// matrix takes to 0 then have their last components as they like and the others as follows; an unknown
/// is undetermined if it is in one of them.
pub(super) fn undetermined(matrix: &Symmetric, threshold: f64) -> (usize, Vec<usize>) {
    let size = matrix.size;
    // Rows of L, which grow by one entry a round, in the matrix's own order.
    let mut lower = vec![Vec::<f64>::new(); size];
    let mut left: Vec<f64> = (0..size).map(|place| matrix.at(place, place)).collect();
    let mut order = Vec::new();
    let mut rest: Vec<usize> = (0..size).collect();
    while let Some(&pivot) = rest
        .iter()
        .reduce(|a, b| if left[*b] > left[*a] { b } else { a })
    {
        // Also ends where there is a NaN.
        if left[pivot].partial_cmp(&threshold) != Some(std::cmp::Ordering::Greater) {
            break;
        }
        rest.retain(|&other| other != pivot);
        let root = left[pivot].sqrt();
        let own = std::mem::take(&mut lower[pivot]);
        let column: Vec<f64> = rest
            .par_iter()
            .with_min_len(64)
            .map(|&other| {
                let entry = matrix.at(other.max(pivot), other.min(pivot));
                (entry - dot(&lower[other], &own)) / root
            })
            .collect();
        for (&other, entry) in rest.iter().zip(column) {
            lower[other].push(entry);
            left[other] -= entry * entry;
        }
        lower[pivot] = own;
        lower[pivot].push(root);
        order.push(pivot);
    }
    let rank = order.len();
    let mut is_free = vec![false; size];
    for &place in &rest {
        is_free[place] = true;
        // The components of the pivots: L₁₁ᵀ c = −L₂₁ᵀ.
        let mut side = lower[place].clone();
        for round in (0..rank).rev() {
            let row = &lower[order[round]];
            side[round] /= row[round];
            let solved = side[round];
            for (value, entry) in side[..round].iter_mut().zip(row) {
                *value -= entry * solved;
            }
        }
        for (&pivot, component) in order.iter().zip(side) {
            is_free[pivot] |= component.abs() > threshold.sqrt();
        }
    }
    (rank, (0..size).filter(|&place| is_free[place]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A Gram matrix of `rank` pseudo-random vectors with `size` components, transposed: positive
    /// semidefinite.
    fn gram(size: usize, rank: usize) -> Symmetric {
        let mut state = 1_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        let rows: Vec<Vec<f64>> = (0..size)
            .map(|_| (0..rank).map(|_| random()).collect())
            .collect();
        let mut matrix = Symmetric::zero(size);
        for row in 0..size {
            for column in 0..=row {
                matrix.row_mut(row)[column] = dot(&rows[row], &rows[column]);
            }
        }
        matrix
    }

    #[test]
    fn factors_give_the_matrix_back_beyond_a_block() {
        for size in [1, 2, 47, 48, 49, 150] {
            let matrix = gram(size, size + 5);
            let factor = Cholesky::new(matrix.clone()).unwrap();
            let truth: Vec<f64> = (0..size).map(|place| 1.0 + place as f64).collect();
            let solution = factor.solve(&matrix.product(&truth));
            let tolerance = 1e-15 * factor.condition() * size as f64 * 10.0;
            for (found, truth) in solution.iter().zip(truth) {
                assert!((found - truth).abs() < tolerance, "{size}: {found} {truth}");
            }
        }
    }

    #[test]
    fn the_condition_is_that_of_the_eigenvalues() {
        let matrix = gram(60, 70);
        let values: Vec<f64> = matrix.eigen().unwrap().iter().map(|pair| pair.0).collect();
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(0.0, f64::max);
        let found = Cholesky::new(matrix).unwrap().condition();
        // The 1-norm of a symmetric matrix is between its largest eigenvalue and √n times that.
        assert!(found >= most / least / 3.0, "{found} {}", most / least);
        assert!(found <= 60.0 * most / least, "{found} {}", most / least);
        assert!(Cholesky::new(gram(20, 19)).is_none_or(|factor| factor.condition() > 1e13));
    }

    #[test]
    fn undetermined_unknowns_are_those_of_the_null_space() {
        // Columns a, b, a + b, c of ones and zeros, scaled to length 1.
        let columns = [
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
        ];
        let mut matrix = Symmetric::zero(4);
        for row in 0..4 {
            for column in 0..=row {
                let lengths =
                    dot(&columns[row], &columns[row]) * dot(&columns[column], &columns[column]);
                matrix.row_mut(row)[column] = dot(&columns[row], &columns[column]) / lengths.sqrt();
            }
        }
        assert_eq!(undetermined(&matrix, 1e-11), (3, vec![0, 1, 2]));
        let mut whole = gram(4, 9);
        whole.row_mut(0)[0] += 1.0;
        assert_eq!(undetermined(&whole, 1e-11), (4, vec![]));
    }
}
