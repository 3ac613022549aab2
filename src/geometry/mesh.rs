//! Triangle meshes.

use glam::DVec3;

/// Triangles with shared vertices, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertices.
    pub positions: Vec<DVec3>,
    /// Unit normals at the vertices, outward; empty, or one per vertex (0 where unknown).
    pub normals: Vec<DVec3>,
    /// Three vertices each.
    pub triangles: Vec<[u32; 3]>,
}
