//! Control points: the surface goes where it is pulled.
//!
//! [`follow`] is equations 7 and 8 of Witkin and Heckbert: the q̇ nearest to a desired one with which
//! the surface keeps up with points that move. [`advance`] makes a step of it. The linear equations
//! predict the new q; then Newton corrections, which are the same equations for points that have
//! arrived, put the surface on the points to rounding, where feedback alone leaves it behind. Steps for
//! which F is not nearly linear are cut.

use std::sync::Arc;

use glam::DVec3;

use super::MotionError;
use super::fit::{FitOptions, fit};
use super::freedom::Freedom;
use super::least_change::{Change, Problem, Solver, least_change, limit_to_median};
use super::metric::Metric;
use super::rows::{Rows, length};
use crate::engine::{CompiledField, Field, Silent};

/// A constraint whose violation is more than this part of its terms has not been satisfied: four digits
/// above what the worst conditioned system that is solved leaves.
const VIOLATION: f64 = 1e-6;

/// A prediction is trusted while F differs from it by at most this part of the motions that it adds up.
const TRUST: f64 = 0.25;

/// F must not become flatter than this in a part of a step, as mean squares of |F_x| at the pins.
const FLATTEST: f64 = 0.25;

/// A fit takes the place of a step if it makes the sum of squared distances smaller by this factor.
const BETTER: f64 = 0.999;

/// The shortest part of a step that is tried, and the smallest damping of a correction.
const SHORTEST: f64 = 1.0 / 64.0;

/// How many corrections a part of a step may take. Newton's method needs two or three.
const CORRECTIONS: usize = 12;

/// A correction must lower the sum of squares to this part, or the next one is not worth its
/// evaluation: what is left then cannot be satisfied.
const PROGRESS: f64 = 0.5;

/// In sums over points no distance counts more than this times the median one, or less than one part in
/// so many.
const LARGEST_WEIGHT: f64 = 1e3;

/// A control point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pin {
    /// Where it is; components beyond the dimension do not matter.
    pub position: DVec3,
    /// How it moves, in length per time.
    pub velocity: DVec3,
}

/// How a surface follows.
#[derive(Clone, Debug)]
pub struct Control {
    /// What a small change of q is.
    pub metric: Metric,
    /// What may change.
    pub freedom: Freedom,
    /// φ, how fast a point that is off the surface comes back to it, per time. [`advance`] never takes
    /// more than the whole distance back in a step.
    pub feedback: f64,
    /// The distance |F|/|F_x| at which a point counts as on the surface.
    pub tolerance: f64,
}

impl Control {
    /// The identity as the metric, all of `count` parameters free, the paper's φ = 15, and this
    /// tolerance.
    pub fn new(count: usize, tolerance: f64) -> Control {
        Control {
            metric: Metric::identity(),
            freedom: Freedom::all(count),
            feedback: 15.0,
            tolerance,
        }
    }
}

/// What became of a control point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PinState {
    /// The surface is with it.
    Followed,
    /// Its constraint could not be satisfied together with the others.
    Missed,
    /// No free parameter moves the surface there.
    Unreachable,
    /// F or a derivative is not a number there. The others were dealt with as if it were not there.
    Undefined,
}

/// What became of a control point, and by how much.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PinReport {
    /// What became of it.
    pub state: PinState,
    /// From [`follow`] the speed at which surface and point part, length per time; from [`advance`] the
    /// distance |F|/|F_x| between them. Infinite where that is not known, or F_x vanishes and F does
    /// not.
    pub residual: f64,
}

/// A velocity of the parameters.
#[derive(Clone, Debug)]
pub struct Follow {
    /// q̇: always finite, exactly 0 for what is frozen.
    pub velocity: Vec<f64>,
    /// How it was found.
    pub solver: Solver,
    /// How many of the constraints are independent.
    pub rank: usize,
    /// A report for each pin, in order.
    pub pins: Vec<PinReport>,
    /// The places of parameters that stand at a bound and are kept from leaving their range.
    pub at_bounds: Vec<usize>,
}

