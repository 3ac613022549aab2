//! Patches that become fans around a vertex on a sharp edge or at a corner.

use std::ops::Range;

use glam::DVec3;

use super::corners;
use crate::geometry::Mesh;
use crate::polygonize::Job;
use crate::polygonize::cubes::CellTriangles;
use crate::polygonize::dual::{Loop, SharpPoint, are_smooth, sharp_points};
use crate::polygonize::grid::Grid;

/// How far beyond its cell a new vertex may be, as a part of the cell's sides.
const REACH: f64 = 1.0;

/// A patch that becomes a fan.
#[derive(Clone, Debug)]
pub(super) struct Fan {
    /// The new vertex.
    pub(super) position: DVec3,
    /// The outward normal there: the mean of the sides'.
    pub(super) normal: DVec3,
    /// The sides of the patch, each with the surface on its left.
    pub(super) sides: Vec<[u32; 2]>,
    /// The numbers of the patch's triangles.
    pub(super) replaced: Vec<usize>,
    /// The sides, by their places, at which its triangles turn their backs to the surface: they lie
    /// over a neighbouring patch.
    pub(super) turned: Vec<usize>,
}

/// The fans of some cells, in their order.
pub(super) struct Fans {
    pub(super) fans: Vec<Fan>,
    /// Points at which F and F_x were taken.
    pub(super) evaluations: usize,
    /// The greatest |F − iso| / |F_x| at a new vertex.
    pub(super) max_residual: f64,
}

impl Fans {
    /// The fans of those of the cells that have these numbers.
    pub(super) fn of_cells(
        (job, grid, mesh): (&Job, &Grid, &Mesh),
        cells: &[CellTriangles],
        numbers: Range<usize>,
    ) -> Fans {
        let (mut loops, mut roots, mut patches) = (Vec::new(), Vec::new(), Vec::new());
        for number in numbers {
            if job.monitor.cancelled() {
                break;
            }
            let end = (cells.get(number + 1)).map_or(mesh.triangles.len(), |next| next.first);
            let triangles = cells[number].first..end;
            let normals = mesh.triangles[triangles.clone()].iter().flatten();
            if are_smooth(normals.map(|&vertex| mesh.normals[vertex as usize])) {
                continue;
            }
            let cell = corners(grid, cells[number].start);
            for patch in patches_of(&mesh.triangles, triangles) {
                let first = roots.len();
                roots.extend(contacts(mesh, cell, &patch));
                let known = roots[first..].iter().map(|[_, normal]| *normal);
                if roots.len() - first < 2 || are_smooth(known) {
                    roots.truncate(first);
                    continue;
                }
                let roots = first..roots.len();
                loops.push(Loop { cell, roots });
                patches.push(patch);
            }
        }
        let is_fit = |place: usize, point: DVec3| {
            let [low, high] = loops[place].cell;
            let slack = REACH * (high - low);
            let [least, most] = corners_of_box(grid);
            point.cmpge((low - slack).max(least)).all()
                && point.cmple((high + slack).min(most)).all()
        };
        let mut field = job.field;
        let (points, evaluations) =
            sharp_points(&mut field, job.accuracy, (&loops, &roots), &is_fit);
        let mut found = Fans {
            fans: Vec::new(),
            evaluations,
            max_residual: 0.0,
        };
        for ((patch, point), own) in patches.into_iter().zip(points).zip(&loops) {
            if let Some(point) = point
                && point.residual <= job.accuracy.distance
                && let Some(turned) = turned_sides(mesh, &patch, (&point, own.cell))
            {
                found.max_residual = found.max_residual.max(point.residual);
                found.fans.push(Fan {
                    position: point.position,
                    normal: point.normal,
                    sides: patch.sides,
                    replaced: patch.triangles,
                    turned,
                });
            }
        }
        found
    }
}

/// The triangles in a cell that hang together.
struct Patch {
    /// Their numbers.
    triangles: Vec<usize>,
    /// The sides that belong to one of them only, on its left: a single closed loop.
    sides: Vec<[u32; 2]>,
}

