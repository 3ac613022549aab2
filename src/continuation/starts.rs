//! Where walks begin: a covering of the box by cells that finds every component.
//!
//! The box is subdivided. A cell whose enclosures exclude 0 holds nothing. If in the box around a
//! cell, three times as large, the curve is proven to be a graph over an axis with so small slopes
//! that it cannot leave through the sides, there is one piece of it at most; if a point of that
//! lies on a curve that was walked, the cell is settled, and if not, a walk begins there. Other
//! cells are split, down to cells that are as small as the places at which a walk jumps over what
//! is singular. What is left of them is judged in groups (`left`): a component that was missed lies
//! in one of those that remain undecided. The work has a limit, after which all cells are left.
//!
//! Of fields that are not compiled nothing is known between the points of a grid; walks then begin
//! in its cells on whose corners all fields change their sign, and nothing is proven.

use std::collections::HashMap;

use glam::DVec3;

use super::curve::{End, Events, Walker};
use super::left;
use super::proof::{Cell, Known, enclose, miss_each_other, reaches};
use super::step::{Place, Step};
use super::system::Condition;
use crate::engine::{CompiledField, Field, Monitor};
use crate::geometry::Bounds;
use crate::graph::Interval;

/// The box in which the curve is to be a graph is so many times as large as the cell: with 3, a
/// straight line with the slope 1 that touches the cell in a corner leaves it in a corner.
const AROUND: f64 = 3.25;

/// Halvings after which a cell is left, and the most cells that are enclosed.
const DEEPEST: u32 = 17;
const MOST_CELLS: u64 = 1 << 17;

/// Gradients between which no larger sine is possible in a cell are judged by those at one point.
const NARROW: f64 = 0.4;

/// Where surfaces touch, they are close to each other up to this distance from there, as a part of
/// the diagonal.
const TOUCH: f64 = 1.0 / 64.0;

/// Cells enclosed at a time.
const BATCH: usize = 256;

/// From this many halvings on, Newton's method tries cells of which nothing is proven.
const TRIED_FROM: u32 = 5;

/// A start with a smaller sine between the normals is singular.
const SMALLEST_SINE: f64 = 1e-5;

/// At zeros of higher order Newton's steps shrink by a constant factor only, 1/2 at the least, and
/// still are longer than this part of the diagonal when there have been enough of them.
const SLOW: f64 = 0.4;
const INEXACT: f64 = 1e-12;

/// So many cells in which the equations hold without a regular point anywhere show that there is no
/// curve.
const HOPELESS: u64 = 2000;

/// Cells of the list of steps along the diagonal.
const BUCKETS: f64 = 128.0;

/// Cells along the longest side of the grid for fields of which nothing is enclosed.
const GRID: (usize, usize) = (256, 48);

/// Cells that are left so close to a singular point, as a part of the diagonal, are expected.
const NEAR: f64 = 1e-3;

/// A point of a curve that was walked is known up to this part of the diagonal.
const KNOWN_TO: f64 = 1e-7;

/// One connected curve, or a part of one that ends at a singular point.
pub(crate) struct Component {
    /// In order, each from where the last one ended.
    pub(crate) steps: Vec<Step>,
    pub(crate) closed: bool,
    pub(crate) length: f64,
}

/// All that was found.
#[derive(Default)]
pub(crate) struct Traced {
    pub(crate) components: Vec<Component>,
    pub(crate) events: Events,
    /// Cells of which nothing could be proven.
    pub(crate) undecided: u64,
    /// How many of them are at singular points that were met, where that is expected.
    pub(crate) undecided_at_singular: u64,
    /// The largest diagonal of one that is not.
    pub(crate) largest_undecided: f64,
    /// Whether cells were looked at by intervals, and none is undecided.
    pub(crate) proven: bool,
    /// Starts at which the equations hold and have no tangent.
    pub(crate) singular: u64,
    pub(crate) index: Index,
}

/// Which steps are where.
#[derive(Default)]
pub(crate) struct Index {
    per_unit: f64,
    buckets: HashMap<[i64; 3], Vec<(u32, u32)>>,
}

