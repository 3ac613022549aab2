//! Samplers, polygonizers and measures as functions of the language.

use std::rc::Rc;
use std::sync::Arc;

use glam::DVec3;

use super::extent::found_bounds;
use super::{Arguments, Builtin, action, pure};
use crate::diagnostic::{Code, Diagnostic};
use crate::engine::CompiledField;
use crate::geometry::Bounds;
use crate::language::field::{FieldValue, bounds_of};
use crate::language::function::At;
use crate::language::product::{self, CurveSet, MeshSet, SampleSet};
use crate::language::session::Session;
use crate::language::value::{Outcome, Value, failure};
use crate::polygonize::{self, PolygonizeError};
use crate::sample::{self, Method, SampleError, Varying};

pub(super) const TABLE: &[Builtin] = &[
    action(
        "polygonize",
        &[
            "f",
            "method = \"cubes\"",
            "cell =",
            "resolution = 64",
            "bounds =",
            "iso = 0",
            "cap = false",
            "tolerance = 1e-9",
        ],
        "The level set f = iso in a box: a mesh in R3 (marching cubes), curves in R2 (marching squares), the list of roots in R1. The box is `bounds`, or what `over` says, or one that provably holds the whole zero set (see `bounds`); `cell` is the side of a grid cell, by default the longest side of the box divided by `resolution`. With `cap = true` what the box cuts is closed along it.",
        polygonize,
    ),
    action(
        "sample",
        &[
            "f",
            "method = \"floaters\"",
            "spacing =",
            "count =",
            "seeds =",
            "seed = 0",
            "bounds =",
            "tolerance = 1e-9",
            "friction = 0.05",
            "direction =",
        ],
        "Points on the zero set. \"floaters\" (Witkin and Heckbert), the default for curves in R2 and surfaces in R3, repel each other, split and die until they are evenly spread, with `spacing` between neighbours (a number, or a function of the point) or `count` of them (2000 on a surface, 500 on a curve); they start on every component, or from `seeds`. The particles of Figueiredo and Gomes are released at random, `count` of them (5000 for a surface, 1000 for a curve): \"kinematic\" ones, the default in R1, move down |f|, \"dynamic\" ones fall with `friction` and pass more false minima. \"trace\", the default for curves in space, on which two fields vanish, goes from point to point: curves get `count` points at exactly equal distances, about `spacing`, and surfaces about `count` points. Three methods find all roots on lines: \"rays\" are `count` points of random lines, uniformly distributed, or of lines that are parallel to `direction`, with `weights`; \"poisson\" are `count` random points that keep their distance from each other; \"grid\" are the points on the edges of a grid with `spacing`, all roots in R1. They estimate `area` and `volume` too (in R2 `length` and `area`), with standard errors. The box is `bounds`, or what `over` says, or one that provably holds the whole zero set; without any floaters and particles search for the surface.",
        sample,
    ),
    action(
        "thin",
        &["samples", "delta", "keep = \"representative\"", "f ="],
        "Samples with one point left in each cube of side delta that has any: the \"representative\" nearest to their middle, or their \"barycenter\", put back onto the zero set of f.",
        thin,
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
    measure("centroid", "The centre of the volume enclosed by a mesh."),
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
fn located_argument(
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
) -> Outcome<Bounds> {
    match given {
        Some(bounds) => Ok(bounds),
        None => found_bounds(field, iso, arguments),
    }
}

fn polygonize(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    match arguments.text("method")?.as_deref() {
        None | Some("cubes") => {}
        Some(other) => {
            let message = format!("there is no polygonizer `{other}`; there is \"cubes\"");
            return Err(arguments.bad("method", message));
        }
    }
    let (field, bounds) = compiled_argument(session, arguments)?;
    let iso = arguments.number(session, "iso")?.unwrap_or(0.0);
    let bounds = box_of(&field, iso, bounds, arguments)?;
    let mut options = polygonize::Options::new(bounds);
    if let Some(resolution) = arguments.positive(session, "resolution")? {
        options.cell = bounds.size().max_element() / resolution;
    }
    if let Some(cell) = arguments.positive(session, "cell")? {
        options.cell = cell;
    }
    options.iso = iso;
    if let Some(cap) = arguments.bool(session, "cap")? {
        options.cap = cap;
    }
    if let Some(tolerance) = arguments.positive(session, "tolerance")? {
        options.tolerance = tolerance;
    }
    options.cell_limit = usize::try_from(session.limits.cells).unwrap_or(usize::MAX);
    let monitor = &session.monitor();
    let (value, statistics) = match bounds.dimension {
        1 => polygonize::roots(&field, &options, monitor)
            .map(|found| (Value::numbers(found.roots), found.statistics)),
        2 => polygonize::contours(&field, &options, monitor).map(|found| {
            let set = CurveSet {
                curves: found.curves,
                method: "squares",
                statistics: found.statistics,
            };
            (Value::Curves(Rc::new(set)), found.statistics)
        }),
        _ => polygonize::surface(&field, &options, monitor).map(|found| {
            let set = MeshSet::new(found.mesh, "cubes", found.statistics);
            (Value::Mesh(Rc::new(set)), found.statistics)
        }),
    }
    .map_err(|error| polygonize_failure(error, arguments))?;
    warn_about_mesh(session, arguments, &statistics, &options);
    Ok(value)
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
                    (0, 0, _) => "the field is not a number anywhere in the box",
                    (_, 0, 1..) => {
                        "the field is negative (inside) wherever it is a number: it ends where it \
                     is no longer defined"
                    }
                    (0, _, _) => {
                        "the field is positive (outside) everywhere: enlarge the box, or use \
                         smaller cells for what is thin"
                    }
                    (_, 0, _) => {
                        "the field is negative (inside) everywhere: enlarge the box, or check \
                         the sign of the field"
                    }
                    _ => "the changes of sign are jumps or poles, not zeros",
                }
                .into(),
            );
            failure
        }
        PolygonizeError::TooManyCells { .. } => {
            let mut failure = failure(Code::CellLimit, message).at(arguments.span, "here");
            failure.help = Some(
                "use larger cells or a smaller box, or raise it with `--limit cells=N`".into(),
            );
            failure
        }
        PolygonizeError::TooManyVertices { .. } => {
            failure(Code::CellLimit, message).at(arguments.span, "here")
        }
        PolygonizeError::BadOption { option, .. } => arguments.bad(option, message),
        PolygonizeError::WrongDimension { .. } => {
            failure(Code::WrongDimension, message).at(arguments.span, "here")
        }
        PolygonizeError::Cancelled => failure(Code::Cancelled, message).at(arguments.span, "here"),
    }
}

