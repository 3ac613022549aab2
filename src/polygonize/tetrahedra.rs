//! Marching tetrahedra on the cells of a uniform grid.
//!
//! Each cell is divided into tetrahedra ([`Split`](super::Split)), or the centres of cells are points of the
//! body-centred cubic lattice, whose tetrahedra lie across the sides of cells. Corners, centres
//! of cells and centres of faces are grids of their own, each evaluated layer by layer, in slabs
//! as marching cubes does it; memory grows with the surface and with a layer.

mod split;

use std::ops::Range;

use self::split::{Pattern, Tetrahedron};
use super::grid::{Grid, Layer, Seen, Sweep, for_each_slab};
use super::simplices::{self, Lattice, Piece, Place, Skin};
use super::{Found, Job, PolygonizeError, Shape, Statistics, grid_counts};

/// The mesh of the level set by marching tetrahedra: oriented and manifold whatever the field is,
/// watertight unless the box cuts it and there is no cap.
pub(super) fn march(job: &Job) -> Result<Found, PolygonizeError> {
    let options = job.options;
    let cells = grid_counts(options)?;
    let needed = cells.iter().map(|&count| count as f64).product();
    let lattice = Lattice::new(&options.bounds, cells).ok_or(PolygonizeError::TooManyCells {
        needed,
        limit: options.cell_limit,
    })?;
    let pattern = Pattern::new(options.split);
    let plan = Plan::new(job, &lattice, &pattern);
    // The corners of cells; caps need no ghosts here.
    let Some(corners) = plan.grids.first().and_then(Option::as_ref) else {
        return Err(PolygonizeError::Cancelled);
    };
    let slabs = for_each_slab(corners, "marching tetrahedra", job.monitor, |cells| {
        Slab::new(&plan).march(cells)
    })?;
    let mut seen = Seen::default();
    let mut evaluations = 0;
    let mut pieces = Vec::with_capacity(slabs.len());
    for slab in slabs {
        seen = seen.and(slab.seen);
        evaluations += slab.evaluations;
        pieces.push(slab.piece);
    }
    let piece = simplices::join(pieces, |vertex| plan.is_shared(vertex.ends))?;
    let (mesh, statistics) = simplices::finish(job, &lattice, &piece)?;
    let statistics = Statistics {
        cells: corners.cells(),
        evaluations: statistics.evaluations + evaluations,
        nan_points: seen.nan,
        ..statistics
    };
    Ok((Shape::Mesh(mesh), seen, statistics))
}

/// What all slabs have in common.
struct Plan<'a> {
    job: &'a Job<'a>,
    lattice: &'a Lattice,
    pattern: &'a Pattern,
    /// The points that a cell's tetrahedra have.
    points: Vec<[i32; 3]>,
    /// The grids that the lattice consists of, those with points of the pattern. Bit a of the
    /// number tells whether the places along axis a are odd.
    grids: [Option<Grid>; 8],
    /// Cells along each axis.
    cells: [usize; 3],
    /// Whether layers of odd places are needed from the slab below.
    looks_back: bool,
}

impl<'a> Plan<'a> {
    fn new(job: &'a Job, lattice: &'a Lattice, pattern: &'a Pattern) -> Self {
        let points = pattern.points();
        let grid = |number: usize| {
            let used = number == 0 || points.iter().any(|&point| grid_number(point) == number);
            let along = |axis: usize| {
                let odd = number >> axis & 1;
                let places = lattice.coordinates(axis).iter().skip(odd);
                places.step_by(2).copied().collect()
            };
            used.then(|| Grid {
                coordinates: (0..3).map(along).collect(),
                ghosts: 0,
                goes_on: [[false; 2]; 3],
            })
        };
        Plan {
            job,
            lattice,
            pattern,
            grids: std::array::from_fn(grid),
            cells: lattice.top.map(|top| top as usize / 2),
            looks_back: points.iter().any(|point| point[2] < 0),
            points,
        }
    }

    /// Whether a vertex may be in two slabs: its edge leaves or touches layers between cells.
    fn is_shared(&self, ends: [u64; 2]) -> bool {
        let [one, other] = ends.map(|end| self.lattice.place(end)[2]);
        // Edges between two layers of corners or within one of centres belong to one slab, unless
        // tetrahedra lie across the sides of cells.
        self.looks_back || one == other && one % 2 == 0
    }
}

/// The number of the grid that a place belongs to.
fn grid_number(place: [i32; 3]) -> usize {
    let odd = |axis: usize| ((place[axis] & 1) as usize) << axis;
    odd(0) | odd(1) | odd(2)
}

/// Two neighbouring layers of one of the grids: corners in the layers below and above a layer of
/// cells, or the middles in the layer of cells before and in this one.
struct Window<'a> {
    sweep: Sweep<'a>,
    layers: [Layer; 2],
    /// Along each axis, whether places are odd.
    odd: [bool; 3],
    /// Points along the first axis.
    width: usize,
}

/// What comes of a slab.
struct Done {
    piece: Piece,
    seen: Seen,
    evaluations: usize,
}

/// A slab in the course of the work.
struct Slab<'a> {
    plan: &'a Plan<'a>,
    windows: [Option<Window<'a>>; 8],
    skin: Skin<'a>,
    seen: Seen,
    evaluations: usize,
    /// The layer of cells.
    index: usize,
}

