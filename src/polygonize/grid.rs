//! The grid that the polygonizers lay over the box, and the evaluation of F on it in batches.
//!
//! A grid is gone through in layers, the sets of points with the same last coordinate: planes in
//! R3, rows in R2, single points in R1. For the parallel work the cells between layers are
//! divided into slabs of fixed thickness, whatever the number of threads.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use rayon::iter::{IndexedParallelIterator, IntoParallelRefIterator, ParallelIterator};

use super::PolygonizeError;
use super::edge_roots::Edge;
use super::signs::{OpenPoints, Signs};
use crate::engine::{Field, Monitor};
use crate::geometry::Bounds;

/// About how many points are given to F at a time.
const BATCH: usize = 2048;

/// Does `work` on every slab of a grid, in parallel; the results in the order of the slabs.
///
/// # Errors
///
/// `Cancelled` if the monitor says so before the last slab is done: what `work` gives then is
/// thrown away, so it may break off.
pub(super) fn for_each_slab<Piece: Send>(
    grid: &Grid,
    phase: &str,
    monitor: &dyn Monitor,
    work: impl Fn(Range<usize>) -> Piece + Sync,
) -> Result<Vec<Piece>, PolygonizeError> {
    let slabs = grid.slabs();
    let finished = AtomicUsize::new(0);
    slabs
        .par_iter()
        .with_max_len(1)
        .map(|slab| {
            if monitor.cancelled() {
                return Err(PolygonizeError::Cancelled);
            }
            let piece = work(slab.clone());
            if monitor.cancelled() {
                return Err(PolygonizeError::Cancelled);
            }
            let done = finished.fetch_add(1, Ordering::Relaxed) + 1;
            monitor.progress(phase, done as f64 / slabs.len() as f64);
            Ok(piece)
        })
        .collect()
}

/// Points of a box, equally spaced along every axis.
///
/// With a cap there is one ghost layer of points beyond every side of the box: its points count
/// as outside, yet they have the coordinates of the side itself, so that what is built between
/// them and the box lies exactly in the side.
pub(super) struct Grid {
    /// The coordinates of the points along each axis, ghosts included; ascending. Axes beyond
    /// the dimension have none.
    pub(super) coordinates: Vec<Vec<f64>>,
    /// The number of ghost layers at each side of the box: 0 or 1.
    pub(super) ghosts: usize,
    /// At which ends of each axis this is a brick of a larger grid that goes on there, rather than
    /// ending at a side of the box: there it has no ghosts.
    pub(super) goes_on: [[bool; 2]; 3],
}

/// How many grid points F was seen at, by its value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Seen {
    pub(super) inside: usize,
    pub(super) outside: usize,
    pub(super) nan: usize,
}

impl Seen {
    /// What is seen at points with these values of F − iso.
    pub(super) fn of_values(values: &[f64]) -> Self {
        let inside = values.iter().filter(|&&value| value < 0.0).count();
        let nan = values.iter().filter(|value| value.is_nan()).count();
        Seen {
            inside,
            outside: values.len() - inside - nan,
            nan,
        }
    }

    /// The sum of both.
    pub(super) fn and(self, other: Self) -> Self {
        Seen {
            inside: self.inside + other.inside,
            outside: self.outside + other.outside,
            nan: self.nan + other.nan,
        }
    }

    /// The number of points.
    pub(super) fn points(self) -> usize {
        self.inside + self.outside + self.nan
    }
}

impl Grid {
    /// The grid with this many cells along each axis of the box.
    pub(super) fn new(bounds: &Bounds, cells: &[usize], cap: bool) -> Self {
        let ghosts = usize::from(cap);
        let axis = |(side, &count): ((f64, f64), &usize)| {
            let steps = (0..=count).map(|step| coordinate(side, step, count));
            let ghost = |end| std::iter::repeat_n(end, ghosts);
            ghost(side.0).chain(steps).chain(ghost(side.1)).collect()
        };
        Grid {
            coordinates: bounds.sides().zip(cells).map(axis).collect(),
            ghosts,
            goes_on: [[false; 2]; 3],
        }
    }

