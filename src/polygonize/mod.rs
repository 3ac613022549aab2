//! Polygonizers: the level set F = iso of a field as a mesh (R3), as polylines (R2) or as roots
//! (R1). They take a field from the [`engine`](crate::engine) and make what
//! [`geometry`](crate::geometry) describes; [`Method`] names them.
//!
//! The inside is F < iso; where F is NaN, it counts as outside. Vertices lie at roots of F that are
//! found to a tolerance, not by interpolation: on the edges of cells or, with dual contouring, in
//! the cells. Except for the roots and the topology (`certified`) that enclosures prove, all that is said about the topology holds
//! up to the cell size: what is thinner than a cell may be missed, and so is a zero without a change
//! of sign, such as that of (x² + y² − 1)².

mod ambiguity;
mod border;
mod bracketing;
mod bricks;
mod certified;
mod columns;
mod continuation;
mod cubes;
mod delaunay;
mod dual;
mod edge_roots;
mod enclosure;
mod error;
mod extended;
mod grid;
mod newton;
mod octree;
mod options;
mod plateau;
mod project;
mod projection;
mod quadtree;
mod roots;
mod signs;
mod simplices;
mod space_curves;
mod springs;
mod squares;
mod statistics;
mod tetrahedra;

use self::edge_roots::Accuracy;
use self::error::no_surface;
use self::grid::{Grid, Seen};
use self::options::check_options;
use crate::engine::{Field, Monitor};
use crate::geometry::{Curves, Mesh};

pub use bricks::{Brick, Bricks};
pub use certified::{
    Cause, Certificate, Certified, Component, Doubt, Verified, VerifyError, verify,
};
pub use error::PolygonizeError;
pub use options::{Ambiguity, Method, Options, Split, default_cell};
pub use project::{project, values_at};
pub use roots::{IsolatedRoot, Reason, Roots, Undecided};
pub use springs::{Conditions, Polygons, Subordination};
pub use statistics::{Leaves, Statistics};

/// A level set as polygons.
#[derive(Clone, Debug, PartialEq)]
pub struct Polygonized {
    /// What it is made of.
    pub shape: Shape,
    /// The method that made it.
    pub method: Method,
    /// What the work amounted to.
    pub statistics: Statistics,
    /// What "certified" proves; none for other methods.
    pub certified: Option<Certified>,
}

/// What a level set is made of, by the dimension of the field.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// R1: the roots, and what is undecided.
    Roots(Roots),
    /// R2: the curves, F < iso on their left.
    Curves(Curves),
    /// R3: the mesh, counter-clockwise seen from F > iso, with normals F_x / |F_x|; inside caps
    /// the normals are those of the box.
    Mesh(Mesh),
}

/// One polygonization: what methods work on.
#[derive(Clone, Copy)]
struct Job<'a> {
    field: &'a dyn Field,
    options: &'a Options,
    accuracy: Accuracy,
    monitor: &'a dyn Monitor,
}

/// What a method gives: the shape, at which points F was seen where, and the statistics.
type Found = (Shape, Seen, Statistics);

