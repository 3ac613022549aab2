//! Continuation: points are found from points, along the curve or over the surface.
//!
//! Curves are found and followed by [`continuation`](crate::continuation); here points are put at
//! equal distances along them (`spread`). Surfaces: `surface`.

mod spread;
mod surface;

pub(super) use self::surface::surface;

use glam::DVec3;

use super::statistics::{CurveComponent, CurveStatistics, Statistics};
use super::{Options, Outcome, SampleError, out_of_range, radii};
use crate::continuation::{Place, Region, System, Traced, Walker, trace};
use crate::engine::{CompiledField, Extent, Field, Monitor, extent};
use crate::geometry::{Bounds, Samples};

/// A box that was found is made larger by this part of its longest side, so that nothing lies in its
/// faces.
const MARGIN: f64 = 0.02;

/// Samples the curve on which one field in R2 or two in R3 vanish.
///
/// Points are equally far apart along each component, to about 1e-9 of the spacing. The cost is
/// some tens of evaluations a step, of which a circle takes about sixty, some thousand enclosures to
/// find the components, and four evaluations a point.
pub(super) fn curve(
    fields: &[&dyn Field],
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Outcome, SampleError> {
    let bounds = match options.bounds {
        Some(bounds) => bounds,
        None => match found_box(fields, monitor)? {
            Some(bounds) => bounds,
            None => return Ok(nothing(fields)),
        },
    };
    let diagonal = bounds.diagonal();
    let system = System::new(fields.to_vec(), diagonal, options.tolerance * diagonal);
    let walker = Walker {
        system: &system,
        bounds,
        compiled: system.compiled(),
    };
    let traced = trace(&walker, &Region::whole(&bounds), monitor).ok_or(SampleError::Cancelled)?;
    if traced.components.is_empty() && traced.singular > 0 {
        return Err(SampleError::NoCurve {
            fields: fields.len(),
        });
    }
    let counts = spread::counts(&traced.components, options)?;
    let mut places: Vec<Place> = Vec::new();
    for (component, count) in traced.components.iter().zip(counts) {
        if monitor.cancelled() {
            return Err(SampleError::Cancelled);
        }
        places.extend(spread::places(&system, component, count));
    }
    let samples = samples(&system, &places);
    let statistics = statistics(&system, &traced, &samples, bounds);
    Ok(Outcome {
        samples,
        statistics,
    })
}

/// The places with all that a sample says about them.
fn samples(system: &System, places: &[Place]) -> Samples {
    let positions: Vec<DVec3> = places.iter().map(|place| place.position).collect();
    // In the plane, the first of the two equations is z = 0.
    let own = 2 - system.fields.len();
    Samples {
        dimension: system.dimension,
        normals: places
            .iter()
            .map(|place| place.local.normals[own])
            .collect(),
        tangents: places.iter().map(|place| place.tangent).collect(),
        weights: Vec::new(),
        residuals: places.iter().map(|place| place.local.residual()).collect(),
        radii: radii::radii(&positions),
        positions,
    }
}

fn statistics(system: &System, traced: &Traced, samples: &Samples, bounds: Bounds) -> Statistics {
    let (evaluations, undefined) = system.counts();
    let events = &traced.events;
    Statistics {
        started: samples.positions.len() as u64,
        points: samples.positions.len() as u64,
        steps: events.steps,
        evaluations,
        converged: events.unfinished == 0,
        max_residual: samples.residuals.iter().copied().fold(0.0, f64::max),
        nan_points: undefined,
        curves: Some(CurveStatistics {
            components: traced
                .components
                .iter()
                .map(|component| CurveComponent {
                    length: component.length,
                    closed: component.closed,
                })
                .collect(),
            crossings: events.crossings.len() as u64,
            corners: events.corners.len() as u64,
            ends: events.ends.len() as u64,
            unfinished: events.unfinished,
            unproven_steps: events.unproven,
            undecided: traced.undecided,
            undecided_at_singular: traced.undecided_at_singular,
            largest_undecided: traced.largest_undecided,
            proven: traced.proven,
        }),
        ..Statistics::new(bounds)
    }
}

/// A box that provably holds the whole set, somewhat enlarged; `None` if there provably is none.
fn found_box(fields: &[&dyn Field], monitor: &dyn Monitor) -> Result<Option<Bounds>, SampleError> {
    let missing = || {
        let expected = "given with this method: no box was found that provably holds the zero set";
        Err(out_of_range("bounds", expected, "left out".to_owned()))
    };
    let compiled: Option<Vec<&CompiledField>> =
        fields.iter().map(|field| field.compiled()).collect();
    let mut found: Option<(DVec3, DVec3)> = None;
    for field in compiled.unwrap_or_default() {
        match extent(field, monitor).ok_or(SampleError::Cancelled)? {
            Extent::Empty => return Ok(None),
            Extent::Within(sides) => {
                let (mut low, mut high) = (DVec3::ZERO, DVec3::ZERO);
                for (axis, side) in sides.iter().enumerate() {
                    (low[axis], high[axis]) = (side.low, side.high);
                }
                let (other_low, other_high) = found.unwrap_or((low, high));
                found = Some((low.max(other_low), high.min(other_high)));
            }
            Extent::Unbounded | Extent::Unknown { .. } => {}
        }
    }
    let Some((low, high)) = found else {
        return missing();
    };
    if low.cmpgt(high).any() {
        return Ok(None);
    }
    let margin = MARGIN * (high - low).max_element();
    let dimension = fields.first().map_or(3, |field| field.dimension());
    let sides: Vec<(f64, f64)> = (0..dimension)
        .map(|axis| (low[axis] - margin, high[axis] + margin))
        .collect();
    match Bounds::from_sides(&sides).filter(|bounds| bounds.diagonal() > 1e-90) {
        Some(bounds) => Ok(Some(bounds)),
        None => missing(),
    }
}

/// The sample of a set that is provably empty.
fn nothing(fields: &[&dyn Field]) -> Outcome {
    let dimension = fields.first().map_or(3, |field| field.dimension());
    let system = System::new(fields.to_vec(), 1.0, 0.0);
    let samples = Samples {
        dimension,
        ..Samples::default()
    };
    let traced = Traced {
        proven: true,
        ..Traced::default()
    };
    let bounds = Bounds {
        dimension,
        min: DVec3::ZERO,
        max: DVec3::ZERO,
    };
    let statistics = statistics(&system, &traced, &samples, bounds);
    Outcome {
        samples,
        statistics,
    }
}
