//! Pictures of triangle meshes, lit like solids, with smooth normals where the mesh has them.
//!
//! Of two triangles the nearer one is seen. Backs have the colour of cuts; ground, if it is shown, lies in
//! the plane z = 0 below the box. The cost is linear in the triangles and in the pixels that they cover.

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

use super::camera::{Aim, Camera};
use super::light;
use super::space::{HeightMap, Hit};
use super::{Options, Picture, PictureError, Statistics, bad, check_angles, checked_film};
use crate::geometry::{Bounds, Mesh};

/// Vertices whose normals have a smaller cosine with a facet's are on an edge of it: 26 degrees.
const SMOOTH: f64 = 0.9;

/// How much larger than the points the box is, in parts of its diagonal.
const MARGIN: f64 = 0.04;

/// The box around points, with a margin; `None` without points.
pub fn box_around_points(
    dimension: usize,
    points: impl IntoIterator<Item = DVec3>,
) -> Option<Bounds> {
    let around = Bounds::of_points(dimension, points)?;
    let around = around.expanded(MARGIN * around.diagonal() + f64::MIN_POSITIVE);
    let sides: Vec<(f64, f64)> = around.sides().collect();
    Bounds::from_sides(&sides)
}

/// Pictures of meshes, all from one eye. Of the options all count but the style and the step.
///
/// # Errors
///
/// For a box that is not in R3, for meshes without triangles, and for the reasons of [`super::render`].
pub fn render_meshes(
    meshes: &[Mesh],
    ground: bool,
    options: &Options,
) -> Result<Vec<Picture>, PictureError> {
    if options.bounds.dimension != 3 {
        return Err(PictureError::WrongDimension {
            field: 3,
            bounds: options.bounds.dimension,
        });
    }
    if meshes.iter().all(|mesh| mesh.triangles.is_empty()) {
        return bad("f", "there is no triangle to be shown".to_owned());
    }
    let size = checked_film(options, meshes.len())?;
    check_angles(options)?;
    let aim = Aim {
        bounds: options.bounds,
        view: options.view,
        perspective: options.perspective,
        size: size.map(|count| count * options.samples),
    };
    let ground = ground.then(|| floor(&options.bounds));
    let mut camera = Camera::new(&aim);
    if !options.whole {
        let points = meshes.iter().flat_map(|mesh| &mesh.positions);
        camera = closer(&camera, points.chain(ground.iter().flatten()));
    }
    let pictures = meshes
        .par_iter()
        .map(|mesh| picture(mesh, ground.as_ref(), options, &camera));
    Ok(pictures.collect())
}

/// The corners of the ground below a box.
fn floor(bounds: &Bounds) -> [DVec3; 4] {
    let (low, high) = (bounds.min, bounds.max);
    [
        (low.x, low.y),
        (high.x, low.y),
        (high.x, high.y),
        (low.x, high.y),
    ]
    .map(|(x, y)| DVec3::new(x, y, 0.0))
}

