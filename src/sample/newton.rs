//! Newton's polish: points that are close to the surface are put on it.
//!
//! The step is x ← x - λ h ∇h / |∇h|², the shortest way to where the linear part of h vanishes,
//! and at regular points that is all there is: convergence is quadratic. The rest is for the
//! others, which real models have (the tip of a heart, the crease of a difference):
//!
//! * A step that does not lower |h| enough is rejected (Armijo's rule, as in Nocedal and Wright,
//!   "Numerical Optimization", section 3.1) and λ is halved.
//! * If such a step has overshot, h has changed sign on the way, and the zero between is found by
//!   bisection.
//! * If not, the gradient has turned on the way: the step crossed a narrow valley of |h|, or a
//!   crease. Then ∇h in the formula is replaced by the shortest vector between it and the gradient
//!   at the rejected place, which points along the valley. (The idea is that of gradient sampling:
//!   Burke, Lewis and Overton, "A robust gradient sampling algorithm for nonsmooth, nonconvex
//!   optimization", SIAM Journal on Optimization 15, 2005.)

use glam::DVec3;

use super::evaluation::{Batch, Evaluation};
use crate::engine::Field;
use crate::geometry::length;

/// The largest number of evaluations per point. A regular point needs three or four. A zero of
/// multiplicity m needs log(accuracy) / log(1 - 1/m), about 75 for m = 7 from 1e-4 to 1e-9, and
/// the way along the valley to a cusp takes some hundreds.
const EVALUATION_LIMIT: u32 = 500;

/// A step shorter than this part of Newton's is no progress worth having.
const SMALLEST_DAMPING: f64 = 1e-6;

/// The part of the predicted decrease of |h| that a step must achieve. A zero of any
/// multiplicity gives 1 - 1/e at the least; the border of a square root's domain, or a place
/// where the gradient blows up, gives next to nothing.
const SUFFICIENT_DECREASE: f64 = 0.25;

/// Residuals of this size, relative to the coordinates, are rounding: no decrease can be asked
/// for there.
const ROUNDING: f64 = 1e-14;

/// The tolerance decides which points are kept, not how exact they are: so many more steps are
/// taken while each halves the residual at least. One or two of Newton's lead to rounding, at this
/// part of the coordinates.
const REFINEMENTS: u32 = 3;
const FLOOR: f64 = 1e-16;

/// What is asked of the polish.
#[derive(Clone, Copy, Debug)]
pub(super) struct Polish {
    /// The largest |h| / |∇h| accepted.
    pub(super) tolerance: f64,
    /// How far a point may move from where it was.
    pub(super) leash: f64,
    /// The unit of length: the diagonal of the box.
    pub(super) diagonal: f64,
}

/// A point with the field there, polished or to be polished.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) position: DVec3,
    pub(super) here: Evaluation,
}

/// A point on its way.
struct Walker {
    /// Its place in the list of points.
    place: usize,
    origin: Point,
    point: Point,
    /// A place where h has the other sign and is larger, once a step has overshot.
    beyond: Option<DVec3>,
    /// The direction of the step: ∇h, or what trials have made of it.
    slope: DVec3,
    /// λ
    damping: f64,
    /// Steps since the point was within the tolerance.
    refined: u32,
}

/// Moves each point onto the surface. The answer has one entry per point, `None` for those that
/// did not get within the tolerance; it comes with the number of evaluations.
///
/// A small residual alone is not believed, because |h| / |∇h| is small too where the gradient
/// is infinite (at a pole, at the border of a square root's domain): the polish must also have
/// lowered |h|.
pub(super) fn polish(
    field: &dyn Field,
    wanted: &Polish,
    points: impl Iterator<Item = Point>,
) -> (Vec<Option<Point>>, u64) {
    run(field, wanted, points, 0)
}

/// The same for points that are to stay where they are put: each goes on to the limit of rounding.
pub(super) fn polish_to_rounding(
    field: &dyn Field,
    wanted: &Polish,
    points: impl Iterator<Item = Point>,
) -> (Vec<Option<Point>>, u64) {
    run(field, wanted, points, REFINEMENTS)
}

