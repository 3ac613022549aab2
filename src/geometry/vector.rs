//! What glam's vectors lack.

use glam::DVec3;

/// The length of a vector without the underflow and overflow of the squares: gradients in the
/// far field of a Gaussian are easily as small as 1e-200 and still point the right way.
pub(crate) fn length(vector: DVec3) -> f64 {
    let plain = vector.length();
    if (1e-150..1e150).contains(&plain) {
        // The squares that matter were normal numbers.
        return plain;
    }
    let largest = vector.abs().max_element();
    if largest == 0.0 || !largest.is_finite() {
        return largest;
    }
    largest * (vector / largest).length()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_survive_tiny_and_huge_components() {
        // 3, 4, 5 times powers of two, so that nothing is rounded.
        for scale in [2.0_f64.powi(-700), 1.0, 2.0_f64.powi(700)] {
            let vector = DVec3::new(0.0, 3.0 * scale, -4.0 * scale);
            assert_eq!(length(vector), 5.0 * scale);
        }
        assert_eq!(length(DVec3::ZERO), 0.0);
    }
}
