//! A block of cells: the signs of F at its points, the crossed edges, and a vertex for each loop.
//!
//! A block looks at all edges of its cells, those in its faces too, so that all of its vertices
//! come from the field as it is pruned for the block. What neighbours compute twice on shared
//! faces has the same bits.

use glam::DVec3;

use super::lattice::{BLOCK, Lattice};
use super::loops::Loops;
use super::place::{Contact, Placer, Site, Vertex};
use crate::engine::Silent;
use crate::polygonize::columns::{Columns, Evaluate};
use crate::polygonize::cubes::EDGES;
use crate::polygonize::edge_roots::{self, Accuracy, Edge, Root};
use crate::polygonize::grid::Seen;

/// Points of a block along each axis.
const POINTS: usize = BLOCK + 1;

/// Roots on edges need be no closer than this part of a cell: vertices are found on their own.
const ROOT_TOLERANCE: f64 = 1e-4;

/// The points with F < iso: bit x of row z·9 + y.
#[derive(Clone, Debug)]
pub(super) struct Signs([u16; POINTS * POINTS]);

impl Signs {
    /// Which corners of a cell are inside, as bits.
    pub(super) fn case(&self, [x, y, z]: [usize; 3]) -> u8 {
        let pair = |y: usize, z: usize| (self.0[z * POINTS + y] >> x & 3) as u8;
        pair(y, z) | pair(y + 1, z) << 2 | pair(y, z + 1) << 4 | pair(y + 1, z + 1) << 6
    }

    /// Whether a point is inside.
    pub(super) fn is_inside(&self, [x, y, z]: [usize; 3]) -> bool {
        self.0[z * POINTS + y] >> x & 1 == 1
    }

    /// Bit x of row z·9 + y: the edge along `axis` from that point is crossed and in the block.
    fn crossed(&self, axis: usize, y: usize, z: usize) -> u16 {
        let row = self.0[z * POINTS + y];
        match axis {
            0 => (row ^ row >> 1) & ((1 << BLOCK) - 1),
            1 if y < BLOCK => row ^ self.0[z * POINTS + y + 1],
            2 if z < BLOCK => row ^ self.0[(z + 1) * POINTS + y],
            _ => 0,
        }
    }

    /// The crossed edges, as axis and lower end, in a fixed order; with `within`, those whose
    /// lower end is no upper corner of the block: each edge of the lattice is one block's own.
    pub(super) fn crossed_edges(
        &self,
        within: usize,
    ) -> impl Iterator<Item = (usize, [usize; 3])> + '_ {
        let rows = (0..3).flat_map(move |axis| {
            (0..within).flat_map(move |z| (0..within).map(move |y| (axis, y, z)))
        });
        rows.flat_map(move |(axis, y, z)| {
            let mut bits = self.crossed(axis, y, z) & ((1 << within) - 1);
            std::iter::from_fn(move || {
                if bits == 0 {
                    return None;
                }
                let x = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                Some((axis, [x, y, z]))
            })
        })
    }

    /// The cells with corners on both sides, in a fixed order.
    pub(super) fn active_cells(&self) -> impl Iterator<Item = [usize; 3]> + '_ {
        (0..BLOCK).flat_map(move |z| {
            (0..BLOCK).flat_map(move |y| {
                let rows = [(y, z), (y + 1, z), (y, z + 1), (y + 1, z + 1)];
                let rows = rows.map(|(y, z)| self.0[z * POINTS + y]);
                let some = rows.iter().fold(0, |all, row| all | row);
                let each = rows.iter().fold(!0, |all, row| all & row);
                let active = (some | some >> 1) & !(each & each >> 1);
                (0..BLOCK).filter_map(move |x| (active >> x & 1 == 1).then_some([x, y, z]))
            })
        })
    }
}

/// A block with a part of the surface.
#[derive(Clone, Debug)]
pub(super) struct Block {
    /// Its place among the blocks.
    pub(super) place: [usize; 3],
    /// The signs at its points.
    pub(super) signs: Signs,
    /// The number of the first vertex of each cell; of no meaning for cells without.
    pub(super) first: Box<[u16; BLOCK * BLOCK * BLOCK]>,
    /// The vertices, cell after cell and loop after loop.
    pub(super) vertices: Vec<Vertex>,
    /// The vertices, by their numbers, around which normals differ, with what was seen there.
    pub(super) bent: Vec<(u16, Vec<Contact>)>,
}

