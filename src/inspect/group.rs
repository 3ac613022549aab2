//! Singular points that are told apart: isolated ones, and those that form a curve or a surface.

use glam::DVec3;

use super::Report;
use super::cells::Cells;
use super::newton::{Found, lexicographic};
use crate::geometry::DisjointSets;

/// Points nearer than this part of a cell's diagonal are one.
const SAME: f64 = 1.0 / 16.0;

/// Points nearer than this many diagonals of a cell are neighbours in a set.
const NEIGHBOURS: f64 = 2.0;

/// With this many points, neighbours are a set.
const SET: usize = 4;

/// Puts the found points into the report.
pub(super) fn group(found: &[Found], cells: &Cells, report: &mut Report) {
    let points = distinct(found, SAME * cells.diagonal());
    let mut sets = DisjointSets::new(points.len() as u32);
    let reach = NEIGHBOURS * cells.diagonal();
    for (index, point) in points.iter().enumerate() {
        for (other, neighbour) in points[..index].iter().enumerate() {
            if point.distance(*neighbour) <= reach {
                sets.union(index as u32, other as u32);
            }
        }
    }
    let mut members: Vec<Vec<DVec3>> = vec![Vec::new(); points.len()];
    for (index, point) in points.iter().enumerate() {
        members[sets.find(index as u32) as usize].push(*point);
    }
    for set in members.into_iter().filter(|set| !set.is_empty()) {
        if set.len() < SET {
            report.points.extend(set);
        } else {
            report.sets.push(set);
        }
    }
    report.points.sort_by(|a, b| lexicographic(*a, *b));
}

/// One point for all that are within `radius` of it: the one with the smallest gradient.
fn distinct(found: &[Found], radius: f64) -> Vec<DVec3> {
    let mut kept: Vec<Found> = Vec::new();
    for candidate in found {
        let near = |known: &&mut Found| known.point.distance(candidate.point) <= radius;
        match kept.iter_mut().find(near) {
            Some(known) if candidate.slope < known.slope => *known = *candidate,
            Some(_) => {}
            None => kept.push(*candidate),
        }
    }
    kept.into_iter().map(|found| found.point).collect()
}
