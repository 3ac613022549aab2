//! Where a ray meets the zero set: from a change of sign to a root in f64.
//!
//! A bracket has F ≥ 0 or NaN at its outer end and F < 0 at its inner one. One Newton step from
//! the secant's guess finds almost every root; it is believed if F changes its sign closely
//! around it, by about as much as the derivative says. What is not believed is bisected. F also
//! changes its sign at jumps, at poles and where its domain ends: there it does not become small
//! with the bracket, and no root is claimed.

use glam::DVec3;

use crate::engine::{CompiledField, Field, Specialized};

/// The distance from a root at which F must have the right signs, as a part of the bracket.
pub(super) const PROBE: f64 = 1.0 / 64.0;

/// How much F may fall around a root, compared with what the derivative says, and its inverse.
const TRUST: f64 = 1.25;

/// How often a bracket is halved.
const HALVINGS: usize = 26;

/// What may be left of |F| at the ends of a bracket that has been halved so often. What behaves
/// like the fourth root of the distance is still a root.
const LEFT: f64 = 0.1;

/// What evaluates F on the screen: u, v and depth.
pub(super) trait Evaluate {
    /// F.
    fn values(&mut self, points: &[&[f64]], values: &mut [f64]);

    /// F and its gradient.
    fn gradients(&mut self, points: &[&[f64]], values: &mut [f64], gradients: &mut [&mut [f64]]);
}

impl Evaluate for Specialized<'_> {
    fn values(&mut self, points: &[&[f64]], values: &mut [f64]) {
        Specialized::values(self, points, values);
    }

    fn gradients(&mut self, points: &[&[f64]], values: &mut [f64], gradients: &mut [&mut [f64]]) {
        Specialized::gradients(self, points, values, gradients);
    }
}

impl Evaluate for &CompiledField {
    fn values(&mut self, points: &[&[f64]], values: &mut [f64]) {
        Field::values(*self, points, values);
    }

    fn gradients(&mut self, points: &[&[f64]], values: &mut [f64], gradients: &mut [&mut [f64]]) {
        Field::gradients(*self, points, values, gradients);
    }
}

/// A part of a ray on which F changes from the outside to the inside.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bracket {
    /// The pixel, for the caller.
    pub(super) pixel: u16,
    /// The ray.
    pub(super) ray: [f64; 2],
    /// The depths of both ends.
    pub(super) outside: f64,
    pub(super) inside: f64,
    /// Where the root may be, between 0 (outside) and 1.
    pub(super) guess: f64,
}

/// What was found in a bracket.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Surface {
    /// Where.
    pub(super) depth: f64,
    /// The gradient on the screen.
    pub(super) gradient: DVec3,
    /// Whether it is a root.
    pub(super) is_root: bool,
}

impl Surface {
    /// What a ray meets that is inside where the box begins, by which it is cut.
    pub(super) const CUT_AT_FRONT: Surface = Surface {
        depth: 0.0,
        gradient: DVec3::ZERO,
        is_root: true,
    };
}

/// Solves brackets together; keeps its memory.
#[derive(Default)]
pub(super) struct Rooter {
    points: [Vec<f64>; 3],
    values: Vec<f64>,
    gradients: [Vec<f64>; 3],
    /// Roots so far from their guesses that the gradient is wanted again.
    far: Vec<usize>,
    /// Brackets that are bisected.
    hard: Vec<Hard>,
    found: Vec<Option<Surface>>,
}

/// A bracket that is bisected.
struct Hard {
    place: usize,
    ends: [f64; 2],
    values: [f64; 2],
    /// The largest finite |F| at the ends in the beginning.
    scale: f64,
}

impl Rooter {
    /// What is in each of the brackets; nothing where F is not negative at the inner end after
    /// all.
    pub(super) fn solve(
        &mut self,
        brackets: &[Bracket],
        field: &mut impl Evaluate,
    ) -> &[Option<Surface>] {
        self.found.clear();
        self.hard.clear();
        if brackets.is_empty() {
            return &self.found;
        }
        self.newton(brackets, field);
        if !self.far.is_empty() {
            self.correct(brackets, field);
        }
        if !self.hard.is_empty() {
            self.bisect(brackets, field);
        }
        &self.found
    }

    /// Puts points on the brackets' rays into the columns: the places, the brackets, the depths.
    fn place(&mut self, points: impl Iterator<Item = ([f64; 2], f64)>) {
        for column in &mut self.points {
            column.clear();
        }
        for ([u, v], depth) in points {
            self.points[0].push(u);
            self.points[1].push(v);
            self.points[2].push(depth);
        }
        self.values.resize(self.points[0].len(), 0.0);
    }

    fn evaluate(&mut self, field: &mut impl Evaluate) {
        let points = self.points.each_ref().map(Vec::as_slice);
        field.values(&points, &mut self.values);
    }

    fn differentiate(&mut self, field: &mut impl Evaluate) {
        let points = self.points.each_ref().map(Vec::as_slice);
        for column in &mut self.gradients {
            column.resize(self.values.len(), 0.0);
        }
        let mut gradients = self.gradients.each_mut().map(Vec::as_mut_slice);
        field.gradients(&points, &mut self.values, &mut gradients);
    }

