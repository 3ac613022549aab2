//! The preliminary search: where is the surface?
//!
//! "If the initial sample is too far away from h⁻¹(0), then the sample after equilibrium might
//! not cover all of V. We may therefore view the sampling step as a preliminary search for V.
//! After V is located, we can then sample it more thoroughly by selecting another set of initial
//! conditions near V, e.g., by sampling a bounding box twice as large as the bounding box of the
//! preliminary sample. A few iterations of this process are usually enough" ("Practical issues").

use glam::DVec3;

use super::newton::Point;
use super::random::Stream;
use super::release::{Release, release};
use super::statistics::Tally;
use super::{Options, SampleError};
use crate::engine::Monitor;
use crate::geometry::Bounds;

/// The next search box is so much larger than the bounding box of what was found.
const ENLARGEMENT: f64 = 2.0;

/// Without bounds and without a find, the search box grows by this factor a round.
const GROWTH: f64 = 4.0;

/// A find counts as new when it enlarges the bounding box of the earlier finds by more than
/// this part of its diagonal. A few hundred random points miss that much of a box anyway.
const MARGIN: f64 = 0.02;

/// Finds closer than this part of the search box are the same. Larger than any sensible
/// tolerance, smaller than any sensible feature.
const ROUNDING: f64 = 1e-6;

/// Particles a round: enough to see a component that catches one particle in a hundred.
const FEWEST: u64 = 128;
const MOST: u64 = 1000;

/// What the search has found.
pub(super) struct Located {
    /// Where the final particles should start.
    pub(super) bounds: Bounds,
    pub(super) rounds: u32,
    /// Whether the last round found nothing new outside the earlier finds.
    pub(super) settled: bool,
}

/// Searches until a round finds nothing outside the finds of the earlier ones, at most
/// `options.search_limit` times, and adds the work to the tally. `first` is the release to begin
/// with; its box is that of the options or, without one, the box in which a search begins.
pub(super) fn locate(
    first: &Release,
    options: &Options,
    monitor: &dyn Monitor,
    tally: &mut Tally,
) -> Result<Located, SampleError> {
    let mut located = Located {
        bounds: first.bounds,
        rounds: 0,
        settled: options.search_limit == 0,
    };
    let mut found: Option<Bounds> = None;
    while !located.settled && located.rounds < options.search_limit {
        located.rounds += 1;
        let round = Release {
            stream: Stream::new(options.seed, u64::from(located.rounds)),
            count: (first.count / 4).clamp(FEWEST, MOST),
            bounds: located.bounds,
            reach: reach(options.bounds, located.bounds),
            ..*first
        };
        let fraction = f64::from(located.rounds - 1) / f64::from(options.search_limit);
        monitor.progress("search", fraction);
        let (points, counts) = release(&round, monitor, &|_| ()).ok_or(SampleError::Cancelled)?;
        tally.add(&counts);
        let earlier = found;
        found = bounding_box(earlier, &points, located.bounds.dimension);
        let next = match (found, options.bounds) {
            (Some(found), _) => around(found, located.bounds, options.bounds),
            (None, None) => located.bounds.scaled(GROWTH),
            // More particles in the same box are the business of the final sample.
            (None, Some(_)) => break,
        };
        let nothing_new = nothing_new(earlier, found, round.bounds);
        located.settled = nothing_new && !is_lost_in(found, round.bounds) || next == round.bounds;
        located.bounds = next;
    }
    if found.is_none() {
        located.bounds = first.bounds;
    }
    Ok(located)
}

/// How far particles from a search box may fly. With bounds, what lies far beyond cannot come
/// to count any more. Without, the surface is tracked "wherever it is", as far as is sensible.
pub(super) fn reach(given: Option<Bounds>, search_box: Bounds) -> Bounds {
    match given {
        Some(bounds) => bounds.scaled(2.0),
        None => search_box.scaled(64.0),
    }
}

/// The bounding box of the points and of what was found before.
fn bounding_box(earlier: Option<Bounds>, points: &[Point], dimension: usize) -> Option<Bounds> {
    points.iter().fold(earlier, |bounds, point| {
        let place = Bounds {
            dimension,
            min: point.position,
            max: point.position,
        };
        Some(bounds.map_or(place, |bounds| Bounds {
            min: bounds.min.min(point.position),
            max: bounds.max.max(point.position),
            ..bounds
        }))
    })
}

/// The box of twice the size around what was found, within the bounds that are given. It does
/// not shrink by more than a factor of about ten a round: what is found from far away is often
/// only the near side of the surface. And a flat find gets some thickness.
fn around(found: Bounds, present: Bounds, given: Option<Bounds>) -> Bounds {
    let thinnest = 0.1 * found.size().max_element().max(0.5 * present.diagonal());
    let mut bounds = found;
    for axis in 0..found.dimension {
        let half = 0.5 * ENLARGEMENT * found.size()[axis].max(thinnest);
        bounds.min[axis] = found.center()[axis] - half;
        bounds.max[axis] = found.center()[axis] + half;
    }
    match given {
        None => bounds,
        Some(given) => Bounds {
            min: bounds.min.max(given.min),
            max: bounds.max.min(given.max),
            ..bounds
        },
    }
}

/// Whether the surface is so small in the box that was searched that another round in a smaller
/// one is better. (A single point, such as a root in R1, is as well sampled as it can be.)
fn is_lost_in(found: Option<Bounds>, searched: Bounds) -> bool {
    let part = found.map_or(0.0, |found| found.diagonal() / searched.diagonal());
    part > ROUNDING && part < 0.5 / (ENLARGEMENT * ENLARGEMENT)
}

/// Whether the finds of this round lie within the earlier ones, up to the margin and to what is
/// rounding in the box that was searched (the finds may be a single point).
fn nothing_new(earlier: Option<Bounds>, found: Option<Bounds>, searched: Bounds) -> bool {
    let (Some(earlier), Some(found)) = (earlier, found) else {
        return false;
    };
    let margin = DVec3::splat(MARGIN * earlier.diagonal() + ROUNDING * searched.diagonal());
    let widened = Bounds {
        min: earlier.min - margin,
        max: earlier.max + margin,
        ..earlier
    };
    widened.contains(found.min) && widened.contains(found.max)
}
