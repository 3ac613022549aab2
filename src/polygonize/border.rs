//! Curves that a box in the plane cuts, closed along its border.

use glam::DVec3;

use crate::geometry::{Bounds, Polyline};

/// Closes polylines along the border of the box such that the inside, which is on their left,
/// stays there: from where one leaves the box counter-clockwise to where the next one enters it.
/// Ends that are not on the border stay open. With no end there, the border itself is a curve if
/// `is_inside`, that is if F < iso on it.
pub(super) fn closed(polylines: Vec<Polyline>, bounds: &Bounds, is_inside: bool) -> Vec<Polyline> {
    let (mut open, mut done): (Vec<Polyline>, Vec<Polyline>) =
        polylines.into_iter().partition(|polyline| !polyline.closed);
    let place = |point: Option<&DVec3>| point.and_then(|point| place_on_border(bounds, *point));
    let entries: Vec<Option<f64>> = open
        .iter()
        .map(|curve| place(curve.points.first()))
        .collect();
    let exits: Vec<Option<f64>> = open
        .iter()
        .map(|curve| place(curve.points.last()))
        .collect();
    if entries.iter().chain(&exits).all(Option::is_none) {
        done.append(&mut open);
        if is_inside {
            let points = (0..4).map(|corner| point_on_border(bounds, f64::from(corner)));
            done.push(Polyline {
                points: points.collect(),
                closed: true,
            });
        }
        return done;
    }
    // The curve that goes on where one ends: the next entry, unless another exit comes before it.
    let ahead = |from: f64, to: f64| (to - from).rem_euclid(4.0);
    let next = |at: usize| -> Option<(usize, f64)> {
        let exit = exits[at]?;
        let entry = (0..open.len())
            .filter_map(|other| Some((other, ahead(exit, entries[other]?))))
            .min_by(|one, other| one.1.total_cmp(&other.1))?;
        let others = (0..open.len()).filter(|&other| other != at);
        let blocked = others
            .filter_map(|other| Some(ahead(exit, exits[other]?)))
            .any(|distance| 0.0 < distance && distance < entry.1);
        (!blocked).then_some(entry)
    };
    let successors: Vec<Option<(usize, f64)>> = (0..open.len()).map(next).collect();
    let mut has_predecessor = vec![false; open.len()];
    for (successor, _) in successors.iter().flatten() {
        has_predecessor[*successor] = true;
    }
    let mut used = vec![false; open.len()];
    let starts = (0..open.len()).filter(|&at| !has_predecessor[at]);
    for first in starts.chain(0..open.len()) {
        let mut points = Vec::new();
        let mut here = Some(first);
        let mut closed = false;
        while let Some(at) = here {
            if used[at] {
                closed = at == first && !points.is_empty();
                break;
            }
            used[at] = true;
            points.extend_from_slice(&open[at].points);
            here = None;
            if let (Some((successor, distance)), Some(exit)) = (successors[at], exits[at]) {
                points.extend(corners_between(bounds, exit, distance));
                here = Some(successor);
            }
        }
        points.dedup();
        if points.len() > 1 {
            done.push(Polyline { points, closed });
        }
    }
    done
}

/// Where a point is on the border, counter-clockwise from the lower left corner in sides; `None` if
/// it is not on it.
fn place_on_border(bounds: &Bounds, point: DVec3) -> Option<f64> {
    let (min, max) = (bounds.min, bounds.max);
    let part = (point - min) / (max - min);
    if point.y == min.y {
        Some(part.x)
    } else if point.x == max.x {
        Some(1.0 + part.y)
    } else if point.y == max.y {
        Some(3.0 - part.x)
    } else if point.x == min.x {
        Some((4.0 - part.y).rem_euclid(4.0))
    } else {
        None
    }
}

/// The corner with a number.
fn point_on_border(bounds: &Bounds, corner: f64) -> DVec3 {
    let (min, max) = (bounds.min, bounds.max);
    match corner.rem_euclid(4.0) as usize {
        0 => DVec3::new(min.x, min.y, 0.0),
        1 => DVec3::new(max.x, min.y, 0.0),
        2 => DVec3::new(max.x, max.y, 0.0),
        _ => DVec3::new(min.x, max.y, 0.0),
    }
}

/// The corners on the way from a place so far along the border.
fn corners_between(bounds: &Bounds, from: f64, distance: f64) -> Vec<DVec3> {
    let first = from.floor() + 1.0;
    (0..4)
        .map(|number| first + f64::from(number))
        .take_while(|corner| corner - from < distance)
        .map(|corner| point_on_border(bounds, corner))
        .collect()
}
