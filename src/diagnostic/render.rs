//! Diagnostics as text for a terminal, drawn by ariadne.
//!
//! ariadne sees excerpts only (see `excerpt`), so that neither a long line nor a
//! large file is printed or even looked through, and since the columns of an excerpt are not those
//! of the file, the headings `file:line:column` are written here.

use std::collections::BTreeMap;
use std::fmt;

use ariadne::{Cache, CharSet, Color, Config, IndexType, Label, Report, ReportKind};

use super::excerpt::{Excerpt, clamped};
use super::{Diagnostic, Severity, SourceId, Sources, Span, shorten};

/// A heading's file in ariadne's output: it stands where the heading is to be put in. Neither a
/// message nor an excerpt contains it.
const HEADING: char = '\u{E000}';

/// Where a label stands: the source and the characters of its excerpt.
type Place = (SourceId, std::ops::Range<usize>);

/// The reports of all diagnostics, one below the other, each with its code, the text that it is
/// about with all labels, and help. With `color` they contain terminal escape sequences.
///
/// The cost depends on what is shown, except for finding line numbers, which is one pass over the
/// text before each label.
pub fn render(diagnostics: &[Diagnostic], sources: &Sources, color: bool) -> String {
    diagnostics
        .iter()
        .map(|diagnostic| render_one(diagnostic, sources, color))
        .collect()
}

/// One line for each diagnostic, as editors read them: `file:line:column: error[E0201]: message`.
/// The place is that of the first label; without one the line begins with the severity.
pub fn short(diagnostics: &[Diagnostic], sources: &Sources) -> String {
    let mut lines = String::new();
    for diagnostic in diagnostics {
        if let Some(span) = diagnostic.span() {
            let (line, column) = sources.position(span.source, span.start);
            let name = plain(&sources.get(span.source).name);
            lines += &format!("{name}:{line}:{column}: ");
        }
        let severity = match diagnostic.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        let message = plain(&diagnostic.message).replace('\n', " ");
        lines += &format!("{severity}[{}]: {message}\n", diagnostic.code.as_str());
    }
    lines
}

fn render_one(diagnostic: &Diagnostic, sources: &Sources, color: bool) -> String {
    let message = plain(&diagnostic.message);
    let Some(primary) = diagnostic.span() else {
        return without_place(diagnostic, &message, color);
    };
    let mut cache = Excerpts::new(diagnostic, sources);
    let kind = match diagnostic.severity {
        Severity::Error => ReportKind::Error,
        Severity::Warning => ReportKind::Warning,
    };
    let config = Config::default()
        .with_color(color)
        .with_char_set(CharSet::Unicode)
        // Places are characters of an excerpt here, translated from bytes of the file.
        .with_index_type(IndexType::Char);
    let mut report = Report::build(kind, cache.place(sources, primary))
        .with_config(config)
        .with_code(diagnostic.code.as_str())
        .with_message(message);
    // ariadne repeats the heading for a label that stands above the one before; the primary one's
    // source comes first.
    let mut labels: Vec<(usize, &super::Label)> = diagnostic.labels.iter().enumerate().collect();
    labels.sort_by_key(|(_, label)| {
        let elsewhere = label.span.source != primary.source;
        (elsewhere, label.span.source, label.span.start)
    });
    for (order, (index, label)) in labels.into_iter().enumerate() {
        let accent = match (index, diagnostic.severity) {
            (0, Severity::Error) => Color::Red,
            (0, Severity::Warning) => Color::Yellow,
            _ => Color::Blue,
        };
        report = report.with_label(
            Label::new(cache.place(sources, label.span))
                .with_message(plain(&label.message))
                .with_color(accent)
                .with_order(order as i32),
        );
    }
    if let Some(help) = &diagnostic.help {
        report = report.with_help(plain(help));
    }
    let mut drawn = Vec::new();
    // Writing into memory does not fail, and what ariadne writes is text.
    if report.finish().write(&mut cache, &mut drawn).is_err() {
        return without_place(diagnostic, &diagnostic.message, color);
    }
    let drawn = String::from_utf8_lossy(&drawn);
    with_headings(&drawn, diagnostic, sources)
}

