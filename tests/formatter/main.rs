//! The formatter: what it makes of each construct and of comments in odd places, that it changes
//! nothing but the layout, and that formatting twice is formatting once.

#[path = "../common/programs.rs"]
mod programs;

mod golden;
mod layout;
mod sentences;
mod sources;

use imp::diagnostic::{SourceId, Sources};
use imp::formatter::format;
use imp::syntax::parse;

/// The formatted text.
fn formatted(text: &str) -> String {
    format(SourceId(0), text).unwrap_or_else(|errors| panic!("{}: {text}", errors[0].message))
}

/// A tree as text, without places; and the comments.
fn meaning(text: &str) -> Option<(String, Vec<String>)> {
    let id = Sources::default().add("test.imp", text);
    let parsed = parse(id, text);
    if !parsed.diagnostics.is_empty() {
        return None;
    }
    let comments = parsed.tree.comments.iter();
    let comments = comments.map(|span| text[span.start as usize..span.end as usize].to_owned());
    let debug = format!("{:?}", parsed.tree.statements);
    Some((without_places(&debug), comments.collect()))
}

/// Removes the places from a tree that is written out.
fn without_places(debug: &str) -> String {
    let mut parts = debug.split("Span { source: SourceId(0), ");
    let first = parts.next().unwrap_or("").to_owned();
    parts.fold(first, |text, part| {
        let (_, rest) = part.split_once('}').unwrap();
        text + rest
    })
}

/// Checks that formatting keeps the meaning and the comments, and changes nothing a second time;
/// else says what is wrong. Texts with mistakes are left out: the result says whether it is one
/// without.
fn check(text: &str) -> Result<bool, String> {
    let Some(before) = meaning(text) else {
        return Ok(false);
    };
    let once = formatted(text);
    let twice = meaning(&once).map(|_| formatted(&once));
    let tidy = once.lines().all(|line| line.trim_end() == line)
        && !once.contains("\n\n\n")
        && !once.starts_with('\n');
    let wrong = match &twice {
        None => "is wrong",
        Some(_) if meaning(&once) != Some(before) => "means something else",
        Some(twice) if *twice != once => "changes again",
        Some(_) if !tidy => "has odd spaces",
        Some(_) => return Ok(true),
    };
    let twice = twice.unwrap_or_default();
    Err(format!(
        "{wrong}\n{text}\n--- once ---\n{once}\n--- twice ---\n{twice}"
    ))
}
