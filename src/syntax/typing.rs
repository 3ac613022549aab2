//! Questions about text that is being typed, answered by the lexer alone: whether it waits for
//! another line, and how to write it with another name.

use super::lexer::lex;
use super::token::{Spanned, Token};
use crate::diagnostic::SourceId;

/// Whether text that is typed line by line is to be read as it is. It is not where a bracket is open,
/// where the last word wants an operand behind it, and where a doc comment waits for its definition.
///
/// Takes time linear in the text.
pub fn is_complete(text: &str) -> bool {
    let lexed = lex(SourceId(0), text);
    let mut open = Vec::new();
    for &(token, _) in &lexed.tokens {
        if let Some(closer) = token.closer() {
            open.push(closer);
        } else if token.is_closer() && open.pop() != Some(token) {
            // This is a mistake, which no further line repairs.
            return true;
        }
    }
    let words = lexed.tokens.iter().rev();
    let last = words
        .map(|&(token, _)| token)
        .find(|token| *token != Token::Newline);
    let ends_with_documentation = || {
        let line = text.trim_end().lines().next_back().unwrap_or_default();
        line.trim_start().starts_with("##")
    };
    open.is_empty() && !last.is_some_and(Token::wants_more) && !ends_with_documentation()
}

/// The text with `new` in place of every name `old` that is not a property.
pub fn renamed(text: &str, old: &str, new: &str) -> String {
    let lexed = lex(SourceId(0), text);
    let mut written = String::with_capacity(text.len());
    let mut done = 0;
    let mut before = None;
    for &(token, span) in &lexed.tokens {
        let (start, end) = (span.start as usize, span.end as usize);
        if token == Token::Name && before != Some(Token::Dot) && &text[start..end] == old {
            written += &text[done..start];
            written += new;
            done = end;
        }
        before = Some(token);
    }
    written + &text[done..]
}

/// Whether the name stands in the text, other than as a property.
pub fn mentions(text: &str, name: &str) -> bool {
    let lexed = lex(SourceId(0), text);
    let says = |&(token, span): &Spanned| {
        token == Token::Name && &text[span.start as usize..span.end as usize] == name
    };
    let after_dot = |place: usize| place > 0 && lexed.tokens[place - 1].0 == Token::Dot;
    let mut tokens = lexed.tokens.iter().enumerate();
    tokens.any(|(place, token)| says(token) && !after_dot(place))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn open_brackets_operators_and_doc_comments_want_more() {
        for text in [
            "f(",
            "[1,\n2",
            "fn f(x) {",
            "1 +",
            "let a =\n",
            "a |>",
            "## what it is",
            "if a then",
            "f({",
            "field f(x, y) over -1..1 =  # note",
        ] {
            assert!(!is_complete(text), "{text}");
        }
        for text in [
            "",
            "1",
            "f(1)",
            "f)",
            "(]",
            "fn f(x) {\nx\n}",
            "# note",
            "\"(\"",
            "\"{\"",
            "## a\nlet b = 1",
            "a; ",
            "\"unclosed",
        ] {
            assert!(is_complete(text), "{text}");
        }
    }

    #[test]
    fn names_change_and_other_text_stays() {
        let text = "ans + \"ans {ans}\" + m.ans + answer # ans";
        let expected = "ans1 + \"ans {ans1}\" + m.ans + answer # ans";
        assert_eq!(renamed(text, "ans", "ans1"), expected);
        assert!(mentions(text, "ans") && !mentions("m.ans + answer", "ans"));
    }
}
