//! Polygonizers and measures as functions of the language.

mod bricks;
mod warnings;

use std::rc::Rc;

use glam::DVec3;

use self::warnings::{
    warn_about_components, warn_about_mesh, warn_about_proof, warn_about_roots,
    warn_about_vertices, warn_not_proven,
};
use super::extent::found_bounds;
use super::samples::{common_box, no_common_zero, points_of, sample_failure};
use super::{Arguments, Builtin, action, methods, pure};
use crate::diagnostic::suggest::nearest;
use crate::diagnostic::{Code, Diagnostic};
use crate::engine::{CompiledField, Monitor};
use crate::geometry::Bounds;
use crate::language::field::{FieldValue, bounds_of};
use crate::language::function::At;
use crate::language::product::{self, CurveSet, MeshSet};
use crate::language::session::Session;
use crate::language::value::{Outcome, Value, failure};
use crate::polygonize::{self, Ambiguity, Method, PolygonizeError, Polygonized, Shape, Split};

pub(super) const TABLE: &[Builtin] = &[
    action(
        "polygonize",
        &[
            "f",
            "method =",
            "cell =",
            "resolution = 64",
            "bounds =",
            "iso = 0",
            "cap =",
            "tolerance = 1e-9",
            "ambiguity = \"saddle\"",
            "split = 6",
            "error =",
            "seeds =",
            "snap = false",
            "samples =",
        ],
        "The level set f = iso in a box: a mesh in R3, curves in R2, the list of roots in R1. Methods in R3: `\"dual\"` (the usual one: sharp edges and corners are kept); `\"cubes\"` (marching cubes with the topology of the trilinear function; with `snap = true` vertices near grid points are merged where that does not change the topology, which makes better triangles); `\"extended\"` (marching cubes with further vertices on sharp edges and at corners; where the surface is smooth it is the mesh of `\"cubes\"`, with its thin triangles, and where edges are closer together than about two cells, or strongly curved, some are cut off and facets may be turned, which `\"dual\"` avoids better); `\"tetrahedra\"`, which cuts cells into `split` = 5, 6, 12 or 24 of them, or `\"bcc\"`, those of the body-centred lattice; `\"octree\"`, the same with larger cells where the surface is flat to `error`, a length (by default `cell` / 64); `\"springs\"`, an adapted triangulation that springs fit to the surface (also in R2; the surface is left open where the box cuts it; `adaptation` of the result tells what became of the triangulation); `\"continuation\"`, marching cubes in those cells only that the surface leads to from `seeds`, points near it, or without seeds from wherever the box is not proven to be empty; `\"certified\"` (also in R2: it takes no resolution, but divides cells until intervals prove that the mesh has the topology of the surface; `proven` says whether that came about, a warning says where it did not, and why; `export(m, \"m.certificate\")` writes the proof, which `imp verify` checks); `\"delaunay\"` (the restricted Delaunay triangulation of `samples`, points on the surface, or of floaters with the distance `cell`: the points become the vertices, the surface is left open where the box cuts it, and where the samples are too sparse for a manifold vertices are added). A field with two components in R3 gives the curve on which both vanish, by `\"continuation\"` (the usual method) or `\"tetrahedra\"`. In R2: `\"squares\"` (the usual one), `\"quadtree\"` (cells become smaller until segments are about as near to the curve as `error`, by default `cell` / 100) and `\"continuation\"` (`cell` is the step). In R1: `\"newton\"` (the usual one, which proves that none is missed) and `\"bracketing\"`. The box is `bounds`, or what `over` says, or one that provably holds the whole zero set (see `bounds`); `cell` is the side of a grid cell, by default the longest side of the box divided by `resolution`. Where the box cuts the level set, a surface is closed along the box unless `cap = false`; curves are left open unless `cap = true`. `ambiguity` is the rule for marching squares where opposite corners are inside: `\"saddle\"` (of the bilinear interpolant), `\"join\"`, `\"separate\"` or `\"subdivide\"` (the field itself decides).",
        polygonize,
    ),
    action(
        "export_bricks",
        &[
            "f",
            "path",
            "bricks = 256",
            "method = \"cubes\"",
            "cell =",
            "resolution = 64",
            "bounds =",
            "iso = 0",
            "cap =",
            "tolerance = 1e-9",
        ],
        "Writes the mesh that `polygonize(f, method = \"cubes\")` gives brick by brick, for grids whose mesh is larger than memory. A brick has `bricks` cells along each side, and a file of its own, `name-0-0-0.ply` and so on by its place along x, y and z; bricks without surface have none. Vertices on faces that bricks share are the same in both, to the last bit, so that the union of the files is the whole mesh; only the sides of the box are capped. Each file is written whole before the next brick is begun; where the work is stopped, those that are there remain. Gives a report: `files`, how many of the `bricks` have surface; `vertices` (those on shared faces count for each brick), `triangles`, `area` and `volume` of all; `largest_bytes`, the memory that the largest brick's mesh takes; `max_residual` and `evaluations`.",
        bricks::export_bricks,
    ),
    action(
        "roots",
        &["f", "bounds ="],
        "The roots of a field or function of one variable in an interval, `roots(f, lo..hi)`, ascending; the same as `polygonize` gives, or an empty list. Each is proven to be the only one in its surroundings, or a warning names the place.",
        roots,
    ),
    measure(
        "area",
        "The area of a mesh, or that enclosed by closed plane curves.",
    ),
    measure("volume", "The volume enclosed by a watertight mesh."),
    measure("genus", "The number of handles of a manifold mesh."),
    measure(
        "components",
        "The number of connected pieces of a mesh or curve set.",
    ),
    measure(
        "centroid",
        "The centroid of a mesh's surface: the mean of its points, by area.",
    ),
];

