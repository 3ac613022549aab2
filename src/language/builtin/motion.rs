//! Surfaces that move: simulations, control points and fits as functions of the language.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use super::samples::{points_of, sample_failure, vector_of, warn_about_samples};
use super::surfaces::located_argument;
use super::{Arguments, Builtin, action};
use crate::diagnostic::{Code, Diagnostic, suggest};
use crate::engine::{CompiledField, Monitor};
use crate::language::field::FieldValue;
use crate::language::function::{Argument, At};
use crate::language::product::{FitSet, SimulationSet, Warned};
use crate::language::session::Session;
use crate::language::value::{Outcome, Value, failure};
use crate::motion::{
    self, FitOptions, Freedom, Measure, Metric, PinState, Setting, Simulation, SimulationError,
    Step,
};
use crate::sample;

/// The paper's time step.
const TIME_STEP: f64 = 0.03;

pub(super) const TABLE: &[Builtin] = &[
    action(
        "simulate",
        &[
            "f",
            "count =",
            "spacing =",
            "seed = 0",
            "bounds =",
            "motion =",
            "freeze = []",
            "metric = \"sensitivity\"",
            "attract = 0",
            "rest =",
        ],
        "A surface (or a curve in R2) that moves, with floaters that follow it (Witkin and Heckbert): `count` of them at the beginning, or `spacing` apart. `step` moves it. What moves it: `motion`, a function of time that gives the field, as in `t -> blobs with {b = 1 + t}`; control points, by `pin` and `drag`; and `attract`, the part of the way per time back to the shape `rest`, the field with other parameters, by default as it is at the beginning. Control points change the parameters as little as they can: by how much the surface moves (`metric = \"sensitivity\"`), by the sum of squares (\"identity\"), or with a list of weights, or a matrix, over `names`. Parameters named in `freeze` keep their values, and ranges of parameters are kept. Floaters stay within `bounds`, if they are given. It tells `time`, `count`, `births`, `deaths`, `max_residual`, `surface` (the field with the parameters it has now), `q`, `names`, `pinned`, `pin_residuals`, `solver`, `rank`, and what samples tell; it can be plotted and exported like samples.",
        simulate,
    ),
    action(
        "step",
        &["sim", "dt = 0.03", "steps = 1"],
        "Lets so much time pass, so many times: the surface moves, control points keep it, and floaters follow, split and die. Gives the simulation.",
        step,
    ),
    action(
        "pin",
        &["sim", "points"],
        "Puts control points at a point, at a list of points, or at samples: from the next step on the surface passes through them. Gives their numbers, or the number of the one point.",
        pin,
    ),
    action(
        "drag",
        &["sim", "index", "to", "time = 0"],
        "Lets the control point of that number go to a point, straight and evenly, in that `time`, or with the next step. Gives the simulation.",
        drag,
    ),
    action(
        "release",
        &["sim", "index"],
        "Takes the control point of that number away. Gives the simulation.",
        release,
    ),
    action(
        "record",
        &["sim", "every = 1"],
        "Keeps a frame now, and after every so many steps. `plot(sim, \"film.png\")` then writes an animated picture, and `export(sim, \"frames.ply\")` a file for each frame. Gives the simulation.",
        record,
    ),
    action(
        "fit",
        &[
            "f",
            "points",
            "freeze = []",
            "tolerance = 1e-13",
            "iterations = 200",
        ],
        "Changes the parameters of a field until its zero set passes through points, or, where it cannot, until the sum of the squared distances |f|/|grad(f)| is least (Levenberg and Marquardt, from the present parameters). Gives the `surface`, the field with what was found, `q` and `names`, `residual` (root mean square) and `max_residual`, `converged`, `rank`, and the parameters that the points leave `undetermined` or that are `at_bounds` of their ranges. Parameters named in `freeze` keep their values.",
        fit,
    ),
];

