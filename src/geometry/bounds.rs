//! Axis-aligned boxes.

use glam::DVec3;

/// A box in R1, R2 or R3. Axes beyond the dimension are 0 in both corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// 1, 2 or 3.
    pub dimension: usize,
    /// The lower corner.
    pub min: DVec3,
    /// The upper corner.
    pub max: DVec3,
}

impl Bounds {
    /// The box with these sides, one `(low, high)` per axis.
    ///
    /// `None` unless there are 1 to 3 sides, all finite, with `low < high`.
    pub fn from_sides(sides: &[(f64, f64)]) -> Option<Self> {
        let well = |&(low, high): &(f64, f64)| low.is_finite() && high.is_finite() && low < high;
        if !(1..=3).contains(&sides.len()) || !sides.iter().all(well) {
            return None;
        }
        let mut bounds = Bounds {
            dimension: sides.len(),
            min: DVec3::ZERO,
            max: DVec3::ZERO,
        };
        for (axis, &(low, high)) in sides.iter().enumerate() {
            bounds.min[axis] = low;
            bounds.max[axis] = high;
        }
        Some(bounds)
    }

    /// The sides, one `(low, high)` per axis.
    pub fn sides(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        (0..self.dimension).map(|axis| (self.min[axis], self.max[axis]))
    }

    /// The lengths of the sides.
    pub fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// The length of the diagonal: the scale that tolerances refer to.
    pub fn diagonal(&self) -> f64 {
        self.size().length()
    }

    /// The middle.
    pub fn center(&self) -> DVec3 {
        0.5 * (self.min + self.max)
    }

    /// Whether the point lies inside or on the boundary.
    pub fn contains(&self, point: DVec3) -> bool {
        point.cmpge(self.min).all() && point.cmple(self.max).all()
    }

    /// The box with the same centre and sides `factor` times as long.
    pub fn scaled(&self, factor: f64) -> Self {
        let half = 0.5 * factor * self.size();
        Bounds {
            min: self.center() - half,
            max: self.center() + half,
            ..*self
        }
    }

    /// The smallest box of the given dimension (1 to 3) that contains the points; it may have
    /// sides of length 0.
    ///
    /// `None` if there are no points or a coordinate is not finite.
    pub fn of_points(dimension: usize, points: impl IntoIterator<Item = DVec3>) -> Option<Self> {
        let mut points = points.into_iter();
        let first = points.next().filter(|point| point.is_finite())?;
        let mut bounds = Bounds {
            dimension,
            min: first,
            max: first,
        };
        for point in points {
            if !point.is_finite() {
                return None;
            }
            bounds.min = bounds.min.min(point);
            bounds.max = bounds.max.max(point);
        }
        Some(bounds)
    }

    /// The smallest box that contains both. Both have the same dimension.
    pub fn union(&self, other: &Self) -> Self {
        Bounds {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            ..*self
        }
    }

    /// The box with every side moved outward by `margin`.
    pub fn expanded(&self, margin: f64) -> Self {
        let mut expanded = *self;
        for axis in 0..self.dimension {
            expanded.min[axis] -= margin;
            expanded.max[axis] += margin;
        }
        expanded
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_must_be_finite_and_ascending() {
        assert!(Bounds::from_sides(&[]).is_none());
        assert!(Bounds::from_sides(&[(0.0, 1.0); 4]).is_none());
        assert!(Bounds::from_sides(&[(1.0, 1.0)]).is_none());
        assert!(Bounds::from_sides(&[(0.0, f64::INFINITY)]).is_none());
        assert!(Bounds::from_sides(&[(f64::NAN, 1.0)]).is_none());
        let sides = [(-1.0, 2.0), (0.0, 4.0)];
        let bounds = Bounds::from_sides(&sides).unwrap();
        assert!(bounds.sides().eq(sides));
        assert_eq!(bounds.diagonal(), 5.0);
        assert_eq!(bounds.center(), DVec3::new(0.5, 2.0, 0.0));
    }

    #[test]
    fn box_of_points_touches_the_extremes() {
        let points = [
            DVec3::new(1.0, -2.0, 3.0),
            DVec3::new(-1.0, 5.0, 3.0),
            DVec3::new(0.0, 0.0, 3.0),
        ];
        let bounds = Bounds::of_points(3, points).unwrap();
        assert_eq!(bounds.min, DVec3::new(-1.0, -2.0, 3.0));
        assert_eq!(bounds.max, DVec3::new(1.0, 5.0, 3.0));
        assert!(Bounds::of_points(3, []).is_none());
        assert!(Bounds::of_points(3, [DVec3::ZERO, DVec3::NAN]).is_none());
        assert!(Bounds::of_points(3, [DVec3::INFINITY]).is_none());
    }

    #[test]
    fn union_contains_both_and_expansion_keeps_the_unused_axes() {
        let first = Bounds::from_sides(&[(0.0, 1.0), (0.0, 1.0)]).unwrap();
        let second = Bounds::from_sides(&[(-3.0, 0.5), (0.5, 2.0)]).unwrap();
        let both = first.union(&second);
        assert!(both.sides().eq([(-3.0, 1.0), (0.0, 2.0)]));
        let wider = first.expanded(0.5);
        assert!(wider.sides().eq([(-0.5, 1.5), (-0.5, 1.5)]));
        assert_eq!((wider.min.z, wider.max.z), (0.0, 0.0));
        assert!(first.scaled(2.0).sides().eq(wider.sides()));
    }
}
