//! Compensated summation, so that measures of large meshes keep their digits.

/// A running sum with Neumaier's correction: the error does not grow with the number of terms
/// as long as they do not cancel to many orders below their magnitude.
///
/// A. Neumaier, "Rundungsfehleranalyse einiger Verfahren zur Summation endlicher Summen",
/// ZAMM 54 (1974), algorithm IV.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CompensatedSum {
    sum: f64,
    correction: f64,
}

impl CompensatedSum {
    /// Adds one term.
    pub(super) fn add(&mut self, term: f64) {
        let sum = self.sum + term;
        self.correction += if self.sum.abs() >= term.abs() {
            (self.sum - sum) + term
        } else {
            (term - sum) + self.sum
        };
        self.sum = sum;
    }

    /// The corrected sum.
    pub(super) fn value(self) -> f64 {
        // Once the sum has overflowed the correction is NaN and says nothing.
        if self.sum.is_finite() {
            self.sum + self.correction
        } else {
            self.sum
        }
    }
}

/// The compensated sum of the terms, in their order.
pub(super) fn sum(terms: impl IntoIterator<Item = f64>) -> f64 {
    let mut total = CompensatedSum::default();
    for term in terms {
        total.add(term);
    }
    total.value()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_terms_beside_a_large_one_are_not_lost() {
        assert_eq!(sum([1.0, 1e100, 1.0, -1e100]), 2.0);
    }

    #[test]
    fn ten_million_tenths_make_a_million() {
        // The rounding of 0.1 itself contributes less than half a unit in the last place.
        let total = sum(std::iter::repeat_n(0.1, 10_000_000));
        assert_eq!(total, 1e6);
    }

    #[test]
    fn infinity_and_nan_pass_through() {
        assert_eq!(sum([1.0, f64::INFINITY, 1.0]), f64::INFINITY);
        assert!(sum([1.0, f64::NAN]).is_nan());
        assert_eq!(sum([]), 0.0);
    }
}
