//! Light on what a camera sees: a lamp beside the eye, a sky, and shade in corners.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::Options;
use super::camera::Camera;
use super::color::{light, pixel};
use super::space::{HeightMap, Hit};
use crate::geometry::Image;
use crate::math::scalar;

/// Directions in which a point is looked at for its occlusion.
const DIRECTIONS: usize = 12;

/// Steps in each direction.
const STEPS: usize = 5;

/// How far corners reach, as a part of the shorter side of the image.
const REACH: f64 = 0.09;

/// What the materials are made of, as linear light.
struct Materials {
    surface: Vec3,
    cut: Vec3,
    jump: Vec3,
    sky: [Vec3; 2],
}

/// The image of a height map that has so many samples along each side of a pixel as the options
/// say.
pub(super) fn shade(map: &HeightMap, camera: &Camera, options: &Options) -> Image {
    let samples = options.samples;
    let (width, height) = (map.width / samples, map.height / samples);
    let materials = Materials {
        surface: light(0x6f_9f_d0),
        cut: light(0xf0_a5_5a),
        jump: light(0x9b_9b_9b),
        sky: [light(0xfc_fd_ff), light(0xe3_e8_f0)],
    };
    let mut image = Image {
        width,
        height,
        pixels: vec![[0; 4]; width * height],
    };
    let rows = image.pixels.par_chunks_mut(width).enumerate();
    rows.for_each(|(row, pixels)| {
        let fraction = (row as f32 + 0.5) / height as f32;
        let sky = materials.sky[0].lerp(materials.sky[1], fraction);
        for (column, target) in pixels.iter_mut().enumerate() {
            let (mut sum, mut covered) = (Vec3::ZERO, 0.0);
            for sample in 0..samples * samples {
                let u = column * samples + sample % samples;
                let v = row * samples + sample / samples;
                if map.hits[v * map.width + u] != Hit::Nothing {
                    sum += sample_light(map, camera, &materials, options, [u, v]);
                    covered += 1.0;
                }
            }
            let share = covered / (samples * samples) as f32;
            *target = if !options.transparent {
                let solid = sum / (samples * samples) as f32;
                pixel(solid + (1.0 - share) * sky, 1.0)
            } else if covered > 0.0 {
                pixel(sum / covered, share)
            } else {
                [0; 4]
            };
        }
    });
    image
}

/// The light from what one ray meets.
fn sample_light(
    map: &HeightMap,
    camera: &Camera,
    materials: &Materials,
    options: &Options,
    [u, v]: [usize; 2],
) -> Vec3 {
    let index = v * map.width + u;
    let ray = [u as f64 + 0.5, v as f64 + 0.5];
    let toward = camera.toward(ray);
    let normal = map.normals[index].as_dvec3();
    let is_known = normal != DVec3::ZERO;
    let normal = if is_known { normal } else { toward };
    let material = match map.hits[index] {
        Hit::Cut => materials.cut,
        Hit::Jump => materials.jump,
        Hit::Surface | Hit::Nothing => materials.surface,
    };
    let open = match options.occlusion {
        true => openness(map, camera, [u, v], normal),
        false => 1.0,
    };
    let [right, up, _] = camera.frame();
    let head = normal.dot(toward).max(0.0);
    let lamp = (toward + 0.55 * up - 0.45 * right).normalize();
    let key = normal.dot(lamp).max(0.0);
    let sky = 0.5 + 0.5 * normal.z;
    let diffuse = 0.16 * open * (0.5 + sky) + open * (0.42 * head + 0.46 * key);
    // The highlight: (n·h)^32 by squaring.
    let half = (lamp + toward).normalize();
    let mut highlight = normal.dot(half).max(0.0);
    for _ in 0..5 {
        highlight *= highlight;
    }
    let shine = match map.hits[index] {
        Hit::Surface => 0.12 * highlight * open,
        _ => 0.0,
    };
    material * diffuse as f32 + Vec3::splat(shine as f32)
}

/// How much of the sky over a surface point is open, by what the neighbouring pixels see: 1 if all
/// is. In every direction along the image the highest thing above the tangent plane counts, less
/// if it is far (in the manner of Bavoil, Sainz and Dimitrov, "Image-space horizon-based ambient
/// occlusion", SIGGRAPH 2008 talks).
fn openness(map: &HeightMap, camera: &Camera, [u, v]: [usize; 2], normal: DVec3) -> f64 {
    let screen = |u: usize, v: usize| {
        let depth = f64::from(map.depths[v * map.width + u]);
        [u as f64 + 0.5, v as f64 + 0.5, depth]
    };
    let here = screen(u, v);
    let point = camera.point(here);
    let reach = REACH * map.width.min(map.height) as f64;
    let length = reach * camera.pixel_at(here);
    let mut hidden = 0.0;
    for direction in 0..DIRECTIONS {
        let angle = std::f64::consts::TAU * (direction as f64 + 0.25) / DIRECTIONS as f64;
        let (sine, cosine) = (scalar::sin(angle), scalar::cos(angle));
        let mut highest: f64 = 0.0;
        for step in 1..=STEPS {
            // Nearer steps are shorter.
            let part = step as f64 / STEPS as f64;
            let distance = (reach * part * part).max(step as f64);
            let x = (u as f64 + distance * cosine).round();
            let y = (v as f64 + distance * sine).round();
            if x < 0.0 || y < 0.0 || x >= map.width as f64 || y >= map.height as f64 {
                break;
            }
            let (x, y) = (x as usize, y as usize);
            if map.hits[y * map.width + x] == Hit::Nothing {
                continue;
            }
            let offset = camera.point(screen(x, y)) - point;
            let far = offset.length();
            let sine = offset.dot(normal) / far.max(f64::MIN_POSITIVE);
            let falloff = (1.0 - (far / (1.5 * length)) * (far / (1.5 * length))).max(0.0);
            // A little is noise of the pixels' raster.
            highest = highest.max((sine - 0.08) * falloff);
        }
        hidden += highest;
    }
    (1.0 - 1.1 * hidden / DIRECTIONS as f64).max(0.0)
}
