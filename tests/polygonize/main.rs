//! Polygonizers: level sets with known topology, measures and roots.

mod bracketing;
mod cubes;
mod squares;
mod support;
