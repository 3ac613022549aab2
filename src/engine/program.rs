//! A program: the graph of one field with everything that is derived from it.
//!
//! A program is made once for a field and kept with it. Its kernels are compiled when they are
//! first used, and a new q compiles nothing. [`super::CompiledField`] puts a program and a q
//! together to what samplers and polygonizers take.

use super::block::{Enclosures, Kernels};
use super::kernel::Kernel;
use super::lower::{self, copy_leaf, rebuild};
use super::prune::{LONG, Origin, Trunk, shared_choices};
use super::slopes::Slopes;
use super::{Tier, tape};
use crate::graph::interval::{Enclosure, Interval, Regularity};
use crate::graph::{Graph, Node, NodeId, derive, print};
use std::sync::OnceLock;

/// Registers beyond which a tape no longer stays in the nearest cache, so that a kernel with fewer
/// is looked for.
const MANY_REGISTERS: usize = 128;

/// What is known of a root before anything was computed.
const UNKNOWN: Enclosure = Enclosure {
    range: Interval::ENTIRE,
    regularity: Regularity::Partial,
};

/// One or several functions of (x, q), ready to be evaluated.
pub struct Program {
    graph: Graph,
    roots: Vec<NodeId>,
    dimension: usize,
    parameters: Vec<u32>,
    tier: Tier,
    values: OnceLock<Kernel>,
    gradients: OnceLock<Kernel>,
    parameter_gradients: OnceLock<Kernel>,
    hessians: OnceLock<Kernel>,
    enclosures: OnceLock<Enclosures>,
    slopes: OnceLock<Slopes>,
    value_trunk: OnceLock<Trunk>,
    gradient_trunk: OnceLock<Trunk>,
    parameter_trunk: OnceLock<Trunk>,
}

impl Program {
    /// The functions `roots` of `dimension` coordinates (0 to 3). Only what the roots consist of
    /// is copied from the graph; a coordinate beyond the dimension does not exist: it is NaN.
    /// Nothing is compiled yet.
    pub fn new(graph: &Graph, roots: &[NodeId], dimension: usize) -> Program {
        Program::with_tier(graph, roots, dimension, Tier::Automatic)
    }

    /// The same, executed by this tier alone. Where machine code cannot be made, blocks serve also
    /// those who ask for machine code; see [`Program::tier`].
    pub fn with_tier(graph: &Graph, roots: &[NodeId], dimension: usize, tier: Tier) -> Program {
        let dimension = dimension.min(3);
        let parameters = graph.support(roots).parameters;
        let (graph, roots) = rebuild(graph, roots, |target, node, operands| match node {
            Node::Parameter(index) => {
                // The list holds every parameter of the roots; its order is kept.
                let place = parameters.partition_point(|&other| other < index);
                target.parameter(place)
            }
            Node::Apply(op, _) => target.apply(op, operands),
            leaf => copy_leaf(target, leaf),
        });
        Program {
            graph,
            roots,
            dimension,
            parameters,
            tier,
            values: OnceLock::new(),
            gradients: OnceLock::new(),
            parameter_gradients: OnceLock::new(),
            hessians: OnceLock::new(),
            enclosures: OnceLock::new(),
            slopes: OnceLock::new(),
            value_trunk: OnceLock::new(),
            gradient_trunk: OnceLock::new(),
            parameter_trunk: OnceLock::new(),
        }
    }

    /// Another program over these functions: `make` gets the graph with the roots, and the place
    /// at which further parameters begin, and gives the new roots, functions of `dimension`
    /// coordinates. The result's parameters are places of this program's q, then of the further
    /// ones. What it serves, a picture, is made once, so it runs in vectors if these are compiled
    /// in a moment, else in blocks.
    pub fn derived(
        &self,
        dimension: usize,
        make: impl FnOnce(&mut Graph, &[NodeId], usize) -> Vec<NodeId>,
    ) -> Program {
        let mut graph = self.graph.clone();
        let roots = make(&mut graph, &self.roots, self.parameters.len());
        let tier = match self.tier {
            Tier::Automatic | Tier::MachineCode => Tier::quick(),
            chosen => chosen,
        };
        Program::with_tier(&graph, &roots, dimension, tier)
    }

