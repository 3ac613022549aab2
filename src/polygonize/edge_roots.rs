//! The roots of F on crossed grid edges, solved together in batches. Every polygonizer, in one,
//! two and three dimensions, ends here: its vertices are these roots.
//!
//! Along each edge F < iso at one end, the inside, and F ≥ iso or NaN at the other. The root is
//! bracketed and the bracket shrinks by a safeguarded Newton method ("rtsafe" in Press et al.,
//! Numerical Recipes, 3rd ed., section 9.4): a Newton step where it stays inside the bracket and
//! at most halves the step before the last, bisection otherwise. It therefore converges
//! quadratically on smooth fields and no slower than bisection on the others, steep ones, kinks
//! and jumps included.
//!
//! F also goes from below the level to not below it at a pole, at a jump and at the end of its
//! domain. A small |F − iso| / |F_x| does not tell a root from these: at the pole of 1/x it
//! vanishes. A root must therefore be credible as well (see [`Search::is_credible`]); what is not
//! is searched on until the bracket cannot shrink any more, and then is poor, unless F is proven to
//! be continuous between the bracket's ends: then its sign changes at a root, and what keeps F from
//! being small there is rounding.

use glam::DVec3;

use super::columns::{Columns, Evaluate, is_continuous};
use crate::engine::Monitor;

/// How many edges are solved together. The columns of a batch fit the first-level cache.
const BATCH: usize = 512;

/// What is left of |F − iso| at the inside end of an edge, as a fraction, where F tends to the
/// level at the end of its domain. Even x^0.3 gets there before the bracket is exhausted.
const LEFT_AT_DOMAIN_END: f64 = 1e-3;

/// A part of a line parallel to an axis, on which the sign of F − iso changes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    /// The end with F < iso.
    pub(super) inside: DVec3,
    /// The axis that the edge is parallel to.
    pub(super) axis: usize,
    /// The coordinate of the other end along the axis.
    pub(super) outside: f64,
    /// F − iso at the inside end, negative.
    pub(super) inside_value: f64,
    /// F − iso at the outside end, not negative; possibly NaN.
    pub(super) outside_value: f64,
}

/// A part of any line, at whose ends the sign of F − iso differs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    /// The end with F < iso.
    pub(super) inside: DVec3,
    /// The other end.
    pub(super) outside: DVec3,
    /// F − iso at the inside end, negative.
    pub(super) inside_value: f64,
    /// F − iso at the outside end, not negative; possibly NaN.
    pub(super) outside_value: f64,
}

impl From<Edge> for Segment {
    fn from(edge: Edge) -> Self {
        let mut outside = edge.inside;
        outside[edge.axis] = edge.outside;
        Segment {
            inside: edge.inside,
            outside,
            inside_value: edge.inside_value,
            outside_value: edge.outside_value,
        }
    }
}

/// What is asked of the roots.
#[derive(Clone, Copy, Debug)]
pub(super) struct Accuracy {
    /// The level: F = iso.
    pub(super) iso: f64,
    /// The greatest |F − iso| / |F_x| at a root, a length.
    pub(super) distance: f64,
}

/// One root.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Root {
    /// Where.
    pub(super) position: DVec3,
    /// F_x / |F_x|; 0 where that is not defined.
    pub(super) normal: DVec3,
    /// |F − iso| / |F_x|: the first-order distance from the level set.
    pub(super) residual: f64,
    /// What was found.
    pub(super) kind: Kind,
}

/// What a search has found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Kind {
    /// A root to the accuracy.
    Good,
    /// The edge has no length: F was not asked.
    #[default]
    Given,
    /// No root: a pole or a jump.
    Jump,
    /// No root: F < iso up to where F ceases to be defined.
    DomainEnd,
}

impl Root {
    /// Whether the edge has no length, so that F was not asked.
    pub(super) fn is_given(&self) -> bool {
        self.kind == Kind::Given
    }

    /// Whether this is the end of the domain.
    pub(super) fn is_domain_end(&self) -> bool {
        self.kind == Kind::DomainEnd
    }

    /// Whether this is no root, but a pole, a jump or the end of the domain.
    pub(super) fn is_poor(&self) -> bool {
        matches!(self.kind, Kind::Jump | Kind::DomainEnd)
    }
}

