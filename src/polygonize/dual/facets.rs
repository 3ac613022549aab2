//! From blocks to a mesh: around every crossed edge of the lattice four cells, and a facet between
//! their vertices.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::block::{Block, Plan, cell_number, site};
use super::lattice::{BLOCK, Lattice};
use super::loops::Loops;
use super::place::{Contact, Vertex};
use crate::engine::{Field, Silent};
use crate::polygonize::columns::Columns;
use crate::polygonize::cubes::EDGES;
use crate::polygonize::edge_roots::{self, Edge};

/// The blocks with a part of the surface, and where each is.
pub(super) struct Blocks {
    list: Vec<Block>,
    place: FxHashMap<[usize; 3], usize>,
    /// The number of each block's first vertex.
    start: Vec<u32>,
    /// Cells with turned faces, and their loops and first vertex.
    turned: FxHashMap<[usize; 3], Turned>,
}

/// A cell of which faces are turned.
#[derive(Clone, Debug)]
struct Turned {
    faces: u8,
    loops: Loops,
    first: u32,
}

/// A facet with its four corners, counter-clockwise seen from outside.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    /// Vertices.
    pub(super) corners: [u32; 4],
    /// The axis of the edge that it goes around, as a direction to the outside.
    pub(super) axis: usize,
    /// Whether the outside is toward the upper end of the edge.
    pub(super) upward: bool,
}

/// A part of the mesh whose shape can be judged: a facet, or a triangle.
pub(super) trait Patch: Sync {
    /// Its vertices, counter-clockwise seen from outside.
    fn corners(&self) -> &[u32];

    /// The shape of its worst triangle (see [`shape`]); negative if one is folded.
    fn fitness(&self, vertices: &[Vertex]) -> f64;
}

impl Patch for Facet {
    fn corners(&self) -> &[u32] {
        &self.corners
    }

    fn fitness(&self, vertices: &[Vertex]) -> f64 {
        Split::of(self, vertices).fitness
    }
}

impl Patch for [u32; 3] {
    fn corners(&self) -> &[u32] {
        self
    }

    /// It is folded if it faces away from the normal of a smooth corner.
    fn fitness(&self, vertices: &[Vertex]) -> f64 {
        let corners = self.map(|corner| vertices[corner as usize]);
        let points = corners.map(|corner| corner.position);
        let normal = (points[1] - points[0]).cross(points[2] - points[0]);
        let mut smooth = corners.iter().filter(|corner| corner.rank == 1);
        match smooth.any(|corner| corner.normal.dot(normal) < 0.0) {
            true => shape(points) - 1.0,
            false => shape(points),
        }
    }
}

/// A cell of the lattice by its block and its place in it.
fn split(cell: [usize; 3]) -> ([usize; 3], [usize; 3]) {
    (
        cell.map(|index| index / BLOCK),
        cell.map(|index| index % BLOCK),
    )
}

impl Blocks {
    /// Blocks in their order.
    pub(super) fn new(list: Vec<Block>) -> Blocks {
        let place = list
            .iter()
            .enumerate()
            .map(|(number, block)| (block.place, number));
        let mut next = 0;
        let start = |block: &Block| {
            next += block.vertices.len() as u32;
            next - block.vertices.len() as u32
        };
        Blocks {
            place: place.collect(),
            start: list.iter().map(start).collect(),
            list,
            turned: HashMap::default(),
        }
    }

    /// All vertices, block after block.
    pub(super) fn vertices(&self) -> Vec<Vertex> {
        self.list
            .iter()
            .flat_map(|block| block.vertices.iter().copied())
            .collect()
    }

    /// The cell that each vertex was made for.
    pub(super) fn cells(&self) -> Vec<[u32; 3]> {
        let mut cells = Vec::new();
        for block in &self.list {
            for local in block.signs.active_cells() {
                let cell = [0, 1, 2].map(|axis| (block.place[axis] * BLOCK + local[axis]) as u32);
                let count = Loops::of_case(block.signs.case(local)).count;
                cells.extend(std::iter::repeat_n(cell, count.into()));
            }
        }
        cells
    }

