//! A cover of the zero set: cells with a point each, which together prove that no component is
//! missed.
//!
//! The box is split into cells. A cell whose enclosure excludes 0 is empty. In the others the part
//! of the zero set that a cell holds is shown to be connected, and a point of it is found:
//!
//! * *Monotone.* If every ∂F/∂x_i has one sign in the cell (it may vanish), then {F ≤ 0} and
//!   {F ≥ 0} are connected, because from every point a way leads to one corner, and they fill the
//!   cell. A box is unicoherent, so what they share is connected too.
//! * *Tube.* The cell is stretched along an axis until F has one sign on its lower and the other on
//!   its upper face. If ∂F along the axis has one sign in all of it (it may vanish, as at the
//!   edges of boxes), every point of {F ≤ 0} is connected with one face and every point of
//!   {F ≥ 0} with the other; so what they share is connected, as before.
//!
//! Cells for which neither holds are split, down to a depth at which a component could only be as
//! small as what is left of them: near singular points, that is tiny. Every zero in the box then
//! lies in an empty cell (it does not), in one that is covered, and so is connected with its point,
//! or in one of those that are left.
//!
//! The enclosures hold F as a function of real numbers. The cost is some thousand enclosures of F
//! and F_x on a smooth surface, and never more than the budget.

use glam::DVec3;
use rayon::prelude::*;

use super::evaluation::{Batch, Evaluation};
use crate::engine::{CompiledField, Field, Monitor};
use crate::geometry::Bounds;
use crate::graph::Interval;
use crate::graph::interval::{Enclosure, Regularity};

/// Cells along the longest side of the box to begin with.
const FIRST: f64 = 16.0;

/// Cells are never halved more often than this: what is left is 10⁻⁹ of the box.
const DEEPEST: u32 = 26;

/// The most operations on intervals: a second's work or so.
const WORK: u64 = 1 << 29;

/// The fewest and the most cells that are looked at, whatever the field costs.
const CELLS: (u64, u64) = (1 << 13, 1 << 18);

/// Cells in a task, and in a call of the field.
const CHUNK: usize = 128;

/// The tube is made longer than the tangent plane asks for, because the surface is curved.
const STRETCH: f64 = 1.25;

/// A tube longer than so many cells is not tried: smaller cells are better.
const LONGEST: f64 = 6.0;

/// Halvings that bring a root on a segment to a part of 10⁻⁴ of it; Newton does the rest.
const HALVINGS: u32 = 14;

/// What is known of the zero set in a box.
#[derive(Clone, Debug, Default)]
pub(super) struct Cover {
    /// Close to the zero set: in each cell that is covered, on its part of it.
    pub(super) points: Vec<DVec3>,
    /// Cells of which nothing could be shown.
    pub(super) left: Vec<Cell>,
    /// Evaluations of F and F_x, and enclosures.
    pub(super) evaluations: u64,
}

impl Cover {
    /// The largest diagonal of a cell that is left: a component of the zero set without a point
    /// is smaller, unless cells that are left touch each other. 0 if there is none.
    pub(super) fn largest_left(&self) -> f64 {
        let diagonals = self.left.iter().map(|cell| (cell.high - cell.low).length());
        diagonals.fold(0.0, f64::max)
    }
}

/// A cell of the box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    pub(super) low: DVec3,
    pub(super) high: DVec3,
}

/// What becomes of a cell.
enum Verdict {
    Empty,
    /// A segment with ends of different sign.
    Covered(DVec3, DVec3),
    Unknown,
}

/// Covers the zero set in the box. `None` if the monitor cancelled.
pub(super) fn cover(
    field: &CompiledField,
    bounds: &Bounds,
    monitor: &dyn Monitor,
) -> Option<Cover> {
    let operations = field.program().size() as u64 + 1;
    let budget = (WORK / operations).clamp(CELLS.0, CELLS.1);
    let mut cover = Cover::default();
    let mut segments = Vec::new();
    let mut cells = first_cells(bounds);
    let mut seen = 0;
    for depth in 0..=DEEPEST {
        if cells.is_empty() {
            break;
        }
        if monitor.cancelled() {
            return None;
        }
        monitor.progress("cover", f64::from(depth) / f64::from(DEEPEST));
        seen += cells.len() as u64;
        let verdicts: Vec<Verdict> = cells
            .par_chunks(CHUNK)
            .flat_map_iter(|chunk| judge(field, bounds, chunk))
            .collect();
        let mut unknown = Vec::new();
        for (cell, verdict) in cells.iter().zip(verdicts) {
            match verdict {
                Verdict::Empty => {}
                Verdict::Covered(from, to) => segments.push((from, to)),
                Verdict::Unknown => unknown.push(*cell),
            }
        }
        let parts = 1_u64 << bounds.dimension;
        if depth == DEEPEST || seen + parts * unknown.len() as u64 > budget {
            cover.left = unknown;
            break;
        }
        let dimension = bounds.dimension;
        cells = unknown
            .iter()
            .flat_map(|cell| cell.parts(dimension))
            .collect();
    }
    // A cell that is not empty takes about four enclosures.
    cover.evaluations = 4 * seen;
    cover.evaluations += solve(field, &mut segments);
    cover.points = segments
        .into_iter()
        .map(|(from, to)| from.midpoint(to))
        .collect();
    Some(cover)
}

