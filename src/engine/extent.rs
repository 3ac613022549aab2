//! Boxes that provably hold the whole zero set of a field.
//!
//! Space outside of the cube [−r, r]ⁿ is covered by 2n parts, one beyond each face. Of each it is
//! proven by interval arithmetic on an adaptive subdivision that F has no zero in it, in one of two
//! ways: with unbounded intervals for the coordinates themselves, or in the projective form of
//! [`crate::graph::projective`], which sees the highest terms of polynomials. The cube grows until that
//! succeeds; then each face moves inward past what is proven to be empty.
//!
//! A zero is a point where the exact F is 0. F must be continuous for what is said of signs; a jump
//! counts as a zero there.

use super::{CompiledField, Field, Monitor};
use crate::graph::interval::Enclosure;
use crate::graph::projective::projective;
use crate::graph::{Graph, Interval, NodeId};
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::sync::Arc;

/// What is known of the place of a zero set.
#[derive(Clone, Debug, PartialEq)]
pub enum Extent {
    /// There is no zero anywhere.
    Empty,
    /// All zeros lie in the box with these sides, one per axis.
    Within(Vec<Interval>),
    /// There are zeros at any distance.
    Unbounded,
    /// Nothing was proven with the work that was allowed. F has both signs at this distance, if at
    /// any that was tried.
    Unknown {
        /// The largest such distance; 0 if there is none.
        reach: f64,
    },
}

/// Half the sides of the cubes that are tried: powers of 4 from 1/4 to 4^12, 1.7·10^7.
const CUBES: std::ops::RangeInclusive<i32> = -1..=12;

/// The most boxes that are enclosed for a part of space, in one of the two ways.
const PART_BUDGET: usize = 4096;

/// The most boxes that are enclosed to move a face.
const FACE_BUDGET: usize = 1 << 15;

/// A face stops where a box as small as this part of the cube may hold a zero.
const FINENESS: f64 = 1.0 / 128.0;

/// Boxes are enclosed so many at a time.
const BATCH: usize = 64;

/// Finds a box for the zero set of F at its present q. Costs at most some hundred thousand
/// enclosures of F, for most fields a few thousand. `None` where the monitor wants an end; it is
/// asked before every few dozen enclosures.
pub fn extent(field: &CompiledField, monitor: &dyn Monitor) -> Option<Extent> {
    let dimension = field.dimension();
    if dimension == 0 {
        return Some(Extent::Unknown { reach: 0.0 });
    }
    let parts: Vec<Part> = (0..dimension)
        .flat_map(|axis| [(axis, -1.0), (axis, 1.0)])
        .map(|(axis, sign)| {
            go_on(monitor)?;
            Some(Part::new(field, axis, sign))
        })
        .collect::<Option<_>>()?;
    if dimension > 1 && signs_at_infinity(&parts) == [true, true] {
        return Some(Extent::Unbounded);
    }
    for exponent in CUBES {
        let half = power_of_four(exponent);
        let mut is_empty = true;
        for part in &parts {
            is_empty = is_empty && part.is_empty_beyond(field, half, monitor)?;
        }
        if is_empty {
            return within(field, half, monitor);
        }
    }
    for distance in CUBES.rev().map(power_of_four) {
        go_on(monitor)?;
        if has_both_signs(field, distance) {
            return Some(Extent::Unknown { reach: distance });
        }
    }
    Some(Extent::Unknown { reach: 0.0 })
}

/// `None` where the monitor wants an end.
fn go_on(monitor: &dyn Monitor) -> Option<()> {
    (!monitor.cancelled()).then_some(())
}

/// 4ⁿ for an n that is not large.
fn power_of_four(exponent: i32) -> f64 {
    f64::from_bits(((1023 + 2 * exponent) as u64) << 52)
}

/// Space beyond a face of a cube.
struct Part {
    axis: usize,
    sign: f64,
    /// The projective form: of t, then of the other coordinates' directions.
    projective: CompiledField,
}

