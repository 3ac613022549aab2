//! Samplers as functions of the language.

mod warnings;

pub(super) use warnings::warn_about_samples;

use std::rc::Rc;
use std::sync::Arc;

use glam::DVec3;

use super::extent::found_bounds;
use super::surfaces::{field_argument, located_argument};
use super::{Arguments, Builtin, action, methods};
use crate::diagnostic::{Code, Diagnostic};
use crate::engine::{CompiledField, Monitor};
use crate::geometry::Bounds;
use crate::language::function::At;
use crate::language::product::SampleSet;
use crate::language::session::Session;
use crate::language::value::{Outcome, Value, failure};
use crate::sample::{self, Density, Focus, Method, Potential, Rules, SampleError, Varying};

/// The contrast of a spacing that follows curvature, and how much finer it is in a focus region.
const CONTRAST: f64 = 8.0;
const FINER: f64 = 3.0;

pub(super) const TABLE: &[Builtin] = &[
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
            "potential = \"absolute\"",
            "direction =",
            "adapt =",
            "contrast = 8",
            "focus =",
            "finer = 3",
            "exact = false",
            "sigma =",
            "sigma_max =",
            "time_step = 0.03",
            "phi = 15",
            "rho = 15",
            "alpha = 6",
            "energy = 0.8",
            "beta = 10",
            "gamma = 4",
            "nu = 0.2",
            "delta = 0.7",
        ],
        "Points on the zero set. \"floaters\" (Witkin and Heckbert), the default for curves in R2 and surfaces in R3, repel each other, split and die until they are evenly spread, with `spacing` between neighbours (a number, or a function of the point) or `count` of them (2000 on a surface, 500 on a curve); they start on every component, or from `seeds`, and stay on sharp edges and corners. Repulsion, birth and death have the parameters of Witkin and Heckbert's table: `time_step`, `phi`, `rho`, `alpha`, `energy` (Ê/α), `beta`, `gamma`, `nu`, `delta`. With `exact = true` their algorithm is all there is: from one seed on each component, or from `seeds`, to the radius `sigma` (σ̂, a fiftieth of the diameter if nothing is said), and how many points come of it is left to it. With `adapt = \"curvature\"` their spacing follows the smaller radius of curvature, the widest at most `contrast` times the narrowest; where the field `focus` is negative it is `finer` times smaller, and grows again over some spacings; `spacing` is then that of an even sample with as many points, outside of the focus, and a function is multiplied. \"relax\" is simpler: few floaters come to rest and then split all at once, several times (Turk). The particles of Figueiredo and Gomes are released at random, `count` of them (5000 for a surface, 1000 for a curve): \"kinematic\" ones, the default in R1, move down |f|, \"dynamic\" ones fall with `friction` and pass more false minima; with `potential = \"square\"` both move down f^2, by a force that does not jump on the zero set. Their steps need no choice: the first is Newton's, and every crossing halves it. \"trace\", the default for curves in space, on which two fields vanish, goes from point to point: curves get `count` points at exactly equal distances, about `spacing`, and surfaces about `count` points. Three methods find all roots on lines: \"rays\" are `count` points of random lines, uniformly distributed, or of lines that are parallel to `direction`, with `weights`; \"poisson\" are `count` random points that keep their distance from each other; \"grid\" are the points on the edges of a grid with `spacing`, all roots in R1. They estimate `area` and `volume` too (in R2 `length` and `area`), with standard errors. The box is `bounds`, or what `over` says, or one that provably holds the whole zero set; without any floaters and particles search for the surface.",
        sample,
    ),
    action(
        "thin",
        &["samples", "delta", "keep = \"representative\"", "f ="],
        "Samples with one point left in each cube of side delta that has any: the \"representative\" nearest to their middle, or their \"barycenter\", put back onto the zero set of f.",
        thin,
    ),
];

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
    methods::check(arguments, method, methods::SAMPLERS, Method::name)?;
    let bounds = match (given, method) {
        (Some(bounds), _) => Some(bounds),
        (None, Method::Kinematic | Method::Dynamic) => None,
        (None, Method::Floaters | Method::Relax) => {
            proven_box(&fields[0], arguments, &session.monitor())?
        }
        (None, _) => Some(common_box(&fields, arguments, &session.monitor())?),
    };
    let mut options = sample::Options {
        method,
        bounds,
        count: number_of_points(session, arguments)?,
        count_limit: session.limits.particles,
        ..sample::Options::default()
    };
    match arguments.given("spacing").map(|given| given.value.clone()) {
        Some(spacing @ (Value::Field(_) | Value::Function(_))) => {
            let spacing = field_of(session, arguments, "spacing", spacing, field.dimension())?;
            options.varying = Some(Varying(Arc::new(spacing)));
        }
        _ => options.spacing = arguments.positive(session, "spacing")?,
    }
    if let Some(seed) = arguments.count(session, "seed")? {
        options.seed = seed;
    }
    if let Some(seeds) = arguments.plain(session, "seeds")? {
        options.seeds = points_of(&seeds, field.dimension()).ok_or_else(|| {
            if let Value::List(points) = &seeds
                && let Some(length) = points
                    .iter()
                    .find_map(|point| other_length(point, field.dimension()))
            {
                let dimension = field.dimension();
                let message = format!(
                    "`seeds` must be points of {dimension} numbers, but one of them has {length}"
                );
                return arguments.bad("seeds", message);
            }
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
    if let Some(name) = arguments.text("potential")? {
        options.potential = Potential::named(&name).ok_or_else(|| {
            let message = format!("`potential` must be \"absolute\" or \"square\", not \"{name}\"");
            arguments.bad("potential", message)
        })?;
    }
    options.exact = arguments.bool(session, "exact")?.unwrap_or(false);
    for name in Rules::NAMES {
        if let Some(value) = arguments.positive(session, name)?
            && let Some(rule) = options.rules.get_mut(name)
        {
            *rule = value;
        }
    }
    if let Some(direction) = arguments.plain(session, "direction")? {
        let dimension = field.dimension();
        let vector = vector_of(&direction, dimension).ok_or_else(|| {
            match other_length(&direction, dimension) {
                Some(length) => {
                    let message = format!(
                        "`direction` must be a vector of {dimension} numbers, but this has {length}"
                    );
                    arguments.bad("direction", message)
                }
                None => arguments.expected("a vector, as in `[0, 0, 1]`", "direction", &direction),
            }
        })?;
        options.direction = Some(vector);
    }
    let density = density(session, arguments, field.dimension())?;
    let monitor = session.monitor();
    let mut fields = fields.into_iter();
    let outcome = match (fields.next(), fields.next(), density) {
        (Some(field), None, None) => sample::sample(&field, &options, &monitor),
        (Some(field), None, Some(density)) => {
            sample::sample_graded(Arc::new(field), &density, &options, &monitor)
        }
        (Some(first), Some(second), None) => {
            sample::sample_curve([&first, &second], &options, &monitor)
        }
        (_, Some(_), Some(_)) => {
            let message = "`adapt` and `focus` are for curves in R2 and surfaces in R3";
            return Err(arguments.bad("f", message.to_owned()));
        }
        (None, ..) => return Err(arguments.expected("a field", "f", &Value::Field(field))),
    };
    let outcome = outcome.map_err(|error| sample_failure(&error, arguments))?;
    let statistics = &outcome.statistics;
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
        error.help = Some(match options.spacing {
            _ if statistics.nan_points > 0 => format!(
                "the field or its gradient was not a number at {} of {} points that were looked at: \
                 check where it is defined, or give `bounds` that lie there",
                statistics.nan_points, statistics.evaluations
            ),
            Some(_) if method == Method::Grid => {
                "give a smaller `spacing`, or `bounds` that hold the surface".to_owned()
            }
            _ => "give `bounds` that hold the surface, or check the field".to_owned(),
        });
        return Err(error);
    }
    warnings::warn(session, arguments, &outcome, &options);
    let set = SampleSet::new(outcome.samples, method.name(), Some(outcome.statistics));
    Ok(Value::Samples(Rc::new(set)))
}

/// How many points are asked for, if that is said: what is above the limit is refused by the sampler.
fn number_of_points(session: &mut Session, arguments: &Arguments) -> Outcome<Option<u64>> {
    /// Beyond it neighbouring whole numbers are no longer told apart.
    const EXACT: f64 = 9_007_199_254_740_992.0;
    match arguments.number(session, "count")? {
        None => Ok(None),
        Some(number) if (1.0..=EXACT).contains(&number) && number.floor() == number => {
            Ok(Some(number as u64))
        }
        Some(number) => {
            let limit = session.limits.particles;
            let message =
                format!("`count` must be a whole number from 1 to {limit}, but it is {number:?}");
            Err(arguments.bad("count", message))
        }
    }
}

/// The length of a list of numbers that is no vector of so many.
fn other_length(value: &Value, dimension: usize) -> Option<usize> {
    let Value::List(components) = value else {
        return None;
    };
    let mut numbers = components
        .iter()
        .map(|component| matches!(component, Value::Number(_)));
    let length = numbers.len();
    (length != dimension && numbers.all(|number| number)).then_some(length)
}

/// The vector that a list of numbers stands for.
pub(super) fn vector_of(value: &Value, dimension: usize) -> Option<DVec3> {
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

/// What the spacing follows, if anything.
fn density(
    session: &mut Session,
    arguments: &Arguments,
    dimension: usize,
) -> Outcome<Option<Density>> {
    let contrast = match arguments.text("adapt")?.as_deref() {
        None => {
            only_with(arguments, "contrast", "adapt")?;
            None
        }
        Some("curvature") => Some(arguments.positive(session, "contrast")?.unwrap_or(CONTRAST)),
        Some(other) => {
            let message = format!("`adapt` must be \"curvature\", not \"{other}\"");
            return Err(arguments.bad("adapt", message));
        }
    };
    let focus = match arguments.given("focus").map(|given| given.value.clone()) {
        None => {
            only_with(arguments, "finer", "focus")?;
            None
        }
        Some(region) => Some(Focus {
            region: Arc::new(field_of(session, arguments, "focus", region, dimension)?),
            finer: arguments.positive(session, "finer")?.unwrap_or(FINER),
        }),
    };
    let follows = contrast.is_some() || focus.is_some();
    Ok(follows.then_some(Density { contrast, focus }))
}

/// Refuses an argument that says something about another one which is not given.
fn only_with(arguments: &Arguments, name: &'static str, other: &str) -> Outcome<()> {
    match arguments.given(name) {
        None => Ok(()),
        Some(_) => Err(arguments.bad(name, format!("`{name}` has no meaning without `{other}`"))),
    }
}

/// A field, or a function of a point or of coordinates.
fn field_of(
    session: &mut Session,
    arguments: &Arguments,
    name: &'static str,
    value: Value,
    dimension: usize,
) -> Outcome<CompiledField> {
    let place = arguments.place(name);
    let field = match value {
        Value::Field(field) => field,
        Value::Function(function) => {
            let as_point = function.parameter_count() == 1 && dimension > 1;
            session.function_as_field(&function, dimension, as_point, place)?
        }
        other => return Err(arguments.expected("a field or a function", name, &other)),
    };
    if field.dimension() != dimension {
        let message = format!(
            "`{name}` has {} coordinates, but the field has {dimension}",
            field.dimension()
        );
        return Err(arguments.bad(name, message));
    }
    field
        .compiled(&mut session.graph, session.parameters.values())
        .at(place, "this field")
}

/// The points that a list of lists of numbers, or a sample, stands for.
pub(super) fn points_of(value: &Value, dimension: usize) -> Option<Vec<DVec3>> {
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
pub(super) fn proven_box(
    field: &CompiledField,
    arguments: &Arguments,
    monitor: &dyn Monitor,
) -> Outcome<Option<Bounds>> {
    match found_bounds(field, 0.0, arguments, monitor) {
        // A zero set that is a point has no box to speak of.
        Ok(bounds) => Ok(Some(bounds).filter(|bounds| bounds.diagonal() > 1e-90)),
        Err(error) if error.code == Code::NoBounds => Ok(None),
        Err(error) => Err(error),
    }
}

/// A box that provably holds all points at which every one of the fields vanishes.
pub(super) fn common_box(
    fields: &[CompiledField],
    arguments: &Arguments,
    monitor: &dyn Monitor,
) -> Outcome<Bounds> {
    let mut common: Option<Bounds> = None;
    let mut unbounded = None;
    for field in fields {
        match (found_bounds(field, 0.0, arguments, monitor), common) {
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

pub(super) fn no_common_zero(arguments: &Arguments) -> Box<Diagnostic> {
    failure(Code::NoSurface, "the fields vanish nowhere together")
        .at(arguments.place("f"), "no zero set")
}

pub(super) fn sample_failure(error: &SampleError, arguments: &Arguments) -> Box<Diagnostic> {
    let message = error.to_string();
    match error {
        SampleError::Option { option, .. } => {
            failure(Code::BadValue, message).at(arguments.place(option), "this value")
        }
        SampleError::TooMany { count, limit } => {
            let asked = ["count", "spacing"];
            let asked = asked
                .into_iter()
                .find(|name| arguments.given(name).is_some());
            let Some(asked) = asked else {
                let message = format!(
                    "{count} points, which there are without `count` and `spacing`, are too many (the \
                     limit is {limit})"
                );
                let mut failure = failure(Code::ParticleLimit, message).at(arguments.span, "here");
                failure.help = Some(format!(
                    "give a `count` of at most {limit}, or raise the limit with `--limit particles=N`"
                ));
                return failure;
            };
            let mut failure =
                failure(Code::ParticleLimit, message).at(arguments.place(asked), "this many");
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