/// Cells of nearly equal sides that fill the box.
fn first_cells(bounds: &Bounds) -> Vec<Cell> {
    let size = bounds.size();
    let side = size.max_element() / FIRST;
    let counts: [usize; 3] = std::array::from_fn(|axis| {
        let parts = (size[axis] / side).round();
        if axis < bounds.dimension {
            (parts as usize).max(1)
        } else {
            1
        }
    });
    let face = |axis: usize, place: usize| {
        if axis >= bounds.dimension {
            return 0.0;
        }
        let part = place as f64 / counts[axis] as f64;
        bounds.min[axis] * (1.0 - part) + bounds.max[axis] * part
    };
    let corner =
        |place: [usize; 3]| DVec3::from_array([0, 1, 2].map(|axis| face(axis, place[axis])));
    let mut cells = Vec::with_capacity(counts.iter().product());
    for z in 0..counts[2] {
        for y in 0..counts[1] {
            for x in 0..counts[0] {
                let (low, high) = (corner([x, y, z]), corner([x + 1, y + 1, z + 1]));
                cells.push(Cell { low, high });
            }
        }
    }
    cells
}

impl Cell {
    /// The halves of its sides, combined.
    fn parts(self, dimension: usize) -> impl Iterator<Item = Cell> {
        let middle = self.low.midpoint(self.high);
        (0..1_usize << dimension).map(move |number| {
            let mut part = self;
            for axis in 0..dimension {
                if number >> axis & 1 == 0 {
                    part.high[axis] = middle[axis];
                } else {
                    part.low[axis] = middle[axis];
                }
            }
            part
        })
    }
}

/// Enclosures of F, and of F_x where they are asked for, over some boxes.
struct Enclosed {
    values: Vec<Enclosure>,
    gradients: [Vec<Interval>; 3],
}

fn columns(boxes: &[Cell], axis: usize) -> Vec<Interval> {
    let side = |cell: &Cell| Interval::new(cell.low[axis], cell.high[axis]);
    boxes.iter().map(side).collect()
}

const UNKNOWN: Enclosure = Enclosure {
    range: Interval::ENTIRE,
    regularity: Regularity::Partial,
};

fn enclose(field: &CompiledField, boxes: &[Cell]) -> Vec<Enclosure> {
    let sides: [Vec<Interval>; 3] = std::array::from_fn(|axis| columns(boxes, axis));
    let sides: Vec<&[Interval]> = sides.iter().map(Vec::as_slice).collect();
    let mut values = vec![UNKNOWN; boxes.len()];
    field.enclose(&sides[..field.dimension()], &mut values);
    values
}

fn enclose_gradients(field: &CompiledField, boxes: &[Cell]) -> Enclosed {
    let sides: [Vec<Interval>; 3] = std::array::from_fn(|axis| columns(boxes, axis));
    let sides: Vec<&[Interval]> = sides.iter().map(Vec::as_slice).collect();
    let mut values = vec![UNKNOWN; boxes.len()];
    let mut gradients = [(); 3].map(|()| vec![Interval::ENTIRE; boxes.len()]);
    let dimension = field.dimension();
    let mut outputs: Vec<&mut [Interval]> = gradients.iter_mut().map(Vec::as_mut_slice).collect();
    field.enclose_gradients(&sides[..dimension], &mut values, &mut outputs[..dimension]);
    Enclosed { values, gradients }
}

fn is_empty(enclosure: &Enclosure) -> bool {
    !enclosure.range.contains(0.0)
}

