//! Enclosures of F and of its gradient over boxes, and the mean-value form.
//!
//! The gradient is the derivative graph of [`derive::reverse`] over intervals. Where F has a kink
//! inside or on the face of a box, its generalised gradient (F. H. Clarke, Optimization and
//! Nonsmooth Analysis, 1983) is the hull of the gradients of both sides, so wherever the operands
//! of a comparison touch, the derivative's branch is left open; for intervals an undecided branch is the hull of
//! both. The value graph stays as it is.
//!
//! By the mean value theorem (Lebourg's, for Lipschitz functions) F(x) lies in
//! F(c) + Σ G_i·(X_i − c_i), where c is the centre of the box X and G_i encloses ∂F/∂x_i over X. That
//! is tighter than F(X) on small boxes: its excess shrinks with the square of the width. It is
//! used where F is known to be continuous on the box, and every G_i that matters to be defined and
//! bounded: compositions of the table's operations are then piecewise C¹ and Lipschitz there.

use super::Tier;
use super::block::{Enclosures, Scalars};
use super::lower::copy_leaf;
use crate::graph::interval::{Enclosure, Regularity};
use crate::graph::{Graph, Interval, Node, NodeId, Op, derive};

/// How many boxes are taken at a time, so that their results stay in the cache.
const CHUNK: usize = 64;

/// A condition of which nothing is known.
const OPEN: Enclosure = Enclosure {
    range: Interval {
        low: 0.0,
        high: 1.0,
    },
    regularity: Regularity::Defined,
};

/// What encloses a function and its gradient.
pub(super) struct Slopes {
    dimension: usize,
    parameters: usize,
    /// F.
    value: Enclosures,
    /// F, then F_x.
    both: Enclosures,
}

/// What is the same for all boxes: for F, and for F and F_x.
pub(super) struct SlopeScalars {
    value: Scalars,
    both: Scalars,
}

impl Slopes {
    /// Of this root, as a function of so many coordinates and parameters.
    pub(super) fn new(
        graph: &Graph,
        root: NodeId,
        (dimension, parameters): (usize, usize),
    ) -> Slopes {
        let mut graph = graph.clone();
        let coordinates: Vec<NodeId> = (0..dimension).map(|axis| graph.coordinate(axis)).collect();
        let first_new = graph.len();
        let mut roots = vec![root];
        roots.extend(derive::reverse(&mut graph, root, &coordinates));
        let (graph, roots) = with_open_ties(&graph, &roots, first_new, parameters);
        Slopes {
            dimension,
            parameters,
            value: Enclosures::new(&graph, &roots[..1], (dimension, parameters)),
            both: Enclosures::new(&graph, &roots, (dimension, parameters + 1)),
        }
    }

    /// What is the same for all boxes. A missing parameter is NaN.
    pub(super) fn scalars(&self, q: &[f64]) -> SlopeScalars {
        let mut q = q.to_vec();
        q.resize(self.parameters, f64::NAN);
        SlopeScalars {
            value: self.value.scalars(&q, &[]),
            both: self.both.scalars(&q, &[OPEN]),
        }
    }

    /// Encloses F and F_x over as many boxes as the shortest column has.
    pub(super) fn run(
        &self,
        tier: Tier,
        sides: &[&[Interval]],
        scalars: &SlopeScalars,
        values: &mut [Enclosure],
        gradients: &mut [&mut [Interval]],
    ) {
        let dimension = self.dimension;
        if sides.len() < dimension || gradients.len() < dimension {
            return;
        }
        let (sides, gradients) = (&sides[..dimension], &mut gradients[..dimension]);
        let lengths = sides.iter().map(|column| column.len());
        let lengths = lengths.chain(gradients.iter().map(|column| column.len()));
        let count = lengths.chain([values.len()]).min().unwrap_or(0);
        // What remains of several boxes is not alone, even if it is one.
        let tier = match tier {
            Tier::Automatic | Tier::MachineCode if count > 1 => Tier::Block(tier.kernels()),
            _ => tier,
        };
        for start in (0..count).step_by(CHUNK) {
            let part = start..count.min(start + CHUNK);
            let mut boxes: [&[Interval]; 3] = [&[]; 3];
            for (chunk, column) in boxes.iter_mut().zip(sides) {
                *chunk = &column[part.clone()];
            }
            let values = &mut values[part.clone()];
            let slopes = self.chunk(tier, &boxes[..dimension], scalars, values);
            for (gradient, slopes) in gradients.iter_mut().zip(slopes) {
                for (gradient, slope) in gradient[part.clone()].iter_mut().zip(slopes) {
                    *gradient = slope.range;
                }
            }
        }
    }

