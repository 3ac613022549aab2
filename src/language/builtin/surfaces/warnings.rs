//! What `polygonize` warns of: level sets that are cut, jump or may not be whole, and meshes that are
//! not what they should be.

use crate::diagnostic::{Code, Diagnostic};
use crate::language::builtin::Arguments;
use crate::language::session::Session;
use crate::polygonize::{
    self, Cause, Certified, Doubt, Method, Polygonized, Roots, Shape, Undecided,
};

/// Warns of what was made by a call.
fn warn(session: &mut Session, arguments: &Arguments, code: Code, message: String, help: &str) {
    let warning = Diagnostic::warning(code, message)
        .label(arguments.span, "made here")
        .help(help);
    session.host.warn(warning);
}

/// Warns of what is unusual about the level set of a field.
pub(super) fn warn_about_mesh(
    session: &mut Session,
    arguments: &Arguments,
    statistics: &polygonize::Statistics,
    options: &polygonize::Options,
) {
    let mut warn = |code, message, help| warn(session, arguments, code, message, help);
    if statistics.nan_points > 0 {
        warn(
            Code::NanRegion,
            format!(
                "the field is not a number at {} points of the grid, which count as outside",
                statistics.nan_points
            ),
            "look for square roots and logarithms of negative numbers, and for 0/0",
        );
    }
    if statistics.cut_by_box && options.bounds.dimension > 1 {
        let (done, help) = if options.cap {
            ("closed", "enlarge the box if the whole of it is wanted")
        } else if options.method == Some(Method::Delaunay) {
            ("left open", "enlarge the box if the whole of it is wanted")
        } else {
            (
                "left open",
                "write `cap = true` to close it, or enlarge the box",
            )
        };
        warn(
            Code::CutByBox,
            format!("the box cuts the level set, which is {done} there"),
            help,
        );
    }
    if statistics.may_miss_components {
        warn(
            Code::MaybeMissed,
            "only components that the seeds lead to were followed".into(),
            "leave out `seeds`, and all components are found that cells can show",
        );
    }
    let jumps = statistics.poor_roots - statistics.domain_ends;
    if jumps > 0 {
        warn(
            Code::PoorRoots,
            format!("{jumps} changes of sign are jumps or poles rather than zeros of the field"),
            "a pole such as 1/x changes its sign without a zero",
        );
    }
    if statistics.folded_facets > 0 {
        warn(
            Code::FoldedFacets,
            format!(
                "{} facets are turned over or have no area, and {} intersect others",
                statistics.folded_facets, statistics.intersecting_facets
            ),
            "where the solid is thinner than a cell, smaller cells help",
        );
    }
    if statistics.flat_places > 0 {
        warn(
            Code::Plateau,
            format!(
                "the field is {} not only on the level set: at {} of {} places it is so beside it, too",
                options.iso, statistics.flat_places, statistics.probed_places
            ),
            "where a field is constant, only the border of the constant region is found: give the \
             field a slope there",
        );
    }
    let moving = (statistics.subordination).filter(|springs| !springs.at_rest);
    if let Some(springs) = moving {
        warn(
            Code::DroppedPoints,
            format!(
                "the springs did not come to rest in {} steps",
                springs.steps
            ),
            "the mesh is on the surface, but its triangles may be less even than they could be",
        );
    }
}

/// Says what became of samples that are to be vertices.
pub(super) fn warn_about_vertices(
    session: &mut Session,
    arguments: &Arguments,
    statistics: &polygonize::Statistics,
    options: &polygonize::Options,
) {
    let mut warn = |code, message, help| warn(session, arguments, code, message, help);
    if statistics.left_out > 0 && !options.samples.is_empty() {
        warn(
            Code::DroppedPoints,
            format!(
                "{} samples are no vertices of the mesh",
                statistics.left_out
            ),
            "they are not on the surface, not in the box, or in the same place as others",
        );
    }
    if statistics.inserted > 0 {
        warn(
            Code::CoarseSpacing,
            format!(
                "the samples are too sparse for this surface: {} vertices were added",
                statistics.inserted
            ),
            "take more samples, or a smaller `cell`, for vertices that are samples alone",
        );
    }
    if statistics.athwart + statistics.doubled > 0 {
        warn(
            Code::CoarseSpacing,
            format!(
                "the samples do not show all of the surface: {} triangles are at more than 60 \
                 degrees with it, and {} vertices are double where the mesh touches itself",
                statistics.athwart, statistics.doubled
            ),
            "take more samples, or a smaller `cell`",
        );
    }
}

