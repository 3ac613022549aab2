//! Where continuation begins.

use glam::DVec3;
use rayon::prelude::*;

use super::space::{Index, Survey, corner};
use crate::polygonize::PolygonizeError;
use crate::polygonize::enclosure::{Colour, classify};
use crate::polygonize::grid::Seen;

/// The side, in cells, of boxes in which the grid is evaluated if they are not decided.
const BLOCK: u32 = 4;

/// How many boxes are looked at together.
const CHUNK: usize = 64;

/// A cube of cells, those beyond the grid included.
#[derive(Clone, Copy)]
struct Block {
    low: Index,
    size: u32,
}

/// All cells that the level set crosses, ghosts aside: in boxes that are not proven to be inside
/// or outside every point of the grid is evaluated. Also the cell beyond a corner of the box that
/// is inside, for a cap may be all of a component.
pub(super) fn everywhere(survey: &mut Survey) -> Result<Vec<Index>, PolygonizeError> {
    let blocks = undecided(survey)?;
    let shared = &*survey;
    let parts: Vec<Result<Part, PolygonizeError>> = blocks
        .par_chunks(CHUNK)
        .map(|blocks| crossed(shared, blocks))
        .collect();
    let mut seeds = Vec::new();
    for part in parts {
        let part = part?;
        // Blocks share points: those of their uppermost layers are counted by the next.
        survey.seen = survey.seen.and(part.seen);
        survey.repeated += part.repeated;
        for (&cell, values) in part.cells.iter().zip(&part.values) {
            for (number, &value) in values.iter().enumerate() {
                let key = survey.key(corner(cell, number));
                survey.values.insert(key, value);
            }
        }
        seeds.extend(part.cells);
    }
    if survey.grid.ghosts > 0 {
        seeds.push([0; 3]);
    }
    Ok(seeds)
}

/// What is crossed in some blocks.
struct Part {
    cells: Vec<Index>,
    /// F − iso at the corners of each.
    values: Vec<[f64; 8]>,
    seen: Seen,
    /// Points that other blocks have as well.
    repeated: usize,
}

/// The crossed cells of blocks.
fn crossed(survey: &Survey, blocks: &[Block]) -> Result<Part, PolygonizeError> {
    let mut part = Part {
        cells: Vec::new(),
        values: Vec::new(),
        seen: Seen::default(),
        repeated: 0,
    };
    let ghosts = survey.grid.ghosts as u32;
    for block in blocks {
        // Past the last real cell.
        let end = [0, 1, 2].map(|axis| {
            let last = survey.cells(axis) - ghosts;
            (block.low[axis] + block.size).min(last)
        });
        let [width, height, depth] = [0, 1, 2].map(|axis| end[axis] - block.low[axis] + 1);
        let at = |[x, y, z]: [u32; 3]| ((z * height + y) * width + x) as usize;
        let points: Vec<Index> = offsets([width, height, depth])
            .map(|offset| [0, 1, 2].map(|axis| block.low[axis] + offset[axis]))
            .collect();
        let values = survey.evaluated(&points)?;
        for offset in offsets([width - 1, height - 1, depth - 1]) {
            let values: [f64; 8] = std::array::from_fn(|c| values[at(corner(offset, c))]);
            if values
                .iter()
                .any(|&value| (value < 0.0) != (values[0] < 0.0))
            {
                part.cells
                    .push([0, 1, 2].map(|axis| block.low[axis] + offset[axis]));
                part.values.push(values);
            }
        }
        let is_own = |point: &Index| {
            let last = |axis: usize| survey.cells(axis) - ghosts;
            (0..3).all(|axis| point[axis] < end[axis] || end[axis] == last(axis))
        };
        let own = points
            .iter()
            .zip(&values)
            .filter(|(point, _)| is_own(point));
        let own: Vec<f64> = own.map(|(_, &value)| value).collect();
        part.seen = part.seen.and(Seen::of_values(&own));
        part.repeated += values.len() - own.len();
    }
    Ok(part)
}

/// All indices below these, the first fastest.
fn offsets([x, y, z]: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
    (0..z).flat_map(move |k| (0..y).flat_map(move |j| (0..x).map(move |i| [i, j, k])))
}

