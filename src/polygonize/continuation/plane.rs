//! Plane curves by continuation: prediction along the direction of the Hamiltonian field
//! (F_y, −F_x), in which F does not change, correction by Newton's method, and starts that miss no
//! component ([`continuation`](crate::continuation)).
//!
//! Vertices are at most a cell apart along the curve, at equal distances between corners, cusps and
//! crossings, which are vertices themselves. The walk goes straight over a crossing, where the side
//! of F < iso changes; polylines turn there instead, so that what is inside stays on their left.

use glam::DVec3;

use crate::continuation::{Component, Events, Place, Region, Step, System, Traced, Walker, trace};
use crate::engine::{CompiledField, Field};
use crate::geometry::{Bounds, Curves, Polyline};
use crate::polygonize::grid::{Grid, Seen};
use crate::polygonize::{Found, Job, PolygonizeError, Shape, Statistics, border};

/// A closed curve has so many vertices at least.
const FEWEST: usize = 12;

/// An end of a curve so close to a side of the box, as a part of the diagonal, lies on it.
const ON_SIDE: f64 = 1e-9;

/// Points along each side of the grid that tells what F is where it has no zero.
const LOOKED_AT: usize = 16;

/// The level set in R2.
pub(super) fn find(job: &Job) -> Result<Found, PolygonizeError> {
    let (bounds, iso) = (job.options.bounds, job.options.iso);
    let compiled = job.field.compiled();
    let level: Option<CompiledField> = compiled
        .filter(|_| iso != 0.0)
        .map(|field| field.minus(iso));
    let shifted = Shifted {
        field: job.field,
        iso,
    };
    let field: &dyn Field = match (&level, iso == 0.0) {
        (Some(level), _) => level,
        (None, true) => job.field,
        (None, false) => &shifted,
    };
    let diagonal = bounds.diagonal();
    let system = System::new(vec![field], diagonal, job.accuracy.distance);
    let walker = Walker {
        system: &system,
        bounds,
        compiled: system.compiled(),
    };
    let traced =
        trace(&walker, &Region::whole(&bounds), job.monitor).ok_or(PolygonizeError::Cancelled)?;
    let mut pieces = Vec::new();
    for component in &traced.components {
        let marks = marks(&system, component, job.options.cell);
        let marks = on_sides(marks, component.closed, &bounds);
        pieces.extend(oriented(marks, component.closed, &traced.events));
    }
    let polylines = linked(pieces);
    let seen = seen(field, &bounds);
    let statistics = statistics(&system, &traced, &polylines, seen);
    let polylines = match job.options.cap {
        true => border::closed(polylines, &bounds, field.value(bounds.min) < 0.0),
        false => polylines,
    };
    let curves = Curves {
        dimension: 2,
        polylines,
    };
    Ok((Shape::Curves(curves), seen, statistics))
}

fn statistics(system: &System, traced: &Traced, polylines: &[Polyline], seen: Seen) -> Statistics {
    let vertices = || polylines.iter().flat_map(|polyline| &polyline.points);
    let residuals = vertices().filter_map(|&point| system.local(point));
    let residuals = residuals.map(|local| local.residual());
    let max_residual = residuals.filter(|own| own.is_finite()).fold(0.0, f64::max);
    let inner_ends = 2 * polylines.iter().filter(|polyline| !polyline.closed).count();
    Statistics {
        evaluations: system.counts().0 as usize + seen.points(),
        nan_points: seen.nan,
        cut_by_box: inner_ends > traced.events.ends.len(),
        max_residual,
        good_roots: vertices().count(),
        undecided: traced.undecided as usize,
        proven: traced.proven && traced.events.unfinished == 0,
        ..Statistics::default()
    }
}

/// What F is at the points of a coarse grid.
fn seen(field: &dyn Field, bounds: &Bounds) -> Seen {
    let grid = Grid::new(bounds, &[LOOKED_AT; 2], false);
    let mut seen = Seen::default();
    for &y in &grid.coordinates[1] {
        let ys = vec![y; grid.coordinates[0].len()];
        let mut values = vec![0.0; ys.len()];
        field.values(&[&grid.coordinates[0], &ys], &mut values);
        seen = seen.and(Seen::of_values(&values));
    }
    seen
}

/// A vertex, and whether the direction of travel is that with F < iso on the left (1) or its
/// opposite (-1); 0 at a singular point.
#[derive(Clone, Copy)]
pub(super) struct Mark {
    pub(super) position: DVec3,
    sign: f64,
}

/// The vertices of a component, the last of a closed one being the first again.
pub(super) fn marks(system: &System, component: &Component, cell: f64) -> Vec<Mark> {
    let mut marks: Vec<Mark> = Vec::new();
    let mut run: Vec<&Step> = Vec::new();
    let smooth = component.steps.iter().all(|step| !step.straight);
    let fewest = if smooth && component.closed {
        FEWEST
    } else {
        1
    };
    for step in &component.steps {
        if !step.straight {
            run.push(step);
            continue;
        }
        divide(system, &run, (cell, fewest), &mut marks);
        run.clear();
        let corners = [step.from, step.to].map(|position| Mark {
            position,
            sign: 0.0,
        });
        let known = marks.last().is_some_and(|last| last.position == step.from);
        marks.extend(&corners[usize::from(known)..]);
    }
    divide(system, &run, (cell, fewest), &mut marks);
    marks
}

