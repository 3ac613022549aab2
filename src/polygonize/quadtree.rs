//! An adaptive quadtree in R2: small cells where the curve bends or where it is not yet clear how it
//! runs, none where enclosures show that there is no curve.
//!
//! The box is divided into equal cells, and each of them into quarters until it is decided: 0 is not
//! in the enclosure F(B), or the enclosure of F_x is so narrow that no two of its vectors are at a
//! right angle (0 ∉ ⟨F_x(B), F_x(B)⟩, the test of Plantinga and Vegter, "Isotopic approximation of
//! implicit curves and surfaces", 2004), so that no closed curve is inside, and F along sides of the
//! box is monotonous; then until the straight segments are near enough to the curve.
//!
//! There are no cracks: a cell's border is made of the shortest edges that it shares with its
//! neighbours, of whatever size these are, and vertices are the roots on them.

use std::collections::{HashMap, HashSet};

use glam::DVec3;

use super::edge_roots::{self, Edge};
use super::grid::{Seen, coordinate};
use super::squares::join;
use super::{Found, Job, PolygonizeError, Shape, Statistics, border, uniform_grid};
use crate::engine::CompiledField;
use crate::geometry::{Curves, Polyline};
use crate::graph::Interval;
use crate::graph::interval::{Enclosure, Regularity};

/// How often a cell is quartered at most.
const DEEPEST: u32 = 8;

/// No cells are quartered beyond so many, as where enclosures are wide in a whole region.
const MOST_CELLS: usize = 1 << 21;

/// What F is before it is enclosed.
const UNKNOWN: Enclosure = Enclosure {
    range: Interval::ENTIRE,
    regularity: Regularity::Partial,
};

/// A place in the lattice of the smallest cells.
type Place = [u32; 2];

/// A cell: its lower left corner, its side, and whether enclosures decide about it.
#[derive(Clone, Copy)]
struct Cell {
    low: Place,
    side: u32,
    clear: bool,
}

/// What is known of a cell.
enum Verdict {
    /// It has no curve.
    Empty,
    /// Its curves are what the signs on its border say.
    Clear,
    /// Nothing.
    Open,
}

/// The level set in R2.
pub(super) fn find(job: &Job) -> Result<Found, PolygonizeError> {
    let grid = uniform_grid(job.options)?;
    let bounds = job.options.bounds;
    let ghosts = 2 * grid.ghosts;
    let roots = [0, 1].map(|axis| grid.points(axis) - 1 - ghosts);
    // Places are numbers of 32 bits.
    let limit = (u32::MAX >> DEEPEST) as usize;
    if let Some(&many) = roots.iter().find(|&&count| count > limit) {
        let needed = many as f64;
        return Err(PolygonizeError::TooManyCells { needed, limit });
    }
    let mut tree = Tree {
        job,
        counts: roots.map(|count| count << DEEPEST),
        values: HashMap::new(),
        evaluations: 0,
    };
    let leaves = tree.grow(roots)?;
    let (polylines, found) = tree.contour(&leaves);
    let is_inside = tree.value([0, 0]) < 0.0;
    let polylines = match job.options.cap {
        true => border::closed(polylines, &bounds, is_inside),
        false => polylines,
    };
    let mut seen = Seen::default();
    for corner in leaves.iter().map(|leaf| leaf.low) {
        seen = seen.and(Seen::of_values(&[tree.value(corner)]));
    }
    let undecided = leaves.iter().filter(|leaf| !leaf.clear).count();
    let statistics = Statistics {
        cells: leaves.len(),
        evaluations: tree.evaluations + found.evaluations,
        nan_points: seen.nan,
        undecided,
        proven: job.field.compiled().is_some() && undecided == 0,
        ..found
    };
    let curves = Curves {
        dimension: 2,
        polylines,
    };
    Ok((Shape::Curves(curves), seen, statistics))
}

/// The tree, with F − iso at the lattice points that were asked for.
struct Tree<'a> {
    job: &'a Job<'a>,
    /// The smallest cells along each axis.
    counts: [usize; 2],
    values: HashMap<Place, f64>,
    evaluations: usize,
}

