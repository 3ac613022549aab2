//! From the creases of pairs of pieces to arcs that end in corners.
//!
//! Ends at the same point are one corner. A crease that passes a corner is split there; creases
//! that two pairs of pieces have in common are kept once. Where just two ends meet and lead on
//! smoothly, as where a circle goes from one piece to the next, there is no corner, and they are
//! one arc.

use std::collections::HashMap;

use glam::DVec3;

use super::corner::Corner;
use super::curves::Curve;
use super::cuts::{Cut, Ending, Run, corners};
use super::{Crease, Setting};
use crate::continuation::{Component, Place, Step, System};

/// Ends closer than this part of the diagonal are one corner.
const SAME: f64 = 1e-7;

/// A smooth transition turns by less: the sine of one degree.
const SMOOTH: f64 = 0.017_452_406_437_283_51;

/// Shorter pieces than this part of the diagonal are none.
const SHORTEST: f64 = 1e-12;

/// A crease of one pair of pieces.
#[derive(Clone, Debug)]
pub(in crate::sample) struct Segment {
    /// The pieces on whose zero sets it lies.
    pub(super) pair: [u32; 2],
    /// The signs by which their normals are the field's.
    pub(super) signs: [f64; 2],
    /// In order, each from where the last one ended.
    pub(super) steps: Vec<Step>,
    /// The corners at its ends.
    corners: [Option<usize>; 2],
    /// The unit tangents at its ends, both forward.
    tangents: [DVec3; 2],
    closed: bool,
}

/// The corners by their places.
struct Directory {
    same: f64,
    corners: Vec<Corner>,
    /// Whether their positions were found by Newton's method.
    exact: Vec<bool>,
    buckets: HashMap<[i64; 3], Vec<usize>>,
}

impl Directory {
    fn bucket(&self, point: DVec3) -> [i64; 3] {
        (point / (4.0 * self.same))
            .floor()
            .to_array()
            .map(|x| x as i64)
    }

    /// The corner at a point.
    fn find(&self, point: DVec3) -> Option<usize> {
        let [x, y, z] = self.bucket(point);
        let around =
            (-1..=1).flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| [i, j, k])));
        let near = around
            .filter_map(|[i, j, k]| self.buckets.get(&[x + i, y + j, z + k]))
            .flatten()
            .map(|&number| (self.corners[number].position.distance(point), number));
        near.filter(|(apart, _)| *apart <= self.same)
            .min_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)))
            .map(|(_, number)| number)
    }

    /// Adds a corner at a cut. Of cuts at the same point, one that is known exactly tells where.
    fn add(&mut self, cut: Cut) {
        match self.find(cut.position) {
            Some(number) => {
                if cut.is_exact && !std::mem::replace(&mut self.exact[number], true) {
                    self.corners[number].position = cut.position;
                }
            }
            None => {
                let bucket = self.bucket(cut.position);
                let number = self.corners.len();
                self.buckets.entry(bucket).or_default().push(number);
                self.exact.push(cut.is_exact);
                self.corners.push(Corner {
                    position: cut.position,
                    normals: Vec::new(),
                });
            }
        }
    }
}

/// Makes arcs and corners of the creases of all pairs.
pub(super) fn join(setting: &Setting, curves: &[Curve]) -> (Vec<Crease>, Vec<Corner>) {
    let mut directory = Directory {
        same: SAME * setting.diagonal,
        corners: Vec::new(),
        exact: Vec::new(),
        buckets: HashMap::new(),
    };
    for curve in curves {
        for run in &curve.runs {
            corners(run).for_each(|cut| directory.add(cut));
        }
    }
    crossings(curves, &mut directory);
    let mut segments: Vec<Segment> = Vec::new();
    for curve in curves {
        let system = setting.system(curve.pair);
        for run in &curve.runs {
            for (from, to, endings) in split(run, &directory, curve.component.steps.len()) {
                let made = segment(
                    setting,
                    &system,
                    (curve, run),
                    [from, to],
                    endings,
                    &directory,
                );
                if let Some(made) = made
                    && !is_known(setting, &segments, &made)
                {
                    segments.push(made);
                }
            }
        }
    }
    let arcs = chains(segments);
    finish(setting, arcs, directory.corners)
}

/// Makes corners where creases cross that lead on beyond.
fn crossings(curves: &[Curve], directory: &mut Directory) {
    let mut passed = Directory {
        same: directory.same,
        corners: Vec::new(),
        exact: Vec::new(),
        buckets: HashMap::new(),
    };
    let mut tangents: Vec<DVec3> = Vec::new();
    for curve in curves {
        let steps = &curve.component.steps;
        for cut in curve.runs.iter().flat_map(|run| &run.inner) {
            let Some(step) = steps.get(cut.at as usize % steps.len().max(1)) else {
                continue;
            };
            match passed.find(cut.position) {
                Some(number) => {
                    if tangents[number].cross(step.direction).length() > SMOOTH {
                        directory.add(*cut);
                    }
                }
                None => {
                    passed.add(*cut);
                    tangents.push(step.direction);
                }
            }
        }
    }
}