/// The number of a cell of a block.
pub(super) fn cell_number([x, y, z]: [usize; 3]) -> usize {
    (z * BLOCK + y) * BLOCK + x
}

/// What blocks are made with; kept from one to the next.
#[derive(Default)]
pub(super) struct Workshop {
    columns: Columns,
    points: [Vec<f64>; 3],
    values: Vec<f64>,
    /// The number of the root on the edge along each axis from each point.
    numbers: [Vec<u16>; 3],
    /// What was seen and done so far.
    pub(super) seen: Seen,
    /// Evaluations.
    pub(super) evaluations: usize,
    /// The roots, by their kinds.
    pub(super) roots: crate::polygonize::Statistics,
}

/// What all blocks have in common.
pub(super) struct Plan<'a> {
    /// Points and cells.
    pub(super) lattice: &'a Lattice,
    /// What is asked of vertices.
    pub(super) accuracy: Accuracy,
}

impl Workshop {
    /// The block at a place, if the surface passes through it; `field` is right at its points.
    pub(super) fn block(
        &mut self,
        plan: &Plan,
        place: [usize; 3],
        field: &mut impl Evaluate,
    ) -> Option<Block> {
        let signs = self.signs(plan, place, field);
        signs.active_cells().next()?;
        let roots = self.roots(plan, place, &signs, field);
        let (sites, contacts, first) = self.sites(plan, place, &signs, &roots);
        let mut placer = plan.placer(field, &mut self.columns);
        let (vertices, bent) = placer.place(&sites, &contacts);
        self.evaluations += placer.evaluations;
        // Those in the sides of the box are where they belong.
        let bent = (bent.into_iter())
            .filter(|&number| sites[number].outward == DVec3::ZERO)
            .map(|number| {
                (
                    number as u16,
                    contacts[sites[number].roots.clone()].to_vec(),
                )
            })
            .collect();
        Some(Block {
            place,
            bent,
            signs,
            first,
            vertices,
        })
    }

    /// Evaluates F at the block's points.
    fn signs(&mut self, plan: &Plan, place: [usize; 3], field: &mut impl Evaluate) -> Signs {
        let lattice = plan.lattice;
        let along = |axis: usize| {
            std::array::from_fn(|step| lattice.coordinate(axis, place[axis] * BLOCK + step))
        };
        let [xs, ys, zs]: [[f64; POINTS]; 3] = [along(0), along(1), along(2)];
        self.points.iter_mut().for_each(Vec::clear);
        for z in zs {
            for y in ys {
                self.points[0].extend(xs);
                self.points[1].extend([y; POINTS]);
                self.points[2].extend([z; POINTS]);
            }
        }
        self.values.resize(POINTS * POINTS * POINTS, 0.0);
        let points = self.points.each_ref().map(Vec::as_slice);
        field.values(&points, &mut self.values);
        self.evaluations += self.values.len();
        let mut signs = Signs([0; POINTS * POINTS]);
        for (row, values) in signs.0.iter_mut().zip(self.values.chunks_mut(POINTS)) {
            for (x, value) in values.iter_mut().enumerate() {
                *value -= plan.accuracy.iso;
                *row |= u16::from(*value < 0.0) << x;
            }
        }
        self.seen = self.seen.and(Seen::of_values(&self.values));
        if lattice.cap {
            clear_ghosts(lattice, place, &mut signs);
        }
        signs
    }

    /// The roots on all crossed edges of the block; `self.numbers` tells which is where.
    fn roots(
        &mut self,
        plan: &Plan,
        place: [usize; 3],
        signs: &Signs,
        field: &mut impl Evaluate,
    ) -> Vec<Root> {
        for numbers in &mut self.numbers {
            numbers.resize(POINTS * POINTS * POINTS, 0);
        }
        let mut edges = Vec::new();
        for (axis, start) in signs.crossed_edges(POINTS) {
            let at = |[x, y, z]: [usize; 3]| (z * POINTS + y) * POINTS + x;
            let mut end = start;
            end[axis] += 1;
            self.numbers[axis][at(start)] = edges.len() as u16;
            let (inside, outside) = match signs.is_inside(start) {
                true => (start, end),
                false => (end, start),
            };
            let point = |local: [usize; 3]| {
                plan.lattice
                    .point([0, 1, 2].map(|axis| place[axis] * BLOCK + local[axis]))
            };
            edges.push(Edge {
                inside: point(inside),
                axis,
                outside: point(outside)[axis],
                inside_value: self.values[at(inside)],
                outside_value: self.values[at(outside)],
            });
        }
        let accuracy = Accuracy {
            iso: plan.accuracy.iso,
            distance: ROOT_TOLERANCE * plan.lattice.side.min_element(),
        };
        let (roots, evaluations) = edge_roots::solve(field, accuracy, &edges, &Silent);
        self.evaluations += evaluations;
        let told = crate::polygonize::Statistics::of_roots(&roots);
        self.roots = self.roots.and(told);
        roots
    }

