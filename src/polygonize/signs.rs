//! Where on a grid in R3 the sign of F − iso is proven, so that F need not be evaluated.
//!
//! The grid is divided into blocks of cells, and these into smaller ones; an interval enclosure of
//! F on a block that leaves out the level decides all points in it. F is then evaluated only near
//! the level set: at a number of points that grows with the surface.

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use super::grid::{Grid, Layer, Seen};
use crate::engine::{CompiledField, Field, Monitor};
use crate::graph::interval::{Enclosure, Interval, Regularity};

/// Cells along each side of a block.
const BLOCK: usize = 4;

/// Blocks along each side of a group of blocks, which is bounded as a whole before they are.
const GROUP: usize = 4;

/// What is known of F − iso on a block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Sign {
    /// Nothing.
    #[default]
    Open,
    /// It is negative.
    Inside,
    /// It is not negative.
    Outside,
}

/// What is known on each block.
pub(super) struct Signs {
    /// Blocks along each axis.
    blocks: [usize; 3],
    /// The first axis fastest.
    signs: Vec<Sign>,
}

impl Signs {
    /// The signs over a grid with these coordinates, in parallel.
    fn new(
        field: &CompiledField,
        iso: f64,
        coordinates: [&[f64]; 3],
        monitor: &dyn Monitor,
    ) -> Self {
        let blocks = coordinates.map(|along| (along.len() - 1).div_ceil(BLOCK));
        let work = Work {
            field,
            iso,
            coordinates,
        };
        let groups = blocks.map(|blocks| blocks.div_ceil(GROUP));
        let layers: Vec<Vec<Sign>> = (0..groups[2])
            .into_par_iter()
            .map(|layer| match monitor.cancelled() {
                true => Vec::new(),
                false => work.layer(layer, groups, blocks),
            })
            .collect();
        let mut signs = layers.concat();
        signs.resize(blocks.iter().product(), Sign::Open);
        Signs { blocks, signs }
    }

    /// The signs over the points of a grid that are not ghosts, if the field can be enclosed.
    pub(super) fn of_grid(
        field: &dyn Field,
        iso: f64,
        grid: &Grid,
        monitor: &dyn Monitor,
    ) -> Option<Self> {
        let coordinates = [0, 1, 2].map(|axis| grid.real_coordinates(axis));
        let compiled = field.compiled()?;
        Some(Signs::new(compiled, iso, coordinates, monitor))
    }

    /// The signs of the blocks in a row along the first axis, where a row of points lies: `Open`
    /// if one of the blocks around it is, of which there are two at a face between blocks.
    fn along(&self, [j, k]: [usize; 2], row: &mut Vec<Sign>) {
        let around = |index: usize, axis: usize| {
            let last = self.blocks[axis] - 1;
            let upper = (index / BLOCK).min(last);
            let at_face = index.is_multiple_of(BLOCK) && index > 0 && index / BLOCK <= last;
            (upper - usize::from(at_face))..=upper
        };
        row.clear();
        row.resize(self.blocks[0], Sign::Outside);
        for (place, block) in around(k, 2)
            .flat_map(|k| around(j, 1).map(move |j| (j, k)))
            .enumerate()
        {
            let (j, k) = block;
            let start = (k * self.blocks[1] + j) * self.blocks[0];
            let others = &self.signs[start..start + self.blocks[0]];
            for (sign, &other) in row.iter_mut().zip(others) {
                let open = place > 0 && *sign == Sign::Open;
                *sign = if open { Sign::Open } else { other };
            }
        }
    }
}

/// The points of a layer at which F must be evaluated, and their evaluation.
pub(super) struct OpenPoints<'a> {
    signs: &'a Signs,
    /// The signs of the blocks along a row.
    along: Vec<Sign>,
    /// Runs of open points: the row, the first point and how many there are.
    runs: Vec<[usize; 3]>,
    columns: [Vec<f64>; 3],
    values: Vec<f64>,
    evaluations: usize,
}

/// About how many points are given to F at a time.
const BATCH: usize = 2048;

impl<'a> OpenPoints<'a> {
    /// None yet.
    pub(super) fn new(signs: &'a Signs) -> Self {
        OpenPoints {
            signs,
            along: Vec::new(),
            runs: Vec::new(),
            columns: Default::default(),
            values: Vec::new(),
            evaluations: 0,
        }
    }

    /// The number of points of the layer at which F was evaluated.
    pub(super) fn evaluations(&self) -> usize {
        self.evaluations
    }