/// The roots on the edges or segments, in their order, and the number of evaluations of F and F_x.
///
/// A root that is at an end of its edge to the accuracy is at that end exactly, so that the roots
/// on all edges that meet there coincide. An edge of no length is its own root, without a normal,
/// and F is not asked there. The result does not depend on what other edges are solved in the
/// same call. Once the monitor wants an end, the roots that are left stay where they were.
pub(super) fn solve<E: Copy + Into<Segment>>(
    field: &mut impl Evaluate,
    accuracy: Accuracy,
    edges: &[E],
    monitor: &dyn Monitor,
) -> (Vec<Root>, usize) {
    let segments = || edges.iter().map(|&edge| edge.into());
    let at_start = |segment: Segment| Root {
        position: segment.inside,
        ..Root::default()
    };
    let mut roots: Vec<Root> = segments().map(at_start).collect();
    let mut waiting = segments()
        .enumerate()
        .filter(|(_, segment)| segment.outside != segment.inside);
    let mut searches: Vec<Search> = Vec::with_capacity(BATCH);
    let mut columns = Columns::default();
    let mut evaluations = 0;
    loop {
        // Refilling the batch as searches end keeps it long to the last.
        let free = BATCH - searches.len();
        searches.extend(
            waiting
                .by_ref()
                .take(free)
                .map(|(index, segment)| Search::new(index, segment)),
        );
        if searches.is_empty() || monitor.cancelled() {
            return (roots, evaluations);
        }
        evaluations += searches.len();
        columns.set_points(searches.iter().map(|search| search.candidate));
        columns.evaluate(field, accuracy.iso);
        let mut position = 0;
        searches.retain_mut(|search| {
            let (value, gradient) = columns.result(position);
            position += 1;
            match search.advance(value, gradient, accuracy.distance) {
                Some(mut root) => {
                    if root.kind == Kind::Jump {
                        let [one, other] = search.bracket();
                        if is_continuous(field, one, other) {
                            root.kind = Kind::Good;
                        }
                    }
                    roots[search.index] = root;
                    false
                }
                None => true,
            }
        });
    }
}

/// The search for the root on one edge, by the coordinate along the axis on which the edge is
/// longest. On an edge that is parallel to an axis the other coordinates stay what they are, to
/// the last bit.
struct Search {
    /// The number of the edge in the list that is solved.
    index: usize,
    edge: Segment,
    axis: usize,
    /// The edge's direction, 1 along the axis.
    direction: DVec3,
    /// The point at which F is wanted next.
    candidate: DVec3,
    /// The bracket: coordinates along the axis.
    inside: f64,
    outside: f64,
    /// F − iso at the outside end of the bracket; NaN as long as F was seen to be undefined
    /// there, but never to rise above the level.
    outside_value: f64,
    /// The lengths of the step before the last and of the last.
    steps: [f64; 2],
    /// The bracket cannot shrink any more; the candidate is its inside end.
    exhausted: bool,
}

impl Search {
    fn new(index: usize, edge: Segment) -> Self {
        let step = edge.outside - edge.inside;
        let axis = step.abs().max_position();
        let (inside, outside) = (edge.inside[axis], edge.outside[axis]);
        let mut search = Search {
            index,
            edge,
            axis,
            direction: step / step[axis],
            candidate: edge.inside,
            inside,
            outside,
            outside_value: edge.outside_value,
            steps: [(outside - inside).abs(); 2],
            exhausted: false,
        };
        let weight = edge.inside_value / (edge.inside_value - edge.outside_value);
        let secant = inside + weight * (outside - inside);
        // An infinite or undefined value at an end says nothing about where the root is.
        search.candidate = search.point(if edge.outside_value == 0.0 {
            outside
        } else if edge.outside_value < f64::INFINITY && secant.is_finite() {
            secant
        } else {
            search.middle()
        });
        search
    }

    /// The point of the edge with this coordinate along the axis; both ends exactly.
    fn point(&self, coordinate: f64) -> DVec3 {
        let Segment {
            inside, outside, ..
        } = self.edge;
        if coordinate == outside[self.axis] {
            return outside;
        }
        let moved = inside + (coordinate - inside[self.axis]) * self.direction;
        let mut point = DVec3::select(self.direction.cmpne(DVec3::ZERO), moved, inside);
        point[self.axis] = coordinate;
        point
    }

    /// The derivative of F by the coordinate along the axis, on the edge. Axes on which the edge
    /// does not extend have no part in it, whatever F_x is there.
    fn slope(&self, gradient: DVec3) -> f64 {
        let other = |axis: &usize| *axis != self.axis && self.direction[*axis] != 0.0;
        let others = (0..3).filter(other);
        let part = |axis: usize| gradient[axis] * self.direction[axis];
        gradient[self.axis] + others.map(part).sum::<f64>()
    }

    /// The ends of the bracket.
    fn bracket(&self) -> [DVec3; 2] {
        [self.inside, self.outside].map(|end| self.point(end))
    }

    fn middle(&self) -> f64 {
        self.inside + 0.5 * (self.outside - self.inside)
    }