/// A report on something that is not in a text, such as a file that cannot be read.
fn without_place(diagnostic: &Diagnostic, message: &str, color: bool) -> String {
    let kind = match diagnostic.severity {
        Severity::Error => "Error",
        Severity::Warning => "Warning",
    };
    let code = diagnostic.code.as_str();
    let heading = match (color, diagnostic.severity) {
        (true, Severity::Error) => format!("\u{1b}[31m[{code}] {kind}:\u{1b}[0m"),
        (true, Severity::Warning) => format!("\u{1b}[33m[{code}] {kind}:\u{1b}[0m"),
        (false, _) => format!("[{code}] {kind}:"),
    };
    let help = diagnostic
        .help
        .as_ref()
        .map_or(String::new(), |help| format!("  Help: {}\n", plain(help)));
    format!("{heading} {message}\n{help}")
}

/// Puts `file:line:column` where ariadne wrote the mark, a line and a column of the excerpt.
fn with_headings(drawn: &str, diagnostic: &Diagnostic, sources: &Sources) -> String {
    let mut parts = drawn.split(HEADING);
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        // The part begins with the source's number and goes on with `:line:column `.
        let (place, rest) = part.split_once(' ').unwrap_or((part, ""));
        let number = place
            .split(':')
            .next()
            .and_then(|digits| digits.parse().ok());
        let span = diagnostic
            .labels
            .iter()
            .map(|label| label.span)
            .find(|span| Some(span.source.0) == number);
        if let Some(span) = span {
            let (line, column) = sources.position(span.source, span.start);
            let name = plain(&sources.get(span.source).name);
            text += &format!("{name}:{line}:{column} ");
        }
        text += rest;
    }
    text
}

/// A message as it is shown: names in it shortened, on one line, without control characters.
fn plain(message: &str) -> String {
    let mut shown = String::new();
    for (index, part) in message.split('`').enumerate() {
        if index > 0 {
            shown.push('`');
        }
        // Every second part stands between backquotes.
        let part = if index % 2 == 1 {
            shorten(part)
        } else {
            part.into()
        };
        shown.extend(part.chars().map(|character| match character {
            '\n' => '\n',
            HEADING => ' ',
            _ if character.is_control() => ' ',
            _ => character,
        }));
    }
    shown
}

/// The excerpts of one report, by source.
struct Excerpts {
    all: BTreeMap<SourceId, (Excerpt, ariadne::Source<String>)>,
}

impl Excerpts {
    fn new(diagnostic: &Diagnostic, sources: &Sources) -> Self {
        let mut spans: BTreeMap<SourceId, Vec<Span>> = BTreeMap::new();
        for label in &diagnostic.labels {
            spans.entry(label.span.source).or_default().push(label.span);
        }
        let all = spans
            .into_iter()
            .map(|(id, spans)| {
                let excerpt = Excerpt::new(&sources.get(id).text, &spans);
                let source = ariadne::Source::from(excerpt.text.clone())
                    .with_display_line_offset(excerpt.line_offset + sources.get(id).lines_before);
                (id, (excerpt, source))
            })
            .collect();
        Excerpts { all }
    }

    fn place(&self, sources: &Sources, span: Span) -> Place {
        let text = &sources.get(span.source).text;
        let (start, end) = clamped(text, span);
        let range = self.all.get(&span.source).map_or(0..0, |(excerpt, _)| {
            excerpt.character(text, start)..excerpt.character(text, end)
        });
        (span.source, range)
    }
}

impl Cache<SourceId> for &mut Excerpts {
    type Storage = String;

    fn fetch(&mut self, id: &SourceId) -> Result<&ariadne::Source<String>, impl fmt::Debug> {
        self.all
            .get(id)
            .map(|(_, source)| source)
            .ok_or("no label is in this source")
    }

    fn display<'a>(&self, id: &'a SourceId) -> Option<impl fmt::Display + 'a> {
        Some(format!("{HEADING}{}", id.0))
    }
}

#[cfg(test)]
mod tests;