    /// Sets the flags of the layer with this index along the last axis, which is not a ghost, and
    /// the values F − iso at its open points. Says what was seen, open or not.
    pub(super) fn evaluate(
        &mut self,
        field: &dyn Field,
        iso: f64,
        (grid, index): (&Grid, usize),
        layer: &mut Layer,
    ) -> Seen {
        let [first, second] = [0, 1].map(|axis| grid.real_coordinates(axis));
        let ([left, before, below], stride) = (grid.first_point(), grid.points(0));
        let at = |row: usize, point: usize| (row + before) * stride + left + point;
        let mut seen = Seen::default();
        self.runs.clear();
        for row in 0..second.len() {
            let flags = &mut layer.inside[at(row, 0)..][..first.len()];
            seen = seen.and(self.find_runs(row, index - below, flags));
        }
        self.evaluations = 0;
        let mut runs = self.runs.iter().peekable();
        while runs.peek().is_some() {
            self.columns.iter_mut().for_each(Vec::clear);
            let mut batch = runs.clone();
            let [xs, ys, zs] = &mut self.columns;
            while let Some(&[row, start, count]) = batch.next_if(|_| xs.len() < BATCH) {
                xs.extend_from_slice(&first[start..start + count]);
                ys.resize(xs.len(), second[row]);
            }
            zs.resize(xs.len(), grid.coordinates[2][index]);
            self.values.resize(xs.len(), 0.0);
            field.values(&[xs, ys, zs], &mut self.values);
            self.evaluations += xs.len();
            let mut done = 0;
            while let Some(&[row, start, count]) = runs.next_if(|_| done < xs.len()) {
                let values = &self.values[done..done + count];
                let place = row * first.len() + start;
                let stored = &mut layer.values[place..place + count];
                let flags = &mut layer.inside[at(row, start)..][..count];
                for ((stored, flag), value) in stored.iter_mut().zip(flags).zip(values) {
                    *stored = value - iso;
                    *flag = u8::from(*stored < 0.0);
                }
                seen = seen.and(Seen::of_values(stored));
                done += count;
            }
        }
        seen
    }

    /// Appends the runs in a row and sets the flags of its other points; says what these are.
    fn find_runs(&mut self, row: usize, layer: usize, flags: &mut [u8]) -> Seen {
        self.signs.along([row, layer], &mut self.along);
        let mut seen = Seen::default();
        // A point between two blocks is open if one of them is, and else belongs to the first.
        let mut next = 0;
        for (block, &sign) in self.along.iter().enumerate() {
            let first = block * BLOCK;
            let end = (first + BLOCK + 1).min(flags.len());
            if sign == Sign::Open {
                match self.runs.last_mut() {
                    Some([other, start, count]) if *other == row && *start + *count > first => {
                        *count = end - *start;
                    }
                    _ => self.runs.push([row, first, end - first]),
                }
                next = end;
                continue;
            }
            let open_next = self.along.get(block + 1) == Some(&Sign::Open);
            let end = end - usize::from(open_next);
            if next < end {
                let inside = sign == Sign::Inside;
                flags[next..end].fill(u8::from(inside));
                let count = end - next;
                seen.inside += if inside { count } else { 0 };
                seen.outside += if inside { 0 } else { count };
                next = end;
            }
        }
        seen
    }
}

/// What blocks are bounded with.
struct Work<'a> {
    field: &'a CompiledField,
    iso: f64,
    coordinates: [&'a [f64]; 3],
}

impl Work<'_> {
    /// The signs of the blocks in one layer of groups.
    fn layer(&self, layer: usize, groups: [usize; 3], blocks: [usize; 3]) -> Vec<Sign> {
        let first = layer * GROUP;
        let height = GROUP.min(blocks[2] - first);
        let mut signs = vec![Sign::Open; height * blocks[1] * blocks[0]];
        let in_layer = (0..groups[1]).flat_map(|j| (0..groups[0]).map(move |i| [i, j, layer]));
        let in_layer: Vec<[usize; 3]> = in_layer.collect();
        let found = self.bound(&in_layer, BLOCK * GROUP);
        let mut open = Vec::new();
        for (group, sign) in in_layer.into_iter().zip(found) {
            let range = |axis: usize| {
                let start = group[axis] * GROUP;
                start..(start + GROUP).min(blocks[axis])
            };
            for (k, j) in range(2).flat_map(|k| range(1).map(move |j| (k, j))) {
                let start = ((k - first) * blocks[1] + j) * blocks[0];
                match sign {
                    Sign::Open => open.extend(range(0).map(|i| [i, j, k])),
                    _ => signs[start..][range(0)].fill(sign),
                }
            }
        }
        let found = self.bound(&open, BLOCK);
        for ([i, j, k], sign) in open.into_iter().zip(found) {
            signs[((k - first) * blocks[1] + j) * blocks[0] + i] = sign;
        }
        signs
    }

    /// What enclosures say of boxes of so many cells, by their places among such boxes.
    fn bound(&self, boxes: &[[usize; 3]], cells: usize) -> Vec<Sign> {
        let side = |axis: usize, place: usize| {
            let along = self.coordinates[axis];
            let last = along.len() - 1;
            Interval::new(along[place * cells], along[((place + 1) * cells).min(last)])
        };
        let sides = [0, 1, 2].map(|axis| {
            let each = boxes.iter().map(|place| side(axis, place[axis]));
            each.collect::<Vec<Interval>>()
        });
        let mut enclosures = vec![Enclosure::of_number(f64::NAN); boxes.len()];
        self.field
            .enclose(&sides.each_ref().map(Vec::as_slice), &mut enclosures);
        let sign = |enclosure: Enclosure| {
            let Enclosure { range, regularity } = enclosure;
            // Where F may be undefined its points are counted.
            if regularity < Regularity::Defined || range.is_empty() {
                Sign::Open
            } else if range.high < self.iso {
                Sign::Inside
            } else if range.low > self.iso {
                Sign::Outside
            } else {
                Sign::Open
            }
        };
        enclosures.into_iter().map(sign).collect()
    }
}