/// Judges the cells of a chunk.
fn judge(field: &CompiledField, bounds: &Bounds, cells: &[Cell]) -> Vec<Verdict> {
    let mut verdicts: Vec<Verdict> = cells.iter().map(|_| Verdict::Unknown).collect();
    let enclosures = enclose(field, cells);
    let mut open: Vec<usize> = Vec::new();
    for (place, enclosure) in enclosures.iter().enumerate() {
        if is_empty(enclosure) {
            verdicts[place] = Verdict::Empty;
        } else {
            open.push(place);
        }
    }
    let boxes: Vec<Cell> = open.iter().map(|&place| cells[place]).collect();
    let mut inside = enclose_gradients(field, &boxes);
    for (number, &place) in open.iter().enumerate() {
        if is_empty(&inside.values[number]) {
            verdicts[place] = Verdict::Empty;
        }
    }
    by_monotony(field, &boxes, &mut inside, &open, &mut verdicts);
    by_tubes(field, bounds, &boxes, &inside, &open, &mut verdicts);
    verdicts
}

/// Looks for a tube around each open cell.
fn by_tubes(
    field: &CompiledField,
    bounds: &Bounds,
    boxes: &[Cell],
    inside: &Enclosed,
    open: &[usize],
    verdicts: &mut [Verdict],
) {
    let mut batch = Batch::default();
    let centres = boxes.iter().map(|cell| cell.low.midpoint(cell.high));
    let here: Vec<Evaluation> = batch.evaluate(field, centres).collect();
    let tubes: Vec<(usize, Cell, usize)> = (0..boxes.len())
        .filter(|&number| matches!(verdicts[open[number]], Verdict::Unknown))
        .filter_map(|number| {
            let slopes = inside.gradients.each_ref().map(|column| column[number]);
            let (tube, axis) = tube(bounds, &boxes[number], here[number], slopes)?;
            Some((open[number], tube, axis))
        })
        .collect();
    let stretched: Vec<Cell> = tubes.iter().map(|tube| tube.1).collect();
    let mut inside = enclose_gradients(field, &stretched);
    sharpen(field, &stretched, &mut inside);
    let faces: Vec<Cell> = tubes
        .iter()
        .flat_map(|(_, tube, axis)| ends(tube, *axis))
        .collect();
    // The mean-value form sees that F hardly changes along the zero set.
    let at_faces = enclose_gradients(field, &faces).values;
    for (number, (place, tube, axis)) in tubes.iter().enumerate() {
        let slope = inside.gradients[*axis][number];
        let is_continuous = inside.values[number].regularity >= Regularity::Continuous;
        let ends = [&at_faces[2 * number], &at_faces[2 * number + 1]];
        if is_continuous && has_sign(slope) && have_opposite_signs(ends[0], ends[1]) {
            let mut from = tube.low.midpoint(tube.high);
            let mut to = from;
            from[*axis] = tube.low[*axis];
            to[*axis] = tube.high[*axis];
            verdicts[*place] = Verdict::Covered(from, to);
        }
    }
}

/// The box around a cell that the zero set leaves by no side face, as far as the slopes in the
/// cell tell, and its axis: that along which the slope is surest.
fn tube(
    bounds: &Bounds,
    cell: &Cell,
    here: Evaluation,
    slopes: [Interval; 3],
) -> Option<(Cell, usize)> {
    let half = 0.5 * (cell.high - cell.low);
    let middle = cell.low.midpoint(cell.high);
    let least = |axis: usize| slopes[axis].low.max(-slopes[axis].high);
    let most = |axis: usize| slopes[axis].high.max(-slopes[axis].low);
    // On a crease the least slope is 0, because each operand of a maximum may take no part.
    let slope = |axis: usize| least(axis).max(here.gradient[axis].abs());
    let axes = 0..bounds.dimension;
    let signed = axes.clone().filter(|&axis| has_sign(slopes[axis]));
    let surest = signed.max_by(|&a, &b| slope(a).total_cmp(&slope(b)))?;
    let others = axes.filter(|&axis| axis != surest);
    let rise: f64 = others.map(|axis| most(axis) * half[axis]).sum();
    if !(slope(surest) > 0.0 && (rise + here.value).is_finite()) {
        return None;
    }
    // Newton's step with intervals, for all lines along the axis together.
    let sign = if slopes[surest].low >= 0.0 { 1.0 } else { -1.0 };
    let steps = [here.value - STRETCH * rise, here.value + STRETCH * rise]
        .map(|value| [slope(surest), most(surest)].map(|slope| -sign * value / slope));
    let steps = steps.as_flattened().iter().copied();
    let margin = 0.1 * half[surest];
    let lowest = middle[surest] + steps.clone().fold(f64::INFINITY, f64::min) - margin;
    let highest = middle[surest] + steps.fold(f64::NEG_INFINITY, f64::max) + margin;
    let mut tube = *cell;
    // What lies beyond the box is no connection.
    tube.low[surest] = lowest.max(bounds.min[surest]).min(cell.low[surest]);
    tube.high[surest] = highest.min(bounds.max[surest]).max(cell.high[surest]);
    let length = tube.high[surest] - tube.low[surest];
    (length <= LONGEST * 2.0 * half[surest]).then_some((tube, surest))
}

