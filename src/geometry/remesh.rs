//! The same surface with triangles of one size that are nearly equilateral.
//!
//! M. Botsch, L. Kobbelt, "A Remeshing Approach to Multiresolution Modeling", SGP 2004, section 4:
//! long edges are split, short ones collapsed, others flipped towards six neighbours a vertex, and
//! vertices move along the surface to the middle of their neighbours. Whoever knows the surface puts
//! them back onto it. Creases (edges at which facets turn by more than 40°), their corners and the
//! boundary are kept.

mod edges;
mod vertices;

use glam::DVec3;

use super::Mesh;
use super::simplify::RefineError;
use super::surgery::Surgery;

/// How to remesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Remeshing {
    /// The length that edges should have.
    pub length: f64,
    /// How often everything is done; after ten times little changes.
    pub iterations: usize,
}

/// Puts points onto the surface, and gives the unit normals there. What cannot be put onto it stays.
/// Says whether the work should go on.
pub type Project<'a> = dyn FnMut(&mut [DVec3], &mut [DVec3]) -> bool + 'a;

/// Facets that turn by more than 40° meet in a crease: its cosine.
const CREASE: f64 = 0.766;

impl Mesh {
    /// The surface with triangles whose sides are near a length, and nearly equilateral.
    /// Components, genus, boundary loops and orientation remain; no facet is turned over.
    ///
    /// `project` puts vertices onto the surface, those on creases by the planes of the surface beside
    /// them. The boundary keeps its shape within the length of an edge and is not projected. Costs
    /// O(n log n) an iteration.
    ///
    /// # Errors
    ///
    /// The mesh is not an oriented manifold, has positions that are not finite, or would have more
    /// triangles than a mesh can number; or `project` has said that the work should end.
    pub fn remeshed(
        &self,
        remeshing: Remeshing,
        project: &mut Project<'_>,
    ) -> Result<Mesh, RefineError> {
        // Equilateral triangles have the area √3/4 of the square of a side.
        let triangles = self.area() / (0.43 * remeshing.length * remeshing.length);
        if triangles > MOST {
            return Err(RefineError::TooManyTriangles);
        }
        let mut work = Work::new(self, remeshing.length)?;
        for _ in 0..remeshing.iterations {
            work.split_long_edges();
            work.collapse_short_edges();
            work.flip_edges();
            work.relax(project)?;
        }
        work.settled(project)
    }

    /// The surface with the same vertices and as many triangles, which are more nearly equilateral:
    /// of what [`Mesh::remeshed`] does, only edges are flipped and vertices move.
    ///
    /// # Errors
    ///
    /// As there.
    pub fn relaxed(
        &self,
        iterations: usize,
        project: &mut Project<'_>,
    ) -> Result<Mesh, RefineError> {
        let mut work = Work::new(self, self.mean_edge_length())?;
        for _ in 0..iterations {
            work.flip_edges();
            work.relax(project)?;
        }
        work.settled(project)
    }
}

/// The most triangles: their corners have numbers, and there may be several times as many on the
/// way.
const MOST: f64 = 1e8;

/// How often vertices are put onto the surface in the end.
const SETTLING: usize = 4;

/// What holds a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    /// Nothing: it may go anywhere on the surface.
    Free,
    /// A crease, along which it may go.
    Crease,
    /// The boundary, on which it stays where it is.
    Boundary,
    /// Creases that end, meet or turn: it stays there.
    Corner,
    /// The boundary where it turns or a crease ends: it stays where it is.
    Fixed,
}

/// The mesh on the way.
struct Work {
    surgery: Surgery,
    positions: Vec<DVec3>,
    /// Unit normals of the surface, 0 where they are not known.
    normals: Vec<DVec3>,
    kinds: Vec<Kind>,
    length: f64,
}

impl Work {
    fn new(mesh: &Mesh, length: f64) -> Result<Self, RefineError> {
        mesh.require_manifold()?;
        Ok(Work {
            surgery: Surgery::new(mesh.triangles.clone(), mesh.positions.len()),
            positions: mesh.positions.clone(),
            normals: vec![DVec3::ZERO; mesh.positions.len()],
            kinds: Vec::new(),
            length,
        })
    }

