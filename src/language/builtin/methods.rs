//! Which arguments of `sample` and `polygonize` belong to which of their methods.

use super::Arguments;
use crate::language::value::Outcome;
use crate::polygonize;
use crate::sample::Method;

/// Those that spread by repulsion, and those that are released.
const FLOATING: &[Method] = &[Method::Floaters, Method::Relax];
const FLYING: &[Method] = &[Method::Kinematic, Method::Dynamic];

/// The arguments that not every method knows, with those that do. `spacing`, `exact`, `sigma` and
/// `adapt` depend on other arguments, too, and are checked by the samplers.
pub(super) const SAMPLERS: &[(&str, &[Method])] = &[
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

/// The same for polygonizers.
pub(super) const POLYGONIZERS: &[(&str, &[polygonize::Method])] = &[
    ("ambiguity", &[polygonize::Method::Squares]),
    ("split", &[polygonize::Method::Tetrahedra]),
    (
        "error",
        &[polygonize::Method::Quadtree, polygonize::Method::Octree],
    ),
    ("seeds", &[polygonize::Method::Continuation]),
    ("snap", &[polygonize::Method::Cubes]),
    ("samples", &[polygonize::Method::Delaunay]),
];

/// Refuses arguments that the method would ignore.
pub(super) fn check<M: Copy + PartialEq>(
    arguments: &Arguments,
    method: M,
    table: &[(&str, &[M])],
    name_of: fn(M) -> &'static str,
) -> Outcome<()> {
    let foreign = table
        .iter()
        .find(|(name, methods)| arguments.given(name).is_some() && !methods.contains(&method));
    let Some((name, methods)) = foreign else {
        return Ok(());
    };
    let methods: Vec<String> = methods
        .iter()
        .map(|method| format!("\"{}\"", name_of(*method)))
        .collect();
    let message = format!(
        "`{name}` has no meaning with the method \"{}\": it is for {}",
        name_of(method),
        methods.join(" and ")
    );
    Err(arguments.bad(name, message))
}
