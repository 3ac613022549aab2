//! From instructions to Cranelift's intermediate representation.
//!
//! One function per chunk, with a loop over points around straight-line code:
//! ```text
//! fn(begin, end, inputs: *const *const f64, uniforms: *const f64,
//!    outputs: *const *mut f64, slots: *mut f64)
//! ```
//! `inputs` and `outputs` are the columns (structure of arrays) of the whole batch, of which the
//! points `begin..end` are computed. Constants and uniforms are fetched where they are used, as
//! memory operands: kept alive over the loop they would all be spilled around the first call.
//! For the same reason an output is stored as soon as it is known.
//!
//! Code for several points at a time ([`Lanes`]) takes as many steps of the loop fewer: `begin` and
//! `end` are multiples of the lanes. Its uniforms are vectors of equal lanes, so that they too are
//! memory operands, and so are the constants, to which a seventh argument points. It calls nothing:
//! what is no instruction is computed between chunks, from slots to slots.

use super::chunk::{NO_SLOT, Plan};
use super::emit::{self, Lanes, Number};
use crate::engine::lower::{Lowered, Operand, Step};
use crate::graph::Op;
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{F64, I64};
use cranelift_codegen::ir::{
    AbiParam, Block, FuncRef, Function, InstBuilder, MemFlagsData, Signature, Type, Value,
};
use cranelift_codegen::isa::CallConv;
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use std::ops::Range;

/// Pointers are 64 bits wide on every machine that Cranelift serves.
const POINTER: Type = I64;

/// The bytes of a pointer.
const SIZE: i32 = 8;

/// The signature of a chunk, see the module's documentation.
pub(super) fn signature(convention: CallConv, lanes: Lanes) -> Signature {
    let mut signature = Signature::new(convention);
    let count = match lanes {
        Lanes::One => 6,
        Lanes::Two | Lanes::Four => 7,
    };
    let parameters = std::iter::repeat_n(AbiParam::new(POINTER), count);
    signature.params.extend(parameters);
    signature
}

/// The signature of [`Op::host_function`].
pub(super) fn host_signature(convention: CallConv) -> Signature {
    let mut signature = Signature::new(convention);
    let parameters = std::iter::repeat_n(AbiParam::new(F64), 3);
    signature.params.extend(parameters);
    signature.returns.push(AbiParam::new(F64));
    signature
}

/// What code is made of: the steps, how they are cut, and for how many points at a time.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) lowered: &'a Lowered,
    pub(super) plan: &'a Plan,
    pub(super) lanes: Lanes,
}

/// Fills `function`, whose signature is set, with the code of one chunk of the plan. `import`
/// declares the function of a host operation in it. The builder is returned so that the caller
/// can finish it, which only compilation needs.
pub(super) fn translate<'f, E>(
    function: &'f mut Function,
    memory: &'f mut FunctionBuilderContext,
    source: Source<'_>,
    chunk: usize,
    import: &mut dyn FnMut(&mut Function, Op) -> Result<FuncRef, E>,
) -> Result<FunctionBuilder<'f>, E> {
    let Source {
        lowered,
        plan,
        lanes,
    } = source;
    let mut builder = FunctionBuilder::new(function, memory);
    let entry = builder.create_block();
    let body = builder.create_block();
    let exit = builder.create_block();
    builder.append_block_params_for_function_params(entry);
    let offset = builder.append_block_param(body, I64);

    builder.switch_to_block(entry);
    let (begin, end, pointers) = enter(&mut builder, entry, lowered.dimension, lanes);
    let some = builder.ins().icmp(IntCC::UnsignedLessThan, begin, end);
    builder.ins().brif(some, body, &[begin.into()], exit, &[]);

    builder.switch_to_block(body);
    let mut point = Point {
        builder,
        plan,
        lanes,
        range: plan.chunks[chunk].clone(),
        registers: Vec::with_capacity(plan.chunks[chunk].len()),
        coordinates: Vec::with_capacity(lowered.dimension),
        pointers,
        offset,
    };
    point.load_coordinates();
    point.compute(lowered, import)?;
    if chunk + 1 == plan.chunks.len() {
        point.store_plain_outputs(lowered);
    }
    let mut builder = point.builder;
    let next = builder.ins().iadd_imm_s(offset, i64::from(lanes.bytes()));
    let more = builder.ins().icmp(IntCC::UnsignedLessThan, next, end);
    builder.ins().brif(more, body, &[next.into()], exit, &[]);

    builder.switch_to_block(exit);
    builder.ins().return_(&[]);
    builder.seal_all_blocks();
    Ok(builder)
}

