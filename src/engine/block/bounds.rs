//! Enclosures as numbers of a tape: interval arithmetic on 64 boxes at a time.
//!
//! The results hold those of the table's interval rules (`graph::interval`), of which they are
//! the branch-free form: ends are computed with rounding to nearest and moved outward by one unit
//! in the last place, unless they are exact zeros. Zero times infinity is 0, since an infinite
//! end stands for unbounded finite numbers. Inside of the tape an empty interval has NaN ends,
//! which every operation hands on. Elementary functions call the table's rules lane by lane, but
//! for the increasing ones, which are computed in vectors and moved by two units, since their
//! errors are below one.

use super::number::{LANES, Number, lend};
use crate::graph::interval::{Enclosure, Regularity};
use crate::graph::{Interval, Op};
use crate::math::slice;

/// An enclosure with its regularity as a number: that of the result of an operation is the
/// minimum of its operands'.
#[derive(Clone, Copy, Debug)]
pub(in crate::engine) struct Bounds {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) regularity: f64,
}

/// The lanes of a block, in columns.
#[derive(Clone, Copy)]
pub(in crate::engine) struct BoundsBlock {
    pub(super) low: [f64; LANES],
    pub(super) high: [f64; LANES],
    pub(super) regularity: [f64; LANES],
}

/// [`Regularity`] in its order.
pub(super) const PARTIAL: f64 = 0.0;
pub(super) const DEFINED: f64 = 1.0;
const CONTINUOUS: f64 = 2.0;

/// The lanes of nothing in particular.
const NOTHING: BoundsBlock = BoundsBlock {
    low: [0.0; LANES],
    high: [0.0; LANES],
    regularity: [PARTIAL; LANES],
};

impl From<Enclosure> for Bounds {
    #[inline(always)]
    fn from(enclosure: Enclosure) -> Bounds {
        let Interval { low, high } = enclosure.range;
        let is_empty = enclosure.range.is_empty();
        Bounds {
            low: if is_empty { f64::NAN } else { low },
            high: if is_empty { f64::NAN } else { high },
            regularity: match enclosure.regularity {
                Regularity::Partial => PARTIAL,
                Regularity::Defined => DEFINED,
                Regularity::Continuous => CONTINUOUS,
            },
        }
    }
}

impl From<Bounds> for Enclosure {
    #[inline(always)]
    fn from(bounds: Bounds) -> Enclosure {
        Enclosure {
            range: Interval::new(bounds.low, bounds.high),
            regularity: if bounds.regularity == CONTINUOUS {
                Regularity::Continuous
            } else if bounds.regularity == DEFINED {
                Regularity::Defined
            } else {
                Regularity::Partial
            },
        }
    }
}

/// One step downward, but from −∞, 0 and NaN none; −0 is the greatest number below 0 that was
/// rounded.
#[inline(always)]
fn down(x: f64) -> f64 {
    let bits = x.to_bits() as i64;
    let moved = f64::from_bits(bits.wrapping_sub((bits >> 63) | 1) as u64);
    let moves = (x > f64::NEG_INFINITY) & (bits != 0);
    if moves { moved } else { x }
}

/// One step upward, likewise: from ∞, −0 and NaN none.
#[inline(always)]
fn up(x: f64) -> f64 {
    -down(-x)
}

/// A rounded sum as a lower bound. A sum that is 0 is exact.
#[inline(always)]
fn sum_down(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { down(x) }
}

/// A rounded sum as an upper bound.
#[inline(always)]
fn sum_up(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { up(x) }
}

