//! Continuation over a surface by a front of points with moving frames.
//!
//! Each point has its tangent plane. In it, the directions of the neighbours are sorted by angle,
//! and wherever the angle between two that follow each other leaves room, it is divided into equal
//! parts of about 60 degrees, at whose ends points at the distance h are predicted; Newton's method
//! puts them on the surface. (Rheinboldt, "On the computation of multi-dimensional solution
//! manifolds of parametrized equations", Numerische Mathematik 53, 1988, moves one frame along and
//! fills a lattice, which does not fit where the surface comes back to itself; the division of the
//! angle is that of Hartmann, "A marching method for the triangulation of surfaces", The Visual
//! Computer 14, 1998.) The points of a front are taken in the order in which they were found, so
//! that it stays round.
//!
//! Fronts start from the points of the cover of the zero set (`cover`) that no front has come near,
//! so no component is missed. Sheets are kept apart by their normals, which are opposite on both
//! sides of a thin wall. What would lie outside of the box is put on its border.
//!
//! Neighbours come from a list of cells, so that the cost is proportional to the points: some twenty
//! evaluations for each.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::found_box;
use crate::continuation::crossed_cells;
use crate::engine::{Field, Monitor};
use crate::geometry::{Bounds, Samples};
use crate::math::scalar;
use crate::sample::cover::cover;
use crate::sample::evaluation::Evaluation;
use crate::sample::statistics::{Proof, Statistics};
use crate::sample::{Options, Outcome, SampleError, radii, refuse_too_fine};

/// Points on a surface without `count` and `spacing`.
const DEFAULT_COUNT: u64 = 2000;

/// The first spacing that is tried for a count, as a part of the diagonal.
const FIRST_SPACING: f64 = 1.0 / 16.0;

/// How often a spacing is tried for a count, and how far the number of points may be off.
const TRIALS: u32 = 6;
const ACCURACY: f64 = 0.01;

/// Points closer than this part of the spacing are not accepted, nor on the border.
const CLOSEST: f64 = 0.8;
const CLOSEST_ON_BORDER: f64 = 0.6;

/// Points so far away, in spacings, bound the angles that are divided.
const SEEN: f64 = 1.45;

/// An angle is divided into as many parts as sixths of a circle fit into it, and one more if this
/// much is left: what is made room for at 99 degrees is 0.84 spacings from both neighbours.
const ROUNDED_UP: f64 = 0.65;

/// Normals of one sheet have at least this cosine: that of a crease of 107 degrees.
const SAME_SHEET: f64 = -0.3;

/// The cells of the grid along the longest side, for fields of which nothing can be enclosed.
const GRID: usize = 32;

/// The most steps of Newton's method.
const NEWTON_LIMIT: u32 = 24;

/// Steps that are not shorter than the last one by this factor are errors of rounding.
const STALLED: f64 = 0.9;

/// Points between questions to the monitor.
const CHUNK: usize = 1024;