/// A measure is a property under its own name.
const fn measure(name: &'static str, documentation: &'static str) -> Builtin {
    pure(name, &["of"], documentation, |_, arguments| {
        let value = arguments.value("of");
        let name = arguments.function();
        product::property(&value, name).ok_or_else(|| {
            failure(
                Code::UnknownProperty,
                format!("`{name}` cannot be given for this {}", bare(value.kind())),
            )
            .at(arguments.place("of"), value.kind())
        })
    })
}

fn bare(kind: &str) -> &str {
    kind.trim_start_matches("a ").trim_start_matches("an ")
}

/// The field that an argument stands for: a field, or a function of a point or of coordinates.
pub(super) fn field_argument(
    session: &mut Session,
    arguments: &Arguments,
    dimension_hint: Option<usize>,
) -> Outcome<FieldValue> {
    match arguments.value("f") {
        Value::Field(field) => Ok(field),
        Value::Function(function) => {
            let parameters = function.parameter_count();
            let (dimension, as_point) = match (parameters, dimension_hint) {
                (2 | 3, _) => (parameters, false),
                (_, Some(1)) => (1, false),
                (_, Some(dimension)) => (dimension, true),
                (_, None) => {
                    let mut error = arguments.bad(
                        "f",
                        "a function of one argument does not tell in how many dimensions it lives"
                            .into(),
                    );
                    error.help = Some(
                        "give one interval for each axis, as in `bounds = [-1..1, -1..1]`, or \
                         write a `field`"
                            .into(),
                    );
                    return Err(error);
                }
            };
            session.function_as_field(&function, dimension, as_point, arguments.place("f"))
        }
        other => Err(arguments.expected("a field", "f", &other)),
    }
}

/// The field, compiled, and the box that was asked for.
pub(super) fn compiled_argument(
    session: &mut Session,
    arguments: &Arguments,
) -> Outcome<(CompiledField, Option<Bounds>)> {
    let (field, bounds) = located_argument(session, arguments)?;
    let compiled = field
        .compiled(&mut session.graph, session.parameters.values())
        .at(arguments.place("f"), "this field")?;
    Ok((compiled, bounds))
}

/// The field and the box that was asked for.
pub(super) fn located_argument(
    session: &mut Session,
    arguments: &Arguments,
) -> Outcome<(FieldValue, Option<Bounds>)> {
    let given = arguments.plain(session, "bounds")?;
    let sides = match &given {
        Some(Value::List(sides)) => Some(sides.len()),
        _ => None,
    };
    let field = field_argument(session, arguments, sides)?;
    let bounds = match given {
        Some(value) => {
            Some(bounds_of(&value, field.dimension()).at(arguments.place("bounds"), "the bounds")?)
        }
        None => field.domain(),
    };
    Ok((field, bounds))
}

/// The box that was given or, without one, a box that provably holds the whole level set.
pub(super) fn box_of(
    field: &CompiledField,
    iso: f64,
    given: Option<Bounds>,
    arguments: &Arguments,
    monitor: &dyn Monitor,
) -> Outcome<Bounds> {
    match given {
        Some(bounds) => Ok(bounds),
        None => found_bounds(field, iso, arguments, monitor),
    }
}