fn warn_about_mesh(
    session: &mut Session,
    arguments: &Arguments,
    statistics: &polygonize::Statistics,
    options: &polygonize::Options,
) {
    let mut warn = |code, message: String, help: &str| {
        let warning = Diagnostic::warning(code, message)
            .label(arguments.span, "made here")
            .help(help);
        session.host.warn(warning);
    };
    if statistics.nan_points > 0 {
        warn(
            Code::NanRegion,
            format!(
                "the field is not a number at {} points of the grid, which count as outside",
                statistics.nan_points
            ),
            "look for square roots and logarithms of negative numbers, and for 0/0",
        );
    }
    if statistics.cut_by_box && options.bounds.dimension > 1 {
        let (done, help) = if options.cap {
            ("closed", "enlarge the box if the whole of it is wanted")
        } else {
            (
                "left open",
                "write `cap = true` to close it, or enlarge the box",
            )
        };
        warn(
            Code::CutByBox,
            format!("the box cuts the level set, which is {done} there"),
            help,
        );
    }
    let jumps = statistics.poor_roots - statistics.domain_ends;
    if jumps > 0 {
        warn(
            Code::PoorRoots,
            format!("{jumps} changes of sign are jumps or poles rather than zeros of the field"),
            "a pole such as 1/x changes its sign without a zero",
        );
    }
}

