//! Reading PLY: as text and binary in both byte orders, with numbers of any type. Of the elements
//! `vertex` and `face` are taken, of these `x y z`, `nx ny nz` and `vertex_indices` (or
//! `vertex_index`); everything else is passed over.

use glam::DVec3;

use super::super::assembly::Assembly;
use super::super::reading::{Bytes, Lines, Place, Wrong, counted, number, quoted_bytes};
use super::header::{Element, Encoding, Header, Kind, read_header};
use crate::geometry::Mesh;

/// The mesh of a text or a binary file. Costs time and memory in proportion to the content.
pub(in crate::file) fn read_mesh(content: &[u8]) -> Result<Mesh, Wrong> {
    let mut lines = Lines::new(content);
    let Header { encoding, elements } = read_header(&mut lines)?;
    let named = |name: &'static [u8]| elements.iter().filter(move |element| element.name == name);
    let counts: Vec<u64> = named(b"vertex").map(|element| element.count).collect();
    // There are fewer than bytes in the file.
    let vertices = match counts.as_slice() {
        [count] => *count as usize,
        _ => return Err(lines.wrong("expected one `element vertex` in the header")),
    };
    if named(b"face").next().is_none() {
        let strips = named(b"tristrips").next().is_some();
        let instead = if strips {
            "triangle strips"
        } else {
            "no faces"
        };
        let expected = "expected polygons, an `element face` in the header";
        return Err(lines.wrong(format!("{instead}; {expected}")));
    }
    let mut source = match encoding {
        Encoding::Text => Source::Text {
            lines,
            words: Vec::new(),
            next: 0,
        },
        _ => Source::Binary {
            bytes: Bytes::new(content, content.len() - lines.rest().len()),
            big_endian: encoding == Encoding::BigEndian,
        },
    };
    let mut mesh = Assembly::default();
    for element in &elements {
        match element.name {
            b"vertex" => read_vertices(&mut source, element, &mut mesh)?,
            b"face" => read_faces(&mut source, element, vertices, &mut mesh)?,
            _ => read_rows(&mut source, element, None, |_, _| Ok(()))?,
        }
    }
    source.end()?;
    mesh.finish().map_err(|message| source.wrong(message))
}

fn read_vertices(source: &mut Source, element: &Element, mesh: &mut Assembly) -> Result<(), Wrong> {
    let place = |name: &[u8]| {
        let mut properties = element.properties.iter();
        properties.position(|property| property.name == name && property.list.is_none())
    };
    let places = |names: [&[u8]; 3]| {
        let [x, y, z] = names.map(place);
        Some([x?, y?, z?])
    };
    let Some(position) = places([b"x", b"y", b"z"]) else {
        let expected = "expected numbers `x`, `y` and `z` among their properties";
        return Err(source.wrong(format!("vertices without positions; {expected}")));
    };
    let normal = places([b"nx", b"ny", b"nz"]);
    let pick = |row: &[f64], places: [usize; 3]| DVec3::from_array(places.map(|place| row[place]));
    read_rows(source, element, None, |row, _| {
        mesh.vertex(pick(row, position))?;
        normal.map_or(Ok(()), |normal| mesh.normal(pick(row, normal)))
    })
}

fn read_faces(
    source: &mut Source,
    element: &Element,
    vertices: usize,
    mesh: &mut Assembly,
) -> Result<(), Wrong> {
    let corners = element.properties.iter().position(|property| {
        let is_whole = property.kind.range().is_some();
        let names: [&[u8]; 2] = [b"vertex_indices", b"vertex_index"];
        names.contains(&property.name) && property.list.is_some() && is_whole
    });
    if corners.is_none() {
        let expected = "expected a list `vertex_indices` of a whole type among their properties";
        return Err(source.wrong(format!("faces without corners; {expected}")));
    }
    let mut indices = Vec::new();
    read_rows(source, element, corners, |_, corners| {
        indices.clear();
        for &corner in corners {
            if corner < 0.0 {
                return Err(format!("a corner at vertex {corner}; expected 0 or more"));
            }
            // A whole number of at most 32 bits.
            indices.push(corner as u32);
        }
        mesh.polygon(&indices, vertices)
    })
}

