//! The machine-code rules of single operations on intervals.
//!
//! An interval is a vector (−low, high). The code runs with rounding upward, so one instruction
//! rounds both ends outward. An empty interval has NaN in both lanes; otherwise neither lane is
//! −∞. What is known of regularity are two masks: whether the value is defined everywhere, and
//! whether it is continuous too; no masks stand for both. Zero times infinity is 0, since an
//! infinite end stands for unbounded finite numbers.
//!
//! The formulas are those of `graph::interval`, in the branch-free form of the block tier's
//! bounds; ends are the tightest of each operation.

use super::table;
use crate::engine::jit::emit::{self, Lanes, little};
use crate::graph::operation::Instruction;
use cranelift_codegen::ir::condcodes::{FloatCC, IntCC};
use cranelift_codegen::ir::types::{F64X2, I8X16, I64X2};
use cranelift_codegen::ir::{ConstantData, InstBuilder, MemFlagsData, Value};
use cranelift_frontend::FunctionBuilder;
use rustc_hash::FxHashMap;

/// An interval in the code.
#[derive(Clone, Copy)]
pub(super) struct Bounds {
    /// (−low, high).
    pub(super) ends: Value,
    /// Masks: defined, continuous. Without them it is both.
    pub(super) regularity: Option<Value>,
}

/// Writes rules into a function.
pub(super) struct Rules<'f> {
    pub(super) builder: FunctionBuilder<'f>,
    /// Where the vectors of [`table`] are.
    pub(super) constants: Value,
    /// Conjunctions of regularities that have been computed.
    pub(super) joined: FxHashMap<(Value, Value), Value>,
}