/// Adds vertices at equal distances along steps that follow each other, both ends included.
fn divide(system: &System, run: &[&Step], (cell, fewest): (f64, usize), marks: &mut Vec<Mark>) {
    let Some(first) = run.first() else { return };
    let length: f64 = run.iter().map(|step| step.length).sum();
    let count = (length / cell).ceil().max(fewest as f64);
    let start = usize::from(marks.last().is_some_and(|last| last.position == first.from));
    let mut steps = run.iter();
    let mut step = *first;
    steps.next();
    let mut passed = 0.0;
    for number in start..=count as usize {
        let wanted = number as f64 / count * length;
        while passed + step.length < wanted
            && let Some(next) = steps.next()
        {
            passed += step.length;
            step = next;
        }
        let part = step.part_at_length(wanted - passed);
        let mark = match step.at(system, part) {
            Some(Place { position, sign, .. }) => Mark { position, sign },
            None => Mark {
                position: step.guess(part),
                sign: 0.0,
            },
        };
        // The ends are known.
        let position = match number {
            0 => first.from,
            _ if number as f64 == count => run.last().map_or(mark.position, |last| last.to),
            _ => mark.position,
        };
        marks.push(Mark { position, ..mark });
    }
}

/// The vertices with the ends of an open curve exactly on the sides of the box that it ends at.
pub(super) fn on_sides(mut marks: Vec<Mark>, closed: bool, bounds: &Bounds) -> Vec<Mark> {
    let near = ON_SIDE * bounds.diagonal();
    let last = marks.len().saturating_sub(1);
    for (place, mark) in marks.iter_mut().enumerate() {
        if closed || place != 0 && place != last {
            continue;
        }
        for axis in 0..bounds.dimension {
            for side in [bounds.min[axis], bounds.max[axis]] {
                if (mark.position[axis] - side).abs() <= near {
                    mark.position[axis] = side;
                }
            }
        }
    }
    marks
}

/// A polyline that begins and ends at crossings, if they have numbers, or is closed.
struct Piece {
    points: Vec<DVec3>,
    closed: bool,
    ends: [Option<usize>; 2],
}

/// The parts of a component between the crossings at which its sides change, each with F < iso on
/// its left.
fn oriented(mut marks: Vec<Mark>, closed: bool, events: &Events) -> Vec<Piece> {
    let known: Vec<usize> = (0..marks.len())
        .filter(|&at| marks[at].sign != 0.0)
        .collect();
    let changes = |pair: &[usize]| marks[pair[0]].sign != marks[pair[1]].sign;
    let first_change = known
        .windows(2)
        .find(|pair| changes(pair))
        .map(|pair| pair[0]);
    if let (true, Some(change)) = (closed, first_change) {
        // The curve begins anew before a change, so that no part goes round its end.
        marks.pop();
        marks.rotate_left(change);
        marks.push(marks[0]);
    }
    let mut pieces: Vec<Piece> = Vec::new();
    let mut piece = Piece {
        points: Vec::new(),
        closed: closed && first_change.is_none(),
        ends: [None; 2],
    };
    let mut sign = known.first().map_or(1.0, |&at| marks[at].sign);
    if let (true, Some(_)) = (closed, first_change) {
        sign = marks[0].sign;
    }
    let mut uncertain: Vec<DVec3> = Vec::new();
    let mut before = marks.first().map_or(DVec3::ZERO, |mark| mark.position);
    for mark in &marks {
        if mark.sign == 0.0 {
            uncertain.push(mark.position);
            continue;
        }
        if mark.sign == sign {
            piece.points.append(&mut uncertain);
        } else {
            let (number, crossing) = crossing(before, mark.position, &uncertain, events);
            uncertain.clear();
            piece.points.push(crossing);
            piece.ends[1] = number;
            let begun = Piece {
                points: vec![crossing],
                closed: false,
                ends: [number, None],
            };
            pieces.push(turned(std::mem::replace(&mut piece, begun), sign));
            sign = mark.sign;
        }
        piece.points.push(mark.position);
        before = mark.position;
    }
    piece.points.append(&mut uncertain);
    pieces.push(turned(piece, sign));
    // A closed curve with changes was cut at its beginning, too.
    if closed && pieces.len() > 1 {
        let last = pieces.pop();
        if let Some(last) = last {
            pieces[0] = joined_at_cut(last, std::mem::replace(&mut pieces[0], empty()), sign);
        }
    }
    pieces
}

fn empty() -> Piece {
    Piece {
        points: Vec::new(),
        closed: false,
        ends: [None; 2],
    }
}

