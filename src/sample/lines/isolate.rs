//! Isolation: parts of lines with exactly one root each, and the places that remain in doubt.

use super::Chunk;
use super::bracket::Bracket;
use crate::engine::CompiledField;
use crate::graph::Interval;
use crate::graph::interval::{Enclosure, Regularity};

/// The length of the first parts, relative to the diagonal of the box: about where enclosures of
/// usual fields begin to exclude zeros.
const FIRST_PARTS: f64 = 1.0 / 8.0;

/// Parts are not cut below this length, relative to the diagonal. Roots closer to each other may
/// be taken for one, which a line has where it misses being a tangent by 1e-19 of the diagonal.
const FLOOR: f64 = 1e-9;

/// A segment is cut into so many parts at most; what is not decided then remains in doubt.
const PART_LIMIT: u32 = 1 << 13;

/// Fields without enclosures are looked at this far apart, relative to the diagonal.
const SAMPLING: f64 = 1.0 / 1024.0;

/// A part of a line with F at its ends.
#[derive(Clone, Copy, Debug)]
struct Part {
    line: u32,
    from: f64,
    to: f64,
    values: [f64; 2],
}

/// Neighbouring parts of a line that intervals could not decide.
#[derive(Clone, Copy, Debug)]
pub(super) struct Doubt {
    /// The place of the segment in its chunk.
    pub(super) line: u32,
    pub(super) from: f64,
    pub(super) to: f64,
    /// F at the ends.
    pub(super) values: [f64; 2],
    /// The length on which F is proven to be 0 all along.
    pub(super) vanishing: f64,
}

impl Doubt {
    /// Whether F is a number at both ends, below 0 at one of them only.
    pub(super) fn changes_sign(&self) -> bool {
        let [first, last] = self.values;
        !first.is_nan() && !last.is_nan() && (first < 0.0) != (last < 0.0)
    }

    /// The bracket of a change of sign.
    pub(super) fn bracket(&self) -> Bracket {
        Bracket {
            line: self.line,
            from: self.from,
            to: self.to,
            values: self.values,
            proven: false,
        }
    }
}

/// What is known of F on a part.
enum Verdict {
    /// It has no zero.
    Empty,
    /// It is continuous and strictly monotonous.
    Monotonous,
    /// Nothing, and smaller parts would not help: it is 0 to the tolerance all along.
    Flat,
    /// It is 0 all along.
    Zero,
    /// Nothing.
    Open,
}

/// Brackets with one root each, and doubts, both in the order of the lines.
pub(super) fn isolate(chunk: &mut Chunk) -> (Vec<Bracket>, Vec<Doubt>) {
    match chunk.field.compiled() {
        Some(compiled) => isolate_by_enclosures(chunk, compiled),
        None => (changes_of_sign(chunk), Vec::new()),
    }
}

/// Every segment in equal parts no longer than `longest`, with F at their ends.
fn parts(chunk: &mut Chunk, longest: f64) -> Vec<Part> {
    let mut places: Vec<(u32, f64)> = Vec::new();
    for (line, segment) in (0..).zip(chunk.segments) {
        let number = (segment.length / longest).ceil().max(1.0);
        let place = |index: u32| f64::from(index) / number * segment.length;
        places.extend((0..=number as u32).map(|index| (line, place(index))));
    }
    let values = chunk.values(&places);
    let ends = places.windows(2).zip(values.windows(2));
    ends.filter(|(places, _)| places[0].0 == places[1].0)
        .map(|(places, values)| Part {
            line: places[0].0,
            from: places[0].1,
            to: places[1].1,
            values: [values[0], values[1]],
        })
        .collect()
}

/// Without enclosures: brackets wherever neighbouring points have different signs.
fn changes_of_sign(chunk: &mut Chunk) -> Vec<Bracket> {
    let longest = SAMPLING * chunk.wanted.bounds.diagonal();
    let parts = parts(chunk, longest);
    let doubts = parts.iter().map(Part::doubt);
    doubts
        .filter(Doubt::changes_sign)
        .map(|doubt| doubt.bracket())
        .collect()
}

