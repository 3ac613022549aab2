//! A field in a cell: its operations in order, their enclosures, and what these decide.

use glam::DVec3;

use crate::graph::interval::Enclosure;
use crate::graph::{Graph, Interval, Node, NodeId, Op};

/// What a step computes.
#[derive(Clone, Copy, Debug)]
pub(super) enum Source {
    Constant(f64),
    Coordinate(u8),
    Apply(Op),
}

/// One operation of a field. Its operands are the places of earlier steps; those beyond the arity
/// repeat the first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub(super) source: Source,
    pub(super) operands: [u32; 3],
}

/// What an enclosure tells of a choice.
enum Decision {
    /// It is this operand.
    Operand(usize),
    /// It is the opposite of the first operand.
    Opposite,
    /// It is this number.
    Number(f64),
}

impl Step {
    /// The places of the operands that count.
    pub(super) fn operands(&self) -> &[u32] {
        match self.source {
            Source::Apply(op) => &self.operands[..op.arity()],
            Source::Constant(_) | Source::Coordinate(_) => &[],
        }
    }

    /// The operation, if it is one whose result is one of several smooth functions.
    pub(super) fn choice(&self) -> Option<Op> {
        match self.source {
            Source::Apply(op) if is_choice(op) => Some(op),
            _ => None,
        }
    }
}

/// Whether the result of an operation is one of several smooth functions of its operands.
fn is_choice(op: Op) -> bool {
    let takes_an_operand = matches!(op, Op::Min | Op::Max | Op::Abs | Op::Select);
    let is_truth = matches!(op, Op::Less | Op::LessEqual | Op::Equal | Op::IsNumber);
    let is_a_step = matches!(op, Op::Sign | Op::Floor | Op::Ceil | Op::Round);
    takes_an_operand || is_truth || is_a_step
}

/// The steps of a root. Parameters are numbers by now. Remainders become floors.
pub(super) fn list(graph: &Graph, root: NodeId) -> Vec<Step> {
    let nodes = graph.reachable(&[root]);
    let mut steps: Vec<Step> = Vec::with_capacity(nodes.len());
    let mut places: Vec<u32> = Vec::with_capacity(nodes.len());
    for &id in &nodes {
        let mut push = |source: Source, operands: [u32; 3]| {
            steps.push(Step { source, operands });
            steps.len() as u32 - 1
        };
        let place = match graph.node(id) {
            Node::Constant(bits) => push(Source::Constant(f64::from_bits(bits)), [0; 3]),
            Node::Coordinate(axis) => push(Source::Coordinate(axis), [0; 3]),
            // Parameters have been replaced.
            Node::Parameter(_) => push(Source::Constant(f64::NAN), [0; 3]),
            Node::Apply(op, operands) => {
                let [a, b, c] = operands.map(|operand| {
                    // Every operand is in the list, before this node.
                    let place = nodes.binary_search(&operand).unwrap_or(0);
                    places[place]
                });
                if op == Op::Modulo {
                    let quotient = push(Source::Apply(Op::Divide), [a, b, a]);
                    let periods = push(Source::Apply(Op::Floor), [quotient; 3]);
                    let whole = push(Source::Apply(Op::Multiply), [b, periods, b]);
                    push(Source::Apply(Op::Subtract), [a, whole, a])
                } else {
                    push(Source::Apply(op), [a, b, c])
                }
            }
        };
        places.push(place);
    }
    steps
}

/// Encloses every step over a box.
pub(super) fn bound(steps: &[Step], low: DVec3, high: DVec3) -> Vec<Enclosure> {
    let mut enclosures: Vec<Enclosure> = Vec::with_capacity(steps.len());
    for step in steps {
        let enclosure = match step.source {
            Source::Constant(number) => Enclosure::of_number(number),
            Source::Coordinate(axis) => {
                let axis = usize::from(axis).min(2);
                Enclosure::of_interval(Interval::new(low[axis], high[axis]))
            }
            Source::Apply(op) => {
                let operands = step.operands.map(|place| enclosures[place as usize]);
                (op.operation().interval)(&operands[..op.arity()])
            }
        };
        enclosures.push(enclosure);
    }
    enclosures
}

/// The last step at a point.
pub(super) fn value(steps: &[Step], point: DVec3) -> f64 {
    let mut values: Vec<f64> = Vec::with_capacity(steps.len());
    for step in steps {
        values.push(match step.source {
            Source::Constant(number) => number,
            Source::Coordinate(axis) => point[usize::from(axis).min(2)],
            Source::Apply(op) => op.value(step.operands.map(|place| values[place as usize])),
        });
    }
    values.last().copied().unwrap_or(f64::NAN)
}

