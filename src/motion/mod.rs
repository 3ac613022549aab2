//! Surfaces that follow points: how the parameters q of a field F(x, q) must change so that its zero
//! set goes where it is pulled.
//!
//! Two questions are answered. [`follow`] and [`advance`] take a surface along with control points: the
//! smallest change of q under which each point stays on the surface (Witkin and Heckbert, "Using
//! particles to sample and control implicit surfaces", 1994, section 3.4). [`fit`] looks for a q with
//! which a surface passes through given points, from far away and in the sense of least squares.
//!
//! A [`Simulation`] is a surface with control points and with floaters that follow it.
//!
//! The way through: `rows` evaluates F, F_x and the sparse rows of F_q; `metric` says what a small
//! change of q is; `freedom` what may change at all; `least_change` solves the linear problem, by the
//! factorisations of `dense`; `control` steps; `fit` iterates on the equations of `normal`;
//! `simulation` moves surface and floaters.

mod control;

mod dense;

mod fit;

mod freedom;

mod least_change;

mod metric;

mod normal;

mod rows;

mod simulation;

pub use control::{
    Advance, Control, Follow, Pin, PinReport, PinState, advance, follow, toward_rest,
};
pub use fit::{End, Fit, FitOptions, fit};
pub use freedom::Freedom;
pub use least_change::Solver;
pub use metric::{Metric, sensitivity};
pub use rows::Rows;
pub use simulation::{Frame, Measure, Setting, Simulation, SimulationError, Step};

use thiserror::Error;

/// Why a surface cannot be controlled as it was asked for.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum MotionError {
    /// A list has another length than q.
    #[error("{what} has {found} entries for {expected} parameters")]
    Length {
        /// What has the wrong length.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The number of parameters.
        expected: usize,
    },
    /// Lengths of changes of q would not be positive.
    #[error("the metric is not symmetric and positive definite")]
    Metric,
    /// A number that must be finite, and sometimes positive, is not.
    #[error("{what} is {found}")]
    Number {
        /// What it is.
        what: &'static str,
        /// The number.
        found: f64,
    },
}
