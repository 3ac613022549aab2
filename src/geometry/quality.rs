//! The shape of the triangles of a mesh: how far from equilateral, how sharp their angles.

use glam::DVec3;
use rayon::iter::{IndexedParallelIterator, IntoParallelRefIterator, ParallelIterator};

use super::Mesh;
use super::summation::sum;
use crate::math::scalar::atan2;

/// The shape of the triangles of a mesh, the worst and the usual. Made by [`Mesh::quality`].
///
/// The radius ratio of a triangle is 2·r/R, twice the radius of the inscribed circle by that of the
/// circumscribed one: 1 for an equilateral triangle, 0 for one without area. Quantiles lie between
/// the two nearest values, in proportion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// The least radius ratio.
    pub worst_ratio: f64,
    /// One triangle in a hundred has a smaller radius ratio.
    pub hundredth_ratio: f64,
    /// Half of the triangles have a smaller radius ratio.
    pub median_ratio: f64,
    /// The mean of the radius ratios.
    pub mean_ratio: f64,
    /// The smallest angle of all, in degrees.
    pub smallest_angle: f64,
    /// The median of the triangles' smallest angles, in degrees.
    pub median_smallest_angle: f64,
    /// The largest angle of all, in degrees.
    pub largest_angle: f64,
    /// The share of triangles with an angle below 20°, from 0 to 1.
    pub sharp: f64,
    /// Triangles without area, or with less than rounding leaves: their height is below 2e-14 of
    /// their longest side. Ratio and smallest angle count as 0, the largest angle as 180°. So do
    /// those with positions that are not finite.
    pub degenerate: usize,
    /// The shortest side.
    pub shortest_edge: f64,
    /// The longest side.
    pub longest_edge: f64,
}

/// The shape of one triangle. Angles are compared by their cotangents, which have all digits also
/// near 0° and 180°, and fall as angles grow.
#[derive(Clone, Copy)]
struct Shape {
    ratio: f64,
    /// The cotangent of the smallest angle.
    sharpest: f64,
    /// The cotangent of the largest angle.
    bluntest: f64,
    shortest_edge: f64,
    longest_edge: f64,
}

/// cot 20°
const SHARP: f64 = 2.747_477_419_454_622;

impl Mesh {
    /// The shape of the triangles; `None` if there are none.
    ///
    /// Costs O(n), in parallel, and 40 bytes a triangle.
    pub fn quality(&self) -> Option<Quality> {
        let corners = |triangle: &[u32; 3]| triangle.map(|vertex| self.positions[vertex as usize]);
        let shapes = self.triangles.par_iter().with_min_len(1 << 12);
        let shapes: Vec<Shape> = shapes.map(|triangle| shape(corners(triangle))).collect();
        if shapes.is_empty() {
            return None;
        }
        let column = |part: fn(&Shape) -> f64| shapes.iter().map(part).collect::<Vec<f64>>();
        let mut ratios = column(|shape| shape.ratio);
        let mut sharpest = column(|shape| shape.sharpest);
        let count = shapes.len() as f64;
        let matching = |test: fn(&&Shape) -> bool| shapes.iter().filter(test).count();
        let least = |part: fn(&Shape) -> f64| shapes.iter().map(part).fold(f64::INFINITY, f64::min);
        let greatest =
            |part: fn(&Shape) -> f64| shapes.iter().map(part).fold(f64::NEG_INFINITY, f64::max);
        Some(Quality {
            worst_ratio: least(|shape| shape.ratio),
            mean_ratio: sum(ratios.iter().copied()) / count,
            hundredth_ratio: quantile(&mut ratios, 0.01),
            median_ratio: quantile(&mut ratios, 0.5),
            smallest_angle: degrees(greatest(|shape| shape.sharpest)),
            median_smallest_angle: degrees(quantile(&mut sharpest, 0.5)),
            largest_angle: degrees(least(|shape| shape.bluntest)),
            sharp: matching(|shape| shape.sharpest > SHARP) as f64 / count,
            degenerate: matching(|shape| shape.ratio == 0.0),
            shortest_edge: least(|shape| shape.shortest_edge),
            longest_edge: greatest(|shape| shape.longest_edge),
        })
    }
}

/// The radius ratio 2·r/R of a triangle: 1 if it is equilateral, 0 if it is degenerate.
pub(super) fn radius_ratio(corners: [DVec3; 3]) -> f64 {
    shape(corners).ratio
}

fn shape([a, b, c]: [DVec3; 3]) -> Shape {
    let edges = [c - b, a - c, b - a];
    let lengths = edges.map(DVec3::length);
    let longest_edge = lengths.into_iter().fold(0.0, f64::max);
    let shortest_edge = lengths.into_iter().fold(f64::INFINITY, f64::min);
    // Relative to the longest side, so that squares neither overflow nor vanish; NaN fails.
    let edges = edges.map(|edge| edge / longest_edge);
    let height = edges[0].cross(edges[1]).length();
    if !(height >= 2e-14 && height.is_finite()) {
        return Shape {
            ratio: 0.0,
            sharpest: f64::INFINITY,
            bluntest: f64::NEG_INFINITY,
            shortest_edge,
            longest_edge,
        };
    }
    // 2 r / R = 16 A² / (a b c (a + b + c)).
    let [p, q, r] = lengths.map(|length| length / longest_edge);
    let ratio = 4.0 * height * height / (p * q * r * (p + q + r));
    let cotangent = |k: usize| -edges[(k + 1) % 3].dot(edges[(k + 2) % 3]) / height;
    let cotangents = [0, 1, 2].map(cotangent);
    Shape {
        ratio,
        sharpest: cotangents.into_iter().fold(f64::NEG_INFINITY, f64::max),
        bluntest: cotangents.into_iter().fold(f64::INFINITY, f64::min),
        shortest_edge,
        longest_edge,
    }
}

