//! What `sample` warns of: points that are no surface, components that may be missed, and what did
//! not come out as it was asked for.

use glam::DVec3;

use crate::diagnostic::{Code, Diagnostic};
use crate::geometry::{Bounds, Samples};
use crate::language::builtin::Arguments;
use crate::language::session::Session;
use crate::sample::{self, Method};

/// Warns of all that is wrong with a sample that there is.
pub(super) fn warn(
    session: &mut Session,
    arguments: &Arguments,
    outcome: &sample::Outcome,
    options: &sample::Options,
) {
    let statistics = &outcome.statistics;
    let stretches = statistics.lines.map_or(0, |lines| lines.vanishing);
    let spacing = options.spacing;
    warn_about_points(session, arguments, &outcome.samples, spacing, stretches);
    warn_about_samples(session, arguments, statistics);
    if options.method == Method::Trace {
        warn_about_trace(session, arguments, statistics, options.count);
    }
}

/// Warns of what the statistics tell.
pub(in crate::language::builtin) fn warn_about_samples(
    session: &mut Session,
    arguments: &Arguments,
    statistics: &sample::Statistics,
) {
    warn_about_missed(session, arguments, statistics);
    if statistics.births.is_some() && !statistics.converged {
        let message = if !statistics.settled {
            "the search for the surface did not come to an end: the surface may be unbounded"
                .to_owned()
        } else if statistics.dropped.total() > 0 {
            format!(
                "{} of {} floaters were dropped: they could not be put on the zero set, which is \
                 rough there",
                statistics.dropped.total(),
                statistics.started
            )
        } else {
            format!(
                "the floaters did not come to rest in {} iterations, or their number, {}, is not \
                 exactly what was asked for",
                statistics.iterations, statistics.points
            )
        };
        let warning = Diagnostic::warning(Code::DroppedPoints, message)
            .label(arguments.span, "sampled here")
            .help("all points lie on the zero set, but maybe not evenly; sharp creases and details smaller than the spacing keep floaters moving");
        session.host.warn(warning);
    }
    if let Some(pieces) = statistics
        .pieces
        .filter(|&pieces| statistics.points < pieces)
    {
        let message = format!(
            "the surface has about {pieces} pieces, and {} points are too few for all of them",
            statistics.points
        );
        let warning = Diagnostic::warning(Code::MaybeMissed, message)
            .label(arguments.span, "sampled here")
            .help("give a larger `count`, or a smaller `spacing`");
        session.host.warn(warning);
    }
    if let Some(lines) = &statistics.lines {
        warn_about_lines(session, arguments, statistics, lines);
    }
    let of_particles = statistics.births.is_none();
    if of_particles && (statistics.dropped.unconverged > 0 || statistics.dropped.spurious > 0) {
        let warning = Diagnostic::warning(
            Code::DroppedPoints,
            format!(
                "{} of {} particles were dropped: {} did not converge, {} were caught where the \
                 field has a minimum that is not 0",
                statistics.dropped.total(),
                statistics.started,
                statistics.dropped.unconverged,
                statistics.dropped.spurious
            ),
        )
        .label(arguments.span, "sampled here");
        session.host.warn(warning);
    }
    if statistics.nan_points > 0 {
        let warning = Diagnostic::warning(
            Code::NanRegion,
            format!(
                "the field or its gradient was not a number at {} of {} points that were looked at",
                statistics.nan_points, statistics.evaluations
            ),
        )
        .label(arguments.span, "sampled here");
        session.host.warn(warning);
    }
}

/// At so many of its points, as a part, the gradient of a surface does not vanish by chance.
const OFTEN: f64 = 0.01;

/// Warns where the zero set has no gradient, or fills so many stretches of lines, so that it is no
/// surface, and where the points are next to none because they are too far apart.
fn warn_about_points(
    session: &mut Session,
    arguments: &Arguments,
    samples: &Samples,
    spacing: Option<f64>,
    stretches: u64,
) {
    let number = samples.positions.len();
    let vanishing = samples.normals.iter().filter(|&&n| n == DVec3::ZERO);
    let vanishing = vanishing.count();
    let message = if stretches as f64 > OFTEN * number as f64 {
        Some(format!(
            "on {stretches} stretches of lines the field is 0 all along: where that is so on a whole \
             region, there is no surface, and it has no area"
        ))
    } else if vanishing as f64 > OFTEN * number as f64 {
        Some(format!(
            "the gradient vanishes at {vanishing} of {number} points: the field is 0 on a whole \
             region there, or does not change its sign, and the points have no normals"
        ))
    } else {
        None
    };
    if let Some(message) = message {
        let warning = Diagnostic::warning(Code::SingularPoints, message)
            .label(arguments.place("f"), "this field")
            .help("a solid is sampled on its surface if the field is negative inside");
        session.host.warn(warning);
    }
    let bounds = Bounds::of_points(samples.dimension, samples.positions.iter().copied());
    let extent = bounds.map_or(0.0, |bounds| bounds.diagonal());
    if let Some(spacing) = spacing.filter(|&spacing| spacing > extent && samples.dimension > 1) {
        let message = format!(
            "the spacing, {spacing}, is larger than the distance between any two of the {number} \
             points that were found"
        );
        let warning = Diagnostic::warning(Code::CoarseSpacing, message)
            .label(arguments.place("spacing"), "this spacing")
            .help("give a smaller `spacing`, or a `count`");
        session.host.warn(warning);
    }
}

