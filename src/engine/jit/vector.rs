//! Machine code for many points: loops over vectors of 128 bits by Cranelift ([`super::translate`]),
//! or of 256 or 512 bits on x86-64 ([`super::wide`]).
//!
//! A kernel runs in stages (see [`super::stages`]) over blocks of 64 points: chunks of code, and
//! groups of functions by the block tier's kernels. A kernel that is one chunk runs over all points at once. On f64 the bits are those of the
//! interpreter, on f32 those of the block tier.
//!
//! Compiling by Cranelift costs about as much as for single points: on a busy machine 12 to 20 ms
//! per 1,000 steps. Wide code costs about a hundredth.

mod functions;

use super::chunk::Lengths;
use super::emit::Lanes;
use super::memory::FreeingModule;
use super::stages::{self, Stage, Stages};
use super::translate::Source;
use super::{Refusal, check_size, wide};
use crate::engine::block::{self, Kernels, LANES};
use crate::engine::lower::{Lowered, Operand};
use crate::engine::tape::Tape;
use functions::{Filled, functions};

/// A number of which machine code computes several at a time.
pub(in crate::engine) trait Vectorised: block::Float {
    /// How many, in Cranelift's code.
    const VECTOR: VectorLanes;

    /// Whether it is f64.
    const IS_F64: bool;

    /// A constant of the steps in this type, rounded to nearest.
    fn rounded(number: f64) -> Self;
}

/// [`Lanes`] for those who need not know what they are.
pub(in crate::engine) struct VectorLanes(Lanes);

impl Vectorised for f64 {
    const VECTOR: VectorLanes = VectorLanes(Lanes::Two);
    const IS_F64: bool = true;

    fn rounded(number: f64) -> f64 {
        number
    }
}

impl Vectorised for f32 {
    const VECTOR: VectorLanes = VectorLanes(Lanes::Four);
    const IS_F64: bool = false;

    fn rounded(number: f64) -> f32 {
        number as f32
    }
}

/// A chunk of code; see [`super::translate`].
type VectorFunction<T> = unsafe extern "C" fn(
    begin: usize,
    end: usize,
    inputs: *const *const T,
    uniforms: *const T,
    outputs: *const *mut T,
    slots: *mut T,
    constants: *const T,
);

/// What [`VectorCode`] executes, in order.
enum Part<T> {
    Code(VectorFunction<T>),
    /// A tape whose registers are the slots.
    Functions(Tape),
}

/// The machine code of one kernel for many points. Without state, like [`super::MachineCode`].
pub(in crate::engine) struct VectorCode<T> {
    parts: Vec<Part<T>>,
    /// Those of the functions between its parts.
    kernels: Kernels,
    /// The lanes of its vectors.
    lanes: usize,
    /// How often each uniform stands in the table of uniforms: once or for every lane.
    copies: usize,
    /// The constants, each for every lane; wide code has its own.
    constants: Vec<T>,
    /// Slots that are filled with a number that is the same for all points.
    filled: Vec<(u32, Operand)>,
    /// The lengths that `run` demands.
    inputs: usize,
    uniforms: usize,
    outputs: usize,
    slots: usize,
    /// Owns the memory of the code; it is freed with this value, when nobody can call it.
    _module: FreeingModule,
}

/// Of Cranelift's code. Measured with 100 spheres (1,015 steps) in f32: chunks of 32 and 64 steps
/// take 53 ns a point, of 128 steps 62; with a picture of 6,345 steps all three are level.
const LENGTHS: Lengths = Lengths {
    whole: 256,
    chunk: 64,
};

/// Of wide code.
const WIDE_LENGTHS: Lengths = Lengths {
    whole: 4096,
    chunk: 2048,
};

/// The most memory for slots, in bytes.
const LARGEST_MEMORY: usize = 1 << 28;

/// Whether code for these kernels is made in a moment, of vectors wider than 128 bits.
pub(in crate::engine) fn are_wide(kernels: Kernels) -> bool {
    wide::vectors(kernels, true).is_some()
}

/// Compiles a kernel for many points, in vectors of these kernels' width or a narrower one.
pub(in crate::engine) fn compile<T: Vectorised>(
    lowered: &Lowered,
    kernels: Kernels,
) -> Result<VectorCode<T>, Refusal> {
    let lengths = match wide::vectors(kernels, T::IS_F64) {
        Some(_) => WIDE_LENGTHS,
        None => LENGTHS,
    };
    super::remember(compile_with(lowered, kernels, lengths))
}

