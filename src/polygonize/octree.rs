//! Marching tetrahedra in an octree: cells are small where the level set is curved, and where it
//! is not they are left large.
//!
//! Boxes that are proven to be inside or outside are leaves of any size and never looked at again
//! ([`super::enclosure`]). Of the others those are divided, from the coarsest level down to cells
//! of the size that is asked for, in which the surface is not provably one sheet, or is not flat to
//! [`Options::error`](super::Options::error) (`build`). Leaves whose neighbours are smaller by more than one level are
//! divided, too (`balance`). The leaves that are left are the points between their centre and
//! the smallest sides that they share with a neighbour, divided around these sides' centres up to
//! the smallest edges: tetrahedra that fit together however the leaves do (`decompose`). Without
//! larger leaves that is the split of every cell into 24.
//!
//! F must be a [`CompiledField`](crate::engine::CompiledField) for that; for others nothing is proven, so that all
//! leaves are of the smallest size. Cost and memory grow with the surface.

pub(super) mod balance;
mod build;
pub(super) mod decompose;
mod flat;

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use self::decompose::Decomposition;
use super::grid::Seen;
use super::simplices::{self, Lattice, Place, Skin};
use super::{Found, Job, PolygonizeError, Shape, Statistics, cell_counts};

/// How many leaves or points make one piece of parallel work.
const CHUNK: usize = 1024;

/// A cube of the octree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Node {
    /// 0 for the largest.
    pub(super) level: u32,
    /// The place of its lowest corner in the lattice.
    pub(super) low: Place,
    /// The length of its sides in places, even.
    pub(super) size: u32,
}

impl Node {
    /// The place so many halves of its side away from the lowest corner along each axis.
    pub(super) fn at(&self, halves: [u32; 3]) -> Place {
        [0, 1, 2].map(|axis| self.low[axis] + halves[axis] * (self.size / 2))
    }

    /// The eight parts of half its size.
    pub(super) fn children(&self) -> impl Iterator<Item = Node> + use<> {
        let node = *self;
        (0..8).map(move |number: u32| Node {
            level: node.level + 1,
            low: node.at([number & 1, number >> 1 & 1, number >> 2 & 1]),
            size: node.size / 2,
        })
    }

    /// What it is a part of, below the coarsest level.
    pub(super) fn parent(&self) -> Node {
        let size = 2 * self.size;
        Node {
            level: self.level.saturating_sub(1),
            low: self.low.map(|place| place / size * size),
            size,
        }
    }

    /// Whether it touches a side of the box.
    fn touches_side(&self, lattice: &Lattice) -> bool {
        (0..3).any(|axis| self.low[axis] == 0 || self.low[axis] + self.size == lattice.top[axis])
    }
}

/// The cells of the coarsest level and how often they may be halved.
struct Levels {
    coarse: [usize; 3],
    /// The number of the finest level.
    finest: u32,
}

impl Levels {
    /// The coarsest level has at least eight cells along the longest side, and at least one along
    /// the others.
    fn new(counts: &[f64]) -> Self {
        let longest = counts.iter().copied().fold(1.0, f64::max);
        let shortest = counts.iter().copied().fold(f64::INFINITY, f64::min);
        let mut finest = 0;
        while finest < 20 && f64::from(2u32 << finest) <= shortest.min(longest / 8.0) {
            finest += 1;
        }
        let width = f64::from(1u32 << finest);
        let coarse = [0, 1, 2].map(|axis| {
            let count = counts.get(axis).copied().unwrap_or(1.0);
            (count / width).ceil() as usize
        });
        Levels { coarse, finest }
    }
}

