//! The last resort for triangles that are folded or nearly without area: an edge of theirs is
//! shrunk to a point, which `Mesh::collapse_degenerate_edges` then takes out if the surface stays
//! the same. Points that slid past each other along a sharp edge make such triangles.

use rustc_hash::FxHashMap;

use super::facets::shape;
use super::place::Vertex;

/// Triangles below this shape are taken out, where 1 is equilateral.
const BAD: f64 = 0.01;

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
