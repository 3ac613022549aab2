//! Rays on their way through a cube: all that are open in lockstep, slice by slice.
//!
//! F is evaluated in f32 at the slices' ends, a few slices at a time. Where a ray is inside, the
//! secant through the slice's ends guesses the root, and one Newton step from there, in f64,
//! makes it exact and brings the gradient along. The step is believed if it is short and the
//! slope there is about that of the slice; the others are left to [`super::root`]. Everything is
//! kept in columns, and there are no branches but for what is rare, so that the loops are
//! vector code.

use glam::DVec3;

use super::root::{Bracket, PROBE, Surface};
use crate::engine::Specialized;

/// The side of a cube, in pixels and slices. Its 64 rays are as many as a block has lanes.
pub(super) const LEAF: usize = 8;

/// The rays of a cube.
pub(super) const RAYS: usize = LEAF * LEAF;

/// How many slices are evaluated at a time.
pub(super) const SLICES: usize = 8;

/// How much the slope at a root may differ from that between the slice's ends, as a part of it.
const TRUST: f64 = 0.125;

/// Rays at the same depth.
pub(super) struct March {
    /// How many there are.
    pub(super) count: usize,
    pixels: [u16; RAYS],
    /// The pixels' middles.
    across: [f32; RAYS],
    down: [f32; RAYS],
    /// F where the rays are now; NaN if it is not known.
    before: [f32; RAYS],
    /// The points of a round, slice by slice, and F there.
    points: [[f32; RAYS * SLICES]; 3],
    values: [f32; RAYS * SLICES],
    /// The same in f64, where that is needed.
    wide_points: [[f64; RAYS * SLICES]; 3],
    wide_values: [f64; RAYS * SLICES],
    /// How many points the round has.
    length: usize,
    /// The rays that are inside at the end of a slice.
    pub(super) found: Found,
}

/// Slices in which rays come to the inside.
pub(super) struct Found {
    /// How many there are.
    pub(super) count: usize,
    pub(super) pixels: [u16; RAYS],
    across: [f64; RAYS],
    down: [f64; RAYS],
    /// The depths at which the slices end.
    inside: [f64; RAYS],
    /// F there, negative, and where the slices begin; NaN if it is not known.
    inner: [f64; RAYS],
    outer: [f64; RAYS],
    /// Where the roots were guessed, with F and its gradient.
    guesses: [f64; RAYS],
    values: [f64; RAYS],
    gradients: [[f64; RAYS]; 3],
}

impl Default for March {
    fn default() -> March {
        March {
            count: 0,
            pixels: [0; RAYS],
            across: [0.0; RAYS],
            down: [0.0; RAYS],
            before: [0.0; RAYS],
            points: [[0.0; RAYS * SLICES]; 3],
            values: [0.0; RAYS * SLICES],
            wide_points: [[0.0; RAYS * SLICES]; 3],
            wide_values: [0.0; RAYS * SLICES],
            length: 0,
            found: Found {
                count: 0,
                pixels: [0; RAYS],
                across: [0.0; RAYS],
                down: [0.0; RAYS],
                inside: [0.0; RAYS],
                inner: [0.0; RAYS],
                outer: [0.0; RAYS],
                guesses: [0.0; RAYS],
                values: [0.0; RAYS],
                gradients: [[0.0; RAYS]; 3],
            },
        }
    }
}

impl March {
    /// Adds the ray through a pixel's middle. There are at most [`RAYS`].
    pub(super) fn add(&mut self, pixel: u16, [u, v]: [f64; 2]) {
        let place = self.count;
        self.pixels[place] = pixel;
        self.across[place] = u as f32;
        self.down[place] = v as f32;
        self.before[place] = f32::NAN;
        self.count += 1;
    }

