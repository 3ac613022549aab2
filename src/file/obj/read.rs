//! Reading OBJ: vertices, normals and polygons. Texture coordinates, names, groups, materials,
//! lines and points are left aside; free-form surfaces are refused.

use glam::DVec3;

use super::super::assembly::{Assembly, unit};
use super::super::reading::{Lines, Wrong, quoted_bytes, vector, whole};
use crate::geometry::Mesh;

/// Statements that have nothing to say about a mesh of polygons.
const LEFT_ASIDE: &[&[u8]] = &[
    b"vt",
    b"vp",
    b"l",
    b"p",
    b"o",
    b"g",
    b"s",
    b"mg",
    b"usemtl",
    b"mtllib",
    b"usemap",
    b"maplib",
    b"lod",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"shadow_obj",
    b"trace_obj",
];

/// The normal of a vertex, as far as it is known.
#[derive(Clone, Copy)]
enum Normal {
    Unknown,
    Known(DVec3),
    /// Its corners have different ones: the surface has an edge there.
    Several,
}

/// The mesh of a text. A vertex has the normal that its corners have, if they all have the same.
/// Costs time and memory in proportion to the content.
pub(in crate::file) fn read_mesh(content: &[u8]) -> Result<Mesh, Wrong> {
    let mut lines = Lines::new(content);
    let mut reader = Reader::default();
    let mut words = Vec::new();
    let mut joined = Vec::new();
    while lines.next_words(&mut words, true) {
        // A backslash at its end continues a line.
        while let Some(start) = words.last().and_then(|word| word.strip_suffix(b"\\")) {
            words.pop();
            words.extend((!start.is_empty()).then_some(start));
            if !lines.next_words(&mut joined, true) {
                return Err(lines.wrong("the file ends after `\\`; expected another line"));
            }
            words.append(&mut joined);
        }
        reader
            .statement(&words)
            .map_err(|message| lines.wrong(message))?;
    }
    reader.finish().map_err(|message| lines.wrong(message))
}

#[derive(Default)]
struct Reader {
    mesh: Assembly,
    normals: Vec<DVec3>,
    /// One for each vertex.
    vertex_normals: Vec<Normal>,
    corners: Vec<u32>,
}

impl Reader {
    /// Takes in a statement; the error says what is wrong with it and what was expected.
    fn statement(&mut self, words: &[&[u8]]) -> Result<(), String> {
        let [keyword, operands @ ..] = words else {
            return Ok(());
        };
        match *keyword {
            b"v" => {
                self.mesh.vertex(vector(operands)?)?;
                self.vertex_normals.push(Normal::Unknown);
                Ok(())
            }
            b"vn" => {
                self.normals.push(unit(vector(operands)?));
                Ok(())
            }
            b"f" => self.face(operands),
            left_aside if LEFT_ASIDE.contains(&left_aside) => Ok(()),
            _ => Err(format!(
                "there is no statement {} for polygons; expected `v`, `vn` or `f`",
                quoted_bytes(keyword)
            )),
        }
    }

    /// A polygon with corners `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn face(&mut self, operands: &[&[u8]]) -> Result<(), String> {
        self.corners.clear();
        for operand in operands {
            let mut parts = operand.split(|&byte| byte == b'/');
            let vertex = index(
                parts.next().unwrap_or_default(),
                self.mesh.vertices(),
                "vertex",
            )?;
            let normal = parts.nth(1).filter(|part| !part.is_empty());
            if parts.next().is_some() {
                let corner = quoted_bytes(operand);
                return Err(format!(
                    "the corner {corner}; expected `vertex/texture/normal`"
                ));
            }
            if let Some(part) = normal {
                let place = index(part, self.normals.len(), "normal")?;
                let known = &mut self.vertex_normals[vertex];
                let normal = self.normals[place];
                *known = match *known {
                    Normal::Unknown => Normal::Known(normal),
                    Normal::Known(other) if other == normal => Normal::Known(normal),
                    _ => Normal::Several,
                };
            }
            // There are no more vertices than `u32` can count.
            self.corners.push(vertex as u32);
        }
        self.mesh.polygon(&self.corners, self.mesh.vertices())
    }

    fn finish(mut self) -> Result<Mesh, String> {
        for normal in self.vertex_normals {
            self.mesh.normal(match normal {
                Normal::Known(normal) => normal,
                Normal::Unknown | Normal::Several => DVec3::ZERO,
            })?;
        }
        self.mesh.finish()
    }
}

