//! What a text says of the names that it defines, read from its words.

use std::sync::Arc;

use super::complete::Kind;
use super::scan::{Bound, Scan, Sort};
use super::surroundings::{Known, parameters};
use crate::syntax::words::words;

/// The longest line that is shown of a definition, in characters.
const LONGEST_LINE: usize = 80;

/// What the text says of a name that it binds.
pub(super) fn known(scan: &Scan<'_>, bound: &Bound) -> Known {
    let name = &scan.text[bound.range.clone()];
    let kind = match bound.sort {
        Sort::Parameter => Kind::Parameter,
        Sort::Setting => Kind::Setting,
        Sort::Module => Kind::Module,
        Sort::Function => Kind::Function,
        Sort::Field => Kind::Field,
        Sort::Value | Sort::Local => Kind::Variable,
    };
    if bound.sort == Sort::Local {
        return Known::new(name, kind, "bound here");
    }
    let start = scan
        .words
        .get(bound.statement)
        .map_or(0, |word| word.range.start);
    let head = head(&scan.text[start..]);
    let mut known = Known::new(name, kind, head);
    if bound.sort == Sort::Function {
        known.parameters = parameters(&scan.text[bound.range.start..]);
    }
    known.documentation = documentation(&scan.text[..start]);
    known
}

/// What a text defines for those who import it.
pub(super) fn definitions(text: &str) -> Vec<Known> {
    let mut words = words(text);
    words.retain(|word| !word.kind.is_comment());
    // Seen from its beginning, everything comes later.
    let scan = Scan::new(text, &words, 0);
    scan.definitions()
        .map(|bound| known(&scan, bound))
        .collect()
}

/// The beginning of a definition: its first line, without the body of a function.
fn head(text: &str) -> String {
    let line = text.lines().next().unwrap_or_default();
    let line = line.strip_suffix('{').unwrap_or(line).trim_end();
    match line.char_indices().nth(LONGEST_LINE) {
        Some((end, _)) => format!("{}…", line[..end].trim_end()),
        None => line.to_owned(),
    }
}

/// The `##` lines right above a place.
fn documentation(before: &str) -> Option<Arc<str>> {
    let before = before.strip_suffix('\n')?;
    let lines = before.rsplit('\n').map(str::trim);
    let mut lines: Vec<&str> = lines
        .map_while(|line| line.strip_prefix("##"))
        .map(|line| line.strip_prefix(' ').unwrap_or(line))
        .collect();
    lines.reverse();
    (!lines.is_empty()).then(|| Arc::from(lines.join("\n")))
}
