//! F, F_x and the rows of F_q at points, where the rows keep only what is not negligible.
//!
//! A point of a large field is moved by few of its parameters: of 300 blobs with 1,200 parameters it
//! feels those nearby. All of F_q is evaluated, in blocks of points, which costs about as much as some
//! evaluations of F for any number of parameters; what is nothing is dropped before it is stored.

use glam::DVec3;
use rayon::prelude::*;

use crate::engine::{CompiledField, Field};

/// So many points are evaluated at a time: a block of the engine. The columns of 1,200 parameters are
/// then 600 kilobytes and stay in the cache.
const CHUNK: usize = 64;

/// An entry smaller than this part of the largest one in its row is below half a unit in the last place
/// of whatever the row is summed to.
const NEGLIGIBLE: f64 = 1e-17;

/// Sparse rows, each a list of places and entries, places ascending.
#[derive(Clone, Debug, Default)]
pub(super) struct SparseRows {
    /// Where each row but the first begins.
    ends: Vec<usize>,
    places: Vec<u32>,
    entries: Vec<f64>,
}

impl SparseRows {
    /// Appends a row.
    pub(super) fn push(&mut self, row: impl Iterator<Item = (u32, f64)>) {
        for (place, entry) in row {
            self.places.push(place);
            self.entries.push(entry);
        }
        self.ends.push(self.places.len());
    }

    /// The number of rows.
    pub(super) fn count(&self) -> usize {
        self.ends.len()
    }

    /// The places and entries of a row.
    pub(super) fn row(&self, index: usize) -> (&[u32], &[f64]) {
        let begin = index.checked_sub(1).map_or(0, |before| self.ends[before]);
        let range = begin..self.ends[index];
        (&self.places[range.clone()], &self.entries[range])
    }

    /// The product of a row and a vector.
    pub(super) fn product(&self, index: usize, vector: &[f64]) -> f64 {
        let (places, entries) = self.row(index);
        // Four sums that do not wait for each other.
        let (groups, last) = places.as_chunks::<4>();
        let (factors, rest) = entries.as_chunks::<4>();
        let mut sums = [0.0; 4];
        for (places, factors) in groups.iter().zip(factors) {
            for lane in 0..4 {
                sums[lane] += factors[lane] * vector[places[lane] as usize];
            }
        }
        let mut sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
        for (&place, &factor) in last.iter().zip(rest) {
            sum += factor * vector[place as usize];
        }
        sum
    }

    /// Adds `factor` times a row to a vector.
    pub(super) fn add(&self, index: usize, factor: f64, vector: &mut [f64]) {
        let (places, entries) = self.row(index);
        for (&place, &entry) in places.iter().zip(entries) {
            vector[place as usize] += factor * entry;
        }
    }

    /// The rows of `other` below these.
    fn append(&mut self, other: &SparseRows) {
        let begin = self.places.len();
        self.ends.extend(other.ends.iter().map(|end| begin + end));
        self.places.extend_from_slice(&other.places);
        self.entries.extend_from_slice(&other.entries);
    }
}

/// F, F_x and F_q at points.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    /// F at each point; NaN where it is undefined.
    pub values: Vec<f64>,
    /// F_x at each point; components beyond the dimension are 0.
    pub gradients: Vec<DVec3>,
    pub(super) sparse: SparseRows,
}

impl Rows {
    /// Evaluates the field. Parallel, with the same result for any number of threads.
    pub fn evaluate(field: &CompiledField, points: &[DVec3]) -> Rows {
        let chunks = points.par_chunks(CHUNK);
        let parts: Vec<Rows> = chunks.map(|points| chunk(field, points)).collect();
        let mut rows = Rows::default();
        for part in parts {
            rows.values.extend(part.values);
            rows.gradients.extend(part.gradients);
            rows.sparse.append(&part.sparse);
        }
        rows
    }

    /// The number of points.
    pub fn count(&self) -> usize {
        self.values.len()
    }

    /// F_q at a point: the places in q, ascending, and the components there. The others are 0, or
    /// smaller than 1e-17 of the largest one, both as they are and multiplied by q.
    pub fn row(&self, index: usize) -> (&[u32], &[f64]) {
        self.sparse.row(index)
    }

    /// F_q · step at a point.
    pub(super) fn product(&self, index: usize, step: &[f64]) -> f64 {
        self.sparse.product(index, step)
    }

