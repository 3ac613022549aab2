//! A program: the graph of one field with everything that is derived from it.
//!
//! A program is made once for a field and kept with it. Its kernels are compiled when they are
//! first used, and a new q compiles nothing. [`super::CompiledField`] puts a program and a q
//! together to what samplers and polygonizers take.

use super::block::{Enclosures, Kernels};
use super::kernel::Kernel;
use super::lower::{copy_leaf, rebuild};
use crate::graph::interval::{self, Enclosure, Interval};
use crate::graph::{Graph, Node, NodeId, derive, print};
use std::sync::OnceLock;

/// What executes kernels.
///
/// All give the same bits, elementary functions aside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backend {
    /// Machine code made by Cranelift.
    MachineCode,
    /// Blocks of points, one operation after the other, by kernels for this instruction set or,
    /// where the processor lacks it, a narrower one.
    Block(Kernels),
    /// The reference interpreter; ten to forty times slower, on every platform.
    Interpreter,
}

/// One or several functions of (x, q), ready to be evaluated.
pub struct Program {
    graph: Graph,
    roots: Vec<NodeId>,
    dimension: usize,
    parameters: Vec<u32>,
    backend: Backend,
    values: OnceLock<Kernel>,
    gradients: OnceLock<Kernel>,
    parameter_gradients: OnceLock<Kernel>,
    enclosures: OnceLock<Enclosures>,
}

impl Program {
    /// The functions `roots` of `dimension` coordinates (0 to 3). Only what the roots consist of
    /// is copied from the graph; a coordinate beyond the dimension does not exist: it is NaN.
    /// Nothing is compiled yet.
    pub fn new(graph: &Graph, roots: &[NodeId], dimension: usize) -> Program {
        Program::with_backend(graph, roots, dimension, Backend::MachineCode)
    }

    /// The same with a choice of what executes it. Where machine code cannot be made, the
    /// interpreter serves also those who ask for machine code; see [`Program::backend`].
    pub fn with_backend(
        graph: &Graph,
        roots: &[NodeId],
        dimension: usize,
        backend: Backend,
    ) -> Program {
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
            backend,
            values: OnceLock::new(),
            gradients: OnceLock::new(),
            parameter_gradients: OnceLock::new(),
            enclosures: OnceLock::new(),
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
        let kernels = match self.backend {
            Backend::Block(kernels) => kernels,
            Backend::MachineCode | Backend::Interpreter => Kernels::widest(),
        };
        Program::with_backend(&graph, &roots, dimension, Backend::Block(kernels))
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

    /// What executes the values. Compiles them on first use.
    pub fn backend(&self) -> Backend {
        self.values().backend()
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
        kernel.run_f32(points, &kernel.uniforms(q), outputs)
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
        let kernels = match self.backend {
            Backend::Block(kernels) => kernels,
            Backend::MachineCode | Backend::Interpreter => Kernels::widest(),
        };
        if !enclosures.run(kernels, sides, q, outputs) {
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

    /// The first root, its F_x and the first components of its F_q, from one reverse sweep.
    fn derivatives(&self, parameters: usize) -> Kernel {
        let mut graph = self.graph.clone();
        let axes = 0..self.dimension;
        let mut variables: Vec<NodeId> = axes.map(|axis| graph.coordinate(axis)).collect();
        variables.extend((0..parameters).map(|place| graph.parameter(place)));
        let mut roots: Vec<NodeId> = self.roots.first().copied().into_iter().collect();
        if let Some(&root) = roots.first() {
            roots.extend(derive::reverse(&mut graph, root, &variables));
        }
        self.kernel(&graph, &roots)
    }

    /// A kernel of these roots.
    fn kernel(&self, graph: &Graph, roots: &[NodeId]) -> Kernel {
        let sizes = (self.dimension, self.parameters.len());
        Kernel::new(graph, roots, sizes, self.backend)
    }
}
