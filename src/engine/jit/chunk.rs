//! Where to cut a long list of steps, and which values cross the cuts.
//!
//! Register allocation is worse than linear in the length of a function, and every value that is
//! alive at a time takes a place on the stack. So a long kernel becomes several functions of
//! bounded length, run one after the other over a block of points. A value that a later chunk
//! needs waits in a *slot*: one number per point of the block, in memory that the caller lends.

use crate::engine::lower::{Lowered, Operand};
use rustc_hash::FxHashMap;
use std::ops::Range;

/// How long functions may be, in steps.
#[derive(Clone, Copy)]
pub(super) struct Lengths {
    /// The longest kernel that stays in one piece.
    pub(super) whole: usize,
    /// The length of the pieces of a longer one.
    pub(super) chunk: usize,
}

/// Measured with the gradient of 100 spheres (2,700 steps): in one piece it takes 42 ms to compile
/// and 1.4 µs a point; in chunks of 1,024 steps 15 ms and 2.1 µs; in chunks of 128 steps 16 ms and
/// 1.2 µs. In short chunks less is spilled, and what waits is written and read along the block.
pub(super) const LENGTHS: Lengths = Lengths {
    whole: 1024,
    chunk: 128,
};

/// The steps of a kernel, cut.
pub(super) struct Plan {
    /// Consecutive ranges of `Lowered::steps`; at least one, possibly empty.
    pub(super) chunks: Vec<Range<usize>>,
    /// For every register the slot in which it waits for a later chunk, or [`NO_SLOT`].
    pub(super) slot: Vec<u32>,
    /// The number of slots.
    pub(super) slots: usize,
    /// The number of points that several chunks take at a time: the lanes of a slot. 64 or, where
    /// thousands of slots would leave the cache, 8.
    pub(super) block: usize,
    /// The places of constants, by their bits, in the memory of code for several lanes.
    pub(super) constants: FxHashMap<u64, u32>,
}

/// The register is used only in the chunk that computes it.
pub(super) const NO_SLOT: u32 = u32::MAX;

/// Cuts a kernel. Takes linear time.
pub(super) fn plan(lowered: &Lowered, lengths: Lengths) -> Plan {
    let count = lowered.steps.len();
    let length = if count <= lengths.whole {
        count.max(1)
    } else {
        lengths.chunk
    };
    let mut plan = Plan {
        chunks: Vec::new(),
        slot: vec![NO_SLOT; count],
        slots: 0,
        block: 64,
        constants: FxHashMap::default(),
    };
    for start in (0..count.max(1)).step_by(length) {
        plan.chunks.push(start..count.min(start + length));
    }
    assign_slots(lowered, &mut plan, |_| false);
    if plan.slots > 4096 {
        plan.block = 8;
    }
    plan
}

/// Gives slots to the registers that cross a cut and, whatever uses them, to those that are
/// `kept`; a slot is free again after the chunk of the last use. Outputs are stored where they
/// are computed, so they need none; but those that are kept are stored by the last chunk.
pub(super) fn assign_slots(lowered: &Lowered, plan: &mut Plan, kept: impl Fn(usize) -> bool) {
    let mut last_chunk = vec![0; lowered.steps.len()];
    for (chunk, range) in plan.chunks.iter().enumerate() {
        for step in &lowered.steps[range.clone()] {
            for operand in step.operands() {
                if let Operand::Register(register) = *operand {
                    last_chunk[register as usize] = chunk;
                }
            }
        }
    }
    for &output in &lowered.outputs {
        if let Operand::Register(register) = output
            && kept(register as usize)
        {
            last_chunk[register as usize] = plan.chunks.len() - 1;
        }
    }
    let mut free: Vec<u32> = Vec::new();
    let mut ending: Vec<Vec<u32>> = vec![Vec::new(); plan.chunks.len()];
    for (chunk, range) in plan.chunks.iter().enumerate() {
        for register in range.clone() {
            let last = last_chunk[register];
            if last > chunk || kept(register) {
                let slot = free.pop().unwrap_or_else(|| {
                    plan.slots += 1;
                    (plan.slots - 1) as u32
                });
                plan.slot[register] = slot;
                ending[last.max(chunk)].push(slot);
            }
        }
        // Only now, so that no slot is written in the chunk that still reads its old value.
        free.append(&mut ending[chunk]);
    }
}