    /// The vertices around which normals differ, ascending, with the roots around them.
    pub(super) fn bent(&mut self) -> Vec<(u32, Vec<Contact>)> {
        let blocks = self.list.iter_mut().zip(&self.start);
        let bent = blocks.flat_map(|(block, start)| {
            let bent = std::mem::take(&mut block.bent).into_iter();
            bent.map(move |(number, contacts)| (start + u32::from(number), contacts))
        });
        bent.collect()
    }

    /// Whether a cell has corners on both sides.
    pub(super) fn is_active(&self, cell: [usize; 3]) -> bool {
        let (block, local) = split(cell);
        self.place
            .get(&block)
            .is_some_and(|&number| !matches!(self.list[number].signs.case(local), 0 | u8::MAX))
    }

    /// The loops of a cell, and the number of the vertex of the first one.
    fn loops(&self, cell: [usize; 3]) -> Option<(Loops, u32)> {
        if let Some(turned) = self.turned.get(&cell) {
            return Some((turned.loops, turned.first));
        }
        let (block, local) = split(cell);
        let number = *self.place.get(&block)?;
        Some(self.own_loops(number, local))
    }

    /// The same for a cell of a block of which no face is turned.
    fn own_loops(&self, number: usize, local: [usize; 3]) -> (Loops, u32) {
        let block = &self.list[number];
        let loops = Loops::of_case(block.signs.case(local));
        let first = self.start[number] + u32::from(block.first[cell_number(local)]);
        (*loops, first)
    }

    /// Turns the faces whose segments belong to one loop on both sides; the vertices of their
    /// cells are placed anew and added to the list. Returns the number of evaluations.
    pub(super) fn turn_doubled_faces(
        &mut self,
        plan: &Plan,
        mut field: &dyn Field,
        vertices: &mut Vec<Vertex>,
    ) -> usize {
        self.find_doubled_faces();
        let mut cells: Vec<[usize; 3]> = self.turned.keys().copied().collect();
        cells.sort_unstable_by_key(|&[x, y, z]| [z, y, x]);
        let mut columns = Columns::default();
        let mut evaluations = 0;
        for cell in cells {
            let (block, local) = split(cell);
            let (Some(&number), Some(turned)) =
                (self.place.get(&block), self.turned.get_mut(&cell))
            else {
                continue;
            };
            turned.first = vertices.len() as u32;
            let case = self.list[number].signs.case(local);
            let edges = edges_of_cell(plan.lattice, &mut field, (cell, case), plan.accuracy.iso);
            let (roots, more) = edge_roots::solve(&mut field, plan.accuracy, &edges.1, &Silent);
            evaluations += more + 8;
            let (mut sites, mut contacts) = (Vec::new(), Vec::new());
            for own in 0..turned.loops.count {
                let of_loop = |&(edge, _): &(&usize, _)| turned.loops.of_edge[*edge] == own;
                let own = edges
                    .0
                    .iter()
                    .zip(&roots)
                    .filter(of_loop)
                    .map(|(_, root)| *root);
                sites.push(site(plan.lattice, cell, own, &mut contacts));
            }
            let mut placer = plan.placer(&mut field, &mut columns);
            vertices.extend(placer.place(&sites, &contacts).0);
            evaluations += placer.evaluations;
        }
        evaluations
    }

    /// Finds out which faces are to be turned. To turn one may free others, never bind them.
    fn find_doubled_faces(&mut self) {
        for number in 0..self.list.len() {
            let base = self.list[number].place.map(|place| place * BLOCK);
            let cells: Vec<[usize; 3]> = self.list[number].signs.active_cells().collect();
            for local in cells {
                let cell = [0, 1, 2].map(|axis| base[axis] + local[axis]);
                for axis in 0..3 {
                    self.turn_face_above(cell, axis);
                }
            }
        }
    }