    /// The part of a grid in R3 with these cells along each axis, ghosts not counted; it has the
    /// same coordinates, and ghosts only where the whole one does.
    pub(super) fn brick(&self, cells: &[Range<usize>; 3]) -> Grid {
        let mut brick = Grid {
            coordinates: Vec::with_capacity(3),
            ghosts: self.ghosts,
            goes_on: [[false; 2]; 3],
        };
        for (axis, Range { start, end }) in cells.iter().enumerate() {
            let real = self.real_coordinates(axis);
            let goes_on = [*start > 0, *end + 1 < real.len()];
            let [below, above] = goes_on.map(|goes_on| if goes_on { 0 } else { self.ghosts });
            let own = &real[*start..=*end];
            let ghost =
                |end: Option<&f64>, count| std::iter::repeat_n(end.copied(), count).flatten();
            let along = ghost(own.first(), below)
                .chain(own.iter().copied())
                .chain(ghost(own.last(), above));
            brick.coordinates.push(along.collect());
            brick.goes_on[axis] = goes_on;
        }
        brick
    }

    /// The number of ghost layers at the lower and at the upper end of an axis.
    pub(super) fn ghosts_at(&self, axis: usize) -> [usize; 2] {
        self.goes_on[axis].map(|goes_on| if goes_on { 0 } else { self.ghosts })
    }

    /// The indices of the lowest point that is not a ghost.
    pub(super) fn first_point(&self) -> [usize; 3] {
        [0, 1, 2].map(|axis| self.ghosts_at(axis)[0])
    }

    /// The number of cells, ghosts aside.
    pub(super) fn cells(&self) -> usize {
        let along = |axis| self.real_coordinates(axis).len() - 1;
        (0..self.coordinates.len()).map(along).product()
    }

    /// The number of points along an axis, ghosts included.
    pub(super) fn points(&self, axis: usize) -> usize {
        self.coordinates[axis].len()
    }

    /// Whether the point with this index along an axis is a ghost.
    pub(super) fn is_ghost(&self, axis: usize, index: usize) -> bool {
        let [below, above] = self.ghosts_at(axis);
        index < below || index + above >= self.points(axis)
    }

    /// The crossed edge along `axis` from the grid point with the indices `start`, given F − iso
    /// at both ends. It has no length if it leads to a ghost.
    pub(super) fn edge(&self, start: &[usize], axis: usize, values: [f64; 2]) -> Edge {
        let point = |step: usize| {
            let mut point = DVec3::ZERO;
            for (along, &index) in start.iter().enumerate() {
                let index = if along == axis { index + step } else { index };
                point[along] = self.coordinates[along][index];
            }
            point
        };
        let inside = if values[0] < 0.0 { 0 } else { 1 };
        Edge {
            inside: point(inside),
            axis,
            outside: point(1 - inside)[axis],
            inside_value: values[inside],
            outside_value: values[1 - inside],
        }
    }

    /// The lowest and the highest corner of the cell in R3 with the indices `start` of its lowest
    /// point.
    pub(super) fn cell(&self, start: [usize; 3]) -> [DVec3; 2] {
        [0, 1].map(|step| {
            let coordinate = |axis: usize| self.coordinates[axis][start[axis] + step];
            DVec3::from_array([0, 1, 2].map(coordinate))
        })
    }

    /// Whether a point lies in a side of the box.
    pub(super) fn is_on_side(&self, point: DVec3) -> bool {
        let mut axes = self.coordinates.iter().enumerate();
        axes.any(|(axis, along)| {
            let ends = [along.first(), along.last()]
                .into_iter()
                .zip(self.goes_on[axis]);
            ends.into_iter()
                .any(|(end, goes_on)| !goes_on && end == Some(&point[axis]))
        })
    }

    /// Whether an edge leads to a ghost.
    pub(super) fn leads_to_ghost(&self, start: &[usize], axis: usize) -> bool {
        self.is_ghost(axis, start[axis]) || self.is_ghost(axis, start[axis] + 1)
    }

    /// Whether a crossing of an edge means that the box cuts the level set: the edge lies in a
    /// side of the box or leads to a ghost.
    pub(super) fn is_cut(&self, start: &[usize], axis: usize) -> bool {
        let on_side = |(along, &index): (usize, &usize)| {
            let [goes_on_below, goes_on_above] = self.goes_on[along];
            let below = !goes_on_below && index <= self.ghosts;
            let above = !goes_on_above && index + 1 + self.ghosts >= self.points(along);
            along != axis && (below || above)
        };
        self.leads_to_ghost(start, axis) || start.iter().enumerate().any(on_side)
    }

