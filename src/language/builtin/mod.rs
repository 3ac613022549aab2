//! The functions that the language brings along.
//!
//! Each is one entry of a table: name, parameters, documentation, and a function that checks
//! its arguments and calls the room that does the work. The elementary functions come straight from
//! the table of operations; other mathematics is composed of them.

mod arguments;
mod calculus;
mod choices;
mod elastic;
mod extent;
mod fit;
mod geometry;
mod inspection;
mod lists;
mod mathematics;
mod meshes;
mod methods;
mod motion;
mod pictures;
mod samples;
mod script;
mod surfaces;

use std::sync::LazyLock;
use std::time::Instant;

pub use arguments::Arguments;
pub use choices::choices;
pub(crate) use script::file_failure;

use super::function::Argument;
use super::session::Session;
use super::value::{Outcome, Value};
use crate::graph::Op;

/// One function of the program.
pub struct Builtin {
    /// Its name in the language.
    pub name: &'static str,
    /// Its parameters in order: `name` is required, `name = default` is not, and `name…`, which
    /// can only be the last without a default, takes any number.
    pub parameters: &'static [&'static str],
    /// What it gives, in a sentence or two.
    pub documentation: &'static str,
    /// Whether it does something besides giving a value, or takes long: such a function cannot
    /// stand in a field, and is not run by `imp check`.
    pub acts: bool,
    /// Whether it is defined on numbers and goes over to lists, fields and functions: of a
    /// function it makes one.
    pub lifts: bool,
    /// Does it.
    pub call: Call,
}

/// How a builtin does its work.
#[derive(Clone, Copy)]
pub enum Call {
    /// By this function.
    Function(Function),
    /// By applying an operation of the table, elementwise.
    Operation(Op),
}

/// The constants of the language.
pub const CONSTANTS: &[(&str, f64)] = &[
    ("pi", std::f64::consts::PI),
    ("π", std::f64::consts::PI),
    ("tau", std::f64::consts::TAU),
    ("τ", std::f64::consts::TAU),
    ("phi", GOLDEN_RATIO),
    ("φ", GOLDEN_RATIO),
    ("e", std::f64::consts::E),
    ("inf", f64::INFINITY),
    ("nan", f64::NAN),
];

const GOLDEN_RATIO: f64 = 1.618_033_988_749_895;

/// The tables, with what they are about.
const SECTIONS: &[(&str, &[Builtin])] = &[
    ("Numbers and vectors", mathematics::TABLE),
    ("Lists", lists::TABLE),
    ("Derivatives", calculus::TABLE),
    ("Differential geometry", geometry::TABLE),
    ("Samples", samples::TABLE),
    ("Motion and control", motion::TABLE),
    ("Fitting", fit::TABLE),
    ("Solids as tetrahedra, and such that fall", elastic::TABLE),
    ("Meshes, curves and measures", surfaces::TABLE),
    ("Meshes measured and made anew", meshes::TABLE),
    ("Boxes", extent::TABLE),
    ("Pictures", pictures::TABLE),
    ("Inspection", inspection::TABLE),
    ("Scripts", script::TABLE),
];

static ALL: LazyLock<Vec<&'static Builtin>> = LazyLock::new(|| {
    let tables = SECTIONS.iter().flat_map(|(_, table)| *table);
    tables.chain(mathematics::operations()).collect()
});

impl std::fmt::Debug for Builtin {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}", arguments::signature(self))
    }
}

impl Builtin {
    /// How the function is called: `name(parameters)`.
    pub fn signature(&self) -> String {
        arguments::signature(self)
    }

    /// Calls it.
    pub(super) fn apply(&self, session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
        match self.call {
            Call::Function(function) if self.acts => {
                let begun = Instant::now();
                let result = function(session, arguments);
                session.spend(self.name, begun.elapsed());
                result
            }
            Call::Function(function) => function(session, arguments),
            Call::Operation(op) => mathematics::apply_operation(session, op, arguments),
        }
    }
}

type Function = fn(&mut Session, &Arguments) -> Outcome<Value>;

/// A table's entry that only gives a value.
const fn pure(
    name: &'static str,
    parameters: &'static [&'static str],
    documentation: &'static str,
    call: Function,
) -> Builtin {
    Builtin {
        name,
        parameters,
        documentation,
        acts: false,
        lifts: false,
        call: Call::Function(call),
    }
}

/// A table's entry for a mathematical function.
const fn mathematical(
    name: &'static str,
    parameters: &'static [&'static str],
    documentation: &'static str,
    call: Function,
) -> Builtin {
    Builtin {
        lifts: true,
        ..pure(name, parameters, documentation, call)
    }
}

/// A table's entry that acts.
const fn action(
    name: &'static str,
    parameters: &'static [&'static str],
    documentation: &'static str,
    call: Function,
) -> Builtin {
    Builtin {
        acts: true,
        ..pure(name, parameters, documentation, call)
    }
}

/// All functions, in the order of their tables.
pub fn all() -> &'static [&'static Builtin] {
    &ALL
}

/// All functions by what they are about: a title and a table each, the elementary functions first.
pub fn sections() -> impl Iterator<Item = (&'static str, &'static [Builtin])> {
    let elementary = ("Elementary functions", mathematics::operations());
    std::iter::once(elementary).chain(SECTIONS.iter().copied())
}

/// Of two functions of one name the one that the arguments are for: `step` lets a simulation go on, and is
/// GLSL's step of numbers.
pub(in crate::language) fn suited(
    builtin: &'static Builtin,
    arguments: &[Argument],
    outside_of_fields: bool,
) -> &'static Builtin {
    let moves = |builtin: &Builtin| builtin.parameters.first() == Some(&"sim");
    let is_simulation = |argument: &Argument| matches!(argument.value, Value::Simulation(_));
    // What is unknown outside of fields is what a script's action would have made.
    let first = arguments.first().map(|argument| &argument.value);
    let of_simulation = arguments.iter().any(is_simulation)
        || (outside_of_fields && matches!(first, Some(Value::Unknown)));
    if builtin.name != motion::STEP || moves(builtin) == of_simulation {
        return builtin;
    }
    let mut others = all().iter().copied();
    let other = others.find(|other| other.name == builtin.name && moves(other) == of_simulation);
    other.unwrap_or(builtin)
}

/// The function of that name.
pub fn find(name: &str) -> Option<&'static Builtin> {
    all().iter().copied().find(|builtin| builtin.name == name)
}