/// A step of the parameters.
#[derive(Clone, Debug)]
pub struct Advance {
    /// q after the step: no NaN that was not there before, and the same bits for what is frozen.
    pub q: Vec<f64>,
    /// Where the pins are now.
    pub positions: Vec<DVec3>,
    /// [`Solver::LeastSquares`] if any system needed it.
    pub solver: Solver,
    /// How many of the last part's constraints are independent.
    pub rank: usize,
    /// How often the step was cut in two since F is not nearly linear over it.
    pub cuts: usize,
    /// How many Newton corrections were made.
    pub corrections: usize,
    /// How often F_q was evaluated at the pins.
    pub evaluations: usize,
    /// A report for each pin, in order.
    pub pins: Vec<PinReport>,
    /// The places of free parameters that stand at an end of their range.
    pub at_bounds: Vec<usize>,
}

/// Q for a surface that is drawn to a rest shape: `rate` is the part of the way per time.
pub fn toward_rest(q: &[f64], rest: &[f64], rate: f64) -> Vec<f64> {
    let velocity = |(q, rest): (&f64, &f64)| rate * (rest - q);
    q.iter().zip(rest).map(velocity).collect()
}

/// The q̇ nearest to `desired` (Q) with which the surface keeps up with the pins, F_x·ṗ + F_q·q̇ + φF =
/// 0 at each. Costs an evaluation of F_q at each of n pins, n² products of its rows and n³/3
/// operations.
///
/// # Errors
///
/// Lists whose lengths are not the number of parameters; a φ or Q that is not finite.
pub fn follow(
    field: &CompiledField,
    pins: &[Pin],
    desired: &[f64],
    control: &Control,
) -> Result<Follow, MotionError> {
    let q = field.parameters();
    check(q.len(), desired, control)?;
    let positions: Vec<DVec3> = pins.iter().map(|pin| pin.position).collect();
    let rows = Rows::evaluate(field, &positions);
    let weights = weights(&rows, field.dimension(), pins);
    let target = |(index, pin): (usize, &Pin)| {
        let motion = rows.gradients[index].dot(flat(field, pin.velocity));
        -(motion + control.feedback * rows.values[index])
    };
    let targets: Vec<f64> = pins.iter().enumerate().map(target).collect();
    let change = least_change(&Problem {
        rows: &rows.sparse,
        targets: &targets,
        weights: &weights,
        desired,
        metric: &control.metric,
        freedom: &control.freedom,
        room: &control.freedom.speeds(q),
    });
    let report = |(index, pin): (usize, &Pin)| {
        let slope = length(rows.gradients[index]);
        let left = (rows.product(index, &change.step) - targets[index]).abs();
        let sizes = slope * length(flat(field, pin.velocity))
            + (control.feedback * rows.values[index]).abs()
            + terms(&rows, index, &change);
        let state = match () {
            () if weights[index] == 0.0 => PinState::Undefined,
            () if left <= VIOLATION * sizes => PinState::Followed,
            () if !change.is_reachable[index] => PinState::Unreachable,
            () => PinState::Missed,
        };
        let residual = distance(left, slope);
        PinReport { state, residual }
    };
    let held = |&place: &usize| change.step[place] == 0.0;
    let at_bounds = control.freedom.at_bounds(q);
    Ok(Follow {
        pins: pins.iter().enumerate().map(report).collect(),
        at_bounds: at_bounds.into_iter().filter(held).collect(),
        solver: change.solver,
        rank: change.rank,
        velocity: change.step,
    })
}

/// Moves the pins by their velocities for a time, and the surface with them.
///
/// Where F is not nearly linear over the step it is made in shorter ones, down to a 64th. Pins move in
/// any case; where the surface cannot follow them q stays the best that was found, and the report says
/// which they are.
///
/// # Errors
///
/// As [`follow`]; a time or tolerance that is not finite or is negative.
pub fn advance(
    field: &CompiledField,
    pins: &[Pin],
    desired: &[f64],
    control: &Control,
    time: f64,
) -> Result<Advance, MotionError> {
    check(field.parameters().len(), desired, control)?;
    for (what, found) in [("the time", time), ("the tolerance", control.tolerance)] {
        if !(found >= 0.0 && found.is_finite()) {
            return Err(MotionError::Number { what, found });
        }
    }
    let mut walk = Walk::new(field, pins, control);
    walk.go(desired, time);
    walk.fit();
    Ok(walk.report())
}

