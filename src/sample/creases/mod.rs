//! Creases and corners: where the gradient of a field jumps on its zero set.
//!
//! Points that spread by repulsion pile up at sharp edges. Meyer, Kirby and Whitaker ("Topology,
//! accuracy, and quality of isosurface meshes using dynamic particles", 2007) and Bronson, Levine
//! and Whitaker ("Particle systems for adaptive, isotropic meshing of CAD models", 2012) put points
//! on corners first, then on edges, then on faces. Here corners and edges are found, and points on
//! them.
//!
//! In reading order: the engine tells which smooth pieces of the field meet where
//! ([`crate::engine::pieces`]); the curves on which two of them vanish are followed by continuation
//! (`curves`); the roots of others on them cut each curve into parts (`cuts`), of which those are
//! creases at which the zero set has sheets of both pieces (`sheets`); parts are joined in corners
//! (`corner`, `join`); and points are placed (`points`). In the plane creases are points (`plane`).
//!
//! What is complete, and what not: cells in which pieces may meet come from enclosures, and so do
//! the curves; cells in which nothing could be decided are counted. Angles of less than a degree
//! are no creases. A point at which a single piece has no gradient (the tip of a cone, an edge of
//! an R-function) is not found, and its cell is counted as undecided if choices are open in it.

mod corner;
mod curves;
mod cuts;
mod join;
mod plane;
mod points;
mod sheets;

pub use self::corner::Corner;
pub use self::points::CreasePoint;

use std::collections::HashSet;

use self::join::Segment;
use crate::continuation::System;
use crate::engine::{CompiledField, Field, Monitor, Pieces, pieces};
use crate::geometry::Bounds;

/// Halvings of the box into the cells in which pieces meet.
const HALVINGS: u32 = 6;

/// Further halvings of cells in which a piece may have no gradient, and the most cells that are
/// looked at so closely.
const CLOSER: u32 = 3;
const CLOSER_LOOKS: usize = 1 << 10;

/// A crease: a curve between two corners or sides of the box, or a closed one.
#[derive(Clone, Debug)]
pub struct Crease {
    /// In order: smooth parts on which two pieces of the field vanish.
    parts: Vec<Segment>,
    /// Whether it has no ends.
    pub closed: bool,
    /// Its arc length.
    pub length: f64,
    /// The corners at its ends, by their places in [`Creases::corners`]; none at the side of the
    /// box.
    pub corners: [Option<usize>; 2],
}

/// What was done to find the creases, and what is not certain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CreaseReport {
    /// Smooth pieces that meet others.
    pub pieces: u64,
    /// Cells in which they meet.
    pub cells: u64,
    /// Evaluations of pieces, enclosures included.
    pub evaluations: u64,
    /// Cells of which nothing could be proven: a crease that was missed lies in such cells.
    pub undecided: u64,
}

/// The creases and corners of a zero set.
pub struct Creases {
    /// The creases; none in R2.
    pub arcs: Vec<Crease>,
    /// The points in which they end or meet.
    pub corners: Vec<Corner>,
    /// How they were found.
    pub report: CreaseReport,
    pieces: Pieces,
    field: CompiledField,
    bounds: Bounds,
    tolerance: f64,
}

/// What every step of the search needs to know.
pub(super) struct Setting<'a> {
    field: &'a CompiledField,
    pieces: &'a Pieces,
    bounds: Bounds,
    diagonal: f64,
    /// The largest distance from both sides that is accepted.
    tolerance: f64,
    /// The shortest side of a cell in which pieces meet.
    finest: f64,
}

impl<'a> Setting<'a> {
    fn new(
        field: &'a CompiledField,
        pieces: &'a Pieces,
        bounds: Bounds,
        tolerance: f64,
    ) -> Setting<'a> {
        Setting {
            field,
            pieces,
            bounds,
            diagonal: bounds.diagonal(),
            tolerance,
            finest: pieces.finest(),
        }
    }

    /// The equations of the curve on which two pieces vanish.
    fn system(&self, pair: [u32; 2]) -> System<'a> {
        let pieces = self.pieces;
        let fields = pair.map(|piece| &pieces.fields[piece as usize] as &dyn Field);
        System::new(fields.to_vec(), self.diagonal, self.tolerance)
    }
}

