//! Nearest neighbours among points that do not move: how dense a point cloud is.
//!
//! A balanced k-d tree rather than a grid of cells, because samples may cluster: two small
//! components far apart put all their points into a few cells of any uniform grid, and the
//! search would become quadratic.

use glam::DVec3;
use rayon::prelude::*;

use super::Samples;
use super::summation::sum;

/// How far the points of a cloud are from their nearest neighbours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spacing {
    /// The least distance to a nearest neighbour.
    pub min: f64,
    /// The mean distance.
    pub mean: f64,
    /// The standard deviation from the mean.
    pub deviation: f64,
    /// The greatest distance.
    pub max: f64,
}

impl Samples {
    /// Statistics of the distances from each point to the nearest other; `None` for fewer than
    /// two points. Costs O(n log n).
    pub fn spacing(&self) -> Option<Spacing> {
        if self.positions.len() < 2 {
            return None;
        }
        let distances = nearest_distances(&self.positions);
        let number = distances.len() as f64;
        let mean = sum(distances.iter().copied()) / number;
        let offsets = distances.iter().map(|distance| distance - mean);
        let squares = offsets.map(|offset| offset * offset);
        Some(Spacing {
            min: distances.iter().copied().fold(f64::INFINITY, f64::min),
            mean,
            deviation: (sum(squares) / number).sqrt(),
            max: distances.iter().copied().fold(0.0, f64::max),
        })
    }
}

/// The distance from each point to the nearest other point, in the order of the points: 0 where
/// two coincide, infinite where there is no other or the point itself is not finite.
///
/// O(n log n), however the points are distributed; parallel, with the same result for any number
/// of threads. There are fewer than 2³² points.
pub fn nearest_distances(points: &[DVec3]) -> Vec<f64> {
    let tree = Tree::new(points);
    // The queries run in the order of the tree, where neighbours lie close in memory.
    let squares: Vec<f64> = (0..points.len())
        .into_par_iter()
        .map(|from| tree.nearest_square(from))
        .collect();
    let mut distances = vec![f64::INFINITY; points.len()];
    for (entry, square) in tree.entries.iter().zip(squares) {
        distances[entry.index as usize] = square.sqrt();
    }
    distances
}

/// A point and its place in the caller's list.
#[derive(Clone, Copy)]
struct Entry {
    position: DVec3,
    index: u32,
}

/// A balanced k-d tree without pointers: the node of a range of entries is its middle entry;
/// the entries before it are not greater along the axis of the node, those after it not less.
struct Tree {
    entries: Vec<Entry>,
    /// The splitting axis of the range whose middle is here.
    axes: Vec<u8>,
}

/// Ranges up to this length are searched through.
const LEAF: usize = 8;

/// Ranges from this length on are built in parallel.
const PARALLEL: usize = 1 << 14;

impl Tree {
    fn new(points: &[DVec3]) -> Self {
        let mut tree = Tree {
            entries: points
                .iter()
                .zip(0..)
                .map(|(&position, index)| Entry { position, index })
                .collect(),
            axes: vec![0; points.len()],
        };
        build(&mut tree.entries, &mut tree.axes);
        tree
    }

    /// The squared distance from an entry, given by its place in the tree, to the nearest other.
    fn nearest_square(&self, from: usize) -> f64 {
        let mut best = f64::INFINITY;
        self.search(0, self.entries.len(), from, &mut best);
        best
    }

    /// Lowers `best` to the least squared distance from an entry to the others in a range.
    /// The depth of the recursion is the binary logarithm of the number of points.
    fn search(&self, start: usize, end: usize, from: usize, best: &mut f64) {
        let position = self.entries[from].position;
        let mut visit = |other: usize| {
            if other != from {
                *best = best.min(position.distance_squared(self.entries[other].position));
            }
        };
        if end - start <= LEAF {
            (start..end).for_each(visit);
            return;
        }
        let middle = start + (end - start) / 2;
        visit(middle);
        let axis = usize::from(self.axes[middle]);
        let offset = position[axis] - self.entries[middle].position[axis];
        let (near, far) = if offset < 0.0 {
            ((start, middle), (middle + 1, end))
        } else {
            ((middle + 1, end), (start, middle))
        };
        self.search(near.0, near.1, from, best);
        if offset * offset < *best {
            self.search(far.0, far.1, from, best);
        }
    }
}

/// Orders a range of entries into a tree: splits it in the middle along its longest side.
fn build(entries: &mut [Entry], axes: &mut [u8]) {
    if entries.len() <= LEAF {
        return;
    }
    let middle = entries.len() / 2;
    let axis = widest_axis(entries);
    axes[middle] = axis as u8;
    // The index decides between equal coordinates, so that the order is unique.
    entries.select_nth_unstable_by(middle, |a, b| {
        let along_axis = a.position[axis].total_cmp(&b.position[axis]);
        along_axis.then(a.index.cmp(&b.index))
    });
    let parallel = entries.len() >= PARALLEL;
    let (low_entries, high_entries) = around(entries, middle);
    let (low_axes, high_axes) = around(axes, middle);
    if parallel {
        rayon::join(
            || build(low_entries, low_axes),
            || build(high_entries, high_axes),
        );
    } else {
        build(low_entries, low_axes);
        build(high_entries, high_axes);
    }
}

