//! Fewer triangles for nearly the same surface: edges are collapsed in the order of their quadric
//! errors.
//!
//! M. Garland, P. S. Heckbert, "Surface Simplification Using Quadric Error Metrics", SIGGRAPH 97.
//! Planes count with the areas of their facets; planes upright on the boundary keep it in place.
//! A collapse that would change the topology, turn a facet or make a sliver is not done.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use glam::DVec3;
use thiserror::Error;

use super::Mesh;
use super::quadric::Quadric;
use super::quality::radius_ratio;
use super::surgery::Surgery;

/// How far to simplify: until one of the two would be passed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// Not to fewer triangles.
    pub triangles: usize,
    /// The greatest error of a collapse: the root mean square of the distances of the new vertex
    /// from the planes of the facets that it stands for, weighted by their areas.
    pub error: f64,
}

/// What became of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Simplified {
    /// The triangles that are left.
    pub mesh: Mesh,
    /// The greatest error of a collapse, as that of the [`Goal`].
    pub error: f64,
}

/// Why a mesh cannot be made another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum RefineError {
    /// Its topology could not be kept.
    #[error("the mesh is not an oriented manifold")]
    NotManifold,
    /// It cannot be measured.
    #[error("the mesh has positions that are not finite")]
    NotFinite,
    /// Too little length for too much area.
    #[error("there would be more than 1e8 triangles")]
    TooManyTriangles,
    /// Whoever was asked for the surface asked for an end.
    #[error("cancelled")]
    Cancelled,
}

impl Mesh {
    /// The mesh with fewer triangles. Components, genus, boundary loops and orientation remain;
    /// sharp edges and the boundary stay where they are within the error.
    ///
    /// There may be more triangles left than the goal says, where fewer would change the topology
    /// or turn facets over. Normals are the weighted means of those that have become one. Costs
    /// O(n log n).
    ///
    /// # Errors
    ///
    /// The mesh is not an oriented manifold, or has positions that are not finite.
    pub fn simplified(&self, goal: Goal) -> Result<Simplified, RefineError> {
        self.require_manifold()?;
        let mut work = Simplification::new(self, goal);
        // What was refused may be possible after other collapses.
        while work.pass() {}
        Ok(work.finish())
    }

    /// An error unless the mesh is an oriented manifold with finite positions.
    pub(super) fn require_manifold(&self) -> Result<(), RefineError> {
        if !self.positions.iter().all(|position| position.is_finite()) {
            return Err(RefineError::NotFinite);
        }
        let topology = self.topology();
        if !(topology.manifold && topology.oriented) {
            return Err(RefineError::NotManifold);
        }
        Ok(())
    }
}

/// A collapse that may be done.
struct Candidate {
    cost: f64,
    ends: (u32, u32),
    /// The ages of the ends when this was made.
    ages: (u32, u32),
    position: DVec3,
    error: f64,
}

impl Candidate {
    /// Edges break ties, so that the order is unique.
    fn key(&self) -> (u64, (u32, u32)) {
        // The order of numbers that are not negative is that of their bits.
        (self.cost.to_bits(), self.ends)
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.key().cmp(&other.key())
    }
}

/// The state between collapses. Positions are relative to the middle, where quadrics have most
/// digits.
struct Simplification {
    surgery: Surgery,
    middle: DVec3,
    positions: Vec<DVec3>,
    /// Sums of normals by area.
    normals: Vec<DVec3>,
    quadrics: Vec<Quadric>,
    on_boundary: Vec<bool>,
    /// How many collapses have moved each vertex.
    ages: Vec<u32>,
    triangles: usize,
    goal: Goal,
    error: f64,
}

