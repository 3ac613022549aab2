//! Fusing: an operation takes over the one that makes its operand.
//!
//! Only an intermediate result that has no other use disappears, and only where there is a kernel
//! for the pair (or the triple). Which pairs have one was chosen by reasoning about solids, sums
//! of Gaussians and their derivatives; what each of them gains has not been measured by itself.
//! Fusing changes no bits: every operation still rounds.

use crate::engine::block::{Kernel, Kind};
use crate::engine::lower::{Lowered, Operand, Step};
use crate::graph::Op;

/// A kernel with its operands, of which `arity` count.
#[derive(Clone, Copy, Debug)]
pub(in crate::engine) struct Fused {
    pub(in crate::engine) kernel: Kernel,
    pub(in crate::engine) operands: [Operand; 3],
    pub(in crate::engine) arity: usize,
}

/// What becomes of operations that choose one of their operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::engine) enum Choices {
    /// They are fused like others.
    Fused,
    /// They stay alone, so that each can be decided by itself.
    Alone,
}

/// What each step becomes: `None` if another one has taken it over, or nobody needs it.
pub(in crate::engine) fn fuse(lowered: &Lowered, choices: Choices) -> Vec<Option<Fused>> {
    let mut steps = Steps {
        choices,
        steps: &lowered.steps,
        uses: uses(lowered),
    };
    let mut fused = vec![None; lowered.steps.len()];
    // From the last step on, so that the larger patterns, which end later, come first.
    for index in (0..lowered.steps.len()).rev() {
        if steps.uses[index] > 0 {
            fused[index] = Some(steps.fuse(&lowered.steps[index]));
        }
    }
    fused
}

/// How often each step's result is used.
fn uses(lowered: &Lowered) -> Vec<u32> {
    let mut uses = vec![0; lowered.steps.len()];
    let operands = lowered.steps.iter().flat_map(Step::operands);
    for operand in operands.chain(&lowered.outputs) {
        if let Operand::Register(index) = *operand {
            uses[index as usize] += 1;
        }
    }
    uses
}

/// The steps and how often each is used; 0 if it has been taken over.
struct Steps<'a> {
    choices: Choices,
    steps: &'a [Step],
    uses: Vec<u32>,
}

