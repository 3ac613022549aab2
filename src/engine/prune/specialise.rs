//! From a sequence and what boxes decide to the shorter sequences of those boxes.
//!
//! [`Batch::mark`] finds the steps that are needed in each of up to 64 boxes, in one pass from
//! the last step to the first, with a bit for every box. [`Specialiser::specialise`] collects
//! those of one box and writes them down anew. Both take time in proportion to the longer
//! sequence, of which the bulk is shared by the boxes, and no memory that is not kept.

use super::Scalars;
use super::fold::Folder;
use super::sequence::{Allocator, SCALAR, Sequence, Step, is_scalar};
use crate::engine::block::{Choice, Code, Decision, Kernel};

/// A box's sequence must be shorter than this part of the longer one; else that one serves.
const WORTHWHILE: (usize, usize) = (7, 8);

/// What up to 64 boxes decide about a sequence, and need of it.
#[derive(Default)]
pub(in crate::engine) struct Batch {
    /// By steps.
    pub(in crate::engine) decisions: Vec<Decision>,
    /// By steps: the boxes that need it, a bit each.
    needed: Vec<u64>,
}

impl Batch {
    /// Makes room for the decisions about a sequence.
    pub(in crate::engine) fn prepare(&mut self, length: usize) -> &mut [Decision] {
        if self.decisions.len() < length {
            self.decisions.resize(length, Decision::default());
        }
        &mut self.decisions[..length]
    }

    /// Calls `tell` with the numbers of the sequence's choices that are decided in this lane, and
    /// what is decided, in the first bits, for operands in the order of the whole function.
    pub(in crate::engine) fn tell(
        &self,
        sequence: &Sequence,
        lane: usize,
        mut tell: impl FnMut(usize, Decision),
    ) {
        for (step, decision) in sequence.steps.iter().zip(&self.decisions) {
            let Some((choice, is_exchanged)) = step.origin.number() else {
                continue;
            };
            if step.code.facts().choice.is_some() {
                let (first, second) = (decision.first >> lane & 1, decision.second >> lane & 1);
                let (first, second) = match is_exchanged {
                    true => (second, first),
                    false => (first, second),
                };
                if first | second != 0 {
                    tell(choice, Decision { first, second });
                }
            }
        }
    }

    /// Takes over what is known of the sequence's choices by their numbers, in the first bits.
    pub(in crate::engine) fn learn(&mut self, sequence: &Sequence, known: &[Decision]) {
        let decisions = self.prepare(sequence.len());
        for (index, step) in sequence.steps.iter().enumerate() {
            let Some(choice) = step.code.facts().choice else {
                continue;
            };
            let number = step.origin.number();
            let found = number.and_then(|(number, _)| known.get(number));
            let mut decision = found.copied().unwrap_or_default();
            if let Some((_, true)) = number {
                std::mem::swap(&mut decision.first, &mut decision.second);
            }
            if choice == Choice::Select && decision == Decision::default() {
                // By its condition, if that is a comparison that is decided.
                let condition = step.operands[0] as usize;
                let is_comparison = sequence
                    .steps
                    .get(condition)
                    .and_then(|step| step.code.facts().choice)
                    .is_some_and(Choice::is_truth);
                if is_comparison {
                    decision = decisions[condition];
                }
            }
            decisions[index] = decision;
        }
    }

    /// Finds what these boxes need, a bit each.
    pub(in crate::engine) fn mark(&mut self, sequence: &Sequence, boxes: u64) {
        let length = sequence.steps.len();
        self.needed.clear();
        // One more, which all operands that are no steps share.
        self.needed.resize(length + 1, 0);
        let needed = &mut self.needed[..length + 1];
        for &output in &sequence.outputs {
            needed[(output as usize).min(length)] |= boxes;
        }
        for (index, step) in sequence.steps.iter().enumerate().rev() {
            let boxes = needed[index];
            if boxes == 0 {
                continue;
            }
            let [a, b, c] = step.operands;
            let [a, b, c] = [a as usize, b as usize, c as usize];
            let [a, b, c] = [a.min(length), b.min(length), c.min(length)];
            match step.code.facts().choice {
                None => {
                    needed[a] |= boxes;
                    needed[b] |= boxes;
                    needed[c] |= boxes;
                }
                Some(choice) => {
                    let Decision { first, second } = self.decisions[index];
                    let open = boxes & !(first | second);
                    match choice {
                        Choice::Min | Choice::Max => {
                            needed[a] |= boxes & !second;
                            needed[b] |= boxes & !first;
                        }
                        Choice::Select => {
                            needed[a] |= open;
                            needed[b] |= boxes & !second;
                            needed[c] |= boxes & !first;
                        }
                        Choice::Abs => needed[a] |= boxes,
                        _ => {
                            needed[a] |= open;
                            needed[b] |= open;
                        }
                    }
                }
            }
        }
    }
}

/// Makes shorter sequences; keeps its memory from one to the next.
#[derive(Default)]
pub(in crate::engine) struct Specialiser {
    /// The steps that the box needs come first.
    list: Vec<u32>,
    /// Where the result of each step of the longer sequence is found in the shorter one.
    places: Vec<u32>,
    /// For removing steps.
    needed: Vec<u32>,
    allocator: Allocator,
}

