//! All roots in R1, each with a proof: interval Newton isolation.
//!
//! The interval is divided until enclosures decide (Moore, Kearfott and Cloud, "Introduction to
//! Interval Analysis", 2009, chapter 8). On a part X with the enclosures F(X) and F'(X):
//!
//! * 0 ∉ F(X): no root.
//! * 0 ∉ F'(X): F is strictly monotonous, so that its signs at the ends decide: one simple root or
//!   none. Newton's operator N(X) = m − F(m) / F'(X), which holds every root of X, then contracts
//!   the part to rounding.
//! * else X is split at a point m with F(m) ≠ 0; extended division, by an F'(X) with 0 inside,
//!   leaves out the gap around m in which F cannot come down to 0.
//!
//! Signs are taken from enclosures at points, which hold the exact values, so that rounding does
//! not invent or hide a root. What is left at the floor of the width, or where F cannot be told
//! from 0 at any point, is examined in `doubts`: multiple roots, poles, jumps, ends of the domain,
//! and stretches on which F is 0.

mod doubts;

use self::doubts::{Doubt, examine};
use super::grid::Seen;
use super::roots::{IsolatedRoot, Reason, Roots};
use super::{Found, Job, PolygonizeError, Shape, Statistics, bracketing, uniform_grid};
use crate::engine::{CompiledField, Field, Monitor};
use crate::graph::Interval;
use crate::graph::interval::{Enclosure, Regularity};

/// Parts are not split below this part of the interval's length, nor below some units in the last
/// place of their ends.
const FLOOR: f64 = 1e-18;
const FLOOR_UNITS: f64 = 4.0;

/// The most parts that are enclosed, some seconds of work; and the most of them that no proven root
/// or cell accounts for, with so many for each.
const PART_LIMIT: usize = 1 << 21;
const IN_VAIN: usize = 1 << 16;
const FOR_A_ROOT: usize = 2;
const FOR_A_CELL: usize = 4;

/// Where a part is split, as fractions of it: the first at which F is surely not 0.
const SPLITS: [f64; 6] = [0.5, 0.461, 0.547, 0.389, 0.623, 0.28];

/// Contractions of a root's enclosure, at most; each squares the relative width until rounding.
const CONTRACTIONS: usize = 64;

/// What F is before it is enclosed.
const UNKNOWN: Enclosure = Enclosure {
    range: Interval::ENTIRE,
    regularity: Regularity::Partial,
};

/// The roots in the interval, both ends included, ascending, and what is undecided.
///
/// Fields that are not compiled give no enclosures: they are left to [`bracketing`].
pub(super) fn find(job: &Job) -> Result<Found, PolygonizeError> {
    let Some(compiled) = job.field.compiled() else {
        return bracketing::find(job);
    };
    let grid = uniform_grid(job.options)?;
    let iso = job.options.iso;
    let shifted = (iso != 0.0).then(|| compiled.minus(iso));
    let mut line = Line {
        field: shifted.as_ref().unwrap_or(compiled),
        side: (job.options.bounds.min.x, job.options.bounds.max.x),
        evaluations: 0,
    };
    let points = &grid.coordinates[0];
    let mut values = vec![0.0; points.len()];
    line.field.values(&[points], &mut values);
    line.evaluations += points.len();
    let seen = Seen::of_values(&values);
    let isolated = isolate(&mut line, points, job.monitor)?;
    let found = examine(&mut line, isolated);
    let statistics = statistics(&mut line, &found, seen, grid.cells());
    Ok((Shape::Roots(found), seen, statistics))
}

fn statistics(line: &mut Line, found: &Roots, seen: Seen, cells: usize) -> Statistics {
    let values = found.values();
    let mut residual = 0.0_f64;
    for &root in &values {
        let (value, slope) = line.at(root);
        let own = if value == 0.0 {
            0.0
        } else {
            (value / slope).abs()
        };
        // At a multiple root the quotient says nothing.
        residual = if own.is_finite() {
            residual.max(own)
        } else {
            residual
        };
    }
    let breaks = || {
        found
            .undecided
            .iter()
            .filter(|doubt| doubt.reason.is_break())
    };
    let ends = breaks().filter(|doubt| doubt.reason == Reason::Undefined);
    Statistics {
        cells,
        evaluations: line.evaluations,
        nan_points: seen.nan,
        cut_by_box: values
            .iter()
            .any(|&root| root == line.side.0 || root == line.side.1),
        max_residual: residual,
        good_roots: values.len(),
        poor_roots: breaks().filter(|doubt| doubt.root.is_none()).count(),
        domain_ends: ends.filter(|doubt| doubt.root.is_none()).count(),
        undecided: found.undecided.len(),
        proven: found.undecided.is_empty(),
        ..Statistics::default()
    }
}

