//! Which arguments of `sample` belong to which of its methods.

use super::Arguments;
use crate::language::value::Outcome;
use crate::sample::Method;

/// Those that spread by repulsion, and those that are released.
const FLOATING: &[Method] = &[Method::Floaters, Method::Relax];
const FLYING: &[Method] = &[Method::Kinematic, Method::Dynamic];

/// The arguments that not every method knows, with those that do. `spacing`, `exact`, `sigma` and
/// `adapt` depend on other arguments, too, and are checked by the samplers.
const TABLE: &[(&str, &[Method])] = &[
    ("seeds", FLOATING),
    ("friction", &[Method::Dynamic]),
    ("potential", FLYING),
    ("direction", &[Method::Rays]),
    ("sigma_max", FLOATING),
    ("time_step", FLOATING),
    ("phi", FLOATING),
    ("rho", FLOATING),
    ("alpha", FLOATING),
    ("energy", FLOATING),
    ("beta", FLOATING),
    ("gamma", FLOATING),
    ("nu", FLOATING),
    ("delta", FLOATING),
];

/// Refuses arguments that the method would ignore.
pub(super) fn check(arguments: &Arguments, method: Method) -> Outcome<()> {
    let foreign = TABLE
        .iter()
        .find(|(name, methods)| arguments.given(name).is_some() && !methods.contains(&method));
    let Some((name, methods)) = foreign else {
        return Ok(());
    };
    let methods: Vec<String> = methods
        .iter()
        .map(|method| format!("\"{}\"", method.name()))
        .collect();
    let message = format!(
        "`{name}` has no meaning with the method \"{}\": it is for {}",
        method.name(),
        methods.join(" and ")
    );
    Err(arguments.bad(name, message))
}
