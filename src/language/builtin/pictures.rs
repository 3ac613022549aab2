//! Pictures as a function of the language.

use std::path::PathBuf;
use std::rc::Rc;

use glam::DVec3;

use super::script::{output_path, write, write_by};
use super::surfaces::{box_of, compiled_argument};
use super::{Arguments, Builtin, action};
use crate::diagnostic::{Code, Diagnostic};
use crate::engine::Field;
use crate::file::{self, Format, check_writable};
use crate::geometry::{Animation, Bounds, Curves, Mesh};
use crate::language::field::bounds_of;
use crate::language::function::At;
use crate::language::product::{FallSet, ImageSet, SimulationSet};
use crate::language::session::Session;
use crate::language::value::{Outcome, Value, failure};
use crate::picture::{self, Options, Picture, PictureError, Scene, Size, Style, View};

/// Frames a second of an animation.
const FRAMES: f64 = 25.0;

pub(super) const TABLE: &[Builtin] = &[action(
    "plot",
    &[
        "f",
        "path =",
        "size = 512",
        "bounds =",
        "style = \"shaded\"",
        "step =",
        "view = \"isometric\"",
        "perspective =",
        "whole = false",
        "occlusion = false",
        "samples = 2",
        "transparent = false",
        "fps = 25",
    ],
    "A picture of a field, of samples, of a mesh, of a simulation or of a fall, written to a PNG file if a path is given: of a field a graph in R1, a map in R2 (style \"shaded\", with contour lines every `step`, or \"fill\"), a lit solid in R3; of samples dots in R2, and in R3 lit disks on the surface, as large as their radii. Of a simulation that is recorded it makes an animated PNG, `fps` frames a second, with control points as balls, and gives the last frame; so it does of a fall, with the ground. `size` is the longer side in pixels, or [width, height]. The box is `bounds`, or what `over` says, or one around the whole zero set; what it cuts off a solid is shown flat. A solid is seen from \"isometric\", \"front\", \"back\", \"left\", \"right\", \"top\", \"bottom\" or [azimuth, elevation], with parallel rays or with `perspective`, an angle of view; `whole = true` shows all of the box, `occlusion = true` darkens corners, `samples` squared rays go through a pixel.",
    plot,
)];

fn plot(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let path = output_path(session, arguments)?;
    if let Some(path) = &path {
        // What cannot be written is said before the work.
        let made = session.output_directories.first().map(PathBuf::as_path);
        Format::for_kind(path, "pictures")
            .and_then(|_| check_writable(path, made))
            .map_err(|error| {
                super::file_failure(&error).at(arguments.place("path"), "this file")
            })?;
    }
    let (mut pictures, dimension) = match arguments.value("f") {
        Value::Samples(set) => {
            let scene = Scene {
                samples: &set.samples,
                marks: &[],
            };
            (
                of_scenes(session, arguments, &[scene])?,
                set.samples.dimension,
            )
        }
        Value::Simulation(set) => (
            of_simulation(session, arguments, &set)?,
            set.field.dimension(),
        ),
        Value::Mesh(set) => {
            let meshes = std::slice::from_ref(&set.mesh);
            (of_meshes(session, arguments, meshes, false)?, 3)
        }
        Value::Fall(set) => (of_fall(session, arguments, &set)?, set.fall.dimension),
        _ => {
            let (picture, dimension) = of_field(session, arguments)?;
            (vec![picture], dimension)
        }
    };
    let delay = delay(session, arguments)?;
    let Some(picture) = pictures.pop() else {
        return Ok(Value::Nothing);
    };
    if let Some(path) = path.as_ref().filter(|_| !pictures.is_empty()) {
        let frames = pictures.into_iter().chain([picture.clone()]);
        let frames = frames.map(|picture| picture.image).collect();
        let animation = Animation { frames, delay };
        write_by(session, arguments, path, |path, left| {
            Some(file::write_animation(path, &animation, left))
        })?;
        return Ok(Value::Image(Rc::new(ImageSet { picture, dimension })));
    }
    let value = Value::Image(Rc::new(ImageSet { picture, dimension }));
    if let Some(path) = path {
        write(session, arguments, &path, &value)?;
    }
    Ok(value)
}

/// How long a frame of an animation is shown, in thousandths of a second.
fn delay(session: &mut Session, arguments: &Arguments) -> Outcome<u16> {
    let rate = arguments.positive(session, "fps")?.unwrap_or(FRAMES);
    if !(1.0..=1000.0).contains(&rate) {
        let message = format!("`fps` must be from 1 to 1000, but it is {rate}");
        return Err(arguments.bad("fps", message));
    }
    Ok((1000.0 / rate).round() as u16)
}

