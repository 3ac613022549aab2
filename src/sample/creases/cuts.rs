//! Which parts of a curve on which two pieces vanish are creases.
//!
//! What happens on the curve can change only where a third piece vanishes: the field is continuous,
//! and where a sheet ends, another one begins. So the roots of all pieces that come near the curve
//! cut it into parts, and of each part one place tells. The roots are found between samples that
//! are closer than the cells in which pieces meet: by changes of sign and, where a piece turns
//! round between two samples, at the turn.

use crate::geometry::length;
use glam::DVec3;

use super::Setting;
use super::corner::on_three;
use super::sheets;
use crate::continuation::{Component, Events, Place, Step, System};
use crate::engine::Field;
use crate::sample::evaluation::Batch;

/// Samples in the shortest side of a cell.
const DENSITY: f64 = 2.0;

/// The most samples in a step.
const MOST_SAMPLES: f64 = 64.0;

/// Pieces that are closer to the curve than this part of the diagonal have no sign.
const FLAT: f64 = 1e-11;

/// Cuts closer than this part of the diagonal are one.
const SAME: f64 = 1e-8;

/// Singular points lie on the curve if they are within this part of the diagonal.
const NEAR: f64 = 1e-5;

/// Where on the way between two cuts it is looked whether there is a crease.
const LOOKS: [f64; 3] = [0.1, 0.5, 0.9];

/// Projections that put a crossing on both surfaces.
const POLISHES: usize = 6;

/// Halvings of a bracket, each of which is a part of a step.
const HALVINGS: u32 = 48;

/// A point in which a curve is cut.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cut {
    /// The number of the step, and the part of it.
    pub(super) at: f64,
    pub(super) position: DVec3,
    /// Whether the position was found by Newton's method.
    pub(super) is_exact: bool,
    /// Whether branches of the curve itself cross here.
    pub(super) is_crossing: bool,
}

/// What is at the end of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ending {
    /// A corner.
    Corner,
    /// The border of the box.
    Border,
    /// Nothing: the run is closed.
    None,
}

/// A part of a curve that is a crease.
#[derive(Clone, Debug)]
pub(super) struct Run {
    /// Where it begins and ends; on closed curves the end may be beyond the last step.
    pub(super) from: Cut,
    pub(super) to: Cut,
    pub(super) endings: [Ending; 2],
    /// Cuts in between, which are corners if another crease ends there.
    pub(super) inner: Vec<Cut>,
    /// The signs by which the pieces' normals are the field's.
    pub(super) signs: [f64; 2],
}

/// A sample of the curve near cells in which both pieces meet.
#[derive(Clone, Copy)]
struct Sample {
    at: f64,
    place: Place,
}

/// A curve, and how to find places on it.
struct Track<'a> {
    setting: &'a Setting<'a>,
    system: &'a System<'a>,
    pair: [u32; 2],
    component: &'a Component,
}

/// The runs of a curve, and how many parts could not be judged.
pub(super) fn runs(
    setting: &Setting,
    system: &System,
    pair: [u32; 2],
    component: &Component,
    events: &Events,
) -> (Vec<Run>, u64) {
    let track = Track {
        setting,
        system,
        pair,
        component,
    };
    let mut cuts: Vec<Cut> = Vec::new();
    for stretch in track.stretches() {
        track.cut(&stretch, &mut cuts);
    }
    let singular = events.crossings.iter().chain(&events.corners);
    cuts.extend(singular.filter_map(|&point| track.crossing(point)));
    let count = component.steps.len() as f64;
    if !component.closed {
        for (at, end) in [
            (0.0, component.steps.first()),
            (count, component.steps.last()),
        ] {
            let position = end.map(|step| if at == 0.0 { step.from } else { step.to });
            cuts.extend(position.map(|position| Cut {
                at,
                position,
                is_exact: true,
                is_crossing: false,
            }));
        }
    }
    cuts.sort_by(|one, other| one.at.total_cmp(&other.at));
    track.unite(&mut cuts);
    track.judge(&cuts)
}

