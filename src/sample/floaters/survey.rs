//! Parts of a surface that no floater is on.
//!
//! Floaters follow the surface they are on, but a new component has none, and where a surface was torn open
//! fission takes long to fill the gap. A coarse grid of values shows most of these places: where F changes its
//! sign between neighbours and no floater is near, there is a place for one. What is smaller than the grid's
//! cells is missed; the proof that nothing is would take as long as sampling anew.

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashSet;

use crate::engine::{CompiledField, Field};
use crate::geometry::Bounds;

/// Cells along the longest side: as many evaluations as 10,000 floaters take.
const CELLS: (usize, usize) = (96, 24);

/// Rows of the grid that share a task.
const ROWS: usize = 16;

/// Halvings that bring a root to a part of 10⁻⁶ of a cell.
const HALVINGS: u32 = 20;

/// What a survey saw.
pub(super) struct Survey {
    /// Places on the surface that are farther than asked for from everybody, and from each other.
    pub(super) places: Vec<DVec3>,
    /// Evaluations of F.
    pub(super) evaluations: u64,
}

/// Searches a box for parts of the zero set that are farther than `near` from all of the points, and puts
/// places there, `apart` from each other.
pub(super) fn survey(
    field: &CompiledField,
    bounds: &Bounds,
    points: impl Iterator<Item = DVec3>,
    [near, apart]: [f64; 2],
) -> Survey {
    let dimension = bounds.dimension;
    let size = bounds.size();
    let along = if dimension == 2 { CELLS.0 } else { CELLS.1 };
    let cell = size.max_element() / along as f64;
    let counts = [0, 1, 2].map(|axis| match axis < dimension {
        true => (size[axis] / cell).ceil().max(1.0) as usize + 1,
        false => 1,
    });
    let place = |index: usize| {
        let [across, down] = [counts[0], counts[0] * counts[1]];
        let steps = [index % across, (index % down) / across, index / down];
        let part = |axis: usize| match counts[axis] > 1 {
            true => steps[axis] as f64 / (counts[axis] - 1) as f64,
            false => 0.0,
        };
        bounds.min + DVec3::new(part(0), part(1), part(2)) * size
    };
    let number = counts.iter().product::<usize>();
    let values: Vec<f64> = (0..number.div_ceil(ROWS * counts[0]))
        .into_par_iter()
        .flat_map_iter(|task| {
            let first = task * ROWS * counts[0];
            let range = first..(first + ROWS * counts[0]).min(number);
            let columns = [0, 1, 2].map(|axis| {
                let column = range.clone().map(|index| place(index)[axis]);
                column.collect::<Vec<f64>>()
            });
            let mut values = vec![0.0; range.len()];
            let columns = columns.each_ref().map(Vec::as_slice);
            field.values(&columns[..dimension], &mut values);
            values
        })
        .collect();
    let mut taken = Buckets::new(bounds.min, near.max(cell * (dimension as f64).sqrt()));
    points.for_each(|point| taken.put(point));
    let mut chosen = Buckets::new(bounds.min, apart);
    let strides = [1, counts[0], counts[0] * counts[1]];
    let mut evaluations = number as u64;
    let mut places = Vec::new();
    for index in 0..number {
        for axis in 0..dimension {
            let is_last = index / strides[axis] % counts[axis] + 1 == counts[axis];
            if is_last {
                continue;
            }
            let ends = [index, index + strides[axis]];
            let changes = (values[ends[0]] < 0.0) != (values[ends[1]] < 0.0);
            let is_defined = ends.iter().all(|&end| values[end].is_finite());
            let [from, to] = ends.map(place);
            if changes && is_defined && !taken.has_near(from.midpoint(to)) {
                evaluations += u64::from(HALVINGS);
                let root = root(field, from, to);
                if !chosen.has_near(root) {
                    chosen.put(root);
                    places.push(root);
                }
            }
        }
    }
    Survey {
        places,
        evaluations,
    }
}

/// Cubes with points in them.
struct Buckets {
    origin: DVec3,
    side: f64,
    taken: FxHashSet<[i64; 3]>,
}

impl Buckets {
    fn new(origin: DVec3, side: f64) -> Self {
        Buckets {
            origin,
            side,
            taken: FxHashSet::default(),
        }
    }

    fn bucket(&self, point: DVec3) -> [i64; 3] {
        let steps = ((point - self.origin) / self.side).floor();
        [steps.x as i64, steps.y as i64, steps.z as i64]
    }

    fn put(&mut self, point: DVec3) {
        self.taken.insert(self.bucket(point));
    }

    /// Whether a point is in the bucket of this one or beside it: one that is nearer than a side is, and
    /// one that is farther than two diagonals is not.
    fn has_near(&self, point: DVec3) -> bool {
        let [x, y, z] = self.bucket(point);
        let mut around = (0..27).map(|k| [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1]);
        around.any(|bucket| self.taken.contains(&bucket))
    }
}

/// Where F changes its sign between two places at which it has different ones.
fn root(field: &CompiledField, mut from: DVec3, mut to: DVec3) -> DVec3 {
    let is_inside = field.value(from) < 0.0;
    for _ in 0..HALVINGS {
        let middle = from.midpoint(to);
        if (field.value(middle) < 0.0) == is_inside {
            from = middle;
        } else {
            to = middle;
        }
    }
    from.midpoint(to)
}
