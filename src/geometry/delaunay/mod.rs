//! The Delaunay triangulation of points in space, tetrahedron by tetrahedron.
//!
//! Points are inserted one after another (A. Bowyer, "Computing Dirichlet tessellations", and
//! D. F. Watson, both in The Computer Journal 24, 1981): the tetrahedra whose circumscribed spheres
//! hold the new point make way for those that join it to the boundary of their union. All signs
//! are exact. On a sphere is not in it; the union is then star-shaped as seen from the point, so that no
//! tetrahedron without a volume can appear, and points of a grid, on a sphere or in a plane need no
//! rule of their own.
//!
//! Eight guards, the corners of a large cube, are there from the beginning, so that every point has
//! tetrahedra all around. They are so far away that inside the box the Voronoi cells are those
//! of the points alone, once there is a point.

mod horizon;
mod order;

use glam::DVec3;

use self::horizon::Horizon;
use self::order::insertion_order;
use super::Bounds;
use super::predicates::{Side, side_of_plane, side_of_sphere};

/// The number of guards: vertices below it are none of the points.
const GUARDS: u32 = 8;

/// The side of the guards' cube, in diagonals of the box: whoever is in the box is nearer to any point
/// in it than to a guard.
const CUBE: f64 = 8.0;

/// No tetrahedron.
const NONE: u32 = u32::MAX;

/// The corners of a tetrahedron's facets, counter-clockwise seen from outside; facet i is opposite of
/// vertex i.
const FACETS: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// Four vertices, the last on the `Greater` side of the first three, and the tetrahedra opposite of them.
#[derive(Clone, Copy, Debug)]
struct Tetrahedron {
    vertices: [u32; 4],
    neighbours: [u32; 4],
}

impl Tetrahedron {
    /// A place that is free.
    fn is_free(&self) -> bool {
        self.vertices[0] == NONE
    }

    /// The facet behind which a neighbour lies.
    fn facet_to(&self, neighbour: u32) -> usize {
        let found = self.neighbours.iter().position(|&other| other == neighbour);
        found.unwrap_or(0)
    }
}

/// A triangle between two tetrahedra, all of whose corners are points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Facet {
    /// Numbers of points, counter-clockwise seen from the second tetrahedron.
    pub(crate) corners: [u32; 3],
    /// Numbers of tetrahedra ([`Delaunay::circumcentre`]).
    pub(crate) between: [u32; 2],
}

/// A Delaunay triangulation that grows. Fewer than 2³⁰ points.
#[derive(Clone, Debug)]
pub(crate) struct Delaunay {
    /// The guards, then the points.
    vertices: Vec<DVec3>,
    tetrahedra: Vec<Tetrahedron>,
    free: Vec<u32>,
    /// Where the next search begins.
    last: u32,
    /// For each tetrahedron the last insertion that has looked at it, twice, and 1 more if it had to
    /// make way.
    seen: Vec<u64>,
    insertion: u64,
    conflicts: Vec<u32>,
    horizon: Horizon,
}

impl Delaunay {
    /// The triangulation of no points, for points in a box in R3 of finite, positive diagonal.
    pub(crate) fn new(bounds: &Bounds) -> Self {
        let half = DVec3::splat(0.5 * CUBE * bounds.diagonal());
        let center = bounds.center();
        let corner = |number: usize| {
            let side = |axis: usize| if number >> axis & 1 == 0 { -1.0 } else { 1.0 };
            center + half * DVec3::from_array([0, 1, 2].map(side))
        };
        let mut delaunay = Delaunay {
            vertices: (0..GUARDS as usize).map(corner).collect(),
            tetrahedra: Vec::new(),
            free: Vec::new(),
            last: 0,
            seen: Vec::new(),
            insertion: 0,
            conflicts: Vec::new(),
            horizon: Horizon::default(),
        };
        delaunay.divide_cube();
        delaunay
    }

