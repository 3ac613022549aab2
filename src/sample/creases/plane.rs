//! Creases in the plane: the points in which two pieces of a field vanish.
//!
//! A cell in which the determinant of both gradients cannot vanish holds one such point at the
//! most. Newton's method finds it or leads out of the cell; other cells are split.

use rayon::prelude::*;

use super::Setting;
use super::corner::Corner;
use super::curves::pairs;
use super::sheets::{SMALLEST_SINE, crease};
use crate::continuation::{Cell, Condition, Place, System, enclose};
use crate::engine::Monitor;
use glam::DVec3;

/// Halvings of the box after which a cell is left, and the most cells for two pieces.
const DEEPEST: u32 = 24;
const MOST_CELLS: usize = 1 << 13;

/// The box in which there is one point at the most is so many times as large as the cell.
const AROUND: f64 = 2.0;

/// Points closer than this part of the diagonal are one.
const SAME: f64 = 1e-7;

/// The corners of a field in the plane, and the number of cells of which nothing is known. `None`
/// if the monitor cancelled.
pub(super) fn corners(setting: &Setting, monitor: &dyn Monitor) -> Option<(Vec<Corner>, u64)> {
    let pairs: Vec<([u32; 2], Vec<usize>)> = pairs(setting.pieces).into_iter().collect();
    let found: Option<Vec<(Vec<Corner>, u64)>> = pairs
        .par_iter()
        .map(|(pair, places)| (!monitor.cancelled()).then(|| of_pair(setting, *pair, places)))
        .collect();
    let mut corners: Vec<Corner> = Vec::new();
    let mut left = 0;
    for (some, undecided) in found? {
        left += undecided;
        for corner in some {
            let same = SAME * setting.diagonal;
            let known = corners
                .iter_mut()
                .find(|known| known.position.distance(corner.position) <= same);
            match known {
                Some(known) => corner
                    .normals
                    .into_iter()
                    .for_each(|normal| known.note(normal)),
                None => corners.push(corner),
            }
        }
    }
    Some((corners, left))
}

/// The corners of two pieces.
fn of_pair(setting: &Setting, pair: [u32; 2], places: &[usize]) -> (Vec<Corner>, u64) {
    let system = setting.system(pair);
    let mut level: Vec<(Cell, u32)> = places
        .iter()
        .map(|&place| {
            let meeting = &setting.pieces.meetings[place];
            let (low, high) = (meeting.low, meeting.high);
            (Cell { low, high }, meeting.depth)
        })
        .collect();
    let mut corners: Vec<Corner> = Vec::new();
    let mut seen = 0;
    let mut left = 0;
    while !level.is_empty() {
        let mut next = Vec::new();
        seen += level.len();
        for (cell, depth) in &level {
            match verdict(&system, cell) {
                Verdict::Empty => {}
                Verdict::Point(point) => {
                    corners.extend(corner(setting, &system, point, &corners));
                }
                Verdict::Unknown if *depth >= DEEPEST || seen > MOST_CELLS + places.len() => {
                    left += 1;
                }
                Verdict::Unknown => next.extend(quarters(cell).map(|part| (part, depth + 1))),
            }
        }
        level = next;
    }
    (corners, left)
}

/// What becomes of a cell.
enum Verdict {
    Empty,
    Point(DVec3),
    Unknown,
}

fn verdict(system: &System, cell: &Cell) -> Verdict {
    let around = cell.scaled(AROUND);
    let Some(fields) = system.compiled() else {
        return Verdict::Unknown;
    };
    let known = enclose(system, &fields, &[*cell, around]);
    let &[here, around_here] = known.as_slice() else {
        return Verdict::Unknown;
    };
    if !here.possible || here.sine < SMALLEST_SINE {
        return Verdict::Empty;
    }
    if around_here.axis().is_none() {
        return Verdict::Unknown;
    }
    let start = cell.center();
    let condition = Condition::Plane(start, DVec3::Z);
    let reach = AROUND * cell.size().max_element();
    match system.solve(start, condition, reach) {
        Some(found) if cell.contains(found.position) => Verdict::Point(found.position),
        // It is that of a neighbour, or of none.
        Some(found) if around.contains(found.position) => Verdict::Empty,
        _ => Verdict::Unknown,
    }
}

/// The corner at a point where both pieces vanish, if the field has a crease there that is new.
fn corner(setting: &Setting, system: &System, point: DVec3, known: &[Corner]) -> Option<Corner> {
    let near = SAME * setting.diagonal;
    if known
        .iter()
        .any(|known| known.position.distance(point) <= near)
    {
        return None;
    }
    let local = system.local(point)?;
    let place = Place::along(point, local, DVec3::Z)?;
    let signs = crease(setting, system, &place, setting.diagonal)?;
    let mut corner = Corner {
        position: point,
        normals: Vec::new(),
    };
    for (normal, sign) in local.normals.into_iter().zip(signs) {
        corner.note(sign * normal);
    }
    Some(corner)
}

/// The quarters of a cell.
fn quarters(cell: &Cell) -> impl Iterator<Item = Cell> {
    let (cell, middle) = (*cell, cell.center());
    (0..4).map(move |number| {
        let mut part = cell;
        for axis in 0..2 {
            match number >> axis & 1 {
                0 => part.high[axis] = middle[axis],
                _ => part.low[axis] = middle[axis],
            }
        }
        part
    })
}
