//! Marching cubes brick by brick, for grids whose mesh is larger than memory.
//!
//! The grid is that of the whole box; a brick is a part of it with the same coordinates, so that
//! the roots on the edges of a face that two bricks share are the same to the last bit: the union of
//! the bricks is the mesh that the whole grid gives: the same vertices and triangles by position,
//! save that triangles without area are left out. Normals are the same, too, to rounding where the
//! surface runs through a grid point. Only the sides of the box are capped. Bricks
//! that enclosures prove to be empty are passed over. Memory holds one brick at a time.

use std::ops::Range;

use glam::DVec3;

use super::edge_roots::Accuracy;
use super::enclosure::{self, Colour};
use super::error::no_surface;
use super::grid::{Grid, Seen};
use super::options::check_options;
use super::{Job, Method, Options, PolygonizeError, Statistics, accuracy, cell_counts, cubes};
use crate::engine::{Field, Monitor};
use crate::geometry::Mesh;

/// The greatest number of bricks.
const LIMIT: usize = 1 << 20;

/// The mesh in one brick.
#[derive(Clone, Debug, PartialEq)]
pub struct Brick {
    /// Its place among the bricks, along each axis.
    pub place: [usize; 3],
    /// The surface in it; left open at the faces that it shares with other bricks. Not empty.
    pub mesh: Mesh,
}

/// The bricks of a grid, which are made one after the other, the first axis fastest.
pub struct Bricks<'a> {
    field: &'a dyn Field,
    options: &'a Options,
    accuracy: Accuracy,
    whole: Grid,
    /// Cells along the side of a brick.
    side: usize,
    /// Bricks along each axis.
    counts: [usize; 3],
    /// The number of the next one.
    next: usize,
    seen: Seen,
    statistics: Statistics,
}

impl<'a> Bricks<'a> {
    /// The level set of a field in R3 by [`Method::Cubes`], in bricks of `side` cells along each
    /// axis; those at the upper sides of the box have what is left. Nothing is done yet.
    ///
    /// The limit of cells is one of each brick.
    ///
    /// # Errors
    ///
    /// Bad options, another method, vertices that are to be merged (which needs the cells around),
    /// too many cells in a brick or too many bricks.
    pub fn new(
        field: &'a dyn Field,
        options: &'a Options,
        side: usize,
    ) -> Result<Self, PolygonizeError> {
        let bounds = options.bounds.dimension;
        for dimension in [field.dimension(), bounds] {
            if dimension != 3 {
                let field = field.dimension();
                return Err(PolygonizeError::WrongDimension { field, bounds });
            }
        }
        let method = options.method.unwrap_or(Method::Cubes);
        if method != Method::Cubes || options.snap {
            return Err(PolygonizeError::NotInBricks { method });
        }
        check_options(options)?;
        let side = side.max(1);
        let cells = cell_counts(options);
        let bricks = cells.iter().map(|cells| (cells / side as f64).ceil());
        let bricks = bricks.product();
        if bricks > LIMIT as f64 {
            return Err(PolygonizeError::TooManyBricks {
                needed: bricks,
                limit: LIMIT,
            });
        }
        let in_brick = cells.iter().map(|cells| cells.min(side as f64));
        super::check_cells(in_brick.product(), options)?;
        let cells: Vec<usize> = cells.into_iter().map(|count| count as usize).collect();
        let whole = Grid::new(&options.bounds, &cells, options.cap);
        let counts = [0, 1, 2].map(|axis| (whole.real_coordinates(axis).len() - 1).div_ceil(side));
        Ok(Bricks {
            field,
            options,
            accuracy: accuracy(options),
            whole,
            side,
            counts,
            next: 0,
            seen: Seen::default(),
            statistics: Statistics::default(),
        })
    }

    /// The number of bricks along each axis, empty ones included.
    pub fn counts(&self) -> [usize; 3] {
        self.counts
    }

    /// The next brick that has surface; `None` when there are no more.
    ///
    /// # Errors
    ///
    /// Too many vertices in a brick, or cancellation by the monitor.
    pub fn advance(&mut self, monitor: &dyn Monitor) -> Result<Option<Brick>, PolygonizeError> {
        let all = self.counts.iter().product();
        while self.next < all {
            if monitor.cancelled() {
                return Err(PolygonizeError::Cancelled);
            }
            let made = self.make(self.next, monitor)?;
            self.next += 1;
            if made.is_some() {
                return Ok(made);
            }
        }
        monitor.progress("bricks", 1.0);
        Ok(None)
    }

