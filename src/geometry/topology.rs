//! How a mesh hangs together: edges, boundary, components, genus, and whether it is a closed,
//! oriented surface. Connectivity is by vertex index alone; positions play no part.

use rayon::slice::ParallelSliceMut;

use super::Mesh;
use super::disjoint_sets::DisjointSets;

/// What the connectivity of a mesh amounts to. Made by [`Mesh::topology`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Topology {
    /// Vertices that some triangle uses.
    pub vertices: usize,
    /// Edges, each counted once however many triangles share it.
    pub edges: usize,
    /// Triangles.
    pub triangles: usize,
    /// Pieces that are connected by shared vertices.
    pub components: usize,
    /// Edges that belong to one triangle only.
    pub boundary_edges: usize,
    /// Connected pieces of the boundary. In a manifold mesh each is a simple closed loop.
    pub boundary_loops: usize,
    /// Edges that belong to more than two triangles, or join a vertex to itself.
    pub nonmanifold_edges: usize,
    /// Vertices at which the triangles form more than one fan: a fan goes on from triangle to
    /// triangle across shared edges, also across those that more than two share.
    pub nonmanifold_vertices: usize,
    /// Whether the mesh is a surface, possibly with boundary: no edge belongs to more than two
    /// triangles, and the triangles around every vertex form one fan.
    pub manifold: bool,
    /// Whether no edge is run through twice in the same direction: neighbouring triangles agree
    /// on which side is outside.
    pub oriented: bool,
    /// Whether every edge is run through exactly once in either direction, and there is at least
    /// one triangle.
    pub watertight: bool,
}

impl Topology {
    /// χ = vertices − edges + triangles.
    pub fn euler_characteristic(&self) -> i64 {
        self.vertices as i64 - self.edges as i64 + self.triangles as i64
    }

    /// The number of handles, added up over the components: (2·components − χ − boundary
    /// loops) / 2. `None` if the mesh is not an oriented manifold, for then the formula means
    /// nothing.
    pub fn genus(&self) -> Option<usize> {
        if !(self.manifold && self.oriented) {
            return None;
        }
        let doubled =
            2 * self.components as i64 - self.euler_characteristic() - self.boundary_loops as i64;
        usize::try_from(doubled / 2).ok()
    }
}

impl Mesh {
    /// Everything about the connectivity in one pass.
    ///
    /// Costs a sort of the 3·triangles half-edges (parallel) and about 60 bytes of memory a
    /// triangle; ask once and keep the answer. The other topological methods of a mesh each
    /// call this one.
    pub fn topology(&self) -> Topology {
        let half_edges = sorted_half_edges(&self.triangles);
        let mut survey = Survey::new(self);
        for uses in half_edges.chunk_by(|a, b| a.edge == b.edge) {
            survey.add_edge(uses);
        }
        survey.finish()
    }

    /// χ = vertices − edges + triangles, of the vertices that are used. See [`Mesh::topology`].
    pub fn euler_characteristic(&self) -> i64 {
        self.topology().euler_characteristic()
    }

    /// Handles over all components; `None` unless the mesh is an oriented manifold. See
    /// [`Topology::genus`].
    pub fn genus(&self) -> Option<usize> {
        self.topology().genus()
    }

    /// Pieces that are connected by shared vertices. See [`Mesh::topology`].
    pub fn components(&self) -> usize {
        self.topology().components
    }

    /// The number of edges that belong to one triangle only. See [`Mesh::topology`].
    pub fn boundary_edges(&self) -> usize {
        self.topology().boundary_edges
    }

    /// Connected pieces of the boundary. See [`Mesh::topology`].
    pub fn boundary_loops(&self) -> usize {
        self.topology().boundary_loops
    }

    /// Whether every edge is run through exactly once in either direction. A mesh without
    /// triangles is not watertight. See [`Mesh::topology`].
    pub fn is_watertight(&self) -> bool {
        self.topology().watertight
    }