impl<'a> Slab<'a> {
    fn new(plan: &'a Plan<'a>) -> Self {
        let Job {
            field,
            accuracy,
            monitor,
            options,
        } = *plan.job;
        let window = |number: usize| {
            let grid = plan.grids[number].as_ref()?;
            let sweep = Sweep::new(field, accuracy.iso, grid, monitor);
            Some(Window {
                layers: [sweep.layer(), sweep.layer()],
                sweep,
                odd: [0, 1, 2].map(|axis| number >> axis & 1 == 1),
                width: grid.points(0),
            })
        };
        Slab {
            plan,
            windows: std::array::from_fn(window),
            skin: Skin::new(plan.lattice, options.cap),
            seen: Seen::default(),
            evaluations: 0,
            index: 0,
        }
    }

    /// Marches through layers of cells.
    fn march(mut self, cells: Range<usize>) -> Done {
        self.evaluate(|odd| match odd {
            false => Some((cells.start, true)),
            // Counted by the slab that it belongs to.
            true => (cells.start > 0 && self.plan.looks_back).then(|| (cells.start - 1, false)),
        });
        let row = self.plan.cells[0];
        let mut flags = [vec![0; row], vec![0; row]];
        for index in cells.clone() {
            if self.plan.job.monitor.cancelled() {
                break;
            }
            let last = index + 1 == self.plan.cells[2];
            let own = index + 1 < cells.end || last;
            self.evaluate(|odd| Some(if odd { (index, true) } else { (index + 1, own) }));
            self.index = index;
            for j in 0..self.plan.cells[1] {
                self.march_row(j, &mut flags);
            }
        }
        Done {
            piece: self.skin.into_piece(),
            seen: self.seen,
            evaluations: self.evaluations,
        }
    }

    /// Moves every window on by a layer, which `next` names for even and odd places together with
    /// whether its points are counted here.
    fn evaluate(&mut self, next: impl Fn(bool) -> Option<(usize, bool)>) {
        for window in self.windows.iter_mut().flatten() {
            window.layers.swap(0, 1);
            if let Some((index, counts)) = next(window.odd[2]) {
                let seen = window.sweep.evaluate(index, &mut window.layers[1]);
                self.evaluations += seen.points();
                if counts {
                    self.seen = self.seen.and(seen);
                }
            }
        }
    }

    /// Adds the surface in a row of cells. `flags` is scratch.
    fn march_row(&mut self, j: usize, [any, all]: &mut [Vec<u8>; 2]) {
        any.fill(0);
        all.fill(1);
        for &[x, y, z] in &self.plan.points {
            let row = 2 * j as i32 + y;
            if row < 0 || self.index == 0 && z < 0 {
                continue;
            }
            let Some(window) = &self.windows[grid_number([x, y, z])] else {
                continue;
            };
            let start = (row as usize >> 1) * window.width;
            let flags = &window.layers[layer_of(z)].inside[start..start + window.width];
            // The place of the cell's point among those of the row.
            let (skipped, flags) = match x >> 1 {
                0 => (0, flags),
                1 => (0, &flags[1..]),
                _ => (1, flags),
            };
            let sums = any[skipped..].iter_mut().zip(&mut all[skipped..]);
            for ((any, all), flag) in sums.zip(flags) {
                *any |= flag;
                *all &= flag;
            }
        }
        for i in 0..any.len() {
            if any[i] != 0 {
                let capped = self.plan.job.options.cap && self.touches_side([i, j, self.index]);
                if all[i] == 0 || capped {
                    self.march_cell([i, j, self.index], capped);
                }
            }
        }
    }

    fn touches_side(&self, cell: [usize; 3]) -> bool {
        (0..3).any(|axis| cell[axis] == 0 || cell[axis] + 1 == self.plan.cells[axis])
    }

    /// Adds the surface in the tetrahedra of a cell.
    fn march_cell(&mut self, cell: [usize; 3], capped: bool) {
        let pattern = self.plan.pattern;
        self.march_list(
            &pattern.cell[(cell[0] + cell[1] + cell[2]) % 2],
            cell,
            capped,
        );
        for (axis, &index) in cell.iter().enumerate() {
            let [low, high] = &pattern.wall[axis];
            let lower = if index == 0 {
                low
            } else {
                &pattern.between[axis]
            };
            self.march_list(lower, cell, capped);
            if index + 1 == self.plan.cells[axis] {
                self.march_list(high, cell, capped);
            }
        }
    }

    fn march_list(&mut self, tetrahedra: &[Tetrahedron], cell: [usize; 3], capped: bool) {
        let Slab { windows, skin, .. } = self;
        let first = self.index;
        // The window and layer of a place, and its indices there.
        let find = |place: Place| {
            let place = place.map(|place| place as i32);
            let window = windows[grid_number(place)].as_ref()?;
            let layer = layer_of(place[2] - 2 * first as i32);
            Some((
                window,
                layer,
                (place[0] >> 1) as usize,
                (place[1] >> 1) as usize,
            ))
        };
        let is_inside = |place: Place| {
            find(place).is_some_and(|(window, layer, i, j)| {
                window.layers[layer].inside[j * window.width + i] != 0
            })
        };
        let value = |place: Place| {
            find(place).map_or(f64::NAN, |(window, layer, i, j)| {
                window.sweep.value(&window.layers[layer], i, j)
            })
        };
        for tetrahedron in tetrahedra {
            let corners = tetrahedron
                .map(|offset| [0, 1, 2].map(|axis| (2 * cell[axis] as i32 + offset[axis]) as u32));
            let inside = (0..4).map(|number| u8::from(is_inside(corners[number])) << number);
            let inside = inside.sum();
            if inside != 0 && (inside != 15 || capped) {
                skin.add(&corners, inside, &value);
            }
        }
    }
}

/// In which layer of its window a place is, by its last coordinate relative to the cell.
fn layer_of(z: i32) -> usize {
    // Even places are 0 and 2, odd ones −1 and 1.
    usize::from(z > 0)
}
