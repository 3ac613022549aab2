//! The polygons of an adapted triangulation (section 7 of the paper): in R2 one segment a triangle, in
//! R3 one or two triangles a tetrahedron, with their corners at the roots on its sides.

use glam::DVec3;
use rayon::prelude::*;

use super::super::edge_roots::{self, Root, Segment};
use super::super::simplices::{ONE_FIRST, TWO_FIRST};
use super::super::{Job, PolygonizeError, Shape, Statistics, project, squares};
use super::complex::{Complex, NONE, PAIRS};
use crate::geometry::{Curves, Mesh, RefineError};

/// How many roots are solved in one piece of parallel work.
const CHUNK: usize = 4096;

/// How often triangles are made better.
const ITERATIONS: usize = 8;

/// The polygons; with `improve`, triangles are made better afterwards.
pub(super) fn cut(
    job: &Job,
    complex: &Complex,
    improve: bool,
) -> Result<(Shape, Statistics), PolygonizeError> {
    let (vertices, segments) = crossed(job, complex);
    let solved: Vec<(Vec<Root>, usize)> = segments
        .par_chunks(CHUNK)
        .map(|part| edge_roots::solve(&mut { job.field }, job.accuracy, part, job.monitor))
        .collect();
    if job.monitor.cancelled() {
        return Err(PolygonizeError::Cancelled);
    }
    let evaluations = solved.iter().map(|(_, count)| count).sum();
    let roots: Vec<Root> = solved.into_iter().flat_map(|(roots, _)| roots).collect();
    let positions: Vec<DVec3> = roots.iter().map(|root| root.position).collect();
    let mut statistics = Statistics {
        evaluations,
        cut_by_box: cut_by_box(complex),
        ..Statistics::of_roots(&roots)
    };
    if complex.dimension == 2 {
        let segments = complex.simplices.iter().zip(&complex.sides);
        let segments: Vec<[usize; 2]> = segments
            .filter_map(|(simplex, sides)| segment(complex, simplex, sides, &vertices))
            .collect();
        let curves = Curves {
            dimension: 2,
            polylines: squares::join(&positions, &segments),
        };
        return Ok((Shape::Curves(curves), statistics));
    }
    let mut triangles = Vec::with_capacity(2 * complex.simplices.len());
    for (simplex, sides) in complex.simplices.iter().zip(&complex.sides) {
        add_triangles(
            complex,
            (simplex, sides),
            (&vertices, &positions),
            &mut triangles,
        );
    }
    let mut mesh = Mesh {
        positions,
        normals: roots.iter().map(|root| root.normal).collect(),
        triangles,
    };
    mesh.collapse_degenerate_edges();
    // Where there are jumps, vertices have no surface to move along.
    if improve && statistics.poor_roots == 0 {
        mesh = better(job, complex, mesh, &mut statistics)?;
    }
    Ok((Shape::Mesh(mesh), statistics))
}

/// For each spring the number of the vertex on it, or [`NONE`], and the segments of the vertices.
fn crossed(job: &Job, complex: &Complex) -> (Vec<u32>, Vec<Segment>) {
    let values: Vec<f64> = complex
        .nodes
        .par_chunks(CHUNK)
        .flat_map_iter(|part| project::values_at(job.field, part).0)
        .collect();
    let mut vertices = vec![NONE; complex.springs.len()];
    let mut segments = Vec::new();
    for (vertex, ends) in vertices.iter_mut().zip(&complex.springs) {
        let [first, second] = ends.map(|end| end as usize);
        if complex.inside[first] == complex.inside[second] {
            continue;
        }
        let (inside, outside) = match complex.inside[first] {
            true => (first, second),
            false => (second, first),
        };
        *vertex = segments.len() as u32;
        segments.push(Segment {
            inside: complex.nodes[inside],
            outside: complex.nodes[outside],
            inside_value: values[inside] - job.options.iso,
            outside_value: values[outside] - job.options.iso,
        });
    }
    (vertices, segments)
}

/// Whether a crossed spring lies in a side of the box: its nodes may not leave it.
fn cut_by_box(complex: &Complex) -> bool {
    complex.springs.iter().any(|&[first, second]| {
        let (first, second) = (first as usize, second as usize);
        let [one, other] = [first, second].map(|node| complex.freedom[node]);
        let (here, there) = (complex.nodes[first], complex.nodes[second]);
        complex.inside[first] != complex.inside[second]
            && (0..complex.dimension)
                .any(|axis| one[axis] == 0.0 && other[axis] == 0.0 && here[axis] == there[axis])
    })
}