    /// Whether a coordinate lies strictly inside the bracket; false for NaN.
    fn brackets(&self, coordinate: f64) -> bool {
        let (low, high) = if self.inside < self.outside {
            (self.inside, self.outside)
        } else {
            (self.outside, self.inside)
        };
        low < coordinate && coordinate < high
    }

    /// Takes F − iso and F_x at the candidate; the root if the search has ended, else the next
    /// candidate is set.
    fn advance(&mut self, value: f64, gradient: DVec3, distance: f64) -> Option<Root> {
        let residual = first_order_distance(value, gradient);
        if residual <= distance && self.is_credible(value, gradient) || self.exhausted {
            return Some(self.root(value, gradient, residual, distance));
        }
        let here = self.candidate[self.axis];
        if value < 0.0 {
            self.inside = here;
        } else {
            self.outside = here;
            self.outside_value = value;
        }
        let newton = here - value / self.slope(gradient);
        let halves = (newton - here).abs() <= 0.5 * self.steps[0];
        let next = if halves && self.brackets(newton) {
            newton
        } else {
            self.middle()
        };
        self.steps = [self.steps[1], (next - here).abs()];
        self.candidate = self.point(next);
        // A bracket as narrow as the spacing of numbers on the edge cannot shrink much more, and
        // what is in it is no root. F at the inside end is certainly defined.
        let ends = [self.edge.inside, self.edge.outside].map(|end| end[self.axis].abs());
        let farthest = ends[0].max(ends[1]);
        let width = (self.outside - self.inside).abs();
        if !self.brackets(next) || width <= f64::EPSILON * farthest {
            self.exhausted = true;
            self.candidate = self.point(self.inside);
        }
        None
    }

    /// Whether a small |F − iso| / |F_x| at the candidate can mean a root.
    ///
    /// On both sides of a pole F falls on the way from the inside to the outside. So it does at
    /// the second of three roots, and then the bracket between the candidate and the proper end
    /// holds another root, where F rises: to go on is right in both cases. A fall that would
    /// not take F to the level along the whole edge is nothing but rounding, as on an edge that
    /// lies in the level set; there is none where F is the level exactly.
    ///
    /// Where the domain ends, a steep slope also makes the quotient small. F then was never seen
    /// above the level; that it tends to the level shows in |F − iso| itself.
    fn is_credible(&self, value: f64, gradient: DVec3) -> bool {
        let Segment {
            inside, outside, ..
        } = self.edge;
        let rise = self.slope(gradient) * (outside[self.axis] - inside[self.axis]);
        let falls = value != 0.0 && rise < -value.abs();
        // 0, which says nothing, if F is infinite at the inside end.
        let left = value / self.edge.inside_value;
        let meets_level = !self.outside_value.is_nan()
            || value >= 0.0
            || left > 0.0 && left <= LEFT_AT_DOMAIN_END;
        !falls && meets_level
    }

    /// The root at the candidate, or at an end of the edge if that is as good.
    fn root(&self, value: f64, gradient: DVec3, residual: f64, distance: f64) -> Root {
        let Segment {
            inside,
            outside,
            inside_value,
            outside_value,
        } = self.edge;
        let good = residual <= distance && self.is_credible(value, gradient);
        let mut root = Root {
            position: self.candidate,
            normal: unit_or_zero(gradient),
            residual,
            kind: match good {
                true => Kind::Good,
                false if self.outside_value.is_nan() => Kind::DomainEnd,
                false => Kind::Jump,
            },
        };
        for (end, value) in [(inside, inside_value), (outside, outside_value)] {
            let residual = first_order_distance(value, gradient);
            let away = (end[self.axis] - root.position[self.axis]).abs();
            if good && residual <= distance && away <= distance {
                root.position = end;
                root.residual = residual;
            }
        }
        root
    }
}

/// |value| / |gradient|: 0 if the value is, else infinite where the gradient vanishes and NaN
/// where it is not finite.
pub(super) fn first_order_distance(value: f64, gradient: DVec3) -> f64 {
    if value == 0.0 {
        return 0.0;
    }
    if !gradient.is_finite() {
        return f64::NAN;
    }
    // Scaling keeps the squares from overflowing and vanishing, here and below.
    let scale = gradient.abs().max_element();
    if scale == 0.0 {
        return value.abs() / scale;
    }
    value.abs() / scale / (gradient / scale).length()
}

/// The direction of a vector; 0 if it has none.
pub(super) fn unit_or_zero(vector: DVec3) -> DVec3 {
    let scale = vector.abs().max_element();
    if scale > 0.0 && vector.is_finite() {
        (vector / scale).normalize()
    } else {
        DVec3::ZERO
    }
}
