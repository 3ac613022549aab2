//! Density: a spacing of floaters that follows the curvature of the surface, or is finer in a region.
//!
//! Both are made of what a coarse, even sample of the surface tells, and become a spacing that varies
//! from place to place ([`Varying`]), so that everything else is done by the floaters:
//!
//! ```text
//! s(x) = s₀ b(x) R(x)/R₀                  b: the spacing that was asked for as a function, or 1
//! s'(x) = min(s, s/m + d(x)/5)            in a focus region m times finer, at a distance d from it
//! ```
//!
//! R is the radius of curvature, 1 / max(|k₁|, |k₂|), from the gradient and the Hessian (R. Goldman,
//! "Curvature formulas for implicit curves and surfaces", Computer Aided Geometric Design 22, 2005,
//! sections 3 and 4): the eigenvalues of P (hess F) P / |F_x| with P = I - n nᵀ, n = F_x / |F_x|. The
//! Hessian is taken from central differences of F_x. R is held in a window, whose ends differ by the
//! factor of the contrast, in the middle of what the coarse sample shows; R₀ makes the mean of
//! (R/R₀)^(1-n) on the surface 1, so that there are as many points as with a spacing of s₀
//! everywhere. With a count s₀ is the spacing that gives so many.
//!
//! Around a focus region the spacing grows by a fifth of the distance, which takes three or four
//! spacings to the full one; repulsion cannot follow much faster.

use std::sync::Arc;
use std::time::Instant;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::evaluation::{Batch, Evaluation};
use super::floaters::balance::number_for;
use super::floaters::default_count;
use super::{Method, Options, Outcome, SampleError, Varying, out_of_range, sample};
use crate::engine::{Field, Monitor};
use crate::geometry::{Bounds, Samples, length};

/// Points of the coarse sample.
const COARSE: u64 = 500;

/// The step of differences, in units of the diagonal: errors of the Hessian from rounding and from
/// what they leave out are both about 1e-10.
const DIFFERENCE: f64 = 1e-5;

/// How fast the spacing grows with the distance from a focus region.
const GRADE: f64 = 0.2;

/// The parts of the surface that are more and less curved than the window's middle is chosen by.
const QUANTILES: (f64, f64) = (0.05, 0.95);

/// The largest factors between spacings that may be asked for.
const LARGEST_FACTOR: f64 = 32.0;

/// Points that share a task.
const CHUNK: usize = 256;

/// What the spacing of floaters follows.
#[derive(Clone, Default)]
pub struct Density {
    /// The spacing follows the radius of curvature; the widest and the narrowest differ at most by
    /// this factor, from 1 to 32.
    pub contrast: Option<f64>,
    /// A region in which the spacing is finer.
    pub focus: Option<Focus>,
}

/// A region in which the spacing is finer.
#[derive(Clone)]
pub struct Focus {
    /// Negative inside.
    pub region: Arc<dyn Field>,
    /// How many times finer, from 1 to 32.
    pub finer: f64,
}

