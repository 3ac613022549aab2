//! The formatter: a program in the one style, with the same meaning and the same comments.
//!
//! The tree says how words belong together, but what is written are the words of the text itself,
//! one after the other (`writer`): none can be lost, numbers and strings stay as they are, and every
//! comment stays between the words between which it was found. The rules for statements and
//! expressions (`statement`, `expression`) only put spaces and possible ends of lines between the
//! words; `document` chooses among these.
//!
//! The style:
//! * Four spaces a level, lines of at most 100 columns, at most one empty line in a row.
//! * Spaces around operators, but none around `^`, `..` and `.`; `*`, `/`, `%` and `@` stay as
//!   tight as they were written, `2*pi` or `2 * pi`.
//! * What does not fit is broken at the loosest operator, before it, or one argument or element a
//!   line with a comma behind the last. Sums, products and lists of numbers fill their lines.
//! * Outside of brackets a line must not begin with `-`: there a chain with a `-` in it is broken
//!   behind its operators.
//! * A value on the line below its `=` stays there, unless it has brackets to be broken in.
//! * A comma behind the last element keeps a list broken; a block stays on one line if it was
//!   written so and fits; parentheses stay.
//! * Comments stay on their lines or behind their code; those behind neighbouring lines are aligned.

mod document;
mod expression;
mod statement;
mod writer;

use crate::diagnostic::{Diagnostic, SourceId};
use crate::syntax::{parse, words};
use writer::Writer;

/// Formats a program. The result ends with a line's end, unless it is empty, and formatting it
/// again changes nothing. Takes time linear in the text.
///
/// # Errors
///
/// What is wrong with the text, as [`parse`] tells it.
pub fn format(source: SourceId, text: &str) -> Result<String, Vec<Diagnostic>> {
    let parsed = parse(source, text);
    if !parsed.diagnostics.is_empty() {
        return Err(parsed.diagnostics);
    }
    let words = words::spans(source, text);
    let mut writer = Writer::new(text, &words, &parsed.tree.comments);
    writer.file(&parsed.tree.statements);
    Ok(writer.finish())
}
