//! Removal of zero-length edges, which marching cubes makes where the surface runs exactly
//! through a grid point: the roots on the grid edges that meet there coincide.
//!
//! Such an edge is collapsed if its link allows it, that is, if the result is the same surface
//! up to homeomorphism; the triangles beside it, which have no area, disappear.

use super::Mesh;
use super::disjoint_sets::DisjointSets;
use super::surgery::Surgery;

impl Mesh {
    /// Collapses edges between equal positions and drops the vertices that no triangle uses;
    /// returns how many edges were collapsed.
    ///
    /// Surface, components, genus, boundary loops and manifoldness remain what they were. An edge
    /// whose collapse would change them stays, such as one that joins two sheets or belongs to a
    /// component that shrinks to nothing. The order of the remaining vertices and triangles is
    /// kept, and each keeps its position and normal.
    ///
    /// Costs O(n) plus, for each edge of length zero, the triangles around its ends.
    pub fn collapse_degenerate_edges(&mut self) -> usize {
        let edges = self.degenerate_edges();
        let became = self.collapse_edges(edges);
        let own = became.iter().zip(0..);
        own.filter(|&(&became, own)| became != own).count()
    }

    /// Collapses those of these edges that can be without a change of the topology, and drops the
    /// vertices that no triangle uses; each remaining one keeps its position and normal. Returns
    /// for every vertex that there was the least of those that it has become one with, by the
    /// numbers before.
    pub(crate) fn collapse_edges(&mut self, mut pending: Vec<(u32, u32)>) -> Vec<u32> {
        let count = self.positions.len() as u32;
        // Vertices that have become one; the least stands for all.
        let mut merged = DisjointSets::new(count);
        if !pending.is_empty() {
            let triangles = std::mem::take(&mut self.triangles);
            let mut surgery = Surgery::new(triangles, self.positions.len());
            // A collapse may free an edge that could not be collapsed before.
            loop {
                let mut collapsed = false;
                pending.retain(|&(a, b)| {
                    let (a, b) = (merged.find(a), merged.find(b));
                    if a == b || !surgery.link_condition(a, b) {
                        return a != b;
                    }
                    merged.union(a, b);
                    surgery.collapse(a.min(b), a.max(b));
                    collapsed = true;
                    false
                });
                if !collapsed {
                    break;
                }
            }
            self.triangles = surgery.finish();
        }
        self.drop_unused_vertices();
        (0..count).map(|vertex| merged.find(vertex)).collect()
    }

