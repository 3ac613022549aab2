//! Triangle meshes.

use glam::DVec3;

/// Triangles with shared vertices, counter-clockwise seen from outside.
///
/// Every triangle refers to existing positions, and there are fewer than 2³²/3 triangles, so that
/// a corner has a `u32` number.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertices.
    pub positions: Vec<DVec3>,
    /// Unit normals at the vertices, outward; empty, or one per vertex (0 where unknown).
    pub normals: Vec<DVec3>,
    /// Three vertices each.
    pub triangles: Vec<[u32; 3]>,
}
