//! Rays: the points in which random lines meet the surface, and what the lines tell of its area and
//! volume.
//!
//! Lines are drawn from the measure that motions leave invariant: their directions are uniform,
//! and for each direction so are their places in the disk across that holds the box. The number
//! of points on a piece of surface is then proportional to its area on average, whatever its shape
//! and place (Cauchy and Crofton; L. A. Santaló, Integral Geometry and Geometric Probability,
//! 1976, sections 3.2 and 14.4). With S the disk's area (in R2: the length of the interval across)
//!
//! * area = S · (mean number of points on a line) / m, where m is the mean |cosine| between a line
//!   and a normal: 1/2 in space, 2/π in the plane (where it is the length);
//! * volume = S · (mean length on a line where F < 0) (in the plane the area).
//!
//! Lines are independent, so the standard error of a mean is s/√n. They are drawn in batches until
//! there are enough points; that depends on the points, which biases the means by a part of about
//! one over their number, far below the standard error.
//!
//! Parallel lines, with a given `direction`, meet a piece of surface in proportion to its shadow.
//! Each point then has the weight 1/|n·d|, by which means over the points are means over the
//! area. Where the surface is nearly parallel to the lines, weights have no bound, and their
//! variance is infinite: the area is not estimated from them.

use std::f64::consts::{FRAC_2_PI, TAU};
use std::ops::Range;

use glam::DVec3;

use super::floaters::balance::number_for;
use super::lines::{CHUNK, Cost, Crossing, Segment, Wanted, intersect};
use super::newton::Point;
use super::random::Stream;
use super::statistics::{Estimate, Lines, Statistics};
use super::{Options, Outcome, SampleError, out_of_range, refuse_too_fine, samples};
use crate::engine::{Field, Monitor};
use crate::geometry::{Bounds, length};
use crate::math::scalar::{cos, sin};

/// The purpose of the random stream; others take smaller numbers.
const LINE_STREAM: u64 = 8 << 32;

/// The lines of the first batch, and of the largest.
const BATCHES: (u64, u64) = (1 << 10, 1 << 13);

/// If none of so many lines meets the surface, there is none for the method.
pub(super) const HOPELESS: u64 = 1 << 16;

/// A parallel line with a smaller cosine to the normal gives no point: it would outweigh all others.
const GRAZING: f64 = 1e-9;

/// Lines are drawn until so many have been for each point that is wanted.
const LINES_PER_POINT: u64 = 1 << 10;

/// The number of points without any wish: on a surface, on a curve.
pub(super) const DEFAULT_COUNT: (u64, u64) = (2000, 500);