impl Part {
    fn new(field: &CompiledField, axis: usize, sign: f64) -> Part {
        let dimension = field.dimension();
        let make = |graph: &mut Graph, roots: &[NodeId], _: usize| {
            let t = graph.coordinate(0);
            let mut next = 0;
            let direction: Vec<NodeId> = (0..dimension)
                .map(|other| match other == axis {
                    true => graph.constant(sign),
                    false => {
                        next += 1;
                        graph.coordinate(next)
                    }
                })
                .collect();
            let roots = roots.iter().take(1);
            roots
                .map(|&root| projective(graph, root, &direction, t))
                .collect()
        };
        let program = field.program().derived(dimension, make);
        Part {
            axis,
            sign,
            projective: CompiledField::new(Arc::new(program), field.parameters().to_vec()),
        }
    }

    /// Whether F is proven to have no zero beyond the face of the cube of this half side.
    fn is_empty_beyond(
        &self,
        field: &CompiledField,
        half: f64,
        monitor: &dyn Monitor,
    ) -> Option<bool> {
        let dimension = field.dimension();
        let mut beyond = [Interval::ENTIRE; 3];
        beyond[self.axis] = match self.sign > 0.0 {
            true => Interval::new(half, f64::INFINITY),
            false => Interval::new(f64::NEG_INFINITY, -half),
        };
        let mut near = [Interval::new(-1.0, 1.0); 3];
        near[0] = Interval::new(0.0, 1.0 / half);
        let is_proven = is_empty(field, &beyond[..dimension], monitor)?;
        Some(is_proven || is_empty(&self.projective, &near[..dimension], monitor)?)
    }
}

/// Whether the function is proven to have no zero in a box, which may be unbounded.
fn is_empty(field: &CompiledField, sides: &[Interval], monitor: &dyn Monitor) -> Option<bool> {
    let dimension = sides.len();
    let whole: [Interval; 3] = std::array::from_fn(|axis| {
        let side = sides.get(axis);
        side.copied().unwrap_or(Interval::point(0.0))
    });
    let mut open = vec![whole];
    let mut enclosed = 0;
    while !open.is_empty() {
        go_on(monitor)?;
        let batch = open.split_off(open.len().saturating_sub(BATCH));
        enclosed += batch.len();
        if enclosed > PART_BUDGET {
            return Some(false);
        }
        for cell in undecided(field, Form::Natural, dimension, &batch) {
            let axis = widest(&cell, &whole, dimension);
            let Some(halves) = halves(cell[axis]) else {
                return Some(false);
            };
            for half in halves {
                let mut child = cell;
                child[axis] = half;
                open.push(child);
            }
        }
    }
    Some(true)
}

/// How boxes are enclosed.
#[derive(Clone, Copy, PartialEq)]
enum Form {
    /// By the natural extension.
    Natural,
    /// By the mean-value form too, which is tighter on small boxes and takes a few times longer.
    MeanValue,
}

/// Those of the boxes in which there may be a zero.
fn undecided(
    field: &CompiledField,
    form: Form,
    dimension: usize,
    boxes: &[[Interval; 3]],
) -> Vec<[Interval; 3]> {
    let columns: [Vec<Interval>; 3] =
        std::array::from_fn(|axis| boxes.iter().map(|sides| sides[axis]).collect());
    let columns = columns.each_ref().map(|column| &column[..]);
    let mut found = vec![Enclosure::of_number(0.0); boxes.len()];
    match form {
        Form::Natural => field.enclose(&columns[..dimension], &mut found),
        Form::MeanValue => {
            let mut slopes = [const { Vec::new() }; 3];
            for column in &mut slopes[..dimension] {
                column.resize(boxes.len(), Interval::ENTIRE);
            }
            let mut slopes = slopes.each_mut().map(|column| &mut column[..]);
            field.enclose_gradients(&columns[..dimension], &mut found, &mut slopes[..dimension]);
        }
    }
    let pairs = boxes.iter().zip(found);
    let open = pairs.filter(|(_, enclosure)| enclosure.range.contains(0.0));
    open.map(|(sides, _)| *sides).collect()
}

