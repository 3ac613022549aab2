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

/// The trunk's sequence pruned for a box, if that is worth it, and its scalars. The trunk is
/// runnable.
pub(in crate::engine) fn prune(
    trunk: &Trunk,
    q: &[f64],
    kernels: Kernels,
    [low, high]: [DVec3; 2],
) -> (Option<Sequence>, Scalars) {
    let (mut scalars, mut batch) = (trunk.scalars(q), Batch::default());
    let whole = trunk.sequence();
    if !whole.has_choices {
        return (None, scalars);
    }
    let mut passes = Passes::new(kernels);
    passes.set(0, low, high);
    passes.run(whole, &scalars, batch.prepare(whole.len()), true);
    batch.mark(whole, 1);
    let mut sequence = Sequence::default();
    let lane = (&batch, 0);
    let is_shorter = Specialiser::default().specialise(whole, lane, &mut scalars, &mut sequence);
    (is_shorter.then_some(sequence), scalars)
}

/// A box that a sequence was specialised for.
#[derive(Clone, Copy, Debug)]
pub(in crate::engine) struct Region {
    /// No two regions have the same number.
    pub(in crate::engine) number: u64,
    /// The cell's level, and its lane in the batch in which it was bounded.
    pub(in crate::engine) level: usize,
    pub(in crate::engine) lane: usize,
    /// The level whose sequence that batch decides about; none: the trunk's.
    pub(in crate::engine) parent: Option<usize>,
    /// Whether the function is a number everywhere in the box.
    pub(in crate::engine) is_defined: bool,
}

/// The sequences of another function of the same choices, in boxes each of which is a part of
/// the one before; made one box at a time when they are asked for, and kept while the outer
/// boxes stay. It takes no interval passes: what is decided is known from the first function's.
pub(in crate::engine) struct Nest {
    scalars: Scalars,
    specialiser: Specialiser,
    batch: Batch,
    levels: Vec<Level>,
    /// What is decided, by the numbers of the choices.
    known: Vec<Decision>,
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
    /// The choices that this box has decided.
    decided: Vec<usize>,
}

impl Nest {
    /// For the trunk at this q, of which up to `choices` choices are known.
    pub(in crate::engine) fn new(trunk: &Trunk, q: &[f64], choices: usize) -> Nest {
        Nest {
            scalars: trunk.scalars(q),
            specialiser: Specialiser::default(),
            batch: Batch::default(),
            levels: Vec::new(),
            known: vec![Decision::default(); choices],
        }
    }

    /// The sequence of the last of these boxes, each of which is a part of the one before, with
    /// its scalars. The trunk is always the same. `decisions` gives the sequence and the batch in
    /// which a region was bounded.
    pub(in crate::engine) fn within<'a, 'b>(
        &'a mut self,
        trunk: &'a Trunk,
        path: &[Region],
        decisions: impl Fn(&Region) -> (&'b Sequence, &'b Batch),
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
            for level in &mut self.levels[known..] {
                level.region = None;
                for choice in level.decided.drain(..) {
                    self.known[choice] = Decision::default();
                }
            }
            for (place, region) in path.iter().enumerate().skip(known) {
                self.enter(trunk, place, region, decisions(region));
            }
        }
        let serves = path
            .len()
            .checked_sub(1)
            .and_then(|last| self.levels[last].serves);
        (sequence(trunk, &self.levels, serves), &self.scalars)
    }

    /// Makes the sequence of a box from that of the box around it.
    fn enter(
        &mut self,
        trunk: &Trunk,
        place: usize,
        region: &Region,
        (first, batch): (&Sequence, &Batch),
    ) {
        if self.levels.len() <= place {
            self.levels.resize_with(place + 1, Level::default);
        }
        let (outer, inner) = self.levels.split_at_mut(place);
        let level = &mut inner[0];
        level.region = Some(region.number);
        level.serves = outer.last().and_then(|outer| outer.serves);
        batch.tell(first, region.lane, |choice, decision| {
            if let Some(known) = self.known.get_mut(choice) {
                *known = decision;
                level.decided.push(choice);
            }
        });
        if let (true, Some(last)) = (region.is_defined, self.known.last_mut()) {
            // The last number is that of the question whether the function is a number.
            *last = Decision {
                first: 1,
                second: 0,
            };
            level.decided.push(self.known.len() - 1);
        }
        let parent = sequence(trunk, outer, level.serves);
        if parent.has_choices {
            self.batch.learn(parent, &self.known);
            self.batch.mark(parent, 1);
            let batch = (&self.batch, 0);
            let (scalars, sequence) = (&mut self.scalars, &mut level.sequence);
            if self
                .specialiser
                .specialise(parent, batch, scalars, sequence)
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