impl Track<'_> {
    /// The step and the part of it at a place of the curve.
    fn step(&self, at: f64) -> Option<(&Step, f64)> {
        let steps = &self.component.steps;
        let last = steps.len().checked_sub(1)?;
        let at = match self.component.closed && at >= steps.len() as f64 {
            true => at - steps.len() as f64,
            false => at,
        };
        let number = (at.max(0.0) as usize).min(last);
        Some((&steps[number], (at - number as f64).clamp(0.0, 1.0)))
    }

    fn place(&self, at: f64) -> Option<Place> {
        let (step, part) = self.step(at)?;
        step.at(self.system, part)
    }

    /// The pieces that meet near a point if both pieces of the curve are among them.
    fn company(&self, point: DVec3, reach: f64) -> Option<Vec<u32>> {
        let mut company: Vec<u32> = Vec::new();
        let mut both = false;
        for place in self.setting.pieces.around(point, reach) {
            let meeting = &self.setting.pieces.meetings[place];
            both |= self.pair.iter().all(|piece| meeting.pieces.contains(piece));
            company.extend(&meeting.pieces);
        }
        company.sort_unstable();
        company.dedup();
        company.retain(|piece| !self.pair.contains(piece));
        both.then_some(company)
    }

    /// Connected lists of samples near which both pieces meet, and the other pieces near them.
    fn stretches(&self) -> Vec<(Vec<Sample>, Vec<u32>)> {
        let apart = self.setting.finest / DENSITY;
        let mut stretches: Vec<(Vec<Sample>, Vec<u32>)> = Vec::new();
        let mut is_open = false;
        let steps = self.component.steps.iter().enumerate();
        for (number, step) in steps {
            let count = (step.chord / apart).ceil().clamp(1.0, MOST_SAMPLES);
            let first = u32::from(number > 0);
            for sample in first..=count as u32 {
                let part = f64::from(sample) / count;
                let Some(company) = self.company(step.guess(part), apart) else {
                    is_open = false;
                    continue;
                };
                let Some(place) = step.at(self.system, part) else {
                    continue;
                };
                if !is_open {
                    stretches.push((Vec::new(), Vec::new()));
                }
                is_open = true;
                if let Some((samples, others)) = stretches.last_mut() {
                    let at = number as f64 + part;
                    samples.push(Sample { at, place });
                    others.extend(company);
                }
            }
        }
        for (_, others) in &mut stretches {
            others.sort_unstable();
            others.dedup();
        }
        stretches
    }

    /// The roots of other pieces on a stretch.
    fn cut(&self, (samples, others): &(Vec<Sample>, Vec<u32>), cuts: &mut Vec<Cut>) {
        let mut batch = Batch::default();
        for &other in others {
            let field = &self.setting.pieces.fields[other as usize];
            let positions = samples.iter().map(|sample| sample.place.position);
            self.system.count(samples.len() as u64);
            // The distance from the other piece, and how it changes along the curve.
            let values: Vec<(f64, f64)> = batch
                .evaluate(field, positions)
                .zip(samples)
                .map(|(here, sample)| {
                    let slope = length(here.gradient);
                    let distance = here.value / slope;
                    let change = here.gradient.dot(sample.place.tangent) / slope;
                    match distance.abs() <= FLAT * self.setting.diagonal {
                        true => (0.0, change),
                        false => (distance, change),
                    }
                })
                .collect();
            self.roots(other, samples, &values, cuts);
        }
    }

    /// The roots of one piece.
    fn roots(&self, other: u32, samples: &[Sample], values: &[(f64, f64)], cuts: &mut Vec<Cut>) {
        let mut last: Option<usize> = None;
        for (place, &(value, change)) in values.iter().enumerate() {
            if value == 0.0 || value.is_nan() {
                continue;
            }
            if let Some(before) = last {
                let (old, slope) = values[before];
                let (from, to) = (samples[before].at, samples[place].at);
                let turns = old * slope < 0.0 && value * change > 0.0;
                if old * value < 0.0 {
                    cuts.extend(self.root(other, from, to, old));
                } else if place - before == 2 {
                    // It touches the curve in a sample.
                    cuts.extend(self.finish(other, samples[before + 1].at));
                } else if turns && place - before == 1 {
                    self.double_root(other, (from, to), old, cuts);
                }
            }
            last = Some(place);
        }
    }

    /// The distance of a place from another piece and its change.
    fn distance(&self, other: u32, at: f64) -> Option<(f64, f64)> {
        let place = self.place(at)?;
        let field = &self.setting.pieces.fields[other as usize];
        self.system.count(1);
        let (value, gradient) = field.value_gradient(place.position);
        let slope = length(gradient);
        let result = (value / slope, gradient.dot(place.tangent) / slope);
        (result.0.is_finite() && result.1.is_finite()).then_some(result)
    }

    /// The root between two places, at the first of which the other piece has this sign.
    fn root(&self, other: u32, from: f64, to: f64, sign: f64) -> Option<Cut> {
        let (mut before, mut behind) = (from, to);
        for _ in 0..HALVINGS {
            let middle = before.midpoint(behind);
            if middle <= before || middle >= behind {
                break;
            }
            match self.distance(other, middle) {
                Some((value, _)) if value * sign > 0.0 => before = middle,
                Some(_) => behind = middle,
                None => break,
            }
        }
        self.finish(other, before.midpoint(behind))
    }

    /// The roots around the place between two others where the distance from another piece is
    /// least.
    fn double_root(&self, other: u32, (from, to): (f64, f64), sign: f64, cuts: &mut Vec<Cut>) {
        let (mut before, mut behind) = (from, to);
        for _ in 0..HALVINGS {
            let middle = before.midpoint(behind);
            let Some((value, change)) = self.distance(other, middle) else {
                return;
            };
            if value * sign < 0.0 {
                cuts.extend(self.root(other, from, middle, sign));
                cuts.extend(self.root(other, middle, to, -sign));
                return;
            }
            if value.abs() <= FLAT * self.setting.diagonal {
                cuts.extend(self.finish(other, middle));
                return;
            }
            match change * sign < 0.0 {
                true => before = middle,
                false => behind = middle,
            }
        }
    }

    /// The cut at a root that is nearly known: where all three pieces vanish.
    fn finish(&self, other: u32, at: f64) -> Option<Cut> {
        let near = self.place(at)?.position;
        let fields = [self.pair[0], self.pair[1], other];
        let exact = on_three(self.setting, fields, near);
        Some(Cut {
            at,
            position: exact.unwrap_or(near),
            is_exact: exact.is_some(),
            is_crossing: false,
        })
    }

    /// The cut at a singular point of the curve, if it is on this component.
    fn crossing(&self, point: DVec3) -> Option<Cut> {
        let near = NEAR * self.setting.diagonal;
        let steps = self.component.steps.iter().enumerate();
        let places = steps.filter_map(|(number, step)| {
            let part = (point - step.from).dot(step.direction) / step.chord;
            let part = part.clamp(0.0, 1.0);
            let apart = step.guess(part).distance(point);
            (apart <= near).then_some((apart, number as f64 + part))
        });
        let (_, at) = places.min_by(|one, other| one.0.total_cmp(&other.0))?;
        // Both surfaces have one tangent plane here.
        let mut position = point;
        for piece in self.system.fields.iter().cycle().take(POLISHES) {
            position = sheets::onto(*piece, position).filter(|to| to.distance(point) <= near)?;
        }
        Some(Cut {
            at,
            position,
            is_exact: false,
            is_crossing: true,
        })
    }

    /// Makes one of cuts at the same point: the one that is known best.
    fn unite(&self, cuts: &mut Vec<Cut>) {
        let same = |one: &Cut, other: &Cut| {
            let loose = one.is_crossing || other.is_crossing;
            let near = if loose { NEAR } else { SAME };
            one.position.distance(other.position) <= near * self.setting.diagonal
        };
        cuts.dedup_by(|next, kept| {
            let is_same = same(next, kept);
            if is_same {
                let is_crossing = kept.is_crossing || next.is_crossing;
                if next.is_exact && !kept.is_exact {
                    *kept = *next;
                }
                kept.is_crossing = is_crossing;
            }
            is_same
        });
        let count = self.component.steps.len() as f64;
        let is_round = self.component.closed && cuts.len() > 1;
        if is_round
            && let (Some(first), Some(last)) = (cuts.first().copied(), cuts.last())
            && first.at + count - last.at < 0.5 * count
            && same(&first, last)
        {
            cuts.pop();
        }
    }

    /// Finds out which parts between cuts are creases, and joins those that follow each other.
    fn judge(&self, cuts: &[Cut]) -> (Vec<Run>, u64) {
        let count = self.component.steps.len() as f64;
        if cuts.is_empty() {
            return self.whole();
        }
        let mut ends: Vec<Cut> = cuts.to_vec();
        if self.component.closed {
            ends.push(Cut {
                at: cuts[0].at + count,
                ..cuts[0]
            });
        }
        let undecided = self.complete(&mut ends);
        let mut runs: Vec<Run> = Vec::new();
        for two in ends.windows(2) {
            let Some(signs) = self.crease_between(&two[0], &two[1], 0.5) else {
                continue;
            };
            let follows = runs.last_mut().filter(|run| run.to.at == two[0].at);
            match follows {
                Some(run) => {
                    run.inner.push(run.to);
                    run.to = two[1];
                }
                None => runs.push(Run {
                    from: two[0],
                    to: two[1],
                    endings: [Ending::Corner; 2],
                    inner: Vec::new(),
                    signs,
                }),
            }
        }
        if self.component.closed {
            close(&mut runs, count);
        } else {
            for run in &mut runs {
                for (ending, cut) in run.endings.iter_mut().zip([run.from, run.to]) {
                    let is_end = cut.at == 0.0 || cut.at == count;
                    if is_end && self.is_on_border(cut.position) {
                        *ending = Ending::Border;
                    }
                }
            }
        }
        (runs, undecided)
    }

    /// The run of a closed curve without cuts.
    fn whole(&self) -> (Vec<Run>, u64) {
        let Some(step) = self.component.steps.first() else {
            return (Vec::new(), 0);
        };
        let end = |at: f64| Cut {
            at,
            position: step.from,
            is_exact: true,
            is_crossing: false,
        };
        let mut ends = vec![end(0.0), end(self.component.steps.len() as f64)];
        let unexplained = self.complete(&mut ends);
        if ends.len() > 2 {
            // It is not the same all around.
            let (runs, more) = self.judge(&ends[1..ends.len() - 1]);
            return (runs, unexplained + more);
        }
        let run = self
            .crease_between(&ends[0], &ends[1], 0.5)
            .map(|signs| Run {
                from: ends[0],
                to: ends[1],
                endings: [Ending::None; 2],
                inner: Vec::new(),
                signs,
            });
        (run.into_iter().collect(), unexplained)
    }

    /// Adds cuts where what is at several places between two cuts is not the same, found by
    /// bisection: how many apart from those at which the angle becomes too small. Not all pieces
    /// were known there.
    fn complete(&self, ends: &mut Vec<Cut>) -> u64 {
        let mut missed: Vec<Cut> = Vec::new();
        let mut unexplained = 0;
        for two in ends.windows(2) {
            let is_crease = |part: f64| self.crease_between(&two[0], &two[1], part).is_some();
            let found = LOOKS.map(is_crease);
            for (number, change) in found.windows(2).enumerate() {
                if change[0] == change[1] {
                    continue;
                }
                let (mut before, mut behind) = (LOOKS[number], LOOKS[number + 1]);
                for _ in 0..HALVINGS {
                    let middle = before.midpoint(behind);
                    match is_crease(middle) == change[0] {
                        true => before = middle,
                        false => behind = middle,
                    }
                }
                let at = two[0].at + before.midpoint(behind) * (two[1].at - two[0].at);
                if let Some(place) = self.place(at) {
                    let sine = place.local.direction().length();
                    unexplained += u64::from(sine > 1.01 * sheets::SMALLEST_SINE);
                    missed.push(Cut {
                        at,
                        position: place.position,
                        is_exact: false,
                        is_crossing: false,
                    });
                }
            }
        }
        ends.extend(missed);
        ends.sort_by(|one, other| one.at.total_cmp(&other.at));
        unexplained
    }

    /// The signs of the normals if there is a crease at a part of the way between two cuts.
    fn crease_between(&self, from: &Cut, to: &Cut, part: f64) -> Option<[f64; 2]> {
        let place = self.place(from.at + part * (to.at - from.at))?;
        let ends = [from.position, to.position].map(|end| end.distance(place.position));
        let room = match from.position == to.position {
            true => self.setting.diagonal,
            false => ends[0].min(ends[1]),
        };
        sheets::crease(self.setting, self.system, &place, 0.05 * room)
    }

    /// Whether a point lies in a side of the box, up to rounding.
    fn is_on_border(&self, point: DVec3) -> bool {
        let bounds = self.setting.bounds;
        let near = SAME * self.setting.diagonal;
        (0..bounds.dimension).any(|axis| {
            let to_side = (point[axis] - bounds.min[axis]).min(bounds.max[axis] - point[axis]);
            to_side <= near
        })
    }
}

/// Joins the last run of a closed curve with the first where they follow each other.
fn close(runs: &mut Vec<Run>, count: f64) {
    let (Some(first), Some(last)) = (runs.first().cloned(), runs.last().cloned()) else {
        return;
    };
    if last.to.at != first.from.at + count {
        return;
    }
    if runs.len() == 1 {
        // All around.
        runs[0].inner.insert(0, first.from);
        runs[0].endings = [Ending::None; 2];
        return;
    }
    let mut joined = last;
    joined.inner.push(joined.to);
    let beyond = |cut: Cut| Cut {
        at: cut.at + count,
        ..cut
    };
    joined.inner.extend(first.inner.into_iter().map(beyond));
    joined.to = beyond(first.to);
    runs.pop();
    runs[0] = joined;
}

/// The cuts of a run that are corners: its ends, and where branches cross.
pub(super) fn corners(run: &Run) -> impl Iterator<Item = Cut> {
    let ends = [run.from, run.to].into_iter().zip(run.endings);
    let ends = ends.filter(|(_, ending)| *ending == Ending::Corner);
    let crossings = run.inner.iter().filter(|cut| cut.is_crossing).copied();
    ends.map(|(cut, _)| cut).chain(crossings)
}
