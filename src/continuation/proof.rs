//! What intervals prove of a curve in a box.
//!
//! If the component T_j of the product of the gradients' enclosures, T = F_x × G_x, excludes 0 on a
//! box in which F and G are continuous, then each plane across axis j meets the curve at most once
//! in the box: two solutions in it would make the Jacobian's minor, with rows from the enclosures,
//! singular by the mean-value theorem (Neumaier, "Interval Methods for Systems of Equations",
//! section 5.1). The curve is a graph over (part of) the axis, with slopes T_i / T_j.

use glam::DVec3;

use super::step::Step;
use super::system::System;
use crate::engine::CompiledField;
use crate::graph::Interval;
use crate::graph::interval::{Enclosure, Regularity};

/// The box around a step is wider than its hull by this part of its longest side, on each side.
const MARGIN: f64 = 0.3;

const UNKNOWN: Enclosure = Enclosure {
    range: Interval::ENTIRE,
    regularity: Regularity::Partial,
};

/// A box by its corners; in the plane, both have z = 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cell {
    pub(crate) low: DVec3,
    pub(crate) high: DVec3,
}

impl Cell {
    pub(crate) fn center(&self) -> DVec3 {
        0.5 * (self.low + self.high)
    }

    pub(crate) fn size(&self) -> DVec3 {
        self.high - self.low
    }

    /// The box with the same middle and sides `factor` times as long.
    pub(crate) fn scaled(&self, factor: f64) -> Cell {
        let half = 0.5 * factor * self.size();
        Cell {
            low: self.center() - half,
            high: self.center() + half,
        }
    }

    pub(crate) fn contains(&self, point: DVec3) -> bool {
        point.cmpge(self.low).all() && point.cmple(self.high).all()
    }

    pub(crate) fn side(&self, axis: usize) -> Interval {
        Interval::new(self.low[axis], self.high[axis])
    }
}

/// What is known of the curve in a box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known {
    /// Whether the equations can hold somewhere.
    pub(crate) possible: bool,
    /// Whether an equation is the same everywhere: 0.
    pub(crate) flat: bool,
    /// T = F_x × G_x, entire where the equations may jump or be undefined.
    pub(crate) tangent: [Interval; 3],
    /// The sine of the angle between the gradients of two fields is not larger.
    pub(crate) sine: f64,
}

impl Known {
    /// The axis over which the curve is proven to be a graph, with the smallest slopes.
    pub(crate) fn axis(&self) -> Option<usize> {
        let least = |axis: &usize| {
            let along = self.tangent[*axis];
            along.low.max(-along.high)
        };
        let axes = (0..3).filter(|axis| least(axis) > 0.0);
        axes.max_by(|one, other| least(one).total_cmp(&least(other)))
    }

    /// dx_i / dx_j on the curve.
    pub(crate) fn slope(&self, of: usize, over: usize) -> Interval {
        self.tangent[of] / self.tangent[over]
    }
}

/// Encloses the equations and the direction of the curve over boxes.
pub(crate) fn enclose(system: &System, fields: &[&CompiledField], cells: &[Cell]) -> Vec<Known> {
    let columns: [Vec<Interval>; 3] =
        std::array::from_fn(|axis| cells.iter().map(|cell| cell.side(axis)).collect());
    let columns = columns.each_ref().map(|column| &column[..]);
    let sides = &columns[..system.dimension];
    let found: Vec<(Vec<Enclosure>, [Vec<Interval>; 3])> = fields
        .iter()
        .map(|field| {
            let mut values = vec![UNKNOWN; cells.len()];
            let mut slopes = [(); 3].map(|()| vec![Interval::point(0.0); cells.len()]);
            let mut outputs = slopes.each_mut().map(|column| &mut column[..]);
            let outputs = &mut outputs[..system.dimension];
            field.enclose_gradients(sides, &mut values, outputs);
            (values, slopes)
        })
        .collect();
    system.count((fields.len() * cells.len()) as u64);
    (0..cells.len())
        .map(|place| {
            let values = found.iter().map(|(values, _)| values[place]);
            let gradient = |field: usize| [0, 1, 2].map(|axis| found[field].1[axis][place]);
            let up = [0.0, 0.0, 1.0].map(Interval::point);
            let slopes = (0..fields.len()).map(|field| least_length(gradient(field)));
            let least: f64 = slopes.product();
            let smooth = values
                .clone()
                .all(|value| value.regularity == Regularity::Continuous);
            let tangent = match (smooth, fields.len()) {
                (true, 1) => cross(up, gradient(0)),
                (true, 2) => cross(gradient(0), gradient(1)),
                _ => [Interval::ENTIRE; 3],
            };
            let longest = tangent.map(|side| side.abs().high);
            Known {
                possible: values.clone().all(|value| value.range.contains(0.0)),
                flat: values
                    .clone()
                    .any(|value| value.range.low == 0.0 && value.range.high == 0.0),
                tangent,
                sine: DVec3::from_array(longest).length() / least,
            }
        })
        .collect()
}

