//! The subdivision: cells are divided until each is proven or given up.

use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

use super::super::octree::Node;
use super::super::octree::balance::oversized;
use super::super::octree::decompose::Decomposition;
use super::super::simplices::Place;
use super::super::{Job, PolygonizeError};
use super::boundary;
use super::cells::{FINEST, Frame, Key, key};
use super::doubts::{self, Cause};
use super::enclosing::{self, Analysed, Known};
use super::normals::{is_narrow, normal};
use crate::graph::Interval;

/// How many cells make one piece of parallel work: what enclosures cost least for.
const CHUNK: usize = 64;

/// Cells that cannot be proven at a time in R2 and in R3, and all cells together, beyond which the
/// proof is given up: what is singular along curves or surfaces needs ever more.
const FRONT: [usize; 2] = [1 << 20, 1 << 16];
const CELLS: [usize; 2] = [1 << 21, 1 << 18];

/// How many tests of cells there may be, in R2 and in R3: all cells are tested again in each round, and
/// beside what is singular there are more rounds than elsewhere.
const TESTS: [usize; 2] = [1 << 26, 1 << 21];

/// From these levels on cells are given up in which the gradients' enclosure does not shrink: in R2
/// a kink may be near a curve without touching it, and cells cost less.
const STUCK: [u32; 2] = [15, 6];

/// The same where F may jump, is undefined or has no bounded gradient.
const ROUGH: [u32; 2] = [6, 4];

/// From this level on cells that fail are looked at for a reason why they always will.
const SUSPICIOUS: u32 = 3;

/// From this level on the gradients of a smooth field differ little in a cell.
const SMOOTH: u32 = 10;

/// How far a cell has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum State {
    /// F is Lipschitz in the cell, and this encloses its gradients.
    Open([Interval; 3]),
    /// All its simplices passed the test, with these gradients.
    Proven([Interval; 3]),
    /// F < iso, but a cap along the sides of the box is made in it.
    Capped,
    /// Given up.
    Doubtful(Cause),
}

/// A cell that the level set may pass through.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaf {
    pub(super) node: Node,
    pub(super) state: State,
}

/// A cell that is to be judged.
struct Candidate {
    node: Node,
    /// The width of its parent's gradients.
    width: f64,
    /// How many times that did not shrink.
    stuck: u32,
    /// Why its parent was given up, if it was.
    doubt: Option<Cause>,
}

impl Candidate {
    /// A cell of which nothing is known.
    fn new(node: Node) -> Self {
        Candidate {
            node,
            width: f64::INFINITY,
            stuck: 0,
            doubt: None,
        }
    }
}

/// What becomes of a cell.
enum Verdict {
    Decided(bool),
    Leaf(State),
    Divide { width: f64, stuck: u32 },
}

/// The tree.
pub(super) struct Forest<'a> {
    job: &'a Job<'a>,
    pub(super) analysed: &'a Analysed<'a>,
    pub(super) frame: &'a Frame,
    /// The cells that are divided.
    pub(super) divided: FxHashSet<Key>,
    /// Those without a zero, and whether they are inside.
    pub(super) decided: FxHashMap<Key, bool>,
    /// The others, in order.
    pub(super) leaves: Vec<Leaf>,
    /// F − iso at corners of simplices, by number.
    pub(super) values: FxHashMap<u64, f64>,
    /// Boxes and points at which something was evaluated.
    pub(super) evaluations: usize,
    /// Cells that were tested, in all rounds.
    tests: usize,
}

