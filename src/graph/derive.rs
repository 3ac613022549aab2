//! Derivatives by source transformation: the derivative of a node is more nodes of the same
//! graph, so it shares what it has in common with the function, can be simplified, compiled and
//! differentiated again.
//!
//! [`reverse`] is the adjoint sweep (Griewank & Walther, Evaluating Derivatives, 2nd ed., section
//! 3.2): all derivatives of one root for a few times the root's operations. [`forward`]
//! propagates tangents (section 3.1): one variable, any number of roots; [`tangents`] does so for
//! all coordinates at once. All read the partial derivatives from the table of operations and follow the same rules at points where
//! derivatives are delicate:
//!
//! * |a|′ is 0 at 0; at a tie `min` and `max` are their first operand.
//! * Where the root is NaN, so is its derivative in every variable that it depends on.
//! * An exactly zero adjoint, tangent or partial derivative absorbs infinity and NaN
//!   ([`Op::ChainProduct`]): √(x² + y²) has gradient 0 at the origin.
//! * Branches are chosen by value; the one not taken contributes nothing, its NaN neither.
//!
//! Nothing here uses stack for depth.

use rustc_hash::FxHashMap;

use super::operation::Derivative;
use super::traverse::NodeMap;
use super::{Graph, Node, NodeId, Op};

/// ∂root/∂variable for every variable, by one adjoint sweep.
///
/// A variable is usually a coordinate or a parameter; any other node is taken for an independent
/// one. A variable that the root does not depend on has derivative 0.
pub fn reverse(graph: &mut Graph, root: NodeId, variables: &[NodeId]) -> Vec<NodeId> {
    let inner = without_gate(graph, root, variables);
    let nodes = graph.reachable(&[inner]);
    let dependent = dependents(graph, &nodes, variables);
    let [zero, one] = [0.0, 1.0].map(|value| graph.constant(value));
    let mut adjoints = NodeMap::new(graph);
    adjoints.set(inner, one);
    for &id in nodes.iter().rev() {
        if let Node::Apply(op, operands) = graph.node(id)
            && let Some(adjoint) = adjoints.get(id)
        {
            for place in 0..op.arity() {
                if dependent[operands[place].index()] {
                    let term = adjoint_term(graph, op, operands, id, adjoint, place);
                    accumulate(graph, &mut adjoints, operands[place], term);
                }
            }
        }
    }
    let support = graph.reachable(&[root]);
    let derivative = |&variable: &NodeId| match support.binary_search(&variable) {
        Ok(_) => gate(graph, root, adjoints.get(variable).unwrap_or(zero)),
        Err(_) => zero,
    };
    variables.iter().map(derivative).collect()
}

/// ∂root/∂variable for every root, by one sweep of tangents. See [`reverse`] for what a variable
/// may be.
pub fn forward(graph: &mut Graph, roots: &[NodeId], variable: NodeId) -> Vec<NodeId> {
    let [zero, one] = [0.0, 1.0].map(|value| graph.constant(value));
    let mut tangents = NodeMap::new(graph);
    for id in graph.reachable(roots) {
        if id == variable {
            tangents.set(id, one);
        } else if let Node::Apply(op, operands) = graph.node(id)
            && operands
                .iter()
                .any(|&operand| tangents.get(operand).is_some())
        {
            let of_operands = operands.map(|id| tangents.get(id).unwrap_or(zero));
            let tangent = tangent(graph, op, operands, id, of_operands);
            tangents.set(id, tangent);
        }
    }
    let derivative = |&root: &NodeId| {
        let inner = without_gate(graph, root, &[variable]);
        match tangents.get(root) {
            Some(_) => gate(graph, root, tangents.get(inner).unwrap_or(zero)),
            None => zero,
        }
    };
    roots.iter().map(derivative).collect()
}

/// The root and its derivatives in the coordinates of these axes as a graph of their own, by one
/// sweep of tangents, in which the tangents of a node stand right behind it. So, other than after
/// [`reverse`], few values are needed at a time: as many for each axis as by the root alone.
pub fn tangents(graph: &Graph, root: NodeId, axes: usize) -> (Graph, Vec<NodeId>) {
    let mut target = Graph::new();
    let [zero, one] = [0.0, 1.0].map(|value| target.constant(value));
    let mut copies = FxHashMap::default();
    for id in graph.reachable(&[root]) {
        let node = graph.node(id);
        let copied = node.operands().iter().map(|operand| copies[operand]);
        let copied: Vec<(NodeId, [NodeId; 3])> = copied.collect();
        let place = |place: usize| copied.get(place).copied().unwrap_or((zero, [zero; 3]));
        let operands = [place(0), place(1), place(2)];
        let mut of_axes = [zero; 3];
        let copy = match node {
            Node::Constant(bits) => target.constant(f64::from_bits(bits)),
            Node::Parameter(index) => target.parameter(index as usize),
            Node::Coordinate(axis) => {
                if let Some(own) = of_axes[..axes].get_mut(usize::from(axis)) {
                    *own = one;
                }
                target.coordinate(usize::from(axis))
            }
            Node::Apply(op, _) => {
                let nodes = operands.map(|(node, _)| node);
                let copy = target.apply(op, &nodes[..op.arity()]);
                for (axis, own) in of_axes[..axes].iter_mut().enumerate() {
                    let of_operands = operands.map(|(_, tangents)| tangents[axis]);
                    if of_operands.iter().any(|&tangent| tangent != zero) {
                        *own = tangent(&mut target, op, nodes, copy, of_operands);
                    }
                }
                copy
            }
        };
        copies.insert(id, (copy, of_axes));
    }
    let support = graph.support(&[root]).coordinates;
    let (root, of_axes) = copies[&root];
    let mut roots = vec![root];
    for (axis, &tangent) in of_axes[..axes].iter().enumerate() {
        let depends = support.iter().any(|&other| usize::from(other) == axis);
        roots.push(match depends {
            true => gate(&mut target, root, tangent),
            false => zero,
        });
    }
    (target, roots)
}