impl Index {
    fn bucket(&self, point: DVec3) -> [i64; 3] {
        (self.per_unit * point).floor().to_array().map(|x| x as i64)
    }

    fn insert(&mut self, component: u32, steps: &[Step]) {
        for (place, step) in steps.iter().enumerate() {
            let margin = DVec3::splat(0.1 * step.chord);
            let low = self.bucket(step.from.min(step.to) - margin);
            let high = self.bucket(step.from.max(step.to) + margin);
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    for z in low[2]..=high[2] {
                        let bucket = self.buckets.entry([x, y, z]).or_default();
                        bucket.push((component, place as u32));
                    }
                }
            }
        }
    }
}

/// A cell of the subdivision.
#[derive(Clone, Copy)]
struct Open {
    cell: Cell,
    depth: u32,
}

/// Where curves are looked for.
pub(crate) struct Region {
    /// Cells, and how often the box was halved for each.
    pub(crate) cells: Vec<(Cell, u32)>,
    /// Cells in which the sine of the angle between two surfaces is smaller are left out.
    pub(crate) smallest_sine: f64,
    /// The most cells that are enclosed.
    pub(crate) most_cells: u64,
}

impl Region {
    /// All of a box, whatever the angle.
    pub(crate) fn whole(bounds: &Bounds) -> Region {
        let cell = Cell {
            low: bounds.min,
            high: bounds.max,
        };
        Region {
            cells: vec![(cell, 0)],
            smallest_sine: 0.0,
            most_cells: MOST_CELLS,
        }
    }
}

/// Walks every component that can be found.
///
/// `None` if the monitor asks to stop.
pub(crate) fn trace(walker: &Walker, region: &Region, monitor: &dyn Monitor) -> Option<Traced> {
    let mut search = Search {
        walker,
        region,
        traced: Traced {
            index: Index {
                per_unit: BUCKETS / walker.system.diagonal,
                buckets: HashMap::new(),
            },
            ..Traced::default()
        },
    };
    match walker.compiled.clone() {
        Some(fields) => search.cover(&fields, monitor)?,
        None => search.grid(monitor)?,
    }
    Some(search.traced)
}

struct Search<'a> {
    walker: &'a Walker<'a>,
    region: &'a Region,
    traced: Traced,
}

