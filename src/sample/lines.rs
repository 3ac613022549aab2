//! All roots of F on segments of lines, many together.
//!
//! Each segment is cut into parts until intervals decide (`isolate`): F cannot be 0 on the part, or
//! it is monotonous along it and has one root if the signs at the ends differ, none if not. Roots
//! are then solved for by Newton's method in a bracket (`bracket`). So every root is found, up to
//! the rounding of F at the ends of parts, however close to another one it lies.
//!
//! What remains undecided at the floor of the width are places where the line touches the surface
//! without crossing it, or lies in it, and places where F is not continuous or ends. Of each one
//! point is kept, that with the smallest |F|, if it is a zero to the tolerance and |F| falls towards
//! it; poles, jumps and ends of the domain are none of these and are counted. So are the stretches
//! on which F is 0 all along, whose one point is in the middle: a region has no area.
//!
//! For fields that give no enclosures (those that are not compiled) signs are compared at many
//! points of a segment instead; two roots between neighbouring points are then missed, and the
//! result says that nothing was proven.
//!
//! The polygonizers have a solver for edges of their own, which knows coordinates instead of
//! lines: it keeps those across the edge exact, and snaps roots to the grid.

mod bracket;
mod isolate;

use glam::DVec3;
use rayon::prelude::*;

use super::evaluation::{Batch, Evaluation};
use super::newton::Point;
use crate::engine::Field;
use crate::geometry::Bounds;
use bracket::solve;
use isolate::{Doubt, isolate};

/// Segments that share calls of the field: about as many boxes as two passes over blocks take.
pub(super) const CHUNK: usize = 64;

/// Steps of the golden section, which take a place from the floor of the width to rounding, and the
/// part that each leaves.
const SECTIONS: usize = 32;
const GOLDEN: f64 = 0.618_033_988_749_894_8;

/// Residuals of this size, relative to the box and the coordinates, are rounding.
const ROUNDING: f64 = 1e-14;

/// A part of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Segment {
    /// Where it begins.
    pub(super) origin: DVec3,
    /// The direction, of length 1.
    pub(super) direction: DVec3,
    /// How long it is.
    pub(super) length: f64,
}

/// What is asked of the roots.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted {
    /// The box that the segments lie in, from which no point strays by rounding.
    pub(super) bounds: Bounds,
    /// The largest |F| / |F_x| of a root, a length.
    pub(super) tolerance: f64,
}

/// A root on a line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    /// The distance from the beginning of the segment.
    pub(super) along: f64,
    /// The point, with the field there.
    pub(super) point: Point,
    /// Whether the line was not proven to cross the surface there: it may touch it only.
    pub(super) touches: bool,
    /// Whether it stands for a stretch on which F is 0 all along.
    pub(super) in_region: bool,
}

/// What was found on one segment.
#[derive(Clone, Debug, Default)]
pub(super) struct Line {
    /// The roots, in their order along the segment.
    pub(super) crossings: Vec<Crossing>,
    /// The length of the parts on which F < 0.
    pub(super) inside: f64,
    /// Places that could not be decided and gave no point.
    pub(super) undecided: u32,
    /// Those of them at which F is close to 0 on both sides, so that there may be roots.
    pub(super) unclear: u32,
    /// Stretches on which F is 0 all along.
    pub(super) vanishing: u32,
}

/// What looking for roots has cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Cost {
    /// Evaluations of F, or of F and F_x, at one point.
    pub(super) evaluations: u64,
    /// Enclosures of F, or of F and F_x, on one box.
    pub(super) enclosures: u64,
    /// Evaluations at which F was NaN or infinite.
    pub(super) undefined: u64,
}

impl Cost {
    /// Adds the cost of other segments.
    pub(super) fn add(&mut self, other: Cost) {
        self.evaluations += other.evaluations;
        self.enclosures += other.enclosures;
        self.undefined += other.undefined;
    }
}

impl Segment {
    /// The point at a distance from the beginning; not outside of the box.
    fn at(&self, along: f64, bounds: &Bounds) -> DVec3 {
        (self.origin + along * self.direction).clamp(bounds.min, bounds.max)
    }
}

impl Wanted {
    /// The size below which a residual at a point is nothing but rounding.
    fn rounding(&self, position: DVec3) -> f64 {
        ROUNDING * (self.bounds.diagonal() + position.abs().max_element())
    }

    /// Whether an evaluation is a zero, given F at two places nearby, on both sides: the residual is
    /// small, and |F| has fallen. |F| / |F_x| alone is small also at a pole and where the domain
    /// of a root ends.
    fn is_zero(&self, point: &Point, nearby: [f64; 2]) -> bool {
        let level = point.here.value.abs();
        let residual = point.here.distance();
        let is_rounding = residual <= self.rounding(point.position);
        // NaN at one of the places leaves the other.
        let [first, last] = nearby.map(f64::abs);
        let falls = level <= 0.5 * first.min(last) || is_rounding && level <= first.max(last);
        point.here.is_defined() && residual <= self.tolerance && (falls || level == 0.0)
    }
}