/// Samples the zero set of a field with floaters whose spacing follows what is told.
///
/// `spacing` is that of an even sample with as many points, and outside of a focus region; a spacing
/// that varies is multiplied. See [`sample`] for the rest. It costs a coarse sample more and, with
/// curvature, seven evaluations of F_x for each one of a floater (in R2 five).
///
/// # Errors
/// If the method is another one, if a factor is out of its range, if the region has another number of
/// coordinates than the field, and for the reasons of [`sample`].
pub fn sample_graded(
    field: Arc<dyn Field>,
    density: &Density,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Outcome, SampleError> {
    check(&*field, density, options)?;
    let begun = Instant::now();
    let even = Options {
        count: Some(COARSE.min(options.count_limit)),
        spacing: None,
        varying: None,
        ..options.clone()
    };
    let coarse = sample(&*field, &even, monitor)?;
    if coarse.samples.positions.is_empty() {
        return Ok(coarse);
    }
    let graded = Graded::new(field.clone(), density, options, &coarse.samples);
    let by_number = options.spacing.is_none() && options.varying.is_none();
    let dimension = field.dimension();
    let options = Options {
        count: match by_number {
            true => Some(options.count.unwrap_or(default_count(dimension))),
            false => options.count,
        },
        spacing: None,
        varying: Some(Varying(Arc::new(graded))),
        ..options.clone()
    };
    let preparing = begun.elapsed();
    let mut outcome = sample(&*field, &options, monitor)?;
    outcome.statistics.evaluations += coarse.statistics.evaluations;
    outcome.statistics.steps += coarse.statistics.steps;
    let times = &mut outcome.statistics.times.0;
    times.insert(0, ("density".to_owned(), preparing));
    Ok(outcome)
}

fn check(field: &dyn Field, density: &Density, options: &Options) -> Result<(), SampleError> {
    let focus = density.focus.as_ref();
    let factors = [
        ("contrast", density.contrast),
        ("finer", focus.map(|focus| focus.finer)),
    ];
    for (option, factor) in factors {
        if let Some(factor) = factor
            && !(1.0..=LARGEST_FACTOR).contains(&factor)
        {
            let expected = format!("from 1 to {LARGEST_FACTOR}");
            return Err(out_of_range(option, &expected, factor.to_string()));
        }
    }
    if !matches!(options.method, Method::Floaters | Method::Relax) {
        let option = if focus.is_some() { "focus" } else { "adapt" };
        return Err(out_of_range(
            option,
            "left out with this method",
            "given".to_owned(),
        ));
    }
    match focus {
        Some(Focus { region, .. }) if region.dimension() != field.dimension() => {
            let expected = format!("a field of {} coordinates", field.dimension());
            let found = format!("one of {}", region.dimension());
            Err(out_of_range("focus", &expected, found))
        }
        _ => Ok(()),
    }
}

/// The spacing, as a field.
struct Graded {
    field: Arc<dyn Field>,
    /// The spacing that was asked for as a function.
    asked: Option<Varying>,
    window: Option<Window>,
    focus: Option<Focus>,
    /// s₀
    spacing: f64,
}

/// What R may be.
struct Window {
    low: f64,
    high: f64,
    /// R₀
    normal: f64,
    /// The step of differences.
    step: f64,
}

impl Graded {
    fn new(
        field: Arc<dyn Field>,
        density: &Density,
        options: &Options,
        coarse: &Samples,
    ) -> Graded {
        let window = density
            .contrast
            .map(|contrast| Window::new(&*field, contrast, coarse));
        let mut graded = Graded {
            field,
            asked: options.varying.clone(),
            window,
            focus: density.focus.clone(),
            spacing: 1.0,
        };
        graded.spacing = match (options.spacing, &options.varying, options.count) {
            (Some(spacing), ..) => spacing,
            (None, Some(_), None) => 1.0,
            (None, _, count) => {
                let count = count.unwrap_or(default_count(coarse.dimension));
                graded.spacing_for(count as f64, coarse)
            }
        };
        graded
    }

    /// The s₀ with which so many points cover the surface.
    fn spacing_for(&mut self, count: f64, coarse: &Samples) -> f64 {
        let dimension = coarse.dimension;
        let even: Vec<f64> = coarse.radii.iter().map(|radius| 2.0 * radius).collect();
        // A point of the coarse sample stands for the area of its cell.
        let number = |graded: &Graded| -> f64 {
            let spacings = graded.at(&coarse.positions);
            let parts = spacings.iter().zip(&even).map(|(&spacing, &even)| {
                let area = 1.0 / number_for(dimension, 1.0, even);
                number_for(dimension, area, spacing)
            });
            parts.filter(|part| part.is_finite()).sum()
        };
        let mean = even.iter().sum::<f64>() / even.len() as f64;
        // The number falls as the spacing grows: bisection of its logarithm.
        let (mut low, mut high) = (-60.0_f64, 60.0_f64);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            self.spacing = mean * crate::math::scalar::exp(middle);
            if number(self) > count {
                low = middle;
            } else {
                high = middle;
            }
        }
        mean * crate::math::scalar::exp(0.5 * (low + high))
    }

    /// The spacing at each of the points.
    fn at(&self, positions: &[DVec3]) -> Vec<f64> {
        let chunks = positions.par_chunks(CHUNK);
        let parts: Vec<Vec<f64>> = chunks.map(|chunk| self.at_chunk(chunk)).collect();
        parts.concat()
    }

    fn at_chunk(&self, positions: &[DVec3]) -> Vec<f64> {
        let mut spacings = vec![self.spacing; positions.len()];
        if let Some(Varying(asked)) = &self.asked {
            for (spacing, &position) in spacings.iter_mut().zip(positions) {
                *spacing *= asked.value(position);
            }
        }
        if let Some(window) = &self.window {
            let radii = radii_of_curvature(&*self.field, positions, window.step);
            for (spacing, radius) in spacings.iter_mut().zip(radii) {
                *spacing *= window.hold(radius) / window.normal;
            }
        }
        if let Some(focus) = &self.focus {
            let mut batch = Batch::default();
            let there = batch.evaluate(&*focus.region, positions.iter().copied());
            for (spacing, there) in spacings.iter_mut().zip(there) {
                let distance = match there.value < 0.0 {
                    true => 0.0,
                    false => there.distance(),
                };
                // Where the region is not defined the distance is not a number, and `min` leaves the
                // spacing as it is.
                *spacing = spacing.min(*spacing / focus.finer + GRADE * distance);
            }
        }
        spacings
    }
}