/// A picture of a field, and its dimension.
fn of_field(session: &mut Session, arguments: &Arguments) -> Outcome<(Picture, usize)> {
    let (field, bounds) = compiled_argument(session, arguments)?;
    let bounds = box_of(&field, 0.0, bounds, arguments, &session.monitor())?;
    let options = options(session, arguments, bounds)?;
    let picture = picture::render(&field, &options, &session.monitor())
        .map_err(|error| picture_failure(&error, arguments))?;
    let dimension = field.dimension();
    warn(session, arguments, &picture, dimension);
    Ok((picture, dimension))
}

/// Pictures of the frames of a simulation or, if nothing was recorded, of how it is.
fn of_simulation(
    session: &mut Session,
    arguments: &Arguments,
    set: &SimulationSet,
) -> Outcome<Vec<Picture>> {
    let simulation = set.simulation.borrow();
    let now;
    let frames = match simulation.frames() {
        [] => {
            now = [simulation.frame()];
            &now[..]
        }
        frames => frames,
    };
    let scenes: Vec<Scene<'_>> = frames
        .iter()
        .map(|frame| Scene {
            samples: &frame.samples,
            marks: &frame.pins,
        })
        .collect();
    of_scenes(session, arguments, &scenes)
}

/// Pictures of samples.
fn of_scenes(
    session: &mut Session,
    arguments: &Arguments,
    scenes: &[Scene<'_>],
) -> Outcome<Vec<Picture>> {
    let dimension = scenes.first().map_or(3, |scene| scene.samples.dimension);
    for name in ["style", "step"] {
        if arguments.given(name).is_some() {
            let message = format!("`{name}` is for pictures of fields, not of samples");
            return Err(arguments.bad(name, message));
        }
    }
    let given = arguments.plain(session, "bounds")?;
    let bounds = match given {
        Some(given) => bounds_of(&given, dimension).at(arguments.place("bounds"), "here")?,
        None => picture::box_around(scenes).ok_or_else(|| {
            let message = "there are no samples to be shown".to_owned();
            arguments.bad("f", message)
        })?,
    };
    let options = options(session, arguments, bounds)?;
    picture::render_samples(scenes, &options).map_err(|error| picture_failure(&error, arguments))
}

/// Pictures of the frames of a fall.
fn of_fall(session: &mut Session, arguments: &Arguments, set: &FallSet) -> Outcome<Vec<Picture>> {
    let fall = &set.fall;
    if fall.dimension == 3 {
        let meshes: Vec<Mesh> = fall.frames.iter().map(|frame| fall.mesh(frame)).collect();
        return of_meshes(session, arguments, &meshes, true);
    }
    let curves: Vec<Curves> = fall.frames.iter().map(|frame| fall.curves(frame)).collect();
    let points = curves.iter().flat_map(|curves| &curves.polylines);
    let points = points.flat_map(|polyline| &polyline.points).copied();
    let bounds = shown_box(session, arguments, 2, points)?;
    let options = options(session, arguments, bounds)?;
    picture::render_outlines(&curves, true, &options)
        .map_err(|error| picture_failure(&error, arguments))
}

/// Pictures of meshes, on the ground or not.
fn of_meshes(
    session: &mut Session,
    arguments: &Arguments,
    meshes: &[Mesh],
    ground: bool,
) -> Outcome<Vec<Picture>> {
    let points = meshes.iter().flat_map(|mesh| &mesh.positions).copied();
    let bounds = shown_box(session, arguments, 3, points)?;
    let options = options(session, arguments, bounds)?;
    picture::render_meshes(meshes, ground, &options)
        .map_err(|error| picture_failure(&error, arguments))
}

/// The box that was asked for, or one around these points.
fn shown_box(
    session: &mut Session,
    arguments: &Arguments,
    dimension: usize,
    points: impl Iterator<Item = DVec3>,
) -> Outcome<Bounds> {
    for name in ["style", "step"] {
        if arguments.given(name).is_some() {
            let message = format!("`{name}` is for pictures of fields");
            return Err(arguments.bad(name, message));
        }
    }
    match arguments.plain(session, "bounds")? {
        Some(given) => bounds_of(&given, dimension).at(arguments.place("bounds"), "here"),
        None => picture::box_around_points(dimension, points).ok_or_else(|| {
            let message = "there is nothing to be shown".to_owned();
            arguments.bad("f", message)
        }),
    }
}

fn options(session: &mut Session, arguments: &Arguments, bounds: Bounds) -> Outcome<Options> {
    let mut options = Options::new(bounds);
    if let Some(size) = size(session, arguments)? {
        options.size = size;
    }
    match arguments.text("style")?.as_deref() {
        None | Some("shaded") => {}
        Some("fill") => options.style = Style::Fill,
        Some(other) => {
            let message = format!("`style` must be \"shaded\" or \"fill\", not \"{other}\"");
            return Err(arguments.bad("style", message));
        }
    }
    options.step = arguments.positive(session, "step")?;
    if let Some(view) = view(session, arguments)? {
        options.view = view;
    }
    options.perspective = arguments.positive(session, "perspective")?;
    if let Some(samples) = arguments.count(session, "samples")? {
        options.samples = usize::try_from(samples).unwrap_or(usize::MAX);
    }
    let switches = [
        ("whole", &mut options.whole),
        ("occlusion", &mut options.occlusion),
        ("transparent", &mut options.transparent),
    ];
    for (name, switch) in switches {
        if let Some(value) = arguments.bool(session, name)? {
            *switch = value;
        }
    }
    Ok(options)
}

/// A whole number of pixels, or one for each side.
fn size(session: &mut Session, arguments: &Arguments) -> Outcome<Option<Size>> {
    let Some(value) = arguments.plain(session, "size")? else {
        return Ok(None);
    };
    let whole = |value: &Value| match value {
        Value::Number(number) if *number >= 0.0 && number.floor() == *number => {
            // Too large a number stays too large.
            Some(*number as usize)
        }
        _ => None,
    };
    let size = match &value {
        Value::List(sides) => match (sides.len(), sides.iter().map(whole).collect()) {
            (2, Some::<Vec<usize>>(sides)) => Some(Size::Exact([sides[0], sides[1]])),
            _ => None,
        },
        other => whole(other).map(Size::Longest),
    };
    size.map(Some).ok_or_else(|| {
        let message = "`size` must be a whole number of pixels, or [width, height]";
        arguments.bad("size", message.into())
    })
}

/// A view by its name or by its angles.
fn view(session: &mut Session, arguments: &Arguments) -> Outcome<Option<View>> {
    let angles = match arguments.plain(session, "view")? {
        None => return Ok(None),
        Some(Value::Text(name)) => {
            return View::named(&name).map(Some).ok_or_else(|| {
                let names: Vec<&str> = View::names().collect();
                let message = format!("there is no view \"{name}\"");
                let mut error = arguments.bad("view", message);
                error.help = Some(format!(
                    "the views are {}; or give [azimuth, elevation], as in [30deg, 20deg]",
                    names.join(", ")
                ));
                error
            });
        }
        Some(Value::List(angles)) => angles,
        Some(other) => return Err(arguments.expected("a string or two angles", "view", &other)),
    };
    match &angles[..] {
        [Value::Number(azimuth), Value::Number(elevation)] => Ok(Some(View {
            azimuth: *azimuth,
            elevation: *elevation,
        })),
        _ => Err(arguments.bad(
            "view",
            "`view` must be a name or [azimuth, elevation]".into(),
        )),
    }
}

fn picture_failure(error: &PictureError, arguments: &Arguments) -> Box<Diagnostic> {
    let message = error.to_string();
    match error {
        PictureError::BadOption { option, .. } => arguments.bad(option, message),
        PictureError::WrongDimension { .. } => {
            failure(Code::WrongDimension, message).at(arguments.span, "here")
        }
        PictureError::Cancelled => failure(Code::Cancelled, message).at(arguments.span, "here"),
    }
}

fn warn(session: &mut Session, arguments: &Arguments, picture: &Picture, dimension: usize) {
    let statistics = &picture.statistics;
    let mut warn = |code, message: String, help: &str| {
        let warning = Diagnostic::warning(code, message)
            .label(arguments.span, "drawn here")
            .help(help);
        session.host.warn(warning);
    };
    if statistics.undefined > 0 {
        let (kind, shown) = match dimension {
            3 => ("points that were looked at", "which count as outside"),
            2 => ("pixels", "which are grey"),
            _ => ("points", "where there is no curve"),
        };
        warn(
            Code::NanRegion,
            format!(
                "the field is not a number at {} {kind}, {shown}",
                statistics.undefined
            ),
            "look for square roots and logarithms of negative numbers, and for 0/0",
        );
    }
    if statistics.jumps > 0 {
        warn(
            Code::PoorRoots,
            format!(
                "{} of the rays end where the field jumps below 0, has a pole or begins to be \
                 defined, not at a zero; that is drawn grey",
                statistics.jumps
            ),
            "a pole such as 1/x changes its sign without a zero",
        );
    }
    if dimension == 3 && statistics.covered == 0.0 {
        warn(
            Code::NothingSeen,
            "nothing is seen: no ray meets the inside of the field in the box".into(),
            "enlarge the box, check the sign of the field, or use more pixels for what is thin",
        );
    }
}
