//! What can be measured on a mesh, and made of it, as functions of the language.

use std::rc::Rc;

use glam::DVec3;
use rayon::iter::ParallelIterator;
use rayon::slice::ParallelSlice;

use super::surfaces::field_argument;
use super::{Arguments, Builtin, action};
use crate::diagnostic::Code;
use crate::engine::{CompiledField, Field, Monitor};
use crate::geometry::{FieldValues, Goal, Mesh, RefineError, Remeshing};
use crate::language::function::At;
use crate::language::product::{MeshSet, ReportSet};
use crate::language::session::Session;
use crate::language::value::{Outcome, Value, failure};
use crate::polygonize;

pub(super) const TABLE: &[Builtin] = &[
    action(
        "quality",
        &["m"],
        "How good the triangles of a mesh are. The radius ratio of a triangle is twice the radius of the inscribed circle by that of the circumscribed one: 1 if it is equilateral, 0 without area. It tells the `worst_ratio`, the `hundredth_ratio` (one triangle in a hundred is worse), `median_ratio` and `mean_ratio`; in degrees the `smallest_angle`, `median_smallest_angle` and `largest_angle`; `sharp`, the share of triangles with an angle below 20°; `degenerate`, how many have no area; `shortest_edge` and `longest_edge`; and `self_intersections`, how many triangles intersect another one beyond a shared side or corner, decided exactly.",
        quality,
    ),
    action(
        "deviation",
        &["m", "f", "iso = 0"],
        "How far a mesh is from the level set f = iso, to first order: the greatest and the root mean square |f - iso|/|grad f| at the vertices (`vertex_max`, `vertex_rms`) and at the centres of the facets (`facet_max`, `facet_rms`); the greatest and the mean angle between a facet and the level sets at its centre, in degrees (`normal_max`, `normal_mean`); `turned`, how many facets face inwards; `undefined`, at how many of these points f has no such distance; and `capped`, how many facets were left out because they close the mesh along its box.",
        deviation,
    ),
    action(
        "simplify",
        &["m", "count =", "error ="],
        "A mesh with fewer triangles for nearly the same surface: not fewer than `count`, or only as long as the root mean square distance of a new vertex from the facets that it stands for is at most `error`, or both. Components, handles, boundaries, sharp edges and corners remain, no facet is turned over.",
        simplify,
    ),
    action(
        "remesh",
        &["m", "f", "length =", "iso = 0", "iterations = 10"],
        "A mesh of the level set f = iso with triangles of one size that are nearly equilateral, made from a mesh of it: long edges are split, short ones collapsed, others flipped, and vertices are spread evenly and put onto the level set by Newton's method. `length` is that of an edge, by default the mean of the mesh. Components, handles, boundaries, sharp edges and corners remain, no facet is turned over.",
        remesh,
    ),
];

/// The mesh that an argument is.
fn mesh_argument(arguments: &Arguments) -> Outcome<Rc<MeshSet>> {
    match arguments.value("m") {
        Value::Mesh(set) => Ok(set),
        other => Err(arguments.expected("a mesh", "m", &other)),
    }
}

/// The mesh and the field that belongs to it.
fn mesh_and_field(
    session: &mut Session,
    arguments: &Arguments,
) -> Outcome<(Rc<MeshSet>, CompiledField)> {
    let set = mesh_argument(arguments)?;
    let field = field_argument(session, arguments, Some(3))?;
    if field.dimension() != 3 {
        let message = format!(
            "a mesh lies in R3, but this field in R{}",
            field.dimension()
        );
        return Err(failure(Code::WrongDimension, message).at(arguments.place("f"), "this field"));
    }
    let compiled = field
        .compiled(&mut session.graph, session.parameters.values())
        .at(arguments.place("f"), "this field")?;
    Ok((set, compiled))
}

fn quality(_: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let set = mesh_argument(arguments)?;
    let report = ReportSet::of_quality(&set.mesh);
    Ok(Value::Report(Rc::new(report)))
}