fn isolate_by_enclosures(
    chunk: &mut Chunk,
    compiled: &CompiledField,
) -> (Vec<Bracket>, Vec<Doubt>) {
    let diagonal = chunk.wanted.bounds.diagonal();
    let farthest = chunk.wanted.bounds.min.abs();
    let farthest = farthest.max(chunk.wanted.bounds.max.abs()).max_element();
    let floor = (FLOOR * diagonal).max(64.0 * f64::EPSILON * farthest);
    let mut open = parts(chunk, FIRST_PARTS * diagonal);
    let mut left = vec![PART_LIMIT; chunk.segments.len()];
    let mut boxes = Boxes::default();
    let mut brackets = Vec::new();
    let mut doubts = Vec::new();
    while !open.is_empty() {
        boxes.reject(chunk, compiled, &mut open);
        boxes.enclose_slopes(chunk, compiled, &open);
        let mut halved: Vec<Part> = Vec::new();
        for (index, part) in open.iter().enumerate() {
            match boxes.verdict(chunk, index, part) {
                Verdict::Empty => {}
                Verdict::Monotonous => part.root(chunk, &mut brackets, &mut doubts),
                Verdict::Flat => doubts.push(part.doubt()),
                Verdict::Zero => doubts.push(Doubt {
                    vanishing: part.to - part.from,
                    ..part.doubt()
                }),
                Verdict::Open => {
                    let left = &mut left[part.line as usize];
                    if part.to - part.from <= floor || *left == 0 {
                        doubts.push(part.doubt());
                    } else {
                        *left -= 1;
                        halved.push(*part);
                    }
                }
            }
        }
        open = halves(chunk, &halved);
    }
    brackets.sort_by(|one: &Bracket, other| {
        (one.line.cmp(&other.line)).then(one.from.total_cmp(&other.from))
    });
    (brackets, joined(doubts))
}

/// Both halves of each part, with F in the middle.
fn halves(chunk: &mut Chunk, parts: &[Part]) -> Vec<Part> {
    let middles: Vec<(u32, f64)> = parts
        .iter()
        .map(|part| (part.line, part.from.midpoint(part.to)))
        .collect();
    let values = chunk.values(&middles);
    let with_middles = parts.iter().zip(middles.iter().zip(values));
    with_middles
        .flat_map(|(part, (&(_, middle), value))| {
            let first = Part {
                to: middle,
                values: [part.values[0], value],
                ..*part
            };
            let second = Part {
                from: middle,
                values: [value, part.values[1]],
                ..*part
            };
            [first, second]
        })
        .collect()
}

/// Doubts in the order of the lines; neighbours are made one.
fn joined(mut doubts: Vec<Doubt>) -> Vec<Doubt> {
    doubts.sort_by(|one, other| (one.line.cmp(&other.line)).then(one.from.total_cmp(&other.from)));
    let mut joined: Vec<Doubt> = Vec::new();
    for doubt in doubts {
        match joined.last_mut() {
            Some(last) if last.line == doubt.line && last.to == doubt.from => {
                last.to = doubt.to;
                last.values[1] = doubt.values[1];
                last.vanishing += doubt.vanishing;
            }
            _ => joined.push(doubt),
        }
    }
    joined
}

impl Part {
    fn doubt(&self) -> Doubt {
        Doubt {
            line: self.line,
            from: self.from,
            to: self.to,
            values: self.values,
            vanishing: 0.0,
        }
    }

    /// The root on a part along which F is monotonous, if there is one.
    fn root(&self, chunk: &Chunk, brackets: &mut Vec<Bracket>, doubts: &mut Vec<Doubt>) {
        let [first, last] = self.values;
        let length = chunk.segments[self.line as usize].length;
        if (first < 0.0) != (last < 0.0) {
            brackets.push(Bracket {
                line: self.line,
                from: self.from,
                to: self.to,
                values: self.values,
                proven: true,
            });
        } else if first == 0.0 && self.from == 0.0 || last == 0.0 && self.to == length {
            // A zero at an end of the segment: the part beyond, which would have the other sign,
            // is not there.
            let place = if first == 0.0 { self.from } else { self.to };
            doubts.push(Doubt {
                from: place,
                to: place,
                ..self.doubt()
            });
        }
    }

    /// A lower bound of |F| on the part from F at the ends and the slopes between them ("linear
    /// boundary value form", A. Neumaier, Interval Methods for Systems of Equations, 1990,
    /// section 2.4): where the two lines meet that fall from the ends as steeply as F may.
    /// `rounding` is a length: the values are wrong as if their places were by so much.
    fn is_bounded_away(&self, slope: Interval, rounding: f64) -> bool {
        let [first, last] = self.values;
        if (first < 0.0) != (last < 0.0) {
            return false;
        }
        let (high, low) = match first < 0.0 {
            true => (-slope.low, -slope.high),
            false => (slope.high, slope.low),
        };
        let width = self.to - self.from;
        let ends = high * first.abs() - low * last.abs();
        let fall = -low * high * width;
        // The difference is believed where it is not rounding.
        let error = rounding * high.max(-low) * (high - low);
        ends - fall > 1e-12 * ends + error
    }
}

