//! From steps to Cranelift's intermediate representation of interval arithmetic.
//!
//! One function per chunk, without a loop:
//! ```text
//! fn(sides: *const BoxNumber, uniforms: *const BoxNumber, outputs: *mut BoxNumber,
//!    slots: *mut BoxNumber, constants: *const Vector)
//! ```
//! It calls nothing, so that it can run in another rounding mode.

use super::rules::{Bounds, Rules};
use super::table::{self, Table, Use};
use crate::engine::jit::chunk::{NO_SLOT, Plan};
use crate::engine::jit::emit;
use crate::engine::lower::{Lowered, Operand, Step};
use crate::graph::Op;
use cranelift_codegen::ir::types::{F64X2, I64, I64X2};
use cranelift_codegen::ir::{AbiParam, Function, InstBuilder, MemFlagsData, Signature, Value};
use cranelift_codegen::isa::CallConv;
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use rustc_hash::FxHashMap;
use std::ops::Range;

/// The bytes of a [`super::BoxNumber`].
const SIZE: i32 = 32;

/// Where its regularity begins.
const REGULARITY: i32 = 16;

/// The signature of a chunk, see the module's documentation.
pub(super) fn signature() -> Signature {
    let mut signature = Signature::new(CallConv::SystemV);
    let parameters = std::iter::repeat_n(AbiParam::new(I64), 5);
    signature.params.extend(parameters);
    signature
}

/// What code is made of.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) lowered: &'a Lowered,
    pub(super) plan: &'a Plan,
    pub(super) table: &'a Table,
}

/// Fills `function`, whose signature is set, with the code of one chunk of the plan. Of registers
/// in slots, `is_regular` says which have no regularity there, because they are continuous
/// wherever they are computed; those of this chunk are noted.
pub(super) fn translate<'f>(
    function: &'f mut Function,
    memory: &'f mut FunctionBuilderContext,
    source: Source<'_>,
    chunk: usize,
    is_regular: &mut [bool],
) -> FunctionBuilder<'f> {
    let mut builder = FunctionBuilder::new(function, memory);
    let entry = builder.create_block();
    builder.append_block_params_for_function_params(entry);
    builder.switch_to_block(entry);
    let argument = |index: usize| builder.block_params(entry)[index];
    let [sides, uniforms, outputs, slots, constants] = std::array::from_fn(argument);
    let mut chunk_code = Chunk {
        rules: Rules {
            builder,
            constants,
            joined: FxHashMap::default(),
        },
        source,
        range: source.plan.chunks[chunk].clone(),
        registers: Vec::new(),
        sides: [None; 3],
        uniform_regularity: FxHashMap::default(),
        pointers: Pointers {
            sides,
            uniforms,
            outputs,
            slots,
        },
        is_regular,
    };
    chunk_code.compute();
    if chunk + 1 == source.plan.chunks.len() {
        chunk_code.store_plain_outputs();
    }
    let mut builder = chunk_code.rules.builder;
    builder.ins().return_(&[]);
    builder.seal_all_blocks();
    builder
}

/// What the function is called with.
struct Pointers {
    sides: Value,
    uniforms: Value,
    outputs: Value,
    slots: Value,
}

/// The code of a chunk, while it is written.
struct Chunk<'a, 'f> {
    rules: Rules<'f>,
    source: Source<'a>,
    range: Range<usize>,
    /// The intervals in the chunk's own registers, from `range.start`.
    registers: Vec<Bounds>,
    /// The coordinates that have been used.
    sides: [Option<Bounds>; 3],
    /// The regularity of the uniforms that have been used.
    uniform_regularity: FxHashMap<u32, Value>,
    pointers: Pointers,
    is_regular: &'a mut [bool],
}

impl Chunk<'_, '_> {
    /// The chunk's steps, each followed by the stores of its result.
    fn compute(&mut self) {
        let Source { lowered, plan, .. } = self.source;
        let mut outputs = vec![Vec::new(); self.range.len()];
        for (output, &operand) in lowered.outputs.iter().enumerate() {
            if let Operand::Register(register) = operand
                && self.range.contains(&(register as usize))
            {
                outputs[register as usize - self.range.start].push(output);
            }
        }
        for index in self.range.clone() {
            let bounds = self.step(&lowered.steps[index]);
            self.registers.push(bounds);
            for &output in &outputs[index - self.range.start] {
                self.store(self.pointers.outputs, output, bounds);
            }
            if plan.slot[index] != NO_SLOT {
                let slot = plan.slot[index] as usize;
                self.is_regular[index] = bounds.regularity.is_none();
                // A function reads the whole number, wherever it comes from.
                self.store(self.pointers.slots, slot, bounds);
            }
        }
    }

    /// The result of one step.
    fn step(&mut self, step: &Step) -> Bounds {
        if let Some(bounds) = self.by_constant(step) {
            return bounds;
        }
        let first = self.operand(step.operands[0]);
        let mut operands = [first; 3];
        for (place, &operand) in step.operands().iter().enumerate().skip(1) {
            operands[place] = self.operand(operand);
        }
        match emit::native(step.operation) {
            Some(instruction) => self.rules.emit(instruction, operands),
            // Never: functions are no part of code.
            None => first,
        }
    }

