//! Polygonizers: level sets with known topology, measures and roots.

mod bracketing;
mod cubes;
mod cubes_topology;
mod squares;
mod support;
mod trilinear;