/// What the enclosures decide about a choice. Ties count for either side: what happens on a set
/// without interior is not asked here.
fn decide(op: Op, operands: [Interval; 3], own: Interval) -> Option<Decision> {
    let [a, b, _] = operands;
    match op {
        Op::Min if a.high <= b.low => Some(Decision::Operand(0)),
        Op::Min if b.high <= a.low => Some(Decision::Operand(1)),
        Op::Max if a.low >= b.high => Some(Decision::Operand(0)),
        Op::Max if b.low >= a.high => Some(Decision::Operand(1)),
        Op::Abs if a.low >= 0.0 => Some(Decision::Operand(0)),
        Op::Abs if a.high <= 0.0 => Some(Decision::Opposite),
        Op::Select if !a.contains(0.0) => Some(Decision::Operand(1)),
        Op::Select if a.low == 0.0 && a.high == 0.0 => Some(Decision::Operand(2)),
        Op::Min | Op::Max | Op::Abs | Op::Select => None,
        Op::IsNumber => Some(Decision::Number(1.0)),
        // Equality without equal enclosures holds nowhere but on a set without interior.
        Op::Equal => Some(Decision::Number(if own.low == 1.0 { 1.0 } else { 0.0 })),
        _ => (own.low == own.high).then_some(Decision::Number(own.low)),
    }
}

/// The steps that are left when all that is decided in a box is put in place; `None` if nothing
/// is decided.
pub(super) fn prune(steps: &[Step], enclosures: &[Enclosure]) -> Option<Vec<Step>> {
    // Where the result of each step is found, and what is needed.
    let mut decisions: Vec<Option<Decision>> = Vec::with_capacity(steps.len());
    for (step, enclosure) in steps.iter().zip(enclosures) {
        let operands = step.operands.map(|place| enclosures[place as usize].range);
        let decision = step
            .choice()
            .and_then(|op| decide(op, operands, enclosure.range));
        decisions.push(decision);
    }
    if decisions.iter().all(Option::is_none) {
        return None;
    }
    let mut needed = vec![false; steps.len()];
    if let Some(last) = needed.last_mut() {
        *last = true;
    }
    for place in (0..steps.len()).rev() {
        if !needed[place] {
            continue;
        }
        let step = &steps[place];
        match &decisions[place] {
            None => {
                for &operand in step.operands() {
                    needed[operand as usize] = true;
                }
            }
            Some(Decision::Operand(number)) => needed[step.operands[*number] as usize] = true,
            Some(Decision::Opposite) => needed[step.operands[0] as usize] = true,
            Some(Decision::Number(_)) => {}
        }
    }
    let mut kept: Vec<Step> = Vec::new();
    let mut places = vec![0; steps.len()];
    for (place, step) in steps.iter().enumerate().filter(|(place, _)| needed[*place]) {
        let operands = step.operands.map(|operand| places[operand as usize]);
        let source = match &decisions[place] {
            None => step.source,
            Some(Decision::Operand(number)) => {
                places[place] = operands[*number];
                continue;
            }
            Some(Decision::Opposite) => Source::Apply(Op::Negate),
            Some(Decision::Number(number)) => Source::Constant(*number),
        };
        places[place] = kept.len() as u32;
        kept.push(Step { source, operands });
    }
    // An operand that became the root stands last among what is needed.
    Some(kept)
}

/// Whether a step may have an unbounded derivative in the box although it is defined there: a root
/// at 0.
pub(super) fn has_singularity(steps: &[Step], enclosures: &[Enclosure]) -> bool {
    steps.iter().enumerate().any(|(place, step)| {
        let range = |number: usize| enclosures[step.operands[number] as usize].range;
        match step.source {
            Source::Apply(Op::SquareRoot) => range(0).low <= 0.0,
            Source::Apply(Op::Hypot) => range(0).contains(0.0) && range(1).contains(0.0),
            Source::Apply(Op::Power) => range(0).low <= 0.0,
            Source::Apply(Op::Asin | Op::Acos) => range(0).abs().high >= 1.0,
            Source::Apply(_) => {
                let range = enclosures[place].range;
                range.low == f64::NEG_INFINITY || range.high == f64::INFINITY
            }
            _ => false,
        }
    })
}
