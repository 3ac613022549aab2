//! Fits, and what may change of a field's parameters.

use std::rc::Rc;

use super::samples::points_of;
use super::surfaces::field_argument;
use super::{Arguments, Builtin, action};
use crate::diagnostic::{Code, Diagnostic, suggest};
use crate::engine::CompiledField;
use crate::language::function::At;
use crate::language::parameters::components;
use crate::language::product::FitSet;
use crate::language::session::Session;
use crate::language::value::{Outcome, Value, failure};
use crate::motion::{self, End, Fit, FitOptions, Freedom};

pub(super) const TABLE: &[Builtin] = &[action(
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
)];

fn fit(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let field = field_argument(session, arguments, None)?;
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
        .map_err(|error| arguments.bad("f", error.to_string()))?;
    if fit.end == End::Cancelled {
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
fn why_not(fit: &Fit) -> String {
    match fit.end {
        End::Iterations => format!(
            "the fit did not come to an end in {} iterations; points are up to {:.2e} off",
            fit.iterations, fit.max
        ),
        End::Flat => "the gradient of the field vanishes at all points, so that nothing \
                              tells where the surface should go"
            .to_owned(),
        End::Undefined => "the field is not a number at any of the points".to_owned(),
        End::Frozen => "there is no parameter that may change".to_owned(),
        _ => format!(
            "the fit found no better parameters, though points are up to {:.2e} off",
            fit.max
        ),
    }
}

/// The places in the session's q of a field's parameters, and their names.
pub(super) fn parameters_of(session: &Session, field: &CompiledField) -> Vec<(usize, String)> {
    let places = field.program().parameters().iter();
    places
        .map(|&place| {
            let place = place as usize;
            (place, session.parameters.component_name(place))
        })
        .collect()
}

/// What may change: not what is frozen, and within the ranges.
pub(super) fn freedom(
    session: &mut Session,
    arguments: &Arguments,
    parameters: &[(usize, String)],
) -> Outcome<Freedom> {
    let mut freedom = Freedom::all(parameters.len());
    for (own, (place, _)) in parameters.iter().enumerate() {
        let covering = session.parameters.iter().find(|(_, parameter)| {
            let number = components(&parameter.value);
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