/// The value below which this share of the values lies; between two values in proportion.
pub(super) fn quantile(values: &mut [f64], share: f64) -> f64 {
    let place = share * values.len().saturating_sub(1) as f64;
    let (_, &mut low, above) = values.select_nth_unstable_by(place as usize, f64::total_cmp);
    let high = above.iter().copied().min_by(f64::total_cmp);
    let part = place.fract();
    match high {
        // Infinite values have no proportion.
        Some(high) if part > 0.0 && low != high => low + part * (high - low),
        _ => low,
    }
}

/// The angle between 0 and 180 with this cotangent.
fn degrees(cotangent: f64) -> f64 {
    if cotangent.is_infinite() {
        return if cotangent > 0.0 { 0.0 } else { 180.0 };
    }
    atan2(1.0, cotangent).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::super::test_meshes::{cube, mesh, octahedron};
    use super::*;

    fn of_triangle(corners: [[f64; 3]; 3]) -> Quality {
        mesh(&corners, &[[0, 1, 2]]).quality().unwrap()
    }

    fn assert_close(value: f64, expected: f64) {
        assert!(
            (value - expected).abs() <= 1e-13 * expected.abs().max(1.0),
            "{value} is not {expected}"
        );
    }

    #[test]
    fn equilateral_triangles_are_the_best() {
        let quality = octahedron().quality().unwrap();
        for ratio in [
            quality.worst_ratio,
            quality.hundredth_ratio,
            quality.median_ratio,
            quality.mean_ratio,
        ] {
            assert_close(ratio, 1.0);
        }
        assert_close(quality.smallest_angle, 60.0);
        assert_close(quality.median_smallest_angle, 60.0);
        assert_close(quality.largest_angle, 60.0);
        assert_close(quality.longest_edge, 2f64.sqrt());
        assert_eq!((quality.sharp, quality.degenerate), (0.0, 0));
    }

    #[test]
    fn right_triangles_have_their_closed_form() {
        // Legs 1 and 1: r = 1 − √2/2, R = √2/2, so 2 r/R = 2√2 − 2.
        let quality = cube(3.0, DVec3::ZERO).quality().unwrap();
        assert_close(quality.worst_ratio, 8f64.sqrt() - 2.0);
        assert_close(quality.mean_ratio, 8f64.sqrt() - 2.0);
        assert_close(quality.smallest_angle, 45.0);
        assert_close(quality.largest_angle, 90.0);
        assert_close(quality.shortest_edge, 3.0);
        assert_close(quality.longest_edge, 3.0 * 2f64.sqrt());
        // 3, 4, 5: r = 1, R = 5/2.
        let quality = of_triangle([[0.0; 3], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0]]);
        assert_close(quality.worst_ratio, 0.8);
        assert_close(quality.smallest_angle, 0.75f64.atan().to_degrees());
    }

    #[test]
    fn angles_below_twenty_degrees_are_sharp() {
        let with_angle = |degrees: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            of_triangle([[0.0; 3], [1.0, 0.0, 0.0], [cos, sin, 0.0]])
        };
        assert_eq!(with_angle(19.999_999).sharp, 1.0);
        assert_eq!(with_angle(20.000_001).sharp, 0.0);
        // The angle is as exact as its corners.
        assert_close(with_angle(1e-6).smallest_angle / 1e-6, 1.0);
        assert_close(with_angle(120.0).largest_angle, 120.0);
    }

    #[test]
    fn triangles_without_area_are_degenerate() {
        for corners in [
            [[0.0; 3], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]],
            [[1.0; 3]; 3],
            [[0.0; 3], [1.0, 0.0, 0.0], [0.5, 1e-15, 0.0]],
            [[0.0; 3], [1.0, 0.0, 0.0], [0.0, f64::NAN, 0.0]],
        ] {
            let quality = of_triangle(corners);
            assert_eq!(quality.degenerate, 1);
            assert_eq!(quality.worst_ratio, 0.0);
            assert_eq!(quality.smallest_angle, 0.0);
            assert_eq!(quality.largest_angle, 180.0);
            assert_eq!(quality.sharp, 1.0);
        }
        assert_eq!(Mesh::default().quality(), None);
    }

    #[test]
    fn quality_does_not_depend_on_the_scale() {
        let scaled = |scale: f64| {
            let corners = [[0.0; 3], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
            of_triangle(corners.map(|corner| corner.map(|x| x * scale))).worst_ratio
        };
        assert_close(scaled(1e100), 0.8);
        assert_close(scaled(1e-100), 0.8);
    }

    #[test]
    fn quantiles_lie_between_the_nearest_values() {
        let mut values: Vec<f64> = (0..=200).rev().map(f64::from).collect();
        assert_eq!(quantile(&mut values, 0.0), 0.0);
        assert_eq!(quantile(&mut values, 0.01), 2.0);
        assert_eq!(quantile(&mut values, 0.5), 100.0);
        assert_eq!(quantile(&mut values, 1.0), 200.0);
        assert_eq!(quantile(&mut [1.0, 5.0], 0.25), 2.0);
        assert_eq!(quantile(&mut [f64::INFINITY; 2], 0.5), f64::INFINITY);
    }
}