/// Reads all of an element and hands over, of each, the numbers of its properties (0 for lists) and
/// the list that is wanted.
fn read_rows(
    source: &mut Source,
    element: &Element,
    wanted: Option<usize>,
    mut take: impl FnMut(&[f64], &[f64]) -> Result<(), String>,
) -> Result<(), Wrong> {
    // Without properties there is nothing to read, however many there are said to be.
    if element.properties.is_empty() {
        return Ok(());
    }
    let mut row = vec![0.0; element.properties.len()];
    let mut list = Vec::new();
    for _ in 0..element.count {
        let place = source.begin(element)?;
        for (index, property) in element.properties.iter().enumerate() {
            let Some(count) = property.list else {
                row[index] = source.value(property.kind)?;
                continue;
            };
            let count = source.count(count, property.kind)?;
            match wanted == Some(index) {
                true => list.clear(),
                false => {
                    source.skip(property.kind, count);
                    continue;
                }
            }
            for _ in 0..count {
                list.push(source.value(property.kind)?);
            }
        }
        source.finish_row()?;
        take(&row, &list).map_err(|message| Wrong { place, message })?;
    }
    Ok(())
}

/// Where the values come from.
enum Source<'a> {
    /// One element a line.
    Text {
        lines: Lines<'a>,
        words: Vec<&'a [u8]>,
        /// The word that comes next.
        next: usize,
    },
    Binary {
        bytes: Bytes<'a>,
        big_endian: bool,
    },
}

