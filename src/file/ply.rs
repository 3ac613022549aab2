//! Binary PLY (little endian) in double precision: the format that keeps everything about meshes
//! and samples. G. Turk, "The PLY polygon file format", 1994.

mod header;
mod read;

use std::io::{self, Write};

use super::sample_columns;
use crate::geometry::{Mesh, Samples};

pub(super) use read::read_mesh;

/// Vertices with positions, and normals if there are any; faces as lists of three indices.
pub(super) fn write_mesh(output: &mut dyn Write, mesh: &Mesh) -> io::Result<()> {
    let has_normals = !mesh.normals.is_empty();
    let columns = if has_normals { 6 } else { 3 };
    write_vertex_header(
        output,
        mesh.positions.len(),
        &sample_columns::VECTORS[..columns],
    )?;
    writeln!(output, "element face {}", mesh.triangles.len())?;
    writeln!(output, "property list uchar uint vertex_indices")?;
    writeln!(output, "end_header")?;
    let mut normals = mesh.normals.iter();
    for position in &mesh.positions {
        write_doubles(output, &position.to_array())?;
        if let Some(normal) = normals.next() {
            write_doubles(output, &normal.to_array())?;
        }
    }
    for triangle in &mesh.triangles {
        output.write_all(&[3])?;
        for vertex in triangle {
            output.write_all(&vertex.to_le_bytes())?;
        }
    }
    Ok(())
}

/// Vertices with `x y z nx ny nz radius residual`, with tangents `tx ty tz` too and with weights
/// `weight`.
pub(super) fn write_samples(output: &mut dyn Write, samples: &Samples) -> io::Result<()> {
    write_vertex_header(
        output,
        samples.positions.len(),
        &sample_columns::names(samples),
    )?;
    writeln!(output, "end_header")?;
    for row in sample_columns::rows(samples) {
        write_doubles(output, &row)?;
    }
    Ok(())
}

/// The header as far as the properties of the vertices.
fn write_vertex_header(output: &mut dyn Write, count: usize, names: &[&str]) -> io::Result<()> {
    writeln!(output, "ply")?;
    writeln!(output, "format binary_little_endian 1.0")?;
    writeln!(output, "comment made by Imp")?;
    writeln!(output, "element vertex {count}")?;
    for name in names {
        writeln!(output, "property double {name}")?;
    }
    Ok(())
}

fn write_doubles(output: &mut dyn Write, values: &[f64]) -> io::Result<()> {
    for value in values {
        output.write_all(&value.to_le_bytes())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::test_values::{bytes, mesh, mesh_without_normals, samples, samples_of_lines};
    use super::*;

    /// The header lines and what follows.
    fn split(bytes: &[u8]) -> (Vec<&str>, &[u8]) {
        let end = b"end_header\n";
        let at = bytes
            .windows(end.len())
            .position(|window| window == end)
            .unwrap();
        let header = std::str::from_utf8(&bytes[..at]).unwrap();
        (header.lines().collect(), &bytes[at + end.len()..])
    }

    fn doubles(bytes: &[u8]) -> Vec<f64> {
        let double = |eight: &[u8]| f64::from_le_bytes(eight.try_into().unwrap());
        bytes.chunks(8).map(double).collect()
    }

    const START: [&str; 3] = [
        "ply",
        "format binary_little_endian 1.0",
        "comment made by Imp",
    ];

    fn assert_mesh_reads_back(mesh: &Mesh) {
        let bytes = bytes(write_mesh, mesh);
        let (header, body) = split(&bytes);
        let columns: &[&str] = if mesh.normals.is_empty() {
            &["x", "y", "z"]
        } else {
            &["x", "y", "z", "nx", "ny", "nz"]
        };
        let mut expected: Vec<String> = START.map(str::to_owned).to_vec();
        expected.push("element vertex 5".to_owned());
        expected.extend(columns.iter().map(|name| format!("property double {name}")));
        expected.push("element face 3".to_owned());
        expected.push("property list uchar uint vertex_indices".to_owned());
        assert_eq!(header, expected);

        let (vertices, faces) = body.split_at(5 * 8 * columns.len());
        for (k, row) in doubles(vertices).chunks(columns.len()).enumerate() {
            assert_eq!(row[..3], mesh.positions[k].to_array());
            if let Some(normal) = mesh.normals.get(k) {
                assert_eq!(row[3..], normal.to_array());
            }
        }
        assert_eq!(faces.len(), 3 * 13);
        for (face, triangle) in faces.chunks(13).zip(&mesh.triangles) {
            assert_eq!(face[0], 3);
            for (index, vertex) in face[1..].chunks(4).zip(triangle) {
                assert_eq!(index, vertex.to_le_bytes());
            }
        }
    }

    #[test]
    fn meshes_read_back_exactly_with_and_without_normals() {
        assert_mesh_reads_back(&mesh());
        assert_mesh_reads_back(&mesh_without_normals());
    }

    #[test]
    fn samples_read_back_exactly() {
        let samples = samples();
        let bytes = bytes(write_samples, &samples);
        let (header, body) = split(&bytes);
        assert_eq!(header[..3], START);
        assert_eq!(header[3], "element vertex 4");
        let names = ["x", "y", "z", "nx", "ny", "nz", "radius", "residual"];
        assert_eq!(
            header[4..],
            names.map(|name| format!("property double {name}"))
        );
        let rows = doubles(body);
        assert_eq!(rows.len(), 4 * 8);
        for (k, row) in rows.chunks(8).enumerate() {
            assert_eq!(DVec3::from_slice(&row[..3]), samples.positions[k]);
            assert_eq!(DVec3::from_slice(&row[3..6]), samples.normals[k]);
            assert_eq!(row[6..], [samples.radii[k], samples.residuals[k]]);
        }
    }

    #[test]
    fn tangents_and_weights_have_properties_where_there_are_any() {
        let samples = samples_of_lines();
        let bytes = bytes(write_samples, &samples);
        let (header, body) = split(&bytes);
        let names = ["tx", "ty", "tz", "weight"];
        assert_eq!(
            header[12..],
            names.map(|name| format!("property double {name}"))
        );
        for (k, row) in doubles(body).chunks(12).enumerate() {
            assert_eq!(DVec3::from_slice(&row[8..11]), samples.tangents[k]);
            assert_eq!(row[11], samples.weights[k]);
        }
    }
}