    /// The cube in five: a corner each at four of its corners, and the rest.
    fn divide_cube(&mut self) {
        const PARTS: [[u32; 4]; 5] = [
            [0, 3, 5, 6],
            [1, 0, 3, 5],
            [2, 0, 3, 6],
            [4, 0, 5, 6],
            [7, 3, 5, 6],
        ];
        for mut vertices in PARTS {
            let [a, b, c, d] = vertices.map(|vertex| self.vertices[vertex as usize]);
            if side_of_plane(a, b, c, d) == Side::Less {
                vertices.swap(2, 3);
            }
            self.tetrahedra.push(Tetrahedron {
                vertices,
                neighbours: [NONE; 4],
            });
            self.seen.push(0);
        }
        for own in 0..PARTS.len() {
            for (facet, corners) in FACETS.iter().enumerate() {
                let corners = corners.map(|corner| self.tetrahedra[own].vertices[corner]);
                let other = (0..PARTS.len()).find(|&other| {
                    let vertices = &self.tetrahedra[other].vertices;
                    other != own && corners.iter().all(|corner| vertices.contains(corner))
                });
                let other = other.map_or(NONE, |other| other as u32);
                self.tetrahedra[own].neighbours[facet] = other;
            }
        }
    }

    /// A point.
    pub(crate) fn point(&self, number: u32) -> DVec3 {
        self.vertices[(number + GUARDS) as usize]
    }

    /// Inserts points of the box, which get the next numbers, and gives the numbers of those that
    /// are in the same place as an earlier one, ascending: these have no tetrahedra.
    ///
    /// They are inserted in an order that makes for short ways, whatever their own is. Costs O(n log n)
    /// for points that are well spread over a generic surface.
    pub(crate) fn extend(&mut self, points: &[DVec3]) -> Vec<u32> {
        let first = self.vertices.len() as u32;
        self.vertices.extend(points);
        let order = insertion_order(points);
        let mut doubles: Vec<u32> = (order.into_iter())
            .filter(|&number| !self.insert(first + number))
            .map(|number| first + number - GUARDS)
            .collect();
        doubles.sort_unstable();
        doubles
    }

    /// Inserts a vertex, unless there is one in its place.
    fn insert(&mut self, vertex: u32) -> bool {
        let point = self.vertices[vertex as usize];
        let home = self.locate(point);
        let own = self.tetrahedra[home as usize].vertices;
        if own
            .iter()
            .any(|&other| self.vertices[other as usize] == point)
        {
            return false;
        }
        self.find_conflicts(home, point);
        self.fill(vertex);
        true
    }

