//! Graphs of functions of one variable.
//!
//! The curve is a polyline through four values for each column of pixels, drawn by the distance
//! of the pixels from it. Where the function jumps, has a pole or is undefined, the line is
//! broken: two neighbours are joined only if their derivatives explain the difference.

use glam::{DVec2, Vec3};

use super::color::{PALETTE, Palette, light, pixel};
use super::tone::round_number;
use super::{Options, Picture, Statistics};
use crate::engine::{CompiledField, Field};
use crate::geometry::Image;

/// Values for each column of pixels.
const DENSITY: usize = 4;

/// Half the width of the curve in pixels, for an image of 512 pixels.
const HALF_CURVE: f64 = 1.2;

/// How much more than its derivatives say F may change between neighbours.
const TRUST: f64 = 4.0;

/// What is left free above and below the curve, as a part of the height.
const MARGIN: f64 = 0.08;

/// F at even distances.
struct Samples {
    values: Vec<f64>,
    slopes: Vec<f64>,
    /// The distance.
    step: f64,
}

/// The graph of the field over its box.
pub(super) fn render(field: &CompiledField, options: &Options, size: [usize; 2]) -> Picture {
    let [width, height] = size;
    let samples = Samples::new(field, options, width);
    let (low, high) = samples.range();
    let mut canvas = Canvas {
        size,
        low,
        high,
        lights: vec![PALETTE.paper; width * height],
        opacities: vec![0.0; width * height],
        mask: vec![0.0; width * height],
    };
    canvas.grid(options);
    canvas.undefined(&samples);
    let scale = width.min(height) as f64 / 320.0;
    let half = (HALF_CURVE * scale).max(0.6);
    for index in 1..samples.values.len() {
        if samples.joins(index, (high - low) / height as f64) {
            let [from, to] = [index - 1, index].map(|index| canvas.position(&samples, index));
            canvas.segment(from, to, half);
        }
    }
    canvas.paint(PALETTE.inside_near);
    for root in samples.roots((high - low) / height as f64) {
        let y = canvas.row(0.0);
        let dot = DVec2::new(root / DENSITY as f64, y);
        canvas.segment(dot, dot, 3.0 * half);
    }
    canvas.paint(PALETTE.line);
    let count = samples.values.len();
    let undefined = samples.values.iter().filter(|value| value.is_nan()).count();
    let inside = samples.values.iter().filter(|&&value| value < 0.0).count();
    let opacity = |opacity: f32| if options.transparent { opacity } else { 1.0 };
    let pixels = canvas.lights.iter().zip(&canvas.opacities);
    Picture {
        image: Image {
            width,
            height,
            pixels: pixels
                .map(|(&light, &alpha)| pixel(light, opacity(alpha)))
                .collect(),
        },
        statistics: Statistics {
            covered: inside as f64 / count as f64,
            undefined: undefined as u64,
            ..Statistics::default()
        },
    }
}

impl Samples {
    fn new(field: &CompiledField, options: &Options, width: usize) -> Samples {
        let count = DENSITY * width + 1;
        let (low, high) = (options.bounds.min.x, options.bounds.max.x);
        let x: Vec<f64> = (0..count)
            .map(|index| {
                let part = index as f64 / (count - 1) as f64;
                low * (1.0 - part) + high * part
            })
            .collect();
        let (mut values, mut slopes) = (vec![0.0; count], vec![0.0; count]);
        field.gradients(&[&x], &mut values, &mut [&mut slopes]);
        Samples {
            values,
            slopes,
            step: (high - low) / (count - 1) as f64,
        }
    }

    /// What the graph shows of F: most of the values, and 0.
    fn range(&self) -> (f64, f64) {
        let finite = self
            .values
            .iter()
            .copied()
            .filter(|value| value.is_finite());
        let mut sorted: Vec<f64> = finite.collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let (Some(&least), Some(&greatest)) = (sorted.first(), sorted.last()) else {
            return (-1.0, 1.0);
        };
        // Poles must not flatten everything else: the middle nine tenths, thrice as high.
        let place = |part: f64| sorted[(part * (sorted.len() - 1) as f64).round() as usize];
        let (lower, upper) = (place(0.05), place(0.95));
        let middle = upper - lower;
        let low = least.max(lower - middle).min(0.0);
        let high = greatest.min(upper + middle).max(0.0);
        let length = high - low;
        if !(length > 0.0 && length.is_finite()) {
            return (-1.0, 1.0);
        }
        (low - MARGIN * length, high + MARGIN * length)
    }

    /// Whether the value before this one is joined with it; `pixel` is the height of a pixel.
    fn joins(&self, index: usize, pixel: f64) -> bool {
        let [before, after] = [self.values[index - 1], self.values[index]];
        let [first, second] = [self.slopes[index - 1], self.slopes[index]];
        let change = after - before;
        let most = first.abs().max(second.abs()) * self.step;
        // A pole changes the sign of F, but not as its derivatives say.
        let opposes = change * first < 0.0 && change * second < 0.0;
        change.is_finite()
            && (change.abs() <= 2.0 * pixel || change.abs() <= TRUST * most && !opposes)
    }