/// The camera that sees just these points, where the box is seen larger.
fn closer<'a>(camera: &Camera, points: impl Iterator<Item = &'a DVec3>) -> Camera {
    let size = camera.size().map(|count| count as f64);
    let places = points.filter_map(|&point| camera.screen(point));
    let (low, high) = places.fold(
        (DVec2::INFINITY, DVec2::NEG_INFINITY),
        |(low, high), [u, v, _]| (low.min(DVec2::new(u, v)), high.max(DVec2::new(u, v))),
    );
    let margin = 0.5 * (super::MARGIN - 1.0) * (high - low) + 1.0;
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

fn picture(
    mesh: &Mesh,
    ground: Option<&[DVec3; 4]>,
    options: &Options,
    camera: &Camera,
) -> Picture {
    let [width, height] = camera.size();
    let mut map = HeightMap {
        width,
        height,
        hits: vec![Hit::Nothing; width * height],
        depths: vec![f32::INFINITY; width * height],
        normals: vec![Vec3::ZERO; width * height],
        undefined: 0,
    };
    for triangle in &mesh.triangles {
        let corners = triangle.map(|vertex| mesh.positions[vertex as usize]);
        let [a, b, c] = corners;
        let facet = (b - a).cross(c - a).normalize_or_zero();
        // At a sharp edge a vertex' normal is that of none of its facets; 0 is that of no vertex.
        let fits = |normal: &DVec3| normal.dot(facet) > SMOOTH;
        let normal = |vertex: u32| mesh.normals.get(vertex as usize).copied();
        let normals = triangle.map(|vertex| normal(vertex).filter(fits));
        paint(&mut map, camera, corners, normals, Hit::Surface);
    }
    let covered = map.hits.iter().filter(|&&hit| hit != Hit::Nothing).count();
    if let Some(&[a, b, c, d]) = ground {
        for corners in [[a, b, c], [a, c, d]] {
            paint(&mut map, camera, corners, [None; 3], Hit::Jump);
        }
    }
    Picture {
        image: light::shade(&map, camera, options),
        statistics: Statistics {
            covered: covered as f64 / map.hits.len() as f64,
            ..Statistics::default()
        },
    }
}

/// Paints a triangle where it is the nearest: of its front as `hit`, of its back as a cut.
fn paint(
    map: &mut HeightMap,
    camera: &Camera,
    corners: [DVec3; 3],
    normals: [Option<DVec3>; 3],
    hit: Hit,
) {
    let [a, b, c] = corners;
    let plane = (b - a).cross(c - a);
    let area = plane.length_squared();
    let screen = corners.map(|corner| camera.screen(corner));
    let [Some(first), Some(second), Some(third)] = screen else {
        return;
    };
    if area.is_nan() || area <= 0.0 {
        return;
    }
    let range = |axis: usize, end: usize| {
        let ends = [first[axis], second[axis], third[axis]];
        let low = ends.into_iter().fold(f64::INFINITY, f64::min);
        let high = ends.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let clamped = |at: f64| at.clamp(0.0, end as f64) as usize;
        clamped(low.floor())..clamped(high.ceil())
    };
    let (columns, rows) = (range(0, map.width), range(1, map.height));
    for row in rows {
        for column in columns.clone() {
            let at = [column as f64 + 0.5, row as f64 + 0.5];
            let start = camera.point([at[0], at[1], 0.0]);
            let step = camera.point([at[0], at[1], 1.0]) - start;
            let slope = plane.dot(step);
            let depth = plane.dot(a - start) / slope;
            let index = row * map.width + column;
            // It is not a number for triangles that are seen edge-on.
            if depth.is_nan() || depth as f32 >= map.depths[index] {
                continue;
            }
            let point = start + depth * step;
            let weight = |p: DVec3, q: DVec3| (q - p).cross(point - p).dot(plane) / area;
            let weights = [weight(b, c), weight(c, a), weight(a, b)];
            // A pixel on a common edge belongs to both triangles, rounding aside.
            if weights.iter().any(|&weight| weight < -1e-9) {
                continue;
            }
            let mut normal = DVec3::ZERO;
            for (weight, corner) in weights.into_iter().zip(normals) {
                normal += weight * corner.unwrap_or(plane / area.sqrt());
            }
            let is_front = slope < 0.0;
            let normal = if is_front { normal } else { -normal };
            map.depths[index] = depth as f32;
            map.hits[index] = if is_front { hit } else { Hit::Cut };
            map.normals[index] = normal.normalize_or_zero().as_vec3();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::{Size, View};

    fn options() -> Options {
        Options {
            size: Size::Longest(100),
            samples: 1,
            whole: true,
            transparent: true,
            view: View::named("front").unwrap(),
            ..Options::new(Bounds::from_sides(&[(-1.0, 1.0); 3]).unwrap())
        }
    }

    /// A triangle in the plane y = `away`, seen from the front if its corners go around clockwise along y.
    fn triangle(away: f64, is_back: bool) -> Mesh {
        let corners = [(-0.8, -0.8), (0.8, -0.8), (0.0, 0.8)];
        Mesh {
            positions: corners.map(|(x, z)| DVec3::new(x, away, z)).to_vec(),
            normals: Vec::new(),
            triangles: vec![if is_back { [0, 2, 1] } else { [0, 1, 2] }],
        }
    }

    #[test]
    fn a_triangle_covers_its_area_and_the_nearer_one_is_seen() {
        let front = render_meshes(&[triangle(0.0, false)], false, &options()).unwrap();
        // 1.28 of the 4 square units of the image; the border is 5.2 long, half a pixel of 0.02 unsure.
        let covered = front[0].statistics.covered;
        assert!((covered - 0.32).abs() < 0.5 * 0.02 * 5.2 / 4.0, "{covered}");
        let colour = |picture: &Picture| picture.image.pixels[50 * 100 + 50];
        let back = render_meshes(&[triangle(0.0, true)], false, &options()).unwrap();
        assert_ne!(colour(&front[0]), colour(&back[0]));
        // The eye is at negative y.
        for (away, expected) in [(-0.5, &back[0]), (0.5, &front[0])] {
            let mut both = triangle(0.0, false);
            both.positions.extend(triangle(away, true).positions);
            both.triangles.push([3, 5, 4]);
            let picture = render_meshes(&[both], false, &options()).unwrap();
            assert_eq!(colour(&picture[0]), colour(expected), "{away}");
        }
    }
}