    /// The outward normal of the box at a point of its boundary; at its edges and corners the
    /// mean of the sides' normals, so that it is one for all vertices there.
    pub(super) fn outward(&self, point: DVec3) -> DVec3 {
        let component = |axis: usize| {
            let along = &self.coordinates[axis];
            let [goes_on_below, goes_on_above] = self.goes_on[axis];
            let above = !goes_on_above && point[axis] == along[along.len() - 1];
            let below = !goes_on_below && point[axis] == along[0];
            f64::from(u8::from(above)) - f64::from(u8::from(below))
        };
        DVec3::from_array([0, 1, 2].map(component)).normalize_or_zero()
    }

    /// The coordinates along an axis without the ghosts.
    pub(super) fn real_coordinates(&self, axis: usize) -> &[f64] {
        let [below, above] = self.ghosts_at(axis);
        &self.coordinates[axis][below..self.points(axis) - above]
    }

    /// The slabs, as ranges of cells along the last axis: at least 8 cells thick except for the
    /// last one, and 33 at most in number.
    ///
    /// F is evaluated twice on the layers between two slabs, which costs at most an eighth more
    /// and saves the slabs from waiting for each other.
    fn slabs(&self) -> Vec<Range<usize>> {
        let cells = self.points(self.coordinates.len() - 1) - 1;
        let thickness = (cells / 32).max(8);
        let slab = |start: usize| start..(start + thickness).min(cells);
        (0..cells).step_by(thickness).map(slab).collect()
    }
}

/// The coordinate after `step` of `count` equal steps along a side; exact at both ends.
pub(super) fn coordinate((low, high): (f64, f64), step: usize, count: usize) -> f64 {
    let (done, left) = (step as f64, (count - step) as f64);
    match (step, count - step) {
        (0, _) => low,
        (_, 0) => high,
        // Symmetric in both ends: a box around 0 has symmetric points.
        _ => (low * left + high * done) / count as f64,
    }
}

/// F on one layer of a grid.
pub(super) struct Layer {
    /// F − iso at the layer's points that are not ghosts, the first axis fastest.
    pub(super) values: Vec<f64>,
    /// 1 where F < iso, else 0; ghosts included, the first axis fastest.
    pub(super) inside: Vec<u8>,
}

/// The evaluation of F on layer after layer of a grid in R2 or R3.
pub(super) struct Sweep<'a> {
    pub(super) field: &'a dyn Field,
    pub(super) iso: f64,
    grid: &'a Grid,
    monitor: &'a dyn Monitor,
    /// The coordinates of a batch of points. Those along the first axis are always the same.
    columns: Vec<Vec<f64>>,
    /// Points of a row (along the first axis) that are not ghosts.
    row: usize,
    /// Rows of a layer that are not ghosts.
    rows: usize,
    /// The points at which F must be evaluated, if that is not all.
    open: Option<OpenPoints<'a>>,
    evaluations: usize,
}

impl<'a> Sweep<'a> {
    /// A sweep over the grid, nothing evaluated yet.
    pub(super) fn new(
        field: &'a dyn Field,
        iso: f64,
        grid: &'a Grid,
        monitor: &'a dyn Monitor,
    ) -> Self {
        let first = grid.real_coordinates(0);
        let rows = match grid.coordinates.len() {
            3 => grid.real_coordinates(1).len(),
            _ => 1,
        };
        let length = first.len() * (BATCH / first.len()).clamp(1, rows);
        let mut columns = vec![vec![0.0; length]; grid.coordinates.len()];
        for (x, &coordinate) in columns[0].iter_mut().zip(first.iter().cycle()) {
            *x = coordinate;
        }
        let row = first.len();
        Sweep {
            field,
            iso,
            grid,
            monitor,
            columns,
            row,
            rows,
            open: None,
            evaluations: 0,
        }
    }

    /// The same sweep over a grid in R3 on which signs are known: where they are F is not
    /// evaluated, and values have no meaning.
    pub(super) fn with_signs(mut self, signs: Option<&'a Signs>) -> Self {
        self.open = signs.map(OpenPoints::new);
        self
    }

    /// The number of points at which F was evaluated.
    pub(super) fn evaluations(&self) -> usize {
        self.evaluations
    }

