//! Lengths, areas and volumes of what comes out. Sums are compensated and taken in a fixed
//! order, so that a measure carries the digits of the mesh and is the same on every run.

use glam::DVec3;

use super::summation::{CompensatedSum, sum};
use super::{Bounds, Curves, Mesh, Polyline};

impl Mesh {
    /// The smallest box around the positions; `None` if there are none or one is not finite.
    pub fn bounds(&self) -> Option<Bounds> {
        Bounds::of_points(3, self.positions.iter().copied())
    }

    /// The total area of the triangles.
    pub fn area(&self) -> f64 {
        sum(self.corners().map(triangle_area))
    }

    /// The mean length of the sides of all triangles; 0 if there are none.
    pub fn mean_edge_length(&self) -> f64 {
        let sides = self.corners().flat_map(|[a, b, c]| [b - a, c - b, a - c]);
        sum(sides.map(DVec3::length)) / (3 * self.triangles.len().max(1)) as f64
    }

    /// The enclosed volume, by the divergence theorem: positive if the triangles are
    /// counter-clockwise seen from outside, negative if they are turned inside out.
    ///
    /// Of a mesh that is not watertight it is the volume between the triangles and the middle of
    /// the bounds, which says little. NaN if a position is not finite.
    pub fn volume(&self) -> f64 {
        // A closed mesh has the same volume about every apex; one nearby loses fewer digits.
        self.volume_from(self.apex())
    }

    /// The signed volume between the triangles and a point: that of parts of a mesh adds up to that of
    /// the whole.
    pub fn volume_from(&self, apex: DVec3) -> f64 {
        sum(self.corners().map(|corners| {
            let [a, b, c] = corners.map(|corner| corner - apex);
            a.dot(b.cross(c)) / 6.0
        }))
    }

    /// The centroid of the surface: the mean of its points, each weighted by area. `None` if the
    /// area is 0 or not finite.
    pub fn centroid(&self) -> Option<DVec3> {
        let apex = self.apex();
        let mut total = CompensatedSum::default();
        let mut moments = [CompensatedSum::default(); 3];
        for corners in self.corners() {
            let area = triangle_area(corners);
            let [a, b, c] = corners.map(|corner| corner - apex);
            let moment = area * (a + b + c) / 3.0;
            total.add(area);
            for (sum, term) in moments.iter_mut().zip(moment.to_array()) {
                sum.add(term);
            }
        }
        let area = total.value();
        let moment = DVec3::from_array(moments.map(CompensatedSum::value));
        (area > 0.0 && area.is_finite()).then(|| apex + moment / area)
    }

    /// The positions of the corners of each triangle.
    pub(super) fn corners(&self) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        self.triangles
            .iter()
            .map(|triangle| triangle.map(|vertex| self.positions[vertex as usize]))
    }

    /// A reference point near the mesh, to measure from.
    fn apex(&self) -> DVec3 {
        self.bounds().map_or(DVec3::ZERO, |bounds| bounds.center())
    }
}

fn triangle_area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

impl Curves {
    /// The smallest box around the points; `None` if there are none or one is not finite.
    pub fn bounds(&self) -> Option<Bounds> {
        let points = self.polylines.iter().flat_map(|polyline| &polyline.points);
        Bounds::of_points(self.dimension, points.copied())
    }

    /// The total length.
    pub fn length(&self) -> f64 {
        sum(self.polylines.iter().map(Polyline::length))
    }

    /// The area that the closed plane curves enclose: a curve that has the inside on its left
    /// counts positive if it is an outer border and negative if it is the border of a hole.
    /// Open curves do not count. `None` for curves in space.
    pub fn enclosed_area(&self) -> Option<f64> {
        let closed = self.polylines.iter().filter(|polyline| polyline.closed);
        (self.dimension == 2).then(|| sum(closed.map(Polyline::signed_area)))
    }

    /// The number of connected pieces.
    pub fn components(&self) -> usize {
        self.polylines.len()
    }

    /// The number of pieces that are closed.
    pub fn closed_components(&self) -> usize {
        self.polylines
            .iter()
            .filter(|polyline| polyline.closed)
            .count()
    }
}

impl Polyline {
    /// The length, the closing segment of a closed curve included.
    pub fn length(&self) -> f64 {
        let inner = self.points.windows(2).map(|ends| ends[0].distance(ends[1]));
        let closing = match self.points[..] {
            [first, .., last] if self.closed => first.distance(last),
            _ => 0.0,
        };
        sum(inner.chain([closing]))
    }

