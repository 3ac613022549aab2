//! Pruning: shorter tapes for parts of space.
//!
//! On a small box most choices of a large field are decided: of the solids of a union one or two
//! are near. A [`Trunk`] is a function's steps in the form that can be pruned (`sequence`), made
//! once for a program; an interval pass over up to 64 boxes records what each box decides
//! ([`super::block::Pass`]); `specialise` makes, for each of the boxes, the shorter sequence with
//! registers of its own, and the parts of that box are treated alike. `fold` keeps the shorter
//! sequence simple where operands have become constants. What is decided of a function serves its
//! derivatives, too (`origin`): a [`Nest`] prunes them without passes of their own.
//!
//! A pruned sequence has the bits of the whole one at every point of its box, in f64. In f32 it
//! has those of the operations that are left, while choices are decided for exact numbers: where
//! the candidates are closer than f32 rounds, it may take the other one.
//!
//! The idea is that of interval arithmetic with tape shortening by Keeter (Massively parallel
//! rendering of complex closed-form implicit surfaces, SIGGRAPH 2020, section 4); the steps that
//! boxes need are found for 64 boxes at a time, as bits.

mod fold;
mod nest;
mod origin;
mod sequence;
mod specialise;

use super::block::{self, Bounds};
use super::interpret;
use super::lower::{self, Lowered};
use crate::graph::{Graph, NodeId};
pub(super) use nest::{BOXES, Nest, Passes, Region, prune};
pub(super) use origin::{Origin, shared_choices};
pub(super) use sequence::{Sequence, scalar_place};
pub(super) use specialise::{Batch, Specialiser};

/// Steps of a sequence that is pruned for leaves, too: of a shorter one that would cost more than
/// it saves.
pub(super) const LONG: usize = 32;

/// The steps of some functions, ready to be pruned.
pub(super) struct Trunk {
    lowered: Lowered,
    sequence: Sequence,
    constants: Vec<f64>,
}

/// The places of 0 and 1 among a trunk's constants.
const ZERO: usize = 0;
const ONE: usize = 1;

impl Trunk {
    /// Of these roots, as functions of so many coordinates and parameters. `origin` tells which
    /// choices nodes are.
    pub(super) fn new(
        graph: &Graph,
        roots: &[NodeId],
        (dimension, parameters): (usize, usize),
        origin: impl Fn(NodeId) -> Origin,
    ) -> Trunk {
        let (lowered, nodes) = lower::list_with_nodes(graph, roots, dimension, parameters);
        let (sequence, constants) = sequence::whole(&lowered, &nodes, origin);
        Trunk {
            lowered,
            sequence,
            constants,
        }
    }

    /// The steps as a whole.
    pub(super) fn sequence(&self) -> &Sequence {
        &self.sequence
    }

    /// Whether passes over its tape are possible: they take memory for every register.
    pub(super) fn is_runnable(&self) -> bool {
        self.sequence.tape.registers * size_of::<block::BoundsBlock>() <= block::LARGEST_MEMORY
            && !self.sequence.outputs.is_empty()
    }

    /// How many scalars there are before anything has been pruned.
    pub(super) fn scalar_count(&self) -> usize {
        self.lowered.uniforms() + self.constants.len()
    }

    /// What is the same for all points, at this q.
    pub(super) fn scalars(&self, q: &[f64]) -> Scalars {
        let mut double = interpret::uniforms(&self.lowered, q);
        let uniforms = double.len();
        double.extend(&self.constants);
        let mut bounds = block::scalar_bounds(&self.lowered, q, &self.constants);
        bounds.iter_mut().for_each(Bounds::settle);
        Scalars {
            single: double.iter().map(|&scalar| scalar as f32).collect(),
            double,
            bounds,
            zero: (uniforms + ZERO) as u32,
            one: (uniforms + ONE) as u32,
        }
    }
}

/// What is the same for all points, for each kind of number. Pruning appends what has become
/// constant.
#[derive(Clone)]
pub(super) struct Scalars {
    pub(super) double: Vec<f64>,
    pub(super) single: Vec<f32>,
    pub(super) bounds: Vec<Bounds>,
    /// The places of 0 and of 1.
    zero: u32,
    one: u32,
}

impl Scalars {
    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.double.len()
    }

    /// Forgets those from this place on.
    pub(super) fn truncate(&mut self, length: usize) {
        self.double.truncate(length);
        self.single.truncate(length);
        self.bounds.truncate(length);
    }

    /// Appends a number with its bounds and returns its place.
    fn push(&mut self, number: f64, mut bounds: Bounds) -> u32 {
        bounds.settle();
        self.double.push(number);
        self.single.push(number as f32);
        self.bounds.push(bounds);
        self.double.len() as u32 - 1
    }
}