    /// Whether the mesh is a surface, possibly with boundary. See [`Topology::manifold`].
    pub fn is_manifold(&self) -> bool {
        self.topology().manifold
    }
}

/// One side of a triangle, from its corner `corner` to the next. Corner `3·t + k` is vertex `k`
/// of triangle `t`; it also names the side that starts there.
#[derive(Clone, Copy)]
struct HalfEdge {
    /// The two vertices, the lesser first, in one number: equal for both sides of an edge.
    edge: u64,
    corner: u32,
}

/// All sides of all triangles, sorted by edge, then by corner.
fn sorted_half_edges(triangles: &[[u32; 3]]) -> Vec<HalfEdge> {
    let mut half_edges: Vec<HalfEdge> = triangles
        .iter()
        .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
        .zip(0..)
        .map(|((from, to), corner)| HalfEdge {
            edge: u64::from(from.min(to)) << 32 | u64::from(from.max(to)),
            corner,
        })
        .collect();
    half_edges.par_sort_unstable_by_key(|half_edge| (half_edge.edge, half_edge.corner));
    half_edges
}

/// The corner that follows in the same triangle.
fn next_corner(corner: u32) -> u32 {
    if corner % 3 == 2 {
        corner - 2
    } else {
        corner + 1
    }
}

/// What is known while the edges are gone through.
struct Survey<'a> {
    mesh: &'a Mesh,
    /// Vertices joined by edges: components.
    vertices: DisjointSets,
    /// Vertices joined by boundary edges: boundary loops.
    boundary: DisjointSets,
    /// Corners joined where two triangles share an edge: each set is one fan at one vertex.
    corners: DisjointSets,
    edges: usize,
    boundary_edges: usize,
    on_boundary: Vec<bool>,
    /// How many unions joined different sets, in the first two partitions.
    component_unions: usize,
    boundary_unions: usize,
    nonmanifold_edges: usize,
    oriented: bool,
}

impl<'a> Survey<'a> {
    fn new(mesh: &'a Mesh) -> Self {
        let vertices = mesh.positions.len();
        Survey {
            mesh,
            vertices: DisjointSets::new(vertices as u32),
            boundary: DisjointSets::new(vertices as u32),
            corners: DisjointSets::new(3 * mesh.triangles.len() as u32),
            edges: 0,
            boundary_edges: 0,
            on_boundary: vec![false; vertices],
            component_unions: 0,
            boundary_unions: 0,
            nonmanifold_edges: 0,
            oriented: true,
        }
    }

    /// The vertex at a corner.
    fn vertex(&self, corner: u32) -> u32 {
        self.mesh.triangles[corner as usize / 3][corner as usize % 3]
    }

    /// Takes in one edge with all its uses.
    fn add_edge(&mut self, uses: &[HalfEdge]) {
        let first = uses[0].corner;
        let (from, to) = (self.vertex(first), self.vertex(next_corner(first)));
        self.edges += 1;
        self.component_unions += usize::from(self.vertices.union(from, to));
        // An edge from a vertex to itself belongs to a triangle without an inside.
        self.nonmanifold_edges += usize::from(uses.len() > 2 || from == to);
        let is_forward = |half_edge: &HalfEdge| self.vertex(half_edge.corner) == from;
        let forward = uses
            .iter()
            .filter(|&half_edge| is_forward(half_edge))
            .count();
        self.oriented &= forward <= 1 && uses.len() - forward <= 1;
        match uses {
            [_] => {
                self.boundary_edges += 1;
                self.on_boundary[from as usize] = true;
                self.on_boundary[to as usize] = true;
                self.boundary_unions += usize::from(self.boundary.union(from, to));
            }
            _ => {
                for pair in uses.windows(2) {
                    self.join_fans(pair[0].corner, pair[1].corner);
                }
            }
        }
    }