    /// Turns the face between a cell and the next one along an axis, if it is doubled in both.
    fn turn_face_above(&mut self, cell: [usize; 3], axis: usize) {
        // Faces are numbered lower, upper along x, y and z.
        let (upper, lower) = (2 * axis + 1, 2 * axis);
        let mut next = cell;
        next[axis] += 1;
        let is_doubled = |cell, face: usize| {
            self.loops(cell)
                .is_some_and(|(loops, _)| loops.doubled >> face & 1 == 1)
        };
        if !is_doubled(cell, upper) || !is_doubled(next, lower) {
            return;
        }
        for (cell, face) in [(cell, upper), (next, lower)] {
            let (block, local) = split(cell);
            let Some(&number) = self.place.get(&block) else {
                continue;
            };
            let case = self.list[number].signs.case(local);
            let before = self.turned.get(&cell).map_or(0, |turned| turned.faces);
            let faces = before | 1 << face;
            let turned = Turned {
                faces,
                loops: Loops::trace(case, faces),
                first: 0,
            };
            self.turned.insert(cell, turned);
        }
    }

    /// The facets around all crossed edges, in a fixed order. Edges at the end of the lattice,
    /// where surfaces are cut by the box, have none.
    pub(super) fn facets(&self, lattice: &Lattice) -> Vec<Facet> {
        let cells = [0, 1, 2].map(|axis| lattice.cells(axis));
        let numbers = 0..self.list.len();
        let of_block = |number: usize| {
            let block = &self.list[number];
            let base = block.place.map(|place| place * BLOCK);
            let edges = block.signs.crossed_edges(BLOCK);
            let facets = edges.filter_map(|(axis, local)| {
                let start = [0, 1, 2].map(|along| base[along] + local[along]);
                // Blocks may reach beyond the lattice.
                if (0..3).any(|along| start[along] >= cells[along]) {
                    return None;
                }
                let inside = block.signs.is_inside(local);
                self.facet(axis, start, inside)
            });
            facets.collect::<Vec<_>>()
        };
        let lists: Vec<Vec<Facet>> = numbers.into_par_iter().map(of_block).collect();
        lists.concat()
    }

    /// The facet around the edge along `axis` from a point.
    fn facet(&self, axis: usize, start: [usize; 3], inside: bool) -> Option<Facet> {
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut corners = [0; 4];
        // Counter-clockwise seen from the upper end.
        for (corner, (down_b, down_c)) in corners.iter_mut().zip([(1, 1), (0, 1), (0, 0), (1, 0)]) {
            let mut cell = start;
            cell[b] = cell[b].checked_sub(down_b)?;
            cell[c] = cell[c].checked_sub(down_c)?;
            let edge = edge_number(axis, [(b, down_b), (c, down_c)]);
            let (loops, first) = self.loops(cell)?;
            *corner = first + u32::from(loops.of_edge[edge]);
        }
        if !inside {
            corners.reverse();
        }
        Some(Facet {
            corners,
            axis,
            upward: inside,
        })
    }
}

/// The number of the edge along an axis of a cell whose other coordinates are these.
fn edge_number(axis: usize, offsets: [(usize, usize); 2]) -> usize {
    let lower: usize = offsets.iter().map(|(along, upper)| upper << along).sum();
    EDGES
        .iter()
        .position(|&edge| edge == (lower, axis))
        .unwrap_or(0)
}

/// The crossed edges of a cell: their numbers and where they are.
fn edges_of_cell(
    lattice: &Lattice,
    field: &mut &dyn Field,
    (cell, case): ([usize; 3], u8),
    iso: f64,
) -> (Vec<usize>, Vec<Edge>) {
    let corner =
        |number: usize| lattice.point([0, 1, 2].map(|axis| cell[axis] + (number >> axis & 1)));
    let values: [f64; 8] = std::array::from_fn(|number| field.value(corner(number)) - iso);
    let (mut numbers, mut edges) = (Vec::new(), Vec::new());
    for (number, (lower, axis)) in EDGES.into_iter().enumerate() {
        let upper = lower | 1 << axis;
        let (inside, outside) = match (case >> lower & 1, case >> upper & 1) {
            (1, 0) => (lower, upper),
            (0, 1) => (upper, lower),
            _ => continue,
        };
        numbers.push(number);
        edges.push(Edge {
            inside: corner(inside),
            axis,
            outside: corner(outside)[axis],
            inside_value: values[inside],
            outside_value: values[outside],
        });
    }
    (numbers, edges)
}

