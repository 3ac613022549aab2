//! Enclosures as numbers of a tape: interval arithmetic on blocks of 64 boxes, or on one.
//!
//! The results hold those of the table's interval rules (`graph::interval`), of which they are
//! the branch-free form: ends are computed with rounding to nearest and moved outward
//! ([`rounding`]), by one unit in the last place, or two for elementary functions ([`functions`],
//! [`periodic`], [`powers`]), which are computed in vectors. Zero times infinity is 0, since an
//! infinite end stands for unbounded finite numbers.
//!
//! A lower end is never +∞ and an upper one never −∞; of an empty interval only the regularity
//! counts, which is [`EMPTY`], and its ends may be anything.

mod functions;
mod periodic;
mod powers;
mod rounding;

use super::number::{LANES, Number, lend};
use crate::graph::interval::{Enclosure, Regularity};
use crate::graph::{Interval, Op};
use rounding::{
    greatest, least, product_above, product_below, quotient_below, root_above, root_below,
    square_above, square_below, sum_above, sum_below, sum_square_above, sum_square_below,
};

/// An enclosure with its regularity as a number: that of the result of an operation is the
/// minimum of its operands'.
#[derive(Clone, Copy, Debug)]
pub(in crate::engine) struct Bounds {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) regularity: f64,
}

/// The lanes of a block, in columns: 64 or, for a single box, one.
///
/// A column begins where a line of the cache does: otherwise half of the widest vectors would be
/// in two lines each.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(in crate::engine) struct BoundsBlock<const BOXES: usize = LANES> {
    pub(super) low: [f64; BOXES],
    pub(super) high: [f64; BOXES],
    pub(super) regularity: [f64; BOXES],
}

impl<const BOXES: usize> BoundsBlock<BOXES> {
    /// The enclosure in one lane.
    #[inline(always)]
    fn lane(&self, lane: usize) -> Bounds {
        Bounds {
            low: self.low[lane],
            high: self.high[lane],
            regularity: self.regularity[lane],
        }
    }

    /// Puts an enclosure into a lane.
    #[inline(always)]
    fn put(&mut self, lane: usize, bounds: Bounds) {
        self.low[lane] = bounds.low;
        self.high[lane] = bounds.high;
        self.regularity[lane] = bounds.regularity;
    }

    /// Equal lanes.
    #[inline(always)]
    fn of(bounds: Bounds) -> Self {
        BoundsBlock {
            low: [bounds.low; BOXES],
            high: [bounds.high; BOXES],
            regularity: [bounds.regularity; BOXES],
        }
    }
}

/// Makes blocks of the sides of at most 64 boxes, a column and a block per axis. Lanes that are left
/// over repeat the last box: they cost what it costs.
#[inline(always)]
pub(super) fn load(blocks: &mut [BoundsBlock], sides: &[&[Interval]]) {
    for (block, column) in blocks.iter_mut().zip(sides) {
        match column.first_chunk::<LANES>() {
            Some(column) => {
                for (lane, &side) in column.iter().enumerate() {
                    block.put(lane, Bounds::of_side(side));
                }
            }
            None => {
                let last = column.last().copied().unwrap_or(Interval::EMPTY);
                for lane in 0..LANES {
                    let side = column.get(lane).copied().unwrap_or(last);
                    block.put(lane, Bounds::of_side(side));
                }
            }
        }
    }
}

/// Copies the enclosures in the first lanes of a block.
#[inline(always)]
pub(super) fn store(enclosures: &mut [Enclosure], block: &BoundsBlock) {
    let ends = block.low.iter().zip(&block.high);
    let is_tame = |&regularity: &f64| regularity == CONTINUOUS;
    if block
        .regularity
        .iter()
        .fold(true, |all, r| all & is_tame(r))
    {
        // Nearly always: there is nothing to decide for each.
        for (enclosure, (&low, &high)) in enclosures.iter_mut().zip(ends) {
            *enclosure = Enclosure {
                range: Interval { low, high },
                regularity: Regularity::Continuous,
            };
        }
        return;
    }
    for (lane, enclosure) in enclosures.iter_mut().take(LANES).enumerate() {
        *enclosure = block.lane(lane).into();
    }
}

/// Below every [`Regularity`]: there is no value at all.
pub(super) const EMPTY: f64 = -1.0;
/// [`Regularity`] in its order.
pub(super) const PARTIAL: f64 = 0.0;
pub(super) const DEFINED: f64 = 1.0;
const CONTINUOUS: f64 = 2.0;

/// The lanes of nothing in particular.
pub(super) const NOTHING: BoundsBlock = BoundsBlock {
    low: [0.0; LANES],
    high: [0.0; LANES],
    regularity: [EMPTY; LANES],
};

impl From<Enclosure> for Bounds {
    #[inline(always)]
    fn from(enclosure: Enclosure) -> Bounds {
        let Interval { low, high } = enclosure.range;
        let regularity = match enclosure.regularity {
            Regularity::Partial => PARTIAL,
            Regularity::Defined => DEFINED,
            Regularity::Continuous => CONTINUOUS,
        };
        Bounds {
            low,
            high,
            regularity: if low > high { EMPTY } else { regularity },
        }
    }
}

