//! The reference of the language's functions and of its library, as Markdown: made of the tables
//! and doc comments themselves, so that it says what the program does.

use super::builtin::{self, Builtin};
use crate::library::{self, Entry};

/// Everything, in sections.
pub fn reference() -> String {
    let mut text = String::from("# Reference\n");
    for (title, table) in builtin::sections() {
        text += &format!("\n## {title}\n");
        for function in table {
            text += &of_builtin(function);
        }
    }
    let mut section = "";
    for entry in library::entries() {
        if entry.section != section {
            section = entry.section;
            text += &format!("\n## {section}\n");
        }
        text += &of_entry(entry);
    }
    text
}

/// What is said of a name: a function's or definition's own text, or all of a namespace.
pub fn about(name: &str) -> Option<String> {
    if let Some(function) = builtin::find(name) {
        return Some(of_builtin(function).trim_start().to_string());
    }
    let entries = library::entries();
    let text: String = match entries.iter().find(|entry| entry.full_name() == name) {
        Some(entry) => of_entry(entry),
        None => {
            let inside = entries.iter().filter(|e| e.namespace == Some(name));
            inside.map(of_entry).collect()
        }
    };
    (!text.is_empty()).then(|| text.trim_start().to_string())
}

/// All names that something is said of.
pub fn names() -> Vec<String> {
    let builtins = builtin::all().iter().map(|b| b.name.to_string());
    let namespaces = library::namespaces().map(|namespace| namespace.name.to_string());
    let entries = library::entries().iter().map(Entry::full_name);
    builtins.chain(namespaces).chain(entries).collect()
}

fn of_builtin(function: &Builtin) -> String {
    item(&function.signature(), [function.documentation])
}

fn of_entry(entry: &Entry) -> String {
    item(&signature(entry), entry.documentation())
}

/// How a definition of the library is called: `namespace.name(parameters)`.
pub fn signature(entry: &Entry) -> String {
    let prefix = entry.namespace.map(|name| format!("{name}."));
    format!("{}{}", prefix.unwrap_or_default(), head(entry))
}

/// A definition up to its body, without the word before its name.
fn head(entry: &Entry) -> &'static str {
    let mut lines = entry.text.lines();
    let line = lines
        .find(|line| !line.starts_with('#'))
        .unwrap_or_default();
    let line = line.split_once(' ').map_or(line, |(_, rest)| rest);
    let end = body(line).unwrap_or(line.len());
    line[..end].trim_end()
}

/// Where the body begins: at the first `=` or `{` outside of brackets.
fn body(line: &str) -> Option<usize> {
    let mut depth = 0;
    let mut letters = line.char_indices();
    let found = letters.find(|&(_, letter)| {
        match letter {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            _ => {}
        }
        depth == 0 && matches!(letter, '=' | '{')
    });
    found.map(|(place, _)| place)
}

/// A heading and what is said: sentences, then the lines `Kind:`, `Source:` … as a list, with
/// examples as code.
fn item<'a>(heading: &str, lines: impl IntoIterator<Item = &'a str>) -> String {
    let mut text = format!("\n### `{heading}`\n\n");
    let mut in_list = false;
    for line in lines {
        match line.split_once(": ") {
            Some((
                label @ ("Kind" | "Source" | "Example" | "Bound" | "Exact" | "Exact outside"),
                rest,
            )) => {
                if !in_list {
                    text += "\n";
                }
                in_list = true;
                text += &match label {
                    "Kind" | "Source" => format!("* {label}: {rest}\n"),
                    _ => format!("* {label}: `{rest}`\n"),
                };
            }
            // A label's sentence can go on.
            _ if in_list => text += &format!("  {line}\n"),
            _ => text += &format!("{line}\n"),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_has_a_text() {
        let whole = reference();
        for name in names() {
            let text = about(&name).unwrap_or_default();
            assert!(text.starts_with("### `"), "{name}: {text}");
            let bare = name.rsplit('.').next().unwrap_or(&name);
            assert!(text.contains(bare), "{name}: {text}");
            assert!(whole.contains(text.lines().next().unwrap_or("?")), "{name}");
            // A heading and at least a sentence.
            assert!(text.lines().count() >= 3, "{name}: {text}");
        }
        assert!(about("no_such_name").is_none());
    }

    #[test]
    fn headings_end_where_bodies_begin() {
        let sphere = about("sphere").unwrap_or_default();
        let heading = sphere.lines().next().unwrap_or_default();
        assert!(
            heading.starts_with("### `sphere(") && heading.ends_with(")`"),
            "{heading}"
        );
        let union = about("union").unwrap_or_default();
        assert!(union.starts_with("### `union(shapes.., k = 0)`"), "{union}");
    }
}