/// The axis along which a box is the largest part of the whole one.
fn widest(cell: &[Interval; 3], whole: &[Interval; 3], dimension: usize) -> usize {
    let part = |axis: usize| part(cell[axis], whole[axis]);
    let axes = 0..dimension;
    axes.max_by(|&a, &b| part(a).total_cmp(&part(b)))
        .unwrap_or(0)
}

/// How large a part of the whole an interval is; of what is unbounded, after x ↦ x/(1 + |x|).
fn part(side: Interval, whole: Interval) -> f64 {
    let is_bounded = whole.low.is_finite() && whole.high.is_finite();
    let image = |x: f64| match (is_bounded, x.is_finite()) {
        (true, _) => x,
        (false, true) => x / (1.0 + x.abs()),
        (false, false) => x.signum(),
    };
    (image(side.high) - image(side.low)) / (image(whole.high) - image(whole.low))
}

/// Two parts of an interval, cut in the middle or, if it is unbounded, at twice its end.
fn halves(side: Interval) -> Option<[Interval; 2]> {
    let Interval { low, high } = side;
    let cut = match (low.is_finite(), high.is_finite()) {
        (true, true) => 0.5 * low + 0.5 * high,
        (false, false) => 0.0,
        (true, false) if low < 1.0 => (0.5 * low).max(1.0),
        (true, false) => 2.0 * low,
        (false, true) if high > -1.0 => (0.5 * high).min(-1.0),
        (false, true) => 2.0 * high,
    };
    (low < cut && cut < high).then(|| [Interval::new(low, cut), Interval::new(cut, high)])
}

/// Whether F is proven to be negative, and to be positive, in a cone that goes to infinity.
fn signs_at_infinity(parts: &[Part]) -> [bool; 2] {
    /// Directions on an axis of a face.
    const STEPS: usize = 9;
    const NEAR: f64 = 1e-6;
    let mut signs = [false; 2];
    for part in parts {
        let dimension = part.projective.dimension();
        let count = STEPS.pow(dimension as u32 - 1);
        let mut columns = [const { Vec::new() }; 3];
        for index in 0..count {
            columns[0].push(Interval::new(0.0, NEAR));
            let mut rest = index;
            for column in &mut columns[1..dimension] {
                let step = (rest % STEPS) as f64 / (STEPS - 1) as f64;
                // Off the axes and diagonals, where symmetric functions are 0.
                column.push(Interval::point((2.0 * step - 1.0) * 0.97 + 0.013));
                rest /= STEPS;
            }
        }
        let columns = columns.each_ref().map(|column| &column[..]);
        let mut found = vec![Enclosure::of_number(0.0); count];
        part.projective.enclose(&columns[..dimension], &mut found);
        for range in found.iter().map(|enclosure| enclosure.range) {
            signs[0] |= range.low <= range.high && range.high < 0.0;
            signs[1] |= range.low <= range.high && range.low > 0.0;
        }
    }
    signs
}

/// Whether F is found to have both signs at points of the surface of the cube of this half side.
fn has_both_signs(field: &CompiledField, half: f64) -> bool {
    /// Points on an axis; not a divisor of any likely period.
    const STEPS: usize = 17;
    let dimension = field.dimension();
    let mut columns = [const { Vec::new() }; 3];
    for axis in 0..dimension {
        for index in 0..2 * STEPS.pow(dimension as u32 - 1) {
            let mut rest = index / 2;
            for (other, column) in columns.iter_mut().enumerate().take(dimension) {
                let step = match other == axis {
                    true => (index % 2 * (STEPS - 1)) as f64,
                    false => {
                        let step = rest % STEPS;
                        rest /= STEPS;
                        step as f64 + 0.37 * (index % 2) as f64
                    }
                };
                column.push(half * (2.0 * step / (STEPS - 1) as f64 - 1.0).min(1.0));
            }
        }
    }
    let columns = columns.each_ref().map(|column| &column[..]);
    let mut values = vec![0.0; columns[0].len()];
    field.values(&columns[..dimension], &mut values);
    values.iter().any(|&value| value < 0.0) && values.iter().any(|&value| value > 0.0)
}