fn run(
    field: &dyn Field,
    wanted: &Polish,
    points: impl Iterator<Item = Point>,
    refinements: u32,
) -> (Vec<Option<Point>>, u64) {
    let mut walkers: Vec<Walker> = points.enumerate().map(Walker::new).collect();
    let mut polished = vec![None; walkers.len()];
    let mut batch = Batch::default();
    let mut evaluations = 0;
    for _ in 0..EVALUATION_LIMIT {
        walkers.retain_mut(|walker| {
            let best = &mut polished[walker.place];
            let goes_on = if walker.has_arrived(wanted) {
                walker.refine(wanted, best, refinements)
            } else {
                best.is_none()
            };
            goes_on && walker.can_go_on(wanted)
        });
        if walkers.is_empty() {
            break;
        }
        evaluations += walkers.len() as u64;
        let trials: Vec<DVec3> = walkers.iter().map(Walker::trial).collect();
        let there = batch.evaluate(field, trials.iter().copied());
        for ((walker, &position), here) in walkers.iter_mut().zip(&trials).zip(there) {
            walker.advance(Point { position, here });
        }
    }
    (polished, evaluations)
}

impl Walker {
    fn new((place, point): (usize, Point)) -> Self {
        Walker {
            place,
            origin: point,
            point,
            beyond: None,
            slope: point.here.gradient,
            damping: 1.0,
            refined: 0,
        }
    }

    fn has_arrived(&self, wanted: &Polish) -> bool {
        let residual = self.point.here.distance();
        let scale = wanted.diagonal + self.point.position.abs().max_element();
        let lowered = self.point.level() <= (1.0 - SUFFICIENT_DECREASE) * self.origin.level();
        let near = self.point.position.distance(self.origin.position) <= wanted.leash;
        residual <= wanted.tolerance && near && (lowered || residual <= ROUNDING * scale)
    }

    /// Keeps a point within the tolerance if it is better than the best one so far by half; then
    /// it may become better still.
    fn refine(&mut self, wanted: &Polish, best: &mut Option<Point>, refinements: u32) -> bool {
        let residual = self.point.here.distance();
        let known = best.map_or(f64::INFINITY, |best| best.here.distance());
        let improves = residual <= 0.5 * known;
        if improves {
            *best = Some(self.point);
        }
        self.refined += 1;
        let scale = wanted.diagonal + self.point.position.abs().max_element();
        improves && self.refined <= refinements && residual > FLOOR * scale
    }

    fn can_go_on(&self, wanted: &Polish) -> bool {
        self.damping >= SMALLEST_DAMPING
            && (self.beyond.is_some() || self.slope != DVec3::ZERO)
            && self.point.position.distance(self.origin.position) <= wanted.leash
    }

    /// Where to try next: the middle of the bracket, or Newton's step.
    fn trial(&self) -> DVec3 {
        match self.beyond {
            Some(beyond) => self.point.position.midpoint(beyond),
            None => {
                let slope = length(self.slope);
                let step = self.damping * -self.point.here.value / slope;
                self.point.position + step * (self.slope / slope)
            }
        }
    }

    fn advance(&mut self, trial: Point) {
        let decrease = 1.0 - SUFFICIENT_DECREASE * self.damping;
        let overshot = self.point.here.value.signum() != trial.here.value.signum();
        if !trial.here.is_defined() {
            self.damping /= 2.0;
        } else if self.beyond.is_some()
            || (overshot && trial.level() > decrease * self.point.level())
        {
            self.bracket(trial, overshot);
        } else if trial.level() <= decrease * self.point.level() {
            self.point = trial;
            self.slope = if self.damping < 1.0 {
                shortest_between(self.slope, trial.here.gradient)
            } else {
                trial.here.gradient
            };
            self.damping = 1.0;
        } else {
            self.slope = shortest_between(self.slope, trial.here.gradient);
            self.damping /= 2.0;
        }
    }

    /// Narrows the bracket by the trial, so that the end with the smaller |h| is the point.
    fn bracket(&mut self, trial: Point, overshot: bool) {
        if trial.level() <= self.point.level() {
            if overshot {
                self.beyond = Some(self.point.position);
            }
            self.point = trial;
        } else if overshot {
            self.beyond = Some(trial.position);
        } else {
            // |h| is not monotonous between the ends: the zero lies beyond the trial.
            self.point = trial;
        }
    }
}

/// The shortest vector on the straight line between the ends of two vectors, the ends included.
fn shortest_between(one: DVec3, other: DVec3) -> DVec3 {
    let difference = other - one;
    let span = length(difference);
    if span == 0.0 {
        return one;
    }
    let direction = difference / span;
    let along = (-one.dot(direction)).clamp(0.0, span);
    one + along * direction
}

impl Point {
    /// |h|
    fn level(&self) -> f64 {
        self.here.value.abs()
    }
}
