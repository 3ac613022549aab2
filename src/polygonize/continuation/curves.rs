//! Curves in space, on which two fields vanish, by continuation: prediction along the tangent, which is the
//! product of the two normals, correction by Newton's method, and starts that miss no component
//! ([`continuation`](crate::continuation)).
//!
//! Vertices are at most a cell apart along the curve, at equal distances between corners. A walk goes straight over
//! a crossing, so that a curve which crosses itself is one polyline.

use super::plane::{marks, on_sides};
use crate::continuation::{Region, System, Traced, Walker, trace};
use crate::engine::{Field, Monitor};
use crate::geometry::{Curves, Polyline};
use crate::polygonize::grid::Seen;
use crate::polygonize::{Found, Options, PolygonizeError, Shape, Statistics};

/// The curve on which both fields vanish.
pub(in crate::polygonize) fn follow(
    fields: [&dyn Field; 2],
    distance: f64,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Found, PolygonizeError> {
    let bounds = options.bounds;
    let system = System::new(fields.to_vec(), bounds.diagonal(), distance);
    let walker = Walker {
        system: &system,
        bounds,
        compiled: system.compiled(),
    };
    let traced =
        trace(&walker, &Region::whole(&bounds), monitor).ok_or(PolygonizeError::Cancelled)?;
    let polylines: Vec<Polyline> = (traced.components.iter())
        .map(|component| {
            let marks = marks(&system, component, options.cell);
            let marks = on_sides(marks, component.closed, &bounds);
            let mut points: Vec<_> = marks.iter().map(|mark| mark.position).collect();
            if component.closed {
                // The last is the first again.
                points.pop();
            }
            Polyline {
                points,
                closed: component.closed,
            }
        })
        .collect();
    let statistics = statistics(&system, &traced, &polylines);
    let curves = Curves {
        dimension: 3,
        polylines,
    };
    Ok((Shape::Curves(curves), Seen::default(), statistics))
}

fn statistics(system: &System, traced: &Traced, polylines: &[Polyline]) -> Statistics {
    let vertices = || polylines.iter().flat_map(|polyline| &polyline.points);
    let residuals = vertices().filter_map(|&point| system.local(point));
    let residuals = residuals.map(|local| local.residual());
    let inner_ends = 2 * polylines.iter().filter(|polyline| !polyline.closed).count();
    Statistics {
        max_residual: residuals.filter(|own| own.is_finite()).fold(0.0, f64::max),
        evaluations: system.counts().0 as usize,
        cut_by_box: inner_ends > traced.events.ends.len(),
        good_roots: vertices().count(),
        undecided: (traced.undecided - traced.undecided_at_singular.min(traced.undecided)) as usize,
        proven: traced.proven && traced.events.unfinished == 0,
        crossings: traced.events.crossings.len(),
        corners: traced.events.corners.len(),
        ..Statistics::default()
    }
}
