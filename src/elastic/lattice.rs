//! The lattice of a solid: Freudenthal's triangulation of a box, restricted to F < 0 and fitted to
//! F = 0.
//!
//! Freudenthal's (or Kuhn's) triangulation divides a square into two triangles and a cube into six
//! tetrahedra, one for each order in which a path along the axes leads from the lowest corner to the
//! highest (Velho, Gomes and Terzopoulos, "Implicit manifolds, triangulations and dynamics", section 3).
//! Of it, the simplices are kept that reach into the solid by a quarter of a cell. Their nodes
//! outside, and those that are nearer to the surface than that, are moved onto the surface as far as no
//! simplex becomes flat. Where that is not far enough the boundary deviates from F = 0 by less than
//! a cell, and such nodes are counted. What is thinner than half a cell is lost, and of a sharp edge up to
//! half of the square of a cell's side.

use glam::DVec3;
use rayon::prelude::*;

use super::boundary;
use super::fitting::{self, Target};
use super::simplex::measure;
use super::{ElasticError, simplex};
use crate::engine::{Field, Monitor};
use crate::geometry::{Bounds, Curves, Mesh, Solid};

/// A node that is nearer to the surface than this part of a cell's side lies on it.
const SHALLOW: f64 = 0.25;

/// The orders of the axes, those of even sign first: their paths are positively oriented.
const ORDERS: [&[&[usize]]; 2] = [
    &[&[0, 1], &[1, 0]],
    &[
        &[0, 1, 2],
        &[1, 2, 0],
        &[2, 0, 1],
        &[0, 2, 1],
        &[1, 0, 2],
        &[2, 1, 0],
    ],
];

/// How a solid is divided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Division {
    /// The box in which the solid is; in R2 or R3, like the field.
    pub bounds: Bounds,
    /// The greatest side length of a cell. Each axis is divided into equal cells, as few as that
    /// allows.
    pub cell: f64,
    /// The greatest number of cells of the box.
    pub cell_limit: usize,
}

impl Division {
    /// Cells of a twelfth of the longest side, and at most four million.
    pub fn new(bounds: Bounds) -> Division {
        Division {
            bounds,
            cell: bounds.size().max_element() / 12.0,
            cell_limit: 1 << 22,
        }
    }
}

/// What is remarkable about a lattice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Remarks {
    /// Points at which F was evaluated.
    pub evaluations: usize,
    /// Grid points at which F is not a number; they count as outside.
    pub undefined: usize,
    /// Grid points on the faces of the box that are inside: there the box cuts the solid.
    pub cut: usize,
    /// Nodes of the boundary that could not be moved onto the surface; without those that the box cuts.
    pub off_surface: usize,
    /// Pieces that share no node.
    pub pieces: usize,
}

/// A solid as simplices: tetrahedra in R3, triangles in R2.
#[derive(Clone, Debug, PartialEq)]
pub struct Lattice {
    /// 2 or 3.
    pub dimension: usize,
    /// The nodes; each belongs to a simplex. Simplices that have only a corner in common, and no chain of
    /// neighbours around it, have nodes of their own there.
    pub nodes: Vec<DVec3>,
    /// The simplices by their nodes, positively oriented; a triangle repeats its last node.
    pub simplices: Vec<[u32; 4]>,
    /// The edges, each once, the lesser node first; in ascending order.
    pub springs: Vec<[u32; 2]>,
    /// The faces that belong to one simplex alone, outward: triangles counter-clockwise seen from
    /// outside, edges (which repeat their last node) with the solid on their left.
    pub boundary: Vec<[u32; 3]>,
    /// What is remarkable.
    pub remarks: Remarks,
}

