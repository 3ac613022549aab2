//! Places as the protocol counts them: lines, and units of the encoding that was agreed on.

use std::ops::Range;

use lsp_types::{Position, PositionEncodingKind, Range as LspRange};

/// In what the columns of a line are counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(super) enum Encoding {
    /// Bytes.
    Utf8,
    /// What everyone understands.
    #[default]
    Utf16,
    /// Characters.
    Utf32,
}

impl Encoding {
    /// The first of the encodings that a client offers and that is known here.
    pub(super) fn agreed(offered: Option<&[PositionEncodingKind]>) -> Encoding {
        let known = offered.unwrap_or_default().iter().find_map(|kind| {
            let kinds = [Encoding::Utf8, Encoding::Utf16, Encoding::Utf32];
            kinds.into_iter().find(|known| known.kind() == *kind)
        });
        known.unwrap_or_default()
    }

    /// Its name in the protocol.
    pub(super) fn kind(self) -> PositionEncodingKind {
        match self {
            Encoding::Utf8 => PositionEncodingKind::UTF8,
            Encoding::Utf16 => PositionEncodingKind::UTF16,
            Encoding::Utf32 => PositionEncodingKind::UTF32,
        }
    }

    fn units(self, character: char) -> usize {
        match self {
            Encoding::Utf8 => character.len_utf8(),
            Encoding::Utf16 => character.len_utf16(),
            Encoding::Utf32 => 1,
        }
    }

    /// How long a text is.
    pub(super) fn length(self, text: &str) -> usize {
        match self {
            Encoding::Utf8 => text.len(),
            _ => text.chars().map(|character| self.units(character)).sum(),
        }
    }
}

/// Where the lines of a text begin.
#[derive(Clone, Debug)]
pub(super) struct Lines {
    starts: Vec<usize>,
    encoding: Encoding,
}

impl Lines {
    /// Finds the lines of a text; they end with `\n`, `\r\n` or `\r`.
    pub(super) fn new(text: &str, encoding: Encoding) -> Lines {
        let starts = std::iter::once(0).chain(starts(text, 0..text.len()));
        let starts = starts.collect();
        Lines { starts, encoding }
    }

    /// Puts something else in the place of some bytes of the text. Only the new bytes are looked
    /// through; what is behind them is moved.
    pub(super) fn replace(&mut self, text: &mut String, bytes: Range<usize>, new: &str) {
        let Range { start, end } = bytes;
        text.replace_range(bytes, new);
        // The last byte before may be the first half of an end of a line.
        let before = start.saturating_sub(1);
        let first = self.starts.partition_point(|&line| line <= before);
        let after = self.starts.partition_point(|&line| line <= end);
        for line in &mut self.starts[after..] {
            *line = *line - end + start + new.len();
        }
        let found = starts(text, before..start + new.len());
        self.starts.splice(first..after, found);
    }

    /// The byte at a position of the text; one behind the end of a line is its end, one behind the
    /// last line the end of the text, one inside of a character its beginning.
    pub(super) fn offset(&self, text: &str, position: Position) -> usize {
        let line = position.line as usize;
        let Some(&start) = self.starts.get(line) else {
            return text.len();
        };
        let end = self.starts.get(line + 1).copied().unwrap_or(text.len());
        let line = text[start..end].trim_end_matches(['\r', '\n']);
        let wanted = position.character as usize;
        let mut units = 0;
        for (place, character) in line.char_indices() {
            units += self.encoding.units(character);
            if units > wanted {
                return start + place;
            }
        }
        start + line.len()
    }

    /// The position of a byte; one behind the end is the end.
    pub(super) fn position(&self, text: &str, offset: usize) -> Position {
        let mut offset = offset.min(text.len());
        while !text.is_char_boundary(offset) {
            offset -= 1;
        }
        let line = self.starts.partition_point(|&start| start <= offset) - 1;
        let before = &text[self.starts[line]..offset];
        Position::new(line as u32, self.encoding.length(before) as u32)
    }

    /// The range of some bytes.
    pub(super) fn range(&self, text: &str, range: &Range<usize>) -> LspRange {
        let start = self.position(text, range.start);
        LspRange::new(start, self.position(text, range.end.max(range.start)))
    }

    /// The bytes of a range; one that ends before it begins is empty.
    pub(super) fn bytes(&self, text: &str, range: LspRange) -> Range<usize> {
        let start = self.offset(text, range.start);
        start..self.offset(text, range.end).max(start)
    }
}

/// The beginnings of lines behind the ends of lines among some bytes.
fn starts(text: &str, among: Range<usize>) -> impl Iterator<Item = usize> {
    let bytes = text.as_bytes();
    let is_end = move |&place: &usize| match bytes.get(place) {
        Some(b'\n') => true,
        Some(b'\r') => bytes.get(place + 1) != Some(&b'\n'),
        _ => false,
    };
    among.filter(is_end).map(|place| place + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_follow_the_edits() {
        let pieces = ["", "a", "\n", "\r", "\r\n", "a\rb", "\n\r"];
        let old = "a\r\nb\n\rc\r\r\n";
        for start in 0..=old.len() {
            for end in start..=old.len() {
                for new in pieces {
                    let mut text = old.to_owned();
                    let mut lines = Lines::new(&text, Encoding::Utf8);
                    lines.replace(&mut text, start..end, new);
                    let expected = Lines::new(&text, Encoding::Utf8).starts;
                    assert_eq!(lines.starts, expected, "{start}..{end} {new:?}");
                }
            }
        }
    }

    #[test]
    fn positions_count_units_of_the_encoding() {
        let text = "aé🙂b\r\n\rc\n";
        let expected = [
            (Encoding::Utf8, [0, 1, 3, 7, 8]),
            (Encoding::Utf16, [0, 1, 2, 4, 5]),
            (Encoding::Utf32, [0, 1, 2, 3, 4]),
        ];
        for (encoding, columns) in expected {
            let lines = Lines::new(text, encoding);
            for (offset, column) in [0, 1, 3, 7, 8].into_iter().zip(columns) {
                let position = Position::new(0, column);
                assert_eq!(lines.position(text, offset), position);
                assert_eq!(lines.offset(text, position), offset);
            }
            assert_eq!(lines.position(text, 10), Position::new(1, 0));
            assert_eq!(lines.position(text, 11), Position::new(2, 0));
            assert_eq!(lines.position(text, 999), Position::new(3, 0));
        }
    }

    #[test]
    fn positions_outside_are_moved_inside() {
        let text = "a🙂b\nc";
        let lines = Lines::new(text, Encoding::Utf16);
        assert_eq!(lines.offset(text, Position::new(0, 2)), 1);
        assert_eq!(lines.offset(text, Position::new(0, 99)), 6);
        assert_eq!(lines.offset(text, Position::new(9, 0)), text.len());
        let far = Position::new(u32::MAX, u32::MAX);
        assert_eq!(lines.offset(text, far), text.len());
        let backwards = LspRange::new(Position::new(1, 0), Position::new(0, 0));
        assert_eq!(lines.bytes(text, backwards), 7..7);
    }
}
