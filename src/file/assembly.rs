//! Meshes from vertices and polygons as files have them.

use std::collections::HashMap;

use glam::DVec3;

use super::reading::counted;
use crate::geometry::Mesh;

/// A mesh that is being read. Every error is a message that says what is wrong with the last vertex
/// or polygon, and what was expected.
#[derive(Default)]
pub(super) struct Assembly {
    mesh: Mesh,
}

/// The most triangles and vertices of a mesh: a corner has a `u32` number.
const MOST: usize = (u32::MAX / 3) as usize;

impl Assembly {
    /// Adds a vertex.
    pub(super) fn vertex(&mut self, position: DVec3) -> Result<(), String> {
        if self.mesh.positions.len() >= MOST {
            return Err(format!("more than {MOST} vertices"));
        }
        if !position.is_finite() {
            let [x, y, z] = position.to_array();
            return Err(format!(
                "the vertex [{x}, {y}, {z}]; expected finite coordinates"
            ));
        }
        self.mesh.positions.push(position);
        Ok(())
    }

    /// Adds the normal of the next vertex that has none yet. It is made a unit vector unless it is
    /// one; 0 says that it is not known.
    pub(super) fn normal(&mut self, normal: DVec3) -> Result<(), String> {
        if !normal.is_finite() {
            let [x, y, z] = normal.to_array();
            return Err(format!(
                "the normal [{x}, {y}, {z}]; expected finite components"
            ));
        }
        self.mesh.normals.push(unit(normal));
        Ok(())
    }

    /// The number of vertices so far.
    pub(super) fn vertices(&self) -> usize {
        self.mesh.positions.len()
    }

    /// Adds a polygon, divided into triangles that share its first corner; of those that repeat a
    /// vertex, which have no area, nothing. There are or will be `vertices` vertices.
    pub(super) fn polygon(&mut self, corners: &[u32], vertices: usize) -> Result<(), String> {
        if let Some(corner) = corners.iter().find(|&&corner| corner as usize >= vertices) {
            return Err(format!(
                "a corner at vertex {corner}, counted from 0; expected less than {vertices}, \
                 the number of vertices"
            ));
        }
        let [first, rest @ ..] = corners else {
            return Err("a polygon without corners; expected at least 3".into());
        };
        if rest.len() < 2 {
            let corners = counted(corners.len(), "corner");
            return Err(format!("a polygon of {corners}; expected at least 3"));
        }
        for pair in rest.windows(2) {
            let [a, b, c] = [*first, pair[0], pair[1]];
            if a == b || b == c || c == a {
                continue;
            }
            if self.mesh.triangles.len() >= MOST {
                return Err(format!("more than {MOST} triangles"));
            }
            self.mesh.triangles.push([a, b, c]);
        }
        Ok(())
    }

    /// The mesh, unless there is nothing in it.
    pub(super) fn finish(mut self) -> Result<Mesh, String> {
        if self.mesh.triangles.is_empty() {
            let vertices = counted(self.vertices(), "point");
            return Err(format!(
                "{vertices} and no polygon with an area; expected a mesh"
            ));
        }
        if self
            .mesh
            .normals
            .iter()
            .all(|normal| *normal == DVec3::ZERO)
        {
            self.mesh.normals = Vec::new();
        }
        Ok(self.mesh)
    }
}

/// The unit vector in a direction. What is one up to single precision stays as it is; 0 too.
pub(super) fn unit(direction: DVec3) -> DVec3 {
    match (direction.length_squared() - 1.0).abs() < 1e-6 {
        true => direction,
        false => direction.normalize_or_zero(),
    }
}

/// Finds vertices by their coordinates, for formats that repeat them in each triangle.
#[derive(Default)]
pub(super) struct Welder {
    // The standard hasher draws its seed at random, so that no file can be made on which it is
    // slow. The map is only asked, never walked through: the seed has no effect on the result.
    known: HashMap<[u64; 3], u32>,
}

impl Welder {
    /// The number of the vertex with exactly these coordinates, 0 and −0 being the same; a new one
    /// is added.
    pub(super) fn vertex(&mut self, mesh: &mut Assembly, position: DVec3) -> Result<u32, String> {
        let key = (position + DVec3::ZERO).to_array().map(f64::to_bits);
        if let Some(&vertex) = self.known.get(&key) {
            return Ok(vertex);
        }
        // There are at most `MOST` of them.
        let vertex = mesh.vertices() as u32;
        mesh.vertex(position)?;
        self.known.insert(key, vertex);
        Ok(vertex)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(count: usize) -> Assembly {
        let mut mesh = Assembly::default();
        for k in 0..count {
            mesh.vertex(DVec3::new(k as f64, (k * k) as f64, 0.0))
                .unwrap();
        }
        mesh
    }

    #[test]
    fn polygons_become_fans_without_what_has_no_area() {
        let mut mesh = points(5);
        mesh.polygon(&[4, 1, 2, 3], 5).unwrap();
        mesh.polygon(&[0, 1, 1, 2, 0], 5).unwrap();
        let mesh = mesh.finish().unwrap();
        assert_eq!(mesh.triangles, [[4, 1, 2], [4, 2, 3], [0, 1, 2]]);
        assert_eq!(mesh.positions.len(), 5);
    }

    #[test]
    fn what_is_no_mesh_is_refused() {
        let mut mesh = points(3);
        let message = mesh.polygon(&[0, 1, 3], 3).unwrap_err();
        assert!(message.contains("at vertex 3") && message.contains("less than 3"));
        let message = mesh.polygon(&[0, 1], 3).unwrap_err();
        assert!(message.contains("of 2 corners; expected at least 3"));
        assert!(mesh.polygon(&[], 3).is_err());
        assert!(mesh.vertex(DVec3::new(0.0, f64::NAN, 1.0)).is_err());
        assert!(mesh.normal(DVec3::INFINITY).is_err());
        mesh.polygon(&[1, 1, 2], 3).unwrap();
        let message = mesh.finish().unwrap_err();
        assert!(message.contains("3 points and no polygon"), "{message}");
    }

    #[test]
    fn normals_are_unit_vectors_or_nothing() {
        let mut mesh = points(3);
        mesh.polygon(&[0, 1, 2], 3).unwrap();
        for normal in [DVec3::X * 3.0, DVec3::ZERO, DVec3::new(1e-200, 0.0, 0.0)] {
            mesh.normal(normal).unwrap();
        }
        let normals = mesh.finish().unwrap().normals;
        assert_eq!(normals[..2], [DVec3::X, DVec3::ZERO]);
        let nearly = DVec3::new(0.6, 0.8 + 1e-9, 0.0);
        assert_eq!(unit(nearly), nearly);
        let mut mesh = points(3);
        mesh.polygon(&[0, 1, 2], 3).unwrap();
        (0..3).for_each(|_| mesh.normal(DVec3::ZERO).unwrap());
        assert!(mesh.finish().unwrap().normals.is_empty());
    }

    #[test]
    fn equal_coordinates_are_one_vertex() {
        let mut mesh = Assembly::default();
        let mut welder = Welder::default();
        let mut vertex = |x: f64| welder.vertex(&mut mesh, DVec3::new(x, 0.0, 1.0)).unwrap();
        assert_eq!(
            [0.0, 1.0, -0.0, 1.0, 1.0 + 1e-15].map(&mut vertex),
            [0, 1, 0, 1, 2]
        );
        assert_eq!(mesh.vertices(), 3);
    }
}