impl<'a> Forest<'a> {
    /// The whole subdivision.
    pub(super) fn grow(
        job: &'a Job<'a>,
        analysed: &'a Analysed<'a>,
        frame: &'a Frame,
    ) -> Result<Forest<'a>, PolygonizeError> {
        let roots = frame.roots();
        let mut forest = Forest {
            job,
            analysed,
            frame,
            divided: FxHashSet::default(),
            decided: FxHashMap::default(),
            leaves: Vec::new(),
            values: FxHashMap::default(),
            evaluations: 0,
            tests: 0,
        };
        forest.settle(roots.into_iter().map(Candidate::new).collect())?;
        let mut rounds = 0;
        loop {
            rounds += 1;
            let done = 1.0 - 1.0 / f64::from(1 + rounds);
            job.monitor.progress("proving the topology", done);
            forest.balance()?;
            let failed = forest.test()?;
            if failed.is_empty() {
                return Ok(forest);
            }
            forest.divide(&failed)?;
        }
    }

    /// Judges cells, and divides those that fail until each is decided, open or given up.
    fn settle(&mut self, candidates: Vec<Candidate>) -> Result<(), PolygonizeError> {
        let mut front = candidates;
        while !front.is_empty() {
            let limit = CELLS[self.frame.dimension - 2].min(self.job.options.cell_limit);
            let most = FRONT[self.frame.dimension - 2];
            let has_room = front.len() <= most.min(limit.saturating_sub(self.leaves.len()));
            let verdicts = self.judge(&front, has_room)?;
            let mut next = Vec::new();
            for (Candidate { node, .. }, verdict) in front.into_iter().zip(verdicts) {
                match verdict {
                    Verdict::Decided(is_inside) => {
                        self.decided.insert(key(&node), is_inside);
                    }
                    Verdict::Leaf(state) => self.leaves.push(Leaf { node, state }),
                    Verdict::Divide { width, stuck } => {
                        self.divided.insert(key(&node));
                        next.extend(self.frame.children(&node).map(|node| Candidate {
                            node,
                            width,
                            stuck,
                            doubt: None,
                        }));
                    }
                }
            }
            front = next;
        }
        Ok(())
    }

    /// What becomes of cells.
    fn judge(
        &mut self,
        front: &[Candidate],
        has_room: bool,
    ) -> Result<Vec<Verdict>, PolygonizeError> {
        let shared = &*self;
        let parts: Vec<Vec<Verdict>> = front
            .par_chunks(CHUNK)
            .map(|part| {
                if shared.job.monitor.cancelled() {
                    return Vec::new();
                }
                let sides = |candidate: &Candidate| shared.frame.sides(&candidate.node);
                let boxes: Vec<[Interval; 3]> = part.iter().map(sides).collect();
                let known = enclosing::judge(shared.analysed, shared.iso(), &boxes);
                let verdict = |(candidate, known)| shared.verdict(candidate, known, has_room);
                part.iter().zip(known).map(verdict).collect()
            })
            .collect();
        if self.job.monitor.cancelled() {
            return Err(PolygonizeError::Cancelled);
        }
        self.evaluations += front.len();
        Ok(parts.into_iter().flatten().collect())
    }

    /// What becomes of a cell of which that much is known.
    fn verdict(&self, candidate: &Candidate, known: Known, has_room: bool) -> Verdict {
        let node = &candidate.node;
        let (width, cause) = match known {
            Known::Decided { is_inside: true }
                if self.job.options.cap
                    && self.frame.dimension == 3
                    && self.frame.touches_side(node) =>
            {
                return Verdict::Leaf(State::Capped);
            }
            Known::Decided { is_inside } => return Verdict::Decided(is_inside),
            Known::Gradients(slopes) if is_narrow(&slopes[..self.frame.dimension]) => {
                return Verdict::Leaf(State::Open(slopes));
            }
            Known::Gradients(slopes) => (enclosing::width(&slopes), Cause::Budget),
            Known::Nothing(cause) => (f64::INFINITY, cause),
        };
        if let Some(cause) = candidate.doubt {
            return Verdict::Leaf(State::Doubtful(cause));
        }
        let is_stuck = width > 0.7 * candidate.width || width == f64::INFINITY;
        let stuck = if is_stuck { candidate.stuck + 1 } else { 0 };
        match self.resignation(node, (cause, stuck), has_room) {
            Some(cause) => Verdict::Leaf(State::Doubtful(cause)),
            None => Verdict::Divide { width, stuck },
        }
    }

    /// Why a cell that fails should not be divided, if it should not.
    fn resignation(
        &self,
        node: &Node,
        (cause, stuck): (Cause, u32),
        has_room: bool,
    ) -> Option<Cause> {
        if node.level >= FINEST || !has_room {
            return Some(cause);
        }
        if node.level < SUSPICIOUS {
            return None;
        }
        let is_smooth = cause == Cause::Budget;
        let patience = if is_smooth { STUCK } else { ROUGH };
        if node.level >= patience[self.frame.dimension - 2] && stuck >= 4 {
            return Some(if is_smooth { Cause::Kink } else { cause });
        }
        doubts::is_singular(self.analysed.field, self.frame, self.job.accuracy.iso, node)
            .then_some(Cause::Singular)
    }

    /// Divides leaves until neighbours differ by one level at most.
    fn balance(&mut self) -> Result<(), PolygonizeError> {
        loop {
            let nodes: Vec<Node> = self.leaves.iter().map(|leaf| leaf.node).collect();
            let mut large = oversized(&self.frame.lattice, &nodes);
            // What is given up stays as it is: its simplices fit together however small others are.
            let given_up: FxHashSet<Key> = (self.leaves.iter())
                .filter(|leaf| matches!(leaf.state, State::Doubtful(_)))
                .map(|leaf| key(&leaf.node))
                .collect();
            large.retain(|name| !given_up.contains(name));
            if large.is_empty() {
                return Ok(());
            }
            self.divide(&large)?;
        }
    }

    /// Divides these leaves, which are in ascending order.
    fn divide(&mut self, keys: &[Key]) -> Result<(), PolygonizeError> {
        let (old, kept): (Vec<Leaf>, Vec<Leaf>) = self
            .leaves
            .iter()
            .partition(|leaf| keys.binary_search(&key(&leaf.node)).is_ok());
        self.leaves = kept;
        self.divided.extend(keys);
        let frame = self.frame;
        let children = |leaf: &Leaf| {
            let doubt = match leaf.state {
                State::Doubtful(cause) => Some(cause),
                _ => None,
            };
            frame.children(&leaf.node).map(move |node| Candidate {
                doubt,
                ..Candidate::new(node)
            })
        };
        self.settle(old.iter().flat_map(children).collect())
    }

    /// Tests all open leaves; returns those that failed and should be divided, ascending.
    fn test(&mut self) -> Result<Vec<Key>, PolygonizeError> {
        self.leaves.sort_unstable_by_key(|leaf| key(&leaf.node));
        let nodes: Vec<Node> = self.leaves.iter().map(|leaf| leaf.node).collect();
        let frame = self.frame;
        let decomposition = Decomposition::new(&frame.lattice, &nodes);
        self.evaluate(&decomposition, &nodes)?;
        let uncertain = boundary::uncertain(self, &decomposition, &nodes);
        let shared = &*self;
        let passed: Vec<bool> = self
            .leaves
            .par_chunks(CHUNK)
            .flat_map_iter(|leaves| {
                let tested = |leaf: &Leaf| match leaf.state {
                    State::Open(slopes) | State::Proven(slopes) => {
                        shared.passes(&decomposition, &leaf.node, &slopes, &uncertain)
                    }
                    State::Capped => shared.is_inside(&decomposition, &leaf.node),
                    State::Doubtful(_) => true,
                };
                leaves.iter().map(tested).collect::<Vec<bool>>()
            })
            .collect();
        self.tests += self.leaves.len();
        let has_room = self.leaves.len()
            < CELLS[self.frame.dimension - 2].min(self.job.options.cell_limit)
            && self.tests < TESTS[self.frame.dimension - 2];
        let causes: FxHashMap<Key, Cause> = self
            .leaves
            .iter()
            .filter_map(|leaf| match leaf.state {
                State::Doubtful(cause) => Some((key(&leaf.node), cause)),
                _ => None,
            })
            .collect();
        let shared = &*self;
        let states: Vec<Option<State>> = (self.leaves.par_iter().zip(passed))
            .map(|(leaf, passed)| match leaf.state {
                State::Open(slopes) if passed => Some(State::Proven(slopes)),
                state if passed => Some(state),
                _ => {
                    let cause = shared.failure(leaf, &causes, has_room)?;
                    Some(State::Doubtful(cause))
                }
            })
            .collect();
        let mut failed = Vec::new();
        for (leaf, state) in self.leaves.iter_mut().zip(states) {
            match state {
                Some(state) => leaf.state = state,
                None => failed.push(key(&leaf.node)),
            }
        }
        failed.sort_unstable();
        Ok(failed)
    }

    /// Why a leaf that failed the test should not be divided, if it should not: beside what is given
    /// up that would go on for ever.
    fn failure(
        &self,
        leaf: &Leaf,
        causes: &FxHashMap<Key, Cause>,
        has_room: bool,
    ) -> Option<Cause> {
        let node = &leaf.node;
        let beside = || {
            let mut neighbours = self.frame.neighbours(node).into_iter();
            neighbours.find_map(|neighbour| causes.get(&neighbour).copied())
        };
        let is_kinked = |slopes: &[Interval; 3]| {
            let largest = |slope: &Interval| slope.low.abs().max(slope.high.abs());
            let size = slopes.iter().map(largest).fold(0.0, f64::max);
            node.level >= SMOOTH && enclosing::width(slopes) > 0.1 * size
        };
        match self.resignation(node, (Cause::Budget, 0), has_room) {
            Some(Cause::Budget) => Some(match leaf.state {
                State::Open(slopes) if is_kinked(&slopes) => Cause::Kink,
                _ if self.frame.touches_side(node) => Cause::Border,
                _ => Cause::Budget,
            }),
            None if node.level > SUSPICIOUS && !causes.is_empty() => beside(),
            own => own,
        }
    }

    /// Whether all simplices of a leaf pass.
    fn passes(
        &self,
        decomposition: &Decomposition,
        node: &Node,
        slopes: &[Interval; 3],
        uncertain: &FxHashSet<u64>,
    ) -> bool {
        let dimension = self.frame.dimension;
        let lattice = &self.frame.lattice;
        let at_side = self.frame.touches_side(node);
        let mut passes = true;
        self.frame.for_each_simplex(decomposition, node, |corners| {
            if !passes {
                return;
            }
            let mut values = [f64::NAN; 4];
            for (value, &corner) in values.iter_mut().zip(corners) {
                *value = self.value(corner);
                let key = lattice.key(corner);
                passes &= uncertain.is_empty() || !uncertain.contains(&key);
            }
            let normal = normal(lattice, corners, &values[..corners.len()]);
            passes &= normal.agrees(&slopes[..dimension], 0);
            if passes && at_side {
                passes = boundary::passes(self, corners, &values, (&normal, slopes));
            }
        });
        passes
    }

    /// Whether all corners of simplices of a leaf are inside.
    fn is_inside(&self, decomposition: &Decomposition, node: &Node) -> bool {
        let mut is_inside = true;
        self.frame.for_each_simplex(decomposition, node, |corners| {
            is_inside &= corners.iter().all(|&corner| self.value(corner) < 0.0);
        });
        is_inside
    }

    /// F − iso at a corner of a simplex.
    pub(super) fn value(&self, place: Place) -> f64 {
        let known = self.values.get(&self.frame.lattice.key(place));
        known.copied().unwrap_or(f64::NAN)
    }

    /// Whether the lowest corner of the box is inside.
    pub(super) fn corner_is_inside(&self) -> bool {
        self.job.field.value(self.frame.lattice.point([0; 3])) < self.iso()
    }

    /// The level.
    pub(super) fn iso(&self) -> f64 {
        self.job.accuracy.iso
    }

    /// Evaluates F at all corners of simplices that are new.
    fn evaluate(
        &mut self,
        decomposition: &Decomposition,
        nodes: &[Node],
    ) -> Result<(), PolygonizeError> {
        let shared = &*self;
        let lattice = &self.frame.lattice;
        let mut new: Vec<u64> = nodes
            .par_chunks(CHUNK)
            .flat_map_iter(|nodes| {
                let mut new = Vec::new();
                for node in nodes {
                    shared
                        .frame
                        .for_each_simplex(decomposition, node, |corners| {
                            let keys = corners.iter().map(|&corner| lattice.key(corner));
                            new.extend(keys.filter(|key| !shared.values.contains_key(key)));
                        });
                }
                new.sort_unstable();
                new.dedup();
                new
            })
            .collect();
        new.par_sort_unstable();
        new.dedup();
        let parts: Vec<Vec<f64>> = new
            .par_chunks(1024)
            .map(|keys| {
                let places = keys.iter().map(|&key| lattice.place(key));
                super::super::octree::values_at(shared.job, places, lattice)
            })
            .collect();
        if self.job.monitor.cancelled() {
            return Err(PolygonizeError::Cancelled);
        }
        self.evaluations += new.len();
        self.values
            .extend(new.into_iter().zip(parts.into_iter().flatten()));
        Ok(())
    }
}