    /// The edges between different vertices at equal positions, each once, ascending.
    pub(crate) fn degenerate_edges(&self) -> Vec<(u32, u32)> {
        let position = |vertex: u32| self.positions[vertex as usize];
        let triangles = self.triangles.iter();
        let mut edges: Vec<(u32, u32)> = triangles
            .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
            .filter(|&(a, b)| a != b && position(a) == position(b))
            .map(|(a, b)| (a.min(b), a.max(b)))
            .collect();
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    /// Drops the vertices that no triangle uses, with their normals; the order is kept.
    pub fn drop_unused_vertices(&mut self) {
        let mut numbers = vec![None; self.positions.len()];
        for &vertex in self.triangles.as_flattened() {
            numbers[vertex as usize] = Some(0);
        }
        for (number, count) in numbers.iter_mut().flatten().zip(0..) {
            *number = count;
        }
        retain_where(&mut self.positions, numbers.iter().map(Option::is_some));
        retain_where(&mut self.normals, numbers.iter().map(Option::is_some));
        for vertex in self.triangles.as_flattened_mut() {
            // Every vertex of a triangle was numbered above.
            *vertex = numbers[*vertex as usize].unwrap_or(*vertex);
        }
    }
}

/// Keeps the entries whose flag is true.
fn retain_where<T>(entries: &mut Vec<T>, flags: impl IntoIterator<Item = bool>) {
    let mut flags = flags.into_iter();
    entries.retain(|_| flags.next().unwrap_or(false));
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::super::test_meshes::{
        cube, disjoint_union, disk, mesh, moebius_strip, octahedron, tetrahedron, torus,
    };
    use super::*;

    /// What a collapse must keep.
    fn invariants(mesh: &Mesh) -> impl PartialEq + std::fmt::Debug + use<> {
        let topology = mesh.topology();
        (
            topology.components,
            topology.euler_characteristic(),
            topology.boundary_loops,
            topology.manifold,
            topology.oriented,
            topology.watertight,
        )
    }

    fn assert_keeps_the_surface(before: &Mesh, after: &Mesh) {
        assert_eq!(invariants(before), invariants(after));
        // Only triangles without area go; the rest is added up with other partial sums.
        assert!((before.area() - after.area()).abs() <= 1e-14 * before.area());
        assert!((before.volume() - after.volume()).abs() <= 1e-14 * before.area());
        assert_eq!(after.topology().vertices, after.positions.len());
    }

    #[test]
    fn a_mesh_without_zero_length_edges_stays_as_it_is() {
        for mesh in [cube(1.0, DVec3::ZERO), torus(2.0, 0.5, 7, 5), disk(5)] {
            let mut collapsed = mesh.clone();
            assert_eq!(collapsed.collapse_degenerate_edges(), 0);
            assert_eq!(collapsed, mesh);
        }
    }

    #[test]
    fn a_pinched_edge_collapses_with_its_two_triangles() {
        let mut pinched = torus(2.0, 0.5, 8, 6);
        pinched.normals = (0..48).map(|k| DVec3::X * f64::from(k)).collect();
        pinched.positions[20] = pinched.positions[19];
        let before = pinched.clone();
        assert_eq!(pinched.collapse_degenerate_edges(), 1);
        assert_eq!(pinched.positions.len(), 47);
        assert_eq!(pinched.triangles.len(), 94);
        assert_keeps_the_surface(&before, &pinched);
        // The lesser vertex remains; the others follow in their order, normals with them.
        assert_eq!(
            pinched.positions[19..21],
            [before.positions[19], before.positions[21]]
        );
        assert_eq!(
            pinched.normals[19..21],
            [before.normals[19], before.normals[21]]
        );
    }

    #[test]
    fn a_patch_of_equal_positions_becomes_one_vertex() {
        // A 3 × 3 block of vertices of the torus: 9 become 1, with 8 edges and 16 triangles.
        let mut pinched = torus(2.0, 0.5, 8, 9);
        for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
            pinched.positions[i * 9 + j] = pinched.positions[0];
        }
        let before = pinched.clone();
        assert_eq!(pinched.collapse_degenerate_edges(), 8);
        assert_eq!(pinched.triangles.len(), before.triangles.len() - 16);
        assert_keeps_the_surface(&before, &pinched);
    }

    #[test]
    fn a_handle_pinched_to_a_point_remains_a_handle() {
        // One circle across the torus shrinks to a point: a loop of three edges must remain.
        let mut pinched = torus(2.0, 0.5, 8, 7);
        for j in 0..7 {
            pinched.positions[j] = pinched.positions[0];
        }
        let before = pinched.clone();
        assert_eq!(pinched.collapse_degenerate_edges(), 4);
        assert_keeps_the_surface(&before, &pinched);
        assert_eq!(pinched.genus(), Some(1));
    }

    #[test]
    fn a_component_without_extent_shrinks_to_a_tetrahedron_and_no_further() {
        let mut points = octahedron();
        points.positions.fill(DVec3::ONE);
        let mut both = disjoint_union(torus(2.0, 0.5, 5, 5), &points);
        let before = both.clone();
        assert_eq!(both.collapse_degenerate_edges(), 2);
        assert_keeps_the_surface(&before, &both);
        let mut minimal = tetrahedron();
        minimal.positions.fill(DVec3::ONE);
        assert_eq!(minimal.collapse_degenerate_edges(), 0);
        assert_eq!(minimal.triangles.len(), 4);
    }

    #[test]
    fn an_edge_that_a_later_collapse_frees_is_collapsed_too() {
        // A vertex in the middle of a face makes the face's sides a loop without a triangle, so
        // that edge 02 must wait until edge 46 has taken the vertex away.
        let mut solid = octahedron();
        assert_eq!(solid.triangles[0], [0, 2, 4]);
        solid
            .triangles
            .splice(0..1, [[0, 2, 6], [2, 4, 6], [4, 0, 6]]);
        solid.positions.push(solid.positions[4]);
        solid.positions[2] = solid.positions[0];
        let before = solid.clone();
        assert_eq!(solid.collapse_degenerate_edges(), 2);
        assert_eq!(solid.triangles.len(), 6);
        assert_keeps_the_surface(&before, &solid);
    }

