//! Sine, cosine and tangent of intervals.
//!
//! Where the extrema and poles lie is told by quarter turns. Which quarter an argument lies in
//! shows in the signs of its sine and cosine; these are right for every floating-point number,
//! however large, because the functions are correctly rounded and only sin 0 is 0.

use std::f64::consts::{PI, TAU};

use super::Interval;
use super::elementary::{UNIT, lower, upper};
use super::rounding::add_up;

impl Interval {
    /// The sines: 1 between the quarters 0 and 1, −1 between 2 and 3.
    pub fn sin(self) -> Interval {
        self.wave(core_math::sin, 0, 2)
    }

    /// The cosines: 1 between the quarters 3 and 0, −1 between 1 and 2.
    pub fn cos(self) -> Interval {
        self.wave(core_math::cos, 3, 1)
    }

    /// The tangents; all numbers if there is a pole between.
    pub fn tan(self) -> Interval {
        if self.is_empty() {
            self
        } else if self.has_tangent_pole() {
            Interval::ENTIRE
        } else {
            self.increasing(core_math::tan, 0.0)
        }
    }

    /// Whether a pole of the tangent, between the quarters 0 and 1 or 2 and 3, may lie inside.
    pub(in crate::graph) fn has_tangent_pole(self) -> bool {
        match Quarters::of(self) {
            Some(quarters) => quarters.leaves(0) || quarters.leaves(2),
            None => true,
        }
    }

    /// A function that is 1 where an argument leaves the quarter `crest`, −1 where it leaves
    /// `trough`, and monotone between.
    fn wave(self, function: fn(f64) -> f64, crest: u8, trough: u8) -> Interval {
        if self.is_empty() {
            return self;
        }
        let Some(quarters) = Quarters::of(self) else {
            return UNIT;
        };
        let low = if quarters.leaves(trough) {
            -1.0
        } else {
            lower(function, self.low, 0.0).min(lower(function, self.high, 0.0))
        };
        let high = if quarters.leaves(crest) {
            1.0
        } else {
            upper(function, self.low, 0.0).max(upper(function, self.high, 0.0))
        };
        Interval { low, high }.intersection(UNIT)
    }
}

/// The quarter turns that an interval of less than a turn runs through.
struct Quarters {
    /// The quarter of the lower end: 0 for [0, π/2), and so on.
    first: u8,
    /// How many boundaries between quarters lie inside.
    crossings: u8,
}

impl Quarters {
    /// `None` if the interval may be a whole turn or more.
    fn of(interval: Interval) -> Option<Quarters> {
        let width = add_up(interval.high, -interval.low);
        // TAU is a little less than 2π.
        if width >= TAU {
            return None;
        }
        let (first, last) = (quarter(interval.low), quarter(interval.high));
        let crossings = match (last + 4 - first) % 4 {
            // Back in the same quarter: less than a quarter turn, or more than three.
            0 if width > PI => 4,
            crossings => crossings,
        };
        Some(Quarters { first, crossings })
    }

    /// Whether the boundary at the end of this quarter lies inside.
    fn leaves(&self, quarter: u8) -> bool {
        (quarter + 4 - self.first) % 4 < self.crossings
    }
}

/// The quarter turn, 0 to 3, that a finite argument lies in.
fn quarter(a: f64) -> u8 {
    match (core_math::sin(a) >= 0.0, core_math::cos(a) >= 0.0) {
        (true, true) => 0,
        (true, false) => 1,
        (false, false) => 2,
        (false, true) => 3,
    }
}