    /// Whether F, F_x and F_q are numbers at a point.
    pub(super) fn is_defined(&self, index: usize) -> bool {
        let (_, entries) = self.row(index);
        self.values[index].is_finite()
            && self.gradients[index].is_finite()
            && entries.iter().all(|entry| entry.is_finite())
    }
}

/// F and F_x at many points, in parallel and in order.
pub(super) fn values_and_gradients(
    field: &CompiledField,
    points: &[DVec3],
) -> (Vec<f64>, Vec<DVec3>) {
    let evaluate = |points: &[DVec3]| {
        let columns = Columns::new(points);
        let dimension = field.dimension();
        let mut outputs = vec![0.0; (1 + dimension) * points.len()];
        let mut outputs: Vec<&mut [f64]> = outputs.chunks_mut(points.len()).collect();
        let (values, gradients) = outputs.split_at_mut(1);
        field.gradients(&columns.slices(dimension), values[0], gradients);
        (values[0].to_vec(), vectors(gradients, points.len()))
    };
    let parts: Vec<(Vec<f64>, Vec<DVec3>)> = points.par_chunks(4 * CHUNK).map(evaluate).collect();
    let mut all = (Vec::new(), Vec::new());
    for (values, gradients) in parts {
        all.0.extend(values);
        all.1.extend(gradients);
    }
    all
}

/// The rows of a few points.
fn chunk(field: &CompiledField, points: &[DVec3]) -> Rows {
    let (dimension, count) = (field.dimension(), points.len());
    let columns = Columns::new(points);
    let q = field.parameters();
    let mut outputs = vec![0.0; (1 + dimension + q.len()) * count];
    let mut outputs: Vec<&mut [f64]> = outputs.chunks_mut(count).collect();
    let (values, rest) = outputs.split_at_mut(1);
    let (gradients, derivatives) = rest.split_at_mut(dimension);
    field.parameter_gradients(
        &columns.slices(dimension),
        values[0],
        gradients,
        derivatives,
    );
    // By columns, since that is how they lie in memory: the largest entries first.
    let mut largest = vec![[0.0_f64; 2]; count];
    for (column, &q) in derivatives.iter().zip(q) {
        for (largest, &entry) in largest.iter_mut().zip(column.iter()) {
            *largest = [
                largest[0].max(entry.abs()),
                largest[1].max((entry * q).abs()),
            ];
        }
    }
    let mut sparse = SparseRows::default();
    for (point, largest) in largest.iter().enumerate() {
        let entries = derivatives.iter().zip(q).enumerate();
        sparse.push(entries.filter_map(|(place, (column, &q))| {
            let entry = column[point];
            // The second test spares parameters that are huge numbers and have small derivatives
            // therefore. NaN is kept.
            let is_nothing = entry == 0.0
                || (entry.abs() <= NEGLIGIBLE * largest[0]
                    && (entry * q).abs() <= NEGLIGIBLE * largest[1]);
            (!is_nothing).then_some((place as u32, entry))
        }));
    }
    Rows {
        values: values[0].to_vec(),
        gradients: vectors(gradients, count),
        sparse,
    }
}

/// Points as columns.
struct Columns([Vec<f64>; 3]);

impl Columns {
    fn new(points: &[DVec3]) -> Columns {
        let column = |axis| points.iter().map(|point| point[axis]).collect();
        Columns(std::array::from_fn(column))
    }

    fn slices(&self, dimension: usize) -> Vec<&[f64]> {
        self.0[..dimension]
            .iter()
            .map(|column| &column[..])
            .collect()
    }
}

/// Columns as vectors; components beyond the columns are 0.
fn vectors(columns: &[&mut [f64]], count: usize) -> Vec<DVec3> {
    let vector = |place: usize| {
        let mut vector = DVec3::ZERO;
        for (axis, column) in columns.iter().enumerate() {
            vector[axis] = column[place];
        }
        vector
    };
    (0..count).map(vector).collect()
}

/// The length of a vector without underflow or overflow of its squares: gradients in the far field of a
/// Gaussian are easily as small as 1e-200 and still point the right way.
pub(super) fn length(vector: DVec3) -> f64 {
    let largest = vector.abs().max_element();
    match largest > 0.0 && largest.is_finite() {
        true => largest * (vector / largest).length(),
        false => largest,
    }
}
