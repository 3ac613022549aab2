//! Polygonizers: level sets with known topology, measures and roots.

mod bracketing;
mod bricks;
mod certified;
mod compiled;
mod continuation;
mod cubes;
mod cubes_snapping;
mod cubes_topology;
mod delaunay;
mod dual;
mod expression;
mod extended;
mod newton;
mod octree;
mod plane;
mod space_curves;
mod springs;
mod squares;
mod support;
mod surfaces;
mod tetrahedra;
mod trilinear;
