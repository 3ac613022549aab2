//! Tests of the grammar: what is parsed, as S-expressions.

mod expressions;
mod limits;
mod print;
mod recovery;
mod statements;

use crate::diagnostic::{Diagnostic, SourceId};
use crate::syntax::{Parsed, parse};

fn parsed(text: &str) -> Parsed {
    parse(SourceId(0), text)
}

/// The tree of a text without mistakes.
#[track_caller]
fn tree(text: &str) -> String {
    let Parsed { tree, diagnostics } = parsed(text);
    assert!(diagnostics.is_empty(), "{text}: {diagnostics:?}");
    print::statements(&tree.statements)
}

fn mistakes(text: &str) -> Vec<Diagnostic> {
    parsed(text).diagnostics
}

fn messages(text: &str) -> Vec<String> {
    let mistakes = mistakes(text);
    mistakes
        .into_iter()
        .map(|mistake| mistake.message)
        .collect()
}
