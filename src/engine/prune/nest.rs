//! Passes over boxes, and sequences of boxes within boxes.

use super::{Batch, Scalars, Sequence, Specialiser, Trunk};
use crate::engine::block::{Bounds, BoundsBlock, Decision, Kernels, LANES, Number, Pass};
use crate::graph::interval::{Enclosure, Interval};
use glam::DVec3;

/// Runs interval passes; keeps its memory from one to the next.
pub(in crate::engine) struct Passes {
    kernels: Kernels,
    boxes: [BoundsBlock; 3],
    registers: Vec<BoundsBlock>,
    outputs: Vec<BoundsBlock>,
}

impl Passes {
    /// By these kernels.
    pub(in crate::engine) fn new(kernels: Kernels) -> Passes {
        let nothing = Bounds::from(Enclosure::of_number(0.0)).splat();
        Passes {
            kernels,
            boxes: [nothing; 3],
            registers: Vec::new(),
            outputs: Vec::new(),
        }
    }

    /// Puts a box into a lane below [`LANES`].
    pub(in crate::engine) fn set(&mut self, lane: usize, low: DVec3, high: DVec3) {
        for (axis, block) in self.boxes.iter_mut().enumerate() {
            let side = Enclosure::of_interval(Interval::new(low[axis], high[axis]));
            Number::set(block, lane, Bounds::from(side));
        }
    }

    /// Runs the sequence over the boxes of all lanes. What is decided goes to `decisions`, which
    /// has a place for every step, or none if it is not asked for. `settle` and the result, the
    /// lanes that are tame, are those of [`Pass`].
    pub(in crate::engine) fn run(
        &mut self,
        sequence: &Sequence,
        scalars: &Scalars,
        decisions: &mut [Decision],
        settle: bool,
    ) -> u64 {
        let nothing = Bounds::from(Enclosure::of_number(0.0)).splat();
        if self.registers.len() < sequence.tape.registers {
            self.registers.resize(sequence.tape.registers, nothing);
        }
        if self.outputs.len() < sequence.outputs.len() {
            self.outputs.resize(sequence.outputs.len(), nothing);
        }
        let mut pass = Pass {
            tape: &sequence.tape,
            boxes: &self.boxes,
            scalars: &scalars.bounds,
            registers: &mut self.registers,
            outputs: &mut self.outputs,
            decisions,
            settle,
            tame: 0,
        };
        pass.run(self.kernels);
        pass.tame
    }

    /// The enclosure of the first output in a lane.
    pub(in crate::engine) fn enclosure(&self, lane: usize) -> Enclosure {
        Bounds::get(&self.outputs[0], lane).into()
    }
}

/// A box that a sequence was specialised for.
#[derive(Clone, Copy, Debug)]
pub(in crate::engine) struct Region {
    /// No two regions have the same number.
    pub(in crate::engine) number: u64,
    pub(in crate::engine) low: DVec3,
    pub(in crate::engine) high: DVec3,
}

/// The sequences of boxes each of which is a part of the one before, made one box at a time when
/// they are asked for, and kept while the outer boxes stay.
pub(in crate::engine) struct Nest {
    scalars: Scalars,
    passes: Passes,
    specialiser: Specialiser,
    batch: Batch,
    levels: Vec<Level>,
}

/// One of a nest's boxes.
#[derive(Default)]
struct Level {
    region: Option<u64>,
    sequence: Sequence,
    /// Which level's sequence serves this box; none: the trunk's.
    serves: Option<usize>,
    /// The number of scalars, with those that this box has added.
    scalars: usize,
    tame: bool,
}

impl Nest {
    /// For the trunk at this q.
    pub(in crate::engine) fn new(trunk: &Trunk, q: &[f64], kernels: Kernels) -> Nest {
        Nest {
            scalars: trunk.scalars(q),
            passes: Passes::new(kernels),
            specialiser: Specialiser::default(),
            batch: Batch::default(),
            levels: Vec::new(),
        }
    }

    /// The sequence of the last of these boxes, each of which is a part of the one before, with
    /// its scalars. The trunk is always the same, and runnable.
    pub(in crate::engine) fn within<'a>(
        &'a mut self,
        trunk: &'a Trunk,
        path: &[Region],
    ) -> (&'a Sequence, &'a Scalars) {
        let known = path.iter().zip(&self.levels);
        let known = known
            .take_while(|(region, level)| level.region == Some(region.number))
            .count();
        if known < path.len() {
            // What an abandoned box has added is not needed any more.
            let kept = match known.checked_sub(1) {
                Some(last) => self.levels[last].scalars,
                None => trunk.scalar_count(),
            };
            self.scalars.truncate(kept);
            for (place, region) in path.iter().enumerate().skip(known) {
                self.enter(trunk, place, region);
            }
        }
        let serves = path
            .len()
            .checked_sub(1)
            .and_then(|last| self.levels[last].serves);
        (sequence(trunk, &self.levels, serves), &self.scalars)
    }

    /// Makes the sequence of a box from that of the box around it.
    fn enter(&mut self, trunk: &Trunk, place: usize, region: &Region) {
        if self.levels.len() <= place {
            self.levels.resize_with(place + 1, Level::default);
        }
        let (outer, inner) = self.levels.split_at_mut(place);
        let level = &mut inner[0];
        let (serves, tame) = match outer.last() {
            Some(outer) => (outer.serves, outer.tame),
            None => (None, false),
        };
        let parent = sequence(trunk, outer, serves);
        level.region = Some(region.number);
        level.serves = serves;
        level.tame = tame;
        if parent.has_choices {
            self.passes.set(0, region.low, region.high);
            let decisions = self.batch.prepare(parent.len());
            let lanes = self.passes.run(parent, &self.scalars, decisions, !tame);
            level.tame = tame || lanes & 1 == 1;
            self.batch.mark(parent, 1);
            let Level { sequence, .. } = level;
            let batch = (&self.batch, 0);
            if self
                .specialiser
                .specialise(parent, batch, &mut self.scalars, sequence)
            {
                level.serves = Some(place);
            }
        }
        level.scalars = self.scalars.len();
    }
}

/// The sequence of a level, or of the trunk.
fn sequence<'a>(trunk: &'a Trunk, levels: &'a [Level], place: Option<usize>) -> &'a Sequence {
    match place.and_then(|place| levels.get(place)) {
        Some(level) => &level.sequence,
        None => trunk.sequence(),
    }
}

/// How many lanes a pass has.
pub(in crate::engine) const BOXES: usize = LANES;
