//! The last resort for triangles that are folded or nearly without area: an edge of theirs is
//! shrunk to a point, which `Mesh::collapse_degenerate_edges` then takes out if the surface stays
//! the same. Points that slid past each other along a sharp edge make such triangles.

use rustc_hash::FxHashMap;

use super::facets::shape;
use super::place::Vertex;
use crate::geometry::DisjointSets;

/// Triangles below this shape are taken out, where 1 is equilateral.
const BAD: f64 = 0.01;

/// Vertices on sharp edges that are nearer to each other than this part of a cell are one: those of
/// cells that share a corner, or an edge of the surface, find the same point but for rounding.
const SAME: f64 = 1e-6;

/// Joins the vertices of rank 2 or more that an edge shorter than a part of a cell connects: all
/// that are connected so get the place of the one with the highest rank, of these the first.
pub(super) fn join_coinciding(triangles: &[[u32; 3]], vertices: &mut [Vertex], cell: f64) {
    let near = |a: u32, b: u32| {
        let [a, b] = [a, b].map(|end| &vertices[end as usize]);
        a.rank > 1 && b.rank > 1 && a.position.distance_squared(b.position) < (SAME * cell).powi(2)
    };
    let sides = triangles
        .iter()
        .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let short: Vec<(u32, u32)> = sides.filter(|&(a, b)| near(a, b)).collect();
    if short.is_empty() {
        return;
    }
    let mut joined = DisjointSets::new(vertices.len() as u32);
    for &(a, b) in &short {
        joined.union(a, b);
    }
    let mut ends: Vec<u32> = short.into_iter().flat_map(|(a, b)| [a, b]).collect();
    ends.sort_unstable();
    ends.dedup();
    let mut best: FxHashMap<u32, Vertex> = FxHashMap::default();
    for &end in &ends {
        let own = vertices[end as usize];
        let best = best.entry(joined.find(end)).or_insert(own);
        if own.rank > best.rank {
            *best = own;
        }
    }
    for end in ends {
        if let Some(&vertex) = best.get(&joined.find(end)) {
            vertices[end as usize] = vertex;
        }
    }
}

/// Moves vertices of bad triangles onto each other, where that leaves no worse ones around.
pub(super) fn merge(triangles: &[[u32; 3]], vertices: &mut [Vertex]) {
    let bad: Vec<[u32; 3]> = (triangles.iter().copied())
        .filter(|&corners| fitness(corners, vertices) < BAD)
        .collect();
    let mut around: FxHashMap<u32, Vec<[u32; 3]>> = FxHashMap::default();
    around.extend(bad.iter().flatten().map(|&corner| (corner, Vec::new())));
    for corners in triangles {
        for corner in corners {
            if let Some(list) = around.get_mut(corner) {
                list.push(*corners);
            }
        }
    }
    for corners in bad {
        // It may have been mended together with another one.
        if fitness(corners, vertices) < BAD {
            mend(corners, &around, vertices);
        }
    }
}

/// Moves an end of an edge of a triangle onto the other end; edges are tried from the shortest.
fn mend(corners: [u32; 3], around: &FxHashMap<u32, Vec<[u32; 3]>>, vertices: &mut [Vertex]) {
    let [a, b, c] = corners;
    let mut moves = [(a, b), (b, a), (b, c), (c, b), (c, a), (a, c)];
    let length = |(from, to): (u32, u32), vertices: &[Vertex]| {
        let [from, to] = [from, to].map(|end| vertices[end as usize].position);
        from.distance(to)
    };
    moves.sort_by(|&one, &other| length(one, vertices).total_cmp(&length(other, vertices)));
    for (from, to) in moves {
        let (old, new) = (vertices[from as usize], vertices[to as usize]);
        // What is on a sharp edge stays on it, and corners stay.
        if old.rank > new.rank || old.rank > 2 {
            continue;
        }
        let Some(fan) = around.get(&from) else {
            continue;
        };
        let left = |vertices: &[Vertex]| {
            let kept = fan.iter().filter(|corners| !corners.contains(&to));
            let worst = kept.map(|&corners| fitness(corners, vertices));
            worst.fold(f64::INFINITY, f64::min)
        };
        let before = left(vertices);
        vertices[from as usize] = new;
        if left(vertices) >= before.min(BAD) {
            return;
        }
        vertices[from as usize] = old;
    }
}

/// The shape of a triangle; negative if it faces away from the normal of a smooth corner.
fn fitness(corners: [u32; 3], vertices: &[Vertex]) -> f64 {
    let corners = corners.map(|corner| vertices[corner as usize]);
    let points = corners.map(|corner| corner.position);
    let normal = (points[1] - points[0]).cross(points[2] - points[0]);
    let mut smooth = corners.iter().filter(|corner| corner.rank == 1);
    let is_folded = smooth.any(|corner| corner.normal.dot(normal) < 0.0);
    if is_folded {
        shape(points) - 1.0
    } else {
        shape(points)
    }
}
