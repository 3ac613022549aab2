//! What the values at the corners of a cube say about the trilinear function between them, where
//! the signs alone do not.
//!
//! On a face the function is bilinear, and the value at its saddle decides which two corners
//! across a diagonal are connected: the asymptotic decider of Nielson and Hamann, "The asymptotic
//! decider: resolving the ambiguity in marching cubes", IEEE Visualization 1991.
//!
//! Inside, the function has no extrema, as it is linear along the axes, and at most two critical
//! points, saddles. As the level rises past one of them, either two parts of the set below it
//! join there or one part of the set above it falls in two. Regions of the surface of the cube
//! are therefore connected in its interior exactly if there is a saddle of the right kind, on the
//! right side of the level. This replaces the tests of Chernyaev, "Marching cubes 33", CERN
//! report CN/95-17 (1995), along an axis, of which Custodio, Etiene, Pesco and Silva, "Practical
//! considerations on marching cubes 33 topological correctness", Computers & Graphics 37 (2013),
//! collect the failures.

use glam::DVec3;

use super::loops::{FACES, ambiguous_faces, is_inside};
use super::patches::Passage;

/// A tunnel through the cube, by which two regions on its surface are connected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tunnel {
    /// What is known of it without numbers.
    pub(super) passage: Passage,
    /// The saddle in the tunnel, in the unit cube.
    saddle: DVec3,
    /// How far the tunnel's wall is from the saddle: about this times the neck's directions (see
    /// [`Passage::neck_directions`]).
    radii: DVec3,
}

impl Tunnel {
    /// Three points on the wall about the tunnel's narrowest place, in the unit cube; the first is
    /// that which lies along x from the saddle, and so on. They lie on the level set of the
    /// quadratic part of the function at the saddle, unless that leaves the cube.
    pub(super) fn neck(&self) -> [DVec3; 3] {
        self.passage.neck_directions().map(|direction| {
            let point = self.saddle + self.radii * direction;
            // No vertex inside the cube may come near its faces: a tenth of the way is left.
            let nearest = self.saddle * 0.1;
            point.clamp(nearest, nearest + DVec3::splat(0.9))
        })
    }
}

/// The ambiguous faces whose inside corners are joined, as bits; `values` are F − iso at the
/// corners.
///
/// The decision for a face depends on nothing but its own four values, so that it is the same for
/// both cubes beside it. Where one of them is not finite the outside corners are joined, and so
/// they are where the saddle is on the level, since F = iso counts as outside.
pub(super) fn joined_faces(case: u8, values: &[f64; 8]) -> u8 {
    let ambiguous = ambiguous_faces(case);
    let mut joined = 0;
    for (number, face) in FACES.iter().enumerate() {
        if ambiguous >> number & 1 == 1 {
            let [a, b, c, d] = face.map(|corner| values[corner]);
            let joins = match is_inside(case, face[0]) {
                true => joins([a, c], [b, d]),
                false => joins([b, d], [a, c]),
            };
            joined |= u8::from(joins) << number;
        }
    }
    joined
}

/// Whether the saddle of a bilinear function is negative, given its values at the corners.
fn joins(inside: [f64; 2], outside: [f64; 2]) -> bool {
    let all = [inside[0], inside[1], outside[0], outside[1]];
    let Some(scale) = scale(&all) else {
        return false;
    };
    let product = |values: [f64; 2]| (values[0] / scale) * (values[1] / scale);
    product(inside) > product(outside)
}

/// The greatest absolute value, with which no product overflows; `None` if one is not finite.
fn scale(values: &[f64]) -> Option<f64> {
    let finite = values.iter().all(|value| value.is_finite());
    let greatest = values
        .iter()
        .fold(0.0, |most: f64, value| most.max(value.abs()));
    finite.then_some(greatest)
}

