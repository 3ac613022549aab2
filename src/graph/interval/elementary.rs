//! Elementary functions that are monotone, whole or in two halves.
//!
//! A correctly rounded value is within half a unit in the last place of the true one, so one step
//! outward is a proof. At the one argument where a function's value is a floating-point number
//! (by Lindemann's theorem there is no other for these functions) no step is needed.

use std::f64::consts::{FRAC_PI_2, PI};

use super::Interval;

/// Numbers from 0 on.
const NOT_NEGATIVE: Interval = Interval {
    low: 0.0,
    high: f64::INFINITY,
};

/// Sines, cosines and tanh.
pub(super) const UNIT: Interval = Interval {
    low: -1.0,
    high: 1.0,
};

/// The smallest numbers known to be above π and π/2; the constants themselves are below.
const ABOVE_PI: f64 = PI.next_up();
const ABOVE_HALF_PI: f64 = FRAC_PI_2.next_up();

impl Interval {
    /// e^a.
    pub fn exp(self) -> Interval {
        self.increasing(core_math::exp, 0.0)
            .intersection(NOT_NEGATIVE)
    }

    /// The logarithm of the numbers that have one.
    pub fn log(self) -> Interval {
        if self.high <= 0.0 {
            return Interval::EMPTY;
        }
        self.intersection(NOT_NEGATIVE)
            .increasing(core_math::log, 1.0)
    }

    /// The angle in [−π/2, π/2] with this sine.
    pub fn asin(self) -> Interval {
        self.intersection(UNIT)
            .increasing(core_math::asin, 0.0)
            .intersection(half_turn())
    }

    /// The angle in [0, π] with this cosine.
    pub fn acos(self) -> Interval {
        let a = self.intersection(UNIT);
        if a.is_empty() {
            return a;
        }
        let low = lower(core_math::acos, a.high, 1.0).max(0.0);
        Interval {
            low,
            high: upper(core_math::acos, a.low, 1.0).min(ABOVE_PI),
        }
    }

    /// The angle in [−π/2, π/2] with this tangent.
    pub fn atan(self) -> Interval {
        self.increasing(core_math::atan, 0.0)
            .intersection(half_turn())
    }

    /// The angle in (−π, π] of the points (x, y), y being `self`; 0 at the origin. It jumps
    /// across the negative x axis, which belongs to the upper side.
    pub fn atan2(self, x: Interval) -> Interval {
        if self.is_empty() || x.is_empty() {
            return Interval::EMPTY;
        }
        let angles = self.angles_around_origin(x);
        match self.contains(0.0) && x.contains(0.0) {
            true => angles.hull(Interval {
                low: 0.0,
                high: 0.0,
            }),
            false => angles,
        }
    }

    /// The angles of the points of a box other than the origin.
    fn angles_around_origin(self, x: Interval) -> Interval {
        let y = self;
        if y.low >= 0.0 {
            upper_angles(y, x)
        } else if x.low < 0.0 && y.high >= 0.0 {
            Interval {
                low: -ABOVE_PI,
                high: ABOVE_PI,
            }
        } else if y.high <= 0.0 {
            -upper_angles(-y, x)
        } else {
            let right = Interval {
                low: x.low,
                high: x.low,
            };
            let above = upper_angles(
                Interval {
                    low: y.high,
                    high: y.high,
                },
                right,
            );
            let below = upper_angles(
                Interval {
                    low: -y.low,
                    high: -y.low,
                },
                right,
            );
            Interval {
                low: -below.high,
                high: above.high,
            }
        }
    }

    /// (e^a − e^−a)/2.
    pub fn sinh(self) -> Interval {
        self.increasing(core_math::sinh, 0.0)
    }

    /// (e^a + e^−a)/2.
    pub fn cosh(self) -> Interval {
        let cosh = self.abs().increasing(core_math::cosh, 0.0);
        cosh.intersection(Interval {
            low: 1.0,
            high: f64::INFINITY,
        })
    }

    /// sinh/cosh.
    pub fn tanh(self) -> Interval {
        self.increasing(core_math::tanh, 0.0).intersection(UNIT)
    }

    /// √(a² + b²).
    pub fn hypot(self, other: Interval) -> Interval {
        let (a, b) = (self.abs(), other.abs());
        if a.is_empty() || b.is_empty() {
            return Interval::EMPTY;
        }
        // With one side 0 the length is the other side.
        let is_exact = |a: f64, b: f64| a == 0.0 || b == 0.0;
        let low = core_math::hypot(a.low, b.low);
        let high = core_math::hypot(a.high, b.high);
        Interval {
            low: if is_exact(a.low, b.low) {
                low
            } else {
                low.next_down()
            },
            high: if is_exact(a.high, b.high) {
                high
            } else {
                high.next_up()
            },
        }
    }

    /// An increasing function whose value is a floating-point number at `exact` only.
    pub(super) fn increasing(self, function: fn(f64) -> f64, exact: f64) -> Interval {
        if self.is_empty() {
            return self;
        }
        Interval {
            low: lower(function, self.low, exact),
            high: upper(function, self.high, exact),
        }
    }
}

/// A lower bound of a function whose value is a floating-point number at `exact` only.
pub(super) fn lower(function: fn(f64) -> f64, a: f64, exact: f64) -> f64 {
    let value = function(a);
    if a == exact { value } else { value.next_down() }
}

/// An upper bound, likewise.
pub(super) fn upper(function: fn(f64) -> f64, a: f64, exact: f64) -> f64 {
    let value = function(a);
    if a == exact { value } else { value.next_up() }
}

/// [−π/2, π/2].
fn half_turn() -> Interval {
    Interval {
        low: -ABOVE_HALF_PI,
        high: ABOVE_HALF_PI,
    }
}

/// The angles of points with y ≥ 0, the origin left out. They grow from right to left; further
/// up they come closer to π/2 from either side.
fn upper_angles(y: Interval, x: Interval) -> Interval {
    if y.high == 0.0 && x.low == 0.0 && x.high == 0.0 {
        return Interval::EMPTY;
    }
    let low = if x.high > 0.0 {
        angle(y.low, x.high).0
    } else if y.high > 0.0 {
        angle(y.high, x.high).0
    } else {
        PI
    };
    let high = if x.low < 0.0 {
        angle(y.low, x.low).1
    } else {
        angle(y.high, x.low).1
    };
    Interval { low, high }
}

/// Bounds of the angle of one point with y ≥ 0; of the origin, 0. Signs of zeros do not count.
fn angle(y: f64, x: f64) -> (f64, f64) {
    let value = core_math::atan2(y + 0.0, x + 0.0);
    if value == 0.0 && y == 0.0 {
        return (0.0, 0.0);
    }
    (value.next_down().max(0.0), value.next_up().min(ABOVE_PI))
}