impl Specialiser {
    /// Writes to `child` what the box in this lane of the batch needs of the sequence, which has
    /// been marked. Returns false, with the child as it was, if that is hardly shorter.
    pub(in crate::engine) fn specialise(
        &mut self,
        sequence: &Sequence,
        (batch, lane): (&Batch, usize),
        scalars: &mut Scalars,
        child: &mut Sequence,
    ) -> bool {
        let length = sequence.steps.len();
        let count = self.collect(&batch.needed[..length], lane);
        if count * WORTHWHILE.1 > length * WORTHWHILE.0 {
            return false;
        }
        if self.places.len() < length {
            self.places.resize(length, 0);
        }
        child.steps.clear();
        let mut folder = Folder {
            steps: &mut child.steps,
            scalars,
            dropped: false,
        };
        for &index in &self.list[..count] {
            let index = index as usize;
            let step = &sequence.steps[index];
            let decision = batch.decisions[index];
            self.places[index] = rewrite(step, decision, lane, &self.places[..length], &mut folder);
        }
        let dropped = folder.dropped;
        child.outputs.clear();
        let outputs = sequence.outputs.iter();
        let places = &self.places[..length];
        child
            .outputs
            .extend(outputs.map(|&output| place(places, output)));
        if dropped {
            self.remove_unneeded(child);
        }
        self.allocator.assign(child);
        true
    }

    /// Lists the steps whose bit is set, and returns how many there are.
    fn collect(&mut self, needed: &[u64], lane: usize) -> usize {
        if self.list.len() < needed.len() {
            self.list.resize(needed.len(), 0);
        }
        // Written without branches, for there is no telling which steps are needed.
        let list = &mut self.list[..needed.len()];
        let mut count = 0;
        for (bits, index) in needed.iter().zip(0..) {
            list[count] = index;
            count += (bits >> lane & 1) as usize;
        }
        count
    }

    /// Removes what no output needs.
    fn remove_unneeded(&mut self, sequence: &mut Sequence) {
        let Sequence { steps, outputs, .. } = sequence;
        self.needed.clear();
        self.needed.resize(steps.len(), 0);
        let need = |operand: u32, needed: &mut [u32]| {
            if let Some(needed) = needed.get_mut(operand as usize) {
                *needed = 1;
            }
        };
        for &output in outputs.iter() {
            need(output, &mut self.needed);
        }
        for (index, step) in steps.iter().enumerate().rev() {
            if self.needed[index] != 0 {
                for operand in step.operands {
                    need(operand, &mut self.needed);
                }
            }
        }
        // From here on the number of steps that are kept before each one.
        let mut kept = 0;
        for index in 0..steps.len() {
            if std::mem::replace(&mut self.needed[index], kept) != 0 {
                let step = steps[index];
                steps[kept as usize] = Step {
                    operands: step.operands.map(|operand| place(&self.needed, operand)),
                    ..step
                };
                kept += 1;
            }
        }
        steps.truncate(kept as usize);
        for output in outputs {
            *output = place(&self.needed, *output);
        }
    }
}

/// Where an operand of the longer sequence is found in the shorter one.
#[inline(always)]
fn place(places: &[u32], operand: u32) -> u32 {
    places.get(operand as usize).copied().unwrap_or(operand)
}

/// Appends what a step becomes and returns where its result is found.
#[inline(always)]
fn rewrite(
    step: &Step,
    decision: Decision,
    lane: usize,
    places: &[u32],
    folder: &mut Folder<'_>,
) -> u32 {
    let [a, b, c] = step.operands;
    let operands = [place(places, a), place(places, b), place(places, c)];
    let facts = step.code.facts();
    if let Some(choice) = facts.choice {
        let is_first = decision.first >> lane & 1 == 1;
        let is_second = decision.second >> lane & 1 == 1;
        if is_first | is_second {
            let [a, b, c] = operands;
            return match choice {
                Choice::Min | Choice::Max if is_first => a,
                Choice::Min | Choice::Max => b,
                Choice::Select if is_first => b,
                Choice::Select => c,
                Choice::Abs if is_first => a,
                Choice::Abs => folder.apply(Kernel::Negate, 1, operands),
                _ if is_first => SCALAR | folder.scalars.one,
                _ => SCALAR | folder.scalars.zero,
            };
        }
    }
    let [a, b, c] = operands;
    let scalars =
        u8::from(is_scalar(a)) | u8::from(is_scalar(b)) << 1 | u8::from(is_scalar(c)) << 2;
    if scalars == facts.scalars && step.code != Code::Splat {
        folder.steps.push(Step {
            operands,
            code: step.code,
            origin: step.origin,
        });
        return folder.steps.len() as u32 - 1;
    }
    match facts.kernel {
        Some(kernel) => folder.apply_choice((kernel, step.origin), facts.arity, operands),
        // Lanes of a scalar, which those who read them may take as it is.
        None => operands[0],
    }
}