    fn gradient(&self, index: usize) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|axis| self.gradients[axis][index]))
    }

    /// One step from every guess, and whether it is believed.
    fn newton(&mut self, brackets: &[Bracket], field: &mut impl Evaluate) {
        self.place(brackets.iter().map(|bracket| {
            let Bracket {
                outside,
                inside,
                guess,
                ..
            } = *bracket;
            (bracket.ray, outside + guess * (inside - outside))
        }));
        self.differentiate(field);
        self.far.clear();
        for (index, bracket) in brackets.iter().enumerate() {
            let (value, gradient) = (self.values[index], self.gradient(index));
            let length = bracket.inside - bracket.outside;
            let depth = self.points[2][index] - value / gradient.z;
            let may_be = gradient.z < 0.0
                && gradient.is_finite()
                && depth >= bracket.outside - PROBE * length
                && depth <= bracket.inside + PROBE * length;
            self.found.push(may_be.then_some(Surface {
                depth,
                gradient,
                is_root: true,
            }));
        }
        let found = std::mem::take(&mut self.found);
        let probes = brackets.iter().zip(&found).flat_map(|(bracket, found)| {
            let step = PROBE * (bracket.inside - bracket.outside);
            // Where there is no step to be believed, the ends are of interest.
            let depths = match found {
                Some(surface) => [surface.depth - step, surface.depth + step],
                None => [bracket.outside, bracket.inside],
            };
            depths.map(|depth| (bracket.ray, depth))
        });
        self.place(probes);
        self.found = found;
        self.evaluate(field);
        for (place, bracket) in brackets.iter().enumerate() {
            let [before, after] = [self.values[2 * place], self.values[2 * place + 1]];
            if let Some(surface) = self.found[place] {
                let length = 2.0 * PROBE * (bracket.inside - bracket.outside);
                let fall = (before - after) / (-surface.gradient.z * length);
                let is_believed =
                    before >= 0.0 && after < 0.0 && fall > 1.0 / TRUST && fall < TRUST;
                if is_believed {
                    // Between the probes F is straight but for a ten thousandth.
                    let depth = surface.depth + length * (before / (before - after) - 0.5);
                    self.found[place] = Some(Surface { depth, ..surface });
                    let guess = bracket.outside + bracket.guess * 0.5 * length / PROBE;
                    if (surface.depth - guess).abs() > 0.5 * length {
                        self.far.push(place);
                    }
                    continue;
                }
            }
            self.found[place] = None;
            self.hard.push(Hard {
                place,
                ends: [bracket.outside, bracket.inside],
                values: [f64::NAN; 2],
                scale: 0.0,
            });
        }
    }

    /// Gradients at the roots themselves, where the guesses were not close.
    fn correct(&mut self, brackets: &[Bracket], field: &mut impl Evaluate) {
        let far = std::mem::take(&mut self.far);
        let depths: Vec<f64> = far
            .iter()
            .filter_map(|&place| self.found[place].map(|surface| surface.depth))
            .collect();
        let rays = far.iter().map(|&place| brackets[place].ray);
        self.place(rays.zip(depths));
        self.differentiate(field);
        for (index, &place) in far.iter().enumerate() {
            let gradient = self.gradient(index);
            if let Some(surface) = &mut self.found[place] {
                surface.gradient = gradient;
            }
        }
        self.far = far;
    }

    /// Halves the brackets of which no step was believed.
    fn bisect(&mut self, brackets: &[Bracket], field: &mut impl Evaluate) {
        let mut hard = std::mem::take(&mut self.hard);
        let ray = |hard: &Hard| brackets[hard.place].ray;
        self.place(
            hard.iter()
                .flat_map(|hard| hard.ends.map(|depth| (ray(hard), depth))),
        );
        self.evaluate(field);
        for (hard, values) in hard.iter_mut().zip(self.values.as_chunks::<2>().0) {
            hard.values = *values;
            let finite = values.iter().filter(|value| value.is_finite());
            hard.scale = finite.fold(0.0, |scale, value| scale.max(value.abs()));
        }
        hard.retain(|hard| hard.values[1] < 0.0);
        for _ in 0..HALVINGS {
            let middle = |hard: &Hard| 0.5 * (hard.ends[0] + hard.ends[1]);
            self.place(hard.iter().map(|hard| (ray(hard), middle(hard))));
            self.evaluate(field);
            for (hard, &value) in hard.iter_mut().zip(&self.values) {
                // If even the outer end turned out to be inside, it is approached.
                let end = usize::from(value < 0.0);
                hard.ends[end] = middle(hard);
                hard.values[end] = value;
            }
        }
        self.place(hard.iter().map(|hard| (ray(hard), hard.ends[1])));
        self.differentiate(field);
        for (index, hard) in hard.iter().enumerate() {
            let left = hard.values.iter().filter(|value| !value.is_nan());
            let left = left.fold(0.0, |left: f64, value| left.max(value.abs()));
            self.found[hard.place] = Some(Surface {
                depth: hard.ends[1],
                gradient: self.gradient(index),
                is_root: left <= LEFT * hard.scale,
            });
        }
        self.hard = hard;
    }
}
