//! Continuation: curves on which one field in R2, or two in R3, vanish, followed from starts that
//! miss no component.
//!
//! Samplers spread points along them, polygonizers join them to polylines. In reading order: the
//! equations of a curve and Newton's steps (`system`), a step and the arc length of it (`step`),
//! what intervals prove (`proof`), the walk (`curve`), where walks begin so that no component is
//! missed (`starts`) and what is left of that (`left`).

mod curve;
mod left;
mod proof;
mod starts;
mod step;
mod system;

pub(crate) use self::curve::{Events, Walker};
pub(crate) use self::proof::{Cell, enclose};
pub(crate) use self::starts::{Component, Region, Traced, crossed_cells, trace};
pub(crate) use self::step::{Place, Step};
pub(crate) use self::system::{Condition, System};
