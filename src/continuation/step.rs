//! One step along a curve: its ends, what lies between them, and its arc length.
//!
//! Between the ends the curve is a graph over the chord: each plane across the chord meets it in
//! one point x(ξ), found by Newton's method from the cubic Hermite interpolant. Its arc length is
//!
//! ```text
//! s(ξ) = ∫ dξ / (t(ξ) · u)
//! ```
//!
//! with t the unit tangent and u the direction of the chord. The integrand is known at the five
//! nodes of Lobatto's rule and interpolated in between (Abramowitz and Stegun, "Handbook of
//! Mathematical Functions", 25.4.32): the error is of the order of the tenth power of the angle by
//! which the curve turns for the whole step, and the sixth for a part of it. The step is accepted
//! only if the nodes lie where the interpolant says, so that both ends are on the same branch.

use glam::DVec3;

use super::system::{Condition, Local, System};

/// Where Lobatto's inner nodes are, on -1..1: ±√(3/7).
const INNER: f64 = 0.654_653_670_707_977_2;

/// Lobatto's weights for the ends, the inner nodes and the middle.
const WEIGHTS: [f64; 3] = [0.1, 49.0 / 90.0, 32.0 / 45.0];

/// The nodes of the rule on 0..1, in order.
const NODES: [f64; 5] = [0.0, 0.5 - 0.5 * INNER, 0.5, 0.5 + 0.5 * INNER, 1.0];

/// A node may lie so far from the interpolant, as a part of the chord.
const LARGEST_GAP: f64 = 0.02;

/// The smallest cosine between a tangent and the chord: that of 26 degrees.
const SMALLEST_COSINE: f64 = 0.9;

/// Points closer than this part of the diagonal are one.
const SAME: f64 = 1e-7;

/// A point of the curve and which way it is passed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) position: DVec3,
    /// Of unit length, in the direction of travel.
    pub(crate) tangent: DVec3,
    /// Whether that is the direction of the equations (1) or its opposite (-1).
    pub(crate) sign: f64,
    pub(crate) local: Local,
}

impl Place {
    /// The place with the tangent that points along a vector; `None` where there is no tangent.
    pub(crate) fn along(position: DVec3, local: Local, along: DVec3) -> Option<Place> {
        let direction = local.direction();
        let size = direction.length();
        // NaN is no tangent either.
        if size.is_nan() || size <= 1e-11 {
            return None;
        }
        let sign = 1.0_f64.copysign(direction.dot(along));
        Some(Place {
            position,
            tangent: sign / size * direction,
            sign,
            local,
        })
    }

    /// The same place passed the other way.
    pub(crate) fn reversed(self) -> Place {
        Place {
            tangent: -self.tangent,
            sign: -self.sign,
            ..self
        }
    }
}

/// A step from one place to another.
#[derive(Clone, Debug)]
pub(crate) struct Step {
    pub(crate) from: DVec3,
    pub(crate) to: DVec3,
    tangents: [DVec3; 2],
    /// The direction of the chord and its length.
    pub(crate) direction: DVec3,
    pub(crate) chord: f64,
    /// The inner nodes.
    pub(crate) nodes: [DVec3; 3],
    /// ds/dξ at the five nodes.
    rates: [f64; 5],
    /// [`Local::strength`] at the five nodes.
    pub(crate) strengths: [f64; 5],
    /// The arc length.
    pub(crate) length: f64,
    /// Whether it leads straight over a singular point, past which the curve is not a graph.
    pub(crate) straight: bool,
}

