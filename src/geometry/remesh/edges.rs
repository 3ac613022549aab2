//! What remeshing does to edges: splits, collapses, flips.

use glam::DVec3;

use super::super::quality::radius_ratio;
use super::super::simplify::is_turned;
use super::{Kind, Work};

/// Edges longer than so many times the length are split.
const LONG: f64 = 4.0 / 3.0;

/// Edges shorter than so many times the length are collapsed.
const SHORT: f64 = 4.0 / 5.0;

/// Triangles with a smaller radius ratio are only made of worse ones.
const SLIVER: f64 = 0.2;

impl Work {
    /// Splits long edges in the middle, the longest first, until there are none.
    pub(super) fn split_long_edges(&mut self) {
        let limit = LONG * self.length;
        loop {
            let mut long = self.edges_by_length(|length| length > limit);
            if long.is_empty() {
                break;
            }
            long.reverse();
            for (_, (a, b)) in long {
                self.surgery.split(a, b);
                self.positions
                    .push(self.position(a).midpoint(self.position(b)));
                let normal = self.normals[a as usize] + self.normals[b as usize];
                self.normals.push(normal.normalize_or_zero());
            }
        }
    }

    /// The edges whose length passes the test, the shortest first.
    fn edges_by_length(&self, test: impl Fn(f64) -> bool) -> Vec<(f64, (u32, u32))> {
        let edges = self.surgery.edges().into_iter();
        let mut chosen: Vec<(f64, (u32, u32))> = edges
            .map(|(a, b)| (self.distance(a, b), (a, b)))
            .filter(|&(length, _)| test(length))
            .collect();
        chosen.sort_unstable_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        chosen
    }

    /// Collapses short edges, the shortest first, where nothing is spoilt.
    pub(super) fn collapse_short_edges(&mut self) {
        self.find_kinds();
        let limit = SHORT * self.length;
        for (_, (a, b)) in self.edges_by_length(|length| length < limit) {
            // Earlier collapses may have changed everything here.
            let is_there = self.surgery.beside(a, b).next().is_some();
            if is_there && self.distance(a, b) < limit {
                self.collapse(a, b);
            }
        }
    }

    fn collapse(&mut self, a: u32, b: u32) {
        let [of_a, of_b] = [a, b].map(|vertex| self.kinds[vertex as usize]);
        // What is held more stays.
        let (kept, gone) = if of_a >= of_b { (a, b) } else { (b, a) };
        let (more, less) = (of_a.max(of_b), of_a.min(of_b));
        let position = match (more, less) {
            (Kind::Free, _) => self.position(a).midpoint(self.position(b)),
            (_, Kind::Free) => self.position(kept),
            (_, Kind::Corner | Kind::Fixed) => return,
            _ if !self.is_feature(a, b) => return,
            (Kind::Crease, _) => self.position(a).midpoint(self.position(b)),
            _ => self.position(kept),
        };
        if self.may_move(kept, gone, position)
            && self.may_move(gone, kept, position)
            && self.surgery.link_condition(kept, gone)
        {
            self.surgery.collapse(kept, gone);
            self.positions[kept as usize] = position;
        }
    }

    /// Whether no facet turns or becomes a sliver, and no edge too long, when a vertex moves and
    /// what joins it with another one vanishes.
    fn may_move(&self, moved: u32, other: u32, position: DVec3) -> bool {
        let limit = LONG * self.length;
        let mut around = self.surgery.star(moved);
        around.all(|facet| {
            if self.surgery.has(facet, other) {
                return true;
            }
            let vertices = self.surgery.corners(facet);
            let before = self.corners(facet);
            let mut after = before;
            for (corner, _) in after.iter_mut().zip(vertices).filter(|(_, v)| *v == moved) {
                *corner = position;
            }
            let is_short = before
                .iter()
                .zip(vertices)
                .all(|(corner, vertex)| vertex == moved || corner.distance(position) <= limit);
            is_short && !is_turned(before, after) && !is_spoilt(&[before], &[after])
        })
    }

    /// Flips edges that then leave their four vertices nearer to six neighbours, on the boundary
    /// four (where three triangles are).
    pub(super) fn flip_edges(&mut self) {
        self.find_kinds();
        for (a, b) in self.surgery.edges() {
            self.flip(a, b);
        }
    }

    fn flip(&mut self, a: u32, b: u32) -> Option<()> {
        let (first, second) = {
            let mut beside = self.surgery.beside(a, b);
            (beside.next()?, beside.next()?)
        };
        let c = self.surgery.opposite(first, a, b)?;
        let d = self.surgery.opposite(second, a, b)?;
        // The first facet runs from a to b, else the roles change.
        let ends = self.surgery.corners(first);
        let runs = (0..3).any(|k| ends[k] == a && ends[(k + 1) % 3] == b);
        let (a, b) = if runs { (a, b) } else { (b, a) };
        let surplus = |vertex: u32, change: i64| {
            let around = self.surgery.star(vertex).count() as i64;
            let ideal = match self.kinds[vertex as usize] {
                Kind::Boundary | Kind::Fixed => 3,
                _ => 6,
            };
            (around + change - ideal).pow(2)
        };
        let total = |of_ends, of_tips| {
            surplus(a, of_ends) + surplus(b, of_ends) + surplus(c, of_tips) + surplus(d, of_tips)
        };
        if total(-1, 1) >= total(0, 0) || self.surgery.beside(c, d).next().is_some() {
            return None;
        }
        if self.is_feature(a, b) {
            return None;
        }
        let facets = [[c, a, d], [d, b, c]];
        let before = [first, second].map(|facet| self.corners(facet));
        let after = facets.map(|facet| facet.map(|vertex| self.position(vertex)));
        // Against both old facets: then the new ones form no fold either.
        let turned = before
            .iter()
            .any(|&old| after.iter().any(|&new| is_turned(old, new)));
        if turned || is_spoilt(&before, &after) {
            return None;
        }
        self.surgery.replace(first, facets[0]);
        self.surgery.replace(second, facets[1]);
        Some(())
    }
}

/// Whether there are slivers after that are worse than those before.
fn is_spoilt(before: &[[DVec3; 3]], after: &[[DVec3; 3]]) -> bool {
    let worst = |triangles: &[[DVec3; 3]]| {
        let ratios = triangles.iter().map(|&corners| radius_ratio(corners));
        ratios.fold(f64::INFINITY, f64::min)
    };
    let left = worst(after);
    left < SLIVER && left < worst(before)
}