fn polygonize(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let method = method_argument(arguments)?;
    let (field, bounds) = located_argument(session, arguments)?;
    let mut fields = field
        .surfaces(&mut session.graph, session.parameters.values())
        .at(arguments.place("f"), "this field")?;
    if let [_, _] = fields[..] {
        return space_curve(session, arguments, (&fields, bounds), method);
    }
    let Some(field) = fields.pop() else {
        return Err(arguments.expected("a field", "f", &Value::Field(field)));
    };
    let used = method.unwrap_or(Method::usual(field.program().dimension()));
    methods::check(arguments, used, methods::POLYGONIZERS, Method::name)?;
    let iso = arguments.number(session, "iso")?.unwrap_or(0.0);
    let samples = samples_argument(session, arguments)?;
    let bounds = bounds.or_else(|| box_around(&samples));
    let bounds = box_of(&field, iso, bounds, arguments, &session.monitor())?;
    let mut options = polygonize::Options::new(bounds);
    options.method = method;
    cell_arguments(session, arguments, &mut options)?;
    if used == Method::Certified {
        refuse_cells(arguments)?;
    }
    options.iso = iso;
    // Triangulations end where the box cuts the surface.
    let can_cap = !matches!(used, Method::Delaunay | Method::Springs);
    options.cap &= can_cap;
    if let Some(cap) = arguments.bool(session, "cap")? {
        if cap && !can_cap {
            let name = used.name();
            let message = format!("\"{name}\" leaves a surface open where the box cuts it");
            return Err(arguments.bad("cap", message));
        }
        options.cap = cap;
    }
    if used == Method::Delaunay {
        options.samples = samples;
    }
    if let Some(snap) = arguments.bool(session, "snap")? {
        options.snap = snap;
    }
    if let Some(error) = arguments.positive(session, "error")? {
        options.error = Some(error);
    }
    if let Some(ambiguity) = ambiguity_argument(arguments)? {
        options.ambiguity = ambiguity;
    }
    if let Some(split) = arguments.plain(session, "split")? {
        options.split = split_of(arguments, &split)?;
    }
    if let Some(seeds) = arguments.plain(session, "seeds")? {
        let points = points_of(&seeds, bounds.dimension).ok_or_else(|| {
            let expected = "points, as in `[[0, 0, 1], [0, 0, -1]]`, or samples";
            arguments.expected(expected, "seeds", &seeds)
        })?;
        if points.is_empty() {
            let message = "there are no seeds; without `seeds` all components are looked for";
            return Err(arguments.bad("seeds", message.to_owned()));
        }
        options.seeds = points;
    }
    options.cell_limit = usize::try_from(session.limits.cells).unwrap_or(usize::MAX);
    let monitor = &session.monitor();
    let found = polygonize::polygonize(&field, &options, monitor)
        .map_err(|error| polygonize_failure(error, arguments))?;
    warn_about_mesh(session, arguments, &found.statistics, &options);
    warn_about_vertices(session, arguments, &found.statistics, &options);
    warn_about_components(session, arguments, &found);
    if let Some(certified) = &found.certified {
        warn_about_proof(session, arguments, (certified, bounds.dimension));
    }
    if let Shape::Roots(roots) = &found.shape {
        warn_about_roots(session, arguments, roots);
        session.isolated = Some(roots.clone());
    }
    Ok(value_of(found))
}

/// Refuses a resolution where the method finds it.
fn refuse_cells(arguments: &Arguments) -> Outcome<()> {
    match ["cell", "resolution"]
        .into_iter()
        .find(|name| arguments.given(name).is_some())
    {
        Some(name) => {
            let message = format!(
                "\"certified\" has no use for `{name}`: its cells are as small as the proof needs them"
            );
            Err(arguments.bad(name, message))
        }
        None => Ok(()),
    }
}

/// The curve on which two fields vanish.
fn space_curve(
    session: &mut Session,
    arguments: &Arguments,
    (fields, bounds): (&[CompiledField], Option<Bounds>),
    method: Option<Method>,
) -> Outcome<Value> {
    const SURFACES_ONLY: [&str; 8] = [
        "iso",
        "cap",
        "ambiguity",
        "split",
        "error",
        "seeds",
        "snap",
        "samples",
    ];
    for name in SURFACES_ONLY {
        if arguments.given(name).is_some() {
            let message = format!("`{name}` has no meaning for a curve in space");
            return Err(arguments.bad(name, message));
        }
    }
    let bounds = match bounds {
        Some(bounds) => bounds,
        None => common_box(fields, arguments, &session.monitor())?,
    };
    let mut options = polygonize::Options::new(bounds);
    options.method = method;
    cell_arguments(session, arguments, &mut options)?;
    options.cell_limit = usize::try_from(session.limits.cells).unwrap_or(usize::MAX);
    let [first, second] = fields else {
        return Err(no_common_zero(arguments));
    };
    let found = polygonize::polygonize_curve([first, second], &options, &session.monitor())
        .map_err(|error| polygonize_failure(error, arguments))?;
    options.cap = false;
    warn_about_mesh(session, arguments, &found.statistics, &options);
    if found.method == Method::Continuation && !found.statistics.proven {
        warn_not_proven(session, arguments, &found.statistics);
    }
    Ok(value_of(found))
}

