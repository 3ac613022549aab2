//! Grid: all points in which the edges of a regular grid meet the surface ("enumeration" in L.
//! Velho, J. Gomes and D. Terzopoulos, "Implicit manifolds, triangulations and dynamics").
//!
//! The edges are parts of lines parallel to the axes, and every root on these is found, also
//! several on one edge, which a polygonizer that compares the signs at their ends does not see.
//! Where a grid point lies on the surface it is one point of the sample, not three.
//!
//! On average an area A is met by 3 A / (2 h²) lines of a grid with cells of side h, and a length L
//! in the plane by 4 L / (π h): the mean of the sum of the normal's components is 3/2, in the plane
//! 4/π. With that a `count` is turned into a first spacing, which is then corrected by what the
//! grid gave.

use std::collections::BTreeSet;
use std::f64::consts::FRAC_2_PI;

use glam::DVec3;

use super::lines::{Cost, Segment, Wanted, intersect};
use super::newton::Point;
use super::rays::{DEFAULT_COUNT, Harvest, line_statistics};
use super::statistics::Lines;
use super::{Options, Outcome, SampleError, out_of_range, samples};
use crate::engine::{Field, Monitor};
use crate::geometry::Bounds;

/// Lines that are worked on at a time.
const BATCH: usize = 1 << 13;

/// Grids that are tried for a count, at most.
const TRIALS: u32 = 8;

/// A number of points this close to the wanted one is good enough.
const NEAR_ENOUGH: f64 = 0.01;

/// So many lines may be drawn for each point that is allowed: that many miss a small surface in
/// a large box.
const LINES_PER_POINT: f64 = 64.0;

