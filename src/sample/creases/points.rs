//! Points on creases, at the wanted distances.

use glam::DVec3;

use super::{Crease, Creases, Setting};
use crate::continuation::{Place, Step};

/// A closed crease that is longer than the tolerance has so many points at least.
const FEWEST_CLOSED: f64 = 3.0;

/// A point of a crease.
#[derive(Clone, Debug, PartialEq)]
pub struct CreasePoint {
    /// Where it is.
    pub position: DVec3,
    /// The unit normals of the sides that adjoin: two on arcs, two or more in corners.
    pub normals: Vec<DVec3>,
    /// The unit tangent of the arc; 0 in corners, and in the plane.
    pub tangent: DVec3,
    /// Whether arcs end here.
    pub is_corner: bool,
}

impl Creases {
    /// The corners, then points on each arc at equal distances, measured in the spacing that is
    /// wanted at each place: as many distances as come nearest to it, at least one, and at
    /// least three on closed arcs. Arcs that end in the border have a point there.
    ///
    /// Each lies on the zero sets of both sides to the tolerance. The order is that of the corners
    /// and arcs. Costs some ten evaluations of both sides a point, and the spacing at five places
    /// of each step.
    pub fn points(&self, spacing: &dyn Fn(DVec3) -> f64) -> Vec<CreasePoint> {
        let setting = self.setting();
        let mut points: Vec<CreasePoint> = self
            .corners
            .iter()
            .map(|corner| CreasePoint {
                position: corner.position,
                normals: corner.normals.clone(),
                tangent: DVec3::ZERO,
                is_corner: true,
            })
            .collect();
        for arc in &self.arcs {
            on_arc(&setting, arc, spacing, &mut points);
        }
        points
    }
}

/// The points of an arc, without those in corners.
fn on_arc(
    setting: &Setting,
    arc: &Crease,
    spacing: &dyn Fn(DVec3) -> f64,
    points: &mut Vec<CreasePoint>,
) {
    let weight = |place: DVec3| {
        let spacing = spacing(place);
        if spacing > 0.0 { 1.0 / spacing } else { 0.0 }
    };
    let steps: Vec<(usize, Step)> = arc
        .parts
        .iter()
        .enumerate()
        .flat_map(|(part, segment)| {
            let steps = segment.steps.iter();
            steps.map(move |step| (part, step.weighed(weight)))
        })
        .collect();
    let measure: f64 = steps.iter().map(|(_, step)| step.length).sum();
    let fewest = match arc.closed && arc.length > setting.tolerance {
        true => FEWEST_CLOSED,
        false => 1.0,
    };
    let gaps = measure.round().max(fewest);
    // An arc of which the spacing is nowhere known has its corners alone.
    if !gaps.is_finite() {
        return;
    }
    let gaps = gaps as u64;
    let first = u64::from(!arc.closed && arc.corners[0].is_some());
    let beyond = match arc.closed || arc.corners[1].is_some() {
        true => gaps,
        false => gaps + 1,
    };
    let mut passed = 0.0;
    let mut rest = steps.iter().peekable();
    for number in first..beyond {
        let wanted = measure * (number as f64 / gaps as f64);
        while let Some((_, step)) = rest.peek()
            && passed + step.length < wanted
            && rest.len() > 1
        {
            passed += step.length;
            rest.next();
        }
        if let Some((part, step)) = rest.peek() {
            points.extend(point(setting, arc, *part, step, wanted - passed));
        }
    }
}

/// The point at which so much of a step is passed.
fn point(
    setting: &Setting,
    arc: &Crease,
    part: usize,
    step: &Step,
    passed: f64,
) -> Option<CreasePoint> {
    let segment = arc.parts.get(part)?;
    let system = setting.system(segment.pair);
    let along = step.part_at_length(passed);
    let place = step.at(&system, along).or_else(|| {
        // At a singular point there is no tangent to solve by; an end is close.
        let end = if along > 0.5 { step.to } else { step.from };
        Place::along(end, system.local(end)?, step.direction)
    })?;
    let signed = place.local.normals.into_iter().zip(segment.signs);
    Some(CreasePoint {
        position: place.position,
        normals: signed.map(|(normal, sign)| sign * normal).collect(),
        tangent: place.tangent,
        is_corner: false,
    })
}