/// The segment in a triangle, with the inside on its left.
fn segment(
    complex: &Complex,
    simplex: &[u32; 4],
    sides: &[u32; 6],
    vertices: &[u32],
) -> Option<[usize; 2]> {
    let is_inside = |corner: usize| complex.inside[simplex[corner % 3] as usize];
    // The corner that is alone, and the vertices on the sides that leave and reach it.
    let alone = (0..3).find(|&corner| {
        is_inside(corner) != is_inside(corner + 1) && is_inside(corner) != is_inside(corner + 2)
    })?;
    let leaves = vertices[sides[alone] as usize] as usize;
    let reaches = vertices[sides[(alone + 2) % 3] as usize] as usize;
    Some(match is_inside(alone) {
        true => [leaves, reaches],
        false => [reaches, leaves],
    })
}

/// Adds the triangles in a tetrahedron; of the two diagonals of a quadrilateral the one is taken with
/// which the worse triangle is the better.
fn add_triangles(
    complex: &Complex,
    (simplex, sides): (&[u32; 4], &[u32; 6]),
    (vertices, positions): (&[u32], &[DVec3]),
    triangles: &mut Vec<[u32; 3]>,
) {
    let flag = |corner: usize| u8::from(complex.inside[simplex[corner] as usize]) << corner;
    let inside: u8 = (0..4).map(flag).sum();
    let vertex = |order: [usize; 4], (from, to): (usize, usize)| {
        let (from, to) = (order[from], order[to]);
        let is_side = |pair: &[usize; 2]| *pair == [from, to] || *pair == [to, from];
        let side = PAIRS.iter().position(is_side).unwrap_or(0);
        vertices[sides[side] as usize]
    };
    match inside.count_ones() {
        1 => {
            let order = ONE_FIRST[inside.trailing_zeros() as usize];
            triangles.push([(0, 1), (0, 2), (0, 3)].map(|side| vertex(order, side)));
        }
        3 => {
            let order = ONE_FIRST[(!inside & 15).trailing_zeros() as usize];
            triangles.push([(1, 0), (3, 0), (2, 0)].map(|side| vertex(order, side)));
        }
        2 => {
            let first = |order: &&[usize; 4]| 1 << order[0] | 1 << order[1] == inside;
            let Some(&order) = TWO_FIRST.iter().find(first) else {
                return;
            };
            let [a, b, c, d] = [(0, 2), (0, 3), (1, 3), (1, 2)].map(|side| vertex(order, side));
            let ways = [[[a, b, c], [a, c, d]], [[b, c, d], [b, d, a]]];
            let [one, other] = ways.map(|way| {
                let ratio = |corners: [u32; 3]| shape(corners.map(|at| positions[at as usize]));
                way.map(ratio).into_iter().fold(f64::INFINITY, f64::min)
            });
            triangles.extend(ways[usize::from(other > one)]);
        }
        _ => {}
    }
}

/// Area by the sum of the squares of the sides: greatest for the equilateral triangle.
fn shape([a, b, c]: [DVec3; 3]) -> f64 {
    let area = (b - a).cross(c - a).length();
    let squares = (b - a).length_squared() + (c - b).length_squared() + (a - c).length_squared();
    if squares > 0.0 { area / squares } else { 0.0 }
}

/// The mesh with better triangles: edges are flipped, and vertices move along the surface.
fn better(
    job: &Job,
    complex: &Complex,
    mesh: Mesh,
    statistics: &mut Statistics,
) -> Result<Mesh, PolygonizeError> {
    let reach = complex.spacing;
    let mut evaluations = 0;
    let found = mesh.relaxed(ITERATIONS, &mut |points, normals| {
        evaluations += points.len();
        project::project(job.field, job.options.iso, reach, points, normals);
        !job.monitor.cancelled()
    });
    statistics.evaluations += evaluations;
    match found {
        Ok(mut found) => {
            // Vertices that stopped half of the way, lest a facet turned over, are not on the surface.
            project::project(
                job.field,
                job.options.iso,
                reach,
                &mut found.positions,
                &mut found.normals,
            );
            let residuals = super::motion::distances(job, &found.positions);
            statistics.evaluations += 2 * residuals.len();
            let residuals = residuals.into_iter().map(|(distance, _)| distance.abs());
            statistics.max_residual = residuals.fold(0.0, f64::max);
            Ok(found)
        }
        Err(RefineError::Cancelled) => Err(PolygonizeError::Cancelled),
        // What cannot be made better stays what it is.
        Err(_) => Ok(mesh),
    }
}
