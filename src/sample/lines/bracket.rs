//! Roots between two points of a line at which F has different signs, many together.
//!
//! Newton's method along the line, safeguarded by the bracket: a step that leaves it, or does not
//! at least halve the step before the last, is replaced by bisection ("rtsafe" in Press et al.,
//! Numerical Recipes, 3rd ed., section 9.4). It converges quadratically on smooth fields and never
//! more slowly than bisection.

use super::{Chunk, Crossing, Found};
use crate::sample::newton::Point;

/// Steps of one search, at most: bisection needs about 60 from the size of a box to the distance
/// of neighbouring numbers, and Newton's steps may take turns with it.
const STEP_LIMIT: u32 = 200;

/// A part of a line with different signs of F at its ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bracket {
    /// The place of the segment in its chunk.
    pub(super) line: u32,
    pub(super) from: f64,
    pub(super) to: f64,
    /// F at the ends. Exactly one is below 0, the other 0 or above.
    pub(super) values: [f64; 2],
    /// Whether F is known to be continuous and monotonous between the ends.
    pub(super) proven: bool,
}

/// The search for one root.
struct Search {
    /// The place of the bracket in the list.
    index: usize,
    /// The ends as they are now, and whether F < 0 at the first.
    from: f64,
    to: f64,
    first_is_negative: bool,
    candidate: f64,
    /// The lengths of the step before the last and of the last.
    steps: [f64; 2],
    /// The place with the smallest |F| so far.
    best: Option<(f64, Point)>,
}

/// The root in each bracket, in order. Where there is none (at a pole, a jump or the end of the
/// domain) it is only said where.
pub(super) fn solve(chunk: &mut Chunk, brackets: &[Bracket]) -> Vec<Found> {
    let mut found: Vec<Found> = brackets
        .iter()
        .map(|bracket| (bracket.from, None))
        .collect();
    let mut searches: Vec<Search> = brackets.iter().enumerate().map(Search::new).collect();
    for step in 0..STEP_LIMIT {
        if searches.is_empty() {
            break;
        }
        let places: Vec<(u32, f64)> = searches
            .iter()
            .map(|search| (brackets[search.index].line, search.candidate))
            .collect();
        let points = chunk.evaluate(&places);
        let mut points = points.into_iter();
        searches.retain_mut(|search| {
            let Some(point) = points.next() else {
                return false;
            };
            let goes_on = search.advance(chunk, brackets, point) && step + 1 < STEP_LIMIT;
            if !goes_on {
                found[search.index] = search.result(chunk, &brackets[search.index]);
            }
            goes_on
        });
    }
    found
}

impl Search {
    fn new((index, bracket): (usize, &Bracket)) -> Search {
        let Bracket {
            from, to, values, ..
        } = *bracket;
        let [first, last] = values;
        let weight = first / (first - last);
        let secant = from + weight * (to - from);
        let usable = first.is_finite() && last.is_finite() && (from..=to).contains(&secant);
        Search {
            index,
            from,
            to,
            first_is_negative: first < 0.0,
            candidate: if usable { secant } else { from.midpoint(to) },
            steps: [to - from; 2],
            best: None,
        }
    }

    /// Takes F and F_x at the candidate; returns whether the search goes on to the next one.
    fn advance(&mut self, chunk: &Chunk, brackets: &[Bracket], point: Point) -> bool {
        let here = self.candidate;
        let value = point.here.value;
        let level = value.abs();
        let before = self
            .best
            .map_or(f64::INFINITY, |(_, best)| best.here.value.abs());
        let improves = level < before;
        if improves {
            self.best = Some((here, point));
        }
        // Once within the tolerance, steps go on while they lower |F|: that costs one or two and
        // gives what rounding allows.
        let residual = point.here.distance();
        let is_exact = residual <= chunk.wanted.rounding(point.position);
        let within = residual <= chunk.wanted.tolerance;
        if value == 0.0 || within && (is_exact || !improves) {
            return false;
        }
        // NaN counts as not below 0, like everywhere.
        if (value < 0.0) == self.first_is_negative {
            self.from = here;
        } else {
            self.to = here;
        }
        let direction = chunk.segments[brackets[self.index].line as usize].direction;
        let newton = here - value / point.here.gradient.dot(direction);
        let step = (newton - here).abs();
        let inside = self.from < newton && newton < self.to;
        let next = if inside && step <= 0.5 * self.steps[0] {
            newton
        } else {
            self.from.midpoint(self.to)
        };
        self.steps = [self.steps[1], (next - here).abs()];
        self.candidate = next;
        self.from < next && next < self.to
    }

    /// What the search has come to.
    fn result(&self, chunk: &Chunk, bracket: &Bracket) -> Found {
        let Some((along, point)) = self.best else {
            return (bracket.from, None);
        };
        let residual = point.here.distance();
        let is_root = match bracket.proven {
            true => residual <= chunk.wanted.tolerance,
            false => chunk.wanted.is_zero(&point, bracket.values),
        };
        let crossing = Crossing {
            along,
            point,
            touches: !bracket.proven,
            in_region: false,
        };
        (along, is_root.then_some(crossing))
    }
}
