//! Fields in the plane, pixel by pixel.
//!
//! The image is a box of the engine's driver, in tiles. For a bitmap of the inside, whole tiles
//! are decided by intervals and the rest is evaluated in f32; for shades F and F_x are needed
//! everywhere, but by programs that are specialised to the tile.

use std::ops::Range;

use glam::DVec3;

use super::camera::suits_single_precision;
use super::{Options, PHASE, Picture, PictureError, Statistics, Style, tone};
use crate::engine::{Cell, CompiledField, Explorer, Monitor, Specialized, Subdivision, explore};
use crate::geometry::Bounds;
use crate::graph::Interval;
use crate::graph::interval::{Enclosure, Regularity};

/// The side of a tile, which is one task, in pixels.
const TILE: usize = 128;

/// The side of the squares that F_x is pruned for.
const SQUARE: usize = 64;

/// The side of the squares in which F is evaluated.
const LEAF: usize = 16;

/// On which side of the zero set a pixel's middle is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Side {
    /// F ≥ 0.
    #[default]
    Outside,
    /// F < 0.
    Inside,
    /// F is not a number.
    Undefined,
    /// Outside of the box.
    Beyond,
}

/// The sides of all pixels, row by row from the top.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Bitmap {
    /// Pixels in a row.
    pub width: usize,
    /// The number of rows.
    pub height: usize,
    /// The sides.
    pub sides: Vec<Side>,
}

/// F and the length of F_x at the pixels' middles, row by row from the top.
pub(super) struct Shades {
    pub(super) frame: Frame,
    /// F; NaN beyond the box, too.
    pub(super) values: Vec<f64>,
    /// |F_x|, for a pixel's width.
    pub(super) slopes: Vec<f32>,
}

/// Where the box is in the image: in the middle, as large as possible.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) size: [usize; 2],
    bounds: Bounds,
    /// The width of a pixel.
    pub(super) pixel: f64,
    /// The image's left and upper edge.
    left: f64,
    top: f64,
}

/// The sides of the pixels' middles, where the image shows the box as large as possible: decided
/// by intervals, else by F in f32 (in f64 where pixels are small against coordinates).
///
/// # Errors
///
/// `Cancelled` if the monitor says so.
pub fn bitmap(
    field: &CompiledField,
    bounds: &Bounds,
    size: [usize; 2],
    monitor: &dyn Monitor,
) -> Result<Bitmap, PictureError> {
    let filler = Filler {
        frame: Frame::new(bounds, size),
    };
    // As many squares in a tile as a batch takes.
    let subdivision = filler.frame.subdivision(&[TILE / LEAF]);
    let tiles = explore(field, &subdivision, &filler, monitor);
    if monitor.cancelled() {
        return Err(PictureError::Cancelled);
    }
    let [width, height] = size;
    let mut sides = vec![Side::Outside; width * height];
    for tile in &tiles {
        tile.place.copy(size, &tile.sides, &mut sides);
    }
    filler.frame.mark_beyond(&mut sides, Side::Beyond);
    Ok(Bitmap {
        width,
        height,
        sides,
    })
}

/// The image of a field in the plane.
pub(super) fn render(
    field: &CompiledField,
    options: &Options,
    size: [usize; 2],
    monitor: &dyn Monitor,
) -> Result<Picture, PictureError> {
    if let Some(step) = options.step
        && !(step > 0.0 && step.is_finite())
    {
        let message = format!("`step` must be greater than 0 and finite, but it is {step}");
        return super::bad("step", message);
    }
    monitor.progress(PHASE, 0.0);
    match options.style {
        Style::Fill => {
            let map = bitmap(field, &options.bounds, size, monitor)?;
            let count = |side| map.sides.iter().filter(|&&other| other == side).count();
            let statistics = Statistics {
                covered: count(Side::Inside) as f64 / map.sides.len() as f64,
                undefined: count(Side::Undefined) as u64,
                ..Statistics::default()
            };
            Ok(Picture {
                image: tone::fill(&map, options.transparent),
                statistics,
            })
        }
        Style::Shaded => {
            let shades = shades(field, &options.bounds, size, monitor)?;
            Ok(tone::shade(&shades, options))
        }
    }
}

/// F and |F_x| at all pixels.
fn shades(
    field: &CompiledField,
    bounds: &Bounds,
    size: [usize; 2],
    monitor: &dyn Monitor,
) -> Result<Shades, PictureError> {
    let frame = Frame::new(bounds, size);
    let shader = Shader { frame };
    let subdivision = frame.subdivision(&[TILE / SQUARE, SQUARE / LEAF]);
    let tiles = explore(field, &subdivision, &shader, monitor);
    if monitor.cancelled() {
        return Err(PictureError::Cancelled);
    }
    let count = size[0] * size[1];
    let (mut values, mut slopes) = (vec![f64::NAN; count], vec![f32::NAN; count]);
    for tile in &tiles {
        tile.place.copy(size, &tile.values, &mut values);
        tile.place.copy(size, &tile.slopes, &mut slopes);
    }
    frame.mark_beyond(&mut values, f64::NAN);
    Ok(Shades {
        frame,
        values,
        slopes,
    })
}

