//! What readers have in common: places in a file, what is wrong there, and numbers as text and as
//! bytes.
//!
//! Readers of meshes work on the whole content as bytes. A text is looked at as lines of words, of
//! which only those that matter have to be UTF-8, so that a name or a comment in another encoding
//! does no harm.

use std::fmt;
use std::io;

use glam::DVec3;

/// A place in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A line of a text, from 1.
    Line(u64),
    /// A byte of a binary file, from 0.
    Byte(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Line(number) => write!(formatter, "line {number}"),
            Place::Byte(offset) => write!(formatter, "byte {offset}"),
        }
    }
}

/// What is wrong with a file's content.
#[derive(Debug, PartialEq)]
pub(super) struct Wrong {
    /// Where.
    pub(super) place: Place,
    /// What is wrong there and what was expected.
    pub(super) message: String,
}

/// Why a content is not what it should be.
#[derive(Debug)]
pub(super) enum ReadError {
    /// It could not be read.
    Failed(io::Error),
    /// Something in it is wrong.
    Wrong(Wrong),
    /// There are more lines than are allowed.
    TooLong,
    /// There are more bytes than are allowed.
    TooMuch,
}

impl From<Wrong> for ReadError {
    fn from(wrong: Wrong) -> Self {
        ReadError::Wrong(wrong)
    }
}

/// Characters of the longest word that a message quotes whole.
const LONGEST_QUOTE: usize = 40;

/// A word of the file as a message shows it.
pub(super) fn quoted(word: &str) -> String {
    match word.char_indices().nth(LONGEST_QUOTE) {
        None => format!("`{word}`"),
        Some((end, _)) => format!("`{}…`", &word[..end]),
    }
}

/// The same of bytes that need not be UTF-8.
pub(super) fn quoted_bytes(word: &[u8]) -> String {
    // A character has at most four bytes.
    let start = &word[..word.len().min(4 * LONGEST_QUOTE + 4)];
    quoted(&String::from_utf8_lossy(start))
}

/// A finite number as it is written; the error quotes the word.
pub(super) fn number(word: &[u8]) -> Result<f64, String> {
    let text = std::str::from_utf8(word).ok();
    match text.and_then(|text| text.parse::<f64>().ok()) {
        Some(number) if number.is_finite() => Ok(number),
        Some(_) => Err(format!("{} is not finite", quoted_bytes(word))),
        None => Err(format!("{} is not a number", quoted_bytes(word))),
    }
}

/// A whole number as it is written; the error quotes the word.
pub(super) fn whole<T: std::str::FromStr>(word: &[u8]) -> Result<T, String> {
    let text = std::str::from_utf8(word).ok();
    text.and_then(|text| text.parse().ok())
        .ok_or_else(|| format!("{} is not an index or count", quoted_bytes(word)))
}

/// The first three of the words as a vector of finite numbers.
pub(super) fn vector(words: &[&[u8]]) -> Result<DVec3, String> {
    let [x, y, z, ..] = words else {
        return Err(format!(
            "{}; expected three",
            counted(words.len(), "number")
        ));
    };
    Ok(DVec3::new(number(x)?, number(y)?, number(z)?))
}

/// So many things: `1 corner`, `3 corners`.
pub(super) fn counted(count: usize, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}

/// The lines of a text, as words.
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    number: u64,
}

impl<'a> Lines<'a> {
    pub(super) fn new(content: &'a [u8]) -> Self {
        // Some editors begin a file with a byte-order mark.
        let rest = content.strip_prefix(b"\xef\xbb\xbf").unwrap_or(content);
        Lines { rest, number: 0 }
    }

    /// The next line without its end; `None` after the last.
    pub(super) fn next_line(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|&byte| byte == b'\n');
        let (line, rest) = match end {
            Some(end) => (&self.rest[..end], &self.rest[end + 1..]),
            None => (self.rest, &self.rest[self.rest.len()..]),
        };
        self.rest = rest;
        self.number += 1;
        Some(line.strip_suffix(b"\r").unwrap_or(line))
    }

    /// Puts the words of the next line that has any into the list; false after the last. What
    /// follows a `#` is a comment if there are comments.
    pub(super) fn next_words(&mut self, words: &mut Vec<&'a [u8]>, comments: bool) -> bool {
        loop {
            words.clear();
            let Some(line) = self.next_line() else {
                return false;
            };
            let end = line.iter().position(|&byte| comments && byte == b'#');
            let line = &line[..end.unwrap_or(line.len())];
            words.extend(split(line));
            if !words.is_empty() {
                return true;
            }
        }
    }

    /// The bytes after the lines that were given.
    pub(super) fn rest(&self) -> &'a [u8] {
        self.rest
    }

    /// The line that was given last, or the first.
    pub(super) fn place(&self) -> Place {
        Place::Line(self.number.max(1))
    }

    /// An error in the line that was given last, or in the first.
    pub(super) fn wrong(&self, message: impl Into<String>) -> Wrong {
        Wrong {
            place: self.place(),
            message: message.into(),
        }
    }
}

