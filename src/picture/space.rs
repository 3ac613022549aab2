//! Solids: what each pixel's ray meets first.
//!
//! The screen with its depths is a box of the engine's driver, which goes through it from front
//! to back, tile by tile, and leaves out what is proven to be outside or hidden. In the cubes
//! that are left F is evaluated in f32 at the slices' ends, a few slices at a time, until a ray
//! is inside; [`super::root`] then finds the root in f64, and the normal. So a sheet thinner
//! than a slice, which is as thick as a pixel is wide, can be missed.

use std::ops::Range;

use glam::{DMat3, DVec3, Vec3};

use super::PictureError;
use super::camera::{Camera, SLICE_GROUP};
use super::root::{Bracket, Rooter, Surface};
use crate::engine::{Cell, CompiledField, Explorer, Monitor, Specialized, Subdivision, explore};
use crate::graph::Interval;
use crate::graph::interval::{Enclosure, Regularity};

/// The side of a tile, which is one task, in pixels.
const TILE: usize = 128;

/// The side of the cubes that F is pruned for.
const CUBE: usize = SLICE_GROUP;

/// The side of the cubes in which F is evaluated: 64 rays, as many as a block has lanes.
const LEAF: usize = 8;

/// How many slices are evaluated at a time.
const SLICES: usize = 4;

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
    let tiles = explore(&seen, &rays.subdivision(), &rays, monitor);
    if monitor.cancelled() {
        return Err(PictureError::Cancelled);
    }
    Ok(rays.assemble(&seen, tiles))
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
    /// Whether a pixel's ray has met nothing yet; false beyond the image.
    open: Vec<bool>,
    /// How many are open.
    rest: usize,
    hits: Vec<Hit>,
    depths: Vec<f32>,
    normals: Vec<Vec3>,
    /// Rays that were proven to be inside although no root was seen on the way.
    pending: Vec<Bracket>,
    /// At how many points F is not a number.
    undefined: u64,
    memory: Memory,
}

/// Lists that are used again and again.
#[derive(Default)]
struct Memory {
    rays: Vec<Ray>,
    found: Vec<Bracket>,
    points: [Vec<f32>; 3],
    wide_points: [Vec<f64>; 3],
    values: Vec<f32>,
    wide_values: Vec<f64>,
    rooter: Rooter,
}