impl Frame {
    fn new(bounds: &Bounds, size: [usize; 2]) -> Frame {
        let [width, height] = size.map(|count| count as f64);
        let extent = bounds.size();
        let pixel = (extent.x / width).max(extent.y / height);
        let center = bounds.center();
        Frame {
            size,
            bounds: *bounds,
            pixel,
            left: center.x - 0.5 * width * pixel,
            top: center.y + 0.5 * height * pixel,
        }
    }

    /// The image in tiles, and these in so many parts a side, level by level.
    fn subdivision(&self, parts: &[usize]) -> Subdivision {
        let tiles = self.size.map(|count| count.div_ceil(TILE));
        let [width, height] = tiles.map(|count| (count * TILE) as f64 * self.pixel);
        Subdivision {
            low: DVec3::new(self.left, self.top - height, 0.0),
            high: DVec3::new(self.left + width, self.top, 0.0),
            splits: std::iter::once([tiles[0], tiles[1], 1])
                .chain(parts.iter().map(|&parts| [parts, parts, 1]))
                .collect(),
            descending: [false, true, false],
        }
    }

    /// The columns and rows of pixels that a cell consists of; some may be beyond the image.
    fn pixels(&self, cell: &Cell) -> [Range<usize>; 2] {
        let column = |x: f64| ((x - self.left) / self.pixel).round() as usize;
        let row = |y: f64| ((self.top - y) / self.pixel).round() as usize;
        [
            column(cell.low.x)..column(cell.high.x),
            row(cell.high.y)..row(cell.low.y),
        ]
    }

    /// The middle of a pixel.
    pub(super) fn middle(&self, column: usize, row: usize) -> [f64; 2] {
        [
            self.left + (column as f64 + 0.5) * self.pixel,
            self.top - (row as f64 + 0.5) * self.pixel,
        ]
    }

    /// Whether the box has anything in common with a cell.
    fn meets(&self, cell: &Cell) -> bool {
        cell.low.x <= self.bounds.max.x
            && cell.high.x >= self.bounds.min.x
            && cell.low.y <= self.bounds.max.y
            && cell.high.y >= self.bounds.min.y
    }

    /// Whether a pixel's middle is in the box.
    pub(super) fn contains(&self, column: usize, row: usize) -> bool {
        let [x, y] = self.middle(column, row);
        self.bounds.contains(DVec3::new(x, y, 0.0))
    }

    /// Writes `mark` to all pixels beyond the box.
    fn mark_beyond<T: Copy>(&self, pixels: &mut [T], mark: T) {
        let [width, height] = self.size;
        let columns: Vec<usize> = {
            let row = (0..height).find(|&row| {
                let y = self.middle(0, row)[1];
                y <= self.bounds.max.y && y >= self.bounds.min.y
            });
            let is_beyond = |&column: &usize| !row.is_some_and(|row| self.contains(column, row));
            (0..width).filter(is_beyond).collect()
        };
        for (row, pixels) in pixels.chunks_mut(width).enumerate() {
            let y = self.middle(0, row)[1];
            if y > self.bounds.max.y || y < self.bounds.min.y {
                pixels.fill(mark);
            }
            for &column in &columns {
                pixels[column] = mark;
            }
        }
    }
}

/// Where a tile is in the image.
#[derive(Clone, Copy)]
struct Place {
    left: usize,
    top: usize,
}

impl Place {
    /// Copies a tile's pixels into the image.
    fn copy<T: Copy>(&self, [width, height]: [usize; 2], tile: &[T], image: &mut [T]) {
        let columns = TILE.min(width - self.left);
        for row in 0..TILE.min(height - self.top) {
            let start = (self.top + row) * width + self.left;
            let from = &tile[row * TILE..row * TILE + columns];
            image[start..start + columns].copy_from_slice(from);
        }
    }

    /// The pixels of a cell, as places in the tile: one range for each row.
    fn rows(&self, [columns, rows]: [Range<usize>; 2]) -> impl Iterator<Item = Range<usize>> {
        let Place { left, top } = *self;
        rows.map(move |row| {
            let start = (row - top) * TILE;
            start + columns.start - left..start + columns.end - left
        })
    }
}

/// The columns of a batch of pixels.
#[derive(Default)]
struct Columns<T> {
    x: Vec<T>,
    y: Vec<T>,
    values: Vec<T>,
}

impl<T: Copy + Default> Columns<T> {
    /// The middles of all pixels of a cell, row by row.
    fn place(&mut self, frame: &Frame, [columns, rows]: &[Range<usize>; 2], narrow: fn(f64) -> T) {
        self.x.clear();
        self.y.clear();
        let width = columns.len();
        let middles = columns.clone();
        let middles = middles.map(|column| narrow(frame.middle(column, 0)[0]));
        self.x.extend(middles);
        for row in rows.clone() {
            let length = self.y.len() + width;
            self.y.resize(length, narrow(frame.middle(0, row)[1]));
            if self.x.len() < length {
                self.x.extend_from_within(..width);
            }
        }
        self.values.resize(self.x.len(), T::default());
    }
}

