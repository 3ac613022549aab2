//! Triangles of a Delaunay triangulation whose dual edges cross the level set.
//!
//! Every centre of a sphere in the box has one value of F, which all four dual edges that meet there
//! use: whatever rounding does to the centres, the triangles between those inside and those
//! outside surround a solid. Dual edges that leave the box end there, so a surface which the box cuts has a
//! border.

use glam::DVec3;
use rayon::prelude::*;

use super::super::Job;
use super::super::edge_roots::{Root, Segment, solve};
use crate::geometry::{Bounds, Delaunay, Facet};

/// Points that are evaluated together, and places for tetrahedra that are looked at together.
const BATCH: usize = 2048;

/// A triangle of samples with the point in which its dual edge crosses the level set.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    /// Numbers of samples, counter-clockwise seen from outside.
    pub(super) corners: [u32; 3],
    /// The crossing.
    pub(super) root: Root,
    /// How far it is from the corners; no sample is nearer.
    pub(super) radius: f64,
    /// The cosine of the angle between the triangle and the level set at the crossing.
    pub(super) cosine: f64,
}

/// All triangles, in an order that depends on the triangulation alone.
pub(super) struct Crossings {
    pub(super) crossings: Vec<Crossing>,
    pub(super) evaluations: usize,
}

/// A triangle with its dual edge.
struct Dual {
    facet: Facet,
    ends: [DVec3; 2],
    values: [f64; 2],
}

/// The triangles whose dual edges cross the level set in the box.
pub(super) fn crossings(job: &Job, delaunay: &Delaunay) -> Crossings {
    let bounds = &job.options.bounds;
    let places = delaunay.places() as u32;
    let centres: Vec<DVec3> = (0..places)
        .into_par_iter()
        .with_min_len(BATCH)
        .map(|place| delaunay.circumcentre(place))
        .collect();
    let inside: Vec<u32> = (0..places)
        .filter(|&place| bounds.contains(centres[place as usize]))
        .collect();
    let points: Vec<DVec3> = inside
        .iter()
        .map(|&place| centres[place as usize])
        .collect();
    let mut values = vec![None; centres.len()];
    for (&place, value) in inside.iter().zip(values_at_points(job, &points)) {
        values[place as usize] = Some(value);
    }
    let starts: Vec<u32> = (0..places).step_by(BATCH).collect();
    let duals = starts.into_par_iter().flat_map_iter(|start| {
        let places = start..places.min(start + BATCH as u32);
        let facets = places.flat_map(|place| delaunay.facets_of(place));
        let duals = facets.filter_map(|facet| dual(bounds, delaunay, facet, &centres, &values));
        duals.collect::<Vec<_>>()
    });
    let mut duals: Vec<(Dual, [bool; 2])> = duals.collect();
    let missing: Vec<DVec3> = (duals.iter())
        .flat_map(|(dual, known)| [0, 1].map(|end| (!known[end]).then_some(dual.ends[end])))
        .flatten()
        .collect();
    let mut found = values_at_points(job, &missing).into_iter();
    for (dual, known) in &mut duals {
        for (value, known) in dual.values.iter_mut().zip(known) {
            if !*known {
                *value = found.next().unwrap_or(f64::NAN);
            }
        }
    }
    let crossed: Vec<Dual> = (duals.into_iter())
        .map(|(dual, _)| dual)
        .filter(|dual| (dual.values[0] < 0.0) != (dual.values[1] < 0.0))
        .collect();
    let (crossings, evaluations) = with_roots(job, delaunay, &crossed);
    Crossings {
        crossings,
        evaluations: evaluations + points.len() + missing.len(),
    }
}

