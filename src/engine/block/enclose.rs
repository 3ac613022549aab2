//! Enclosures of boxes, one or many: a tape over intervals.
//!
//! The steps are those of the graph itself, in which every operation keeps its own interval rule;
//! lowered ones would enclose less tightly. Boxes are taken in blocks, so a result does not
//! depend on how many there are.

use super::bounds::{BOXES, Bounds, BoundsBlock};
use super::execute::Columns;
use super::number::Number;
use super::{CACHE, Kernels, LARGEST_MEMORY, dispatch};
use crate::engine::lower::{self, Lowered, Operand};
use crate::engine::tape::{self, Tape};
use crate::graph::interval::Enclosure;
use crate::graph::{Graph, Interval, NodeId};

/// The most blocks that are computed at a time.
const LARGEST_GROUP: usize = 4;

/// The outputs of one run that need no allocation.
const FEW: usize = 4;

/// What encloses some roots of a graph.
pub(in crate::engine) struct Enclosures {
    lowered: Lowered,
    tape: Tape,
    constants: Vec<Bounds>,
}

/// What is the same for all boxes: the parameters, what depends on them alone, and constants.
#[derive(Clone)]
pub(in crate::engine) struct Scalars(Vec<Bounds>);

impl Enclosures {
    /// For these roots, as functions of so many coordinates and parameters.
    pub(in crate::engine) fn new(
        graph: &Graph,
        roots: &[NodeId],
        (dimension, parameters): (usize, usize),
    ) -> Enclosures {
        let lowered = lower::list(graph, roots, dimension, parameters);
        let tape = tape::assemble(&lowered);
        let constants = tape.constants.iter();
        Enclosures {
            constants: constants
                .map(|&number| Enclosure::of_number(number).into())
                .collect(),
            lowered,
            tape,
        }
    }

    /// With these values of the first parameters and ranges of those that follow; what is missing
    /// is undefined.
    pub(in crate::engine) fn scalars(&self, q: &[f64], ranges: &[Enclosure]) -> Scalars {
        let numbers = q.iter().map(|&number| Enclosure::of_number(number));
        let mut uniforms: Vec<Enclosure> = numbers
            .chain(ranges.iter().copied())
            .take(self.lowered.parameters)
            .collect();
        uniforms.resize(self.lowered.parameters, Enclosure::of_number(f64::NAN));
        for step in &self.lowered.uniform_steps {
            let operands = step.operands.map(|operand| match operand {
                Operand::Uniform(index) => uniforms[index as usize],
                Operand::Constant(number) => Enclosure::of_number(number),
                // Neither occurs in what depends on q alone.
                Operand::Coordinate(_) | Operand::Register(_) => Enclosure::of_number(f64::NAN),
            });
            let rule = step.operation.operation().interval;
            uniforms.push(rule(&operands[..step.operands().len()]));
        }
        let mut scalars: Vec<Bounds> = uniforms.into_iter().map(Bounds::from).collect();
        scalars.extend(&self.constants);
        Scalars(scalars)
    }

    /// All outputs over as many boxes as the shortest column has; a missing column has none.
    /// Returns false, with the outputs as they were, if the tape is too large to run.
    pub(in crate::engine) fn run(
        &self,
        kernels: Kernels,
        sides: &[&[Interval]],
        scalars: &Scalars,
        outputs: &mut [&mut [Enclosure]],
    ) -> bool {
        let (dimension, results) = (self.lowered.dimension, self.lowered.outputs.len());
        let block = self.tape.registers * size_of::<BoundsBlock>();
        if block > LARGEST_MEMORY {
            return false;
        }
        if sides.len() < dimension || outputs.len() < results {
            return true;
        }
        let (sides, outputs) = (&sides[..dimension], &mut outputs[..results]);
        let lengths = sides.iter().map(|column| column.len());
        let lengths = lengths.chain(outputs.iter().map(|column| column.len()));
        let count = lengths.min().unwrap_or(0);
        let blocks = count.div_ceil(BOXES);
        let group = (CACHE / block.max(1)).clamp(1, LARGEST_GROUP).min(blocks);
        let registers = group * self.tape.registers;
        Bounds::with_memory(registers + group * (dimension + results), |memory| {
            let (registers, columns) = memory.split_at_mut(registers);
            let (points, found) = columns.split_at_mut(group * dimension);
            for start in (0..count).step_by(group * BOXES) {
                let part = start..count.min(start + group * BOXES);
                for (blocks, column) in points.chunks_exact_mut(group).zip(sides) {
                    load(blocks, &column[part.clone()]);
                }
                let blocks = part.len().div_ceil(BOXES);
                self.run_group(kernels, (group, blocks), points, scalars, registers, found);
                for (blocks, column) in found.chunks_exact(group).zip(outputs.iter_mut()) {
                    store(&mut column[part.clone()], blocks);
                }
            }
        });
        true
    }

    /// Runs the tape on the first blocks of columns that have `group` each.
    fn run_group(
        &self,
        kernels: Kernels,
        (group, blocks): (usize, usize),
        points: &[BoundsBlock],
        scalars: &Scalars,
        registers: &mut [BoundsBlock],
        found: &mut [BoundsBlock],
    ) {
        let mut coordinates: [&[BoundsBlock]; 3] = [&[]; 3];
        for (coordinate, column) in coordinates.iter_mut().zip(points.chunks_exact(group)) {
            *coordinate = &column[..blocks];
        }
        let mut few: [&mut [BoundsBlock]; FEW] = Default::default();
        let mut many: Vec<&mut [BoundsBlock]>;
        let found = found
            .chunks_exact_mut(group)
            .map(|column| &mut column[..blocks]);
        let outputs = if found.len() <= FEW {
            let count = found.len();
            for (few, column) in few.iter_mut().zip(found) {
                *few = column;
            }
            &mut few[..count]
        } else {
            many = found.collect();
            &mut many[..]
        };
        let mut columns = Columns {
            points: &coordinates[..self.lowered.dimension],
            scalars: &scalars.0,
            outputs,
        };
        dispatch::run(kernels, &self.tape, blocks, registers, &mut columns);
    }
}

/// Puts sides into lanes. Lanes that are left over repeat the last side: they cost what it costs.
fn load(blocks: &mut [BoundsBlock], sides: &[Interval]) {
    let (whole, rest) = sides.as_chunks::<BOXES>();
    let mut blocks = blocks.iter_mut();
    // The chunks first: a zip that ends asks its first part once more.
    for (sides, block) in whole.iter().zip(blocks.by_ref()) {
        for lane in 0..BOXES {
            Bounds::set(block, lane, Bounds::of_side(sides[lane]));
        }
    }
    if let (Some(block), Some(&last)) = (blocks.next(), rest.last()) {
        for lane in 0..BOXES {
            let side = rest.get(lane).copied().unwrap_or(last);
            Bounds::set(block, lane, Bounds::of_side(side));
        }
    }
}

/// Takes enclosures from lanes.
fn store(enclosures: &mut [Enclosure], blocks: &[BoundsBlock]) {
    for (enclosures, block) in enclosures.chunks_mut(BOXES).zip(blocks) {
        for (lane, enclosure) in enclosures.iter_mut().enumerate() {
            *enclosure = Bounds::get(block, lane).into();
        }
    }
}