    /// The vertices to be placed: their sites, the roots around them, and each cell's first.
    fn sites(
        &self,
        plan: &Plan,
        place: [usize; 3],
        signs: &Signs,
        roots: &[Root],
    ) -> (Vec<Site>, Vec<Contact>, Box<[u16; BLOCK * BLOCK * BLOCK]>) {
        let (mut sites, mut contacts) = (Vec::new(), Vec::new());
        let mut first = Box::new([0; BLOCK * BLOCK * BLOCK]);
        for cell in signs.active_cells() {
            first[cell_number(cell)] = sites.len() as u16;
            let loops = Loops::of_case(signs.case(cell));
            let global = [0, 1, 2].map(|axis| place[axis] * BLOCK + cell[axis]);
            for number in 0..loops.count {
                let own = (0..12).filter(|&edge| loops.of_edge[edge] == number);
                let own = own.map(|edge| {
                    let (corner, axis) = EDGES[edge];
                    let [x, y, z] = [0, 1, 2].map(|along| cell[along] + (corner >> along & 1));
                    roots[usize::from(self.numbers[axis][(z * POINTS + y) * POINTS + x])]
                });
                sites.push(site(plan.lattice, global, own, &mut contacts));
            }
        }
        (sites, contacts, first)
    }
}

impl Plan<'_> {
    /// What places vertices with a field.
    pub(super) fn placer<'p, E: Evaluate>(
        &self,
        field: &'p mut E,
        columns: &'p mut Columns,
    ) -> Placer<'p, E> {
        Placer {
            field,
            iso: self.accuracy.iso,
            tolerance: self.accuracy.distance,
            columns,
            evaluations: 0,
        }
    }
}

/// Ghost points are outside where the surface is closed at the box.
fn clear_ghosts(lattice: &Lattice, place: [usize; 3], signs: &mut Signs) {
    let ghosts = |axis: usize| {
        let is_ghost = |step: &usize| {
            let point = place[axis] * BLOCK + step;
            point + 1 >= lattice.coordinates[axis].len() || lattice.is_ghost(axis, point)
        };
        (0..POINTS)
            .filter(is_ghost)
            .fold(0u16, |bits, step| bits | 1 << step)
    };
    let [x, y, z] = [ghosts(0), ghosts(1), ghosts(2)];
    for (number, row) in signs.0.iter_mut().enumerate() {
        let hidden = y >> (number % POINTS) & 1 == 1 || z >> (number / POINTS) & 1 == 1;
        *row &= if hidden { 0 } else { !x };
    }
}

/// The site of a loop through these roots of a cell, which are added to the list.
///
/// In a flat cell only roots within the side count, if there are any: those on edges that lead
/// out of it have no length, and merely say that the surface is closed there.
pub(super) fn site(
    lattice: &Lattice,
    cell: [usize; 3],
    roots: impl Iterator<Item = Root> + Clone,
    contacts: &mut Vec<Contact>,
) -> Site {
    let low = lattice.point(cell);
    let high = lattice.point(cell.map(|index| index + 1));
    let mut site = Site {
        low,
        high,
        middle: 0.5 * (low + high),
        roots: contacts.len()..contacts.len(),
        outward: lattice.outward(cell),
    };
    let is_flat = low.cmpeq(high).any();
    let known = |root: &Root| !(is_flat && root.is_given());
    contacts.extend(roots.clone().filter(known).map(|root| Contact {
        position: root.position,
        normal: match is_flat {
            true => site.within(root.normal).normalize_or_zero(),
            false => root.normal,
        },
    }));
    site.roots.end = contacts.len();
    let own = &contacts[site.roots.clone()];
    if !own.is_empty() {
        let sum: DVec3 = own.iter().map(|contact| contact.position).sum();
        site.middle = sum / own.len() as f64;
    }
    site
}
