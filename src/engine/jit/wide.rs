//! Machine code for many points in vectors of 256 or 512 bits, on x86-64.
//!
//! Cranelift knows vectors of 128 bits only, and spends some 10 µs on a step. What it would be
//! asked for here is straight-line code of a dozen kinds of instructions, so it is written
//! directly: [`rules`] says which instructions compute a step, [`registers`] where its operands
//! are, and [`assembler`] makes bytes of them. The stages, the slots, and the memory of the code
//! are those of [`super::vector`], and the bits of the results are the same.
//!
//! Compiling takes linear time, about 0.1 µs per step.
//!
//! The convention is System V's; on Windows there is no wide code. General registers, from the
//! function's beginning to its end:
//!
//! | register | what it holds |
//! |---|---|
//! | rdi, rsi | the offset of the points in their columns in bytes, and where it ends |
//! | rax, r10, r11 | the columns of the coordinates |
//! | rcx | the uniforms |
//! | rdx | the slots, moved so that the offset of a point leads to its lane |
//! | r8 | the columns of the outputs |
//! | r9 | the memory of the slots, behind which values are spilled |
//! | rbp | the column of an output, while it is stored |

mod assembler;
mod registers;
mod rules;

use super::Refusal;
use super::chunk::{NO_SLOT, Plan};
use super::emit;
use crate::engine::block::{Kernels, LANES};
use crate::engine::lower::{Lowered, Operand, Step};
use crate::graph::operation::Instruction;
use assembler::{Assembler, Base, Register, Source};
use cranelift_codegen::isa::CallConv;
use cranelift_module::{FuncId, Module};
use registers::{NEVER, Registers, ValueId};
use rules::Masks;
use rustc_hash::FxHashMap;
use std::ops::Range;

pub(super) use assembler::Vectors;

/// The columns' registers, by axis.
const COLUMNS: [Base; 3] = [Base::Rax, Base::R10, Base::R11];

/// The vectors that code for these kernels has; `None` where it is left to Cranelift.
pub(super) fn vectors(kernels: Kernels, is_f64: bool) -> Option<Vectors> {
    if !cfg!(all(target_arch = "x86_64", not(windows))) {
        return None;
    }
    match kernels.or_narrower() {
        Kernels::Baseline => None,
        Kernels::Avx2 => Some(Vectors {
            is_512: false,
            is_f64,
        }),
        Kernels::Avx512 => Some(Vectors {
            is_512: true,
            is_f64,
        }),
    }
}

/// Writes these chunks of the plan into the module, and gives the plan slots for what they spill.
pub(super) fn define(
    module: &mut impl Module,
    lowered: &Lowered,
    plan: &mut Plan,
    vectors: Vectors,
    chunks: impl IntoIterator<Item = usize>,
) -> Result<Vec<FuncId>, Refusal> {
    let signature = super::translate::signature(CallConv::SystemV, emit::Lanes::Four);
    let mut functions = Vec::new();
    let mut spilled = 0;
    for chunk in chunks {
        let id = module.declare_anonymous_function(&signature)?;
        let (code, vectors) = super::counted(|| Chunk::new(lowered, plan, vectors, chunk).write());
        spilled = spilled.max(vectors);
        module.define_function_bytes(id, 64, &code, &[])?;
        functions.push(id);
    }
    plan.slots += (spilled * vectors.bytes()).div_ceil(LANES << vectors.shift());
    Ok(functions)
}

/// The next use of each operand of a step, and of its result.
struct Uses {
    operands: [u32; 3],
    result: u32,
}

/// One chunk, while its code is written.
struct Chunk<'a> {
    lowered: &'a Lowered,
    plan: &'a Plan,
    chunk: usize,
    range: Range<usize>,
    code: Assembler,
    registers: Registers,
    masks: Masks,
    /// The values of coordinates and of slots that other chunks have filled; those of the
    /// chunk's own steps come first.
    leaves: FxHashMap<Leaf, ValueId>,
    /// The uses of each step.
    uses: Vec<Uses>,
}

/// What a chunk finds in memory.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Leaf {
    Coordinate(u8),
    /// The register of another chunk.
    Slot(u32),
}

