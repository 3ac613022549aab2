//! Source texts and places in them.

use std::sync::Arc;

/// Which source text a span belongs to; an index into [`Sources`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SourceId(pub u32);

/// A half-open range of bytes in one source text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Span {
    /// The text.
    pub source: SourceId,
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

impl Span {
    /// No place at all: labels there are not shown.
    pub const NOWHERE: Span = Span {
        source: SourceId(u32::MAX),
        start: 0,
        end: 0,
    };

    /// Whether this is a place in a text.
    pub fn is_somewhere(self) -> bool {
        self.source != Self::NOWHERE.source
    }

    /// The bytes `start..end` of `source`.
    pub fn new(source: SourceId, start: usize, end: usize) -> Self {
        Span {
            source,
            start: start as u32,
            end: end as u32,
        }
    }

    /// The smallest span that holds both; they must be in one source.
    pub fn to(self, other: Span) -> Span {
        Span {
            source: self.source,
            start: self.start.min(other.start),
            end: self.end.max(other.end),
        }
    }
}

/// One text and the name under which errors speak of it.
#[derive(Clone, Debug)]
pub struct Source {
    /// A path, `<stdin>` or `<command line>`.
    pub name: String,
    /// The whole text, valid UTF-8, at most 4 GiB.
    pub text: Arc<str>,
    /// How many lines of the same input came before it.
    pub lines_before: usize,
}

/// All texts of one session, by [`SourceId`].
#[derive(Clone, Debug, Default)]
pub struct Sources {
    all: Vec<Source>,
}

impl Sources {
    /// Keeps a text and gives its id.
    pub fn add(&mut self, name: impl Into<String>, text: impl Into<Arc<str>>) -> SourceId {
        self.add_part(name, text, 0)
    }

    /// Keeps a part of a text, before which there are so many lines, and gives its id.
    pub fn add_part(
        &mut self,
        name: impl Into<String>,
        text: impl Into<Arc<str>>,
        lines_before: usize,
    ) -> SourceId {
        self.all.push(Source {
            name: name.into(),
            text: text.into(),
            lines_before,
        });
        SourceId(self.all.len() as u32 - 1)
    }

    /// How many texts there are.
    pub fn len(&self) -> usize {
        self.all.len()
    }

    /// Whether there is no text.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// The text with that id.
    pub fn get(&self, id: SourceId) -> &Source {
        &self.all[id.0 as usize]
    }

    /// The characters that a span covers.
    pub fn text(&self, span: Span) -> &str {
        &self.get(span.source).text[span.start as usize..span.end as usize]
    }

    /// Line and column of a byte, both counted from 1, the column in characters.
    pub fn position(&self, source: SourceId, byte: u32) -> (usize, usize) {
        let Source {
            text, lines_before, ..
        } = self.get(source);
        let mut end = (byte as usize).min(text.len());
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        let line_start = text[..end].rfind('\n').map_or(0, |at| at + 1);
        let line = text[..end].matches('\n').count() + 1 + lines_before;
        (line, text[line_start..end].chars().count() + 1)
    }
}
