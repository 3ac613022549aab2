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
}