/// Samples the zero set of a field in R2 or R3 by the points of random lines.
pub(super) fn rays(
    field: &dyn Field,
    bounds: Bounds,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Outcome, SampleError> {
    let mut harvest = Harvest::new(field, bounds, options, monitor)?;
    harvest.draw_first()?;
    let count = harvest.number(options)?;
    harvest.draw(count)?;
    let mut points: Vec<Point> = harvest.crossings.iter().map(|c| c.point).collect();
    points.truncate(count as usize);
    let mut samples = samples(bounds.dimension, &points);
    if let Some(direction) = harvest.bundle.direction() {
        let weight = |normal: &DVec3| 1.0 / normal.dot(direction).abs();
        samples.weights = samples.normals.iter().map(weight).collect();
    }
    let complete = samples.positions.len() as u64 == count;
    let statistics = harvest.statistics(&points, complete);
    Ok(Outcome {
        samples,
        statistics,
    })
}

/// The lines that may be drawn.
struct Bundle {
    bounds: Bounds,
    stream: Stream,
    kind: Kind,
}

enum Kind {
    /// Isotropic: all lines that meet the ball around the box.
    Isotropic { radius: f64 },
    /// Parallel: through the rectangle that holds the box as seen along them.
    Parallel {
        direction: DVec3,
        /// Orthogonal directions across, of length 1.
        across: [DVec3; 2],
        /// Where the rectangle begins along each, from the box's centre, and how long it is.
        sides: [(f64, f64); 2],
    },
}

impl Bundle {
    fn new(bounds: Bounds, options: &Options) -> Bundle {
        let kind = match options.direction {
            None => Kind::Isotropic {
                radius: 0.5 * bounds.diagonal(),
            },
            Some(mut direction) => {
                if bounds.dimension == 2 {
                    direction.z = 0.0;
                }
                let direction = (direction / length(direction)).normalize();
                let across = match bounds.dimension {
                    2 => [DVec3::new(-direction.y, direction.x, 0.0), DVec3::ZERO],
                    _ => <[DVec3; 2]>::from(direction.any_orthonormal_pair()),
                };
                let sides = across.map(|across| {
                    let reach = 0.5 * bounds.size().dot(across.abs());
                    (-reach, 2.0 * reach)
                });
                Kind::Parallel {
                    direction,
                    across,
                    sides,
                }
            }
        };
        Bundle {
            bounds,
            stream: Stream::new(options.seed, LINE_STREAM),
            kind,
        }
    }

    fn direction(&self) -> Option<DVec3> {
        match self.kind {
            Kind::Isotropic { .. } => None,
            Kind::Parallel { direction, .. } => Some(direction),
        }
    }

    /// The area across which lines are drawn; in R2 the length.
    fn section(&self) -> f64 {
        match (&self.kind, self.bounds.dimension) {
            (Kind::Isotropic { radius }, 2) => 2.0 * radius,
            (Kind::Isotropic { radius }, _) => 0.5 * TAU * radius * radius,
            (Kind::Parallel { sides, .. }, 2) => sides[0].1,
            (Kind::Parallel { sides, .. }, _) => sides[0].1 * sides[1].1,
        }
    }

    /// The part of a line in the box; `None` if it passes by.
    fn line(&self, index: u64) -> Option<Segment> {
        let random = |place: u64| self.stream.unit(4 * index + place);
        let centre = self.bounds.center();
        let (through, direction) = match &self.kind {
            Kind::Isotropic { radius } if self.bounds.dimension == 2 => {
                let angle = TAU * random(0);
                let direction = DVec3::new(cos(angle), sin(angle), 0.0);
                let across = DVec3::new(-direction.y, direction.x, 0.0);
                let offset = radius * (2.0 * random(1) - 1.0);
                (centre + offset * across, direction)
            }
            Kind::Isotropic { radius } => {
                // Archimedes: the height of a random point of a sphere is uniform.
                let height = 2.0 * random(0) - 1.0;
                let ring = (1.0 - height * height).sqrt();
                let angle = TAU * random(1);
                let direction = DVec3::new(ring * cos(angle), ring * sin(angle), height);
                let (first, second) = direction.any_orthonormal_pair();
                let offset = radius * random(2).sqrt();
                let turn = TAU * random(3);
                let across = offset * (cos(turn) * first + sin(turn) * second);
                (centre + across, direction.normalize())
            }
            Kind::Parallel {
                direction,
                across,
                sides,
            } => {
                let offset = |axis: usize| {
                    let (begin, length) = sides[axis];
                    (begin + length * random(axis as u64)) * across[axis]
                };
                (centre + offset(0) + offset(1), *direction)
            }
        };
        clip(&self.bounds, through, direction)
    }
}

/// The part of the line through a point that lies in the box.
fn clip(bounds: &Bounds, through: DVec3, direction: DVec3) -> Option<Segment> {
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..bounds.dimension {
        let (place, speed) = (through[axis], direction[axis]);
        let (low, high) = (bounds.min[axis], bounds.max[axis]);
        if speed == 0.0 {
            if !(low..=high).contains(&place) {
                return None;
            }
            continue;
        }
        let (one, other) = ((low - place) / speed, (high - place) / speed);
        enter = enter.max(one.min(other));
        leave = leave.min(one.max(other));
    }
    (enter < leave).then(|| Segment {
        origin: through + enter * direction,
        direction,
        length: leave - enter,
    })
}

/// Lines drawn so far, with all that they met.
pub(super) struct Harvest<'a> {
    field: &'a dyn Field,
    monitor: &'a dyn Monitor,
    wanted: Wanted,
    bundle: Bundle,
    /// The roots, in the order of the lines.
    pub(super) crossings: Vec<Crossing>,
    /// Lines, those that pass the box by included.
    drawn: u64,
    /// Lines, at most, if there is nothing to be found.
    limit: u64,
    /// Sums over lines of the number of points and its square, exact.
    numbers: (u64, u64),
    /// Sums over lines of the length inside and its square.
    lengths: (f64, f64),
    undecided: u64,
    /// Of these, places at which there may be roots; and stretches on which F is 0.
    unclear: u64,
    vanishing: u64,
    cost: Cost,
}

