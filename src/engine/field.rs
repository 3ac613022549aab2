//! The waist of the program: all that samplers and polygonizers know of a field.

use glam::DVec3;

use super::CompiledField;

/// A function F(x, q) with its present q, ready to be evaluated.
///
/// Points are given in structure-of-arrays form, one slice of equal length per axis
/// (`dimension()` of them). Values follow IEEE 754 point by point: NaN where F is undefined.
/// Results do not depend on how points are grouped into batches.
pub trait Field: Send + Sync {
    /// The number of coordinates: 1, 2 or 3.
    fn dimension(&self) -> usize;

    /// The present q: the parameters that F depends on.
    fn parameters(&self) -> &[f64];

    /// F at every point.
    fn values(&self, points: &[&[f64]], values: &mut [f64]);

    /// F and F_x at every point; `gradients` has one slice per axis.
    fn gradients(&self, points: &[&[f64]], values: &mut [f64], gradients: &mut [&mut [f64]]);

    /// F, F_x and F_q at every point; `parameter_gradients` has one slice per parameter.
    fn parameter_gradients(
        &self,
        points: &[&[f64]],
        values: &mut [f64],
        gradients: &mut [&mut [f64]],
        parameter_gradients: &mut [&mut [f64]],
    );

    /// The compiled field that this is, where it is one: enclosures over boxes can be had of it, so
    /// that something can be proven of the whole zero set.
    fn compiled(&self) -> Option<&CompiledField> {
        None
    }

    /// F at one point; coordinates beyond the dimension are ignored.
    fn value(&self, point: DVec3) -> f64 {
        let mut value = [0.0];
        with_columns(point, self.dimension(), |columns| {
            self.values(columns, &mut value)
        });
        value[0]
    }

    /// F and F_x at one point; components beyond the dimension are 0.
    fn value_gradient(&self, point: DVec3) -> (f64, DVec3) {
        let mut value = [0.0];
        let [mut x, mut y, mut z] = [[0.0]; 3];
        with_columns(point, self.dimension(), |columns| {
            let mut gradients = [&mut x[..], &mut y[..], &mut z[..]];
            self.gradients(columns, &mut value, &mut gradients[..self.dimension()]);
        });
        (value[0], DVec3::new(x[0], y[0], z[0]))
    }
}

/// One point as columns of length one.
fn with_columns(point: DVec3, dimension: usize, evaluate: impl FnOnce(&[&[f64]])) {
    let [x, y, z] = [[point.x], [point.y], [point.z]];
    let columns = [&x[..], &y[..], &z[..]];
    evaluate(&columns[..dimension]);
}