/// F along its axis, with a count of what is asked of it.
struct Line<'a> {
    field: &'a CompiledField,
    /// The interval.
    side: (f64, f64),
    evaluations: usize,
}

impl Line<'_> {
    /// Encloses F and F' on intervals.
    fn enclose(&mut self, sides: &[Interval]) -> Vec<(Enclosure, Interval)> {
        let mut values = vec![UNKNOWN; sides.len()];
        let mut slopes = vec![Interval::ENTIRE; sides.len()];
        self.field
            .enclose_gradients(&[sides], &mut values, &mut [&mut slopes]);
        self.evaluations += sides.len();
        // A derivative that is defined nowhere says nothing.
        let known = |slope: Interval| {
            if slope.is_empty() {
                Interval::ENTIRE
            } else {
                slope
            }
        };
        values
            .into_iter()
            .zip(slopes.into_iter().map(known))
            .collect()
    }

    /// Encloses F at points.
    fn enclose_points(&mut self, points: &[f64]) -> Vec<Enclosure> {
        let sides: Vec<Interval> = points.iter().map(|&point| Interval::point(point)).collect();
        let mut values = vec![UNKNOWN; points.len()];
        self.field.enclose(&[&sides], &mut values);
        self.evaluations += points.len();
        values
    }

    /// F and F' at a point, rounded.
    fn at(&mut self, point: f64) -> (f64, f64) {
        self.evaluations += 1;
        let (value, gradient) = self.field.value_gradient(glam::DVec3::new(point, 0.0, 0.0));
        (value, gradient.x)
    }

    /// F at points, rounded.
    fn values(&mut self, points: &[f64]) -> Vec<f64> {
        let mut values = vec![0.0; points.len()];
        self.field.values(&[points], &mut values);
        self.evaluations += points.len();
        values
    }

    /// The width below which a part at a place is not split.
    fn floor(&self, low: f64, high: f64) -> f64 {
        let units = FLOOR_UNITS * f64::EPSILON * low.abs().max(high.abs());
        units.max(FLOOR * (self.side.1 - self.side.0))
    }
}

/// The sign of F at a point as far as it is proven: -1, 0 (unknown) or 1.
fn sign(value: &Enclosure) -> i8 {
    if value.regularity == Regularity::Partial || value.range.contains(0.0) {
        return 0;
    }
    if value.range.low > 0.0 { 1 } else { -1 }
}

/// Whether F is proven to be 0, or a number too small for f64.
fn is_zero(value: &Enclosure) -> bool {
    // A product with 0 is rounded outward.
    let largest = value.range.low.abs().max(value.range.high.abs());
    value.regularity != Regularity::Partial && largest <= f64::MIN_POSITIVE
}

/// A part of the interval.
#[derive(Clone, Copy, Debug)]
struct Part {
    low: f64,
    high: f64,
    /// The signs of F at the ends. At an end that Newton's operator made F is not asked: between
    /// there and the point of the split it has no zero.
    signs: [i8; 2],
    /// Whether F is proven to be 0 at the ends.
    zeros: [bool; 2],
}

/// What isolation comes to.
#[derive(Default)]
struct Isolated {
    roots: Vec<IsolatedRoot>,
    doubts: Vec<Doubt>,
}