impl Simplification {
    fn new(mesh: &Mesh, goal: Goal) -> Self {
        let middle = mesh.bounds().map_or(DVec3::ZERO, |bounds| bounds.center());
        let count = mesh.positions.len();
        let mut work = Simplification {
            surgery: Surgery::new(mesh.triangles.clone(), count),
            middle,
            positions: mesh.positions.iter().map(|&p| p - middle).collect(),
            normals: mesh.normals.clone(),
            quadrics: vec![Quadric::NONE; count],
            on_boundary: vec![false; count],
            ages: vec![0; count],
            triangles: mesh.triangles.len(),
            goal,
            error: 0.0,
        };
        let mut areas = vec![0.0; count];
        for &triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|vertex| work.positions[vertex as usize]);
            let normal = (b - a).cross(c - a);
            let area = 0.5 * normal.length();
            let plane = Quadric::of_plane(a, normal.normalize_or_zero(), area);
            for vertex in triangle.map(|vertex| vertex as usize) {
                work.quadrics[vertex] = work.quadrics[vertex].plus(&plane);
                areas[vertex] += area;
            }
        }
        for (normal, area) in work.normals.iter_mut().zip(areas) {
            *normal *= area;
        }
        work.hold_boundary();
        work
    }

    /// Adds planes through the edges of the boundary, upright on their facets.
    fn hold_boundary(&mut self) {
        /// So much more than area a boundary counts.
        const HOLD: f64 = 10.0;
        for (a, b) in self.surgery.edges() {
            let mut beside = self.surgery.star(a).filter(|&t| self.surgery.has(t, b));
            let (Some(facet), None) = (beside.next(), beside.next()) else {
                continue;
            };
            let ends = [a, b].map(|vertex| self.positions[vertex as usize]);
            let along = ends[1] - ends[0];
            let upright = along.cross(self.normal(facet)).normalize_or_zero();
            let plane = Quadric::of_plane(ends[0], upright, HOLD * along.length_squared());
            for vertex in [a, b].map(|vertex| vertex as usize) {
                self.quadrics[vertex] = self.quadrics[vertex].plus(&plane);
                self.on_boundary[vertex] = true;
            }
        }
    }

    /// The normal of a facet, twice as long as its area.
    fn normal(&self, facet: u32) -> DVec3 {
        let corners = self.surgery.corners(facet);
        let [a, b, c] = corners.map(|vertex| self.positions[vertex as usize]);
        (b - a).cross(c - a)
    }

    /// Goes through all edges once, and those that change in between; says whether there is hope
    /// for another pass.
    fn pass(&mut self) -> bool {
        let before = self.triangles;
        let edges = self.surgery.edges();
        let mut queue: BinaryHeap<Reverse<Candidate>> = edges
            .into_iter()
            .filter_map(|(a, b)| self.candidate(a, b).map(Reverse))
            .collect();
        while self.triangles > self.goal.triangles
            && let Some(Reverse(candidate)) = queue.pop()
        {
            let (a, b) = candidate.ends;
            if candidate.ages != (self.ages[a as usize], self.ages[b as usize])
                || !self.is_allowed(&candidate)
            {
                continue;
            }
            self.collapse(&candidate);
            for (other, _) in self.surgery.neighbours(a) {
                let ends = (a.min(other), a.max(other));
                queue.extend(self.candidate(ends.0, ends.1).map(Reverse));
            }
        }
        self.triangles > self.goal.triangles && self.triangles < before
    }

    /// What collapsing an edge would give; `None` if the error is too great.
    fn candidate(&self, a: u32, b: u32) -> Option<Candidate> {
        /// Of collapses that cost nothing, those of short edges are done first.
        const SHORT_FIRST: f64 = 1e-8;
        let (i, j) = (a as usize, b as usize);
        let quadric = self.quadrics[i].plus(&self.quadrics[j]);
        let [first, second] = [self.positions[i], self.positions[j]];
        let square = first.distance_squared(second);
        let middle = first.midpoint(second);
        let position = match (self.on_boundary[i], self.on_boundary[j]) {
            (true, false) => first,
            (false, true) => second,
            _ => {
                // A minimum far away is one of planes that hardly meet.
                let near = |point: &DVec3| point.distance_squared(middle) <= square;
                let least = quadric.minimum(middle).filter(near);
                let ends = [first, second, middle].into_iter();
                let best_end = ends.min_by(|p, q| quadric.at(*p).total_cmp(&quadric.at(*q)));
                least.or(best_end)?
            }
        };
        let error = quadric.error_at(position);
        (error <= self.goal.error).then(|| Candidate {
            cost: quadric.at(position) + SHORT_FIRST * quadric.weight * square,
            ends: (a, b),
            ages: (self.ages[i], self.ages[j]),
            position,
            error,
        })
    }

    /// Whether a collapse keeps the topology, turns no facet and makes no sliver.
    fn is_allowed(&self, candidate: &Candidate) -> bool {
        let (a, b) = candidate.ends;
        let turns = |moved: u32, other: u32| {
            let mut around = self.surgery.star(moved);
            around.any(|facet| {
                !self.surgery.has(facet, other) && self.spoils(facet, moved, candidate.position)
            })
        };
        !turns(a, b) && !turns(b, a) && self.surgery.link_condition(a, b)
    }

    /// Whether a facet turns by more than 60° or becomes a sliver when one of its corners moves.
    fn spoils(&self, facet: u32, moved: u32, position: DVec3) -> bool {
        const SLIVER: f64 = 0.05;
        let vertices = self.surgery.corners(facet);
        let before = vertices.map(|vertex| self.positions[vertex as usize]);
        let mut after = before;
        for (corner, _) in after.iter_mut().zip(vertices).filter(|(_, v)| *v == moved) {
            *corner = position;
        }
        is_turned(before, after) || {
            let ratio = radius_ratio(after);
            ratio < SLIVER && ratio < radius_ratio(before)
        }
    }

    /// Makes one vertex of two: the first remains.
    fn collapse(&mut self, candidate: &Candidate) {
        let (a, b) = candidate.ends;
        let (i, j) = (a as usize, b as usize);
        self.triangles -= self.surgery.collapse(a, b);
        self.positions[i] = candidate.position;
        self.quadrics[i] = self.quadrics[i].plus(&self.quadrics[j]);
        self.on_boundary[i] |= self.on_boundary[j];
        if let Some(&other) = self.normals.get(j) {
            self.normals[i] += other;
        }
        self.ages[i] += 1;
        self.ages[j] += 1;
        self.error = self.error.max(candidate.error);
    }

    fn finish(self) -> Simplified {
        let middle = self.middle;
        let mut mesh = Mesh {
            positions: self.positions.into_iter().map(|p| p + middle).collect(),
            normals: self
                .normals
                .into_iter()
                .map(DVec3::normalize_or_zero)
                .collect(),
            triangles: self.surgery.finish(),
        };
        mesh.drop_unused_vertices();
        Simplified {
            mesh,
            error: self.error,
        }
    }
}

