//! Reading STL, binary and as text. Corners with equal coordinates become one vertex; normals of
//! facets are left aside, since the order of the corners has the same to say.
//!
//! A file is binary if it is as long as the number of its triangles demands. Whether it begins with
//! `solid` says nothing: many binary files do.

use glam::DVec3;

use super::super::assembly::{Assembly, Welder};
use super::super::reading::{Bytes, Lines, Wrong, quoted_bytes, vector};
use crate::geometry::Mesh;

/// Bytes before the first facet of a binary file: a free text and the number of facets.
const HEADER: usize = 84;

/// Bytes of a facet: normal, three corners, two bytes for attributes.
const FACET: usize = 50;

/// The mesh of a binary file or a text. Costs time and memory in proportion to the content.
pub(in crate::file) fn read_mesh(content: &[u8]) -> Result<Mesh, Wrong> {
    let promised = content
        .get(HEADER - 4..HEADER)
        .and_then(<[u8]>::first_chunk);
    let facets = promised.map(|&bytes| u64::from(u32::from_le_bytes(bytes)));
    let length = facets.map(|facets| HEADER as u64 + FACET as u64 * facets);
    if length == Some(content.len() as u64) {
        return read_binary(content);
    }
    let start = &content[..content.len().min(1000)];
    let text = start.trim_ascii_start();
    let begins = text.len() >= 5 && text[..5].eq_ignore_ascii_case(b"solid");
    // A text has no byte 0, and a binary header nearly always has one behind it.
    if begins && !start.contains(&0) {
        return read_text(content);
    }
    Err(match (facets, length) {
        (Some(facets), Some(length)) => Bytes::new(content, HEADER - 4).wrong(format!(
            "a binary STL file with {facets} facets has {length} bytes, but this one has {}; \
             expected that, or a text that begins with `solid`",
            content.len()
        )),
        _ => Bytes::new(content, content.len()).wrong(format!(
            "the file ends within the header; expected a binary STL file of at least {HEADER} \
             bytes, or a text that begins with `solid`"
        )),
    })
}

/// The facets of a file that is as long as it should be.
fn read_binary(content: &[u8]) -> Result<Mesh, Wrong> {
    let mut bytes = Bytes::new(content, HEADER);
    let mut mesh = Assembly::default();
    let mut welder = Welder::default();
    while bytes.left() > 0 {
        // The normal.
        bytes.skip(12);
        let mut corners = [0; 3];
        for corner in &mut corners {
            let place = bytes.place();
            let mut position = DVec3::ZERO;
            for axis in 0..3 {
                position[axis] = f64::from(f32::from_le_bytes(bytes.take("a facet")?));
            }
            let vertex = welder.vertex(&mut mesh, position);
            *corner = vertex.map_err(|message| Wrong { place, message })?;
        }
        bytes.skip(2);
        mesh.polygon(&corners, mesh.vertices())
            .map_err(|message| bytes.wrong(message))?;
    }
    mesh.finish().map_err(|message| bytes.wrong(message))
}

/// A text of lines `solid`, `facet normal x y z`, `outer loop`, three of `vertex x y z`, `endloop`,
/// `endfacet`, `endsolid`, in capitals or not; several solids become one mesh.
fn read_text(content: &[u8]) -> Result<Mesh, Wrong> {
    let mut text = Text {
        lines: Lines::new(content),
        words: Vec::new(),
    };
    let mut mesh = Assembly::default();
    let mut welder = Welder::default();
    let mut inside = false;
    while text.next() {
        match (inside, text.keyword().as_slice()) {
            (false, b"solid") => inside = true,
            (true, b"endsolid") => inside = false,
            (true, b"facet") => read_facet(&mut text, &mut mesh, &mut welder)?,
            (true, _) => return Err(text.expected("`facet` or `endsolid`")),
            (false, _) => return Err(text.expected("`solid`")),
        }
    }
    if inside {
        return Err(text.expected("`facet` or `endsolid`"));
    }
    mesh.finish().map_err(|message| text.lines.wrong(message))
}

/// What comes after the line of `facet`.
fn read_facet(text: &mut Text, mesh: &mut Assembly, welder: &mut Welder) -> Result<(), Wrong> {
    text.require(b"outer", "`outer loop`")?;
    let mut corners = [0; 3];
    for corner in &mut corners {
        text.require(b"vertex", "`vertex x y z`")?;
        *corner = vector(&text.words[1..])
            .and_then(|position| welder.vertex(mesh, position))
            .map_err(|message| text.lines.wrong(message))?;
    }
    text.require(b"endloop", "`endloop` after three vertices")?;
    text.require(b"endfacet", "`endfacet`")?;
    mesh.polygon(&corners, mesh.vertices())
        .map_err(|message| text.lines.wrong(message))
}

/// The lines and the words of the present one.
struct Text<'a> {
    lines: Lines<'a>,
    words: Vec<&'a [u8]>,
}

