//! From text to tokens.
//!
//! logos splits the text; this file switches between its two modes, code and the inside of a
//! string, and collects comments and doc comments on the way. Nothing stops it: what is not part
//! of the language is reported and left out, and a string without its closing quote ends with its
//! line.

use std::ops::Range;
use std::sync::Arc;

use logos::Logos;

use super::number::{MAXIMUM_PRECISION, escape_value, precision_value};
use super::token::{Spanned, Token};
use crate::diagnostic::{Code, Diagnostic, SourceId, Span, shorten};

/// What the lexer found.
#[derive(Debug, Default)]
pub(super) struct Lexed {
    /// The tokens in order; one [`Token::Newline`] for any number of line ends in a row.
    pub(super) tokens: Vec<Spanned>,
    /// All comments, in order.
    pub(super) comments: Vec<Span>,
    /// The text of the `##` lines right above a token, with the first byte of that token;
    /// ascending.
    pub(super) documentation: Vec<(u32, Arc<str>)>,
    /// Where a string without its closing quote was broken off, ascending: what stood behind it
    /// on its line is lost, closing brackets among it.
    pub(super) broken_lines: Vec<u32>,
    /// What is wrong.
    pub(super) diagnostics: Vec<Diagnostic>,
}

/// The code mode.
#[derive(Logos, Clone, Copy, Debug, PartialEq)]
#[logos(skip r"[ \t\r\u{A0}\u{FEFF}]+")]
enum Lexeme {
    #[token("let", |_| Token::Let)]
    #[token("var", |_| Token::Var)]
    #[token("param", |_| Token::Param)]
    #[token("fn", |_| Token::Fn)]
    #[token("field", |_| Token::Field)]
    #[token("over", |_| Token::Over)]
    #[token("for", |_| Token::For)]
    #[token("in", |_| Token::In)]
    #[token("while", |_| Token::While)]
    #[token("if", |_| Token::If)]
    #[token("then", |_| Token::Then)]
    #[token("else", |_| Token::Else)]
    #[token("and", |_| Token::And)]
    #[token("or", |_| Token::Or)]
    #[token("not", |_| Token::Not)]
    #[token("with", |_| Token::With)]
    #[token("by", |_| Token::By)]
    #[token("true", |_| Token::True)]
    #[token("false", |_| Token::False)]
    #[token("setting", |_| Token::Setting)]
    #[token("import", |_| Token::Import)]
    #[token("test", |_| Token::Test)]
    #[token("as", |_| Token::As)]
    #[token("+", |_| Token::Plus)]
    #[token("-", |_| Token::Minus)]
    #[token("*", |_| Token::Star)]
    #[token("/", |_| Token::Slash)]
    #[token("%", |_| Token::Percent)]
    #[token("@", |_| Token::At)]
    #[token("^", |_| Token::Caret)]
    #[token("|", |_| Token::Bar)]
    #[token("&", |_| Token::Ampersand)]
    #[token("\\", |_| Token::Backslash)]
    #[token("!", |_| Token::Bang)]
    #[token("==", |_| Token::Equal)]
    #[token("!=", |_| Token::NotEqual)]
    #[token("<", |_| Token::Less)]
    #[token("<=", |_| Token::LessEqual)]
    #[token(">", |_| Token::Greater)]
    #[token(">=", |_| Token::GreaterEqual)]
    #[token("=", |_| Token::Assign)]
    #[token("->", |_| Token::Arrow)]
    #[token("|>", |_| Token::Pipe)]
    #[token("..", |_| Token::DotDot)]
    #[token(".", |_| Token::Dot)]
    #[token(",", |_| Token::Comma)]
    #[token(";", |_| Token::Semicolon)]
    #[token("(", |_| Token::OpenParenthesis)]
    #[token(")", |_| Token::CloseParenthesis)]
    #[token("[", |_| Token::OpenBracket)]
    #[token("]", |_| Token::CloseBracket)]
    #[token("{", |_| Token::OpenBrace)]
    #[token("}", |_| Token::CloseBrace)]
    #[token("\n", |_| Token::Newline)]
    #[token("\"", |_| Token::StringStart)]
    #[regex(r"[0-9](_?[0-9])*(\.[0-9](_?[0-9])*)?([eE][+-]?[0-9](_?[0-9])*)?(deg|turn)?", |_| Token::Number)]
    #[regex(r"[\p{XID_Start}_]\p{XID_Continue}*", |_| Token::Name)]
    Token(Token),
    #[regex(r"#[^\n]*", allow_greedy = true)]
    Comment,
    #[token(":")]
    Colon,
    #[token("**")]
    DoubleStar,
    #[token("&&")]
    DoubleAmpersand,
    #[token("||")]
    DoubleBar,
    #[regex(r"\.[0-9](_?[0-9])*")]
    LeadingPoint,
}

