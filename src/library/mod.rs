//! The library of shapes and functions that is written in Imp itself: its texts, and where in
//! them each definition stands.
//!
//! Every definition begins in the first column, under the `##` lines that describe it. The index
//! is one pass over the text, made when the first session begins; a definition is parsed and
//! evaluated when its name is first looked up (`language/library.rs`), so what is not used costs
//! nothing. A file with a namespace is reached as `namespace.name`, the others by name alone.

use std::sync::{Arc, LazyLock};

/// One text of the library.
struct File {
    /// What stands before the dot; nothing for names that are visible everywhere.
    namespace: Option<&'static str>,
    /// What the file is about, for `help(namespace)` and the reference.
    title: &'static str,
    text: &'static str,
}

macro_rules! files {
    ($($namespace:expr, $title:literal, $path:literal;)*) => {
        const FILES: &[File] = &[$(File {
            namespace: $namespace,
            title: $title,
            text: include_str!($path),
        },)*];
    };
}

files! {
    None, "Plane figures", "plane.imp";
    None, "Solids", "solid.imp";
    None, "Combinations", "combine.imp";
    None, "Transformations", "transform.imp";
    None, "Fields", "field.imp";
    None, "Mathematics", "mathematics.imp";
    Some("ease"), "Easings: ways from 0 at t = 0 to 1 at t = 1", "ease.imp";
    Some("algebraic"), "Algebraic surfaces", "algebraic.imp";
}

/// One definition of the library.
#[derive(Debug)]
pub struct Entry {
    /// The name, without its namespace.
    pub name: Arc<str>,
    /// What stands before the dot.
    pub namespace: Option<&'static str>,
    /// The title of the file in which it stands.
    pub section: &'static str,
    /// The definition with the comments above it.
    pub text: &'static str,
}

impl Entry {
    /// The name as it is called: `namespace.name`.
    pub fn full_name(&self) -> String {
        match self.namespace {
            Some(namespace) => format!("{namespace}.{}", self.name),
            None => self.name.to_string(),
        }
    }

    /// The doc comment, line by line, without the signs of comments.
    pub fn documentation(&self) -> impl Iterator<Item = &'static str> {
        self.text
            .lines()
            .map_while(|line| line.strip_prefix("##"))
            .map(|line| line.strip_prefix(' ').unwrap_or(line))
    }
}

/// A namespace of the library.
#[derive(Clone, Copy, Debug)]
pub struct Namespace {
    /// What stands before the dot.
    pub name: &'static str,
    /// What it is about.
    pub title: &'static str,
}

/// The namespaces, in the order of the files.
pub fn namespaces() -> impl Iterator<Item = Namespace> {
    FILES.iter().filter_map(|file| {
        Some(Namespace {
            name: file.namespace?,
            title: file.title,
        })
    })
}

/// All definitions, in the order of the files and of their texts.
pub fn entries() -> &'static [Entry] {
    static ENTRIES: LazyLock<Vec<Entry>> =
        LazyLock::new(|| FILES.iter().flat_map(definitions).collect());
    &ENTRIES
}

/// The definitions of a file. One pass over its lines.
fn definitions(file: &'static File) -> Vec<Entry> {
    let mut entries = Vec::new();
    // The definition that is being read, and where it begins.
    let mut open: Option<(&'static str, usize)> = None;
    let mut comment = None;
    let mut at = 0;
    let mut close = |open: &mut Option<(&'static str, usize)>, end: usize| {
        if let Some((name, begin)) = open.take() {
            entries.push(Entry {
                name: Arc::from(name),
                namespace: file.namespace,
                section: file.title,
                text: file.text[begin..end].trim_end(),
            });
        }
    };
    for line in file.text.split_inclusive('\n') {
        if line.starts_with('#') {
            close(&mut open, at);
            comment = comment.or_else(|| line.starts_with("##").then_some(at));
        } else if let Some(name) = defined_name(line) {
            close(&mut open, at);
            open = Some((name, comment.take().unwrap_or(at)));
        } else {
            comment = None;
        }
        at += line.len();
    }
    close(&mut open, at);
    entries
}

/// The name that a line in the first column defines.
fn defined_name(line: &str) -> Option<&str> {
    let rest = ["fn ", "field ", "let "]
        .iter()
        .find_map(|word| line.strip_prefix(word))?;
    let end = rest.find(|letter: char| !(letter.is_alphanumeric() || letter == '_'));
    end.map(|end| &rest[..end])
}