fn simulate(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let (field, bounds) = located_argument(session, arguments)?;
    let place = arguments.place("f");
    let compiled = field
        .compiled(&mut session.graph, session.parameters.values())
        .at(place, "this field")?;
    let parameters = parameters_of(session, &compiled);
    let walls = bounds.is_some();
    let options = sample::Options {
        bounds: match bounds {
            Some(bounds) => Some(bounds),
            None => super::samples::proven_box(&compiled, arguments, &session.monitor())?,
        },
        count: arguments.count(session, "count")?,
        spacing: arguments.positive(session, "spacing")?,
        count_limit: session.limits.particles,
        seed: arguments.count(session, "seed")?.unwrap_or(0),
        ..sample::Options::default()
    };
    let setting = Setting {
        options,
        walls,
        freedom: freedom(session, arguments, &parameters)?,
        measure: measure(session, arguments, parameters.len())?,
        rest: rest(session, arguments, &field, &compiled)?,
    };
    let motion = arguments.given("motion").map(|given| given.value.clone());
    if let Some(motion) = motion.as_ref().filter(|m| !matches!(m, Value::Function(_))) {
        return Err(arguments.expected(
            "a function of time, as in `t -> f with {r = 1 + t}`",
            "motion",
            motion,
        ));
    }
    let program = std::sync::Arc::clone(compiled.program());
    let q = crate::engine::Field::parameters(&compiled).to_vec();
    let (simulation, statistics) = Simulation::new(program, q, setting, &session.monitor())
        .map_err(|error| simulation_failure(&error, arguments))?;
    if simulation.followers().is_empty() {
        let mut error = failure(Code::NoSurface, "no floater found a zero of the field")
            .at(place, "no zero found");
        error.help = Some("give `bounds` that hold the surface, or check the field".to_owned());
        return Err(error);
    }
    warn_about_samples(session, arguments, &statistics);
    let set = SimulationSet {
        simulation: RefCell::new(simulation),
        last: RefCell::new(None),
        warned: Cell::new(Warned::default()),
        field,
        parameters,
        motion,
    };
    Ok(Value::Simulation(Rc::new(set)))
}

/// The places in the session's q of a field's parameters, and their names.
fn parameters_of(session: &Session, field: &CompiledField) -> Vec<(usize, String)> {
    let places = field.program().parameters().iter();
    places
        .map(|&place| {
            let place = place as usize;
            (place, session.parameters.component_name(place))
        })
        .collect()
}

/// What may change: not what is frozen, and within the ranges.
fn freedom(
    session: &mut Session,
    arguments: &Arguments,
    parameters: &[(usize, String)],
) -> Outcome<Freedom> {
    let mut freedom = Freedom::all(parameters.len());
    for (own, (place, _)) in parameters.iter().enumerate() {
        let covering = session.parameters.iter().find(|(_, parameter)| {
            let number = crate::language::parameters::components(&parameter.value);
            let number = number.map_or(0, |components| components.len());
            (parameter.first..parameter.first + number).contains(place)
        });
        if let Some((low, high)) = covering.and_then(|(_, parameter)| parameter.range) {
            freedom = freedom.with_range(own, low, high);
        }
    }
    let frozen = match arguments.plain(session, "freeze")? {
        None => return Ok(freedom),
        Some(name @ Value::Text(_)) => vec![name],
        Some(Value::List(names)) => names.iter().cloned().collect(),
        Some(other) => return Err(arguments.expected("a list of names", "freeze", &other)),
    };
    for name in frozen {
        let Value::Text(name) = name else {
            return Err(arguments.expected("a list of names", "freeze", &name));
        };
        let is_part = |whole: &str| {
            let rest = whole.strip_prefix(&*name);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('['))
        };
        let places: Vec<usize> = (0..parameters.len())
            .filter(|&own| is_part(&parameters[own].1))
            .collect();
        if places.is_empty() {
            return Err(unknown_parameter(&name, arguments, parameters));
        }
        for own in places {
            freedom = freedom.with_frozen(own);
        }
    }
    Ok(freedom)
}

fn unknown_parameter(
    name: &str,
    arguments: &Arguments,
    parameters: &[(usize, String)],
) -> Box<Diagnostic> {
    let mut names: Vec<&str> = parameters
        .iter()
        .map(|(_, name)| name.split('[').next().unwrap_or(name))
        .collect();
    names.dedup();
    let message = format!("the field has no parameter `{name}`");
    let mut error =
        failure(Code::UnknownParameter, message).at(arguments.place("freeze"), "in this list");
    error.help = Some(match suggest::nearest(name, names.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None if names.is_empty() => "it has none; define one with `param name = value`".to_owned(),
        None => format!(
            "it has {}; one component is written `name[0]`",
            names.join(", ")
        ),
    });
    error
}