/// Whether a triangle turns by more than 60° from before to after. One that had no area before
/// cannot turn.
pub(super) fn is_turned(before: [DVec3; 3], after: [DVec3; 3]) -> bool {
    let normal = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
    let (old, new) = (normal(before), normal(after));
    old.dot(new) < 0.5 * old.length() * new.length()
}

#[cfg(test)]
mod tests {
    use super::super::test_meshes::{
        cube, disjoint_union, disk, grid, mesh, moebius_strip, refined, torus,
    };
    use super::*;

    fn to_count(mesh: &Mesh, triangles: usize) -> Mesh {
        let error = f64::INFINITY;
        mesh.simplified(Goal { triangles, error }).unwrap().mesh
    }

    fn to_error(mesh: &Mesh, error: f64) -> Simplified {
        mesh.simplified(Goal {
            triangles: 0,
            error,
        })
        .unwrap()
    }

    fn assert_same_topology(before: &Mesh, after: &Mesh) {
        let invariants = |mesh: &Mesh| {
            let topology = mesh.topology();
            (
                topology.components,
                topology.genus(),
                topology.boundary_loops,
                topology.watertight,
                topology.manifold,
            )
        };
        assert_eq!(invariants(before), invariants(after));
        assert_eq!(after.topology().vertices, after.positions.len());
    }

    #[test]
    fn a_divided_cube_becomes_a_cube_again() {
        // Its faces are planes and its edges sharp, so that nothing needs to have an error.
        let fine = refined(refined(refined(cube(2.0, DVec3::ONE))));
        assert_eq!(fine.triangles.len(), 12 * 64);
        let Simplified { mesh, error } = to_error(&fine, 1e-7);
        assert_eq!(mesh.triangles.len(), 12);
        assert!(error <= 1e-7);
        assert_same_topology(&fine, &mesh);
        assert!((mesh.volume() - 8.0).abs() < 1e-6);
        for corner in cube(2.0, DVec3::ONE).positions {
            let distances = mesh.positions.iter().map(|p| p.distance(corner));
            assert!(distances.fold(f64::INFINITY, f64::min) < 1e-7);
        }
    }

