//! Arithmetic on intervals: the ends are found by sign, and rounded outward.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::Interval;
use super::rounding::{
    add_down, add_up, divide_down, divide_up, multiply_down, multiply_up, square_root_down,
    square_root_up,
};
use crate::graph::operation::value;

impl Add for Interval {
    type Output = Interval;

    fn add(self, other: Interval) -> Interval {
        if self.is_empty() || other.is_empty() {
            return Interval::EMPTY;
        }
        Interval {
            low: add_down(self.low, other.low),
            high: add_up(self.high, other.high),
        }
    }
}

impl Neg for Interval {
    type Output = Interval;

    fn neg(self) -> Interval {
        Interval {
            low: -self.high,
            high: -self.low,
        }
    }
}

impl Sub for Interval {
    type Output = Interval;

    fn sub(self, other: Interval) -> Interval {
        self + -other
    }
}

impl Mul for Interval {
    type Output = Interval;

    fn mul(self, other: Interval) -> Interval {
        let (a, b) = (self, other);
        if a.is_empty() || b.is_empty() {
            return Interval::EMPTY;
        }
        if a.low < 0.0 && a.high <= 0.0 {
            return -(-a * b);
        }
        if b.low < 0.0 && b.high <= 0.0 {
            return -(a * -b);
        }
        match (a.low < 0.0, b.low < 0.0) {
            (false, false) => ends((a.low, b.low), (a.high, b.high)),
            (false, true) => ends((a.high, b.low), (a.high, b.high)),
            (true, false) => ends((a.low, b.high), (a.high, b.high)),
            (true, true) => {
                ends((a.low, b.high), (a.high, b.high)).hull(ends((a.high, b.low), (a.low, b.low)))
            }
        }
    }
}

/// From one product to another.
fn ends(low: (f64, f64), high: (f64, f64)) -> Interval {
    Interval {
        low: multiply_down(low.0, low.1),
        high: multiply_up(high.0, high.1),
    }
}

impl Div for Interval {
    type Output = Interval;

    fn div(self, other: Interval) -> Interval {
        let (a, b) = (self, other);
        if a.is_empty() || b.is_empty() || (b.low == 0.0 && b.high == 0.0) {
            return Interval::EMPTY;
        }
        if a.low == 0.0 && a.high == 0.0 {
            return a;
        }
        if b.low < 0.0 && 0.0 < b.high {
            return Interval::ENTIRE;
        }
        if b.high <= 0.0 {
            return -a / -b;
        }
        // The divisors are positive, and come as close to 0 as one likes if b.low is 0.
        let low = match (a.low < 0.0, b.low == 0.0) {
            (false, _) => divide_down(a.low, b.high),
            (true, false) => divide_down(a.low, b.low),
            (true, true) => f64::NEG_INFINITY,
        };
        let high = match (a.high > 0.0, b.low == 0.0) {
            (false, _) => divide_up(a.high, b.high),
            (true, false) => divide_up(a.high, b.low),
            (true, true) => f64::INFINITY,
        };
        Interval { low, high }
    }
}

impl Interval {
    /// |a|.
    pub fn abs(self) -> Interval {
        if self.is_empty() || self.low >= 0.0 {
            self
        } else if self.high <= 0.0 {
            -self
        } else {
            Interval {
                low: 0.0,
                high: self.high.max(-self.low),
            }
        }
    }

    /// a².
    pub fn square(self) -> Interval {
        let magnitude = self.abs();
        magnitude * magnitude
    }

    /// √a of the numbers that have one.
    pub fn square_root(self) -> Interval {
        let a = self.intersection(Interval {
            low: 0.0,
            high: f64::INFINITY,
        });
        if a.is_empty() {
            return a;
        }
        Interval {
            low: square_root_down(a.low),
            high: square_root_up(a.high),
        }
    }

    /// The smaller one of two numbers.
    pub fn min(self, other: Interval) -> Interval {
        if self.is_empty() || other.is_empty() {
            return Interval::EMPTY;
        }
        Interval {
            low: self.low.min(other.low),
            high: self.high.min(other.high),
        }
    }

    /// The larger one of two numbers.
    pub fn max(self, other: Interval) -> Interval {
        -(-self).min(-other)
    }

    /// Both ends through a function that never decreases and is exact: ⌊a⌋, ⌈a⌉, round, sign.
    pub fn stepped(self, step: fn(f64) -> f64) -> Interval {
        if self.is_empty() {
            return self;
        }
        Interval {
            low: step(self.low),
            high: step(self.high),
        }
    }

    /// The floored remainder a − b·⌊a/b⌋. Where ⌊a/b⌋ is known the ends move with a; else they
    /// are 0 and b, widened by as much as the rounded remainder can miss them.
    pub fn modulo(self, other: Interval) -> Interval {
        let (a, b) = (self, other);
        let stepwise = a - b * (a / b).stepped(f64::floor);
        if stepwise.is_empty() {
            return stepwise;
        }
        let slack = modulo_slack(a.abs().high, b);
        let period = b.hull(Interval {
            low: 0.0,
            high: 0.0,
        });
        stepwise.intersection(
            period
                + Interval {
                    low: -slack,
                    high: slack,
                },
        )
    }
}

/// How far the computed remainder can lie outside of [0, b]. The quotient, the product and the
/// difference each round once, to 2^-53 of |a| + |b| (times 4 for the sum of all, and 2 to be
/// safe), and the quotient may underflow. If b is a power of two only that is left.
fn modulo_slack(dividend: f64, b: Interval) -> f64 {
    const SMALLEST: f64 = f64::from_bits(1);
    let divisor = b.abs().high;
    let underflow = if divisor <= 1.0 {
        0.0
    } else {
        divisor * SMALLEST
    };
    if b.low == b.high && value::is_power_of_two(b.low) {
        return underflow;
    }
    (dividend + divisor) * (4.0 * f64::EPSILON) + underflow + SMALLEST
}