/// The lower and the upper face of a box.
fn ends(tube: &Cell, axis: usize) -> [Cell; 2] {
    let (mut lower, mut upper) = (*tube, *tube);
    lower.high[axis] = lower.low[axis];
    upper.low[axis] = upper.high[axis];
    [lower, upper]
}

fn have_opposite_signs(one: &Enclosure, other: &Enclosure) -> bool {
    let below = |enclosure: &Enclosure| !enclosure.range.is_empty() && enclosure.range.high < 0.0;
    let above = |enclosure: &Enclosure| !enclosure.range.is_empty() && enclosure.range.low > 0.0;
    (below(one) && above(other)) || (above(one) && below(other))
}

/// Looks whether F is monotone in each coordinate in the open cells.
fn by_monotony(
    field: &CompiledField,
    boxes: &[Cell],
    inside: &mut Enclosed,
    open: &[usize],
    verdicts: &mut [Verdict],
) {
    sharpen(field, boxes, inside);
    let mut monotone = Vec::new();
    for (number, cell) in boxes.iter().enumerate() {
        let slopes = &inside.gradients[..field.dimension()];
        let slopes = slopes.iter().map(|column| column[number]);
        if inside.values[number].regularity >= Regularity::Continuous
            && let Some((least, most)) = extreme_corners(cell, slopes)
        {
            monotone.push((open[number], least, most));
        }
    }
    let point = |&corner: &DVec3| Cell {
        low: corner,
        high: corner,
    };
    let corners: Vec<Cell> = monotone
        .iter()
        .flat_map(|(_, least, most)| [point(least), point(most)])
        .collect();
    let at_corners = enclose(field, &corners);
    for (number, (place, least, most)) in monotone.iter().enumerate() {
        let (low, high) = (
            at_corners[2 * number].range,
            at_corners[2 * number + 1].range,
        );
        if low.low > 0.0 || high.high < 0.0 {
            verdicts[*place] = Verdict::Empty;
        } else if low.high < 0.0 && high.low > 0.0 {
            verdicts[*place] = Verdict::Covered(*least, *most);
        }
    }
}

/// Encloses slopes again between which and one sign only rounding stands: of a box alone the ends
/// are the tightest, and a zero is one.
fn sharpen(field: &CompiledField, boxes: &[Cell], inside: &mut Enclosed) {
    let is_nearly_signed = |slope: Interval| {
        let beyond = slope.high.min(-slope.low);
        beyond > 0.0 && beyond < f64::MIN_POSITIVE
    };
    let columns = &mut inside.gradients[..field.dimension()];
    for (number, cell) in boxes.iter().enumerate() {
        if columns
            .iter()
            .any(|column| is_nearly_signed(column[number]))
        {
            let alone = enclose_gradients(field, &[*cell]).gradients;
            for (column, alone) in columns.iter_mut().zip(alone) {
                column[number] = alone[0];
            }
        }
    }
}

/// Whether all numbers but 0 have one sign.
fn has_sign(slope: Interval) -> bool {
    !slope.is_empty() && (slope.low >= 0.0 || slope.high <= 0.0)
}

/// The corners at which F is least and most, if each slope has one sign.
fn extreme_corners(cell: &Cell, slopes: impl Iterator<Item = Interval>) -> Option<(DVec3, DVec3)> {
    let (mut least, mut most) = (cell.low, cell.high);
    for (axis, slope) in slopes.enumerate() {
        if slope.is_empty() || slope.low >= 0.0 {
            continue;
        }
        if slope.high > 0.0 {
            return None;
        }
        least[axis] = cell.high[axis];
        most[axis] = cell.low[axis];
    }
    Some((least, most))
}

