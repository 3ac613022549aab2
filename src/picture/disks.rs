//! Pictures of samples: disks on the surface, as Witkin and Heckbert show their floaters, and dots
//! in the plane.
//!
//! Each disk is tangent to the surface and as large as its point's radius; of two disks the nearer
//! one is seen. Backs, whose normals point away from the eye, have the colour of cuts, and so have
//! marks, such as control points, which are balls. The cost is linear in the points and in the pixels
//! that their disks cover.

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

use super::camera::{Aim, Camera};
use super::color::{PALETTE, pixel};
use super::light;
use super::space::{HeightMap, Hit};
use super::{Options, Picture, PictureError, Statistics, bad, check_angles, checked_film};
use crate::geometry::{Bounds, Image, Samples};

/// Disks are smaller than the radii by this factor, so that they are seen apart.
const APART: f64 = 0.92;

/// Dots in the plane: their radius in units of the points', and at least, in pixels.
const DOT: (f64, f64) = (0.4, 1.25);

/// What covers a part of a pixel in the plane.
const NOTHING: u8 = 0;
const POINT: u8 = 1;
const MARKED: u8 = 2;

/// How much wider than what is seen the picture is.
const FRAME: f64 = 0.06;

/// How much larger than the points the box is.
const MARGIN: f64 = 0.04;

/// Marks are balls of so many mean radii, and in the plane dots so much larger than the others.
const MARK: f64 = 1.5;
const MARK_DOT: f64 = 2.0;

/// What is seen in a picture of points.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// The points with their normals and radii.
    pub samples: &'a Samples,
    /// Points that stand out.
    pub marks: &'a [DVec3],
}

