//! Extended marching cubes: marching cubes with further vertices on sharp edges and at corners.
//!
//! L. P. Kobbelt, M. Botsch, U. Schwanecke, H.-P. Seidel, "Feature sensitive surface extraction from
//! volume data", SIGGRAPH 2001. Roots and topology are those of [`cubes`](super::cubes). Where the
//! normals at the roots of one loop (the border of a patch of surface in a cell) differ, the patch
//! becomes a fan around a new vertex, the point nearest to the tangent planes at the roots
//! (`fans`). At last edges between two fans are flipped, so that sharp edges are edges of the mesh
//! (`weave`, `flips`). Loops without a new vertex keep the triangles of the case: a smooth surface has the
//! mesh of marching cubes.
//!
//! It differs from the paper in three points. What the paper decides by the angles between the
//! normals, whether a patch has an edge (θ) or a corner (φ), is decided near the new vertex,
//! where the normals on each side agree however curved it is; and there the vertex is improved, so
//! that it is on the edge also where the sides are curved. A fan is made only if no triangle of it
//! turns its back to the surface, or flips put that right. Flips also join new vertices across patches
//! that have none, if that brings the mesh nearer to the surface.
//!
//! Compared with dual contouring: smooth parts keep the thin triangles of marching cubes, there are more
//! triangles, and vertices are found from the roots of one cell alone. Where sharp edges are closer
//! together than about two cells or strongly curved, some are cut off and facets may be turned; where
//! they pass through grid points, triangles without area may be left. Where a sharp edge leaves the box,
//! the corner of the cap is cut off, by less than a cell, unless its cell in the side has roots of both
//! sides; without a cap the edge is always cut off in its last cell.

mod fans;
mod flips;
mod weave;

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use self::fans::{Fan, Fans};
use self::weave::weave;
use super::cubes::{self, Rough};
use super::grid::Grid;
use super::{Found, Job, PolygonizeError, Shape, uniform_grid};

/// So many cells are done at a time.
const BATCH: usize = 4096;

/// The mesh of the level set by extended marching cubes: oriented and manifold, watertight unless
/// the box cuts it and there is no cap.
pub(super) fn march(job: &Job) -> Result<Found, PolygonizeError> {
    let grid = &uniform_grid(job.options)?;
    let Rough {
        mut mesh,
        cells,
        seen,
        mut statistics,
        ..
    } = cubes::rough(job, grid, true)?;
    let pieces: Vec<Fans> = (0..cells.len().div_ceil(BATCH))
        .into_par_iter()
        .map(|number| {
            let end = cells.len().min((number + 1) * BATCH);
            Fans::of_cells((job, grid, &mesh), &cells, number * BATCH..end)
        })
        .collect();
    if job.monitor.cancelled() {
        return Err(PolygonizeError::Cancelled);
    }
    for piece in &pieces {
        statistics.evaluations += piece.evaluations;
        statistics.max_residual = statistics.max_residual.max(piece.max_residual);
    }
    let fans: Vec<Fan> = pieces.into_iter().flat_map(|piece| piece.fans).collect();
    statistics.evaluations += weave((job, grid, &mut mesh), &fans)?;
    mesh.collapse_degenerate_edges();
    Ok((Shape::Mesh(mesh), seen, statistics))
}

/// The lowest and the highest corner of a cell.
fn corners(grid: &Grid, start: [u32; 3]) -> [glam::DVec3; 2] {
    grid.cell(start.map(|index| index as usize))
}