/// A ray on its way through a cube.
#[derive(Clone, Copy)]
struct Ray {
    /// The pixel's place in the tile.
    pixel: u16,
    /// F where the ray is now; NaN if it is not known.
    before: f32,
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
    fn assemble(&self, field: &CompiledField, tiles: Vec<Tile>) -> HeightMap {
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
        for mut tile in tiles {
            self.settle(field, &mut tile);
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
    fn settle(&self, mut field: &CompiledField, tile: &mut Tile) {
        let found = std::mem::take(&mut tile.pending);
        let mut rooter = std::mem::take(&mut tile.memory.rooter);
        for (bracket, surface) in found.iter().zip(rooter.solve(&found, &mut field)) {
            // Proven to be inside, so whatever the numbers say, there is something.
            let surface = surface.unwrap_or(Surface {
                depth: bracket.inside,
                gradient: DVec3::ZERO,
                is_root: false,
            });
            self.meet(tile, bracket.pixel, &surface);
        }
    }

    /// Notes what a ray has met.
    fn meet(&self, tile: &mut Tile, pixel: u16, surface: &Surface) {
        let [u, v] = tile.middle(pixel);
        let screen = [u, v, surface.depth];
        let (turn, width) = self.straight.unwrap_or_else(|| turn(self.camera, screen));
        let point = self.camera.point(screen);
        let (hit, normal) = match self.camera.side_at(point, CUT * width) {
            Some(normal) => (Hit::Cut, normal),
            None if surface.is_root => (Hit::Surface, direction(turn * surface.gradient)),
            None => (Hit::Jump, direction(turn * surface.gradient)),
        };
        let pixel = usize::from(pixel);
        if std::mem::replace(&mut tile.open[pixel], false) {
            tile.rest -= 1;
        }
        tile.hits[pixel] = hit;
        tile.depths[pixel] = surface.depth as f32;
        tile.normals[pixel] = normal.as_vec3();
    }

    /// Follows all rays, which are at the same depth, from the slices' end with the number `next`
    /// in the cube to where they are inside or leave it; the former are found.
    fn follow(
        &self,
        memory: &mut Memory,
        tile: &mut Tile,
        (cell, mut next): (&Cell, usize),
        field: &mut Specialized<'_>,
    ) {
        while !memory.rays.is_empty() && next <= LEAF {
            let steps = SLICES.min(LEAF + 1 - next);
            memory.place(tile, cell.low.z as f32 + next as f32, steps);
            memory.evaluate(self.in_single, field);
            if memory.values.iter().any(|value| value.is_nan()) {
                tile.undefined += self.count_undefined(memory, field);
            }
            memory.advance(tile, cell.low.z + next as f64);
            next += steps;
        }
        memory.rays.clear();
    }

    /// At how many points of the batch, in the box, F is not a number. In f32 that may be an
    /// overflow, so it is computed again.
    fn count_undefined(&self, memory: &mut Memory, field: &mut Specialized<'_>) -> u64 {
        memory.evaluate(false, field);
        let is_undefined = |&index: &usize| {
            let screen = [0, 1, 2].map(|axis| f64::from(memory.points[axis][index]));
            memory.values[index].is_nan() && self.camera.sees(self.camera.point(screen))
        };
        (0..memory.values.len()).filter(is_undefined).count() as u64
    }
}

/// The direction of a vector; 0 where there is none.
fn direction(vector: DVec3) -> DVec3 {
    let scale = vector.abs().max_element();
    if scale > 0.0 && scale.is_finite() {
        (vector / scale).normalize()
    } else {
        DVec3::ZERO
    }
}

/// The slice of a ray at whose end, with this depth and this F, it is inside.
fn bracket(tile: &Tile, ray: &Ray, inside: f64, value: f32) -> Bracket {
    let guess = f64::from(ray.before / (ray.before - value));
    Bracket {
        pixel: ray.pixel,
        ray: tile.middle(ray.pixel),
        // Before the first slice there is nothing.
        outside: (inside - 1.0).max(0.0),
        inside,
        guess: if guess.is_finite() {
            guess.clamp(0.01, 0.99)
        } else {
            0.5
        },
    }
}

impl Memory {
    /// Puts the rays' points at so many ends of slices, from this depth on, into the columns:
    /// slice by slice. All coordinates are halves of whole numbers, and exact in f32.
    fn place(&mut self, tile: &Tile, depth: f32, steps: usize) {
        let [first, second, third] = &mut self.points;
        first.clear();
        second.clear();
        third.clear();
        let count = self.rays.len();
        for ray in &self.rays {
            let [u, v] = tile.middle(ray.pixel);
            first.push(u as f32);
            second.push(v as f32);
        }
        third.resize(count, depth);
        for step in 1..steps {
            first.extend_from_within(..count);
            second.extend_from_within(..count);
            third.resize((step + 1) * count, depth + step as f32);
        }
        self.values.resize(steps * count, 0.0);
    }

    /// Takes the values of a round that began at this depth: rays that are inside are found, the
    /// others stay.
    fn advance(&mut self, tile: &Tile, depth: f64) {
        let Memory {
            rays,
            found,
            values,
            ..
        } = self;
        let count = rays.len();
        let mut index = 0;
        rays.retain_mut(|ray| {
            let own = values[index..].iter().step_by(count);
            index += 1;
            for (step, &value) in own.enumerate() {
                if value < 0.0 {
                    found.push(bracket(tile, ray, depth + step as f64, value));
                    return false;
                }
                ray.before = value;
            }
            true
        });
    }

    /// F at the points in the columns.
    fn evaluate(&mut self, in_single: bool, field: &mut Specialized<'_>) {
        if in_single {
            field.values_f32(&self.points.each_ref().map(Vec::as_slice), &mut self.values);
            return;
        }
        for (wide, column) in self.wide_points.iter_mut().zip(&self.points) {
            wide.clear();
            wide.extend(column.iter().map(|&coordinate| f64::from(coordinate)));
        }
        self.wide_values.resize(self.values.len(), 0.0);
        let points = self.wide_points.each_ref().map(Vec::as_slice);
        field.values(&points, &mut self.wide_values);
        for (value, &wide) in self.values.iter_mut().zip(&self.wide_values) {
            *value = wide as f32;
            // Only the sign counts, and that must not be lost.
            if wide < 0.0 && *value == 0.0 {
                *value = -f32::MIN_POSITIVE;
            }
        }
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

    /// The first and last row and column of a cell in the tile.
    fn rectangle(&self, cell: &Cell) -> [Range<usize>; 2] {
        let rows = whole(cell.low.y) - self.top..whole(cell.high.y) - self.top;
        let columns = whole(cell.low.x) - self.left..whole(cell.high.x) - self.left;
        [rows, columns]
    }

    /// Calls `visit` with every pixel of the cell whose ray has met nothing yet.
    fn for_each_open(&self, cell: &Cell, mut visit: impl FnMut(u16)) {
        let [rows, columns] = self.rectangle(cell);
        for row in rows {
            for pixel in row * TILE + columns.start..row * TILE + columns.end {
                if self.open[pixel] {
                    visit(pixel as u16);
                }
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
    type Task = Tile;

    fn begin(&self, cell: &Cell) -> Tile {
        let (left, top) = (whole(cell.low.x), whole(cell.low.y));
        let [width, height] = self.camera.size();
        let count = TILE * TILE;
        let inside = |pixel: usize| left + pixel % TILE < width && top + pixel / TILE < height;
        let open: Vec<bool> = (0..count).map(inside).collect();
        Tile {
            left,
            top,
            rest: open.iter().filter(|&&open| open).count(),
            open,
            hits: vec![Hit::Nothing; count],
            depths: vec![f32::INFINITY; count],
            normals: vec![Vec3::ZERO; count],
            pending: Vec::new(),
            undefined: 0,
            memory: Memory::default(),
        }
    }

    fn wants(&self, tile: &mut Tile, cell: &Cell) -> bool {
        if tile.rest == 0 {
            return false;
        }
        let [rows, columns] = tile.rectangle(cell);
        rows.into_iter().any(|row| {
            let row = &tile.open[row * TILE..(row + 1) * TILE];
            row[columns.clone()].contains(&true)
        })
    }

    fn decides(&self, _cell: &Cell, enclosure: &Enclosure) -> bool {
        let Interval { low, high } = enclosure.range;
        // What is undefined is outside, so only the inside must be defined everywhere. An empty
        // range is above everything.
        low > 0.0 || high < 0.0 && enclosure.regularity >= Regularity::Defined
    }

    fn decided(&self, tile: &mut Tile, cell: &Cell, enclosure: &Enclosure) {
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
        let mut pending = std::mem::take(&mut tile.pending);
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
        for bracket in &pending[first..] {
            tile.open[usize::from(bracket.pixel)] = false;
        }
        tile.rest -= pending.len() - first;
        if cell.low.z == 0.0 {
            for bracket in pending.drain(first..) {
                self.meet(tile, bracket.pixel, &Surface::CUT_AT_FRONT);
            }
        }
        tile.pending = pending;
    }

    fn leaf(
        &self,
        tile: &mut Tile,
        cell: &Cell,
        _enclosure: &Enclosure,
        field: &mut Specialized<'_>,
    ) {
        let mut memory = std::mem::take(&mut tile.memory);
        // The first end of a slice was the last one of the cube in front.
        let first = usize::from(cell.low.z > 0.0);
        memory.rays.clear();
        tile.for_each_open(cell, |pixel| {
            memory.rays.push(Ray {
                pixel,
                before: f32::NAN,
            });
        });
        self.follow(&mut memory, tile, (cell, first), field);
        let mut refused = Vec::new();
        while !memory.found.is_empty() {
            let surfaces = memory.rooter.solve(&memory.found, field);
            for (bracket, surface) in memory.found.iter().zip(surfaces) {
                match surface {
                    _ if bracket.inside == 0.0 => {
                        self.meet(tile, bracket.pixel, &Surface::CUT_AT_FRONT);
                    }
                    Some(surface) => self.meet(tile, bracket.pixel, surface),
                    // In f64 it is not inside there: the ray goes on.
                    None => refused.push(*bracket),
                }
            }
            memory.found.clear();
            for bracket in refused.drain(..) {
                memory.rays.push(Ray {
                    pixel: bracket.pixel,
                    before: f32::NAN,
                });
                let next = (bracket.inside - cell.low.z) as usize + 1;
                self.follow(&mut memory, tile, (cell, next), field);
            }
        }
        tile.memory = memory;
    }
}
