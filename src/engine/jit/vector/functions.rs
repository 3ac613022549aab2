//! Groups of functions between chunks of vector code, as tapes for the block tier.

use crate::engine::block::{self, Kind};
use crate::engine::jit::chunk::Plan;
use crate::engine::lower::{Lowered, Operand};
use crate::engine::tape::{Instruction, Source, Tape};
use rustc_hash::FxHashMap;
use std::ops::Range;

/// The slots that are filled with numbers that are the same for all points.
#[derive(Default)]
pub(super) struct Filled {
    pub(super) list: Vec<(u32, Operand)>,
    /// Which slot has this constant (by its bits) or uniform.
    known: FxHashMap<(bool, u64), u32>,
}

impl Filled {
    /// The slot of a constant or uniform.
    fn slot(&mut self, operand: Operand, key: (bool, u64), plan: &mut Plan) -> u32 {
        *self.known.entry(key).or_insert_with(|| {
            let slot = plan.slots as u32;
            plan.slots += 1;
            self.list.push((slot, operand));
            slot
        })
    }
}

/// A group of functions as a tape whose registers are the slots. An operand that is the same for all points gets a slot of its
/// own.
pub(super) fn functions(
    lowered: &Lowered,
    range: Range<usize>,
    plan: &mut Plan,
    filled: &mut Filled,
) -> Tape {
    let mut instructions = Vec::with_capacity(range.len());
    for index in range {
        let step = &lowered.steps[index];
        let [a, b, c] = step.operands.map(|operand| match operand {
            Operand::Register(register) => Source(plan.slot[register as usize]),
            Operand::Coordinate(axis) => Source::of_coordinate(axis),
            Operand::Constant(number) => {
                Source(filled.slot(operand, (false, number.to_bits()), plan))
            }
            Operand::Uniform(index) => Source(filled.slot(operand, (true, index.into()), plan)),
        });
        let kernel = block::Kernel::from(step.operation);
        // There is an instruction for lanes of every operation.
        if let Some(code) = kernel.code(&[Kind::Lanes; 3][..step.operation.arity()]) {
            instructions.push(Instruction {
                code,
                out: plan.slot[index],
                a,
                b,
                c,
            });
        }
    }
    Tape {
        instructions,
        ..Tape::default()
    }
}