    /// The session-wide indices of the parameters that the roots depend on, ascending: the
    /// components of the program's q.
    pub fn parameters(&self) -> &[u32] {
        &self.parameters
    }

    /// The number of roots.
    pub fn outputs(&self) -> usize {
        self.roots.len()
    }

    /// The number of coordinates.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// The number of nodes that the roots consist of.
    pub fn size(&self) -> usize {
        self.graph.reachable(&self.roots).len()
    }

    /// What executes the values of a batch of `count` points: never [`Tier::Automatic`]. Makes
    /// the machine code if that is what would run.
    pub fn tier(&self, count: usize) -> Tier {
        self.values().tier(count)
    }

    /// All roots at one point, into the first places of `outputs`. Missing coordinates and
    /// parameters are NaN. The first call compiles.
    pub fn evaluate(&self, point: &[f64], q: &[f64], outputs: &mut [f64]) {
        let coordinate = |axis| [point.get(axis).copied().unwrap_or(f64::NAN)];
        let [x, y, z] = std::array::from_fn(coordinate);
        let kernel = self.values();
        let mut columns: Vec<[f64; 1]> = vec![[f64::NAN]; self.outputs()];
        let mut group: Vec<&mut [f64]> = columns.iter_mut().map(|column| &mut column[..]).collect();
        kernel.run(&[&x, &y, &z], &kernel.uniforms(q), &mut group);
        for (output, [value]) in outputs.iter_mut().zip(columns) {
            *output = value;
        }
    }

    /// All roots at a batch of points: `points` has a column per axis and `outputs` one per root.
    /// As many points are evaluated as the shortest column has.
    pub fn evaluate_batch(&self, points: &[&[f64]], q: &[f64], outputs: &mut [&mut [f64]]) {
        let kernel = self.values();
        kernel.run(points, &kernel.uniforms(q), outputs);
    }

    /// The same in single precision, for pictures and classification: in blocks or vectors, faster
    /// and with half the memory. What depends on q alone is computed in f64 and rounded; then
    /// every operation rounds to f32. Of a graph with millions of values alive at a time nothing
    /// is computed, and false is returned.
    pub fn evaluate_batch_f32(
        &self,
        points: &[&[f32]],
        q: &[f64],
        outputs: &mut [&mut [f32]],
    ) -> bool {
        let kernel = self.values();
        let uniforms = kernel.uniforms(q);
        let uniforms: Vec<f32> = uniforms.iter().map(|&uniform| uniform as f32).collect();
        kernel.run_f32(points, &uniforms, outputs)
    }

    /// Encloses all roots over the box with these sides, into the first places of `outputs`:
    /// every value that a root takes in the box lies in its interval. A missing side or parameter
    /// is NaN, whatever depends on it has no value. The same as [`Program::enclose_batch`] of one
    /// box.
    pub fn enclose(&self, sides: &[Interval], q: &[f64], outputs: &mut [Interval]) {
        let side = |axis| [sides.get(axis).copied().unwrap_or(Interval::EMPTY)];
        let [x, y, z]: [[Interval; 1]; 3] = std::array::from_fn(side);
        let mut found = vec![[UNKNOWN]; self.outputs()];
        let mut columns: Vec<&mut [Enclosure]> =
            found.iter_mut().map(|column| &mut column[..]).collect();
        self.enclose_batch(&[&x, &y, &z], q, &mut columns);
        for (output, [enclosure]) in outputs.iter_mut().zip(found) {
            *output = enclosure.range;
        }
    }

    /// Encloses all roots over many boxes, with their regularity: `sides` has a column per axis
    /// and `outputs` one per root. As many boxes are taken as the shortest column has; they cost
    /// least by multiples of 64. The enclosure of a box alone is that of [`crate::graph::interval::enclose`],
    /// whose ends are as tight as they can be. Among several, what an enclosure is does not depend
    /// on the others, and sums, products, quotients and roots are at most one unit in the last
    /// place wider on each side, functions two, fused operations a little more.
    pub fn enclose_batch(
        &self,
        sides: &[&[Interval]],
        q: &[f64],
        outputs: &mut [&mut [Enclosure]],
    ) {
        let enclosures = self.enclosures();
        match enclosures.fixed_scalars() {
            Some(scalars) => enclosures.run(self.tier, sides, scalars, outputs),
            None => enclosures.run(self.tier, sides, &enclosures.scalars(q, &[]), outputs),
        }
    }

