//! What the kernels need of a kind of number: the table's operations, and how lanes are stored.
//!
//! The formulas of [`super::table`] are written once in these methods. For floating-point numbers
//! each is an IEEE operation or a branch-free combination of some, so that a loop over lanes
//! becomes vector code of any width with the bits of the table's value rules.

use crate::graph::Op;
use crate::graph::operation::value::is_algebraic_power;
use crate::math::slice;

/// The lanes of one block of floating-point numbers.
pub(in crate::engine) const LANES: usize = 64;

/// A kind of number that tapes compute with.
pub(in crate::engine) trait Number: Copy + 'static {
    /// The lanes of one block.
    type Block: Copy + 'static;

    /// How many lanes a block has.
    const LANES: usize;

    /// A block of equal lanes.
    fn splat(self) -> Self::Block;
    /// The number in a lane below [`Number::LANES`].
    fn get(block: &Self::Block, lane: usize) -> Self;
    /// Puts a number into a lane below [`Number::LANES`].
    fn set(block: &mut Self::Block, lane: usize, number: Self);

    /// a + b
    fn add(self, other: Self) -> Self;
    /// a − b
    fn subtract(self, other: Self) -> Self;
    /// a·b
    fn multiply(self, other: Self) -> Self;
    /// a/b
    fn divide(self, other: Self) -> Self;
    /// −a
    fn negate(self) -> Self;
    /// a·a
    fn square(self) -> Self;
    /// (a − b)²
    #[inline(always)]
    fn squared_difference(self, other: Self) -> Self {
        self.subtract(other).square()
    }
    /// √a
    fn square_root(self) -> Self;
    /// |a|
    fn absolute(self) -> Self;
    /// ⌊a⌋
    fn round_down(self) -> Self;
    /// ⌈a⌉
    fn round_up(self) -> Self;
    /// The smaller one; NaN if an operand is NaN, and −0 < 0.
    fn smaller(self, other: Self) -> Self;
    /// The larger one; NaN if an operand is NaN, and −0 < 0.
    fn larger(self, other: Self) -> Self;
    /// a < b
    fn less(self, other: Self) -> Self;
    /// a ≤ b
    fn less_equal(self, other: Self) -> Self;
    /// a = b
    fn equal(self, other: Self) -> Self;
    /// Whether a is not NaN.
    fn is_number(self) -> Self;
    /// `taken` where this is not 0, else `otherwise`.
    fn select(self, taken: Self, otherwise: Self) -> Self;
    /// a·b, in which an exact 0 absorbs infinity and NaN.
    fn chain_product(self, other: Self) -> Self;

    /// An operation of one operand that is not among the above.
    fn function_of_one(op: Op, out: &mut Self::Block, a: &Self::Block);
    /// An operation of two operands that is not among the above.
    fn function_of_two(op: Op, out: &mut Self::Block, a: &Self::Block, b: &Self::Block);
    /// aⁿ for an integer n of which [`is_integer_power`] holds, by repeated multiplication.
    fn integer_power(out: &mut Self::Block, a: &Self::Block, exponent: Self);
    /// a mod b
    fn modulo(out: &mut Self::Block, a: &Self::Block, b: Self);
    /// Such an operation on single numbers.
    fn function(op: Op, operands: [Self; 3]) -> Self;

    /// Lends the thread's own memory of at least `length` blocks, whose content is unspecified,
    /// to `work`.
    fn with_memory(length: usize, work: impl FnOnce(&mut [Self::Block]));
}

/// The bytes of a line of the cache, and of the widest vectors.
const LINE: usize = 64;

/// Lends numbers or blocks that are kept from call to call, so that repeated calls do not allocate.
pub(in crate::engine) fn lend<B: Copy>(
    kept: &std::cell::Cell<Vec<B>>,
    length: usize,
    filling: B,
    work: impl FnOnce(&mut [B]),
) {
    /// More than this is given back, in bytes.
    const KEPT: usize = 1 << 22;
    let mut blocks = kept.take();
    if blocks.len() < length {
        blocks.resize(length, filling);
    }
    work(&mut blocks[..length]);
    if blocks.len() * size_of::<B>() <= KEPT {
        kept.set(blocks);
    }
}