fn sample(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let (field, given) = located_argument(session, arguments)?;
    let fields = field
        .surfaces(&mut session.graph, session.parameters.values())
        .at(arguments.place("f"), "this field")?;
    let method = match arguments.text("method")?.as_deref() {
        None if fields.len() == 2 => Method::Trace,
        None if field.dimension() == 1 => Method::Kinematic,
        None => Method::default(),
        Some(name) => Method::named(name).ok_or_else(|| {
            let names = Method::NAMES.iter().map(|(_, name)| format!("\"{name}\""));
            let names: Vec<String> = names.collect();
            let message = format!(
                "there is no sampler `{name}`; there are {}",
                names.join(", ")
            );
            arguments.bad("method", message)
        })?,
    };
    let bounds = match (given, method) {
        (Some(bounds), _) => Some(bounds),
        (None, Method::Kinematic | Method::Dynamic) => None,
        (None, Method::Floaters) => proven_box(&fields[0], arguments)?,
        (None, _) => Some(common_box(&fields, arguments)?),
    };
    let mut options = sample::Options {
        method,
        bounds,
        count: arguments.count(session, "count")?,
        count_limit: session.limits.particles,
        ..sample::Options::default()
    };
    match arguments.given("spacing").map(|given| given.value.clone()) {
        Some(spacing @ (Value::Field(_) | Value::Function(_))) => {
            options.varying = Some(varying(session, arguments, spacing, field.dimension())?);
        }
        _ => options.spacing = arguments.positive(session, "spacing")?,
    }
    if let Some(seed) = arguments.count(session, "seed")? {
        options.seed = seed;
    }
    if let Some(seeds) = arguments.plain(session, "seeds")? {
        options.seeds = points_of(&seeds, field.dimension()).ok_or_else(|| {
            let expected = "points, as in `[[0, 0, 1], [0, 0, -1]]`, or samples";
            arguments.expected(expected, "seeds", &seeds)
        })?;
    }
    if let Some(tolerance) = arguments.positive(session, "tolerance")? {
        options.tolerance = tolerance;
    }
    if let Some(friction) = arguments.positive(session, "friction")? {
        options.friction = friction;
    }
    if let Some(direction) = arguments.plain(session, "direction")? {
        let vector = vector_of(&direction, field.dimension());
        let expected = "a vector, as in `[0, 0, 1]`";
        options.direction =
            Some(vector.ok_or_else(|| arguments.expected(expected, "direction", &direction))?);
    }
    let outcome = match fields.as_slice() {
        [first, second] => sample::sample_curve([first, second], &options, &session.monitor()),
        [field, ..] => sample::sample(field, &options, &session.monitor()),
        [] => return Err(arguments.expected("a field", "f", &Value::Field(field))),
    };
    let outcome = outcome.map_err(|error| sample_failure(&error, arguments))?;
    let statistics = outcome.statistics;
    if outcome.samples.positions.is_empty() {
        let message = match (method, &statistics.lines) {
            (Method::Trace, _) => "the field has no zero in the box that could be found".to_owned(),
            (_, None) => format!(
                "none of the {} particles found a zero of the field",
                statistics.started
            ),
            (_, Some(_)) => format!(
                "none of the {} lines through the box met a zero of the field",
                statistics.started
            ),
        };
        let mut error = failure(Code::NoSurface, message).at(arguments.place("f"), "no zero found");
        error.help = Some("give `bounds` that hold the surface, or check the field".into());
        return Err(error);
    }
    warn_about_samples(session, arguments, &statistics);
    let set = SampleSet::new(outcome.samples, method.name(), Some(statistics));
    Ok(Value::Samples(Rc::new(set)))
}

/// The vector that a list of numbers stands for.
fn vector_of(value: &Value, dimension: usize) -> Option<DVec3> {
    let Value::List(components) = value else {
        return None;
    };
    let mut vector = DVec3::ZERO;
    for (axis, component) in components.iter().enumerate() {
        match component {
            Value::Number(number) if axis < dimension => vector[axis] = *number,
            _ => return None,
        }
    }
    (components.len() == dimension).then_some(vector)
}