    /// Encloses the first root F over many boxes, with its regularity, and its F_x: `gradients` has
    /// a column per axis.
    ///
    /// A gradient's enclosure holds F_x wherever in the box the chain rule defines it, and every
    /// generalised gradient (the hull of what it is around a kink) on boxes on which F is
    /// continuous; conditions other than comparisons, and those joined by arithmetic, are the
    /// exception: there it holds what F_x is inside of the box. Where F is continuous and F_x bounded, the value's enclosure is the
    /// natural one cut with the mean-value form: it holds every exact value of F, and need not
    /// hold what F computes with rounding errors. See [`Program::enclose_batch`] for the rest.
    pub fn enclose_gradient_batch(
        &self,
        sides: &[&[Interval]],
        q: &[f64],
        values: &mut [Enclosure],
        gradients: &mut [&mut [Interval]],
    ) {
        if let Some(slopes) = self.slopes() {
            slopes.run(self.tier, sides, &slopes.scalars(q), values, gradients);
        }
    }

    /// The tier that was asked for.
    pub(super) fn chosen_tier(&self) -> Tier {
        self.tier
    }

    /// Whether the functions are much shorter in small boxes: they are long and make choices.
    pub fn is_pruned(&self) -> bool {
        let sequence = self.value_trunk().sequence();
        sequence.has_choices && sequence.len() >= LONG
    }

    /// The first root in the program's own graph, whose parameters are places of q.
    pub fn first_root(&self) -> Option<(&Graph, NodeId)> {
        Some((&self.graph, *self.roots.first()?))
    }

    /// What encloses the first root and its F_x; none if there is no root.
    pub(super) fn slopes(&self) -> Option<&Slopes> {
        let &root = self.roots.first()?;
        let sizes = (self.dimension, self.parameters.len());
        Some(
            self.slopes
                .get_or_init(|| Slopes::new(&self.graph, root, sizes)),
        )
    }

    /// What encloses the roots.
    pub(super) fn enclosures(&self) -> &Enclosures {
        let sizes = (self.dimension, self.parameters.len());
        self.enclosures
            .get_or_init(|| Enclosures::new(&self.graph, &self.roots, sizes))
    }

    /// The roots and all that they are made of as text; parameters are named by their places in
    /// the program's q.
    pub fn graph_text(&self) -> String {
        print::text(&self.graph, &self.roots)
    }

    /// The kernels in Cranelift's intermediate representation: values and, of a program with one
    /// root, the derivatives. The same text on every machine.
    pub fn clif(&self) -> String {
        let mut text = self.values().clif("values");
        if self.roots.len() == 1 {
            text += "\n";
            text += &self.gradients().clif("gradients");
            if !self.parameters.is_empty() {
                text += "\n";
                text += &self.parameter_gradients().clif("parameter_gradients");
            }
        }
        text
    }

    /// The kernel of the roots.
    pub(super) fn values(&self) -> &Kernel {
        self.values
            .get_or_init(|| self.kernel(&self.graph, &self.roots))
    }

    /// The kernel of the first root and its F_x.
    pub(super) fn gradients(&self) -> &Kernel {
        self.gradients.get_or_init(|| {
            let (graph, roots) = self.gradient_roots();
            self.kernel(&graph, &roots)
        })
    }

    /// The first root and its F_x: by a reverse sweep or, where that would keep very many values
    /// for each point, by tangents. Both are exact but may round differently, so the choice
    /// depends on the graph alone.
    fn gradient_roots(&self) -> (Graph, Vec<NodeId>) {
        let reverse = self.derivative_roots(0);
        let size = |(graph, roots): &(Graph, Vec<NodeId>)| {
            let parameters = self.parameters.len();
            let tape = tape::assemble(&lower::list(graph, roots, self.dimension, parameters));
            (tape.instructions.len(), tape.registers)
        };
        let (instructions, registers) = size(&reverse);
        let Some(&root) = self.roots.first() else {
            return reverse;
        };
        if registers <= MANY_REGISTERS {
            return reverse;
        }
        let tangents = derive::tangents(&self.graph, root, self.dimension);
        let (others, fewer) = size(&tangents);
        if fewer <= registers / 2 && others <= instructions + instructions / 2 {
            tangents
        } else {
            reverse
        }
    }

