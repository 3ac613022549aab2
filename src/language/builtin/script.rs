//! What a script does: print, assert, export, load.

use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::{Arguments, Builtin, action, pure};
use crate::diagnostic::{Code, Diagnostic, Span, shorten};
use crate::file::{self, Allowed, FileError, Loaded, Outline};
use crate::language::arithmetic::value_of_node;
use crate::language::field::FieldValue;
use crate::language::function::{At, FunctionValue};
use crate::language::json::json;
use crate::language::product::{self, MeshSet};
use crate::language::session::Session;
use crate::language::settings::quoted;
use crate::language::show::show;
use crate::language::tracer::first_axis;
use crate::language::value::{Outcome, Value, failure};

pub(super) const TABLE: &[Builtin] = &[
    action(
        "print",
        &["values…"],
        "Writes a line to standard output: the values, with spaces between them.",
        |session, arguments| {
            let mut words = Vec::new();
            for argument in arguments.rest() {
                let plain = session.plain(argument.value.clone(), argument.span)?;
                words.push(show(&plain, None));
            }
            print(session, arguments, &words.join(" "))
        },
    ),
    pure(
        "assert",
        &["condition", "message ="],
        "Ends the program with an error unless the condition holds. In a field a condition on parameters is tested at their present values, and one on the point not at all.",
        assert,
    ),
    action(
        "export",
        &["value", "path"],
        "Writes a mesh, curves, samples, a solid or an image to a file below the output directory, in the format that the extension names: .obj .stl .ply .off .glb .3mf .vtp .vtu .csv .svg .dxf .png. With the extension .certificate it writes the proof of what `polygonize` made by the method `\"certified\"`. Of a simulation that is recorded, and of a fall, it writes a file for each frame, `name-0000.ply` and so on; of another simulation the floaters as they are.",
        export,
    ),
    pure(
        "load",
        &["path"],
        "The field or mesh that a file holds; a relative path starts at the folder of the script or module. `.obj`, `.stl`, `.ply` and `.off` files are meshes. `.vm` files have one operation a line: a field in R3 if `var-z` occurs, else in R2.",
        load,
    ),
    pure(
        "outlines",
        &["string", "font", "size = 1"],
        "The outlines of a text in the letters of a font file (TrueType or OpenType), as a list of closed polygons: lists of points in the plane. The text begins at the origin, `size` is the length of the font's em; inner polygons are holes. `even_odd` makes a shape of them, and `text` does both.",
        outlines,
    ),
    action(
        "help",
        &["of"],
        "Prints what a function or field is for.",
        |session, arguments| {
            let text = documentation(&arguments.value("of"));
            print(session, arguments, &text)
        },
    ),
    action(
        "time",
        &[],
        "Seconds since the program began: the difference of two is what lies between them. The only value that differs from run to run.",
        |session, _| Ok(Value::Number(session.begun.elapsed().as_secs_f64())),
    ),
    pure(
        "json",
        &["value"],
        "The value as JSON text.",
        |session, arguments| {
            let plain = session.plain(arguments.value("value"), arguments.place("value"))?;
            Ok(Value::text(json(&plain).to_string()))
        },
    ),
];

/// Prints a line, if there may be so much.
fn print(session: &mut Session, arguments: &Arguments, line: &str) -> Outcome<Value> {
    session.count_output(line.len() as u64 + 1, arguments.span)?;
    session.host.print(line);
    Ok(Value::Nothing)
}

fn assert(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    // A script's own assertions are among its actions; those of functions and fields are about
    // what they are given.
    if !session.acting && session.depth == 0 && session.graph.level == 0 {
        return Ok(Value::Unknown);
    }
    let place = arguments.place("condition");
    let message = arguments.text("message")?;
    match session.present(arguments.value("condition")) {
        // It depends on the point: there is no one answer.
        Value::Condition(_) => Ok(Value::Nothing),
        Value::Bool(true) => Ok(Value::Nothing),
        Value::Bool(false) => {
            let message = match message {
                Some(message) => format!("assertion failed: {message}"),
                None => "assertion failed".into(),
            };
            let mut error = failure(Code::AssertionFailed, message).at(place, "this does not hold");
            error.help = failed_comparison(session, place);
            Err(error)
        }
        other => {
            let mut error = arguments.expected("a condition", "condition", &other);
            error.code = Code::NotACondition;
            Err(error)
        }
    }
}