impl Search<'_> {
    /// Settles cells level by level.
    fn cover(&mut self, fields: &[&CompiledField], monitor: &dyn Monitor) -> Option<()> {
        let cells = self.region.cells.iter();
        let mut level: Vec<Open> = cells.map(|&(cell, depth)| Open { cell, depth }).collect();
        let most_cells = self.region.most_cells;
        let mut enclosed = 0;
        let mut left: Vec<Cell> = Vec::new();
        while !level.is_empty() {
            let mut next = Vec::new();
            for batch in level.chunks(BATCH) {
                if monitor.cancelled() {
                    return None;
                }
                if enclosed >= most_cells || self.walker.is_exhausted(&self.traced.events) {
                    left.extend(batch.iter().map(|open| open.cell));
                    continue;
                }
                enclosed += batch.len() as u64;
                self.settle(fields, batch, &mut next, &mut left);
                if self.traced.components.is_empty() && self.traced.singular > HOPELESS {
                    self.traced.undecided = self.traced.singular;
                    return Some(());
                }
            }
            monitor.progress("cover", enclosed as f64 / most_cells as f64);
            level = next;
        }
        let undecided = left::undecided(self.walker.system, fields, &self.walker.bounds, left);
        let near = NEAR * self.walker.system.diagonal;
        let events = &self.traced.events;
        let elsewhere = undecided
            .iter()
            .filter(|cell| !events.is_near(cell.center(), near));
        let elsewhere: Vec<f64> = elsewhere.map(|cell| cell.size().length()).collect();
        self.traced.undecided_at_singular = (undecided.len() - elsewhere.len()) as u64;
        self.traced.largest_undecided = elsewhere.into_iter().fold(0.0, f64::max);
        self.traced.undecided = undecided.len() as u64;
        self.traced.proven = undecided.is_empty();
        Some(())
    }

    /// Settles the cells of a batch, or splits them.
    fn settle(
        &mut self,
        fields: &[&CompiledField],
        batch: &[Open],
        next: &mut Vec<Open>,
        left: &mut Vec<Cell>,
    ) {
        let system = self.walker.system;
        let cells: Vec<Cell> = batch.iter().map(|open| open.cell).collect();
        let known = enclose(system, fields, &cells);
        let mut possible: Vec<(Open, Known)> = batch
            .iter()
            .copied()
            .zip(known)
            .filter(|(_, known)| known.possible)
            .collect();
        let cells: Vec<Cell> = possible.iter().map(|(open, _)| open.cell).collect();
        let mut missed = miss_each_other(system, fields, &cells).into_iter();
        possible.retain(|_| missed.next() != Some(true));
        let around: Vec<Cell> = possible
            .iter()
            .map(|(open, _)| open.cell.scaled(AROUND))
            .collect();
        let known_around = enclose(system, fields, &around);
        for (((open, here), around), known) in possible.iter().zip(&around).zip(known_around) {
            if here.flat {
                // Smaller cells would be as flat.
                self.traced.singular += HOPELESS;
                left.push(open.cell);
                continue;
            }
            if self.is_flat(&open.cell, here) || self.is_settled(&open.cell, around, &known) {
                continue;
            }
            if open.depth >= TRIED_FROM && known.axis().is_none() {
                self.try_cell(&open.cell, around);
            }
            if open.depth >= DEEPEST {
                left.push(open.cell);
            } else {
                split(open, next);
            }
        }
    }

    /// Whether two surfaces meet at no more than the smallest angle in a cell, as where they touch
    /// or are the same: by the enclosure or, if that is narrow, by the angle in the middle or where
    /// they meet near it.
    fn is_flat(&self, cell: &Cell, known: &Known) -> bool {
        let smallest = self.region.smallest_sine;
        // NaN tells nothing either.
        if smallest == 0.0 || known.sine.is_nan() || known.sine > NARROW {
            return false;
        }
        let (system, middle) = (self.walker.system, cell.center());
        let in_middle = || {
            let local = system.local(middle);
            local.is_some_and(|local| local.direction().length() < 0.5 * smallest)
        };
        let reach = cell.size().max_element().max(TOUCH * system.diagonal);
        known.sine < smallest || in_middle() || system.touching(middle, reach, 0.5 * smallest)
    }

    /// Whether the one piece of the curve that a cell can hold is walked, perhaps just now.
    fn is_settled(&mut self, cell: &Cell, around: &Cell, known: &Known) -> bool {
        let Some(axis) = known.axis() else {
            return false;
        };
        if !self.crosses_border_once(around, known) {
            return false;
        }
        let (low, high) = (cell.low[axis], cell.high[axis]);
        for across in [0.5 * (low + high), low, high] {
            let mut start = cell.center();
            start[axis] = across;
            let condition = Condition::Plane(start, DVec3::AXES[axis]);
            let reach = AROUND * cell.size().max_element();
            let Some(found) = self.walker.system.solve(start, condition, reach) else {
                continue;
            };
            // The piece is followed a little further, because a point of a curve that was walked
            // may stand for this one.
            let same = KNOWN_TO * self.walker.system.diagonal;
            let slack = Interval::new(-same, same);
            let run = cell.side(axis) - Interval::point(across) + slack;
            let holds = around.contains(found.position)
                && reaches(known, axis, found.position, run, around);
            if !holds {
                continue;
            }
            if self.walker.is_inside(found.position) {
                return self.is_old(found.position) || self.start(found.position);
            }
        }
        false
    }

    /// Whether the curve, where it is a graph in a box, crosses those of the border's sides at most
    /// once that the box sticks out of: then what lies inside is one piece.
    fn crosses_border_once(&self, around: &Cell, known: &Known) -> bool {
        let bounds = self.walker.bounds;
        (0..self.walker.system.dimension).all(|axis| {
            let within =
                bounds.min[axis] <= around.low[axis] && around.high[axis] <= bounds.max[axis];
            within || !known.tangent[axis].contains(0.0)
        })
    }

    /// Looks for a point of a new curve in a cell of which nothing is proven.
    fn try_cell(&mut self, cell: &Cell, around: &Cell) {
        let reach = 2.0 * cell.size().max_element();
        let start = cell.center();
        let system = self.walker.system;
        match system.solve(start, Condition::Nearest, reach) {
            Some(found) => {
                let inexact = found.noise > INEXACT * system.diagonal;
                let multiple = inexact && found.contraction > SLOW;
                let regular = found.local.direction().length() > SMALLEST_SINE && !multiple;
                if !around.contains(found.position) || !self.walker.is_inside(found.position) {
                } else if !regular {
                    self.count_singular(1);
                } else if !self.is_old(found.position) {
                    self.start(found.position);
                }
            }
            None => {
                // Newton's method fails where gradients vanish or are parallel on all of the curve.
                let local = system.local(start);
                let close = local.is_some_and(|local| local.residual() <= reach);
                self.count_singular(u64::from(close));
            }
        }
    }

    /// Counts starts without a tangent, unless surfaces that touch are left out anyway.
    fn count_singular(&mut self, more: u64) {
        if self.region.smallest_sine == 0.0 {
            self.traced.singular += more;
        }
    }

    /// Whether a point of the curve lies on one that was walked.
    fn is_old(&self, point: DVec3) -> bool {
        is_old(&self.traced, self.walker, point)
    }

    /// Walks the curve through a point, both ways if it is not closed. Whether it now is a known
    /// one.
    fn start(&mut self, point: DVec3) -> bool {
        let walker = self.walker;
        let Some(local) = walker.system.local(point) else {
            return false;
        };
        let Some(place) = Place::along(point, local, local.direction()) else {
            return false;
        };
        let mut events = std::mem::take(&mut self.traced.events);
        let before = events.clone();
        let ends = events.ends.len();
        let known = |point: DVec3| is_old(&self.traced, walker, point);
        let (mut steps, end) = walker.walk(&place, &known, &mut events);
        let mut closed = end == End::Closed;
        let mut old = end == End::Old;
        if !closed && !old {
            let known = |point: DVec3| {
                let passed = |step: &Step| step.passes(walker.system, point);
                is_old(&self.traced, walker, point) || steps.iter().any(passed)
            };
            let (back, end) = walker.walk(&place.reversed(), &known, &mut events);
            old = end == End::Old;
            // From a start in a corner, only one of the two ways leads along the curve.
            closed = end == End::Closed && steps.is_empty();
            let mut all: Vec<Step> = back.iter().rev().map(Step::reversed).collect();
            all.append(&mut steps);
            steps = all;
        }
        if closed {
            events.ends.truncate(ends);
        }
        let proven = events.unproven == before.unproven;
        // A curve that could not be walked along is none, and neither is what was met on it.
        let nothing = !old && steps.is_empty();
        self.traced.events = match nothing {
            true => before.with_work_of(&events),
            false => events,
        };
        if old || nothing {
            return old && proven;
        }
        let number = self.traced.components.len() as u32;
        self.traced.index.insert(number, &steps);
        self.traced.components.push(Component {
            length: steps.iter().map(|step| step.length).sum(),
            closed,
            steps,
        });
        true
    }

    /// Starts walks from the cells of a grid on whose corners all fields change their sign.
    fn grid(&mut self, monitor: &dyn Monitor) -> Option<()> {
        let system = self.walker.system;
        let along = if system.dimension == 2 {
            GRID.0
        } else {
            GRID.1
        };
        let (cells, evaluations) = crossed_cells(&system.fields, &self.walker.bounds, along);
        system.count(evaluations);
        for batch in cells.chunks(BATCH) {
            if monitor.cancelled() {
                return None;
            }
            if self.walker.is_exhausted(&self.traced.events) {
                self.traced.undecided += batch.len() as u64;
                continue;
            }
            for cell in batch {
                self.try_cell(cell, &cell.scaled(AROUND));
            }
        }
        Some(())
    }
}