fn measure(session: &mut Session, arguments: &Arguments, number: usize) -> Outcome<Measure> {
    let expected =
        "\"sensitivity\", \"identity\", or a list of weights, or a matrix, as large as `names`";
    let metric = match arguments.plain(session, "metric")? {
        None => return Ok(Measure::Sensitivity),
        Some(Value::Text(name)) => match &*name {
            "sensitivity" => return Ok(Measure::Sensitivity),
            "identity" => Ok(Metric::identity()),
            other => {
                let message = format!("`metric` must be {expected}, not \"{other}\"");
                return Err(arguments.bad("metric", message));
            }
        },
        Some(value) => {
            let Value::List(rows) = &value else {
                return Err(arguments.expected(expected, "metric", &value));
            };
            let numbers = |value: &Value| match value {
                Value::List(row) => row
                    .iter()
                    .map(|entry| match entry {
                        Value::Number(number) => Some(*number),
                        _ => None,
                    })
                    .collect::<Option<Vec<f64>>>(),
                _ => None,
            };
            let matrix: Option<Vec<Vec<f64>>> = rows.iter().map(numbers).collect();
            if rows.len() != number {
                let message = format!(
                    "`metric` has {} entries, but the field has {number} parameters",
                    rows.len()
                );
                return Err(arguments.bad("metric", message));
            }
            match (numbers(&value), matrix) {
                (Some(weights), _) => Metric::diagonal(weights),
                (None, Some(matrix)) => Metric::full(&matrix),
                (None, None) => return Err(arguments.expected(expected, "metric", &value)),
            }
        }
    };
    metric
        .map(Measure::Given)
        .map_err(|error| arguments.bad("metric", error.to_string()))
}

/// The rest shape and how fast the surface goes back to it.
fn rest(
    session: &mut Session,
    arguments: &Arguments,
    field: &FieldValue,
    compiled: &CompiledField,
) -> Outcome<Option<(Vec<f64>, f64)>> {
    let rate = arguments.number(session, "attract")?.unwrap_or(0.0);
    if !(rate >= 0.0 && rate.is_finite()) {
        let message = format!("`attract` must be at least 0 and finite, but it is {rate}");
        return Err(arguments.bad("attract", message));
    }
    let shape = match arguments.given("rest").map(|given| given.value.clone()) {
        Some(_) if rate == 0.0 => {
            let message = "`rest` has no meaning without `attract`".to_owned();
            return Err(arguments.bad("rest", message));
        }
        Some(shape) => q_of(session, field, compiled, &shape)
            .ok_or_else(|| arguments.bad("rest", not_the_same("rest")))?,
        None => crate::engine::Field::parameters(compiled).to_vec(),
    };
    Ok((rate > 0.0).then_some((shape, rate)))
}

fn not_the_same(what: &str) -> String {
    format!(
        "`{what}` must give the field that is simulated, with other parameters, as in `f with {{r = 2}}`"
    )
}

/// The parameters of a field that differs from another in nothing else.
fn q_of(
    session: &Session,
    field: &FieldValue,
    compiled: &CompiledField,
    other: &Value,
) -> Option<Vec<f64>> {
    match other {
        Value::Field(other) if other.is_same(field) => {
            Some(other.present(compiled.program(), session.parameters.values()))
        }
        _ => None,
    }
}

/// The simulation that an argument is.
fn simulation(arguments: &Arguments) -> Outcome<Rc<SimulationSet>> {
    match arguments.value("sim") {
        Value::Simulation(set) => Ok(set),
        other => Err(arguments.expected("a simulation, made by `simulate`", "sim", &other)),
    }
}

fn step(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let set = simulation(arguments)?;
    let time = arguments.number(session, "dt")?.unwrap_or(TIME_STEP);
    if !(time >= 0.0 && time.is_finite()) {
        let message = format!("`dt` must be at least 0 and finite, but it is {time}");
        return Err(arguments.bad("dt", message));
    }
    let steps = arguments.count(session, "steps")?.unwrap_or(1);
    for done in 0..steps {
        let path = path(session, arguments, &set, time)?;
        let monitor = session.monitor();
        monitor.progress("simulate", done as f64 / steps as f64);
        let result = set
            .simulation
            .borrow_mut()
            .step(time, path.as_deref(), &monitor);
        let step = result.map_err(|error| simulation_failure(&error, arguments))?;
        warn(session, arguments, &set, &step);
        *set.last.borrow_mut() = Some(step);
    }
    Ok(Value::Simulation(set))
}

/// The q that the motion wants after a step of this time.
fn path(
    session: &mut Session,
    arguments: &Arguments,
    set: &SimulationSet,
    time: f64,
) -> Outcome<Option<Vec<f64>>> {
    let Some(motion) = &set.motion else {
        return Ok(None);
    };
    let when = set.simulation.borrow().time() + time;
    let span = arguments.span;
    let argument = Argument {
        name: None,
        value: Value::Number(when),
        span,
    };
    let shape = session.call_value(motion, vec![argument], span, span)?;
    let field = set.simulation.borrow().field();
    let Some(q) = q_of(session, &set.field, &field, &shape) else {
        return Err(failure(Code::WrongKind, not_the_same("motion")).at(span, "in this step"));
    };
    if let Some(place) = q.iter().position(|value| !value.is_finite()) {
        let name = set.names(&[place]).join("");
        let message = format!("the motion gives `{name}` the value {} at {when}", q[place]);
        return Err(failure(Code::BadValue, message).at(span, "in this step"));
    }
    Ok(Some(q))
}

