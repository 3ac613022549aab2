//! Wavefront OBJ: text, read by nearly everything. Vertices are numbered from 1.

mod read;

use std::io::{self, Write};

use glam::DVec3;

use crate::geometry::{Curves, Mesh, Samples};

pub(super) use read::read_mesh;

/// `v`, one `vn` for each vertex if there are normals, and `f`.
pub(super) fn write_mesh(output: &mut dyn Write, mesh: &Mesh) -> io::Result<()> {
    write_vectors(output, "v", &mesh.positions)?;
    write_vectors(output, "vn", &mesh.normals)?;
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|vertex| u64::from(vertex) + 1);
        if mesh.normals.is_empty() {
            writeln!(output, "f {a} {b} {c}")?;
        } else {
            writeln!(output, "f {a}//{a} {b}//{b} {c}//{c}")?;
        }
    }
    Ok(())
}

/// `v` and one `l` for each curve, which ends with its first vertex again if it is closed. A
/// curve of one point becomes a `p`.
pub(super) fn write_curves(output: &mut dyn Write, curves: &Curves) -> io::Result<()> {
    for polyline in &curves.polylines {
        write_vectors(output, "v", &polyline.points)?;
    }
    let mut first = 1;
    for polyline in &curves.polylines {
        let end = first + polyline.points.len();
        match polyline.points.len() {
            0 => {}
            1 => writeln!(output, "p {first}")?,
            _ => {
                write!(output, "l")?;
                let again = polyline.closed.then_some(first);
                for vertex in (first..end).chain(again) {
                    write!(output, " {vertex}")?;
                }
                writeln!(output)?;
            }
        }
        first = end;
    }
    Ok(())
}

/// `v` and one `p` for each sample. OBJ has no place for the normal of a point.
pub(super) fn write_samples(output: &mut dyn Write, samples: &Samples) -> io::Result<()> {
    write_vectors(output, "v", &samples.positions)?;
    for vertex in 1..=samples.positions.len() {
        writeln!(output, "p {vertex}")?;
    }
    Ok(())
}

fn write_vectors(output: &mut dyn Write, keyword: &str, vectors: &[DVec3]) -> io::Result<()> {
    for vector in vectors {
        writeln!(
            output,
            "{keyword} {:?} {:?} {:?}",
            vector.x, vector.y, vector.z
        )?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::test_values::{
        mesh, mesh_without_normals, plane_curves, samples, space_curves, text,
    };
    use super::*;

    /// The lines that begin with a keyword, without it.
    fn lines<'a>(text: &'a str, keyword: &str) -> Vec<Vec<&'a str>> {
        let words = text.lines().map(|line| line.split(' ').collect::<Vec<_>>());
        words
            .filter(|words| words[0] == keyword)
            .map(|words| words[1..].to_vec())
            .collect()
    }

    fn vectors(text: &str, keyword: &str) -> Vec<DVec3> {
        lines(text, keyword)
            .iter()
            .map(|words| {
                DVec3::from_slice(&words.iter().map(|w| w.parse().unwrap()).collect::<Vec<_>>())
            })
            .collect()
    }

    fn indices(text: &str, keyword: &str) -> Vec<Vec<usize>> {
        let parse = |words: &Vec<&str>| words.iter().map(|w| w.parse().unwrap()).collect();
        lines(text, keyword).iter().map(parse).collect()
    }

    #[test]
    fn meshes_read_back_exactly() {
        let mesh = mesh();
        let text = text(write_mesh, &mesh);
        assert_eq!(vectors(&text, "v"), mesh.positions);
        assert_eq!(vectors(&text, "vn"), mesh.normals);
        let faces = lines(&text, "f");
        assert_eq!(faces.len(), mesh.triangles.len());
        for (face, triangle) in faces.iter().zip(&mesh.triangles) {
            for (corner, vertex) in face.iter().zip(triangle) {
                assert_eq!(*corner, format!("{0}//{0}", vertex + 1));
            }
        }
        assert_eq!(text.lines().count(), 5 + 5 + 3);
    }

    #[test]
    fn meshes_without_normals_have_plain_faces() {
        let text = text(write_mesh, &mesh_without_normals());
        assert_eq!(indices(&text, "f"), [[1, 2, 3], [3, 2, 4], [4, 5, 1]]);
        assert_eq!(text.lines().count(), 5 + 3);
    }

    #[test]
    fn curves_become_lines_and_closed_ones_return_to_their_start() {
        let curves = plane_curves();
        let plane = text(write_curves, &curves);
        let points = curves.polylines.iter().flat_map(|p| p.points.clone());
        assert_eq!(vectors(&plane, "v"), points.collect::<Vec<_>>());
        assert_eq!(indices(&plane, "l"), [vec![1, 2, 3, 1], vec![4, 5]]);
        assert_eq!(indices(&plane, "p"), [[6]]);
        let space = text(write_curves, &space_curves());
        assert_eq!(vectors(&space, "v"), space_curves().polylines[0].points);
    }

    #[test]
    fn samples_become_points() {
        let text = text(write_samples, &samples());
        assert_eq!(vectors(&text, "v"), samples().positions);
        assert_eq!(indices(&text, "p"), [[1], [2], [3], [4]]);
    }
}