impl Window {
    /// Around the radii of curvature at the points of a sample.
    fn new(field: &dyn Field, contrast: f64, coarse: &Samples) -> Window {
        let positions = &coarse.positions;
        let around = Bounds::of_points(coarse.dimension, positions.iter().copied());
        let diagonal = around.map_or(1.0, |bounds| bounds.diagonal());
        let step = DIFFERENCE * diagonal;
        // Nothing is flatter than the whole thing is large.
        let radii = radii_of_curvature(field, positions, step);
        let mut radii: Vec<f64> = radii
            .into_iter()
            .map(|radius| radius.clamp(step, diagonal.max(step)))
            .collect();
        radii.sort_by(f64::total_cmp);
        let last = radii.len().saturating_sub(1) as f64;
        let quantile = |part: f64| radii.get((part * last) as usize).copied().unwrap_or(1.0);
        let middle = (quantile(QUANTILES.0) * quantile(QUANTILES.1)).sqrt();
        let mut window = Window {
            low: middle / contrast.sqrt(),
            high: middle * contrast.sqrt(),
            normal: 1.0,
            step,
        };
        let density = |&radius: &f64| number_for(coarse.dimension, 1.0, window.hold(radius));
        let mean = radii.iter().map(density).sum::<f64>() / radii.len().max(1) as f64;
        // The even spacing of the mean density.
        window.normal = match coarse.dimension {
            2 => 1.0 / mean,
            _ => (number_for(3, 1.0, 1.0) / mean).sqrt(),
        };
        window
    }

    fn hold(&self, radius: f64) -> f64 {
        radius.clamp(self.low, self.high)
    }
}

/// The radius of curvature of the level set at each of the points, that of the larger principal
/// curvature; 0 where the gradient vanishes or is undefined near.
fn radii_of_curvature(field: &dyn Field, positions: &[DVec3], step: f64) -> Vec<f64> {
    let dimension = field.dimension();
    let stencil = |&position: &DVec3| {
        let sides = DVec3::AXES.into_iter().take(dimension);
        let sides = sides.flat_map(move |axis| [position - step * axis, position + step * axis]);
        std::iter::once(position).chain(sides)
    };
    let mut batch = Batch::default();
    let there: Vec<Evaluation> = batch
        .evaluate(field, positions.iter().flat_map(stencil))
        .collect();
    there
        .chunks(1 + 2 * dimension)
        .map(|around| {
            let curvature = largest_curvature(dimension, around, step);
            if curvature.is_nan() {
                0.0
            } else {
                1.0 / curvature
            }
        })
        .collect()
}

/// max(|k₁|, |k₂|) from F_x at a point and on both sides along each axis.
fn largest_curvature(dimension: usize, around: &[Evaluation], step: f64) -> f64 {
    let gradient = around[0].gradient;
    let slope = length(gradient);
    let normal = gradient / slope;
    let column = |axis: usize| match around.get(2 + 2 * axis) {
        Some(after) => (after.gradient - around[1 + 2 * axis].gradient) / (2.0 * step),
        None => DVec3::ZERO,
    };
    let hessian = DMat3::from_cols(column(0), column(1), column(2));
    if dimension == 2 {
        let tangent = DVec3::new(-normal.y, normal.x, 0.0);
        return (tangent.dot(hessian * tangent) / slope).abs();
    }
    let across = |vector: DVec3| vector - normal * normal.dot(vector);
    // S, whose eigenvalues are k₁, k₂ and 0, by columns.
    let bent = DVec3::AXES.map(|axis| across(hessian * across(axis)) / slope);
    let mean = 0.5 * (bent[0].x + bent[1].y + bent[2].z);
    // Of S - mean P they are ±(k₁ - k₂)/2 and 0.
    let rest = [0, 1, 2].map(|axis| bent[axis] - mean * across(DVec3::AXES[axis]));
    let squares: f64 = rest.iter().map(|column| column.length_squared()).sum();
    mean.abs() + (0.5 * squares).sqrt()
}

