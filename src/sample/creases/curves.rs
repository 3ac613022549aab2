//! The curves on which two pieces of a field vanish, each with the parts of it that are creases.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::Setting;
use super::cuts::{Run, runs};
use super::sheets::SMALLEST_SINE;
use crate::engine::{Meeting, Monitor, Pieces};
use crate::sample::trace::{Cell, Component, Region, Walker, trace};

/// The most cells that are enclosed for two pieces, in addition to so many for each cell in which
/// they meet.
const MOST_CELLS: u64 = 1 << 12;
const CELLS_EACH: u64 = 64;

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

/// Follows the curves of all pairs and finds the creases on them. In the order of the pairs, whatever
/// the number of threads. `None` if the monitor cancelled.
pub(super) fn follow(setting: &Setting, monitor: &dyn Monitor) -> Option<Vec<Found>> {
    let pairs: Vec<([u32; 2], Vec<usize>)> = pairs(setting.pieces).into_iter().collect();
    pairs
        .par_iter()
        .map(|(pair, places)| follow_pair(setting, *pair, places, monitor))
        .collect()
}

/// Follows the curves of two pieces.
fn follow_pair(
    setting: &Setting,
    pair: [u32; 2],
    places: &[usize],
    monitor: &dyn Monitor,
) -> Option<Found> {
    if monitor.cancelled() {
        return None;
    }
    let system = setting.system(pair);
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
        most_cells: MOST_CELLS + CELLS_EACH * places.len() as u64,
    };
    let walker = Walker {
        system: &system,
        bounds: setting.bounds,
        compiled: system.compiled(),
    };
    let traced = trace(&walker, &region, &Quiet(monitor))?;
    let mut undecided = traced.undecided;
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

/// Passes only the wish to stop on: each pair has a progress of its own.
struct Quiet<'a>(&'a dyn Monitor);

impl Monitor for Quiet<'_> {
    fn progress(&self, _phase: &str, _fraction: f64) {}

    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}