/// The mode inside a string.
#[derive(Logos, Clone, Copy, Debug, PartialEq)]
enum Piece {
    #[regex(r#"[^"\\{}\n]+"#)]
    Run,
    #[token("{{")]
    #[token("}}")]
    #[regex(r"\\[^\n]")]
    #[regex(r"\\u\{[0-9A-Fa-f]*\}")]
    #[token("\\", priority = 1)]
    Escape,
    #[token("{")]
    InterpolationStart,
    #[token("}")]
    StrayBrace,
    #[token("\"")]
    Quote,
    #[token("\n")]
    LineEnd,
}

enum Mode<'source> {
    Code(logos::Lexer<'source, Lexeme>),
    Text(logos::Lexer<'source, Piece>),
}

/// A string whose closing quote has not come yet.
struct OpenString {
    quote: usize,
    first_token: usize,
    /// The `{` of the interpolation that is being read, and how many braces are open in it.
    interpolation: Option<(usize, u32)>,
}

struct State<'source> {
    source: SourceId,
    text: &'source str,
    lexed: Lexed,
    strings: Vec<OpenString>,
    /// The `##` lines read last, and where the last one ends.
    documentation: Vec<&'source str>,
    documentation_end: usize,
}

/// Splits a text into tokens. Takes time linear in the text.
pub(super) fn lex(source: SourceId, text: &str) -> Lexed {
    let mut state = State {
        source,
        text,
        lexed: Lexed::default(),
        strings: Vec::new(),
        documentation: Vec::new(),
        documentation_end: 0,
    };
    let mut mode = Mode::Code(Lexeme::lexer(text));
    loop {
        mode = match mode {
            Mode::Code(mut lexer) => {
                let Some(lexeme) = lexer.next() else { break };
                match lexeme {
                    Ok(Lexeme::Token(token)) => state.token(token, lexer.span()),
                    Ok(Lexeme::Colon) if state.ends_interpolation() => {
                        let end = format_end(text, lexer.span().end);
                        lexer.bump(end - lexer.span().end);
                        state.format(lexer.span());
                    }
                    Ok(Lexeme::Comment) => state.comment(lexer.span()),
                    Ok(other) => state.correct(other, lexer.span()),
                    Err(()) => state.unknown_character(lexer.span()),
                }
                if state.in_text() {
                    Mode::Text(lexer.morph())
                } else {
                    Mode::Code(lexer)
                }
            }
            Mode::Text(mut lexer) => {
                let Some(piece) = lexer.next() else { break };
                // The pieces cover every character, so there is no error to look at.
                state.piece(piece.unwrap_or(Piece::Run), lexer.span());
                if state.in_text() {
                    Mode::Text(lexer)
                } else {
                    Mode::Code(lexer.morph())
                }
            }
        };
    }
    state.break_off_strings(text.len());
    state.lexed
}

impl<'source> State<'source> {
    fn span(&self, range: Range<usize>) -> Span {
        Span::new(self.source, range.start, range.end)
    }

    fn push(&mut self, token: Token, range: Range<usize>) {
        let span = self.span(range);
        self.lexed.tokens.push((token, span));
    }

    fn report(&mut self, diagnostic: Diagnostic) {
        super::report(&mut self.lexed.diagnostics, diagnostic);
    }

    /// Whether the next character belongs to the text of a string.
    fn in_text(&self) -> bool {
        self.strings
            .last()
            .is_some_and(|string| string.interpolation.is_none())
    }

    /// Whether a `}` or `:` here belongs to the interpolation and not to something in it.
    fn ends_interpolation(&self) -> bool {
        self.strings
            .last()
            .is_some_and(|string| matches!(string.interpolation, Some((_, 0))))
    }

    fn token(&mut self, token: Token, range: Range<usize>) {
        if token == Token::Newline {
            self.break_off_strings(range.start);
            if !matches!(self.lexed.tokens.last(), Some((Token::Newline, _))) {
                self.push(token, range);
            }
            return;
        }
        self.attach_documentation(range.start);
        match token {
            Token::StringStart => {
                self.strings.push(OpenString {
                    quote: range.start,
                    first_token: self.lexed.tokens.len(),
                    interpolation: None,
                });
            }
            Token::CloseBrace if self.ends_interpolation() => {
                self.set_interpolation(None);
                return self.push(Token::InterpolationEnd, range);
            }
            Token::OpenBrace => self.count_brace(1),
            Token::CloseBrace => self.count_brace(-1),
            Token::Name => self.check_name(range.clone()),
            _ => {}
        }
        self.push(token, range);
    }