/// The cells of a grid, so many along the longest side of the box, on whose corners all fields
/// change their sign; and what that cost.
pub(crate) fn crossed_cells(
    fields: &[&dyn Field],
    bounds: &Bounds,
    along: usize,
) -> (Vec<Cell>, u64) {
    let side = bounds.size().max_element() / along as f64;
    let counts = [0, 1, 2].map(|axis| match axis < bounds.dimension {
        true => (bounds.size()[axis] / side).ceil().max(1.0) as usize,
        false => 0,
    });
    let step = DVec3::from_array([0, 1, 2].map(|axis| match counts[axis] {
        0 => 0.0,
        count => bounds.size()[axis] / count as f64,
    }));
    let at =
        |x: usize, y: usize, z: usize| bounds.min + step * DVec3::new(x as f64, y as f64, z as f64);
    let mut columns: [Vec<f64>; 3] = Default::default();
    for z in 0..=counts[2] {
        for y in 0..=counts[1] {
            for x in 0..=counts[0] {
                for (column, coordinate) in columns.iter_mut().zip(at(x, y, z).to_array()) {
                    column.push(coordinate);
                }
            }
        }
    }
    let columns = columns.each_ref().map(|column| &column[..]);
    let signs_of = |field: &&dyn Field| {
        let mut values = vec![0.0; columns[0].len()];
        field.values(&columns[..bounds.dimension], &mut values);
        let sign = |value: f64| (!value.is_nan()).then_some(value > 0.0);
        values.into_iter().map(sign).collect()
    };
    let signs: Vec<Vec<Option<bool>>> = fields.iter().map(signs_of).collect();
    let mut cells = Vec::new();
    for z in 0..counts[2].max(1) {
        for y in 0..counts[1] {
            for x in 0..counts[0] {
                if signs.iter().all(|signs| changes(signs, counts, [x, y, z])) {
                    let low = at(x, y, z);
                    let high = low + step;
                    cells.push(Cell { low, high });
                }
            }
        }
    }
    (cells, (fields.len() * columns[0].len()) as u64)
}