    /// The tetrahedron that a point of the cube lies in, or on the boundary of: a walk through facets
    /// that see it on their other side. It ends, because in a Delaunay triangulation no such walk
    /// returns (H. Edelsbrunner, "An acyclicity theorem for cell complexes in d dimensions", 1990).
    fn locate(&self, point: DVec3) -> u32 {
        let mut here = self.last;
        let mut before = NONE;
        'walk: loop {
            let tetrahedron = &self.tetrahedra[here as usize];
            for (facet, corners) in FACETS.iter().enumerate() {
                let beyond = tetrahedron.neighbours[facet];
                if beyond == before || beyond == NONE {
                    continue;
                }
                let [a, b, c] =
                    corners.map(|corner| self.vertices[tetrahedron.vertices[corner] as usize]);
                if side_of_plane(a, b, c, point) == Side::Greater {
                    before = here;
                    here = beyond;
                    continue 'walk;
                }
            }
            return here;
        }
    }

    /// Collects the tetrahedra whose spheres hold a point, and the facets around them.
    fn find_conflicts(&mut self, home: u32, point: DVec3) {
        self.insertion += 1;
        let (looked, yields) = (2 * self.insertion, 2 * self.insertion + 1);
        self.conflicts.clear();
        self.horizon.clear();
        self.conflicts.push(home);
        self.seen[home as usize] = yields;
        let mut next = 0;
        while let Some(&here) = self.conflicts.get(next) {
            next += 1;
            let tetrahedron = self.tetrahedra[here as usize];
            for (facet, &beyond) in tetrahedron.neighbours.iter().enumerate() {
                let state = self.seen.get(beyond as usize).copied().unwrap_or(looked);
                if state == yields {
                    continue;
                }
                if state != looked {
                    if self.holds(beyond, point) {
                        self.seen[beyond as usize] = yields;
                        self.conflicts.push(beyond);
                        continue;
                    }
                    self.seen[beyond as usize] = looked;
                }
                let corners = FACETS[facet].map(|corner| tetrahedron.vertices[corner]);
                let back = match self.tetrahedra.get(beyond as usize) {
                    Some(other) => other.facet_to(here),
                    None => 0,
                };
                self.horizon.push(corners, beyond, back as u8);
            }
        }
    }

    /// Whether the sphere around a tetrahedron holds a point.
    fn holds(&self, tetrahedron: u32, point: DVec3) -> bool {
        let corners = self.corners(tetrahedron);
        side_of_sphere(corners, point) == Side::Greater
    }

    /// Joins a vertex to all facets around the tetrahedra that make way for it.
    fn fill(&mut self, vertex: u32) {
        self.free.extend(&self.conflicts);
        for &gone in &self.conflicts {
            self.tetrahedra[gone as usize].vertices[0] = NONE;
        }
        for number in 0..self.horizon.facets.len() {
            let facet = self.horizon.facets[number];
            let [a, b, c] = facet.corners;
            // The facet looks outward, away from the vertex.
            let tetrahedron = Tetrahedron {
                vertices: [vertex, a, b, c],
                neighbours: [facet.beyond, NONE, NONE, NONE],
            };
            let place = match self.free.pop() {
                Some(place) => {
                    self.tetrahedra[place as usize] = tetrahedron;
                    place
                }
                None => {
                    self.tetrahedra.push(tetrahedron);
                    self.seen.push(0);
                    self.tetrahedra.len() as u32 - 1
                }
            };
            self.last = place;
            if let Some(other) = self.tetrahedra.get_mut(facet.beyond as usize) {
                other.neighbours[usize::from(facet.back)] = place;
            }
            // Opposite of a lies the neighbour that has b and c, and so on.
            for (edge, facet) in [([b, c], 1), ([c, a], 2), ([a, b], 3)] {
                if let Some((other, back)) = self.horizon.join(edge, place, facet) {
                    self.tetrahedra[place as usize].neighbours[usize::from(facet)] = other;
                    self.tetrahedra[other as usize].neighbours[usize::from(back)] = place;
                }
            }
        }
    }

    fn corners(&self, tetrahedron: u32) -> [DVec3; 4] {
        let vertices = self.tetrahedra[tetrahedron as usize].vertices;
        vertices.map(|vertex| self.vertices[vertex as usize])
    }

    /// The number of places for tetrahedra: their numbers are below it.
    pub(crate) fn places(&self) -> usize {
        self.tetrahedra.len()
    }

    /// The centre of the sphere around a tetrahedron: a corner of the Voronoi diagram. Not finite where
    /// there is no tetrahedron. Not exact, and far off where it is flat.
    pub(crate) fn circumcentre(&self, tetrahedron: u32) -> DVec3 {
        if self.tetrahedra[tetrahedron as usize].is_free() {
            return DVec3::NAN;
        }
        let [a, b, c, d] = self.corners(tetrahedron);
        let [u, v, w] = [b - a, c - a, d - a];
        let [vw, wu, uv] = [v.cross(w), w.cross(u), u.cross(v)];
        let sum = u.length_squared() * vw + v.length_squared() * wu + w.length_squared() * uv;
        a + sum / (2.0 * u.dot(vw))
    }

    /// The triangles whose corners are points, those of one place for a tetrahedron after those of
    /// another; each once.
    pub(crate) fn facets_of(&self, place: u32) -> impl Iterator<Item = Facet> + '_ {
        let tetrahedron = self.tetrahedra[place as usize];
        let own = (0..4).filter(move |&facet| {
            let beyond = tetrahedron.neighbours[facet];
            !tetrahedron.is_free() && beyond != NONE && place < beyond
        });
        own.filter_map(move |facet| {
            let corners = FACETS[facet].map(|corner| tetrahedron.vertices[corner]);
            let are_points = corners.iter().all(|&corner| corner >= GUARDS);
            are_points.then(|| Facet {
                corners: corners.map(|corner| corner - GUARDS),
                between: [place, tetrahedron.neighbours[facet]],
            })
        })
    }
}

#[cfg(test)]
mod tests;
