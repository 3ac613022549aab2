//! Functions that are trilinear in every cell of a grid, and the topology of their level sets by
//! subdivision.
//!
//! A cell is halved along every axis, again and again. A trilinear function is trilinear in the
//! halves, too, so its values there are exact. It ends where signs tell everything: where no face
//! has two equal signs across a diagonal only, and equal corners are connected by edges. There is
//! one region of either sign in such a cell, at most. Near a saddle cells become small until the
//! sign in them is one. Regions are connected across the faces between cells; the Euler number of
//! the set below the level is the sum of those of its parts in all open cells, faces, edges and
//! vertices (with compact support). Nothing of this knows a case table.

use glam::DVec3;
use imp::engine::Field;

use crate::support::Closure;

/// The values at the corners of a cell; corner c lies at (c & 1, c >> 1 & 1, c >> 2 & 1).
pub(crate) type Corners = [f64; 8];

/// The trilinear function with these values at the corners, in the unit cube.
pub(crate) fn interpolate(corners: &Corners, at: [f64; 3]) -> f64 {
    let weight = |corner: usize, axis: usize| match corner >> axis & 1 {
        0 => 1.0 - at[axis],
        _ => at[axis],
    };
    let term = |corner: usize| (0..3).map(|axis| weight(corner, axis)).product::<f64>();
    (0..8).map(|corner| corners[corner] * term(corner)).sum()
}

/// The corners of each face in a circle, and those of each edge.
const FACES: [[usize; 4]; 6] = [
    [0, 2, 6, 4],
    [1, 3, 7, 5],
    [0, 1, 5, 4],
    [2, 3, 7, 6],
    [0, 1, 3, 2],
    [4, 5, 7, 6],
];

/// Whether a bilinear function, given in a circle, connects its two negative corners across the
/// diagonal; `None` if signs are otherwise.
pub(crate) fn connects(face: [f64; 4]) -> Option<bool> {
    let [a, b, c, d] = face;
    let [p, q, r, s] = face.map(|value| value < 0.0);
    // The value at the saddle is (ac − bd)/(a + c − b − d).
    (p == r && q == s && p != q).then(|| (a * c - b * d) / (a + c - b - d) < 0.0)
}

/// A cell of the subdivision.
enum Part {
    /// Values and the regions of negative and other values.
    Whole(Corners, [usize; 2]),
    Split(Vec<Part>),
}

/// Regions that may turn out to be one.
#[derive(Default)]
struct Regions(Vec<usize>);

impl Regions {
    fn add(&mut self) -> usize {
        self.0.push(self.0.len());
        self.0.len() - 1
    }

    fn find(&mut self, mut region: usize) -> usize {
        while self.0[region] != region {
            self.0[region] = self.0[self.0[region]];
            region = self.0[region];
        }
        region
    }

    fn join(&mut self, one: usize, other: usize) {
        let (one, other) = (self.find(one), self.find(other));
        self.0[one.max(other)] = one.min(other);
    }
}

/// Components of the negative and of the other set, and the Euler number of the negative one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sets {
    pub(crate) negative: usize,
    pub(crate) positive: usize,
    pub(crate) euler: i64,
}

#[derive(Default)]
struct Subdivision {
    regions: Regions,
    euler: i64,
}