/// What was compared last in an assertion's condition, if that is why it does not hold.
fn failed_comparison(session: &Session, place: Span) -> Option<String> {
    let (span, left, right) = session.failed_comparison.as_ref()?;
    let within = span.source == place.source && place.to(*span) == place;
    let [left, right] = [left, right].map(quoted);
    within.then(|| {
        let (left, right) = (shorten(&left), shorten(&right));
        format!("the left side is {left}, the right side is {right}")
    })
}

fn export(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let Some(path) = output_path(session, arguments)? else {
        return Ok(Value::Nothing);
    };
    let value = arguments.value("value");
    if let Value::Simulation(set) = &value
        && !set.simulation.borrow().frames().is_empty()
    {
        for (number, frame) in set.simulation.borrow().frames().iter().enumerate() {
            let path = frame_path(&path, number);
            write_by(session, arguments, &path, |path, left| {
                Some(file::write_samples(path, &frame.samples, left))
            })?;
        }
        return Ok(Value::Nothing);
    }
    if let Value::Fall(set) = &value {
        for (number, frame) in set.fall.frames.iter().enumerate() {
            let path = frame_path(&path, number);
            write(session, arguments, &path, &set.boundary(frame))?;
        }
        return Ok(Value::Nothing);
    }
    write(session, arguments, &path, &value)?;
    Ok(Value::Nothing)
}

/// Where the argument `path` leads, if it is given and may be written to.
pub(super) fn output_path(session: &Session, arguments: &Arguments) -> Outcome<Option<PathBuf>> {
    let Some(given) = arguments.text("path")? else {
        return Ok(None);
    };
    if given.contains(char::is_control) {
        return Err(arguments.bad("path", "a control character in a file name".into()));
    }
    allowed_path(&session.output_directories, Path::new(&given))
        .map(Some)
        .at(arguments.place("path"), "this path")
}

/// Writes a value to the file that the argument `path` names.
pub(super) fn write(
    session: &mut Session,
    arguments: &Arguments,
    path: &Path,
    value: &Value,
) -> Outcome<()> {
    let is_certificate = path
        .extension()
        .is_some_and(|extension| extension == "certificate");
    if is_certificate {
        return write_certificate(session, arguments, path, value);
    }
    write_by(session, arguments, path, |path, left| match value {
        Value::Mesh(set) => Some(file::write_mesh(path, &set.mesh, left)),
        Value::Curves(set) => Some(file::write_curves(path, &set.curves, left)),
        Value::Samples(set) => Some(file::write_samples(path, &set.samples, left)),
        Value::Image(set) => Some(file::write_image(path, &set.picture.image, left)),
        Value::Solid(set) => Some(file::write_solid(path, &set.lattice.solid(), left)),
        Value::Simulation(set) => {
            let samples = set.simulation.borrow().followers().samples();
            Some(file::write_samples(path, &samples, left))
        }
        _ => None,
    })?
    .ok_or_else(|| {
        let expected = "a mesh, curves, samples, an image, a solid, a simulation or a fall";
        arguments.expected(expected, "value", value)
    })
}

/// Writes the proof that belongs to a mesh or to curves.
fn write_certificate(
    session: &mut Session,
    arguments: &Arguments,
    path: &Path,
    value: &Value,
) -> Outcome<()> {
    let Some(text) = product::certificate(value) else {
        let expected = "what `polygonize` makes with `method = \"certified\"`";
        return Err(arguments.expected(expected, "value", value));
    };
    write_by(session, arguments, path, |path, left| {
        let bytes = text.len() as u64;
        Some(match bytes <= left {
            true => file::write_text(path, &text).map(|()| bytes),
            false => Err(FileError::TooLarge {
                path: path.to_owned(),
                limit: left,
            }),
        })
    })?;
    Ok(())
}

/// Writes a file by a function that is told how many bytes it may have; `None` where the function
/// cannot write what it should.
pub(super) fn write_by(
    session: &mut Session,
    arguments: &Arguments,
    path: &Path,
    write: impl FnOnce(&Path, u64) -> Option<Result<u64, FileError>>,
) -> Outcome<Option<()>> {
    let place = arguments.place("path");
    let failed = |error: FileError| file_failure(&error).at(place, "this file");
    if let Some(directory) = session.output_directories.first() {
        file::create_folder(directory).map_err(failed)?;
    }
    let left = session.output_left();
    let Some(result) = write(path, left) else {
        return Ok(None);
    };
    match result {
        Ok(bytes) => session.count_output(bytes, place)?,
        Err(FileError::TooLarge { .. }) => {
            let more = left.saturating_add(1);
            session.count_output(more, place)?;
        }
        Err(error) => return Err(failed(error)),
    }
    session.host.wrote(path);
    Ok(Some(()))
}