    /// The mesh with its vertices on the surface: one that is in the way of others may be so no
    /// longer once they have moved.
    fn settled(mut self, project: &mut Project<'_>) -> Result<Mesh, RefineError> {
        for _ in 0..SETTLING {
            self.settle(project)?;
        }
        Ok(self.finish())
    }

    fn position(&self, vertex: u32) -> DVec3 {
        self.positions[vertex as usize]
    }

    fn distance(&self, a: u32, b: u32) -> f64 {
        self.position(a).distance(self.position(b))
    }

    fn corners(&self, facet: u32) -> [DVec3; 3] {
        let corners = self.surgery.corners(facet);
        corners.map(|vertex| self.position(vertex))
    }

    /// The normal of a facet, twice as long as its area.
    fn normal(&self, facet: u32) -> DVec3 {
        let [a, b, c] = self.corners(facet);
        (b - a).cross(c - a)
    }

    /// Whether an edge is part of the boundary.
    fn is_border(&self, a: u32, b: u32) -> bool {
        self.surgery.beside(a, b).count() != 2
    }

    /// Whether an edge is part of the boundary or of a crease.
    fn is_feature(&self, a: u32, b: u32) -> bool {
        let mut beside = self.surgery.beside(a, b);
        let (Some(first), Some(second)) = (beside.next(), beside.next()) else {
            return true;
        };
        let [first, second] = [first, second].map(|facet| self.normal(facet));
        first.dot(second) < CREASE * first.length() * second.length()
    }

    /// The neighbours along creases and boundary, ascending.
    fn feature_neighbours(&self, vertex: u32) -> Vec<u32> {
        let around = self.surgery.neighbours(vertex).into_iter();
        let others = around.map(|(other, _)| other);
        others
            .filter(|&other| self.is_feature(vertex, other))
            .collect()
    }

    fn kind(&self, vertex: u32) -> Kind {
        let along = self.feature_neighbours(vertex);
        let bends = |first: u32, second: u32| {
            let [to_first, to_second] =
                [first, second].map(|other| self.position(other) - self.position(vertex));
            to_first.dot(to_second) > -CREASE * to_first.length() * to_second.length()
        };
        let is_on_border = along.iter().any(|&other| self.is_border(vertex, other));
        match (&along[..], is_on_border) {
            ([], _) => Kind::Free,
            (&[first, second], false) if !bends(first, second) => Kind::Crease,
            (&[first, second], true) if !bends(first, second) => Kind::Boundary,
            (_, false) => Kind::Corner,
            (_, true) => Kind::Fixed,
        }
    }

    /// Finds what holds each vertex now.
    fn find_kinds(&mut self) {
        let count = self.positions.len() as u32;
        self.kinds = (0..count).map(|vertex| self.kind(vertex)).collect();
    }

    /// The mean of the normals of the facets around a vertex, by area.
    fn mean_normal(&self, vertex: u32) -> DVec3 {
        let facets = self.surgery.star(vertex);
        let sum: DVec3 = facets.map(|facet| self.normal(facet)).sum();
        sum.normalize_or_zero()
    }

    fn finish(mut self) -> Mesh {
        for vertex in 0..self.positions.len() as u32 {
            if self.normals[vertex as usize] == DVec3::ZERO {
                self.normals[vertex as usize] = self.mean_normal(vertex);
            }
        }
        let mut mesh = Mesh {
            positions: self.positions,
            normals: self.normals,
            triangles: self.surgery.finish(),
        };
        mesh.drop_unused_vertices();
        mesh
    }
}

#[cfg(test)]
mod tests {
    use super::super::Topology;
    use super::super::test_meshes::{cube, disjoint_union, grid, moebius_strip, torus};
    use super::*;

    const TEN: fn(f64) -> Remeshing = |length| Remeshing {
        length,
        iterations: 10,
    };

    fn invariants(topology: &Topology) -> impl PartialEq + std::fmt::Debug + use<> {
        (
            topology.components,
            topology.genus(),
            topology.boundary_loops,
            topology.watertight,
            topology.manifold,
        )
    }

