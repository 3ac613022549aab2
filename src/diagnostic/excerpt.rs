//! The few lines of a text that a diagnostic shows.
//!
//! A report needs the lines under its labels and nothing else, and of a line of ten megabytes only
//! what is near a label. An [`Excerpt`] is that part of the text, with places translated into it,
//! so that what a report costs depends on what it shows.

use super::Span;

/// Lines up to this many characters are shown whole.
const LONGEST_LINE: usize = 200;

/// How many characters are shown on both sides of a label's ends in a longer line.
const AROUND: usize = 60;

/// Up to this many lines between two labelled ones are shown too; of more, none.
const LINES_BETWEEN: usize = 4;

/// Line numbers are counted from the excerpt's own first line beyond this many skipped lines.
const LINES_COUNTED: usize = 10_000;

/// A part of a text.
pub(super) struct Excerpt {
    /// The characters shown, on as many lines as they had; left-out lines are empty.
    pub(super) text: String,
    /// What to add to the line numbers in `text`.
    pub(super) line_offset: usize,
    /// Which bytes of the source stand where: ascending and disjoint.
    pieces: Vec<Piece>,
}

/// The bytes `start..end` of the source, shown from the character `character` on.
struct Piece {
    start: usize,
    end: usize,
    character: usize,
}

impl Excerpt {
    /// What is to be shown of `source` for these labels, of which there must be one at least.
    pub(super) fn new(source: &str, spans: &[Span]) -> Excerpt {
        let mut ends: Vec<usize> = spans
            .iter()
            .flat_map(|&span| {
                let (start, end) = clamped(source, span);
                [start, end.max(start + 1) - 1]
            })
            .map(|place| place.min(source.len()))
            .collect();
        ends.sort_unstable();
        let mut lines: Vec<(usize, usize)> = ends
            .iter()
            .map(|&place| line_around(source, place))
            .collect();
        lines.dedup();
        let skipped = lines
            .first()
            .map_or(0, |&(start, _)| line_ends(&source[..start]));
        let line_offset = skipped - skipped.min(LINES_COUNTED);
        let mut excerpt = Excerpt {
            text: "\n".repeat(skipped - line_offset),
            line_offset,
            pieces: Vec::new(),
        };
        let mut characters = excerpt.text.len();
        let mut shown_to = None;
        for (start, end) in lines {
            if let Some(last) = shown_to {
                excerpt.push_between(source, last, start, &mut characters);
            }
            excerpt.push_line(source, (start, end), &ends, &mut characters);
            shown_to = Some(end);
        }
        excerpt
    }

    /// Where a byte of the source stands in the excerpt, in characters.
    pub(super) fn character(&self, source: &str, byte: usize) -> usize {
        let index = self.pieces.partition_point(|piece| piece.start <= byte);
        let Some(piece) = index.checked_sub(1).map(|index| &self.pieces[index]) else {
            return self.pieces.first().map_or(0, |piece| piece.character);
        };
        let byte = byte.min(piece.end);
        piece.character + source[piece.start..byte].chars().count()
    }

    /// The lines between two shown ones: whole if they are few and short.
    fn push_between(&mut self, source: &str, from: usize, to: usize, characters: &mut usize) {
        let between = &source[from..to];
        let lines = line_ends(between);
        let few = lines <= LINES_BETWEEN + 1 && between.len() <= LINES_BETWEEN * LONGEST_LINE;
        if few {
            let clean: String = between.chars().map(printable).collect();
            *characters += clean.chars().count();
            self.text += &clean;
        } else {
            *characters += lines;
            self.text.extend(std::iter::repeat_n('\n', lines));
        }
    }

    fn push_line(
        &mut self,
        source: &str,
        (start, end): (usize, usize),
        ends: &[usize],
        characters: &mut usize,
    ) {
        let line = &source[start..end];
        let short = line.len() <= LONGEST_LINE || line.chars().count() <= LONGEST_LINE;
        let windows = if short {
            vec![(start, end)]
        } else {
            windows(source, (start, end), ends)
        };
        let mut shown_to = start;
        for (from, to) in windows {
            if from > shown_to {
                self.push_text("…", characters);
            }
            self.pieces.push(Piece {
                start: from,
                end: to,
                character: *characters,
            });
            self.push_text(&source[from..to], characters);
            shown_to = to;
        }
        if shown_to < end {
            self.push_text("…", characters);
        }
    }

    fn push_text(&mut self, text: &str, characters: &mut usize) {
        for character in text.chars() {
            self.text.push(printable(character));
            *characters += 1;
        }
    }
}

/// A span's bytes, moved down to the borders of characters and into the text.
pub(super) fn clamped(source: &str, span: Span) -> (usize, usize) {
    let start = boundary(source, span.start as usize);
    let end = boundary(source, span.end as usize);
    (start, end.max(start))
}

