//! `export_bricks`: a mesh that is written brick by brick.

use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::super::script::{output_path, write_by};
use super::warnings::warn_about_mesh;
use super::{
    Arguments, box_of, cell_arguments, compiled_argument, method_argument, polygonize_failure,
};
use crate::engine::CompiledField;
use crate::file;
use crate::language::product::{BrickTotals, ReportSet};
use crate::language::session::Session;
use crate::language::value::{Outcome, Value};
use crate::polygonize::{self, Brick, Bricks};

/// Cells along the side of a brick if nothing is said.
const USUAL_SIDE: u64 = 256;

pub(super) fn export_bricks(session: &mut Session, arguments: &Arguments) -> Outcome<Value> {
    let method = method_argument(arguments)?;
    let (field, bounds) = compiled_argument(session, arguments)?;
    let iso = arguments.number(session, "iso")?.unwrap_or(0.0);
    let bounds = box_of(&field, iso, bounds, arguments, &session.monitor())?;
    let mut options = polygonize::Options::new(bounds);
    options.method = method;
    options.iso = iso;
    cell_arguments(session, arguments, &mut options)?;
    if let Some(cap) = arguments.bool(session, "cap")? {
        options.cap = cap;
    }
    options.cell_limit = usize::try_from(session.limits.cells).unwrap_or(usize::MAX);
    let side = arguments.count(session, "bricks")?.unwrap_or(USUAL_SIDE);
    if side == 0 {
        let message = "a brick has at least one cell along its side".to_owned();
        return Err(arguments.bad("bricks", message));
    }
    let side = usize::try_from(side).unwrap_or(usize::MAX);
    let Some(path) = output_path(session, arguments)? else {
        return Ok(Value::Nothing);
    };
    let mut totals = BrickTotals::default();
    let written = write_all(
        session,
        arguments,
        (&field, &options, side),
        &path,
        &mut totals,
    );
    match written {
        Err(mut error) if totals.files > 0 && error.help.is_none() => {
            error.help = Some(format!(
                "the {} bricks that were written before remain",
                totals.files
            ));
            Err(error)
        }
        Err(error) => Err(error),
        Ok(statistics) => {
            totals.closed = options.cap || !statistics.cut_by_box;
            totals.max_residual = statistics.max_residual;
            totals.evaluations = statistics.evaluations;
            warn_about_mesh(session, arguments, &statistics, &options);
            Ok(Value::Report(Rc::new(ReportSet {
                bricks: Some(totals),
                ..ReportSet::default()
            })))
        }
    }
}

/// Makes all bricks and writes each to a file.
fn write_all(
    session: &mut Session,
    arguments: &Arguments,
    (field, options, side): (&CompiledField, &polygonize::Options, usize),
    path: &Path,
    totals: &mut BrickTotals,
) -> Outcome<polygonize::Statistics> {
    let failed = |error| polygonize_failure(error, arguments);
    let mut bricks = Bricks::new(field, options, side).map_err(failed)?;
    totals.bricks = bricks.counts().iter().product();
    let middle = 0.5 * (options.bounds.min + options.bounds.max);
    while let Some(brick) = bricks.advance(&session.monitor()).map_err(failed)? {
        let Brick { place, mesh } = brick;
        totals.add(&mesh, middle);
        write_by(
            session,
            arguments,
            &brick_path(path, place),
            |path, left| Some(file::write_mesh(path, &mesh, left)),
        )?;
        totals.files += 1;
    }
    bricks.finish().map_err(failed)
}

/// The file of a brick: `name-0-3-1.ply`.
fn brick_path(path: &Path, [i, j, k]: [usize; 3]) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}-{i}-{j}-{k}.{extension}"))
}
