//! The smooth pieces that a field is made of, and where several of them meet.
//!
//! Wherever all min, max, abs, select, comparisons and step functions of a field are decided, it is
//! one smooth function: a *piece*, such as one sphere of a union. Its zero set can have creases
//! only where two pieces vanish. [`pieces`] subdivides a box: cells in which the field's enclosure
//! excludes 0 or all choices are decided end there; in the others the open choices are gone through
//! (`pattern`), and the pieces whose enclosures hold 0 are those that may meet there. Equal pieces
//! of different cells are one.
//!
//! That is complete: a point at which two pieces of the zero set meet lies in a cell that names
//! both, or in one that is told to be undecided. A piece that is named need not take part.
//!
//! The cost is an enclosure of the field as pruned for its surroundings for each cell, of which
//! there are some tens for each cell's length of crease, and the pieces' own in those that are
//! left. A field without such operations costs a look at its graph.

mod pattern;
mod steps;

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use self::steps::Step;
use super::{CompiledField, Field, Monitor, Program};
use crate::graph::interval::{Enclosure, Regularity};
use crate::graph::{Graph, Node, NodeId};

/// Cells are enclosed with so much of their sides around them.
const BEYOND: f64 = 1e-6;

/// Cells whose choices are too many are given up after so many more halvings.
const DEEPER: u32 = 4;

/// The most cells that are looked at.
const MOST_CELLS: usize = 1 << 19;

/// Cells with more open choices are split before these are gone through.
const MOST_CHOICES: usize = 24;

/// More pieces than these do not meet in a cell that is small enough.
const MOST_PIECES: usize = 64;

/// Functions whose ratio is the same at all probes to this accuracy are multiples of each other.
const PROBES: usize = 8;
const SAME: f64 = 1e-10;

/// A cell in which several pieces may vanish.
#[derive(Clone, Debug)]
pub struct Meeting {
    /// Its lower corner. Axes beyond the dimension are 0.
    pub low: DVec3,
    /// Its upper corner.
    pub high: DVec3,
    /// How often the box was halved.
    pub depth: u32,
    /// The pieces, by their places in [`Pieces::fields`], ascending.
    pub pieces: Vec<u32>,
    /// Those among them that may have no gradient in the cell, as √(u² + v²) where u = v = 0.
    pub singular: Vec<u32>,
}

/// The pieces of a field and the cells of a box in which they meet.
pub struct Pieces {
    /// The pieces, each once, up to the sign.
    pub fields: Vec<CompiledField>,
    /// The cells, from large to small ones.
    pub meetings: Vec<Meeting>,
    /// Cells of which it was not found out which pieces meet there: lower and upper corners.
    pub undecided: Vec<(DVec3, DVec3)>,
    low: DVec3,
    high: DVec3,
    dimension: usize,
    deepest: u32,
    /// The meetings' places by depth and index.
    places: HashMap<(u32, [u32; 3]), u32>,
}

impl Pieces {
    /// The place of the meeting in whose cell a point lies.
    fn at(&self, point: DVec3) -> Option<usize> {
        let part = (point - self.low) / (self.high - self.low);
        (0..=self.deepest).find_map(|depth| {
            let cells = f64::from(1_u32 << depth);
            let index = [0, 1, 2].map(|axis| match axis < self.dimension {
                true => (part[axis] * cells).clamp(0.0, cells - 1.0) as u32,
                false => 0,
            });
            Some(*self.places.get(&(depth, index))? as usize)
        })
    }

    /// The places of the meetings in whose cells a point lies or the corners of a cube around it,
    /// whose half side is `reach`. Some may come twice.
    pub fn around(&self, point: DVec3, reach: f64) -> impl Iterator<Item = usize> {
        let corners = match self.meetings.is_empty() {
            true => 0,
            false => 1 + (1_usize << self.dimension),
        };
        (0..corners).filter_map(move |number| {
            let mut beside = point;
            for axis in 0..self.dimension {
                beside[axis] += match number {
                    0 => 0.0,
                    _ if (number - 1) >> axis & 1 == 1 => reach,
                    _ => -reach,
                };
            }
            self.at(beside)
        })
    }

