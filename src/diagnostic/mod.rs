//! What can be wrong with a program, as plain data.
//!
//! Every stage that reads a person's text reports with a [`Diagnostic`]: a [`Code`], a message,
//! labelled [`Span`]s and help. Nothing here prints: [`render`] turns diagnostics into text for a
//! terminal, and the shell decides where the text goes.

use std::borrow::Cow;

mod advice;
mod code;
mod excerpt;
pub mod render;
mod source;
pub mod suggest;

pub use code::Code;
pub use source::{Source, SourceId, Sources, Span};

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// The program cannot go on as written.
    Error,
    /// The program runs, but probably not as its author thinks.
    Warning,
}

/// A stretch of the source and what is to be said about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// The text that is underlined.
    pub span: Span,
    /// What stands beside the line.
    pub message: String,
}

/// One thing that is wrong, where, and what to do about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Error or warning.
    pub severity: Severity,
    /// The stable code, `E0201`; also decides the exit code.
    pub code: Code,
    /// One sentence, lower case, without a full stop: what is wrong.
    pub message: String,
    /// The places; the first is the primary one. Empty where there is no text to point at
    /// (a file that cannot be read).
    pub labels: Vec<Label>,
    /// What to write or do instead.
    pub help: Option<String>,
}

impl Diagnostic {
    /// An error without a place; add one with [`Diagnostic::label`].
    pub fn error(code: Code, message: impl Into<String>) -> Self {
        Diagnostic {
            severity: Severity::Error,
            code,
            message: message.into(),
            labels: Vec::new(),
            help: None,
        }
    }

    /// A warning without a place.
    pub fn warning(code: Code, message: impl Into<String>) -> Self {
        Diagnostic {
            severity: Severity::Warning,
            ..Diagnostic::error(code, message)
        }
    }

    /// Adds a labelled place, unless it is [`Span::NOWHERE`]; the first one added is the primary
    /// one.
    pub fn label(mut self, span: Span, message: impl Into<String>) -> Self {
        if span.is_somewhere() {
            self.labels.push(Label {
                span,
                message: message.into(),
            });
        }
        self
    }

    /// Says what to do instead.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// The primary place, if there is one.
    pub fn span(&self) -> Option<Span> {
        self.labels.first().map(|label| label.span)
    }
}

/// A name or other text as a message quotes it: whole if it is short, else its beginning and end.
pub fn shorten(text: &str) -> Cow<'_, str> {
    const LONGEST: usize = 60;
    const BEGINNING: usize = 40;
    const END: usize = 12;
    if text.len() <= LONGEST || text.chars().count() <= LONGEST {
        return Cow::Borrowed(text);
    }
    let beginning: String = text.chars().take(BEGINNING).collect();
    let end = text
        .char_indices()
        .rev()
        .nth(END - 1)
        .map_or("", |(at, _)| &text[at..]);
    Cow::Owned(format!("{beginning}…{end}"))
}
