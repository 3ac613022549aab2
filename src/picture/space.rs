//! Solids: what each pixel's ray meets first.
//!
//! The screen with its depths is a box of the engine's driver, which goes through it from front
//! to back, tile by tile, and leaves out what is proven to be outside or hidden. In the cubes
//! that are left F is evaluated in f32 at the slices' ends, a few slices at a time, until a ray
//! is inside ([`super::march`]); the root, and the normal, are found in f64. So a sheet thinner
//! than a slice, which is as thick as a pixel is wide, can be missed.

use std::ops::Range;

use glam::{DMat3, DVec3, Vec3};

use super::PictureError;
use super::camera::{Camera, SLICE_GROUP};
use super::march::{LEAF, March, SLICES};
use super::root::{Bracket, Rooter, Surface};
use crate::engine::{Cell, CompiledField, Explorer, Monitor, Specialized, Subdivision, explore};
use crate::graph::Interval;
use crate::graph::interval::{Enclosure, Regularity};

/// The side of a tile, which is one task, in pixels.
const TILE: usize = 128;

/// The side of the cubes that F is pruned for.
const CUBE: usize = SLICE_GROUP;

/// How near to a side of the box a root is a cut, in pixels.
const CUT: f64 = 1e-3;

/// What a pixel's ray meets first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Hit {
    /// Nothing.
    #[default]
    Nothing,
    /// The zero set.
    Surface,
    /// The inside, cut open by a side of the box.
    Cut,
    /// The inside, which begins there with a jump, at a pole or where F begins to be defined.
    Jump,
}

/// What the pixels of a camera see, row by row from the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HeightMap {
    /// Pixels in a row.
    pub width: usize,
    /// The number of rows.
    pub height: usize,
    /// What each pixel sees.
    pub hits: Vec<Hit>,
    /// How far away, in slices of the camera; infinite for nothing.
    pub depths: Vec<f32>,
    /// The unit normal there, in space: F_x/|F_x|, or that of the box's side; 0 for nothing and
    /// where F_x does not tell.
    pub normals: Vec<Vec3>,
    /// At how many points in the box F was seen not to be a number.
    pub undefined: u64,
}

/// What the pixels of the camera see of the solid F < 0 in the camera's box. The middles of
/// pixels are what counts.
///
/// # Errors
///
/// `Cancelled` if the monitor says so.
pub fn height_map(
    field: &CompiledField,
    camera: &Camera,
    monitor: &dyn Monitor,
) -> Result<HeightMap, PictureError> {
    let seen = camera.through(field);
    let rays = Rays {
        camera,
        in_single: camera.suits_single_precision(),
        straight: camera.eye().is_none().then(|| turn(camera, [0.0; 3])),
    };
    let tasks = explore(&seen, &rays.subdivision(), &rays, monitor);
    if monitor.cancelled() {
        return Err(PictureError::Cancelled);
    }
    Ok(rays.assemble(&seen, tasks))
}

/// The explorer.
struct Rays<'a> {
    camera: &'a Camera,
    /// Whether signs are looked for in f32.
    in_single: bool,
    /// What turns gradients on the screen into those in space, and the size of a pixel, if they
    /// are the same for all rays.
    straight: Option<(DMat3, f64)>,
}

/// What the pixels of a tile see.
struct Tile {
    left: usize,
    top: usize,
    /// By rows: the pixels whose rays have met nothing yet, a bit each; none beyond the image.
    open: [u128; TILE],
    /// How many are open.
    rest: u32,
    hits: Vec<Hit>,
    depths: Vec<f32>,
    normals: Vec<Vec3>,
    /// At how many points F is not a number.
    undefined: u64,
}

/// A tile at work.
struct Task {
    tile: Tile,
    /// Rays that were proven to be inside although no root was seen on the way.
    pending: Vec<Bracket>,
    march: Box<March>,
    /// Slices whose roots are harder to find.
    hard: Vec<Bracket>,
    rooter: Rooter,
}

/// What turns gradients on the screen into those in space, by the chain rule the inverse of the
/// camera's transposed Jacobian, and the size of a pixel.
fn turn(camera: &Camera, screen: [f64; 3]) -> (DMat3, f64) {
    let jacobian = camera.jacobian(screen);
    (jacobian.inverse().transpose(), jacobian.x_axis.length())
}