/// A spacing that is a field, or a function of a point or of coordinates.
fn varying(
    session: &mut Session,
    arguments: &Arguments,
    spacing: Value,
    dimension: usize,
) -> Outcome<Varying> {
    let place = arguments.place("spacing");
    let field = match spacing {
        Value::Field(field) => field,
        Value::Function(function) => {
            let as_point = function.parameter_count() == 1 && dimension > 1;
            session.function_as_field(&function, dimension, as_point, place)?
        }
        other => return Err(arguments.expected("a number or a function", "spacing", &other)),
    };
    if field.dimension() != dimension {
        let message = format!(
            "`spacing` has {} coordinates, but the field has {dimension}",
            field.dimension()
        );
        return Err(arguments.bad("spacing", message));
    }
    let compiled = field
        .compiled(&mut session.graph, session.parameters.values())
        .at(place, "this spacing")?;
    Ok(Varying(Arc::new(compiled)))
}

/// The points that a list of lists of numbers, or a sample, stands for.
fn points_of(value: &Value, dimension: usize) -> Option<Vec<DVec3>> {
    if let Value::Samples(set) = value {
        return (set.samples.dimension == dimension).then(|| set.samples.positions.clone());
    }
    let Value::List(points) = value else {
        return None;
    };
    points
        .iter()
        .map(|point| vector_of(point, dimension))
        .collect()
}

/// A box that provably holds the whole zero set, if one can be found. That there is no zero at
/// all is an error; that nothing could be proven is none, because the sampler can search.
fn proven_box(field: &CompiledField, arguments: &Arguments) -> Outcome<Option<Bounds>> {
    match found_bounds(field, 0.0, arguments) {
        // A zero set that is a point has no box to speak of.
        Ok(bounds) => Ok(Some(bounds).filter(|bounds| bounds.diagonal() > 1e-90)),
        Err(error) if error.code == Code::NoBounds => Ok(None),
        Err(error) => Err(error),
    }
}

/// A box that provably holds all points at which every one of the fields vanishes.
fn common_box(fields: &[CompiledField], arguments: &Arguments) -> Outcome<Bounds> {
    let mut common: Option<Bounds> = None;
    let mut unbounded = None;
    for field in fields {
        match (found_bounds(field, 0.0, arguments), common) {
            (Ok(bounds), None) => common = Some(bounds),
            (Ok(bounds), Some(other)) => {
                let (min, max) = (bounds.min.max(other.min), bounds.max.min(other.max));
                if min.cmpgt(max).any() {
                    return Err(no_common_zero(arguments));
                }
                common = Some(Bounds { min, max, ..other });
            }
            (Err(error), _) if error.code == Code::NoBounds => unbounded = Some(error),
            (Err(error), _) => return Err(error),
        }
    }
    common.ok_or_else(|| unbounded.unwrap_or_else(|| no_common_zero(arguments)))
}

fn no_common_zero(arguments: &Arguments) -> Box<Diagnostic> {
    failure(Code::NoSurface, "the fields vanish nowhere together")
        .at(arguments.place("f"), "no zero set")
}

fn sample_failure(error: &SampleError, arguments: &Arguments) -> Box<Diagnostic> {
    let message = error.to_string();
    match error {
        SampleError::Option { option, .. } => {
            failure(Code::BadValue, message).at(arguments.place(option), "this value")
        }
        SampleError::TooMany { .. } => {
            let mut failure =
                failure(Code::ParticleLimit, message).at(arguments.place("count"), "this many");
            failure.help = Some("raise it with `--limit particles=N` if this is meant".into());
            failure
        }
        SampleError::Dimension { .. } => {
            failure(Code::WrongDimension, message).at(arguments.span, "here")
        }
        SampleError::Method { .. } => arguments.bad("method", message),
        SampleError::NoCurve { .. } => {
            failure(Code::NoSurface, message).at(arguments.place("f"), "not a curve")
        }
        SampleError::Cancelled => failure(Code::Cancelled, message).at(arguments.span, "here"),
    }
}