/// Both floating-point types differ only in their bits.
macro_rules! floating_point {
    ($float:ident) => {
        impl Number for $float {
            type Block = [$float; LANES];

            const LANES: usize = LANES;

            #[inline(always)]
            fn splat(self) -> Self::Block {
                [self; LANES]
            }

            #[inline(always)]
            fn get(block: &Self::Block, lane: usize) -> Self {
                block[lane]
            }

            #[inline(always)]
            fn set(block: &mut Self::Block, lane: usize, number: Self) {
                block[lane] = number;
            }

            #[inline(always)]
            fn add(self, other: Self) -> Self {
                self + other
            }

            #[inline(always)]
            fn subtract(self, other: Self) -> Self {
                self - other
            }

            #[inline(always)]
            fn multiply(self, other: Self) -> Self {
                self * other
            }

            #[inline(always)]
            fn divide(self, other: Self) -> Self {
                self / other
            }

            #[inline(always)]
            fn negate(self) -> Self {
                -self
            }

            #[inline(always)]
            fn square(self) -> Self {
                self * self
            }

            #[inline(always)]
            fn square_root(self) -> Self {
                self.sqrt()
            }

            #[inline(always)]
            fn absolute(self) -> Self {
                self.abs()
            }

            #[inline(always)]
            fn round_down(self) -> Self {
                self.floor()
            }

            #[inline(always)]
            fn round_up(self) -> Self {
                self.ceil()
            }

            /// Two minimum instructions, which differ where the operands are equal or one is NaN;
            /// there the union of bits is −0 if one is −0, and NaN if one is NaN.
            #[inline(always)]
            fn smaller(self, other: Self) -> Self {
                let first = if self < other { self } else { other };
                let second = if other < self { other } else { self };
                Self::from_bits(first.to_bits() | second.to_bits())
            }

            /// Like [`Number::smaller`], but for the sign's intersection: 0 if one operand is 0
            /// and the other −0.
            #[inline(always)]
            fn larger(self, other: Self) -> Self {
                let first = if self > other { self } else { other };
                let second = if other > self { other } else { self };
                let (one, two) = (first.to_bits(), second.to_bits());
                let sign = (-0.0 as $float).to_bits();
                Self::from_bits((one & two) | ((one | two) & !sign))
            }

            #[inline(always)]
            fn less(self, other: Self) -> Self {
                if self < other { 1.0 } else { 0.0 }
            }

            #[inline(always)]
            fn less_equal(self, other: Self) -> Self {
                if self <= other { 1.0 } else { 0.0 }
            }

            #[inline(always)]
            fn equal(self, other: Self) -> Self {
                if self == other { 1.0 } else { 0.0 }
            }

            #[inline(always)]
            fn is_number(self) -> Self {
                if self.is_nan() { 0.0 } else { 1.0 }
            }

            #[inline(always)]
            fn select(self, taken: Self, otherwise: Self) -> Self {
                if self != 0.0 { taken } else { otherwise }
            }

            #[inline(always)]
            fn chain_product(self, other: Self) -> Self {
                let product = self * other;
                let absorbed = (self == 0.0) | (other == 0.0);
                if absorbed { 0.0 } else { product }
            }

            #[inline(always)]
            fn function_of_one(op: Op, out: &mut Self::Block, a: &Self::Block) {
                match op {
                    Op::Exp => slice::exp(out, a),
                    Op::Log => slice::log(out, a),
                    Op::Sin => slice::sin(out, a),
                    Op::Cos => slice::cos(out, a),
                    Op::Tan => slice::tan(out, a),
                    Op::Asin => slice::asin(out, a),
                    Op::Acos => slice::acos(out, a),
                    Op::Atan => slice::atan(out, a),
                    Op::Sinh => slice::sinh(out, a),
                    Op::Cosh => slice::cosh(out, a),
                    Op::Tanh => slice::tanh(out, a),
                    Op::Sign => {
                        for (out, &a) in out.iter_mut().zip(a) {
                            let not_positive = if a < 0.0 { -1.0 } else { a };
                            *out = if 0.0 < a { 1.0 } else { not_positive };
                        }
                    }
                    Op::Round => {
                        for (out, &a) in out.iter_mut().zip(a) {
                            let (floor, ceil) = (a.floor(), a.ceil());
                            let if_negative = if 0.5 <= ceil - a { floor } else { ceil };
                            let otherwise = if 0.5 <= a - floor { ceil } else { floor };
                            *out = if a < 0.0 { if_negative } else { otherwise };
                        }
                    }
                    _ => {
                        for (out, &a) in out.iter_mut().zip(a) {
                            *out = op.value([f64::from(a), 0.0, 0.0]) as $float;
                        }
                    }
                }
            }

            #[inline(always)]
            fn function_of_two(op: Op, out: &mut Self::Block, a: &Self::Block, b: &Self::Block) {
                match op {
                    Op::Hypot => slice::hypot(out, a, b),
                    // −0 counts as 0, as in the table's value rule.
                    Op::Atan2 => {
                        let (mut y, mut x) = (*a, *b);
                        for lane in 0..LANES {
                            y[lane] += 0.0;
                            x[lane] += 0.0;
                        }
                        slice::atan2(out, &y, &x);
                    }
                    Op::Modulo => {
                        for ((out, &a), &b) in out.iter_mut().zip(a).zip(b) {
                            *out = a - b * (a / b).floor();
                        }
                    }
                    Op::Power => {
                        slice::pow(out, a, b);
                        // Integers and ½ have rules of their own.
                        if b.iter().any(|&b| is_algebraic_power(f64::from(b))) {
                            for ((out, &a), &b) in out.iter_mut().zip(a).zip(b) {
                                if is_algebraic_power(f64::from(b)) {
                                    *out = op.value([f64::from(a), f64::from(b), 0.0]) as $float;
                                }
                            }
                        }
                    }
                    _ => {
                        for ((out, &a), &b) in out.iter_mut().zip(a).zip(b) {
                            *out = op.value([f64::from(a), f64::from(b), 0.0]) as $float;
                        }
                    }
                }
            }

            #[inline(always)]
            fn integer_power(out: &mut Self::Block, a: &Self::Block, exponent: Self) {
                if exponent == 0.0 {
                    for (out, &a) in out.iter_mut().zip(a) {
                        *out = if a.is_nan() { a } else { 1.0 };
                    }
                    return;
                }
                // The multiplications of `graph::operation::value::by_squaring`, in its order.
                let mut square = *a;
                let mut digits = exponent.abs() as u32;
                let mut has_product = false;
                loop {
                    if digits & 1 == 1 {
                        for (out, &square) in out.iter_mut().zip(&square) {
                            *out = if has_product { *out * square } else { square };
                        }
                        has_product = true;
                    }
                    digits >>= 1;
                    if digits == 0 {
                        break;
                    }
                    for square in &mut square {
                        *square *= *square;
                    }
                }
                if !has_product {
                    *out = square;
                }
                if exponent < 0.0 {
                    for out in out {
                        *out = 1.0 / *out;
                    }
                }
            }

            #[inline(always)]
            fn modulo(out: &mut Self::Block, a: &Self::Block, b: Self) {
                for (out, &a) in out.iter_mut().zip(a) {
                    *out = a - b * (a / b).floor();
                }
            }

            #[inline(always)]
            fn function(op: Op, operands: [Self; 3]) -> Self {
                op.value(operands.map(f64::from)) as $float
            }

            fn with_memory(length: usize, work: impl FnOnce(&mut [Self::Block])) {
                thread_local! {
                    static KEPT: std::cell::Cell<Vec<$float>> = const {
                        std::cell::Cell::new(Vec::new())
                    };
                }
                const SPARE: usize = LINE / size_of::<$float>();
                KEPT.with(|kept| {
                    lend(kept, length * LANES + SPARE, 0.0, |numbers| {
                        // Where vectors would be in two lines of the cache each, a tape takes
                        // up to twice the time.
                        let before = numbers.as_ptr().align_offset(LINE).min(SPARE);
                        let aligned = &mut numbers[before..before + length * LANES];
                        work(aligned.as_chunks_mut().0);
                    });
                });
            }
        }
    };
}

floating_point!(f64);
floating_point!(f32);
