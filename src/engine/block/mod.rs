//! The block tier: runs a tape instruction by instruction over blocks of points in the cache.
//!
//! Nothing is compiled at run time, so it serves where machine code cannot be made, and it is
//! faster than machine code for many points, because its vectors are as wide as the processor's.
//! [`table`] is the list of kernels with their formulas, written for any [`number::Number`];
//! [`execute`] walks over tape and blocks; [`dispatch`] compiles both for several instruction sets
//! and holds the tier's only `unsafe`, the calls into those. [`bounds`] makes enclosures a number
//! of tapes, [`choices`] runs them over boxes and records which of their operands choices take
//! there, and [`enclose`] is what encloses a field over any number of boxes.
//!
//! On f64 the results are those of the interpreter, to the last bit, whatever the instruction set
//! and the length of a batch. On f32 every operation rounds to f32.

mod bounds;
mod choices;
mod dispatch;
mod enclose;
mod execute;
mod number;
mod table;

use super::tape::Tape;
pub(super) use bounds::{Bounds, BoundsBlock};
pub(super) use choices::{Choice, Decision, Pass};
pub use dispatch::Kernels;
pub(super) use enclose::{Enclosures, Scalars, scalars as scalar_bounds};
use execute::Columns;
pub(super) use number::{LANES, Number, lend};
pub(super) use table::{Code, Kernel, Kind, single};

/// The bytes that the registers of a group of blocks may fill: a part of the second-level cache.
/// The first level would be too small for what matters more in a long tape: that the jump to the
/// next instruction, which the processor does not foresee there, is shared by many lanes. (A tape
/// of 4,400 instructions on 128 registers is 2.3 to 2.7 times faster with eight blocks at a time
/// than with one.)
const CACHE: usize = 1 << 19;

/// The most blocks that are computed at a time.
const LARGEST_GROUP: usize = 8;

/// As many columns of outputs as need no allocation.
const FEW: usize = 4;

/// The bytes of registers beyond which a tape is not run.
pub(super) const LARGEST_MEMORY: usize = 1 << 28;

/// A floating-point number: f64 or f32, whose blocks are arrays.
pub(super) trait Float: Number<Block = [Self; LANES]> + Default {}

impl Float for f64 {}
impl Float for f32 {}

/// Runs the tape at the first `count` points of the columns, which all have as many. `scalars` is
/// what the tape's instructions refer to as such. Returns false, and does nothing, if the tape
/// needs too much memory.
pub(super) fn run<T: Float>(
    tape: &Tape,
    kernels: Kernels,
    count: usize,
    points: &[&[T]],
    scalars: &[T],
    outputs: &mut [&mut [T]],
) -> bool {
    let block = tape.registers * size_of::<T::Block>();
    if block > LARGEST_MEMORY {
        return false;
    }
    let most = (count / LANES).clamp(1, LARGEST_GROUP);
    let group = (CACHE / block.max(1)).clamp(1, most);
    let whole = count / LANES * LANES;
    let rest = count - whole;
    let remainder = if rest > 0 {
        points.len() + outputs.len()
    } else {
        0
    };
    T::with_memory(group * tape.registers + remainder, |memory| {
        let (registers, buffers) = memory.split_at_mut(group * tape.registers);
        if whole > 0 {
            let mut inputs: [&[T::Block]; 3] = [&[]; 3];
            for (input, column) in inputs.iter_mut().zip(points) {
                *input = column[..whole].as_chunks().0;
            }
            let results = outputs.iter_mut();
            let results = results.map(|column| column[..whole].as_chunks_mut().0);
            let mut run = |outputs: &mut [&mut [T::Block]]| {
                let mut columns = Columns {
                    points: &inputs[..points.len()],
                    scalars,
                    outputs,
                };
                dispatch::run(kernels, tape, group, registers, &mut columns);
            };
            // Values and gradients need no allocation.
            let mut few: [&mut [T::Block]; FEW] = Default::default();
            if results.len() <= FEW {
                let count = results.len();
                few.iter_mut()
                    .zip(results)
                    .for_each(|(few, result)| *few = result);
                run(&mut few[..count]);
            } else {
                let mut many: Vec<&mut [T::Block]> = results.collect();
                run(&mut many);
            }
        }
        if rest > 0 {
            let range = whole..count;
            let (inputs, results) = buffers.split_at_mut(points.len());
            for (block, column) in inputs.iter_mut().zip(points) {
                // The lanes that are left over hold numbers of earlier calls; nobody reads what
                // becomes of them.
                block[..rest].copy_from_slice(&column[range.clone()]);
            }
            run_block(tape, kernels, inputs, scalars, registers, results);
            for (block, column) in results.iter().zip(outputs) {
                column[range.clone()].copy_from_slice(&block[..rest]);
            }
        }
    });
    true
}

/// Runs the tape on one block.
fn run_block<N: Number>(
    tape: &Tape,
    kernels: Kernels,
    points: &[N::Block],
    scalars: &[N],
    registers: &mut [N::Block],
    results: &mut [N::Block],
) {
    let mut inputs: [&[N::Block]; 3] = [&[]; 3];
    for (input, point) in inputs.iter_mut().zip(points) {
        *input = std::slice::from_ref(point);
    }
    let mut run = |outputs: &mut [&mut [N::Block]]| {
        let mut columns = Columns {
            points: &inputs[..points.len()],
            scalars,
            outputs,
        };
        dispatch::run(kernels, tape, 1, registers, &mut columns);
    };
    let count = results.len();
    let results = results.iter_mut().map(std::slice::from_mut);
    let mut few: [&mut [N::Block]; FEW] = Default::default();
    if count <= FEW {
        few.iter_mut()
            .zip(results)
            .for_each(|(few, result)| *few = result);
        run(&mut few[..count]);
    } else {
        let mut many: Vec<&mut [N::Block]> = results.collect();
        run(&mut many);
    }
}

/// Runs a tape without outputs on the first block of the columns: from registers to registers.
/// `idle` is a block to which nothing is written.
pub(super) fn run_on_registers<N: Number>(
    tape: &Tape,
    kernels: Kernels,
    points: &[&[N::Block]],
    registers: &mut [N::Block],
    idle: &mut N::Block,
) {
    let mut columns = Columns::<'_, '_, N> {
        points,
        scalars: &[],
        outputs: &mut [std::slice::from_mut(idle)],
    };
    dispatch::run(kernels, tape, 1, registers, &mut columns);
}