/// The level set of a field, by the method that the options name.
///
/// Methods on a grid evaluate F once at each grid point in batches along rows; memory grows with
/// the level set and one layer of the grid. The result is the same for any number of threads.
///
/// # Errors
///
/// Bad options or dimensions, a method for other dimensions, too many cells or vertices, no zero
/// in the box (all points that were looked at have F < iso, or none has, or where they differ
/// there are only poor roots), or cancellation by the monitor.
pub fn polygonize(
    field: &dyn Field,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Polygonized, PolygonizeError> {
    let dimension = options.bounds.dimension;
    if field.dimension() != dimension {
        return Err(PolygonizeError::WrongDimension {
            field: field.dimension(),
            bounds: dimension,
        });
    }
    let mut method = options.method.unwrap_or(Method::usual(dimension));
    if !method.dimensions().contains(&dimension) {
        return Err(PolygonizeError::WrongMethod { method, dimension });
    }
    check_options(options)?;
    // Without enclosures there is nothing to prove with.
    if method == Method::Newton && field.compiled().is_none() {
        method = Method::Bracketing;
    }
    let job = Job {
        field,
        options,
        accuracy: accuracy(options),
        monitor,
    };
    let mut proof = None;
    let (shape, seen, mut statistics) = match method {
        Method::Bracketing => bracketing::find(&job)?,
        Method::Newton => newton::find(&job)?,
        Method::Squares => squares::march(&job)?,
        Method::Quadtree => quadtree::find(&job)?,
        Method::Cubes => cubes::march(&job)?,
        Method::Extended => extended::march(&job)?,
        Method::Tetrahedra => tetrahedra::march(&job)?,
        Method::Octree => octree::march(&job)?,
        Method::Continuation => continuation::follow(&job)?,
        Method::Dual => dual::march(&job)?,
        Method::Springs => springs::adapt(&job)?,
        Method::Delaunay => delaunay::triangulate(&job)?,
        Method::Certified => {
            let (found, certified) = certified::prove(&job)?;
            proof = Some(certified);
            found
        }
    };
    // Of poor roots alone there is no level set.
    let may_have_more = match &shape {
        Shape::Roots(roots) => roots.undecided.iter().any(|part| !part.reason.is_break()),
        _ => false,
    };
    if statistics.good_roots == 0 && !may_have_more {
        let proven = proof.as_ref();
        let proven = proven.and_then(|proof| proof.emptiness(options.iso, dimension));
        return Err(proven.unwrap_or_else(|| no_surface(options, seen)));
    }
    (statistics.flat_places, statistics.probed_places) = plateau::plateau(&job, &shape);
    if dimension == 3 && options.cap && statistics.cut_by_box {
        statistics.capped_by = Some(options.bounds);
    }
    Ok(Polygonized {
        shape,
        method,
        statistics,
        certified: proof,
    })
}

/// The curve in R3 on which two fields vanish, by "continuation" (the usual method) or "tetrahedra".
///
/// Curves are left open where they leave the box, and closed where they are. The level is 0.
///
/// # Errors
///
/// Bad options, fields that are not in R3, another method, too many cells, no curve in the box, or
/// cancellation by the monitor.
pub fn polygonize_curve(
    fields: [&dyn Field; 2],
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Polygonized, PolygonizeError> {
    let bounds = options.bounds.dimension;
    for field in fields.iter().map(|field| field.dimension()).chain([bounds]) {
        if field != 3 {
            return Err(PolygonizeError::WrongDimension { field, bounds });
        }
    }
    let method = options.method.unwrap_or(Method::Continuation);
    check_options(options)?;
    let distance = accuracy(options).distance;
    let (shape, _, statistics) = match method {
        Method::Continuation => continuation::follow_in_space(fields, distance, options, monitor)?,
        Method::Tetrahedra => space_curves::enumerate(fields, distance, options, monitor)?,
        _ => return Err(PolygonizeError::NotForCurves { method }),
    };
    if statistics.good_roots == 0 {
        return Err(PolygonizeError::NoCurve);
    }
    Ok(Polygonized {
        shape,
        method,
        statistics,
        certified: None,
    })
}

/// What is asked of roots.
fn accuracy(options: &Options) -> Accuracy {
    let bounds = &options.bounds;
    // Roots cannot be told apart below the spacing of numbers at the far corner of the box.
    let farthest = bounds.min.abs().max(bounds.max.abs()).max_element();
    Accuracy {
        iso: options.iso,
        distance: (options.tolerance * bounds.diagonal()).max(4.0 * f64::EPSILON * farthest),
    }
}

/// The grid over the box: each axis is divided into equal cells, as few as `cell` allows.
///
/// # Errors
///
/// Too many cells.
fn uniform_grid(options: &Options) -> Result<Grid, PolygonizeError> {
    let counts = cell_counts(options);
    check_cells(counts.iter().product(), options)?;
    let counts: Vec<usize> = counts.into_iter().map(|count| count as usize).collect();
    // In R1 there is nothing to be closed.
    let cap = options.cap && options.bounds.dimension > 1;
    Ok(Grid::new(&options.bounds, &counts, cap))
}

/// The number of cells along each axis of a box in R3.
///
/// # Errors
///
/// Too many cells.
fn grid_counts(options: &Options) -> Result<[usize; 3], PolygonizeError> {
    let counts = cell_counts(options);
    check_cells(counts.iter().product(), options)?;
    Ok(std::array::from_fn(|axis| {
        counts.get(axis).map_or(1, |&count| count as usize)
    }))
}

/// The number of cells along each axis: as few as `cell` allows.
fn cell_counts(options: &Options) -> Vec<f64> {
    let count = |(low, high): (f64, f64)| {
        // A quotient that exceeds an integer by no more than rounding needs no further cell.
        ((high - low) / options.cell * (1.0 - 1e-12))
            .ceil()
            .max(1.0)
    };
    options.bounds.sides().map(count).collect()
}

/// Refuses more cells than are allowed.
fn check_cells(needed: f64, options: &Options) -> Result<(), PolygonizeError> {
    if needed > options.cell_limit as f64 {
        return Err(PolygonizeError::TooManyCells {
            needed,
            limit: options.cell_limit,
        });
    }
    Ok(())
}
