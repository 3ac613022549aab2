//! Runs a tape over columns of blocks.
//!
//! A pass takes as many blocks at a time as fit the cache and runs every instruction over all of
//! them before the next one: what an instruction costs besides its arithmetic is shared by their
//! lanes. All functions are inlined into those of [`super::dispatch`], which choose the processor
//! features that they are compiled for.

use super::number::Number;
use super::table;
use crate::engine::tape::{Instruction, Place, Source, Tape};

/// What a tape reads and writes, in blocks: a column per coordinate and per output, of equal
/// lengths.
pub(in crate::engine) struct Columns<'a, 'b, N: Number> {
    /// The coordinates.
    pub(in crate::engine) points: &'a [&'a [N::Block]],
    /// The numbers that are the same for all points.
    pub(in crate::engine) scalars: &'a [N],
    /// The results.
    pub(in crate::engine) outputs: &'a mut [&'b mut [N::Block]],
}

/// Runs the tape on all blocks of the columns, `group` at a time.
#[inline(always)]
pub(super) fn run<N: Number>(
    tape: &Tape,
    group: usize,
    registers: &mut [N::Block],
    columns: &mut Columns<'_, '_, N>,
) {
    let blocks = columns.outputs.first().map_or(0, |column| column.len());
    let mut first = 0;
    while first < blocks {
        let count = group.min(blocks - first);
        pass(tape, first, count, registers, columns);
        first += count;
    }
}

/// Runs the tape on the blocks from `first` on.
#[inline(always)]
fn pass<N: Number>(
    tape: &Tape,
    first: usize,
    count: usize,
    registers: &mut [N::Block],
    columns: &mut Columns<'_, '_, N>,
) {
    let mut points: [&[N::Block]; 3] = [&[]; 3];
    for (point, column) in points.iter_mut().zip(columns.points) {
        *point = &column[first..first + count];
    }
    for instruction in &tape.instructions {
        let outputs = &mut *columns.outputs;
        let (out, sources) = operands(
            instruction,
            points,
            columns.scalars,
            count,
            registers,
            |output| &mut outputs[output][first..first + count],
        );
        table::execute(instruction, out, &sources);
    }
    for &(output, place) in &tape.copies {
        let column = &mut columns.outputs[output as usize][first..first + count];
        match place {
            Place::Scalar(index) => column.fill(columns.scalars[index as usize].splat()),
            Place::Coordinate(axis) => column.copy_from_slice(points[usize::from(axis)]),
            Place::Register(register) => {
                let start = register as usize * count;
                column.copy_from_slice(&registers[start..start + count]);
            }
        }
    }
}

/// The `count` blocks that an instruction writes, which are `output`'s or a register's, and where it
/// finds its operands. `points` has as many blocks.
#[inline(always)]
pub(super) fn operands<'a, N: Number>(
    instruction: &Instruction,
    points: [&'a [N::Block]; 3],
    scalars: &'a [N],
    count: usize,
    registers: &'a mut [N::Block],
    output: impl FnOnce(usize) -> &'a mut [N::Block],
) -> (&'a mut [N::Block], Sources<'a, N>) {
    let mut sources = Sources {
        points,
        scalars,
        below: &[],
        above: &[],
        hole: instruction.out,
        count,
    };
    let out = match instruction.output() {
        Some(place) => {
            // No register is written, so all are below the hole.
            sources.below = registers;
            output(place)
        }
        None => {
            let start = instruction.out as usize * count;
            let (below, rest) = registers.split_at_mut(start);
            let (out, above) = rest.split_at_mut(count);
            (sources.below, sources.above) = (below, above);
            out
        }
    };
    (out, sources)
}

/// Where an instruction finds its operands.
pub(super) struct Sources<'a, N: Number> {
    points: [&'a [N::Block]; 3],
    scalars: &'a [N],
    /// The registers below the one that is written, `count` blocks each.
    below: &'a [N::Block],
    /// The registers above it.
    above: &'a [N::Block],
    /// The register that is written. It is no operand of the same instruction.
    hole: u32,
    count: usize,
}

impl<'a, N: Number> Sources<'a, N> {
    /// The lanes of an operand.
    #[inline(always)]
    pub(super) fn lanes(&self, source: Source) -> Lanes<'a, N> {
        let blocks = match source.coordinate() {
            Some(axis) => self.points[axis],
            None if source.0 < self.hole => {
                let start = source.0 as usize * self.count;
                &self.below[start..start + self.count]
            }
            None => {
                let start = (source.0 - self.hole - 1) as usize * self.count;
                &self.above[start..start + self.count]
            }
        };
        Lanes(blocks)
    }

    /// An operand that is the same for all points.
    #[inline(always)]
    pub(super) fn scalar(&self, source: Source) -> Scalar<N> {
        Scalar(self.scalars[source.0 as usize])
    }
}

/// An operand with a number for every point.
#[derive(Clone, Copy)]
pub(super) struct Lanes<'a, N: Number>(&'a [N::Block]);

impl<'a, N: Number> Lanes<'a, N> {
    /// One of its blocks.
    #[inline(always)]
    pub(super) fn block(self, index: usize) -> Block<'a, N> {
        Block(&self.0[index])
    }
}

/// A block of an operand.
#[derive(Clone, Copy)]
pub(super) struct Block<'a, N: Number>(pub(super) &'a N::Block);

impl<N: Number> Block<'_, N> {
    /// The number in one lane.
    #[inline(always)]
    pub(super) fn lane(self, lane: usize) -> N {
        N::get(self.0, lane)
    }
}

/// An operand that is the same for all points.
#[derive(Clone, Copy)]
pub(super) struct Scalar<N>(pub(super) N);

impl<N: Number> Scalar<N> {
    /// The same for any block.
    #[inline(always)]
    pub(super) fn block(self, _: usize) -> Scalar<N> {
        self
    }

    /// The number.
    #[inline(always)]
    pub(super) fn lane(self, _: usize) -> N {
        self.0
    }
}
