//! Polygonizers: the level set F = iso of a field as a mesh (R3), as polylines (R2) or as roots
//! (R1), from the signs of F on a uniform grid over a box. They take a field from the
//! [`engine`](crate::engine) and make what [`geometry`](crate::geometry) describes.
//!
//! The inside is F < iso; where F is NaN, it counts as outside. Vertices lie on grid edges whose
//! ends differ, at a root of F that is found to a tolerance, not by interpolation. All that is
//! said about the topology holds up to the cell size: what is thinner than a cell may be missed,
//! and so is a zero without a change of sign, such as that of (x² + y² − 1)².

mod cubes;
mod edge_roots;
mod grid;
mod roots;
mod squares;

use thiserror::Error;

use self::edge_roots::{Accuracy, Kind, Root};
use self::grid::{Grid, Seen};
use crate::engine::{Field, Monitor};
use crate::geometry::{Bounds, Curves, Mesh};

/// How to polygonize.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// The box in which the level set is sought; of the field's dimension.
    pub bounds: Bounds,
    /// The greatest side length of a cell. Each axis is divided into equal cells, as few as
    /// that allows, so that cells fit the box exactly.
    pub cell: f64,
    /// Whether a level set that the box cuts is closed along the box, rather than left open.
    /// Means nothing in R1.
    pub cap: bool,
    /// The level: F = iso.
    pub iso: f64,
    /// The greatest |F − iso| / |F_x| at a vertex, relative to the diagonal of the box.
    pub tolerance: f64,
    /// The greatest number of cells.
    pub cell_limit: usize,
}

impl Options {
    /// The usual options for a box: 64 cells along its longest side. Roots on a line cost so
    /// little that they are found to the last digits.
    pub fn new(bounds: Bounds) -> Self {
        let tolerance = if bounds.dimension == 1 { 1e-15 } else { 1e-9 };
        Options {
            bounds,
            cell: default_cell(&bounds),
            cap: false,
            iso: 0.0,
            tolerance,
            cell_limit: 1 << 30,
        }
    }
}

/// A 64th of the longest side.
pub fn default_cell(bounds: &Bounds) -> f64 {
    bounds.size().max_element() / 64.0
}

/// What the work amounted to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Cells of the grid.
    pub cells: usize,
    /// Points at which F, or F and F_x, was evaluated.
    pub evaluations: usize,
    /// Grid points at which F is NaN.
    pub nan_points: usize,
    /// Whether the level set reaches the boundary of the box, so that it is left open or capped
    /// there; in R1, whether an end of the interval is a root.
    pub cut_by_box: bool,
    /// The greatest |F − iso| / |F_x| at a root, poor roots aside.
    pub max_residual: f64,
    /// Roots to the tolerance: in R1 those returned, else those on the edges of the grid, caps
    /// aside.
    pub good_roots: usize,
    /// Changes of sign that are no roots to the tolerance: poles, jumps, ends of the domain of F.
    /// They are vertices of meshes and curves all the same, lest these fall apart.
    pub poor_roots: usize,
    /// The poor roots that are ends of the domain: F < iso on one side, F NaN on the other. There
    /// the solid F < iso ends indeed.
    pub domain_ends: usize,
}

impl Statistics {
    /// What the roots contribute.
    fn of_roots(roots: &[Root]) -> Self {
        let count = |kind| roots.iter().filter(|root| root.kind == kind).count();
        let good = roots.iter().filter(|root| !root.is_poor());
        let domain_ends = count(Kind::DomainEnd);
        Statistics {
            max_residual: good.map(|root| root.residual).fold(0.0, f64::max),
            good_roots: count(Kind::Good),
            poor_roots: count(Kind::Jump) + domain_ends,
            domain_ends,
            ..Statistics::default()
        }
    }

    /// The statistics of two parts of the work together.
    fn and(self, other: Self) -> Self {
        Statistics {
            cells: self.cells + other.cells,
            evaluations: self.evaluations + other.evaluations,
            nan_points: self.nan_points + other.nan_points,
            cut_by_box: self.cut_by_box || other.cut_by_box,
            max_residual: self.max_residual.max(other.max_residual),
            good_roots: self.good_roots + other.good_roots,
            poor_roots: self.poor_roots + other.poor_roots,
            domain_ends: self.domain_ends + other.domain_ends,
        }
    }
}

/// A polygonized surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// The mesh, counter-clockwise seen from F > iso, with normals F_x / |F_x|; inside caps the
    /// normals are those of the box.
    pub mesh: Mesh,
    /// What the work amounted to.
    pub statistics: Statistics,
}

/// Polygonized plane curves.
#[derive(Clone, Debug, PartialEq)]
pub struct Contours {
    /// The curves, F < iso on their left.
    pub curves: Curves,
    /// What the work amounted to.
    pub statistics: Statistics,
}

/// The roots of a function of one variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Roots {
    /// The roots, ascending.
    pub roots: Vec<f64>,
    /// What the work amounted to. Poor roots are not among the roots.
    pub statistics: Statistics,
}

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
    #[error(
        "expected a field and a box in R{expected}, not a field in R{field} and a box in R{bounds}"
    )]
    WrongDimension {
        /// What the polygonizer works in.
        expected: usize,
        /// The dimension of the field.
        field: usize,
        /// The dimension of the box.
        bounds: usize,
    },
    /// The monitor asked for an end.
    #[error("cancelled")]
    Cancelled,
}