/// Finds the creases and corners of a field in a box, to a distance of `tolerance`. For fields in
/// R2 and R3; in R1 there are none. `None` if the monitor cancelled.
///
/// The result does not depend on the number of threads. A field without choices costs a look at its
/// graph. Otherwise the cost is that of [`pieces`], and for each crease some hundred enclosures and
/// some thousand evaluations of the two pieces that it lies on, whatever the size of the whole
/// field.
pub fn creases(
    field: &CompiledField,
    bounds: Bounds,
    tolerance: f64,
    monitor: &dyn Monitor,
) -> Option<Creases> {
    let pieces = pieces(field, bounds.min, bounds.max, HALVINGS, monitor)?;
    let setting = Setting::new(field, &pieces, bounds, tolerance);
    let mut report = CreaseReport {
        pieces: pieces.fields.len() as u64,
        cells: pieces.meetings.len() as u64,
        undecided: pieces.undecided.len() as u64,
        evaluations: 0,
    };
    let (arcs, corners) = match bounds.dimension {
        2 => {
            let (corners, undecided) = plane::corners(&setting, monitor)?;
            report.undecided += undecided;
            (Vec::new(), corners)
        }
        3 => {
            let found = curves::follow(&setting, monitor)?;
            report.undecided += found.iter().map(|found| found.undecided).sum::<u64>();
            report.evaluations += found.iter().map(|found| found.evaluations).sum::<u64>();
            let curves: Vec<_> = found.into_iter().flat_map(|found| found.curves).collect();
            join::join(&setting, &curves)
        }
        _ => (Vec::new(), Vec::new()),
    };
    report.undecided += singular(&setting, &arcs, &corners, monitor)?;
    let field = CompiledField::new(field.program().clone(), field.parameters().to_vec());
    Some(Creases {
        arcs,
        corners,
        report,
        pieces,
        field,
        bounds,
        tolerance,
    })
}

/// The number of cells in which a piece may have no gradient, and where no crease was found; a
/// closer look clears most. `None` if the monitor cancelled.
fn singular(
    setting: &Setting,
    arcs: &[Crease],
    corners: &[Corner],
    monitor: &dyn Monitor,
) -> Option<u64> {
    let steps = arcs.iter().flat_map(|arc| &arc.parts);
    let steps = steps.flat_map(|part| &part.steps);
    let on_arcs = steps.flat_map(|step| {
        let count = (2.0 * step.chord / setting.finest).ceil().max(1.0) as u32;
        (0..=count).map(move |place| step.guess(f64::from(place) / f64::from(count)))
    });
    let in_corners = corners.iter().map(|corner| corner.position);
    let mut seen: HashSet<usize> = HashSet::new();
    for point in on_arcs.chain(in_corners) {
        seen.extend(setting.pieces.around(point, 0.5 * setting.finest));
    }
    let meetings = setting.pieces.meetings.iter().enumerate();
    let unseen =
        meetings.filter(|(place, meeting)| !meeting.singular.is_empty() && !seen.contains(place));
    let mut count = 0;
    for (number, (_, meeting)) in unseen.enumerate() {
        if number < CLOSER_LOOKS {
            let (low, high) = (meeting.low, meeting.high);
            let quiet = curves::Quiet(monitor);
            let found = pieces(setting.field, low, high, CLOSER, &quiet)?;
            let mut meetings = found.meetings.iter();
            let is_clear = meetings.all(|part| part.singular.is_empty());
            count += u64::from(!(is_clear && found.undecided.is_empty()));
        } else {
            count += 1;
        }
    }
    Some(count)
}

impl Creases {
    fn setting(&self) -> Setting<'_> {
        Setting::new(&self.field, &self.pieces, self.bounds, self.tolerance)
    }
}
