//! The vectors that code on intervals reads as memory operands: masks, then constants.

use super::BoxNumber;
use crate::engine::lower::{Lowered, Operand, Step};
use crate::graph::Op;
use crate::graph::interval::{Enclosure, Regularity};
use rustc_hash::FxHashMap;

/// The sign of the first lane.
pub(super) const FIRST_SIGN: usize = 0;
/// The sign of the second lane.
pub(super) const SECOND_SIGN: usize = 1;
/// All bits of the first lane.
pub(super) const FIRST: usize = 2;
/// All bits of the second lane.
pub(super) const SECOND: usize = 3;
/// All bits.
pub(super) const ALL: usize = 4;
/// (−1, 1).
pub(super) const MINUS_ONE_AND_ONE: usize = 5;
/// (0, −∞): what the ends of an interval of which a root is taken are at least.
pub(super) const ROOT_DOMAIN: usize = 6;

const SIGN: u64 = 1 << 63;

/// Two lanes, aligned as memory operands must be.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub(super) struct Vector(pub(super) [u64; 2]);

/// What stands before the constants.
const HEAD: [Vector; 7] = [
    Vector([SIGN, 0]),
    Vector([0, SIGN]),
    Vector([u64::MAX, 0]),
    Vector([0, u64::MAX]),
    Vector([u64::MAX, u64::MAX]),
    Vector([(-1f64).to_bits(), 1f64.to_bits()]),
    Vector([0, f64::NEG_INFINITY.to_bits()]),
];

/// How a step uses a constant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Use {
    /// As an interval.
    Interval,
    /// By its magnitude, in both lanes.
    Magnitude,
}

/// The places of constants.
pub(super) struct Table {
    /// The vectors.
    pub(super) vectors: Vec<Vector>,
    places: FxHashMap<(Use, u64), usize>,
}

impl Table {
    /// With all constants of the steps, for both uses; a negated one as an interval too.
    pub(super) fn new(lowered: &Lowered) -> Table {
        let mut table = Table {
            vectors: HEAD.to_vec(),
            places: FxHashMap::default(),
        };
        for step in &lowered.steps {
            for (place, &operand) in step.operands().iter().enumerate() {
                if let Operand::Constant(number) = operand {
                    table.add(step, place, number);
                }
            }
        }
        for &output in &lowered.outputs {
            if let Operand::Constant(number) = output {
                table.add_use(Use::Interval, number);
            }
        }
        table
    }

    /// Adds what the step needs of a constant at this place of its operands.
    fn add(&mut self, step: &Step, place: usize, number: f64) {
        if is_factor(step, place, number) {
            self.add_use(Use::Magnitude, number.abs());
        } else if step.operation == Op::Subtract && place == 1 {
            self.add_use(Use::Interval, -number);
        } else {
            self.add_use(Use::Interval, number);
        }
    }

    fn add_use(&mut self, how: Use, number: f64) {
        let vectors = &mut self.vectors;
        self.places
            .entry((how, number.to_bits()))
            .or_insert_with(|| {
                let ends = match how {
                    Use::Interval => BoxNumber::from(Enclosure::of_number(number)).ends,
                    Use::Magnitude => [number; 2],
                };
                vectors.push(Vector(ends.map(f64::to_bits)));
                vectors.len() - 1
            });
    }

    /// Where a constant is; every one that steps need is there.
    pub(super) fn place(&self, how: Use, number: f64) -> Option<usize> {
        self.places.get(&(how, number.to_bits())).copied()
    }
}

/// Whether the operand at this place is a factor or divisor by which both ends are simply
/// multiplied or divided: finite, and not 0.
pub(super) fn is_factor(step: &Step, place: usize, number: f64) -> bool {
    let is_place = match step.operation {
        Op::Multiply => true,
        Op::Divide => place == 1,
        _ => false,
    };
    is_place && number.is_finite() && number != 0.0
}

/// Whether a constant is a number, so that nothing need be known of its regularity.
pub(super) fn is_regular(number: f64) -> bool {
    Enclosure::of_number(number).regularity == Regularity::Continuous
}
