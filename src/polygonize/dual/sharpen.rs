//! Sharp edges where they leave the cells that the surface is seen in.
//!
//! An edge may run through a cell whose corners are all on one side, and a corner may lie in a cell
//! whose roots do not touch all of its faces. Then the cells around know more than one alone: the
//! roots of a cell and of its neighbours in the mesh give a new guess, and a vertex may take a
//! place in its own cell or in one beside it that no other vertex has. So a sharp edge goes from
//! vertex to vertex without a gap.

use glam::DVec3;
use rustc_hash::FxHashSet;

use super::around::{Around, worst};
use super::block::Plan;
use super::facets::{Blocks, Facet};
use super::place::{Contact, Site, Vertex};
use super::quadric::Quadric;
use super::scattered::Scattered;
use crate::polygonize::columns::Columns;

/// How far beyond its cell a guess may be that is to be improved, in cells.
const SLACK: f64 = 0.2;

/// How far around a vertex roots are asked, in steps from facet to facet.
const RINGS: usize = 2;

/// So many roots whose normals have a cosine above this are enough.
const ENOUGH: usize = 3;
const ALIKE: f64 = 0.995;

/// The mesh as far as it is known.
pub(super) struct Known<'a> {
    /// The cells.
    pub(super) blocks: &'a Blocks,
    /// The cell of each vertex.
    pub(super) cells: &'a [[u32; 3]],
    /// The vertices around which normals differ, ascending, with the roots around them.
    pub(super) bent: &'a [(u32, Vec<Contact>)],
    /// The facets.
    pub(super) facets: &'a [Facet],
    /// Those at each vertex.
    pub(super) around: &'a Around,
}

/// Moves vertices onto sharp edges and corners; returns the number of evaluations.
pub(super) fn sharpen(
    field: &mut Scattered,
    plan: &Plan,
    known: &Known,
    vertices: &mut [Vertex],
) -> usize {
    let (mut sites, mut contacts, mut owners) = (Vec::new(), Vec::new(), Vec::new());
    for (vertex, own) in known.bent {
        // A vertex may have been left behind when its cell was turned.
        if known.around.of(known.facets, *vertex).next().is_none() {
            continue;
        }
        let first = contacts.len();
        contacts.extend_from_slice(own);
        known.add_neighbours(*vertex, vertices, &mut contacts);
        let cell = known.cells[*vertex as usize].map(|index| index as usize);
        let site = Site {
            low: plan.lattice.point(cell),
            high: plan.lattice.point(cell.map(|index| index + 1)),
            middle: vertices[*vertex as usize].position,
            roots: first..contacts.len(),
            outward: DVec3::ZERO,
        };
        if known.is_promising(plan, (*vertex, vertices), &site, &contacts) {
            sites.push(site);
            owners.push(*vertex);
        } else {
            contacts.truncate(first);
        }
    }
    let is_fit =
        |place: usize, point: DVec3| known.is_free(plan, owners[place], &sites[place], point);
    let mut columns = Columns::default();
    let mut placer = plan.placer(field, &mut columns);
    let found = placer.find_sharp(&sites, &contacts, &is_fit);
    let mut found: Vec<(usize, Vertex)> = (found.into_iter().enumerate())
        .filter_map(|(place, vertex)| Some((place, vertex?)))
        .collect();
    // Corners first, and what is smooth yet and near: of the vertices that want the same free
    // cell only one may have it.
    let order = |&(place, vertex): &(usize, Vertex)| {
        let old = vertices[owners[place] as usize];
        let distance = vertex.position.distance_squared(old.position);
        // Distances are not negative, so that their bits have their order.
        (std::cmp::Reverse(vertex.rank), old.rank, distance.to_bits())
    };
    found.sort_by_cached_key(order);
    let mut taken = FxHashSet::default();
    for (place, vertex) in found {
        let owner = owners[place];
        let old = vertices[owner as usize];
        let cell = plan.lattice.cell_of(vertex.position);
        if vertex.rank <= old.rank || taken.contains(&cell) {
            continue;
        }
        let before = worst(known.around, known.facets, vertices, owner);
        vertices[owner as usize] = vertex;
        let after = worst(known.around, known.facets, vertices, owner);
        if after < before.min(0.0) {
            vertices[owner as usize] = old;
        } else if !sites[place].holds(vertex.position) {
            taken.insert(cell);
        }
    }
    placer.evaluations
}

impl Known<'_> {
    /// Adds what is known of the surface around a vertex, up to the neighbours' neighbours: roots
    /// near those around which normals differ, and the others themselves; of many with nearly the
    /// same normal a few.
    fn add_neighbours(&self, vertex: u32, vertices: &[Vertex], contacts: &mut Vec<Contact>) {
        let first = contacts.len();
        let mut known = vec![vertex];
        let mut ring = vec![vertex];
        for _ in 0..RINGS {
            let corners = ring
                .iter()
                .flat_map(|&own| self.around.of(self.facets, own));
            let mut next: Vec<u32> = corners.flat_map(|facet| facet.corners).collect();
            next.sort_unstable();
            next.dedup();
            next.retain(|own| !known.contains(own));
            for &own in &next {
                self.add_contacts(own, vertices, (first, contacts));
            }
            known.extend_from_slice(&next);
            ring = next;
        }
    }

    /// Adds the roots around a vertex or itself, unless there are enough alike behind `first`.
    fn add_contacts(
        &self,
        vertex: u32,
        vertices: &[Vertex],
        (first, contacts): (usize, &mut Vec<Contact>),
    ) {
        let Vertex {
            position,
            normal,
            rank,
            ..
        } = vertices[vertex as usize];
        let itself = [Contact { position, normal }];
        let found = match self.bent.binary_search_by_key(&vertex, |(own, _)| *own) {
            Ok(place) => &self.bent[place].1[..],
            Err(_) if rank == 1 => &itself,
            Err(_) => &[],
        };
        for contact in found {
            let alike = |other: &&Contact| other.normal.dot(contact.normal) > ALIKE;
            if contacts[first..].iter().filter(alike).count() < ENOUGH {
                contacts.push(*contact);
            }
        }
    }

    /// Whether the planes at the roots of a site meet in an edge or a corner that its vertex may
    /// go to, and is not on: nothing is evaluated for this.
    fn is_promising(
        &self,
        plan: &Plan,
        (vertex, vertices): (u32, &[Vertex]),
        site: &Site,
        contacts: &[Contact],
    ) -> bool {
        let mut quadric = Quadric::default();
        for contact in &contacts[site.roots.clone()] {
            let distance = contact.normal.dot(contact.position - site.middle);
            quadric.add(contact.normal, distance);
        }
        let nearest = quadric.nearest(3);
        let guess = site.middle + nearest.offset;
        let slack = SLACK * (site.high - site.low);
        let is_near = guess.cmpge(site.low - slack).all() && guess.cmple(site.high + slack).all();
        nearest.rank > usize::from(vertices[vertex as usize].rank)
            && (is_near || self.is_free(plan, vertex, site, guess))
    }

    /// Whether a vertex may go to a point: in its own cell, or in one beside it that has none.
    fn is_free(&self, plan: &Plan, vertex: u32, site: &Site, point: DVec3) -> bool {
        let own = self.cells[vertex as usize];
        let beside =
            |cell: &[usize; 3]| (0..3).all(|axis| cell[axis].abs_diff(own[axis] as usize) <= 1);
        let cell = plan.lattice.cell_of(point).filter(beside);
        site.holds(point) || cell.is_some_and(|cell| !self.blocks.is_active(cell))
    }
}