/// The tunnel through a cube, if there can be one; `values` are F − iso at the corners. Whether
/// it connects regions that are separate on the surface of the cube is not looked at.
pub(super) fn tunnel(values: &[f64; 8]) -> Option<Tunnel> {
    let scale = scale(values).filter(|&scale| scale > 0.0)?;
    let function = Trilinear::new(values.map(|value| value / scale));
    let saddles = function.critical_points()?;
    saddles
        .into_iter()
        .find_map(|saddle| function.tunnel_at(saddle))
}

/// A trilinear function c + b·p + m_z xy + m_y xz + m_x yz + t xyz.
struct Trilinear {
    constant: f64,
    linear: DVec3,
    mixed: DVec3,
    cubic: f64,
}

impl Trilinear {
    /// The function with these values at the corners of the unit cube.
    fn new(v: [f64; 8]) -> Self {
        Trilinear {
            constant: v[0],
            linear: DVec3::new(v[1] - v[0], v[2] - v[0], v[4] - v[0]),
            mixed: DVec3::new(
                v[6] - v[2] - v[4] + v[0],
                v[5] - v[1] - v[4] + v[0],
                v[3] - v[1] - v[2] + v[0],
            ),
            cubic: v[7] - v[6] - v[5] - v[3] + v[1] + v[2] + v[4] - v[0],
        }
    }

    /// The points at which the gradient vanishes; those that are not there are not finite.
    ///
    /// The second and third of the equations give y and z as functions of x; the first is then
    /// quadratic in x.
    fn critical_points(&self) -> Option<[DVec3; 2]> {
        let (b, m, t) = (self.linear, self.mixed, self.cubic);
        let factor = b.x * t - m.z * m.y;
        let (square, half) = (factor * t, factor * m.x);
        let rest = b.x * m.x * m.x - m.x * (m.z * b.z + m.y * b.y) + t * b.y * b.z;
        let discriminant = half * half - square * rest;
        if discriminant.is_nan() || discriminant <= 0.0 {
            return None;
        }
        // Of the two forms of the solution neither suffers from cancellation.
        let sum = -(half + discriminant.sqrt().copysign(half));
        let point = |x: f64| {
            let slope = m.x + t * x;
            DVec3::new(x, -(b.z + m.y * x) / slope, -(b.y + m.z * x) / slope)
        };
        Some([point(sum / square), point(rest / sum)])
    }

    /// The tunnel at a critical point, if it lies in the cube and the regions that meet there are
    /// connected.
    fn tunnel_at(&self, p: DVec3) -> Option<Tunnel> {
        if !(p.cmpgt(DVec3::ZERO).all() && p.cmplt(DVec3::ONE).all()) {
            return None;
        }
        let m = self.mixed;
        let value = self.constant
            + self.linear.dot(p)
            + m.x * p.y * p.z
            + m.y * p.x * p.z
            + m.z * p.x * p.y
            + self.cubic * p.x * p.y * p.z;
        // The second derivatives F_yz, F_xz and F_xy; the others are 0. Their product has the sign
        // of the determinant: with positive sign F rises along one diagonal and falls across it.
        let second = m + self.cubic * p;
        let product = second.element_product();
        let inside = value < 0.0;
        if !product.is_normal() || inside != (product < 0.0) {
            return None;
        }
        // Along the diagonal F moves away from the level in both directions: the signs of its
        // components are those for which all three mixed terms agree.
        let flip = if inside { -second } else { second };
        let negative = |axis: usize| usize::from(flip[axis] < 0.0);
        let corner = [0, 1, 2].map(|axis| (negative(axis) ^ negative(2)) << axis);
        // In coordinates in which the mixed terms are alike the neck is round.
        let unit = second.abs() / second.abs().element_product().sqrt();
        Some(Tunnel {
            passage: Passage {
                inside,
                diagonal: corner.into_iter().sum(),
            },
            saddle: p,
            radii: unit * (value.abs() / 3.0).sqrt(),
        })
    }
}