/// Checks what the caller gave.
fn check(count: usize, desired: &[f64], control: &Control) -> Result<(), MotionError> {
    if desired.len() != count {
        return Err(MotionError::Length {
            what: "the desired velocity",
            found: desired.len(),
            expected: count,
        });
    }
    control.metric.check(count)?;
    control.freedom.check(count)?;
    let numbers = desired.iter().map(|&speed| ("a desired velocity", speed));
    for (what, found) in numbers.chain([("the feedback", control.feedback)]) {
        if !found.is_finite() {
            return Err(MotionError::Number { what, found });
        }
    }
    Ok(())
}

/// A vector without the components that the field does not have.
fn flat(field: &CompiledField, mut vector: DVec3) -> DVec3 {
    for axis in field.dimension()..3 {
        vector[axis] = 0.0;
    }
    vector
}

/// Σ |F_q_k d_k|: how much the step moves F before its parts cancel.
fn terms(rows: &Rows, index: usize, change: &Change) -> f64 {
    let (places, entries) = rows.row(index);
    let term = |(&place, entry): (&u32, &f64)| (entry * change.step[place as usize]).abs();
    places.iter().zip(entries).map(term).sum()
}

/// |F|/|F_x|: 0 where F is, infinite where something is undefined.
fn distance(value: f64, slope: f64) -> f64 {
    match value == 0.0 {
        true => 0.0,
        false => Some(value.abs() / slope)
            .filter(|d| !d.is_nan())
            .unwrap_or(f64::INFINITY),
    }
}

/// 1/|F_x|, which makes distances of values of F, within limits; 0 where something is undefined or a
/// pin is not finite.
fn weights(rows: &Rows, dimension: usize, pins: &[Pin]) -> Vec<f64> {
    let usable: Vec<usize> = (0..rows.count())
        .filter(|&index| {
            let velocity = pins[index].velocity;
            rows.is_defined(index) && (0..dimension).all(|axis| velocity[axis].is_finite())
        })
        .collect();
    let slopes = usable.iter().map(|&index| length(rows.gradients[index]));
    let mut inverses: Vec<f64> = slopes.map(|slope| (1.0 / slope).min(f64::MAX)).collect();
    limit_to_median(&mut inverses, LARGEST_WEIGHT);
    let mut weights = vec![0.0; rows.count()];
    for (index, inverse) in usable.into_iter().zip(inverses) {
        weights[index] = inverse;
    }
    weights
}

/// A step while it is made.
struct Walk<'a> {
    field: &'a CompiledField,
    pins: Vec<Pin>,
    control: &'a Control,
    q: Vec<f64>,
    rows: Rows,
    is_reachable: Vec<bool>,
    solver: Solver,
    rank: usize,
    cuts: usize,
    corrections: usize,
    evaluations: usize,
}

