//! A program: the graph of one field with everything that is derived from it.
//!
//! A program is made once for a field and kept with it. Its kernels are compiled when they are
//! first used, and a new q compiles nothing. [`super::CompiledField`] puts a program and a q
//! together to what samplers and polygonizers take.

use super::Tier;
use super::block::{Enclosures, Kernels};
use super::kernel::Kernel;
use super::lower::{copy_leaf, rebuild};
use super::prune::Trunk;
use crate::graph::interval::{self, Enclosure, Interval};
use crate::graph::{Graph, Node, NodeId, derive, print};
use std::sync::OnceLock;

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
            value_trunk: OnceLock::new(),
            gradient_trunk: OnceLock::new(),
            parameter_trunk: OnceLock::new(),
        }
    }

    /// Another program over these functions: `make` gets the graph with the roots, and the place
    /// at which further parameters begin, and gives the new roots, functions of `dimension`
    /// coordinates. The result's parameters are places of this program's q, then of the further
    /// ones. It runs in blocks, so that nothing is compiled: what it serves, a picture, is made
    /// once.
    pub fn derived(
        &self,
        dimension: usize,
        make: impl FnOnce(&mut Graph, &[NodeId], usize) -> Vec<NodeId>,
    ) -> Program {
        let mut graph = self.graph.clone();
        let roots = make(&mut graph, &self.roots, self.parameters.len());
        let tier = match self.tier {
            Tier::Automatic | Tier::MachineCode => Tier::Block(Kernels::widest()),
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

    /// The same in single precision, for pictures and classification: always in blocks, faster
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
    /// is NaN, whatever depends on it has no value. See [`interval::enclose`].
    pub fn enclose(&self, sides: &[Interval], q: &[f64], outputs: &mut [Interval]) {
        let side = |axis| sides.get(axis).copied().unwrap_or(Interval::EMPTY);
        let sides: [Interval; 3] = std::array::from_fn(side);
        let parameter = |place: u32| q.get(place as usize).copied().unwrap_or(f64::NAN);
        let enclosures = interval::enclose(&self.graph, &self.roots, &sides, parameter);
        for (output, enclosure) in outputs.iter_mut().zip(enclosures) {
            *output = enclosure.range;
        }
    }

    /// Encloses all roots over many boxes, with their regularity: `sides` has a column per axis
    /// and `outputs` one per root. As many boxes are taken as the shortest column has; 64 at a
    /// time cost little more than one by [`Program::enclose`]. Sums, products, quotients and roots
    /// are up to one unit in the last place wider on each side than there.
    pub fn enclose_batch(
        &self,
        sides: &[&[Interval]],
        q: &[f64],
        outputs: &mut [&mut [Enclosure]],
    ) {
        let sizes = (self.dimension, self.parameters.len());
        let new = || Enclosures::new(&self.graph, &self.roots, sizes);
        let enclosures = self.enclosures.get_or_init(new);
        if !enclosures.run(self.block_kernels(), sides, q, outputs) {
            // Too large for blocks: widest bounds, which are always true.
            let unknown = Enclosure {
                range: Interval::ENTIRE,
                regularity: interval::Regularity::Partial,
            };
            for column in outputs.iter_mut().take(self.outputs()) {
                column.fill(unknown);
            }
        }
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
        self.gradients.get_or_init(|| self.derivatives(0))
    }

    /// The kernel of the first root, its F_x and its F_q.
    pub(super) fn parameter_gradients(&self) -> &Kernel {
        self.parameter_gradients
            .get_or_init(|| self.derivatives(self.parameters.len()))
    }

    /// What runs blocks: those of its tier, or the widest.
    pub(super) fn block_kernels(&self) -> Kernels {
        self.tier.kernels()
    }

    /// The roots, to be pruned.
    pub(super) fn value_trunk(&self) -> &Trunk {
        let sizes = (self.dimension, self.parameters.len());
        self.value_trunk
            .get_or_init(|| Trunk::new(&self.graph, &self.roots, sizes))
    }

    /// The first root and its F_x, to be pruned.
    pub(super) fn gradient_trunk(&self) -> &Trunk {
        self.gradient_trunk.get_or_init(|| self.derivative_trunk(0))
    }

    /// The first root, its F_x and its F_q, to be pruned.
    pub(super) fn parameter_trunk(&self) -> &Trunk {
        self.parameter_trunk
            .get_or_init(|| self.derivative_trunk(self.parameters.len()))
    }

    /// The first root and derivatives, to be pruned.
    fn derivative_trunk(&self, parameters: usize) -> Trunk {
        let (graph, roots) = self.derivative_roots(parameters);
        Trunk::new(&graph, &roots, (self.dimension, self.parameters.len()))
    }

    /// The kernel of the first root, its F_x and the first components of its F_q.
    fn derivatives(&self, parameters: usize) -> Kernel {
        let (graph, roots) = self.derivative_roots(parameters);
        self.kernel(&graph, &roots)
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