/// Explores for a bitmap.
struct Filler {
    frame: Frame,
}

/// A tile of a bitmap.
struct Filled {
    place: Place,
    sides: Vec<Side>,
    single: Columns<f32>,
    double: Columns<f64>,
}

fn side(value: f64) -> Side {
    if value < 0.0 {
        Side::Inside
    } else if value.is_nan() {
        Side::Undefined
    } else {
        Side::Outside
    }
}

impl Explorer for Filler {
    type Task = Filled;

    fn begin(&self, cell: &Cell) -> Filled {
        let [columns, rows] = self.frame.pixels(cell);
        Filled {
            place: Place {
                left: columns.start,
                top: rows.start,
            },
            sides: vec![Side::Outside; TILE * TILE],
            single: Columns::default(),
            double: Columns::default(),
        }
    }

    fn wants(&self, _task: &mut Filled, cell: &Cell) -> bool {
        self.frame.meets(cell)
    }

    fn decides(&self, _cell: &Cell, enclosure: &Enclosure) -> bool {
        let Interval { low, high } = enclosure.range;
        let is_decided = low > 0.0 || high < 0.0;
        enclosure.range.is_empty() || is_decided && enclosure.regularity >= Regularity::Defined
    }

    fn decided(&self, task: &mut Filled, cell: &Cell, enclosure: &Enclosure) {
        let side = if enclosure.range.is_empty() {
            Side::Undefined
        } else if enclosure.range.high < 0.0 {
            Side::Inside
        } else {
            return;
        };
        for row in task.place.rows(self.frame.pixels(cell)) {
            task.sides[row].fill(side);
        }
    }

    fn leaf(
        &self,
        task: &mut Filled,
        cell: &Cell,
        _enclosure: &Enclosure,
        field: &mut Specialized<'_>,
    ) {
        let pixels = self.frame.pixels(cell);
        let largest = cell.low.abs().max(cell.high.abs()).max_element();
        let Filled {
            place,
            sides,
            single,
            double,
        } = task;
        let rows = place.rows(pixels.clone());
        if suits_single_precision(largest, self.frame.pixel) {
            single.place(&self.frame, &pixels, |coordinate| coordinate as f32);
            field.values_f32(&[&single.x, &single.y], &mut single.values);
            for (row, values) in rows.zip(single.values.chunks(pixels[0].len())) {
                for (target, &value) in sides[row].iter_mut().zip(values) {
                    *target = side(f64::from(value));
                }
            }
        } else {
            double.place(&self.frame, &pixels, |coordinate| coordinate);
            field.values(&[&double.x, &double.y], &mut double.values);
            for (row, values) in rows.zip(double.values.chunks(pixels[0].len())) {
                for (target, &value) in sides[row].iter_mut().zip(values) {
                    *target = side(value);
                }
            }
        }
    }
}

/// Explores for shades: nothing is decided.
struct Shader {
    frame: Frame,
}

/// A tile of shades.
struct Shaded {
    place: Place,
    values: Vec<f64>,
    slopes: Vec<f32>,
    columns: Columns<f64>,
    gradients: [Vec<f64>; 2],
}

impl Explorer for Shader {
    type Task = Shaded;

    fn begin(&self, cell: &Cell) -> Shaded {
        let [columns, rows] = self.frame.pixels(cell);
        Shaded {
            place: Place {
                left: columns.start,
                top: rows.start,
            },
            values: vec![f64::NAN; TILE * TILE],
            slopes: vec![f32::NAN; TILE * TILE],
            columns: Columns::default(),
            gradients: Default::default(),
        }
    }

    fn wants(&self, _task: &mut Shaded, cell: &Cell) -> bool {
        self.frame.meets(cell)
    }

    fn decides(&self, _cell: &Cell, _enclosure: &Enclosure) -> bool {
        false
    }

    fn decided(&self, _task: &mut Shaded, _cell: &Cell, _enclosure: &Enclosure) {}

    fn leaf(
        &self,
        task: &mut Shaded,
        cell: &Cell,
        _enclosure: &Enclosure,
        field: &mut Specialized<'_>,
    ) {
        let pixels = self.frame.pixels(cell);
        let Columns { x, y, values } = {
            task.columns
                .place(&self.frame, &pixels, |coordinate| coordinate);
            &mut task.columns
        };
        for gradient in &mut task.gradients {
            gradient.resize(values.len(), 0.0);
        }
        let [along, across] = &mut task.gradients;
        field.gradients(&[x, y], values, &mut [along, across]);
        let width = pixels[0].len();
        for (number, row) in task.place.rows(pixels).enumerate() {
            let start = number * width;
            for (offset, target) in row.enumerate() {
                let index = start + offset;
                let slope = DVec3::new(along[index], across[index], 0.0).length();
                task.values[target] = values[index];
                task.slopes[target] = (slope * self.frame.pixel) as f32;
            }
        }
    }
}
