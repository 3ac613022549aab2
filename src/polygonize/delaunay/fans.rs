//! Where triangles make a manifold: which of them belong together along edges and around vertices.

use glam::DVec3;
use rayon::prelude::*;

use super::restricted::Crossing;
use crate::geometry::DisjointSets;

/// The fans around vertices. Corner 3 t + c is corner c of triangle t.
pub(super) struct Fans {
    /// The least corner of the fan that a corner belongs to.
    pub(super) of_corner: Vec<u32>,
    /// Samples with more than one fan, or with an edge that has not one or two triangles; by number.
    bad: Vec<bool>,
    /// Edges with one triangle.
    pub(super) borders: usize,
}

impl Fans {
    /// Whether a triangle has a corner at which there is no manifold.
    pub(super) fn is_bad(&self, corners: [u32; 3]) -> bool {
        corners.iter().any(|&corner| self.bad[corner as usize])
    }
}

/// A side of a triangle.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    /// Its samples, the lesser first.
    edge: [u32; 2],
    triangle: u32,
    /// The corner that it begins at.
    corner: u32,
}

/// The fans of triangles between samples at these positions.
///
/// Two triangles are joined along an edge that only they have. Where more have it, those are joined that
/// have the inside between them, so that each is joined to one other and solids that touch along
/// an edge are parted.
pub(super) fn fans(crossings: &[Crossing], positions: &[DVec3]) -> Fans {
    let mut sides: Vec<Side> = (crossings.par_iter().enumerate())
        .flat_map_iter(|(triangle, crossing)| {
            let corners = crossing.corners;
            (0..3).map(move |corner| {
                let (from, to) = (corners[corner], corners[(corner + 1) % 3]);
                Side {
                    edge: [from.min(to), from.max(to)],
                    triangle: triangle as u32,
                    corner: corner as u32,
                }
            })
        })
        .collect();
    sides.par_sort_unstable();
    let mut sets = DisjointSets::new(3 * crossings.len() as u32);
    let mut bad = vec![false; positions.len()];
    let mut borders = 0;
    for group in sides.chunk_by(|first, second| first.edge == second.edge) {
        let is_turned = |pair: &[Side]| begins(crossings, &pair[0]) != begins(crossings, &pair[1]);
        match group.len() {
            1 => borders += 1,
            2 if is_turned(group) => join(&mut sets, crossings, group[0], group[1]),
            _ => {
                group[0]
                    .edge
                    .iter()
                    .for_each(|&end| bad[end as usize] = true);
                for [first, second] in around(crossings, positions, group) {
                    join(&mut sets, crossings, first, second);
                }
            }
        }
    }
    let of_corner: Vec<u32> = (0..3 * crossings.len() as u32)
        .map(|corner| sets.find(corner))
        .collect();
    let mut owners = vec![u32::MAX; positions.len()];
    for (corner, &fan) in of_corner.iter().enumerate() {
        let sample = crossings[corner / 3].corners[corner % 3] as usize;
        bad[sample] |= owners[sample] != u32::MAX && owners[sample] != fan;
        owners[sample] = fan;
    }
    Fans {
        of_corner,
        bad,
        borders,
    }
}

/// Whether a side begins at the lesser sample.
fn begins(crossings: &[Crossing], side: &Side) -> bool {
    crossings[side.triangle as usize].corners[side.corner as usize] == side.edge[0]
}

/// Joins two triangles at both ends of their side.
fn join(sets: &mut DisjointSets, crossings: &[Crossing], first: Side, second: Side) {
    let corner_at = |side: Side, sample: u32| {
        let corners = crossings[side.triangle as usize].corners;
        let other = u32::from(corners[side.corner as usize] != sample);
        3 * side.triangle + (side.corner + other) % 3
    };
    for sample in first.edge {
        sets.union(corner_at(first, sample), corner_at(second, sample));
    }
}

/// The pairs of triangles at an edge that have the inside between them.
fn around(crossings: &[Crossing], positions: &[DVec3], group: &[Side]) -> Vec<[Side; 2]> {
    let [from, to] = group[0].edge.map(|sample| positions[sample as usize]);
    let axis = (to - from).normalize_or_zero();
    let across = |side: &Side| {
        let corners = crossings[side.triangle as usize].corners;
        let apex = positions[corners[(side.corner as usize + 2) % 3] as usize] - from;
        (apex - apex.dot(axis) * axis).normalize_or_zero()
    };
    let [x, y] = [across(&group[0]), axis.cross(across(&group[0]))];
    let mut turns: Vec<(f64, Side)> = (group.iter())
        .map(|side| (turn(across(side).dot(x), across(side).dot(y)), *side))
        .collect();
    turns.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    // Counter-clockwise seen from outside, a triangle whose side goes along the axis has the outside
    // before it, turning about the axis, and the inside behind it; another one has it the other way.
    let mut pairs = Vec::new();
    for (place, (_, side)) in turns.iter().enumerate() {
        let next = turns[(place + 1) % turns.len()].1;
        if !begins(crossings, side) && begins(crossings, &next) {
            pairs.push([*side, next]);
        }
    }
    pairs
}

/// A number from 0 to 4 that grows with the angle of a unit vector with the first axis.
fn turn(x: f64, y: f64) -> f64 {
    match y >= 0.0 {
        true => 1.0 - x,
        false => 3.0 + x,
    }
}
