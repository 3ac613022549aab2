//! Pictures of samples: disks on the surface, as Witkin and Heckbert show their floaters, and dots
//! in the plane.
//!
//! Each disk is tangent to the surface and as large as its point's radius; of two disks the nearer
//! one is seen. Backs, whose normals point away from the eye, have the colour of cuts. The cost is
//! linear in the points and in the pixels that their disks cover.

use glam::{DVec2, DVec3, Vec3};

use super::camera::{Aim, Camera};
use super::color::{PALETTE, pixel};
use super::light;
use super::space::{HeightMap, Hit};
use super::{Options, Picture, PictureError, Statistics, bad, check_angles, checked_size};
use crate::geometry::{Bounds, Image, Samples};

/// Disks are smaller than the radii by this factor, so that they are seen apart.
const APART: f64 = 0.92;

/// Dots in the plane: their radius in units of the points', and at least, in pixels.
const DOT: (f64, f64) = (0.4, 1.25);

/// How much wider than what is seen the picture is.
const FRAME: f64 = 0.06;

/// How much larger than the points the box is.
const MARGIN: f64 = 0.04;

/// A picture of samples in R2 or R3: in the plane dots, in space lit disks. Of the options all count
/// but the style and the step.
///
/// # Errors
///
/// For samples of another dimension than the box or in R1, without any points, and for the reasons
/// of [`super::render`].
pub fn render_samples(samples: &Samples, options: &Options) -> Result<Picture, PictureError> {
    if samples.dimension != options.bounds.dimension {
        return Err(PictureError::WrongDimension {
            field: samples.dimension,
            bounds: options.bounds.dimension,
        });
    }
    if samples.dimension == 1 || samples.positions.is_empty() {
        let message = "samples are shown in R2 and R3, and there must be some".to_owned();
        return bad("f", message);
    }
    let size = checked_size(options)?;
    check_angles(options)?;
    Ok(match samples.dimension {
        2 => dots(samples, options, size),
        _ => disks(samples, options, size),
    })
}

/// The box around samples with their disks.
pub fn box_around(samples: &Samples) -> Option<Bounds> {
    let around = Bounds::of_points(samples.dimension, samples.positions.iter().copied())?;
    let radius = samples.radii.iter().copied().fold(0.0, f64::max);
    let margin = radius + MARGIN * around.diagonal() + f64::MIN_POSITIVE;
    let sides: Vec<(f64, f64)> = around
        .sides()
        .map(|(low, high)| (low - margin, high + margin))
        .collect();
    Bounds::from_sides(&sides)
}

fn disks(samples: &Samples, options: &Options, size: [usize; 2]) -> Picture {
    let aim = Aim {
        bounds: options.bounds,
        view: options.view,
        perspective: options.perspective,
        size: size.map(|count| count * options.samples),
    };
    let mut camera = Camera::new(&aim);
    if !options.whole {
        camera = closer(&camera, samples);
    }
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
        paint(&mut map, &camera, center, normal, radius);
    }
    let covered = map.hits.iter().filter(|&&hit| hit != Hit::Nothing).count();
    Picture {
        image: light::shade(&map, &camera, options),
        statistics: Statistics {
            covered: covered as f64 / map.hits.len() as f64,
            ..Statistics::default()
        },
    }
}

/// The camera that sees just the disks, where the box is seen larger.
fn closer(camera: &Camera, samples: &Samples) -> Camera {
    let size = camera.size().map(|count| count as f64);
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for (center, radius) in samples.positions.iter().zip(&samples.radii) {
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

fn dots(samples: &Samples, options: &Options, size: [usize; 2]) -> Picture {
    let fine = size.map(|count| count * options.samples);
    let bounds = options.bounds;
    let per_unit = (fine[0] as f64 / bounds.size().x).min(fine[1] as f64 / bounds.size().y);
    let middle = DVec2::new(0.5 * fine[0] as f64, 0.5 * fine[1] as f64);
    let mut covered = vec![false; fine[0] * fine[1]];
    for (place, &point) in samples.positions.iter().enumerate() {
        let offset = per_unit * (point - bounds.center());
        let center = middle + DVec2::new(offset.x, -offset.y);
        let radius = samples.radii.get(place).copied().unwrap_or(0.0);
        let radius = (DOT.0 * per_unit * radius).max(DOT.1 * options.samples as f64);
        let range = |middle: f64, end: usize| {
            let low = (middle - radius).floor().clamp(0.0, end as f64) as usize;
            low..(middle + radius).ceil().clamp(0.0, end as f64) as usize
        };
        for row in range(center.y, fine[1]) {
            for column in range(center.x, fine[0]) {
                let at = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
                covered[row * fine[0] + column] |= at.distance_squared(center) <= radius * radius;
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
            let parts = (0..number).filter(|part| {
                let u = column * options.samples + part % options.samples;
                let v = row * options.samples + part / options.samples;
                covered[v * fine[0] + u]
            });
            let share = parts.count() as f32 / number as f32;
            image.pixels.push(match options.transparent {
                true => pixel(PALETTE.line, share),
                false => pixel(PALETTE.paper.lerp(PALETTE.line, share), 1.0),
            });
        }
    }
    let dark = covered.iter().filter(|&&is_covered| is_covered).count();
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

    #[test]
    fn a_disk_covers_the_area_of_its_projection() {
        // Seen from the front, at negative y; the second one is turned by 60 degrees.
        for (normal, share) in [
            (DVec3::NEG_Y, 1.0),
            (DVec3::new(0.75_f64.sqrt(), -0.5, 0.0), 0.5),
        ] {
            let disk = samples(&[(DVec3::new(0.2, 0.0, 0.1), normal, 0.5)], 3);
            let picture = render_samples(&disk, &options(3)).unwrap();
            let area = share * std::f64::consts::PI * (APART * 0.5).powi(2) / 4.0;
            assert!((picture.statistics.covered - area).abs() < 0.01 * area + 1e-3);
        }
    }

    #[test]
    fn the_nearer_disk_is_seen_and_backs_have_another_colour() {
        let near = (DVec3::new(0.0, -0.5, 0.0), DVec3::NEG_Y, 0.5);
        let far = (DVec3::new(0.0, 0.5, 0.0), DVec3::Y, 0.5);
        let middle = |places: &[(DVec3, DVec3, f64)]| {
            let picture = render_samples(&samples(places, 3), &options(3)).unwrap();
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
        let image = render_samples(&dot, &options(2)).unwrap().image;
        let opaque = |x: usize, y: usize| image.pixels[y * 200 + x][3] == 255;
        // y is up: the upper right quarter.
        assert!(opaque(150, 50) && !opaque(150, 150) && !opaque(50, 50));
    }

    #[test]
    fn nothing_and_the_line_are_refused() {
        let none = render_samples(&samples(&[], 3), &options(3));
        assert!(matches!(none, Err(PictureError::BadOption { .. })));
        let root = samples(&[(DVec3::ZERO, DVec3::X, 0.1)], 1);
        assert!(matches!(
            render_samples(&root, &options(1)),
            Err(PictureError::BadOption { .. })
        ));
        assert!(matches!(
            render_samples(&root, &options(2)),
            Err(PictureError::WrongDimension { .. })
        ));
    }
}