    /// The kernel of the first root, its F_x and its F_q.
    pub(super) fn parameter_gradients(&self) -> &Kernel {
        self.parameter_gradients.get_or_init(|| {
            let (graph, roots) = self.derivative_roots(self.parameters.len());
            self.kernel(&graph, &roots)
        })
    }

    /// What runs blocks: those of its tier, or the widest.
    pub(super) fn block_kernels(&self) -> Kernels {
        self.tier.kernels()
    }

    /// The roots, to be pruned.
    pub(super) fn value_trunk(&self) -> &Trunk {
        let sizes = (self.dimension, self.parameters.len());
        self.value_trunk
            .get_or_init(|| Trunk::new(&self.graph, &self.roots, sizes, own_choice))
    }

    /// The first root and its F_x, to be pruned by what is decided of [`Program::value_trunk`].
    pub(super) fn gradient_trunk(&self) -> &Trunk {
        self.gradient_trunk.get_or_init(|| {
            let (mut graph, roots) = self.gradient_roots();
            let shared = self.roots.first();
            let shared = shared.map(|&root| shared_choices(&self.graph, root, &mut graph));
            let shared = shared.unwrap_or_default();
            let sizes = (self.dimension, self.parameters.len());
            Trunk::new(&graph, &roots, sizes, |node| {
                shared.get(&node).copied().unwrap_or(Origin::NONE)
            })
        })
    }

    /// How many numbers there are of choices of the first root; see [`shared_choices`].
    pub(super) fn choices(&self) -> usize {
        self.graph.len() + 1
    }

    /// The first root, its F_x and its F_q, to be pruned.
    pub(super) fn parameter_trunk(&self) -> &Trunk {
        self.parameter_trunk.get_or_init(|| {
            let (graph, roots) = self.derivative_roots(self.parameters.len());
            let sizes = (self.dimension, self.parameters.len());
            Trunk::new(&graph, &roots, sizes, own_choice)
        })
    }

    /// The first root, its F_x and the first components of its F_q, from one reverse sweep.
    fn derivative_roots(&self, parameters: usize) -> (Graph, Vec<NodeId>) {
        let mut graph = self.graph.clone();
        let axes = 0..self.dimension;
        let mut variables: Vec<NodeId> = axes.map(|axis| graph.coordinate(axis)).collect();
        variables.extend((0..parameters).map(|place| graph.parameter(place)));
        let mut roots: Vec<NodeId> = self.roots.first().copied().into_iter().collect();
        if let Some(&root) = roots.first() {
            roots.extend(derive::reverse(&mut graph, root, &variables));
        }
        (graph, roots)
    }

    /// The kernel of the first root, its F_x and the upper triangle of its F_xx, row by row.
    pub(super) fn hessians(&self) -> &Kernel {
        self.hessians.get_or_init(|| {
            let mut graph = self.graph.clone();
            let variables: Vec<NodeId> = (0..self.dimension)
                .map(|axis| graph.coordinate(axis))
                .collect();
            let mut roots: Vec<NodeId> = self.roots.first().copied().into_iter().collect();
            if let Some(&root) = roots.first() {
                roots.extend(derive::reverse(&mut graph, root, &variables));
                let matrix = derive::hessian(&mut graph, root, &variables);
                roots.extend(
                    matrix
                        .iter()
                        .enumerate()
                        .flat_map(|(row, entries)| &entries[row..]),
                );
            }
            self.kernel(&graph, &roots)
        })
    }

    /// A kernel of these roots.
    fn kernel(&self, graph: &Graph, roots: &[NodeId]) -> Kernel {
        let sizes = (self.dimension, self.parameters.len());
        Kernel::new(graph, roots, sizes, self.tier)
    }
}

/// The choice that a node of a function's own graph is.
fn own_choice(node: NodeId) -> Origin {
    Origin::new(node.index())
}