    /// Adds the rays through those pixels of a row, from this one on, whose bits are set.
    pub(super) fn add_row(&mut self, bits: u8, first: u16, [u, v]: [f64; 2]) {
        for column in 0..8 {
            // Written in any case, and kept if the count goes on.
            let place = self.count.min(RAYS - 1);
            self.pixels[place] = first + column;
            self.across[place] = u as f32 + f32::from(column);
            self.down[place] = v as f32;
            self.before[place] = f32::NAN;
            self.count += usize::from(bits >> column & 1);
        }
    }

    /// Evaluates F at so many ends of slices, from this depth on. All coordinates are halves of
    /// whole numbers, and exact in f32.
    pub(super) fn evaluate(
        &mut self,
        (depth, steps): (f32, usize),
        in_single: bool,
        field: &mut Specialized<'_>,
    ) {
        let count = self.count;
        self.length = steps * count;
        let [first, second, third] = &mut self.points;
        for step in 0..steps {
            let range = step * count..(step + 1) * count;
            first[range.clone()].copy_from_slice(&self.across[..count]);
            second[range.clone()].copy_from_slice(&self.down[..count]);
            third[range].fill(depth + step as f32);
        }
        let length = self.length;
        if in_single {
            let points = self.points.each_ref().map(|column| &column[..length]);
            field.values_f32(&points, &mut self.values[..length]);
        } else {
            self.evaluate_wide(field);
        }
    }

    /// Evaluates F at the points of the round, in f64.
    pub(super) fn evaluate_wide(&mut self, field: &mut Specialized<'_>) {
        let length = self.length;
        for (wide, column) in self.wide_points.iter_mut().zip(&self.points) {
            for (wide, &coordinate) in wide[..length].iter_mut().zip(column) {
                *wide = f64::from(coordinate);
            }
        }
        let points = self.wide_points.each_ref().map(|column| &column[..length]);
        field.values(&points, &mut self.wide_values[..length]);
        for (value, &wide) in self.values[..length].iter_mut().zip(&self.wide_values) {
            let rounded = wide as f32;
            // Only the sign counts, and that must not be lost.
            let is_lost = wide < 0.0 && rounded == 0.0;
            *value = if is_lost { -f32::MIN_POSITIVE } else { rounded };
        }
    }

    /// Whether F is not a number at some point of the round.
    pub(super) fn has_undefined(&self) -> bool {
        let values = self.values[..self.length].iter();
        values.fold(false, |found, value| found | value.is_nan())
    }

    /// Whether F ≥ 0 at all points of the round.
    pub(super) fn is_outside(&self) -> bool {
        let values = self.values[..self.length].iter();
        values.fold(true, |outside, &value| outside & (value >= 0.0))
    }

    /// The points of the round at which F is not a number.
    pub(super) fn undefined(&self) -> impl Iterator<Item = [f64; 3]> {
        let is_undefined = |&index: &usize| self.values[index].is_nan();
        let point = |index: usize| [0, 1, 2].map(|axis| f64::from(self.points[axis][index]));
        (0..self.length).filter(is_undefined).map(point)
    }