/// Says where a method that searches for components cannot prove that it has all of them.
pub(super) fn warn_about_components(
    session: &mut Session,
    arguments: &Arguments,
    found: &Polygonized,
) {
    let is_plane = matches!(found.shape, Shape::Curves(_));
    let searches = matches!(found.method, Method::Continuation | Method::Quadtree);
    if is_plane && searches && !found.statistics.proven {
        warn_not_proven(session, arguments, &found.statistics);
    }
}

/// Warns that a search for components was not able to decide everywhere.
pub(super) fn warn_not_proven(
    session: &mut Session,
    arguments: &Arguments,
    statistics: &polygonize::Statistics,
) {
    let message = match statistics.undecided {
        0 => "not all of the curve could be followed".to_owned(),
        cells => format!("{cells} small cells could not be decided"),
    };
    let help = "components as small as that may have been missed, as at crossings and cusps";
    warn(session, arguments, Code::MaybeMissed, message, help);
}

/// Names the places in which roots are not proven. Poles, jumps and gaps are warned of like those
/// of surfaces.
pub(super) fn warn_about_roots(session: &mut Session, arguments: &Arguments, roots: &Roots) {
    const NAMED: usize = 5;
    let open: Vec<&Undecided> = (roots.undecided.iter())
        .filter(|part| !part.reason.is_break())
        .collect();
    if open.is_empty() {
        return;
    }
    let named = open.iter().take(NAMED).map(|part| match part.root {
        Some(root) => format!("at {root:?}, where {}", part.reason.text()),
        None => format!(
            "in {:?}..{:?}, where {}",
            part.low,
            part.high,
            part.reason.text()
        ),
    });
    let mut named: Vec<String> = named.collect();
    if open.len() > NAMED {
        named.push(format!("and in {} more places", open.len() - NAMED));
    }
    let message = format!("roots are not proven {}", named.join("; "));
    let warning = Diagnostic::warning(Code::UndecidedRoots, message)
        .label(arguments.span, "found here")
        .help("a field that changes its sign at each root, with a slope, leaves no doubt");
    session.host.warn(warning);
}

/// Names the places in which the topology is not proven, by their causes.
pub(super) fn warn_about_proof(
    session: &mut Session,
    arguments: &Arguments,
    (certified, dimension): (&Certified, usize),
) {
    if certified.proven {
        return;
    }
    let mut causes: Vec<Cause> = Vec::new();
    for doubt in &certified.doubts {
        if !causes.contains(&doubt.cause) {
            causes.push(doubt.cause);
        }
    }
    let of_cause = |&cause: &Cause| {
        let doubts = certified.doubts.iter().filter(|doubt| doubt.cause == cause);
        let doubts: Vec<&Doubt> = doubts.collect();
        named_doubts(&doubts, dimension)
    };
    let mut named: Vec<String> = causes.iter().map(of_cause).collect();
    if named.is_empty() {
        named.push("because the mesh is not whole, which is a mistake of the program".into());
    }
    let message = format!("the topology is not proven {}", named.join("; "));
    let warning = Diagnostic::warning(Code::TopologyNotProven, message)
        .label(arguments.span, "made here")
        .help("`doubts` lists the places; a level a little above or below may be proven");
    session.host.warn(warning);
}

/// Some of the places that have the same cause.
fn named_doubts(doubts: &[&Doubt], dimension: usize) -> String {
    const NAMED: usize = 3;
    let place = |doubt: &&Doubt| {
        let coordinates = doubt.place.to_array();
        let coordinates = coordinates[..dimension]
            .iter()
            .map(|own| format!("{own:.6}"));
        format!("({})", coordinates.collect::<Vec<_>>().join(", "))
    };
    let places: Vec<String> = doubts.iter().take(NAMED).map(place).collect();
    let more = match doubts.len().saturating_sub(NAMED) {
        0 => String::new(),
        1 => " and in one more place".to_owned(),
        count => format!(" and in {count} more places"),
    };
    doubts.first().map_or(String::new(), |doubt| {
        let [value, gradient] = doubt.values;
        let (places, words) = (places.join(", "), doubt.cause.words());
        format!("near {places}{more}, because {words} (at the first |F| = {value:.1e} and |F_x| = {gradient:.1e})")
    })
}
