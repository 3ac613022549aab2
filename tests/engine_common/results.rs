//! What a field's kernels compute, in columns.

use super::expressions::same;
use imp::engine::{CompiledField, Field};

/// F, F_x and F_q in columns.
pub(crate) struct Results {
    pub(crate) value: Vec<f64>,
    pub(crate) gradient: Vec<Vec<f64>>,
    pub(crate) parameter_gradient: Vec<Vec<f64>>,
}

impl Results {
    /// From the three kernels, which must agree on what they have in common.
    pub(crate) fn of(field: &CompiledField, points: &[Vec<f64>; 3]) -> Results {
        let count = points[0].len();
        let columns = points.each_ref().map(|column| &column[..]);
        let zeros = |number: usize| vec![vec![0.0; count]; number];
        let mut alone = vec![0.0; count];
        field.values(&columns, &mut alone);
        let (mut value, mut gradient) = (vec![0.0; count], zeros(3));
        field.gradients(&columns, &mut value, &mut slices(&mut gradient));
        assert_same(&alone, &value, "values alone and with F_x");
        let mut results = Results {
            value: vec![0.0; count],
            gradient: zeros(3),
            parameter_gradient: zeros(field.parameters().len()),
        };
        field.parameter_gradients(
            &columns,
            &mut results.value,
            &mut slices(&mut results.gradient),
            &mut slices(&mut results.parameter_gradient),
        );
        assert_same(&value, &results.value, "values with F_x and with F_q");
        for (alone, together) in gradient.iter().zip(&results.gradient) {
            assert_same(alone, together, "F_x alone and with F_q");
        }
        results
    }

    /// All columns.
    pub(crate) fn columns(&self) -> impl Iterator<Item = &Vec<f64>> {
        let derivatives = self.gradient.iter().chain(&self.parameter_gradient);
        std::iter::once(&self.value).chain(derivatives)
    }
}

fn slices(columns: &mut [Vec<f64>]) -> Vec<&mut [f64]> {
    columns.iter_mut().map(|column| &mut column[..]).collect()
}

pub(crate) fn assert_same(a: &[f64], b: &[f64], what: &str) {
    for (index, (&a, &b)) in a.iter().zip(b).enumerate() {
        assert!(
            same(a, b),
            "{what} differ at point {index}: {a:e} and {b:e}"
        );
    }
}
