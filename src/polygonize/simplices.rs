//! Marching tetrahedra on any set of tetrahedra that fit together: the part that those methods
//! have in common which differ in where their tetrahedra come from.
//!
//! A tetrahedron whose corners are not all on one side of the level is cut by one triangle or by
//! one quadrilateral, with its corners on the crossed edges. Where tetrahedra share whole faces
//! these pieces are a surface, whatever the signs are: around a crossed edge its tetrahedra form
//! a ring, and so do their pieces around the vertex on it; there are no ambiguous cases (Doi and
//! Koide, "An efficient method of triangulating equi-valued surfaces by using tetrahedral cells",
//! IEICE Transactions E74, 1991; Velho, Gomes, de Figueiredo, "Implicit Objects in Computer
//! Graphics", 2002).
//!
//! Points are named by their place in a lattice that has a point at every corner of the finest
//! cells, between any two of them and so on in the middles of faces and cells; places are even at
//! corners. A vertex is named by the ends of its edge.
//!
//! A cap is made of the faces of tetrahedra that lie in the sides of the box: the parts of them
//! that are inside. Its vertices are the roots on edges in the side and the points of the lattice
//! that are inside, so that the cap lies in the sides exactly, and the whole is the boundary of
//! the tetrahedra's inside parts.

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::edge_roots::{self, Root, Segment};
use super::grid::coordinate;
use super::{Job, PolygonizeError, Statistics};
use crate::geometry::{Bounds, Mesh};

/// A place in a [`Lattice`].
pub(super) type Place = [u32; 3];

/// How many roots are solved in one piece of parallel work.
const CHUNK: usize = 4096;

/// In the last place of a facet that is a triangle.
const NONE: u32 = u32::MAX;

/// The corners of a tetrahedron, one of them first, in orders that keep its orientation.
pub(super) const ONE_FIRST: [[usize; 4]; 4] =
    [[0, 1, 2, 3], [1, 0, 3, 2], [2, 0, 1, 3], [3, 0, 2, 1]];

/// The same with each pair of them first.
pub(super) const TWO_FIRST: [[usize; 4]; 6] = [
    [0, 1, 2, 3],
    [0, 2, 3, 1],
    [0, 3, 1, 2],
    [1, 2, 0, 3],
    [1, 3, 2, 0],
    [2, 3, 0, 1],
];

/// The faces of a tetrahedron, counter-clockwise seen from outside.
const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// Points of a box: the corners of equal cells, at even places, and those halfway between.
pub(super) struct Lattice {
    /// The coordinates by place along each axis; of a large lattice none, they are computed.
    coordinates: [Vec<f64>; 3],
    sides: [(f64, f64); 3],
    /// The last place along each axis.
    pub(super) top: Place,
}

impl Lattice {
    /// The lattice of so many cells along each axis; `None` if its places cannot be numbered.
    pub(super) fn new(bounds: &Bounds, cells: [usize; 3]) -> Option<Self> {
        let mut lattice = Lattice::large(bounds, cells)?;
        for axis in 0..bounds.dimension.min(3) {
            let column = (0..=lattice.top[axis]).map(|place| lattice.coordinate(axis, place));
            lattice.coordinates[axis] = column.collect();
        }
        Some(lattice)
    }

    /// The same for a lattice of which few points will be used: its coordinates are computed each
    /// time. Axes that the box does not have run from 0 to 1.
    pub(super) fn large(bounds: &Bounds, cells: [usize; 3]) -> Option<Self> {
        let mut top = [0; 3];
        let mut points = 1u64;
        for (top, cells) in top.iter_mut().zip(cells) {
            *top = u32::try_from(cells.checked_mul(2)?).ok()?;
            points = points.checked_mul(u64::from(*top) + 1)?;
        }
        let mut sides = [(0.0, 1.0); 3];
        for (own, side) in sides.iter_mut().zip(bounds.sides()) {
            *own = side;
        }
        Some(Lattice {
            coordinates: [const { Vec::new() }; 3],
            sides,
            top,
        })
    }

    /// The coordinate of a place along an axis.
    pub(super) fn coordinate(&self, axis: usize, place: u32) -> f64 {
        match self.coordinates[axis].get(place as usize) {
            Some(&known) => known,
            None => coordinate(self.sides[axis], place as usize, self.top[axis] as usize),
        }
    }

    /// The coordinates of all places along an axis.
    pub(super) fn coordinates(&self, axis: usize) -> &[f64] {
        &self.coordinates[axis]
    }