/// The part of a triangle's dual edge in the box, and which ends have known values. `None` if nothing of
/// it is there, or if it does not cross the level set.
fn dual(
    bounds: &Bounds,
    delaunay: &Delaunay,
    facet: Facet,
    centres: &[DVec3],
    values: &[Option<f64>],
) -> Option<(Dual, [bool; 2])> {
    let between = facet.between.map(|place| place as usize);
    let known = between.map(|place| values[place]);
    let of = |ends, values| Dual {
        facet,
        ends,
        values,
    };
    let mut ends = between.map(|place| centres[place]);
    if let [Some(first), Some(second)] = known {
        let crosses = (first < 0.0) != (second < 0.0);
        return crosses.then(|| (of(ends, [first, second]), [true; 2]));
    }
    let [a, b, c] = facet.corners.map(|corner| delaunay.point(corner));
    let normal = (b - a).cross(c - a);
    let (u, v) = (b - a, c - a);
    let lift = u.length_squared() * v.cross(normal) + v.length_squared() * normal.cross(u);
    let middle = a + lift / (2.0 * normal.length_squared());
    // From the first tetrahedron to the second, as the corners are counter-clockwise seen from there.
    let axis = normal.normalize_or_zero();
    let places = ends.map(|end| (end - middle).dot(axis));
    let [low, high] = inside_of(bounds, middle, axis)?;
    if !(places[0] <= high && places[1] >= low) {
        return None;
    }
    for end in 0..2 {
        if known[end].is_none() {
            ends[end] = middle + axis * places[end].clamp(low, high);
        }
    }
    let values = known.map(|value| value.unwrap_or(f64::NAN));
    Some((of(ends, values), known.map(|value| value.is_some())))
}

/// The part of a line in a box, as multiples of its direction; `None` if it passes the box, or is no line.
fn inside_of(bounds: &Bounds, start: DVec3, direction: DVec3) -> Option<[f64; 2]> {
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..3 {
        let (start, step) = (start[axis], direction[axis]);
        let [first, last] = [bounds.min, bounds.max].map(|corner| corner[axis] - start);
        if step == 0.0 {
            if !(first <= 0.0 && last >= 0.0) {
                return None;
            }
            continue;
        }
        let ends = [first / step, last / step];
        low = low.max(ends[0].min(ends[1]));
        high = high.min(ends[0].max(ends[1]));
    }
    (low < high && high - low < f64::INFINITY).then_some([low, high])
}

/// The triangles with the crossings on their dual edges, and the number of evaluations.
fn with_roots(job: &Job, delaunay: &Delaunay, duals: &[Dual]) -> (Vec<Crossing>, usize) {
    let Job {
        field,
        accuracy,
        monitor,
        ..
    } = *job;
    let parts: Vec<(Vec<Crossing>, usize)> = duals
        .par_chunks(BATCH)
        .map(|duals| {
            let segments: Vec<Segment> = duals.iter().map(Dual::segment).collect();
            let (roots, evaluations) = solve(&mut { field }, accuracy, &segments, monitor);
            let crossings = duals.iter().zip(roots);
            let crossings = crossings.map(|(dual, root)| dual.crossing(delaunay, root));
            (crossings.collect(), evaluations)
        })
        .collect();
    let evaluations = parts.iter().map(|part| part.1).sum();
    let crossings = parts.into_iter().flat_map(|part| part.0);
    (crossings.collect(), evaluations)
}

impl Dual {
    /// Whether the first end is the one with F < iso.
    fn begins_inside(&self) -> bool {
        self.values[0] < 0.0
    }

    /// The dual edge, from its inside end.
    fn segment(&self) -> Segment {
        let [inside, outside] = match self.begins_inside() {
            true => [0, 1],
            false => [1, 0],
        };
        Segment {
            inside: self.ends[inside],
            outside: self.ends[outside],
            inside_value: self.values[inside],
            outside_value: self.values[outside],
        }
    }

    fn crossing(&self, delaunay: &Delaunay, root: Root) -> Crossing {
        let [a, b, c] = self.facet.corners;
        let corners = match self.begins_inside() {
            true => [a, b, c],
            false => [a, c, b],
        };
        let [a, b, c] = corners.map(|corner| delaunay.point(corner));
        let normal = (b - a).cross(c - a).normalize_or_zero();
        Crossing {
            corners,
            root,
            radius: a.distance(root.position),
            cosine: normal.dot(root.normal),
        }
    }
}

/// F − iso at points, in parallel.
pub(super) fn values_at_points(job: &Job, points: &[DVec3]) -> Vec<f64> {
    let mut values = vec![0.0; points.len()];
    points
        .par_chunks(BATCH)
        .zip(values.par_chunks_mut(BATCH))
        .for_each(|(points, values)| {
            let columns =
                [0, 1, 2].map(|axis| points.iter().map(|point| point[axis]).collect::<Vec<f64>>());
            let columns = columns.each_ref().map(Vec::as_slice);
            job.field.values(&columns, values);
            values
                .iter_mut()
                .for_each(|value| *value -= job.accuracy.iso);
        });
    values
}