    /// The shortest side of the smallest cell in which pieces meet.
    pub fn finest(&self) -> f64 {
        let sides = self.meetings.iter().flat_map(|meeting| {
            let size = meeting.high - meeting.low;
            (0..self.dimension).map(move |axis| size[axis])
        });
        sides.fold(f64::INFINITY, f64::min)
    }
}

/// A cell of the subdivision and the field in its parent.
struct Open {
    index: [u32; 3],
    steps: Arc<Vec<Step>>,
}

/// A cell of which the choices are not decided.
struct Judged {
    index: [u32; 3],
    steps: Arc<Vec<Step>>,
    enclosures: Vec<Enclosure>,
}

/// A piece: where it is in the graph, and its steps.
struct Piece {
    root: NodeId,
    steps: Vec<Step>,
    /// Its values at the probes.
    probes: [f64; PROBES],
}

/// The pieces of a field, and where in the box two or more may vanish. Cells are handed out after
/// so many halvings (at most 16) at the latest, those in which just two pieces meet as soon as that
/// is known. `None` if the monitor cancelled.
pub fn pieces(
    field: &CompiledField,
    low: DVec3,
    high: DVec3,
    halvings: u32,
    monitor: &dyn Monitor,
) -> Option<Pieces> {
    let halvings = halvings.min(16);
    let mut search = Search::new(field, low, high, halvings);
    let steps = match field.program().first_root() {
        Some((graph, root)) => {
            let (graph, root) = with_numbers(graph, root, field.parameters());
            steps::list(&graph, root)
        }
        None => Vec::new(),
    };
    let has_choices = steps.iter().any(|step| step.choice().is_some());
    let mut level = match has_choices {
        true => vec![Open {
            index: [0; 3],
            steps: Arc::new(steps),
        }],
        false => Vec::new(),
    };
    let mut seen = 0;
    let deepest = halvings + DEEPER;
    for depth in 0..=deepest {
        if level.is_empty() {
            break;
        }
        if monitor.cancelled() {
            return None;
        }
        monitor.progress("pieces", f64::from(depth) / f64::from(deepest));
        seen += level.len();
        let judged: Vec<Judged> = level
            .par_iter()
            .filter_map(|open| search.judge(open, depth))
            .collect();
        let is_last = depth == deepest || seen > MOST_CELLS;
        let mut next = Vec::new();
        for cell in judged {
            if !search.settle(&cell, depth, is_last) {
                next.extend(search.parts(&cell));
            }
        }
        level = next;
    }
    Some(search.finish())
}

/// Whether values have one ratio, as far as they are defined. Both must be at the same places.
fn are_multiples(one: &[f64; PROBES], other: &[f64; PROBES]) -> bool {
    let largest = |values: &[f64; PROBES]| {
        let finite = values.iter().filter(|value| value.is_finite());
        finite.fold(0.0, |most: f64, value| most.max(value.abs()))
    };
    let (first, second) = (largest(one), largest(other));
    let pairs = || one.iter().zip(other);
    let count = pairs().filter(|(a, b)| a.is_finite() && b.is_finite());
    if first == 0.0 || second == 0.0 || 2 * count.count() < PROBES {
        return false;
    }
    [1.0, -1.0].iter().any(|sign| {
        pairs().all(|(a, b)| {
            let apart = (a / first - sign * b / second).abs();
            apart <= SAME || !a.is_finite() && !b.is_finite()
        })
    })
}