/// The patches of a cell that are disks.
fn patches_of(triangles: &[[u32; 3]], numbers: Range<usize>) -> Vec<Patch> {
    let mut rest: Vec<usize> = numbers.collect();
    let mut patches = Vec::new();
    while let Some(first) = rest.first().copied() {
        let mut own = vec![first];
        let mut next = 0;
        rest.remove(0);
        while next < own.len() {
            let corners = triangles[own[next]];
            next += 1;
            rest.retain(|&other| {
                let touches = triangles[other]
                    .iter()
                    .any(|corner| corners.contains(corner));
                if touches {
                    own.push(other);
                }
                !touches
            });
        }
        let all: Vec<[u32; 2]> = own
            .iter()
            .flat_map(|&number| sides(triangles[number]))
            .collect();
        let outer = all
            .iter()
            .copied()
            .filter(|&[from, to]| !all.contains(&[to, from]));
        if let Some(sides) = single_loop(outer.collect()) {
            own.sort_unstable();
            patches.push(Patch {
                triangles: own,
                sides,
            });
        }
    }
    patches
}

fn sides([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// The sides in the order of the loop that they make; `None` if it is more than one, as at the ends
/// of a tunnel.
fn single_loop(mut sides: Vec<[u32; 2]>) -> Option<Vec<[u32; 2]>> {
    for place in 1..sides.len() {
        let end = sides[place - 1][1];
        let next = (place..sides.len()).find(|&other| sides[other][0] == end)?;
        sides.swap(place, next);
    }
    Some(sides)
}

/// The roots of a patch with their normals, those of a flat cell, in a side of the box, within its
/// plane. The vertices that close the surface there, at the corners of flat cells, are no roots.
fn contacts(
    mesh: &Mesh,
    [low, high]: [DVec3; 2],
    patch: &Patch,
) -> impl Iterator<Item = [DVec3; 2]> {
    let wide = low.cmplt(high);
    let at = move |&[vertex, _]: &[u32; 2]| {
        let vertex = vertex as usize;
        let normal = DVec3::select(wide, mesh.normals[vertex], DVec3::ZERO);
        [mesh.positions[vertex], normal.normalize_or_zero()]
    };
    let is_root = move |[position, normal]: &[DVec3; 2]| {
        let is_corner = (position.cmpeq(low) | position.cmpeq(high)).all();
        *normal != DVec3::ZERO && (wide.all() || !is_corner)
    };
    patch.sides.iter().map(at).filter(is_root)
}

/// The sides at which the triangles of a fan around a point turn their backs to the surface though it
/// is smooth there. `None` if some do elsewhere. Triangles without area do not.
fn turned_sides(
    mesh: &Mesh,
    patch: &Patch,
    (point, [low, high]): (&SharpPoint, [DVec3; 2]),
) -> Option<Vec<usize>> {
    let mut turned = Vec::new();
    for (place, side) in patch.sides.iter().enumerate() {
        let [a, b] = side.map(|vertex| mesh.positions[vertex as usize]);
        let across = (b - a).cross(point.position - a);
        let normals = side.map(|vertex| mesh.normals[vertex as usize]);
        let is_smooth = low.cmplt(high).all() && are_smooth(normals.into_iter());
        if is_smooth && normals.iter().any(|normal| across.dot(*normal) < 0.0) {
            turned.push(place);
        } else if across.dot(normals[0] + normals[1]) < 0.0 {
            return None;
        }
    }
    Some(turned)
}

/// The lowest and the highest corner of the box.
fn corners_of_box(grid: &Grid) -> [DVec3; 2] {
    let corner = |pick: fn(&[f64]) -> Option<&f64>| {
        DVec3::from_array(
            [0, 1, 2].map(|axis| pick(&grid.coordinates[axis]).copied().unwrap_or_default()),
        )
    };
    [corner(<[f64]>::first), corner(<[f64]>::last)]
}
