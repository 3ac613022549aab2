//! Surfaces that follow points: control points against equations solved by hand and by pseudo-inverses, fits
//! against closed forms and known parameters.

#[path = "../engine_common/expressions.rs"]
#[allow(dead_code)]
mod expressions;

#[path = "../engine_common/fields.rs"]
mod examples;

mod control;

mod fields;

mod fit;
mod simulation;