/// The root with its parameters replaced by their values.
fn with_numbers(graph: &Graph, root: NodeId, q: &[f64]) -> (Graph, NodeId) {
    let mut graph = graph.clone();
    let parameters = graph.support(&[root]).parameters;
    let numbers: HashMap<u32, NodeId> = parameters
        .into_iter()
        .map(|index| {
            let value = q.get(index as usize).copied().unwrap_or(f64::NAN);
            (index, graph.constant(value))
        })
        .collect();
    let roots = graph.substitute(&[root], |node| match node {
        Node::Parameter(index) => numbers.get(&index).copied(),
        _ => None,
    });
    let root = roots.first().copied().unwrap_or(root);
    (graph, root)
}

/// What is found on the way.
struct Search {
    dimension: usize,
    halvings: u32,
    low: DVec3,
    high: DVec3,
    /// Of all pieces.
    graph: Graph,
    pieces: Vec<Piece>,
    /// The places of the pieces by their roots.
    numbers: HashMap<NodeId, u32>,
    meetings: Vec<Meeting>,
    places: HashMap<(u32, [u32; 3]), u32>,
    undecided: Vec<(DVec3, DVec3)>,
}

impl Search {
    fn new(field: &CompiledField, mut low: DVec3, mut high: DVec3, halvings: u32) -> Search {
        let dimension = field.dimension();
        for axis in dimension..3 {
            (low[axis], high[axis]) = (0.0, 0.0);
        }
        Search {
            dimension,
            halvings,
            low,
            high,
            graph: Graph::new(),
            pieces: Vec::new(),
            numbers: HashMap::new(),
            meetings: Vec::new(),
            places: HashMap::new(),
            undecided: Vec::new(),
        }
    }

    /// The corners of a cell and a little beyond: of choices that change just where cells meet, as in
    /// the planes of symmetry of a box around the origin, both sides are then seen.
    fn around(&self, depth: u32, index: [u32; 3]) -> (DVec3, DVec3) {
        let (low, high) = self.corners(depth, index);
        let margin = BEYOND * (high - low);
        (low - margin, high + margin)
    }

    /// The corners of a cell. Neighbours have the coordinates of their faces in common.
    fn corners(&self, depth: u32, index: [u32; 3]) -> (DVec3, DVec3) {
        let cells = f64::from(1_u32 << depth);
        let face = |upper: u32| {
            DVec3::from_array([0, 1, 2].map(|axis| {
                let part = f64::from(index[axis] + upper) / cells;
                self.low[axis] * (1.0 - part) + self.high[axis] * part
            }))
        };
        match self.dimension {
            2 => (
                face(0) * DVec3::new(1.0, 1.0, 0.0),
                face(1) * DVec3::new(1.0, 1.0, 0.0),
            ),
            _ => (face(0), face(1)),
        }
    }

    /// The field in a cell, if it may vanish there and choices are open.
    fn judge(&self, open: &Open, depth: u32) -> Option<Judged> {
        let (low, high) = self.around(depth, open.index);
        let mut steps = open.steps.clone();
        let mut enclosures = steps::bound(&steps, low, high);
        if !enclosures.last()?.range.contains(0.0) {
            return None;
        }
        if let Some(pruned) = steps::prune(&steps, &enclosures) {
            enclosures = steps::bound(&pruned, low, high);
            steps = Arc::new(pruned);
        }
        let has_choices = steps.iter().any(|step| step.choice().is_some());
        has_choices.then_some(Judged {
            index: open.index,
            steps,
            enclosures,
        })
    }

