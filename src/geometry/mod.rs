//! What comes out: points, curves, meshes and images, and what can be measured on them.
//!
//! Samplers and polygonizers make [`Samples`], [`Curves`] and a [`Mesh`], pictures are an
//! [`Image`]; the file writers and the measures of the language take them from here. Nothing in this room knows how they came
//! to be.

mod bounds;
mod curves;
mod image;
mod mesh;
mod samples;
mod simplex;

mod collapse;
mod delaunay;
mod deviation;
mod disjoint_sets;
mod intersect;
mod measure;
mod neighbours;
mod predicates;
mod quadric;
mod quality;
mod remesh;
mod simplify;
mod summation;
mod surgery;
mod topology;
mod vector;

pub use bounds::Bounds;
pub(crate) use delaunay::{Delaunay, Facet};
pub use deviation::{Deviation, Distances, FieldValues};
pub(crate) use disjoint_sets::DisjointSets;
pub(crate) use vector::length;

pub use curves::{Curves, Polyline};
pub use image::{Animation, Image};
pub use mesh::Mesh;
pub use neighbours::{Spacing, nearest_distances};
pub use quality::Quality;
pub use remesh::{Project, Remeshing};
pub use samples::Samples;
pub use simplex::{Solid, radius_ratio, simplex_measure};
pub use simplify::{Goal, RefineError, Simplified};
pub use topology::Topology;

#[cfg(test)]
mod test_meshes;
