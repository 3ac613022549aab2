//! Folding: what becomes of a step some of whose operands have become scalars.
//!
//! All rules keep the bits of the result, NaN and the signs of zeros included: x + 0 is x only
//! where x cannot be −0, and 0·x is no constant, but a chain-rule product with 0 is.

use super::sequence::{SCALAR, Step, encode, is_scalar, is_step, scalar_place};
use super::{Origin, Scalars};
use crate::engine::block::{Kernel, Kind, single};

/// Appends steps to a list.
pub(super) struct Folder<'a> {
    pub(super) steps: &'a mut Vec<Step>,
    pub(super) scalars: &'a mut Scalars,
    /// Set if an operand that is not a scalar is no longer needed.
    pub(super) dropped: bool,
}

impl Folder<'_> {
    /// Where the kernel's result on these operands is found, of which `arity` count.
    pub(super) fn apply(&mut self, kernel: Kernel, arity: usize, operands: [u32; 3]) -> u32 {
        self.apply_choice((kernel, Origin::NONE), arity, operands)
    }

    /// The same for what may be a choice.
    pub(super) fn apply_choice(
        &mut self,
        (kernel, origin): (Kernel, Origin),
        arity: usize,
        operands: [u32; 3],
    ) -> u32 {
        if operands[..arity].iter().all(|&operand| is_scalar(operand)) {
            return self.constant(kernel, arity, operands);
        }
        let [a, b, c] = operands;
        let are_scalars = is_scalar(a) && is_scalar(b);
        match kernel {
            Kernel::Select => {
                if let Some(condition) = self.number(a) {
                    self.dropped = true;
                    return if condition != 0.0 { b } else { c };
                }
            }
            Kernel::ChainProduct if self.is_zero(a) || self.is_zero(b) => {
                self.dropped = true;
                return SCALAR | self.scalars.zero;
            }
            Kernel::ChainProductAdd if are_scalars || self.is_zero(a) || self.is_zero(b) => {
                let product = self.apply(Kernel::ChainProduct, 2, [a, b, a]);
                return self.apply(Kernel::Add, 2, [c, product, c]);
            }
            Kernel::MultiplyAdd if are_scalars => {
                let product = self.apply(Kernel::Multiply, 2, [a, b, a]);
                return self.apply(Kernel::Add, 2, [c, product, c]);
            }
            Kernel::MultiplySubtract if are_scalars => {
                let product = self.apply(Kernel::Multiply, 2, [a, b, a]);
                return self.apply(Kernel::Subtract, 2, [product, c, product]);
            }
            Kernel::SubtractProduct if are_scalars => {
                let product = self.apply(Kernel::Multiply, 2, [a, b, a]);
                return self.apply(Kernel::Subtract, 2, [c, product, c]);
            }
            Kernel::SquaredDifferenceAdd if are_scalars => {
                let square = self.apply(Kernel::SquaredDifference, 2, [a, b, a]);
                return self.apply(Kernel::Add, 2, [c, square, c]);
            }
            Kernel::SquareAdd if is_scalar(a) => {
                let square = self.apply(Kernel::Square, 1, [a; 3]);
                return self.apply(Kernel::Add, 2, [b, square, b]);
            }
            Kernel::RootSubtract if is_scalar(a) => {
                let root = self.apply(Kernel::SquareRoot, 1, [a; 3]);
                return self.apply(Kernel::Subtract, 2, [root, b, root]);
            }
            Kernel::Add if is_scalar(a) && self.is_neutral(b, a) => return b,
            Kernel::Add if is_scalar(b) && self.is_neutral(a, b) => return a,
            Kernel::Subtract if self.is(b, 0.0) => return a,
            Kernel::Multiply | Kernel::Divide if self.is(b, 1.0) => return a,
            Kernel::Multiply if self.is(a, 1.0) => return b,
            _ => {}
        }
        encode(self.steps, (kernel, origin), arity, operands)
    }

    /// The result on scalars.
    fn constant(&mut self, kernel: Kernel, arity: usize, operands: [u32; 3]) -> u32 {
        // Every kernel has a code for lanes alone.
        let Some(code) = kernel.code(&[Kind::Lanes; 3][..arity]) else {
            return encode(self.steps, (kernel, Origin::NONE), arity, operands);
        };
        let places = operands.map(|operand| scalar_place(operand).unwrap_or(0));
        let number = single(code, places.map(|place| self.scalars.double[place]));
        let bounds = single(code, places.map(|place| self.scalars.bounds[place]));
        SCALAR | self.scalars.push(number, bounds)
    }

    /// The number that the operand is, if it is one.
    fn number(&self, operand: u32) -> Option<f64> {
        scalar_place(operand).map(|place| self.scalars.double[place])
    }

    /// Whether the operand is this number, to the bit.
    fn is(&self, operand: u32, number: f64) -> bool {
        let found = self.number(operand).map(f64::to_bits);
        found == Some(number.to_bits())
    }

    /// Whether the operand is 0 or −0.
    fn is_zero(&self, operand: u32) -> bool {
        self.number(operand) == Some(0.0)
    }

    /// Whether adding the scalar leaves the operand as it is.
    fn is_neutral(&self, operand: u32, scalar: u32) -> bool {
        self.is(scalar, -0.0) || (self.is(scalar, 0.0) && self.is_never_negative_zero(operand))
    }

    /// Whether the operand is made by a step whose result is never −0.
    fn is_never_negative_zero(&self, operand: u32) -> bool {
        let step = match self.steps.get(operand as usize) {
            Some(step) if is_step(operand) => step,
            _ => return false,
        };
        let is_other_than_negative_zero =
            |operand: u32| is_scalar(operand) && !self.is(operand, -0.0);
        let [_, b, c] = step.operands;
        match step.code.facts().kernel {
            Some(Kernel::Square | Kernel::SquaredDifference | Kernel::Abs | Kernel::Exp) => true,
            // A sum is −0 only if both terms are.
            Some(Kernel::SquareAdd | Kernel::SquaredDifferenceAdd) => true,
            Some(Kernel::Add) => is_other_than_negative_zero(b),
            Some(Kernel::MultiplyAdd | Kernel::ChainProductAdd) => is_other_than_negative_zero(c),
            _ => false,
        }
    }
}