/// The level set of a field in R3 by marching cubes, as an oriented manifold mesh with shared
/// vertices, watertight unless the box cuts it and `cap` is off.
///
/// F is evaluated once at each grid point (twice on layers between slabs) in batches along rows;
/// memory grows with the surface and with one layer of the grid. The result is the same for any
/// number of threads.
///
/// # Errors
///
/// Bad options or dimensions, too many cells or vertices, no zero in the box (all grid points
/// have F < iso, or none has, or where they differ there are only poor roots), or cancellation by
/// the monitor.
pub fn surface(
    field: &dyn Field,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Surface, PolygonizeError> {
    let (grid, accuracy) = prepare(3, field, options)?;
    let (mesh, seen, statistics) = cubes::march(field, accuracy, &grid, monitor)?;
    require_root(options, seen, &statistics)?;
    let statistics = with_cells(&grid, statistics);
    Ok(Surface { mesh, statistics })
}

/// The level set of a field in R2 by marching squares, as polylines: closed, or open with their
/// ends at the box if it cuts them and `cap` is off.
///
/// Cost, memory and determinism as for [`surface`].
///
/// # Errors
///
/// As for [`surface`].
pub fn contours(
    field: &dyn Field,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Contours, PolygonizeError> {
    let (grid, accuracy) = prepare(2, field, options)?;
    let (curves, seen, statistics) = squares::march(field, accuracy, &grid, monitor)?;
    require_root(options, seen, &statistics)?;
    let statistics = with_cells(&grid, statistics);
    Ok(Contours { curves, statistics })
}

/// The roots of F − iso in an interval, both ends included: one for each change of sign between
/// neighbouring grid points, and every grid point at which F = iso exactly.
///
/// # Errors
///
/// As for [`surface`], where no zero means that there is no root.
pub fn roots(
    field: &dyn Field,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Roots, PolygonizeError> {
    let uncapped = Options {
        cap: false,
        ..*options
    };
    let (grid, accuracy) = prepare(1, field, &uncapped)?;
    let (roots, seen, statistics) = roots::find(field, accuracy, &grid, monitor)?;
    if roots.is_empty() {
        return Err(no_surface(options, seen));
    }
    let statistics = with_cells(&grid, statistics);
    Ok(Roots { roots, statistics })
}

/// The statistics with the number of cells filled in.
fn with_cells(grid: &Grid, statistics: Statistics) -> Statistics {
    Statistics {
        cells: grid.cells(),
        ..statistics
    }
}

/// Checks the options and lays the grid over the box.
fn prepare(
    dimension: usize,
    field: &dyn Field,
    options: &Options,
) -> Result<(Grid, Accuracy), PolygonizeError> {
    let bounds = &options.bounds;
    if field.dimension() != dimension || bounds.dimension != dimension {
        return Err(PolygonizeError::WrongDimension {
            expected: dimension,
            field: field.dimension(),
            bounds: bounds.dimension,
        });
    }
    check_options(options)?;
    let count = |(low, high): (f64, f64)| {
        // A quotient that exceeds an integer by no more than rounding needs no further cell.
        ((high - low) / options.cell * (1.0 - 1e-12))
            .ceil()
            .max(1.0)
    };
    let counts: Vec<f64> = bounds.sides().map(count).collect();
    let needed = counts.iter().product();
    if needed > options.cell_limit as f64 {
        return Err(PolygonizeError::TooManyCells {
            needed,
            limit: options.cell_limit,
        });
    }
    let counts: Vec<usize> = counts.into_iter().map(|count| count as usize).collect();
    // Roots cannot be told apart below the spacing of numbers at the far corner of the box.
    let farthest = bounds.min.abs().max(bounds.max.abs()).max_element();
    let accuracy = Accuracy {
        iso: options.iso,
        distance: (options.tolerance * bounds.diagonal()).max(4.0 * f64::EPSILON * farthest),
    };
    Ok((Grid::new(bounds, &counts, options.cap), accuracy))
}

/// Whether the numbers among the options make sense.
fn check_options(options: &Options) -> Result<(), PolygonizeError> {
    let demand = |well: bool, option, demand, value| {
        if well {
            Ok(())
        } else {
            Err(PolygonizeError::BadOption {
                option,
                demand,
                value,
            })
        }
    };
    let positive = |value: f64| value > 0.0 && value.is_finite();
    for (low, high) in options.bounds.sides() {
        let length = high - low;
        demand(
            low < high,
            "bounds",
            "have sides of positive length",
            length,
        )?;
    }
    // The square of a longer diagonal overflows, which also is the case for boxes so far from 0
    // that coordinates do.
    let diagonal = options.bounds.diagonal();
    let short = diagonal.is_finite();
    demand(
        short,
        "bounds",
        "have a diagonal shorter than 1e154",
        diagonal,
    )?;
    let size = "be positive and finite";
    demand(positive(options.cell), "cell", size, options.cell)?;
    let tolerance = options.tolerance;
    demand(positive(tolerance), "tolerance", size, tolerance)?;
    demand(options.iso.is_finite(), "iso", "be finite", options.iso)
}

/// An error unless there is a root: of poor roots alone there is no level set.
fn require_root(
    options: &Options,
    seen: Seen,
    statistics: &Statistics,
) -> Result<(), PolygonizeError> {
    if statistics.good_roots == 0 {
        return Err(no_surface(options, seen));
    }
    Ok(())
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
    format!("no point with F = {iso} in the box: {}", parts.join(", "))
}

/// The error that says what was seen instead of a zero.
fn no_surface(options: &Options, seen: Seen) -> PolygonizeError {
    PolygonizeError::NoSurface {
        bounds: options.bounds,
        iso: options.iso,
        below: seen.inside,
        above: seen.outside,
        undefined: seen.nan,
    }
}
