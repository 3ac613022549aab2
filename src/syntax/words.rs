//! The words of a text for tools that look at it while it is being written: what colours it and
//! what completes it.
//!
//! They are the parser's own tokens after its own repairs, so brackets are balanced and a line end
//! is there only where it ends a statement; nothing is ever wrong with a text here.

use std::ops::Range;

use super::lexer::{self, Lexed};
use super::token::Token;
use super::{brackets, layout};
use crate::diagnostic::{SourceId, Span};

/// A word and its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Word {
    /// Its bytes; none where a missing bracket was put in.
    pub range: Range<usize>,
    /// What it is.
    pub kind: WordKind,
}

/// The kinds of words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WordKind {
    /// A reserved word.
    Keyword,
    /// A name.
    Name,
    /// The only parameter of a function `x -> …`.
    LambdaName,
    /// A number with its unit.
    Number,
    /// A string, or a part of one between interpolations, with its quotes.
    Text,
    /// The `{` of an interpolation.
    InterpolationOpen,
    /// The format in an interpolation, `:.3`.
    Format,
    /// The `}` of an interpolation.
    InterpolationClose,
    /// An operator, `=`, `->` and `|>` among them.
    Operator,
    /// `(`, `[` or `{`.
    Open,
    /// The `(` before the parameters of a function `(x, y) -> …`.
    LambdaOpen,
    /// `)`, `]` or `}`.
    Close,
    /// `,` or `.`
    Punctuation,
    /// `;`, or a line end that ends a statement.
    StatementEnd,
    /// A comment.
    Comment,
    /// A comment that begins with `##` and has its line to itself.
    Documentation,
}

impl WordKind {
    /// Whether it opens a bracket.
    pub fn opens(self) -> bool {
        matches!(
            self,
            WordKind::Open | WordKind::LambdaOpen | WordKind::InterpolationOpen
        )
    }

    /// Whether it closes a bracket.
    pub fn closes(self) -> bool {
        matches!(self, WordKind::Close | WordKind::InterpolationClose)
    }

    /// Whether it is a comment of either kind.
    pub fn is_comment(self) -> bool {
        matches!(self, WordKind::Comment | WordKind::Documentation)
    }
}

/// Every reserved word.
pub fn keywords() -> impl Iterator<Item = &'static str> {
    Token::keywords().map(Token::text)
}

/// Whether a text is a name and nothing else.
pub fn is_name(text: &str) -> bool {
    let words = words(text);
    let is_one = matches!(&words[..], [word] if word.kind == WordKind::Name && word.range == (0..text.len()));
    is_one && text.chars().all(lexer::is_name_character)
}

/// The words of a text, in order. Takes time linear in the text.
pub fn words(text: &str) -> Vec<Word> {
    let source = SourceId(0);
    let mut lexed = lexer::lex(source, text);
    let end = text.trim_end().len();
    // Brackets that are nested too deeply stay as they are.
    let balanced = brackets::balance(&mut lexed, Span::new(source, end, end)).is_ok();
    layout::drop_insignificant_newlines(&mut lexed.tokens);
    if balanced {
        layout::mark_functions(&mut lexed.tokens);
    }
    with_comments(text, &lexed)
}

/// Tokens and comments as words in the order of the text.
fn with_comments(text: &str, lexed: &Lexed) -> Vec<Word> {
    let mut words: Vec<Word> = Vec::with_capacity(lexed.tokens.len() + lexed.comments.len());
    let mut comments = lexed.comments.iter().peekable();
    for &(token, span) in &lexed.tokens {
        while let Some(comment) = comments.next_if(|comment| comment.start < span.start) {
            words.push(comment_word(text, *comment));
        }
        let range = span.start as usize..span.end as usize;
        let goes_on = matches!(token, Token::TextRun | Token::TextEscape | Token::StringEnd);
        match words.last_mut() {
            Some(word) if goes_on && word.kind == WordKind::Text => word.range.end = range.end,
            _ => words.push(Word {
                range,
                kind: kind(token),
            }),
        }
    }
    words.extend(comments.map(|comment| comment_word(text, *comment)));
    words
}