/// Halves the segments, whose ends have different signs, around a zero. Returns the number of
/// evaluations.
fn solve(field: &CompiledField, segments: &mut [(DVec3, DVec3)]) -> u64 {
    segments.par_chunks_mut(CHUNK).for_each(|segments| {
        let mut batch = Batch::default();
        let starts: Vec<DVec3> = segments.iter().map(|segment| segment.0).collect();
        let is_below: Vec<bool> = batch
            .evaluate(field, starts.into_iter())
            .map(|here| here.value < 0.0)
            .collect();
        for _ in 0..HALVINGS {
            let middles: Vec<DVec3> = segments
                .iter()
                .map(|(from, to)| from.midpoint(*to))
                .collect();
            let there = batch.evaluate(field, middles.iter().copied());
            for (((segment, middle), here), below) in
                segments.iter_mut().zip(&middles).zip(there).zip(&is_below)
            {
                if (here.value < 0.0) == *below {
                    segment.0 = *middle;
                } else {
                    segment.1 = *middle;
                }
            }
        }
    });
    u64::from(HALVINGS + 1) * segments.len() as u64
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::engine::{Program, Silent};
    use crate::graph::{Graph, NodeId, Op};

    fn covered(
        dimension: usize,
        half: f64,
        make: impl Fn(&mut Graph, &[NodeId]) -> NodeId,
    ) -> Cover {
        let mut graph = Graph::new();
        let point: Vec<NodeId> = (0..dimension).map(|axis| graph.coordinate(axis)).collect();
        let root = make(&mut graph, &point);
        let program = Program::new(&graph, &[root], dimension);
        let field = CompiledField::new(Arc::new(program), Vec::new());
        let bounds = Bounds::from_sides(&vec![(-half, half); dimension]).unwrap();
        cover(&field, &bounds, &Silent).unwrap()
    }

    /// |p − centre|² − radius²
    fn ball(graph: &mut Graph, point: &[NodeId], centre: f64, radius: f64) -> NodeId {
        let mut sum = graph.constant(-radius * radius);
        for (axis, &coordinate) in point.iter().enumerate() {
            let centre = graph.constant(if axis == 0 { centre } else { 0.0 });
            let offset = graph.apply(Op::Subtract, &[coordinate, centre]);
            let square = graph.apply(Op::Multiply, &[offset, offset]);
            sum = graph.apply(Op::Add, &[sum, square]);
        }
        sum
    }

    #[test]
    fn a_tiny_ball_far_from_a_large_one_is_found_and_nothing_is_left() {
        for dimension in [2, 3] {
            let cover = covered(dimension, 8.0, |graph, point| {
                let large = ball(graph, point, -2.0, 3.0);
                let small = ball(graph, point, 6.1, 0.004);
                graph.apply(Op::Min, &[large, small])
            });
            assert!(cover.left.is_empty(), "{}", cover.left.len());
            let on_small = |p: &&DVec3| (**p - DVec3::new(6.1, 0.0, 0.0)).length() < 0.005;
            let found = cover.points.iter().filter(on_small).count();
            assert!(found >= 2, "{found}");
            for p in cover.points.iter().filter(|p| p.x < 4.0) {
                assert!(((*p - DVec3::new(-2.0, 0.0, 0.0)).length() - 3.0).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn the_edges_and_corners_of_a_cube_are_covered() {
        let cover = covered(3, 1.3, |graph, point| {
            let sides: Vec<NodeId> = point
                .iter()
                .map(|&axis| graph.apply(Op::Abs, &[axis]))
                .collect();
            let largest = graph.apply(Op::Max, &[sides[1], sides[2]]);
            let largest = graph.apply(Op::Max, &[sides[0], largest]);
            let one = graph.constant(1.0);
            graph.apply(Op::Subtract, &[largest, one])
        });
        assert!(cover.left.is_empty(), "{}", cover.left.len());
        for p in &cover.points {
            assert!((p.abs().max_element() - 1.0).abs() < 1e-3);
        }
    }

    #[test]
    fn of_a_cone_only_the_apex_is_left_and_of_nothing_nothing() {
        let cone = covered(3, 1.1, |graph, point| {
            let ball = ball(graph, point, 0.01, 0.0);
            let square = graph.apply(Op::Multiply, &[point[2], point[2]]);
            let three = graph.constant(3.0);
            let square = graph.apply(Op::Multiply, &[three, square]);
            graph.apply(Op::Subtract, &[ball, square])
        });
        assert!(
            !cone.left.is_empty() && cone.left.len() <= 64,
            "{}",
            cone.left.len()
        );
        assert!(
            cone.left
                .iter()
                .all(|cell| (cell.low - DVec3::X * 0.01).length() < 1e-6)
        );
        let nothing = covered(3, 1.0, |graph, point| ball(graph, point, 0.0, 3.0));
        assert!(nothing.left.is_empty() && nothing.points.is_empty());
    }
}