/// The file of one frame of a sequence: `name-0007.ply`.
pub(super) fn frame_path(path: &Path, frame: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}-{frame:04}.{extension}"))
}

fn load(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let Some(given) = arguments.text("path")? else {
        return Ok(Value::Nothing);
    };
    let path = session.unit.directory.join(given);
    let graph = &mut session.graph;
    let first = first_axis(graph.level);
    let coordinates = [0, 1, 2].map(|axis| graph.coordinate(first + axis));
    let place = arguments.place("path");
    let allowed = Allowed {
        lines: session.limits.nodes,
        bytes: session.limits.input,
    };
    let loaded = file::load(&path, graph, coordinates, allowed)
        .map_err(|error| file_failure(&error).at(place, "this file"))?;
    let field = match loaded {
        Loaded::Field(field) => field,
        Loaded::Mesh(mesh) => {
            return Ok(Value::Mesh(Rc::new(MeshSet::new(mesh, "loaded", None))));
        }
    };
    let value = value_of_node(graph, field.root);
    FieldValue::new(field.dimension, graph.level, value, None)
        .map(Value::Field)
        .at(place, "this file")
}

fn outlines(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let text = arguments.text("string")?.unwrap_or_default();
    let font = arguments.text("font")?.unwrap_or_default();
    let size = arguments.positive(session, "size")?.unwrap_or(1.0);
    let path = session.unit.directory.join(font);
    let outlines = file::read_outlines(&path, &text, size)
        .map_err(|error| file_failure(&error).at(arguments.place("font"), "this file"))?;
    let outline = |outline: Outline| Value::list(outline.into_iter().map(Value::numbers).collect());
    Ok(Value::list(outlines.into_iter().map(outline).collect()))
}

/// The diagnostic for a file that was not written or not read.
pub(crate) fn file_failure(error: &FileError) -> Box<Diagnostic> {
    let code = match error {
        FileError::CannotRead { .. } => Code::CannotRead,
        FileError::BadContent { .. } => Code::BadContent,
        FileError::TooLong { .. } => Code::NodeLimit,
        FileError::TooMuch { .. } => Code::InputLimit,
        FileError::TooLarge { .. } => Code::OutputLimit,
        FileError::CannotWrite { .. } => Code::CannotWrite,
        FileError::UnknownFormat { .. } => Code::UnknownFormat,
        FileError::WrongFormat { .. } | FileError::OnlyWritten { .. } => Code::WrongFormat,
    };
    let mut failure = failure(code, error.to_string());
    let limit = match error {
        FileError::TooLong { .. } => "nodes",
        FileError::TooMuch { .. } => "input",
        FileError::TooLarge { .. } => "bytes",
        _ => return failure,
    };
    failure.help = Some(format!(
        "raise it with `--limit {limit}=N` if this is meant"
    ));
    failure
}

/// Where a script's file goes, if it may: below one of the directories, whatever `..` and
/// symbolic links the path goes through. None of it needs to exist.
fn allowed_path(directories: &[PathBuf], given: &Path) -> Outcome<PathBuf> {
    let path = match directories.first() {
        Some(first) => first.join(given),
        None => given.to_owned(),
    };
    let unresolved = |source| {
        file_failure(&FileError::CannotWrite {
            path: path.clone(),
            source,
        })
    };
    let present = std::env::current_dir().map_err(unresolved)?;
    let target = file::resolve(&present.join(&path)).map_err(unresolved)?;
    for directory in directories {
        let directory = file::resolve(&present.join(directory)).map_err(unresolved)?;
        if target.starts_with(directory) {
            return Ok(path);
        }
    }
    let mut error = failure(
        Code::OutsideOutput,
        format!("`{}` is outside the output directory", given.display()),
    );
    error.help = Some("allow it with `--allow-write DIR` or choose it with `--out DIR`".into());
    Err(error)
}

fn documentation(value: &Value) -> String {
    let (head, text) = match value {
        Value::Function(FunctionValue::Builtin(builtin)) => {
            (builtin.signature(), Some(builtin.documentation))
        }
        Value::Function(FunctionValue::Closure(closure)) => {
            (closure.signature(), closure.documentation.as_deref())
        }
        Value::Module(module) => (
            format!(
                "{}: {}",
                show(value, None),
                module.scope.names_here().join(", ")
            ),
            module.documentation.as_deref(),
        ),
        Value::Field(field) => (show(value, None), field.documentation()),
        other => (other.kind().to_string(), None),
    };
    match text {
        Some(text) => format!("{head}\n{text}"),
        None => head,
    }
}
