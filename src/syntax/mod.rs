//! From text to tree.
//!
//! [`parse`] never fails: it returns a [`tree::Tree`], with error nodes where it could not
//! understand, and the list of what is wrong. On the way the text becomes tokens (`lexer`),
//! brackets find their partners (`brackets`), line ends that end nothing go (`layout`), what stands
//! side by side without an operator is reported (`adjacency`), the depth is bounded (`nesting`) and
//! the tree is built (`parser`). logos and chumsky are known to this room only.

mod adjacency;
mod brackets;
mod layout;
mod lexer;
mod nesting;
mod number;
mod parser;
mod token;
pub mod tree;
mod typing;
pub mod walk;
pub mod words;

use crate::diagnostic::{Code, Diagnostic, SourceId, Span};
use token::{Spanned, Token};
use tree::{Expression, StatementKind, Tree};
pub use typing::{is_complete, mentions, renamed};

/// The most diagnostics that [`parse`] gives; the last one then says that there were more.
const MAXIMUM_DIAGNOSTICS: usize = 50;

/// The most diagnostics that one pass collects. It is larger, because some of them turn out to be
/// the consequence of others.
const MAXIMUM_COLLECTED: usize = 1_000;

/// A tree and what is wrong with its text.
#[derive(Clone, Debug)]
pub struct Parsed {
    /// The tree, with error nodes for what was not understood.
    pub tree: Tree,
    /// What is wrong, in the order of the text; the tree is whole if there is nothing.
    pub diagnostics: Vec<Diagnostic>,
}

/// Parses a whole file.
///
/// Takes time linear in the text, and recursion over the tree is safe: it is at most 2,000 levels
/// deep.
pub fn parse(source: SourceId, text: &str) -> Parsed {
    let mut lexed = lexer::lex(source, text);
    let end = text.trim_end().len();
    let end = Span::new(source, end, end);
    let mut tree = Tree {
        statements: Vec::new(),
        comments: std::mem::take(&mut lexed.comments),
    };
    if let Err(diagnostic) = brackets::balance(&mut lexed, end) {
        lexed.diagnostics.push(*diagnostic);
        let diagnostics = in_order(lexed.diagnostics);
        return Parsed { tree, diagnostics };
    }
    let mut tokens = lexed.tokens;
    let mut diagnostics = lexed.diagnostics;
    layout::drop_insignificant_newlines(&mut tokens);
    layout::mark_functions(&mut tokens);
    diagnostics.extend(adjacency::implicit_products(text, &tokens));
    if let Err(diagnostic) = nesting::check(&tokens) {
        diagnostics.push(*diagnostic);
        let diagnostics = in_order(diagnostics);
        return Parsed { tree, diagnostics };
    }
    let (statements, mistakes) = parser::parse(text, &tokens, &lexed.documentation, end);
    tree.statements = statements;
    diagnostics = with_independent(diagnostics, mistakes, &tokens);
    let diagnostics = in_order(diagnostics);
    Parsed { tree, diagnostics }
}

/// Parses one expression, as given on a command line.
///
/// # Errors
///
/// What is wrong with the text, or where it is more than one expression or none.
pub fn parse_expression(source: SourceId, text: &str) -> Result<Expression, Vec<Diagnostic>> {
    let Parsed { tree, diagnostics } = parse(source, text);
    if !diagnostics.is_empty() {
        return Err(diagnostics);
    }
    let whole = Span::new(source, 0, text.len());
    let (message, span) = match &tree.statements[..] {
        [only] => match &only.kind {
            StatementKind::Expression(expression) => return Ok(expression.clone()),
            _ => ("expected an expression, found a statement", only.span),
        },
        [_, second, ..] => ("expected one expression, found several", second.span),
        [] => ("expected an expression, found nothing", whole),
    };
    Err(vec![
        Diagnostic::error(Code::UnexpectedToken, message).label(span, "expected one expression"),
    ])
}

/// Adds the parser's mistakes to what was reported before, except those in a part of the text in
/// which something was reported before: they are its consequence. A part reaches from one line end,
/// `;` or brace to the next.
fn with_independent(
    mut reported: Vec<Diagnostic>,
    mistakes: Vec<Diagnostic>,
    tokens: &[Spanned],
) -> Vec<Diagnostic> {
    if reported.is_empty() {
        return mistakes;
    }
    let borders: Vec<u32> = tokens
        .iter()
        .filter(|(token, _)| {
            matches!(
                token,
                Token::Newline | Token::Semicolon | Token::OpenBrace | Token::CloseBrace
            )
        })
        .map(|(_, span)| span.start)
        .collect();
    let part = |span: Span| borders.partition_point(|&border| border < span.start);
    let mut spoilt: Vec<usize> = reported
        .iter()
        .filter_map(Diagnostic::span)
        .map(part)
        .collect();
    spoilt.sort_unstable();
    reported.extend(mistakes.into_iter().filter(|mistake| {
        mistake
            .span()
            .is_none_or(|span| spoilt.binary_search(&part(span)).is_err())
    }));
    reported
}

/// Adds a diagnostic, unless a pass has found so many already that nobody will read this one.
fn report(diagnostics: &mut Vec<Diagnostic>, diagnostic: Diagnostic) {
    if diagnostics.len() < MAXIMUM_COLLECTED {
        diagnostics.push(diagnostic);
    }
}

/// Diagnostics in the order of the text, and not too many of them.
fn in_order(mut diagnostics: Vec<Diagnostic>) -> Vec<Diagnostic> {
    diagnostics.sort_by_key(|diagnostic| diagnostic.span().map(|span| span.start));
    if diagnostics.len() > MAXIMUM_DIAGNOSTICS {
        diagnostics.truncate(MAXIMUM_DIAGNOSTICS - 1);
        diagnostics.push(Diagnostic::error(
            Code::UnexpectedToken,
            "there are more mistakes than are shown",
        ));
    }
    diagnostics
}
