//! Seeded random expressions that use every operation of the table, and points to try them at.

use imp::graph::operation::Derivative;
use imp::graph::{Graph, Node, NodeId, Op};

/// A sequence of random numbers (splitmix64, Steele et al. 2014), the same on every machine.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// 64 random bits.
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [low, high).
    pub(crate) fn uniform(&mut self, low: f64, high: f64) -> f64 {
        let unit = (self.bits() >> 11) as f64 / (1u64 << 53) as f64;
        low + (high - low) * unit
    }

    /// Uniform below `count`.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    /// One of these.
    pub(crate) fn choose<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }
}

/// How many parameters the expressions have at most.
pub(crate) const PARAMETERS: usize = 3;

/// Numbers at which operations misbehave.
pub(crate) const SPECIAL: &[f64] = &[
    0.0,
    -0.0,
    5e-324,
    -2.3e-308,
    1e-160,
    0.5,
    -0.5,
    1.0,
    -1.0,
    1.5,
    2.0,
    -2.5,
    std::f64::consts::PI,
    4_503_599_627_370_495.5,
    1e160,
    -1e300,
    f64::MAX,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::NAN,
];

/// A random expression of 3 to 24 operations, of which the one numbered `seed` modulo their
/// number is certain to be there. Whatever is computed is a part of the root.
pub(crate) fn expression(graph: &mut Graph, seed: u64) -> NodeId {
    let random = &mut Random(seed);
    let certain = Op::ALL[seed as usize % Op::ALL.len()];
    let operations = 3 + random.below(22);
    let place = random.below(operations);
    let mut nodes: Vec<NodeId> = (0..3).map(|axis| graph.coordinate(axis)).collect();
    nodes.extend((0..PARAMETERS).map(|index| graph.parameter(index)));
    let mut root = random.choose(&nodes);
    for index in 0..operations {
        let op = match index == place {
            true => certain,
            false => random.choose(Op::ALL),
        };
        root = apply(graph, random, op, root, &nodes);
        if matches!(op.operation().derivative, Derivative::Zero) {
            // So that steps leave something to differentiate.
            let leaf = random.choose(&nodes);
            root = graph.apply(Op::Add, &[root, leaf]);
        }
        if random.below(3) == 0 {
            root = tame(graph, random, root);
        }
        nodes.push(root);
    }
    root
}

/// The operation on the newest node and random others, in random order.
fn apply(
    graph: &mut Graph,
    random: &mut Random,
    op: Op,
    newest: NodeId,
    nodes: &[NodeId],
) -> NodeId {
    if op == Op::IntegerPower {
        let exponent = graph.constant(random.below(9) as f64 - 3.0);
        return graph.apply(op, &[newest, exponent]);
    }
    let mut operands: Vec<NodeId> = (0..op.arity())
        .map(|_| match random.below(5) {
            0 => graph.constant(random.choose(&[0.5, -1.5, 2.0, 3.0, 0.0, -0.75])),
            _ => random.choose(nodes),
        })
        .collect();
    let place = random.below(operands.len());
    operands[place] = newest;
    graph.apply(op, &operands)
}

/// A function of the node with moderate values, so that the next operation is often defined.
fn tame(graph: &mut Graph, random: &mut Random, node: NodeId) -> NodeId {
    let op = random.choose(&[Op::Sin, Op::Tanh, Op::Atan]);
    let bounded = graph.apply(op, &[node]);
    let half = graph.constant(0.5);
    let scaled = graph.apply(Op::Multiply, &[bounded, half]);
    match random.below(2) {
        0 => scaled,
        _ => {
            let shift = graph.constant(0.875);
            graph.apply(Op::Add, &[scaled, shift])
        }
    }
}

/// A node's value by the table's value rules alone, without lowering or a kernel.
pub(crate) fn direct(graph: &Graph, roots: &[NodeId], point: [f64; 3], q: &[f64]) -> Vec<f64> {
    let mut values = vec![f64::NAN; graph.len()];
    for id in graph.reachable(roots) {
        values[id.index()] = match graph.node(id) {
            Node::Constant(bits) => f64::from_bits(bits),
            Node::Coordinate(axis) => point[usize::from(axis)],
            Node::Parameter(index) => q[index as usize],
            Node::Apply(op, operands) => op.value(operands.map(|operand| values[operand.index()])),
        };
    }
    roots.iter().map(|root| values[root.index()]).collect()
}

/// The same bits, or both NaN.
pub(crate) fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

/// Columns of random points: `ordinary` ones in [−2, 2]³, then `special` ones whose coordinates
/// are special numbers, ties among them.
pub(crate) fn points(random: &mut Random, ordinary: usize, special: usize) -> [Vec<f64>; 3] {
    let mut columns = [Vec::new(), Vec::new(), Vec::new()];
    for _ in 0..ordinary {
        for column in &mut columns {
            column.push(random.uniform(-2.0, 2.0));
        }
    }
    for _ in 0..special {
        let tie = random.choose(SPECIAL);
        for column in &mut columns {
            column.push(match random.below(3) {
                0 => tie,
                1 => random.choose(SPECIAL),
                _ => random.uniform(-2.0, 2.0),
            });
        }
    }
    columns
}
