//! What particles ask of a field: h and ∇h, at one place or at many in one call.
//!
//! The methods think in single particles; the field is evaluated in batches of columns. This
//! file is the seam between the two.

use crate::geometry::length;
use glam::DVec3;

use crate::engine::Field;

/// h and ∇h at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Evaluation {
    /// h
    pub(super) value: f64,
    /// ∇h; components beyond the dimension are 0.
    pub(super) gradient: DVec3,
}

impl Evaluation {
    /// Whether the point can be used: h is finite and so is ∇h, which does not matter where h
    /// is 0 because the point lies on the surface already.
    pub(super) fn is_defined(&self) -> bool {
        self.value == 0.0 || (self.value.is_finite() && self.gradient.is_finite())
    }

    /// |h| / |∇h|: the first-order distance to the surface. It is 0 where h is 0, even if the
    /// gradient vanishes there, and infinite where the gradient alone vanishes.
    pub(super) fn distance(&self) -> f64 {
        if self.value == 0.0 {
            0.0
        } else {
            self.value.abs() / length(self.gradient)
        }
    }

    /// ∇h / |∇h|, or 0 where the gradient vanishes or is undefined.
    pub(super) fn normal(&self) -> DVec3 {
        let slope = length(self.gradient);
        if slope > 0.0 && slope.is_finite() {
            self.gradient / slope
        } else {
            DVec3::ZERO
        }
    }
}

/// Columns for evaluating a field at many points in one call, kept from one call to the next.
#[derive(Default)]
pub(super) struct Batch {
    points: [Vec<f64>; 3],
    values: Vec<f64>,
    gradients: [Vec<f64>; 3],
}

impl Batch {
    /// Evaluates the field at the points and hands back one evaluation per point, in order.
    pub(super) fn evaluate(
        &mut self,
        field: &dyn Field,
        points: impl Iterator<Item = DVec3>,
    ) -> impl Iterator<Item = Evaluation> {
        let dimension = field.dimension();
        self.points.iter_mut().for_each(Vec::clear);
        for point in points {
            for axis in 0..dimension {
                self.points[axis].push(point[axis]);
            }
        }
        let count = self.points[0].len();
        self.values.resize(count, 0.0);
        for axis in 0..dimension {
            self.gradients[axis].resize(count, 0.0);
        }
        let [x, y, z] = &self.points;
        let [along_x, along_y, along_z] = &mut self.gradients;
        field.gradients(
            &[&x[..], &y[..], &z[..]][..dimension],
            &mut self.values,
            &mut [&mut along_x[..], &mut along_y[..], &mut along_z[..]][..dimension],
        );
        (0..count).map(move |i| {
            let component = |axis: usize| {
                if axis < dimension {
                    self.gradients[axis][i]
                } else {
                    0.0
                }
            };
            Evaluation {
                value: self.values[i],
                gradient: DVec3::new(component(0), component(1), component(2)),
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_distance_is_zero_where_the_value_is_zero_and_infinite_where_only_the_gradient_is() {
        let at = |value, gradient| Evaluation { value, gradient }.distance();
        assert_eq!(at(0.0, DVec3::ZERO), 0.0);
        assert_eq!(at(1e-9, DVec3::ZERO), f64::INFINITY);
        assert_eq!(at(-6.0, DVec3::X * 2.0), 3.0);
    }

    #[test]
    fn nan_and_infinity_are_undefined_except_beside_a_zero_value() {
        let defined = |value, gradient| Evaluation { value, gradient }.is_defined();
        assert!(!defined(f64::NAN, DVec3::X));
        assert!(!defined(f64::INFINITY, DVec3::X));
        assert!(!defined(1.0, DVec3::NAN));
        assert!(defined(0.0, DVec3::NAN));
        assert!(defined(1.0, DVec3::X));
    }
}
