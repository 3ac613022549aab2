//! The simplices of the box's Freudenthal triangulation that the level set intersects (section 4
//! of the paper), with their nodes and springs numbered once and for all.

use std::ops::Range;

use glam::DVec3;

use super::super::grid::{Seen, coordinate};
use super::super::{Job, PolygonizeError, Statistics, cell_counts, check_cells};
use super::LIMIT;
use crate::geometry::Bounds;

/// In the places of a triangle that only a tetrahedron has.
pub(super) const NONE: u32 = u32::MAX;

/// The pairs of corners of a simplex, those of its triangle first.
pub(super) const PAIRS: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];

/// The axes in all orders, with whether the order is an even permutation.
const ORDERS: [([usize; 3], bool); 6] = [
    ([0, 1, 2], true),
    ([1, 2, 0], true),
    ([2, 0, 1], true),
    ([0, 2, 1], false),
    ([2, 1, 0], false),
    ([1, 0, 2], false),
];

/// Simplices with nodes and springs.
#[derive(Default)]
pub(super) struct Complex {
    pub(super) dimension: usize,
    /// The longest side of a cell.
    pub(super) spacing: f64,
    pub(super) nodes: Vec<DVec3>,
    /// Whether F < iso; does not change any more.
    pub(super) inside: Vec<bool>,
    /// 1 along the axes in which a node may move, 0 in others: nodes in a side of the box stay in it.
    pub(super) freedom: Vec<DVec3>,
    /// Nodes of each simplex, of positive orientation; the last is [`NONE`] in R2.
    pub(super) simplices: Vec<[u32; 4]>,
    /// The springs of each simplex, in the order of [`PAIRS`].
    pub(super) sides: Vec<[u32; 6]>,
    /// The nodes of each spring.
    pub(super) springs: Vec<[u32; 2]>,
    /// Springs around node n: `around[starts[n]..starts[n + 1]]` are the nodes at their other ends.
    pub(super) starts: Vec<u32>,
    pub(super) around: Vec<u32>,
}

impl Complex {
    /// The simplices that the level set intersects, what was seen, and the evaluations; F is
    /// evaluated at each point of the grid once, layer by layer.
    pub(super) fn new(job: &Job) -> Result<(Self, Seen, Statistics), PolygonizeError> {
        let counts = cell_counts(job.options);
        check_cells(counts.iter().product(), job.options)?;
        let mut builder = Builder::new(job, counts.iter().map(|&count| count as usize).collect());
        let mut statistics = Statistics {
            cells: builder.counts.iter().product(),
            ..Statistics::default()
        };
        let last = builder.dimension - 1;
        let layers = builder.counts[last];
        builder.evaluate(0)?;
        for layer in 0..layers {
            if job.monitor.cancelled() {
                return Err(PolygonizeError::Cancelled);
            }
            job.monitor
                .progress("triangulation", layer as f64 / layers as f64);
            builder.evaluate(layer + 1)?;
            builder.add_layer(layer)?;
        }
        statistics.evaluations = builder.seen.points();
        statistics.nan_points = builder.seen.nan;
        if job.options.cap && builder.meets_box {
            return Err(PolygonizeError::BadOption {
                option: "cap",
                demand: "be 0 (false) with \"springs\", which closes nothing along the box",
                value: 1.0,
            });
        }
        Ok((builder.complex.connected(), builder.seen, statistics))
    }

    /// The corners of a simplex.
    pub(super) fn corners(&self) -> usize {
        self.dimension + 1
    }

    /// The area or volume of a simplex times 2 or 6, if its nodes were at these positions.
    pub(super) fn measure(&self, simplex: &[u32; 4], nodes: &[DVec3]) -> f64 {
        let at = |corner: usize| nodes[simplex[corner] as usize];
        let (first, second) = (at(1) - at(0), at(2) - at(0));
        match self.dimension {
            2 => first.x * second.y - first.y * second.x,
            _ => first.cross(second).dot(at(3) - at(0)),
        }
    }

