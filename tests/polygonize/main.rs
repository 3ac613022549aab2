//! Polygonizers: level sets with known topology, measures and roots.

mod bracketing;
mod continuation;
mod cubes;
mod octree;
mod squares;
mod support;
mod surfaces;
mod tetrahedra;
