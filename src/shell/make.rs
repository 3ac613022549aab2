//! `imp mesh` and `imp sample`: the language's `polygonize` and `sample` with their arguments as
//! flags, and a file for the result; what `imp render` does with `plot` is the same.

use std::path::{Path, PathBuf};
use std::rc::Rc;

use serde_json::{Map, Value as Json, json};

use super::arguments::{Common, Mesh, Sample, Subject};
use super::workspace::{Workspace, limits};
use super::{output, timings};
use crate::diagnostic::{Code, Diagnostic};
use crate::file;
use crate::language::builtin::file_failure;
use crate::language::json::json as json_of;
use crate::language::product::{self, MeshSet};
use crate::language::show::{show, table};
use crate::language::{FieldValue, Mode, Outcome, Value};
use crate::polygonize::{IsolatedRoot, Roots};
use crate::syntax::tree::Expression;

/// A flag that is an argument of the language's function: its name and the text of its value.
pub(super) type Flag<'a> = (&'a str, Option<&'a str>);

/// Polygonizes a field; fails with an exit code.
pub(super) fn mesh(command: &Mesh) -> Result<(), u8> {
    let method = command.method.as_deref().map(quoted);
    let ambiguity = command.ambiguity.as_deref().map(quoted);
    let split = command.split.as_deref().map(quoted);
    let flags = [
        ("method", method.as_deref()),
        ("ambiguity", ambiguity.as_deref()),
        ("split", split.as_deref()),
        ("error", command.error.as_deref()),
        ("seeds", command.seeds.as_deref()),
        ("cell", command.cell.as_deref()),
        ("resolution", command.resolution.as_deref()),
        ("iso", command.iso.as_deref()),
        ("cap", command.cap.as_deref()),
        ("snap", command.snap.then_some("true")),
        ("tolerance", command.tolerance.as_deref()),
        ("bricks", command.bricks.as_deref()),
    ];
    let further = match (&command.certificate, command.report) {
        (Some(path), _) => Further::Certificate(path),
        (None, true) => Further::Report,
        (None, false) => Further::Nothing,
    };
    make(
        match command.bricks {
            Some(_) => BRICKS,
            None => "polygonize",
        },
        &command.subject,
        &flags,
        &command.common,
        further,
    )
}

/// Samples a field; fails with an exit code.
pub(super) fn sample(command: &Sample) -> Result<(), u8> {
    let method = command.method.as_deref().map(quoted);
    let potential = command.potential.as_deref().map(quoted);
    let adapt = command.adapt.as_deref().map(quoted);
    let exact = command.exact.then_some("true");
    let rules = command.rule.iter();
    let rules = rules.map(|rule| (rule.name.as_str(), Some(rule.text.as_str())));
    let flags = [
        ("method", method.as_deref()),
        ("exact", exact),
        ("adapt", adapt.as_deref()),
        ("contrast", command.contrast.as_deref()),
        ("focus", command.focus.as_deref()),
        ("finer", command.finer.as_deref()),
        ("spacing", command.spacing.as_deref()),
        ("count", command.count.as_deref()),
        ("seeds", command.seeds.as_deref()),
        ("seed", command.seed.as_deref()),
        ("friction", command.friction.as_deref()),
        ("potential", potential.as_deref()),
        ("direction", command.direction.as_deref()),
        ("tolerance", command.tolerance.as_deref()),
    ];
    let flags: Vec<Flag<'_>> = flags.into_iter().chain(rules).collect();
    make(
        "sample",
        &command.subject,
        &flags,
        &command.common,
        if command.timings {
            Further::Timings
        } else {
            Further::Nothing
        },
    )
}

/// A word as a string of the language.
pub(super) fn quoted(word: &str) -> String {
    let escaped = word
        .replace('\\', "\\\\")
        .replace('"', "\\\"")
        .replace('{', "{{")
        .replace('}', "}}");
    format!("\"{escaped}\"")
}

/// The function that writes its files itself.
const BRICKS: &str = "export_bricks";

/// What is told of a result besides its properties.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Further<'a> {
    Nothing,
    /// What took how long.
    Timings,
    /// All measures of a mesh.
    Report,
    /// A file for the proof of the topology.
    Certificate(&'a Path),
}