/// Columns of boxes around parts, with what encloses F and F_x there.
#[derive(Default)]
struct Boxes {
    sides: [Vec<Interval>; 3],
    values: Vec<Enclosure>,
    gradients: [Vec<Interval>; 3],
}

/// What stands in a column before it is filled.
const NOTHING: Enclosure = Enclosure {
    range: Interval::ENTIRE,
    regularity: Regularity::Partial,
};

impl Boxes {
    /// Makes the boxes around the parts.
    fn surround(&mut self, chunk: &Chunk, parts: &[Part]) {
        self.sides.iter_mut().for_each(Vec::clear);
        for part in parts {
            let from = chunk.point(part.line, part.from);
            let to = chunk.point(part.line, part.to);
            let direction = chunk.segments[part.line as usize].direction;
            for (axis, column) in self.sides.iter_mut().enumerate() {
                let (low, high) = (from[axis].min(to[axis]), from[axis].max(to[axis]));
                // Points between are rounded too, unless the axis is not moved along.
                let margin = match direction[axis] == 0.0 {
                    true => 0.0,
                    false => 4.0 * f64::EPSILON * low.abs().max(high.abs()),
                };
                column.push(Interval::new(low - margin, high + margin));
            }
        }
        self.values.clear();
        self.values.resize(parts.len(), NOTHING);
    }

    /// Leaves only parts on whose boxes F may be 0.
    fn reject(&mut self, chunk: &mut Chunk, compiled: &CompiledField, parts: &mut Vec<Part>) {
        self.surround(chunk, parts);
        chunk.cost.enclosures += parts.len() as u64;
        let columns = self.sides.each_ref().map(Vec::as_slice);
        let dimension = chunk.wanted.bounds.dimension;
        compiled.enclose(&columns[..dimension], &mut self.values);
        let mut values = self.values.iter();
        parts.retain(|_| values.next().is_none_or(|value| value.range.contains(0.0)));
    }

    /// Encloses F and F_x on the parts' boxes.
    fn enclose_slopes(&mut self, chunk: &mut Chunk, compiled: &CompiledField, parts: &[Part]) {
        self.surround(chunk, parts);
        chunk.cost.enclosures += parts.len() as u64;
        for column in &mut self.gradients {
            column.clear();
            column.resize(parts.len(), Interval::ENTIRE);
        }
        let columns = self.sides.each_ref().map(Vec::as_slice);
        let mut gradients = self.gradients.each_mut().map(Vec::as_mut_slice);
        let dimension = chunk.wanted.bounds.dimension;
        compiled.enclose_gradients(
            &columns[..dimension],
            &mut self.values,
            &mut gradients[..dimension],
        );
    }

    /// What is known of F on a part.
    fn verdict(&self, chunk: &Chunk, index: usize, part: &Part) -> Verdict {
        let Enclosure { range, regularity } = self.values[index];
        if !range.contains(0.0) {
            return Verdict::Empty;
        }
        if regularity != Regularity::Continuous {
            return Verdict::Open;
        }
        let dimension = chunk.wanted.bounds.dimension;
        let direction = chunk.segments[part.line as usize].direction;
        let mut slope = Interval::new(0.0, 0.0);
        // The smallest that |F_x| can be, squared.
        let mut least = 0.0;
        for axis in 0..dimension {
            let component = self.gradients[axis][index];
            let is_bounded = f64::NEG_INFINITY < component.low
                && component.low <= component.high
                && component.high < f64::INFINITY;
            if !is_bounded {
                return Verdict::Open;
            }
            let along = direction[axis];
            if along != 0.0 {
                slope = slope + component * Interval::new(along, along);
            }
            let smallest = component.low.max(-component.high).max(0.0);
            least += smallest * smallest;
        }
        if !slope.contains(0.0) {
            return Verdict::Monotonous;
        }
        let rounding = chunk.wanted.rounding(chunk.point(part.line, part.from));
        if part.is_bounded_away(slope, rounding) {
            return Verdict::Empty;
        }
        let largest = range.high.max(-range.low);
        // A product with 0 is rounded outward.
        if largest <= f64::MIN_POSITIVE {
            return Verdict::Zero;
        }
        if largest <= chunk.wanted.tolerance * least.sqrt() {
            return Verdict::Flat;
        }
        Verdict::Open
    }
}
