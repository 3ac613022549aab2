//! Solids as tetrahedra, and solids that fall, as functions of the language.

use std::rc::Rc;

use super::surfaces::{box_of, compiled_argument};
use super::{Arguments, Builtin, action};
use crate::diagnostic::{Code, Diagnostic};
use crate::elastic::{Division, Drop, ElasticError, Fall, Lattice, Remarks};
use crate::engine::CompiledField;
use crate::geometry::Bounds;
use crate::language::function::At;
use crate::language::product::{FallSet, SolidSet};
use crate::language::session::Session;
use crate::language::value::{Outcome, Value, failure};

pub(super) const TABLE: &[Builtin] = &[
    action(
        "tetrahedralize",
        &["f", "cell =", "bounds ="],
        "The solid f < 0 as tetrahedra, in R2 as triangles (the adapted triangulation of a solid of Velho, Gomes and Terzopoulos): Freudenthal's triangulation of cells of the side `cell`, by default a twelfth of the longest side of the box, is restricted to the solid, its outer nodes are put on f = 0, and springs even it out, those inside with a tenth of the stiffness. Of sharp edges up to half of the square of a cell is lost. It tells `nodes`, `tetrahedra` (in R2 `triangles`), `pieces`, `euler`, `volume` and the `area` of the boundary (in R2 `area` and `length`); the radius ratios, 1 for the regular simplex: `mean_ratio`, `hundredth_ratio` (one in a hundred is worse), `worst_ratio`; `off_surface`, how many nodes of the boundary could not be put on f = 0; and `steps`, `at_rest` and `energy` of the springs. `boundary` is a mesh (in R2 curves), `points` are the nodes, `cells` the nodes of each simplex. `export(solid, \"name.vtu\")` writes it.",
        tetrahedralize,
    ),
    action(
        "drop",
        &[
            "f",
            "height = 1",
            "time = 3",
            "cell =",
            "stiffness =",
            "damping = 0.01",
            "restitution = 0.7",
            "friction = 0.5",
            "gravity = 9.81",
            "density = 1",
            "bounds =",
            "every = 0.04",
        ],
        "Lets the solid f < 0 fall on the ground, z = 0 (in R2 y = 0), from where its lowest point is `height` above it: a lattice of springs and masses (Velho, Gomes and Terzopoulos), with cells of the side `cell`, by default a twelfth of the longest side of the box. `stiffness` is about Young's modulus, by default 100 density·gravity·(height + the solid's own), which makes it look like rubber; `damping` the share of critical damping of the slowest vibration; `restitution`, from 0.1 to 1, the part of its speed that a stiff solid keeps in an impact. A stable step of time is found. It tells `frames`, one every so much time, `nodes`, `tetrahedra`, `springs`, `step`, `lowest`, `bounces`, `energy` (a list of [time, kinetic, elastic, gravity, lost]), `energy_error`, and the boundary: `mesh` and `meshes`, the last and all frames, in R2 `curves`. `plot(fall, \"film.png\")` writes an animated picture, `export(fall, \"frames.ply\")` a file for each frame.",
        drop,
    ),
];

/// The lattice of the solid, and the box in which it is.
fn lattice_of(
    session: &mut Session,
    arguments: &Arguments,
) -> Outcome<(CompiledField, Bounds, Lattice)> {
    let (field, given) = compiled_argument(session, arguments)?;
    let is_found = given.is_none();
    let bounds = box_of(&field, 0.0, given, arguments, &session.monitor())?;
    let mut division = Division::new(bounds);
    if let Some(cell) = arguments.positive(session, "cell")? {
        division.cell = cell;
    }
    let most = usize::try_from(session.limits.cells).unwrap_or(usize::MAX);
    division.cell_limit = division.cell_limit.min(most);
    let lattice = Lattice::new(&field, &division, &session.monitor());
    let lattice = match lattice {
        Err(ElasticError::Full { .. }) if is_found => return Err(inside_out(arguments)),
        lattice => lattice.map_err(|error| elastic_failure(&error, arguments))?,
    };
    if is_found && lattice.remarks.cut > 0 {
        return Err(inside_out(arguments));
    }
    Ok((field, bounds, lattice))
}

fn tetrahedralize(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let (field, bounds, mut lattice) = lattice_of(session, arguments)?;
    let relaxation = lattice.relax(&field, &bounds, &session.monitor());
    let relaxation = relaxation.map_err(|error| elastic_failure(&error, arguments))?;
    warn_about_lattice(session, arguments, &lattice.remarks);
    Ok(Value::Solid(Rc::new(SolidSet::new(lattice, relaxation))))
}

