//! Powers of intervals, with integer and with real exponents.

use super::Interval;
use super::rounding::{divide_down, divide_up, multiply_down, multiply_up};
use crate::graph::operation::value::{by_squaring, integer_power, is_integer_power, power};

const ZERO: Interval = Interval {
    low: 0.0,
    high: 0.0,
};
const ONE: Interval = Interval {
    low: 1.0,
    high: 1.0,
};

impl Interval {
    /// a^n for an integer n of magnitude at most 1024; 0 has no negative power.
    pub fn integer_power(self, exponent: f64) -> Interval {
        let a = self;
        if a.is_empty() || (exponent < 0.0 && a == ZERO) {
            Interval::EMPTY
        } else if exponent == 0.0 {
            ONE
        } else if exponent % 2.0 == 0.0 {
            magnitudes(a.abs(), exponent)
        } else if a.low >= 0.0 {
            magnitudes(a, exponent)
        } else if a.high <= 0.0 {
            -magnitudes(-a, exponent)
        } else if exponent < 0.0 {
            Interval::ENTIRE
        } else {
            let side = |end: f64| {
                magnitudes(
                    Interval {
                        low: 0.0,
                        high: end,
                    },
                    exponent,
                )
            };
            Interval {
                low: -side(-a.low).high,
                high: side(a.high).high,
            }
        }
    }

    /// a^b. A negative number has integer powers only, and 0 no negative ones; 0^0 is 1.
    pub fn power(self, exponent: Interval) -> Interval {
        let (a, b) = (self, exponent);
        if a.is_empty() || b.is_empty() {
            return Interval::EMPTY;
        }
        if b.low == b.high && is_integer_power(b.low) {
            return a.integer_power(b.low);
        }
        let positive = a.intersection(Interval {
            low: 0.0,
            high: f64::INFINITY,
        });
        let mut result = positive_power(positive, b);
        if a.low < 0.0 && b.low.ceil() <= b.high {
            let negative = Interval {
                low: a.low,
                high: a.high.min(-0.0),
            };
            let magnitude = positive_power(-negative, b);
            if has_parity(b, 0.0) {
                result = result.hull(magnitude);
            }
            if has_parity(b, 1.0) {
                result = result.hull(-magnitude);
            }
        }
        result
    }
}

/// Whether an interval that holds an integer holds one with this remainder by 2.
fn has_parity(b: Interval, remainder: f64) -> bool {
    let first = b.low.ceil();
    first < b.high.floor() || first.abs() % 2.0 == remainder
}

/// a^n for a ≥ 0 and an integer n that is not 0.
fn magnitudes(a: Interval, exponent: f64) -> Interval {
    if exponent > 0.0 {
        let (low, high) = (
            integer_power_ends(a.low, exponent),
            integer_power_ends(a.high, exponent),
        );
        return Interval {
            low: low.0,
            high: high.1,
        };
    }
    let low = integer_power_ends(a.high, exponent).0;
    let high = if a.low == 0.0 {
        f64::INFINITY
    } else {
        integer_power_ends(a.low, exponent).1
    };
    Interval { low, high }
}

/// Bounds of a^n for a ≥ 0, both of the true power and of the one that repeated multiplication
/// computes: from repeated multiplication with directed rounding or from the correctly rounded
/// power, whichever is tighter.
fn integer_power_ends(a: f64, exponent: f64) -> (f64, f64) {
    let magnitude = exponent.abs() as u32;
    let mut low = by_squaring(a, magnitude, multiply_down);
    let mut high = by_squaring(a, magnitude, multiply_up);
    if exponent < 0.0 {
        (low, high) = (divide_down(1.0, high), divide_up(1.0, low));
    }
    if low == high {
        return (low, high);
    }
    let computed = integer_power(a, exponent);
    let nearest = core_math::pow(a, exponent);
    (
        low.max(nearest.next_down().min(computed)),
        high.min(nearest.next_up().max(computed)),
    )
}

/// a^b for a ≥ 0: monotone in a for each b and in b for each a, so the extremes are at corners;
/// which ones depends on whether a is below 1 and on the sign of b.
fn positive_power(a: Interval, b: Interval) -> Interval {
    if a.is_empty() || (a == ZERO && b.high < 0.0) {
        return Interval::EMPTY;
    }
    if a == ZERO {
        let at_zero = if b.contains(0.0) {
            ONE
        } else {
            Interval::EMPTY
        };
        let above = if b.high > 0.0 { ZERO } else { Interval::EMPTY };
        return at_zero.hull(above);
    }
    let low = if b.low >= 0.0 {
        lower_power(a.low, if a.low < 1.0 { b.high } else { b.low })
    } else if b.high <= 0.0 {
        lower_power(a.high, if a.high < 1.0 { b.high } else { b.low })
    } else {
        lower_power(a.low, b.high).min(lower_power(a.high, b.low))
    };
    let high = if b.low >= 0.0 {
        upper_power(a.high, if a.high < 1.0 { b.low } else { b.high })
    } else if b.high <= 0.0 {
        upper_power(a.low, if a.low < 1.0 { b.low } else { b.high })
    } else {
        upper_power(a.low, b.low).max(upper_power(a.high, b.high))
    };
    Interval { low, high }
}

fn lower_power(a: f64, b: f64) -> f64 {
    let nearest = core_math::pow(a, b);
    if is_exact(a, b) {
        nearest
    } else {
        nearest.next_down().min(power(a, b)).max(0.0)
    }
}

fn upper_power(a: f64, b: f64) -> f64 {
    let nearest = core_math::pow(a, b);
    if is_exact(a, b) {
        nearest
    } else {
        nearest.next_up().max(power(a, b))
    }
}

/// Powers that are the limits or numbers that one expects, without rounding.
fn is_exact(a: f64, b: f64) -> bool {
    a == 0.0 || a == 1.0 || a.is_infinite() || b == 0.0 || b == 1.0 || b.is_infinite()
}