/// Divides the interval until all parts are decided or in doubt; first at those grid points at
/// which F is surely not 0.
fn isolate(
    line: &mut Line,
    points: &[f64],
    monitor: &dyn Monitor,
) -> Result<Isolated, PolygonizeError> {
    let mut isolated = Isolated::default();
    let mut open = first_parts(line, points);
    let mut enclosed = 0;
    while !open.is_empty() {
        if monitor.cancelled() {
            return Err(PolygonizeError::Cancelled);
        }
        let accounted = FOR_A_ROOT * isolated.roots.len() + FOR_A_CELL * points.len();
        let allowed = IN_VAIN + accounted;
        if enclosed + open.len() > allowed.min(PART_LIMIT) {
            isolated.doubts.extend(open.iter().map(Doubt::unfinished));
            break;
        }
        enclosed += open.len();
        let sides: Vec<Interval> = open.iter().map(Part::side).collect();
        let known = line.enclose(&sides);
        let mut undecided = Vec::new();
        for (part, (value, slope)) in open.iter().zip(known) {
            if !value.range.contains(0.0) {
                continue;
            }
            let continuous = value.regularity == Regularity::Continuous;
            if is_zero(&value) {
                isolated.doubts.push(Doubt::vanishing(part));
            } else if continuous && !slope.contains(0.0) {
                settle(line, part, slope, &mut isolated);
            } else if part.high - part.low <= line.floor(part.low, part.high) {
                isolated.doubts.push(Doubt::of(part, continuous));
            } else {
                undecided.push((*part, continuous.then_some(slope)));
            }
        }
        open = split(line, &undecided, &mut isolated);
        monitor.progress("isolating roots", enclosed as f64 / PART_LIMIT as f64);
    }
    let by_place = |one: &IsolatedRoot, other: &IsolatedRoot| one.value.total_cmp(&other.value);
    isolated.roots.sort_by(by_place);
    // A zero at an end that two parts share is found in both.
    isolated
        .roots
        .dedup_by(|one, other| one.value == other.value);
    Ok(isolated)
}

/// The parts between those grid points at which F is surely not 0, and the ends.
fn first_parts(line: &mut Line, points: &[f64]) -> Vec<Part> {
    let last = points.len() - 1;
    let values = line.enclose_points(points);
    let places = points.iter().zip(&values).enumerate();
    let kept =
        places.filter(|(index, (_, value))| *index == 0 || *index == last || sign(value) != 0);
    let kept: Vec<(f64, &Enclosure)> = kept.map(|(_, (point, value))| (*point, value)).collect();
    kept.windows(2)
        .map(|ends| Part {
            low: ends[0].0,
            high: ends[1].0,
            signs: [sign(ends[0].1), sign(ends[1].1)],
            zeros: [is_zero(ends[0].1), is_zero(ends[1].1)],
        })
        .collect()
}

/// Decides a part on which F is continuous and strictly monotonous.
fn settle(line: &mut Line, part: &Part, slope: Interval, isolated: &mut Isolated) {
    let rises = if slope.low > 0.0 { 1 } else { -1 };
    let at_end = part.zeros.iter().position(|&zero| zero);
    if let Some(end) = at_end {
        let value = [part.low, part.high][end];
        isolated.roots.push(IsolatedRoot {
            value,
            enclosure: (value, value),
            proven: true,
        });
        return;
    }
    let [first, last] = part.signs;
    if first == rises || last == -rises {
        return;
    }
    let (side, inside) = contract(line, part.side(), slope);
    if side.is_empty() {
        return;
    }
    let proven = inside || first == -rises && last == rises;
    let value = best(line, side);
    let root = IsolatedRoot {
        value,
        enclosure: (side.low, side.high),
        proven,
    };
    if proven {
        isolated.roots.push(root);
    } else {
        // At an end of the interval, or of the domain, F is 0 but for rounding.
        isolated.doubts.push(Doubt::at_end(part, side, value));
    }
}

/// What is left of a part by Newton's operator, on and on; whether it came to lie inside of what
/// it was applied to, which proves that there is a root.
fn contract(line: &mut Line, mut side: Interval, mut slope: Interval) -> (Interval, bool) {
    let mut inside = false;
    for _ in 0..CONTRACTIONS {
        let middle = side.low.midpoint(side.high);
        let value = line.enclose_points(&[middle])[0];
        if value.range.is_empty() || value.regularity == Regularity::Partial {
            break;
        }
        let newton = Interval::point(middle) - value.range / slope;
        inside |= side.low < newton.low && newton.high < side.high;
        let next = newton.intersection(side);
        if next.is_empty() {
            return (next, false);
        }
        let shrinks = next.high - next.low < 0.9 * (side.high - side.low);
        side = next;
        if !shrinks {
            break;
        }
        let narrower = line.enclose(&[side])[0].1;
        // The old slope holds as well.
        let both = narrower.intersection(slope);
        if !both.is_empty() {
            slope = both;
        }
    }
    (side, inside)
}

