//! Which operand a choice takes: an interval pass over boxes that records what is decided.
//!
//! A choice is an operation whose value is, at every point, one of its operands (or that with the
//! other sign) or a truth value: min, max, select, abs and comparisons. It is decided in a box if
//! the enclosures of its operands leave one possibility, *with the bits of the value rules*:
//!
//! * Operands must be defined. A NaN that is dropped would be missed, and an infinity need not
//!   lie in its enclosure (1/x on [−1, 0] is at most −1, but at 0 it is ∞). An enclosure with an
//!   infinite end counts as undefined, since the numbers that it encloses may have overflowed;
//!   [`Pass::settle`] says when the pass must see to that.
//! * Ranges must be apart, not touch: at a tie of zeros their signs decide.
//!
//! Every range holds the computed values, not only the true ones (`graph::interval`), so what is
//! decided holds for them.

use super::bounds::{Bounds, BoundsBlock, DEFINED, PARTIAL};
use super::dispatch::{self, Kernels};
use super::execute::{Sources, operands};
use super::number::{LANES, Number};
use super::table::{self, Kernel};
use crate::engine::tape::{Instruction, Place, Tape};

/// The kinds of choices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::engine) enum Choice {
    /// The first operand or the second one.
    Min,
    /// Likewise.
    Max,
    /// The second operand or the third one.
    Select,
    /// The operand or its opposite.
    Abs,
    /// 1 or 0.
    Less,
    /// 1 or 0.
    LessEqual,
    /// 1 or 0.
    Equal,
    /// 1 or 0; only 1 is ever decided.
    IsNumber,
}

impl Choice {
    /// Whether it is a truth value, of which the first possibility is 1 and the second one 0.
    pub(in crate::engine) fn is_truth(self) -> bool {
        !matches!(
            self,
            Choice::Min | Choice::Max | Choice::Select | Choice::Abs
        )
    }
}

/// The kind of choice that a kernel is, if any.
pub(super) const fn choice(kernel: Kernel) -> Option<Choice> {
    match kernel {
        Kernel::Min => Some(Choice::Min),
        Kernel::Max => Some(Choice::Max),
        Kernel::Select => Some(Choice::Select),
        Kernel::Abs => Some(Choice::Abs),
        Kernel::Less => Some(Choice::Less),
        Kernel::LessEqual => Some(Choice::LessEqual),
        Kernel::Equal => Some(Choice::Equal),
        Kernel::IsNumber => Some(Choice::IsNumber),
        _ => None,
    }
}

/// In which lanes a choice is decided, a bit each, and for which possibility, in the order of
/// [`Choice`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::engine) struct Decision {
    /// For the first one.
    pub(in crate::engine) first: u64,
    /// For the second one.
    pub(in crate::engine) second: u64,
}

/// A tape over up to [`LANES`] boxes.
pub(in crate::engine) struct Pass<'a> {
    /// What to run. If anything is to be recorded, its choices are instructions of their own, not
    /// fused.
    pub(in crate::engine) tape: &'a Tape,
    /// A block of sides per axis.
    pub(in crate::engine) boxes: &'a [BoundsBlock; 3],
    /// What the tape's instructions refer to as scalars.
    pub(in crate::engine) scalars: &'a [Bounds],
    /// Memory to work in: at least as many blocks as the tape has registers.
    pub(in crate::engine) registers: &'a mut [BoundsBlock],
    /// The enclosures of the tape's outputs.
    pub(in crate::engine) outputs: &'a mut [BoundsBlock],
    /// By the places of the tape's instructions, what is decided; those of instructions that are
    /// no choices stay as they are. If it is shorter than the tape, nothing is recorded.
    pub(in crate::engine) decisions: &'a mut [Decision],
    /// Whether to take enclosures with infinite ends for undefined. It is not needed where no
    /// instruction has one in any of the boxes, as is known from a box around them.
    pub(in crate::engine) settle: bool,
    /// With `settle`: the lanes in which every instruction is defined and has finite ends. They
    /// need it no more in any part of these boxes.
    pub(in crate::engine) tame: u64,
}

