//! The header of a PLY file: its encoding and its elements with their properties.

use super::super::reading::{Lines, Wrong, counted, quoted_bytes, split, whole};

/// How the values after the header are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// A type of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

/// The names of the types: those of the format's paper and those that many programs write.
const KINDS: &[(&[u8], Kind)] = &[
    (b"char", Kind::I8),
    (b"uchar", Kind::U8),
    (b"short", Kind::I16),
    (b"ushort", Kind::U16),
    (b"int", Kind::I32),
    (b"uint", Kind::U32),
    (b"float", Kind::F32),
    (b"double", Kind::F64),
    (b"int8", Kind::I8),
    (b"uint8", Kind::U8),
    (b"int16", Kind::I16),
    (b"uint16", Kind::U16),
    (b"int32", Kind::I32),
    (b"uint32", Kind::U32),
    (b"float32", Kind::F32),
    (b"float64", Kind::F64),
];

impl Kind {
    /// Bytes of a number of it.
    pub(super) fn size(self) -> usize {
        match self {
            Kind::I8 | Kind::U8 => 1,
            Kind::I16 | Kind::U16 => 2,
            Kind::I32 | Kind::U32 | Kind::F32 => 4,
            Kind::F64 => 8,
        }
    }

    /// The least and the largest value, if it is a type of whole numbers.
    pub(super) fn range(self) -> Option<(f64, f64)> {
        Some(match self {
            Kind::I8 => (i8::MIN.into(), i8::MAX.into()),
            Kind::U8 => (0.0, u8::MAX.into()),
            Kind::I16 => (i16::MIN.into(), i16::MAX.into()),
            Kind::U16 => (0.0, u16::MAX.into()),
            Kind::I32 => (i32::MIN.into(), i32::MAX.into()),
            Kind::U32 => (0.0, u32::MAX.into()),
            Kind::F32 | Kind::F64 => return None,
        })
    }
}

/// A property of an element: a number, or a list of numbers with their count before them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Property<'a> {
    pub(super) name: &'a [u8],
    pub(super) kind: Kind,
    /// The type of the count.
    pub(super) list: Option<Kind>,
}

/// So many things of a kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Element<'a> {
    pub(super) name: &'a [u8],
    pub(super) count: u64,
    pub(super) properties: Vec<Property<'a>>,
}

impl Element<'_> {
    /// The bytes that one of them takes at least: in a text a digit and what separates it.
    pub(super) fn least_size(&self, encoding: Encoding) -> u64 {
        let size = |property: &Property| match encoding {
            Encoding::Text => 2,
            _ => property.list.unwrap_or(property.kind).size() as u64,
        };
        self.properties.iter().map(size).sum()
    }
}

/// What a header says.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Header<'a> {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element<'a>>,
}

/// Reads the header; the lines go on behind it.
pub(super) fn read_header<'a>(lines: &mut Lines<'a>) -> Result<Header<'a>, Wrong> {
    if lines.next_line().map(<[u8]>::trim_ascii_end) != Some(b"ply") {
        return Err(lines.wrong("expected `ply`, with which every PLY file begins"));
    }
    let mut encoding = None;
    let mut elements = Vec::new();
    while let Some(line) = lines.next_line() {
        let words: Vec<&[u8]> = split(line).collect();
        match words.as_slice() {
            [b"comment" | b"obj_info", ..] | [] => {}
            [b"format", name, b"1.0"] => {
                encoding = Some(match *name {
                    b"ascii" => Encoding::Text,
                    b"binary_little_endian" => Encoding::LittleEndian,
                    b"binary_big_endian" => Encoding::BigEndian,
                    _ => {
                        let known = "`ascii`, `binary_little_endian` or `binary_big_endian`";
                        let name = quoted_bytes(name);
                        return Err(lines.wrong(format!("the format {name}; expected {known}")));
                    }
                });
            }
            [b"element", name, count] => elements.push(Element {
                name,
                count: whole(count).map_err(|message| lines.wrong(message))?,
                properties: Vec::new(),
            }),
            [b"property", words @ ..] => {
                let property = property(words).map_err(|message| lines.wrong(message))?;
                let Some(element) = elements.last_mut() else {
                    let message = "a property of nothing; expected an `element` above it";
                    return Err(lines.wrong(message));
                };
                element.properties.push(property);
            }
            [b"end_header"] => {
                let Some(encoding) = encoding else {
                    let message = "the header ends; expected a line such as `format ascii 1.0`";
                    return Err(lines.wrong(message));
                };
                return check_counts(Header { encoding, elements }, lines);
            }
            _ => {
                let expected = "`format … 1.0`, `element`, `property`, `comment` or `end_header`";
                let line = quoted_bytes(line);
                return Err(lines.wrong(format!("{line} in the header; expected {expected}")));
            }
        }
    }
    Err(lines.wrong("the file ends within the header; expected `end_header`"))
}

/// `type name`, or `list type-of-count type name`.
fn property<'a>(words: &[&'a [u8]]) -> Result<Property<'a>, String> {
    match words {
        [b"list", count, kind, name] => {
            let list = self::kind(count)?;
            if list.range().is_none() {
                let count = quoted_bytes(count);
                return Err(format!("a list counted by {count}; expected a whole type"));
            }
            Ok(Property {
                name,
                kind: self::kind(kind)?,
                list: Some(list),
            })
        }
        [kind, name] => Ok(Property {
            name,
            kind: self::kind(kind)?,
            list: None,
        }),
        _ => Err(format!(
            "{} after `property`; expected `type name` or `list type type name`",
            counted(words.len(), "word")
        )),
    }
}

fn kind(word: &[u8]) -> Result<Kind, String> {
    let found = KINDS.iter().find(|(name, _)| *name == word);
    found.map(|(_, kind)| *kind).ok_or_else(|| {
        let names = KINDS[..8].iter().map(|(name, _)| quoted_bytes(name));
        let names: Vec<String> = names.collect();
        let word = quoted_bytes(word);
        format!(
            "there is no type {word}; expected one of {}",
            names.join(", ")
        )
    })
}

/// Refuses counts for which the rest of the file is too short, before anything is made of them.
fn check_counts<'a>(header: Header<'a>, lines: &Lines<'a>) -> Result<Header<'a>, Wrong> {
    // A text may end without a line break.
    let there = lines.rest().len() as u64 + 1;
    for element in &header.elements {
        let least = element
            .least_size(header.encoding)
            .saturating_mul(element.count);
        if least > there {
            return Err(lines.wrong(format!(
                "{} elements {} take at least {least} bytes, but after the header there are {}",
                element.count,
                quoted_bytes(element.name),
                there - 1
            )));
        }
    }
    Ok(header)
}
