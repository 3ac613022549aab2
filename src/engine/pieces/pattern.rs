//! The smooth functions that a cell's field may be, by going through its open choices.
//!
//! From the root downwards, each open choice that is needed is taken in every way; what is not
//! needed any more is not asked. A way whose conditions contradict each other (a ≥ b from one
//! choice, b ≥ a from another) holds on a set without interior at the most and is left out.
//!
//! Pieces are functions of real numbers: they are simplified further than graphs are, by u + 0 = u
//! and √(u²) = |u|, so that equal functions of different origin are one node.

use super::steps::{Source, Step};
use crate::graph::interval::Enclosure;
use crate::graph::{Graph, Node, NodeId, Op};

/// The most ways that are gone through for a cell.
const MOST_WAYS: usize = 1 << 11;

/// A step function with more values in a cell is not gone through.
const MOST_VALUES: f64 = 8.0;

/// No way is taken yet.
const OPEN: f64 = f64::NAN;

/// The pieces of a cell, in a graph that all cells share; `None` if there are too many ways.
pub(super) fn patterns(
    graph: &mut Graph,
    steps: &[Step],
    enclosures: &[Enclosure],
) -> Option<Vec<NodeId>> {
    let mut search = Search {
        graph,
        steps,
        enclosures,
        taken: vec![OPEN; steps.len()],
        ways: 0,
        found: Vec::new(),
    };
    search.descend()?;
    let mut found = search.found;
    found.sort_unstable();
    found.dedup();
    Some(found)
}

/// A pass through all ways.
struct Search<'a> {
    graph: &'a mut Graph,
    steps: &'a [Step],
    enclosures: &'a [Enclosure],
    /// By steps, the place of the operand that is taken, or the value of a step function.
    taken: Vec<f64>,
    ways: usize,
    found: Vec<NodeId>,
}