    /// The point at a place.
    pub(super) fn point(&self, place: Place) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|axis| {
            self.coordinate(axis, place[axis])
        }))
    }

    /// The number of a place.
    pub(super) fn key(&self, [x, y, z]: Place) -> u64 {
        let [width, height, _] = self.top.map(|top| u64::from(top) + 1);
        (u64::from(z) * height + u64::from(y)) * width + u64::from(x)
    }

    /// The place of a number.
    pub(super) fn place(&self, key: u64) -> Place {
        let [width, height, _] = self.top.map(|top| u64::from(top) + 1);
        [
            (key % width) as u32,
            (key / width % height) as u32,
            (key / (width * height)) as u32,
        ]
    }

    /// Whether all these places lie in one side of the box.
    fn in_one_side(&self, places: &[Place]) -> bool {
        (0..3).any(|axis| {
            let within = |side: u32| places.iter().all(|place| place[axis] == side);
            within(0) || within(self.top[axis])
        })
    }

    /// The outward normal of the box at a place on its boundary; at its edges and corners the mean
    /// of the sides' normals.
    fn outward(&self, place: Place) -> DVec3 {
        let component = |axis: usize| {
            let above = f64::from(u8::from(place[axis] == self.top[axis]));
            above - f64::from(u8::from(place[axis] == 0))
        };
        DVec3::from_array([0, 1, 2].map(component)).normalize_or_zero()
    }

    /// The edge that a vertex is on; of no length at a cap.
    fn segment(&self, vertex: &Vertex) -> Segment {
        let [inside, outside] = vertex.ends.map(|end| self.point(self.place(end)));
        Segment {
            inside,
            outside,
            inside_value: vertex.values[0],
            outside_value: vertex.values[1],
        }
    }
}

/// A vertex before its root is found.
#[derive(Clone, Copy)]
pub(super) struct Vertex {
    /// The numbers of the points at the ends of its edge, that inside first. At a point of a cap
    /// they are the same.
    pub(super) ends: [u64; 2],
    /// F − iso at the ends.
    values: [f64; 2],
}

/// A surface in the making: how it hangs together.
#[derive(Default)]
pub(super) struct Piece {
    pub(super) vertices: Vec<Vertex>,
    /// Triangles and quadrilaterals, counter-clockwise seen from outside.
    facets: Vec<[u32; 4]>,
}

/// Cuts tetrahedra by the level.
pub(super) struct Skin<'a> {
    lattice: &'a Lattice,
    cap: bool,
    numbers: FxHashMap<[u64; 2], u32>,
    piece: Piece,
}

impl<'a> Skin<'a> {
    /// An empty surface; with a cap where `cap` says so.
    pub(super) fn new(lattice: &'a Lattice, cap: bool) -> Self {
        Skin {
            lattice,
            cap,
            numbers: FxHashMap::default(),
            piece: Piece::default(),
        }
    }

    /// The surface.
    pub(super) fn into_piece(self) -> Piece {
        self.piece
    }

    /// Adds what is in a tetrahedron of positive orientation. Bit c of `inside` tells whether its
    /// corner c is; `value` gives F − iso at a place.
    pub(super) fn add(&mut self, corners: &[Place; 4], inside: u8, value: &impl Fn(Place) -> f64) {
        let cut = |skin: &mut Self, order: [usize; 4], edges: &[(usize, usize)]| {
            let facet = edges
                .iter()
                .map(|&(from, to)| skin.vertex([corners[order[from]], corners[order[to]]], value));
            let facet: Vec<u32> = facet.collect();
            skin.push(&facet);
        };
        match inside.count_ones() {
            1 => {
                let order = ONE_FIRST[inside.trailing_zeros() as usize];
                cut(self, order, &[(0, 1), (0, 2), (0, 3)]);
            }
            2 => {
                let first = |order: &&[usize; 4]| 1 << order[0] | 1 << order[1] == inside;
                if let Some(&order) = TWO_FIRST.iter().find(first) {
                    cut(self, order, &[(0, 2), (0, 3), (1, 3), (1, 2)]);
                }
            }
            3 => {
                let order = ONE_FIRST[(!inside & 15).trailing_zeros() as usize];
                cut(self, order, &[(1, 0), (3, 0), (2, 0)]);
            }
            _ => {}
        }
        if self.cap && inside != 0 {
            self.close(corners, inside, value);
        }
    }

    /// Adds the inside parts of those faces that lie in a side of the box.
    fn close(&mut self, corners: &[Place; 4], inside: u8, value: &impl Fn(Place) -> f64) {
        for face in FACES {
            if !self
                .lattice
                .in_one_side(&face.map(|corner| corners[corner]))
            {
                continue;
            }
            let mut facet = Vec::with_capacity(4);
            for step in 0..3 {
                let (here, next) = (face[step], face[(step + 1) % 3]);
                let is_inside = |corner: usize| inside >> corner & 1 == 1;
                if is_inside(here) {
                    facet.push(self.vertex([corners[here]; 2], value));
                }
                if is_inside(here) != is_inside(next) {
                    let ends = if is_inside(here) {
                        [here, next]
                    } else {
                        [next, here]
                    };
                    facet.push(self.vertex(ends.map(|end| corners[end]), value));
                }
            }
            self.push(&facet);
        }
    }

