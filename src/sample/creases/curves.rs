//! The curves on which two pieces of a field vanish, each with the parts of it that are creases.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;

use super::Setting;
use super::cuts::{Run, runs};
use super::sheets::{SMALLEST_SINE, onto};
use crate::continuation::{Cell, Component, Region, System, Walker, trace};
use crate::engine::{Meeting, Monitor, Pieces};

/// The most cells that are enclosed for two pieces at first. Pairs for which that is not enough
/// share the second number, but none gets more than the third.
const FIRST_CELLS: u64 = 1 << 12;
const SHARED_CELLS: u64 = 1 << 19;
const MOST_CELLS: u64 = 1 << 17;

/// Whether two pieces are one is judged in so many cells at the most, and by so many places at
/// least.
const MOST_LOOKED_AT: usize = 64;
const FEWEST_LOOKED_AT: u32 = 3;

/// Surfaces that are closer than this part of the diagonal, and whose normals have a smaller sine
/// between them, are one.
const SAME: f64 = 1e-10;
const PARALLEL: f64 = 1e-7;

/// A connected curve on which two pieces vanish.
pub(super) struct Curve {
    /// The pieces.
    pub(super) pair: [u32; 2],
    pub(super) component: Component,
    /// The parts that are creases.
    pub(super) runs: Vec<Run>,
}

/// What two pieces gave.
pub(super) struct Found {
    pub(super) curves: Vec<Curve>,
    /// Cells of which nothing could be proven.
    pub(super) undecided: u64,
    pub(super) evaluations: u64,
}

/// The pairs of pieces that may meet, each with the places of the meetings.
pub(super) fn pairs(pieces: &Pieces) -> BTreeMap<[u32; 2], Vec<usize>> {
    let mut pairs: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
    for (place, meeting) in pieces.meetings.iter().enumerate() {
        let regular: Vec<u32> = regular(meeting).collect();
        for (number, &first) in regular.iter().enumerate() {
            for &second in &regular[number + 1..] {
                pairs.entry([first, second]).or_default().push(place);
            }
        }
    }
    pairs
}

/// The pieces of a meeting that have a gradient in its cell.
pub(super) fn regular(meeting: &Meeting) -> impl Iterator<Item = u32> {
    let pieces = meeting.pieces.iter().copied();
    pieces.filter(|piece| !meeting.singular.contains(piece))
}

/// Follows the curves of all pairs and finds the creases on them. In the order of the pairs,
/// whatever the number of threads. `None` if the monitor cancelled.
pub(super) fn follow(setting: &Setting, monitor: &dyn Monitor) -> Option<Vec<Found>> {
    let pairs: Vec<([u32; 2], Vec<usize>)> = pairs(setting.pieces).into_iter().collect();
    let first: Option<Vec<Found>> = pairs
        .par_iter()
        .map(|(pair, places)| follow_pair(setting, *pair, places, FIRST_CELLS, monitor))
        .collect();
    let first = first?;
    let open = first.iter().filter(|found| found.undecided > 0).count() as u64;
    let share = (SHARED_CELLS / open.max(1)).min(MOST_CELLS);
    pairs
        .par_iter()
        .zip(first)
        .map(|((pair, places), found)| {
            if found.undecided == 0 || share < 2 * FIRST_CELLS {
                return Some(found);
            }
            let again = follow_pair(setting, *pair, places, share, monitor)?;
            Some(Found {
                evaluations: again.evaluations + found.evaluations,
                ..again
            })
        })
        .collect()
}

/// Follows the curves of two pieces, and encloses no more cells than these.
fn follow_pair(
    setting: &Setting,
    pair: [u32; 2],
    places: &[usize],
    most_cells: u64,
    monitor: &dyn Monitor,
) -> Option<Found> {
    if monitor.cancelled() {
        return None;
    }
    let system = setting.system(pair);
    if are_one(&system, setting.pieces, places) {
        return Some(Found {
            curves: Vec::new(),
            undecided: 0,
            evaluations: system.counts().0,
        });
    }
    let cells = places.iter().map(|&place| {
        let meeting = &setting.pieces.meetings[place];
        let cell = Cell {
            low: meeting.low,
            high: meeting.high,
        };
        (cell, meeting.depth)
    });
    let region = Region {
        cells: cells.collect(),
        smallest_sine: SMALLEST_SINE,
        most_cells,
    };
    let walker = Walker {
        system: &system,
        bounds: setting.bounds,
        compiled: system.compiled(),
    };
    let traced = trace(&walker, &region, &Quiet(monitor))?;
    let mut undecided = traced.undecided - traced.undecided_at_singular;
    let mut curves = Vec::new();
    for component in traced.components {
        let (runs, left) = runs(setting, &system, pair, &component, &traced.events);
        undecided += left;
        if !runs.is_empty() {
            curves.push(Curve {
                pair,
                component,
                runs,
            });
        }
    }
    Some(Found {
        curves,
        undecided,
        evaluations: system.counts().0,
    })
}

/// Whether two pieces vanish on the same surface, as far as places all over the cells in which they
/// meet can tell: then they are one function in two forms, or touch all over it, and make no
/// crease.
fn are_one(system: &System, pieces: &Pieces, places: &[usize]) -> bool {
    let stride = places.len().div_ceil(MOST_LOOKED_AT);
    let mut count = 0;
    for &place in places.iter().step_by(stride.max(1)) {
        let meeting = &pieces.meetings[place];
        let (middle, size) = (
            meeting.low.midpoint(meeting.high),
            meeting.high - meeting.low,
        );
        for corner in 0..8 {
            let part = [0.25, -0.25];
            let offset = DVec3::new(part[corner & 1], part[corner >> 1 & 1], part[corner >> 2]);
            let start = middle + offset * size;
            let Some(point) = system.fields.first().and_then(|&one| onto(one, start)) else {
                continue;
            };
            if point.distance(start) > size.length() {
                continue;
            }
            let Some(local) = system.local(point) else {
                continue;
            };
            let apart = local.residual() > SAME * system.diagonal;
            if apart || local.direction().length() > PARALLEL {
                return false;
            }
            count += 1;
        }
    }
    count >= FEWEST_LOOKED_AT
}

/// Passes only the wish to stop on: each pair has a progress of its own.
pub(super) struct Quiet<'a>(pub(super) &'a dyn Monitor);

impl Monitor for Quiet<'_> {
    fn progress(&self, _phase: &str, _fraction: f64) {}

    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}
