//! What remeshing does to vertices: moves along the surface and back onto it.

use glam::DVec3;

use super::super::quadric::Quadric;
use super::super::simplify::{RefineError, is_turned};
use super::{Kind, Project, Work};

impl Work {
    /// Moves vertices along the surface to the middle of their neighbours, and onto the surface.
    pub(super) fn relax(&mut self, project: &mut Project<'_>) -> Result<(), RefineError> {
        self.find_kinds();
        let targets = (0..self.positions.len() as u32).map(|vertex| self.target(vertex));
        let targets = targets.collect();
        self.go_to(targets, project)
    }

    /// Moves vertices onto the surface, and nowhere else.
    pub(super) fn settle(&mut self, project: &mut Project<'_>) -> Result<(), RefineError> {
        self.find_kinds();
        self.go_to(self.positions.clone(), project)
    }

    /// Where a vertex should go: the middle of its neighbours, as far as that is along the surface or
    /// the crease.
    fn target(&self, vertex: u32) -> DVec3 {
        let here = self.position(vertex);
        match self.kinds[vertex as usize] {
            Kind::Free => {
                let around = self.surgery.neighbours(vertex);
                if around.is_empty() {
                    return here;
                }
                let sum: DVec3 = around.iter().map(|&(other, _)| self.position(other)).sum();
                let way = sum / around.len() as f64 - here;
                let known = self.normals[vertex as usize];
                let normal = if known == DVec3::ZERO {
                    self.mean_normal(vertex)
                } else {
                    known
                };
                here + way - normal * normal.dot(way)
            }
            Kind::Crease => match self.feature_neighbours(vertex)[..] {
                [first, second] => {
                    let [first, second] = [first, second].map(|other| self.position(other));
                    let along = (second - first).normalize_or_zero();
                    let way = first.midpoint(second) - here;
                    here + along * along.dot(way)
                }
                _ => here,
            },
            Kind::Boundary | Kind::Corner | Kind::Fixed => here,
        }
    }

    /// Puts the targets onto the surface, and the vertices there, but none whose move would turn a
    /// facet.
    fn go_to(
        &mut self,
        mut targets: Vec<DVec3>,
        project: &mut Project<'_>,
    ) -> Result<(), RefineError> {
        let free = self.all_of(Kind::Free);
        let mut points: Vec<DVec3> = free.iter().map(|&v| targets[v as usize]).collect();
        let mut normals: Vec<DVec3> = free.iter().map(|&v| self.normals[v as usize]).collect();
        if !project(&mut points, &mut normals) {
            return Err(RefineError::Cancelled);
        }
        for ((&vertex, point), normal) in free.iter().zip(points).zip(normals) {
            targets[vertex as usize] = point;
            self.normals[vertex as usize] = normal;
        }
        let mut creased = self.all_of(Kind::Crease);
        creased.extend(self.all_of(Kind::Corner));
        // The nearer the probes, the nearer the planes through them are to those at the vertex.
        for reach in [0.2, 0.02, 0.002] {
            self.project_onto_creases(&creased, &mut targets, reach, project);
        }
        self.move_to(&targets);
        Ok(())
    }

    fn all_of(&self, kind: Kind) -> Vec<u32> {
        let kinds = self.kinds.iter().zip(0..);
        let chosen = kinds.filter(|&(&other, vertex)| {
            other == kind && self.surgery.star(vertex).next().is_some()
        });
        chosen.map(|(_, vertex)| vertex).collect()
    }

    /// Puts targets on creases where the planes of the surface beside them meet: the planes at
    /// points on the way to the centres of the facets around, so far of the way.
    fn project_onto_creases(
        &self,
        vertices: &[u32],
        targets: &mut [DVec3],
        reach: f64,
        project: &mut Project<'_>,
    ) {
        let mut probes = Vec::new();
        for &vertex in vertices {
            let target = targets[vertex as usize];
            for facet in self.surgery.star(vertex) {
                let center = self.corners(facet).iter().sum::<DVec3>() / 3.0;
                probes.push(target + reach * (center - self.position(vertex)));
            }
        }
        let mut normals = vec![DVec3::ZERO; probes.len()];
        project(&mut probes, &mut normals);
        let mut planes = probes.into_iter().zip(normals);
        for &vertex in vertices {
            let target = targets[vertex as usize];
            let count = self.surgery.star(vertex).count();
            let around = planes.by_ref().take(count);
            // About the target, where the digits are.
            let quadric = around.fold(Quadric::NONE, |sum, (point, normal)| {
                sum.plus(&Quadric::of_plane(point - target, normal, 1.0))
            });
            let way = quadric.minimum(DVec3::ZERO).unwrap_or(DVec3::ZERO);
            // Farther away it is not this crease.
            if way.length() < 0.5 * self.length {
                targets[vertex as usize] = target + way;
            }
        }
    }

    /// Moves vertices to their targets; those that would turn a facet half of the way, or not at all.
    fn move_to(&mut self, targets: &[DVec3]) {
        let before = std::mem::replace(&mut self.positions, targets.to_vec());
        let mut stops = vec![0_u8; before.len()];
        loop {
            let is_turned = |&facet: &u32| {
                let old = self.surgery.corners(facet).map(|v| before[v as usize]);
                is_turned(old, self.corners(facet))
            };
            let turned: Vec<u32> = self.surgery.numbers().filter(is_turned).collect();
            let mut at_fault: Vec<usize> = turned
                .iter()
                .flat_map(|&facet| self.surgery.corners(facet))
                .map(|vertex| vertex as usize)
                .filter(|&vertex| stops[vertex] < 2)
                .collect();
            at_fault.sort_unstable();
            at_fault.dedup();
            // Where all corners are where they were, nothing is turned: this ends.
            if at_fault.is_empty() {
                break;
            }
            for vertex in at_fault {
                stops[vertex] += 1;
                self.positions[vertex] = match stops[vertex] {
                    1 => before[vertex].midpoint(targets[vertex]),
                    _ => before[vertex],
                };
            }
        }
    }
}