/// Compiles a kernel in functions of these lengths.
fn compile_with<T: Vectorised>(
    lowered: &Lowered,
    kernels: Kernels,
    lengths: Lengths,
) -> Result<VectorCode<T>, Refusal> {
    let target = super::target().ok_or(Refusal::Processor)?;
    check_size(lowered)?;
    let Stages {
        lowered,
        mut plan,
        stages,
        constants,
    } = stages::stages(lowered, lengths);
    let mut filled = Filled::default();
    let mut tapes = Vec::new();
    for (stage, range) in stages.iter().zip(plan.chunks.clone()) {
        if *stage == Stage::Functions {
            tapes.push(functions(&lowered, range, &mut plan, &mut filled));
        }
    }
    if plan.slots * size_of::<T::Block>() > LARGEST_MEMORY {
        return Err(Refusal::TooLarge);
    }
    let mut owner = FreeingModule::new(super::builder(target.clone()));
    let module = owner.module().ok_or(Refusal::Processor)?;
    let code = (0..stages.len()).filter(|&stage| stages[stage] == Stage::Code);
    let vectors = wide::vectors(kernels, T::IS_F64);
    let code = match vectors {
        Some(vectors) => wide::define(module, &lowered, &mut plan, vectors, code)?,
        None => {
            let source = Source {
                lowered: &lowered,
                plan: &plan,
                lanes: T::VECTOR.0,
            };
            super::define(module, source, code)?
        }
    };
    module.finalize_definitions()?;
    let mut code = code.into_iter().map(|function| {
        let address = module.get_finalized_function(function);
        // SAFETY: the address is that of a finished function, which `translate` or `wide` gave
        // exactly this signature and the calling convention of `extern "C"`.
        Part::Code(unsafe { std::mem::transmute::<*const u8, VectorFunction<T>>(address) })
    });
    let mut tapes = tapes.into_iter().map(Part::Functions);
    let parts = stages.into_iter().filter_map(|stage| match stage {
        Stage::Code => code.next(),
        Stage::Functions => tapes.next(),
    });
    let parts = parts.collect();
    let (lanes, copies, constants) = match vectors {
        Some(vectors) => (
            vectors.bytes() / size_of::<T>(),
            vectors.copies(),
            Vec::new(),
        ),
        None => {
            let lanes = 16 / size_of::<T>();
            let constants = constants.iter().map(|&number| T::rounded(number));
            let constants = constants.flat_map(|number| std::iter::repeat_n(number, lanes));
            (lanes, lanes, constants.collect())
        }
    };
    Ok(VectorCode {
        parts,
        kernels,
        lanes,
        copies,
        constants,
        filled: filled.list,
        inputs: lowered.dimension,
        uniforms: lowered.uniforms(),
        outputs: lowered.outputs.len(),
        slots: plan.slots,
        _module: owner,
    })
}

/// What all parts of a run share.
struct Run<'a, T> {
    points: &'a [&'a [T]],
    inputs: [*const T; 3],
    outputs: &'a [*mut T],
    /// The uniforms, each as often as the code wants it.
    uniforms: *const T,
    kernels: Kernels,
}

impl<T: Vectorised> VectorCode<T> {
    /// Computes the outputs of `count` points, of which 64 at a time are best. Returns whether it
    /// did: not if a column of the points or of the outputs is missing or shorter than `count`, or
    /// if uniforms are missing.
    pub(in crate::engine) fn run(
        &self,
        count: usize,
        points: &[&[T]],
        uniforms: &[T],
        outputs: &mut [&mut [T]],
    ) -> bool {
        let (Some(points), Some(outputs), Some(uniforms)) = (
            points.get(..self.inputs),
            outputs.get_mut(..self.outputs),
            uniforms.get(..self.uniforms),
        ) else {
            return false;
        };
        if points.iter().any(|column| column.len() < count)
            || outputs.iter().any(|column| column.len() < count)
        {
            return false;
        }
        let step = match self.parts.len() {
            1 => self.lanes,
            _ => LANES,
        };
        let whole = count / step * step;
        let table = (uniforms.len() * self.copies).div_ceil(LANES);
        let columns = match count - whole {
            0 => 0,
            _ => self.inputs + self.outputs,
        };
        T::with_memory(table + 1 + self.slots + columns, |memory| {
            let (table, memory) = memory.split_at_mut(table);
            let (slots, columns) = memory.split_at_mut(1 + self.slots);
            self.fill(table, slots, uniforms);
            let table = table.as_flattened().as_ptr();
            if whole > 0 {
                self.run_whole(whole, points, table, outputs, slots);
            }
            if whole < count {
                self.run_rest(whole..count, points, table, outputs, (slots, columns));
            }
        });
        true
    }

    /// Puts what is the same for all points where code and functions look for it.
    fn fill(&self, table: &mut [T::Block], slots: &mut [T::Block], uniforms: &[T]) {
        let lanes = table.as_flattened_mut().chunks_exact_mut(self.copies);
        for (vector, &uniform) in lanes.zip(uniforms) {
            vector.fill(uniform);
        }
        for &(slot, operand) in &self.filled {
            let number = match operand {
                Operand::Constant(number) => T::rounded(number),
                Operand::Uniform(index) => uniforms[index as usize],
                // Only numbers that are the same for all points are filled in.
                Operand::Coordinate(_) | Operand::Register(_) => continue,
            };
            slots[slot as usize] = number.splat();
        }
    }