impl<'a> Chunk<'a> {
    /// Looks at all uses.
    fn new(lowered: &'a Lowered, plan: &'a Plan, vectors: Vectors, chunk: usize) -> Chunk<'a> {
        let range = plan.chunks[chunk].clone();
        let mut leaves: FxHashMap<Leaf, ValueId> = FxHashMap::default();
        let mut found = Vec::new();
        for step in &lowered.steps[range.clone()] {
            for leaf in step.operands().iter().filter_map(|&o| leaf(o, &range)) {
                leaves.entry(leaf).or_insert_with(|| {
                    found.push(leaf);
                    (range.len() + found.len() - 1) as ValueId
                });
            }
        }
        let slot_bytes = LANES << vectors.shift();
        let memory = found.iter().map(|&leaf| match leaf {
            Leaf::Coordinate(axis) => Source::Lanes {
                base: COLUMNS[usize::from(axis)],
                displacement: 0,
            },
            Leaf::Slot(register) => slot(plan.slot[register as usize], slot_bytes),
        });
        let own = std::iter::repeat_n(None, range.len());
        let registers = Registers::new(
            rules::allocated(vectors),
            own.chain(memory.map(Some)),
            (plan.slots * slot_bytes) as i32,
        );
        let mut chunk = Chunk {
            lowered,
            plan,
            chunk,
            range,
            code: Assembler::new(vectors),
            registers,
            masks: Masks::default(),
            leaves,
            uses: Vec::new(),
        };
        chunk.find_uses();
        chunk
    }

    /// The next use of everything, from the last step to the first.
    fn find_uses(&mut self) {
        let mut next = vec![NEVER; self.range.len() + self.leaves.len()];
        self.uses.reserve(self.range.len());
        for place in (0..self.range.len()).rev() {
            let step = &self.lowered.steps[self.range.start + place];
            let result = next[place];
            let mut operands = [NEVER; 3];
            for (index, &operand) in step.operands().iter().enumerate().rev() {
                if let Some(value) = self.value(operand) {
                    operands[index] = next[value as usize];
                    next[value as usize] = place as u32;
                }
            }
            self.uses.push(Uses { operands, result });
        }
        self.uses.reverse();
    }

    /// The value of an operand that differs from point to point.
    fn value(&self, operand: Operand) -> Option<ValueId> {
        match (leaf(operand, &self.range), operand) {
            (Some(leaf), _) => self.leaves.get(&leaf).copied(),
            (None, Operand::Register(register)) => {
                Some((register as usize - self.range.start) as ValueId)
            }
            _ => None,
        }
    }

    /// The bytes of the whole function, and how many vectors it spills.
    fn write(mut self) -> (Vec<u8>, usize) {
        let (exit, body) = self.enter();
        let mut outputs = super::translate::register_outputs(self.lowered, &self.range)
            .into_iter()
            .peekable();
        for place in 0..self.range.len() {
            let index = self.range.start + place;
            let step = &self.lowered.steps[index];
            // Chunks of code consist of native operations.
            let Some(instruction) = emit::native(step.operation) else {
                continue;
            };
            let register = self.compute(place, step, instruction);
            while let Some((_, output)) = outputs.next_if(|&(register, _)| register == index) {
                self.store_output(output, register);
            }
            if self.plan.slot[index] != NO_SLOT {
                let place_of = slot(self.plan.slot[index], self.slot_bytes());
                self.code.store(place_of, register);
                self.registers.note_memory(place as ValueId, place_of);
            }
            if self.uses[place].result == NEVER {
                self.registers.forget(place as ValueId);
            }
        }
        if self.chunk + 1 == self.plan.chunks.len() {
            self.store_plain_outputs();
        }
        self.leave(exit, body);
        (self.code.finish(), self.registers.spilled())
    }

    /// One step; returns the register of its result.
    fn compute(&mut self, place: usize, step: &Step, instruction: Instruction) -> Register {
        let mut values = [None; 3];
        for (index, &operand) in step.operands().iter().enumerate() {
            values[index] = self.value(operand);
            if let Some(value) = values[index] {
                let next = self.uses[place].operands[index];
                self.registers.note_use(value, next);
            }
        }
        let operands = std::array::from_fn(|index| match values[index] {
            Some(value) => rules::Operand::Value(value),
            None if index < step.operands().len() => {
                rules::Operand::Same(self.same(step.operands[index]))
            }
            None => rules::Operand::None,
        });
        let result = (place as ValueId, self.uses[place].result);
        let mut rules = rules::Rules {
            code: &mut self.code,
            registers: &mut self.registers,
            masks: &mut self.masks,
        };
        rules.compute(instruction, &operands, result)
    }

    /// A number that is the same for all points.
    fn same(&mut self, operand: Operand) -> Source {
        let vectors = self.code.vectors;
        match operand {
            Operand::Constant(number) => self.code.constant(rules::bits(vectors, number)),
            Operand::Uniform(index) => Source::Number {
                base: Base::Rcx,
                displacement: index as i32 * (vectors.copies() << vectors.shift()) as i32,
            },
            // These differ from point to point and are values.
            Operand::Coordinate(_) | Operand::Register(_) => Source::Register(0),
        }
    }

    /// The bytes of a slot.
    fn slot_bytes(&self) -> usize {
        LANES << self.code.vectors.shift()
    }

    /// Prepares the general registers. Returns where the ways out stand, and the loop's beginning.
    fn enter(&mut self) -> (usize, usize) {
        let shift = self.code.vectors.shift();
        let code = &mut self.code;
        code.bytes(&[0x55]); // push rbp
        code.bytes(&[0x48, 0xc1, 0xe7, shift]); // shl rdi, shift
        code.bytes(&[0x48, 0xc1, 0xe6, shift]); // shl rsi, shift
        // mov rax, [rdx]; mov r10, [rdx + 8]; mov r11, [rdx + 16]
        let columns: [&[u8]; 3] = [
            &[0x48, 0x8b, 0x02],
            &[0x4c, 0x8b, 0x52, 0x08],
            &[0x4c, 0x8b, 0x5a, 0x10],
        ];
        for column in &columns[..self.lowered.dimension] {
            code.bytes(column);
        }
        code.bytes(&[0x4c, 0x89, 0xca]); // mov rdx, r9
        code.bytes(&[0x48, 0x29, 0xfa]); // sub rdx, rdi
        code.bytes(&[0x48, 0x39, 0xf7]); // cmp rdi, rsi
        code.bytes(&[0x0f, 0x83]); // jae exit
        code.number(0);
        (code.length() - 4, code.length())
    }

    /// The end of the loop and of the function.
    fn leave(&mut self, exit: usize, body: usize) {
        let step = self.code.vectors.bytes() as i32;
        let code = &mut self.code;
        code.bytes(&[0x48, 0x81, 0xc7]); // add rdi, step
        code.number(step);
        code.bytes(&[0x48, 0x39, 0xf7]); // cmp rdi, rsi
        code.bytes(&[0x0f, 0x82]); // jb body
        code.number(body as i32 - (code.length() as i32 + 4));
        code.lead_here(exit);
        code.bytes(&[0x5d]); // pop rbp
        code.bytes(&[0xc5, 0xf8, 0x77]); // vzeroupper
        code.bytes(&[0xc3]); // ret
    }

    /// Stores one output. The column's address is loaded anew, as there is one register for all.
    fn store_output(&mut self, output: usize, register: Register) {
        self.code.bytes(&[0x49, 0x8b, 0xa8]); // mov rbp, [r8 + …]
        self.code.number(output as i32 * 8);
        let place = Source::Lanes {
            base: Base::Rbp,
            displacement: 0,
        };
        self.code.store(place, register);
    }

    /// The outputs that no code computes: constants, coordinates, uniforms, and results of
    /// functions. They come last, when no register is needed any more.
    fn store_plain_outputs(&mut self) {
        for (output, &operand) in self.lowered.outputs.iter().enumerate() {
            let source = match operand {
                Operand::Register(register) => {
                    let operation = self.lowered.steps[register as usize].operation;
                    if emit::native(operation).is_some() {
                        continue;
                    }
                    slot(self.plan.slot[register as usize], self.slot_bytes())
                }
                Operand::Coordinate(axis) => Source::Lanes {
                    base: COLUMNS[usize::from(axis)],
                    displacement: 0,
                },
                Operand::Constant(_) | Operand::Uniform(_) => self.same(operand),
            };
            self.code.load(0, source);
            self.store_output(output, 0);
        }
    }
}

/// What a chunk of these steps loads for the operand.
fn leaf(operand: Operand, range: &Range<usize>) -> Option<Leaf> {
    match operand {
        Operand::Coordinate(axis) => Some(Leaf::Coordinate(axis)),
        Operand::Register(register) if (register as usize) < range.start => {
            Some(Leaf::Slot(register))
        }
        _ => None,
    }
}

/// The points' lanes of a slot.
fn slot(slot: u32, bytes: usize) -> Source {
    Source::Lanes {
        base: Base::Rdx,
        displacement: slot as i32 * bytes as i32,
    }
}

#[cfg(test)]
mod tests;