impl Search<'_> {
    /// Takes the last choice that is needed and open in every way, or notes the piece if there is
    /// none. `None` if there are too many ways.
    fn descend(&mut self) -> Option<()> {
        let (needed, open) = self.needed();
        let Some(place) = open else {
            self.ways += 1;
            if self.ways > MOST_WAYS {
                return None;
            }
            let piece = self.resolve(&needed);
            self.found.extend(piece);
            return Some(());
        };
        for value in self.values(place)? {
            self.taken[place] = value;
            self.descend()?;
        }
        self.taken[place] = OPEN;
        Some(())
    }

    /// The steps that are needed on the present way, down to the last one that is open.
    fn needed(&self) -> (Vec<bool>, Option<usize>) {
        let mut needed = vec![false; self.steps.len()];
        if let Some(last) = needed.last_mut() {
            *last = true;
        }
        for (place, step) in self.steps.iter().enumerate().rev() {
            if !needed[place] {
                continue;
            }
            match step.choice() {
                None => {
                    for &operand in step.operands() {
                        needed[operand as usize] = true;
                    }
                }
                Some(_) if self.taken[place].is_nan() => return (needed, Some(place)),
                Some(op) => {
                    if let Some(operand) = self.target(op, place) {
                        needed[operand] = true;
                    }
                }
            }
        }
        (needed, None)
    }

    /// The ways to take a choice; `None` if there are too many.
    fn values(&self, place: usize) -> Option<Vec<f64>> {
        let range = self.enclosures[place].range;
        let values = match self.steps[place].choice()? {
            Op::Select => vec![1.0, 2.0],
            Op::Sign => vec![-1.0, 1.0],
            Op::Floor | Op::Ceil | Op::Round => {
                let count = range.high - range.low;
                if !(0.0..MOST_VALUES).contains(&count) {
                    return None;
                }
                (0..=count as u32)
                    .map(|number| range.low + f64::from(number))
                    .collect()
            }
            _ => vec![0.0, 1.0],
        };
        Some(values)
    }

    /// The step whose value a choice has on the present way; none if that is a number.
    fn target(&self, op: Op, place: usize) -> Option<usize> {
        let operands = self.steps[place].operands;
        match op {
            Op::Abs => Some(operands[0] as usize),
            Op::Min | Op::Max | Op::Select => Some(operands[self.taken[place] as usize] as usize),
            _ => None,
        }
    }

    /// The piece of the present way; none if it is a number, or has no interior.
    fn resolve(&mut self, needed: &[bool]) -> Option<NodeId> {
        let mut order = Order::default();
        let mut nodes: Vec<Option<NodeId>> = Vec::with_capacity(self.steps.len());
        for (place, step) in self.steps.iter().enumerate() {
            let operands = step.operands.map(|operand| {
                let operand = operand as usize;
                nodes.get(operand).copied().flatten()
            });
            let node = match step.source {
                Source::Constant(number) => Some(self.graph.constant(number)),
                Source::Coordinate(axis) => Some(self.graph.coordinate(usize::from(axis))),
                Source::Apply(op) => match step.choice() {
                    Some(_) if self.taken[place].is_nan() => None,
                    Some(_) => {
                        if needed[place]
                            && let Some((Some(greater), Some(lesser))) =
                                self.condition(op, place, operands, &nodes)
                        {
                            order.note(self.graph, greater, lesser);
                        }
                        self.choose(op, place, operands)
                    }
                    None => self.combine(op, operands, &order),
                },
            };
            nodes.push(node);
        }
        let root = nodes.last().copied().flatten()?;
        // Opposite functions vanish together.
        let root = match self.graph.node(root) {
            Node::Apply(Op::Negate, [opposite, ..]) => opposite,
            _ => root,
        };
        let is_number = self.graph.constant_value(root).is_some();
        (!is_number && !order.is_contradictory(self.graph)).then_some(root)
    }

    /// What a choice is on the present way.
    fn choose(&mut self, op: Op, place: usize, operands: [Option<NodeId>; 3]) -> Option<NodeId> {
        let taken = self.taken[place];
        match op {
            Op::Min | Op::Max | Op::Select => operands[taken as usize],
            Op::Abs if taken == 0.0 => operands[0],
            Op::Abs => operands[0].map(|a| self.graph.apply(Op::Negate, &[a])),
            _ => Some(self.graph.constant(taken)),
        }
    }

    /// The condition under which the present way is taken: which node is not less than which.
    fn condition(
        &mut self,
        op: Op,
        place: usize,
        [a, b, _]: [Option<NodeId>; 3],
        nodes: &[Option<NodeId>],
    ) -> Option<(Option<NodeId>, Option<NodeId>)> {
        let taken = self.taken[place];
        let zero = Some(self.graph.constant(0.0));
        let (condition, holds) = match op {
            Op::Min => ((b, a), taken == 0.0),
            Op::Max => ((a, b), taken == 0.0),
            Op::Abs => ((a, zero), taken == 0.0),
            Op::Sign => ((a, zero), taken > 0.0),
            Op::Less | Op::LessEqual => ((b, a), taken != 0.0),
            Op::Select => {
                let test = self.steps[self.steps[place].operands[0] as usize];
                if !matches!(test.source, Source::Apply(Op::Less | Op::LessEqual)) {
                    return None;
                }
                let [a, b] = [0, 1].map(|number: usize| nodes[test.operands[number] as usize]);
                ((b, a), taken == 1.0)
            }
            _ => return None,
        };
        Some(match holds {
            true => condition,
            false => (condition.1, condition.0),
        })
    }

    /// The operation on operands that are known.
    fn combine(&mut self, op: Op, operands: [Option<NodeId>; 3], order: &Order) -> Option<NodeId> {
        let first = operands[0]?;
        let known = match op.arity() {
            1 => [first; 3],
            2 => [first, operands[1]?, first],
            _ => [first, operands[1]?, operands[2]?],
        };
        let [a, b, _] = known;
        let value = |id: NodeId| self.graph.constant_value(id);
        let (zero_first, zero_second) = (value(a) == Some(0.0), value(b) == Some(0.0));
        let simpler = match op {
            Op::Add if zero_second => Some(a),
            Op::Add if zero_first => Some(b),
            Op::Subtract if a == b => Some(self.graph.constant(0.0)),
            Op::Subtract if zero_second => Some(a),
            Op::Subtract if zero_first => Some(self.graph.apply(Op::Negate, &[b])),
            Op::Multiply if zero_first || zero_second => Some(self.graph.constant(0.0)),
            Op::Hypot if zero_second => self.absolute(a, order),
            Op::Hypot if zero_first => self.absolute(b, order),
            Op::SquareRoot => match self.graph.node(a) {
                Node::Apply(Op::Square, [u, ..]) => self.absolute(u, order),
                _ => None,
            },
            _ => None,
        };
        Some(simpler.unwrap_or_else(|| self.graph.apply(op, &known[..op.arity()])))
    }

    /// |u|, if the sign of u is known.
    fn absolute(&mut self, u: NodeId, order: &Order) -> Option<NodeId> {
        let zero = self.graph.constant(0.0);
        let key = difference(self.graph, u, zero);
        let opposite = (key.1, key.0);
        if order.pairs.contains(&key) {
            Some(u)
        } else if order.pairs.contains(&opposite) {
            Some(self.graph.apply(Op::Negate, &[u]))
        } else {
            None
        }
    }
}

