//! What the interval rules of the table are written in: the range of an operation, and what it
//! does to regularity.

use super::{Enclosure, Interval, Regularity};
use crate::graph::operation::value::is_integer_power;

/// An operation that is defined and continuous wherever its operands are.
pub(in crate::graph) fn smooth(operands: &[Enclosure], range: Interval) -> Enclosure {
    let regularity = operands.iter().map(|operand| operand.regularity).min();
    let regularity = match regularity {
        Some(regularity) if !range.is_empty() => regularity,
        _ => Regularity::Partial,
    };
    Enclosure { range, regularity }
}

/// An operation that is undefined outside of a domain, and continuous in it.
pub(in crate::graph) fn within(
    is_in_domain: bool,
    operands: &[Enclosure],
    range: Interval,
) -> Enclosure {
    let enclosure = smooth(operands, range);
    match is_in_domain {
        true => enclosure,
        false => Enclosure {
            regularity: Regularity::Partial,
            ..enclosure
        },
    }
}

/// An operation that is defined wherever its operands are, but jumps.
pub(in crate::graph) fn jumping(
    is_continuous: bool,
    operands: &[Enclosure],
    range: Interval,
) -> Enclosure {
    let enclosure = smooth(operands, range);
    match is_continuous {
        true => enclosure,
        false => Enclosure {
            regularity: enclosure.regularity.min(Regularity::Defined),
            ..enclosure
        },
    }
}

/// A step function: it is continuous where it does not step.
pub(in crate::graph) fn steps(operands: &[Enclosure], step: fn(f64) -> f64) -> Enclosure {
    let range = operands[0].range.stepped(step);
    jumping(range.low == range.high, operands, range)
}

/// a/b.
pub(in crate::graph) fn divide(operands: &[Enclosure]) -> Enclosure {
    let [a, b] = [operands[0].range, operands[1].range];
    within(!b.contains(0.0), operands, a / b)
}

/// a^b: defined for positive a, and for every a if b is a non-negative integer constant.
pub(in crate::graph) fn power(operands: &[Enclosure]) -> Enclosure {
    let [a, b] = [operands[0].range, operands[1].range];
    let is_integer = b.low == b.high && is_integer_power(b.low);
    let is_defined = match is_integer {
        true => b.low >= 0.0 || !a.contains(0.0),
        false => a.low > 0.0 || (a.low == 0.0 && b.low > 0.0),
    };
    within(is_defined, operands, a.power(b))
}

/// The angle of a point: it jumps at the origin and along the negative x axis.
pub(in crate::graph) fn atan2(operands: &[Enclosure]) -> Enclosure {
    let [y, x] = [operands[0].range, operands[1].range];
    let has_origin = y.contains(0.0) && x.contains(0.0);
    let is_cut = x.low < 0.0 && y.low < 0.0 && y.high >= 0.0;
    jumping(!has_origin && !is_cut, operands, y.atan2(x))
}

/// a mod b: jumps where a/b is an integer.
pub(in crate::graph) fn modulo(operands: &[Enclosure]) -> Enclosure {
    let [a, b] = [operands[0].range, operands[1].range];
    let periods = (a / b).stepped(f64::floor);
    let enclosure = jumping(periods.low == periods.high, operands, a.modulo(b));
    within(!b.contains(0.0), &[enclosure], enclosure.range)
}

/// a < b.
pub(in crate::graph) fn less(operands: &[Enclosure]) -> Enclosure {
    let [a, b] = [operands[0].range, operands[1].range];
    comparison(operands, a.low < b.high, a.high < b.low)
}

/// a ≤ b.
pub(in crate::graph) fn less_equal(operands: &[Enclosure]) -> Enclosure {
    let [a, b] = [operands[0].range, operands[1].range];
    comparison(operands, a.low <= b.high, a.high <= b.low)
}

/// a = b.
pub(in crate::graph) fn equal(operands: &[Enclosure]) -> Enclosure {
    let [a, b] = [operands[0].range, operands[1].range];
    comparison(
        operands,
        a.low <= b.high && b.low <= a.high,
        a.low == b.high && b.low == a.high,
    )
}

/// Whether a is not NaN.
pub(in crate::graph) fn is_number(operands: &[Enclosure]) -> Enclosure {
    comparison(operands, true, true)
}

/// A comparison that, of operands that are numbers, can hold or must hold. Of others it does not.
fn comparison(operands: &[Enclosure], can_hold: bool, must_hold: bool) -> Enclosure {
    let is_empty = operands.iter().any(|operand| operand.range.is_empty());
    let is_partial = operands
        .iter()
        .any(|operand| operand.regularity == Regularity::Partial);
    let can_hold = can_hold && !is_empty;
    let can_fail = is_partial || !must_hold;
    let low = if can_fail { 0.0 } else { 1.0 };
    let high = if can_hold { 1.0 } else { 0.0 };
    let regularity = match low == high {
        true => Regularity::Continuous,
        false => Regularity::Defined,
    };
    Enclosure {
        range: Interval { low, high },
        regularity,
    }
}

/// The second operand where the first is not 0 (or NaN), else the third; both if that is open.
pub(in crate::graph) fn select(operands: &[Enclosure]) -> Enclosure {
    let [condition, taken, otherwise] = [operands[0], operands[1], operands[2]];
    let is_partial = condition.regularity == Regularity::Partial;
    let can_take = is_partial || condition.range.low != 0.0 || condition.range.high != 0.0;
    match (can_take, condition.range.contains(0.0)) {
        (true, false) => taken,
        (false, _) => otherwise,
        (true, true) => {
            let range = taken.range.hull(otherwise.range);
            jumping(false, &[taken, otherwise], range)
        }
    }
}

/// a·b, and 0 where a factor is 0, whatever the other one is.
pub(in crate::graph) fn chain_product(operands: &[Enclosure]) -> Enclosure {
    let [a, b] = [operands[0].range, operands[1].range];
    let has_zero = a.contains(0.0) || b.contains(0.0);
    let absorbed = if has_zero {
        Interval::new(0.0, 0.0)
    } else {
        Interval::EMPTY
    };
    smooth(operands, (a * b).hull(absorbed))
}