/// Samples the surface on which a field in R3 vanishes.
pub(in crate::sample) fn surface(
    field: &dyn Field,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Outcome, SampleError> {
    let bounds = match options.bounds {
        Some(bounds) => Some(bounds),
        None => found_box(&[field], monitor)?,
    };
    let Some(bounds) = bounds else {
        return Ok(super::nothing(&[field]));
    };
    let mut starts = Starts::new(field, &bounds, monitor).ok_or(SampleError::Cancelled)?;
    let tolerance = options.tolerance * bounds.diagonal();
    let mut front = Front {
        field,
        bounds,
        tolerance,
        spacing: options.spacing.unwrap_or(FIRST_SPACING * bounds.diagonal()),
        limit: options.count_limit,
        points: Vec::new(),
        cells: HashMap::new(),
        evaluations: starts.evaluations,
        undefined: 0,
    };
    let coarse = FIRST_SPACING * bounds.diagonal();
    if let Some(spacing) = options.spacing
        && spacing < coarse
    {
        // What a coarse front covers tells how many points a fine one takes.
        front.spacing = coarse;
        front.grow(&starts.points, monitor)?;
        let finer = coarse / spacing;
        let points = front.points.len() as f64 * finer * finer;
        refuse_too_fine(spacing, points, options.count_limit)?;
        front.spacing = spacing;
    }
    let mut trials = 1;
    front.grow(&starts.points, monitor)?;
    let wanted = options.count.unwrap_or(DEFAULT_COUNT) as f64;
    let mut reached = true;
    if options.spacing.is_none() && !front.points.is_empty() {
        let off = |found: usize| (found as f64 - wanted).abs() > ACCURACY * wanted;
        while off(front.points.len()) && trials < TRIALS {
            trials += 1;
            // The number is inverse to the square of the spacing, but for what is small.
            front.spacing *= (front.points.len() as f64 / wanted).sqrt();
            front.grow(&starts.points, monitor)?;
        }
        reached = !off(front.points.len());
    }
    if front.points.is_empty() && starts.left > 0 {
        return Err(SampleError::NoCurve { fields: 1 });
    }
    starts.evaluations = 0;
    Ok(outcome(&front, &starts, bounds, trials, reached))
}

fn outcome(front: &Front, starts: &Starts, bounds: Bounds, trials: u32, reached: bool) -> Outcome {
    let positions: Vec<DVec3> = front.points.iter().map(|point| point.position).collect();
    let samples = Samples {
        dimension: 3,
        normals: front.points.iter().map(|point| point.normal).collect(),
        tangents: Vec::new(),
        weights: Vec::new(),
        residuals: front.points.iter().map(|point| point.residual).collect(),
        radii: radii::radii(&positions),
        positions,
    };
    let count = samples.positions.len() as u64;
    let statistics = Statistics {
        started: count,
        points: count,
        iterations: trials,
        steps: count,
        evaluations: front.evaluations,
        converged: reached,
        max_residual: samples.residuals.iter().copied().fold(0.0, f64::max),
        proof: starts.proof,
        nan_points: front.undefined,
        ..Statistics::new(bounds)
    };
    Outcome {
        samples,
        statistics,
    }
}

/// Points near the surface, at least one for each component.
struct Starts {
    points: Vec<DVec3>,
    /// Cells in which the surface may be and none of the points is.
    left: u64,
    proof: Option<Proof>,
    evaluations: u64,
}

impl Starts {
    /// Those of the cover, or else of a grid; `None` if the monitor cancelled.
    fn new(field: &dyn Field, bounds: &Bounds, monitor: &dyn Monitor) -> Option<Starts> {
        let Some(compiled) = field.compiled() else {
            let (cells, evaluations) = crossed_cells(&[field], bounds, GRID);
            return Some(Starts {
                points: cells.iter().map(|cell| cell.center()).collect(),
                left: cells.len() as u64,
                proof: None,
                evaluations,
            });
        };
        let found = cover(compiled, bounds, monitor)?;
        let left = found.left.len() as u64;
        let proof = Proof {
            covered: found.points.len() as u64,
            left,
            largest_left: found.largest_left(),
        };
        let open = found.left.iter().map(|cell| cell.low.midpoint(cell.high));
        Some(Starts {
            points: found.points.iter().copied().chain(open).collect(),
            left,
            proof: Some(proof),
            evaluations: found.evaluations,
        })
    }
}

/// A point on the surface.
#[derive(Clone, Copy)]
struct Vertex {
    position: DVec3,
    normal: DVec3,
    residual: f64,
}

/// The points so far, with their cells.
struct Front<'a> {
    field: &'a dyn Field,
    bounds: Bounds,
    tolerance: f64,
    spacing: f64,
    limit: u64,
    points: Vec<Vertex>,
    cells: HashMap<[i64; 3], Vec<u32>>,
    evaluations: u64,
    undefined: u64,
}