impl Source<'_> {
    /// Begins with the next of an element, and says where that is.
    fn begin(&mut self, element: &Element) -> Result<Place, Wrong> {
        match self {
            Source::Text { lines, words, next } => {
                *next = 0;
                if lines.next_words(words, false) {
                    return Ok(lines.place());
                }
                let (name, count) = (quoted_bytes(element.name), element.count);
                let message = format!("the file ends; expected {count} lines of elements {name}");
                Err(lines.wrong(message))
            }
            Source::Binary { bytes, .. } => Ok(bytes.place()),
        }
    }

    /// The next number.
    fn value(&mut self, kind: Kind) -> Result<f64, Wrong> {
        match self {
            Source::Text { lines, words, next } => {
                let Some(word) = words.get(*next) else {
                    let values = counted(words.len(), "value");
                    return Err(lines.wrong(format!("{values} in the line; expected more")));
                };
                *next += 1;
                let value = number(word).map_err(|message| lines.wrong(message))?;
                let fits = kind.range().is_none_or(|(least, most)| {
                    least <= value && value <= most && value.fract() == 0.0
                });
                match fits {
                    true => Ok(value),
                    false => Err(lines.wrong(format!(
                        "{} does not fit the type that the header says",
                        quoted_bytes(word)
                    ))),
                }
            }
            Source::Binary { bytes, big_endian } => {
                let what = "an element";
                macro_rules! number {
                    ($type:ty) => {{
                        let bytes = bytes.take(what)?;
                        f64::from(match big_endian {
                            true => <$type>::from_be_bytes(bytes),
                            false => <$type>::from_le_bytes(bytes),
                        })
                    }};
                }
                Ok(match kind {
                    Kind::I8 => number!(i8),
                    Kind::U8 => number!(u8),
                    Kind::I16 => number!(i16),
                    Kind::U16 => number!(u16),
                    Kind::I32 => number!(i32),
                    Kind::U32 => number!(u32),
                    Kind::F32 => number!(f32),
                    Kind::F64 => number!(f64),
                })
            }
        }
    }

    /// How many numbers a list has. There are so many before the end of the line or file.
    fn count(&mut self, count: Kind, kind: Kind) -> Result<usize, Wrong> {
        let count = self.value(count)?;
        if count < 0.0 {
            return Err(self.wrong(format!("a list of {count} numbers; expected 0 or more")));
        }
        // A whole number of at most 32 bits.
        let count = count as usize;
        let room = match self {
            Source::Text { words, next, .. } => words.len() - *next,
            Source::Binary { bytes, .. } => bytes.left() / kind.size(),
        };
        match count <= room {
            true => Ok(count),
            false => Err(self.wrong(format!(
                "a list of {}, but there is room for {room} only",
                counted(count, "number")
            ))),
        }
    }

    /// Leaves out so many numbers, for which there is room.
    fn skip(&mut self, kind: Kind, count: usize) {
        match self {
            Source::Text { next, .. } => *next += count,
            Source::Binary { bytes, .. } => bytes.skip(count * kind.size()),
        }
    }

    /// Ends a row: a line has no more words.
    fn finish_row(&self) -> Result<(), Wrong> {
        match self {
            Source::Text { lines, words, next } if *next < words.len() => {
                let (found, expected) = (counted(words.len(), "value"), next);
                Err(lines.wrong(format!("{found} in the line; expected {expected}")))
            }
            _ => Ok(()),
        }
    }

    /// Ends the file: nothing but white space follows.
    fn end(&mut self) -> Result<(), Wrong> {
        let message = "more after the last element; expected the end of the file";
        match self {
            Source::Text { lines, words, .. } => match lines.next_words(words, false) {
                true => Err(lines.wrong(message)),
                false => Ok(()),
            },
            Source::Binary { bytes, .. } => match bytes.rest().trim_ascii().is_empty() {
                true => Ok(()),
                false => Err(bytes.wrong(message)),
            },
        }
    }

    /// An error at the present place.
    fn wrong(&self, message: impl Into<String>) -> Wrong {
        match self {
            Source::Text { lines, .. } => lines.wrong(message),
            Source::Binary { bytes, .. } => bytes.wrong(message),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::test_values::{bytes, mesh, mesh_without_normals};
    use super::super::write_mesh;
    use super::*;

    #[track_caller]
    fn refuses(content: &[u8], place: Place, words: &str) {
        let wrong = read_mesh(content).unwrap_err();
        assert_eq!(wrong.place, place, "{}", wrong.message);
        assert!(wrong.message.contains(words), "{}", wrong.message);
    }

    /// A square with something in the middle of everything that is of no interest.
    const TEXT: &str = "ply\r\nformat ascii 1.0\ncomment a\nobj_info b\nelement vertex 4\n\
                        property float x\nproperty int y\nproperty list uchar short tags\n\
                        property uchar red\nproperty double z\nelement camera 1\n\
                        property list int float view\nelement nothing 4000000000\nelement face 2\n\
                        property list uint8 int32 vertex_index\nproperty float quality\n\
                        end_header\n0 0 0 255 0\n1.5 0 2 -7 8 0 0\n1.5 1 1 0 0 1e-1\n0 1 0 9 0\n\
                        2 1.5 2.5\n\n4 0 1 2 3 0.5\n3 0 2 1 0\n";

    /// The same without the header, in binary.
    fn binary(big_endian: bool) -> Vec<u8> {
        let name = if big_endian {
            "binary_big_endian"
        } else {
            "binary_little_endian"
        };
        let end = TEXT.find("0 0 0 255").unwrap();
        let mut content = TEXT[..end].replace("ascii", name).into_bytes();
        let mut put = |bytes: &[u8]| match big_endian {
            true => content.extend(bytes.iter().rev()),
            false => content.extend(bytes),
        };
        let vertices: [(f32, i32, &[i16], u8, f64); 4] = [
            (0.0, 0, &[], 255, 0.0),
            (1.5, 0, &[-7, 8], 0, 0.0),
            (1.5, 1, &[0], 0, 0.1),
            (0.0, 1, &[], 9, 0.0),
        ];
        for (x, y, tags, red, z) in vertices {
            put(&x.to_le_bytes());
            put(&y.to_le_bytes());
            put(&[tags.len() as u8]);
            tags.iter().for_each(|tag| put(&tag.to_le_bytes()));
            put(&[red]);
            put(&z.to_le_bytes());
        }
        put(&2i32.to_le_bytes());
        [1.5f32, 2.5]
            .iter()
            .for_each(|angle| put(&angle.to_le_bytes()));
        for face in [&[0i32, 1, 2, 3][..], &[0, 2, 1]] {
            put(&[face.len() as u8]);
            face.iter().for_each(|corner| put(&corner.to_le_bytes()));
            put(&0.5f32.to_le_bytes());
        }
        content
    }

    #[test]
    fn what_is_written_reads_back_exactly() {
        for mesh in [mesh(), mesh_without_normals()] {
            assert_eq!(read_mesh(&bytes(write_mesh, &mesh)).unwrap(), mesh);
        }
    }

    #[test]
    fn all_encodings_and_types_say_the_same() {
        let mesh = read_mesh(TEXT.as_bytes()).unwrap();
        let expected = [[0.0; 3], [1.5, 0.0, 0.0], [1.5, 1.0, 0.1], [0.0, 1.0, 0.0]];
        assert_eq!(mesh.positions, expected.map(DVec3::from_array));
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 2, 1]]);
        assert!(mesh.normals.is_empty());
        for big_endian in [false, true] {
            assert_eq!(read_mesh(&binary(big_endian)).unwrap(), mesh);
        }
    }

    #[test]
    fn counts_that_lie_are_refused_before_anything_is_made_of_them() {
        let lying = |from: &str, to: &str| TEXT.replace(from, to).into_bytes();
        refuses(
            &lying("vertex 4", "vertex 4000000000"),
            Place::Line(17),
            "at least 40000000000",
        );
        let most = "face 18446744073709551615";
        refuses(&lying("face 2", most), Place::Line(17), "take at least");
        refuses(
            &lying("face 2", "face 3"),
            Place::Line(25),
            "the file ends; expected 3 lines",
        );
        refuses(
            &lying("face 2", "face 1"),
            Place::Line(25),
            "more after the last element",
        );
        refuses(
            &lying("face 2", "face -1"),
            Place::Line(14),
            "is not an index or count",
        );
        let good = binary(false);
        // The count of the list in the element `camera`, behind four vertices.
        let at = good.len() - 3 * 4 - 2 - 7 * 4 - 2 * 4;
        let mut content = good.clone();
        content[at..at + 4].copy_from_slice(&i32::MAX.to_le_bytes());
        let place = Place::Byte(at as u64 + 4);
        refuses(
            &content,
            place,
            "2147483647 numbers, but there is room for 11 only",
        );
        content[at..at + 4].copy_from_slice(&(-1i32).to_le_bytes());
        refuses(&content, place, "a list of -1 numbers");
        let end = good.len() as u64;
        refuses(
            &good[..good.len() - 2],
            Place::Byte(end - 4),
            "2 bytes left, expected 4",
        );
        refuses(
            &[&good[..], b"x"].concat(),
            Place::Byte(end),
            "more after the last element",
        );
        assert!(read_mesh(&[&good[..], b"\n"].concat()).is_ok());
    }

    #[test]
    fn wrong_values_are_named() {
        let with = |from: &str, to: &str| TEXT.replacen(from, to, 1).into_bytes();
        refuses(
            &with("4 0 1 2 3", "4 0 1 2 4"),
            Place::Line(24),
            "at vertex 4, counted from 0",
        );
        refuses(
            &with("4 0 1 2 3", "4 0 1 2 -3"),
            Place::Line(24),
            "at vertex -3",
        );
        refuses(
            &with("4 0 1 2 3 ", "2 0 1 "),
            Place::Line(24),
            "of 2 corners",
        );
        refuses(
            &with("4 0 1 2 3", "9 0 1 2 3"),
            Place::Line(24),
            "9 numbers, but there is room",
        );
        refuses(
            &with("4 0 1 2 3", "3 0 1 2 3"),
            Place::Line(24),
            "6 values in the line",
        );
        refuses(
            &with("0 0 0 255 0", "0 0 0 256 0"),
            Place::Line(18),
            "`256` does not fit",
        );
        refuses(
            &with("0 0 0 255 0", "0 .5 0 255 0"),
            Place::Line(18),
            "`.5` does not fit",
        );
        refuses(
            &with("0 0 0 255 0", "0 0 0 255"),
            Place::Line(18),
            "4 values in the line",
        );
        refuses(
            &with("0 0 0 255 0", "0 0 0 255 inf"),
            Place::Line(18),
            "`inf` is not finite",
        );
        let mut content = binary(true);
        let start = content
            .windows(10)
            .position(|window| window == b"end_header")
            .unwrap()
            + 11;
        content[start..start + 4].copy_from_slice(&f32::NAN.to_be_bytes());
        refuses(
            &content,
            Place::Byte(start as u64),
            "expected finite coordinates",
        );
    }

    #[test]
    fn wrong_headers_are_named() {
        let with = |from: &str, to: &str| TEXT.replacen(from, to, 1).into_bytes();
        refuses(b"", Place::Line(1), "expected `ply`");
        refuses(b"plyx\n", Place::Line(1), "expected `ply`");
        refuses(
            b"ply\nformat ascii 1.0\n",
            Place::Line(2),
            "expected `end_header`",
        );
        refuses(
            b"ply\nend_header\n",
            Place::Line(2),
            "such as `format ascii 1.0`",
        );
        refuses(
            &with("ascii", "text"),
            Place::Line(2),
            "the format `text`; expected `ascii`",
        );
        refuses(
            &with("float x", "half x"),
            Place::Line(6),
            "no type `half`; expected one of",
        );
        refuses(
            &with("float x", "float w"),
            Place::Line(17),
            "vertices without positions",
        );
        refuses(
            &with("uchar short", "float short"),
            Place::Line(8),
            "a list counted by `float`",
        );
        refuses(
            &with("vertex_index", "corners"),
            Place::Line(22),
            "faces without corners",
        );
        refuses(
            &with("int32 vertex", "float vertex"),
            Place::Line(22),
            "of a whole type",
        );
        refuses(
            &with("comment a", "property float x"),
            Place::Line(3),
            "a property of nothing",
        );
        refuses(
            &with("comment a", "remark"),
            Place::Line(3),
            "`remark` in the header",
        );
        refuses(
            &with("camera", "vertex"),
            Place::Line(17),
            "expected one `element vertex`",
        );
        refuses(
            &with("element face", "element tristrips"),
            Place::Line(17),
            "triangle strips;",
        );
        refuses(
            &with("element face", "element edge"),
            Place::Line(17),
            "no faces;",
        );
    }
}
