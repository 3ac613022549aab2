//! Guaranteed enclosures: arithmetic on intervals, and what an expression can be on a box.
//!
//! An [`Interval`] holds every value that the exact function takes for arguments in its operands,
//! and every finite one that the table's value rules compute there. (There is one gap: where an
//! exponent itself runs through an interval with an integer inside, repeated multiplication may
//! miss the true power by more than the enclosure's margin.) The meaning is the set-based one of
//! IEEE 1788: arguments outside a function's domain are left out, so √[−1, 4] is [0, 2], and the
//! result is empty if none is left. An [`Enclosure`] adds whether anything was left out and
//! whether the function is continuous on the box: a sign change proves a zero only where it is.
//!
//! `rounding` does the directed rounding by error-free transformations; `arithmetic`,
//! `elementary`, `periodic` and `power` hold the functions; `rule` joins them with regularity to
//! the interval rules of the table. Sums, differences, products, quotients and roots are the
//! tightest possible, but for results near underflow; functions are at most one unit in the last
//! place wider on each side than their correctly rounded ends.

mod arithmetic;
mod elementary;
mod periodic;
mod power;
mod rounding;
pub(super) mod rule;

use super::{Graph, Node, NodeId};

/// A closed interval of real numbers; an infinite end means that it is unbounded there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// The lower end: −∞ or finite, or +∞ for the empty interval.
    pub low: f64,
    /// The upper end: finite or +∞, or −∞ for the empty interval.
    pub high: f64,
}

impl Interval {
    /// No number: [+∞, −∞], so that it takes no part in a hull.
    pub const EMPTY: Interval = Interval {
        low: f64::INFINITY,
        high: f64::NEG_INFINITY,
    };

    /// Every number.
    pub const ENTIRE: Interval = Interval {
        low: f64::NEG_INFINITY,
        high: f64::INFINITY,
    };

    /// The numbers from `low` to `high`; empty if there is none, or if an end is NaN.
    pub fn new(low: f64, high: f64) -> Interval {
        if low <= high && low < f64::INFINITY && high > f64::NEG_INFINITY {
            Interval { low, high }
        } else {
            Interval::EMPTY
        }
    }

    /// One number. NaN gives the empty interval; an infinity, which stands for a number too large
    /// for f64, everything beyond the largest finite one.
    pub fn point(value: f64) -> Interval {
        if value == f64::INFINITY {
            Interval {
                low: f64::MAX,
                high: value,
            }
        } else if value == f64::NEG_INFINITY {
            Interval {
                low: value,
                high: f64::MIN,
            }
        } else {
            Interval::new(value, value)
        }
    }

    /// Whether it holds no number.
    pub fn is_empty(self) -> bool {
        self.low > self.high
    }

    /// Whether the number, which may be infinite, lies between the ends.
    pub fn contains(self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }

    /// The smallest interval that holds both.
    pub fn hull(self, other: Interval) -> Interval {
        Interval {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    /// The numbers that are in both.
    pub fn intersection(self, other: Interval) -> Interval {
        Interval::new(self.low.max(other.low), self.high.min(other.high))
    }
}

/// What is known of an expression on a whole box; what comes later implies what comes before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Regularity {
    /// It may be undefined (NaN or infinite) somewhere.
    Partial,
    /// It is defined everywhere, but may jump.
    Defined,
    /// It is defined and continuous everywhere.
    Continuous,
}

/// What an expression can be on a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Enclosure {
    /// Holds every value.
    pub range: Interval,
    /// Whether it is known to be defined and continuous.
    pub regularity: Regularity,
}

impl Enclosure {
    /// Of a coordinate that runs through an interval.
    pub fn of_interval(range: Interval) -> Enclosure {
        let regularity = match range.is_empty() {
            true => Regularity::Partial,
            false => Regularity::Continuous,
        };
        Enclosure { range, regularity }
    }

    /// Of a known number: undefined if it is NaN or infinite.
    pub fn of_number(value: f64) -> Enclosure {
        let regularity = match value.is_finite() {
            true => Regularity::Continuous,
            false => Regularity::Partial,
        };
        Enclosure {
            range: Interval::point(value),
            regularity,
        }
    }
}

/// Encloses the roots over the box that has these sides (a missing one is unbounded), with the
/// parameters given by their places. One pass over the nodes.
pub fn enclose(
    graph: &Graph,
    roots: &[NodeId],
    sides: &[Interval],
    parameter: impl Fn(u32) -> f64,
) -> Vec<Enclosure> {
    let nodes = graph.reachable(roots);
    let mut enclosures: Vec<Enclosure> = Vec::with_capacity(nodes.len());
    let place = |id: NodeId| nodes.binary_search(&id).unwrap_or(0);
    for &id in &nodes {
        let enclosure = match graph.node(id) {
            Node::Constant(bits) => Enclosure::of_number(f64::from_bits(bits)),
            Node::Coordinate(axis) => {
                let side = sides.get(axis as usize).copied();
                Enclosure::of_interval(side.unwrap_or(Interval::ENTIRE))
            }
            Node::Parameter(index) => Enclosure::of_number(parameter(index)),
            Node::Apply(op, operands) => {
                let operands = operands.map(|operand| enclosures[place(operand)]);
                (op.operation().interval)(&operands[..op.arity()])
            }
        };
        enclosures.push(enclosure);
    }
    roots.iter().map(|&root| enclosures[place(root)]).collect()
}

#[cfg(test)]
mod tests;