/// Finds the roots on the segments, in their order, and the cost. Segments are worked on in
/// parallel, in chunks of [`CHUNK`]; the result does not depend on that.
///
/// A smooth root costs some tens of enclosures and five evaluations.
pub(super) fn intersect(
    field: &dyn Field,
    segments: &[Segment],
    wanted: &Wanted,
) -> (Vec<Line>, Cost) {
    let parts: Vec<(Vec<Line>, Cost)> = segments
        .par_chunks(CHUNK)
        .map(|chunk| intersect_chunk(field, chunk, wanted))
        .collect();
    let mut lines = Vec::with_capacity(segments.len());
    let mut cost = Cost::default();
    for (found, counts) in parts {
        lines.extend(found);
        cost.add(counts);
    }
    (lines, cost)
}

fn intersect_chunk(field: &dyn Field, segments: &[Segment], wanted: &Wanted) -> (Vec<Line>, Cost) {
    let mut chunk = Chunk {
        field,
        segments,
        wanted,
        columns: Columns::default(),
        batch: Batch::default(),
        cost: Cost::default(),
    };
    let (mut brackets, doubts) = isolate(&mut chunk);
    let mut lines = vec![Line::default(); segments.len()];
    // Where the sign may change although there is no root.
    let mut breaks: Vec<(u32, f64)> = Vec::new();
    for doubt in doubts.iter().filter(|doubt| doubt.vanishing > 0.0) {
        lines[doubt.line as usize].vanishing += 1;
    }
    let (with_sign, without): (Vec<Doubt>, Vec<Doubt>) =
        doubts.into_iter().partition(Doubt::changes_sign);
    brackets.extend(with_sign.iter().map(Doubt::bracket));
    for (bracket, root) in brackets.iter().zip(solve(&mut chunk, &brackets)) {
        chunk.keep(bracket.line, root, &mut lines, &mut breaks);
    }
    for (doubt, (root, unclear)) in without.iter().zip(touching(&mut chunk, &without)) {
        lines[doubt.line as usize].unclear += u32::from(unclear);
        chunk.keep(doubt.line, root, &mut lines, &mut breaks);
    }
    for line in &mut lines {
        let crossings = &mut line.crossings;
        crossings.sort_by(|one, other| one.along.total_cmp(&other.along));
    }
    measure_inside(&mut chunk, &mut lines, &mut breaks);
    (lines, chunk.cost)
}

/// A place on a line, and the root there, if it is one.
type Found = (f64, Option<Crossing>);

/// Of each doubtful place without a change of sign the best of four points: the middle, the ends, and
/// where |F| is smallest. With it, whether F is close to 0 although none of them is a zero.
fn touching(chunk: &mut Chunk, doubts: &[Doubt]) -> Vec<(Found, bool)> {
    let smallest = smallest(chunk, doubts);
    let places: Vec<(u32, f64)> = (doubts.iter().zip(smallest))
        .flat_map(|(doubt, smallest)| {
            let middle = doubt.from.midpoint(doubt.to);
            [middle, doubt.from, doubt.to, smallest].map(|along| (doubt.line, along))
        })
        .collect();
    let points = chunk.evaluate(&places);
    let mut found = Vec::with_capacity(doubts.len());
    let tried = places.chunks(4).zip(points.chunks(4));
    for (doubt, (places, four)) in doubts.iter().zip(tried) {
        let zeros = places.iter().zip(four);
        let zeros = zeros.filter(|(_, point)| chunk.wanted.is_zero(point, doubt.values));
        // The first of several that are as good, which in a region is the middle.
        let best = zeros
            .min_by(|(_, one), (_, other)| one.here.distance().total_cmp(&other.here.distance()));
        let crossing = best.map(|(&(_, along), &point)| Crossing {
            along,
            point,
            touches: true,
            in_region: doubt.vanishing > 0.0,
        });
        let has_ends = doubt.values.iter().all(|value| value.is_finite());
        let is_close = |point: &Point| point.here.distance() <= chunk.wanted.tolerance;
        let unclear = crossing.is_none() && has_ends && four.iter().any(is_close);
        found.push(((places[0].1, crossing), unclear));
    }
    found
}