    /// Takes the values of a round that began at this depth: rays that are inside are found, the
    /// others go on.
    pub(super) fn advance(&mut self, depth: f64) {
        let count = self.count;
        if count == 0 {
            return;
        }
        let steps = self.length / count;
        let last = (steps - 1) * count;
        let values = &self.values[..self.length];
        if !values
            .iter()
            .fold(false, |found, &value| found | (value < 0.0))
        {
            self.before[..count].copy_from_slice(&values[last..]);
            return;
        }
        guess_before(&mut self.before[..count], values);
        // In which step each ray is inside, if it is.
        let mut steps_to = [steps as f32; RAYS];
        for (step, values) in values.chunks_exact(count).enumerate().rev() {
            for (first, &value) in steps_to.iter_mut().zip(values) {
                *first = if value < 0.0 { step as f32 } else { *first };
            }
        }
        // The rays that are found, and the others. Written in any case, and kept if the count
        // goes on.
        let (mut caught, mut free) = ([0; RAYS], [0; RAYS]);
        let (mut caught_count, mut free_count) = (0, 0);
        for (ray, &first) in steps_to[..count].iter().enumerate() {
            caught[caught_count & (RAYS - 1)] = ray as u8;
            free[free_count & (RAYS - 1)] = ray as u8;
            let is_found = first < steps as f32;
            caught_count += usize::from(is_found);
            free_count += usize::from(!is_found);
        }
        let found = &mut self.found;
        for &ray in &caught[..caught_count] {
            let (ray, place) = (usize::from(ray) & (RAYS - 1), found.count & (RAYS - 1));
            found.pixels[place] = self.pixels[ray];
            found.across[place] = f64::from(self.across[ray]);
            found.down[place] = f64::from(self.down[ray]);
            let step = steps_to[ray] as usize;
            found.inside[place] = depth + f64::from(steps_to[ray]);
            found.inner[place] = f64::from(values[step * count + ray]);
            found.outer[place] = f64::from(match step {
                0 => self.before[ray],
                _ => values[(step - 1) * count + ray],
            });
            found.count += 1;
        }
        let values = &values[last..];
        for (rest, &ray) in free[..free_count].iter().enumerate() {
            let ray = usize::from(ray) & (RAYS - 1);
            self.pixels[rest] = self.pixels[ray];
            self.across[rest] = self.across[ray];
            self.down[rest] = self.down[ray];
            self.before[rest] = values[ray];
        }
        self.count = free_count;
    }
}

/// Where F is not known in front of a round, what its first slice goes on to.
fn guess_before(before: &mut [f32], values: &[f32]) {
    let (first, rest) = values.split_at(before.len());
    for ((before, &first), &second) in before.iter_mut().zip(first).zip(rest) {
        let guess = 2.0 * first - second;
        *before = if before.is_nan() { guess } else { *before };
    }
}

impl Found {
    /// Evaluates F and its gradient where the roots are guessed.
    pub(super) fn strike(&mut self, field: &mut Specialized<'_>) {
        let count = self.count;
        for place in 0..count {
            let guess = self.outer[place] / (self.outer[place] - self.inner[place]);
            let is_between = (0.0..=1.0).contains(&guess);
            let guess = if is_between { guess } else { 0.5 };
            self.guesses[place] = self.inside[place] - 1.0 + guess;
        }
        let points = [
            &self.across[..count],
            &self.down[..count],
            &self.guesses[..count],
        ];
        let [x, y, z] = self.gradients.each_mut().map(|column| &mut column[..count]);
        field.gradients(&points, &mut self.values[..count], &mut [x, y, z]);
    }

    /// What is at this place: the root if the step to it is to be believed.
    #[inline]
    pub(super) fn surface(&self, place: usize) -> Option<Surface> {
        let [x, y, z] = &self.gradients;
        let gradient = DVec3::new(x[place], y[place], z[place]);
        let mean = self.inner[place] - self.outer[place];
        let step = -self.values[place] / gradient.z;
        let is_believed = self.outer[place] >= 0.0
            && (gradient.z - mean).abs() <= TRUST * -mean
            && step.abs() <= PROBE
            && gradient.is_finite();
        is_believed.then_some(Surface {
            depth: self.guesses[place] + step,
            gradient,
            is_root: true,
        })
    }

    /// Whether the ray is inside where the box begins.
    pub(super) fn is_cut_at_front(&self, place: usize) -> bool {
        self.inside[place] == 0.0
    }

    /// The slice at this place.
    pub(super) fn bracket(&self, place: usize) -> Bracket {
        let [outer, inner] = [self.outer[place], self.inner[place]];
        let guess = outer / (outer - inner);
        Bracket {
            pixel: self.pixels[place],
            ray: [self.across[place], self.down[place]],
            outside: self.inside[place] - 1.0,
            inside: self.inside[place],
            guess: if outer >= 0.0 && guess.is_finite() {
                guess.clamp(0.01, 0.99)
            } else {
                0.5
            },
        }
    }
}
