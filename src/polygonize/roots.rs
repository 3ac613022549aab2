//! Roots in R1: bracketing on uniform cells, then the solver for grid edges.

use std::ops::Range;

use glam::DVec3;

use super::edge_roots::{self, Accuracy, Edge, Root};
use super::grid::{Seen, for_each_slab};
use super::{Found, Job, PolygonizeError, Shape, Statistics, uniform_grid};
use crate::engine::{Field, Monitor};

/// The roots of F − iso in the interval, both ends included, in ascending order: one for each
/// change of sign between neighbouring grid points, and every grid point at which F = iso exactly.
///
/// Unlike the vertices of curves and surfaces, poor roots are left out: nothing depends on them,
/// and a pole is no root.
pub(super) fn find(job: &Job) -> Result<Found, PolygonizeError> {
    let grid = &uniform_grid(job.options)?;
    let (field, accuracy, monitor) = (job.field, job.accuracy, job.monitor);
    let points = &grid.coordinates[0];
    let pieces = for_each_slab(grid, "finding roots", monitor, |cells| {
        find_piece(field, accuracy, points, cells, monitor)
    })?;

    let mut found = Vec::new();
    let mut seen = Seen::default();
    let mut statistics = Statistics::default();
    for (roots, piece_seen, evaluations) in pieces {
        let good = roots.iter().filter(|root| !root.is_poor());
        found.extend(good.map(|root| root.position.x));
        seen = seen.and(piece_seen);
        statistics = statistics.and(Statistics {
            evaluations,
            nan_points: piece_seen.nan,
            ..Statistics::of_roots(&roots)
        });
    }
    // Two roots within the tolerance of the grid point between them are both there.
    found.dedup();
    statistics.good_roots = found.len();
    let at_end = |root: &f64| *root == points[0] || *root == points[points.len() - 1];
    statistics.cut_by_box = found.iter().any(at_end);
    statistics.cells = grid.cells();
    Ok((Shape::Roots(found), seen, statistics))
}

/// The roots in a range of cells, not counting its upper end unless that is the last point; what
/// was seen at the same points, and the number of evaluations.
fn find_piece(
    field: &dyn Field,
    accuracy: Accuracy,
    points: &[f64],
    cells: Range<usize>,
    monitor: &dyn Monitor,
) -> (Vec<Root>, Seen, usize) {
    let last = cells.end + 1 == points.len();
    let points = &points[cells.start..=cells.end];
    let own = if last { points.len() } else { points.len() - 1 };
    let mut values = vec![0.0; points.len()];
    field.values(&[points], &mut values);
    values.iter_mut().for_each(|value| *value -= accuracy.iso);

    let edge = |inside: usize, outside: usize| Edge {
        inside: DVec3::new(points[inside], 0.0, 0.0),
        axis: 0,
        outside: points[outside],
        inside_value: values[inside],
        outside_value: values[outside],
    };
    let mut edges = Vec::new();
    for here in 0..own {
        if values[here] == 0.0 {
            // A root at a grid point, once and exactly: an edge of no length.
            edges.push(edge(here, here));
        } else if here + 1 < points.len() && values[here + 1] != 0.0 {
            match (values[here] < 0.0, values[here + 1] < 0.0) {
                (true, false) => edges.push(edge(here, here + 1)),
                (false, true) => edges.push(edge(here + 1, here)),
                _ => {}
            }
        }
    }
    let (roots, more) = edge_roots::solve(&mut { field }, accuracy, &edges, monitor);
    (roots, Seen::of_values(&values[..own]), points.len() + more)
}
