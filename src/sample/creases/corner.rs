//! Corners: points in which creases end or meet.

use crate::geometry::length;
use glam::DVec3;

use super::Setting;
use crate::engine::Field;

/// Newton's steps from where bisection ended.
const STEPS: usize = 8;

/// The result may not lie farther away than this part of the diagonal.
const REACH: f64 = 1e-5;

/// Normals closer to each other than this, as a sine, are one.
const SAME_NORMAL: f64 = 1e-3;

/// A corner.
#[derive(Clone, Debug, PartialEq)]
pub struct Corner {
    /// Where it is.
    pub position: DVec3,
    /// The unit normals of the sides that adjoin, each once.
    pub normals: Vec<DVec3>,
}

impl Corner {
    /// Adds a normal, unless it is there.
    pub(super) fn note(&mut self, normal: DVec3) {
        let is_new = self
            .normals
            .iter()
            .all(|known| known.dot(normal) < 0.0 || known.cross(normal).length() > SAME_NORMAL);
        if is_new && normal != DVec3::ZERO {
            self.normals.push(normal);
        }
    }
}

/// The point near another one on which three pieces vanish, by Newton's method; `None` if their
/// tangent planes have no common point near by.
pub(super) fn on_three(setting: &Setting, pieces: [u32; 3], near: DVec3) -> Option<DVec3> {
    let mut point = near;
    for _ in 0..STEPS {
        let mut distances = [0.0; 3];
        let mut normals = [DVec3::ZERO; 3];
        for (number, &piece) in pieces.iter().enumerate() {
            let (value, gradient) = setting.pieces.fields[piece as usize].value_gradient(point);
            let slope = length(gradient);
            distances[number] = value / slope;
            normals[number] = gradient / slope;
        }
        let [a, b, c] = normals;
        let determinant = a.dot(b.cross(c));
        let step =
            distances[0] * b.cross(c) + distances[1] * c.cross(a) + distances[2] * a.cross(b);
        let step = step / determinant;
        if !step.is_finite() || determinant.abs() < 1e-9 {
            return None;
        }
        point -= step;
        if point.distance(near) > REACH * setting.diagonal {
            return None;
        }
        if step.length() <= 1e-15 * setting.diagonal {
            break;
        }
    }
    Some(point)
}
