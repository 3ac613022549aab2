//! Why there is no result.

use glam::DVec3;
use thiserror::Error;

use super::grid::Seen;
use super::{Cause, Method, Options};
use crate::geometry::Bounds;
use crate::sample::SampleError;

/// Why there is no result.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PolygonizeError {
    /// The grid shows no zero of F: it is either below the level everywhere or nowhere, or all
    /// changes of sign are poles, jumps or ends of the domain.
    #[error("{}", no_level(*iso, *below, *above, *undefined))]
    NoSurface {
        /// The box.
        bounds: Bounds,
        /// The level.
        iso: f64,
        /// Grid points with F < iso.
        below: usize,
        /// Grid points with F ≥ iso.
        above: usize,
        /// Grid points at which F is NaN.
        undefined: usize,
    },
    /// The grid would have more cells than allowed.
    #[error("the grid needs {needed:.3e} cells, more than the limit of {limit}")]
    TooManyCells {
        /// Cells.
        needed: f64,
        /// The limit.
        limit: usize,
    },
    /// The level set has more vertices than a mesh can number.
    #[error("the level set has {vertices} vertices, more than a mesh can number")]
    TooManyVertices {
        /// Vertices.
        vertices: usize,
    },
    /// No zero is seen from a seed.
    #[error("no zero of F is met from the seed {seed} along the axes")]
    LostSeed {
        /// The seed.
        seed: DVec3,
    },
    /// A seed is not in the box.
    #[error("the seed {seed} is not in the box")]
    SeedOutside {
        /// The seed.
        seed: DVec3,
    },
    /// One cell would be more than the whole box.
    #[error("the cell is {cell}, which is more than the longest side of the box, {longest}")]
    CellTooLarge {
        /// The side of a cell.
        cell: f64,
        /// The longest side of the box.
        longest: f64,
    },
    /// An option makes no sense.
    #[error("{option} must {demand}, not {value}")]
    BadOption {
        /// The name of the option, that of the field of [`Options`].
        option: &'static str,
        /// What it must do, such as "be positive".
        demand: &'static str,
        /// What it is.
        value: f64,
    },
    /// The dimensions do not fit.
    #[error("a field in R{field} does not fit a box in R{bounds}")]
    WrongDimension {
        /// The dimension of the field.
        field: usize,
        /// The dimension of the box.
        bounds: usize,
    },
    /// The method makes something of fields of another dimension.
    #[error("\"{}\" polygonizes fields in {}, not in R{dimension}", method.name(), method.spaces())]
    WrongMethod {
        /// The method.
        method: Method,
        /// The dimension of the field.
        dimension: usize,
    },
    /// The method makes nothing of a curve in space.
    #[error("\"{}\" is not for curves in space; use \"continuation\" or \"tetrahedra\"", method.name())]
    NotForCurves {
        /// The method.
        method: Method,
    },
    /// The method does not work brick by brick.
    #[error("only \"cubes\" without `snap` works brick by brick, not \"{}\"{}", method.name(), if *method == Method::Cubes { " with it" } else { "" })]
    NotInBricks {
        /// The method.
        method: Method,
    },
    /// The bricks are too small for the grid.
    #[error("there would be {needed:.3e} bricks, more than the limit of {limit}")]
    TooManyBricks {
        /// Bricks.
        needed: f64,
        /// The limit.
        limit: usize,
    },
    /// Two fields have no curve in common.
    #[error("no curve was found in the box on which both fields vanish")]
    NoCurve,
    /// The samples that "delaunay" should join are not on the level set.
    #[error("none of the {samples} samples is on the level set and in the box")]
    NoSamples {
        /// Samples.
        samples: usize,
    },
    /// No three samples make a triangle.
    #[error("{samples} samples make no triangle: they are too few for this surface")]
    TooSparse {
        /// Samples.
        samples: usize,
    },
    /// No samples could be made.
    #[error("{0}")]
    Sampling(SampleError),
    /// The level set is proven to be empty in the box.
    #[error("no point with F = {iso} is in the box, which is proven")]
    ProvenEmpty {
        /// The level.
        iso: f64,
    },
    /// No zero was found, but there may be some where nothing is proven.
    #[error("no point with F = {iso} was found in the box, but nothing is proven near {}, because {}", in_words(*place, *dimension), cause.words())]
    MaybeEmpty {
        /// The level.
        iso: f64,
        /// That of the field.
        dimension: usize,
        /// Where the most of what is not proven is.
        place: DVec3,
        /// Why.
        cause: Cause,
    },
    /// The field gives no enclosures.
    #[error("nothing can be proven of a field that is not compiled")]
    NothingToProveWith,
    /// The monitor asked for an end.
    #[error("cancelled")]
    Cancelled,
}

/// What was seen instead of the level, in words.
fn no_level(iso: f64, below: usize, above: usize, undefined: usize) -> String {
    let points = below + above + undefined;
    let kinds = [
        (below, format!("F < {iso}")),
        (above, format!("F ≥ {iso}")),
        (undefined, "F is undefined".to_owned()),
    ];
    let part = |(count, what): (usize, String)| match count {
        0 => None,
        _ if count == points => Some(format!("{what} at all {points} grid points")),
        _ => Some(format!("{what} at {count} of {points} grid points")),
    };
    let parts: Vec<String> = kinds.into_iter().filter_map(part).collect();
    format!("F does not cross {iso} in the box: {}", parts.join(", "))
}

/// A place with as many coordinates as there are.
pub(super) fn in_words(place: DVec3, dimension: usize) -> String {
    let coordinates = place.to_array();
    let coordinates = coordinates.iter().take(dimension);
    let coordinates: Vec<String> = coordinates.map(f64::to_string).collect();
    format!("({})", coordinates.join(", "))
}

/// The error that says what was seen instead of a zero.
pub(super) fn no_surface(options: &Options, seen: Seen) -> PolygonizeError {
    PolygonizeError::NoSurface {
        bounds: options.bounds,
        iso: options.iso,
        below: seen.inside,
        above: seen.outside,
        undefined: seen.nan,
    }
}