    /// Where the joined values change their signs, in steps.
    fn roots(&self, pixel: f64) -> Vec<f64> {
        let mut roots = Vec::new();
        for (index, &value) in self.values.iter().enumerate() {
            if value == 0.0 {
                // One dot for a stretch of zeros.
                if index == 0 || self.values[index - 1] != 0.0 {
                    roots.push(index as f64);
                }
            } else if index > 0 {
                let before = self.values[index - 1];
                if before * value < 0.0 && self.joins(index, pixel) {
                    roots.push((index - 1) as f64 + before / (before - value));
                }
            }
        }
        roots
    }
}

/// The image as it is drawn; rows count from the top.
struct Canvas {
    size: [usize; 2],
    low: f64,
    high: f64,
    lights: Vec<Vec3>,
    opacities: Vec<f32>,
    /// How much of each pixel is covered by what is drawn next in one colour.
    mask: Vec<f32>,
}

impl Canvas {
    /// The row, in pixels, of a value.
    fn row(&self, value: f64) -> f64 {
        (self.high - value) / (self.high - self.low) * self.size[1] as f64
    }

    fn position(&self, samples: &Samples, index: usize) -> DVec2 {
        let row = self.row(samples.values[index]);
        // Far beyond the image the exact place does not matter.
        let far = 4.0 * self.size[1] as f64;
        DVec2::new(index as f64 / DENSITY as f64, row.clamp(-far, far))
    }

    /// Lines at round numbers, those at 0 stronger.
    fn grid(&mut self, options: &Options) {
        let [width, height] = self.size.map(|count| count as f64);
        let (left, right) = (options.bounds.min.x, options.bounds.max.x);
        let fine = light(0xe6_e9_ee);
        let axis = light(0x8a_93_a3);
        let step = round_number((right - left) / 10.0);
        for position in multiples(left, right, step) {
            let column = (position - left) / (right - left) * width;
            self.segment(DVec2::new(column, 0.0), DVec2::new(column, height), 0.5);
            self.paint(if position == 0.0 { axis } else { fine });
        }
        let step = round_number((self.high - self.low) / 7.0);
        for value in multiples(self.low, self.high, step) {
            let row = self.row(value);
            self.segment(DVec2::new(0.0, row), DVec2::new(width, row), 0.5);
            self.paint(if value == 0.0 { axis } else { fine });
        }
    }

    /// Stripes where F is undefined.
    fn undefined(&mut self, samples: &Samples) {
        let [width, height] = self.size;
        let Palette {
            undefined,
            undefined_stripe,
            ..
        } = &*PALETTE;
        for column in 0..width {
            if samples.values[DENSITY * column + DENSITY / 2].is_nan() {
                for row in 0..height {
                    let is_stripe = (row + column) / 4 % 2 == 0;
                    let light = if is_stripe {
                        *undefined
                    } else {
                        *undefined_stripe
                    };
                    self.lights[row * width + column] = light;
                    self.opacities[row * width + column] = 1.0;
                }
            }
        }
    }

    /// Puts everything that was drawn since the last time into the image, in this colour.
    fn paint(&mut self, color: Vec3) {
        let pixels = self.lights.iter_mut().zip(&mut self.opacities);
        for ((light, opacity), covered) in pixels.zip(&mut self.mask) {
            *light = light.lerp(color, *covered);
            *opacity = opacity.max(*covered);
            *covered = 0.0;
        }
    }

    /// Draws a line with round ends.
    fn segment(&mut self, from: DVec2, to: DVec2, half: f64) {
        let reach = half + 1.0;
        let (low, high) = (from.min(to) - reach, from.max(to) + reach);
        let range = |low: f64, high: f64, count: usize| {
            let clamped = |x: f64| x.clamp(0.0, count as f64) as usize;
            clamped(low.floor())..clamped(high.ceil())
        };
        let along = to - from;
        let length = along.length_squared();
        for row in range(low.y, high.y, self.size[1]) {
            for column in range(low.x, high.x, self.size[0]) {
                let offset = DVec2::new(column as f64 + 0.5, row as f64 + 0.5) - from;
                let part = match length > 0.0 {
                    true => (offset.dot(along) / length).clamp(0.0, 1.0),
                    false => 0.0,
                };
                let distance = (offset - part * along).length();
                let coverage = (half + 0.5 - distance).clamp(0.0, 1.0) as f32;
                let covered = &mut self.mask[row * self.size[0] + column];
                *covered = covered.max(coverage);
            }
        }
    }
}

/// The multiples of a step between two numbers.
fn multiples(low: f64, high: f64, step: f64) -> impl Iterator<Item = f64> {
    let (first, last) = ((low / step).ceil(), (high / step).floor());
    let count = if last - first < 100.0 {
        (last - first + 1.0) as usize
    } else {
        0
    };
    (0..count).map(move |index| (first + index as f64) * step)
}
