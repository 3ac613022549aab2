//! A bound on what the parser must hold open at once.
//!
//! Brackets are bounded already. What else nests to the right without a bracket is a chain of
//! prefix operators, of powers, of functions `x -> …` and of `if`. The parser recurses over these,
//! so their number is bounded before it starts. The count here is never too small, and it is
//! exact for plain chains; operators that nest to the left, as in a long sum, need no recursion
//! and are not counted.

use super::token::{Spanned, Token};
use crate::diagnostic::{Code, Diagnostic, Span};

/// How deep a tree may be, and what may be open at once while it is parsed.
pub(super) const MAXIMUM_DEPTH: u32 = 2_000;

/// What waits for its right end in one pair of brackets.
#[derive(Clone, Copy, Default)]
struct Waiting {
    /// Powers and the prefixes `-` and `!`: any looser operator ends them.
    tight: u32,
    /// `not`: ended by `and`, `or` and looser ones.
    negations: u32,
    /// Functions and `if`, and what waited when they began: only a separator ends them.
    heads: u32,
}

impl Waiting {
    fn total(self) -> u32 {
        self.tight + self.negations + self.heads
    }
}

/// Checks that no more than [`MAXIMUM_DEPTH`] operators nest to the right at any place.
///
/// # Errors
///
/// The one diagnostic that says where there are more.
pub(super) fn check(tokens: &[Spanned]) -> Result<(), Box<Diagnostic>> {
    let mut outer: Vec<Waiting> = Vec::new();
    let mut outer_total = 0;
    let mut waiting = Waiting::default();
    let mut after_operand = false;
    for &(token, span) in tokens {
        if token.closer().is_some() {
            outer_total += waiting.total() + 1;
            outer.push(waiting);
            waiting = Waiting::default();
        } else if token.is_closer() {
            waiting = outer.pop().unwrap_or_default();
            outer_total -= (waiting.total() + 1).min(outer_total);
        } else {
            waiting = step(waiting, token, after_operand);
        }
        after_operand = token.ends_operand();
        if outer_total + waiting.total() > MAXIMUM_DEPTH {
            return Err(Box::new(too_deep(span)));
        }
    }
    Ok(())
}

fn step(waiting: Waiting, token: Token, after_operand: bool) -> Waiting {
    use Token::*;
    match token {
        Caret => Waiting {
            tight: waiting.tight + 1,
            ..waiting
        },
        Minus | Bang if !after_operand => Waiting {
            tight: waiting.tight + 1,
            ..waiting
        },
        Not => Waiting {
            negations: waiting.negations + 1,
            ..waiting
        },
        Arrow | If => Waiting {
            heads: waiting.total() + 1,
            ..Waiting::default()
        },
        And | Or | Pipe | With | Then | Else | For | In => Waiting {
            heads: waiting.heads,
            ..Waiting::default()
        },
        Comma | Newline | Semicolon | Assign => Waiting::default(),
        _ if token.continues_statement() || token == Minus => Waiting {
            tight: 0,
            ..waiting
        },
        _ => waiting,
    }
}

/// The error for an expression that is nested too deep, at `span`.
pub(super) fn too_deep(span: Span) -> Diagnostic {
    Diagnostic::error(
        Code::TooDeep,
        format!("an expression is nested deeper than {MAXIMUM_DEPTH} levels"),
    )
    .label(span, "one level too many")
    .help("use a list and `sum`, or give names to parts of it with `let`")
}

#[cfg(test)]
mod tests {
    use super::super::lexer::lex;
    use super::*;
    use crate::diagnostic::SourceId;

    fn passes(text: &str) -> bool {
        check(&lex(SourceId(0), text).tokens).is_ok()
    }

    #[test]
    fn chains_to_the_right_are_bounded() {
        for link in [
            "-",
            "!",
            "not ",
            "x^",
            "x -> ",
            "if a then b else ",
            "- x -> 1 + ",
        ] {
            assert!(passes(&(link.repeat(900) + "x")), "{link}");
            assert!(!passes(&(link.repeat(2_001) + "x")), "{link}");
        }
    }

    #[test]
    fn what_is_finished_does_not_count() {
        for link in [
            "-x^2 - ",
            "not a and ",
            "1 + ",
            "x -> -x, ",
            "if a then b else c\n",
            "f(-x^2) * ",
            "a = -b; ",
        ] {
            assert!(passes(&(link.repeat(5_000) + "x")), "{link}");
        }
    }

    #[test]
    fn a_chain_is_counted_across_brackets() {
        let text = "-".repeat(1_500) + "(" + &"-".repeat(600) + "x)";
        assert!(!passes(&text));
    }
}
