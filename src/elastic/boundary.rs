//! How simplices hang together: edges, the faces that belong to one alone, pieces; and the boundary as a
//! mesh or as curves.

use glam::DVec3;
use rayon::slice::ParallelSliceMut;

use crate::geometry::{Curves, DisjointSets, Mesh, Polyline};

/// The faces of a tetrahedron, by places in its list of corners: outward if it is positively oriented.
const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// The sides of a triangle, the last corner repeated.
const SIDES: [[usize; 3]; 3] = [[0, 1, 1], [1, 2, 2], [2, 0, 0]];

fn face_places(dimension: usize) -> &'static [[usize; 3]] {
    match dimension {
        2 => &SIDES,
        _ => &FACES,
    }
}

/// A face of a simplex.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Face {
    /// Its nodes, ascending.
    nodes: [u32; 3],
    simplex: u32,
    /// Which of the simplex's.
    place: u8,
}

/// All faces of all simplices, equal ones side by side.
fn sorted_faces(dimension: usize, simplices: &[[u32; 4]]) -> Vec<Face> {
    let mut faces = Vec::with_capacity(simplices.len() * face_places(dimension).len());
    for (number, simplex) in simplices.iter().enumerate() {
        for (place, corners) in face_places(dimension).iter().enumerate() {
            let mut nodes = corners.map(|corner| simplex[corner]);
            // A side repeats one node: which of them must not matter.
            if dimension == 2 {
                nodes[2] = nodes[0].max(nodes[1]);
            }
            nodes.sort_unstable();
            faces.push(Face {
                nodes,
                simplex: number as u32,
                place: place as u8,
            });
        }
    }
    faces.par_sort_unstable();
    faces
}

/// The faces that belong to one simplex alone, outward, in the order of the simplices.
pub(super) fn faces(dimension: usize, simplices: &[[u32; 4]]) -> Vec<[u32; 3]> {
    let sorted = sorted_faces(dimension, simplices);
    let groups = sorted.chunk_by(|a, b| a.nodes == b.nodes);
    let mut alone: Vec<Face> = groups
        .filter(|group| group.len() == 1)
        .flatten()
        .copied()
        .collect();
    alone.sort_unstable_by_key(|face| (face.simplex, face.place));
    let oriented = alone.into_iter().map(|face| {
        let corners = face_places(dimension)[face.place as usize];
        corners.map(|corner| simplices[face.simplex as usize][corner])
    });
    oriented.collect()
}

/// The edges, each once, the lesser node first; ascending.
pub(super) fn edges(dimension: usize, simplices: &[[u32; 4]]) -> Vec<[u32; 2]> {
    let mut edges = Vec::new();
    for simplex in simplices {
        for end in 1..=dimension {
            for start in 0..end {
                let (a, b) = (simplex[start], simplex[end]);
                edges.push([a.min(b), a.max(b)]);
            }
        }
    }
    edges.par_sort_unstable();
    edges.dedup();
    edges
}

/// The number of pieces that share no node. Every node belongs to a simplex.
pub(super) fn pieces(nodes: usize, simplices: &[[u32; 4]]) -> usize {
    let mut sets = DisjointSets::new(nodes as u32);
    let joined = simplices
        .iter()
        .flat_map(|&[a, b, c, d]| [(a, b), (a, c), (a, d)]);
    nodes - joined.filter(|&(a, b)| sets.union(a, b)).count()
}