    /// Numbers the springs.
    fn connected(mut self) -> Self {
        let used = self.dimension * (self.dimension + 1) / 2;
        let ends = |simplex: &[u32; 4], [from, to]: [usize; 2]| {
            let (from, to) = (simplex[from], simplex[to]);
            [from.min(to), from.max(to)]
        };
        let all = self.simplices.iter();
        self.springs = all
            .flat_map(|simplex| PAIRS[..used].iter().map(move |&pair| ends(simplex, pair)))
            .collect();
        self.springs.sort_unstable();
        self.springs.dedup();
        let number = |spring: [u32; 2]| match self.springs.binary_search(&spring) {
            Ok(place) | Err(place) => place as u32,
        };
        let sides = |simplex: &[u32; 4]| {
            let mut sides = [NONE; 6];
            for (side, &pair) in sides.iter_mut().zip(&PAIRS[..used]) {
                *side = number(ends(simplex, pair));
            }
            sides
        };
        self.sides = self.simplices.iter().map(sides).collect();
        let mut directed: Vec<[u32; 2]> = self.springs.clone();
        directed.extend(self.springs.iter().map(|&[from, to]| [to, from]));
        directed.sort_unstable();
        self.around = directed.iter().map(|&[_, to]| to).collect();
        let count = self.nodes.len() as u32;
        self.starts = (0..=count)
            .map(|node| directed.partition_point(|&[from, _]| from < node) as u32)
            .collect();
        self
    }

    /// The places of a node's springs in `around`.
    pub(super) fn springs_of(&self, node: usize) -> Range<usize> {
        self.starts[node] as usize..self.starts[node + 1] as usize
    }
}

/// Two layers of the grid and what has been made of those before.
struct Builder<'a> {
    job: &'a Job<'a>,
    dimension: usize,
    /// Cells along each axis.
    counts: Vec<usize>,
    coordinates: Vec<Vec<f64>>,
    /// F − iso in the lower and the upper layer.
    values: [Vec<f64>; 2],
    /// The nodes there, or [`NONE`].
    numbers: [Vec<u32>; 2],
    seen: Seen,
    /// Whether a point in the boundary of the box is inside.
    meets_box: bool,
    complex: Complex,
}

impl<'a> Builder<'a> {
    fn new(job: &'a Job, counts: Vec<usize>) -> Self {
        let bounds: &Bounds = &job.options.bounds;
        let along = |(side, &count): ((f64, f64), &usize)| {
            (0..=count)
                .map(|step| coordinate(side, step, count))
                .collect()
        };
        let spacing = bounds.sides().zip(&counts);
        Builder {
            job,
            dimension: counts.len(),
            coordinates: bounds.sides().zip(&counts).map(along).collect(),
            values: Default::default(),
            numbers: Default::default(),
            seen: Seen::default(),
            meets_box: false,
            complex: Complex {
                dimension: counts.len(),
                spacing: spacing
                    .map(|((low, high), &count)| (high - low) / count as f64)
                    .fold(0.0, f64::max),
                ..Complex::default()
            },
            counts,
        }
    }

    /// Points along the first axis.
    fn width(&self) -> usize {
        self.counts[0] + 1
    }

    /// Moves on by a layer and evaluates F there.
    fn evaluate(&mut self, layer: usize) -> Result<(), PolygonizeError> {
        let last = self.dimension - 1;
        let points: usize = self.counts[..last].iter().map(|count| count + 1).product();
        let mut columns = vec![Vec::with_capacity(points); self.dimension];
        for point in 0..points {
            columns[0].push(self.coordinates[0][point % self.width()]);
            if self.dimension == 3 {
                columns[1].push(self.coordinates[1][point / self.width()]);
            }
            columns[last].push(self.coordinates[last][layer]);
        }
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        self.values.swap(0, 1);
        self.numbers.swap(0, 1);
        let [_, values] = &mut self.values;
        values.resize(points, 0.0);
        self.job.field.values(&columns, values);
        values
            .iter_mut()
            .for_each(|value| *value -= self.job.options.iso);
        self.seen = self.seen.and(Seen::of_values(values));
        self.numbers[1].clear();
        self.numbers[1].resize(points, NONE);
        Ok(())
    }