/// Tells of what did not go well in a step, when it begins.
fn warn(session: &mut Session, arguments: &Arguments, set: &SimulationSet, step: &Step) {
    let before = set.warned.get();
    let simulation = set.simulation.borrow();
    let time = simulation.time();
    let mut tell = |code, message: String, help: &str| {
        let warning = Diagnostic::warning(code, message)
            .label(arguments.span, "in this step")
            .help(help);
        session.host.warn(warning);
    };
    let reports = step.advance.iter().flat_map(|advance| &advance.pins);
    let numbers = simulation.pins();
    let missed: Vec<String> = reports
        .zip(&numbers)
        .filter(|(report, _)| report.state != PinState::Followed)
        .map(|(report, (index, _, _))| missed_pin(*index, report.state, report.residual))
        .collect();
    if !missed.is_empty() && !before.missed {
        let bounds = step.advance.as_ref().map(|advance| &advance.at_bounds);
        let bounds = bounds.filter(|bounds| !bounds.is_empty());
        let bounds = bounds.map_or(String::new(), |bounds| {
            format!("; at an end of its range: {}", set.names(bounds).join(", "))
        });
        tell(
            Code::NotFollowed,
            format!("at time {time}: {}{bounds}", missed.join(", ")),
            "control points that contradict each other, or more of them than parameters, are met as nearly as can be",
        );
    }
    if (step.vanished || step.full) && !before.lost {
        let message = match step.vanished {
            true => format!("at time {time} the surface has vanished: no floater is left"),
            false => format!(
                "at time {time} there are as many floaters as there may be, {}: the surface may be \
                 unbounded, and is not covered",
                simulation.followers().len()
            ),
        };
        tell(
            Code::LostSurface,
            message,
            "the simulation can go on; a surface that is there again is searched for",
        );
    }
    if step.followed.rough && !before.rough {
        tell(
            Code::LostSurface,
            format!(
                "at time {time} the surface moved by up to {:.3e} in one step, farther than floaters \
                 can follow: {} were lost",
                step.followed.farthest, step.followed.lost
            ),
            "take smaller steps",
        );
    }
    set.warned.set(Warned {
        missed: !missed.is_empty(),
        lost: step.vanished || step.full,
        rough: step.followed.rough,
    });
}

fn missed_pin(index: usize, state: PinState, residual: f64) -> String {
    match state {
        PinState::Undefined => {
            format!("the field is not a number at the control point {index}")
        }
        PinState::Unreachable => {
            format!("no free parameter moves the surface at the control point {index}")
        }
        PinState::Followed | PinState::Missed => {
            format!("the control point {index} is {residual:.2e} off the surface")
        }
    }
}

fn pin(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let set = simulation(arguments)?;
    let dimension = set.field.dimension();
    let value = match arguments.value("points") {
        samples @ Value::Samples(_) => samples,
        other => session.plain(other, arguments.place("points"))?,
    };
    let mut simulation = set.simulation.borrow_mut();
    if let Some(point) = vector_of(&value, dimension).filter(|point| point.is_finite()) {
        return Ok(Value::Number(simulation.pin(point) as f64));
    }
    let points =
        points_of(&value, dimension).filter(|points| points.iter().all(|point| point.is_finite()));
    let points = points.ok_or_else(|| {
        let expected = format!("a point of {dimension} finite coordinates, or a list of points");
        arguments.expected(&expected, "points", &value)
    })?;
    let numbers = points.into_iter().map(|point| simulation.pin(point) as f64);
    Ok(Value::numbers(numbers.collect::<Vec<_>>()))
}

fn drag(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let set = simulation(arguments)?;
    let index = index(session, arguments)?;
    let dimension = set.field.dimension();
    let to = session.plain(arguments.value("to"), arguments.place("to"))?;
    let goal = vector_of(&to, dimension).filter(|point| point.is_finite());
    let goal = goal.ok_or_else(|| {
        let expected = format!("a point of {dimension} finite coordinates");
        arguments.expected(&expected, "to", &to)
    })?;
    let time = arguments.number(session, "time")?.unwrap_or(0.0);
    if !(time >= 0.0 && time.is_finite()) {
        let message = format!("`time` must be at least 0 and finite, but it is {time}");
        return Err(arguments.bad("time", message));
    }
    let result = set.simulation.borrow_mut().drag(index, goal, time);
    result.map_err(|error| simulation_failure(&error, arguments))?;
    Ok(Value::Simulation(set))
}