    fn push(&mut self, facet: &[u32]) {
        match *facet {
            [a, b, c] => self.piece.facets.push([a, b, c, NONE]),
            [a, b, c, d] => self.piece.facets.push([a, b, c, d]),
            _ => {}
        }
    }

    /// The number of the vertex on the edge between two places, that inside first.
    fn vertex(&mut self, ends: [Place; 2], value: &impl Fn(Place) -> f64) -> u32 {
        let keys = ends.map(|place| self.lattice.key(place));
        let vertices = &mut self.piece.vertices;
        *self.numbers.entry(keys).or_insert_with(|| {
            vertices.push(Vertex {
                ends: keys,
                values: ends.map(value),
            });
            // A number beyond the range wraps, but is not used: then the vertices are too many.
            (vertices.len() - 1) as u32
        })
    }
}

/// The pieces as one; `is_shared` tells which vertices may be in several of them.
pub(super) fn join(
    pieces: Vec<Piece>,
    is_shared: impl Fn(&Vertex) -> bool,
) -> Result<Piece, PolygonizeError> {
    let mut whole = Piece::default();
    let mut known: FxHashMap<[u64; 2], u32> = FxHashMap::default();
    for piece in pieces {
        let mut numbers = Vec::with_capacity(piece.vertices.len());
        for vertex in piece.vertices {
            let next = whole.vertices.len() as u32;
            let number = match is_shared(&vertex) {
                true => *known.entry(vertex.ends).or_insert(next),
                false => next,
            };
            if number == next {
                whole.vertices.push(vertex);
            }
            numbers.push(number);
        }
        let vertices = whole.vertices.len();
        if vertices >= NONE as usize {
            return Err(PolygonizeError::TooManyVertices { vertices });
        }
        let renamed = |vertex: u32| numbers.get(vertex as usize).copied().unwrap_or(NONE);
        let facets = piece.facets.iter().map(|facet| facet.map(renamed));
        whole.facets.extend(facets);
    }
    Ok(whole)
}

/// Finds the roots and makes the mesh: quadrilaterals are divided along the shorter diagonal,
/// which is inside of their tetrahedron or in the cap, where no other facet has it.
pub(super) fn finish(
    job: &Job,
    lattice: &Lattice,
    piece: &Piece,
) -> Result<(Mesh, Statistics), PolygonizeError> {
    let solved: Vec<(Vec<Root>, usize)> = piece
        .vertices
        .par_chunks(CHUNK)
        .map(|vertices| {
            let segments: Vec<Segment> = vertices.iter().map(|own| lattice.segment(own)).collect();
            let (mut roots, evaluations) =
                edge_roots::solve(&mut { job.field }, job.accuracy, &segments, job.monitor);
            for (root, Vertex { ends, .. }) in roots.iter_mut().zip(vertices) {
                if ends[0] == ends[1] {
                    root.normal = lattice.outward(lattice.place(ends[0]));
                }
            }
            (roots, evaluations)
        })
        .collect();
    if job.monitor.cancelled() {
        return Err(PolygonizeError::Cancelled);
    }
    let mut statistics = Statistics::default();
    let mut mesh = Mesh::default();
    for (roots, evaluations) in solved {
        statistics = statistics.and(Statistics {
            evaluations,
            ..Statistics::of_roots(&roots)
        });
        mesh.positions
            .extend(roots.iter().map(|root| root.position));
        mesh.normals.extend(roots.iter().map(|root| root.normal));
    }
    let cut = |vertex: &Vertex| lattice.in_one_side(&vertex.ends.map(|end| lattice.place(end)));
    statistics.cut_by_box = piece.vertices.par_iter().any(cut);
    mesh.triangles = triangles(&piece.facets, &mesh.positions);
    // Where the surface runs through a point of the lattice, the roots on all edges there are
    // that point.
    mesh.collapse_degenerate_edges();
    Ok((mesh, statistics))
}

/// The facets as triangles.
fn triangles(facets: &[[u32; 4]], positions: &[DVec3]) -> Vec<[u32; 3]> {
    let length = |a: u32, b: u32| positions[a as usize].distance_squared(positions[b as usize]);
    let mut triangles = Vec::with_capacity(2 * facets.len());
    for &[a, b, c, d] in facets {
        if d == NONE {
            triangles.push([a, b, c]);
        } else if length(a, c) <= length(b, d) {
            triangles.extend([[a, b, c], [a, c, d]]);
        } else {
            triangles.extend([[b, c, d], [b, d, a]]);
        }
    }
    triangles
}
