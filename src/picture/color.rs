//! Colours: the palette, and the way from light to the numbers of a file.
//!
//! Colours are mixed as light, in linear sRGB, and encoded once (IEC 61966-2-1).

use std::sync::LazyLock;

use glam::Vec3;

use crate::math::scalar;

/// How finely the encoding is tabulated: far below a step of eight bits where it is steepest.
const STEPS: usize = 1 << 14;

/// The encoded values of evenly spaced amounts of light from 0 to 1.
static ENCODED: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let encode = |step: usize| {
        let light = step as f64 / STEPS as f64;
        let value = if light <= 0.003_130_8 {
            12.92 * light
        } else {
            1.055 * scalar::pow(light, 1.0 / 2.4) - 0.055
        };
        (255.0 * value).round() as u8
    };
    (0..=STEPS).map(encode).collect()
});

/// The light of every encoded value.
static DECODED: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|value| {
        let value = value as f64 / 255.0;
        let light = if value <= 0.040_45 {
            value / 12.92
        } else {
            scalar::pow((value + 0.055) / 1.055, 2.4)
        };
        light as f32
    })
});

/// The light of a colour that is written as `0xrrggbb`.
pub(super) fn light(rgb: u32) -> Vec3 {
    let [_, r, g, b] = rgb.to_be_bytes();
    Vec3::from_array([r, g, b].map(|value| DECODED[usize::from(value)]))
}

/// A pixel of this light and opacity.
pub(super) fn pixel(light: Vec3, opacity: f32) -> [u8; 4] {
    let place = |light: f32| (light.clamp(0.0, 1.0) * STEPS as f32 + 0.5) as usize;
    let [r, g, b] = light.to_array().map(|light| ENCODED[place(light)]);
    [r, g, b, (255.0 * opacity.clamp(0.0, 1.0)).round() as u8]
}

/// The colours of maps and graphs.
pub(super) struct Palette {
    pub(super) inside_near: Vec3,
    pub(super) inside_far: Vec3,
    pub(super) outside_near: Vec3,
    pub(super) outside_far: Vec3,
    /// The line F = 0, and the curve of a graph.
    pub(super) line: Vec3,
    pub(super) undefined: Vec3,
    pub(super) undefined_stripe: Vec3,
    pub(super) paper: Vec3,
}

/// The palette.
pub(super) static PALETTE: LazyLock<Palette> = LazyLock::new(|| Palette {
    inside_near: light(0x3d_7d_b8),
    inside_far: light(0xa9_d3_ee),
    outside_near: light(0xe8_b2_6d),
    outside_far: light(0xfa_f1_e0),
    line: light(0x14_24_42),
    undefined: light(0x9b_9b_9b),
    undefined_stripe: light(0x8a_8a_8a),
    paper: light(0xff_ff_ff),
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_encoded_value_comes_back() {
        for value in 0..=255u32 {
            let rgb = value << 16 | (255 - value) << 8 | value;
            let [r, g, b, opacity] = pixel(light(rgb), 1.0);
            assert_eq!(u32::from_be_bytes([0, r, g, b]), rgb);
            assert_eq!(opacity, 255);
        }
    }

    #[test]
    fn half_of_the_light_is_188() {
        // 1.055·0.5^(1/2.4) − 0.055 = 0.7354, times 255.
        assert_eq!(pixel(Vec3::splat(0.5), 0.5), [188, 188, 188, 128]);
        assert_eq!(pixel(Vec3::splat(7.0), -1.0), [255, 255, 255, 0]);
    }
}
