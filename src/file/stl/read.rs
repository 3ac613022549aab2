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
