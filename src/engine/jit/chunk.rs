//! Where to cut a long list of steps, and which values cross the cuts.
//!
//! Register allocation is worse than linear in the length of a function, and every value that is
//! alive at a time takes a place on the stack. So a long kernel becomes several functions of
//! bounded length, run one after the other over a block of points. A value that a later chunk
//! needs waits in a *slot*: one number per point of the block, in memory that the caller lends.

use crate::engine::lower::{Lowered, Operand};
use std::ops::Range;

/// The number of points that a kernel of several chunks takes at a time. A slot then has 512
/// bytes, so that even hundreds of live values stay in the first or second level of cache.
pub(super) const BLOCK: usize = 64;

/// The steps of a kernel, cut.
pub(super) struct Plan {
    /// Consecutive ranges of `Lowered::steps`; at least one, possibly empty.
    pub(super) chunks: Vec<Range<usize>>,
    /// For every register the slot in which it waits for a later chunk, or [`NO_SLOT`].
    pub(super) slot: Vec<u32>,
    /// The number of slots.
    pub(super) slots: usize,
}

/// The register is used only in the chunk that computes it.
pub(super) const NO_SLOT: u32 = u32::MAX;

/// Cuts into chunks of at most `length` steps. Takes linear time.
pub(super) fn plan(lowered: &Lowered, length: usize) -> Plan {
    let count = lowered.steps.len();
    let mut plan = Plan {
        chunks: Vec::new(),
        slot: vec![NO_SLOT; count],
        slots: 0,
    };
    let mut start = 0;
    while start < count {
        let end = count.min(start + length);
        plan.chunks.push(start..end);
        start = end;
    }
    if plan.chunks.len() <= 1 {
        plan.chunks = std::iter::once(0..count).collect();
    } else {
        assign_slots(lowered, length, &mut plan);
    }
    plan
}

/// Gives slots to the registers that cross a cut; a slot is free again after the chunk of the
/// last use. Outputs are stored where they are computed, so they need none.
fn assign_slots(lowered: &Lowered, length: usize, plan: &mut Plan) {
    let mut last_chunk = vec![0; lowered.steps.len()];
    for (index, step) in lowered.steps.iter().enumerate() {
        for operand in step.operands() {
            if let Operand::Register(register) = *operand {
                last_chunk[register as usize] = index / length;
            }
        }
    }
    let mut free: Vec<u32> = Vec::new();
    let mut ending: Vec<Vec<u32>> = vec![Vec::new(); plan.chunks.len()];
    for (chunk, range) in plan.chunks.iter().enumerate() {
        for register in range.clone() {
            let last = last_chunk[register];
            if last > chunk {
                let slot = free.pop().unwrap_or_else(|| {
                    plan.slots += 1;
                    (plan.slots - 1) as u32
                });
                plan.slot[register] = slot;
                ending[last].push(slot);
            }
        }
        // Only now, so that no slot is written in the chunk that still reads its old value.
        free.append(&mut ending[chunk]);
    }
}