impl From<Bounds> for Enclosure {
    #[inline(always)]
    fn from(bounds: Bounds) -> Enclosure {
        let is_empty = bounds.is_empty();
        let range = Interval {
            low: if is_empty { f64::INFINITY } else { bounds.low },
            high: if is_empty {
                f64::NEG_INFINITY
            } else {
                bounds.high
            },
        };
        Enclosure {
            range,
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

impl Bounds {
    /// A side of a box.
    #[inline(always)]
    pub(super) fn of_side(side: Interval) -> Bounds {
        let Interval { low, high } = side;
        Bounds {
            low,
            high,
            // An interval with an end that is NaN holds nothing either.
            regularity: if low <= high { CONTINUOUS } else { EMPTY },
        }
    }

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
        self.regularity < PARTIAL
    }

    #[inline(always)]
    fn has_zero(self) -> bool {
        (self.low <= 0.0) & (self.high >= 0.0)
    }

    /// Whether it is 0 alone.
    #[inline(always)]
    fn is_zero(self) -> bool {
        (self.low == 0.0) & (self.high == 0.0)
    }

    /// One of two.
    #[inline(always)]
    fn chosen(first: bool, a: Bounds, b: Bounds) -> Bounds {
        Bounds {
            low: if first { a.low } else { b.low },
            high: if first { a.high } else { b.high },
            regularity: if first { a.regularity } else { b.regularity },
        }
    }

    /// A comparison that, of numbers, can hold or must hold.
    #[inline(always)]
    fn comparison(a: Bounds, b: Bounds, can_hold: bool, must_hold: bool) -> Bounds {
        let regularity = least(a.regularity, b.regularity);
        let low = if must_hold & (regularity > PARTIAL) {
            1.0
        } else {
            0.0
        };
        let high = if can_hold & (regularity >= PARTIAL) {
            1.0
        } else {
            0.0
        };
        Bounds {
            low,
            high,
            regularity: if low == high { CONTINUOUS } else { DEFINED },
        }
    }

    /// The table's interval rule for these operands.
    fn by_rule(op: Op, operands: &[Bounds]) -> Bounds {
        let mut enclosures = [Enclosure::of_number(f64::NAN); 3];
        for (enclosure, &operand) in enclosures.iter_mut().zip(operands) {
            *enclosure = operand.into();
        }
        (op.operation().interval)(&enclosures[..op.arity()]).into()
    }
}

impl Number for Bounds {
    type Block = BoundsBlock;

    const LANES: usize = LANES;

    #[inline(always)]
    fn splat(self) -> BoundsBlock {
        BoundsBlock::of(self)
    }

    #[inline(always)]
    fn get(block: &BoundsBlock, lane: usize) -> Bounds {
        block.lane(lane)
    }

    #[inline(always)]
    fn set(block: &mut BoundsBlock, lane: usize, bounds: Bounds) {
        block.put(lane, bounds);
    }

    #[inline(always)]
    fn add(self, other: Bounds) -> Bounds {
        let (low, high) = (self.low + other.low, self.high + other.high);
        Bounds::smooth(sum_below(low), sum_above(high), self, other)
    }

    #[inline(always)]
    fn subtract(self, other: Bounds) -> Bounds {
        let (low, high) = (self.low - other.high, self.high - other.low);
        Bounds::smooth(sum_below(low), sum_above(high), self, other)
    }

    /// The extremes are products of ends. Of those, 0·∞ is NaN: then one of the others is 0, or
    /// all are NaN and the product is 0; so NaN is passed over, and the last one taken for 0.
    #[inline(always)]
    fn multiply(self, other: Bounds) -> Bounds {
        let (a, b) = (self, other);
        let (p, q, r) = (a.low * b.low, a.low * b.high, a.high * b.low);
        let s = a.high * b.high;
        let s = if s.is_nan() { 0.0 } else { s };
        let low = product_below(least(p, least(q, least(r, s))));
        let high = product_above(greatest(p, greatest(q, greatest(r, s))));
        let is_positive = (least(a.low, b.low) >= 0.0) | (greatest(a.high, b.high) <= 0.0);
        let floor = if is_positive { 0.0 } else { f64::NEG_INFINITY };
        Bounds::smooth(greatest(low, floor), high, a, b)
    }

    /// With the divisor made positive, the ends are quotients of the dividend's by whichever end
    /// of the divisor makes them larger or smaller.
    #[inline(always)]
    fn divide(self, other: Bounds) -> Bounds {
        let (a, b) = (self, other);
        let is_negative = b.high <= 0.0;
        let first = if is_negative { -a.high } else { a.low };
        let last = if is_negative { -a.low } else { a.high };
        // What ends at 0 ends at a positive 0, from which the divisor comes.
        let smallest = if is_negative { -b.high } else { b.low }.abs();
        let largest = if is_negative { -b.low } else { b.high };
        // Sums with 0 and differences from it have no −0: where the dividend is 0, the quotient
        // is exact.
        let low = quotient_below((first + 0.0) / if first < 0.0 { smallest } else { largest });
        let high = -quotient_below((0.0 - last) / if last > 0.0 { smallest } else { largest });
        let is_entire = (b.low < 0.0) & (b.high > 0.0) & !a.is_zero();
        let low = if is_entire { f64::NEG_INFINITY } else { low };
        let high = if is_entire { f64::INFINITY } else { high };
        Bounds::smooth(low, high, a, b)
            .unless(!b.has_zero(), PARTIAL)
            .unless(!b.is_zero(), EMPTY)
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
            low: square_below(a.low),
            high: square_above(a.high),
            ..a
        }
    }

    #[inline(always)]
    fn squared_difference(self, other: Bounds) -> Bounds {
        let (low, high) = (self.low - other.high, self.high - other.low);
        let difference = Bounds::smooth(low, high, self, other).absolute();
        Bounds {
            low: sum_square_below(difference.low),
            high: sum_square_above(difference.high),
            ..difference
        }
    }

    #[inline(always)]
    fn square_root(self) -> Bounds {
        Bounds {
            low: root_below(greatest(self.low, 0.0).sqrt()),
            high: root_above(self.high.sqrt()),
            ..self
        }
        .unless(self.low >= 0.0, PARTIAL)
        .unless(self.high >= 0.0, EMPTY)
    }

    #[inline(always)]
    fn absolute(self) -> Bounds {
        Bounds {
            low: greatest(greatest(self.low, -self.high), 0.0),
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
        let (low, high) = (least(self.low, other.low), least(self.high, other.high));
        Bounds::smooth(low, high, self, other)
    }

    #[inline(always)]
    fn larger(self, other: Bounds) -> Bounds {
        let low = greatest(self.low, other.low);
        let high = greatest(self.high, other.high);
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

    /// NaN is not 0, so where the condition may be undefined the first branch may be taken.
    #[inline(always)]
    fn select(self, taken: Bounds, otherwise: Bounds) -> Bounds {
        let can_take = (self.regularity <= PARTIAL) | (self.low != 0.0) | (self.high != 0.0);
        let can_leave = !self.is_empty() & self.has_zero();
        let hull = Bounds {
            low: least(taken.low, otherwise.low),
            high: greatest(taken.high, otherwise.high),
            regularity: least(DEFINED, least(taken.regularity, otherwise.regularity)),
        };
        // Of an empty branch nothing is taken, but that it is undefined.
        let hull = Bounds::chosen(taken.is_empty(), otherwise.unless(false, PARTIAL), hull);
        let hull = Bounds::chosen(otherwise.is_empty(), taken.unless(false, PARTIAL), hull);
        let one = Bounds::chosen(can_take, taken, otherwise);
        Bounds::chosen(can_take & can_leave, hull, one)
    }

    #[inline(always)]
    fn chain_product(self, other: Bounds) -> Bounds {
        let (a, b) = (self, other);
        let product = a.multiply(b);
        let absorbs = (a.has_zero() & !a.is_empty()) | (b.has_zero() & !b.is_empty());
        let is_zero = (a.is_zero() & !a.is_empty()) | (b.is_zero() & !b.is_empty());
        let only_zero = product.is_empty() | is_zero;
        let low = if only_zero {
            0.0
        } else {
            least(product.low, 0.0)
        };
        let high = if only_zero {
            0.0
        } else {
            greatest(product.high, 0.0)
        };
        let absorbed = Bounds {
            low,
            high,
            regularity: greatest(product.regularity, PARTIAL),
        };
        Bounds::chosen(absorbs, absorbed, product)
    }

    #[inline(always)]
    fn function_of_one(op: Op, out: &mut BoundsBlock, a: &BoundsBlock) {
        functions::of_one(op, out, a);
    }

    #[inline(always)]
    fn function_of_two(op: Op, out: &mut BoundsBlock, a: &BoundsBlock, b: &BoundsBlock) {
        functions::of_two(op, out, a, b);
    }

    #[inline(always)]
    fn integer_power(out: &mut BoundsBlock, a: &BoundsBlock, exponent: Bounds) {
        powers::integer_power(out, a, exponent);
    }

    #[inline(always)]
    fn modulo(out: &mut BoundsBlock, a: &BoundsBlock, b: Bounds) {
        functions::modulo(out, a, &b.splat());
    }

    /// A block of one lane, so that the bits are those of many.
    #[inline(always)]
    fn function(op: Op, operands: [Bounds; 3]) -> Bounds {
        let [a, b, _] = operands.map(BoundsBlock::<1>::of);
        let mut out = a;
        match op {
            Op::IntegerPower => powers::integer_power(&mut out, &a, operands[1]),
            _ if op.arity() == 1 => functions::of_one(op, &mut out, &a),
            _ => functions::of_two(op, &mut out, &a, &b),
        }
        out.lane(0)
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