impl Step {
    /// The step between two places; `None` if the curve between them is not what their tangents
    /// say.
    pub(crate) fn new(system: &System, from: &Place, to: &Place) -> Option<Step> {
        let mut step = Step::straight(from.position, to.position);
        step.straight = false;
        step.tangents = [from.tangent, to.tangent];
        let cosines = step
            .tangents
            .map(|tangent| tangent.dot(step.direction))
            .map(|cosine| (cosine >= SMALLEST_COSINE).then_some(cosine));
        step.rates[0] = 1.0 / cosines[0]?;
        step.rates[4] = 1.0 / cosines[1]?;
        step.strengths[0] = from.local.strength;
        step.strengths[4] = to.local.strength;
        for (place, &part) in NODES.iter().enumerate().take(4).skip(1) {
            let guess = step.guess(part);
            let reach = LARGEST_GAP * step.chord;
            let across = Condition::Plane(guess, step.direction);
            let found = system.solve(guess, across, reach)?;
            let here = Place::along(found.position, found.local, step.direction)?;
            let cosine = here.tangent.dot(step.direction);
            if found.position.distance(guess) > reach || cosine < SMALLEST_COSINE {
                return None;
            }
            step.rates[place] = 1.0 / cosine;
            step.strengths[place] = here.local.strength;
            step.nodes[place - 1] = found.position;
        }
        step.length = integral(step.chord, step.rates);
        Some(step)
    }

    /// A straight step.
    pub(crate) fn straight(from: DVec3, to: DVec3) -> Step {
        let chord = from.distance(to);
        let direction = (to - from) / chord;
        Step {
            from,
            to,
            tangents: [direction; 2],
            direction,
            chord,
            nodes: [1, 2, 3].map(|place: usize| from.lerp(to, NODES[place])),
            rates: [1.0; 5],
            strengths: [0.0; 5],
            length: chord,
            straight: true,
        }
    }

    /// The same step passed the other way.
    pub(crate) fn reversed(&self) -> Step {
        let [one, two, three] = self.nodes;
        let [first, last] = self.tangents;
        let mut rates = self.rates;
        rates.reverse();
        let mut strengths = self.strengths;
        strengths.reverse();
        Step {
            from: self.to,
            to: self.from,
            tangents: [-last, -first],
            direction: -self.direction,
            nodes: [three, two, one],
            rates,
            strengths,
            ..*self
        }
    }

    /// The same step with ds multiplied by a function of the place, so that its length is the
    /// integral of that function over the arc length.
    pub(crate) fn weighed(&self, weight: impl Fn(DVec3) -> f64) -> Step {
        let mut step = self.clone();
        for (rate, (_, node)) in step.rates.iter_mut().zip(self.all_nodes()) {
            *rate *= weight(node);
        }
        step.length = integral(step.chord, step.rates);
        step
    }

    /// The cubic through the ends with their tangents; `part` is 0 at the start and 1 at the end.
    pub(crate) fn guess(&self, part: f64) -> DVec3 {
        let slope = |tangent: DVec3| self.chord / tangent.dot(self.direction) * tangent;
        let rest = 1.0 - part;
        let along = self.from + part * part * (3.0 - 2.0 * part) * (self.to - self.from);
        along + part * rest * (rest * slope(self.tangents[0]) - part * slope(self.tangents[1]))
    }

    /// The point of the curve over a part of the chord.
    pub(crate) fn at(&self, system: &System, part: f64) -> Option<Place> {
        let guess = self.guess(part);
        let reach = 0.5 * self.chord;
        let across = match self.straight {
            true => Condition::Nearest,
            false => Condition::Plane(guess, self.direction),
        };
        let found = system.solve(guess, across, reach)?;
        Place::along(found.position, found.local, self.direction)
    }

    /// The nodes in order, ends included, with the parts of the chord at which they are.
    pub(crate) fn all_nodes(&self) -> [(f64, DVec3); 5] {
        let [one, two, three] = self.nodes;
        let points = [self.from, one, two, three, self.to];
        std::array::from_fn(|place| (NODES[place], points[place]))
    }

    /// Whether a point of the curve lies on this step. Costs a few evaluations if it is near.
    pub(crate) fn passes(&self, system: &System, point: DVec3) -> bool {
        self.part_of(system, point).is_some()
    }

    /// Whether a point lies on this step, whichever equations it is a solution of.
    pub(crate) fn lies_on(&self, system: &System, point: DVec3) -> bool {
        let part = (point - self.from).dot(self.direction) / self.chord;
        let same = SAME * system.diagonal;
        (0.0..=1.0).contains(&part)
            && match self.straight {
                true => point.distance(self.guess(part)) <= same,
                false => self
                    .at(system, part)
                    .is_some_and(|here| here.position.distance(point) <= same),
            }
    }