impl Tree<'_> {
    fn position(&self, place: Place) -> DVec3 {
        let mut position = DVec3::ZERO;
        for (axis, side) in self.job.options.bounds.sides().enumerate().take(2) {
            position[axis] = coordinate(side, place[axis] as usize, self.counts[axis]);
        }
        position
    }

    /// F − iso at a place that was asked for.
    fn value(&self, place: Place) -> f64 {
        self.values.get(&place).copied().unwrap_or(f64::NAN)
    }

    /// Asks for F at places at which it is not known.
    fn evaluate(&mut self, places: impl Iterator<Item = Place>) {
        let mut new: Vec<Place> = places
            .filter(|place| !self.values.contains_key(place))
            .collect();
        new.sort_unstable();
        new.dedup();
        let points: Vec<DVec3> = new.iter().map(|&place| self.position(place)).collect();
        let columns = [0, 1].map(|axis| points.iter().map(|point| point[axis]).collect());
        let [x, y]: [Vec<f64>; 2] = columns;
        let mut values = vec![0.0; new.len()];
        self.job.field.values(&[&x, &y], &mut values);
        self.evaluations += new.len();
        for (place, value) in new.into_iter().zip(values) {
            self.values.insert(place, value - self.job.options.iso);
        }
    }

    /// Quarters cells until all are decided and near enough to the curve; the leaves.
    fn grow(&mut self, roots: [usize; 2]) -> Result<Vec<Cell>, PolygonizeError> {
        let side = 1 << DEEPEST;
        let mut open: Vec<Cell> = (0..roots[1] as u32)
            .flat_map(|y| (0..roots[0] as u32).map(move |x| [x, y]))
            .map(|[x, y]| Cell {
                low: [x * side, y * side],
                side,
                clear: false,
            })
            .collect();
        let mut leaves = Vec::new();
        for depth in 0..=DEEPEST {
            if self.job.monitor.cancelled() {
                return Err(PolygonizeError::Cancelled);
            }
            let needed = (leaves.len() + open.len()) as f64;
            let limit = self.job.options.cell_limit;
            if needed > limit as f64 {
                return Err(PolygonizeError::TooManyCells { needed, limit });
            }
            let verdicts = self.verdicts(&open);
            self.evaluate(open.iter().flat_map(Cell::corners));
            let possible = open.iter().zip(&verdicts);
            let possible = possible.filter(|(_, verdict)| !matches!(verdict, Verdict::Empty));
            if depth < DEEPEST {
                let inner: Vec<Place> = possible.flat_map(|(cell, _)| cell.middles()).collect();
                self.evaluate(inner.into_iter());
            }
            let mut quartered = Vec::new();
            for (cell, verdict) in open.iter().zip(verdicts) {
                let clear = !matches!(verdict, Verdict::Open);
                let settled = match verdict {
                    Verdict::Empty => true,
                    Verdict::Clear => self.is_near(cell),
                    Verdict::Open => self.job.field.compiled().is_none() && self.is_near(cell),
                };
                if settled || depth == DEEPEST {
                    leaves.push(Cell { clear, ..*cell });
                } else {
                    quartered.push(Cell { clear, ..*cell });
                }
            }
            if leaves.len() + 4 * quartered.len() > MOST_CELLS {
                leaves.append(&mut quartered);
            }
            open = quartered.iter().flat_map(Cell::quarters).collect();
            let part = f64::from(depth + 1) / f64::from(DEEPEST + 1);
            self.job.monitor.progress("quadtree", part);
        }
        Ok(leaves)
    }

    /// What enclosures say of cells; nothing where there are none.
    fn verdicts(&mut self, cells: &[Cell]) -> Vec<Verdict> {
        let Some(field) = self.job.field.compiled() else {
            return cells.iter().map(|_| Verdict::Open).collect();
        };
        let boxes: Vec<[Interval; 2]> = cells.iter().map(|cell| self.sides(cell)).collect();
        let known = self.enclose(field, &boxes);
        let mut verdicts: Vec<Verdict> = known.iter().map(Known::verdict).collect();
        // Along the sides of the box F must be monotonous, lest a curve leave and come back unseen.
        let mut owners = Vec::new();
        let mut edges = Vec::new();
        for (index, cell) in cells.iter().enumerate() {
            if !matches!(verdicts[index], Verdict::Clear) {
                continue;
            }
            for axis in 0..2 {
                let end = self.counts[axis] as u32;
                let [low, high] = [cell.low[axis], cell.low[axis] + cell.side];
                for face in [low, high] {
                    if face == 0 || face == end {
                        let mut edge = boxes[index];
                        let at = coordinate_of(self.job, axis, face, end);
                        edge[axis] = Interval::point(at);
                        owners.push((index, 1 - axis));
                        edges.push(edge);
                    }
                }
            }
        }
        for ((index, along), known) in owners.into_iter().zip(self.enclose(field, &edges)) {
            if known.value.range.contains(0.0) && known.slopes[along].contains(0.0) {
                verdicts[index] = Verdict::Open;
            }
        }
        verdicts
    }

    fn enclose(&mut self, field: &CompiledField, boxes: &[[Interval; 2]]) -> Vec<Known> {
        let columns = [0, 1].map(|axis| boxes.iter().map(|sides| sides[axis]).collect());
        let [x, y]: [Vec<Interval>; 2] = columns;
        let mut values = vec![UNKNOWN; boxes.len()];
        let mut slopes = [(); 2].map(|()| vec![Interval::ENTIRE; boxes.len()]);
        let [along_x, along_y] = &mut slopes;
        field.enclose_gradients(&[&x, &y], &mut values, &mut [along_x, along_y]);
        self.evaluations += boxes.len();
        let iso = Interval::point(self.job.options.iso);
        let known = |index: usize| {
            let Enclosure { range, regularity } = values[index];
            Known {
                value: Enclosure {
                    range: range - iso,
                    regularity,
                },
                slopes: [slopes[0][index], slopes[1][index]],
            }
        };
        (0..boxes.len()).map(known).collect()
    }

    fn sides(&self, cell: &Cell) -> [Interval; 2] {
        let [low, _, high, _] = cell.corners().map(|corner| self.position(corner));
        [0, 1].map(|axis| Interval::new(low[axis], high[axis]))
    }

    /// Whether straight segments in the cell are near enough to the curve: how far F in the middles
    /// of sides and diagonals is from the mean of both ends, over the slope. Always, if the
    /// corners are on one side.
    fn is_near(&self, cell: &Cell) -> bool {
        let corners = cell.corners().map(|corner| self.value(corner));
        let inside = corners.map(|value| value < 0.0);
        let changes = (0..4)
            .filter(|&at| inside[at] != inside[(at + 1) % 4])
            .count();
        let middles = cell.middles().map(|place| self.value(place));
        let size = self.sides(cell).map(|side| side.high - side.low);
        let [a, b, c, d] = corners;
        let slope = [
            0.5 * (b - a + c - d) / size[0],
            0.5 * (c - b + d - a) / size[1],
        ];
        let steepness = (slope[0] * slope[0] + slope[1] * slope[1]).sqrt();
        let ends = [(a, b), (b, c), (c, d), (d, a), (a, c), (b, d)];
        let bends = ends
            .iter()
            .enumerate()
            .map(|(at, (one, other))| (middles[at.min(4)] - 0.5 * (one + other)).abs());
        let bend = bends.fold(0.0, f64::max);
        let seen = middles.iter().any(|middle| (*middle < 0.0) != inside[0]);
        match changes {
            0 => !seen,
            // Where F is not a number nothing is gained by smaller cells.
            2 => steepness.is_nan() || bend <= self.job.options.error() * steepness,
            _ => false,
        }
    }

    /// The polylines of the leaves, and the statistics of their vertices.
    fn contour(&mut self, leaves: &[Cell]) -> (Vec<Polyline>, Statistics) {
        let corners: HashSet<Place> = leaves.iter().flat_map(Cell::corners).collect();
        let mut numbers: HashMap<[Place; 2], usize> = HashMap::new();
        let mut edges: Vec<Edge> = Vec::new();
        let mut segments: Vec<[usize; 2]> = Vec::new();
        let mut cut_by_box = false;
        for leaf in leaves {
            let around = leaf.border(&corners);
            let count = around.len();
            let inside: Vec<bool> = around.iter().map(|&at| self.value(at) < 0.0).collect();
            let mut vertex = |from: usize| {
                let mut ends = [around[from % count], around[(from + 1) % count]];
                ends.sort_unstable();
                *numbers.entry(ends).or_insert_with(|| {
                    cut_by_box |= self.is_on_border(ends);
                    edges.push(self.edge(ends));
                    edges.len() - 1
                })
            };
            for entry in 0..count {
                // As in marching squares, every run of points inside is cut off by one segment.
                if inside[entry] || !inside[(entry + 1) % count] {
                    continue;
                }
                let exit = (entry + 1..entry + count).find(|exit| !inside[(exit + 1) % count]);
                if let Some(exit) = exit {
                    segments.push([vertex(exit), vertex(entry)]);
                }
            }
        }
        let job = self.job;
        let (roots, evaluations) =
            edge_roots::solve(&mut { job.field }, job.accuracy, &edges, job.monitor);
        let positions: Vec<DVec3> = roots.iter().map(|root| root.position).collect();
        let statistics = Statistics {
            evaluations,
            cut_by_box,
            ..Statistics::of_roots(&roots)
        };
        (join(&positions, &segments), statistics)
    }

    /// Whether an edge lies in a side of the box.
    fn is_on_border(&self, ends: [Place; 2]) -> bool {
        (0..2).any(|axis| {
            let [one, other] = ends.map(|end| end[axis] as usize);
            one == other && (one == 0 || one == self.counts[axis])
        })
    }

    fn edge(&self, ends: [Place; 2]) -> Edge {
        let axis = usize::from(ends[0][0] == ends[1][0]);
        let values = ends.map(|end| self.value(end));
        let inside = if values[0] < 0.0 { 0 } else { 1 };
        Edge {
            inside: self.position(ends[inside]),
            axis,
            outside: self.position(ends[1 - inside])[axis],
            inside_value: values[inside],
            outside_value: values[1 - inside],
        }
    }
}

