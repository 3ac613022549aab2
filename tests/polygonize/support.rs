//! Fields given by closures, for the tests of the polygonizers.

use glam::DVec3;
use imp::engine::{Field, Monitor};
use imp::geometry::{Bounds, Curves, Mesh};
use imp::polygonize::{Method, Options, PolygonizeError, Shape, Statistics, polygonize};

/// A field whose closure returns F and F_x at a point.
pub(crate) struct Closure<F> {
    pub(crate) dimension: usize,
    pub(crate) function: F,
}

impl<F: Fn(DVec3) -> (f64, DVec3) + Send + Sync> Field for Closure<F> {
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn parameters(&self) -> &[f64] {
        &[]
    }

    fn values(&self, points: &[&[f64]], values: &mut [f64]) {
        for (index, value) in values.iter_mut().enumerate() {
            *value = (self.function)(point(points, index)).0;
        }
    }

    fn gradients(&self, points: &[&[f64]], values: &mut [f64], gradients: &mut [&mut [f64]]) {
        for (index, value) in values.iter_mut().enumerate() {
            let (here, gradient) = (self.function)(point(points, index));
            *value = here;
            for (axis, column) in gradients.iter_mut().enumerate() {
                column[index] = gradient[axis];
            }
        }
    }

    fn parameter_gradients(
        &self,
        points: &[&[f64]],
        values: &mut [f64],
        gradients: &mut [&mut [f64]],
        _parameter_gradients: &mut [&mut [f64]],
    ) {
        self.gradients(points, values, gradients);
    }
}

fn point(columns: &[&[f64]], index: usize) -> DVec3 {
    let mut point = DVec3::ZERO;
    for (axis, column) in columns.iter().enumerate() {
        point[axis] = column[index];
    }
    point
}

/// The box with the same side along every axis.
pub(crate) fn cube(dimension: usize, low: f64, high: f64) -> Bounds {
    Bounds::from_sides(&vec![(low, high); dimension]).unwrap()
}

/// A level set by one method, as what that method makes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Made<T> {
    pub(crate) shape: T,
    pub(crate) statistics: Statistics,
}

/// What a method makes of a field, taken out of the [`Shape`] by `take`.
pub(crate) fn made<T>(
    field: &dyn Field,
    (method, options): (Method, &Options),
    monitor: &dyn Monitor,
    take: impl Fn(Shape) -> Option<T>,
) -> Result<Made<T>, PolygonizeError> {
    let options = Options {
        method: Some(method),
        ..options.clone()
    };
    let found = polygonize(field, &options, monitor)?;
    assert_eq!(found.method, method);
    Ok(Made {
        shape: take(found.shape).expect("the kind of shape of the dimension"),
        statistics: found.statistics,
    })
}

/// The mesh that a method makes.
pub(crate) fn mesh(
    field: &dyn Field,
    (method, options): (Method, &Options),
    monitor: &dyn Monitor,
) -> Result<Made<Mesh>, PolygonizeError> {
    made(field, (method, options), monitor, |shape| match shape {
        Shape::Mesh(mesh) => Some(mesh),
        _ => None,
    })
}

/// The curves that a method makes.
pub(crate) fn curves(
    field: &dyn Field,
    (method, options): (Method, &Options),
    monitor: &dyn Monitor,
) -> Result<Made<Curves>, PolygonizeError> {
    made(field, (method, options), monitor, |shape| match shape {
        Shape::Curves(curves) => Some(curves),
        _ => None,
    })
}

/// The usual options, but for surfaces that are left open where the box cuts them.
pub(crate) fn open(bounds: Bounds) -> Options {
    Options {
        cap: false,
        ..Options::new(bounds)
    }
}
