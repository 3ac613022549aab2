//! Merging of vertices near grid points ("iso-snapping"): where the surface passes close to a grid
//! point, marching cubes makes thin triangles around it, a quarter of all.
//!
//! All roots that are nearest to one grid point and joined by edges of the mesh become one vertex,
//! as far as the surface remains the same up to homeomorphism. The vertex lies on the level set: it
//! is the mean of the roots, moved there by Newton's method. If only roots closer than, say, a
//! quarter of an edge were merged, those left in the middle of an edge would make slivers with the
//! merged vertices at its ends. The idea is that of Raman and Wenger,
//! "Quality isosurface mesh generation using an extended marching cubes lookup table", Computer
//! Graphics Forum 27 (2008), who move the grid's values instead.

use glam::DVec3;

use super::super::edge_roots::{Edge, Root};
use super::super::grid::Grid;
use super::super::projection::{Start, newton};
use super::Job;
use crate::geometry::{DisjointSets, Mesh};

/// The least cosine between a triangle's normal and the mean of the level set's at its corners.
const LEAST_COSINE: f64 = 0.2;

/// The end of an edge that is nearer to its root. None if the root is poor, and none for what is
/// in a side of the box, where vertices must stay.
pub(super) fn near_end(grid: &Grid, edge: &Edge, root: &Root) -> Option<DVec3> {
    let [inside, outside] = [edge.inside[edge.axis], edge.outside];
    if root.is_poor() || inside == outside || grid.is_on_side(root.position) {
        return None;
    }
    let at = root.position[edge.axis];
    let mut end = edge.inside;
    if (at - outside).abs() < (at - inside).abs() {
        end[edge.axis] = outside;
    }
    Some(end)
}

/// Merges vertices that are near the same grid point, given for each vertex; `reach` is how far
/// they may be from it. Returns the number of evaluations and the greatest residual of what is
/// moved.
///
/// Vertices that one merged vertex would turn a triangle over stay as they are; so do those whose
/// merging would change the topology, and those with no root near the grid point.
pub(super) fn merge(
    mesh: &mut Mesh,
    near: &[Option<DVec3>],
    reach: DVec3,
    job: &Job,
) -> (usize, f64) {
    let edges = edges_to_merge(mesh, near);
    let clusters = Clusters::new(mesh, &edges);
    let (roots, evaluations) = clusters.roots(mesh, near, reach, job);
    let kept = clusters.without_turned_triangles(mesh, &roots);
    let cluster_of = |vertex: u32| clusters.numbers[vertex as usize];
    let merged = |vertex: u32| cluster_of(vertex).filter(|&cluster| kept[cluster]);
    let edges = edges.into_iter().filter(|&(a, _)| merged(a).is_some());
    let became = mesh.collapse_edges(edges.collect());
    // How many vertices are left of each cluster.
    let survivors = (0..).zip(&became).filter(|&(own, became)| own == *became);
    let survivors: Vec<u32> = survivors.map(|(own, _)| own).collect();
    let mut left = vec![0; roots.len()];
    for cluster in survivors.iter().filter_map(|&vertex| merged(vertex)) {
        left[cluster] += 1;
    }
    let mut residual = 0.0;
    for (number, &vertex) in survivors.iter().enumerate() {
        if let Some(cluster) = merged(vertex).filter(|&cluster| left[cluster] == 1) {
            let root = roots[cluster];
            mesh.positions[number] = root.position;
            mesh.normals[number] = root.normal;
            residual = f64::max(residual, root.residual);
        }
    }
    (evaluations, residual)
}

/// The edges between vertices that are near the same grid point.
fn edges_to_merge(mesh: &Mesh, near: &[Option<DVec3>]) -> Vec<(u32, u32)> {
    let near = |vertex: u32| near.get(vertex as usize).copied().flatten();
    let sides = (mesh.triangles.iter()).flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let mut edges: Vec<(u32, u32)> = sides
        .filter(|&(a, b)| near(a).is_some() && near(a) == near(b))
        .map(|(a, b)| (a.min(b), a.max(b)))
        .collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}

/// Sets of two vertices or more that are to become one.
struct Clusters {
    /// The cluster of each vertex.
    numbers: Vec<Option<usize>>,
    /// Their vertices.
    members: Vec<Vec<u32>>,
}

impl Clusters {
    /// The vertices that these edges connect.
    fn new(mesh: &Mesh, edges: &[(u32, u32)]) -> Self {
        let count = mesh.positions.len();
        let mut sets = DisjointSets::new(count as u32);
        let mut numbers = vec![None; count];
        let mut members: Vec<Vec<u32>> = Vec::new();
        let mut in_edge = vec![false; count];
        for &(a, b) in edges {
            sets.union(a, b);
            in_edge[a as usize] = true;
            in_edge[b as usize] = true;
        }
        for vertex in (0..count as u32).filter(|&vertex| in_edge[vertex as usize]) {
            let least = sets.find(vertex) as usize;
            let number = *numbers[least].get_or_insert_with(|| {
                members.push(Vec::new());
                members.len() - 1
            });
            numbers[vertex as usize] = Some(number);
            members[number].push(vertex);
        }
        Clusters { numbers, members }
    }

    /// A point of the level set for each cluster, poor where there is none.
    fn roots(
        &self,
        mesh: &Mesh,
        near: &[Option<DVec3>],
        reach: DVec3,
        job: &Job,
    ) -> (Vec<Root>, usize) {
        let start = |members: &Vec<u32>| {
            let positions = members
                .iter()
                .map(|&vertex| mesh.positions[vertex as usize]);
            let point = positions.sum::<DVec3>() / members.len() as f64;
            let grid_point = members.first().and_then(|&vertex| near[vertex as usize]);
            let grid_point = grid_point.unwrap_or(point);
            Start {
                point,
                low: grid_point - reach,
                high: grid_point + reach,
                ends: [point; 2],
            }
        };
        let starts: Vec<Start> = self.members.iter().map(start).collect();
        newton(&mut { job.field }, job.accuracy, &starts)
    }

    /// Which clusters can be merged so that no triangle turns over against the level set's
    /// normals. The others are given up one round after the other, until none is left to be.
    fn without_turned_triangles(&self, mesh: &Mesh, roots: &[Root]) -> Vec<bool> {
        let mut kept: Vec<bool> = roots.iter().map(|root| !root.is_poor()).collect();
        loop {
            let cluster = |vertex: u32| self.numbers[vertex as usize].filter(|&c| kept[c]);
            let place = |vertex: u32| match cluster(vertex) {
                Some(cluster) => (roots[cluster].position, roots[cluster].normal),
                None => {
                    let vertex = vertex as usize;
                    (mesh.positions[vertex], mesh.normals[vertex])
                }
            };
            let mut turned = Vec::new();
            for triangle in &mesh.triangles {
                let clusters = triangle.map(cluster);
                let [p, q, r] = clusters;
                let one = |a: Option<usize>, b| a.is_some() && a == b;
                // Nothing moves, or the triangle disappears.
                if clusters == [None; 3] || one(p, q) || one(q, r) || one(r, p) {
                    continue;
                }
                let [a, b, c] = triangle.map(place);
                let across = (b.0 - a.0).cross(c.0 - a.0);
                let normal = a.1 + b.1 + c.1;
                let upright = across.dot(normal) > LEAST_COSINE * across.length() * normal.length();
                if !upright {
                    turned.extend(clusters.into_iter().flatten());
                }
            }
            if turned.is_empty() {
                return kept;
            }
            for cluster in turned {
                kept[cluster] = false;
            }
        }
    }
}
