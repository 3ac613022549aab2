//! Fitting: the parameters with which a zero set passes through given points, or as near as it can.
//!
//! What is made small is the sum of the squares of the first-order distances r = F/|F_x|, not of F
//! itself: F can be made small everywhere without bringing the surface to any point, by blobs that
//! flatten out or a factor that goes to 0, and it weighs points by how steep F happens to be there. The
//! slopes |F_x| are taken to be fixed during an iteration and are renewed after it (iteratively
//! reweighted least squares; Sampson, "Fitting conic sections to 'very scattered' data", 1982). Where
//! points can't all be met the result is therefore where Σ F F_q/|F_x|² vanishes, which differs from
//! the least distances by terms of the second order in the residuals.
//!
//! Each iteration is one of Levenberg and Marquardt, with unknowns scaled by the columns of the
//! Jacobian and the damping of Nielsen ("Damping parameter in Marquardt's method", 1999; Madsen,
//! Nielsen and Tingleff, "Methods for non-linear least squares problems", algorithm 3.16). Damped steps
//! are the shortest ones in these units where parameters are not determined: what moves nothing does
//! not move.
//!
//! A step counts by Σ r² with the old slopes, divided by how much their mean has changed: so nothing is
//! gained by making F smaller as a whole. Where that is what the equations propose (F has a factor
//! among its parameters), the derivative of the mean slope is made a part of them.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::MotionError;
use super::dense::{Cholesky, undetermined};
use super::freedom::Freedom;
use super::normal::Normal;
use super::rows::{Rows, length, values_and_gradients};
use crate::engine::{CompiledField, Field, Monitor};

/// The damping at first, relative to a diagonal of ones.
const FIRST_DAMPING: f64 = 1e-3;

/// With more damping steps are below rounding.
const LARGEST_DAMPING: f64 = 1e16;

/// The least part of the predicted gain that a step must achieve.
const SUFFICIENT_GAIN: f64 = 1e-3;

/// If less than this part of a gain is left when the change of the mean slope is taken off, the
/// equations have to know of that change.
const OWN_GAIN: f64 = 0.75;

/// Where no column of the Jacobian makes a larger cosine with the residuals, they cannot be made
/// smaller.
const ORTHOGONAL: f64 = 1e-10;

/// The same where no step is found: not as sharp, for rounding in F may be what hinders.
const NEARLY_ORTHOGONAL: f64 = 1e-5;

/// A gain of less than this part of the sum of squares is rounding.
const LEAST_GAIN: f64 = 1e-15;

/// A squared singular value of the scaled Jacobian that is smaller has no digits: about m·ε for m
/// parameters, 3e-13 for 1,200.
const RANK_THRESHOLD: f64 = 1e-11;

/// Derivatives that are so small against others, and against the extent of the points, are rounding
/// errors.
const NO_EFFECT: f64 = 1e-10;

/// At so many points the change of the mean slope is measured.
const SLOPE_POINTS: usize = 64;

/// Differences for that are taken over changes that move the surface by this part of the points'
/// extent.
const DIFFERENCE: f64 = 1e-6;

/// What is asked of a fit.
#[derive(Clone, Copy, Debug)]
pub struct FitOptions {
    /// The fit is done when no point is farther from the surface than this part of the diagonal of the
    /// points' box.
    pub tolerance: f64,
    /// The largest number of iterations.
    pub iterations: usize,
}

impl Default for FitOptions {
    fn default() -> Self {
        FitOptions {
            tolerance: 1e-13,
            iterations: 200,
        }
    }
}

/// Why a fit ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// All points are on the surface, to the tolerance.
    OnSurface,
    /// The points cannot be met better: no parameter lowers the sum of squares, to the first order.
    Stationary,
    /// No step is found that lowers the sum of squares, though its derivative does not vanish.
    Stalled,
    /// The largest number of iterations has been made.
    Iterations,
    /// The monitor said so.
    Cancelled,
    /// F_x vanishes at all points: there is no surface to be drawn to them.
    Flat,
    /// There is no point at which F and its derivatives are defined.
    Undefined,
    /// There is no parameter that may change.
    Frozen,
}

/// A fitted q, and how good it is.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The parameters; what is frozen has the same bits as before.
    pub q: Vec<f64>,
    /// Why the fit ended.
    pub end: End,
    /// How many systems were set up.
    pub iterations: usize,
    /// At how many points F and F_x, or F_q too, have been evaluated in all.
    pub evaluations: u64,
    /// The square root of the mean of the squared distances |F|/|F_x|, none counted as more than the
    /// diagonal of the points' box; 0 without points.
    pub rms: f64,
    /// The largest distance, in the same sense.
    pub max: f64,
    /// The number of points at which F or a derivative was not a number at the start; the fit is
    /// without them.
    pub undefined: usize,
    /// How many directions of q the points determine, to the first order.
    pub rank: usize,
    /// The places of free parameters that some change of q moves which does not move the surface at the
    /// points.
    pub undetermined: Vec<usize>,
    /// The places of free parameters that stand at an end of their range.
    pub at_bounds: Vec<usize>,
}

