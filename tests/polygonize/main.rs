//! Polygonizers: level sets with known topology, measures and roots.

mod bracketing;
mod cubes;
mod dual;
mod squares;
mod support;