impl Rules<'_> {
    /// Emits a rule; operands beyond the arity repeat the first.
    pub(super) fn emit(&mut self, instruction: Instruction, operands: [Bounds; 3]) -> Bounds {
        let [a, b, c] = operands;
        match instruction {
            Instruction::Add => {
                let ends = self.builder.ins().fadd(a.ends, b.ends);
                self.smooth(ends, a, b)
            }
            Instruction::Subtract => {
                let opposite = self.swap(b.ends);
                let ends = self.builder.ins().fadd(a.ends, opposite);
                self.smooth(ends, a, b)
            }
            Instruction::Multiply => {
                let ends = self.product(a.ends, b.ends);
                self.smooth(ends, a, b)
            }
            Instruction::Divide => self.divide(a, b),
            Instruction::Negate => Bounds {
                ends: self.swap(a.ends),
                ..a
            },
            Instruction::Square => {
                let magnitude = self.magnitude(a.ends);
                let opposite = self.flip(magnitude, table::FIRST_SIGN);
                let ends = self.builder.ins().fmul(opposite, magnitude);
                Bounds { ends, ..a }
            }
            Instruction::SquareRoot => self.square_root(a),
            Instruction::Abs => Bounds {
                ends: self.magnitude(a.ends),
                ..a
            },
            Instruction::Floor | Instruction::Ceil => {
                let down = self.builder.ins().floor(a.ends);
                let up = self.builder.ins().ceil(a.ends);
                let (first, second) = match instruction {
                    Instruction::Floor => (up, down),
                    _ => (down, up),
                };
                self.steps(first, second, a)
            }
            Instruction::Min | Instruction::Max => {
                let small = emit::minimum(&mut self.builder, Lanes::Two, a.ends, b.ends);
                let large = emit::maximum(&mut self.builder, Lanes::Two, a.ends, b.ends);
                let ends = match instruction {
                    Instruction::Min => self.halves(large, small),
                    _ => self.halves(small, large),
                };
                let empty = self.builder.ins().fcmp(FloatCC::Unordered, a.ends, b.ends);
                let ends = self.or(ends, empty);
                self.smooth(ends, a, b)
            }
            Instruction::Less | Instruction::LessEqual => {
                let first = self.swap(a.ends);
                let first = self.flip(first, table::SECOND_SIGN);
                let second = self.flip(b.ends, table::FIRST_SIGN);
                let condition = match instruction {
                    Instruction::Less => FloatCC::LessThan,
                    _ => FloatCC::LessThanOrEqual,
                };
                let mask = self.builder.ins().fcmp(condition, first, second);
                self.comparison(mask, a, b)
            }
            Instruction::Equal => self.equal(a, b),
            Instruction::IsNumber => {
                let mask = self.builder.ins().fcmp(FloatCC::Ordered, a.ends, a.ends);
                self.comparison(mask, a, a)
            }
            Instruction::Select => self.select(a, b, c),
            Instruction::ChainProduct => self.chain_product(a, b),
        }
    }

    /// The product with a finite number that is not 0. `magnitude` has it in both lanes.
    pub(super) fn multiply_by(&mut self, a: Bounds, number: f64, magnitude: Value) -> Bounds {
        let ends = self.signed(a.ends, number);
        let ends = self.builder.ins().fmul(ends, magnitude);
        Bounds { ends, ..a }
    }

    /// The quotient by a finite number that is not 0. `magnitude` has it in both lanes.
    pub(super) fn divide_by(&mut self, a: Bounds, number: f64, magnitude: Value) -> Bounds {
        let ends = self.signed(a.ends, number);
        let ends = self.builder.ins().fdiv(ends, magnitude);
        Bounds { ends, ..a }
    }

    /// The ends, or those of the opposite where the number is negative.
    fn signed(&mut self, ends: Value, number: f64) -> Value {
        match number < 0.0 {
            true => self.swap(ends),
            false => ends,
        }
    }

    /// The interval with the regularity of an operation that is defined and continuous.
    fn smooth(&mut self, ends: Value, a: Bounds, b: Bounds) -> Bounds {
        Bounds {
            ends,
            regularity: self.join(a.regularity, b.regularity),
        }
    }

    /// The lesser regularity.
    fn join(&mut self, a: Option<Value>, b: Option<Value>) -> Option<Value> {
        let (Some(a), Some(b)) = (a, b) else {
            return a.or(b);
        };
        if a == b {
            return Some(a);
        }
        let key = (a.min(b), a.max(b));
        if let Some(&joined) = self.joined.get(&key) {
            return Some(joined);
        }
        let joined = self.builder.ins().band(a, b);
        self.joined.insert(key, joined);
        for part in [a, b] {
            // What is joined already changes nothing a second time.
            self.joined
                .insert((part.min(joined), part.max(joined)), joined);
        }
        Some(joined)
    }

    /// From four candidates for (−low, high), and NaN where the product or quotient stands for 0,
    /// the ends; NaN where an operand is.
    fn around(&mut self, candidates: [Value; 4], a: Value, b: Value) -> Value {
        let [p, q, r, s] = candidates.map(|candidate| {
            let known = self
                .builder
                .ins()
                .fcmp(FloatCC::Ordered, candidate, candidate);
            self.and(candidate, known)
        });
        let one = emit::maximum(&mut self.builder, Lanes::Two, p, q);
        let other = emit::maximum(&mut self.builder, Lanes::Two, r, s);
        let ends = emit::maximum(&mut self.builder, Lanes::Two, one, other);
        let empty = self.builder.ins().fcmp(FloatCC::Unordered, a, b);
        self.or(ends, empty)
    }

    /// a·b: with low = −n, the candidates for (−low, high) are nₐ(−n_b, n_b), nₐ(h_b, −h_b),
    /// hₐ(n_b, −n_b) and hₐ(−h_b, h_b).
    fn product(&mut self, a: Value, b: Value) -> Value {
        let [na, ha, nb, hb] = self.lanes(a, b);
        let factors = [
            (na, self.flip(nb, table::FIRST_SIGN)),
            (na, self.flip(hb, table::SECOND_SIGN)),
            (ha, self.flip(nb, table::SECOND_SIGN)),
            (ha, self.flip(hb, table::FIRST_SIGN)),
        ];
        let products = factors.map(|(a, b)| self.builder.ins().fmul(a, b));
        self.around(products, a, b)
    }

    /// a/b. A divisor that ends at 0 comes close to it from one side: its lower end is 0, its
    /// upper one −0.
    fn divide(&mut self, a: Bounds, b: Bounds) -> Bounds {
        let zero = self.number(0.0);
        // (low, −high), 0 as lane where an end is 0.
        let opposite = self.builder.ins().fsub(zero, b.ends);
        let [na, ha, low, minus_high] = self.lanes(a.ends, opposite);
        let divisors = [
            (na, self.flip(low, table::SECOND_SIGN)),
            (na, self.flip(minus_high, table::FIRST_SIGN)),
            (ha, self.flip(low, table::FIRST_SIGN)),
            (ha, self.flip(minus_high, table::SECOND_SIGN)),
        ];
        let quotients = divisors.map(|(a, b)| self.builder.ins().fdiv(a, b));
        let ends = self.around(quotients, a.ends, b.ends);
        let ins = self.builder.ins();
        let is_not_zero = ins.fcmp(FloatCC::NotEqual, a.ends, zero);
        let is_not_zero = self.either(is_not_zero);
        let surrounds = self.builder.ins().fcmp(FloatCC::GreaterThan, b.ends, zero);
        let surrounds = self.both(surrounds);
        let is_entire = self.builder.ins().band(surrounds, is_not_zero);
        let everything = self.number(f64::INFINITY);
        let ends = self.choose(is_entire, everything, ends);
        let none = self.builder.ins().fcmp(FloatCC::Equal, b.ends, zero);
        let none = self.both(none);
        // Of an empty operand nothing is left either.
        let empty = self.builder.ins().fcmp(FloatCC::Unordered, a.ends, b.ends);
        let empty = self.builder.ins().bor(none, empty);
        let ends = self.or(ends, empty);
        let has_zero = self.has_zero(b.ends);
        let is_good = self.builder.ins().bnot(has_zero);
        let regularity = self.join(a.regularity, b.regularity);
        Bounds {
            ends,
            regularity: self.join(regularity, Some(is_good)),
        }
    }

    /// √a of what is not negative. A root that is too large when squared was rounded up, which is
    /// right for the upper end only.
    fn square_root(&mut self, a: Bounds) -> Bounds {
        let zero = self.number(0.0);
        let arguments = self.flip(a.ends, table::FIRST_SIGN);
        let domain = self.entry(table::ROOT_DOMAIN, F64X2);
        let arguments = emit::maximum(&mut self.builder, Lanes::Two, domain, arguments);
        let roots = self.builder.ins().sqrt(arguments);
        let squares = self.builder.ins().fmul(roots, roots);
        let is_above = (self.builder.ins()).fcmp(FloatCC::GreaterThan, squares, arguments);
        let first = self.entry(table::FIRST, I64X2);
        // −1 where a unit in the last place must be taken off.
        let step = self.builder.ins().band(is_above, first);
        let bits = self.bits(roots);
        let bits = self.builder.ins().iadd(bits, step);
        let roots = self.numbers(bits);
        let ends = self.flip(roots, table::FIRST_SIGN);
        // Below 0 there is no upper end, and with it no interval.
        let empty = self.builder.ins().fcmp(FloatCC::Unordered, ends, ends);
        let empty = self.either(empty);
        let ends = self.or(ends, empty);
        let is_good = (self.builder.ins()).fcmp(FloatCC::LessThanOrEqual, a.ends, zero);
        let is_good = self.shuffle(is_good, is_good, FIRST_TWICE);
        Bounds {
            ends,
            regularity: self.join(a.regularity, Some(is_good)),
        }
    }

    /// The ends of |a|.
    fn magnitude(&mut self, ends: Value) -> Value {
        let zero = self.number(0.0);
        let opposite = self.swap(ends);
        let large = emit::maximum(&mut self.builder, Lanes::Two, ends, opposite);
        let small = emit::minimum(&mut self.builder, Lanes::Two, ends, opposite);
        let small = emit::minimum(&mut self.builder, Lanes::Two, zero, small);
        self.halves(small, large)
    }

    /// A step function, with −low from one vector and high from another one: it is continuous
    /// where both are the same step.
    fn steps(&mut self, first: Value, second: Value, a: Bounds) -> Bounds {
        let ends = self.halves(first, second);
        let numbers = self.flip(ends, table::FIRST_SIGN);
        let other = self.swap(numbers);
        let is_one = self.builder.ins().fcmp(FloatCC::Equal, numbers, other);
        let first = self.entry(table::FIRST, I64X2);
        let limit = self.builder.ins().bor(is_one, first);
        Bounds {
            ends,
            regularity: self.join(a.regularity, Some(limit)),
        }
    }

    /// a = b can hold where the intervals meet, and must where both are the same number.
    fn equal(&mut self, a: Bounds, b: Bounds) -> Bounds {
        let opposite = self.swap(b.ends);
        let numbers = self.flip(a.ends, table::FIRST_SIGN);
        let others = self.flip(opposite, table::SECOND_SIGN);
        let must = self.builder.ins().fcmp(FloatCC::Equal, numbers, others);
        let must = self.both(must);
        let least = self.builder.ins().fneg(a.ends);
        let can = (self.builder.ins()).fcmp(FloatCC::LessThanOrEqual, least, opposite);
        let can = self.both(can);
        let mask = self.shuffle(must, can, HALVES);
        self.comparison(mask, a, b)
    }

    /// A comparison that, of numbers, must hold where the first lane of the mask is set and can
    /// hold where the second one is; of empty intervals it is set nowhere.
    fn comparison(&mut self, mask: Value, a: Bounds, b: Bounds) -> Bounds {
        let mask = match self.join(a.regularity, b.regularity) {
            None => mask,
            Some(regularity) => {
                // Where an operand may be undefined the comparison may fail.
                let second = self.entry(table::SECOND, I64X2);
                let limit = self.builder.ins().bor(regularity, second);
                self.builder.ins().band(mask, limit)
            }
        };
        let ones = self.entry(table::MINUS_ONE_AND_ONE, F64X2);
        let ends = self.and(ones, mask);
        let other = self.shuffle(mask, mask, SWAP);
        let is_certain = self.builder.ins().icmp(IntCC::Equal, mask, other);
        let first = self.entry(table::FIRST, I64X2);
        Bounds {
            ends,
            regularity: Some(self.builder.ins().bor(is_certain, first)),
        }
    }

    /// The second operand where the first is not 0 or NaN, else the third; both if that is open.
    fn select(&mut self, condition: Bounds, taken: Bounds, otherwise: Bounds) -> Bounds {
        let zero = self.number(0.0);
        let is_other = (self.builder.ins()).fcmp(FloatCC::NotEqual, condition.ends, zero);
        let mut can_take = self.either(is_other);
        if let Some(regularity) = condition.regularity {
            let is_defined = self.shuffle(regularity, regularity, FIRST_TWICE);
            let is_partial = self.builder.ins().bnot(is_defined);
            can_take = self.builder.ins().bor(can_take, is_partial);
        }
        let can_leave = self.has_zero(condition.ends);
        let is_open = self.builder.ins().band(can_take, can_leave);
        let hull = self.hull(taken.ends, otherwise.ends);
        let one = self.choose(can_take, taken.ends, otherwise.ends);
        let ends = self.choose(is_open, hull, one);
        let all = self.entry(table::ALL, I64X2);
        let first = self.entry(table::FIRST, I64X2);
        let [of_taken, of_other] = [taken, otherwise].map(|one| one.regularity.unwrap_or(all));
        let common = self.builder.ins().band(of_taken, of_other);
        let common = self.builder.ins().band(common, first);
        let one = self.builder.ins().bitselect(can_take, of_taken, of_other);
        let regularity = self.builder.ins().bitselect(is_open, common, one);
        Bounds {
            ends,
            regularity: Some(regularity),
        }
    }

    /// The product, and 0 where a factor can be 0, whatever the other one is.
    fn chain_product(&mut self, a: Bounds, b: Bounds) -> Bounds {
        let zero = self.number(0.0);
        let product = self.product(a.ends, b.ends);
        let [first, second] = [a, b].map(|factor| self.has_zero(factor.ends));
        let absorbs = self.builder.ins().bor(first, second);
        let hull = emit::maximum(&mut self.builder, Lanes::Two, product, zero);
        let ends = self.choose(absorbs, hull, product);
        self.smooth(ends, a, b)
    }

    /// The ends of the smallest interval that holds both; an empty one takes no part.
    fn hull(&mut self, a: Value, b: Value) -> Value {
        let ends = emit::maximum(&mut self.builder, Lanes::Two, a, b);
        let is_empty = self.builder.ins().fcmp(FloatCC::Unordered, b, b);
        self.choose(is_empty, a, ends)
    }

    /// Whether 0 lies in the interval, in both lanes.
    fn has_zero(&mut self, ends: Value) -> Value {
        let zero = self.number(0.0);
        let mask = (self.builder.ins()).fcmp(FloatCC::GreaterThanOrEqual, ends, zero);
        self.both(mask)
    }

    /// −low and high of both intervals, each in both lanes.
    fn lanes(&mut self, a: Value, b: Value) -> [Value; 4] {
        [
            self.shuffle(a, a, FIRST_TWICE),
            self.shuffle(a, a, SECOND_TWICE),
            self.shuffle(b, b, FIRST_TWICE),
            self.shuffle(b, b, SECOND_TWICE),
        ]
    }

    /// Where both lanes of the mask are set.
    fn both(&mut self, mask: Value) -> Value {
        let other = self.shuffle(mask, mask, SWAP);
        self.builder.ins().band(mask, other)
    }

    /// Where one lane of the mask is set, or both.
    fn either(&mut self, mask: Value) -> Value {
        let other = self.shuffle(mask, mask, SWAP);
        self.builder.ins().bor(mask, other)
    }

    /// (high, −low): the ends of the opposite.
    pub(super) fn swap(&mut self, ends: Value) -> Value {
        self.shuffle(ends, ends, SWAP)
    }

    /// The first lane of one vector and the second lane of the other.
    fn halves(&mut self, first: Value, second: Value) -> Value {
        self.shuffle(first, second, HALVES)
    }

    /// The lanes in these places of both vectors, in the type of the first.
    fn shuffle(&mut self, first: Value, second: Value, places: [u8; 2]) -> Value {
        let kind = self.builder.func.dfg.value_type(first);
        let bytes: Vec<u8> = places
            .iter()
            .flat_map(|place| 8 * place..8 * (place + 1))
            .collect();
        let [first, second] =
            [first, second].map(|vector| self.builder.ins().bitcast(I8X16, little(), vector));
        let dfg = &mut self.builder.func.dfg;
        let places = dfg.immediates.push(ConstantData::from(&bytes[..]));
        let bytes = self.builder.ins().shuffle(first, second, places);
        self.builder.ins().bitcast(kind, little(), bytes)
    }

    /// The numbers with the signs changed that are set in this vector of the table.
    fn flip(&mut self, numbers: Value, signs: usize) -> Value {
        let signs = self.entry(signs, F64X2);
        self.builder.ins().bxor(numbers, signs)
    }

    /// The numbers where the mask is set, else 0.
    fn and(&mut self, numbers: Value, mask: Value) -> Value {
        let mask = self.numbers(mask);
        self.builder.ins().band(numbers, mask)
    }

    /// NaN where the mask is set.
    fn or(&mut self, numbers: Value, mask: Value) -> Value {
        let mask = self.numbers(mask);
        self.builder.ins().bor(numbers, mask)
    }

    /// One of two by lanes of a mask.
    fn choose(&mut self, mask: Value, taken: Value, otherwise: Value) -> Value {
        let mask = self.numbers(mask);
        self.builder.ins().bitselect(mask, taken, otherwise)
    }

    /// Bits taken for numbers.
    fn numbers(&mut self, bits: Value) -> Value {
        self.builder.ins().bitcast(F64X2, little(), bits)
    }

    /// Numbers taken for bits.
    fn bits(&mut self, numbers: Value) -> Value {
        self.builder.ins().bitcast(I64X2, little(), numbers)
    }

    /// The number in both lanes.
    fn number(&mut self, number: f64) -> Value {
        Lanes::Two.constant(&mut self.builder, number)
    }

    /// A vector of the table.
    pub(super) fn entry(&mut self, place: usize, kind: cranelift_codegen::ir::Type) -> Value {
        let flags = MemFlagsData::trusted().with_readonly().with_can_move();
        self.builder
            .ins()
            .load(kind, flags, self.constants, 16 * place as i32)
    }
}

/// The places of lanes in two vectors: 0 and 1 in the first one, 2 and 3 in the second.
const SWAP: [u8; 2] = [1, 0];
const FIRST_TWICE: [u8; 2] = [0, 0];
const SECOND_TWICE: [u8; 2] = [1, 1];
const HALVES: [u8; 2] = [0, 3];
