//! Operations: what a node of the graph can do with its operands.
//!
//! The static table in `table.rs` is the one place where an operation is described: its name,
//! documentation, value rule, interval rule, derivative rule and machine-code rule stand in one
//! entry, and everything else (constant folding, the interpreter, enclosures, derivatives, code
//! generation, the printer) reads it. A new operation is one new entry. Rules longer than a
//! formula live beside the table: [`value`], `partial` (derivatives), `lower` (machine code), and
//! [`super::interval`].

mod lower;
mod partial;
mod table;
pub mod value;

pub use table::Op;

use super::interval::Enclosure;
use super::{Graph, NodeId};

/// One entry of the table: everything that the program knows of an operation.
pub struct Operation {
    /// The name in printed graphs, and of the host function if there is one.
    pub name: &'static str,
    /// What it computes, in one sentence.
    pub documentation: &'static str,
    /// The result on numbers.
    pub value: Value,
    /// What the result can be when the operands lie in intervals.
    pub interval: fn(&[Enclosure]) -> Enclosure,
    /// How a change of an operand changes the result.
    pub derivative: Derivative,
    /// What becomes of the result when the operands grow.
    pub scaling: Scaling,
    /// How machine code computes it.
    pub code: MachineCode,
}

/// A value rule: the result of an operation on numbers, by arity.
#[derive(Clone, Copy, Debug)]
pub enum Value {
    /// Of one operand.
    One(fn(f64) -> f64),
    /// Of two operands.
    Two(fn(f64, f64) -> f64),
    /// Of three operands.
    Three(fn(f64, f64, f64) -> f64),
}

impl Value {
    /// How many operands the rule takes.
    pub const fn arity(self) -> usize {
        match self {
            Value::One(_) => 1,
            Value::Two(_) => 2,
            Value::Three(_) => 3,
        }
    }

    /// The result on these operands; those beyond the arity are ignored.
    pub fn apply(self, operands: [f64; 3]) -> f64 {
        let [a, b, c] = operands;
        match self {
            Value::One(value) => value(a),
            Value::Two(value) => value(a, b),
            Value::Three(value) => value(a, b, c),
        }
    }
}

/// A partial derivative of an operation, built from its operands and its result.
pub type Partial = fn(&mut Graph, operands: [NodeId; 3], result: NodeId) -> NodeId;

/// A derivative rule.
#[derive(Clone, Copy, Debug)]
pub enum Derivative {
    /// The result is piecewise constant: 0, at the steps too.
    Zero,
    /// The partial derivative in each operand.
    Partials(&'static [Partial]),
    /// The result is one of two operands, and changes with that one alone.
    Branch {
        /// Builds the condition that chooses.
        condition: fn(&mut Graph, operands: [NodeId; 3]) -> NodeId,
        /// The place of the operand that is the result where the condition is not 0.
        taken: usize,
        /// The place of the operand that is the result elsewhere.
        otherwise: usize,
    },
}

/// What an operation f makes of operands that are multiplied by powers of a t > 0, in exact
/// arithmetic.
#[derive(Clone, Copy, Debug)]
pub enum Scaling {
    /// f(t·a, t·b) = t·f(a, b).
    Shared,
    /// f(t·a, t·b) = f(a, b).
    Invariant,
    /// f(a, t·b, t·c) = t·f(a, b, c).
    Chosen,
    /// f(s·a, t·b) = s·t·f(a, b).
    Product,
    /// f(s·a, t·b) = s/t·f(a, b).
    Quotient,
    /// f(t·a) = tᵖ·f(a).
    Power(f64),
    /// f(t·a, p) = tᵖ·f(a, p).
    PowerOfOperand,
    /// Nothing of the kind.
    None,
}

/// How machine code computes an operation. All three ways give the bits of the value rule.
#[derive(Clone, Copy, Debug)]
pub enum MachineCode {
    /// By one instruction.
    Native(Instruction),
    /// By calling the value rule, a host function that has the operation's name.
    Host,
    /// By other operations: builds them on the operands and returns the result. What it builds
    /// may need lowering in turn.
    Lower(fn(&mut Graph, &[NodeId]) -> NodeId),
}

/// The instructions that native operations are made of, as IEEE 754 defines them. A comparison
/// gives 1.0 or 0.0, and 0.0 where an operand is NaN.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instruction {
    /// a + b
    Add,
    /// a − b
    Subtract,
    /// a·b
    Multiply,
    /// a/b
    Divide,
    /// −a
    Negate,
    /// a·a
    Square,
    /// √a
    SquareRoot,
    /// |a|
    Abs,
    /// ⌊a⌋
    Floor,
    /// ⌈a⌉
    Ceil,
    /// The smaller one; NaN if an operand is NaN, and −0 < 0.
    Min,
    /// The larger one; NaN if an operand is NaN, and −0 < 0.
    Max,
    /// a < b
    Less,
    /// a ≤ b
    LessEqual,
    /// a = b
    Equal,
    /// Whether a is not NaN.
    IsNumber,
    /// b where a ≠ 0 (or NaN), else c
    Select,
    /// 0 where a = 0 or b = 0, else a·b: the product's bits masked by the two comparisons.
    ChainProduct,
}

impl Op {
    /// The operation's entry in the table.
    pub fn operation(self) -> &'static Operation {
        &table::OPERATIONS[self as usize]
    }

    /// How many operands it takes: 1, 2 or 3.
    pub fn arity(self) -> usize {
        self.operation().value.arity()
    }

    /// Its name in printed graphs.
    pub fn name(self) -> &'static str {
        self.operation().name
    }

    /// Its result on numbers; operands beyond the arity are ignored.
    pub fn value(self, operands: [f64; 3]) -> f64 {
        self.operation().value.apply(operands)
    }

    /// Whether exchanging its two operands never changes the result. (`min` and `max` are not
    /// among them: at a tie their derivative belongs to the first operand.)
    pub(super) fn is_commutative(self) -> bool {
        matches!(
            self,
            Op::Add | Op::Multiply | Op::Equal | Op::Hypot | Op::ChainProduct
        )
    }

    /// Whether its result is always 1 or 0.
    pub(super) fn is_truth(self) -> bool {
        matches!(self, Op::Less | Op::LessEqual | Op::Equal | Op::IsNumber)
    }
}

#[cfg(test)]
mod tests;
