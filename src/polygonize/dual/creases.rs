//! Sharp edges that no cell has seen. One that lies in a plane of the lattice passes between cells of
//! which each sees a single side, so that edges of the mesh cross it and cut it off. They are split
//! at points on the sharp edge, which makes it a path of edges: a triangle with two of them has a
//! part of the sharp edge between its new points, one with three has a corner.

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::block::Plan;
use super::facets::Patch;
use super::flips::faces_outward;
use super::place::{Contact, Site, Vertex, are_alike, is_curved};
use super::scattered::Scattered;
use crate::polygonize::Job;
use crate::polygonize::columns::Columns;
use crate::polygonize::edge_roots::first_order_distance;

/// An edge whose middle is nearer to the surface than this part of its length cuts nothing off.
const CUTS: f64 = 0.02;

/// How far from the middle of an edge its new point may be, in lengths of the edge.
const REACH: f64 = 0.75;

/// Splits edges of the mesh that cross a sharp edge; returns whether there are any, and the number of
/// evaluations.
pub(super) fn split(
    (job, plan, field): (&Job, &Plan, &mut Scattered),
    triangles: &mut Vec<[u32; 3]>,
    vertices: &mut Vec<Vertex>,
) -> (bool, usize) {
    let bent = bent_edges(triangles, vertices);
    let (cutting, mut evaluations) = cutting((job, field), &bent, vertices);
    if cutting.is_empty() {
        return (false, evaluations);
    }
    let (found, count) = points((job, plan, field), &cutting, vertices);
    evaluations += count;
    let first = vertices.len();
    let mut split: FxHashMap<[u32; 2], u32> = FxHashMap::default();
    for (edge, vertex) in cutting.iter().zip(found) {
        if let (Some(vertex), Ok(number)) = (vertex, u32::try_from(vertices.len())) {
            split.insert(*edge, number);
            vertices.push(vertex);
        }
    }
    drop_unsound(triangles, vertices, &mut split);
    let mut parts = Vec::with_capacity(triangles.len() + 2 * split.len());
    for &corners in triangles.iter() {
        add_parts(corners, &split, vertices, &mut parts);
    }
    *triangles = parts;
    (vertices.len() > first, evaluations)
}

/// The edges between smooth vertices whose normals differ, in the order of the triangles, the lower
/// end first.
fn bent_edges(triangles: &[[u32; 3]], vertices: &[Vertex]) -> Vec<[u32; 2]> {
    let sides = triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let is_bent = |[a, b]: &[u32; 2]| {
        let ends = [a, b].map(|&end| &vertices[end as usize]);
        // Every edge is met twice.
        a < b
            && ends.iter().all(|end| end.rank == 1)
            && !are_alike(ends.map(|end| end.normal).into_iter())
    };
    sides.filter(is_bent).collect()
}

/// Those whose middle is off the surface, which is not just curved there, and the number of
/// evaluations.
fn cutting(
    (job, field): (&Job, &mut Scattered),
    edges: &[[u32; 2]],
    vertices: &[Vertex],
) -> (Vec<[u32; 2]>, usize) {
    let mut columns = Columns::default();
    columns.set_points(edges.iter().map(|&edge| middle(ends(edge, vertices))));
    columns.evaluate(field, job.accuracy.iso);
    let cuts = |(index, edge): (usize, &[u32; 2])| {
        let (value, gradient) = columns.result(index);
        let ends = ends(*edge, vertices);
        let length = ends[0].position.distance(ends[1].position);
        let is_off = first_order_distance(value, gradient) > CUTS * length;
        (is_off && !is_curved(&ends, gradient)).then_some(*edge)
    };
    let cutting = edges.iter().enumerate().filter_map(cuts).collect();
    (cutting, edges.len())
}

/// A point of a sharp edge for each of these edges, if there is one, and the number of evaluations.
fn points(
    (job, plan, field): (&Job, &Plan, &mut Scattered),
    edges: &[[u32; 2]],
    vertices: &[Vertex],
) -> (Vec<Option<Vertex>>, usize) {
    let contacts: Vec<Contact> = (edges.iter())
        .flat_map(|&edge| ends(edge, vertices))
        .collect();
    let pairs = contacts.as_chunks::<2>().0;
    let site = |(index, pair): (usize, &[Contact; 2])| {
        let (middle, length) = (middle(*pair), pair[0].position.distance(pair[1].position));
        Site {
            low: middle - REACH * length,
            high: middle + REACH * length,
            middle,
            roots: 2 * index..2 * index + 2,
            outward: DVec3::ZERO,
        }
    };
    let sites: Vec<Site> = pairs.iter().enumerate().map(site).collect();
    let bounds = &job.options.bounds;
    let is_fit = |place: usize, point: DVec3| {
        let site = &sites[place];
        let reach = 0.5 * (site.high.x - site.low.x);
        point.distance(site.middle) <= reach && bounds.contains(point)
    };
    let mut columns = Columns::default();
    let mut placer = plan.placer(field, &mut columns);
    let found = placer.find_sharp(&sites, &contacts, &is_fit);
    (found, placer.evaluations)
}

fn ends(edge: [u32; 2], vertices: &[Vertex]) -> [Contact; 2] {
    edge.map(|end| {
        let Vertex {
            position, normal, ..
        } = vertices[end as usize];
        Contact { position, normal }
    })
}

fn middle([one, other]: [Contact; 2]) -> DVec3 {
    0.5 * (one.position + other.position)
}

/// Gives up those splits that would turn a triangle over or leave it no area.
fn drop_unsound(triangles: &[[u32; 3]], vertices: &[Vertex], split: &mut FxHashMap<[u32; 2], u32>) {
    let mut parts = Vec::new();
    loop {
        let mut unsound: Vec<[u32; 2]> = Vec::new();
        for &corners in triangles {
            parts.clear();
            add_parts(corners, split, vertices, &mut parts);
            let is_split = parts.len() > 1;
            if is_split && !parts.iter().all(|&part| faces_outward(part, vertices)) {
                unsound.extend(sides(corners));
            }
        }
        let before = split.len();
        for edge in unsound {
            split.remove(&edge);
        }
        if split.len() == before {
            break;
        }
    }
}

/// The sides of a triangle, the lower end of each first.
fn sides([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(|[from, to]| [from.min(to), from.max(to)])
}

/// Adds what a triangle becomes when its sides are split.
fn add_parts(
    corners: [u32; 3],
    split: &FxHashMap<[u32; 2], u32>,
    vertices: &[Vertex],
    parts: &mut Vec<[u32; 3]>,
) {
    let points = sides(corners).map(|side| split.get(&side).copied());
    for turn in 0..3 {
        let [a, b, c] = [0, 1, 2].map(|step| corners[(turn + step) % 3]);
        match [0, 1, 2].map(|step| points[(turn + step) % 3]) {
            [Some(ab), None, None] => return parts.extend([[a, ab, c], [ab, b, c]]),
            [Some(ab), Some(bc), None] => {
                let first = [[a, ab, bc], [a, bc, c]];
                let second = [[a, ab, c], [ab, bc, c]];
                let worse = |pair: [[u32; 3]; 2]| pair.map(|part| part.fitness(vertices));
                let worse = |pair| worse(pair).into_iter().fold(f64::INFINITY, f64::min);
                parts.push([ab, b, bc]);
                return parts.extend(if worse(first) >= worse(second) {
                    first
                } else {
                    second
                });
            }
            [Some(ab), Some(bc), Some(ca)] => {
                return parts.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
            }
            _ => {}
        }
    }
    parts.push(corners);
}
