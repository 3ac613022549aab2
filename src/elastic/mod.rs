//! Solids that fall: the spring-mass lattice of an implicit solid under gravity (Velho, Gomes and Terzopoulos,
//! "Implicit manifolds, triangulations and dynamics", sections 4 to 7).
//!
//! The way through: `lattice` divides the solid F < 0 into simplices, of which `simplex` knows the volume, `fitting`
//! moves nodes onto F = 0, and `boundary` finds edges and outer faces; `body` moves the
//! lattice, step by step, and `fall` from the beginning to the end.

mod body;
mod boundary;
mod fall;
mod fitting;
mod lattice;
mod relaxation;
pub mod simplex;

pub use body::{Body, Energy, Ground, Material};
pub use fall::{Drop, Fall, Frame};
pub use lattice::{Division, Lattice, Remarks};
pub use relaxation::Relaxation;

use thiserror::Error;

/// Why a solid does not fall.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ElasticError {
    /// The dimensions do not fit.
    #[error(
        "expected a field and a box both in R2 or both in R3, not a field in R{field} and a box in R{bounds}"
    )]
    Dimension {
        /// The field's.
        field: usize,
        /// The box's.
        bounds: usize,
    },
    /// The cells do not fit into the box.
    #[error(
        "the cell must be greater than 0 and at most as large as the shortest side of the box, {side}, but it is {cell}"
    )]
    Cell {
        /// The side of a cell.
        cell: f64,
        /// The shortest side of the box.
        side: f64,
    },
    /// The box would have more cells than allowed.
    #[error("the lattice needs a grid of {needed:.3e} cells, more than the limit of {limit}")]
    TooManyCells {
        /// Cells.
        needed: f64,
        /// The limit.
        limit: usize,
    },
    /// Nothing of the solid is in the box.
    #[error("the solid is empty: {}", outside(*points, *undefined))]
    Empty {
        /// Grid points.
        points: usize,
        /// Those at which F is not a number.
        undefined: usize,
    },
    /// The box holds nothing but the solid.
    #[error("the solid fills the box: F < 0 at all {points} grid points")]
    Full {
        /// Grid points.
        points: usize,
    },
    /// The solid is too thin for the cells.
    #[error(
        "the solid is too thin for cells of {cell}: no point of the grid is a quarter of a cell inside"
    )]
    Thin {
        /// The side of a cell.
        cell: f64,
    },
    /// A number that makes no sense.
    #[error("`{name}` must be {demand}, but it is {value}")]
    Number {
        /// Its name.
        name: &'static str,
        /// The number.
        value: f64,
        /// What it must be.
        demand: &'static str,
    },
    /// The fall would take too long.
    #[error("the fall would take {steps:.3e} steps of time, more than the limit of {limit}")]
    TooManySteps {
        /// The estimate.
        steps: f64,
        /// The limit.
        limit: u64,
    },
    /// The frames would be too large.
    #[error("the frames would have {points:.3e} points, more than the limit of {limit}")]
    TooManyPoints {
        /// All points of all frames.
        points: f64,
        /// The limit.
        limit: u64,
    },
    /// The monitor asked for an end.
    #[error("cancelled")]
    Cancelled,
}

fn outside(points: usize, undefined: usize) -> String {
    match undefined {
        0 => format!("F ≥ 0 at all {points} grid points"),
        _ if undefined == points => format!("F is not a number at any of {points} grid points"),
        _ => format!("F ≥ 0 or not a number at all {points} grid points"),
    }
}
