//! Which line ends end a statement.
//!
//! A line end counts except inside `( )` and `[ ]`, after an operator or another word that wants
//! more, and before a line that begins with something that cannot start a statement. Inside
//! `{ }` it counts again, wherever the braces stand. The pass also marks the parameters of `x -> …`
//! and `(x, y) -> …`, so that the parser need not read on to know what a `(` begins.

use super::token::{Spanned, Token};

/// Drops the line ends that end nothing. The brackets must be balanced.
pub(super) fn drop_insignificant_newlines(tokens: &mut Vec<Spanned>) {
    let mut open: Vec<Token> = Vec::new();
    let mut kept = 0_usize;
    for index in 0..tokens.len() {
        let (token, _) = tokens[index];
        if token == Token::Newline {
            let in_list = matches!(
                open.last(),
                Some(Token::OpenParenthesis | Token::OpenBracket | Token::InterpolationStart)
            );
            let after = kept
                .checked_sub(1)
                .is_none_or(|before| tokens[before].0.wants_more());
            let next = tokens.get(index + 1).map(|&(next, _)| next);
            let before = next.is_some_and(Token::continues_statement);
            // After a statement that was left unfinished a new one begins all the same, so that
            // one mistake does not spoil two statements.
            let definition = kept > 0 && next.is_some_and(Token::starts_definition);
            if in_list || (after && !definition) || before {
                continue;
            }
        } else if token.closer().is_some() {
            open.push(token);
        } else if token.is_closer() {
            open.pop();
        }
        tokens[kept] = tokens[index];
        kept += 1;
    }
    tokens.truncate(kept);
}

/// Turns a name before `->` into [`Token::LambdaName`], and a `(` whose `)` stands before `->`
/// into [`Token::LambdaParenthesis`]. The brackets must be balanced.
pub(super) fn mark_functions(tokens: &mut [Spanned]) {
    let mut open: Vec<usize> = Vec::new();
    for index in 0..tokens.len() {
        let (token, _) = tokens[index];
        let arrow = matches!(tokens.get(index + 1), Some((Token::Arrow, _)));
        if token.closer().is_some() {
            open.push(index);
        } else if token.is_closer() {
            let opener = open.pop();
            if arrow
                && token == Token::CloseParenthesis
                && let Some(opener) = opener
            {
                tokens[opener].0 = Token::LambdaParenthesis;
            }
        } else if arrow && token == Token::Name {
            tokens[index].0 = Token::LambdaName;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::lexer::lex;
    use super::*;
    use crate::diagnostic::SourceId;

    /// The text with a `¶` for each line end that counts and a space for each that does not.
    fn laid_out(text: &str) -> String {
        let mut tokens = lex(SourceId(0), text).tokens;
        drop_insignificant_newlines(&mut tokens);
        let words: Vec<&str> = tokens
            .iter()
            .map(|&(token, span)| match token {
                Token::Newline => "¶",
                _ => &text[span.start as usize..span.end as usize],
            })
            .collect();
        words.join(" ")
    }

    #[test]
    fn a_line_end_ends_a_statement() {
        assert_eq!(laid_out("a\nb\n\n\n# note\nc"), "a ¶ b ¶ c");
        assert_eq!(laid_out("a\n-b\nnot c\n!d"), "a ¶ - b ¶ not c ¶ ! d");
        assert_eq!(laid_out("f\n(a)\n[b]"), "f ¶ ( a ) ¶ [ b ]");
    }

    #[test]
    fn nothing_ends_inside_parentheses_and_square_brackets() {
        assert_eq!(laid_out("f(\na\n,\n[b\n]\n)\nc"), "f ( a , [ b ] ) ¶ c");
    }

    #[test]
    fn braces_inside_parentheses_bring_line_ends_back() {
        assert_eq!(laid_out("f(\n{\na\nb\n}\n)\nc"), "f ( { ¶ a ¶ b ¶ } ) ¶ c");
    }

    #[test]
    fn an_operator_at_the_end_of_a_line_wants_the_next() {
        for operator in [
            "+", "-", "*", "/", "%", "@", "^", "|", "&", "\\", "!", "==", "<", "=", "->", "|>",
            "..", ",", "and", "or", "not", "with", "by", "in", "over", "then", "else",
        ] {
            assert_eq!(
                laid_out(&format!("a {operator}\nb")),
                format!("a {operator} b")
            );
        }
    }

    #[test]
    fn an_operator_at_the_start_of_a_line_belongs_to_the_line_before() {
        for operator in [
            ".", "|>", "*", "/", "%", "@", "+", "^", "|", "&", "\\", "==", "!=", "<", "<=", ">",
            ">=", "..", "->", "and", "or", "then", "else", "with", "over", "by", "in",
        ] {
            assert_eq!(
                laid_out(&format!("a\n\n{operator} b")),
                format!("a {operator} b")
            );
        }
    }

    #[test]
    fn a_definition_begins_even_where_the_line_before_wants_more() {
        assert_eq!(laid_out("let a =\nlet b = 1"), "let a = ¶ let b = 1");
    }

    #[test]
    fn parameters_before_an_arrow_are_marked() {
        let text = "x -> (y, (1)) + ([a, b], k = (2)) -> (z)";
        let mut tokens = lex(SourceId(0), text).tokens;
        mark_functions(&mut tokens);
        let marked: Vec<u32> = tokens
            .iter()
            .filter(|(token, _)| matches!(token, Token::LambdaName | Token::LambdaParenthesis))
            .map(|(_, span)| span.start)
            .collect();
        assert_eq!(marked, [0, 16]);
    }
}
