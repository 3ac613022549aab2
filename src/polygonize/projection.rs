//! Points on a level set near given points: Newton's method along the gradient, within boxes, and
//! bisection where that fails.

use glam::DVec3;

use super::columns::{Columns, Evaluate, is_continuous};
use super::edge_roots::{Accuracy, Kind, Root, first_order_distance, unit_or_zero};
use crate::engine::{Field, Monitor};

/// How many points are moved together.
const BATCH: usize = 512;

/// The greatest number of Newton steps. Near a smooth level set five are enough.
const STEPS: usize = 12;

/// The greatest number of halvings of a segment: as many as numbers have bits, and some more.
const HALVINGS: usize = 64;

/// Where a point of the level set is sought.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Start {
    /// The point that is moved.
    pub(super) point: DVec3,
    /// The lowest corner of the box that it may not leave.
    pub(super) low: DVec3,
    /// The highest corner.
    pub(super) high: DVec3,
    /// A point at which F < iso, and one at which it is not. On the way from the start to one of
    /// them the sign changes.
    pub(super) ends: [DVec3; 2],
}

/// A point of the level set for each start, and the number of evaluations of F and F_x.
///
/// Newton steps that lead out of the box end at its side. Where they do not converge, as where F
/// is not smooth, the point is sought by bisection between the start and one of its ends.
pub(super) fn project(
    field: &dyn Field,
    accuracy: Accuracy,
    starts: &[Start],
    monitor: &dyn Monitor,
) -> (Vec<Root>, usize) {
    let mut roots = Vec::with_capacity(starts.len());
    let mut evaluations = 0;
    for starts in starts.chunks(BATCH) {
        if monitor.cancelled() {
            break;
        }
        let (mut found, count) = newton(&mut { field }, accuracy, starts);
        let lost: Vec<usize> = (0..starts.len())
            .filter(|&at| found[at].is_poor())
            .collect();
        let searches = lost.iter().map(|&at| {
            let [inside, outside] = starts[at].ends;
            // The residual of a point that is lost tells the sign of F there.
            match found[at].residual < 0.0 {
                true => [starts[at].point, outside],
                false => [inside, starts[at].point],
            }
        });
        let (halved, further) = bisect(field, accuracy, searches.collect());
        for (&at, root) in lost.iter().zip(halved) {
            found[at] = root;
        }
        roots.extend(found);
        evaluations += count + further;
    }
    (roots, evaluations)
}

/// Newton's method along the gradient. A root that is not found is poor, at the start, and its
/// residual negative if F < iso there, else not.
pub(super) fn newton(
    field: &mut impl Evaluate,
    accuracy: Accuracy,
    starts: &[Start],
) -> (Vec<Root>, usize) {
    let mut points: Vec<DVec3> = starts.iter().map(|start| start.point).collect();
    let mut roots = vec![Root::default(); starts.len()];
    let mut moving: Vec<usize> = (0..starts.len()).collect();
    let mut evaluations = 0;
    for step in 0..STEPS {
        if moving.is_empty() {
            break;
        }
        evaluations += moving.len();
        let found = evaluate(field, accuracy.iso, moving.iter().map(|&at| points[at]));
        let mut found = found.into_iter();
        moving.retain(|&at| {
            let Some((value, gradient)) = found.next() else {
                return false;
            };
            let root = root(points[at], value, gradient);
            if root.residual <= accuracy.distance {
                roots[at] = root;
                return false;
            }
            if step == 0 {
                roots[at] = Root {
                    residual: if value < 0.0 { -1.0 } else { 1.0 },
                    kind: Kind::Jump,
                    ..root
                };
            }
            let Start { low, high, .. } = starts[at];
            let newton = points[at] - root.residual.copysign(value) * root.normal;
            let next = newton.clamp(low, high);
            let moves = next.is_finite() && next != points[at];
            points[at] = next;
            moves
        });
    }
    (roots, evaluations)
}

/// Bisection between pairs of points, F < iso at the first and not at the second. A root that is
/// not found, at a jump, is the last point with F < iso.
fn bisect(
    mut field: &dyn Field,
    accuracy: Accuracy,
    mut searches: Vec<[DVec3; 2]>,
) -> (Vec<Root>, usize) {
    let mut roots = vec![Root::default(); searches.len()];
    let mut moving: Vec<usize> = (0..searches.len()).collect();
    let mut evaluations = 0;
    for halving in 0..=HALVINGS {
        if moving.is_empty() {
            break;
        }
        evaluations += moving.len();
        let last = halving == HALVINGS;
        let candidate = |[inside, outside]: [DVec3; 2]| match last {
            true => inside,
            false => inside.midpoint(outside),
        };
        let points: Vec<DVec3> = moving.iter().map(|&at| candidate(searches[at])).collect();
        let found = evaluate(&mut field, accuracy.iso, points.iter().copied());
        let mut found = points.into_iter().zip(found);
        moving.retain(|&at| {
            let Some((point, (value, gradient))) = found.next() else {
                return false;
            };
            roots[at] = root(point, value, gradient);
            let good = roots[at].residual <= accuracy.distance;
            if !good {
                searches[at][usize::from(value.is_nan() || value >= 0.0)] = point;
                let [inside, outside] = searches[at];
                let is_root = last && is_continuous(&field, inside, outside);
                roots[at].kind = if is_root { Kind::Good } else { Kind::Jump };
            }
            !good
        });
    }
    (roots, evaluations)
}

/// A point as a root.
fn root(position: DVec3, value: f64, gradient: DVec3) -> Root {
    Root {
        position,
        normal: unit_or_zero(gradient),
        residual: first_order_distance(value, gradient),
        kind: Kind::Good,
    }
}

/// F − iso and F_x at points in R3.
fn evaluate(
    field: &mut impl Evaluate,
    iso: f64,
    points: impl Iterator<Item = DVec3>,
) -> Vec<(f64, DVec3)> {
    let mut columns = Columns::default();
    columns.set_points(points);
    columns.evaluate(field, iso);
    columns.results().collect()
}