/// Gives nodes of their own to simplices that meet in a node, but have no chain of neighbours with common faces
/// around it: a joint of a single point would be no solid. Gives the new nodes, the new simplices, and from
/// which node each new one comes.
pub(super) fn separate(
    dimension: usize,
    nodes: Vec<DVec3>,
    mut simplices: Vec<[u32; 4]>,
) -> (Vec<DVec3>, Vec<[u32; 4]>, Vec<u32>) {
    let mut corners = DisjointSets::new(4 * simplices.len() as u32);
    let corner_of = |face: &Face, node: u32| {
        let place = simplices[face.simplex as usize]
            .iter()
            .position(|&corner| corner == node);
        4 * face.simplex + place.unwrap_or(0) as u32
    };
    let sorted = sorted_faces(dimension, &simplices);
    for pair in sorted
        .windows(2)
        .filter(|pair| pair[0].nodes == pair[1].nodes)
    {
        for node in pair[0].nodes {
            corners.union(corner_of(&pair[0], node), corner_of(&pair[1], node));
        }
    }
    let mut numbers = vec![u32::MAX; 4 * simplices.len()];
    let mut taken = vec![false; nodes.len()];
    let mut origins: Vec<u32> = (0..nodes.len() as u32).collect();
    for (number, simplex) in simplices.iter_mut().enumerate() {
        for (place, corner) in simplex.iter_mut().enumerate().take(dimension + 1) {
            let set = corners.find((4 * number + place) as u32) as usize;
            let node = *corner;
            if numbers[set] == u32::MAX {
                numbers[set] = match std::mem::replace(&mut taken[node as usize], true) {
                    false => node,
                    true => {
                        origins.push(node);
                        origins.len() as u32 - 1
                    }
                };
            }
            *corner = numbers[set];
        }
        if dimension == 2 {
            simplex[3] = simplex[2];
        }
    }
    let nodes = origins.iter().map(|&node| nodes[node as usize]).collect();
    (nodes, simplices, origins)
}

/// A boundary without places: which nodes are on it, and its faces by their numbers among these.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Skin {
    dimension: usize,
    /// The nodes on the boundary, ascending.
    pub(super) nodes: Vec<u32>,
    faces: Vec<[u32; 3]>,
}

impl Skin {
    pub(super) fn new(dimension: usize, boundary: &[[u32; 3]]) -> Skin {
        let mut nodes: Vec<u32> = boundary.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let number = |node: u32| nodes.partition_point(|&other| other < node) as u32;
        let faces = boundary.iter().map(|face| face.map(number)).collect();
        Skin {
            dimension,
            nodes,
            faces,
        }
    }

    /// The places of the boundary's nodes among those of all.
    pub(super) fn places(&self, nodes: &[DVec3]) -> Vec<DVec3> {
        let places = self.nodes.iter().map(|&node| nodes[node as usize]);
        places.collect()
    }

    /// The boundary of a body with these nodes as a mesh. A normal is the mean of the normals around a
    /// vertex, weighted by area.
    pub(super) fn mesh(&self, nodes: &[DVec3]) -> Mesh {
        self.mesh_of(self.places(nodes))
    }

    /// The mesh with these positions.
    pub(super) fn mesh_of(&self, positions: Vec<DVec3>) -> Mesh {
        let triangles = match self.dimension {
            2 => Vec::new(),
            _ => self.faces.clone(),
        };
        let mut normals = vec![DVec3::ZERO; positions.len()];
        for triangle in &triangles {
            let [a, b, c] = triangle.map(|vertex| positions[vertex as usize]);
            for &vertex in triangle {
                normals[vertex as usize] += (b - a).cross(c - a);
            }
        }
        for normal in &mut normals {
            *normal = normal.normalize_or_zero();
        }
        Mesh {
            positions,
            normals,
            triangles,
        }
    }

    /// The boundary of a body with these nodes as closed curves.
    pub(super) fn curves(&self, nodes: &[DVec3]) -> Curves {
        self.curves_of(&self.places(nodes))
    }

    /// The curves with these positions.
    pub(super) fn curves_of(&self, positions: &[DVec3]) -> Curves {
        let mut next = vec![u32::MAX; positions.len()];
        if self.dimension == 2 {
            for &[from, to, _] in &self.faces {
                next[from as usize] = to;
            }
        }
        let mut polylines = Vec::new();
        for start in 0..positions.len() {
            let mut points = Vec::new();
            let mut at = start;
            while next[at] != u32::MAX {
                points.push(positions[at]);
                at = std::mem::replace(&mut next[at], u32::MAX) as usize;
            }
            if !points.is_empty() {
                polylines.push(Polyline {
                    points,
                    closed: true,
                });
            }
        }
        Curves {
            dimension: 2,
            polylines,
        }
    }
}