/// The parts of a run between corners.
fn split(run: &Run, directory: &Directory, count: usize) -> Vec<(Cut, Cut, [Ending; 2])> {
    let is_corner = |cut: &&Cut| directory.find(cut.position).is_some();
    let inner: Vec<Cut> = run.inner.iter().filter(is_corner).copied().collect();
    let closed = run.endings == [Ending::None; 2];
    let (mut ends, mut endings) = (vec![run.from], vec![run.endings[0]]);
    ends.extend(&inner);
    ends.push(run.to);
    endings.extend(inner.iter().map(|_| Ending::Corner));
    endings.push(run.endings[1]);
    if let (true, Some(&first)) = (closed, inner.first()) {
        // All around from the first corner.
        let again = Cut {
            at: first.at + count as f64,
            ..first
        };
        ends = inner.clone();
        ends.push(again);
        endings = vec![Ending::Corner; ends.len()];
    }
    let pairs = ends.windows(2).zip(endings.windows(2));
    pairs
        .map(|(ends, endings)| (ends[0], ends[1], [endings[0], endings[1]]))
        .collect()
}

/// The crease between two cuts.
fn segment(
    setting: &Setting,
    system: &System,
    (curve, run): (&Curve, &Run),
    mut ends: [Cut; 2],
    endings: [Ending; 2],
    directory: &Directory,
) -> Option<Segment> {
    let mut corners = [None; 2];
    for (number, end) in ends.iter_mut().enumerate() {
        if endings[number] == Ending::Corner
            && let Some(corner) = directory.find(end.position)
        {
            corners[number] = Some(corner);
            end.position = directory.corners[corner].position;
        }
    }
    let shortest = SHORTEST * setting.diagonal;
    let steps = clip(system, &curve.component, ends, shortest);
    let (first, last) = (steps.first()?, steps.last()?);
    let tangent = |point: DVec3, along: DVec3| {
        let local = system.local(point);
        let place = local.and_then(|local| Place::along(point, local, along));
        place.map_or(along, |place| place.tangent)
    };
    Some(Segment {
        pair: curve.pair,
        signs: run.signs,
        corners,
        tangents: [
            tangent(first.from, first.direction),
            tangent(last.to, last.direction),
        ],
        closed: endings == [Ending::None; 2],
        steps,
    })
}

/// The steps of a curve between two cuts; those at the ends are shorter.
fn clip(system: &System, component: &Component, [from, to]: [Cut; 2], shortest: f64) -> Vec<Step> {
    let count = component.steps.len();
    let mut steps = Vec::new();
    let mut at = from.at;
    let mut here = from.position;
    while at < to.at {
        let number = at.floor();
        let Some(step) = component.steps.get(number as usize % count.max(1)) else {
            break;
        };
        let is_last = to.at <= number + 1.0;
        let there = if is_last { to.position } else { step.to };
        if here.distance(there) > shortest {
            let is_whole = here == step.from && there == step.to;
            steps.push(match is_whole {
                true => step.clone(),
                false => part(system, step, here, there),
            });
            here = there;
        }
        at = number + 1.0;
    }
    steps
}

/// The part of a step between two points.
fn part(system: &System, step: &Step, from: DVec3, to: DVec3) -> Step {
    let place = |point: DVec3| Place::along(point, system.local(point)?, step.direction);
    let made = match (step.straight, place(from), place(to)) {
        (false, Some(from), Some(to)) => Step::new(system, &from, &to),
        _ => None,
    };
    made.unwrap_or_else(|| Step::straight(from, to))
}

/// Whether another pair of pieces has the same crease.
fn is_known(setting: &Setting, segments: &[Segment], new: &Segment) -> bool {
    let Some(middle) = new.steps.get(new.steps.len() / 2) else {
        return true;
    };
    let point = middle.all_nodes()[2].1;
    let mut ends = new.corners;
    ends.sort_unstable();
    segments.iter().any(|known| {
        let mut others = known.corners;
        others.sort_unstable();
        if others != ends || known.pair == new.pair {
            return false;
        }
        let near = known.steps.iter().filter(|step| {
            let reach = step.chord;
            step.from.distance(point) <= 2.0 * reach || step.to.distance(point) <= 2.0 * reach
        });
        let system = setting.system(known.pair);
        let mut near = near.filter(|step| step.guess(0.5).distance(point) <= step.chord);
        near.any(|step| step.lies_on(&system, point))
    })
}