/// Pictures of samples in R2 or R3, all from one eye: in the plane dots, in space lit disks. Of the
/// options all count but the style and the step.
///
/// # Errors
///
/// For samples of another dimension than the box or in R1, without any points, and for the reasons
/// of [`super::render`].
pub fn render_samples(
    scenes: &[Scene<'_>],
    options: &Options,
) -> Result<Vec<Picture>, PictureError> {
    let dimension = options.bounds.dimension;
    let other = scenes
        .iter()
        .find(|scene| scene.samples.dimension != dimension);
    if let Some(scene) = other {
        return Err(PictureError::WrongDimension {
            field: scene.samples.dimension,
            bounds: dimension,
        });
    }
    if dimension == 1
        || scenes
            .iter()
            .all(|scene| scene.samples.positions.is_empty())
    {
        let message = "samples are shown in R2 and R3, and there must be some".to_owned();
        return bad("f", message);
    }
    let size = checked_film(options, scenes.len())?;
    check_angles(options)?;
    if dimension == 2 {
        let pictures = scenes.par_iter().map(|scene| dots(scene, options, size));
        return Ok(pictures.collect());
    }
    let aim = Aim {
        bounds: options.bounds,
        view: options.view,
        perspective: options.perspective,
        size: size.map(|count| count * options.samples),
    };
    let mut camera = Camera::new(&aim);
    if !options.whole {
        camera = closer(&camera, scenes);
    }
    let pictures = scenes
        .par_iter()
        .map(|scene| disks(scene, options, &camera));
    Ok(pictures.collect())
}

/// The box around samples with their disks, and around marks.
pub fn box_around(scenes: &[Scene<'_>]) -> Option<Bounds> {
    let dimension = scenes.first()?.samples.dimension;
    let places = scenes
        .iter()
        .flat_map(|scene| scene.samples.positions.iter().chain(scene.marks));
    let around = Bounds::of_points(dimension, places.copied())?;
    let radii = scenes.iter().flat_map(|scene| &scene.samples.radii);
    let radius = radii.copied().fold(0.0, f64::max);
    let margin = radius + MARGIN * around.diagonal() + f64::MIN_POSITIVE;
    let sides: Vec<(f64, f64)> = around
        .sides()
        .map(|(low, high)| (low - margin, high + margin))
        .collect();
    Bounds::from_sides(&sides)
}

fn disks(scene: &Scene<'_>, options: &Options, camera: &Camera) -> Picture {
    let samples = scene.samples;
    let [width, height] = camera.size();
    let mut map = HeightMap {
        width,
        height,
        hits: vec![Hit::Nothing; width * height],
        depths: vec![f32::INFINITY; width * height],
        normals: vec![Vec3::ZERO; width * height],
        undefined: 0,
    };
    for (place, &center) in samples.positions.iter().enumerate() {
        let normal = samples.normals.get(place).copied().unwrap_or(DVec3::ZERO);
        let radius = APART * samples.radii.get(place).copied().unwrap_or(0.0);
        paint(&mut map, camera, center, normal, radius);
    }
    let radius = MARK * samples.radii.iter().sum::<f64>() / samples.radii.len().max(1) as f64;
    for &center in scene.marks {
        ball(&mut map, camera, center, radius);
    }
    let covered = map.hits.iter().filter(|&&hit| hit != Hit::Nothing).count();
    Picture {
        image: light::shade(&map, camera, options),
        statistics: Statistics {
            covered: covered as f64 / map.hits.len() as f64,
            ..Statistics::default()
        },
    }
}

/// The camera that sees just the disks, where the box is seen larger.
fn closer(camera: &Camera, scenes: &[Scene<'_>]) -> Camera {
    let size = camera.size().map(|count| count as f64);
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let disks = scenes.iter().flat_map(|scene| {
        let marks = scene.marks.iter().map(|mark| (mark, 0.0));
        let radii = scene.samples.radii.iter().copied();
        scene.samples.positions.iter().zip(radii).chain(marks)
    });
    for (center, radius) in disks {
        if let Some(screen) = camera.screen(*center) {
            let reach = radius / camera.pixel_at(screen) + 1.0;
            let place = DVec2::new(screen[0], screen[1]);
            low = low.min(place - reach);
            high = high.max(place + reach);
        }
    }
    let margin = 0.5 * FRAME * (high - low);
    let (low, high) = (low - margin, high + margin);
    let part = [
        low.x.max(0.0),
        low.y.max(0.0),
        high.x.min(size[0]),
        high.y.min(size[1]),
    ];
    match part[0] < part[2] && part[1] < part[3] {
        true => camera.framed(part),
        false => camera.clone(),
    }
}

/// Paints a disk where it is the nearest.
fn paint(map: &mut HeightMap, camera: &Camera, center: DVec3, normal: DVec3, radius: f64) {
    let Some([u, v, depth]) = camera.screen(center) else {
        return;
    };
    // Disks are not smaller than a pixel, or points would come and go.
    let reach = (radius / camera.pixel_at([u, v, depth])).max(0.75);
    let radius = reach * camera.pixel_at([u, v, depth]);
    let toward = camera.toward([u, v]);
    let normal = if normal == DVec3::ZERO {
        toward
    } else {
        normal
    };
    let facing = if normal.dot(toward) >= 0.0 {
        normal
    } else {
        -normal
    };
    let hit = if normal.dot(toward) >= 0.0 {
        Hit::Surface
    } else {
        Hit::Cut
    };
    let range = |middle: f64, end: usize| {
        let low = (middle - 1.5 * reach).floor().max(0.0) as usize;
        let high = (middle + 1.5 * reach).ceil().clamp(0.0, end as f64) as usize;
        low..high
    };
    for row in range(v, map.height) {
        for column in range(u, map.width) {
            let at = [column as f64 + 0.5, row as f64 + 0.5];
            let start = camera.point([at[0], at[1], 0.0]);
            let step = camera.point([at[0], at[1], 1.0]) - start;
            // An edge-on disk is a line, which no ray meets: it counts as turned by a degree.
            let slope = facing.dot(step).min(-0.02 * step.length());
            let depth = facing.dot(center - start) / slope;
            let met = start + depth * step;
            let index = row * map.width + column;
            if met.distance_squared(center) <= radius * radius && (depth as f32) < map.depths[index]
            {
                map.depths[index] = depth as f32;
                map.hits[index] = hit;
                map.normals[index] = facing.as_vec3();
            }
        }
    }
}

/// Paints a ball where it is the nearest.
fn ball(map: &mut HeightMap, camera: &Camera, center: DVec3, radius: f64) {
    let Some([u, v, depth]) = camera.screen(center) else {
        return;
    };
    let reach = (radius / camera.pixel_at([u, v, depth])).max(1.5);
    let radius = reach * camera.pixel_at([u, v, depth]);
    let range = |middle: f64, end: usize| {
        let low = (middle - 1.5 * reach).floor().max(0.0) as usize;
        low..(middle + 1.5 * reach).ceil().clamp(0.0, end as f64) as usize
    };
    for row in range(v, map.height) {
        for column in range(u, map.width) {
            let at = [column as f64 + 0.5, row as f64 + 0.5];
            let start = camera.point([at[0], at[1], 0.0]);
            let step = camera.point([at[0], at[1], 1.0]) - start;
            // Where the ray first meets the ball.
            let (from, length) = (start - center, step.length());
            let along = step / length;
            let nearest = -from.dot(along);
            let inside = radius * radius - (from + nearest * along).length_squared();
            if inside < 0.0 {
                continue;
            }
            let distance = nearest - inside.sqrt();
            let depth = (distance / length) as f32;
            let index = row * map.width + column;
            if depth < map.depths[index] {
                map.depths[index] = depth;
                map.hits[index] = Hit::Cut;
                map.normals[index] = ((from + distance * along) / radius).as_vec3();
            }
        }
    }
}

fn dots(scene: &Scene<'_>, options: &Options, size: [usize; 2]) -> Picture {
    let fine = size.map(|count| count * options.samples);
    let bounds = options.bounds;
    let per_unit = (fine[0] as f64 / bounds.size().x).min(fine[1] as f64 / bounds.size().y);
    let middle = DVec2::new(0.5 * fine[0] as f64, 0.5 * fine[1] as f64);
    let samples = scene.samples;
    let mut covered = vec![NOTHING; fine[0] * fine[1]];
    let mean = samples.radii.iter().sum::<f64>() / samples.radii.len().max(1) as f64;
    let points = samples.positions.iter().zip(&samples.radii);
    let points = points.map(|(&point, &radius)| (point, radius, POINT));
    let marks = scene
        .marks
        .iter()
        .map(|&mark| (mark, MARK_DOT * mean, MARKED));
    for (point, radius, kind) in points.chain(marks) {
        let offset = per_unit * (point - bounds.center());
        let center = middle + DVec2::new(offset.x, -offset.y);
        let least = DOT.1 * options.samples as f64 * if kind == MARKED { MARK_DOT } else { 1.0 };
        let radius = (DOT.0 * per_unit * radius).max(least);
        let range = |middle: f64, end: usize| {
            let low = (middle - radius).floor().clamp(0.0, end as f64) as usize;
            low..(middle + radius).ceil().clamp(0.0, end as f64) as usize
        };
        for row in range(center.y, fine[1]) {
            for column in range(center.x, fine[0]) {
                let at = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
                if at.distance_squared(center) <= radius * radius {
                    covered[row * fine[0] + column] = kind;
                }
            }
        }
    }
    let mut image = Image {
        width: size[0],
        height: size[1],
        pixels: Vec::with_capacity(size[0] * size[1]),
    };
    let number = options.samples * options.samples;
    for row in 0..size[1] {
        for column in 0..size[0] {
            let parts = (0..number).map(|part| {
                let u = column * options.samples + part % options.samples;
                let v = row * options.samples + part / options.samples;
                covered[v * fine[0] + u]
            });
            let (mut light, mut number_of) = (Vec3::ZERO, 0);
            for kind in parts.filter(|&kind| kind != NOTHING) {
                light += if kind == MARKED {
                    PALETTE.outside_near
                } else {
                    PALETTE.line
                };
                number_of += 1;
            }
            let share = number_of as f32 / number as f32;
            let light = light / number_of.max(1) as f32;
            image.pixels.push(match options.transparent {
                true => pixel(light, share),
                false => pixel(PALETTE.paper.lerp(light, share), 1.0),
            });
        }
    }
    let dark = covered.iter().filter(|&&kind| kind != NOTHING).count();
    Picture {
        image,
        statistics: Statistics {
            covered: dark as f64 / covered.len() as f64,
            ..Statistics::default()
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::{Size, View};

    fn samples(places: &[(DVec3, DVec3, f64)], dimension: usize) -> Samples {
        Samples {
            dimension,
            positions: places.iter().map(|place| place.0).collect(),
            normals: places.iter().map(|place| place.1).collect(),
            radii: places.iter().map(|place| place.2).collect(),
            ..Samples::default()
        }
    }

    fn options(dimension: usize) -> Options {
        Options {
            size: Size::Longest(200),
            samples: 1,
            whole: true,
            transparent: true,
            view: View::named("front").unwrap(),
            ..Options::new(Bounds::from_sides(&vec![(-1.0, 1.0); dimension]).unwrap())
        }
    }

    fn scene(samples: &Samples) -> Scene<'_> {
        Scene {
            samples,
            marks: &[],
        }
    }

    fn one(samples: &Samples, dimension: usize) -> Picture {
        let pictures = render_samples(&[scene(samples)], &options(dimension));
        pictures.unwrap().remove(0)
    }

    #[test]
    fn marks_are_balls_of_another_colour_that_may_hide_and_be_hidden() {
        let disk = samples(&[(DVec3::ZERO, DVec3::NEG_Y, 0.2)], 3);
        let seen = |mark: DVec3| {
            let scene = Scene {
                samples: &disk,
                marks: &[mark],
            };
            render_samples(&[scene], &options(3)).unwrap().remove(0)
        };
        let area = std::f64::consts::PI * 0.3 * 0.3 / 4.0;
        let before = seen(DVec3::new(0.0, -0.5, 0.0));
        assert!((before.statistics.covered - area).abs() < 0.01 * area + 1e-3);
        let colour = |picture: &Picture| picture.image.pixels[100 * 200 + 100];
        let behind = seen(DVec3::new(0.0, 0.5, 0.0));
        assert!(colour(&before)[0] > colour(&before)[2]);
        assert!(colour(&behind)[2] > colour(&behind)[0]);
    }

    #[test]
    fn a_disk_covers_the_area_of_its_projection() {
        // Seen from the front, at negative y; the second one is turned by 60 degrees.
        for (normal, share) in [
            (DVec3::NEG_Y, 1.0),
            (DVec3::new(0.75_f64.sqrt(), -0.5, 0.0), 0.5),
        ] {
            let disk = samples(&[(DVec3::new(0.2, 0.0, 0.1), normal, 0.5)], 3);
            let picture = one(&disk, 3);
            let area = share * std::f64::consts::PI * (APART * 0.5).powi(2) / 4.0;
            assert!((picture.statistics.covered - area).abs() < 0.01 * area + 1e-3);
        }
    }

    #[test]
    fn the_nearer_disk_is_seen_and_backs_have_another_colour() {
        let near = (DVec3::new(0.0, -0.5, 0.0), DVec3::NEG_Y, 0.5);
        let far = (DVec3::new(0.0, 0.5, 0.0), DVec3::Y, 0.5);
        let middle = |places: &[(DVec3, DVec3, f64)]| {
            let picture = one(&samples(places, 3), 3);
            picture.image.pixels[100 * 200 + 100]
        };
        let (front, back) = (middle(&[near]), middle(&[far]));
        assert!(front[2] > front[0] && back[0] > back[2]);
        assert_eq!(middle(&[near, far]), front);
        assert_eq!(middle(&[far, near]), front);
    }

    #[test]
    fn dots_lie_where_points_are() {
        let dot = samples(&[(DVec3::new(0.5, 0.5, 0.0), DVec3::X, 0.1)], 2);
        let image = one(&dot, 2).image;
        let opaque = |x: usize, y: usize| image.pixels[y * 200 + x][3] == 255;
        // y is up: the upper right quarter.
        assert!(opaque(150, 50) && !opaque(150, 150) && !opaque(50, 50));
    }

    #[test]
    fn nothing_and_the_line_are_refused() {
        let empty = samples(&[], 3);
        let none = render_samples(&[scene(&empty)], &options(3));
        assert!(matches!(none, Err(PictureError::BadOption { .. })));
        let root = samples(&[(DVec3::ZERO, DVec3::X, 0.1)], 1);
        assert!(matches!(
            render_samples(&[scene(&root)], &options(1)),
            Err(PictureError::BadOption { .. })
        ));
        assert!(matches!(
            render_samples(&[scene(&root)], &options(2)),
            Err(PictureError::WrongDimension { .. })
        ));
    }
}