/// The addresses that stay the same over the loop.
struct Pointers {
    /// The columns of the coordinates.
    columns: Vec<Value>,
    uniforms: Value,
    outputs: Value,
    /// The slots' memory, moved so that the offset of a point leads to its lane.
    slots: Value,
    /// Vectors of constants, in code for several lanes.
    constants: Option<Value>,
}

/// The function's beginning: first and last offset in bytes, and the addresses.
fn enter(
    builder: &mut FunctionBuilder,
    entry: Block,
    dimension: usize,
    lanes: Lanes,
) -> (Value, Value, Pointers) {
    let argument = |index: usize| builder.block_params(entry)[index];
    let [begin, end, inputs, uniforms, outputs, slots] = std::array::from_fn(argument);
    let constants = builder.block_params(entry).get(6).copied();
    let shift = i64::from(lanes.shift());
    let begin = builder.ins().ishl_imm_u(begin, shift);
    let end = builder.ins().ishl_imm_u(end, shift);
    let columns = (0..dimension as i32)
        .map(|axis| {
            builder
                .ins()
                .load(POINTER, constant_memory(), inputs, axis * SIZE)
        })
        .collect();
    let slots = builder.ins().isub(slots, begin);
    let pointers = Pointers {
        columns,
        uniforms,
        outputs,
        slots,
        constants,
    };
    (begin, end, pointers)
}

/// Pointers, which nothing writes while a kernel runs.
fn constant_memory() -> MemFlagsData {
    MemFlagsData::trusted().with_readonly().with_can_move()
}

/// The code for one point or several, while it is written.
struct Point<'a, 'f> {
    builder: FunctionBuilder<'f>,
    plan: &'a Plan,
    lanes: Lanes,
    range: Range<usize>,
    /// The numbers in the chunk's own registers, from `range.start`.
    registers: Vec<Number>,
    /// The point's coordinates.
    coordinates: Vec<Number>,
    pointers: Pointers,
    /// The position of the point in its columns, in bytes.
    offset: Value,
}

impl Point<'_, '_> {
    /// The chunk's steps, each followed by the stores of its result.
    fn compute<E>(
        &mut self,
        lowered: &Lowered,
        import: &mut dyn FnMut(&mut Function, Op) -> Result<FuncRef, E>,
    ) -> Result<(), E> {
        let mut imported = vec![None; Op::ALL.len()];
        let mut outputs = register_outputs(lowered, &self.range)
            .into_iter()
            .peekable();
        for index in self.range.clone() {
            let step = &lowered.steps[index];
            let mut operands = self.operands(step);
            let number = match emit::native(step.operation) {
                Some(instruction) => {
                    let number =
                        emit::emit(&mut self.builder, self.lanes, instruction, &mut operands);
                    self.note_masks(step, &operands);
                    number
                }
                None => {
                    let function = match imported[step.operation as usize] {
                        Some(function) => function,
                        None => import(self.builder.func, step.operation)?,
                    };
                    imported[step.operation as usize] = Some(function);
                    let operands = operands.map(|operand| operand.value);
                    let call = self.builder.ins().call(function, &operands);
                    Number::from(self.builder.inst_results(call)[0])
                }
            };
            self.registers.push(number);
            let value = number.value;
            while let Some((_, output)) = outputs.next_if(|&(register, _)| register == index) {
                self.store_output(output, value);
            }
            if self.plan.slot[index] != NO_SLOT {
                let (address, displacement) = self.slot(self.plan.slot[index]);
                self.builder
                    .ins()
                    .store(self.lanes.memory(), value, address, displacement);
            }
        }
        Ok(())
    }

    /// The outputs that are no result of code: constants, coordinates, uniforms and, beside
    /// vectors, results of functions.
    fn store_plain_outputs(&mut self, lowered: &Lowered) {
        for (output, &operand) in lowered.outputs.iter().enumerate() {
            let is_stored = match operand {
                Operand::Register(register) => {
                    let operation = lowered.steps[register as usize].operation;
                    self.lanes == Lanes::One || emit::native(operation).is_some()
                }
                _ => false,
            };
            if !is_stored {
                let number = self.operand(operand);
                self.store_output(output, number.value);
            }
        }
    }