impl Fit {
    /// Whether q is a solution: the points are met, or as nearly as they can be from nearby.
    pub fn converged(&self) -> bool {
        matches!(self.end, End::OnSurface | End::Stationary)
    }
}

/// Changes q until F vanishes at the points, or nearly so, starting at the field's own.
///
/// Per iteration F_q is evaluated at n points, and the normal equations of m parameters cost the sum of
/// the squared numbers of parameters that each point feels, and m³/3 operations. Parallel, with the
/// same bits for any number of threads.
///
/// # Errors
///
/// A freedom for another number of parameters; a tolerance that is negative or NaN.
pub fn fit(
    field: &CompiledField,
    points: &[DVec3],
    freedom: &Freedom,
    options: &FitOptions,
    monitor: &dyn Monitor,
) -> Result<Fit, MotionError> {
    freedom.check(field.parameters().len())?;
    if options.tolerance.is_nan() || options.tolerance < 0.0 {
        return Err(MotionError::Number {
            what: "the tolerance",
            found: options.tolerance,
        });
    }
    let mut search = Search::new(field, points, freedom);
    let end = search.run(options, monitor);
    Ok(search.report(end, points.len()))
}

/// A fit while it is made.
struct Search<'a> {
    field: &'a CompiledField,
    freedom: &'a Freedom,
    /// Those at which the field was defined at first.
    points: Vec<DVec3>,
    /// The diagonal of their box.
    extent: f64,
    /// The parameters that are not frozen.
    free: Vec<usize>,
    q: Vec<f64>,
    /// The field at the points.
    rows: Rows,
    /// What makes distances of values of F.
    weights: Vec<f64>,
    damping: f64,
    /// What the damping grows by when a step fails.
    growth: f64,
    /// Whether the derivative of the mean slope is a part of the equations.
    is_normalised: bool,
    iterations: usize,
    evaluations: u64,
}

/// What became of a proposed step.
enum Step {
    Taken,
    /// The equations have to be set up otherwise.
    Again,
    None(End),
}

