//! Surfaces that move: simulations and control points as functions of the language.

use std::cell::{Cell, RefCell};
use std::rc::Rc;
use std::sync::Arc;

use super::fit::{freedom, parameters_of};
use super::samples::{points_of, proven_box, sample_failure, vector_of, warn_about_samples};
use super::surfaces::located_argument;
use super::{Arguments, Builtin, action};
use crate::diagnostic::{Code, Diagnostic};
use crate::engine::{CompiledField, Field, Monitor};
use crate::language::field::FieldValue;
use crate::language::function::{Argument, At};
use crate::language::product::{SimulationSet, Warned};
use crate::language::session::Session;
use crate::language::value::{Outcome, Value, failure};
use crate::motion::{Measure, Metric, PinState, Setting, Simulation, SimulationError, Step};
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
            None => proven_box(&compiled, arguments, &session.monitor())?,
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
    let program = Arc::clone(compiled.program());
    let q = compiled.parameters().to_vec();
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
        None => compiled.parameters().to_vec(),
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
