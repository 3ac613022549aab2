//! Colours: what each word of a text is, found without parsing it, so that a text that is being
//! written keeps its colours.

use std::ops::Range;

use rustc_hash::FxHashMap;

use super::vocabulary;
use crate::syntax::words::{Word, WordKind, words};

/// A stretch of text and what it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Highlight {
    /// Its bytes.
    pub range: Range<usize>,
    /// What it is.
    pub class: Class,
}

/// What a stretch of text is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Class {
    /// A reserved word.
    Keyword,
    /// A number.
    Number,
    /// The text of a string.
    String,
    /// The braces and the format of an interpolation.
    Interpolation,
    /// A comment.
    Comment,
    /// A comment that documents a definition.
    Documentation,
    /// An operator.
    Operator,
    /// Brackets, commas and points.
    Punctuation,
    /// The name of a function.
    Function,
    /// The name of a field.
    Field,
    /// The name of a parameter or setting.
    Parameter,
    /// The name of any other value, or of a module.
    Variable,
    /// A name behind a point, or of an argument.
    Property,
    /// A name that nothing in the text and nothing of the language binds.
    Unknown,
}

/// The coloured stretches of a text, in order, without overlap. Takes time linear in the text.
///
/// A name has one class wherever it stands in the text: scopes are not looked at.
pub fn highlight(text: &str) -> Vec<Highlight> {
    let words = words(text);
    let bound = bound_names(text, &words);
    let mut highlights = Vec::with_capacity(words.len());
    let mut open: Vec<&str> = Vec::new();
    for (place, word) in words.iter().enumerate() {
        if word.kind.opens() {
            open.push(&text[word.range.clone()]);
        } else if word.kind.closes() {
            open.pop();
        }
        let class = match word.kind {
            WordKind::Keyword => Class::Keyword,
            WordKind::Number => Class::Number,
            WordKind::Text => Class::String,
            WordKind::InterpolationOpen | WordKind::Format | WordKind::InterpolationClose => {
                Class::Interpolation
            }
            WordKind::Operator => Class::Operator,
            WordKind::Open | WordKind::LambdaOpen | WordKind::Close | WordKind::Punctuation => {
                Class::Punctuation
            }
            WordKind::Comment => Class::Comment,
            WordKind::Documentation => Class::Documentation,
            WordKind::LambdaName => Class::Variable,
            WordKind::Name => {
                let in_parentheses = open.last() == Some(&"(");
                name_class(text, &words, place, &bound, in_parentheses)
            }
            WordKind::StatementEnd if text[word.range.clone()].starts_with(';') => {
                Class::Punctuation
            }
            WordKind::StatementEnd => continue,
        };
        if !word.range.is_empty() {
            let range = word.range.clone();
            highlights.push(Highlight { range, class });
        }
    }
    highlights
}

fn name_class(
    text: &str,
    words: &[Word],
    place: usize,
    bound: &FxHashMap<&str, Class>,
    in_parentheses: bool,
) -> Class {
    let shown = |word: &Word| &text[word.range.clone()];
    let name = shown(&words[place]);
    let before = place.checked_sub(1).map(|before| shown(&words[before]));
    let after = words.get(place + 1).map(shown);
    match (before, after) {
        (Some("."), Some("(")) => Class::Function,
        (Some("."), _) => Class::Property,
        // The name of an argument, or a parameter with a default.
        (Some("(" | ","), Some("=")) if in_parentheses => Class::Property,
        _ => bound
            .get(name)
            .copied()
            .or_else(|| vocabulary::class(name))
            .unwrap_or(Class::Unknown),
    }
}