impl Subdivision {
    /// The parts of a cell. The Euler number of what is in its interior is added.
    fn divide(&mut self, corners: &Corners) -> Part {
        if is_decided(corners) {
            // An open cell has the number −1, one with a boundary on one side 0.
            if corners.iter().all(|&value| value < 0.0) {
                self.euler -= 1;
            }
            return Part::Whole(*corners, [self.regions.add(), self.regions.add()]);
        }
        let at = |doubled: [usize; 3]| interpolate(corners, doubled.map(|x| 0.5 * x as f64));
        let parts: Vec<Part> = (0..8)
            .map(|part: usize| {
                let corner =
                    |c: usize| at([0, 1, 2].map(|axis| (part >> axis & 1) + (c >> axis & 1)));
                self.divide(&[0, 1, 2, 3, 4, 5, 6, 7].map(corner))
            })
            .collect();
        let middle = at([1, 1, 1]);
        self.euler += i64::from(middle < 0.0);
        for axis in 0..3 {
            for end in [0, 2] {
                let mut place = [1; 3];
                place[axis] = end;
                self.euler -= i64::from(middle < 0.0 && at(place) < 0.0);
            }
            for quarter in 0..4usize {
                let corner = |(u, v): (usize, usize)| {
                    let mut place = [1; 3];
                    place[(axis + 1) % 3] = (quarter & 1) + u;
                    place[(axis + 2) % 3] = (quarter >> 1) + v;
                    at(place)
                };
                self.euler += open_face([(0, 0), (1, 0), (1, 1), (0, 1)].map(corner));
            }
            for part in (0..8).filter(|part| part >> axis & 1 == 0) {
                self.glue([&parts[part], &parts[part | 1 << axis]], axis);
            }
        }
        Part::Split(parts)
    }

    /// Connects the regions of two cells, of which the second follows along the axis.
    fn glue(&mut self, [one, other]: [&Part; 2], axis: usize) {
        let upper = |part: usize| part >> axis & 1 == 1;
        match (one, other) {
            (Part::Whole(values, regions), Part::Whole(others, other_regions)) => {
                for sign in [0, 1] {
                    let has = |value: f64| (value < 0.0) == (sign == 0);
                    let here = (0..8).any(|c| upper(c) && has(values[c]));
                    let there = (0..8).any(|c| !upper(c) && has(others[c]));
                    if here && there {
                        self.regions.join(regions[sign], other_regions[sign]);
                    }
                }
            }
            (Part::Split(parts), Part::Whole(..)) => {
                for part in (0..8).filter(|&part| upper(part)) {
                    self.glue([&parts[part], other], axis);
                }
            }
            (Part::Whole(..), Part::Split(parts)) => {
                for part in (0..8).filter(|&part| !upper(part)) {
                    self.glue([one, &parts[part]], axis);
                }
            }
            (Part::Split(parts), Part::Split(others)) => {
                for part in (0..8).filter(|&part| upper(part)) {
                    self.glue([&parts[part], &others[part & !(1 << axis)]], axis);
                }
            }
        }
    }

    /// Notes which regions there are.
    fn collect(&mut self, part: &Part, found: &mut [Vec<usize>; 2]) {
        match part {
            Part::Whole(values, regions) => {
                for sign in [0, 1] {
                    if values.iter().any(|&value| (value < 0.0) == (sign == 0)) {
                        found[sign].push(self.regions.find(regions[sign]));
                    }
                }
            }
            Part::Split(parts) => parts.iter().for_each(|part| self.collect(part, found)),
        }
    }
}

/// Whether signs decide the topology: equal corners are connected by edges.
fn is_decided(corners: &Corners) -> bool {
    let circle = |face: [usize; 4]| face.map(|corner| corners[corner]);
    if FACES
        .into_iter()
        .any(|face| connects(circle(face)).is_some())
    {
        return false;
    }
    // Without such faces only two opposite corners can be apart.
    let alone = |corner: usize| {
        let sign = corners[corner] < 0.0;
        (0..3).all(|axis| (corners[corner ^ 1 << axis] < 0.0) != sign)
            && (corners[corner ^ 7] < 0.0) == sign
    };
    !(0..4).any(alone)
}

/// The Euler number, with compact support, of the negative set in an open square.
fn open_face(face: [f64; 4]) -> i64 {
    let all = face.iter().all(|&value| value < 0.0);
    // An open square has the number 1, a strip with its two curves −1, what is cut off by one
    // curve 0.
    i64::from(all) - i64::from(connects(face) == Some(true))
}

/// A function that is trilinear in the cells of a grid of `points`³ points at integers.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    pub(crate) points: usize,
    /// The first axis fastest.
    pub(crate) values: Vec<f64>,
}