/// The words of a line.
pub(super) fn split(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
}

/// Numbers as bytes, one after another.
pub(super) struct Bytes<'a> {
    content: &'a [u8],
    offset: usize,
}

impl<'a> Bytes<'a> {
    /// The bytes of a content from an offset on.
    pub(super) fn new(content: &'a [u8], offset: usize) -> Self {
        let offset = offset.min(content.len());
        Bytes { content, offset }
    }

    /// The bytes that are left.
    pub(super) fn rest(&self) -> &'a [u8] {
        &self.content[self.offset..]
    }

    /// How many bytes are left.
    pub(super) fn left(&self) -> usize {
        self.rest().len()
    }

    /// The next bytes; the error says of what there should have been more.
    pub(super) fn take<const N: usize>(&mut self, what: &str) -> Result<[u8; N], Wrong> {
        match self.rest().first_chunk() {
            Some(&bytes) => {
                self.offset += N;
                Ok(bytes)
            }
            None => Err(self.wrong(format!(
                "the file ends within {what}: {} left, expected {N}",
                counted(self.left(), "byte")
            ))),
        }
    }

    /// Leaves bytes out, as far as there are any.
    pub(super) fn skip(&mut self, count: usize) {
        self.offset += count.min(self.left());
    }

    /// Where the next byte is.
    pub(super) fn place(&self) -> Place {
        Place::Byte(self.offset as u64)
    }

    /// An error at the next byte.
    pub(super) fn wrong(&self, message: impl Into<String>) -> Wrong {
        Wrong {
            place: self.place(),
            message: message.into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_counted_whatever_ends_them() {
        let mut lines = Lines::new(b"\xef\xbb\xbfa  b\r\n\n# c\n\td # e\nf");
        let mut words = Vec::new();
        let mut seen = Vec::new();
        while lines.next_words(&mut words, true) {
            seen.push((lines.number, words.concat()));
        }
        let expected: [(u64, &[u8]); 3] = [(1, b"ab"), (4, b"d"), (5, b"f")];
        assert_eq!(seen, expected.map(|(line, words)| (line, words.to_vec())));
        assert_eq!(lines.wrong("x").place.to_string(), "line 5");
        assert!(lines.rest().is_empty() && words.is_empty());
        assert_eq!(Lines::new(b"").wrong("x").place, Place::Line(1));
    }

    #[test]
    fn numbers_are_finite() {
        assert_eq!(number(b"-1e-3"), Ok(-1e-3));
        for (word, message) in [
            (&b"1,5"[..], "`1,5` is not a number"),
            (b"nan", "`nan` is not finite"),
            (b"-inf", "`-inf` is not finite"),
            (b"1e999", "`1e999` is not finite"),
            (b"\xff", "`\u{fffd}` is not a number"),
        ] {
            assert_eq!(number(word).unwrap_err(), message);
        }
        assert_eq!(whole::<u32>(b"7"), Ok(7));
        assert!(whole::<u32>(b"-7").is_err() && whole::<u32>(b"4294967296").is_err());
        assert_eq!(
            vector(&[b"1", b"2"]).unwrap_err(),
            "2 numbers; expected three"
        );
    }

    #[test]
    fn bytes_end_with_an_error_at_their_place() {
        let mut bytes = Bytes::new(b"abcde", 1);
        assert_eq!(bytes.take(""), Ok(*b"bc"));
        let wrong = bytes.take::<4>("a facet").unwrap_err();
        assert_eq!(wrong.place.to_string(), "byte 3");
        assert!(
            wrong
                .message
                .contains("within a facet: 2 bytes left, expected 4")
        );
        bytes.skip(usize::MAX);
        assert_eq!((bytes.left(), Bytes::new(b"a", 9).left()), (0, 0));
    }
}
