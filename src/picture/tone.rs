//! Colours of maps of the plane.
//!
//! The first-order distance |F|/|F_x| (Taubin, "Distance approximations for rasterizing implicit
//! curves", ACM Transactions on Graphics 13, 1994) is measured in pixels: it shades both sides in
//! bands of even width, and makes lines as wide as they should be, whatever the scale of F.

use glam::Vec3;
use rayon::prelude::*;

use super::color::{PALETTE, pixel};
use super::plane::{Bitmap, Shades, Side};
use super::{Options, Picture, Statistics};
use crate::geometry::Image;
use crate::math::scalar;

/// About how many contour lines a picture's side crosses.
const CONTOURS: f64 = 20.0;

/// Contour lines that would be closer than this, in pixels, are thinned out.
const CLOSEST: f64 = 9.0;

/// Half the width of the line F = 0 in pixels.
const HALF_LINE: f32 = 1.1;

/// Half the width of a contour line.
const HALF_CONTOUR: f32 = 0.5;

/// The width of a band of the shading, as a part of the longer side of the image.
const BAND: f32 = 0.05;

/// How dark a contour line is.
const CONTOUR_DARKNESS: f32 = 0.38;

/// Two colours; grey where F is undefined.
pub(super) fn fill(map: &Bitmap, is_transparent: bool) -> Image {
    let transparent = [0; 4];
    let [inside, outside, undefined, paper] = [
        pixel(PALETTE.inside_near, 1.0),
        pixel(PALETTE.outside_far, 1.0),
        pixel(PALETTE.undefined, 1.0),
        pixel(PALETTE.paper, 1.0),
    ];
    let color = |side: &Side| match side {
        Side::Inside => inside,
        Side::Undefined => undefined,
        _ if is_transparent => transparent,
        Side::Outside => outside,
        Side::Beyond => paper,
    };
    Image {
        width: map.width,
        height: map.height,
        pixels: map.sides.iter().map(color).collect(),
    }
}

/// Shades, contour lines and the line F = 0.
pub(super) fn shade(shades: &Shades, options: &Options) -> Picture {
    let [width, height] = shades.frame.size;
    let longest = width.max(height) as f32;
    let step = options.step.or_else(|| suitable_step(shades));
    let mut pixels = vec![[0; 4]; width * height];
    let rows = pixels.par_chunks_mut(width).enumerate();
    let counts: Vec<[usize; 2]> = rows
        .map(|(row, pixels)| {
            let [mut inside, mut undefined] = [0, 0];
            for (column, target) in pixels.iter_mut().enumerate() {
                let index = row * width + column;
                let value = shades.values[index];
                let is_beyond = value.is_nan() && !shades.frame.contains(column, row);
                inside += usize::from(value < 0.0);
                undefined += usize::from(value.is_nan() && !is_beyond);
                let (light, opacity) = match value.is_nan() {
                    true if is_beyond => (PALETTE.paper, 0.0),
                    true if (row + column) / 4 % 2 == 0 => (PALETTE.undefined, 1.0),
                    true => (PALETTE.undefined_stripe, 1.0),
                    false => tone(value, shades.slopes[index], longest, step),
                };
                let opacity = if options.transparent { opacity } else { 1.0 };
                *target = match opacity > 0.0 {
                    true => pixel(light, opacity),
                    false => [0; 4],
                };
            }
            [inside, undefined]
        })
        .collect();
    let total = |kind: usize| counts.iter().map(|counts| counts[kind]).sum::<usize>();
    Picture {
        image: Image {
            width,
            height,
            pixels,
        },
        statistics: Statistics {
            covered: total(0) as f64 / (width * height) as f64,
            undefined: total(1) as u64,
            jumps: 0,
            step,
        },
    }
}

