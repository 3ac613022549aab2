//! Brackets find their partners before anything is parsed.
//!
//! After this pass the brackets of a token stream are balanced, whatever was written: a missing
//! one is put in where it was missed, a stray one is left out, and each such repair is one error
//! that points at both places. So the parser can always skip from a bracket to its partner. The
//! pass also bounds how deep brackets are nested, which bounds the parser's recursion.

use super::lexer::Lexed;
use super::token::{Spanned, Token};
use crate::diagnostic::{Code, Diagnostic, Span};

/// How deep brackets may be nested.
pub(super) const MAXIMUM_BRACKETS: usize = 256;

/// A change that balances the brackets; applied to the token with its index.
#[derive(Clone, Copy)]
enum Repair {
    Remove(usize),
    Replace(usize, Token),
    InsertBefore(usize, Token),
}

struct Check<'tokens> {
    tokens: &'tokens [Spanned],
    open: Vec<Spanned>,
    repairs: Vec<Repair>,
    diagnostics: Vec<Diagnostic>,
}

/// Balances the brackets in `lexed.tokens` and adds what was wrong to `lexed.diagnostics`.
///
/// # Errors
///
/// Where brackets are nested deeper than [`MAXIMUM_BRACKETS`]: that one diagnostic.
pub(super) fn balance(lexed: &mut Lexed, end: Span) -> Result<(), Box<Diagnostic>> {
    let mut check = Check {
        tokens: &lexed.tokens,
        open: Vec::new(),
        repairs: Vec::new(),
        diagnostics: Vec::new(),
    };
    let mut broken_lines = lexed.broken_lines.iter().copied().peekable();
    for (index, &(token, span)) in lexed.tokens.iter().enumerate() {
        // The broken string itself ends at that place, with a token of no length.
        let broken = |&place: &u32| place <= span.start && token != Token::StringEnd;
        if broken_lines.next_if(broken).is_some() {
            check.close_broken_line(index);
        }
        if token.starts_definition() && check.starts_line(index) {
            check.close_before_definition(index, span);
        }
        if token.closer().is_some() {
            check.open.push((token, span));
            if check.open.len() > MAXIMUM_BRACKETS {
                return Err(Box::new(too_deep(span)));
            }
        } else if token.is_closer() {
            check.close(index, (token, span));
        }
    }
    if broken_lines.peek().is_some() {
        check.close_broken_line(lexed.tokens.len());
    }
    check.close_at_end(end);
    let (repairs, diagnostics) = (check.repairs, check.diagnostics);
    if !repairs.is_empty() {
        lexed.tokens = apply(&lexed.tokens, &repairs, end);
    }
    lexed.diagnostics.extend(diagnostics);
    Ok(())
}

fn too_deep(span: Span) -> Diagnostic {
    Diagnostic::error(
        Code::TooDeep,
        format!("brackets are nested deeper than {MAXIMUM_BRACKETS} levels"),
    )
    .label(span, "one level too many")
    .help("give names to parts of it with `let`")
}

impl Check<'_> {
    fn report(&mut self, diagnostic: Diagnostic) {
        super::report(&mut self.diagnostics, diagnostic);
    }

    fn starts_line(&self, index: usize) -> bool {
        index
            .checked_sub(1)
            .is_some_and(|before| self.tokens[before].0 == Token::Newline)
    }

    /// Closes open brackets until `keep` remain, before the token at `index`.
    fn close_down_to(&mut self, keep: usize, index: usize) {
        for (opener, _) in self.open.drain(keep..).rev() {
            if let Some(closer) = opener.closer() {
                self.repairs.push(Repair::InsertBefore(index, closer));
            }
        }
    }

    /// How many brackets remain open when the parentheses and square brackets on top are closed.
    fn outside_lists(&self) -> usize {
        self.open
            .iter()
            .rposition(|&(token, _)| matches!(token, Token::OpenBrace | Token::InterpolationStart))
            .map_or(0, |brace| brace + 1)
    }

    /// The rest of a line is lost behind a broken string, its closing brackets too; the string is
    /// reported already.
    fn close_broken_line(&mut self, index: usize) {
        let keep = self.outside_lists();
        self.close_down_to(keep, index);
    }

    /// A line that begins with `let` and the like cannot be inside parentheses.
    fn close_before_definition(&mut self, index: usize, place: Span) {
        let keep = self.outside_lists();
        if keep < self.open.len() {
            self.report_unclosed(place, "a new statement begins here");
            self.close_down_to(keep, index - 1);
        }
    }

    fn close(&mut self, index: usize, (closer, place): Spanned) {
        if self.open.last().and_then(|&(token, _)| token.closer()) == Some(closer) {
            self.open.pop();
            return;
        }
        // A bracket in a string's interpolation has no partner outside.
        let partner = self
            .open
            .iter()
            .rposition(|&(token, _)| {
                token.closer() == Some(closer) || token == Token::InterpolationStart
            })
            .filter(|&at| self.open[at].0.closer() == Some(closer));
        if let Some(partner) = partner {
            let found = format!("but {closer} comes first");
            self.report_unclosed(place, &found);
            self.close_down_to(partner + 1, index);
            self.open.pop();
            return;
        }
        match self.open.last().copied() {
            Some((opener @ (Token::OpenParenthesis | Token::OpenBracket), start)) => {
                self.open.pop();
                let meant = opener.closer().unwrap_or(closer);
                self.repairs.push(Repair::Replace(index, meant));
                self.report(
                    Diagnostic::error(
                        Code::UnclosedBracket,
                        format!("{opener} is closed with {closer}"),
                    )
                    .label(start, "opened here")
                    .label(place, format!("expected {meant}")),
                );
            }
            _ => {
                self.repairs.push(Repair::Remove(index));
                self.report(
                    Diagnostic::error(Code::UnclosedBracket, format!("{closer} closes nothing"))
                        .label(place, "no bracket is open here that it could close"),
                );
            }
        }
    }

    fn close_at_end(&mut self, end: Span) {
        if !self.open.is_empty() {
            self.report_unclosed(end, "the file ends here");
            self.close_down_to(0, self.tokens.len());
        }
    }

    /// One error for all brackets that are missed at a place: it names the innermost.
    fn report_unclosed(&mut self, place: Span, found: &str) {
        let Some(&(opener, start)) = self.open.last() else {
            return;
        };
        let closer = opener.closer().unwrap_or(opener);
        self.report(
            Diagnostic::error(Code::UnclosedBracket, format!("{opener} is never closed"))
                .label(start, format!("its {closer} is missing"))
                .label(place, found),
        );
    }
}

