//! Points in structure-of-arrays form with F − iso and F_x at them, and what gives these.

use glam::DVec3;

use crate::engine::{CompiledField, Field, Specialized};
use crate::graph::Interval;
use crate::graph::interval::{Enclosure, Regularity};

/// What gives F and F_x at points: a field, or one that was pruned for a cell.
pub(super) trait Evaluate {
    /// The number of coordinates.
    fn dimension(&self) -> usize;

    /// F at every point.
    fn values(&mut self, points: &[&[f64]], values: &mut [f64]);

    /// F and F_x at every point.
    fn gradients(&mut self, points: &[&[f64]], values: &mut [f64], gradients: &mut [&mut [f64]]);

    /// The whole field, if boxes can be enclosed.
    fn compiled(&self) -> Option<&CompiledField>;
}

/// Whether F is proven to be continuous in the box between two points.
pub(super) fn is_continuous(field: &impl Evaluate, one: DVec3, other: DVec3) -> bool {
    let (low, high) = (one.min(other), one.max(other));
    let sides = [0, 1, 2].map(|axis| [Interval::new(low[axis], high[axis])]);
    let sides = sides.each_ref().map(|side| &side[..]);
    field.compiled().is_some_and(|compiled| {
        let mut found = [Enclosure::of_number(f64::NAN)];
        compiled.enclose(&sides[..compiled.dimension()], &mut found);
        found[0].regularity == Regularity::Continuous
    })
}

impl Evaluate for &dyn Field {
    fn dimension(&self) -> usize {
        Field::dimension(*self)
    }

    fn values(&mut self, points: &[&[f64]], values: &mut [f64]) {
        Field::values(*self, points, values);
    }

    fn gradients(&mut self, points: &[&[f64]], values: &mut [f64], gradients: &mut [&mut [f64]]) {
        Field::gradients(*self, points, values, gradients);
    }

    fn compiled(&self) -> Option<&CompiledField> {
        Field::compiled(*self)
    }
}

impl Evaluate for Specialized<'_> {
    fn dimension(&self) -> usize {
        Specialized::dimension(self)
    }

    fn values(&mut self, points: &[&[f64]], values: &mut [f64]) {
        Specialized::values(self, points, values);
    }

    fn gradients(&mut self, points: &[&[f64]], values: &mut [f64], gradients: &mut [&mut [f64]]) {
        Specialized::gradients(self, points, values, gradients);
    }

    fn compiled(&self) -> Option<&CompiledField> {
        Some(self.whole())
    }
}

/// Points, and F − iso and F_x at them. Kept and filled anew, it does not allocate.
#[derive(Default)]
pub(super) struct Columns {
    points: [Vec<f64>; 3],
    gradients: [Vec<f64>; 3],
    values: Vec<f64>,
}

impl Columns {
    /// Replaces the points.
    pub(super) fn set_points(&mut self, points: impl Iterator<Item = DVec3>) {
        self.points.iter_mut().for_each(Vec::clear);
        for point in points {
            for (column, coordinate) in self.points.iter_mut().zip(point.to_array()) {
                column.push(coordinate);
            }
        }
    }

    /// Finds F − iso and F_x at the points.
    pub(super) fn evaluate(&mut self, field: &mut impl Evaluate, iso: f64) {
        let (count, dimension) = (self.points[0].len(), field.dimension());
        // Components beyond the dimension stay 0.
        for column in &mut self.gradients {
            column.resize(count, 0.0);
        }
        self.values.resize(count, 0.0);
        let points = self.points.each_ref().map(Vec::as_slice);
        let mut gradients = self.gradients.each_mut().map(Vec::as_mut_slice);
        field.gradients(
            &points[..dimension],
            &mut self.values,
            &mut gradients[..dimension],
        );
        self.values.iter_mut().for_each(|value| *value -= iso);
    }

    /// F − iso and F_x at all points, in order.
    pub(super) fn results(&self) -> impl Iterator<Item = (f64, DVec3)> + '_ {
        (0..self.values.len()).map(|index| self.result(index))
    }

    /// F − iso and F_x at a point.
    pub(super) fn result(&self, index: usize) -> (f64, DVec3) {
        let gradient = self.gradients.each_ref().map(|column| column[index]);
        (self.values[index], DVec3::from_array(gradient))
    }
}