/// Facets as triangles.
pub(super) fn triangulate(facets: &[Facet], vertices: &[Vertex]) -> Vec<[u32; 3]> {
    let pairs = facets.par_iter().with_min_len(256).map(|facet| {
        let [a, b, c, d] = facet.corners;
        match Split::of(facet, vertices).is_first {
            true => [[a, b, c], [a, c, d]],
            false => [[a, b, d], [b, c, d]],
        }
    });
    pairs.flatten_iter().collect()
}

/// How a facet is split into two triangles: along the diagonal that folds nothing, keeps sharp
/// edges, or gives the better triangles, in this order.
pub(super) struct Split {
    /// Whether from the first to the third corner.
    pub(super) is_first: bool,
    /// The shape of the worse triangle (see [`shape`]); negative if one is folded.
    pub(super) fitness: f64,
}

impl Split {
    pub(super) fn of(facet: &Facet, vertices: &[Vertex]) -> Split {
        let corners = facet.corners.map(|corner| &vertices[corner as usize]);
        let [a, b, c, d] = corners.map(|corner| corner.position);
        // Both splits share the sides, of which each is measured once.
        let sides = [a.distance(b), b.distance(c), c.distance(d), d.distance(a)];
        let [ac, bd] = [a.distance(c), b.distance(d)];
        let fitness = |places: [usize; 3], lengths: [f64; 3]| {
            fitness(facet, places.map(|place| corners[place]), lengths)
        };
        let [ab, bc, cd, da] = sides;
        let first = fitness([0, 1, 2], [ab, bc, ac]).min(fitness([0, 2, 3], [ac, cd, da]));
        let second = fitness([0, 1, 3], [ab, bd, da]).min(fitness([1, 2, 3], [bc, cd, bd]));
        // Where a sharp edge goes from corner to corner across the facet.
        let sharp = corners.map(|corner| corner.rank > 1);
        let is_first = if (first > 0.0) != (second > 0.0) {
            first > 0.0
        } else if matches!(
            sharp,
            [true, false, true, false] | [false, true, false, true]
        ) {
            sharp[0]
        } else {
            first >= second
        };
        Split {
            is_first,
            fitness: if is_first { first } else { second },
        }
    }
}

/// The shape of a triangle with sides of these lengths; negative if it is folded: seen along its
/// facet's edge, which the facet surrounds, it turns backward, or it faces away from the normal of a
/// smooth corner.
fn fitness(facet: &Facet, corners: [&Vertex; 3], lengths: [f64; 3]) -> f64 {
    let [a, b, c] = corners.map(|corner| corner.position);
    let normal = (b - a).cross(c - a);
    let along = if facet.upward {
        normal[facet.axis]
    } else {
        -normal[facet.axis]
    };
    let smooth = corners.iter().filter(|corner| corner.rank == 1);
    let is_folded = along <= 0.0 || smooth.clone().any(|corner| corner.normal.dot(normal) < 0.0);
    let shape = ratio(normal, lengths);
    if is_folded { shape - 1.0 } else { shape }
}

/// How near a triangle is to an equilateral one, which has 1: twice the radius of the incircle
/// over that of the circumcircle; 0 for one without area.
pub(super) fn shape([a, b, c]: [DVec3; 3]) -> f64 {
    let lengths = [b.distance(c), c.distance(a), a.distance(b)];
    ratio((b - a).cross(c - a), lengths)
}

/// The same, given the cross product of two sides and the lengths of all.
fn ratio(normal: DVec3, [a, b, c]: [f64; 3]) -> f64 {
    // 2r = 2·(2A)/perimeter, and 1/R = 2·(2A)/product.
    let ratio = 4.0 * normal.length_squared() / ((a + b + c) * (a * b * c));
    if ratio.is_finite() { ratio } else { 0.0 }
}