fn release(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let set = simulation(arguments)?;
    let index = index(session, arguments)?;
    let result = set.simulation.borrow_mut().release(index);
    result.map_err(|error| simulation_failure(&error, arguments))?;
    Ok(Value::Simulation(set))
}

fn index(session: &mut Session, arguments: &Arguments) -> Outcome<usize> {
    let index = arguments.count(session, "index")?.unwrap_or(0);
    Ok(usize::try_from(index).unwrap_or(usize::MAX))
}

fn record(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let set = simulation(arguments)?;
    let every = arguments.count(session, "every")?.unwrap_or(1);
    if every == 0 {
        return Err(arguments.bad("every", "`every` must be at least 1".to_owned()));
    }
    set.simulation.borrow_mut().record(every);
    Ok(Value::Simulation(set))
}

fn fit(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let field = super::surfaces::field_argument(session, arguments, None)?;
    let compiled = field
        .compiled(&mut session.graph, session.parameters.values())
        .at(arguments.place("f"), "this field")?;
    let parameters = parameters_of(session, &compiled);
    let value = match arguments.value("points") {
        samples @ Value::Samples(_) => samples,
        other => session.plain(other, arguments.place("points"))?,
    };
    let dimension = field.dimension();
    let points = points_of(&value, dimension).ok_or_else(|| {
        let expected = format!("a list of points of {dimension} coordinates, or samples");
        arguments.expected(&expected, "points", &value)
    })?;
    if points.is_empty() {
        let message = "there is no point to fit the field to".to_owned();
        return Err(arguments.bad("points", message));
    }
    if parameters.is_empty() {
        let message = "the field has no parameters that could be fitted";
        let mut error =
            failure(Code::UnknownParameter, message).at(arguments.place("f"), "this field");
        error.help = Some("define some with `param name = value`".to_owned());
        return Err(error);
    }
    let mut options = FitOptions::default();
    if let Some(tolerance) = arguments.positive(session, "tolerance")? {
        options.tolerance = tolerance;
    }
    if let Some(iterations) = arguments.count(session, "iterations")? {
        options.iterations = usize::try_from(iterations).unwrap_or(usize::MAX);
    }
    let freedom = freedom(session, arguments, &parameters)?;
    let fit = motion::fit(&compiled, &points, &freedom, &options, &session.monitor())
        .map_err(|error| simulation_failure(&error.into(), arguments))?;
    if fit.end == motion::End::Cancelled {
        let cancelled = failure(Code::Cancelled, "the fit was cancelled");
        return Err(cancelled.at(arguments.span, "here"));
    }
    if !fit.converged() {
        let warning = Diagnostic::warning(Code::NotFollowed, why_not(&fit))
            .label(arguments.span, "fitted here")
            .help("start nearer to the points, with other parameters by `with`");
        session.host.warn(warning);
    }
    let places = parameters.iter().map(|(place, _)| *place);
    let set = FitSet {
        field: field.with(places.zip(fit.q.iter().copied())),
        names: parameters.into_iter().map(|(_, name)| name).collect(),
        fit,
    };
    Ok(Value::Fit(Rc::new(set)))
}

/// Why a fit is no solution.
fn why_not(fit: &motion::Fit) -> String {
    match fit.end {
        motion::End::Iterations => format!(
            "the fit did not come to an end in {} iterations; points are up to {:.2e} off",
            fit.iterations, fit.max
        ),
        motion::End::Flat => "the gradient of the field vanishes at all points, so that nothing \
                              tells where the surface should go"
            .to_owned(),
        motion::End::Undefined => "the field is not a number at any of the points".to_owned(),
        motion::End::Frozen => "there is no parameter that may change".to_owned(),
        _ => format!(
            "the fit found no better parameters, though points are up to {:.2e} off",
            fit.max
        ),
    }
}

fn simulation_failure(error: &SimulationError, arguments: &Arguments) -> Box<Diagnostic> {
    let message = error.to_string();
    match error {
        SimulationError::Sample(error) => sample_failure(error, arguments),
        SimulationError::Motion(_) => failure(Code::BadValue, message).at(arguments.span, "here"),
        SimulationError::NoPin { .. } => arguments.bad("index", message),
        SimulationError::TooLong { .. } => {
            let mut failure = failure(Code::ParticleLimit, message).at(arguments.span, "here");
            failure.help = Some(
                "record fewer frames, with a larger `every`, or raise it with `--limit particles=N`"
                    .into(),
            );
            failure
        }
    }
}