impl Grid {
    /// Values from `inner` at the points that are not on the boundary, positive ones there.
    pub(crate) fn closed(points: usize, mut random: impl FnMut() -> f64) -> Grid {
        let on_boundary = |index: usize| index == 0 || index + 1 == points;
        let mut values = Vec::with_capacity(points.pow(3));
        for number in 0..points.pow(3) {
            let place = [
                number % points,
                number / points % points,
                number / points.pow(2),
            ];
            let value = random();
            let outer = place.into_iter().any(on_boundary);
            values.push(if outer { value.abs() } else { value });
        }
        Grid { points, values }
    }

    fn value(&self, [i, j, k]: [usize; 3]) -> f64 {
        self.values[(k * self.points + j) * self.points + i]
    }

    /// All cells, the first axis fastest.
    pub(crate) fn cells(&self) -> Vec<Corners> {
        let cells = self.points - 1;
        let cell = |number: usize| {
            let low = [
                number % cells,
                number / cells % cells,
                number / cells.pow(2),
            ];
            [0, 1, 2, 3, 4, 5, 6, 7].map(|corner: usize| {
                self.value([0, 1, 2].map(|axis| low[axis] + (corner >> axis & 1)))
            })
        };
        (0..cells.pow(3)).map(cell).collect()
    }

    /// The topology of the sets of negative and of other values.
    pub(crate) fn sets(&self) -> Sets {
        let mut work = Subdivision::default();
        let cells = self.points - 1;
        let parts: Vec<Part> = self.cells().iter().map(|cell| work.divide(cell)).collect();
        let stride = [1, cells, cells * cells];
        for (number, part) in parts.iter().enumerate() {
            for axis in 0..3 {
                if number / stride[axis] % cells + 1 < cells {
                    work.glue([part, &parts[number + stride[axis]]], axis);
                }
            }
        }
        // What is on the grid's own points, edges and faces.
        let points = self.points;
        for number in 0..points.pow(3) {
            let place = [
                number % points,
                number / points % points,
                number / points.pow(2),
            ];
            let at = |steps: &[usize]| {
                let mut place = place;
                steps.iter().for_each(|&axis| place[axis] += 1);
                self.value(place)
            };
            work.euler += i64::from(at(&[]) < 0.0);
            for axis in (0..3).filter(|&axis| place[axis] + 1 < points) {
                work.euler -= i64::from(at(&[]) < 0.0 && at(&[axis]) < 0.0);
            }
            for [a, b] in [[0, 1], [1, 2], [2, 0]] {
                if place[a] + 1 < points && place[b] + 1 < points {
                    work.euler += open_face([at(&[]), at(&[a]), at(&[a, b]), at(&[b])]);
                }
            }
        }
        let mut found = [Vec::new(), Vec::new()];
        parts.iter().for_each(|part| work.collect(part, &mut found));
        let [negative, positive] = found.map(|mut regions| {
            regions.sort_unstable();
            regions.dedup();
            regions.len()
        });
        Sets {
            negative,
            positive,
            euler: work.euler,
        }
    }

    /// The function as a field.
    pub(crate) fn field(self) -> impl Field {
        let function = move |p: DVec3| {
            let low = p
                .floor()
                .clamp(DVec3::ZERO, DVec3::splat(self.points as f64 - 2.0));
            let base = [0, 1, 2].map(|axis| low[axis] as usize);
            let corners = [0, 1, 2, 3, 4, 5, 6, 7].map(|corner: usize| {
                self.value([0, 1, 2].map(|axis| base[axis] + (corner >> axis & 1)))
            });
            let at = (p - low).to_array();
            // Linear along every axis: the difference between the ends is the slope.
            let slope = |axis: usize| {
                let [mut from, mut to] = [at, at];
                (from[axis], to[axis]) = (0.0, 1.0);
                interpolate(&corners, to) - interpolate(&corners, from)
            };
            (
                interpolate(&corners, at),
                DVec3::from_array([0, 1, 2].map(slope)),
            )
        };
        Closure {
            dimension: 3,
            function,
        }
    }
}