    /// Onto the torus with radii 1 and 0.4.
    fn onto_torus(points: &mut [DVec3], normals: &mut [DVec3]) -> bool {
        for (point, normal) in points.iter_mut().zip(normals) {
            let center = DVec3::new(point.x, point.y, 0.0).normalize();
            *normal = (*point - center).normalize();
            *point = center + 0.4 * *normal;
        }
        true
    }

    /// Onto the nearest of the planes of a cube about the origin with sides of length 2.
    fn onto_cube(points: &mut [DVec3], normals: &mut [DVec3]) -> bool {
        for (point, normal) in points.iter_mut().zip(normals) {
            let axis = point.abs().max_position();
            *normal = DVec3::AXES[axis] * point[axis].signum();
            *point -= *normal * (point.dot(*normal) - 1.0);
        }
        true
    }

    #[test]
    fn a_torus_gets_even_triangles_on_the_same_surface() {
        let given = torus(1.0, 0.4, 60, 12);
        for length in [0.06, 0.12] {
            let made = given.remeshed(TEN(length), &mut onto_torus).unwrap();
            assert_eq!(invariants(&given.topology()), invariants(&made.topology()));
            assert_eq!(made.self_intersecting_triangles(), 0);
            let quality = made.quality().unwrap();
            assert!(quality.hundredth_ratio > 0.7, "{quality:?}");
            assert!(quality.median_ratio > 0.95, "{quality:?}");
            assert!(quality.longest_edge < 2.0 * length);
            // 4π²·0.4 by √3/4·length², within the spread of lengths.
            let ideal = 15.79 / (0.433 * length * length);
            let count = made.triangles.len() as f64;
            assert!((0.7..1.4).contains(&(count / ideal)), "{count} of {ideal}");
            let mut on = made.positions.clone();
            onto_torus(&mut on, &mut made.normals.clone());
            let distances = on.iter().zip(&made.positions).map(|(a, b)| a.distance(*b));
            assert!(distances.fold(0.0, f64::max) < 1e-12);
        }
    }

    #[test]
    fn a_cube_keeps_its_edges_and_corners() {
        let mut given = cube(2.0, DVec3::splat(-1.0));
        given.normals.clear();
        let made = given.remeshed(TEN(0.2), &mut onto_cube).unwrap();
        assert_eq!(invariants(&given.topology()), invariants(&made.topology()));
        assert!((made.volume() - 8.0).abs() < 1e-9);
        assert!((made.area() - 24.0).abs() < 1e-9);
        assert!(made.triangles.len() > 1000);
        assert!(made.quality().unwrap().hundredth_ratio > 0.5);
        // Nothing but flat facets: their normals are those of the planes.
        for [a, b, c] in made.corners() {
            let normal = (b - a).cross(c - a).normalize();
            assert!(normal.abs().max_element() > 1.0 - 1e-9);
        }
    }

    #[test]
    fn open_surfaces_keep_their_boundary() {
        let given = grid(6, |x, y| DVec3::new(x, y, 0.0));
        let mut onto_plane = |points: &mut [DVec3], normals: &mut [DVec3]| {
            points.iter_mut().for_each(|point| point.z = 0.0);
            normals.fill(DVec3::Z);
            true
        };
        let pair = disjoint_union(given, &grid(3, |x, y| DVec3::new(x + 2.0, y, 0.0)));
        for length in [0.04, 0.3] {
            let made = pair.remeshed(TEN(length), &mut onto_plane).unwrap();
            assert_eq!(invariants(&pair.topology()), invariants(&made.topology()));
            assert!((made.area() - 2.0).abs() < 1e-9, "{}", made.area());
            assert_eq!(made.self_intersecting_triangles(), 0);
        }
    }

    #[test]
    fn what_cannot_be_done_is_refused() {
        let strip = moebius_strip();
        let refused = strip.remeshed(TEN(0.1), &mut onto_torus);
        assert_eq!(refused, Err(RefineError::NotManifold));
        let solid = cube(2.0, DVec3::ZERO);
        let refused = solid.remeshed(TEN(1e-6), &mut onto_torus);
        assert_eq!(refused, Err(RefineError::TooManyTriangles));
        let ended = solid.remeshed(TEN(0.5), &mut |_, _| false);
        assert_eq!(ended, Err(RefineError::Cancelled));
    }
}