    /// Encloses F into `values` and returns the enclosures of F_x, for at most [`CHUNK`] boxes.
    fn chunk(
        &self,
        tier: Tier,
        boxes: &[&[Interval]],
        scalars: &SlopeScalars,
        values: &mut [Enclosure],
    ) -> [[Enclosure; CHUNK]; 3] {
        let (dimension, length) = (self.dimension, values.len());
        let mut slopes = [[OPEN; CHUNK]; 3];
        let [x, y, z] = slopes.each_mut().map(|column| &mut column[..length]);
        let mut outputs = [&mut *values, x, y, z];
        let outputs = &mut outputs[..=dimension];
        self.both.run(tier, boxes, &scalars.both, outputs);
        let mut points = [[Interval::EMPTY; CHUNK]; 3];
        for (points, sides) in points.iter_mut().zip(boxes) {
            for (point, side) in points.iter_mut().zip(*sides) {
                *point = centre(*side);
            }
        }
        let columns = points.each_ref().map(|column| &column[..length]);
        let mut at_centre = [OPEN; CHUNK];
        let outputs = &mut [&mut at_centre[..length]];
        self.value
            .run(tier, &columns[..dimension], &scalars.value, outputs);
        for (index, value) in values.iter_mut().enumerate() {
            if value.regularity != Regularity::Continuous {
                continue;
            }
            let terms = (0..dimension).map(|axis| {
                let offset = boxes[axis][index] - points[axis][index];
                (slopes[axis][index], offset)
            });
            if let Some(range) = mean_value(at_centre[index], terms) {
                value.range = value.range.intersection(range);
            }
        }
        slopes
    }
}

/// A number in the middle of a side, as an interval; of unbounded sides one that is in it.
fn centre(side: Interval) -> Interval {
    let Interval { low, high } = side;
    let middle = if low > f64::NEG_INFINITY && high < f64::INFINITY {
        0.5 * low + 0.5 * high
    } else {
        0.0
    };
    // Halves of subnormal numbers are rounded.
    let middle = middle.max(low).min(high);
    if side.is_empty() {
        Interval::EMPTY
    } else {
        Interval::new(middle, middle)
    }
}

/// F(c) + Σ G_i·(X_i − c_i) from F(c) and pairs of G_i and X_i − c_i, if that is known to enclose F.
fn mean_value(
    centre: Enclosure,
    terms: impl Iterator<Item = (Enclosure, Interval)>,
) -> Option<Interval> {
    let mut sum = (centre.regularity == Regularity::Continuous).then_some(centre.range)?;
    for (slope, offset) in terms {
        if offset.low == 0.0 && offset.high == 0.0 {
            // Nothing moves along this axis.
            continue;
        }
        let Interval { low, high } = slope.range;
        let is_bounded = f64::NEG_INFINITY < low && low <= high && high < f64::INFINITY;
        if slope.regularity == Regularity::Partial || !is_bounded {
            return None;
        }
        sum = sum + slope.range * offset;
    }
    Some(sum)
}

/// The graph with the comparisons, signs and directions of derivatives left open where they have
/// kinks. Nodes from `first_new` on are those of derivatives; the first root is F, which does not
/// change. `open` is the place of a parameter that stands for an open condition.
fn with_open_ties(
    graph: &Graph,
    roots: &[NodeId],
    first_new: usize,
    open: usize,
) -> (Graph, Vec<NodeId>) {
    let mut target = Graph::new();
    let open = target.parameter(open);
    // What nodes become in F, and in derivatives.
    let mut kept: Vec<NodeId> = vec![open; graph.len()];
    let mut opened = kept.clone();
    for id in graph.reachable(roots) {
        let (copy, with_open) = match graph.node(id) {
            Node::Apply(op, operands) => {
                let is_new = id.index() >= first_new;
                let copies = if is_new { &opened } else { &kept };
                let operands = operands.map(|operand| copies[operand.index()]);
                let copy = target.apply(op, &operands[..op.arity()]);
                let may_open = is_new || matches!(op, Op::Less | Op::LessEqual);
                let with_open =
                    may_open.then(|| opened_kink(&mut target, op, operands, copy, open));
                (copy, with_open.unwrap_or(copy))
            }
            leaf => {
                let copy = copy_leaf(&mut target, leaf);
                (copy, copy)
            }
        };
        (kept[id.index()], opened[id.index()]) = (copy, with_open);
    }
    let derivatives = roots.iter().skip(1).map(|root| opened[root.index()]);
    let first = roots.iter().take(1).map(|root| kept[root.index()]);
    let roots = first.chain(derivatives).collect();
    (target, roots)
}

/// What an operation of a derivative becomes.
fn opened_kink(
    graph: &mut Graph,
    op: Op,
    [a, b, _]: [NodeId; 3],
    copy: NodeId,
    open: NodeId,
) -> NodeId {
    let [zero, one, minus_one] = [0.0, 1.0, -1.0].map(|number| graph.constant(number));
    match op {
        Op::Less | Op::LessEqual => at_tie(graph, [a, b], open, copy),
        Op::Sign => {
            let either = graph.apply(Op::Select, &[open, minus_one, one]);
            at_tie(graph, [a, zero], either, copy)
        }
        Op::Divide if is_hypotenuse(graph, b, a) => {
            // A side is no longer than the hypotenuse.
            let below = graph.apply(Op::Min, &[copy, one]);
            graph.apply(Op::Max, &[below, minus_one])
        }
        _ => copy,
    }
}

/// Whether a node is the hypotenuse of this side.
fn is_hypotenuse(graph: &Graph, node: NodeId, side: NodeId) -> bool {
    match graph.node(node) {
        Node::Apply(Op::Hypot, [a, b, _]) => a == side || b == side,
        _ => false,
    }
}

/// `at_tie` where both may be equal, else `elsewhere`.
fn at_tie(graph: &mut Graph, operands: [NodeId; 2], at_tie: NodeId, elsewhere: NodeId) -> NodeId {
    let is_tie = graph.apply(Op::Equal, &operands);
    graph.apply(Op::Select, &[is_tie, at_tie, elsewhere])
}
