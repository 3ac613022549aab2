//! Quadric errors: weighted sums of squared distances from planes, as a quadratic form of the point.
//!
//! M. Garland, P. S. Heckbert, "Surface Simplification Using Quadric Error Metrics", SIGGRAPH 97,
//! section 5, with areas as weights.

use glam::{DMat3, DVec3};

/// Q(p) = pᵀ A p + 2 b·p + c = Σ wᵢ (nᵢ·(p − oᵢ))².
#[derive(Clone, Copy, Debug)]
pub(super) struct Quadric {
    matrix: DMat3,
    vector: DVec3,
    constant: f64,
    /// Σ wᵢ
    pub(super) weight: f64,
}

impl Quadric {
    /// The sum over no planes.
    pub(super) const NONE: Quadric = Quadric {
        matrix: DMat3::ZERO,
        vector: DVec3::ZERO,
        constant: 0.0,
        weight: 0.0,
    };

    /// The squared distance from the plane through a point with this unit normal, times a weight.
    pub(super) fn of_plane(point: DVec3, normal: DVec3, weight: f64) -> Quadric {
        let offset = normal.dot(point);
        let outer = DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z);
        Quadric {
            matrix: outer * weight,
            vector: normal * (-offset * weight),
            constant: offset * offset * weight,
            weight,
        }
    }

    /// Both sums together.
    pub(super) fn plus(&self, other: &Quadric) -> Quadric {
        Quadric {
            matrix: self.matrix + other.matrix,
            vector: self.vector + other.vector,
            constant: self.constant + other.constant,
            weight: self.weight + other.weight,
        }
    }

    /// Q(p), at least 0: rounding may leave less.
    pub(super) fn at(&self, point: DVec3) -> f64 {
        let value = point.dot(self.matrix * point + 2.0 * self.vector) + self.constant;
        value.max(0.0)
    }

    /// The root of the weighted mean of the squared distances at p.
    pub(super) fn error_at(&self, point: DVec3) -> f64 {
        if self.weight > 0.0 {
            (self.at(point) / self.weight).sqrt()
        } else {
            0.0
        }
    }

    /// The point with the least Q, and where Q says nothing, along a plane or an edge, the nearest
    /// such point to `near`. `None` if there are no planes.
    pub(super) fn minimum(&self, near: DVec3) -> Option<DVec3> {
        // Distances from `near` have a small weight of their own. What Q does say counts 1e9 times
        // as much; curvature that is weaker than that does not matter.
        const PULL: f64 = 1e-9;
        let pull = PULL * self.weight;
        let regular = self.matrix + DMat3::from_diagonal(DVec3::splat(pull));
        let slope = self.matrix * near + self.vector;
        let point = near - regular.try_inverse()? * slope;
        (self.weight > 0.0 && point.is_finite()).then_some(point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_planes_meet_in_the_minimum() {
        let corner = DVec3::new(1.0, -2.0, 3.0);
        let normals = [DVec3::X, DVec3::new(0.6, 0.8, 0.0), DVec3::ONE.normalize()];
        let quadric = normals.iter().fold(Quadric::NONE, |sum, &normal| {
            sum.plus(&Quadric::of_plane(corner, normal, 0.5))
        });
        let point = quadric.minimum(corner + DVec3::splat(0.1)).unwrap();
        assert!(point.distance(corner) < 1e-8);
        // One unit along x: distances 1, 0.6 and 1/√3.
        let expected = 0.5 * (1.0 + 0.36 + 1.0 / 3.0);
        assert!((quadric.at(corner + DVec3::X) - expected).abs() < 1e-14);
        assert!((quadric.error_at(corner + DVec3::X) - (expected / 1.5).sqrt()).abs() < 1e-14);
    }

    #[test]
    fn along_planes_and_edges_the_nearest_point_is_taken() {
        let plane = Quadric::of_plane(DVec3::ZERO, DVec3::Z, 2.0);
        let near = DVec3::new(3.0, 4.0, 5.0);
        let on_plane = plane.minimum(near).unwrap();
        assert!(on_plane.distance(DVec3::new(3.0, 4.0, 0.0)) < 1e-7);
        let edge = plane.plus(&Quadric::of_plane(DVec3::ZERO, DVec3::Y, 1.0));
        let on_edge = edge.minimum(near).unwrap();
        assert!(on_edge.distance(DVec3::new(3.0, 0.0, 0.0)) < 1e-7);
        assert_eq!(Quadric::NONE.minimum(near), None);
    }
}