fn comment_word(text: &str, span: Span) -> Word {
    let range = span.start as usize..span.end as usize;
    let line = text[..range.start].rfind('\n').map_or(0, |at| at + 1);
    let alone = text[line..range.start].trim().is_empty();
    let kind = match text[range.clone()].starts_with("##") && alone {
        true => WordKind::Documentation,
        false => WordKind::Comment,
    };
    Word { range, kind }
}

fn kind(token: Token) -> WordKind {
    match token {
        _ if token.is_keyword() => WordKind::Keyword,
        Token::Name => WordKind::Name,
        Token::LambdaName => WordKind::LambdaName,
        Token::Number => WordKind::Number,
        Token::StringStart | Token::TextRun | Token::TextEscape | Token::StringEnd => {
            WordKind::Text
        }
        Token::InterpolationStart => WordKind::InterpolationOpen,
        Token::Format => WordKind::Format,
        Token::InterpolationEnd => WordKind::InterpolationClose,
        Token::LambdaParenthesis => WordKind::LambdaOpen,
        _ if token.closer().is_some() => WordKind::Open,
        _ if token.is_closer() => WordKind::Close,
        Token::Comma | Token::Dot => WordKind::Punctuation,
        Token::Semicolon | Token::Newline => WordKind::StatementEnd,
        _ => WordKind::Operator,
    }
}

/// The places of the words of a program, in order: names, numbers, operators, brackets, and whole
/// strings with what is interpolated in them; neither comments nor line ends. The text must be
/// without mistakes.
pub fn spans(source: SourceId, text: &str) -> Vec<Span> {
    let mut words = Vec::new();
    let mut open_strings = 0_usize;
    let mut start = Span::NOWHERE;
    for (token, span) in lexer::lex(source, text).tokens {
        match token {
            Token::StringStart => {
                if open_strings == 0 {
                    start = span;
                }
                open_strings += 1;
            }
            Token::StringEnd => {
                open_strings = open_strings.saturating_sub(1);
                if open_strings == 0 {
                    words.push(start.to(span));
                }
            }
            Token::Newline => {}
            _ if open_strings == 0 => words.push(span),
            _ => {}
        }
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(text: &str) -> Vec<(&str, WordKind)> {
        words(text)
            .into_iter()
            .map(|word| (&text[word.range], word.kind))
            .collect()
    }

    #[test]
    fn strings_are_one_word_between_interpolations() {
        use WordKind::*;
        assert_eq!(
            shown(r#"print("a\n{x:.3}b""#),
            [
                ("print", Name),
                ("(", Open),
                (r#""a\n"#, Text),
                ("{", InterpolationOpen),
                ("x", Name),
                (":.3", Format),
                ("}", InterpolationClose),
                (r#"b""#, Text),
                ("", Close),
            ]
        );
    }

    #[test]
    fn an_open_string_reaches_to_the_end_of_its_line() {
        use WordKind::*;
        assert_eq!(
            shown("import \"par\nlet a = 1"),
            [
                ("import", Keyword),
                ("\"par", Text),
                ("\n", StatementEnd),
                ("let", Keyword),
                ("a", Name),
                ("=", Operator),
                ("1", Number),
            ]
        );
    }

    #[test]
    fn comments_stand_where_they_are_written() {
        use WordKind::*;
        assert_eq!(
            shown("## what\nlet a = 1 ## why\n# end"),
            [
                ("## what", Documentation),
                ("let", Keyword),
                ("a", Name),
                ("=", Operator),
                ("1", Number),
                ("## why", Comment),
                ("\n", StatementEnd),
                ("# end", Comment),
            ]
        );
    }
}
