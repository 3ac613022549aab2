//! The order in which code that calls nothing executes its steps.
//!
//! A vector of numbers cannot be handed to a function without spilling all that is alive, and a
//! function's own loop over lanes is faster than calls. So steps that are functions stand between
//! chunks of code: chunks and groups of functions take turns over a block of points or over a box,
//! and what they tell each other waits in slots. Steps are moved so that as many functions as possible stand in
//! a group: a step that needs a function's result waits while the chunk goes on with others.

use super::chunk::{self, Lengths, NO_SLOT, Plan};
use super::emit;
use crate::engine::block::LANES;
use crate::engine::lower::{Lowered, Operand, Step};
use rustc_hash::FxHashMap;
use std::ops::Range;

/// A kernel in stages.
pub(super) struct Stages {
    /// The same steps in the order of their execution.
    pub(super) lowered: Lowered,
    /// One chunk for each stage. The last one is code, so that it can store what functions made.
    pub(super) plan: Plan,
    /// What the stages are.
    pub(super) stages: Vec<Stage>,
    /// The constants of the code, in the order of their places.
    pub(super) constants: Vec<f64>,
}

/// What the steps of a stage are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    /// They become code.
    Code,
    /// Functions, none of which needs another's result.
    Functions,
}

/// How many steps may wait for functions while a chunk goes on without them.
const WAITING: usize = 64;

/// Puts the steps in order, cuts them and gives them slots. Takes linear time for kernels without
/// functions, else at most in proportion to steps times [`WAITING`].
pub(super) fn stages(lowered: &Lowered, lengths: Lengths) -> Stages {
    let has_functions = lowered.steps.iter().any(is_function);
    let length = if lowered.steps.len() <= lengths.whole && !has_functions {
        usize::MAX
    } else {
        lengths.chunk
    };
    let (order, cuts) = order(lowered, length);
    let lowered = reordered(lowered, &order);
    let mut plan = Plan {
        chunks: cuts.iter().map(|(range, _)| range.clone()).collect(),
        slot: vec![NO_SLOT; lowered.steps.len()],
        slots: 0,
        block: LANES,
        constants: FxHashMap::default(),
    };
    chunk::assign_slots(&lowered, &mut plan, |step| {
        is_function(&lowered.steps[step])
    });
    let constants = constants(&lowered, &mut plan);
    Stages {
        stages: cuts.into_iter().map(|(_, stage)| stage).collect(),
        lowered,
        plan,
        constants,
    }
}

/// Whether no instruction computes the step.
fn is_function(step: &Step) -> bool {
    emit::native(step.operation).is_none()
}

/// A range of steps, and what they are.
type Cut = (Range<usize>, Stage);

/// The steps in the order of their execution, and where to cut them: code and functions take
/// turns, beginning and ending with code.
fn order(lowered: &Lowered, length: usize) -> (Vec<usize>, Vec<Cut>) {
    let count = lowered.steps.len();
    let mut order: Vec<usize> = Vec::with_capacity(count);
    let mut cuts: Vec<Cut> = Vec::new();
    let mut is_done = vec![false; count];
    let (mut waiting, mut next) = (Vec::new(), 0);
    loop {
        let start = order.len();
        let (mut functions, mut blocked) = (Vec::new(), Vec::new());
        let mut earlier = waiting.into_iter();
        // Those that have waited come first; when the chunk is full they go on waiting.
        while order.len() - start < length {
            let step = match earlier.next() {
                Some(step) => step,
                None if next < count && blocked.len() < WAITING => {
                    next += 1;
                    next - 1
                }
                None => break,
            };
            let is_ready = lowered.steps[step]
                .operands()
                .iter()
                .all(|&operand| match operand {
                    Operand::Register(register) => is_done[register as usize],
                    _ => true,
                });
            if !is_ready {
                blocked.push(step);
            } else if is_function(&lowered.steps[step]) {
                functions.push(step);
            } else {
                is_done[step] = true;
                order.push(step);
            }
        }
        blocked.extend(earlier);
        waiting = blocked;
        cuts.push((start..order.len(), Stage::Code));
        if functions.is_empty() && waiting.is_empty() && next == count {
            return (order, cuts);
        }
        if !functions.is_empty() {
            let start = order.len();
            functions.iter().for_each(|&step| is_done[step] = true);
            order.append(&mut functions);
            cuts.push((start..order.len(), Stage::Functions));
        }
    }
}

/// The same steps in another order, in which operands still come first.
fn reordered(lowered: &Lowered, order: &[usize]) -> Lowered {
    let mut places = vec![0; order.len()];
    for (place, &step) in order.iter().enumerate() {
        places[step] = place as u32;
    }
    let moved = |operand: Operand| match operand {
        Operand::Register(register) => Operand::Register(places[register as usize]),
        other => other,
    };
    let steps = order.iter().map(|&step| {
        let Step {
            operation,
            operands,
        } = lowered.steps[step];
        Step {
            operation,
            operands: operands.map(moved),
        }
    });
    Lowered {
        steps: steps.collect(),
        outputs: lowered.outputs.iter().copied().map(moved).collect(),
        dimension: lowered.dimension,
        parameters: lowered.parameters,
        uniform_steps: lowered.uniform_steps.clone(),
    }
}

/// The distinct constants of code; their places are noted in the plan. 0 is made without memory.
fn constants(lowered: &Lowered, plan: &mut Plan) -> Vec<f64> {
    let mut constants = Vec::new();
    for step in lowered.steps.iter().filter(|step| !is_function(step)) {
        for &operand in step.operands() {
            if let Operand::Constant(number) = operand
                && number.to_bits() != 0
            {
                plan.constants.entry(number.to_bits()).or_insert_with(|| {
                    constants.push(number);
                    constants.len() as u32 - 1
                });
            }
        }
    }
    constants
}
