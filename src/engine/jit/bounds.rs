//! Machine code for enclosures of one box.
//!
//! The two ends of an interval are the two lanes of a vector, the lower one negated, so that
//! rounding upward rounds both outward: most operations are one to five instructions. The code
//! runs in stages (see [`super::stages`]): chunks of arithmetic with the processor's rounding mode
//! set upward ([`rounding`]), and between them functions by the table's interval rules in the
//! usual mode. Ends of arithmetic are the tightest, so the enclosures lie within those of the
//! block tier and are those of the table's rules, or near underflow within them.
//!
//! For many boxes at once the block tier is faster, and nothing must be compiled.

mod rounding;
mod rules;
mod table;
mod translate;

use super::chunk::Lengths;
use super::memory::FreeingModule;
use super::stages::{self, Stage, Stages};
use super::{Refusal, check_size};
use crate::engine::block;
use crate::engine::lower::{Lowered, Operand};
use crate::graph::interval::{Enclosure, Regularity};
use crate::graph::{Interval, Op};
use cranelift_codegen::Context;
use cranelift_frontend::FunctionBuilderContext;
use cranelift_module::Module;
use rounding::{Arguments, BoxFunction, CALL_UPWARD, CallUpward};
use std::cell::Cell;
use table::{Table, Vector};
use translate::Source;

/// An enclosure as the code has it.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(in crate::engine) struct BoxNumber {
    /// (−low, high), both NaN if empty.
    ends: [f64; 2],
    /// All bits set or none: defined everywhere; continuous too.
    regularity: [u64; 2],
}

impl BoxNumber {
    /// Nothing in particular.
    const NOTHING: BoxNumber = BoxNumber {
        ends: [0.0; 2],
        regularity: [0; 2],
    };
}

impl From<Enclosure> for BoxNumber {
    fn from(enclosure: Enclosure) -> BoxNumber {
        let Interval { low, high } = enclosure.range;
        BoxNumber {
            ends: match enclosure.range.is_empty() {
                true => [f64::NAN; 2],
                false => [-low, high],
            },
            regularity: match enclosure.regularity {
                Regularity::Partial => [0, 0],
                Regularity::Defined => [u64::MAX, 0],
                Regularity::Continuous => [u64::MAX, u64::MAX],
            },
        }
    }
}

impl From<BoxNumber> for Enclosure {
    fn from(number: BoxNumber) -> Enclosure {
        let [opposite, high] = number.ends;
        Enclosure {
            // 0 − 0 is 0, not −0.
            range: Interval::new(0.0 - opposite, high),
            regularity: match number.regularity {
                [0, _] => Regularity::Partial,
                [_, 0] => Regularity::Defined,
                _ => Regularity::Continuous,
            },
        }
    }
}

/// Where a function finds an operand.
#[derive(Clone, Copy)]
enum Place {
    Slot(u32),
    Side(u8),
    Uniform(u32),
    Constant(Enclosure),
}

/// A function between chunks.
struct Call {
    operation: Op,
    operands: [Place; 3],
    slot: u32,
}

/// What [`BoxCode`] executes, in order.
enum Part {
    Code(BoxFunction),
    Functions(Vec<Call>),
}

/// The machine code that encloses some functions over one box. Without state, like
/// [`super::MachineCode`].
pub(in crate::engine) struct BoxCode {
    parts: Vec<Part>,
    call_upward: CallUpward,
    /// See [`table`].
    constants: Vec<Vector>,
    /// How many there are.
    uniforms: usize,
    outputs: usize,
    slots: usize,
    /// Owns the memory of the code; it is freed with this value, when nobody can call it.
    _module: FreeingModule,
}

/// Measured with 100 spheres (1,015 steps): chunks of 64 and 128 steps take 1.3 µs a box, of 32
/// steps 1.45.
const LENGTHS: Lengths = Lengths {
    whole: 64,
    chunk: 64,
};

/// Compiles enclosures of steps that [`super::super::lower::list`] has made.
pub(in crate::engine) fn compile(lowered: &Lowered) -> Result<BoxCode, Refusal> {
    match CALL_UPWARD {
        Some(_) => super::remember(compile_with(lowered, LENGTHS)),
        // Other code can be made for this processor.
        None => Err(Refusal::Processor),
    }
}

/// Compiles them in functions of these lengths.
fn compile_with(lowered: &Lowered, lengths: Lengths) -> Result<BoxCode, Refusal> {
    let target = super::target().ok_or(Refusal::Processor)?;
    let call_upward = CALL_UPWARD.ok_or(Refusal::Processor)?;
    check_size(lowered)?;
    let Stages {
        lowered,
        plan,
        stages,
        ..
    } = stages::stages(lowered, lengths);
    let table = Table::new(&lowered);
    let source = Source {
        lowered: &lowered,
        plan: &plan,
        table: &table,
    };
    let mut owner = FreeingModule::new(super::builder(target.clone()));
    let module = owner.module().ok_or(Refusal::Processor)?;
    let code = define(module, source, &stages)?;
    module.finalize_definitions()?;
    let mut code = code.into_iter().map(|function| {
        let address = module.get_finalized_function(function);
        Part::Code(BoxFunction(address.expose_provenance()))
    });
    let chunks = stages.iter().zip(&plan.chunks);
    let parts = chunks.filter_map(|(stage, range)| match stage {
        Stage::Code => code.next(),
        Stage::Functions => Some(Part::Functions(
            range.clone().map(|step| call(source, step)).collect(),
        )),
    });
    Ok(BoxCode {
        parts: parts.collect(),
        call_upward,
        constants: table.vectors,
        uniforms: lowered.uniforms(),
        outputs: lowered.outputs.len(),
        slots: plan.slots,
        _module: owner,
    })
}