impl Text<'_> {
    /// Goes to the next line with words; false at the end.
    fn next(&mut self) -> bool {
        self.lines.next_words(&mut self.words, false)
    }

    /// The first word in small letters; empty at the end.
    fn keyword(&self) -> Vec<u8> {
        self.words
            .first()
            .map_or(Vec::new(), |word| word.to_ascii_lowercase())
    }

    /// Goes to the next line, which has to begin with a keyword.
    fn require(&mut self, keyword: &[u8], expected: &str) -> Result<(), Wrong> {
        self.next();
        match self.keyword() == keyword {
            true => Ok(()),
            false => Err(self.expected(expected)),
        }
    }

    /// The error for a line that is not what was expected.
    fn expected(&self, expected: &str) -> Wrong {
        self.lines.wrong(match self.words.first() {
            Some(word) => format!("{}; expected {expected}", quoted_bytes(word)),
            None => format!("the file ends; expected {expected}"),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::reading::Place;
    use super::super::super::test_values::{bytes, single_precision_mesh};
    use super::super::write_mesh;
    use super::*;

    const TEXT: &str = "solid a b\n\
                        facet normal 0 0 1\n  outer loop\n    vertex 0 0 0\n    vertex 1 0 0\n\
                            vertex 0 1e0 0\n  endloop\nendfacet\nendsolid a b\n\
                        SOLID\r\nFacet Normal 0 0 0\nOuter Loop\nVertex 1 0 -0\n\
                        VERTEX 1 1 .5\nvertex -0 1 0\nEndLoop\nEndFacet\nEndSolid\n";

    #[track_caller]
    fn refuses(content: &[u8], place: Place, words: &str) {
        let wrong = read_mesh(content).unwrap_err();
        assert_eq!(wrong.place, place, "{}", wrong.message);
        assert!(wrong.message.contains(words), "{}", wrong.message);
    }

    #[test]
    fn what_is_written_reads_back_in_single_precision() {
        let mesh = single_precision_mesh();
        let read = read_mesh(&bytes(write_mesh, &mesh)).unwrap();
        // Vertices are numbered as they come.
        let corners = |mesh: &Mesh| -> Vec<DVec3> {
            let corners = mesh.triangles.as_flattened().iter();
            corners
                .map(|&corner| mesh.positions[corner as usize])
                .collect()
        };
        assert_eq!(corners(&read), corners(&mesh));
        assert_eq!(read.positions.len(), mesh.positions.len());
        assert!(read.normals.is_empty());
    }

    #[test]
    fn texts_are_read_and_equal_corners_are_one_vertex() {
        let mesh = read_mesh(TEXT.as_bytes()).unwrap();
        let expected = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.5]];
        assert_eq!(mesh.positions, expected.map(DVec3::from_array));
        assert_eq!(mesh.triangles, [[0, 1, 2], [1, 3, 2]]);
    }

    #[test]
    fn a_binary_file_may_begin_like_a_text() {
        let mesh = single_precision_mesh();
        let mut content = bytes(write_mesh, &mesh);
        content[..6].copy_from_slice(b"solid ");
        assert_eq!(
            read_mesh(&content).unwrap().triangles.len(),
            mesh.triangles.len()
        );
        // Where its length is wrong, it is not taken for a text either.
        content.pop();
        refuses(
            &content,
            Place::Byte(80),
            "has 234 bytes, but this one has 233",
        );
    }

    #[test]
    fn wrong_binary_files_are_refused_at_their_byte() {
        let mut content = bytes(write_mesh, &single_precision_mesh());
        refuses(b"", Place::Byte(0), "the file ends within the header");
        refuses(&content[..50], Place::Byte(50), "at least 84 bytes");
        content[96..100].copy_from_slice(&f32::NAN.to_le_bytes());
        refuses(&content, Place::Byte(96), "expected finite coordinates");
        content[80..84].fill(255);
        refuses(
            &content,
            Place::Byte(80),
            "4294967295 facets has 214748364834 bytes",
        );
        refuses(&[0; 84], Place::Byte(84), "0 points and no polygon");
    }

    #[test]
    fn wrong_texts_are_refused_at_their_line() {
        let line = |number: usize, text: &str| {
            let mut lines: Vec<&str> = TEXT.lines().collect();
            lines[number - 1] = text;
            lines.join("\n").into_bytes()
        };
        refuses(
            &line(4, "vertex 0 0"),
            Place::Line(4),
            "2 numbers; expected three",
        );
        refuses(
            &line(4, "vertex 0 0 nan"),
            Place::Line(4),
            "`nan` is not finite",
        );
        refuses(
            &line(5, "corner 1 0 0"),
            Place::Line(5),
            "`corner`; expected `vertex x y z`",
        );
        refuses(
            &line(7, "vertex 1 1 1"),
            Place::Line(7),
            "expected `endloop` after three",
        );
        refuses(
            &line(9, ""),
            Place::Line(10),
            "`SOLID`; expected `facet` or `endsolid`",
        );
        refuses(
            b"solid\n\n",
            Place::Line(2),
            "the file ends; expected `facet` or `endsolid`",
        );
        refuses(
            b"solid\nendsolid\n",
            Place::Line(2),
            "0 points and no polygon",
        );
        refuses(
            b"solid\nendsolid\nx",
            Place::Line(3),
            "`x`; expected `solid`",
        );
    }
}
