//! Polygonizers: level sets with known topology, measures and roots.

mod bracketing;
mod cubes;
mod expression;
mod newton;
mod plane;
mod squares;
mod support;