    /// The result of a step with a constant operand for which there is a shorter way.
    fn by_constant(&mut self, step: &Step) -> Option<Bounds> {
        let table = self.source.table;
        for (place, &operand) in step.operands().iter().enumerate() {
            let Operand::Constant(number) = operand else {
                continue;
            };
            let other = step.operands[usize::from(place == 0)];
            if table::is_factor(step, place, number) {
                let magnitude = table.place(Use::Magnitude, number.abs())?;
                let a = self.operand(other);
                let magnitude = self.rules.entry(magnitude, F64X2);
                return Some(match step.operation {
                    Op::Multiply => self.rules.multiply_by(a, number, magnitude),
                    _ => self.rules.divide_by(a, number, magnitude),
                });
            }
            if step.operation == Op::Subtract && place == 1 {
                // A subtracted constant is an added one.
                let a = self.operand(other);
                let b = self.constant(-number);
                let add = crate::graph::operation::Instruction::Add;
                return Some(self.rules.emit(add, [a, b, a]));
            }
        }
        None
    }

    /// An operand; constants, uniforms and slots are fetched anew for each use.
    fn operand(&mut self, operand: Operand) -> Bounds {
        match operand {
            Operand::Constant(number) => self.constant(number),
            Operand::Uniform(index) => {
                let base = self.pointers.uniforms;
                let ends = self.load(F64X2, base, index as i32 * SIZE, true);
                let known = self.uniform_regularity.get(&index).copied();
                let regularity = known.unwrap_or_else(|| {
                    let loaded = self.load(I64X2, base, index as i32 * SIZE + REGULARITY, true);
                    self.uniform_regularity.insert(index, loaded);
                    loaded
                });
                Bounds {
                    ends,
                    regularity: Some(regularity),
                }
            }
            Operand::Coordinate(axis) => {
                let place = usize::from(axis);
                if let Some(side) = self.sides[place] {
                    return side;
                }
                let displacement = i32::from(axis) * SIZE;
                let base = self.pointers.sides;
                let side = Bounds {
                    ends: self.load(F64X2, base, displacement, true),
                    regularity: Some(self.load(I64X2, base, displacement + REGULARITY, true)),
                };
                self.sides[place] = Some(side);
                side
            }
            Operand::Register(register) => {
                let register = register as usize;
                if let Some(place) = register.checked_sub(self.range.start) {
                    return self.registers[place];
                }
                let displacement = self.source.plan.slot[register] as i32 * SIZE;
                let base = self.pointers.slots;
                let ends = self.load(F64X2, base, displacement, false);
                let regularity = match self.is_regular[register] {
                    true => None,
                    false => Some(self.load(I64X2, base, displacement + REGULARITY, false)),
                };
                Bounds { ends, regularity }
            }
        }
    }

    /// A constant as an interval.
    fn constant(&mut self, number: f64) -> Bounds {
        let place = self.source.table.place(Use::Interval, number);
        // Every constant that steps need is in the table.
        let ends = self.rules.entry(place.unwrap_or(table::ALL), F64X2);
        let regularity = match table::is_regular(number) {
            true => None,
            false => {
                let zero = self.rules.builder.ins().iconst(I64, 0);
                Some(self.rules.builder.ins().splat(I64X2, zero))
            }
        };
        Bounds { ends, regularity }
    }

    /// The outputs that are no result of code.
    fn store_plain_outputs(&mut self) {
        let lowered = self.source.lowered;
        for (output, &operand) in lowered.outputs.iter().enumerate() {
            let is_stored = match operand {
                Operand::Register(register) => {
                    emit::native(lowered.steps[register as usize].operation).is_some()
                }
                _ => false,
            };
            if !is_stored {
                let bounds = self.operand(operand);
                self.store(self.pointers.outputs, output, bounds);
            }
        }
    }

    /// Loads a vector.
    fn load(
        &mut self,
        kind: cranelift_codegen::ir::Type,
        base: Value,
        displacement: i32,
        is_constant: bool,
    ) -> Value {
        let flags = match is_constant {
            true => MemFlagsData::trusted().with_readonly().with_can_move(),
            false => MemFlagsData::trusted(),
        };
        let ins = self.rules.builder.ins();
        ins.load(kind, flags, base, displacement)
    }

    /// Stores an interval and its regularity.
    fn store(&mut self, base: Value, place: usize, bounds: Bounds) {
        let displacement = place as i32 * SIZE;
        let flags = MemFlagsData::trusted();
        let ins = self.rules.builder.ins();
        ins.store(flags, bounds.ends, base, displacement);
        let regularity = match bounds.regularity {
            Some(regularity) => regularity,
            None => self.rules.entry(table::ALL, I64X2),
        };
        let ins = self.rules.builder.ins();
        ins.store(flags, regularity, base, displacement + REGULARITY);
    }
}
