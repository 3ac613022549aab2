//! What is unusual about a field on its box, before anything is made of it.
//!
//! [`inspect`] looks for what most often is a mistake or a trouble ahead: a field that is not a
//! number or is constant, one whose inside surrounds its object, and singular points, where the
//! gradient vanishes on the zero set. The first three come from a grid of points (`survey`). Singular
//! points come from a subdivision by enclosures of F and F_x (`cells`), which cannot lose one but
//! below its finest cells, and from Newton's method on F_x = 0 in the cells that are left
//! (`newton`); what is found is told apart into points and larger sets (`group`).

mod cells;
mod group;
mod newton;
mod survey;

use glam::DVec3;
use thiserror::Error;

use crate::engine::{CompiledField, Monitor};
use crate::geometry::Bounds;

/// What is unusual about a field.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// It is not a number at any point of the grid.
    pub undefined: bool,
    /// It has this value at all points of the grid.
    pub constant: Option<f64>,
    /// It is negative (inside) on the whole border of the box, and positive somewhere within.
    pub inside_out: bool,
    /// Isolated points of the zero set at which the gradient vanishes, in lexicographic order.
    pub points: Vec<DVec3>,
    /// Connected sets of such points that are more than points (curves, surfaces): for each some
    /// of its points, about as far from each other as the finest cells are wide.
    pub sets: Vec<Vec<DVec3>>,
}

impl Report {
    /// Whether nothing unusual was found.
    pub fn is_clean(&self) -> bool {
        *self == Report::default()
    }
}

/// The work was cancelled.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("the inspection was cancelled")]
pub struct Cancelled;

/// Inspects a field on a box of its dimension.
///
/// Takes up to some 10⁵ enclosures and as many values of F_xx, so at most about a second for an
/// ordinary field. Singular points are found where F is twice differentiable around them; two of
/// them nearer than a 16th of the finest cell (1/128 of the box in R3) count as one, and four or
/// more in neighbouring cells as a set.
pub fn inspect(
    field: &CompiledField,
    bounds: &Bounds,
    monitor: &dyn Monitor,
) -> Result<Report, Cancelled> {
    let survey = survey::survey(field, bounds);
    let mut report = Report {
        undefined: survey.undefined,
        constant: survey.constant,
        inside_out: survey.inside_out,
        ..Report::default()
    };
    if !report.undefined && report.constant.is_none() && survey.slope > 0.0 {
        let cells = cells::suspicious(field, bounds, monitor)?;
        let found = newton::converge(field, bounds, &cells, survey.slope, monitor)?;
        group::group(&found, &cells, &mut report);
    }
    Ok(report)
}