/// The last part of a closed curve and the first, which has the same sign, as one.
fn joined_at_cut(last: Piece, first: Piece, sign: f64) -> Piece {
    let (mut one, other) = if sign > 0.0 {
        (last, first)
    } else {
        (first, last)
    };
    one.points.extend(other.points.into_iter().skip(1));
    one.ends[1] = other.ends[1];
    one
}

/// The piece in the direction that has F < iso on its left.
fn turned(mut piece: Piece, sign: f64) -> Piece {
    if piece.closed {
        piece.points.pop();
    }
    if sign < 0.0 {
        piece.points.reverse();
        piece.ends.reverse();
    }
    piece
}

/// The crossing between two vertices on its two sides: its number, if it was met, and where.
fn crossing(from: DVec3, to: DVec3, between: &[DVec3], events: &Events) -> (Option<usize>, DVec3) {
    let middle = 0.5 * (from + to);
    let reach = from.distance(to);
    let known = events.crossings.iter().enumerate();
    let nearest = known
        .map(|(number, place)| (number, *place, place.distance(middle)))
        .min_by(|one, other| one.2.total_cmp(&other.2));
    match nearest {
        Some((number, place, distance)) if distance <= reach => (Some(number), place),
        _ => (
            None,
            between.get(between.len() / 2).copied().unwrap_or(middle),
        ),
    }
}

/// Links pieces at crossings: each goes on with the next one clockwise around the crossing, so that
/// nothing but the inside lies between them.
fn linked(pieces: Vec<Piece>) -> Vec<Polyline> {
    let next = |at: usize| -> Option<usize> {
        let crossing = pieces[at].ends[1]?;
        let arrival = ray(pieces[at].points.iter().rev())?;
        let leaving = (0..pieces.len()).filter(|&other| pieces[other].ends[0] == Some(crossing));
        let clockwise = leaving.filter_map(|other| {
            let turn = (arrival - ray(pieces[other].points.iter())?).rem_euclid(4.0);
            Some((other, turn))
        });
        let nearest = clockwise.min_by(|one, other| one.1.total_cmp(&other.1))?;
        Some(nearest.0)
    };
    let successors: Vec<Option<usize>> = (0..pieces.len()).map(next).collect();
    let mut has_predecessor = vec![false; pieces.len()];
    for successor in successors.iter().flatten() {
        has_predecessor[*successor] = true;
    }
    let starts: Vec<usize> = (0..pieces.len())
        .filter(|&at| !has_predecessor[at])
        .collect();
    let mut used = vec![false; pieces.len()];
    let mut polylines = Vec::new();
    for first in starts.into_iter().chain(0..pieces.len()) {
        let mut points: Vec<DVec3> = Vec::new();
        let mut closed = pieces[first].closed;
        let mut here = Some(first);
        while let Some(at) = here {
            if used[at] {
                closed |= at == first && !points.is_empty();
                break;
            }
            used[at] = true;
            let own = &pieces[at].points;
            let repeated = usize::from(points.last().is_some() && points.last() == own.first());
            points.extend_from_slice(&own[repeated..]);
            here = successors[at];
        }
        points.dedup();
        if closed && points.len() > 1 && points.first() == points.last() {
            points.pop();
        }
        if points.len() > 1 {
            polylines.push(Polyline { points, closed });
        }
    }
    polylines
}

/// The direction of the second point from the first, as a number from 0 to 4 that grows
/// counter-clockwise.
fn ray<'a>(mut points: impl Iterator<Item = &'a DVec3>) -> Option<f64> {
    let from = points.next()?;
    let along = *points.next()? - *from;
    let part = along.y / (along.x.abs() + along.y.abs());
    match along.x >= 0.0 {
        true => Some(part.rem_euclid(4.0)),
        false => Some(2.0 - part),
    }
}

/// A field less a number, where nothing is compiled.
pub(in crate::polygonize) struct Shifted<'a> {
    pub(in crate::polygonize) field: &'a dyn Field,
    pub(in crate::polygonize) iso: f64,
}

impl Shifted<'_> {
    fn shift(&self, values: &mut [f64]) {
        values.iter_mut().for_each(|value| *value -= self.iso);
    }
}

impl Field for Shifted<'_> {
    fn dimension(&self) -> usize {
        self.field.dimension()
    }

    fn parameters(&self) -> &[f64] {
        self.field.parameters()
    }

    fn values(&self, points: &[&[f64]], values: &mut [f64]) {
        self.field.values(points, values);
        self.shift(values);
    }

    fn gradients(&self, points: &[&[f64]], values: &mut [f64], gradients: &mut [&mut [f64]]) {
        self.field.gradients(points, values, gradients);
        self.shift(values);
    }

    fn parameter_gradients(
        &self,
        points: &[&[f64]],
        values: &mut [f64],
        gradients: &mut [&mut [f64]],
        parameter_gradients: &mut [&mut [f64]],
    ) {
        self.field
            .parameter_gradients(points, values, gradients, parameter_gradients);
        self.shift(values);
    }
}