/// The place from 0 of something that is numbered from 1, or from −1 backward.
fn index(word: &[u8], count: usize, what: &str) -> Result<usize, String> {
    let number: i64 = whole(word)?;
    let place = match number {
        1.. => number - 1,
        _ => count as i64 + number,
    };
    match usize::try_from(place) {
        Ok(place) if number != 0 && place < count => Ok(place),
        _ => Err(format!(
            "the {what} {number}, of {count} so far; expected 1 to {count}, or -1 for the last"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::reading::Place;
    use super::super::super::test_values::{bytes, mesh, mesh_without_normals};
    use super::super::write_mesh;
    use super::*;

    #[track_caller]
    fn refuses(content: &str, line: u64, words: &str) {
        let wrong = read_mesh(content.as_bytes()).unwrap_err();
        assert_eq!(wrong.place, Place::Line(line), "{}", wrong.message);
        assert!(wrong.message.contains(words), "{}", wrong.message);
    }

    const POINTS: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    #[test]
    fn what_is_written_reads_back_exactly() {
        for mesh in [mesh(), mesh_without_normals()] {
            assert_eq!(read_mesh(&bytes(write_mesh, &mesh)).unwrap(), mesh);
        }
    }

    #[test]
    fn corners_of_all_forms_are_read() {
        let text = format!(
            "# \u{e9}\nmtllib a b.mtl\no thing\n{POINTS}vt 0 0\nvn 0 0 1\ng a\ns off\n\
             usemtl red\nf 1/1/1 2/1/-1 3//1 4/1\nv 2 0 1 1.0\nf -4 -1 \\\n  -3\nl 1 2\np 1\n\
             v 5 5 5 0.1 0.2 0.3\n"
        );
        let mesh = read_mesh(text.as_bytes()).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [1, 4, 2]]);
        assert_eq!(
            mesh.positions[4..],
            [DVec3::new(2.0, 0.0, 1.0), DVec3::splat(5.0)]
        );
        let known = [true, true, true, false, false, false];
        assert_eq!(mesh.normals.len(), 6);
        for (normal, known) in mesh.normals.iter().zip(known) {
            assert_eq!(*normal, if known { DVec3::Z } else { DVec3::ZERO });
        }
        // Comments may be in any encoding.
        assert!(read_mesh(&[&b"# \xe9\n"[..], POINTS.as_bytes(), b"f 1 2 3"].concat()).is_ok());
    }

    #[test]
    fn corners_with_different_normals_leave_the_vertex_without() {
        let faces = "vn 0 0 1\nvn 0 2 0\nvn 0 1 0\nf 1//1 2//2 3//3\nf 1//2 3//2 4//1\n";
        let mesh = read_mesh(format!("{POINTS}{faces}").as_bytes()).unwrap();
        assert_eq!(mesh.normals, [DVec3::ZERO, DVec3::Y, DVec3::Y, DVec3::Z]);
    }

    #[test]
    fn wrong_lines_are_named() {
        refuses("", 1, "0 points and no polygon");
        refuses(POINTS, 4, "4 points and no polygon");
        refuses("v 0 0\n", 1, "2 numbers; expected three");
        refuses("\nv 0 0 x", 2, "`x` is not a number");
        refuses("v 0 1e400 0", 1, "`1e400` is not finite");
        for (face, words) in [
            ("1 2", "a polygon of 2 corners; expected at least 3"),
            ("", "a polygon without corners"),
            ("1 2 5", "the vertex 5, of 4 so far; expected 1 to 4"),
            ("1 2 0", "the vertex 0, of 4"),
            ("1 2 -5", "the vertex -5, of 4"),
            ("1 2 9223372036854775807", "the vertex 9223372036854775807"),
            ("1 2 99999999999999999999", "is not an index or count"),
            ("1//1 2 3", "the normal 1, of 0 so far"),
            (
                "1/1/1/1 2 3",
                "the corner `1/1/1/1`; expected `vertex/texture/normal`",
            ),
            ("/1 2 3", "`` is not an index"),
        ] {
            refuses(&format!("{POINTS}f {face}\n"), 5, words);
        }
        refuses("surf 0 1 0 1 1 2", 1, "no statement `surf` for polygons");
        refuses("v 0 0 \\\n", 1, "the file ends after `\\`");
    }
}