/// The mesh of the level set by marching tetrahedra in an octree: oriented and manifold whatever
/// the field is, watertight unless the box cuts it and there is no cap.
pub(super) fn march(job: &Job) -> Result<Found, PolygonizeError> {
    let counts = cell_counts(job.options);
    let levels = Levels::new(&counts);
    let cells = levels
        .coarse
        .map(|count| count.saturating_mul(1 << levels.finest));
    let too_many = PolygonizeError::TooManyCells {
        needed: counts.iter().product(),
        limit: job.options.cell_limit,
    };
    let lattice = Lattice::new(&job.options.bounds, cells).ok_or(too_many)?;
    let mut tree = build::build(job, &lattice, &levels)?;
    balance::balance(job, &lattice, &mut tree)?;
    tree.boundary
        .sort_unstable_by_key(|node| (node.low, node.level));
    for node in &tree.boundary {
        tree.leaves.boundary[node.level as usize] += 1;
    }
    let decomposition = Decomposition::new(&lattice, &tree.boundary);
    let points = decomposition.points(&tree.boundary);
    let (values, seen) = evaluate(job, &lattice, &points)?;
    let statistics = Statistics {
        cells: tree.boundary.len(),
        evaluations: tree.evaluations + points.len(),
        nan_points: seen.nan,
        leaves: tree.leaves,
        ..Statistics::default()
    };
    drop(points);
    let piece = surface(&decomposition, &tree.boundary, &values, job.options.cap)?;
    drop(values);
    let (mesh, more) = simplices::finish(job, &lattice, &piece)?;
    Ok((Shape::Mesh(mesh), seen, statistics.and(more)))
}

/// F − iso at points, by their numbers.
pub(super) type Values = FxHashMap<u64, f64>;

/// F − iso at points that are given by their numbers, and how often it was seen to be what.
fn evaluate(
    job: &Job,
    lattice: &Lattice,
    points: &[u64],
) -> Result<(Values, Seen), PolygonizeError> {
    let parts: Vec<Vec<f64>> = points
        .par_chunks(CHUNK)
        .map(|points| {
            if job.monitor.cancelled() {
                return Vec::new();
            }
            values_at(job, points.iter().map(|&key| lattice.place(key)), lattice)
        })
        .collect();
    if job.monitor.cancelled() {
        return Err(PolygonizeError::Cancelled);
    }
    let mut values = Values::default();
    values.reserve(points.len());
    let mut seen = Seen::default();
    for (points, part) in points.chunks(CHUNK).zip(parts) {
        seen = seen.and(Seen::of_values(&part));
        values.extend(points.iter().copied().zip(part));
    }
    Ok((values, seen))
}

/// F − iso at places.
pub(super) fn values_at(
    job: &Job,
    places: impl Iterator<Item = Place>,
    lattice: &Lattice,
) -> Vec<f64> {
    let mut columns = [const { Vec::new() }; 3];
    for place in places {
        for (axis, column) in columns.iter_mut().enumerate() {
            column.push(lattice.coordinate(axis, place[axis]));
        }
    }
    let mut values = vec![0.0; columns[0].len()];
    let columns = columns.each_ref().map(Vec::as_slice);
    job.field.values(&columns, &mut values);
    values
        .iter_mut()
        .for_each(|value| *value -= job.accuracy.iso);
    values
}

/// The surface in the leaves.
pub(super) fn surface(
    decomposition: &Decomposition,
    leaves: &[Node],
    values: &Values,
    cap: bool,
) -> Result<simplices::Piece, PolygonizeError> {
    let lattice = decomposition.lattice;
    let value = |place: Place| {
        let known = values.get(&lattice.key(place));
        known.copied().unwrap_or(f64::NAN)
    };
    let pieces = leaves.par_chunks(CHUNK).map(|leaves| {
        let mut skin = Skin::new(lattice, cap);
        for leaf in leaves {
            decomposition.for_each_tetrahedron(leaf, |corners| {
                let flag = |number: usize| u8::from(value(corners[number]) < 0.0) << number;
                skin.add(&corners, (0..4).map(flag).sum(), &value);
            });
        }
        skin.into_piece()
    });
    simplices::join(pieces.collect(), |_| true)
}

#[cfg(test)]
mod tests;
