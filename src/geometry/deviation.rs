//! How far a mesh is from the surface F = 0 that it stands for, to first order: distances
//! |F| / |F_x| and the angles between facets and the surface. Whoever knows F gives its values.

use glam::DVec3;
use rayon::iter::{IndexedParallelIterator, IntoParallelRefIterator, ParallelIterator};

use super::summation::sum;
use super::{Bounds, Mesh};
use crate::math::scalar::atan2;

/// F and F_x at points.
#[derive(Clone, Debug, Default)]
pub struct FieldValues {
    /// F.
    pub values: Vec<f64>,
    /// F_x, as many.
    pub gradients: Vec<DVec3>,
}

/// How far a mesh is from a surface F = 0. Made by [`Mesh::deviation`].
///
/// Points at which F or F_x is not finite, or F_x is 0, have no distance to first order; they are
/// counted and left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Distances of the vertices.
    pub vertices: Distances,
    /// Distances of the centres of the facets.
    pub facets: Distances,
    /// The greatest angle between the normal of a facet and F_x at its centre, in degrees.
    pub largest_normal_deviation: f64,
    /// The mean of these angles, in degrees.
    pub mean_normal_deviation: f64,
    /// Facets whose angle is above 90°: they are turned over.
    pub turned: usize,
}

/// Distances |F| / |F_x| from a surface; 0 where there are no points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distances {
    /// The greatest.
    pub max: f64,
    /// The root of the mean square.
    pub rms: f64,
    /// Points without such a distance.
    pub undefined: usize,
}

impl Mesh {
    /// The centres of the facets, in their order.
    pub fn facet_centers(&self) -> Vec<DVec3> {
        self.corners().map(|[a, b, c]| (a + b + c) / 3.0).collect()
    }

    /// The facets that do not lie in a side of a box, with their vertices, and how many do: caps,
    /// which belong to the box rather than to a surface. Costs O(n).
    pub fn without_sides(&self, bounds: &Bounds) -> (Mesh, usize) {
        // Caps have the coordinates of the box but for rounding.
        let near = 1e-12 * bounds.diagonal();
        let is_in_side = |triangle: &[u32; 3]| {
            let corners = triangle.map(|vertex| self.positions[vertex as usize]);
            (0..3).any(|axis| {
                [bounds.min[axis], bounds.max[axis]].iter().any(|side| {
                    let corner_is = |corner: &DVec3| (corner[axis] - side).abs() <= near;
                    corners.iter().all(corner_is)
                })
            })
        };
        let kept = self.triangles.iter().copied();
        let kept: Vec<[u32; 3]> = kept.filter(|triangle| !is_in_side(triangle)).collect();
        let capped = self.triangles.len() - kept.len();
        let mut numbers = vec![u32::MAX; self.positions.len()];
        let mut mesh = Mesh::default();
        for triangle in kept {
            mesh.triangles.push(triangle.map(|vertex| {
                let number = &mut numbers[vertex as usize];
                if *number == u32::MAX {
                    *number = mesh.positions.len() as u32;
                    mesh.positions.push(self.positions[vertex as usize]);
                }
                *number
            }));
        }
        (mesh, capped)
    }

    /// The deviation from the surface F = 0, where F < 0 inside, from F and F_x at the vertices and
    /// at the centres of the facets. Facets without area have no normal and therefore no angle.
    ///
    /// Costs O(n), in parallel. Both fields have a value for each vertex, or each facet.
    pub fn deviation(&self, at_vertices: &FieldValues, at_centers: &FieldValues) -> Deviation {
        let facets = self.triangles.par_iter().zip(&at_centers.gradients);
        let angles: Vec<Option<f64>> = facets
            .with_min_len(1 << 12)
            .map(|(triangle, &gradient)| {
                let [a, b, c] = triangle.map(|vertex| self.positions[vertex as usize]);
                angle_between((b - a).cross(c - a), gradient)
            })
            .collect();
        let angles: Vec<f64> = angles.into_iter().flatten().map(f64::to_degrees).collect();
        Deviation {
            vertices: at_vertices.distances(),
            facets: at_centers.distances(),
            largest_normal_deviation: angles.iter().copied().fold(0.0, f64::max),
            mean_normal_deviation: sum(angles.iter().copied()) / angles.len().max(1) as f64,
            turned: angles.iter().filter(|&&angle| angle > 90.0).count(),
        }
    }
}

impl FieldValues {
    /// |F| / |F_x|, summed up.
    fn distances(&self) -> Distances {
        let pairs = self.values.iter().zip(&self.gradients);
        let distances: Vec<f64> = pairs
            .map(|(value, gradient)| value.abs() / gradient.length())
            .filter(|distance| distance.is_finite())
            .collect();
        let max = distances.iter().copied().fold(0.0, f64::max);
        let squares = distances.iter().map(|distance| distance * distance);
        Distances {
            max,
            rms: (sum(squares) / distances.len().max(1) as f64).sqrt(),
            undefined: self.values.len() - distances.len(),
        }
    }
}

/// The angle between two vectors, with all its digits also where it is small; `None` if one of them
/// has no direction.
fn angle_between(first: DVec3, second: DVec3) -> Option<f64> {
    let (first, second) = (first.try_normalize()?, second.try_normalize()?);
    Some(atan2(first.cross(second).length(), first.dot(second)))
}

#[cfg(test)]
mod tests {
    use super::super::test_meshes::{inverted, octahedron};
    use super::*;

    /// F = |p| − 1, whose |F| / |F_x| is the distance itself.
    fn of_sphere(points: &[DVec3]) -> FieldValues {
        FieldValues {
            values: points.iter().map(|p| p.length() - 1.0).collect(),
            gradients: points.iter().map(|p| p.normalize()).collect(),
        }
    }

    #[test]
    fn an_octahedron_in_the_unit_sphere_has_its_closed_form() {
        let solid = octahedron();
        let centers = of_sphere(&solid.facet_centers());
        let deviation = solid.deviation(&of_sphere(&solid.positions), &centers);
        assert_eq!(deviation.vertices, Distances::default());
        let depth = 1.0 - 1.0 / 3f64.sqrt();
        assert!((deviation.facets.max - depth).abs() < 1e-15);
        assert!((deviation.facets.rms - depth).abs() < 1e-15);
        assert!(deviation.largest_normal_deviation < 1e-7);
        assert_eq!(deviation.turned, 0);
        let turned = inverted(solid).deviation(&FieldValues::default(), &centers);
        assert_eq!(turned.turned, 8);
        assert!((turned.mean_normal_deviation - 180.0).abs() < 1e-7);
    }

    #[test]
    fn angles_and_undefined_points_are_counted() {
        let solid = octahedron();
        // The gradient (0, 0, 1) makes the same angle with all eight facets, up or down.
        let angle = (1.0 / 3f64.sqrt()).acos().to_degrees();
        let mut values = FieldValues {
            values: vec![1.0; 8],
            gradients: vec![DVec3::Z; 8],
        };
        values.gradients[5] = DVec3::ZERO;
        values.values[6] = f64::NAN;
        let deviation = solid.deviation(&FieldValues::default(), &values);
        assert_eq!(deviation.facets.undefined, 2);
        assert_eq!((deviation.facets.max, deviation.facets.rms), (1.0, 1.0));
        assert_eq!(deviation.turned, 3);
        assert!((deviation.largest_normal_deviation - (180.0 - angle)).abs() < 1e-12);
        let mean = (4.0 * angle + 3.0 * (180.0 - angle)) / 7.0;
        assert!((deviation.mean_normal_deviation - mean).abs() < 1e-12);
    }
}