impl Search<'_> {
    fn new<'a>(field: &'a CompiledField, points: &[DVec3], freedom: &'a Freedom) -> Search<'a> {
        let all = Rows::evaluate(field, points);
        let dimension = field.dimension();
        let is_usable = |&index: &usize| {
            all.is_defined(index) && (0..dimension).all(|axis| points[index][axis].is_finite())
        };
        let usable: Vec<usize> = (0..points.len()).filter(is_usable).collect();
        let points: Vec<DVec3> = usable.iter().map(|&index| points[index]).collect();
        let rows = match usable.len() == all.count() {
            true => all,
            false => Rows::evaluate(field, &points),
        };
        let count = field.parameters().len();
        let mut search = Search {
            field,
            freedom,
            extent: extent(&points, dimension),
            free: (0..count)
                .filter(|&place| !freedom.is_frozen(place))
                .collect(),
            q: field.parameters().to_vec(),
            evaluations: rows.count() as u64,
            points,
            rows,
            weights: Vec::new(),
            damping: FIRST_DAMPING,
            growth: 2.0,
            is_normalised: false,
            iterations: 0,
        };
        search.weights = search.weights();
        search
    }

    /// Iterates until there is a reason to end.
    fn run(&mut self, options: &FitOptions, monitor: &dyn Monitor) -> End {
        if self.points.is_empty() {
            return End::Undefined;
        }
        loop {
            // Before all else: where F vanishes in a whole neighbourhood no point is on a surface.
            let gradients = &self.rows.gradients;
            if gradients.iter().all(|&gradient| gradient == DVec3::ZERO) {
                return End::Flat;
            }
            let near = options.tolerance * self.extent;
            if self.distances().iter().all(|&distance| distance <= near) {
                return End::OnSurface;
            }
            match () {
                () if self.free.is_empty() => return End::Frozen,
                () if self.iterations >= options.iterations => return End::Iterations,
                () if monitor.cancelled() => return End::Cancelled,
                () => (),
            }
            monitor.progress(
                "fitting",
                self.iterations as f64 / options.iterations as f64,
            );
            self.iterations += 1;
            let normal = self.equations();
            if cosine(&normal) <= ORTHOGONAL {
                return End::Stationary;
            }
            if let Step::None(end) = self.step(&normal, monitor) {
                return end;
            }
        }
    }

    /// The equations at the present q, without parameters that are held at a bound.
    fn equations(&self) -> Normal {
        let mut normal = Normal::new(&self.rows, &self.weights, &self.free, self.q.len());
        if self.is_normalised {
            normal.normalise(&self.mean_slope(&normal));
        }
        for (unknown, &place) in self.free.iter().enumerate() {
            let [low, high] = self.freedom.range(place);
            let slope = normal.slope[unknown];
            let leads_out =
                (self.q[place] <= low && slope > 0.0) || (self.q[place] >= high && slope < 0.0);
            if leads_out {
                normal.hold(unknown);
            }
        }
        normal
    }

    /// Damps more and more until a step lowers the sum of squares.
    fn step(&mut self, normal: &Normal, monitor: &dyn Monitor) -> Step {
        while self.damping <= LARGEST_DAMPING {
            if monitor.cancelled() {
                return Step::None(End::Cancelled);
            }
            let Some(factor) = Cholesky::new(normal.damped(self.damping)) else {
                self.damp();
                continue;
            };
            let q = self.proposal(normal, &factor.solve(&normal.slope));
            let unknowns: Vec<f64> = self
                .free
                .iter()
                .zip(&normal.scales)
                .map(|(&place, scale)| (q[place] - self.q[place]) * scale)
                .collect();
            let predicted = normal.reduction(&unknowns);
            if predicted <= LEAST_GAIN * normal.squares {
                // A long step may be worth nothing because a range cuts it, and a shorter one much.
                self.damp();
                continue;
            }
            let (same, normalised) = self.sums(&q);
            let gain = |sum: f64| 0.5 * (normal.squares - sum) / predicted;
            if !self.is_normalised
                && gain(same) > SUFFICIENT_GAIN
                && gain(normalised) < OWN_GAIN * gain(same)
            {
                self.is_normalised = true;
                return Step::Again;
            }
            if gain(normalised) > SUFFICIENT_GAIN {
                let cube = 2.0 * gain(normalised) - 1.0;
                self.damping *= (1.0 - cube * cube * cube).max(1.0 / 3.0);
                self.growth = 2.0;
                self.move_to(q);
                return Step::Taken;
            }
            self.damp();
        }
        let is_least = cosine(normal) <= NEARLY_ORTHOGONAL;
        let end = if is_least {
            End::Stationary
        } else {
            End::Stalled
        };
        Step::None(end)
    }

    /// More damping, by more each time.
    fn damp(&mut self) {
        self.damping *= self.growth;
        self.growth *= 2.0;
    }

    /// q after a step against these unknowns.
    fn proposal(&self, normal: &Normal, unknowns: &[f64]) -> Vec<f64> {
        let mut step = vec![0.0; self.q.len()];
        for ((&place, unknown), &scale) in self.free.iter().zip(unknowns).zip(&normal.scales) {
            if scale > 0.0 {
                step[place] = -unknown / scale;
            }
        }
        self.freedom.moved(&self.q, &step)
    }

    /// Σ r² for another q with the present slopes, and the same in units of how much their mean
    /// changes. NaN where F is not defined at all points or is flat.
    fn sums(&mut self, q: &[f64]) -> (f64, f64) {
        self.evaluations += self.points.len() as u64;
        let (values, gradients) = values_and_gradients(&self.field_at(q), &self.points);
        let (mut sum, mut before, mut after) = (0.0, 0.0, 0.0);
        for (index, weight) in self.weights.iter().enumerate() {
            let square = |number: f64| (weight * number) * (weight * number);
            sum += square(values[index]);
            before += square(length(self.rows.gradients[index]));
            after += square(length(gradients[index]));
        }
        (sum, sum * before / after)
    }

    fn field_at(&self, q: &[f64]) -> CompiledField {
        CompiledField::new(Arc::clone(self.field.program()), q.to_vec())
    }

    fn move_to(&mut self, q: Vec<f64>) {
        self.evaluations += self.points.len() as u64;
        self.rows = Rows::evaluate(&self.field_at(&q), &self.points);
        self.q = q;
        self.weights = self.weights();
    }

    /// 1/|F_x| for each point, less where that makes the distance larger than the points' extent: how
    /// far it is then the slope does not tell. 0 where F and F_x are both 0.
    fn weights(&self) -> Vec<f64> {
        let weight = |(gradient, value): (&DVec3, &f64)| {
            let weight = 1.0 / length(*gradient).max(value.abs() / self.extent);
            if weight.is_finite() { weight } else { 0.0 }
        };
        let values = self.rows.gradients.iter().zip(&self.rows.values);
        values.map(weight).collect()
    }

    /// |F|/|F_x| at each point, at most the points' extent.
    fn distances(&self) -> Vec<f64> {
        let distance = |(gradient, value): (&DVec3, &f64)| match *value == 0.0 {
            true => 0.0,
            false => (value.abs() / length(*gradient)).min(self.extent),
        };
        let values = self.rows.gradients.iter().zip(&self.rows.values);
        values.map(distance).collect()
    }

    /// The derivative of the logarithm of the mean slope, the root of Σ (w|F_x|)², by each free
    /// parameter: by differences, at a part of the points. One evaluation of F_x for each parameter.
    fn mean_slope(&self, normal: &Normal) -> Vec<f64> {
        let stride = self.points.len().div_ceil(SLOPE_POINTS);
        let chosen: Vec<usize> = (0..self.points.len()).step_by(stride).collect();
        let points: Vec<DVec3> = chosen.iter().map(|&index| self.points[index]).collect();
        let mean = |q: &[f64]| {
            let (_, gradients) = values_and_gradients(&self.field_at(q), &points);
            let slopes = gradients.iter().zip(&chosen);
            let slopes = slopes.map(|(gradient, &index)| self.weights[index] * length(*gradient));
            slopes.map(|slope| slope * slope).sum::<f64>().sqrt()
        };
        let here = mean(&self.q);
        let root = (self.points.len() as f64).sqrt();
        let derivative = |(&place, &scale): (&usize, &f64)| {
            if scale == 0.0 {
                return 0.0;
            }
            let mut q = self.q.clone();
            // In between for parameters whose effect at the points is as good as none, like that of a
            // factor of F.
            let own = q[place].abs();
            let most = if own > 0.0 { 1e-3 * own } else { f64::MAX };
            let step = (DIFFERENCE * self.extent * root / scale).clamp(1e-8 * own, most);
            let step = match q[place] + step > self.freedom.range(place)[1] {
                true => -step,
                false => step,
            };
            q[place] += step;
            let derivative = (mean(&q) - here) / (here * step);
            if derivative.is_finite() {
                derivative
            } else {
                0.0
            }
        };
        let unknowns = self.free.par_iter().zip(&normal.scales);
        unknowns.map(derivative).collect()
    }

    /// Unknowns whose derivatives at the points are rounding: as much as their own value, or any other
    /// parameter's unit, would not move the surface there. A factor of F is one when F vanishes.
    fn without_effect(&self, normal: &Normal) -> Vec<usize> {
        let largest = normal.scales.iter().copied().fold(0.0, f64::max);
        let root = (self.points.len() as f64).sqrt();
        let has_none = |&unknown: &usize| {
            let scale = normal.scales[unknown];
            let own = scale * self.q[self.free[unknown]].abs();
            scale <= NO_EFFECT * largest && own <= NO_EFFECT * self.extent * root
        };
        (0..self.free.len()).filter(has_none).collect()
    }

    /// What became of it.
    fn report(self, end: End, given: usize) -> Fit {
        let distances = self.distances();
        let squares: f64 = distances.iter().map(|distance| distance * distance).sum();
        let mut normal = Normal::new(&self.rows, &self.weights, &self.free, self.q.len());
        for unknown in self.without_effect(&normal) {
            normal.hold(unknown);
        }
        let (rank, unknowns) = undetermined(&normal.matrix, RANK_THRESHOLD);
        Fit {
            at_bounds: self.freedom.at_bounds(&self.q),
            q: self.q,
            end,
            iterations: self.iterations,
            evaluations: self.evaluations,
            rms: (squares / distances.len().max(1) as f64).sqrt(),
            max: distances.iter().copied().fold(0.0, f64::max),
            undefined: given - distances.len(),
            rank,
            undetermined: unknowns
                .into_iter()
                .map(|unknown| self.free[unknown])
                .collect(),
        }
    }
}

/// The largest cosine between the residuals and a column of the Jacobian.
fn cosine(normal: &Normal) -> f64 {
    let largest = |largest: f64, slope: &f64| largest.max(slope.abs());
    normal.slope.iter().fold(0.0, largest) / normal.squares.sqrt()
}

/// The diagonal of the points' box or, where they are all one, how far it is from the origin, or 1: a
/// length beside which others are small or large.
fn extent(points: &[DVec3], dimension: usize) -> f64 {
    let mut low = DVec3::splat(f64::INFINITY);
    let mut high = -low;
    for &point in points {
        low = low.min(point);
        high = high.max(point);
    }
    let mut sides = high - low;
    let mut far = high.abs().max(low.abs());
    for axis in dimension..3 {
        sides[axis] = 0.0;
        far[axis] = 0.0;
    }
    let lengths = [length(sides), length(far)];
    let usable = lengths
        .into_iter()
        .find(|&length| length > 0.0 && length.is_finite());
    usable.unwrap_or(1.0)
}