/// Calls a function of the language with the field and the flags, writes what it gives, and
/// shows its properties, and what further is asked for.
pub(super) fn make(
    function: &str,
    subject: &Subject,
    flags: &[Flag<'_>],
    common: &Common,
    further: Further<'_>,
) -> Result<(), u8> {
    let mut workspace = Workspace::open(Some(&subject.file), common, Mode::Define)?;
    workspace.run()?;
    let field = workspace.field(subject.field.as_deref())?;
    let is_told = common.json || further == Further::Report;
    check_output(subject, (function, is_told), field.dimension(), common)
        .map_err(|error| workspace.fail(&[*error]))?;
    if let Further::Certificate(path) = further {
        check_certificate(path, subject, flags, common)
            .map_err(|error| workspace.fail(&[*error]))?;
    }
    let bounds = ("bounds", subject.bounds.as_deref());
    let mut options = Vec::new();
    for (name, text) in flags.iter().chain([&bounds]) {
        if let Some(text) = text {
            let value = workspace.parse(&format!("<--{name}>"), text)?;
            options.push((*name, value));
        }
    }
    let mut subjects = vec![Value::Field(field.clone())];
    let given = subject.output.as_deref();
    if let Some(path) = given.filter(|_| function == BRICKS) {
        let path = brick_path(&mut workspace, path, common);
        subjects.push(path.map_err(|error| workspace.fail(&[*error]))?);
    }
    let value = workspace
        .session
        .call(function, subjects, &options)
        .map_err(|errors| workspace.fail(&errors))?;
    let output = match &subject.output {
        Some(path) if function == BRICKS => Some(output_path(path, common)),
        Some(path) => Some(write(path, common, &value).map_err(|error| workspace.fail(&[*error]))?),
        None => None,
    };
    if let Further::Certificate(path) = further {
        write_certificate(path, common, &value).map_err(|error| workspace.fail(&[*error]))?;
    }
    let phases = match &value {
        Value::Samples(set) => set.statistics.as_ref().map(|told| told.times.clone()),
        _ => None,
    };
    let timings = (further == Further::Timings).then(|| phases.unwrap_or_default());
    let report = match (&value, further) {
        (Value::Mesh(set), Further::Report) => {
            options.retain(|(name, _)| *name == "iso");
            let measured = report(&mut workspace, set, field, &options);
            Some(measured.map_err(|errors| workspace.fail(&errors))?)
        }
        (Value::Curves(_), Further::Report) => {
            let own = (CURVES, product::summary(&value));
            Some(std::iter::once(own).chain(adaptation(&value)).collect())
        }
        _ => None,
    };
    if common.json {
        let mut object = object(output.as_deref(), &value);
        if let Some(isolated) = &workspace.session.isolated {
            object.extend(told_of_roots(isolated));
        }
        if let Some(phases) = &timings {
            object.insert("timings".into(), timings::json(&workspace, phases));
        }
        for (title, rows) in report.iter().flatten() {
            let rows = rows
                .iter()
                .map(|(name, value)| (String::from(*name), json_of(value)));
            if [MESH, CURVES].contains(title) {
                for (name, value) in rows {
                    // What is already there keeps its form.
                    object.entry(name).or_insert(value);
                }
            } else {
                object.insert((*title).into(), Json::Object(rows.collect()));
            }
        }
        workspace.finish_json(&mut object);
        output::data(&Json::Object(object).to_string());
    } else {
        match &report {
            Some(parts) => {
                for (title, rows) in parts {
                    output::data(&format!("{title}\n{}", table(rows, None)));
                }
            }
            None => output::data(&show(&value, None)),
        }
        if let Some(phases) = &timings {
            timings::tell(&workspace, phases);
        }
    }
    Ok(())
}

/// The title of what is known of a mesh alone.
const MESH: &str = "mesh";

/// The same for curves.
const CURVES: &str = "curves";

/// A title and named values.
type Part = (&'static str, Vec<(&'static str, Value)>);

/// All measures of a mesh that a field was made into: of its topology, of its triangles, and of
/// its distance from the field's surface.
fn report(
    workspace: &mut Workspace,
    set: &Rc<MeshSet>,
    field: FieldValue,
    iso: &[(&str, Expression)],
) -> Result<Vec<Part>, Vec<Diagnostic>> {
    let mesh = Value::Mesh(Rc::clone(set));
    let session = &mut workspace.session;
    let quality = session.call("quality", vec![mesh.clone()], &[])?;
    let deviation = session.call("deviation", vec![mesh, Value::Field(field)], iso)?;
    let parts = vec![
        (MESH, product::details(set)),
        ("quality", product::summary(&quality)),
        ("deviation", product::summary(&deviation)),
    ];
    let of_springs = adaptation(&Value::Mesh(Rc::clone(set)));
    Ok(parts.into_iter().chain(of_springs).collect())
}

/// What springs tell, if they made it.
fn adaptation(value: &Value) -> Option<Part> {
    const NAME: &str = "adaptation";
    Some((NAME, product::summary(&product::property(value, NAME)?)))
}

/// Refuses, before the work, a file that cannot hold what comes of it or cannot be written, and
/// work whose result would be lost.
fn check_output(
    subject: &Subject,
    (function, is_told): (&str, bool),
    dimension: usize,
    common: &Common,
) -> Outcome<()> {
    let (kind, example) = match (function, dimension, &subject.output) {
        ("sample", ..) => ("samples", "points.ply"),
        ("plot", ..) => ("pictures", "picture.png"),
        (_, 3, _) => ("meshes", "mesh.stl"),
        (_, 2, _) => ("plane curves", "curves.svg"),
        (.., Some(_)) => return Err(roots_to_file()),
        (.., None) => return Ok(()),
    };
    match &subject.output {
        Some(path) => file::Format::for_kind(path, kind)
            .and_then(|_| file::check_writable(&output_path(path, common), common.out.as_deref()))
            .map_err(|error| file_failure(&error)),
        // Measures of a mesh, curves or samples can be all that is wanted.
        None if is_told => Ok(()),
        None => {
            let message = format!("no file is named for the {kind}");
            let error = Diagnostic::error(Code::Usage, message);
            Err(Box::new(error.help(format!(
                "name it with `-o`, as in `-o {example}`; `--json` without it, and `--report` of a \
                 mesh, print the measures only"
            ))))
        }
    }
}

