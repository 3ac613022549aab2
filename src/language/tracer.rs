//! What tracing works on: the session's graph, how deep in field bodies the evaluation is, and
//! the programs that have been made of the graph's expressions.

use std::ops::{Deref, DerefMut};
use std::sync::Arc;

use indexmap::IndexMap;

use crate::engine::{Program, Tier};
use crate::graph::{Graph, NodeId};

/// How many programs a session keeps. A script that makes ever new fields, a loop over `f + v`,
/// lets the oldest go.
const KEPT_PROGRAMS: usize = 256;

/// How deep field bodies may be nested: each level has three coordinates of its own, and a
/// coordinate's axis is a byte.
pub const DEEPEST_LEVEL: usize = 84;

/// The session's graph with the state of tracing. It is a [`Graph`] for whoever only builds.
#[derive(Default)]
pub struct Tracer {
    graph: Graph,
    /// How many field bodies are being traced, one inside the other: 0 in a script.
    pub level: usize,
    /// What executes the programs.
    pub tier: Tier,
    programs: IndexMap<(Vec<NodeId>, usize), Arc<Program>>,
}

impl Tracer {
    /// The program of these roots, made when it is first asked for: equal expressions are equal
    /// nodes, so `grad(f)` is compiled once however often it is written.
    pub fn program(&mut self, roots: &[NodeId], dimension: usize) -> Arc<Program> {
        let key = (roots.to_vec(), dimension);
        if let Some(program) = self.programs.get(&key) {
            return Arc::clone(program);
        }
        if self.programs.len() >= KEPT_PROGRAMS {
            self.programs.shift_remove_index(0);
        }
        let program = Arc::new(Program::with_tier(&self.graph, roots, dimension, self.tier));
        self.programs.insert(key, Arc::clone(&program));
        program
    }

    /// The coordinates of a body at the present level. Bodies inside bodies have coordinates of
    /// their own, so that an inner function may speak of the outer point.
    pub fn coordinates(&mut self, dimension: usize) -> Vec<NodeId> {
        let first = first_axis(self.level);
        (first..first + dimension)
            .map(|axis| self.graph.coordinate(axis))
            .collect()
    }
}

/// The first axis of a level's coordinates.
pub fn first_axis(level: usize) -> usize {
    3 * level.min(DEEPEST_LEVEL)
}

impl Deref for Tracer {
    type Target = Graph;

    fn deref(&self) -> &Graph {
        &self.graph
    }
}

impl DerefMut for Tracer {
    fn deref_mut(&mut self) -> &mut Graph {
        &mut self.graph
    }
}
