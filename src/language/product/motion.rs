//! Surfaces that move, and fits: what `simulate` and `fit` make.

use std::cell::{Cell, RefCell};

use glam::DVec3;

use super::{Property, count, hidden, number, points, shown};
use crate::language::field::FieldValue;
use crate::language::value::Value;
use crate::motion::{End, Fit, Simulation, Solver, Step};
use crate::sample::Times;

/// A moving surface: the one value of the language that changes, by `step`, `pin` and the like.
pub struct SimulationSet {
    /// The surface with its floaters and control points.
    pub simulation: RefCell<Simulation>,
    /// What the last step did.
    pub last: RefCell<Option<Step>>,
    /// What was warned of, so that a loop of steps warns once of what lasts.
    pub warned: Cell<Warned>,
    /// The field, with the parameters of the beginning.
    pub field: FieldValue,
    /// The place in the session's q of each parameter of the field, and its name.
    pub parameters: Vec<(usize, String)>,
    /// The field as a function of time.
    pub motion: Option<Value>,
}

/// Of which troubles a person has been told.
#[derive(Clone, Copy, Debug, Default)]
pub struct Warned {
    /// Control points are not followed.
    pub missed: bool,
    /// The surface vanished, or may not be covered.
    pub lost: bool,
    /// A step was too large.
    pub rough: bool,
}

impl std::fmt::Debug for SimulationSet {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "a simulation of {:?}", self.field)
    }
}

/// A field that was fitted to points.
#[derive(Debug)]
pub struct FitSet {
    /// How it went.
    pub fit: Fit,
    /// The field with the parameters that were found.
    pub field: FieldValue,
    /// The names of the field's parameters.
    pub names: Vec<String>,
}

impl SimulationSet {
    /// The field with the present parameters.
    pub fn present(&self) -> FieldValue {
        let simulation = self.simulation.borrow();
        let places = self.parameters.iter().map(|(place, _)| *place);
        self.field.with(places.zip(simulation.q().iter().copied()))
    }

    /// The names of parameters at these places of the field's q.
    pub fn names(&self, places: &[usize]) -> Vec<String> {
        let names = places
            .iter()
            .filter_map(|&place| self.parameters.get(place));
        names.map(|(_, name)| name.clone()).collect()
    }
}

fn texts(names: impl IntoIterator<Item = String>) -> Value {
    Value::list(names.into_iter().map(Value::text).collect())
}

/// What the last step tells.
fn last<T>(set: &SimulationSet, tell: impl FnOnce(&Step) -> Option<T>) -> Option<T> {
    set.last.borrow().as_ref().and_then(tell)
}

fn solver(solver: Solver) -> Value {
    Value::text(match solver {
        Solver::Cholesky => "Cholesky",
        Solver::LeastSquares => "least squares",
    })
}