/// Reads `cell`, `resolution` and `tolerance`.
fn cell_arguments(
    session: &mut Session,
    arguments: &Arguments,
    options: &mut polygonize::Options,
) -> Outcome<()> {
    if let Some(resolution) = arguments.positive(session, "resolution")? {
        options.cell = options.bounds.size().max_element() / resolution;
    }
    if let Some(cell) = arguments.positive(session, "cell")? {
        options.cell = cell;
    }
    if let Some(tolerance) = arguments.positive(session, "tolerance")? {
        options.tolerance = tolerance;
    }
    Ok(())
}

/// The points that "delaunay" is to join; none if they are not given.
fn samples_argument(session: &mut Session, arguments: &Arguments) -> Outcome<Vec<DVec3>> {
    let Some(samples) = arguments.plain(session, "samples")? else {
        return Ok(Vec::new());
    };
    let points = points_of(&samples, 3).filter(|points| !points.is_empty());
    points.ok_or_else(|| {
        let expected = "samples of a surface, or a list of points, as in `[[0, 0, 1], [0, 0, -1]]`";
        arguments.expected(expected, "samples", &samples)
    })
}

/// A box around points, with some room; none where that has no extent.
fn box_around(points: &[DVec3]) -> Option<Bounds> {
    const ROOM: f64 = 0.1;
    let bounds = Bounds::of_points(3, points.iter().copied())?;
    let longest = bounds.size().max_element();
    (longest > 0.0).then(|| bounds.expanded(ROOM * longest))
}

fn roots(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let field = field_argument(session, arguments, Some(1))?;
    if field.dimension() != 1 {
        return Err(arguments.bad("f", "roots are those of a function of one variable".into()));
    }
    let bounds = match arguments.plain(session, "bounds")? {
        Some(value) => Some(bounds_of(&value, 1).at(arguments.place("bounds"), "the interval")?),
        None => field.domain(),
    };
    let compiled = field
        .compiled(&mut session.graph, session.parameters.values())
        .at(arguments.place("f"), "this field")?;
    let bounds = box_of(&compiled, 0.0, bounds, arguments, &session.monitor())?;
    let options = polygonize::Options::new(bounds);
    let found = match polygonize::polygonize(&compiled, &options, &session.monitor()) {
        Err(PolygonizeError::NoSurface { .. }) => return Ok(Value::numbers(Vec::new())),
        found => found.map_err(|error| polygonize_failure(error, arguments))?,
    };
    if let Shape::Roots(roots) = &found.shape {
        warn_about_roots(session, arguments, roots);
        session.isolated = Some(roots.clone());
    }
    Ok(value_of(found))
}

/// The rule for ambiguous squares, if one is given.
fn ambiguity_argument(arguments: &Arguments) -> Outcome<Option<Ambiguity>> {
    let Some(name) = arguments.text("ambiguity")? else {
        return Ok(None);
    };
    let known = Ambiguity::NAMES.iter().find(|(_, known)| *known == name);
    match known {
        Some((ambiguity, _)) => Ok(Some(*ambiguity)),
        None => {
            let names = Ambiguity::NAMES.iter();
            let names: Vec<String> = names.map(|(_, name)| format!("\"{name}\"")).collect();
            let message = format!("there is no rule `{name}`; there are {}", names.join(", "));
            Err(arguments.bad("ambiguity", message))
        }
    }
}

/// The split of a number or a name.
fn split_of(arguments: &Arguments, value: &Value) -> Outcome<Split> {
    let name = match value {
        Value::Number(number) => number.to_string(),
        Value::Text(name) => name.to_string(),
        other => return Err(arguments.expected("a number or a string", "split", other)),
    };
    Split::named(&name).ok_or_else(|| {
        let message = format!("`split` must be 5, 6, 12, 24 or \"bcc\", but it is {name}");
        arguments.bad("split", message)
    })
}

/// The polygonizer that is asked for, if one is.
fn method_argument(arguments: &Arguments) -> Outcome<Option<Method>> {
    let Some(name) = arguments.text("method")? else {
        return Ok(None);
    };
    match Method::named(&name) {
        Some(method) => Ok(Some(method)),
        None => {
            let names = Method::TABLE.iter().map(|(_, name, _)| *name);
            let quoted: Vec<String> = names.clone().map(|name| format!("\"{name}\"")).collect();
            let quoted = quoted.join(", ");
            let message = format!("there is no polygonizer `{name}`; there are {quoted}");
            let mut failure = arguments.bad("method", message);
            failure.help = nearest(&name, names).map(|near| format!("did you mean \"{near}\"?"));
            Err(failure)
        }
    }
}

