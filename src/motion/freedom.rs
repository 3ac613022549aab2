//! What the parameters may do: some are frozen, others stay in a range.

use super::MotionError;

/// What may change of q.
///
/// A frozen parameter takes no part in anything: it keeps every bit. A parameter with a range stops at
/// its ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Freedom {
    frozen: Vec<bool>,
    /// The ends, infinite where there is none.
    ranges: Vec<[f64; 2]>,
}

impl Freedom {
    /// `count` parameters that may do anything.
    pub fn all(count: usize) -> Freedom {
        Freedom {
            frozen: vec![false; count],
            ranges: vec![[f64::NEG_INFINITY, f64::INFINITY]; count],
        }
    }

    /// The parameter at this place of q keeps its value. A place beyond q changes nothing.
    #[must_use]
    pub fn with_frozen(mut self, place: usize) -> Freedom {
        if let Some(frozen) = self.frozen.get_mut(place) {
            *frozen = true;
        }
        self
    }

    /// The parameter at this place of q stays in low..high; ends that are NaN are none.
    #[must_use]
    pub fn with_range(mut self, place: usize, low: f64, high: f64) -> Freedom {
        if let Some(range) = self.ranges.get_mut(place) {
            let end = |end: f64, none: f64| if end.is_nan() { none } else { end };
            *range = [end(low, f64::NEG_INFINITY), end(high, f64::INFINITY)];
        }
        self
    }

    /// The number of parameters.
    pub fn count(&self) -> usize {
        self.frozen.len()
    }

    /// Whether the parameter keeps its value.
    pub fn is_frozen(&self, place: usize) -> bool {
        self.frozen.get(place).copied().unwrap_or(true)
    }

    /// The range of a parameter; infinite ends where there is none.
    pub fn range(&self, place: usize) -> [f64; 2] {
        let none = [f64::NEG_INFINITY, f64::INFINITY];
        self.ranges.get(place).copied().unwrap_or(none)
    }

    /// The places of the parameters that stand at an end of their range, or beyond it, and are not
    /// frozen.
    pub fn at_bounds(&self, q: &[f64]) -> Vec<usize> {
        let stands = |&place: &usize| {
            let [low, high] = self.range(place);
            !self.is_frozen(place) && (q[place] <= low || q[place] >= high)
        };
        (0..self.count().min(q.len())).filter(stands).collect()
    }

    /// How far each parameter may go from `q`, downward and upward. One that is out of its range may
    /// only come back.
    pub(super) fn room(&self, q: &[f64]) -> Vec<[f64; 2]> {
        let room = |(place, &q): (usize, &f64)| {
            let [low, high] = self.range(place);
            [(low - q).min(0.0), (high - q).max(0.0)]
        };
        q.iter().enumerate().map(room).collect()
    }

    /// How fast each parameter may go, downward and upward: how long it will is not known, so that only
    /// an end at which it stands matters.
    pub(super) fn speeds(&self, q: &[f64]) -> Vec<[f64; 2]> {
        let speed = |room: f64| match room == 0.0 {
            true => 0.0,
            false => f64::INFINITY * room,
        };
        let rooms = self.room(q).into_iter();
        rooms.map(|room| room.map(speed)).collect()
    }

    /// `q + step` within the ranges; what is frozen or does not move keeps its bits.
    pub(super) fn moved(&self, q: &[f64], step: &[f64]) -> Vec<f64> {
        let moved = |(place, (&q, &step)): (usize, (&f64, &f64))| {
            if self.is_frozen(place) || step == 0.0 {
                return q;
            }
            let [low, high] = self.range(place);
            // Exactly at the end, whatever rounding says; what is out of the range may take some steps back.
            match step > 0.0 {
                true if step >= high - q => high.max(q),
                true => (q + step).min(high),
                false if step <= low - q => low.min(q),
                false => (q + step).max(low),
            }
        };
        q.iter().zip(step).enumerate().map(moved).collect()
    }

    /// Checks that there is an entry for each parameter.
    pub(super) fn check(&self, expected: usize) -> Result<(), MotionError> {
        let found = self.count();
        match found == expected {
            true => Ok(()),
            false => Err(MotionError::Length {
                what: "the freedom of parameters",
                found,
                expected,
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_frozen_keeps_its_bits_and_ranges_are_not_left() {
        let freedom = Freedom::all(4).with_frozen(0).with_range(1, -0.0, 0.3);
        let freedom = freedom.with_range(2, 1.0, 2.0);
        let q = [f64::NAN, 0.1, 5.0, -0.0];
        let moved = freedom.moved(&q, &[1.0, 7.0, -1.0, 0.0]);
        assert_eq!(moved[0].to_bits(), q[0].to_bits());
        assert_eq!(moved[1..3], [0.3, 4.0]);
        assert_eq!(moved[3].to_bits(), (-0.0_f64).to_bits());
        assert_eq!(freedom.room(&q)[2], [-4.0, 0.0]);
        assert_eq!(freedom.at_bounds(&q), [2]);
        assert_eq!(freedom.at_bounds(&moved), [1, 2]);
    }
}