impl Rays<'_> {
    fn subdivision(&self) -> Subdivision {
        let [width, height] = self.camera.size().map(|count| count.div_ceil(TILE));
        let slices = self.camera.slices();
        let high = [width * TILE, height * TILE, slices].map(|count| count as f64);
        Subdivision {
            low: DVec3::ZERO,
            high: DVec3::from_array(high),
            splits: vec![
                [width, height, 1],
                [TILE / CUBE, TILE / CUBE, slices / CUBE],
                [CUBE / LEAF; 3],
            ],
            descending: [false; 3],
        }
    }

    /// The tiles' pixels in one list, with what was left to be done.
    fn assemble(&self, field: &CompiledField, tasks: Vec<Task>) -> HeightMap {
        let [width, height] = self.camera.size();
        let count = width * height;
        let mut map = HeightMap {
            width,
            height,
            hits: vec![Hit::Nothing; count],
            depths: vec![f32::INFINITY; count],
            normals: vec![Vec3::ZERO; count],
            undefined: 0,
        };
        for task in tasks {
            let tile = self.settle(field, task);
            map.undefined += tile.undefined;
            let columns = TILE.min(width - tile.left);
            for row in 0..TILE.min(height - tile.top) {
                let from = row * TILE..row * TILE + columns;
                let start = (tile.top + row) * width + tile.left;
                let to = start..start + columns;
                map.hits[to.clone()].copy_from_slice(&tile.hits[from.clone()]);
                map.depths[to.clone()].copy_from_slice(&tile.depths[from.clone()]);
                map.normals[to].copy_from_slice(&tile.normals[from]);
            }
        }
        map
    }

    /// Finds the roots of the rays that were left pending.
    fn settle(&self, mut field: &CompiledField, task: Task) -> Tile {
        let Task {
            mut tile,
            pending,
            mut rooter,
            ..
        } = task;
        for (bracket, surface) in pending.iter().zip(rooter.solve(&pending, &mut field)) {
            // Proven to be inside, so whatever the numbers say, there is something.
            let surface = surface.unwrap_or(Surface {
                depth: bracket.inside,
                gradient: DVec3::ZERO,
                is_root: false,
            });
            self.meet(&mut tile, bracket.pixel, &surface, true);
        }
        tile
    }

    /// Whether the cell may touch a side of the box.
    fn touches_side(&self, cell: &Cell) -> bool {
        let ends = [cell.low, cell.high];
        // All of it is between its corners: the map is linear along each axis of the screen.
        (0..8).any(|corner| {
            let end = |axis: usize| ends[corner >> axis & 1][axis];
            let screen = [end(0), end(1), end(2)];
            let point = self.camera.point(screen);
            let width = self
                .straight
                .map_or_else(|| self.camera.pixel_at(screen), |(_, width)| width);
            self.camera.side_at(point, width).is_some()
        })
    }

    /// Notes what a ray has met, which may be a side of the box if the ray is near one.
    fn meet(&self, tile: &mut Tile, pixel: u16, surface: &Surface, is_near_side: bool) {
        let [u, v] = tile.middle(pixel);
        let screen = [u, v, surface.depth];
        let (turn, width) = self.straight.unwrap_or_else(|| turn(self.camera, screen));
        let side = match is_near_side {
            true => (self.camera).side_at(self.camera.point(screen), CUT * width),
            false => None,
        };
        let (hit, normal) = match side {
            Some(normal) => (Hit::Cut, normal),
            None if surface.is_root => (Hit::Surface, direction(turn * surface.gradient)),
            None => (Hit::Jump, direction(turn * surface.gradient)),
        };
        let pixel = usize::from(pixel);
        let (open, bit) = (&mut tile.open[pixel / TILE], 1 << (pixel % TILE));
        tile.rest -= u32::from(*open & bit != 0);
        *open &= !bit;
        tile.hits[pixel] = hit;
        tile.depths[pixel] = surface.depth as f32;
        tile.normals[pixel] = normal.as_vec3();
    }

    /// Follows all rays, which are at the same depth, from the slices' end with the number `next`
    /// in the cube to where they are inside or leave it; the former are found.
    fn follow(
        &self,
        march: &mut March,
        undefined: &mut u64,
        (cell, mut next): (&Cell, usize),
        field: &mut Specialized<'_>,
    ) {
        while march.count > 0 && next <= LEAF {
            let steps = SLICES.min(LEAF + 1 - next);
            let depth = cell.low.z + next as f64;
            march.evaluate((depth as f32, steps), self.in_single, field);
            if march.has_undefined() {
                // In f32 that may be an overflow, so it is computed again.
                march.evaluate_wide(field);
                let is_seen = |&screen: &[f64; 3]| self.camera.sees(self.camera.point(screen));
                *undefined += march.undefined().filter(is_seen).count() as u64;
            }
            march.advance(depth);
            next += steps;
        }
        march.count = 0;
    }

    /// Finds the roots in the slices that were found; those that are harder are put aside.
    fn strike(&self, task: &mut Task, is_near_side: bool, field: &mut Specialized<'_>) {
        let Task {
            tile, march, hard, ..
        } = task;
        let found = &mut march.found;
        found.strike(field);
        hard.clear();
        for place in 0..found.count {
            let pixel = found.pixels[place];
            if found.is_cut_at_front(place) {
                self.meet(tile, pixel, &Surface::CUT_AT_FRONT, true);
            } else if let Some(surface) = found.surface(place) {
                self.meet(tile, pixel, &surface, is_near_side);
            } else {
                hard.push(found.bracket(place));
            }
        }
        found.count = 0;
    }
}