impl Field for Graded {
    fn dimension(&self) -> usize {
        self.field.dimension()
    }

    fn parameters(&self) -> &[f64] {
        &[]
    }

    fn values(&self, points: &[&[f64]], values: &mut [f64]) {
        let positions: Vec<DVec3> = (0..values.len())
            .map(|place| point(points, place))
            .collect();
        values.copy_from_slice(&self.at(&positions));
    }

    /// By central differences.
    fn gradients(&self, points: &[&[f64]], values: &mut [f64], gradients: &mut [&mut [f64]]) {
        self.values(points, values);
        let positions: Vec<DVec3> = (0..values.len())
            .map(|place| point(points, place))
            .collect();
        for (axis, column) in gradients.iter_mut().enumerate() {
            let step = DIFFERENCE * self.spacing * DVec3::AXES[axis];
            let moved = |step: DVec3| -> Vec<f64> {
                let there: Vec<DVec3> = positions.iter().map(|place| place + step).collect();
                self.at(&there)
            };
            let (after, before) = (moved(step), moved(-step));
            for (slope, (after, before)) in column.iter_mut().zip(after.iter().zip(&before)) {
                *slope = (after - before) / (2.0 * step[axis]);
            }
        }
    }

    fn parameter_gradients(
        &self,
        points: &[&[f64]],
        values: &mut [f64],
        gradients: &mut [&mut [f64]],
        _parameter_gradients: &mut [&mut [f64]],
    ) {
        self.gradients(points, values, gradients);
    }
}

fn point(points: &[&[f64]], place: usize) -> DVec3 {
    let mut position = DVec3::ZERO;
    for (axis, column) in points.iter().enumerate() {
        position[axis] = column[place];
    }
    position
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x²/9 + y² + z² - 1 with its gradient; in R2 x²/9 + y² - 1.
    struct Ellipsoid(usize);

    impl Field for Ellipsoid {
        fn dimension(&self) -> usize {
            self.0
        }

        fn parameters(&self) -> &[f64] {
            &[]
        }

        fn values(&self, points: &[&[f64]], values: &mut [f64]) {
            for (place, value) in values.iter_mut().enumerate() {
                let p = point(points, place);
                *value = p.x * p.x / 9.0 + p.y * p.y + p.z * p.z - 1.0;
            }
        }

        fn gradients(&self, points: &[&[f64]], values: &mut [f64], gradients: &mut [&mut [f64]]) {
            self.values(points, values);
            let factors = [2.0 / 9.0, 2.0, 2.0];
            for (axis, column) in gradients.iter_mut().enumerate() {
                for (place, slope) in column.iter_mut().enumerate() {
                    *slope = factors[axis] * points[axis][place];
                }
            }
        }

        fn parameter_gradients(
            &self,
            points: &[&[f64]],
            values: &mut [f64],
            gradients: &mut [&mut [f64]],
            _: &mut [&mut [f64]],
        ) {
            self.gradients(points, values, gradients);
        }
    }

    #[test]
    fn radii_of_curvature_are_those_of_an_ellipsoid_of_revolution() {
        // With a = 3, b = 1, x = a sin t and w = a² cos² t + b² sin² t the curvature along the meridian
        // is a b / w^(3/2), and the other one a / (b √w).
        for t in [0.0_f64, 0.3, 0.8, 1.2, 1.5] {
            let w = 9.0 * t.cos().powi(2) + t.sin().powi(2);
            let (along, across) = (3.0 / w.powf(1.5), 3.0 / w.sqrt());
            let position = DVec3::new(3.0 * t.sin(), t.cos(), 0.0);
            let turned = DVec3::new(position.x, 0.6 * position.y, -0.8 * position.y);
            let radius = radii_of_curvature(&Ellipsoid(3), &[turned], 1e-5)[0];
            let expected = 1.0 / along.max(across);
            assert!(
                (radius / expected - 1.0).abs() < 1e-8,
                "{t}: {radius} {expected}"
            );
            let radius = radii_of_curvature(&Ellipsoid(2), &[position], 1e-5)[0];
            assert!((radius * along - 1.0).abs() < 1e-8, "{t}: {radius}");
        }
    }
}
