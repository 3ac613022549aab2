//! What `quality` and `deviation` tell of a mesh.

use super::{MeshSet, Property, count, hidden, number, shown};
use crate::geometry::{Deviation, Mesh, Quality};
use crate::language::value::Value;

/// What was measured on a mesh; what was not asked for is absent.
#[derive(Debug)]
pub struct ReportSet {
    /// The shape of its triangles, unless there are none.
    pub quality: Option<Quality>,
    /// How many triangles intersect others.
    pub self_intersections: Option<usize>,
    /// How far it is from a field's surface.
    pub deviation: Option<Deviation>,
    /// How many facets were left out of that, because they close the mesh along its box.
    pub capped: Option<usize>,
}

impl ReportSet {
    /// The shape of the triangles of a mesh, and how many of them intersect others.
    pub fn of_quality(mesh: &Mesh) -> ReportSet {
        ReportSet {
            quality: mesh.quality(),
            self_intersections: Some(mesh.self_intersecting_triangles()),
            deviation: None,
            capped: None,
        }
    }
}

fn of_quality(set: &ReportSet, part: fn(&Quality) -> f64) -> Option<Value> {
    number(part(set.quality.as_ref()?))
}

fn of_deviation(set: &ReportSet, part: fn(&Deviation) -> f64) -> Option<Value> {
    number(part(set.deviation.as_ref()?))
}

pub(super) const REPORT: &[Property<ReportSet>] = &[
    shown("worst_ratio", |set| of_quality(set, |q| q.worst_ratio)),
    shown("hundredth_ratio", |set| {
        of_quality(set, |q| q.hundredth_ratio)
    }),
    shown("median_ratio", |set| of_quality(set, |q| q.median_ratio)),
    shown("mean_ratio", |set| of_quality(set, |q| q.mean_ratio)),
    shown("smallest_angle", |set| {
        of_quality(set, |q| q.smallest_angle)
    }),
    shown("median_smallest_angle", |set| {
        of_quality(set, |q| q.median_smallest_angle)
    }),
    shown("largest_angle", |set| of_quality(set, |q| q.largest_angle)),
    shown("sharp", |set| of_quality(set, |q| q.sharp)),
    shown("degenerate", |set| of_quality(set, |q| q.degenerate as f64)),
    shown("shortest_edge", |set| of_quality(set, |q| q.shortest_edge)),
    shown("longest_edge", |set| of_quality(set, |q| q.longest_edge)),
    shown("self_intersections", |set| count(set.self_intersections?)),
    shown("vertex_max", |set| of_deviation(set, |d| d.vertices.max)),
    shown("vertex_rms", |set| of_deviation(set, |d| d.vertices.rms)),
    shown("facet_max", |set| of_deviation(set, |d| d.facets.max)),
    shown("facet_rms", |set| of_deviation(set, |d| d.facets.rms)),
    shown("normal_max", |set| {
        of_deviation(set, |d| d.largest_normal_deviation)
    }),
    shown("normal_mean", |set| {
        of_deviation(set, |d| d.mean_normal_deviation)
    }),
    shown("turned", |set| of_deviation(set, |d| d.turned as f64)),
    shown("undefined", |set| {
        of_deviation(set, |d| (d.vertices.undefined + d.facets.undefined) as f64)
    }),
    shown("capped", |set| count(set.capped?)),
];

/// Properties of a mesh that tell more of it than summaries do.
pub(super) const MORE_OF_MESH: &[Property<MeshSet>] = &[
    hidden("boundary_loops", |set| count(set.topology().boundary_loops)),
    hidden("nonmanifold_edges", |set| {
        count(set.topology().nonmanifold_edges)
    }),
    hidden("nonmanifold_vertices", |set| {
        count(set.topology().nonmanifold_vertices)
    }),
    hidden("oriented", |set| Some(Value::Bool(set.topology().oriented))),
    hidden("centroid", |set| {
        let centroid = set.mesh.centroid()?;
        Some(Value::numbers(centroid.to_array()))
    }),
];