impl Lattice {
    /// The lattice of the solid F < 0 in a box.
    ///
    /// The cost is linear in the cells of the box; F is evaluated in batches, a layer of the box at a
    /// time. The result does not depend on the number of threads.
    ///
    /// # Errors
    ///
    /// A field that is not in R2 or R3, or not of the box's dimension; a cell that makes no sense or makes
    /// too many; a box without anything of the solid, or with nothing else, or with too little for the
    /// cells; and cancellation.
    pub fn new(
        field: &dyn Field,
        division: &Division,
        monitor: &dyn Monitor,
    ) -> Result<Lattice, ElasticError> {
        let grid = Grid::new(field, division)?;
        let values = grid.evaluate(field, monitor)?;
        let undefined = values.iter().filter(|value| value.is_nan()).count();
        let inside = values.iter().filter(|&&value| value < 0.0).count();
        if inside == 0 || inside == values.len() {
            let points = values.len();
            return Err(match inside {
                0 => ElasticError::Empty { points, undefined },
                _ => ElasticError::Full { points },
            });
        }
        let mut restriction = Restriction::new(&grid, values);
        let shallow = restriction.find_shallow(field);
        let kept = restriction.simplices();
        if kept.is_empty() {
            return Err(ElasticError::Thin { cell: grid.least() });
        }
        if monitor.cancelled() {
            return Err(ElasticError::Cancelled);
        }
        let (nodes, simplices) = compact(&kept, restriction.values.len());
        let targets = restriction.targets(field, &nodes, &shallow);
        let places: Vec<DVec3> = nodes.iter().map(|&node| grid.point(node)).collect();
        let fitted = fitting::fit(grid.dimension, places, &targets, &simplices);
        let off_node = fitted.off;
        let (nodes, simplices, origins) =
            boundary::separate(grid.dimension, fitted.nodes, simplices);
        let faces = boundary::faces(grid.dimension, &simplices);
        let mut is_boundary = vec![false; nodes.len()];
        for &node in faces.iter().flatten() {
            is_boundary[node as usize] = true;
        }
        let off_surface = (0..nodes.len())
            .filter(|&node| is_boundary[node] && off_node[origins[node] as usize])
            .count();
        let remarks = Remarks {
            evaluations: restriction.values.len() + restriction.evaluations,
            undefined,
            cut: restriction.cut(),
            off_surface,
            pieces: boundary::pieces(nodes.len(), &simplices),
        };
        Ok(Lattice {
            dimension: grid.dimension,
            springs: boundary::edges(grid.dimension, &simplices),
            nodes,
            simplices,
            boundary: faces,
            remarks,
        })
    }

    /// The volume of the simplices together; in R2 their area.
    pub fn volume(&self) -> f64 {
        let measures = self.simplices.iter().map(|&simplex| {
            let corners = simplex.map(|node| self.nodes[node as usize]);
            measure(self.dimension, corners)
        });
        measures.sum()
    }

    /// The Euler characteristic: 1 for a ball, 0 for a solid ring.
    ///
    /// Every face of a simplex is one of two, or of the boundary.
    pub fn euler_characteristic(&self) -> i64 {
        let [nodes, edges, simplices, outer] = [
            self.nodes.len(),
            self.springs.len(),
            self.simplices.len(),
            self.boundary.len(),
        ]
        .map(|count| count as i64);
        match self.dimension {
            2 => nodes - edges + simplices,
            _ => nodes - edges + (4 * simplices + outer) / 2 - simplices,
        }
    }

    /// The simplices alone.
    pub fn solid(&self) -> Solid {
        Solid {
            dimension: self.dimension,
            nodes: self.nodes.clone(),
            simplices: self.simplices.clone(),
        }
    }

    /// The least quality of a simplex: see [`simplex::quality`].
    pub fn least_quality(&self) -> f64 {
        let qualities = self.simplices.iter().map(|&simplex| {
            let corners = simplex.map(|node| self.nodes[node as usize]);
            simplex::quality(self.dimension, corners)
        });
        qualities.fold(f64::INFINITY, f64::min)
    }

    /// The boundary as a mesh with normals; in R2 one without triangles.
    pub fn mesh(&self) -> Mesh {
        self.skin().mesh(&self.nodes)
    }

    /// The boundary as curves; in R3 none.
    pub fn curves(&self) -> Curves {
        self.skin().curves(&self.nodes)
    }

    /// The boundary without places.
    pub(super) fn skin(&self) -> boundary::Skin {
        boundary::Skin::new(self.dimension, &self.boundary)
    }
}

/// The points of a box, equally spaced along each axis, the first axis fastest.
struct Grid {
    dimension: usize,
    bounds: Bounds,
    /// Cells along each axis; none beyond the dimension.
    cells: [usize; 3],
    /// How far apart neighbours along an axis are in the list of points.
    strides: [usize; 3],
}

impl Grid {
    fn new(field: &dyn Field, division: &Division) -> Result<Grid, ElasticError> {
        let (bounds, cell) = (division.bounds, division.cell);
        let dimension = field.dimension();
        if !(2..=3).contains(&dimension) || bounds.dimension != dimension {
            return Err(ElasticError::Dimension {
                field: dimension,
                bounds: bounds.dimension,
            });
        }
        let side = bounds
            .sides()
            .map(|(low, high)| high - low)
            .fold(f64::INFINITY, f64::min);
        if !(cell > 0.0 && cell <= side) {
            return Err(ElasticError::Cell { cell, side });
        }
        // A quotient that exceeds an integer by no more than rounding needs no further cell.
        let counts = bounds
            .sides()
            .map(|(low, high)| ((high - low) / cell * (1.0 - 1e-12)).ceil().max(1.0));
        let counts: Vec<f64> = counts.collect();
        let needed: f64 = counts.iter().product();
        // Nodes have numbers of 32 bits, and a cube has six simplices of four corners.
        let limit = division.cell_limit.min(1 << 27);
        if needed > limit as f64 {
            return Err(ElasticError::TooManyCells { needed, limit });
        }
        let mut cells = [0; 3];
        let mut strides = [0; 3];
        let mut stride = 1;
        for (axis, count) in counts.into_iter().enumerate() {
            cells[axis] = count as usize;
            strides[axis] = stride;
            stride *= cells[axis] + 1;
        }
        Ok(Grid {
            dimension,
            bounds,
            cells,
            strides,
        })
    }