/// Compiles the chunks of code into the module.
fn define(
    module: &mut impl Module,
    source: Source<'_>,
    stages: &[Stage],
) -> Result<Vec<cranelift_module::FuncId>, Refusal> {
    let mut context = Context::new();
    let mut memory = FunctionBuilderContext::new();
    let config = module.target_config();
    let mut is_regular = vec![false; source.lowered.steps.len()];
    let mut functions = Vec::new();
    for (chunk, _) in (0..)
        .zip(stages)
        .filter(|(_, stage)| **stage == Stage::Code)
    {
        module.clear_context(&mut context);
        context.func.signature = translate::signature();
        let function = &mut context.func;
        let builder = translate::translate(function, &mut memory, source, chunk, &mut is_regular);
        builder.finalize(config);
        functions.push(super::finish(module, &mut context)?);
    }
    Ok(functions)
}

/// A step that is a function.
fn call(source: Source<'_>, step: usize) -> Call {
    let slots = &source.plan.slot;
    let place = |operand: Operand| match operand {
        Operand::Register(register) => Place::Slot(slots[register as usize]),
        Operand::Coordinate(axis) => Place::Side(axis),
        Operand::Uniform(index) => Place::Uniform(index),
        Operand::Constant(number) => Place::Constant(Enclosure::of_number(number)),
    };
    let slot = slots[step];
    let step = &source.lowered.steps[step];
    Call {
        operation: step.operation,
        operands: step.operands.map(place),
        slot,
    }
}

impl BoxCode {
    /// Encloses the outputs over the box with these sides and hands each with its place to
    /// `write`. `uniforms` are the parameters and what is computed of them alone, as many as the
    /// code was made for.
    pub(in crate::engine) fn run(
        &self,
        sides: &[Interval; 3],
        uniforms: &[BoxNumber],
        mut write: impl FnMut(usize, Enclosure),
    ) {
        assert!(uniforms.len() >= self.uniforms, "a uniform is missing");
        let [x, y, z] = sides;
        let number = |side: &Interval| Enclosure::of_interval(*side).into();
        let sides = [number(x), number(y), number(z)];
        thread_local! {
            static KEPT: Cell<Vec<BoxNumber>> = const { Cell::new(Vec::new()) };
        }
        let count = self.slots + self.outputs;
        KEPT.with(|kept| {
            block::lend(kept, count, BoxNumber::NOTHING, |memory| {
                let (slots, results) = memory.split_at_mut(self.slots);
                self.execute(&sides, uniforms, slots, results);
                for (output, &result) in results.iter().enumerate() {
                    write(output, result.into());
                }
            });
        });
    }

    /// Runs all parts. There are as many uniforms, slots and outputs as the code uses.
    fn execute(
        &self,
        sides: &[BoxNumber; 3],
        uniforms: &[BoxNumber],
        slots: &mut [BoxNumber],
        outputs: &mut [BoxNumber],
    ) {
        for part in &self.parts {
            match part {
                Part::Code(code) => {
                    let arguments = Arguments {
                        sides: sides.as_ptr(),
                        uniforms: uniforms.as_ptr(),
                        outputs: outputs.as_mut_ptr(),
                        slots: slots.as_mut_ptr(),
                        constants: self.constants.as_ptr(),
                    };
                    // SAFETY: the address is that of a finished function, which `translate` gave
                    // this signature and convention. It reads sides of three coordinates at most, the uniforms and
                    // outputs that `run` has counted and the slots and constants that were counted
                    // when it was made; what it writes comes from exclusive references. It calls
                    // nothing. It is alive, since `self` owns its memory.
                    unsafe { (self.call_upward)(*code, &arguments) };
                }
                Part::Functions(calls) => {
                    for call in calls {
                        let mut operands = [Enclosure::of_number(0.0); 3];
                        for (operand, place) in operands.iter_mut().zip(call.operands) {
                            *operand = match place {
                                Place::Slot(slot) => slots[slot as usize].into(),
                                Place::Side(axis) => sides[usize::from(axis)].into(),
                                Place::Uniform(index) => uniforms[index as usize].into(),
                                Place::Constant(enclosure) => enclosure,
                            };
                        }
                        let rule = call.operation.operation().interval;
                        let enclosure = rule(&operands[..call.operation.arity()]);
                        slots[call.slot as usize] = enclosure.into();
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