pub(super) const SIMULATION: &[Property<SimulationSet>] = &[
    shown("time", |set| number(set.simulation.borrow().time())),
    shown(
        "steps",
        |set| number(set.simulation.borrow().steps() as f64),
    ),
    shown("count", |set| {
        count(set.simulation.borrow().followers().len())
    }),
    shown("births", |set| {
        number(last(set, |step| Some(step.followed.births)).unwrap_or(0) as f64)
    }),
    shown("deaths", |set| {
        number(last(set, |step| Some(step.followed.deaths)).unwrap_or(0) as f64)
    }),
    shown("lost", |set| {
        number(last(set, |step| Some(step.followed.lost)).unwrap_or(0) as f64)
    }),
    shown("max_residual", |set| {
        let residuals = set.simulation.borrow().followers().samples().residuals;
        number(residuals.into_iter().fold(0.0, f64::max))
    }),
    shown("pins", |set| count(set.simulation.borrow().pins().len())),
    shown("pin_residual", |set| {
        let pins = set.simulation.borrow().pins();
        let residuals = pins.iter().map(|(_, _, residual)| *residual);
        let largest = |a: f64, b: f64| {
            if a.is_nan() || b.is_nan() {
                f64::NAN
            } else {
                a.max(b)
            }
        };
        (!pins.is_empty()).then(|| Value::Number(residuals.fold(0.0, largest)))
    }),
    shown("solver", |set| {
        last(set, |step| Some(solver(step.advance.as_ref()?.solver)))
    }),
    shown("rank", |set| {
        last(set, |step| count(step.advance.as_ref()?.rank))
    }),
    shown("at_bounds", |set| {
        let places = last(set, |step| Some(step.advance.as_ref()?.at_bounds.clone()));
        Some(texts(set.names(&places.unwrap_or_default())))
    }),
    shown("frames", |set| {
        let frames = set.simulation.borrow().frames().len();
        (frames > 0).then(|| Value::Number(frames as f64))
    }),
    hidden("surface", |set| Some(Value::Field(set.present()))),
    hidden("q", |set| {
        Some(Value::numbers(set.simulation.borrow().q().iter().copied()))
    }),
    hidden("names", |set| {
        Some(texts(set.parameters.iter().map(|(_, name)| name.clone())))
    }),
    hidden("points", |set| {
        let samples = set.simulation.borrow().followers().samples();
        Some(points(&samples.positions, samples.dimension))
    }),
    hidden("normals", |set| {
        let samples = set.simulation.borrow().followers().samples();
        Some(points(&samples.normals, samples.dimension))
    }),
    hidden("radii", |set| {
        let samples = set.simulation.borrow().followers().samples();
        Some(Value::numbers(samples.radii))
    }),
    hidden("residuals", |set| {
        let samples = set.simulation.borrow().followers().samples();
        Some(Value::numbers(samples.residuals))
    }),
    hidden("pinned", |set| {
        let pins = set.simulation.borrow().pins();
        let places: Vec<DVec3> = pins.iter().map(|(_, place, _)| *place).collect();
        Some(points(&places, set.field.dimension()))
    }),
    hidden("pin_residuals", |set| {
        let pins = set.simulation.borrow().pins();
        Some(Value::numbers(
            pins.iter().map(|(_, _, residual)| *residual),
        ))
    }),
    hidden("spacing", |set| {
        let samples = set.simulation.borrow().followers().samples();
        number(samples.spacing()?.mean)
    }),
    hidden("spacing_deviation", |set| {
        let samples = set.simulation.borrow().followers().samples();
        number(samples.spacing()?.deviation)
    }),
    hidden("spacing_min", |set| {
        let samples = set.simulation.borrow().followers().samples();
        number(samples.spacing()?.min)
    }),
    hidden("spacing_max", |set| {
        let samples = set.simulation.borrow().followers().samples();
        number(samples.spacing()?.max)
    }),
    hidden("evaluations", |set| {
        last(set, |step| number(step.followed.evaluations as f64))
    }),
    hidden("times", |set| {
        last(set, |step| Some(phases(&step.followed.times)))
    }),
];

/// Phases and the seconds that they took.
fn phases(Times(times): &Times) -> Value {
    let pair = |(phase, time): &(String, std::time::Duration)| {
        Value::list(vec![
            Value::text(&**phase),
            Value::Number(time.as_secs_f64()),
        ])
    };
    Value::list(times.iter().map(pair).collect())
}

pub(super) const FIT: &[Property<FitSet>] = &[
    shown("converged", |set| Some(Value::Bool(set.fit.converged()))),
    shown("residual", |set| defined(set, set.fit.rms)),
    shown("max_residual", |set| defined(set, set.fit.max)),
    shown("iterations", |set| count(set.fit.iterations)),
    shown("evaluations", |set| number(set.fit.evaluations as f64)),
    shown("rank", |set| count(set.fit.rank)),
    shown("undetermined", |set| named(set, &set.fit.undetermined)),
    shown("at_bounds", |set| named(set, &set.fit.at_bounds)),
    hidden("surface", |set| Some(Value::Field(set.field.clone()))),
    hidden("q", |set| Some(Value::numbers(set.fit.q.iter().copied()))),
    hidden("names", |set| Some(texts(set.names.iter().cloned()))),
];

/// A residual, unless there is no point at which the field is a number.
fn defined(set: &FitSet, residual: f64) -> Option<Value> {
    let known = set.fit.end != End::Undefined;
    known.then_some(Value::Number(residual))
}

/// The names of some parameters; nothing without any.
fn named(set: &FitSet, places: &[usize]) -> Option<Value> {
    let names = places.iter().filter_map(|&place| set.names.get(place));
    (!places.is_empty()).then(|| texts(names.cloned()))
}
