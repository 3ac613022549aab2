//! Solids with known volumes, as fields.

use glam::DVec3;

use imp::engine::Field;
use imp::geometry::Bounds;

/// A field that is a plain function with a gradient.
pub(crate) struct Solid {
    dimension: usize,
    function: Box<dyn Fn(DVec3) -> (f64, DVec3) + Send + Sync>,
}

impl Field for Solid {
    fn dimension(&self) -> usize {
        self.dimension
    }

    fn parameters(&self) -> &[f64] {
        &[]
    }

    fn values(&self, points: &[&[f64]], values: &mut [f64]) {
        for (place, value) in values.iter_mut().enumerate() {
            *value = (self.function)(point(points, place)).0;
        }
    }

    fn gradients(&self, points: &[&[f64]], values: &mut [f64], gradients: &mut [&mut [f64]]) {
        for (place, value) in values.iter_mut().enumerate() {
            let (result, gradient) = (self.function)(point(points, place));
            *value = result;
            for (axis, slopes) in gradients.iter_mut().enumerate() {
                slopes[place] = gradient[axis];
            }
        }
    }

    fn parameter_gradients(
        &self,
        points: &[&[f64]],
        values: &mut [f64],
        gradients: &mut [&mut [f64]],
        _: &mut [&mut [f64]],
    ) {
        self.gradients(points, values, gradients);
    }
}

fn point(points: &[&[f64]], place: usize) -> DVec3 {
    let coordinate = |axis: usize| points.get(axis).map_or(0.0, |column| column[place]);
    DVec3::from_array([0, 1, 2].map(coordinate))
}

pub(crate) fn solid(
    dimension: usize,
    function: impl Fn(DVec3) -> (f64, DVec3) + Send + Sync + 'static,
) -> Solid {
    Solid {
        dimension,
        function: Box::new(function),
    }
}

/// |x|² − r²: not a distance. In the plane a disk.
pub(crate) fn ball(dimension: usize, radius: f64) -> Solid {
    solid(dimension, move |p| {
        (p.length_squared() - radius * radius, 2.0 * p)
    })
}

/// max |x_i| − a_i: gradients jump at edges. In the plane a rectangle.
pub(crate) fn cuboid(dimension: usize, half: DVec3) -> Solid {
    solid(dimension, move |p| {
        let excess = p.abs() - half;
        let axis = (0..dimension)
            .max_by(|&a, &b| excess[a].total_cmp(&excess[b]))
            .unwrap();
        let mut gradient = DVec3::ZERO;
        gradient[axis] = p[axis].signum();
        (excess[axis], gradient)
    })
}

/// The distance from a torus around the third axis.
pub(crate) fn torus(large: f64, small: f64) -> Solid {
    solid(3, move |p| {
        let around = p.truncate().length();
        let away = DVec3::new(around - large, p.z, 0.0);
        let distance = away.length();
        let out = p.truncate() / around;
        let gradient = (out * away.x / distance).extend(p.z / distance);
        (distance - small, gradient)
    })
}

pub(crate) fn cube(dimension: usize, half: f64) -> Bounds {
    Bounds::from_sides(&vec![(-half, half); dimension]).unwrap()
}
