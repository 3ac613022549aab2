//! The last resort for triangles that are folded or nearly without area: an edge of theirs is
//! shrunk to a point, which `Mesh::collapse_degenerate_edges` then takes out if the surface stays
//! the same. Points that slid past each other along a sharp edge make such triangles.

use rustc_hash::FxHashMap;

use super::facets::Patch;
use super::place::Vertex;
use crate::geometry::{DisjointSets, Mesh};

/// Triangles below this shape are taken out, where 1 is equilateral.
const BAD: f64 = 0.01;

/// Vertices on sharp edges that are nearer to each other than this part of a cell are one: those of
/// cells that share a corner, or an edge of the surface, find the same point but for rounding.
const SAME: f64 = 1e-6;

/// Joins the vertices of rank 2 or more that an edge shorter than a part of a cell connects: all
/// that are connected so get the place of the one with the highest rank, of these the first.
pub(super) fn join_coinciding(triangles: &[[u32; 3]], vertices: &mut [Vertex], cell: f64) {
    let near = |a: u32, b: u32, vertices: &[Vertex]| {
        let [a, b] = [a, b].map(|end| &vertices[end as usize]);
        a.rank > 1 && b.rank > 1 && a.position.distance(b.position) < SAME * cell
    };
    pull_between(triangles, vertices, SAME * cell);
    let near = |a: u32, b: u32| near(a, b, vertices);
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

/// Two vertices at one corner that are no neighbours have come to it past those between them, as
/// cells do of which only some reach as far as a corner on a point of the lattice: it takes those
/// of lower rank that are neighbours of both, too.
fn pull_between(triangles: &[[u32; 3]], vertices: &mut [Vertex], distance: f64) {
    let is_corner = |vertex: &u32| vertices[*vertex as usize].rank > 2;
    let mut neighbours: FxHashMap<u32, Vec<u32>> = FxHashMap::default();
    for &[a, b, c] in triangles {
        for (own, others) in [(a, [b, c]), (b, [c, a]), (c, [a, b])] {
            if is_corner(&own) {
                neighbours.entry(own).or_default().extend(others);
            }
        }
    }
    let mut corners: Vec<u32> = neighbours.keys().copied().collect();
    let x = |vertex: u32| vertices[vertex as usize].position.x;
    corners.sort_unstable_by(|&one, &other| x(one).total_cmp(&x(other)).then(one.cmp(&other)));
    let mut pulled = Vec::new();
    for (place, &one) in corners.iter().enumerate() {
        let at = vertices[one as usize].position;
        let behind = corners[place + 1..].iter();
        let near = behind.take_while(|&&other| x(other) - at.x < distance);
        for other in near {
            let is_same = vertices[*other as usize].position.distance(at) < distance;
            if !is_same || neighbours[&one].contains(other) {
                continue;
            }
            let between = neighbours[&one].iter();
            let between = between.filter(|own| neighbours[other].contains(own) && !is_corner(own));
            pulled.extend(between.map(|&own| (own, vertices[one as usize])));
        }
    }
    for (own, vertex) in pulled {
        // A point of the surface beside the sharp edges is better left where it is.
        if vertices[own as usize].rank == 2 {
            vertices[own as usize] = vertex;
        }
    }
}

/// Moves vertices of bad triangles onto each other, where that leaves no worse ones around.
/// Returns those that were moved, with what they were.
pub(super) fn merge(triangles: &[[u32; 3]], vertices: &mut [Vertex]) -> Vec<(u32, Vertex)> {
    let bad: Vec<[u32; 3]> = (triangles.iter().copied())
        .filter(|&corners| corners.fitness(vertices) < BAD)
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
    let mut moved = Vec::new();
    for corners in bad {
        // It may have been mended together with another one.
        if corners.fitness(vertices) < BAD {
            moved.extend(mend(corners, &around, vertices));
        }
    }
    moved
}

/// Takes out the edges without length; vertices that were moved onto others, but cannot become one
/// with them lest the surface change, go back.
pub(super) fn collapse(mesh: &mut Mesh, moved: &[(u32, Vertex)]) {
    let edges = mesh.degenerate_edges();
    if edges.is_empty() {
        return;
    }
    let count = mesh.positions.len();
    let mut is_used = vec![false; count];
    for &corner in mesh.triangles.as_flattened() {
        is_used[corner as usize] = true;
    }
    let became = mesh.collapse_edges(edges);
    let mut sizes = vec![0u32; count];
    for &own in &became {
        sizes[own as usize] += 1;
    }
    // Where those that are left are now: in their order.
    let is_left = (0u32..).zip(became.iter().zip(&is_used));
    let is_left = is_left.map(|(own, (&became, &is_used))| own == became && is_used);
    let numbers: Vec<usize> = is_left
        .scan(0, |next, is_left| {
            let own = *next;
            *next += usize::from(is_left);
            Some(own)
        })
        .collect();
    // What was moved twice is again what it was first.
    for (own, old) in moved.iter().rev() {
        if sizes[*own as usize] == 1 && is_used[*own as usize] {
            let number = numbers[*own as usize];
            mesh.positions[number] = old.position;
            mesh.normals[number] = old.normal;
        }
    }
}

/// Moves an end of an edge of a triangle onto the other end; edges are tried from the shortest.
/// Returns the one that was moved, with what it was.
fn mend(
    corners: [u32; 3],
    around: &FxHashMap<u32, Vec<[u32; 3]>>,
    vertices: &mut [Vertex],
) -> Option<(u32, Vertex)> {
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
            let worst = kept.map(|&corners| corners.fitness(vertices));
            worst.fold(f64::INFINITY, f64::min)
        };
        let before = left(vertices);
        vertices[from as usize] = new;
        if left(vertices) >= before.min(BAD) {
            return Some((from, old));
        }
        vertices[from as usize] = old;
    }
    None
}