fn drop(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let (_, _, lattice) = lattice_of(session, arguments)?;
    let density = arguments.positive(session, "density")?.unwrap_or(1.0);
    let gravity = arguments.positive(session, "gravity")?.unwrap_or(9.81);
    let height = arguments.number(session, "height")?.unwrap_or(1.0);
    let failed = |error: ElasticError| elastic_failure(&error, arguments);
    let mut drop = Drop::new(&lattice, density, gravity, height);
    if let Some(stiffness) = arguments.positive(session, "stiffness")? {
        drop.material.stiffness = stiffness;
        drop.material.volume_stiffness = stiffness;
    }
    let numbers = [
        ("damping", &mut drop.material.damping),
        ("restitution", &mut drop.ground.restitution),
        ("friction", &mut drop.ground.friction),
        ("time", &mut drop.time),
        ("every", &mut drop.every),
    ];
    for (name, number) in numbers {
        if let Some(value) = arguments.number(session, name)? {
            *number = value;
        }
    }
    drop.point_limit = session.limits.particles;
    let fall = Fall::new(&lattice, &drop, &session.monitor()).map_err(failed)?;
    warn(session, arguments, &fall);
    Ok(Value::Fall(Rc::new(FallSet { fall })))
}

/// The proven box holds all zeros, but the solid leaves it.
fn inside_out(arguments: &Arguments) -> Box<Diagnostic> {
    let message = "the field is negative (inside) outside of its zero set: the solid is unbounded";
    let mut error = arguments.bad("f", message.to_owned());
    error.help = Some("turn the sign of the field, or cut it off by `bounds`".to_owned());
    error
}

fn elastic_failure(error: &ElasticError, arguments: &Arguments) -> Box<Diagnostic> {
    let message = error.to_string();
    let helped = |mut failure: Box<Diagnostic>, help: &str| {
        failure.help = Some(help.to_owned());
        failure
    };
    let at_call = |code| failure(code, message.clone()).at(arguments.span, "here");
    match error {
        ElasticError::Dimension { .. } => at_call(Code::WrongDimension),
        ElasticError::Cell { .. } => arguments.bad("cell", message),
        ElasticError::TooManyCells { .. } => helped(
            at_call(Code::CellLimit),
            "use larger cells or a smaller box",
        ),
        ElasticError::Empty { .. } => helped(
            at_call(Code::NoSurface),
            "use smaller cells for what is thin, a larger box, or turn the sign of the field",
        ),
        ElasticError::Full { .. } => helped(
            at_call(Code::NoSurface),
            "enlarge the box, or turn the sign of the field",
        ),
        ElasticError::Thin { .. } => helped(at_call(Code::NoSurface), "use smaller cells"),
        ElasticError::Number { name, .. } => arguments.bad(name, message),
        ElasticError::TooManySteps { .. } => helped(
            arguments.bad("stiffness", message),
            "use a smaller stiffness or damping, larger cells, or a shorter time",
        ),
        ElasticError::TooManyPoints { .. } => helped(
            at_call(Code::ParticleLimit),
            "use larger cells or a larger `every`, or raise it with `--limit particles=N`",
        ),
        ElasticError::Cancelled => at_call(Code::Cancelled),
    }
}

/// Says where the field or the box leave something to be wished.
fn warn_about_lattice(session: &mut Session, arguments: &Arguments, remarks: &Remarks) {
    let mut warn = |code, message: String, help: &str| {
        let warning = Diagnostic::warning(code, message)
            .label(arguments.span, "made here")
            .help(help);
        session.host.warn(warning);
    };
    if remarks.undefined > 0 {
        warn(
            Code::NanRegion,
            format!(
                "the field is not a number at {} points of the grid, which count as outside",
                remarks.undefined
            ),
            "look for square roots and logarithms of negative numbers, and for 0/0",
        );
    }
    if remarks.cut > 0 {
        warn(
            Code::CutByBox,
            "the box cuts the solid, which ends there".to_owned(),
            "enlarge the box if the whole of it is wanted",
        );
    }
}

fn warn(session: &mut Session, arguments: &Arguments, fall: &Fall) {
    warn_about_lattice(session, arguments, &fall.remarks);
    let mut warn = |code, message: String, help: &str| {
        let warning = Diagnostic::warning(code, message)
            .label(arguments.span, "dropped here")
            .help(help);
        session.host.warn(warning);
    };
    let stiffer = "make it stiffer by a larger `stiffness`, or let it fall from a lower `height`";
    if let Some(time) = fall.broken {
        warn(
            Code::CrushedSolid,
            format!("the fall ends at time {time:.3}, because its energy is no longer kept"),
            stiffer,
        );
    } else if fall.inverted > 0 {
        let kind = if fall.dimension == 2 {
            "triangles"
        } else {
            "tetrahedra"
        };
        warn(
            Code::CrushedSolid,
            format!("the impact turns up to {} {kind} inside out", fall.inverted),
            stiffer,
        );
    }
}