fn warn_about_samples(
    session: &mut Session,
    arguments: &Arguments,
    statistics: &sample::Statistics,
) {
    if statistics.births.is_some() && !statistics.converged {
        let message = if !statistics.settled {
            "the search for the surface did not come to an end: the surface may be unbounded"
                .to_owned()
        } else if statistics.dropped.total() > 0 {
            format!(
                "{} of {} floaters were dropped: they could not be put on the zero set, which is \
                 rough there",
                statistics.dropped.total(),
                statistics.started
            )
        } else {
            format!(
                "the floaters did not come to rest in {} iterations, or their number is not \
                 exactly what was asked for",
                statistics.iterations
            )
        };
        let warning = Diagnostic::warning(Code::DroppedPoints, message)
            .label(arguments.span, "sampled here")
            .help("all points lie on the zero set, but maybe not evenly; sharp creases and details smaller than the spacing keep floaters moving");
        session.host.warn(warning);
    }
    if let Some(lines) = &statistics.lines {
        warn_about_lines(session, arguments, statistics, lines);
    }
    let of_particles = statistics.births.is_none();
    if of_particles && (statistics.dropped.unconverged > 0 || statistics.dropped.spurious > 0) {
        let warning = Diagnostic::warning(
            Code::DroppedPoints,
            format!(
                "{} of {} particles were dropped: {} did not converge, {} were caught where the \
                 field has a minimum that is not 0",
                statistics.dropped.total(),
                statistics.started,
                statistics.dropped.unconverged,
                statistics.dropped.spurious
            ),
        )
        .label(arguments.span, "sampled here");
        session.host.warn(warning);
    }
    if statistics.nan_points > 0 {
        let warning = Diagnostic::warning(
            Code::NanRegion,
            format!(
                "the field or its gradient was not a number at {} of {} points that were looked at",
                statistics.nan_points, statistics.evaluations
            ),
        )
        .label(arguments.span, "sampled here");
        session.host.warn(warning);
    }
}

fn warn_about_lines(
    session: &mut Session,
    arguments: &Arguments,
    statistics: &sample::Statistics,
    lines: &sample::Lines,
) {
    let mut warn = |code, message: String, help: &str| {
        let warning = Diagnostic::warning(code, message)
            .label(arguments.span, "sampled here")
            .help(help);
        session.host.warn(warning);
    };
    if !statistics.converged {
        warn(
            Code::DroppedPoints,
            format!(
                "only {} points were found on {} lines: the surface is too small for its box",
                statistics.points, lines.drawn
            ),
            "give `bounds` that are closer to the surface",
        );
    }
    if lines.undecided > 0 {
        warn(
            Code::PoorRoots,
            format!(
                "at {} places on {} lines the field jumps, has a pole, ends, or could not be \
                 enclosed closely: they give no points",
                lines.undecided, lines.drawn
            ),
            "a pole such as 1/x changes its sign without a zero",
        );
    }
}

fn thin(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let Value::Samples(set) = arguments.value("samples") else {
        return Err(arguments.expected("samples", "samples", &arguments.value("samples")));
    };
    let delta = arguments.positive(session, "delta")?.unwrap_or(f64::NAN);
    let thinned = match arguments.text("keep")?.as_deref() {
        None | Some("representative") => {
            sample::thin(&set.samples, delta, sample::Keep::Representative)
        }
        Some("barycenter" | "barycentre") => {
            if arguments.given("f").is_none() {
                let message = "`keep = \"barycenter\"` needs the field, `f = …`, to put the \
                               points back onto its zero set";
                return Err(failure(Code::MissingArgument, message).at(arguments.span, "here"));
            }
            let field = field_argument(session, arguments, Some(set.samples.dimension))?;
            let compiled = field
                .compiled(&mut session.graph, session.parameters.values())
                .at(arguments.place("f"), "this field")?;
            sample::thin(&set.samples, delta, sample::Keep::Barycenter(&compiled))
        }
        Some(other) => {
            let message =
                format!("`keep` must be \"representative\" or \"barycenter\", not \"{other}\"");
            return Err(arguments.bad("keep", message));
        }
    }
    .map_err(|error| sample_failure(&error, arguments))?;
    let set = SampleSet::new(thinned, set.method, None);
    Ok(Value::Samples(Rc::new(set)))
}