/// Samples the zero set of a field by the edges of a grid.
pub(super) fn grid(
    field: &dyn Field,
    bounds: Bounds,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Outcome, SampleError> {
    let wanted = Wanted {
        bounds,
        tolerance: options.tolerance * bounds.diagonal(),
    };
    if bounds.dimension == 1 {
        let found = cross(field, &wanted, bounds.size().x, monitor)?;
        return Ok(outcome(field, &bounds, found, None));
    }
    // What random lines tell of the area, before anything large is begun.
    let plain = Options {
        direction: None,
        ..options.clone()
    };
    let mut first = Harvest::new(field, bounds, &plain, monitor)?;
    first.draw_first()?;
    let area = first.counted_area().map_or(0.0, |area| area.value);
    let found = match options.spacing {
        Some(spacing) => {
            check_spacing(&bounds, area, spacing, options.count_limit)?;
            cross(field, &wanted, spacing, monitor)?
        }
        None => {
            let default = match bounds.dimension {
                2 => DEFAULT_COUNT.1,
                _ => DEFAULT_COUNT.0,
            };
            let count = options.count.unwrap_or(default) as f64;
            cross_for_count(field, &wanted, area, count, monitor)?
        }
    };
    Ok(outcome(field, &bounds, found, Some(first)))
}

/// The points of one grid.
struct Found {
    points: Vec<Point>,
    lines: u64,
    touching: u64,
    undecided: u64,
    vanishing: u64,
    cost: Cost,
}

fn outcome(field: &dyn Field, bounds: &Bounds, found: Found, first: Option<Harvest>) -> Outcome {
    let lines = Lines {
        drawn: found.lines,
        touching: found.touching,
        undecided: found.undecided,
        vanishing: found.vanishing,
        proven: field.compiled().is_some(),
        enclosures: found.cost.enclosures,
        area: first.as_ref().and_then(Harvest::area),
        volume: first.as_ref().map(Harvest::volume),
    };
    Outcome {
        samples: samples(bounds.dimension, &found.points),
        statistics: line_statistics(bounds, &found.points, lines, found.cost, true),
    }
}

/// Refuses a spacing that makes too many points or lines.
fn check_spacing(bounds: &Bounds, area: f64, spacing: f64, limit: u64) -> Result<(), SampleError> {
    let expected = number_of_crossings(bounds.dimension, area, spacing);
    let lines: f64 = (0..bounds.dimension)
        .map(|axis| number_of_lines(&cells(bounds, spacing), axis))
        .sum();
    if expected > limit as f64 || lines > LINES_PER_POINT * limit as f64 {
        return Err(out_of_range(
            "spacing",
            &format!("larger, for at most {limit} points"),
            format!("{spacing} (which takes about {expected:.0} points on {lines:.0} lines)"),
        ));
    }
    Ok(())
}

/// The mean number of crossings of grids with cells of side `spacing`.
fn number_of_crossings(dimension: usize, area: f64, spacing: f64) -> f64 {
    match dimension {
        2 => 2.0 * FRAC_2_PI * area / spacing,
        _ => 1.5 * area / (spacing * spacing),
    }
}

/// The side of the cells that gives so many crossings, on average.
fn spacing_for_crossings(dimension: usize, area: f64, number: f64) -> f64 {
    match dimension {
        2 => 2.0 * FRAC_2_PI * area / number,
        _ => (1.5 * area / number).sqrt(),
    }
}

/// The numbers of cells that fit in the box along the axes; 0 beyond the dimension.
fn cells(bounds: &Bounds, spacing: f64) -> [f64; 3] {
    let size = bounds.size().to_array();
    // Where the side is a multiple of the spacing, rounding must not take the last grid line away.
    size.map(|side| (side / spacing * (1.0 + 1e-12)).floor())
}

/// The number of grid lines parallel to an axis.
fn number_of_lines(cells: &[f64; 3], axis: usize) -> f64 {
    (0..3)
        .filter(|&other| other != axis)
        .map(|other| cells[other] + 1.0)
        .product()
}

/// The grid that comes closest to a number of points, among those that are tried.
fn cross_for_count(
    field: &dyn Field,
    wanted: &Wanted,
    area: f64,
    count: f64,
    monitor: &dyn Monitor,
) -> Result<Found, SampleError> {
    let dimension = wanted.bounds.dimension;
    // Without any area the box stands for it: a grid as fine as its faces would need.
    let fallback = wanted.bounds.size().max_element();
    let mut spacing = match area > 0.0 {
        true => spacing_for_crossings(dimension, area, count),
        false => spacing_for_crossings(dimension, fallback * fallback, count),
    };
    let mut best: Option<Found> = None;
    let mut cost = Cost::default();
    for trial in 0..TRIALS {
        let found = cross(field, wanted, spacing, monitor)?;
        cost.add(found.cost);
        let number = found.points.len() as f64;
        let miss = |number: f64| (number - count).abs();
        if best
            .as_ref()
            .is_none_or(|best| miss(number) < miss(best.points.len() as f64))
        {
            best = Some(found);
        }
        if number == 0.0 || miss(number) <= NEAR_ENOUGH * count {
            break;
        }
        let correction = match dimension {
            2 => number / count,
            _ => (number / count).sqrt(),
        };
        // The number of crossings is no smooth function of the spacing: half a correction now and
        // then keeps trials from repeating.
        spacing *= match trial % 2 {
            0 => correction,
            _ => correction.sqrt(),
        };
    }
    best.map(|best| Found { cost, ..best })
        .ok_or(SampleError::Cancelled)
}

/// All crossings of the grid whose cells have this side, in the order of the lines.
fn cross(
    field: &dyn Field,
    wanted: &Wanted,
    spacing: f64,
    monitor: &dyn Monitor,
) -> Result<Found, SampleError> {
    let bounds = &wanted.bounds;
    let cells = cells(bounds, spacing);
    let total: f64 = (0..bounds.dimension)
        .map(|axis| number_of_lines(&cells, axis))
        .sum();
    let mut found = Found {
        points: Vec::new(),
        lines: 0,
        touching: 0,
        undecided: 0,
        vanishing: 0,
        cost: Cost::default(),
    };
    let mut nodes = BTreeSet::new();
    for axis in 0..bounds.dimension {
        let [first, second] = [(axis + 1) % 3, (axis + 2) % 3];
        let rows = cells[first] as u64 + 1;
        let lines = rows * (cells[second] as u64 + 1);
        for start in (0..lines).step_by(BATCH) {
            if monitor.cancelled() {
                return Err(SampleError::Cancelled);
            }
            monitor.progress("grid", found.lines as f64 / total);
            let indices: Vec<[u64; 3]> = (start..lines.min(start + BATCH as u64))
                .map(|line| {
                    let mut index = [0; 3];
                    index[first] = line % rows;
                    index[second] = line / rows;
                    index
                })
                .collect();
            let segments: Vec<Segment> = indices
                .iter()
                .map(|&index| line_of(bounds, spacing, axis, index))
                .collect();
            let (crossed, cost) = intersect(field, &segments, wanted);
            found.cost.add(cost);
            found.lines += segments.len() as u64;
            for (line, mut index) in crossed.into_iter().zip(indices) {
                found.undecided += u64::from(line.undecided);
                found.vanishing += u64::from(line.vanishing);
                for crossing in line.crossings {
                    let node = (crossing.along / spacing).round();
                    index[axis] = node as u64;
                    let is_node = (crossing.along - node * spacing).abs() <= wanted.tolerance;
                    if is_node && !nodes.insert(index) {
                        continue;
                    }
                    found.touching += u64::from(crossing.touches);
                    found.points.push(crossing.point);
                }
            }
        }
    }
    Ok(found)
}

/// The grid line parallel to an axis through the grid point with this index. The grid begins in the
/// lower corner of the box.
fn line_of(bounds: &Bounds, spacing: f64, axis: usize, index: [u64; 3]) -> Segment {
    let mut origin = bounds.min;
    for other in (0..bounds.dimension).filter(|&other| other != axis) {
        let place = bounds.min[other] + index[other] as f64 * spacing;
        origin[other] = place.min(bounds.max[other]);
    }
    Segment {
        origin,
        direction: DVec3::AXES[axis],
        length: bounds.size()[axis],
    }
}