/// What scripts see of a level set.
fn value_of(found: Polygonized) -> Value {
    let (method, statistics) = (found.method.name(), found.statistics);
    match found.shape {
        Shape::Roots(roots) => Value::numbers(roots.values()),
        Shape::Curves(curves) => Value::Curves(Rc::new(CurveSet {
            curves,
            method,
            statistics,
            certified: found.certified,
        })),
        Shape::Mesh(mesh) => {
            let mut set = MeshSet::new(mesh, method, Some(statistics));
            set.certified = found.certified;
            Value::Mesh(Rc::new(set))
        }
    }
}

fn polygonize_failure(error: PolygonizeError, arguments: &Arguments) -> Box<Diagnostic> {
    let message = error.to_string();
    match error {
        PolygonizeError::NoSurface {
            below,
            above,
            undefined,
            ..
        } => {
            let mut failure = failure(Code::NoSurface, message).at(arguments.place("f"), "no zero");
            failure.help = Some(
                match (below, above, undefined) {
                    (0, 0, _) => "the field is not a number at any of them",
                    (_, 0, 1..) => {
                        "the field is negative (inside) wherever it is a number: it ends where it \
                     is no longer defined"
                    }
                    (0, _, _) => {
                        "the field is positive (outside) at all of them: enlarge the box, or use \
                         smaller cells for what is thin"
                    }
                    (_, 0, _) => {
                        "the field is negative (inside) at all of them: enlarge the box, or check \
                         the sign of the field"
                    }
                    _ => "the changes of sign are jumps or poles, not zeros",
                }
                .into(),
            );
            failure
        }
        PolygonizeError::TooManyCells { .. } => {
            let message = format!("{message}, which `--limit cells=N` raises");
            let mut failure = failure(Code::CellLimit, message).at(arguments.span, "here");
            failure.help = Some("larger cells or a smaller box need fewer".into());
            failure
        }
        PolygonizeError::CellTooLarge { .. } => {
            let name = match arguments.given("cell") {
                Some(_) => "cell",
                None => "resolution",
            };
            let mut failure = arguments.bad(name, message);
            failure.help = Some("use smaller cells, or a larger box".into());
            failure
        }
        PolygonizeError::SeedOutside { .. } => arguments.bad("seeds", message),
        PolygonizeError::TooManyVertices { .. } => {
            failure(Code::CellLimit, message).at(arguments.span, "here")
        }
        PolygonizeError::BadOption { option, .. } => arguments.bad(option, message),
        PolygonizeError::WrongDimension { .. } => {
            failure(Code::WrongDimension, message).at(arguments.span, "here")
        }
        PolygonizeError::WrongMethod { dimension, .. } => {
            let mut failure = arguments.bad("method", message);
            let names = Method::names_in(dimension);
            failure.help = Some(format!("in R{dimension} there are {names}"));
            failure
        }
        PolygonizeError::NotForCurves { .. }
        | PolygonizeError::NotInBricks { .. }
        | PolygonizeError::NothingToProveWith => arguments.bad("method", message),
        PolygonizeError::TooManyBricks { .. } => {
            let mut failure = arguments.bad("bricks", message);
            failure.help = Some("give bricks more cells along a side".into());
            failure
        }
        PolygonizeError::ProvenEmpty { .. } | PolygonizeError::MaybeEmpty { .. } => {
            failure(Code::NoSurface, message).at(arguments.place("f"), "no zero")
        }
        PolygonizeError::NoCurve => {
            failure(Code::NoSurface, message).at(arguments.place("f"), "no curve")
        }
        PolygonizeError::NoSamples { .. } => {
            let mut failure = arguments.bad("samples", message);
            failure.help = Some("they must be samples of this field, in `bounds`".into());
            failure
        }
        PolygonizeError::TooSparse { .. } => {
            let mut failure = failure(Code::NoSurface, message).at(arguments.span, "here");
            failure.help = Some("give more samples, or a smaller `cell`".into());
            failure
        }
        PolygonizeError::Sampling(error) => sample_failure(&error, arguments),
        PolygonizeError::LostSeed { .. } => arguments.bad("seeds", message),
        PolygonizeError::Cancelled => failure(Code::Cancelled, message).at(arguments.span, "here"),
    }
}
