//! Poisson-disk samples: random points of which no two are close, exactly as many as are wanted.
//!
//! A dense sample by rays is thinned out by weighted sample elimination (C. Yuksel, "Sample
//! elimination for generating Poisson disk sample sets", Computer Graphics Forum 34, Eurographics
//! 2015): again and again the point that has the most and the closest neighbours is taken away,
//! until the wanted number is left.
//!
//! What is left is then improved by exchange: the point that is closest to another one is taken
//! away, and the point of the dense sample that is farthest from all others, in the largest gap,
//! comes in, as long as the gap is wider than the distance that is lost (the exchange of clusters and
//! voids is R. Ulichney's, "The void-and-cluster method for dither array generation", 1993; the
//! goal that of T. Schlömer, D. Heck and O. Deussen, "Farthest-point optimized point sets with
//! maximized minimum distance", 2011). In the end no gap in the dense sample is wider than the least
//! distance between two points: the sample is a maximal Poisson-disk set of the dense one.
//!
//! Distances are straight, but two points whose normals differ by more than 120 degrees are no
//! neighbours: they lie on two sheets, or on both sides of a thin part.

mod cells;
mod elimination;
mod exchange;

use glam::DVec3;

use super::floaters::balance::spacing_for;
use super::newton::Point;
use super::rays::Harvest;
use super::{Options, Outcome, SampleError, samples};
use crate::engine::{Field, Monitor};
use crate::geometry::Bounds;
use cells::Cells;
use elimination::eliminate;
use exchange::exchange;

/// Points of the dense sample for each one that is wanted.
const DENSITY: u64 = 10;

/// The least cosine between the normals of neighbours.
const SAME_SHEET: f64 = -0.5;

/// Samples the zero set of a field in R2 or R3 by elimination.
pub(super) fn poisson(
    field: &dyn Field,
    bounds: Bounds,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Outcome, SampleError> {
    let dimension = bounds.dimension;
    let mut harvest = Harvest::new(field, bounds, options, monitor)?;
    harvest.draw_first()?;
    let count = harvest.number(options)?;
    harvest.draw(DENSITY * count)?;
    let dense: Vec<Point> = harvest.crossings.iter().map(|c| c.point).collect();
    let ask = |fraction| {
        monitor.progress("eliminate", fraction);
        !monitor.cancelled()
    };
    let area = harvest.area().map_or(0.0, |area| area.value);
    let spacing = spacing_for(dimension, area, count as f64);
    let kept = if (dense.len() as u64) <= count {
        dense
    } else {
        let cloud = Cloud::new(&dense, spacing);
        let kept = eliminate(&cloud, count as usize, &ask)
            .and_then(|kept| exchange(&cloud, kept, &ask))
            .ok_or(SampleError::Cancelled)?;
        kept.into_iter().map(|index| dense[index as usize]).collect()
    };
    let complete = kept.len() as u64 == count;
    let statistics = harvest.statistics(&kept, complete);
    Ok(Outcome {
        samples: samples(dimension, &kept),
        statistics,
    })
}

/// The dense sample.
struct Cloud {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    /// The distance between neighbours in the ideal pattern of the points that are to be left,
    /// beyond which points don't know of each other.
    spacing: f64,
    cells: Cells,
}

impl Cloud {
    fn new(points: &[Point], spacing: f64) -> Cloud {
        let positions: Vec<DVec3> = points.iter().map(|point| point.position).collect();
        Cloud {
            cells: Cells::new(&positions, spacing),
            normals: points.iter().map(|point| point.here.normal()).collect(),
            positions,
            spacing,
        }
    }

    /// Calls `visit` with every other point that is nearer than the spacing, on the same sheet, and
    /// with the squared distance.
    fn neighbours(&self, index: u32, mut visit: impl FnMut(u32, f64)) {
        let position = self.positions[index as usize];
        let normal = self.normals[index as usize];
        let reach = self.spacing * self.spacing;
        self.cells.around(position, |other| {
            let place = other as usize;
            let square = self.positions[place].distance_squared(position);
            let sheet = self.normals[place].dot(normal) >= SAME_SHEET;
            if square < reach && other != index && sheet {
                visit(other, square);
            }
        });
    }
}

/// A number that orders heaps; NaN does not occur.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Key {
    value: f64,
    index: u32,
}

impl Eq for Key {}

impl Ord for Key {
    /// By value; of equal ones the earlier index is greater, so that it leaves a heap first.
    fn cmp(&self, other: &Key) -> std::cmp::Ordering {
        let by_value = self.value.total_cmp(&other.value);
        by_value.then(other.index.cmp(&self.index))
    }
}

impl PartialOrd for Key {
    fn partial_cmp(&self, other: &Key) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
