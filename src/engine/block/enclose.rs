//! Enclosures of many boxes at once: a tape over intervals.
//!
//! The steps are those of the graph itself, in which every operation keeps its own interval rule;
//! lowered ones would enclose less tightly.

use super::bounds::{Bounds, BoundsBlock};
use super::number::{LANES, Number};
use super::{Kernels, LARGEST_MEMORY, run_block};
use crate::engine::lower::{self, Lowered, Operand};
use crate::engine::tape::{self, Tape};
use crate::graph::interval::Enclosure;
use crate::graph::{Graph, Interval, NodeId};

/// What encloses some roots of a graph.
pub(in crate::engine) struct Enclosures {
    lowered: Lowered,
    tape: Tape,
}

impl Enclosures {
    /// For these roots, as functions of so many coordinates and parameters.
    pub(in crate::engine) fn new(
        graph: &Graph,
        roots: &[NodeId],
        (dimension, parameters): (usize, usize),
    ) -> Enclosures {
        let lowered = lower::list(graph, roots, dimension, parameters);
        let tape = tape::assemble(&lowered);
        Enclosures { lowered, tape }
    }

    /// All outputs over as many boxes as the shortest column has; a missing column has none.
    /// Returns false, with the outputs as they were, if the tape is too large to run.
    pub(in crate::engine) fn run(
        &self,
        kernels: Kernels,
        sides: &[&[Interval]],
        q: &[f64],
        outputs: &mut [&mut [Enclosure]],
    ) -> bool {
        let (dimension, results) = (self.lowered.dimension, self.lowered.outputs.len());
        if self.tape.registers * size_of::<BoundsBlock>() > LARGEST_MEMORY {
            return false;
        }
        if sides.len() < dimension || outputs.len() < results {
            return true;
        }
        let (sides, outputs) = (&sides[..dimension], &mut outputs[..results]);
        let lengths = sides.iter().map(|column| column.len());
        let lengths = lengths.chain(outputs.iter().map(|column| column.len()));
        let count = lengths.min().unwrap_or(0);
        let scalars = self.scalars(q);
        let memory = self.tape.registers + dimension + results;
        Bounds::with_memory(memory, |memory| {
            let (registers, columns) = memory.split_at_mut(self.tape.registers);
            let (points, found) = columns.split_at_mut(dimension);
            for start in (0..count).step_by(LANES) {
                let lanes = LANES.min(count - start);
                for (block, column) in points.iter_mut().zip(sides) {
                    for (lane, &side) in column[start..start + lanes].iter().enumerate() {
                        Bounds::set(block, lane, Enclosure::of_interval(side).into());
                    }
                }
                run_block(&self.tape, kernels, points, &scalars, registers, found);
                for (block, column) in found.iter().zip(outputs.iter_mut()) {
                    for (lane, enclosure) in column[start..start + lanes].iter_mut().enumerate() {
                        *enclosure = Bounds::get(block, lane).into();
                    }
                }
            }
        });
        true
    }

    /// What is the same for all boxes.
    fn scalars(&self, q: &[f64]) -> Vec<Bounds> {
        scalars(&self.lowered, q, &self.tape.constants)
    }
}

/// The bounds of what is the same for all boxes: parameters, what depends on them alone, and
/// constants. A missing parameter is NaN.
pub(in crate::engine) fn scalars(lowered: &Lowered, q: &[f64], constants: &[f64]) -> Vec<Bounds> {
    let parameters = (0..lowered.parameters)
        .map(|place| Enclosure::of_number(q.get(place).copied().unwrap_or(f64::NAN)));
    let mut uniforms: Vec<Enclosure> = parameters.collect();
    for step in &lowered.uniform_steps {
        let operands = step.operands.map(|operand| match operand {
            Operand::Uniform(index) => uniforms[index as usize],
            Operand::Constant(number) => Enclosure::of_number(number),
            // Neither occurs in what depends on q alone.
            Operand::Coordinate(_) | Operand::Register(_) => Enclosure::of_number(f64::NAN),
        });
        let rule = step.operation.operation().interval;
        uniforms.push(rule(&operands[..step.operands().len()]));
    }
    uniforms.extend(constants.iter().map(|&number| Enclosure::of_number(number)));
    uniforms.into_iter().map(Bounds::from).collect()
}