impl<'a> Harvest<'a> {
    pub(super) fn new(
        field: &'a dyn Field,
        bounds: Bounds,
        options: &Options,
        monitor: &'a dyn Monitor,
    ) -> Result<Harvest<'a>, SampleError> {
        if bounds.dimension == 1 {
            let expected = "\"grid\", \"kinematic\" or \"dynamic\" for the roots of a field in R1";
            let found = format!("{:?}", options.method.name());
            return Err(out_of_range("method", expected, found));
        }
        Ok(Harvest {
            field,
            monitor,
            wanted: Wanted {
                bounds,
                tolerance: options.tolerance * bounds.diagonal(),
            },
            bundle: Bundle::new(bounds, options),
            crossings: Vec::new(),
            drawn: 0,
            limit: 0,
            numbers: (0, 0),
            lengths: (0.0, 0.0),
            undecided: 0,
            unclear: 0,
            vanishing: 0,
            cost: Cost::default(),
        })
    }

    /// Draws the first lines: enough for a first estimate, if there is anything.
    pub(super) fn draw_first(&mut self) -> Result<(), SampleError> {
        let least = BATCHES.0 as usize;
        while self.drawn < HOPELESS && self.crossings.len() < least {
            self.ask(self.drawn as f64 / HOPELESS as f64)?;
            let number = self.drawn.clamp(BATCHES.0, BATCHES.1);
            self.batch(self.drawn..self.drawn + number);
        }
        Ok(())
    }

    /// Draws lines until there are so many points, if that can be.
    pub(super) fn draw(&mut self, count: u64) -> Result<(), SampleError> {
        self.limit = HOPELESS + count.saturating_mul(LINES_PER_POINT);
        let mut found = self.crossings.len() as u64;
        while found > 0 && found < count && self.drawn < self.limit {
            self.ask(found as f64 / count as f64)?;
            let missing = (count - found) as f64;
            let lines = 1.02 * missing * self.drawn as f64 / found as f64;
            let lines = (lines as u64).clamp(CHUNK as u64, BATCHES.1);
            let lines = lines.next_multiple_of(CHUNK as u64);
            self.batch(self.drawn..self.drawn + lines);
            found = self.crossings.len() as u64;
        }
        Ok(())
    }

    /// Tells the monitor how far it is, and asks it whether to go on.
    fn ask(&self, fraction: f64) -> Result<(), SampleError> {
        if self.monitor.cancelled() {
            return Err(SampleError::Cancelled);
        }
        self.monitor.progress("rays", fraction);
        Ok(())
    }

    fn batch(&mut self, indices: Range<u64>) {
        self.drawn += indices.end - indices.start;
        let segments: Vec<Segment> = indices.filter_map(|i| self.bundle.line(i)).collect();
        let (lines, cost) = intersect(self.field, &segments, &self.wanted);
        self.cost.add(cost);
        for line in lines {
            let regular = line.crossings.iter().filter(|c| !c.in_region);
            let number = regular.count() as u64;
            self.numbers.0 += number;
            self.numbers.1 += number * number;
            self.lengths.0 += line.inside;
            self.lengths.1 += line.inside * line.inside;
            self.undecided += u64::from(line.undecided);
            self.unclear += u64::from(line.unclear);
            self.vanishing += u64::from(line.vanishing);
            let direction = self.bundle.direction();
            self.crossings
                .extend(line.crossings.into_iter().filter(|crossing| {
                    let normal = crossing.point.here.normal();
                    direction.is_none_or(|along| normal.dot(along).abs() > GRAZING)
                }));
        }
    }

    /// How many points are wanted, by their count or by their spacing on the estimated area.
    pub(super) fn number(&self, options: &Options) -> Result<u64, SampleError> {
        let dimension = self.wanted.bounds.dimension;
        let default = match dimension {
            2 => DEFAULT_COUNT.1,
            _ => DEFAULT_COUNT.0,
        };
        let Some(spacing) = options.spacing else {
            return Ok(options.count.unwrap_or(default));
        };
        if self.vanishing > 0 {
            let expected = "left out, with `count` instead, where the field is 0 on a whole region";
            return Err(out_of_range("spacing", expected, spacing.to_string()));
        }
        let Some(area) = self.counted_area() else {
            let expected = "left out where a direction is given";
            return Err(out_of_range("spacing", expected, spacing.to_string()));
        };
        let expected = number_for(dimension, area.value, spacing).round().max(1.0);
        refuse_too_fine(spacing, expected, options.count_limit)?;
        Ok(expected as u64)
    }

    /// The area of the surface in the box, in R2 the length of the curve; not from parallel lines,
    /// not where F is 0 on a whole region, and not where roots may have been missed or counted twice
    /// so often that the standard error says less than that.
    pub(super) fn area(&self) -> Option<Estimate> {
        let estimate = self.counted_area()?;
        let (sum, _) = self.numbers;
        // At each unclear place there may be a root or two.
        let bias = 2.0 * self.unclear as f64 * estimate.value / sum.max(1) as f64;
        (self.vanishing == 0 && bias <= estimate.error).then_some(Estimate {
            error: estimate.error + bias,
            ..estimate
        })
    }

    /// The area by the roots that were counted, whatever they are worth.
    pub(super) fn counted_area(&self) -> Option<Estimate> {
        let mean_cosine = match (&self.bundle.kind, self.wanted.bounds.dimension) {
            (Kind::Parallel { .. }, _) => return None,
            (_, 2) => FRAC_2_PI,
            _ => 0.5,
        };
        let (sum, squares) = self.numbers;
        let factor = self.bundle.section() / mean_cosine;
        Some(mean(self.drawn, sum as f64, squares as f64, factor))
    }

    /// The volume within the box where F < 0, in R2 the area.
    pub(super) fn volume(&self) -> Estimate {
        let (sum, squares) = self.lengths;
        mean(self.drawn, sum, squares, self.bundle.section())
    }

    /// What is told of these points.
    pub(super) fn statistics(&self, points: &[Point], complete: bool) -> Statistics {
        let counts = Lines {
            drawn: self.drawn,
            touching: self.crossings.iter().filter(|c| c.touches).count() as u64,
            undecided: self.undecided,
            vanishing: self.vanishing,
            proven: self.field.compiled().is_some(),
            enclosures: self.cost.enclosures,
            area: self.area(),
            volume: Some(self.volume()),
        };
        line_statistics(&self.wanted.bounds, points, counts, self.cost, complete)
    }
}

/// A mean over so many lines with its standard error, times a factor.
fn mean(number: u64, sum: f64, squares: f64, factor: f64) -> Estimate {
    let number = number as f64;
    let mean = sum / number;
    let variance = (squares / number - mean * mean).max(0.0) * number / (number - 1.0);
    Estimate {
        value: factor * mean,
        error: factor * (variance / number).sqrt(),
    }
}

/// The statistics of a method that works with lines.
pub(super) fn line_statistics(
    bounds: &Bounds,
    points: &[Point],
    lines: Lines,
    cost: Cost,
    complete: bool,
) -> Statistics {
    let vanishing = points
        .iter()
        .filter(|point| point.here.gradient == DVec3::ZERO);
    Statistics {
        started: lines.drawn,
        points: points.len() as u64,
        evaluations: cost.evaluations,
        converged: complete,
        max_residual: points
            .iter()
            .map(|point| point.here.distance())
            .fold(0.0, f64::max),
        nan_points: cost.undefined,
        singular: vanishing.count() as u64,
        lines: Some(lines),
        ..Statistics::new(*bounds)
    }
}