/// ∂²root/∂variable∂variable: a symmetric matrix, by a forward sweep over the reverse one for
/// every variable.
pub fn hessian(graph: &mut Graph, root: NodeId, variables: &[NodeId]) -> Vec<Vec<NodeId>> {
    let gradient = reverse(graph, root, variables);
    let mut matrix = vec![gradient.clone(); variables.len()];
    for (column, &variable) in variables.iter().enumerate() {
        let entries = forward(graph, &gradient[..=column], variable);
        for (row, entry) in entries.into_iter().enumerate() {
            matrix[row][column] = entry;
            matrix[column][row] = entry;
        }
    }
    matrix
}

/// For every node of the graph whether its value changes with a variable; a variable's does.
fn dependents(graph: &Graph, nodes: &[NodeId], variables: &[NodeId]) -> Vec<bool> {
    let mut dependent = vec![false; graph.len()];
    for variable in variables {
        dependent[variable.index()] = true;
    }
    for &id in nodes {
        let node = graph.node(id);
        if node
            .operands()
            .iter()
            .any(|operand| dependent[operand.index()])
        {
            dependent[id.index()] = true;
        }
    }
    dependent
}

/// What a node passes to the adjoint of its operand at `place`.
fn adjoint_term(
    graph: &mut Graph,
    op: Op,
    operands: [NodeId; 3],
    result: NodeId,
    adjoint: NodeId,
    place: usize,
) -> NodeId {
    let zero = graph.constant(0.0);
    match op.operation().derivative {
        Derivative::Zero => zero,
        Derivative::Partials(partials) => {
            let partial = partials[place](graph, operands, result);
            graph.apply(Op::ChainProduct, &[adjoint, partial])
        }
        Derivative::Branch {
            condition,
            taken,
            otherwise,
        } => {
            let branches = [taken, otherwise];
            if !branches.contains(&place) {
                return zero;
            }
            let condition = condition(graph, operands);
            let [taken, otherwise] = branches.map(|b| if b == place { adjoint } else { zero });
            graph.apply(Op::Select, &[condition, taken, otherwise])
        }
    }
}

/// Adds a term to a node's adjoint. Terms come in the order of the sweep, which is the same in
/// every run. A constant zero is no term: adding it could only change the sign of a zero.
fn accumulate(graph: &mut Graph, adjoints: &mut NodeMap, id: NodeId, term: NodeId) {
    if graph.constant_value(term) == Some(0.0) {
        return;
    }
    let sum = match adjoints.get(id) {
        Some(adjoint) => graph.apply(Op::Add, &[adjoint, term]),
        None => term,
    };
    adjoints.set(id, sum);
}

/// The tangent of a node from those of its operands.
fn tangent(
    graph: &mut Graph,
    op: Op,
    operands: [NodeId; 3],
    result: NodeId,
    tangents: [NodeId; 3],
) -> NodeId {
    let zero = graph.constant(0.0);
    match op.operation().derivative {
        Derivative::Zero => zero,
        Derivative::Partials(partials) => {
            let mut sum = None;
            for (partial, tangent) in partials.iter().zip(tangents) {
                if tangent != zero {
                    let partial = partial(graph, operands, result);
                    let term = graph.apply(Op::ChainProduct, &[tangent, partial]);
                    sum = Some(sum.map_or(term, |sum| graph.apply(Op::Add, &[sum, term])));
                }
            }
            sum.unwrap_or(zero)
        }
        Derivative::Branch {
            condition,
            taken,
            otherwise,
        } => {
            let condition = condition(graph, operands);
            graph.apply(
                Op::Select,
                &[condition, tangents[taken], tangents[otherwise]],
            )
        }
    }
}

/// The derivative of a root, made NaN where the root is NaN.
fn gate(graph: &mut Graph, root: NodeId, derivative: NodeId) -> NodeId {
    let undefined = graph.constant(f64::NAN);
    let defined = graph.apply(Op::IsNumber, &[root]);
    graph.apply(Op::Select, &[defined, derivative, undefined])
}

/// What a gated derivative is where it is not NaN. Differentiating that and gating by the root
/// is the same as differentiating the gate, and saves a branch on every path.
fn without_gate(graph: &Graph, root: NodeId, variables: &[NodeId]) -> NodeId {
    let mut inner = root;
    while let Node::Apply(Op::Select, [condition, derivative, undefined]) = graph.node(inner)
        && let Node::Apply(Op::IsNumber, _) = graph.node(condition)
        && graph.constant_value(undefined).is_some_and(f64::is_nan)
        && !variables.contains(&inner)
    {
        inner = derivative;
    }
    inner
}

#[cfg(test)]
mod tests;