/// The light of a pixel with this F, and how opaque it is where the outside is not wanted.
fn tone(value: f64, slope: f32, longest: f32, step: Option<f64>) -> (Vec3, f32) {
    // Pixels to F = 0: 0 on it, infinite where F does not change.
    let magnitude = value.abs() as f32;
    let distance = match magnitude == 0.0 {
        true => 0.0,
        false => (magnitude / slope).min(f32::MAX),
    };
    let distance = if distance.is_nan() {
        f32::MAX
    } else {
        distance
    };
    let signed = if value < 0.0 { -distance } else { distance };
    let reach = (distance / (0.35 * longest)).min(16.0);
    let part = 1.0 - scalar::exp(-f64::from(reach)) as f32;
    let inside = PALETTE.inside_near.lerp(PALETTE.inside_far, part);
    let outside = PALETTE.outside_near.lerp(PALETTE.outside_far, part);
    // The edge is half covered where it goes through the middle of a pixel.
    let coverage = (0.5 - signed).clamp(0.0, 1.0);
    let mut light = outside.lerp(inside, coverage);
    let band = distance / (BAND * longest);
    if band < 64.0 {
        // Between the edges of bands brightness rises a little, as in a relief.
        light *= 0.955 + 0.07 * band.fract();
    }
    if let Some(step) = step {
        light *= 1.0 - CONTOUR_DARKNESS * contour(value, f64::from(slope), step);
    }
    let line = (HALF_LINE + 0.5 - distance).clamp(0.0, 1.0);
    (light.lerp(PALETTE.line, line), line.max(coverage))
}

/// How much of a pixel a contour line covers, lines where F is a multiple of the step. Where
/// lines would be too close, every other one fades out, and again.
fn contour(value: f64, slope: f64, step: f64) -> f32 {
    let spacing = step / slope;
    if !(spacing.is_finite() && value.is_finite()) {
        return 0.0;
    }
    let (mut step, mut fading) = (step, 0.0);
    if spacing < CLOSEST {
        let level = scalar::log(CLOSEST / spacing) / std::f64::consts::LN_2;
        if level > 64.0 {
            return 0.0;
        }
        step *= (0..level as usize).fold(1.0, |factor, _| 2.0 * factor);
        fading = level - level.floor();
    }
    let line = |step: f64| {
        let offset = (value / step - (value / step).round()).abs() * step;
        (HALF_CONTOUR + 0.5 - (offset / slope) as f32).clamp(0.0, 1.0)
    };
    line(2.0 * step).max((1.0 - fading as f32) * line(step))
}

/// 1, 2 or 5 times a power of 10, so that the picture is crossed by about [`CONTOURS`] lines;
/// nothing where F does not change.
fn suitable_step(shades: &Shades) -> Option<f64> {
    let stride = (shades.slopes.len() / 65_536).max(1);
    let slopes = shades.slopes.iter().step_by(stride);
    let mut slopes: Vec<f32> = slopes
        .copied()
        .filter(|slope| *slope > 0.0 && slope.is_finite())
        .collect();
    if slopes.is_empty() {
        return None;
    }
    let middle = slopes.len() / 2;
    let (_, median, _) = slopes.select_nth_unstable_by(middle, f32::total_cmp);
    let longest = shades.frame.size[0].max(shades.frame.size[1]) as f64;
    Some(round_number(f64::from(*median) * longest / CONTOURS))
}

/// The nearest of the numbers 1, 2 and 5 times a power of 10, in proportion.
pub(super) fn round_number(number: f64) -> f64 {
    let exponent = (scalar::log(number) / std::f64::consts::LN_10).floor();
    let power = scalar::pow(10.0, exponent);
    let leading = number / power;
    // The bounds are geometric means of neighbours.
    let factor = match leading {
        _ if leading < std::f64::consts::SQRT_2 => 1.0,
        _ if leading < 3.162 => 2.0,
        _ if leading < 7.071 => 5.0,
        _ => 10.0,
    };
    factor * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_numbers_are_near() {
        for (number, expected) in [
            (1.0, 1.0),
            (1.5, 2.0),
            (4.0, 5.0),
            (8.0, 10.0),
            (0.03, 0.02),
            (0.0066, 0.005),
        ] {
            let found = round_number(number);
            assert!((found / expected - 1.0).abs() < 1e-12, "{number}: {found}");
        }
    }

    #[test]
    fn contour_lines_are_a_pixel_wide_and_thin_out() {
        // F rises by 0.05 a pixel, so lines of step 1 are 20 pixels apart.
        let covered = |value: f64| contour(value, 0.05, 1.0);
        assert_eq!(covered(3.0), 1.0);
        assert_eq!(covered(3.5), 0.0);
        assert!((covered(3.0 + 0.05 * 0.5) - 0.5).abs() < 1e-6);
        // 400 times as steep, 1 is 0.05 pixels; the lines that are left are multiples of 128
        // (6.4 pixels) fading out and of 256.
        let covered = |value: f64| contour(value, 20.0, 1.0);
        assert_eq!(covered(256.0), 1.0);
        assert!(covered(128.0) < 1.0 && covered(128.0) > 0.0);
        assert_eq!(covered(64.0 + 10.0), 0.0);
    }
}