/// The coordinate of a face of the lattice.
fn coordinate_of(job: &Job, axis: usize, face: u32, count: u32) -> f64 {
    let bounds = &job.options.bounds;
    let side = (bounds.min[axis], bounds.max[axis]);
    coordinate(side, face as usize, count as usize)
}

/// What encloses F − iso and F_x on a box.
struct Known {
    value: Enclosure,
    slopes: [Interval; 2],
}

impl Known {
    fn verdict(&self) -> Verdict {
        let Enclosure { range, regularity } = self.value;
        // What is not a number counts as outside, and so does 0, which products miss by rounding.
        if range.is_empty() || range.low >= -f64::MIN_POSITIVE {
            return Verdict::Empty;
        }
        if !range.contains(0.0) && regularity != Regularity::Partial {
            return Verdict::Empty;
        }
        let [x, y] = self.slopes;
        let product = x * x + y * y;
        match regularity == Regularity::Continuous && product.low > 0.0 {
            true => Verdict::Clear,
            false => Verdict::Open,
        }
    }
}

impl Cell {
    /// Counter-clockwise from the lower left.
    fn corners(&self) -> [Place; 4] {
        let ([x, y], side) = (self.low, self.side);
        [[x, y], [x + side, y], [x + side, y + side], [x, y + side]]
    }