    /// Notes which pieces meet in a cell; false if it should be split first.
    fn settle(&mut self, cell: &Judged, depth: u32, is_last: bool) -> bool {
        let (low, high) = self.corners(depth, cell.index);
        let around = self.around(depth, cell.index);
        let choices = cell.steps.iter().filter(|step| step.choice().is_some());
        let found = match choices.count() <= MOST_CHOICES {
            true => pattern::patterns(&mut self.graph, &cell.steps, &cell.enclosures),
            false => None,
        };
        let mut pieces = Vec::new();
        let mut singular = Vec::new();
        let mut numbers: Vec<u32> = found
            .iter()
            .flatten()
            .map(|&root| self.number(root))
            .collect();
        numbers.sort_unstable();
        numbers.dedup();
        for number in numbers {
            let steps = &self.pieces[number as usize].steps;
            let (around_low, around_high) = around;
            let enclosures = steps::bound(steps, around_low, around_high);
            let Some(last) = enclosures.last() else {
                continue;
            };
            if last.range.contains(0.0) {
                pieces.push(number);
                if last.regularity != Regularity::Continuous
                    || steps::has_singularity(steps, &enclosures)
                {
                    singular.push(number);
                }
            }
        }
        if found.is_none() || pieces.len() - singular.len() > MOST_PIECES {
            if is_last {
                self.undecided.push((low, high));
            }
            return is_last;
        }
        if pieces.is_empty() || (pieces.len() == 1 && singular.is_empty()) {
            return true;
        }
        let is_plain = pieces.len() == 2 && singular.is_empty();
        if !is_plain && depth < self.halvings && !is_last {
            return false;
        }
        let place = self.meetings.len() as u32;
        self.places.insert((depth, cell.index), place);
        self.meetings.push(Meeting {
            low,
            high,
            depth,
            pieces,
            singular,
        });
        true
    }

    /// The number of a piece, which may be new. Multiples of each other are one: analytic functions
    /// that agree at places without any pattern agree everywhere.
    fn number(&mut self, root: NodeId) -> u32 {
        if let Some(number) = self.numbers.get(&root) {
            return *number;
        }
        let steps = steps::list(&self.graph, root);
        let probes = std::array::from_fn(|place| {
            // The additive recurrence with the powers of the root of x⁴ = x + 1, and of a step that
            // keeps away from the faces.
            let part = [0.819_172_513, 0.671_043_607, 0.549_700_478]
                .map(|rate| 0.01 + 0.98 * ((place as f64 + 0.5) * rate).fract());
            let point = self.low + DVec3::from_array(part) * (self.high - self.low);
            steps::value(&steps, point)
        });
        let known = self
            .pieces
            .iter()
            .position(|piece| are_multiples(&piece.probes, &probes));
        let number = known.unwrap_or(self.pieces.len()) as u32;
        self.numbers.insert(root, number);
        if known.is_none() {
            self.pieces.push(Piece {
                root,
                steps,
                probes,
            });
        }
        number
    }

    /// The halves of a cell's sides, combined.
    fn parts(&self, cell: &Judged) -> impl Iterator<Item = Open> {
        let dimension = self.dimension;
        let (index, steps) = (cell.index, cell.steps.clone());
        (0..1_u32 << dimension).map(move |number| Open {
            index: [0, 1, 2].map(|axis| match axis < dimension {
                true => 2 * index[axis] + (number >> axis & 1),
                false => 0,
            }),
            steps: steps.clone(),
        })
    }

    /// What was found, with pieces that no cell names left out.
    fn finish(mut self) -> Pieces {
        let mut used: Vec<u32> = self
            .meetings
            .iter()
            .flat_map(|meeting| meeting.pieces.iter().copied())
            .collect();
        used.sort_unstable();
        used.dedup();
        for meeting in &mut self.meetings {
            for piece in meeting.pieces.iter_mut().chain(&mut meeting.singular) {
                *piece = used.partition_point(|&other| other < *piece) as u32;
            }
        }
        let fields = used.iter().map(|&number| {
            let root = self.pieces[number as usize].root;
            let program = Program::new(&self.graph, &[root], self.dimension);
            CompiledField::new(Arc::new(program), Vec::new())
        });
        Pieces {
            fields: fields.collect(),
            meetings: self.meetings,
            undecided: self.undecided,
            low: self.low,
            high: self.high,
            dimension: self.dimension,
            deepest: self.halvings + DEEPER,
            places: self.places,
        }
    }
}