/// Refuses, before the work, a certificate that there would not be or that has no place.
fn check_certificate(
    path: &Path,
    subject: &Subject,
    flags: &[Flag<'_>],
    common: &Common,
) -> Outcome<()> {
    let refuse = |message: &str| Err(Box::new(Diagnostic::error(Code::Usage, message.to_owned())));
    let certified = quoted("certified");
    if !flags.contains(&("method", Some(&certified))) {
        return refuse(NO_CERTIFICATE);
    }
    if subject.output.as_deref() == Some(path) {
        return refuse("the certificate would replace the other file: give it a name of its own");
    }
    file::check_writable(&output_path(path, common), common.out.as_deref())
        .map_err(|error| file_failure(&error))
}

/// Why there is no certificate.
const NO_CERTIFICATE: &str = "only `--method certified` makes a certificate, in R2 and R3";

fn roots_to_file() -> Box<Diagnostic> {
    let message = "roots cannot be written to a file";
    let error = Diagnostic::error(Code::WrongFormat, message);
    Box::new(error.help("leave out `-o`: the roots are printed"))
}

/// Where a file goes: below the output directory, if one was named.
fn output_path(path: &Path, common: &Common) -> PathBuf {
    match &common.out {
        Some(directory) => directory.join(path),
        None => path.to_owned(),
    }
}

/// The path that [`BRICKS`] is given: it may write there, as what was named on the command line, and
/// need not tell of each file.
fn brick_path(workspace: &mut Workspace, path: &Path, common: &Common) -> Outcome<Value> {
    let Some(text) = path.to_str() else {
        let message = "the name of the files is not UTF-8 text";
        return Err(Box::new(Diagnostic::error(Code::Usage, message)));
    };
    let target = output_path(path, common);
    let folder = target.parent().filter(|folder| folder.as_os_str() != "");
    let folder = folder.unwrap_or(Path::new("."));
    workspace.session.allow_writing(folder);
    workspace.heard.tells_of_files.set(false);
    Ok(Value::text(text))
}

/// Writes the result and gives the path.
fn write(path: &Path, common: &Common, value: &Value) -> Outcome<PathBuf> {
    let limit = limits(common).bytes;
    if let Some(directory) = &common.out {
        file::create_folder(directory).map_err(|error| file_failure(&error))?;
    }
    let path = output_path(path, common);
    let result = match value {
        Value::Mesh(set) => file::write_mesh(&path, &set.mesh, limit),
        Value::Curves(set) => file::write_curves(&path, &set.curves, limit),
        Value::Samples(set) => file::write_samples(&path, &set.samples, limit),
        Value::Image(set) => file::write_image(&path, &set.picture.image, limit),
        _ => return Err(roots_to_file()),
    };
    result.map_err(|error| file_failure(&error))?;
    Ok(path)
}

/// Writes the proof of the topology.
fn write_certificate(path: &Path, common: &Common, value: &Value) -> Outcome<()> {
    let text = product::certificate(value)
        .ok_or_else(|| Box::new(Diagnostic::error(Code::Usage, NO_CERTIFICATE.to_owned())))?;
    file::write_text(&output_path(path, common), &text).map_err(|error| file_failure(&error))
}

/// What is known of roots beyond their values: for each whether it is proven and an interval that
/// holds it, and what is undecided.
fn told_of_roots(roots: &Roots) -> Map<String, Json> {
    let of_each = |told: fn(&IsolatedRoot) -> Json| roots.roots.iter().map(told).collect::<Json>();
    let undecided = roots.undecided.iter().map(|part| {
        json!({
            "low": part.low,
            "high": part.high,
            "reason": part.reason.name(),
            "root": part.root,
        })
    });
    Map::from_iter([
        ("proven".to_owned(), of_each(|root| root.proven.into())),
        (
            "enclosures".to_owned(),
            of_each(|root| json!([root.enclosure.0, root.enclosure.1])),
        ),
        ("undecided".to_owned(), undecided.collect()),
    ])
}

fn object(output: Option<&Path>, value: &Value) -> Map<String, Json> {
    let mut object = Map::new();
    if let Some(path) = output {
        object.insert("output".into(), path.display().to_string().into());
    }
    match json_of(value) {
        Json::Object(properties) => object.extend(properties),
        roots => drop(object.insert("roots".into(), roots)),
    }
    object
}