    #[test]
    fn a_torus_keeps_its_handle_down_to_a_few_triangles() {
        let fine = torus(1.0, 0.4, 80, 40);
        for count in [3000, 600, 100, 0] {
            let coarse = to_count(&fine, count);
            assert_same_topology(&fine, &coarse);
            if count >= 100 {
                // A collapse removes two.
                assert!(coarse.triangles.len() <= count && coarse.triangles.len() + 2 > count);
                assert_eq!(coarse.self_intersecting_triangles(), 0);
            }
            // The least triangulation of the torus has 14 triangles.
            assert!(coarse.triangles.len() >= 14);
        }
        // The tube has 20 rows of facets as long as 0.06 and as wide as 0.08: a tenth of the
        // triangles leave sides of 0.25, whose sagitta is 0.25²/(8·0.4) = 0.02.
        let coarse = to_count(&fine, 640);
        for p in &coarse.positions {
            let off = (p.x.hypot(p.y) - 1.0).hypot(p.z) - 0.4;
            assert!(off.abs() < 0.02, "{off}");
        }
    }

    #[test]
    fn the_error_is_a_bound_for_the_distance_from_a_curved_surface() {
        let fine = torus(1.0, 0.4, 160, 80);
        for error in [1e-3, 4e-3] {
            let simplified = to_error(&fine, error);
            assert!(simplified.error <= error && simplified.error > 0.9 * error);
            assert!(simplified.mesh.triangles.len() < fine.triangles.len() / 3);
            // It is a mean over planes; the vertices themselves are nearer than a few times that.
            for p in &simplified.mesh.positions {
                let off = (p.x.hypot(p.y) - 1.0).hypot(p.z) - 0.4;
                assert!(off.abs() < 4.0 * error + 2e-3, "{off}");
            }
        }
    }

    #[test]
    fn boundaries_stay_where_they_are() {
        // A plane square with four sides: two triangles suffice.
        let square = grid(12, |x, y| DVec3::new(x, y, 0.0));
        let coarse = to_error(&square, 1e-7).mesh;
        assert_same_topology(&square, &coarse);
        assert_eq!(coarse.triangles.len(), 2);
        assert!((coarse.area() - 1.0).abs() < 1e-6);
        // A piece of a paraboloid keeps its four bent sides, too.
        let bent = grid(30, |x, y| DVec3::new(x, y, x * x + y * y));
        let coarse = to_count(&bent, 200);
        assert_same_topology(&bent, &coarse);
        let bounds = coarse.bounds().unwrap();
        let expected = bent.bounds().unwrap();
        assert!(bounds.min.distance(expected.min) + bounds.max.distance(expected.max) < 0.02);
    }

    #[test]
    fn components_stay_and_normals_go_along() {
        let mut pair = disjoint_union(
            refined(cube(1.0, DVec3::ZERO)),
            &refined(cube(1.0, DVec3::splat(3.0))),
        );
        pair.normals = vec![DVec3::Z; pair.positions.len()];
        let coarse = to_count(&pair, 0);
        assert_same_topology(&pair, &coarse);
        assert_eq!(coarse.normals, vec![DVec3::Z; coarse.positions.len()]);
    }

    #[test]
    fn what_is_no_surface_is_refused() {
        let goal = Goal {
            triangles: 1,
            error: 1.0,
        };
        assert_eq!(
            moebius_strip().simplified(goal),
            Err(RefineError::NotManifold)
        );
        let mut solid = disk(5);
        solid.positions[2].y = f64::NAN;
        assert_eq!(solid.simplified(goal), Err(RefineError::NotFinite));
        let empty = mesh(&[], &[]);
        assert_eq!(empty.simplified(goal).map(|done| done.mesh), Ok(empty));
    }
}