impl Steps<'_> {
    /// The step with as many others as there is a kernel for.
    fn fuse(&mut self, step: &Step) -> Fused {
        let [a, b, _] = step.operands;
        let fused = match step.operation {
            Op::Square => self.squared(a),
            Op::Subtract => self.subtracted(a, b),
            Op::Add => self.added(a, b).or_else(|| self.added(b, a)),
            Op::Min | Op::Max if self.choices == Choices::Alone => None,
            Op::Min => self.minimum(a, b).or_else(|| self.minimum(b, a)),
            Op::Max => self.maximum(a, b).or_else(|| self.maximum(b, a)),
            _ => None,
        };
        fused.unwrap_or_else(|| alone(step))
    }

    /// a²
    fn squared(&mut self, a: Operand) -> Option<Fused> {
        let [u, v] = self.operands(a, Op::Subtract)?;
        self.take(&[a], Kernel::SquaredDifference, &[u, v])
    }

    /// a − b
    fn subtracted(&mut self, a: Operand, b: Operand) -> Option<Fused> {
        if let Some([u, v]) = self.operands(a, Op::Multiply) {
            self.take(&[a], Kernel::MultiplySubtract, &[u, v, b])
        } else if let Some([u, _]) = self.operands(a, Op::SquareRoot) {
            self.take(&[a], Kernel::RootSubtract, &[u, b])
        } else {
            let [u, v] = self.operands(b, Op::Multiply)?;
            self.take(&[b], Kernel::SubtractProduct, &[u, v, a])
        }
    }

    /// a + b, where a may be taken over.
    fn added(&mut self, a: Operand, b: Operand) -> Option<Fused> {
        if let Some([u, v]) = self.operands(a, Op::Multiply) {
            self.take(&[a], Kernel::MultiplyAdd, &[u, v, b])
        } else if let Some([u, v]) = self.operands(a, Op::ChainProduct) {
            self.take(&[a], Kernel::ChainProductAdd, &[u, v, b])
        } else {
            let [u, _] = self.operands(a, Op::Square)?;
            self.operands(u, Op::Subtract)
                .and_then(|[v, w]| self.take(&[a, u], Kernel::SquaredDifferenceAdd, &[v, w, b]))
                .or_else(|| self.take(&[a], Kernel::SquareAdd, &[u, b]))
        }
    }

    /// min(a, b), where a may be taken over.
    fn minimum(&mut self, a: Operand, b: Operand) -> Option<Fused> {
        if let Some([u, v]) = self.operands(a, Op::Subtract) {
            self.operands(u, Op::SquareRoot)
                .and_then(|[w, _]| self.take(&[a, u], Kernel::RootSubtractMin, &[w, v, b]))
                .or_else(|| self.take(&[a], Kernel::SubtractMin, &[u, v, b]))
        } else if let Some([u, v]) = self.operands(a, Op::Max) {
            self.take(&[a], Kernel::MaxMin, &[u, v, b])
        } else {
            let [u, v] = self.operands(a, Op::Min)?;
            self.take(&[a], Kernel::MinOfThree, &[u, v, b])
        }
    }

    /// max(a, b), where a may be taken over.
    fn maximum(&mut self, a: Operand, b: Operand) -> Option<Fused> {
        if let Some([u, v]) = self.operands(a, Op::Subtract) {
            self.take(&[a], Kernel::SubtractMax, &[u, v, b])
        } else if let Some([u, v]) = self.operands(a, Op::Min) {
            self.take(&[a], Kernel::MinMax, &[u, v, b])
        } else if let Some([u, v]) = self.operands(a, Op::Max) {
            self.take(&[a], Kernel::MaxOfThree, &[u, v, b])
        } else {
            let [u, _] = self.operands(a, Op::Negate)?;
            self.take(&[a], Kernel::NegateMax, &[u, b])
        }
    }

    /// The first operands of the step that makes this one, if it is such an operation and is
    /// used nowhere else.
    fn operands(&self, operand: Operand, operation: Op) -> Option<[Operand; 2]> {
        let Operand::Register(index) = operand else {
            return None;
        };
        let step = &self.steps[index as usize];
        let is_alone = self.uses[index as usize] == 1 && step.operation == operation;
        is_alone.then_some([step.operands[0], step.operands[1]])
    }

    /// The kernel on these operands if it has a code for them; then the steps that made `taken`
    /// have been taken over.
    fn take(&mut self, taken: &[Operand], kernel: Kernel, operands: &[Operand]) -> Option<Fused> {
        let fused = ordered(kernel, operands)?;
        for operand in taken {
            if let Operand::Register(index) = *operand {
                self.uses[index as usize] = 0;
            }
        }
        Some(fused)
    }
}

/// The kernel of a single step.
fn alone(step: &Step) -> Fused {
    let kernel = Kernel::from(step.operation);
    ordered(kernel, step.operands()).unwrap_or(Fused {
        kernel,
        operands: step.operands,
        arity: step.operands().len(),
    })
}

/// The kernel on these operands in an order for which it has a code.
fn ordered(kernel: Kernel, operands: &[Operand]) -> Option<Fused> {
    let first = *operands.first()?;
    let operand = |place: usize| operands.get(place).copied().unwrap_or(first);
    let given = [first, operand(1), operand(2)];
    let exchanged = [given[1], given[0], given[2]];
    let orders = match is_symmetric(kernel) {
        true => &[given, exchanged][..],
        false => &[given][..],
    };
    let kinds = |order: &[Operand; 3]| order.map(kind);
    let order = orders
        .iter()
        .find(|order| kernel.code(&kinds(order)[..operands.len()]).is_some())?;
    Some(Fused {
        kernel,
        operands: *order,
        arity: operands.len(),
    })
}

/// Whether exchanging the first two operands does not change the result.
pub(in crate::engine) fn is_symmetric(kernel: Kernel) -> bool {
    matches!(
        kernel,
        Kernel::Add
            | Kernel::Multiply
            | Kernel::Min
            | Kernel::Max
            | Kernel::Equal
            | Kernel::ChainProduct
            | Kernel::MultiplyAdd
            | Kernel::MultiplySubtract
            | Kernel::SubtractProduct
            | Kernel::SquaredDifference
            | Kernel::SquaredDifferenceAdd
            | Kernel::ChainProductAdd
    )
}

/// What a code has for the operand.
fn kind(operand: Operand) -> Kind {
    match operand {
        Operand::Coordinate(_) | Operand::Register(_) => Kind::Lanes,
        Operand::Constant(_) | Operand::Uniform(_) => Kind::Scalar,
    }
}