    /// The first points, straight from their columns.
    fn run_whole(
        &self,
        whole: usize,
        points: &[&[T]],
        uniforms: *const T,
        outputs: &mut [&mut [T]],
        slots: &mut [T::Block],
    ) {
        // A few outputs need no allocation.
        let mut few = [std::ptr::null_mut(); 10];
        let mut many = Vec::new();
        let pointers = match outputs.len() <= few.len() {
            true => &mut few[..outputs.len()],
            false => {
                many.resize(outputs.len(), std::ptr::null_mut());
                &mut many[..]
            }
        };
        for (pointer, column) in pointers.iter_mut().zip(outputs) {
            *pointer = column.as_mut_ptr();
        }
        let run = Run {
            points,
            inputs: pointers_to(points),
            outputs: pointers,
            uniforms,
            kernels: self.kernels,
        };
        let block = match self.parts.len() {
            1 => whole,
            _ => LANES,
        };
        for begin in (0..whole).step_by(block) {
            // SAFETY: `run` has checked that every column has more than `whole` places, which is
            // a multiple of the block; the uniforms' table has a vector for each.
            unsafe { self.execute(&run, begin, begin + block, slots) };
        }
    }

    /// The last points, fewer than a block, by way of columns of their own.
    fn run_rest(
        &self,
        range: std::ops::Range<usize>,
        points: &[&[T]],
        uniforms: *const T,
        outputs: &mut [&mut [T]],
        (slots, columns): (&mut [T::Block], &mut [T::Block]),
    ) {
        let rest = range.len();
        let (inputs, results) = columns.split_at_mut(self.inputs);
        for (block, column) in inputs.iter_mut().zip(points) {
            let (used, padding) = block.split_at_mut(rest);
            used.copy_from_slice(&column[range.clone()]);
            // Of which any number would do; 0 is not one for which functions are slow.
            padding.fill(T::default());
        }
        let mut padded: [&[T]; 3] = [&[]; 3];
        for (column, block) in padded.iter_mut().zip(&*inputs) {
            *column = block;
        }
        let pointers: Vec<*mut T> = results.iter_mut().map(|block| block.as_mut_ptr()).collect();
        let run = Run {
            points: &padded[..self.inputs],
            inputs: pointers_to(&padded),
            outputs: &pointers,
            uniforms,
            kernels: self.kernels,
        };
        let end = rest.next_multiple_of(self.lanes);
        // SAFETY: every column is a block, which the end does not exceed; the uniforms' table has
        // a vector for each.
        unsafe { self.execute(&run, 0, end, slots) };
        for (block, column) in results.iter().zip(outputs) {
            column[range.clone()].copy_from_slice(&block[..rest]);
        }
    }

    /// Runs all parts over the points from `begin` to `end`.
    ///
    /// # Safety
    /// Both are multiples of a vector's lanes; the run's columns are as many as the code reads
    /// and writes and have at least `end` places; and if there are several parts, `end - begin`
    /// is at most [`LANES`] and the columns of points have `begin` + [`LANES`] places.
    unsafe fn execute(&self, run: &Run<'_, T>, begin: usize, end: usize, slots: &mut [T::Block]) {
        for part in &self.parts {
            match part {
                // SAFETY: the code reads and writes columns below `end` only, of which the caller
                // vouches; outputs come from exclusive references, so they overlap nothing. It
                // reads uniforms and constants of which there is a vector each. It uses of
                // `self.slots` slots the lanes below `end - begin` of a block, and writes each
                // before it reads it. The code is alive, since `self` owns its memory.
                Part::Code(code) => unsafe {
                    code(
                        begin,
                        end,
                        run.inputs.as_ptr(),
                        run.uniforms,
                        run.outputs.as_ptr(),
                        slots.as_flattened_mut().as_mut_ptr(),
                        self.constants.as_ptr(),
                    );
                },
                Part::Functions(tape) => {
                    let mut points: [&[T::Block]; 3] = [&[]; 3];
                    for (blocks, column) in points.iter_mut().zip(run.points) {
                        *blocks = column[begin..begin + LANES].as_chunks().0;
                    }
                    let points = &points[..run.points.len().min(3)];
                    if let Some((idle, slots)) = slots.split_last_mut() {
                        block::run_on_registers::<T>(tape, run.kernels, points, slots, idle);
                    }
                }
            }
        }
    }
}

/// Where the columns begin.
fn pointers_to<T>(columns: &[&[T]]) -> [*const T; 3] {
    let mut pointers = [std::ptr::null(); 3];
    for (pointer, column) in pointers.iter_mut().zip(columns) {
        *pointer = column.as_ptr();
    }
    pointers
}

#[cfg(test)]
mod tests;
