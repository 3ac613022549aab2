//! Simplices: triangles in the plane and tetrahedra in space, one by one and many together.

use glam::DVec3;

/// The faces of a tetrahedron, by its corners.
const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// The signed volume of a tetrahedron, or the signed area of a triangle, whose last corner is
/// repeated.
pub fn simplex_measure(dimension: usize, [a, b, c, d]: [DVec3; 4]) -> f64 {
    match dimension {
        2 => 0.5 * (b - a).cross(c - a).z,
        _ => (b - a).dot((c - a).cross(d - a)) / 6.0,
    }
}

/// The radius ratio of a tetrahedron, or of a triangle whose last corner is repeated: the dimension
/// times the radius of the inscribed sphere by that of the circumscribed one. 1 for the regular
/// simplex, 0 for a flat one, negative for one that is turned over.
pub fn radius_ratio(dimension: usize, corners: [DVec3; 4]) -> f64 {
    let measure = simplex_measure(dimension, corners);
    let [a, b, c] = [1, 2, 3].map(|corner: usize| corners[corner] - corners[0]);
    let ratio = if dimension == 2 {
        // 2 r / R with r = 2 A / (sum of sides) and R = (product of sides) / 4 A.
        let [a, b, c] = [(b - a).length(), b.length(), a.length()];
        16.0 * measure * measure.abs() / ((a + b + c) * a * b * c)
    } else {
        // 3 r / R with r = 3 V / S, R = |Σ a² (b × c)| / 12 V for edges a, b, c from one corner.
        let vector = a.length_squared() * b.cross(c)
            + b.length_squared() * c.cross(a)
            + c.length_squared() * a.cross(b);
        let area = |[i, j, k]: [usize; 3]| {
            0.5 * (corners[j] - corners[i])
                .cross(corners[k] - corners[i])
                .length()
        };
        let areas: f64 = FACES.map(area).iter().sum();
        108.0 * measure * measure.abs() / (areas * vector.length())
    };
    if ratio.is_nan() { 0.0 } else { ratio }
}

/// A solid as tetrahedra, or a plane figure as triangles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Solid {
    /// 2 or 3.
    pub dimension: usize,
    /// The nodes.
    pub nodes: Vec<DVec3>,
    /// The nodes of each simplex, positively oriented; a triangle repeats its last node.
    pub simplices: Vec<[u32; 4]>,
}

impl Solid {
    /// The places of a simplex's corners.
    pub fn corners(&self, simplex: [u32; 4]) -> [DVec3; 4] {
        simplex.map(|node| self.nodes[node as usize])
    }

    /// The radius ratios of all simplices, ascending.
    pub fn radius_ratios(&self) -> Vec<f64> {
        let simplices = self.simplices.iter();
        let mut ratios: Vec<f64> = simplices
            .map(|&simplex| radius_ratio(self.dimension, self.corners(simplex)))
            .collect();
        ratios.sort_unstable_by(f64::total_cmp);
        ratios
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regular_simplices_have_the_ratio_1_and_right_ones_that_of_their_radii() {
        let regular = [[1, 1, 1], [-1, 1, -1], [1, -1, -1], [-1, -1, 1]];
        let regular = regular.map(|corner| DVec3::from_array(corner.map(f64::from)));
        assert!((radius_ratio(3, regular) - 1.0).abs() < 1e-14);
        let [a, b, c, d] = regular;
        assert!((radius_ratio(3, [b, a, c, d]) + 1.0).abs() < 1e-14);
        // The corner of a cube: r = 1/(3 + √3), R = √3/2.
        let corner = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let root = 3f64.sqrt();
        assert!((radius_ratio(3, corner) - 3.0 / (3.0 + root) / (root / 2.0)).abs() < 1e-14);
        // The half of a square: r = 1/(2 + √2), R = √2/2.
        let half = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Y];
        let root = 2f64.sqrt();
        assert!((radius_ratio(2, half) - 2.0 / (2.0 + root) / (root / 2.0)).abs() < 1e-14);
        assert_eq!(radius_ratio(3, [DVec3::ZERO; 4]), 0.0);
    }
}