    /// The area on the left of the curve seen as closed, in the plane z = 0: positive if it runs
    /// counter-clockwise.
    pub fn signed_area(&self) -> f64 {
        let Some(&apex) = self.points.first() else {
            return 0.0;
        };
        sum(self.points.windows(2).map(|ends| {
            let (a, b) = (ends[0] - apex, ends[1] - apex);
            0.5 * (a.x * b.y - a.y * b.x)
        }))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::super::test_meshes::{
        cube, disjoint_union, disk, inverted, octahedron, tetrahedron, torus,
    };
    use super::*;

    /// A few roundings in each of a few terms.
    const ROUNDING: f64 = 1e-15;

    fn assert_close(value: f64, expected: f64, relative: f64) {
        assert!(
            (value - expected).abs() <= relative * expected.abs(),
            "{value} is not {expected}"
        );
    }

    #[test]
    fn solids_have_their_closed_form_area_and_volume() {
        let root3 = 3f64.sqrt();
        for (solid, area, volume) in [
            (cube(2.0, DVec3::ZERO), 24.0, 8.0),
            (tetrahedron(), 1.5 + root3 / 2.0, 1.0 / 6.0),
            (octahedron(), 4.0 * root3, 4.0 / 3.0),
        ] {
            assert_close(solid.area(), area, ROUNDING);
            assert_close(solid.volume(), volume, ROUNDING);
            assert_close(inverted(solid).volume(), -volume, ROUNDING);
        }
    }

    #[test]
    fn volume_keeps_its_digits_far_from_the_origin() {
        // The corners 1e6 and 1e6 + 1 are exact, so nothing but the apex decides.
        let solid = cube(1.0, DVec3::splat(1e6));
        assert_close(solid.volume(), 1.0, ROUNDING);
    }

    #[test]
    fn measures_of_disjoint_solids_add_up_and_cavities_subtract() {
        let apart = disjoint_union(
            cube(1.0, DVec3::ZERO),
            &cube(2.0, DVec3::new(5.0, 0.0, 0.0)),
        );
        assert_close(apart.area(), 30.0, ROUNDING);
        assert_close(apart.volume(), 9.0, ROUNDING);
        let hollow = disjoint_union(cube(3.0, DVec3::ZERO), &inverted(cube(1.0, DVec3::ONE)));
        assert_close(hollow.volume(), 26.0, ROUNDING);
    }

    #[test]
    fn torus_tends_to_its_area_and_volume() {
        // Area 4π²Rr and volume 2π²Rr² (Pappus); n chords fall short by O(1/n²): the chord of
        // an angle h is short by h²/24 and the polygon's area by h²/6, h = 2π/200.
        let torus = torus(2.0, 0.5, 200, 200);
        let h = 2.0 * PI / 200.0;
        assert_close(torus.area(), 4.0 * PI * PI * 2.0 * 0.5, h * h);
        assert_close(torus.volume(), 2.0 * PI * PI * 2.0 * 0.25, h * h);
        assert!(torus.volume() < 2.0 * PI * PI * 2.0 * 0.25);
    }

    #[test]
    fn centroid_is_the_area_weighted_mean() {
        let centre = cube(2.0, DVec3::new(3.0, 4.0, 5.0)).centroid().unwrap();
        assert!(centre.distance(DVec3::new(4.0, 5.0, 6.0)) < 1e-14);
        // The three right triangles have area 1/2, the slanted one √3/2; each pulls to its own
        // centroid, and by symmetry the three coordinates are equal.
        let weight = 3f64.sqrt() / 2.0;
        let expected = (2.0 * 0.5 / 3.0 + weight / 3.0) / (1.5 + weight);
        let centre = tetrahedron().centroid().unwrap();
        assert!(centre.distance(DVec3::splat(expected)) < 1e-15);
        assert_eq!(Mesh::default().centroid(), None);
    }

    #[test]
    fn bounds_of_a_mesh_are_those_of_its_positions() {
        let bounds = octahedron().bounds().unwrap();
        assert_eq!((bounds.min, bounds.max), (-DVec3::ONE, DVec3::ONE));
        assert_eq!(Mesh::default().bounds(), None);
    }

    #[test]
    fn an_open_mesh_has_an_area() {
        // A regular hexagon in the unit circle.
        assert_close(disk(6).area(), 1.5 * 3f64.sqrt(), ROUNDING);
        assert_eq!(disk(6).volume(), 0.0);
        assert_close(disk(6).mean_edge_length(), 1.0, ROUNDING);
        assert_eq!(Mesh::default().mean_edge_length(), 0.0);
    }

    fn square(side: f64, reversed: bool) -> Polyline {
        let mut points: Vec<DVec3> = [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)]
            .iter()
            .map(|&(x, y)| DVec3::new(x, y, 0.0))
            .collect();
        if reversed {
            points.reverse();
        }
        Polyline {
            points,
            closed: true,
        }
    }

    #[test]
    fn curves_have_length_and_enclosed_area_with_holes_taken_off() {
        let open = Polyline {
            points: vec![DVec3::ZERO, DVec3::new(3.0, 4.0, 0.0)],
            closed: false,
        };
        let curves = Curves {
            dimension: 2,
            polylines: vec![square(4.0, false), square(1.0, true), open],
        };
        assert_eq!(curves.length(), 16.0 + 4.0 + 5.0);
        assert_eq!(curves.enclosed_area(), Some(15.0));
        assert_eq!(curves.components(), 3);
        assert_eq!(curves.closed_components(), 2);
        let bounds = curves.bounds().unwrap();
        assert!(bounds.sides().eq([(0.0, 4.0), (0.0, 4.0)]));
    }

    #[test]
    fn space_curves_enclose_no_area_and_short_polylines_are_harmless() {
        let curves = |dimension, points: Vec<DVec3>| Curves {
            dimension,
            polylines: vec![Polyline {
                points,
                closed: true,
            }],
        };
        assert_eq!(curves(3, vec![DVec3::ZERO; 3]).enclosed_area(), None);
        for count in 0..3 {
            let short = curves(2, vec![DVec3::ONE; count]);
            assert_eq!(short.length(), 0.0);
            assert_eq!(short.enclosed_area(), Some(0.0));
        }
    }
}