fn boundary(source: &str, byte: usize) -> usize {
    let mut byte = byte.min(source.len());
    while !source.is_char_boundary(byte) {
        byte -= 1;
    }
    byte
}

/// The line around a byte, without its line end.
fn line_around(source: &str, byte: usize) -> (usize, usize) {
    let byte = boundary(source, byte);
    let start = source[..byte].rfind('\n').map_or(0, |at| at + 1);
    let end = source[byte..]
        .find('\n')
        .map_or(source.len(), |at| byte + at);
    (start, end)
}

fn line_ends(text: &str) -> usize {
    text.bytes().filter(|&byte| byte == b'\n').count()
}

/// What is shown of a long line: some characters around each label's ends.
fn windows(source: &str, (start, end): (usize, usize), ends: &[usize]) -> Vec<(usize, usize)> {
    let mut windows: Vec<(usize, usize)> = Vec::new();
    for &place in ends.iter().filter(|&&place| start <= place && place <= end) {
        let place = boundary(source, place);
        let from = source[start..place]
            .char_indices()
            .rev()
            .nth(AROUND - 1)
            .map_or(start, |(at, _)| start + at);
        let to = source[place..end]
            .char_indices()
            .nth(AROUND + 1)
            .map_or(end, |(at, _)| place + at);
        match windows.last_mut() {
            Some(last) if from <= last.1 => last.1 = last.1.max(to),
            _ => windows.push((from, to)),
        }
    }
    windows
}

/// A character that moves the cursor or begins another line is shown as a space, so that a text
/// can neither confuse the columns nor send commands to a terminal.
fn printable(character: char) -> char {
    match character {
        '\n' | '\t' => character,
        '\u{2028}' | '\u{2029}' | '\u{200E}' | '\u{200F}' => ' ',
        '\u{202A}'..='\u{202E}' | '\u{2066}'..='\u{2069}' | '\u{E000}' => ' ',
        _ if character.is_control() => ' ',
        _ => character,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::SourceId;

    fn excerpt(source: &str, spans: &[(usize, usize)]) -> Excerpt {
        let spans: Vec<Span> = spans
            .iter()
            .map(|&(start, end)| Span::new(SourceId(0), start, end))
            .collect();
        Excerpt::new(source, &spans)
    }

    #[test]
    fn only_labelled_lines_are_shown_and_all_are_counted() {
        let source = "one\ntwo\nthree\nfour\n";
        let excerpt = excerpt(source, &[(8, 13)]);
        assert_eq!(excerpt.text, "\n\nthree");
        assert_eq!(excerpt.character(source, 8), 2);
        assert_eq!(excerpt.character(source, 13), 7);
    }

    #[test]
    fn few_lines_between_labels_are_shown_and_many_are_not() {
        let near = excerpt("a\nb\nc", &[(0, 1), (4, 5)]);
        assert_eq!(near.text, "a\nb\nc");
        let source = format!("a\n{}c", "b\n".repeat(9));
        let far = excerpt(&source, &[(0, 1), (20, 21)]);
        assert_eq!(far.text, format!("a{}c", "\n".repeat(10)));
        assert_eq!(far.character(&source, 20), 11);
    }

    #[test]
    fn a_long_line_is_shown_around_its_labels() {
        let source = "x".repeat(5_000) + "ö" + &"y".repeat(5_000_000);
        let excerpt = excerpt(&source, &[(5_000, 5_002)]);
        assert_eq!(
            excerpt.text,
            format!("…{}ö{}…", "x".repeat(60), "y".repeat(60))
        );
        assert_eq!(excerpt.character(&source, 5_000), 61);
        assert_eq!(excerpt.character(&source, 5_002), 62);
    }

    #[test]
    fn far_labels_in_a_long_line_get_a_window_each() {
        let source = "x".repeat(1_000);
        let excerpt = excerpt(&source, &[(100, 101), (900, 901)]);
        let window = "x".repeat(121);
        assert_eq!(excerpt.text, format!("…{window}…{window}…"));
        assert_eq!(excerpt.character(&source, 900), 1 + 121 + 1 + 60);
    }

    #[test]
    fn places_outside_the_text_or_inside_a_character_are_moved() {
        let excerpt = excerpt("aö", &[(2, 99)]);
        assert_eq!(excerpt.text, "aö");
        assert_eq!(clamped("aö", Span::new(SourceId(0), 2, 99)), (1, 3));
    }

    #[test]
    fn control_characters_are_not_shown() {
        assert_eq!(excerpt("a\u{1b}[31m\r", &[(0, 1)]).text, "a [31m ");
    }

    #[test]
    fn deep_in_a_long_text_lines_are_counted_from_an_offset() {
        let source = "\n".repeat(50_000) + "x";
        let excerpt = excerpt(&source, &[(50_000, 50_001)]);
        assert_eq!(excerpt.line_offset, 40_000);
        assert_eq!(excerpt.text.len(), 10_001);
    }
}