/// Links segments at corners where just two ends meet and lead on smoothly.
fn chains(mut segments: Vec<Segment>) -> Vec<Crease> {
    let mut ends: HashMap<usize, Vec<(usize, usize)>> = HashMap::new();
    for (number, segment) in segments.iter().enumerate() {
        for (end, corner) in segment.corners.iter().enumerate() {
            if let Some(corner) = corner {
                ends.entry(*corner).or_default().push((number, end));
            }
        }
    }
    // Out of a segment, away from the corner.
    let outward = |&(number, end): &(usize, usize)| {
        let tangent = segments[number].tangents[end];
        if end == 0 { tangent } else { -tangent }
    };
    let linked = |corner: usize| {
        let meeting = ends.get(&corner)?;
        let &[one, other] = meeting.as_slice() else {
            return None;
        };
        let (a, b) = (outward(&one), outward(&other));
        (a.dot(b) < 0.0 && a.cross(b).length() < SMOOTH).then_some([one, other])
    };
    let next = |number: usize, end: usize| {
        let [one, other] = linked(segments[number].corners[end]?)?;
        Some(if one == (number, end) { other } else { one })
    };
    let mut used = vec![false; segments.len()];
    let mut orders: Vec<(Vec<(usize, bool)>, bool)> = Vec::new();
    for number in 0..segments.len() {
        if std::mem::replace(&mut used[number], true) {
            continue;
        }
        let mut order = vec![(number, true)];
        let mut closed = segments[number].closed;
        for forward in [true, false] {
            let mut end = (number, usize::from(forward));
            while let Some((other, entry)) = next(end.0, end.1) {
                if std::mem::replace(&mut used[other], true) {
                    closed |= other == number;
                    break;
                }
                let is_ahead = (entry == 0) == forward;
                match forward {
                    true => order.push((other, is_ahead)),
                    false => order.insert(0, (other, is_ahead)),
                }
                end = (other, 1 - entry);
            }
            if closed {
                break;
            }
        }
        orders.push((order, closed));
    }
    let mut taken: Vec<Option<Segment>> = segments.drain(..).map(Some).collect();
    let arc = |(order, closed): (Vec<(usize, bool)>, bool)| {
        let parts = order.into_iter().filter_map(|(number, is_ahead)| {
            let segment = taken.get_mut(number)?.take()?;
            Some(if is_ahead {
                segment
            } else {
                segment.reversed()
            })
        });
        Crease::new(parts.collect(), closed)
    };
    orders.into_iter().map(arc).collect()
}

impl Segment {
    /// The same crease passed the other way.
    fn reversed(self) -> Segment {
        let [first, last] = self.corners;
        let [one, other] = self.tangents;
        Segment {
            steps: self.steps.iter().rev().map(Step::reversed).collect(),
            corners: [last, first],
            tangents: [-other, -one],
            ..self
        }
    }
}

impl Crease {
    fn new(parts: Vec<Segment>, closed: bool) -> Crease {
        let steps = parts.iter().flat_map(|part| &part.steps);
        let length = steps.map(|step| step.length).sum();
        let first = parts.first().and_then(|part| part.corners[0]);
        let last = parts.last().and_then(|part| part.corners[1]);
        Crease {
            length,
            closed,
            corners: if closed { [None; 2] } else { [first, last] },
            parts,
        }
    }
}

/// Leaves out corners at which no arc ends, and gives the others their normals.
fn finish(
    setting: &Setting,
    mut arcs: Vec<Crease>,
    corners: Vec<Corner>,
) -> (Vec<Crease>, Vec<Corner>) {
    let mut numbers: Vec<Option<usize>> = vec![None; corners.len()];
    for corner in arcs.iter().flat_map(|arc| arc.corners).flatten() {
        numbers[corner] = Some(0);
    }
    let mut kept: Vec<Corner> = Vec::new();
    for (corner, number) in corners.into_iter().zip(&mut numbers) {
        if number.is_some() {
            *number = Some(kept.len());
            kept.push(corner);
        }
    }
    for arc in &mut arcs {
        arc.corners = arc.corners.map(|corner| numbers.get(corner?).copied()?);
        let ends = [
            (arc.parts.first(), arc.corners[0]),
            (arc.parts.last(), arc.corners[1]),
        ];
        for (part, corner) in ends {
            let (Some(part), Some(corner)) = (part, corner) else {
                continue;
            };
            let corner = &mut kept[corner];
            if let Some(local) = setting.system(part.pair).local(corner.position) {
                for (normal, sign) in local.normals.into_iter().zip(part.signs) {
                    corner.note(sign * normal);
                }
            }
        }
    }
    (arcs, kept)
}