fn deviation(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let (set, field) = mesh_and_field(session, arguments)?;
    let iso = arguments.number(session, "iso")?.unwrap_or(0.0);
    let capped_by = set.statistics.and_then(|told| told.capped_by);
    let parts = capped_by.map(|bounds| set.mesh.without_sides(&bounds));
    let (mesh, capped) = match &parts {
        Some((mesh, capped)) => (mesh, *capped),
        None => (&set.mesh, 0),
    };
    let at_vertices = values_at(&field, iso, &mesh.positions);
    let at_centers = values_at(&field, iso, &mesh.facet_centers());
    Ok(Value::Report(Rc::new(ReportSet {
        deviation: Some(mesh.deviation(&at_vertices, &at_centers)),
        capped: Some(capped),
        ..ReportSet::default()
    })))
}

/// f − iso and its gradient at points, in parallel batches.
fn values_at(field: &dyn Field, iso: f64, points: &[DVec3]) -> FieldValues {
    const BATCH: usize = 2048;
    let batches = points.par_chunks(BATCH);
    let parts: Vec<(Vec<f64>, Vec<DVec3>)> = batches
        .map(|batch| polygonize::values_at(field, batch))
        .collect();
    let mut all = FieldValues::default();
    for (values, gradients) in parts {
        all.values
            .extend(values.into_iter().map(|value| value - iso));
        all.gradients.extend(gradients);
    }
    all
}

fn simplify(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let set = mesh_argument(arguments)?;
    let count = arguments.count(session, "count")?;
    let error = arguments.positive(session, "error")?;
    if count.is_none() && error.is_none() {
        let message = "`simplify` needs `count` or `error`, or it would not know when to end";
        return Err(failure(Code::MissingArgument, message).at(arguments.span, "not given here"));
    }
    let goal = Goal {
        triangles: count.map_or(0, |count| usize::try_from(count).unwrap_or(usize::MAX)),
        error: error.unwrap_or(f64::INFINITY),
    };
    let simplified = set.mesh.simplified(goal);
    let simplified = simplified.map_err(|error| refused(error, arguments))?;
    Ok(made("simplify", simplified.mesh))
}

fn remesh(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let (set, field) = mesh_and_field(session, arguments)?;
    let iso = arguments.number(session, "iso")?.unwrap_or(0.0);
    let length = arguments.positive(session, "length")?;
    let length = length.unwrap_or_else(|| set.mesh.mean_edge_length());
    let iterations = arguments.count(session, "iterations")?.unwrap_or(10);
    let remeshing = Remeshing {
        length,
        iterations: usize::try_from(iterations).unwrap_or(usize::MAX),
    };
    let monitor = session.monitor();
    // An edge's length away the surface may be another sheet.
    let mut project = |points: &mut [DVec3], normals: &mut [DVec3]| {
        polygonize::project(&field, iso, length, points, normals);
        !monitor.cancelled()
    };
    let remeshed = set.mesh.remeshed(remeshing, &mut project);
    let remeshed = remeshed.map_err(|error| refused(error, arguments))?;
    Ok(made("remesh", remeshed))
}

/// A mesh that was made from another one.
fn made(method: &'static str, mesh: Mesh) -> Value {
    Value::Mesh(Rc::new(MeshSet::new(mesh, method, None)))
}

fn refused(error: RefineError, arguments: &Arguments) -> Box<crate::diagnostic::Diagnostic> {
    let name = match error {
        RefineError::Cancelled => {
            return failure(Code::Cancelled, error.to_string()).at(arguments.span, "here");
        }
        RefineError::TooManyTriangles => "length",
        RefineError::NotManifold | RefineError::NotFinite => "m",
    };
    let mut refused = arguments.bad(name, error.to_string());
    refused.help = Some(
        match error {
            RefineError::NotManifold => {
                "its `nonmanifold_edges`, `nonmanifold_vertices` and `oriented` tell what is wrong"
            }
            RefineError::NotFinite => "its `points` tell which",
            RefineError::TooManyTriangles | RefineError::Cancelled => "use a greater length",
        }
        .to_owned(),
    );
    refused
}