fn apply(tokens: &[Spanned], repairs: &[Repair], end: Span) -> Vec<Spanned> {
    let mut repaired = Vec::with_capacity(tokens.len() + repairs.len());
    let mut repairs = repairs.iter().copied().peekable();
    for index in 0..=tokens.len() {
        let mut token = tokens.get(index).copied();
        while let Some(repair) = repairs.next_if(|repair| repair.index() == index) {
            match repair {
                Repair::Remove(_) => token = None,
                Repair::Replace(_, other) => token = token.map(|(_, span)| (other, span)),
                Repair::InsertBefore(_, closer) => {
                    let place = repaired.last().map_or(end, |&(_, span): &Spanned| Span {
                        start: span.end,
                        ..span
                    });
                    repaired.push((closer, place));
                }
            }
        }
        repaired.extend(token);
    }
    repaired
}

impl Repair {
    fn index(self) -> usize {
        match self {
            Repair::Remove(index) | Repair::Replace(index, _) | Repair::InsertBefore(index, _) => {
                index
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::lexer::lex;
    use super::*;
    use crate::diagnostic::SourceId;

    /// The brackets after the repair, and the messages.
    fn balanced(text: &str) -> (String, Vec<String>) {
        let source = SourceId(0);
        let mut lexed = lex(source, text);
        let end = Span::new(source, text.len(), text.len());
        if let Err(diagnostic) = balance(&mut lexed, end) {
            return (String::new(), vec![diagnostic.message]);
        }
        let brackets = lexed
            .tokens
            .iter()
            .filter(|(token, _)| token.is_closer() || token.closer().is_some())
            .map(|(token, _)| match token {
                Token::InterpolationStart => "«",
                Token::InterpolationEnd => "»",
                other => other.text(),
            })
            .collect();
        let messages = lexed.diagnostics.into_iter().map(|one| one.message);
        (brackets, messages.collect())
    }

    #[test]
    fn balanced_brackets_stay_as_they_are() {
        let (brackets, messages) = balanced("f(a[1], { g(\"{x[0]}\") })");
        assert_eq!(brackets, "([]{(«[]»)})");
        assert!(messages.is_empty());
    }

    #[test]
    fn missing_and_stray_brackets_are_repaired_with_one_error_each() {
        for (text, brackets, message) in [
            ("f(1, [2, 3", "([])", "`[` is never closed"),
            ("{ f(1 }", "{()}", "`(` is never closed"),
            ("(1, 2]", "()", "`(` is closed with `]`"),
            ("[1, 2)", "[]", "`[` is closed with `)`"),
            ("1 + 2)", "", "`)` closes nothing"),
            ("}", "", "`}` closes nothing"),
            ("(1}", "()", "`(` is closed with `}`"),
            ("f(\"{)}\")", "(«»)", "`)` closes nothing"),
            ("f(1\nlet a = [2]", "()[]", "`(` is never closed"),
            ("{ f([1\nlet a = 2 }", "{([])}", "`[` is never closed"),
            ("\"{f(x}\"", "«()»", "`(` is never closed"),
        ] {
            let (repaired, messages) = balanced(text);
            assert_eq!(repaired, brackets, "{text}");
            assert_eq!(messages, [message], "{text}");
        }
    }

    #[test]
    fn a_broken_string_takes_its_line_s_brackets_with_it() {
        let (brackets, messages) = balanced("print(f(\"a))\nprint(1)");
        assert_eq!(brackets, "(())()");
        assert_eq!(messages, ["a string ends on the line on which it begins"]);
        let (brackets, messages) = balanced("print(\"a");
        assert_eq!(brackets, "()");
        assert_eq!(messages.len(), 1);
    }

    #[test]
    fn nesting_up_to_the_limit_passes_and_beyond_it_is_one_error() {
        let nested = |depth: usize| "(".repeat(depth) + "1" + &")".repeat(depth);
        let (brackets, messages) = balanced(&nested(MAXIMUM_BRACKETS));
        assert_eq!((brackets.len(), messages.len()), (2 * MAXIMUM_BRACKETS, 0));
        let (_, messages) = balanced(&nested(10_000));
        assert_eq!(messages, ["brackets are nested deeper than 256 levels"]);
    }
}
