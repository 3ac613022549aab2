//! One simplex: its volume, how that changes with its corners, and how flat it is.

use glam::DVec3;

pub use crate::geometry::simplex_measure as measure;

/// The derivatives of the [`measure`] with respect to the corners after the first. That with respect to
/// the first is the negative of their sum, since a translation changes nothing. Of a triangle the third
/// is 0.
pub fn slopes(dimension: usize, [a, b, c, d]: [DVec3; 4]) -> [DVec3; 3] {
    let (u, v, w) = (b - a, c - a, d - a);
    match dimension {
        2 => [
            0.5 * DVec3::new(v.y, -v.x, 0.0),
            0.5 * DVec3::new(-u.y, u.x, 0.0),
            DVec3::ZERO,
        ],
        _ => [v.cross(w) / 6.0, w.cross(u) / 6.0, u.cross(v) / 6.0],
    }
}

/// How far from flat a simplex is: its measure relative to that of the regular simplex with the same longest
/// edge. 1 for a regular one, 0 for a flat one, negative for an inverted one; 0.27 for those
/// of Freudenthal's triangulation in space and 0.58 in the plane.
pub fn quality(dimension: usize, corners: [DVec3; 4]) -> f64 {
    let mut longest: f64 = 0.0;
    for (number, &corner) in corners.iter().enumerate() {
        for &other in &corners[..number] {
            longest = longest.max(corner.distance_squared(other));
        }
    }
    let regular = match dimension {
        2 => longest * 3.0_f64.sqrt() / 4.0,
        _ => longest * longest.sqrt() / 72.0_f64.sqrt(),
    };
    match regular > 0.0 {
        true => measure(dimension, corners) / regular,
        false => 0.0,
    }
}