impl Walk<'_> {
    fn new<'a>(field: &'a CompiledField, pins: &[Pin], control: &'a Control) -> Walk<'a> {
        let positions: Vec<DVec3> = pins.iter().map(|pin| pin.position).collect();
        Walk {
            field,
            pins: pins.to_vec(),
            control,
            q: field.parameters().to_vec(),
            rows: Rows::evaluate(field, &positions),
            is_reachable: vec![false; pins.len()],
            solver: Solver::Cholesky,
            rank: 0,
            cuts: 0,
            corrections: 0,
            evaluations: 1,
        }
    }

    /// The whole step, in as many parts as it takes.
    fn go(&mut self, desired: &[f64], time: f64) {
        let mut left = 1.0;
        let mut part: f64 = 1.0;
        while left > 0.0 {
            part = part.min(left);
            match self.predict(desired, part * time) {
                Some((q, rows)) => {
                    self.q = q;
                    self.rows = rows;
                }
                None if part > SHORTEST => {
                    part *= 0.5;
                    self.cuts += 1;
                    continue;
                }
                // The surface waits where it is, for the corrections to take it along.
                None => self.rows = self.evaluate(&self.q.clone(), part * time),
            }
            self.arrive(part * time);
            self.correct();
            left -= part;
            part *= 2.0;
        }
    }

    /// F and its derivatives for another q, with the pins where they are after this time.
    fn evaluate(&mut self, q: &[f64], time: f64) -> Rows {
        self.evaluations += 1;
        self.evaluated(q, time)
    }

    /// The same without counting it.
    fn evaluated(&self, q: &[f64], time: f64) -> Rows {
        let field = CompiledField::new(Arc::clone(self.field.program()), q.to_vec());
        let positions: Vec<DVec3> = self.pins.iter().map(|pin| pin.at(time)).collect();
        Rows::evaluate(&field, &positions)
    }

    /// Puts the pins where they are after this time.
    fn arrive(&mut self, time: f64) {
        for pin in &mut self.pins {
            pin.position = pin.at(time);
        }
    }

    /// The mean of |F_x|² at the pins, weighed, for other rows in units of that for the present ones; 1 where
    /// there is nothing to be compared. A surface that is drawn to its pins must not get there by F flattening
    /// out everywhere.
    fn steepness(&self, rows: &Rows, weights: &[f64]) -> f64 {
        let mean = |rows: &Rows| {
            let slopes = rows.gradients.iter().zip(weights);
            let squares = slopes.filter(|(_, weight)| **weight > 0.0);
            let squares = squares
                .map(|(slope, weight)| (weight * length(*slope)) * (weight * length(*slope)));
            squares.sum::<f64>()
        };
        let (before, after) = (mean(&self.rows), mean(rows));
        if before > 0.0 && before.is_finite() {
            after / before
        } else {
            1.0
        }
    }

    /// The least change of q for these values of aᵢ · d.
    fn solve(&mut self, targets: &[f64], weights: &[f64], desired: &[f64]) -> Change {
        let change = least_change(&Problem {
            rows: &self.rows.sparse,
            targets,
            weights,
            desired,
            metric: &self.control.metric,
            freedom: &self.control.freedom,
            room: &self.control.freedom.room(&self.q),
        });
        if change.solver == Solver::LeastSquares {
            self.solver = Solver::LeastSquares;
        }
        self.rank = change.rank;
        self.is_reachable.clone_from(&change.is_reachable);
        change
    }

    /// The linear equations' q after this time and the field there; none if F is too far from what they
    /// predict.
    fn predict(&mut self, desired: &[f64], time: f64) -> Option<(Vec<f64>, Rows)> {
        let feedback = (self.control.feedback * time).min(1.0);
        let count = self.pins.len();
        let weights = weights(&self.rows, self.field.dimension(), &self.pins);
        let motion = |index: usize| flat(self.field, self.pins[index].velocity) * time;
        let targets: Vec<f64> = (0..count)
            .map(|index| {
                let slope = self.rows.gradients[index];
                -(slope.dot(motion(index)) + feedback * self.rows.values[index])
            })
            .collect();
        let lengths: Vec<f64> = (0..count).map(|index| length(motion(index))).collect();
        let desired: Vec<f64> = desired.iter().map(|speed| speed * time).collect();
        let change = self.solve(&targets, &weights, &desired);
        let q = self.control.freedom.moved(&self.q, &change.step);
        // A huge desired velocity may lead out of the numbers where no pin sees it.
        let stays_finite = |(new, old): (&f64, &f64)| new.is_finite() || !old.is_finite();
        if !q.iter().zip(&self.q).all(stays_finite) {
            return None;
        }
        let rows = self.evaluate(&q, time);
        let is_trusted = |index: usize| {
            if weights[index] == 0.0 {
                return true;
            }
            let value = self.rows.values[index];
            let slope = length(self.rows.gradients[index]);
            let expected =
                value * (1.0 - feedback) + self.rows.product(index, &change.step) - targets[index];
            let error = (rows.values[index] - expected).abs();
            let scale = value.abs() + slope * lengths[index] + terms(&self.rows, index, &change);
            rows.is_defined(index) && error <= TRUST * scale + self.control.tolerance * slope
        };
        let stays_steep = self.steepness(&rows, &weights) >= FLATTEST;
        ((0..count).all(is_trusted) && stays_steep).then_some((q, rows))
    }

    /// Newton's method for F = 0 at the pins, by least changes of q, until all pins are within the
    /// tolerance or nothing is gained any more.
    fn correct(&mut self) {
        let desired = vec![0.0; self.q.len()];
        for _ in 0..CORRECTIONS {
            let weights = weights(&self.rows, self.field.dimension(), &self.pins);
            let squares = |rows: &Rows| {
                let square = |(value, weight): (&f64, &f64)| match *weight == 0.0 {
                    true => 0.0,
                    false => (value * weight) * (value * weight),
                };
                rows.values.iter().zip(&weights).map(square).sum::<f64>()
            };
            let is_on = |index: usize| {
                let slope = length(self.rows.gradients[index]);
                distance(self.rows.values[index], slope) <= self.control.tolerance
            };
            if (0..self.pins.len()).all(|index| weights[index] == 0.0 || is_on(index)) {
                return;
            }
            let targets: Vec<f64> = self.rows.values.iter().map(|value| -value).collect();
            let change = self.solve(&targets, &weights, &desired);
            let before = squares(&self.rows);
            let mut predicted = self.rows.clone();
            for (index, value) in predicted.values.iter_mut().enumerate() {
                *value += self.rows.product(index, &change.step);
            }
            // Also ends where there is a NaN.
            if squares(&predicted) >= PROGRESS * before {
                return;
            }
            // In units of how steep F is: it is no gain if F becomes smaller everywhere.
            let is_better = |rows: &Rows| squares(rows) < before * self.steepness(rows, &weights);
            let Some((q, rows)) = self.damped(&change.step, is_better) else {
                return;
            };
            let after = squares(&rows);
            (self.q, self.rows) = (q, rows);
            self.corrections += 1;
            self.evaluations += 1;
            if after > PROGRESS * before {
                return;
            }
        }
    }

    /// The longest of the step, its half, and so on, at which the field is as wanted and defined where
    /// it was.
    fn damped(&self, step: &[f64], is_better: impl Fn(&Rows) -> bool) -> Option<(Vec<f64>, Rows)> {
        let mut damping = 1.0;
        while damping >= SHORTEST {
            let step: Vec<f64> = step.iter().map(|step| damping * step).collect();
            let q = self.control.freedom.moved(&self.q, &step);
            let rows = self.evaluated(&q, 0.0);
            let stays_defined = |index| rows.is_defined(index) || !self.rows.is_defined(index);
            if (0..rows.count()).all(stays_defined) && is_better(&rows) {
                return Some((q, rows));
            }
            damping *= 0.5;
        }
        None
    }

    /// Where the surface is not with all pins, it may be because least changes led to where it cannot be, or
    /// because the pins ask for too much: then a fit from the q of the beginning takes the place of what was
    /// found, if it is nearer to them.
    fn fit(&mut self) {
        let squares = |rows: &Rows| -> f64 {
            let distances = (0..rows.count())
                .filter(|&index| rows.is_defined(index))
                .map(|index| distance(rows.values[index], length(rows.gradients[index])));
            distances.map(|distance| distance * distance).sum()
        };
        let enough = self.pins.len() as f64 * self.control.tolerance * self.control.tolerance;
        let before = squares(&self.rows);
        if before <= enough {
            return;
        }
        let positions: Vec<DVec3> = self.pins.iter().map(|pin| pin.position).collect();
        let options = FitOptions::default();
        let Ok(found) = fit(
            self.field,
            &positions,
            &self.control.freedom,
            &options,
            &Silent,
        ) else {
            return;
        };
        let rows = self.evaluate(&found.q, 0.0);
        if squares(&rows) < BETTER * before {
            (self.q, self.rows) = (found.q, rows);
            self.solver = Solver::LeastSquares;
            self.rank = found.rank;
        }
    }

    /// What became of it.
    fn report(self) -> Advance {
        let weights = weights(&self.rows, self.field.dimension(), &self.pins);
        let report = |index: usize| {
            let slope = length(self.rows.gradients[index]);
            let residual = distance(self.rows.values[index], slope);
            let state = match () {
                () if weights[index] == 0.0 => PinState::Undefined,
                () if residual <= self.control.tolerance => PinState::Followed,
                () if !self.is_reachable[index] => PinState::Unreachable,
                () => PinState::Missed,
            };
            PinReport { state, residual }
        };
        Advance {
            pins: (0..self.pins.len()).map(report).collect(),
            at_bounds: self.control.freedom.at_bounds(&self.q),
            positions: self.pins.iter().map(|pin| pin.position).collect(),
            q: self.q,
            solver: self.solver,
            rank: self.rank,
            cuts: self.cuts,
            corrections: self.corrections,
            evaluations: self.evaluations,
        }
    }
}

impl Pin {
    /// Where it is after this time. One whose velocity is not finite stays.
    fn at(&self, time: f64) -> DVec3 {
        match self.velocity.is_finite() {
            true => self.position + self.velocity * time,
            false => self.position,
        }
    }
}