/// The direction of a vector; 0 where there is none.
fn direction(vector: DVec3) -> DVec3 {
    let square = vector.length_squared();
    if square > 1e-200 && square < 1e200 {
        return vector * (1.0 / square.sqrt());
    }
    let scale = vector.abs().max_element();
    if scale > 0.0 && scale.is_finite() {
        (vector / scale).normalize()
    } else {
        DVec3::ZERO
    }
}

impl Tile {
    /// The middle of a pixel, in screen coordinates.
    fn middle(&self, pixel: u16) -> [f64; 2] {
        let (row, column) = (usize::from(pixel) / TILE, usize::from(pixel) % TILE);
        [
            (self.left + column) as f64 + 0.5,
            (self.top + row) as f64 + 0.5,
        ]
    }

    /// The rows of a cell in the tile, and the bits of its columns.
    fn rectangle(&self, cell: &Cell) -> (Range<usize>, u128) {
        let rows = whole(cell.low.y) - self.top..whole(cell.high.y) - self.top;
        let columns = whole(cell.low.x) - self.left..whole(cell.high.x) - self.left;
        let bits = u128::MAX >> (TILE - columns.len()) << columns.start;
        (rows, bits)
    }

    /// Adds the cell's rays that have met nothing yet.
    fn march_in(&self, cell: &Cell, march: &mut March) {
        let (rows, columns) = self.rectangle(cell);
        let left = columns.trailing_zeros() as usize;
        for row in rows {
            let bits = (self.open[row] >> left) as u8;
            let first = (row * TILE + left) as u16;
            march.add_row(bits, first, self.middle(first));
        }
    }

    /// Calls `visit` with every pixel of the cell whose ray has met nothing yet.
    fn for_each_open(&self, cell: &Cell, mut visit: impl FnMut(u16)) {
        let (rows, columns) = self.rectangle(cell);
        for row in rows {
            let mut bits = self.open[row] & columns;
            while bits != 0 {
                visit((row * TILE) as u16 + bits.trailing_zeros() as u16);
                bits &= bits - 1;
            }
        }
    }
}

/// The pixel at which a cell begins or ends. It is a whole number but for rounding: faces are
/// fractions of the box.
fn whole(face: f64) -> usize {
    (face + 0.5) as usize
}