    fn set_interpolation(&mut self, interpolation: Option<(usize, u32)>) {
        if let Some(string) = self.strings.last_mut() {
            string.interpolation = interpolation;
        }
    }

    fn count_brace(&mut self, change: i32) {
        if let Some(OpenString {
            interpolation: Some((_, braces)),
            ..
        }) = self.strings.last_mut()
        {
            *braces = braces.saturating_add_signed(change);
        }
    }

    fn piece(&mut self, piece: Piece, range: Range<usize>) {
        match piece {
            Piece::Run => self.push(Token::TextRun, range),
            Piece::Escape => {
                if escape_value(&self.text[range.clone()]).is_none() {
                    self.bad_escape(range.clone());
                }
                self.push(Token::TextEscape, range);
            }
            Piece::InterpolationStart => {
                self.set_interpolation(Some((range.start, 0)));
                self.push(Token::InterpolationStart, range);
            }
            Piece::StrayBrace => {
                let span = self.span(range.clone());
                self.report(
                    Diagnostic::error(Code::BadFormat, "`}` in a string without its `{`")
                        .label(span, "no `{` before it in this string")
                        .help("write `}}` for a brace"),
                );
                self.push(Token::TextRun, range);
            }
            Piece::Quote => {
                self.strings.pop();
                self.push(Token::StringEnd, range);
            }
            Piece::LineEnd => self.token(Token::Newline, range),
        }
    }

    fn bad_escape(&mut self, range: Range<usize>) {
        let span = self.span(range.clone());
        let message = format!("`{}` is not an escape sequence", shorten(&self.text[range]));
        self.report(
            Diagnostic::error(Code::BadFormat, message)
                .label(span, "unknown escape sequence")
                .help(
                    r#"the escape sequences are `\n`, `\t`, `\r`, `\"`, `\\` and `\u{3c0}`; `{{` and `}}` are braces"#,
                ),
        );
    }

    fn format(&mut self, range: Range<usize>) {
        let text = &self.text[range.clone()];
        if precision_value(text).is_some() {
            return self.push(Token::Format, range);
        }
        let span = self.span(range);
        let message = format!("`{}` is not a format", shorten(text));
        self.report(
            Diagnostic::error(Code::BadFormat, message)
                .label(span, "unknown format")
                .help(format!(
                    "a format is `:.` and the number of digits after the point, at most {MAXIMUM_PRECISION}, as in `{{x:.3}}`"
                )),
        );
    }

    /// Ends all open strings at a line's end. One error speaks for all: the outermost one is the
    /// one whose end is missing, and its tokens are no use.
    fn break_off_strings(&mut self, end: usize) {
        let Some(outermost) = self.strings.first() else {
            return;
        };
        let end = self.text[..end].trim_end_matches('\r').len();
        let quote = self.span(outermost.quote..outermost.quote + 1);
        let mut diagnostic = Diagnostic::error(
            Code::UnclosedText,
            "a string ends on the line on which it begins",
        )
        .label(quote, "this string has no closing quote");
        if let Some((brace, _)) = outermost.interpolation {
            diagnostic = diagnostic
                .label(self.span(brace..brace + 1), "this `{` has no `}`")
                .help("write `{{` for a brace in a string");
        } else {
            diagnostic = diagnostic.help("write `\\n` for a line break in a string");
        }
        let (first_token, start) = (outermost.first_token, outermost.quote);
        self.lexed.tokens.truncate(first_token);
        self.push(Token::StringStart, start..start + 1);
        self.push(Token::StringEnd, end..end);
        self.lexed.broken_lines.push(end as u32);
        self.report(diagnostic);
        self.strings.clear();
    }

    fn comment(&mut self, range: Range<usize>) {
        let text = self.text[range.clone()].trim_end();
        let end = range.start + text.len();
        let span = self.span(range.start..end);
        self.lexed.comments.push(span);
        let line_start = self.text[..range.start].rfind('\n').map_or(0, |at| at + 1);
        let alone = self.text[line_start..range.start].trim().is_empty();
        match text.strip_prefix("##") {
            Some(line) if alone => {
                if !self.documentation.is_empty() && !self.is_next_line(range.start) {
                    self.documentation.clear();
                }
                self.documentation
                    .push(line.strip_prefix(' ').unwrap_or(line));
                self.documentation_end = end;
            }
            _ => self.documentation.clear(),
        }
    }

    /// Whether only one line end stands between the doc comment read last and this place.
    fn is_next_line(&self, place: usize) -> bool {
        let between = &self.text[self.documentation_end..place];
        between.trim().is_empty() && between.bytes().filter(|&byte| byte == b'\n').count() == 1
    }