/// The box within the cube of this half side, outside of which F has no zero.
fn within(field: &CompiledField, half: f64, monitor: &dyn Monitor) -> Option<Extent> {
    let dimension = field.dimension();
    let mut sides = [Interval::point(0.0); 3];
    sides[..dimension].fill(Interval::new(-half, half));
    // A pass is as fine as its box: more passes follow while it becomes much smaller.
    loop {
        let before = sides;
        for axis in 0..dimension {
            for sign in [-1.0, 1.0] {
                match moved(field, &sides, dimension, (axis, sign), monitor)? {
                    None => return Some(Extent::Empty),
                    Some(end) if sign < 0.0 => sides[axis].low = end,
                    Some(end) => sides[axis].high = end,
                }
            }
        }
        let is_much_smaller = |axis: usize| part(sides[axis], before[axis]) < 0.7;
        if !(0..dimension).any(is_much_smaller) {
            return Some(Extent::Within(sides[..dimension].to_vec()));
        }
    }
}

/// A box in which there may be a zero, with how far it reaches toward the face.
struct Candidate {
    reach: f64,
    sides: [Interval; 3],
}

impl Ord for Candidate {
    fn cmp(&self, other: &Candidate) -> Ordering {
        self.reach.total_cmp(&other.reach)
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Candidate) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Eq for Candidate {}

impl PartialEq for Candidate {
    fn eq(&self, other: &Candidate) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

/// Where a face of the box can be moved to, with no zero left outside; none if there is no zero in
/// the box. Boxes are divided from the face inward, so that only those near the outermost zeros
/// are. `None` outside where the monitor wants an end.
fn moved(
    field: &CompiledField,
    sides: &[Interval; 3],
    dimension: usize,
    (axis, sign): (usize, f64),
    monitor: &dyn Monitor,
) -> Option<Option<f64>> {
    let reach = |cell: &[Interval; 3]| match sign > 0.0 {
        true => cell[axis].high,
        false => -cell[axis].low,
    };
    let is_fine =
        |cell: &[Interval; 3]| (0..dimension).all(|axis| part(cell[axis], sides[axis]) <= FINENESS);
    let mut open = BinaryHeap::new();
    open.push(Candidate {
        reach: reach(sides),
        sides: *sides,
    });
    let mut enclosed = 0;
    while let Some(first) = open.peek() {
        if enclosed > FACE_BUDGET || (enclosed > 0 && is_fine(&first.sides)) {
            return Some(Some(sign * first.reach));
        }
        go_on(monitor)?;
        let mut batch = Vec::with_capacity(BATCH);
        while batch.len() < BATCH / 2
            && let Some(cell) = open.pop()
        {
            let widest = widest(&cell.sides, sides, dimension);
            let parts = match is_fine(&cell.sides) {
                true => None,
                false => halves(cell.sides[widest]),
            };
            let Some(parts) = parts else {
                // Nothing to divide: it stays what it is.
                open.push(cell);
                break;
            };
            for part in parts {
                let mut child = cell.sides;
                child[widest] = part;
                batch.push(child);
            }
        }
        if batch.is_empty() {
            return Some(open.peek().map(|first| sign * first.reach));
        }
        enclosed += batch.len();
        for cell in undecided(field, Form::MeanValue, dimension, &batch) {
            open.push(Candidate {
                reach: reach(&cell),
                sides: cell,
            });
        }
    }
    Some(None)
}
