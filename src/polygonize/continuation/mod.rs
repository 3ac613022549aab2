//! Continuation: along plane curves from point to point, along surfaces from cell to cell.

mod curves;
mod plane;
mod seeds;
mod space;

use super::{Found, Job, PolygonizeError};

pub(super) use self::curves::follow as follow_in_space;
pub(super) use self::plane::Shifted;

/// The level set by continuation: curves in R2, a mesh in R3.
pub(super) fn follow(job: &Job) -> Result<Found, PolygonizeError> {
    match job.options.bounds.dimension {
        2 => plane::find(job),
        _ => space::march(job),
    }
}