impl Pass<'_> {
    /// Runs it with these kernels or narrower ones.
    pub(in crate::engine) fn run(&mut self, kernels: Kernels) {
        dispatch::record(kernels, self);
    }
}

/// Runs the pass.
#[inline(always)]
pub(super) fn run(pass: &mut Pass<'_>) {
    let points: [&[BoundsBlock]; 3] = pass.boxes.each_ref().map(std::slice::from_ref);
    let records = pass.decisions.len() >= pass.tape.instructions.len();
    let mut worst = [DEFINED; LANES];
    for (index, instruction) in pass.tape.instructions.iter().enumerate() {
        let outputs = &mut *pass.outputs;
        let (out, sources) = operands(
            instruction,
            points,
            pass.scalars,
            1,
            pass.registers,
            |output| std::slice::from_mut(&mut outputs[output]),
        );
        table::execute(instruction, out, &sources);
        if pass.settle {
            doubt(instruction, &sources, &mut out[0]);
            settle(&mut out[0], &mut worst);
        }
        if records {
            record(instruction, &sources, &mut pass.decisions[index]);
        }
    }
    for &(output, place) in &pass.tape.copies {
        pass.outputs[output as usize] = match place {
            Place::Scalar(index) => pass.scalars[index as usize].splat(),
            Place::Coordinate(axis) => pass.boxes[usize::from(axis)],
            Place::Register(register) => pass.registers[register as usize],
        };
    }
    pass.tame = match pass.settle {
        true => mask(|lane| worst[lane] >= DEFINED),
        false => u64::MAX,
    };
}

impl Bounds {
    /// Takes an enclosure with an infinite end for undefined.
    pub(in crate::engine) fn settle(&mut self) {
        let is_finite = self.high - self.low < f64::INFINITY;
        self.regularity = match is_finite {
            true => self.regularity,
            false => self.regularity.min(PARTIAL),
        };
    }
}

/// What is chosen by something undefined is unknown: its infinity may lie outside of the range
/// that the choice was bounded by.
#[inline(always)]
fn doubt(instruction: &Instruction, sources: &Sources<'_, Bounds>, out: &mut BoundsBlock) {
    let facts = instruction.code.facts();
    let Some(choice) = facts.choice else {
        return;
    };
    for (place, source) in [instruction.a, instruction.b].into_iter().enumerate() {
        let is_condition = matches!(choice, Choice::Select);
        if place > 0 && (is_condition || facts.arity == 1) {
            return;
        }
        let operand: &BoundsBlock = match facts.scalars >> place & 1 {
            1 => &sources.scalar(source).0.splat(),
            _ => sources.lanes(source).block(0).0,
        };
        for lane in 0..LANES {
            let is_defined = operand.regularity[lane] >= DEFINED;
            match choice {
                Choice::Select if !is_defined => {
                    out.regularity[lane] = out.regularity[lane].min(PARTIAL);
                }
                Choice::Min | Choice::Max | Choice::Abs | Choice::Select => {}
                _ if !is_defined => Bounds::set(out, lane, TRUTH),
                _ => {}
            }
        }
    }
}

/// A comparison of which nothing is known.
const TRUTH: Bounds = Bounds {
    low: 0.0,
    high: 1.0,
    regularity: DEFINED,
};

/// Takes enclosures with an infinite end for undefined, and notes what is undefined.
#[inline(always)]
#[allow(
    clippy::needless_range_loop,
    reason = "several columns are read at the same lane"
)]
fn settle(block: &mut BoundsBlock, worst: &mut [f64; LANES]) {
    for lane in 0..LANES {
        let width = block.high[lane] - block.low[lane];
        // Not if an end is infinite, nor if there is none.
        let is_finite = width < f64::INFINITY;
        let regularity = block.regularity[lane];
        let is_better = !is_finite & (regularity > PARTIAL);
        let regularity = if is_better { PARTIAL } else { regularity };
        block.regularity[lane] = regularity;
        worst[lane] = if regularity < worst[lane] {
            regularity
        } else {
            worst[lane]
        };
    }
}

