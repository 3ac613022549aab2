//! Which sheets of a zero set meet along the curve of two pieces.
//!
//! From a point of the curve, the zero set of each piece leads away to two sides. The field's own
//! leads where the field vanishes, too, a little away from the curve. There is a crease if it does
//! for both pieces: they take over from each other, or cross.

use crate::geometry::length;
use glam::DVec3;

use super::Setting;
use crate::continuation::{Place, System};
use crate::engine::Field;

/// Surfaces that meet at a smaller angle are taken for smooth: the sine of one degree.
pub(super) const SMALLEST_SINE: f64 = 0.017_452_406_437_283_51;

/// How far from the curve sheets are looked for, as a part of the diagonal.
const AWAY: f64 = 1e-6;

/// Where a sheet is part of the zero set, |F| is smaller than this part of what the other piece has
/// there.
const SMALL: f64 = 1e-3;

/// Newton's steps onto a piece, of which two do for points as close as these.
const STEPS: usize = 4;

/// Whether the pieces of a system make a crease at a place: for each the sign by which its normal
/// is that of the field. `room` is the distance to where that may change.
pub(super) fn crease(
    setting: &Setting,
    system: &System,
    place: &Place,
    room: f64,
) -> Option<[f64; 2]> {
    let [a, b] = place.local.normals;
    let sine = a.cross(b).length();
    if sine.is_nan() || sine < SMALLEST_SINE {
        return None;
    }
    let away = (AWAY * setting.diagonal).min(room);
    let first = sheet(setting, system, place, 0, away)?;
    let second = sheet(setting, system, place, 1, away)?;
    Some([first, second])
}

/// Whether the field vanishes along one piece on either side of the curve: the sign of its normal.
fn sheet(
    setting: &Setting,
    system: &System,
    place: &Place,
    number: usize,
    away: f64,
) -> Option<f64> {
    let piece = system.fields.get(number)?;
    let other = system.fields.get(1 - number)?;
    let along = place.tangent.cross(place.local.normals[number]);
    let size = along.length();
    [1.0, -1.0].iter().find_map(|side| {
        let point = onto(*piece, place.position + side * away / size * along)?;
        let (_, slope) = piece.value_gradient(point);
        let (beside, _) = other.value_gradient(point);
        let (value, gradient) = setting.field.value_gradient(point);
        let scale = beside.abs().min(length(slope) * away);
        if value.is_nan() || value.abs() > SMALL * scale {
            return None;
        }
        // Where the field has no gradient on the very sheet, the piece has the sign.
        Some(match gradient.dot(slope) < 0.0 {
            true => -1.0,
            false => 1.0,
        })
    })
}

/// The point of a piece's zero set near another point, by some of Newton's steps.
pub(super) fn onto(piece: &dyn Field, start: DVec3) -> Option<DVec3> {
    let mut point = start;
    for _ in 0..STEPS {
        let (value, gradient) = piece.value_gradient(point);
        let slope = length(gradient);
        let step = value / slope * (gradient / slope);
        if !step.is_finite() {
            return None;
        }
        point -= step;
        if step == DVec3::ZERO {
            break;
        }
    }
    Some(point)
}