/// For two fields, whether their zero sets are proven not to meet in boxes, although both pass.
///
/// Where they almost touch, the combination of both whose gradient is smallest says so: its
/// mean-value form around the middle c of the box, D(c) + (α F_x - β G_x)(box) · (x - c), with α and
/// β such that the gradients' common part cancels.
pub(crate) fn miss_each_other(
    system: &System,
    fields: &[&CompiledField],
    cells: &[Cell],
) -> Vec<bool> {
    let &[first, second] = fields else {
        return vec![false; cells.len()];
    };
    let columns: [Vec<Interval>; 3] =
        std::array::from_fn(|axis| cells.iter().map(|cell| cell.side(axis)).collect());
    let sides = columns.each_ref().map(|column| &column[..]);
    let middles: [Vec<Interval>; 3] = std::array::from_fn(|axis| {
        let middles = cells.iter().map(|cell| cell.center()[axis]);
        middles.map(Interval::point).collect()
    });
    let middles = middles.each_ref().map(|column| &column[..]);
    system.count(4 * cells.len() as u64);
    let [one, other] = [first, second].map(|field| {
        let mut values = vec![UNKNOWN; cells.len()];
        let mut slopes = [(); 3].map(|()| vec![Interval::ENTIRE; cells.len()]);
        let mut outputs = slopes.each_mut().map(|column| &mut column[..]);
        field.enclose_gradients(&sides, &mut values, &mut outputs);
        let mut centres = vec![UNKNOWN; cells.len()];
        field.enclose(&middles, &mut centres);
        (values, slopes, centres)
    });
    let gradient = |of: &[Vec<Interval>; 3], place: usize| [0, 1, 2].map(|axis| of[axis][place]);
    let missed = |place: usize| {
        let smooth = [&one, &other]
            .iter()
            .all(|field| field.0[place].regularity == Regularity::Continuous);
        let (a, b) = (gradient(&one.1, place), gradient(&other.1, place));
        let middle =
            |of: [Interval; 3]| DVec3::from_array(of.map(|side| 0.5 * (side.low + side.high)));
        let (p, q) = (middle(a), middle(b));
        let factor = p.dot(q) / q.length_squared();
        if !(smooth && factor.is_finite()) {
            return false;
        }
        let factor = Interval::point(factor);
        let mut range = one.2[place].range - factor * other.2[place].range;
        for axis in 0..3 {
            let from_middle = sides[axis][place] - middles[axis][place];
            range = range + (a[axis] - factor * b[axis]) * from_middle;
        }
        !range.contains(0.0)
    };
    (0..cells.len()).map(missed).collect()
}

/// No vector with components in these intervals is shorter.
fn least_length(sides: [Interval; 3]) -> f64 {
    let least = sides.map(|side| side.low.max(-side.high).max(0.0));
    DVec3::from_array(least).length()
}

fn cross(a: [Interval; 3], b: [Interval; 3]) -> [Interval; 3] {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| a[i] * b[j] - a[j] * b[i])
}

/// Whether both ends of a step are proven to lie on the same piece of the curve: in a box around
/// it the curve is a graph over an axis, and starting from the first end it cannot leave through
/// the sides before it comes to the second.
pub(crate) fn connects(system: &System, fields: &[&CompiledField], step: &Step) -> bool {
    let hull = Cell {
        low: step.from.min(step.to),
        high: step.from.max(step.to),
    };
    let mut margin = DVec3::splat(MARGIN * hull.size().max_element());
    if system.dimension == 2 {
        margin.z = 0.0;
    }
    let around = Cell {
        low: hull.low - margin,
        high: hull.high + margin,
    };
    let known = enclose(system, fields, &[around]);
    let Some((known, axis)) = known.first().and_then(|known| Some((known, known.axis()?))) else {
        return false;
    };
    let run = Interval::point(step.to[axis]) - Interval::point(step.from[axis]);
    reaches(
        known,
        axis,
        step.from,
        run.hull(Interval::point(0.0)),
        &around,
    )
}

/// Whether the curve from a point stays between the sides of a box while the coordinate of the axis
/// changes by `run`.
pub(crate) fn reaches(
    known: &Known,
    axis: usize,
    from: DVec3,
    run: Interval,
    within: &Cell,
) -> bool {
    (0..3).filter(|&other| other != axis).all(|other| {
        let reached = Interval::point(from[other]) + known.slope(other, axis) * run;
        let side = within.side(other);
        side.low <= reached.low && reached.high <= side.high
    })
}