/// The names that are bound anywhere in the text, with what they are.
fn bound_names<'text>(text: &'text str, words: &[Word]) -> FxHashMap<&'text str, Class> {
    let mut bound = FxHashMap::default();
    for (place, word) in words.iter().enumerate() {
        let shown = &text[word.range.clone()];
        let rest = &words[place + 1..];
        match (word.kind, shown) {
            (WordKind::LambdaName, _) => drop(bound.entry(shown).or_insert(Class::Variable)),
            (WordKind::LambdaOpen, _) => bind_list(text, rest, &mut bound),
            (WordKind::Keyword, "param" | "setting") => {
                bind_next(text, rest, Class::Parameter, &mut bound);
            }
            (WordKind::Keyword, "fn" | "field") => {
                let class = match shown {
                    "fn" => Class::Function,
                    _ => Class::Field,
                };
                bind_next(text, rest, class, &mut bound);
                if rest.get(1).is_some_and(|word| word.kind == WordKind::Open) {
                    bind_list(text, &rest[2..], &mut bound);
                }
            }
            (WordKind::Keyword, "as") => bind_next(text, rest, Class::Variable, &mut bound),
            (WordKind::Keyword, "let" | "var" | "for") => {
                let pattern = rest.iter().take_while(|word| {
                    let shown = &text[word.range.clone()];
                    word.kind == WordKind::Name || matches!(shown, "[" | "]" | ",")
                });
                for word in pattern.filter(|word| word.kind == WordKind::Name) {
                    let name = &text[word.range.clone()];
                    bound.entry(name).or_insert(Class::Variable);
                }
            }
            _ => {}
        }
    }
    bound
}

fn bind_next<'text>(
    text: &'text str,
    rest: &[Word],
    class: Class,
    bound: &mut FxHashMap<&'text str, Class>,
) {
    if let Some(word) = rest.first().filter(|word| word.kind == WordKind::Name) {
        bound.insert(&text[word.range.clone()], class);
    }
}

/// Binds the names of a list of parameters or coordinates, whose bracket has been opened.
fn bind_list<'text>(text: &'text str, rest: &[Word], bound: &mut FxHashMap<&'text str, Class>) {
    for word in super::scan::parameter_names(text, rest) {
        let name = &text[word.range.clone()];
        bound.entry(name).or_insert(Class::Variable);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn classes(text: &str) -> Vec<(&str, Class)> {
        highlight(text)
            .into_iter()
            .map(|highlight| (&text[highlight.range], highlight.class))
            .collect()
    }

    fn class(text: &str, part: &str) -> Class {
        let all = classes(text);
        let found = all.iter().find(|(shown, _)| *shown == part);
        found.map_or_else(|| panic!("{part} is not in {all:?}"), |(_, class)| *class)
    }

    #[test]
    fn every_class_is_found() {
        let text = "## A ball.\nparam r = 1 in 0.1..3 # radius\nfield ball(p in R3) = norm(p) - r\n\
                    let m = polygonize(ball, cell = 0.1)\nprint(\"{m.area:.3} of\")\nnothing_known\n";
        let expected = [
            ("## A ball.", Class::Documentation),
            ("param", Class::Keyword),
            ("r", Class::Parameter),
            ("1", Class::Number),
            ("..", Class::Operator),
            ("# radius", Class::Comment),
            ("ball", Class::Field),
            ("p", Class::Variable),
            ("norm", Class::Function),
            ("m", Class::Variable),
            ("cell", Class::Property),
            ("area", Class::Property),
            (":.3", Class::Interpolation),
            (" of\"", Class::String),
            ("(", Class::Punctuation),
            ("nothing_known", Class::Unknown),
        ];
        for (part, expected) in expected {
            assert_eq!(class(text, part), expected, "{part}");
        }
    }

    #[test]
    fn broken_text_keeps_its_colours() {
        let text = "let a = (1 + \nfield f(x, y = x +\nlet s = \"open\nprint(a";
        assert_eq!(class(text, "\"open"), Class::String);
        assert_eq!(class(text, "f"), Class::Field);
        assert_eq!(class(text, "print"), Class::Function);
        assert_eq!(class(text, "a"), Class::Variable);
    }

    #[test]
    fn stretches_are_in_order_and_do_not_overlap() {
        for text in [
            "",
            "\"",
            "\"a{",
            "((((",
            "a.b.c(d = e)",
            "“é” 𝒳 ≤ 1 \"🙂{🙂}\"",
            "}{)(][",
        ] {
            let mut end = 0;
            for Highlight { range, .. } in highlight(text) {
                assert!(range.start >= end && range.end > range.start, "{text}");
                assert!(text.get(range.clone()).is_some(), "{text}");
                end = range.end;
            }
            assert!(end <= text.len());
        }
    }
}