/// The blocks that are not proven to be inside or outside. Of a field that cannot be enclosed
/// these are all.
fn undecided(survey: &Survey) -> Result<Vec<Block>, PolygonizeError> {
    let job = survey.job;
    let ghosts = survey.grid.ghosts as u32;
    let ends = [0, 1, 2].map(|axis| survey.cells(axis) - ghosts);
    let longest = ends.into_iter().max().unwrap_or(1);
    let mut size = BLOCK;
    while size < longest {
        size *= 2;
    }
    let mut blocks = vec![Block {
        low: [ghosts; 3],
        size,
    }];
    loop {
        blocks = blocks
            .par_chunks(CHUNK)
            .flat_map_iter(|blocks| open(survey, blocks, ends))
            .collect();
        if job.monitor.cancelled() {
            return Err(PolygonizeError::Cancelled);
        }
        job.monitor.progress("looking for seeds", 0.0);
        if size == BLOCK {
            return Ok(blocks);
        }
        size /= 2;
        let children = |block: Block| {
            (0..8).map(move |number| {
                Block {
                    low: corner([0; 3], number).map(|bit| bit * size),
                    size,
                }
                .moved(block.low)
            })
        };
        let within = |block: &Block| (0..3).all(|axis| block.low[axis] < ends[axis]);
        blocks = blocks
            .into_iter()
            .flat_map(children)
            .filter(within)
            .collect();
    }
}

impl Block {
    fn moved(self, by: Index) -> Block {
        Block {
            low: [0, 1, 2].map(|axis| self.low[axis] + by[axis]),
            ..self
        }
    }
}

/// Those of some blocks that are not decided.
fn open(survey: &Survey, blocks: &[Block], ends: Index) -> Vec<Block> {
    let job = survey.job;
    let Some(field) = job.field.compiled() else {
        return blocks.to_vec();
    };
    if job.monitor.cancelled() {
        return Vec::new();
    }
    let coordinates = &survey.grid.coordinates;
    let point = |index: Index| {
        DVec3::from_array([0, 1, 2].map(|axis| coordinates[axis][index[axis] as usize]))
    };
    let boxes: Vec<[DVec3; 2]> = blocks
        .iter()
        .map(|block| {
            let high = [0, 1, 2].map(|axis| (block.low[axis] + block.size).min(ends[axis]));
            [point(block.low), point(high)]
        })
        .collect();
    let colours = classify(field, job.accuracy.iso, &boxes);
    let undecided = blocks.iter().zip(colours);
    undecided
        .filter(|(_, (colour, _))| *colour == Colour::Boundary)
        .map(|(block, _)| *block)
        .collect()
}

/// For every given seed its cell, if the level set crosses it, or the nearest crossed cell on the
/// six rays along the axes from the cell's corner next to the seed.
pub(super) fn given(survey: &mut Survey) -> Result<Vec<Index>, PolygonizeError> {
    let mut cells = Vec::new();
    for &seed in &survey.job.options.seeds {
        let cell = [0, 1, 2].map(|axis| cell_along(survey, axis, seed[axis]));
        survey.learn((0..8).map(|number| corner(cell, number)))?;
        let case = survey.case(cell);
        if case != 0 && case != 255 {
            cells.push(cell);
            continue;
        }
        let found = shoot(survey, cell)?;
        cells.push(found.ok_or(PolygonizeError::LostSeed { seed })?);
    }
    Ok(cells)
}

/// The index of the real cell that holds a coordinate.
fn cell_along(survey: &Survey, axis: usize, coordinate: f64) -> u32 {
    let ghosts = survey.grid.ghosts;
    let along = &survey.grid.coordinates[axis];
    let real = &along[ghosts..along.len() - ghosts];
    let above = real.partition_point(|&own| own <= coordinate);
    (above.clamp(1, real.len() - 1) - 1 + ghosts) as u32
}

/// The nearest cell with a crossed edge on the rays from a cell's lowest corner along the axes.
fn shoot(survey: &mut Survey, start: Index) -> Result<Option<Index>, PolygonizeError> {
    let mut nearest: Option<(f64, Index)> = None;
    for axis in 0..3 {
        let point = |index: u32| {
            let mut point = start;
            point[axis] = index;
            point
        };
        let ghosts = survey.grid.ghosts as u32;
        let real = ghosts..=survey.cells(axis) - ghosts;
        survey.learn(real.clone().map(point))?;
        for cell in ghosts..survey.cells(axis) - ghosts {
            let inside = |index: u32| survey.value(point(index)) < 0.0;
            if inside(cell) == inside(cell + 1) {
                continue;
            }
            let along = &survey.grid.coordinates[axis];
            let ends = [cell, cell + 1].map(|index| along[index as usize]);
            let from = along[start[axis] as usize];
            let distance = ends
                .map(|end| (end - from).abs())
                .into_iter()
                .fold(f64::INFINITY, f64::min);
            if nearest.is_none_or(|(least, _)| distance < least) {
                nearest = Some((distance, point(cell)));
            }
        }
    }
    Ok(nearest.map(|(_, cell)| cell))
}