/// The lanes in which a condition holds, a bit each.
#[inline(always)]
fn mask(holds: impl Fn(usize) -> bool) -> u64 {
    let mut mask = 0;
    for group in 0..LANES / 8 {
        let mut bits = 0u8;
        for bit in 0..8 {
            bits |= u8::from(holds(8 * group + bit)) << bit;
        }
        mask |= u64::from(bits) << (8 * group);
    }
    mask
}

/// An operand's enclosure in a lane.
trait Lane: Copy {
    fn at(self, lane: usize) -> Bounds;
}

impl Lane for &BoundsBlock {
    #[inline(always)]
    fn at(self, lane: usize) -> Bounds {
        Bounds::get(self, lane)
    }
}

impl Lane for Bounds {
    #[inline(always)]
    fn at(self, _: usize) -> Bounds {
        self
    }
}

/// Records what the instruction decides, if it is a choice.
#[inline(always)]
fn record(instruction: &Instruction, sources: &Sources<'_, Bounds>, decision: &mut Decision) {
    let facts = instruction.code.facts();
    let Some(choice) = facts.choice else {
        return;
    };
    let lanes = |source| sources.lanes(source).block(0).0;
    let scalar = |source| sources.scalar(source).0;
    let (a, b) = (instruction.a, instruction.b);
    *decision = match choice {
        // Their condition is the first operand, the only one that counts.
        Choice::Select | Choice::Abs | Choice::IsNumber => of_one(choice, lanes(a)),
        _ => match facts.scalars & 3 {
            0 => of_two(choice, lanes(a), lanes(b)),
            1 => of_two(choice, scalar(a), lanes(b)),
            _ => of_two(choice, lanes(a), scalar(b)),
        },
    };
}

/// What is decided by one operand.
#[inline(always)]
fn of_one(choice: Choice, a: &BoundsBlock) -> Decision {
    let is_defined = |lane: usize| a.regularity[lane] >= DEFINED;
    let [first, second] = match choice {
        Choice::Select => [
            mask(|lane| is_defined(lane) & ((a.low[lane] > 0.0) | (a.high[lane] < 0.0))),
            mask(|lane| is_defined(lane) & (a.low[lane] == 0.0) & (a.high[lane] == 0.0)),
        ],
        Choice::IsNumber => [mask(is_defined), 0],
        _ => [
            mask(|lane| is_defined(lane) & (a.low[lane] > 0.0)),
            mask(|lane| is_defined(lane) & (a.high[lane] < 0.0)),
        ],
    };
    Decision { first, second }
}

/// What is decided by two operands.
#[inline(always)]
fn of_two<A: Lane, B: Lane>(choice: Choice, a: A, b: B) -> Decision {
    let both = |holds: fn(Bounds, Bounds) -> bool| {
        move |lane: usize| {
            let (a, b) = (a.at(lane), b.at(lane));
            (a.regularity >= DEFINED) & (b.regularity >= DEFINED) & holds(a, b)
        }
    };
    let [first, second] = match choice {
        Choice::Max => [
            mask(both(|a, b| b.high < a.low)),
            mask(both(|a, b| a.high < b.low)),
        ],
        Choice::Less => [
            mask(both(|a, b| a.high < b.low)),
            mask(both(|a, b| a.low >= b.high)),
        ],
        Choice::LessEqual => [
            mask(both(|a, b| a.high <= b.low)),
            mask(both(|a, b| a.low > b.high)),
        ],
        Choice::Equal => [
            mask(both(|a, b| (a.low == b.high) & (a.high == b.low))),
            mask(both(|a, b| (a.high < b.low) | (b.high < a.low))),
        ],
        _ => [
            mask(both(|a, b| a.high < b.low)),
            mask(both(|a, b| b.high < a.low)),
        ],
    };
    Decision { first, second }
}
