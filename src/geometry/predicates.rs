//! On which side a point lies, decided exactly: signs of determinants of differences.
//!
//! A sign is taken from floating-point numbers where it is beyond their error, which is nearly
//! always; else the crate `robust` decides, by J. R. Shewchuk, "Adaptive Precision Floating-Point
//! Arithmetic and Fast Robust Geometric Predicates", Discrete & Computational Geometry 18 (1997).
//! Coordinates must be finite, and their products neither overflow nor underflow.

use std::cmp::Ordering;

use glam::DVec3;
use robust::{Coord, Coord3D};

/// On which side something is: `Equal` is on the plane or line itself.
pub(super) type Side = Ordering;

/// The plane through three points, ready to be asked about many others.
#[derive(Clone, Copy)]
pub(super) struct Plane {
    /// The three points.
    pub(super) points: [DVec3; 3],
    normal: DVec3,
    /// The greatest absolute value of each component of the two edges at the first point.
    extent: DVec3,
}

impl Plane {
    /// The plane through the points, which may be collinear: then every point lies on it.
    pub(super) fn through([a, b, c]: [DVec3; 3]) -> Plane {
        let (first, second) = (b - a, c - a);
        Plane {
            points: [a, b, c],
            normal: first.cross(second),
            extent: first.abs().max(second.abs()),
        }
    }

    /// The side of the plane on which the point lies: `Greater` is where the three points are
    /// counter-clockwise to look at.
    pub(super) fn side(&self, point: DVec3) -> Side {
        // Each term of the determinant is at most the product of the greatest components and is
        // wrong by less than 12 roundings of 2⁻⁵³; the sums of the three pairs add 12 more. 90
        // roundings are 1e-14.
        const ERROR: f64 = 1e-14;
        let offset = point - self.points[0];
        let determinant = self.normal.dot(offset);
        let greatest = self.extent.max(offset.abs());
        if determinant.abs() > ERROR * (greatest.x * greatest.y * greatest.z) {
            return sign(determinant);
        }
        let [a, b, c] = self.points;
        // `robust` counts the other side positive.
        sign(-robust::orient3d(
            coordinates(a),
            coordinates(b),
            coordinates(c),
            coordinates(point),
        ))
    }
}

/// The side of the plane through a, b and c on which d lies, as [`Plane::side`].
pub(super) fn side_of_plane(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> Side {
    Plane::through([a, b, c]).side(d)
}

/// Where e lies of the sphere through a, b, c and d, of which d is on the `Greater` side of the plane
/// through the others: `Greater` is inside.
pub(super) fn side_of_sphere([a, b, c, d]: [DVec3; 4], e: DVec3) -> Side {
    // The orientation that `robust` counts positive is the other one.
    sign(-robust::insphere(
        coordinates(a),
        coordinates(b),
        coordinates(c),
        coordinates(d),
        coordinates(e),
    ))
}

/// The side of the line from a to b on which c lies, all seen along an axis: `Greater` is on the
/// left.
pub(super) fn side_of_line(axis: usize, a: DVec3, b: DVec3, c: DVec3) -> Side {
    let [a, b, c] = [a, b, c].map(|point| seen_along(axis, point));
    sign(robust::orient2d(a, b, c))
}

/// An axis along which the triangle is seen with an area; `None` if its corners are collinear.
pub(super) fn facing_axis([a, b, c]: [DVec3; 3]) -> Option<usize> {
    // A component of the normal is wrong by less than 8 roundings of the product of the extents.
    const ERROR: f64 = 1e-15;
    let (first, second) = (b - a, c - a);
    let normal = first.cross(second).abs();
    let extent = first.abs().max(second.abs()).max_element();
    let widest = normal.max_position();
    if normal[widest] > ERROR * extent * extent {
        return Some(widest);
    }
    (0..3).find(|&axis| side_of_line(axis, a, b, c) != Side::Equal)
}

fn seen_along(axis: usize, point: DVec3) -> Coord<f64> {
    Coord {
        x: point[(axis + 1) % 3],
        y: point[(axis + 2) % 3],
    }
}

fn coordinates(point: DVec3) -> Coord3D<f64> {
    Coord3D {
        x: point.x,
        y: point.y,
        z: point.z,
    }
}

/// The sign of a number; NaN, which finite coordinates do not give, has none.
fn sign(number: f64) -> Side {
    number.partial_cmp(&0.0).unwrap_or(Side::Equal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_of_a_plane_have_the_sign_of_its_normal() {
        let [x, y, z] = DVec3::AXES;
        assert_eq!(side_of_plane(DVec3::ZERO, x, y, z), Side::Greater);
        assert_eq!(side_of_plane(DVec3::ZERO, x, y, -z), Side::Less);
        assert_eq!(side_of_plane(DVec3::ZERO, x, y, x + 3.0 * y), Side::Equal);
        assert_eq!(side_of_line(2, DVec3::ZERO, x, x + y), Side::Greater);
        assert_eq!(side_of_line(0, DVec3::ZERO, y, y - z), Side::Less);
    }

    #[test]
    fn the_least_step_off_a_plane_is_seen() {
        // The points satisfy x + y + z = 1 exactly, and so does the fourth before the step.
        let corners = [0.25, 0.5, 0.125].map(|x| DVec3::new(x, 0.75 - x, 0.25));
        let [a, b, _] = corners;
        let c = DVec3::new(0.5, 0.375, 0.125);
        let on = DVec3::new(0.0625, 0.8125, 0.125);
        assert_eq!(side_of_plane(a, b, c, on), Side::Equal);
        let up = DVec3::new(on.x, on.y, on.z.next_up());
        let down = DVec3::new(on.x, on.y, on.z.next_down());
        let sides = [up, down].map(|point| side_of_plane(a, b, c, point));
        assert_eq!(sides[0], sides[1].reverse());
        assert_ne!(sides[0], Side::Equal);
    }

    #[test]
    fn the_least_step_into_a_sphere_is_seen() {
        let [x, y, z] = DVec3::AXES;
        let corners = [DVec3::ZERO, x, y, z];
        let on = DVec3::ONE;
        assert_eq!(side_of_sphere(corners, on), Side::Equal);
        let inward = DVec3::new(1.0, 1.0, 1.0f64.next_down());
        assert_eq!(side_of_sphere(corners, inward), Side::Greater);
        let outward = DVec3::new(1.0, 1.0, 1.0f64.next_up());
        assert_eq!(side_of_sphere(corners, outward), Side::Less);
    }

    #[test]
    fn thin_triangles_face_an_axis_and_collinear_ones_none() {
        let [a, b] = [DVec3::ZERO, DVec3::ONE];
        let middle = DVec3::splat(0.5);
        assert_eq!(facing_axis([a, middle, b]), None);
        assert_eq!(facing_axis([a, a, b]), None);
        let off = DVec3::new(0.5, 0.5, 0.5f64.next_up());
        assert!(facing_axis([a, off, b]).is_some());
        assert_eq!(facing_axis([a, DVec3::X, DVec3::Z]), Some(1));
    }
}