/// What is known of the order of nodes: the first of each pair is not less than the second.
#[derive(Default)]
struct Order {
    pairs: Vec<(NodeId, NodeId)>,
}

/// The order of two nodes in a form in which the same order is found again: that of a - b and 0 is
/// that of a and b.
fn difference(graph: &Graph, greater: NodeId, lesser: NodeId) -> (NodeId, NodeId) {
    let is_zero = |id: NodeId| graph.constant_value(id) == Some(0.0);
    let mut pair = (greater, lesser);
    for _ in 0..4 {
        pair = match (graph.node(pair.0), graph.node(pair.1)) {
            (Node::Apply(Op::Subtract, [a, b, _]), _) if is_zero(pair.1) => (a, b),
            (_, Node::Apply(Op::Subtract, [a, b, _])) if is_zero(pair.0) => (b, a),
            (Node::Apply(Op::Negate, [a, ..]), _) if is_zero(pair.1) => (pair.1, a),
            (_, Node::Apply(Op::Negate, [a, ..])) if is_zero(pair.0) => (a, pair.0),
            _ => return pair,
        };
    }
    pair
}

impl Order {
    fn note(&mut self, graph: &Graph, greater: NodeId, lesser: NodeId) {
        let pair = difference(graph, greater, lesser);
        if pair.0 != pair.1 && !self.pairs.contains(&pair) {
            self.pairs.push(pair);
        }
    }

    /// Whether nodes would have to be greater than themselves.
    fn is_contradictory(&self, graph: &Graph) -> bool {
        let mut pairs = self.pairs.clone();
        let mut numbers: Vec<(f64, NodeId)> = Vec::new();
        for id in pairs.iter().flat_map(|pair| [pair.0, pair.1]) {
            if let Some(number) = graph.constant_value(id) {
                numbers.push((number, id));
            }
        }
        numbers.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
        numbers.dedup();
        pairs.extend(numbers.windows(2).map(|two| (two[1].1, two[0].1)));
        // What has nothing greater than it takes no part in a circle, nor does what is left then.
        loop {
            let before = pairs.len();
            let lesser: Vec<NodeId> = pairs.iter().map(|pair| pair.1).collect();
            pairs.retain(|pair| lesser.contains(&pair.0));
            if pairs.is_empty() {
                return false;
            }
            if pairs.len() == before {
                return true;
            }
        }
    }
}