    /// Two triangles share an edge: their corners at either end belong to the same fan.
    fn join_fans(&mut self, first: u32, second: u32) {
        let (start, end) = if self.vertex(first) == self.vertex(second) {
            (second, next_corner(second))
        } else {
            (next_corner(second), second)
        };
        self.corners.union(first, start);
        self.corners.union(next_corner(first), end);
    }

    /// How many vertices have more than one fan.
    fn torn_vertices(&mut self) -> usize {
        let mut fans = vec![0_u32; self.mesh.positions.len()];
        for (&vertex, corner) in self.mesh.triangles.as_flattened().iter().zip(0..) {
            fans[vertex as usize] += u32::from(self.corners.find(corner) == corner);
        }
        fans.iter().filter(|&&fans| fans > 1).count()
    }

    /// Adds up. A forest of n elements after u joining unions has n − u sets.
    fn finish(mut self) -> Topology {
        let triangles = self.mesh.triangles.len();
        let mut used = vec![false; self.mesh.positions.len()];
        for &vertex in self.mesh.triangles.as_flattened() {
            used[vertex as usize] = true;
        }
        let vertices = used.iter().filter(|&&used| used).count();
        let boundary_vertices = self.on_boundary.iter().filter(|&&on| on).count();
        let nonmanifold_vertices = self.torn_vertices();
        Topology {
            vertices,
            edges: self.edges,
            triangles,
            components: vertices - self.component_unions,
            boundary_edges: self.boundary_edges,
            boundary_loops: boundary_vertices - self.boundary_unions,
            nonmanifold_edges: self.nonmanifold_edges,
            nonmanifold_vertices,
            manifold: self.nonmanifold_edges == 0 && nonmanifold_vertices == 0,
            oriented: self.oriented,
            // Oriented edges have at most two uses, so without boundary they have two.
            watertight: self.oriented && self.boundary_edges == 0 && triangles > 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::test_meshes::{
        cube, disjoint_union, disk, inverted, mesh, moebius_strip, octahedron, tetrahedron, torus,
    };
    use super::*;

    #[test]
    fn platonic_solids_are_spheres() {
        for (solid, edges) in [
            (cube(1.0, DVec3::ZERO), 18),
            (tetrahedron(), 6),
            (octahedron(), 12),
        ] {
            let topology = solid.topology();
            let expected = Topology {
                vertices: solid.positions.len(),
                edges,
                triangles: solid.triangles.len(),
                components: 1,
                boundary_edges: 0,
                boundary_loops: 0,
                nonmanifold_edges: 0,
                nonmanifold_vertices: 0,
                manifold: true,
                oriented: true,
                watertight: true,
            };
            assert_eq!(topology, expected);
            assert_eq!(topology.euler_characteristic(), 2);
            assert_eq!(topology.genus(), Some(0));
        }
    }

    #[test]
    fn torus_has_one_handle() {
        let torus = torus(2.0, 0.5, 12, 7);
        assert_eq!(torus.euler_characteristic(), 0);
        assert_eq!(torus.genus(), Some(1));
        assert_eq!(torus.components(), 1);
        assert!(torus.is_watertight() && torus.is_manifold());
    }

    #[test]
    fn handles_add_up_over_components() {
        let pair = disjoint_union(torus(2.0, 0.5, 5, 4), &torus(2.0, 0.5, 3, 9));
        let three = disjoint_union(pair, &octahedron());
        assert_eq!(three.components(), 3);
        assert_eq!(three.euler_characteristic(), 2);
        assert_eq!(three.genus(), Some(2));
        assert!(three.is_watertight());
    }

    #[test]
    fn open_disk_has_one_boundary_loop() {
        let topology = disk(7).topology();
        assert_eq!(topology.boundary_edges, 7);
        assert_eq!(topology.boundary_loops, 1);
        assert_eq!(topology.euler_characteristic(), 1);
        assert_eq!(topology.genus(), Some(0));
        assert!(topology.manifold && topology.oriented && !topology.watertight);
    }

    #[test]
    fn holes_cut_into_a_torus_are_counted_and_keep_its_genus() {
        let mut torus = torus(2.0, 0.5, 12, 12);
        torus.triangles.remove(100);
        torus.triangles.remove(3);
        let topology = torus.topology();
        assert_eq!(topology.boundary_edges, 6);
        assert_eq!(topology.boundary_loops, 2);
        assert_eq!(topology.genus(), Some(1));
        assert!(!topology.watertight);
    }

    #[test]
    fn an_edge_of_three_triangles_is_not_manifold() {
        let book = mesh(
            &[
                [0.0, 0.0, 0.0],
                [0.0, 0.0, 1.0],
                [1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [-1.0, 0.0, 0.0],
            ],
            &[[0, 1, 2], [0, 1, 3], [1, 0, 4]],
        );
        let topology = book.topology();
        assert!(!topology.manifold && !topology.oriented && !topology.watertight);
        assert_eq!(topology.genus(), None);
        assert_eq!(topology.components, 1);
        // The three pages hang together at both ends of the spine.
        assert_eq!(topology.nonmanifold_edges, 1);
        assert_eq!(topology.nonmanifold_vertices, 0);
    }

    #[test]
    fn two_tetrahedra_that_touch_in_a_vertex_are_watertight_but_not_manifold() {
        let mut pair = disjoint_union(tetrahedron(), &tetrahedron());
        for vertex in pair.triangles.as_flattened_mut() {
            *vertex = if *vertex == 4 { 0 } else { *vertex };
        }
        let topology = pair.topology();
        assert_eq!(topology.vertices, 7);
        assert_eq!(topology.components, 1);
        assert!(topology.watertight && topology.oriented && !topology.manifold);
        assert_eq!(topology.nonmanifold_edges, 0);
        assert_eq!(topology.nonmanifold_vertices, 1);
        assert_eq!(topology.genus(), None);
    }

    #[test]
    fn a_bow_tie_is_not_manifold() {
        let bow_tie = mesh(
            &[
                [0.0, 0.0, 0.0],
                [1.0, -1.0, 0.0],
                [1.0, 1.0, 0.0],
                [-1.0, 1.0, 0.0],
                [-1.0, -1.0, 0.0],
            ],
            &[[0, 1, 2], [0, 3, 4]],
        );
        assert!(!bow_tie.is_manifold());
        assert_eq!(bow_tie.components(), 1);
        assert_eq!(bow_tie.boundary_edges(), 6);
    }

    #[test]
    fn moebius_strip_is_manifold_but_has_no_sides() {
        let topology = moebius_strip().topology();
        assert_eq!(topology.euler_characteristic(), 0);
        assert_eq!(topology.boundary_edges, 5);
        assert_eq!(topology.boundary_loops, 1);
        assert!(topology.manifold && !topology.oriented && !topology.watertight);
        assert_eq!(topology.genus(), None);
    }

    #[test]
    fn one_triangle_turned_over_spoils_orientation_only() {
        let mut solid = octahedron();
        solid.triangles[3].swap(0, 1);
        let topology = solid.topology();
        assert!(topology.manifold && !topology.oriented && !topology.watertight);
        assert!(inverted(octahedron()).is_watertight());
    }

    #[test]
    fn unused_vertices_do_not_count() {
        let mut solid = octahedron();
        solid.positions.push(DVec3::ONE);
        assert_eq!(solid.topology(), octahedron().topology());
    }

    #[test]
    fn triangles_that_repeat_a_vertex_are_not_manifold() {
        let points = [[0.0; 3], [1.0, 0.0, 0.0]];
        assert!(!mesh(&points, &[[0, 0, 1]]).is_manifold());
        assert!(!mesh(&points, &[[1, 1, 1]]).is_manifold());
    }

    #[test]
    fn an_empty_mesh_is_not_watertight() {
        let topology = Mesh::default().topology();
        assert_eq!(topology.euler_characteristic(), 0);
        assert_eq!(topology.genus(), Some(0));
        assert_eq!(topology.components, 0);
        assert!(!topology.watertight);
    }
}
