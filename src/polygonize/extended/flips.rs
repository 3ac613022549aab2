//! Flips that make sharp edges edges of the mesh: where two fans meet along a side that a sharp edge
//! crosses, the edge between their centres replaces the side (section 4 of the paper). Where a patch
//! without a centre is between them, edges to a centre replace those that cut the sharp edge off,
//! until the next one is reached.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::geometry::Mesh;
use crate::polygonize::dual::are_smooth;
use crate::polygonize::grid::Grid;

/// Passes over the edges at most. Each flip leaves one edge less that cuts sharp edges off.
const PASSES: usize = 8;

/// Flips edges in place; vertices from `centres` on are centres of fans, the others roots.
pub(super) fn flip((mesh, grid): (&Mesh, &Grid), centres: u32, triangles: &mut [[u32; 3]]) {
    let flipper = Flipper {
        mesh,
        grid,
        centres,
    };
    let near: Vec<usize> = (0..triangles.len())
        .filter(|&number| flipper.is_near(triangles[number]))
        .collect();
    for _ in 0..PASSES {
        if !flipper.pass(&near, triangles) {
            return;
        }
    }
}

struct Flipper<'a> {
    mesh: &'a Mesh,
    grid: &'a Grid,
    centres: u32,
}

impl Flipper<'_> {
    /// Whether a triangle has a centre or an edge that cuts a sharp edge off. All edges at centres
    /// are in such triangles.
    fn is_near(&self, triangle: [u32; 3]) -> bool {
        triangle.iter().any(|&corner| corner >= self.centres)
            || sides(triangle).iter().any(|&side| self.cuts(side))
    }

    /// One pass over the edges; whether any was flipped.
    fn pass(&self, near: &[usize], triangles: &mut [[u32; 3]]) -> bool {
        let own_sides = |&number: &usize| sides(triangles[number]).map(|side| (side, number));
        let at_side: FxHashMap<[u32; 2], usize> = near.iter().flat_map(own_sides).collect();
        let (mut touched, mut added) = (FxHashSet::default(), FxHashSet::default());
        for &number in near {
            for [from, to] in sides(triangles[number]) {
                let Some(&other) = at_side.get(&[to, from]) else {
                    continue;
                };
                // Every edge is met twice.
                let is_open = !touched.contains(&number) && !touched.contains(&other);
                if from > to || !is_open || !self.cuts([from, to]) {
                    continue;
                }
                let across = |number: usize| {
                    let mut corners = triangles[number].into_iter();
                    corners.find(|corner| ![from, to].contains(corner))
                };
                let (Some(one), Some(two)) = (across(number), across(other)) else {
                    continue;
                };
                let is_new = !at_side.contains_key(&[one, two])
                    && !at_side.contains_key(&[two, one])
                    && !added.contains(&[one.min(two), one.max(two)]);
                let flipped = [[from, two, one], [to, one, two]];
                if one != two
                    && is_new
                    && one.max(two) >= self.centres
                    && flipped.iter().all(|corners| self.faces_outward(*corners))
                {
                    added.insert([one.min(two), one.max(two)]);
                    touched.extend([number, other]);
                    (triangles[number], triangles[other]) = (flipped[0], flipped[1]);
                }
            }
        }
        !touched.is_empty()
    }

    /// Whether an edge cuts a sharp edge off: it joins roots with different normals. Vertices that
    /// close the surface at the box are no roots.
    fn cuts(&self, [from, to]: [u32; 2]) -> bool {
        let ends = [from, to].map(|vertex| vertex as usize);
        let normals = ends.map(|vertex| self.mesh.normals[vertex]);
        from.max(to) < self.centres
            && !are_smooth(normals.into_iter())
            && !ends.iter().any(|&vertex| self.is_cap(vertex))
    }

    fn is_cap(&self, vertex: usize) -> bool {
        let position = self.mesh.positions[vertex];
        self.grid.is_on_side(position) && self.mesh.normals[vertex] == self.grid.outward(position)
    }

    /// Whether a triangle has an area and does not turn its back to the surface at its corners that
    /// are roots: at each of them if their normals agree, else in the mean. False in sides of the box.
    fn faces_outward(&self, triangle: [u32; 3]) -> bool {
        let [a, b, c] = triangle.map(|vertex| self.mesh.positions[vertex as usize]);
        let across = (b - a).cross(c - a);
        let roots = triangle.into_iter().filter(|&vertex| vertex < self.centres);
        let mut normals = roots.map(|vertex| self.mesh.normals[vertex as usize]);
        let in_side = (0..3).any(|axis| {
            let sides = &self.grid.coordinates[axis];
            let ends = [sides.first(), sides.last()];
            a[axis] == b[axis] && b[axis] == c[axis] && ends.contains(&Some(&a[axis]))
        });
        if in_side {
            return false;
        }
        if are_smooth(normals.clone()) {
            return normals.all(|normal| across.dot(normal) > 0.0);
        }
        across.dot(normals.sum()) > 0.0
    }
}

fn sides([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}
