//! Binary STL: triangles without connectivity, in single precision, little endian. For printing
//! and for tools that know nothing else.

mod read;

use std::io::{self, Write};

use glam::DVec3;

use crate::geometry::Mesh;

pub(super) use read::read_mesh;

/// Free text. It must not begin with `solid`, by which readers recognise the text form of STL.
const HEADER: &[u8; 80] =
    b"binary STL made by Imp                                                          ";

/// Header, number of triangles, then normal, corners and an empty attribute of each.
///
/// An error for more than 2³² − 1 triangles, which the format cannot count.
pub(super) fn write_mesh(output: &mut dyn Write, mesh: &Mesh) -> io::Result<()> {
    let count = u32::try_from(mesh.triangles.len()).map_err(|_| {
        let message = "STL files hold at most 4294967295 triangles";
        io::Error::new(io::ErrorKind::FileTooLarge, message)
    })?;
    output.write_all(HEADER)?;
    output.write_all(&count.to_le_bytes())?;
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
        for vector in [facet_normal(a, b, c), a, b, c] {
            for component in vector.to_array() {
                output.write_all(&(component as f32).to_le_bytes())?;
            }
        }
        output.write_all(&[0, 0])?;
    }
    Ok(())
}

/// The unit normal by the right-hand rule; 0 for a triangle without area.
fn facet_normal(a: DVec3, b: DVec3, c: DVec3) -> DVec3 {
    (b - a).cross(c - a).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::super::test_values::bytes;
    use super::*;

    fn tetrahedron() -> Mesh {
        Mesh {
            positions: vec![DVec3::ZERO, DVec3::X * 0.1, DVec3::Y * 0.3, DVec3::Z / 3.0],
            normals: Vec::new(),
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        }
    }

    #[test]
    fn triangles_read_back_in_single_precision() {
        let mesh = tetrahedron();
        let bytes = bytes(write_mesh, &mesh);
        assert_eq!(bytes.len(), 84 + 50 * 4);
        assert!(!bytes.starts_with(b"solid"));
        assert_eq!(bytes[80..84], [4, 0, 0, 0]);
        for (facet, triangle) in bytes[84..].chunks(50).zip(&mesh.triangles) {
            let floats: Vec<f32> = facet[..48]
                .chunks(4)
                .map(|four| f32::from_le_bytes(four.try_into().unwrap()))
                .collect();
            for (corner, &vertex) in floats[3..].chunks(3).zip(triangle) {
                assert_eq!(corner, mesh.positions[vertex as usize].as_vec3().to_array());
            }
            assert_eq!(facet[48..], [0, 0]);
        }
        let normal = |k: usize| {
            let start = 84 + 50 * k;
            [0, 4, 8].map(|offset| {
                let four = &bytes[start + offset..start + offset + 4];
                f32::from_le_bytes(four.try_into().unwrap())
            })
        };
        assert_eq!(normal(0), [0.0, 0.0, -1.0]);
        assert_eq!(normal(1), [0.0, -1.0, 0.0]);
        assert_eq!(normal(2), [-1.0, 0.0, 0.0]);
        // The plane 10 x + y/0.3 + 3 z = 1, whose gradient has length √(100 + 100/9 + 9).
        let length = (100.0 + 100.0 / 9.0 + 9.0f64).sqrt();
        for (component, expected) in normal(3).into_iter().zip([10.0, 10.0 / 3.0, 3.0]) {
            assert!((f64::from(component) - expected / length).abs() < 1e-7);
        }
    }

    #[test]
    fn facets_without_area_have_normal_zero() {
        let mut mesh = tetrahedron();
        mesh.triangles = vec![[0, 0, 1]];
        assert_eq!(bytes(write_mesh, &mesh)[84..96], [0; 12]);
    }
}
