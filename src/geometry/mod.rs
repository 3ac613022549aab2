//! What comes out: points, curves and meshes, and what can be measured on them.

mod bounds;
mod curves;
mod mesh;
mod samples;

pub use bounds::Bounds;
pub use curves::{Curves, Polyline};
pub use mesh::Mesh;
pub use samples::Samples;