    fn attach_documentation(&mut self, place: usize) {
        if self.documentation.is_empty() {
            return;
        }
        if self.is_next_line(place) {
            let text = self.documentation.join("\n");
            self.lexed.documentation.push((place as u32, text.into()));
        }
        self.documentation.clear();
    }

    fn check_name(&mut self, range: Range<usize>) {
        let name = &self.text[range.clone()];
        if name.chars().all(is_name_character) {
            return;
        }
        let span = self.span(range);
        let message = format!("`{}` is not a name", shorten(name));
        self.report(
            Diagnostic::error(Code::UnknownCharacter, message)
                .label(span, "letters that cannot be in a name")
                .help("names are made of the letters a to z and A to Z, Greek letters, digits and `_`"),
        );
    }

    /// Reports what is written in another way in Imp, and goes on with what was meant.
    fn correct(&mut self, lexeme: Lexeme, range: Range<usize>) {
        let text = &self.text[range.clone()];
        let span = self.span(range.clone());
        let (diagnostic, meant) = match lexeme {
            Lexeme::DoubleStar => (
                Diagnostic::error(Code::DoubleStar, "powers are written with `^`")
                    .label(span, "write `^`")
                    .help("`x^2` is the square of x"),
                Token::Caret,
            ),
            Lexeme::DoubleAmpersand => (not_our_word(text, "and", span), Token::And),
            Lexeme::DoubleBar => (not_our_word(text, "or", span), Token::Or),
            Lexeme::LeadingPoint => (
                Diagnostic::error(
                    Code::BadNumber,
                    "a number has a digit on both sides of its point",
                )
                .label(span, "no digit before the point")
                .help(format!("write `0{}`", shorten(text))),
                Token::Number,
            ),
            _ => return self.unknown_character(range),
        };
        self.report(diagnostic);
        self.push(meant, range);
    }

    fn unknown_character(&mut self, range: Range<usize>) {
        let text = &self.text[range.clone()];
        let span = self.span(range);
        // A run of such characters is one mistake.
        if let Some(last) = self.lexed.diagnostics.last_mut()
            && last.code == Code::UnknownCharacter
            && let Some(label) = last.labels.first_mut()
            && label.span.end == span.start
        {
            label.span.end = span.end;
            return;
        }
        let character = text.chars().next().unwrap_or(' ');
        let message = if character.is_control() {
            format!(
                "the character U+{:04X} is not part of the language",
                u32::from(character)
            )
        } else {
            format!("`{character}` is not part of the language")
        };
        let diagnostic =
            Diagnostic::error(Code::UnknownCharacter, message).label(span, "not understood");
        self.report(match meant_instead(character) {
            Some(help) => diagnostic.help(help),
            None => diagnostic,
        });
    }
}

fn not_our_word(written: &str, word: &str, span: Span) -> Diagnostic {
    Diagnostic::error(
        Code::UnexpectedToken,
        format!("`{written}` is written `{word}`"),
    )
    .label(span, format!("write `{word}`"))
}

/// Where a format that begins before `from` ends: at the brace, quote or line end.
fn format_end(text: &str, from: usize) -> usize {
    text[from..]
        .find(['}', '{', '"', '\n'])
        .map_or(text.len(), |length| from + length)
}

pub(super) fn is_name_character(character: char) -> bool {
    character.is_ascii_alphanumeric()
        || character == '_'
        || (matches!(character, '\u{370}'..='\u{3FF}' | '\u{1F00}'..='\u{1FFF}')
            && character.is_alphabetic())
}

/// What was probably meant by a character that looks like one of ours.
fn meant_instead(character: char) -> Option<&'static str> {
    Some(match character {
        '\'' | '‘' | '’' | '“' | '”' | '„' | '`' => {
            "strings stand in straight double quotes, `\"`"
        }
        '−' | '–' | '—' => "the minus sign is the hyphen, `-`",
        '×' | '·' | '⋅' => "a product is written with `*`",
        '÷' => "a quotient is written with `/`",
        '²' => "a square is written `^2`",
        '³' => "a cube is written `^3`",
        '≤' => "it is written `<=`",
        '≥' => "it is written `>=`",
        '≠' => "it is written `!=`",
        '√' => "a square root is written `sqrt(x)`",
        '∪' => "a union is written with `|`",
        '∩' => "an intersection is written with `&`",
        '→' | '↦' => "a function is written with `->`",
        '∞' => "infinity is written `1/0`",
        ':' => "a value follows `=`, an interval is written `lo..hi`",
        _ => return None,
    })
}

#[cfg(test)]
mod tests;