    /// A layer to be filled by [`Sweep::evaluate`].
    pub(super) fn layer(&self) -> Layer {
        let planar = self.grid.coordinates.len() - 1;
        Layer {
            values: vec![0.0; self.row * self.rows],
            inside: vec![0; (0..planar).map(|axis| self.grid.points(axis)).product()],
        }
    }

    /// Evaluates F on the layer with this index along the last axis; nothing more of it once the
    /// monitor wants an end.
    pub(super) fn evaluate(&mut self, index: usize, layer: &mut Layer) -> Seen {
        let last = self.grid.coordinates.len() - 1;
        if self.grid.is_ghost(last, index) {
            layer.values.fill(f64::INFINITY);
            layer.inside.fill(0);
            return Seen::default();
        }
        if let Some(open) = &mut self.open {
            let seen = open.evaluate(self.field, self.iso, (self.grid, index), layer);
            self.evaluations += open.evaluations();
            return seen;
        }
        self.columns[last].fill(self.grid.coordinates[last][index]);
        let batch = self.columns[0].len();
        for (number, values) in layer.values.chunks_mut(batch).enumerate() {
            if self.monitor.cancelled() {
                break;
            }
            if last == 2 {
                let rows = &self.grid.real_coordinates(1)[number * batch / self.row..];
                for (y, row) in rows.iter().zip(self.columns[1].chunks_mut(self.row)) {
                    row.fill(*y);
                }
            }
            let points = self.columns.iter().map(|column| &column[..values.len()]);
            self.field.values(&points.collect::<Vec<_>>(), values);
        }
        self.evaluations += layer.values.len();
        self.classify(layer)
    }

    /// Sets the flags of an evaluated layer, and turns its values to F − iso.
    fn classify(&self, layer: &mut Layer) -> Seen {
        let ghosts = self.grid.ghosts_at(0)[0];
        let stride = self.grid.points(0);
        // In R2 a layer is one row and has no ghost rows before it.
        let ghost_rows = match self.grid.coordinates.len() {
            3 => self.grid.ghosts_at(1)[0],
            _ => 0,
        };
        let rows = layer.inside.chunks_mut(stride).skip(ghost_rows);
        let mut seen = Seen::default();
        for (values, flags) in layer.values.chunks_mut(self.row).zip(rows) {
            let mut nan = 0;
            for (value, flag) in values.iter_mut().zip(&mut flags[ghosts..]) {
                *value -= self.iso;
                *flag = u8::from(*value < 0.0);
                nan += u64::from(value.is_nan());
            }
            // The ghosts beside the row have the flag 0.
            let inside: u64 = flags.iter().map(|&flag| u64::from(flag)).sum();
            seen.nan += nan as usize;
            seen.inside += inside as usize;
        }
        seen.outside = layer.values.len() - seen.inside - seen.nan;
        seen
    }

    /// F − iso at a point of an evaluated layer, by its indices along the first axis and, in R3,
    /// the second (else 0); infinite for the ghosts beside the layer.
    pub(super) fn value(&self, layer: &Layer, i: usize, j: usize) -> f64 {
        let planar = self.grid.coordinates.len() - 1;
        if self.grid.is_ghost(0, i) || planar == 2 && self.grid.is_ghost(1, j) {
            return f64::INFINITY;
        }
        let row = if planar == 2 {
            j - self.grid.ghosts_at(1)[0]
        } else {
            0
        };
        layer.values[row * self.row + i - self.grid.ghosts_at(0)[0]]
    }
}

/// Calls `visit` with every index at which two rows of flags of equal length differ, in ascending
/// order.
pub(super) fn for_each_difference(one: &[u8], other: &[u8], mut visit: impl FnMut(usize)) {
    // Rows are alike almost everywhere: flags are compared many at a time.
    const WIDTH: usize = 16;
    let (chunks, rest) = one.as_chunks::<WIDTH>();
    let (other_chunks, other_rest) = other.as_chunks::<WIDTH>();
    let mut compare = |start: usize, one: &[u8], other: &[u8]| {
        for (offset, (a, b)) in one.iter().zip(other).enumerate() {
            if a != b {
                visit(start + offset);
            }
        }
    };
    for (number, (one, other)) in chunks.iter().zip(other_chunks).enumerate() {
        if one != other {
            compare(number * WIDTH, one, other);
        }
    }
    compare(chunks.len() * WIDTH, rest, other_rest);
}