/// Whether signs differ among the corners of a cell, which must all be known.
fn changes(signs: &[Option<bool>], counts: [usize; 3], at: [usize; 3]) -> bool {
    let rows = counts[0] + 1;
    let layers = rows * (counts[1] + 1);
    let mut seen = [false; 2];
    for z in at[2]..=(at[2] + 1).min(counts[2]) {
        for y in at[1]..=at[1] + 1 {
            for x in at[0]..=at[0] + 1 {
                match signs[z * layers + y * rows + x] {
                    Some(sign) => seen[usize::from(sign)] = true,
                    None => return false,
                }
            }
        }
    }
    seen == [true, true]
}

/// Whether a point of the curve lies on one that was walked.
fn is_old(traced: &Traced, walker: &Walker, point: DVec3) -> bool {
    let bucket = traced.index.buckets.get(&traced.index.bucket(point));
    bucket.is_some_and(|bucket| {
        bucket.iter().any(|&(component, place)| {
            let step = &traced.components[component as usize].steps[place as usize];
            step.passes(walker.system, point)
        })
    })
}

/// Halves a cell along its longer sides.
fn split(open: &Open, next: &mut Vec<Open>) {
    let size = open.cell.size();
    let long = size.cmpgt(DVec3::splat(0.6 * size.max_element()));
    let middle = open.cell.center();
    let mut parts = vec![open.cell];
    for axis in (0..3).filter(|&axis| long.test(axis)) {
        for place in 0..parts.len() {
            let mut upper = parts[place];
            parts[place].high[axis] = middle[axis];
            upper.low[axis] = middle[axis];
            parts.push(upper);
        }
    }
    let depth = open.depth + 1;
    next.extend(parts.into_iter().map(|cell| Open { cell, depth }));
}