    /// The middles of the sides, counter-clockwise from the lower one, and that of the cell; the
    /// corner itself in the smallest cells, which have none.
    fn middles(&self) -> [Place; 5] {
        let ([x, y], side) = (self.low, self.side);
        let half = side / 2;
        [
            [x + half, y],
            [x + side, y + half],
            [x + half, y + side],
            [x, y + half],
            [x + half, y + half],
        ]
    }

    fn quarters(&self) -> [Cell; 4] {
        let half = self.side / 2;
        let [x, y] = self.low;
        [[x, y], [x + half, y], [x, y + half], [x + half, y + half]].map(|low| Cell {
            low,
            side: half,
            clear: false,
        })
    }

    /// The points on the border at which edges of this cell or of neighbours end, counter-clockwise.
    fn border(&self, corners: &HashSet<Place>) -> Vec<Place> {
        let own = self.corners();
        let mut around = Vec::with_capacity(8);
        for at in 0..4 {
            around.push(own[at]);
            between(own[at], own[(at + 1) % 4], corners, &mut around);
        }
        around
    }
}

/// The corners of smaller cells between two points of a side, in order.
fn between(from: Place, to: Place, corners: &HashSet<Place>, points: &mut Vec<Place>) {
    let length = from[0].abs_diff(to[0]).max(from[1].abs_diff(to[1]));
    let middle = [0, 1].map(|axis| u32::midpoint(from[axis], to[axis]));
    if length > 1 && corners.contains(&middle) {
        between(from, middle, corners, points);
        points.push(middle);
        between(middle, to, corners, points);
    }
}
