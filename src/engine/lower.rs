//! From a graph to a list of steps: the one form that machine code and the interpreter execute.
//!
//! Operations that processors lack are replaced by those they have (the table's `Lower` rules),
//! nodes that no output needs disappear, and what depends on q alone is separated from what
//! depends on the point: it is computed once for a q, not once a point.

use crate::graph::operation::MachineCode;
use crate::graph::{Graph, Node, NodeId, Op};

/// Where a step finds an operand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Operand {
    /// A number that never changes.
    Constant(f64),
    /// A number that is the same for all points: a place of the list that
    /// [`super::interpret::uniforms`] makes of q.
    Uniform(u32),
    /// A coordinate of the point.
    Coordinate(u8),
    /// The result of an earlier step for the same point.
    Register(u32),
}

/// One operation on operands that are known by then. Its result is the register (or uniform)
/// that has its place in the list.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// What to do; after [`lower`] never an operation that needs lowering.
    pub(super) operation: Op,
    /// The operands, of which the operation's arity count; the others repeat the first.
    pub(super) operands: [Operand; 3],
}

impl Step {
    /// The operands that count.
    pub(super) fn operands(&self) -> &[Operand] {
        &self.operands[..self.operation.arity()]
    }
}

/// A graph as steps.
#[derive(Clone, Debug, Default)]
pub(super) struct Lowered {
    /// How many coordinates a point has.
    pub(super) dimension: usize,
    /// How many parameters there are: the first places of the uniforms.
    pub(super) parameters: usize,
    /// What depends on q alone; step i makes uniform `parameters + i`.
    pub(super) uniform_steps: Vec<Step>,
    /// What depends on the point; step i makes register i.
    pub(super) steps: Vec<Step>,
    /// The results.
    pub(super) outputs: Vec<Operand>,
}

impl Lowered {
    /// The number of uniforms: q and what is computed of it.
    pub(super) fn uniforms(&self) -> usize {
        self.parameters + self.uniform_steps.len()
    }
}

/// Lowers what the roots need. A coordinate that is not below `dimension` does not exist, and is
/// NaN; nor does a parameter that is not below `parameters`. Takes time and memory in proportion
/// to the graph.
pub(super) fn lower(
    graph: &Graph,
    roots: &[NodeId],
    dimension: usize,
    parameters: usize,
) -> Lowered {
    let (graph, roots) = without_lowerings(graph, roots);
    list(&graph, &roots, dimension, parameters)
}

/// The same without replacing any operation: for those who have a rule for each.
pub(super) fn list(
    graph: &Graph,
    roots: &[NodeId],
    dimension: usize,
    parameters: usize,
) -> Lowered {
    list_with_nodes(graph, roots, dimension, parameters).0
}

/// The same, with the nodes that the steps are made of.
pub(super) fn list_with_nodes(
    graph: &Graph,
    roots: &[NodeId],
    dimension: usize,
    parameters: usize,
) -> (Lowered, Vec<NodeId>) {
    let mut nodes = Vec::new();
    let mut lowered = Lowered {
        dimension,
        parameters,
        ..Lowered::default()
    };
    let mut places = vec![Operand::Constant(0.0); graph.len()];
    for id in graph.reachable(roots) {
        places[id.index()] = match graph.node(id) {
            Node::Constant(bits) => Operand::Constant(f64::from_bits(bits)),
            Node::Coordinate(axis) if usize::from(axis) < dimension => Operand::Coordinate(axis),
            Node::Parameter(index) if (index as usize) < parameters => Operand::Uniform(index),
            Node::Coordinate(_) | Node::Parameter(_) => Operand::Constant(f64::NAN),
            Node::Apply(operation, operands) => {
                let operands = operands.map(|operand| places[operand.index()]);
                let step = Step {
                    operation,
                    operands,
                };
                let place = lowered.push(step);
                if nodes.len() < lowered.steps.len() {
                    nodes.push(id);
                }
                place
            }
        };
    }
    lowered.outputs = roots.iter().map(|root| places[root.index()]).collect();
    (lowered, nodes)
}

impl Lowered {
    /// Appends a step where it belongs and returns the place of its result.
    fn push(&mut self, step: Step) -> Operand {
        let varies =
            |operand: &Operand| matches!(operand, Operand::Coordinate(_) | Operand::Register(_));
        if step.operands().iter().any(varies) {
            self.steps.push(step);
            Operand::Register(self.steps.len() as u32 - 1)
        } else {
            self.uniform_steps.push(step);
            Operand::Uniform(self.uniforms() as u32 - 1)
        }
    }
}

/// The same graph without operations that need lowering. A rule may build operations that need
/// it in turn, so this repeats until none is left.
fn without_lowerings(graph: &Graph, roots: &[NodeId]) -> (Graph, Vec<NodeId>) {
    let mut found = true;
    let (mut graph, mut roots) = (graph.clone(), roots.to_vec());
    while found {
        found = false;
        (graph, roots) = rebuild(&graph, &roots, |target, node, operands| match node {
            Node::Apply(op, _) => match op.operation().code {
                MachineCode::Lower(rule) => {
                    found = true;
                    rule(target, operands)
                }
                MachineCode::Native(_) | MachineCode::Host => target.apply(op, operands),
            },
            leaf => copy_leaf(target, leaf),
        });
    }
    (graph, roots)
}

/// A new graph of what the roots need, in which `build` makes each node from the new operands.
pub(super) fn rebuild(
    graph: &Graph,
    roots: &[NodeId],
    mut build: impl FnMut(&mut Graph, Node, &[NodeId]) -> NodeId,
) -> (Graph, Vec<NodeId>) {
    let mut target = Graph::new();
    // Every operand is overwritten before it is read, since operands come first.
    let mut copies = roots
        .first()
        .map_or_else(Vec::new, |&root| vec![root; graph.len()]);
    for id in graph.reachable(roots) {
        let node = graph.node(id);
        let mut operands = [id; 3];
        let arity = node.operands().len();
        for (copy, operand) in operands.iter_mut().zip(node.operands()) {
            *copy = copies[operand.index()];
        }
        copies[id.index()] = build(&mut target, node, &operands[..arity]);
    }
    let roots = roots.iter().map(|root| copies[root.index()]).collect();
    (target, roots)
}

/// The same leaf in another graph.
pub(super) fn copy_leaf(target: &mut Graph, leaf: Node) -> NodeId {
    match leaf {
        Node::Constant(bits) => target.constant(f64::from_bits(bits)),
        Node::Coordinate(axis) => target.coordinate(usize::from(axis)),
        Node::Parameter(index) => target.parameter(index as usize),
        Node::Apply(op, operands) => target.apply(op, &operands[..op.arity()]),
    }
}
