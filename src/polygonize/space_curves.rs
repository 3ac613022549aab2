//! Curves in space, on which two fields vanish, by enumeration of tetrahedra.
//!
//! The cells of a grid are cut into six tetrahedra each (Freudenthal), on which both fields are
//! interpolated linearly. The interpolants vanish together on a segment or not at all, which enters and
//! leaves a tetrahedron through two of its faces (E. L. Allgower and K. Georg, "Numerical Continuation
//! Methods", chapter 15). Whether they vanish on a face depends on the signs of the determinants of
//! the values at the ends of its edges, which are found without error and made different from 0 by a
//! shift of the origin that is smaller than any number; so every face agrees with itself from both
//! sides and no curve breaks off. Then Newton's method puts the vertices on the curve.

use glam::DVec3;
use rayon::prelude::*;

use super::grid::{Grid, Seen};
use super::{Found, Options, PolygonizeError, Shape, Statistics, uniform_grid};
use crate::continuation::{Condition, System};
use crate::engine::{Field, Monitor};
use crate::geometry::{Curves, Polyline};

/// The ways from one corner of a cell to the opposite one: the order of the axes.
const WAYS: [[usize; 3]; 6] = [
    [0, 1, 2],
    [0, 2, 1],
    [1, 0, 2],
    [1, 2, 0],
    [2, 0, 1],
    [2, 1, 0],
];

/// The faces of a tetrahedron.
const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]];

/// Layers of cells that are looked at together.
const LAYERS: usize = 4;

/// Where the sine between the normals is smaller, the vertex is at a crossing or where surfaces touch.
const SINGULAR: f64 = 0.05;

/// Vertices at which surfaces are nearly tangent are at one place if they are nearer than so many cells.
const ONE: f64 = 4.0;

/// A face by the numbers of its grid points, ascending, and where the interpolants vanish on it.
#[derive(Clone, Copy, Debug)]
struct Passage {
    face: [u64; 3],
    point: DVec3,
}

/// The curve on which both fields vanish.
pub(super) fn enumerate(
    fields: [&dyn Field; 2],
    distance: f64,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Found, PolygonizeError> {
    let grid = uniform_grid(&Options {
        cap: false,
        ..options.clone()
    })?;
    let layers = grid.coordinates[2].len() - 1;
    let slabs: Vec<usize> = (0..layers).step_by(LAYERS).collect();
    let parts: Vec<(Vec<[Passage; 2]>, Seen)> = (slabs.into_par_iter())
        .map(|first| match monitor.cancelled() {
            true => (Vec::new(), Seen::default()),
            false => slab(fields, &grid, first, (first + LAYERS).min(layers)),
        })
        .collect();
    if monitor.cancelled() {
        return Err(PolygonizeError::Cancelled);
    }
    let mut segments = Vec::new();
    let mut seen = Seen::default();
    for (own, more) in parts {
        segments.extend(own);
        seen = seen.and(more);
    }
    let mut polylines = joined(&segments);
    let system = System::new(fields.to_vec(), options.bounds.diagonal(), distance);
    let mut statistics = Statistics {
        cells: grid.cells(),
        nan_points: seen.nan,
        cut_by_box: polylines.iter().any(|polyline| !polyline.closed),
        ..Statistics::default()
    };
    let mut singular: Vec<DVec3> = Vec::new();
    for polyline in &mut polylines {
        correct(
            &system,
            options.cell,
            polyline,
            &mut statistics,
            &mut singular,
        );
    }
    statistics.crossings = singular.len();
    statistics.evaluations = seen.points() + system.counts().0 as usize;
    let curves = Curves {
        dimension: 3,
        polylines,
    };
    Ok((Shape::Curves(curves), seen, statistics))
}

/// The segments in some layers of cells, and what was seen of the first field.
fn slab(
    fields: [&dyn Field; 2],
    grid: &Grid,
    first: usize,
    end: usize,
) -> (Vec<[Passage; 2]>, Seen) {
    let counts = [0, 1, 2].map(|axis| grid.coordinates[axis].len());
    let number = |[x, y, z]: [usize; 3]| (z * counts[1] + y) * counts[0] + x;
    let start = number([0, 0, first]);
    let mut values = fields.map(|_| Vec::with_capacity(number([0, 0, end + 1]) - start));
    for z in first..=end {
        for &y in &grid.coordinates[1] {
            let [ys, zs] = [y, grid.coordinates[2][z]].map(|value| vec![value; counts[0]]);
            for (field, values) in fields.iter().zip(&mut values) {
                let mut row = vec![0.0; counts[0]];
                field.values(&[&grid.coordinates[0], &ys, &zs], &mut row);
                values.extend(row);
            }
        }
    }
    let mut segments = Vec::new();
    for z in first..end {
        for y in 0..counts[1] - 1 {
            for x in 0..counts[0] - 1 {
                let corner =
                    |corner: usize| [x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)];
                let at = |name: usize| {
                    let place = number(corner(name)) - start;
                    [values[0][place], values[1][place]]
                };
                if !may_vanish(at) {
                    continue;
                }
                let vertex = |name: usize| Vertex {
                    number: number(corner(name)) as u64,
                    values: at(name),
                    position: DVec3::from_array(std::array::from_fn(|axis| {
                        grid.coordinates[axis][corner(name)[axis]]
                    })),
                };
                for way in WAYS {
                    let second = 1 << way[0];
                    let third = second | 1 << way[1];
                    segments.extend(segment([0, second, third, 7].map(vertex)));
                }
            }
        }
    }
    let own = match end == counts[2] - 1 {
        true => values[0].len(),
        // The last layer of points is the first of the next slab.
        false => number([0, 0, end]) - start,
    };
    (segments, Seen::of_values(&values[0][..own]))
}