/// The smaller number; which one of 0 and −0, and of numbers and NaN, does not matter.
#[inline(always)]
fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The larger number, likewise.
#[inline(always)]
fn greatest(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// From four candidates and whether each is exactly 0, the interval that holds all. Exact
/// zeros must not be moved and underflowed ones must: 0 at the lower end and −0 at the upper one
/// stand for exact zeros, and order puts the others before them.
#[inline(always)]
fn around(candidates: [(f64, bool); 4]) -> (f64, f64) {
    let [p, q, r, s] = candidates;
    let low = or(p, 0.0).smaller(or(q, 0.0));
    let low = low.smaller(or(r, 0.0).smaller(or(s, 0.0)));
    let high = or(p, -0.0).larger(or(q, -0.0));
    let high = high.larger(or(r, -0.0).larger(or(s, -0.0)));
    (down(low), up(high))
}

/// The number, or this zero where it is an exact one.
#[inline(always)]
fn or((number, is_zero): (f64, bool), zero: f64) -> f64 {
    if is_zero { zero } else { number }
}

/// A product, and whether it is exactly 0.
#[inline(always)]
fn product(a: f64, b: f64) -> (f64, bool) {
    (a * b, (a == 0.0) | (b == 0.0))
}

/// A quotient, and whether it is exactly 0 or as close to it as one likes.
#[inline(always)]
fn quotient(a: f64, b: f64) -> (f64, bool) {
    (a / b, (a == 0.0) | (b.abs() == f64::INFINITY))
}

impl Bounds {
    /// The interval with the regularity of an operation that is defined and continuous.
    #[inline(always)]
    fn smooth(low: f64, high: f64, a: Bounds, b: Bounds) -> Bounds {
        let regularity = least(a.regularity, b.regularity);
        Bounds {
            low,
            high,
            regularity,
        }
    }

    /// The same, less regular unless `holds`.
    #[inline(always)]
    fn unless(self, holds: bool, regularity: f64) -> Bounds {
        let limit = if holds { CONTINUOUS } else { regularity };
        Bounds {
            regularity: least(self.regularity, limit),
            ..self
        }
    }

    #[inline(always)]
    fn is_empty(self) -> bool {
        self.low.is_nan()
    }

    #[inline(always)]
    fn has_zero(self) -> bool {
        (self.low <= 0.0) & (self.high >= 0.0)
    }

    /// The empty interval where the condition holds.
    #[inline(always)]
    fn empty_where(self, is_empty: bool) -> Bounds {
        Bounds {
            low: if is_empty { f64::NAN } else { self.low },
            high: if is_empty { f64::NAN } else { self.high },
            ..self
        }
    }

    /// A comparison that, of numbers, can hold or must hold.
    #[inline(always)]
    fn comparison(a: Bounds, b: Bounds, can_hold: bool, must_hold: bool) -> Bounds {
        let is_empty = a.is_empty() | b.is_empty();
        let is_partial = (a.regularity == PARTIAL) | (b.regularity == PARTIAL);
        let low = if must_hold & !is_partial { 1.0 } else { 0.0 };
        let high = if can_hold & !is_empty { 1.0 } else { 0.0 };
        let regularity = if low == high { CONTINUOUS } else { DEFINED };
        Bounds {
            low,
            high,
            regularity,
        }
    }
}

impl Number for Bounds {
    type Block = BoundsBlock;

    #[inline(always)]
    fn splat(self) -> BoundsBlock {
        BoundsBlock {
            low: [self.low; LANES],
            high: [self.high; LANES],
            regularity: [self.regularity; LANES],
        }
    }

    #[inline(always)]
    fn get(block: &BoundsBlock, lane: usize) -> Bounds {
        Bounds {
            low: block.low[lane],
            high: block.high[lane],
            regularity: block.regularity[lane],
        }
    }

    #[inline(always)]
    fn set(block: &mut BoundsBlock, lane: usize, bounds: Bounds) {
        block.low[lane] = bounds.low;
        block.high[lane] = bounds.high;
        block.regularity[lane] = bounds.regularity;
    }

    #[inline(always)]
    fn add(self, other: Bounds) -> Bounds {
        let (low, high) = (self.low + other.low, self.high + other.high);
        Bounds::smooth(sum_down(low), sum_up(high), self, other)
    }

    #[inline(always)]
    fn subtract(self, other: Bounds) -> Bounds {
        let (low, high) = (self.low - other.high, self.high - other.low);
        Bounds::smooth(sum_down(low), sum_up(high), self, other)
    }

    #[inline(always)]
    fn multiply(self, other: Bounds) -> Bounds {
        let (a, b) = (self, other);
        let (low, high) = around([
            product(a.low, b.low),
            product(a.low, b.high),
            product(a.high, b.low),
            product(a.high, b.high),
        ]);
        Bounds::smooth(low, high, a, b).empty_where(a.is_empty() | b.is_empty())
    }

    #[inline(always)]
    fn divide(self, other: Bounds) -> Bounds {
        let (a, b) = (self, other);
        // A divisor that ends at 0 comes close to it from one side.
        let first = if b.low == 0.0 { 0.0 } else { b.low };
        let last = if b.high == 0.0 { -0.0 } else { b.high };
        let (low, high) = around([
            quotient(a.low, first),
            quotient(a.low, last),
            quotient(a.high, first),
            quotient(a.high, last),
        ]);
        let is_zero = (a.low == 0.0) & (a.high == 0.0);
        let is_entire = (b.low < 0.0) & (b.high > 0.0) & !is_zero;
        let low = if is_entire { f64::NEG_INFINITY } else { low };
        let high = if is_entire { f64::INFINITY } else { high };
        let has_none = (b.low == 0.0) & (b.high == 0.0);
        Bounds::smooth(low, high, a, b)
            .empty_where(a.is_empty() | b.is_empty() | has_none)
            .unless(!b.has_zero(), PARTIAL)
    }

    #[inline(always)]
    fn negate(self) -> Bounds {
        Bounds {
            low: -self.high,
            high: -self.low,
            ..self
        }
    }

    #[inline(always)]
    fn square(self) -> Bounds {
        let a = self.absolute();
        Bounds {
            // Not negative, so that 0 is a bound however it was rounded.
            low: down(a.low * a.low),
            high: if a.high == 0.0 {
                0.0
            } else {
                up(a.high * a.high)
            },
            ..a
        }
    }

    #[inline(always)]
    fn square_root(self) -> Bounds {
        let first = if 0.0 > self.low { 0.0 } else { self.low };
        Bounds {
            low: sum_down(first.sqrt()),
            high: sum_up(self.high.sqrt()),
            ..self
        }
        .empty_where(self.high.is_nan() | (self.high < 0.0))
        .unless(self.low >= 0.0, PARTIAL)
    }

    #[inline(always)]
    fn absolute(self) -> Bounds {
        let low = greatest(self.low, -self.high);
        Bounds {
            low: if 0.0 > low { 0.0 } else { low },
            high: greatest(-self.low, self.high),
            ..self
        }
    }

    #[inline(always)]
    fn round_down(self) -> Bounds {
        let (low, high) = (self.low.floor(), self.high.floor());
        Bounds { low, high, ..self }.unless(low == high, DEFINED)
    }

    #[inline(always)]
    fn round_up(self) -> Bounds {
        let (low, high) = (self.low.ceil(), self.high.ceil());
        Bounds { low, high, ..self }.unless(low == high, DEFINED)
    }

    #[inline(always)]
    fn smaller(self, other: Bounds) -> Bounds {
        let (low, high) = (self.low.smaller(other.low), self.high.smaller(other.high));
        Bounds::smooth(low, high, self, other)
    }

    #[inline(always)]
    fn larger(self, other: Bounds) -> Bounds {
        let (low, high) = (self.low.larger(other.low), self.high.larger(other.high));
        Bounds::smooth(low, high, self, other)
    }

    #[inline(always)]
    fn less(self, other: Bounds) -> Bounds {
        let (a, b) = (self, other);
        Bounds::comparison(a, b, a.low < b.high, a.high < b.low)
    }

    #[inline(always)]
    fn less_equal(self, other: Bounds) -> Bounds {
        let (a, b) = (self, other);
        Bounds::comparison(a, b, a.low <= b.high, a.high <= b.low)
    }

    #[inline(always)]
    fn equal(self, other: Bounds) -> Bounds {
        let (a, b) = (self, other);
        let can_hold = (a.low <= b.high) & (b.low <= a.high);
        let must_hold = (a.low == b.high) & (b.low == a.high);
        Bounds::comparison(a, b, can_hold, must_hold)
    }

    #[inline(always)]
    fn is_number(self) -> Bounds {
        Bounds::comparison(self, self, true, true)
    }

    #[inline(always)]
    fn select(self, taken: Bounds, otherwise: Bounds) -> Bounds {
        let is_partial = self.regularity == PARTIAL;
        let can_take = is_partial | (self.low != 0.0) | (self.high != 0.0);
        let can_leave = self.has_zero();
        let hull = Bounds {
            low: taken.low.min(otherwise.low),
            high: taken.high.max(otherwise.high),
            regularity: least(DEFINED, least(taken.regularity, otherwise.regularity)),
        };
        let one = Bounds::chosen(can_take, taken, otherwise);
        Bounds::chosen(can_take & can_leave, hull, one)
    }

    #[inline(always)]
    fn chain_product(self, other: Bounds) -> Bounds {
        let product = self.multiply(other);
        let absorbs = self.has_zero() | other.has_zero();
        Bounds {
            low: if absorbs {
                product.low.min(0.0)
            } else {
                product.low
            },
            high: if absorbs {
                product.high.max(0.0)
            } else {
                product.high
            },
            ..product
        }
    }

    #[inline(always)]
    fn function_of_one(op: Op, out: &mut BoundsBlock, a: &BoundsBlock) {
        match op {
            Op::Exp => {
                slice::exp(&mut out.low, &a.low);
                slice::exp(&mut out.high, &a.high);
                for (low, high) in out.low.iter_mut().zip(&mut out.high) {
                    let moved = down(down(*low));
                    *low = if 0.0 > moved { 0.0 } else { moved };
                    *high = up(up(*high));
                }
                out.regularity = a.regularity;
            }
            _ => {
                for lane in 0..LANES {
                    let operand = Enclosure::from(Bounds::get(a, lane));
                    let enclosure = (op.operation().interval)(&[operand]);
                    Bounds::set(out, lane, enclosure.into());
                }
            }
        }
    }

    #[inline(always)]
    fn function_of_two(op: Op, out: &mut BoundsBlock, a: &BoundsBlock, b: &BoundsBlock) {
        for lane in 0..LANES {
            let operands = [a, b].map(|block| Enclosure::from(Bounds::get(block, lane)));
            let enclosure = (op.operation().interval)(&operands);
            Bounds::set(out, lane, enclosure.into());
        }
    }

    #[inline(always)]
    fn integer_power(out: &mut BoundsBlock, a: &BoundsBlock, exponent: Bounds) {
        Bounds::function_of_two(Op::IntegerPower, out, a, &exponent.splat());
    }

    #[inline(always)]
    fn modulo(out: &mut BoundsBlock, a: &BoundsBlock, b: Bounds) {
        Bounds::function_of_two(Op::Modulo, out, a, &b.splat());
    }

    fn function(op: Op, operands: [Bounds; 3]) -> Bounds {
        let operands = operands.map(Enclosure::from);
        (op.operation().interval)(&operands[..op.arity()]).into()
    }

    fn with_memory(length: usize, work: impl FnOnce(&mut [BoundsBlock])) {
        thread_local! {
            static KEPT: std::cell::Cell<Vec<BoundsBlock>> = const {
                std::cell::Cell::new(Vec::new())
            };
        }
        KEPT.with(|kept| lend(kept, length, NOTHING, work));
    }
}

impl Bounds {
    /// One of two.
    #[inline(always)]
    fn chosen(first: bool, a: Bounds, b: Bounds) -> Bounds {
        Bounds {
            low: if first { a.low } else { b.low },
            high: if first { a.high } else { b.high },
            regularity: if first { a.regularity } else { b.regularity },
        }
    }
}