    /// The number of points.
    fn len(&self) -> usize {
        self.cells.iter().map(|count| count + 1).product()
    }

    /// Where a point is along each axis.
    fn steps(&self, index: usize) -> [usize; 3] {
        let mut rest = index;
        self.cells.map(|count| {
            let step = rest % (count + 1);
            rest /= count + 1;
            step
        })
    }

    fn point(&self, index: usize) -> DVec3 {
        let steps = self.steps(index);
        let mut point = DVec3::ZERO;
        for (axis, (low, high)) in self.bounds.sides().enumerate() {
            let (done, count) = (steps[axis] as f64, self.cells[axis] as f64);
            // Symmetric in both ends: a box around 0 has symmetric points.
            point[axis] = (low * (count - done) + high * done) / count;
        }
        point
    }

    /// The shortest side of a cell.
    fn least(&self) -> f64 {
        let sides = (0..self.dimension).map(|axis| self.side(axis));
        sides.fold(f64::INFINITY, f64::min)
    }

    fn side(&self, axis: usize) -> f64 {
        self.bounds.size()[axis] / self.cells[axis] as f64
    }

    /// The diagonal of a cell.
    fn diagonal(&self) -> f64 {
        let squares = (0..self.dimension).map(|axis| self.side(axis) * self.side(axis));
        squares.sum::<f64>().sqrt()
    }

    /// F at all points.
    fn evaluate(&self, field: &dyn Field, monitor: &dyn Monitor) -> Result<Vec<f64>, ElasticError> {
        let layer = self.strides[self.dimension - 1];
        let mut values = vec![0.0; self.len()];
        values
            .par_chunks_mut(layer)
            .enumerate()
            .try_for_each(|(number, values)| {
                if monitor.cancelled() {
                    return Err(ElasticError::Cancelled);
                }
                let points = (0..layer).map(|place| self.point(number * layer + place));
                let mut columns = [const { Vec::new() }; 3];
                for point in points {
                    for (axis, column) in columns.iter_mut().enumerate().take(self.dimension) {
                        column.push(point[axis]);
                    }
                }
                let columns = columns.each_ref().map(Vec::as_slice);
                field.values(&columns[..self.dimension], values);
                Ok(())
            })?;
        Ok(values)
    }
}

/// The part of the grid that belongs to the solid.
struct Restriction<'a> {
    grid: &'a Grid,
    /// F at each grid point.
    values: Vec<f64>,
    /// Whether the point is inside, and by a quarter of a cell.
    deep: Vec<bool>,
    /// Points at which F was evaluated besides those of the grid.
    evaluations: usize,
}

impl<'a> Restriction<'a> {
    fn new(grid: &'a Grid, values: Vec<f64>) -> Restriction<'a> {
        Restriction {
            grid,
            deep: values.iter().map(|&value| value < 0.0).collect(),
            values,
            evaluations: 0,
        }
    }

    /// Grid points on the faces of the box that are inside.
    fn cut(&self) -> usize {
        let on_face = |index: usize| {
            let steps = self.grid.steps(index);
            (0..self.grid.dimension).any(|axis| [0, self.grid.cells[axis]].contains(&steps[axis]))
        };
        let inside = (0..self.values.len()).filter(|&index| self.values[index] < 0.0);
        inside.filter(|&index| on_face(index)).count()
    }

    /// The points that an edge of the triangulation joins to this one: all steps of 0 or 1 along the axes,
    /// and their opposites.
    fn neighbours(&self, index: usize) -> impl Iterator<Item = usize> + '_ {
        let (steps, dimension) = (self.grid.steps(index), self.grid.dimension);
        let ways = (1..1_usize << dimension).flat_map(|way| [(way, true), (way, false)]);
        ways.filter_map(move |(way, upward)| {
            let mut neighbour = index;
            for (axis, &step) in steps.iter().enumerate().take(dimension) {
                if way >> axis & 1 == 1 {
                    let stride = self.grid.strides[axis];
                    neighbour = match upward {
                        true if step < self.grid.cells[axis] => neighbour + stride,
                        false if step > 0 => neighbour - stride,
                        _ => return None,
                    };
                }
            }
            Some(neighbour)
        })
    }

