//! What `quality` and `deviation` tell of a mesh.

use std::rc::Rc;

use glam::DVec3;

use super::{MeshSet, Property, count, hidden, number, shown};
use crate::geometry::{Deviation, Mesh, Quality};
use crate::language::value::Value;
use crate::polygonize::{Statistics, Subordination};

/// What was measured on a mesh; what was not asked for is absent.
#[derive(Debug, Default)]
pub struct ReportSet {
    /// The shape of its triangles, unless there are none.
    pub quality: Option<Quality>,
    /// How many triangles intersect others.
    pub self_intersections: Option<usize>,
    /// How far it is from a field's surface.
    pub deviation: Option<Deviation>,
    /// How many facets were left out of that, because they close the mesh along its box.
    pub capped: Option<usize>,
    /// What was written brick by brick.
    pub bricks: Option<BrickTotals>,
    /// How the springs of an adapted triangulation came out.
    pub adaptation: Option<Subordination>,
}

/// What bricks amount to.
#[derive(Debug, Default)]
pub struct BrickTotals {
    /// Those that have surface, each in a file.
    pub files: usize,
    /// All of them.
    pub bricks: usize,
    vertices: usize,
    triangles: usize,
    area: f64,
    volume: f64,
    largest_bytes: usize,
    /// Whether the whole is closed, so that it has a volume.
    pub closed: bool,
    /// See [`polygonize::Statistics`](crate::polygonize::Statistics).
    pub max_residual: f64,
    /// The same.
    pub evaluations: usize,
}

impl BrickTotals {
    /// Adds the mesh of a brick; volumes of all bricks are measured from the same point.
    pub fn add(&mut self, mesh: &Mesh, apex: DVec3) {
        let Mesh {
            positions,
            normals,
            triangles,
        } = mesh;
        self.vertices += positions.len();
        self.triangles += triangles.len();
        self.area += mesh.area();
        self.volume += mesh.volume_from(apex);
        let bytes =
            size_of_val(&positions[..]) + size_of_val(&normals[..]) + size_of_val(&triangles[..]);
        self.largest_bytes = self.largest_bytes.max(bytes);
    }
}

impl ReportSet {
    /// The shape of the triangles of a mesh, and how many of them intersect others.
    pub fn of_quality(mesh: &Mesh) -> ReportSet {
        ReportSet {
            quality: mesh.quality(),
            self_intersections: Some(mesh.self_intersecting_triangles()),
            ..ReportSet::default()
        }
    }
}

fn of_quality(set: &ReportSet, part: fn(&Quality) -> f64) -> Option<Value> {
    number(part(set.quality.as_ref()?))
}

fn of_deviation(set: &ReportSet, part: fn(&Deviation) -> f64) -> Option<Value> {
    number(part(set.deviation.as_ref()?))
}

fn of_springs(set: &ReportSet, part: fn(&Subordination) -> f64) -> Option<Value> {
    number(part(set.adaptation.as_ref()?))
}

fn of_triangles(set: &ReportSet, which: usize, part: fn(&Quality) -> f64) -> Option<Value> {
    number(part(
        set.adaptation.as_ref()?.polygons[which].quality.as_ref()?,
    ))
}

/// What springs tell of a mesh or of curves.
pub(super) fn adaptation(statistics: Option<&Statistics>) -> Option<Value> {
    Some(Value::Report(Rc::new(ReportSet {
        adaptation: Some(statistics?.subordination?),
        ..ReportSet::default()
    })))
}

fn of_bricks(set: &ReportSet, part: fn(&BrickTotals) -> f64) -> Option<Value> {
    number(part(set.bricks.as_ref()?))
}

pub(super) const REPORT: &[Property<ReportSet>] = &[
    shown("simplices", |set| of_springs(set, |s| s.simplices as f64)),
    shown("steps", |set| of_springs(set, |s| s.steps as f64)),
    shown("at_rest", |set| {
        Some(Value::Bool(set.adaptation.as_ref()?.at_rest))
    }),
    shown("energy_before", |set| of_springs(set, |s| s.energy[0])),
    shown("energy_after", |set| of_springs(set, |s| s.energy[1])),
    shown("transversal_before", |set| {
        of_springs(set, |s| s.before.transversal)
    }),
    shown("transversal_after", |set| {
        of_springs(set, |s| s.after.transversal)
    }),
    shown("regular_before", |set| {
        of_springs(set, |s| s.before.regular)
    }),
    shown("regular_after", |set| of_springs(set, |s| s.after.regular)),
    shown("parallel_before", |set| {
        of_springs(set, |s| s.before.parallel)
    }),
    shown("parallel_after", |set| {
        of_springs(set, |s| s.after.parallel)
    }),
    shown("simplex_ratio_before", |set| {
        of_springs(set, |s| s.before.mean_ratio)
    }),
    shown("simplex_ratio_after", |set| {
        of_springs(set, |s| s.after.mean_ratio)
    }),
    shown("triangle_ratio_before", |set| {
        of_triangles(set, 0, |q| q.mean_ratio)
    }),
    shown("triangle_ratio_after", |set| {
        of_triangles(set, 1, |q| q.mean_ratio)
    }),
    shown("hundredth_ratio_before", |set| {
        of_triangles(set, 0, |q| q.hundredth_ratio)
    }),
    shown("hundredth_ratio_after", |set| {
        of_triangles(set, 1, |q| q.hundredth_ratio)
    }),
    shown("smallest_angle_before", |set| {
        of_triangles(set, 0, |q| q.smallest_angle)
    }),
    shown("smallest_angle_after", |set| {
        of_triangles(set, 1, |q| q.smallest_angle)
    }),
    shown("side_ratio_before", |set| {
        of_springs(set, |s| s.polygons[0].shortest / s.polygons[0].longest)
    }),
    shown("side_ratio_after", |set| {
        of_springs(set, |s| s.polygons[1].shortest / s.polygons[1].longest)
    }),
    shown("files", |set| of_bricks(set, |b| b.files as f64)),
    shown("bricks", |set| of_bricks(set, |b| b.bricks as f64)),
    shown("vertices", |set| of_bricks(set, |b| b.vertices as f64)),
    shown("triangles", |set| of_bricks(set, |b| b.triangles as f64)),
    shown("area", |set| of_bricks(set, |b| b.area)),
    shown("volume", |set| {
        number(set.bricks.as_ref().filter(|bricks| bricks.closed)?.volume)
    }),
    shown("largest_bytes", |set| {
        of_bricks(set, |b| b.largest_bytes as f64)
    }),
    shown("max_residual", |set| of_bricks(set, |b| b.max_residual)),
    shown("evaluations", |set| {
        of_bricks(set, |b| b.evaluations as f64)
    }),
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