/// Whether both fields change their signs among the corners of a cell, and are numbers.
fn may_vanish(at: impl Fn(usize) -> [f64; 2]) -> bool {
    let mut least = [f64::INFINITY; 2];
    let mut greatest = [f64::NEG_INFINITY; 2];
    for corner in 0..8 {
        for (field, value) in at(corner).into_iter().enumerate() {
            if !value.is_finite() {
                return false;
            }
            least[field] = least[field].min(value);
            greatest[field] = greatest[field].max(value);
        }
    }
    (0..2).all(|field| least[field] <= 0.0 && greatest[field] >= 0.0)
}

/// A corner of a tetrahedron. Along the ways through a cell numbers ascend.
#[derive(Clone, Copy)]
struct Vertex {
    number: u64,
    values: [f64; 2],
    position: DVec3,
}

/// The segment in a tetrahedron.
fn segment(vertices: [Vertex; 4]) -> Option<[Passage; 2]> {
    let passages = FACES.map(|face| passage(face.map(|corner| vertices[corner])));
    let mut found = passages.into_iter().flatten();
    Some([found.next()?, found.next()?])
}

/// Where both interpolants vanish on a face.
fn passage(face: [Vertex; 3]) -> Option<Passage> {
    let [a, b, c] = face;
    let turns = [[a, b], [b, c], [a, c]].map(|[from, to]| turn(from.values, to.values));
    // Round the origin in one sense: a to b, b to c, c to a.
    if turns[0] != turns[1] || turns[0] == turns[2] || turns[0] == 0.0 {
        return None;
    }
    let determinant = |from: Vertex, to: Vertex| {
        (from.values[0] * to.values[1] - from.values[1] * to.values[0]).abs()
    };
    let weights = [determinant(b, c), determinant(c, a), determinant(a, b)];
    let sum: f64 = weights.iter().sum();
    let point = match sum > 0.0 {
        true => (a.position * weights[0] + b.position * weights[1] + c.position * weights[2]) / sum,
        false => (a.position + b.position + c.position) / 3.0,
    };
    Some(Passage {
        face: face.map(|vertex| vertex.number),
        point,
    })
}

/// The sense in which the way from one pair of values to another turns round the origin, shifted by
/// (ε, ε²) for an ε that is smaller than any number: 1 or -1, 0 if the pairs are the same.
fn turn(from: [f64; 2], to: [f64; 2]) -> f64 {
    // The sign of a difference of products is exact with their errors added (W. Kahan).
    let product = from[1] * to[0];
    let error = (-from[1]).mul_add(to[0], product);
    let determinant = from[0].mul_add(to[1], -product) + error;
    let decisive = [determinant, from[1] - to[1], to[0] - from[0]];
    let decisive = decisive.into_iter().find(|&number| number != 0.0);
    decisive.map_or(0.0, f64::signum)
}

/// Segments that share faces as polylines, in the order of their least faces.
fn joined(segments: &[[Passage; 2]]) -> Vec<Polyline> {
    // Each end of a segment, by face: two of a face belong together.
    let mut ends: Vec<([u64; 3], usize)> = (segments.iter().enumerate())
        .flat_map(|(number, segment)| [0, 1].map(|end| (segment[end].face, 2 * number + end)))
        .collect();
    ends.par_sort_unstable();
    let mut partners = vec![None; 2 * segments.len()];
    let mut open = Vec::new();
    for group in ends.chunk_by(|first, second| first.0 == second.0) {
        match group {
            [(_, first), (_, second)] => {
                partners[*first] = Some(*second);
                partners[*second] = Some(*first);
            }
            others => open.extend(others.iter().map(|other| other.1)),
        }
    }
    let mut done = vec![false; segments.len()];
    let mut polylines = Vec::new();
    let all = ends.iter().map(|end| end.1);
    // Open curves begin at their ends, closed ones anywhere.
    for begin in open.into_iter().chain(all) {
        if done[begin / 2] {
            continue;
        }
        let passage = |end: usize| segments[end / 2][end % 2].point;
        let mut points = vec![passage(begin)];
        let mut at = begin;
        let closed = loop {
            done[at / 2] = true;
            points.push(passage(at ^ 1));
            match partners[at ^ 1] {
                Some(next) if next == begin => break true,
                Some(next) if !done[next / 2] => at = next,
                _ => break false,
            }
        };
        if closed {
            points.pop();
        }
        points.dedup();
        polylines.push(Polyline { points, closed });
    }
    polylines
}

/// Puts the vertices on the curve, those that come to it within a cell, and notes where the surfaces
/// are nearly tangent to each other, once for all vertices within some cells.
fn correct(
    system: &System,
    cell: f64,
    polyline: &mut Polyline,
    statistics: &mut Statistics,
    singular: &mut Vec<DVec3>,
) {
    for point in &mut polyline.points {
        match system.solve(*point, Condition::Nearest, cell) {
            Some(found) if found.position.distance(*point) <= cell => {
                *point = found.position;
                statistics.good_roots += 1;
                let residual = found.local.residual();
                statistics.max_residual = statistics.max_residual.max(residual);
                let is_singular = found.local.direction().length() < SINGULAR;
                let is_known = || singular.iter().any(|at| at.distance(*point) <= ONE * cell);
                if is_singular && !is_known() {
                    singular.push(*point);
                }
            }
            _ => statistics.poor_roots += 1,
        }
    }
}