    #[test]
    fn boundary_edges_collapse_but_no_bridge_between_two_boundaries_does() {
        let mut rim = disk(6);
        rim.positions[2] = rim.positions[1];
        let before = rim.clone();
        assert_eq!(rim.collapse_degenerate_edges(), 1);
        assert_eq!(rim.triangles.len(), 5);
        assert_keeps_the_surface(&before, &rim);

        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0; 3], [0.0, 1.0, 0.0]];
        let bridge = mesh(&corners, &[[0, 1, 2], [0, 2, 3]]);
        let mut collapsed = bridge.clone();
        assert_eq!(collapsed.collapse_degenerate_edges(), 0);
        assert_eq!(collapsed, bridge);

        let mut lone = mesh(&corners[..3], &[[0, 1, 2]]);
        assert_eq!(lone.collapse_degenerate_edges(), 0);
        assert_eq!(lone.triangles.len(), 1);
    }

    #[test]
    fn surfaces_with_the_fewest_possible_vertices_stay() {
        let mut strip = moebius_strip();
        strip.positions.fill(DVec3::ZERO);
        let before = strip.clone();
        assert_eq!(strip.collapse_degenerate_edges(), 0);
        assert_eq!(strip, before);
    }

    #[test]
    fn edges_of_three_triangles_stay() {
        let mut book = mesh(
            &[
                [0.0; 3],
                [0.0; 3],
                [1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [-1.0, 0.0, 0.0],
            ],
            &[[0, 1, 2], [0, 1, 3], [1, 0, 4]],
        );
        assert_eq!(book.collapse_degenerate_edges(), 0);
        assert_eq!(book.triangles.len(), 3);
    }

    #[test]
    fn unused_vertices_are_dropped() {
        let mut solid = disjoint_union(disk(3), &octahedron());
        solid.triangles.drain(..3);
        solid.drop_unused_vertices();
        assert_eq!(solid, octahedron());
    }

    #[test]
    fn a_large_mesh_with_every_other_vertex_pinched_collapses_in_one_go() {
        let (around, across) = (400, 100);
        let mut pinched = torus(2.0, 0.5, around, across);
        for vertex in (1..pinched.positions.len()).step_by(2) {
            pinched.positions[vertex] = pinched.positions[vertex - 1];
        }
        let before = pinched.clone();
        let pairs = (around * across / 2) as usize;
        assert_eq!(pinched.collapse_degenerate_edges(), pairs);
        assert_eq!(pinched.positions.len(), pairs);
        assert_keeps_the_surface(&before, &pinched);
    }

    proptest! {
        #[test]
        fn whatever_coincides_the_surface_remains(
            shape in 0..4,
            snaps in prop::collection::vec((0..40usize, 0..40usize), 0..60),
            holes in prop::collection::vec(0..60usize, 0..4),
        ) {
            let mut mesh = match shape {
                0 => torus(2.0, 0.5, 8, 5),
                1 => disk(12),
                2 => disjoint_union(cube(1.0, DVec3::ZERO), &octahedron()),
                // No Möbius strip: the seam where its faces disagree may itself be collapsed.
                _ => disjoint_union(torus(1.0, 0.5, 3, 4), &disk(7)),
            };
            for hole in holes {
                let triangle = hole % mesh.triangles.len();
                mesh.triangles.remove(triangle);
            }
            for (from, to) in snaps {
                let count = mesh.positions.len();
                mesh.positions[to % count] = mesh.positions[from % count];
            }
            mesh.drop_unused_vertices();
            let mut collapsed = mesh.clone();
            let count = collapsed.collapse_degenerate_edges();
            prop_assert_eq!(invariants(&mesh), invariants(&collapsed));
            prop_assert_eq!(mesh.positions.len() - count, collapsed.positions.len());
            prop_assert!((mesh.area() - collapsed.area()).abs() <= 1e-13);
            prop_assert_eq!(collapsed.collapse_degenerate_edges(), 0);
        }
    }
}
