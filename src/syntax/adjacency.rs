//! Things that stand side by side as if that meant a product.
//!
//! `2x`, `2(x + 1)` and `(a)(…)` look alike to a mathematician, but `f(x)(y)` is a call: so Imp
//! has no implicit multiplication, and this pass says what to write. It looks at neighbours only
//! and leaves the tokens as they are.

use super::token::{Spanned, Token};
use crate::diagnostic::{Code, Diagnostic, Span, shorten};

/// Reports each number before a name or `(`, and each `)` before a name or number, except where
/// the `)` ends the parameters of a definition or the condition of an `if` or `while`: there
/// something else is missing.
pub(super) fn implicit_products(text: &str, tokens: &[Spanned]) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    let mut open: Vec<usize> = Vec::new();
    for (index, pair) in tokens.windows(2).enumerate() {
        let [(left, left_span), (right, right_span)] = *pair else {
            continue;
        };
        let opener = match left {
            _ if left.closer().is_some() => {
                open.push(index);
                None
            }
            _ if left.is_closer() => open.pop(),
            _ => None,
        };
        let is_name = matches!(right, Token::Name | Token::LambdaName);
        let product = match left {
            Token::Number => {
                is_name || matches!(right, Token::OpenParenthesis | Token::LambdaParenthesis)
            }
            Token::CloseParenthesis => {
                (is_name || right == Token::Number)
                    && opener.is_some_and(|opener| !belongs_to_statement(&tokens[..opener]))
            }
            _ => false,
        };
        if product {
            let diagnostic = describe(text, opener, tokens, left_span, right_span, right);
            super::report(&mut diagnostics, diagnostic);
        }
    }
    diagnostics
}

/// Whether the parenthesis behind these tokens begins the parameters of a definition or a
/// condition.
fn belongs_to_statement(before: &[Spanned]) -> bool {
    matches!(
        before,
        [.., (Token::Fn | Token::Field, _), (Token::Name, _)] | [.., (Token::If | Token::While, _)]
    )
}

fn describe(
    text: &str,
    opener: Option<usize>,
    tokens: &[Spanned],
    left: Span,
    right: Span,
    right_token: Token,
) -> Diagnostic {
    let slice = |span: Span| &text[span.start as usize..span.end as usize];
    let attached = left.end == right.start;
    if opener.is_none() && attached && right_token == Token::Name {
        let (number, name) = (slice(left), slice(right));
        if name.starts_with('_') {
            return Diagnostic::error(Code::BadNumber, "`_` in a number stands between two digits")
                .label(left.to(right), "malformed number");
        }
        if number.ends_with("deg") || number.ends_with("turn") {
            let written = format!("{number}{name}");
            return Diagnostic::error(
                Code::BadNumber,
                format!("`{}` is not a number", shorten(&written)),
            )
            .label(left.to(right), "unknown unit")
            .help("the units of angles are `deg` and `turn`, as in `45deg`");
        }
    }
    let start = opener.map_or(left, |opener| tokens[opener].1.to(left));
    let first = shorten(slice(start));
    let second = match right_token {
        Token::OpenParenthesis | Token::LambdaParenthesis => "(…)".into(),
        _ => shorten(slice(right)),
    };
    Diagnostic::error(
        Code::ImplicitMultiplication,
        "a product is written with `*`",
    )
    .label(left.to(right), "`*` is missing here")
    .help(format!("write `{first}*{second}`"))
}

#[cfg(test)]
mod tests {
    use super::super::layout::mark_functions;
    use super::super::lexer::lex;
    use super::*;
    use crate::diagnostic::SourceId;

    fn found(text: &str) -> Vec<(Code, Option<String>)> {
        let mut tokens = lex(SourceId(0), text).tokens;
        mark_functions(&mut tokens);
        implicit_products(text, &tokens)
            .into_iter()
            .map(|diagnostic| (diagnostic.code, diagnostic.help))
            .collect()
    }

    #[test]
    fn products_without_a_star_are_reported_with_what_to_write() {
        for (text, help) in [
            ("2x", "write `2*x`"),
            ("2 x", "write `2*x`"),
            ("2(x + 1)", "write `2*(…)`"),
            ("45deg x", "write `45deg*x`"),
            ("(a + b)c", "write `(a + b)*c`"),
            ("(a) 2", "write `(a)*2`"),
            ("f(x) y", "write `(x)*y`"),
            ("2x -> x", "write `2*x`"),
        ] {
            let expected = (Code::ImplicitMultiplication, Some(help.to_owned()));
            assert_eq!(found(text), [expected], "{text}");
        }
    }

    #[test]
    fn calls_and_statements_are_not_products() {
        for text in [
            "f(x)(y)",
            "x(y)",
            "a[1](2)",
            "fn f(x) x",
            "field f(x) x",
            "if (a) b",
            "(a) then b",
            "(a)\nb",
            "1..2",
            "2 then x",
            "[a for x in (b) if c]",
        ] {
            assert_eq!(found(text), [], "{text}");
        }
    }

    #[test]
    fn malformed_numbers_are_not_called_products() {
        for text in ["1_", "1__0", "45degrees", "1turns"] {
            let found = found(text);
            assert_eq!(found.len(), 1, "{text}");
            assert_eq!(found[0].0, Code::BadNumber, "{text}");
        }
    }
}