    /// The part of the chord over which a point of the curve lies, if it is on this step.
    pub(crate) fn part_of(&self, system: &System, point: DVec3) -> Option<f64> {
        let same = SAME * system.diagonal;
        let part = (point - self.from).dot(self.direction) / self.chord;
        let slack = same / self.chord;
        if !(part >= -slack && part <= 1.0 + slack) {
            return None;
        }
        let bounded = part.clamp(0.0, 1.0);
        if point.distance(self.guess(bounded)) > 0.05 * self.chord + same {
            return None;
        }
        if self.straight {
            return Some(bounded);
        }
        let here = self.at(system, bounded)?;
        // The branches of a cusp are close to each other, but lead opposite ways.
        let there = system.local(point)?.direction();
        let alike = there.dot(here.local.direction()) > 0.0;
        (alike && here.position.distance(point) <= same).then_some(bounded)
    }

    /// The part of the chord at which so much of the arc length is passed: the inverse of s(ξ), by
    /// Newton's method on the integrated interpolant.
    pub(crate) fn part_at_length(&self, length: f64) -> f64 {
        let rates = Polynomial::through(self.rates);
        let scale = 0.5 * self.chord;
        let mut t = 2.0 * (length / self.length).clamp(0.0, 1.0) - 1.0;
        for _ in 0..8 {
            let missing = length / scale - (rates.integral(t) - rates.integral(-1.0));
            let shift = missing / rates.value(t);
            t = (t + shift).clamp(-1.0, 1.0);
            if shift.abs() < 1e-15 {
                break;
            }
        }
        0.5 + 0.5 * t
    }
}

/// ∫ ds over a chord from ds/dξ at Lobatto's nodes.
fn integral(chord: f64, rates: [f64; 5]) -> f64 {
    let [first, second, middle, fourth, last] = rates;
    let sum = WEIGHTS[0] * (first + last) + WEIGHTS[1] * (second + fourth) + WEIGHTS[2] * middle;
    0.5 * chord * sum
}

/// A polynomial of degree four on -1..1.
struct Polynomial([f64; 5]);

impl Polynomial {
    /// The one with these values at Lobatto's nodes: its even part is a parabola in t², and so is
    /// its odd part but for a factor t.
    fn through(values: [f64; 5]) -> Polynomial {
        let y = INNER * INNER;
        let even = |place: usize| 0.5 * (values[4 - place] + values[place]);
        let odd = |place: usize| 0.5 * (values[4 - place] - values[place]);
        let middle = values[2];
        let near = (even(1) - middle) / y;
        let far = even(0) - middle;
        let fourth = (far - near) / (1.0 - y);
        let third = (odd(0) - odd(1) / INNER) / (1.0 - y);
        Polynomial([middle, odd(0) - third, far - fourth, third, fourth])
    }

    fn value(&self, t: f64) -> f64 {
        self.0
            .iter()
            .rev()
            .fold(0.0, |sum, factor| sum * t + factor)
    }

    fn integral(&self, t: f64) -> f64 {
        let factors = self.0.iter().zip([1.0, 2.0, 3.0, 4.0, 5.0]).rev();
        t * factors.fold(0.0, |sum, (factor, power)| sum * t + factor / power)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interpolant_reproduces_polynomials_of_degree_four() {
        let factors = [0.5, -1.0, 2.0, 0.25, -3.0];
        let wanted = Polynomial(factors);
        let values = NODES.map(|part| wanted.value(2.0 * part - 1.0));
        let found = Polynomial::through(values);
        for (found, wanted) in found.0.iter().zip(factors) {
            assert!((found - wanted).abs() < 1e-14, "{found} {wanted}");
        }
        // 2 (0.5 + 2/3 - 3/5) over the whole.
        let whole = found.integral(1.0) - found.integral(-1.0);
        assert!((whole - 2.0 * (0.5 + 2.0 / 3.0 - 0.6)).abs() < 1e-14);
    }
}