    /// The points inside that are near enough to the surface to be moved there, ascending, with the places
    /// for them. They are no longer deep.
    fn find_shallow(&mut self, field: &dyn Field) -> Vec<(usize, DVec3)> {
        let next_to_surface = |&index: &usize| {
            self.deep[index]
                && self
                    .neighbours(index)
                    .any(|neighbour| !self.deep[neighbour])
        };
        let candidates: Vec<usize> = (0..self.values.len())
            .into_par_iter()
            .filter(next_to_surface)
            .collect();
        let reach = SHALLOW * self.grid.least();
        let places: Vec<DVec3> = candidates.iter().map(|&at| self.grid.point(at)).collect();
        let (feet, evaluations) = fitting::feet(field, &places, reach);
        self.evaluations += evaluations;
        let shallow: Vec<(usize, DVec3)> = candidates
            .into_iter()
            .zip(feet)
            .filter_map(|(index, foot)| Some((index, foot?)))
            .collect();
        for &(index, _) in &shallow {
            self.deep[index] = false;
        }
        shallow
    }

    /// The simplices with a deep corner, by grid points.
    fn simplices(&self) -> Vec<[usize; 4]> {
        let grid = self.grid;
        let orders = ORDERS[grid.dimension - 2];
        let mut kept = Vec::new();
        let first = self.deep.iter().position(|&deep| deep).unwrap_or(0);
        // The cell whose lowest corner comes before the first deep point by more than a diagonal has none.
        let diagonal: usize = grid.strides.iter().sum();
        for index in first.saturating_sub(diagonal)..self.values.len() {
            let steps = grid.steps(index);
            if (0..grid.dimension).any(|axis| steps[axis] == grid.cells[axis]) {
                continue;
            }
            for (number, order) in orders.iter().enumerate() {
                let mut corners = [index; 4];
                let mut corner = index;
                for (place, &axis) in order.iter().enumerate() {
                    corner += grid.strides[axis];
                    corners[place + 1..].fill(corner);
                }
                if corners.iter().any(|&corner| self.deep[corner]) {
                    if 2 * number >= orders.len() {
                        corners.swap(0, 1);
                    }
                    kept.push(corners);
                }
            }
        }
        kept
    }

    /// Where the nodes belong, which are given by their grid points, ascending.
    fn targets(
        &mut self,
        field: &dyn Field,
        nodes: &[usize],
        shallow: &[(usize, DVec3)],
    ) -> Vec<Target> {
        let is_outside = |index: &usize| self.values[*index].is_nan() || self.values[*index] >= 0.0;
        let outside: Vec<usize> = nodes.iter().copied().filter(is_outside).collect();
        let places: Vec<DVec3> = outside.iter().map(|&at| self.grid.point(at)).collect();
        let (feet, mut evaluations) = fitting::feet(field, &places, self.grid.diagonal());
        let mut feet = outside.iter().zip(places).zip(feet);
        let mut shallow = shallow.iter().peekable();
        let mut targets = Vec::with_capacity(nodes.len());
        for &node in nodes {
            while shallow.next_if(|&&(index, _)| index < node).is_some() {}
            let target = if self.deep[node] {
                Target::Here
            } else if let Some(&(_, place)) = shallow.next_if(|&&(index, _)| index == node) {
                Target::Surface(place)
            } else if let Some(((_, place), foot)) = feet.next() {
                match foot {
                    Some(foot) => Target::Surface(foot),
                    None => {
                        evaluations += fitting::HALVINGS;
                        Target::Surface(fitting::crossing(field, self.deepest(node), place))
                    }
                }
            } else {
                Target::Here
            };
            targets.push(target);
        }
        self.evaluations += evaluations;
        targets
    }

    /// The neighbour of a point outside that is deepest inside.
    fn deepest(&self, index: usize) -> DVec3 {
        let deep = self
            .neighbours(index)
            .filter(|&neighbour| self.deep[neighbour]);
        let deepest = deep.min_by(|&a, &b| self.values[a].total_cmp(&self.values[b]));
        self.grid.point(deepest.unwrap_or(index))
    }
}

/// The grid points that occur, ascending, and the simplices by their places in that list.
fn compact(kept: &[[usize; 4]], points: usize) -> (Vec<usize>, Vec<[u32; 4]>) {
    let mut numbers = vec![u32::MAX; points];
    for &corner in kept.iter().flatten() {
        numbers[corner] = 0;
    }
    let used: Vec<usize> = (0..points).filter(|&point| numbers[point] == 0).collect();
    for (number, &point) in used.iter().enumerate() {
        numbers[point] = number as u32;
    }
    let simplices = kept
        .iter()
        .map(|simplex| simplex.map(|corner| numbers[corner]))
        .collect();
    (used, simplices)
}
