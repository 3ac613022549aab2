//! Points on sharp edges and at corners, for other methods that have the roots around them.

use std::ops::Range;

use glam::DVec3;

use super::place::{Contact, Placer, Site, are_alike};
use crate::polygonize::columns::{Columns, Evaluate};
use crate::polygonize::edge_roots::Accuracy;

/// Roots around which the surface may have a sharp edge or a corner.
#[derive(Clone, Debug)]
pub(in crate::polygonize) struct Loop {
    /// The lowest and the highest point of the cell; in a flat cell F counts along its plane only.
    pub(in crate::polygonize) cell: [DVec3; 2],
    /// The positions of the roots with the normals there, as a range of the list; not empty.
    pub(in crate::polygonize) roots: Range<usize>,
}

/// A point on a sharp edge or at a corner.
#[derive(Clone, Copy, Debug)]
pub(in crate::polygonize) struct SharpPoint {
    /// Where.
    pub(in crate::polygonize) position: DVec3,
    /// The mean of the sides' normals, of length 1.
    pub(in crate::polygonize) normal: DVec3,
    /// |F − iso| / |F_x|.
    pub(in crate::polygonize) residual: f64,
}

/// The sharp point of each loop, if there is one where `is_fit` says so for the number of the loop;
/// and how often F and F_x were evaluated.
///
/// The first guess is the point nearest to the tangent planes at the roots, of least distance from
/// their middle; `place` says how it is improved, and told from strong curvature.
pub(in crate::polygonize) fn sharp_points(
    field: &mut impl Evaluate,
    accuracy: Accuracy,
    (loops, roots): (&[Loop], &[[DVec3; 2]]),
    is_fit: &dyn Fn(usize, DVec3) -> bool,
) -> (Vec<Option<SharpPoint>>, usize) {
    let contacts: Vec<Contact> = (roots.iter())
        .map(|&[position, normal]| Contact { position, normal })
        .collect();
    let sites: Vec<Site> = loops
        .iter()
        .map(|own| {
            let positions = roots[own.roots.clone()]
                .iter()
                .map(|[position, _]| position);
            Site {
                low: own.cell[0],
                high: own.cell[1],
                // Clamped, since rounding must not lead out of a flat cell.
                middle: (positions.sum::<DVec3>() / own.roots.len() as f64)
                    .clamp(own.cell[0], own.cell[1]),
                roots: own.roots.clone(),
                outward: DVec3::ZERO,
            }
        })
        .collect();
    let mut columns = Columns::default();
    let mut placer = Placer {
        field,
        iso: accuracy.iso,
        tolerance: accuracy.distance,
        columns: &mut columns,
        evaluations: 0,
    };
    let found = placer.find_sharp(&sites, &contacts, is_fit).into_iter();
    let points = found.map(|vertex| {
        vertex.map(|vertex| SharpPoint {
            position: vertex.position,
            normal: vertex.normal,
            residual: vertex.residual,
        })
    });
    (points.collect(), placer.evaluations)
}

/// Whether normals point in nearly the same direction, so that no sharp edge is between them.
pub(in crate::polygonize) fn are_smooth(normals: impl Iterator<Item = DVec3> + Clone) -> bool {
    are_alike(normals)
}