    /// Loads the coordinates; those without a use are dropped.
    fn load_coordinates(&mut self) {
        for &column in &self.pointers.columns {
            let address = self.builder.ins().iadd(column, self.offset);
            let flags = self.lanes.memory().with_readonly().with_can_move();
            let numbers = self.lanes.numbers();
            let value = self.builder.ins().load(numbers, flags, address, 0);
            self.coordinates.push(value.into());
        }
    }

    /// The operands of a step; those that it does not have repeat the first.
    fn operands(&mut self, step: &Step) -> [Number; 3] {
        let first = self.operand(step.operands[0]);
        let mut operands = [first; 3];
        for (place, &operand) in step.operands().iter().enumerate().skip(1) {
            operands[place] = self.operand(operand);
        }
        operands
    }

    /// An operand; constants, uniforms and slots are fetched anew for each use.
    fn operand(&mut self, operand: Operand) -> Number {
        let (lanes, numbers) = (self.lanes, self.lanes.numbers());
        let constant = lanes.memory().with_readonly().with_can_move();
        match operand {
            Operand::Constant(number) => {
                let place = self.plan.constants.get(&number.to_bits());
                match (self.pointers.constants, place) {
                    (Some(constants), Some(&place)) => {
                        let displacement = place as i32 * lanes.bytes();
                        let ins = self.builder.ins();
                        ins.load(numbers, constant, constants, displacement).into()
                    }
                    _ => lanes.constant(&mut self.builder, number).into(),
                }
            }
            Operand::Uniform(index) => {
                let displacement = index as i32 * lanes.bytes();
                let uniforms = self.pointers.uniforms;
                let ins = self.builder.ins();
                ins.load(numbers, constant, uniforms, displacement).into()
            }
            Operand::Coordinate(axis) => self.coordinates[usize::from(axis)],
            Operand::Register(register) => match self.own(register) {
                Some(place) => self.registers[place],
                None => {
                    let (address, displacement) = self.slot(self.plan.slot[register as usize]);
                    let ins = self.builder.ins();
                    ins.load(numbers, lanes.memory(), address, displacement)
                        .into()
                }
            },
        }
    }

    /// Keeps the masks that a step has made of its operands for the steps to come.
    fn note_masks(&mut self, step: &Step, operands: &[Number; 3]) {
        for (&operand, number) in step.operands().iter().zip(operands) {
            match operand {
                Operand::Register(register) => {
                    if let Some(place) = self.own(register) {
                        self.registers[place] = *number;
                    }
                }
                Operand::Coordinate(axis) => self.coordinates[usize::from(axis)] = *number,
                Operand::Constant(_) | Operand::Uniform(_) => {}
            }
        }
    }

    /// The place of a register among the chunk's own ones.
    fn own(&self, register: u32) -> Option<usize> {
        (register as usize).checked_sub(self.range.start)
    }

    /// The address of the point's lane of a slot, as base and displacement.
    fn slot(&mut self, slot: u32) -> (Value, i32) {
        let address = self.builder.ins().iadd(self.pointers.slots, self.offset);
        (
            address,
            slot as i32 * self.plan.block as i32 * self.lanes.size(),
        )
    }

    /// Stores one output of the point. The column's address is loaded anew: with the dozens of
    /// outputs of a parameter gradient there are no registers to keep them in.
    fn store_output(&mut self, output: usize, value: Value) {
        let displacement = output as i32 * SIZE;
        let ins = self.builder.ins();
        let column = ins.load(
            POINTER,
            constant_memory(),
            self.pointers.outputs,
            displacement,
        );
        let address = self.builder.ins().iadd(column, self.offset);
        self.builder
            .ins()
            .store(self.lanes.memory(), value, address, 0);
    }
}

/// The registers of this range that are outputs, ascending, each with the output's place.
pub(super) fn register_outputs(lowered: &Lowered, range: &Range<usize>) -> Vec<(usize, usize)> {
    let outputs = lowered.outputs.iter().enumerate();
    let mut found: Vec<(usize, usize)> = outputs
        .filter_map(|(output, &operand)| match operand {
            Operand::Register(register) => Some((register as usize, output)),
            _ => None,
        })
        .filter(|(register, _)| range.contains(register))
        .collect();
    found.sort_unstable();
    found
}