/// What lies before and after the middle.
fn around<T>(entries: &mut [T], middle: usize) -> (&mut [T], &mut [T]) {
    let (low, high) = entries.split_at_mut(middle);
    (low, &mut high[1..])
}

/// The axis along which the entries spread most.
fn widest_axis(entries: &[Entry]) -> usize {
    let mut min = DVec3::INFINITY;
    let mut max = DVec3::NEG_INFINITY;
    for entry in entries {
        min = min.min(entry.position);
        max = max.max(entry.position);
    }
    let size = (max - min).to_array();
    (1..3).fold(0, |widest, axis| {
        if size[axis] > size[widest] {
            axis
        } else {
            widest
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reproducible numbers in [0, 1): Marsaglia's xorshift64.
    fn random(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    fn brute_force(points: &[DVec3]) -> Vec<f64> {
        let nearest = |index: usize| {
            let others = (0..points.len()).filter(|&other| other != index);
            others
                .map(|other| points[index].distance_squared(points[other]))
                .fold(f64::INFINITY, f64::min)
                .sqrt()
        };
        (0..points.len()).map(nearest).collect()
    }

    #[test]
    fn distances_agree_with_brute_force_to_the_last_bit() {
        let mut random = random(1);
        for count in [0, 1, 2, 8, 9, 10, 100, 1500] {
            for flat in 0..3 {
                let mut points = Vec::new();
                for _ in 0..count {
                    let mut point = DVec3::new(random(), random(), random());
                    // Space, plane and line; two clusters; a tenth of the points twice.
                    for axis in 3 - flat..3 {
                        point[axis] = 0.0;
                    }
                    if random() < 0.5 {
                        point = 1e-3 * point + DVec3::X * 50.0;
                    }
                    points.push(point);
                    if random() < 0.1 {
                        points.push(point);
                    }
                }
                assert_eq!(nearest_distances(&points), brute_force(&points));
            }
        }
    }

    #[test]
    fn points_on_a_lattice_have_its_spacing() {
        let lattice = |n: u32| {
            let axis = move || (0..n).map(f64::from);
            axis().flat_map(move |x| axis().map(move |y| DVec3::new(0.5 * x, 0.5 * y, 0.0)))
        };
        let mut samples = Samples {
            dimension: 2,
            positions: lattice(40).collect(),
            ..Samples::default()
        };
        let even = Spacing {
            min: 0.5,
            mean: 0.5,
            deviation: 0.0,
            max: 0.5,
        };
        assert_eq!(samples.spacing(), Some(even));
        samples.positions.push(DVec3::new(-2.0, 0.0, 0.0));
        let spacing = samples.spacing().unwrap();
        assert_eq!((spacing.min, spacing.max), (0.5, 2.0));
        assert_eq!(spacing.mean, (1600.0 * 0.5 + 2.0) / 1601.0);
        // One of n + 1 values is off by d: the variance is d² n / (n + 1)².
        let deviation = 1.5 * 1600_f64.sqrt() / 1601.0;
        assert!((spacing.deviation - deviation).abs() < 1e-15);
    }

    #[test]
    fn a_cloud_of_coincident_points_has_distance_zero_and_takes_no_quadratic_time() {
        let points = vec![DVec3::ONE; 200_000];
        assert!(nearest_distances(&points).iter().all(|&d| d == 0.0));
    }

    #[test]
    fn single_and_infinite_points_have_no_neighbour() {
        assert_eq!(nearest_distances(&[DVec3::ONE]), [f64::INFINITY]);
        let single = Samples {
            positions: vec![DVec3::ONE],
            ..Samples::default()
        };
        assert_eq!(single.spacing(), None);
        let mut points = vec![DVec3::ZERO; 20];
        points[7] = DVec3::NAN;
        points[8] = DVec3::INFINITY;
        let distances = nearest_distances(&points);
        assert_eq!(distances[0], 0.0);
        assert_eq!((distances[7], distances[8]), (f64::INFINITY, f64::INFINITY));
    }

    #[test]
    fn the_number_of_threads_does_not_matter() {
        let mut random = random(2);
        let points: Vec<DVec3> = (0..40_000)
            .map(|_| DVec3::new(random(), random(), random()))
            .collect();
        let with_threads = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.unwrap().install(|| nearest_distances(&points))
        };
        assert_eq!(with_threads(1), with_threads(3));
    }
}