impl Front<'_> {
    /// Covers the surface anew with the present spacing.
    fn grow(&mut self, starts: &[DVec3], monitor: &dyn Monitor) -> Result<(), SampleError> {
        self.points.clear();
        self.cells.clear();
        let mut next = 0;
        for &start in starts {
            if let Some(seed) = self.put(start, 2.0 * self.spacing, None)
                && self.bounds.contains(seed.position)
                && self.has_room(&seed, CLOSEST)
            {
                self.add(seed);
            }
            while next < self.points.len() {
                if next.is_multiple_of(CHUNK) {
                    if monitor.cancelled() {
                        return Err(SampleError::Cancelled);
                    }
                    let done = next as f64 / self.limit as f64;
                    monitor.progress("front", done);
                }
                self.surround(next);
                next += 1;
                if self.points.len() as u64 > self.limit {
                    return Err(SampleError::TooMany {
                        count: self.estimate(),
                        limit: self.limit,
                    });
                }
            }
        }
        Ok(())
    }

    /// How many points there would be, at the least: a flat piece across the box.
    fn estimate(&self) -> u64 {
        let size = self.bounds.size().to_array();
        let largest = (size[0] * size[1])
            .max(size[1] * size[2])
            .max(size[2] * size[0]);
        let count = largest / (0.75_f64.sqrt() * self.spacing * self.spacing);
        (count.min(1e18) as u64).max(self.points.len() as u64)
    }

    fn cell(&self, position: DVec3) -> [i64; 3] {
        let cell = (position / (SEEN * self.spacing)).floor();
        cell.to_array().map(|place| place as i64)
    }

    fn add(&mut self, point: Vertex) {
        let cell = self.cell(point.position);
        let place = self.points.len() as u32;
        self.cells.entry(cell).or_default().push(place);
        self.points.push(point);
    }

    /// The points of the same sheet that are seen from one, in a fixed order.
    fn neighbours(&self, point: &Vertex) -> Vec<Vertex> {
        let [x, y, z] = self.cell(point.position);
        let reach = SEEN * self.spacing;
        let mut found = Vec::with_capacity(16);
        for dx in -1..=1 {
            for dy in -1..=1 {
                for dz in -1..=1 {
                    let cell = self.cells.get(&[x + dx, y + dy, z + dz]);
                    let points = cell.into_iter().flatten();
                    found.extend(points.map(|&place| self.points[place as usize]).filter(
                        |other| {
                            other.position.distance(point.position) < reach
                                && other.normal.dot(point.normal) > SAME_SHEET
                        },
                    ));
                }
            }
        }
        found
    }

    /// Whether no point of the same sheet is closer than a part of the spacing.
    fn has_room(&self, point: &Vertex, part: f64) -> bool {
        let closest = part * self.spacing;
        self.neighbours(point)
            .iter()
            .all(|other| other.position.distance(point.position) >= closest)
    }

    /// Adds points around one, wherever there is room for them.
    fn surround(&mut self, place: usize) {
        let centre = self.points[place];
        let along = centre.normal.any_orthonormal_vector();
        let across = centre.normal.cross(along);
        let mut angles: Vec<f64> = self
            .neighbours(&centre)
            .iter()
            .map(|other| other.position - centre.position)
            .filter(|offset| *offset != DVec3::ZERO)
            .map(|offset| scalar::atan2(offset.dot(across), offset.dot(along)))
            .collect();
        angles.sort_by(f64::total_cmp);
        let first = angles.first().copied().unwrap_or(0.0);
        angles.push(first + TAU);
        if angles.len() == 1 {
            angles.insert(0, first);
        }
        for pair in angles.windows(2) {
            let parts = ((pair[1] - pair[0]) / (PI / 3.0) + (1.0 - ROUNDED_UP)).floor();
            let whole = pair[1] - pair[0] == TAU;
            let start = if whole && angles.len() == 2 { 0 } else { 1 };
            for number in start..parts as u32 {
                let angle = pair[0] + (pair[1] - pair[0]) * f64::from(number) / parts;
                let direction = scalar::cos(angle) * along + scalar::sin(angle) * across;
                self.place(&centre, direction);
            }
        }
    }

    /// Adds the point at the spacing from one in a direction, if there is room.
    fn place(&mut self, centre: &Vertex, direction: DVec3) {
        let predicted = centre.position + self.spacing * direction;
        let Some(point) = self.put(predicted, 0.6 * self.spacing, None) else {
            return;
        };
        let (point, closest) = match self.bounds.contains(point.position) {
            true => (point, CLOSEST),
            false => match self.on_border(point.position) {
                Some(point) => (point, CLOSEST_ON_BORDER),
                None => return,
            },
        };
        let apart = point.position.distance(centre.position);
        if apart <= 1.3 * self.spacing
            && point.normal.dot(centre.normal) > SAME_SHEET
            && self.has_room(&point, closest)
        {
            self.add(point);
        }
    }

    /// The point on the side of the box that is nearest to one outside; `None` in its edges.
    fn on_border(&mut self, outside: DVec3) -> Option<Vertex> {
        let inside = outside.clamp(self.bounds.min, self.bounds.max);
        let moved = inside.cmpne(outside).bitmask();
        let axis = (0..3).find(|axis| moved == 1 << axis)?;
        let point = self.put(inside, 0.6 * self.spacing, Some(axis))?;
        self.bounds.contains(point.position).then_some(point)
    }

    /// Newton's method along the gradient, within a plane across an axis if one is given: the point
    /// of the surface near a place, not farther than `reach` from it.
    fn put(&mut self, start: DVec3, reach: f64, fixed: Option<usize>) -> Option<Vertex> {
        let mut position = start;
        let mut last = f64::INFINITY;
        for _ in 0..NEWTON_LIMIT {
            self.evaluations += 1;
            let (value, gradient) = self.field.value_gradient(position);
            let here = Evaluation { value, gradient };
            if !here.is_defined() {
                self.undefined += 1;
                return None;
            }
            let normal = here.normal();
            let residual = here.distance();
            let mut tangential = normal;
            if let Some(axis) = fixed {
                tangential[axis] = 0.0;
            }
            let squared = tangential.length_squared();
            let shift = residual * value.signum() / squared * tangential;
            let size = shift.length();
            let rounding = 4e-16 * (self.bounds.diagonal() + position.abs().max_element());
            let stalled = residual <= self.tolerance && size >= STALLED * last;
            if residual <= rounding || stalled {
                return (normal != DVec3::ZERO).then_some(Vertex {
                    position,
                    normal,
                    residual,
                });
            }
            position -= shift;
            // A singular place, or not this part of the surface.
            let moved = position.distance(start);
            if moved.is_nan() || moved > reach {
                return None;
            }
            last = size;
        }
        None
    }
}