    /// What the work amounted to, once all bricks were given. Roots and points on the faces that
    /// bricks share count for each of them.
    ///
    /// # Errors
    ///
    /// `NoSurface` if there was none.
    pub fn finish(self) -> Result<Statistics, PolygonizeError> {
        match self.statistics.good_roots {
            0 => Err(no_surface(self.options, self.seen)),
            _ => Ok(self.statistics),
        }
    }

    /// The cells of a brick along each axis.
    fn cells(&self, place: [usize; 3]) -> [Range<usize>; 3] {
        [0, 1, 2].map(|axis| {
            let all = self.whole.real_coordinates(axis).len() - 1;
            let start = place[axis] * self.side;
            start..(start + self.side).min(all)
        })
    }

    /// What a proof says of all points of a brick, if it says that there is no surface in it.
    fn proven(&self, brick: &Grid) -> Option<Seen> {
        let corner = |last: bool| {
            let coordinate = |axis: usize| {
                let along = brick.real_coordinates(axis);
                along[if last { along.len() - 1 } else { 0 }]
            };
            DVec3::from_array([0, 1, 2].map(coordinate))
        };
        let field = self.field.compiled()?;
        let corners = [corner(false), corner(true)];
        let colours = enclosure::classify(field, self.accuracy.iso, &[corners]);
        let (colour, _) = *colours.first()?;
        let points = |axis| brick.real_coordinates(axis).len();
        let points = (0..3).map(points).product();
        let capped = brick.ghosts > 0 && brick.goes_on.as_flattened().contains(&false);
        match colour {
            // A field that is undefined in all of the brick is that at its corner.
            Colour::Exterior if field.value(corner(false)).is_nan() => Some(Seen {
                nan: points,
                ..Seen::default()
            }),
            Colour::Exterior => Some(Seen {
                outside: points,
                ..Seen::default()
            }),
            Colour::Interior if !capped => Some(Seen {
                inside: points,
                ..Seen::default()
            }),
            _ => None,
        }
    }

    /// The mesh in a brick, unless there is nothing.
    fn make(
        &mut self,
        number: usize,
        monitor: &dyn Monitor,
    ) -> Result<Option<Brick>, PolygonizeError> {
        let [along_x, along_y, _] = self.counts;
        let place = [
            number % along_x,
            number / along_x % along_y,
            number / (along_x * along_y),
        ];
        let grid = self.whole.brick(&self.cells(place));
        if let Some(seen) = self.proven(&grid) {
            self.seen = self.seen.and(seen);
            self.statistics.cells += grid.cells();
            self.statistics.nan_points += seen.nan;
            return Ok(None);
        }
        let part = Part {
            monitor,
            done: number,
            all: self.counts.iter().product(),
        };
        let job = Job {
            field: self.field,
            options: self.options,
            accuracy: self.accuracy,
            monitor: &part,
        };
        let (mut mesh, seen, statistics) = cubes::march_through(&job, &grid)?;
        // Where the surface runs through a grid point on a shared face, vertices there are not merged,
        // since that would change how this brick alone is connected. In the union they are one.
        let corners = |triangle: &[u32; 3]| triangle.map(|vertex| mesh.positions[vertex as usize]);
        mesh.triangles.retain(|triangle| {
            let [a, b, c] = corners(triangle);
            a != b && b != c && c != a
        });
        mesh.drop_unused_vertices();
        self.seen = self.seen.and(seen);
        self.statistics = self.statistics.and(statistics);
        Ok((!mesh.triangles.is_empty()).then_some(Brick { place, mesh }))
    }
}

/// Who watches a brick: it hears of the whole work.
struct Part<'a> {
    monitor: &'a dyn Monitor,
    /// Bricks that are done.
    done: usize,
    all: usize,
}

impl Monitor for Part<'_> {
    fn progress(&self, _phase: &str, fraction: f64) {
        // The bricks after this one take time, too: the work is not at its end here.
        let fraction = (self.done as f64 + fraction) / self.all as f64;
        self.monitor.progress("bricks", fraction.min(0.999));
    }

    fn cancelled(&self) -> bool {
        self.monitor.cancelled()
    }
}