/// Where |F| is smallest at each doubtful place, by the golden section.
fn smallest(chunk: &mut Chunk, doubts: &[Doubt]) -> Vec<f64> {
    let mut ranges: Vec<(f64, f64)> = doubts.iter().map(|doubt| (doubt.from, doubt.to)).collect();
    let open: Vec<usize> = (0..doubts.len())
        .filter(|&place| doubts[place].vanishing == 0.0 && doubts[place].from < doubts[place].to)
        .collect();
    for _ in 0..if open.is_empty() { 0 } else { SECTIONS } {
        let places = open.iter().flat_map(|&place| {
            let (from, to) = ranges[place];
            [1.0 - GOLDEN, GOLDEN].map(|part| (doubts[place].line, from + part * (to - from)))
        });
        let places: Vec<(u32, f64)> = places.collect();
        let values = chunk.values(&places);
        for ((&place, inner), values) in open.iter().zip(places.chunks(2)).zip(values.chunks(2)) {
            match values[0].abs() <= values[1].abs() {
                true => ranges[place].1 = inner[1].1,
                false => ranges[place].0 = inner[0].1,
            }
        }
    }
    let middles = ranges.iter().map(|(from, to)| from.midpoint(*to));
    middles.collect()
}

/// Adds up the lengths on which F < 0: between places where its sign may change it is that in the
/// middle.
fn measure_inside(chunk: &mut Chunk, lines: &mut [Line], breaks: &mut [(u32, f64)]) {
    breaks.sort_by(|one, other| one.0.cmp(&other.0).then(one.1.total_cmp(&other.1)));
    let mut next_break = breaks.iter().peekable();
    let mut middles: Vec<(u32, f64)> = Vec::new();
    let mut lengths: Vec<f64> = Vec::new();
    for (index, line) in (0_u32..).zip(lines.iter()) {
        let mut cuts: Vec<f64> = line.crossings.iter().map(|root| root.along).collect();
        while let Some((_, place)) = next_break.next_if(|(line, _)| *line == index) {
            cuts.push(*place);
        }
        cuts.push(chunk.segments[index as usize].length);
        cuts.sort_by(f64::total_cmp);
        let mut from = 0.0;
        for to in cuts {
            middles.push((index, 0.5 * (from + to)));
            lengths.push(to - from);
            from = to;
        }
    }
    let values = chunk.values(&middles);
    for (((index, _), length), value) in middles.iter().zip(lengths).zip(values) {
        if value < 0.0 {
            lines[*index as usize].inside += length;
        }
    }
}

/// The segments that are worked on together.
struct Chunk<'a> {
    field: &'a dyn Field,
    segments: &'a [Segment],
    wanted: &'a Wanted,
    columns: Columns,
    batch: Batch,
    cost: Cost,
}

/// Columns for values without gradients.
#[derive(Default)]
struct Columns {
    points: [Vec<f64>; 3],
    values: Vec<f64>,
}

impl Chunk<'_> {
    /// The point of a segment.
    fn point(&self, line: u32, along: f64) -> DVec3 {
        self.segments[line as usize].at(along, &self.wanted.bounds)
    }

    /// F at points of segments.
    fn values(&mut self, places: &[(u32, f64)]) -> Vec<f64> {
        let mut columns = std::mem::take(&mut self.columns);
        let dimension = self.wanted.bounds.dimension;
        columns.points.iter_mut().for_each(Vec::clear);
        for &(line, along) in places {
            let point = self.point(line, along);
            for (axis, column) in columns.points.iter_mut().enumerate() {
                column.push(point[axis]);
            }
        }
        columns.values.resize(places.len(), 0.0);
        let [x, y, z] = &columns.points;
        let points = [&x[..], &y[..], &z[..]];
        self.field.values(&points[..dimension], &mut columns.values);
        let values = columns.values.clone();
        self.count(values.iter().copied());
        self.columns = columns;
        values
    }

    /// F and F_x at points of segments.
    fn evaluate(&mut self, places: &[(u32, f64)]) -> Vec<Point> {
        let positions: Vec<DVec3> = places
            .iter()
            .map(|&(line, along)| self.point(line, along))
            .collect();
        let here: Vec<Evaluation> = self
            .batch
            .evaluate(self.field, positions.iter().copied())
            .collect();
        self.count(here.iter().map(|here| here.value));
        let points = positions.into_iter().zip(here);
        points
            .map(|(position, here)| Point { position, here })
            .collect()
    }

    fn count(&mut self, values: impl ExactSizeIterator<Item = f64>) {
        self.cost.evaluations += values.len() as u64;
        self.cost.undefined += values.filter(|value| !value.is_finite()).count() as u64;
    }

    /// Writes down what was found at a place of a line.
    fn keep(
        &self,
        line: u32,
        (place, root): Found,
        lines: &mut [Line],
        breaks: &mut Vec<(u32, f64)>,
    ) {
        let found = &mut lines[line as usize];
        match root {
            Some(crossing) => found.crossings.push(crossing),
            None => {
                found.undecided += 1;
                breaks.push((line, place));
            }
        }
    }
}