/// The number in a narrow interval at which |F| is smallest, of a few.
fn best(line: &mut Line, side: Interval) -> f64 {
    let middle = side.low.midpoint(side.high);
    let mut places = vec![middle];
    let (mut below, mut above) = (middle, middle);
    for _ in 0..3 {
        (below, above) = (below.next_down(), above.next_up());
        places.extend([below, above]);
    }
    places.retain(|place| side.contains(*place));
    let values = line.values(&places);
    let smallest = places
        .iter()
        .zip(&values)
        .filter(|(_, value)| !value.is_nan())
        .min_by(|one, other| one.1.abs().total_cmp(&other.1.abs()));
    smallest.map_or(middle, |(place, _)| *place)
}

/// Splits parts, without the gaps that Newton's operator leaves; parts in which F cannot be told
/// from 0 anywhere are doubts.
fn split(
    line: &mut Line,
    parts: &[(Part, Option<Interval>)],
    isolated: &mut Isolated,
) -> Vec<Part> {
    let mut places: Vec<Option<(f64, Enclosure)>> = vec![None; parts.len()];
    let mut only_zeros = vec![true; parts.len()];
    for fraction in SPLITS {
        let waiting: Vec<usize> = (0..parts.len())
            .filter(|&at| places[at].is_none())
            .collect();
        let points: Vec<f64> = waiting
            .iter()
            .map(|&at| {
                let Part { low, high, .. } = parts[at].0;
                low + fraction * (high - low)
            })
            .collect();
        for ((&at, &point), value) in waiting
            .iter()
            .zip(&points)
            .zip(line.enclose_points(&points))
        {
            only_zeros[at] &= is_zero(&value);
            if sign(&value) != 0 {
                places[at] = Some((point, value));
            }
        }
    }
    let mut next = Vec::new();
    for ((&(part, slope), place), only_zeros) in parts.iter().zip(places).zip(only_zeros) {
        match place {
            Some((point, value)) => part.around_gap(point, &value, slope, &mut next),
            // Where F is 0 in places, or is not known to be continuous, halves may tell more.
            None if only_zeros || slope.is_none() => {
                next.extend(part.halves(only_zeros));
            }
            None => isolated.doubts.push(Doubt::of(&part, true)),
        }
    }
    next
}

impl Part {
    fn side(&self) -> Interval {
        Interval::new(self.low, self.high)
    }

    fn halves(&self, zero: bool) -> [Part; 2] {
        let middle = self.low.midpoint(self.high);
        let lower = Part {
            high: middle,
            signs: [self.signs[0], 0],
            zeros: [self.zeros[0], zero],
            ..*self
        };
        let upper = Part {
            low: middle,
            signs: [0, self.signs[1]],
            zeros: [zero, self.zeros[1]],
            ..*self
        };
        [lower, upper]
    }

    /// The parts on both sides of a point, without the gap in which F cannot come down to 0 with a
    /// slope; without a slope there is none.
    fn around_gap(
        &self,
        point: f64,
        value: &Enclosure,
        slope: Option<Interval>,
        parts: &mut Vec<Part>,
    ) {
        let own = sign(value);
        let level = value.range.abs().low;
        // To the left F falls as it rises to the right.
        let reach = |steepness: f64| match slope {
            Some(_) if steepness > 0.0 => (Interval::point(level) / Interval::point(steepness)).low,
            Some(_) => f64::INFINITY,
            None => 0.0,
        };
        let (left, right) = match (slope, own > 0) {
            (Some(slope), true) => (slope.high, -slope.low),
            (Some(slope), false) => (-slope.low, slope.high),
            (None, _) => (0.0, 0.0),
        };
        let left = (Interval::point(point) - Interval::point(reach(left))).high;
        let high = if left < point {
            left.next_up().min(point)
        } else {
            point
        };
        if high > self.low {
            parts.push(Part {
                high,
                signs: [self.signs[0], own],
                zeros: [self.zeros[0], false],
                ..*self
            });
        }
        let right = (Interval::point(point) + Interval::point(reach(right))).low;
        let low = if right > point {
            right.next_down().max(point)
        } else {
            point
        };
        if low < self.high {
            parts.push(Part {
                low,
                signs: [own, self.signs[1]],
                zeros: [false, self.zeros[1]],
                ..*self
            });
        }
    }
}