/// Cells that remain at singular points, however often they are halved, are smaller than this part
/// of the box's diagonal: there is no use in warning of them wherever a surface has a corner.
const TINY: f64 = 1e-3;

/// Warns where a component may be missing, telling how large it can be.
fn warn_about_missed(
    session: &mut Session,
    arguments: &Arguments,
    statistics: &sample::Statistics,
) {
    let of_cells = statistics
        .proof
        .filter(|proof| proof.left > 0 && proof.largest_left > TINY * statistics.bounds.diagonal());
    let of_curves = statistics
        .curves
        .as_ref()
        .filter(|curves| curves.undecided > curves.undecided_at_singular);
    let message = match (of_cells, of_curves) {
        (Some(proof), _) => format!(
            "components may be missed: nothing could be proven of {} cells of the box, the largest \
             {:.2e} across, and smaller components, or those that cross several of these cells, \
             may have no point",
            proof.left, proof.largest_left
        ),
        (None, Some(curves)) => format!(
            "components may be missed: it could not be proven that the curve has no others, because \
             {} cells of the box, the largest {:.2e} across, are left undecided",
            curves.undecided - curves.undecided_at_singular,
            curves.largest_undecided
        ),
        (None, None) => return,
    };
    let warning = Diagnostic::warning(Code::MaybeMissed, message)
        .label(arguments.span, "sampled here")
        .help("give `bounds` that are closer to the surface, or `seeds` on the component that is missing");
    session.host.warn(warning);
}

/// Warns where continuation did not come to its end, or gives another number of points than was asked
/// for. The points of a front, of which a surface gets about as many as are wanted, may be off by a
/// hundredth.
fn warn_about_trace(
    session: &mut Session,
    arguments: &Arguments,
    statistics: &sample::Statistics,
    asked: Option<u64>,
) {
    let points = statistics.points;
    let message = match (&statistics.curves, asked) {
        (Some(curves), _) if curves.unfinished > 0 => format!(
            "{} walks along the curve were given up, because it turns too often or is singular all \
             along: not all of it has points",
            curves.unfinished
        ),
        (Some(curves), Some(asked)) if asked != points => format!(
            "there are {points} points, not {asked}, on the {} components of the curve: each has one \
             at least",
            curves.components.len()
        ),
        (None, Some(asked)) if !statistics.converged => format!(
            "there are {points} points, not {asked}: no spacing of the front that was tried gives \
             that number"
        ),
        (None, None) if !statistics.converged => format!(
            "there are {points} points: no spacing of the front that was tried gives the usual number"
        ),
        _ => return,
    };
    let warning = Diagnostic::warning(Code::DroppedPoints, message)
        .label(arguments.span, "sampled here")
        .help("give a `spacing`, or `bounds` of the part that is wanted");
    session.host.warn(warning);
}

fn warn_about_lines(
    session: &mut Session,
    arguments: &Arguments,
    statistics: &sample::Statistics,
    lines: &sample::Lines,
) {
    let mut warn = |code, message: String, help: &str| {
        let warning = Diagnostic::warning(code, message)
            .label(arguments.span, "sampled here")
            .help(help);
        session.host.warn(warning);
    };
    if !statistics.converged {
        warn(
            Code::DroppedPoints,
            format!(
                "only {} points were found on {} lines: the surface is too small for its box",
                statistics.points, lines.drawn
            ),
            "give `bounds` that are closer to the surface",
        );
    }
    if lines.undecided > 0 {
        warn(
            Code::PoorRoots,
            format!(
                "at {} places on {} lines the field jumps, has a pole, ends, or could not be \
                 enclosed closely: they give no points",
                lines.undecided, lines.drawn
            ),
            "a pole such as 1/x changes its sign without a zero",
        );
    }
}