impl Explorer for Rays<'_> {
    type Task = Task;

    fn begin(&self, cell: &Cell) -> Task {
        let (left, top) = (whole(cell.low.x), whole(cell.low.y));
        let [width, height] = self.camera.size();
        let count = TILE * TILE;
        let columns = u128::MAX >> (TILE - TILE.min(width - left));
        let open: [u128; TILE] =
            std::array::from_fn(|row| if top + row < height { columns } else { 0 });
        Task {
            tile: Tile {
                left,
                top,
                rest: open.iter().map(|row| row.count_ones()).sum(),
                open,
                hits: vec![Hit::Nothing; count],
                depths: vec![f32::INFINITY; count],
                normals: vec![Vec3::ZERO; count],
                undefined: 0,
            },
            pending: Vec::new(),
            march: Box::default(),
            hard: Vec::new(),
            rooter: Rooter::default(),
        }
    }

    fn wants(&self, task: &mut Task, cell: &Cell) -> bool {
        if task.tile.rest == 0 {
            return false;
        }
        let (rows, columns) = task.tile.rectangle(cell);
        task.tile.open[rows].iter().any(|row| row & columns != 0)
    }

    fn decides(&self, _cell: &Cell, enclosure: &Enclosure) -> bool {
        let Interval { low, high } = enclosure.range;
        // What is undefined is outside, so only the inside must be defined everywhere. An empty
        // range is above everything.
        low > 0.0 || high < 0.0 && enclosure.regularity >= Regularity::Defined
    }

    fn decided(&self, task: &mut Task, cell: &Cell, enclosure: &Enclosure) {
        let Task { tile, pending, .. } = task;
        if enclosure.range.is_empty() {
            // The part of the cell that is in the image.
            let [width, height] = self.camera.size().map(|count| count as f64);
            let high = cell.high.min(DVec3::new(width, height, f64::INFINITY));
            let middle = (0.5 * (cell.low + high)).to_array();
            if self.camera.sees(self.camera.point(middle)) {
                tile.undefined += (high - cell.low).element_product() as u64;
            }
            return;
        }
        if enclosure.range.low > 0.0 {
            return;
        }
        let first = pending.len();
        tile.for_each_open(cell, |pixel| {
            pending.push(Bracket {
                pixel,
                ray: tile.middle(pixel),
                outside: (cell.low.z - 1.0).max(0.0),
                inside: cell.low.z,
                guess: 0.5,
            });
        });
        let (rows, columns) = tile.rectangle(cell);
        for row in &mut tile.open[rows] {
            *row &= !columns;
        }
        tile.rest -= (pending.len() - first) as u32;
        if cell.low.z == 0.0 {
            for bracket in pending.drain(first..) {
                self.meet(tile, bracket.pixel, &Surface::CUT_AT_FRONT, true);
            }
        }
    }

    fn leaf(
        &self,
        task: &mut Task,
        cell: &Cell,
        _enclosure: &Enclosure,
        field: &mut Specialized<'_>,
    ) {
        let Task { tile, march, .. } = &mut *task;
        // The first end of a slice was the last one of the cube in front.
        let first = usize::from(cell.low.z > 0.0);
        tile.march_in(cell, march);
        if !field.depends_on(2) {
            // All of a ray's points in the cube are alike, and it is outside in front of them.
            march.evaluate((cell.low.z as f32, 1), self.in_single, field);
            if march.is_outside() {
                march.count = 0;
                return;
            }
        }
        self.follow(march, &mut tile.undefined, (cell, first), field);
        if march.found.count == 0 {
            return;
        }
        let is_near_side = self.touches_side(cell);
        while task.march.found.count > 0 {
            self.strike(task, is_near_side, field);
            let Task {
                tile,
                march,
                hard,
                rooter,
                ..
            } = &mut *task;
            let mut refused = Vec::new();
            for (bracket, surface) in hard.iter().zip(rooter.solve(hard, field)) {
                match surface {
                    Some(surface) => self.meet(tile, bracket.pixel, surface, is_near_side),
                    // In f64 it is not inside there: the ray goes on.
                    None => refused.push(*bracket),
                }
            }
            for bracket in refused {
                march.add(bracket.pixel, bracket.ray);
                let next = (bracket.inside - cell.low.z) as usize + 1;
                self.follow(march, &mut tile.undefined, (cell, next), field);
            }
        }
    }
}