    /// Adds the simplices in a layer of cells.
    fn add_layer(&mut self, layer: usize) -> Result<(), PolygonizeError> {
        let rows = if self.dimension == 3 {
            self.counts[1]
        } else {
            1
        };
        for row in 0..rows {
            for column in 0..self.counts[0] {
                self.add_cell([column, row, layer]);
            }
        }
        if self.complex.simplices.len() > LIMIT {
            return Err(PolygonizeError::TooManyVertices {
                vertices: self.complex.nodes.len(),
            });
        }
        Ok(())
    }

    /// The layer of a corner of a cell, and its place there. Bit a of the corner tells whether it is
    /// at the upper end along axis a.
    fn place(&self, [column, row, _]: [usize; 3], corner: usize) -> (usize, usize) {
        let last = self.dimension - 1;
        let column = column + (corner & 1);
        let row = match self.dimension {
            3 => row + (corner >> 1 & 1),
            _ => 0,
        };
        (corner >> last & 1, row * self.width() + column)
    }

    /// Adds the simplices of a cell: those along the ways from its lowest to its highest corner
    /// (the Freudenthal triangulation).
    fn add_cell(&mut self, cell: [usize; 3]) {
        let corners = 1 << self.dimension;
        let mut inside = 0u32;
        for corner in 0..corners {
            let (layer, place) = self.place(cell, corner);
            inside |= u32::from(self.values[layer][place] < 0.0) << corner;
        }
        if inside == 0 {
            return;
        }
        let touches = |axis: usize| {
            let step = cell[if axis + 1 == self.dimension { 2 } else { axis }];
            let side = |at_end: usize| {
                (0..corners).any(|corner| corner >> axis & 1 == at_end && inside >> corner & 1 == 1)
            };
            step == 0 && side(0) || step + 1 == self.counts[axis] && side(1)
        };
        self.meets_box |= (0..self.dimension).any(touches);
        if inside == (1 << corners) - 1 {
            return;
        }
        for (order, is_even) in ORDERS {
            // In R2 the last axis is not gone along.
            if self.dimension == 2 && order[2] != 2 {
                continue;
            }
            let mut way = [0; 4];
            for step in 0..self.dimension {
                way[step + 1] = way[step] | 1 << order[step];
            }
            let ways = &way[..=self.dimension];
            let within = ways.iter().filter(|&&corner| inside >> corner & 1 == 1);
            let count = within.count();
            if count == 0 || count == ways.len() {
                continue;
            }
            let mut simplex = [NONE; 4];
            for (node, &corner) in simplex.iter_mut().zip(ways) {
                *node = self.node(cell, corner);
            }
            if !is_even {
                simplex.swap(1, 2);
            }
            self.complex.simplices.push(simplex);
        }
    }

    /// The node at a corner of a cell.
    fn node(&mut self, cell: [usize; 3], corner: usize) -> u32 {
        let (layer, place) = self.place(cell, corner);
        let known = self.numbers[layer][place];
        if known != NONE {
            return known;
        }
        let (mut point, mut freedom) = (DVec3::ZERO, DVec3::ZERO);
        for axis in 0..self.dimension {
            let step =
                cell[if axis + 1 == self.dimension { 2 } else { axis }] + (corner >> axis & 1);
            point[axis] = self.coordinates[axis][step];
            freedom[axis] = f64::from(u8::from(step != 0 && step != self.counts[axis]));
        }
        let value = self.values[layer][place];
        // Where F is not defined there is nothing to follow.
        if !value.is_finite() {
            freedom = DVec3::ZERO;
        }
        let number = self.complex.nodes.len() as u32;
        self.numbers[layer][place] = number;
        self.complex.nodes.push(point);
        self.complex.inside.push(value < 0.0);
        self.complex.freedom.push(freedom);
        number
    }
}
