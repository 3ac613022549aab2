//! Commands about files, and taking back.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::super::output::escaped;
use super::session::Repl;
use crate::diagnostic::{Code, Sources};
use crate::file;
use crate::language::builtin::file_failure;
use crate::syntax::tree::{Statement, StatementKind};

/// `:load FILE`
pub(super) fn load(repl: &mut Repl, words: &str) -> Result<(), u8> {
    match path(words) {
        Some(path) => repl.load(&path),
        None => Err(repl.refuse(Code::Usage, "a file is needed", "as in `:load scene.imp`")),
    }
}

/// `:reload`
pub(super) fn reload(repl: &mut Repl) -> Result<(), u8> {
    match repl.file.clone() {
        Some(file) => repl.load(&file),
        None => {
            let help = "`:load FILE` loads one";
            Err(repl.refuse(Code::Usage, "no file has been loaded", help))
        }
    }
}

/// `:save FILE`; what is there is replaced only if that is said.
pub(super) fn save(repl: &mut Repl, words: &str, replaces: bool) -> Result<(), u8> {
    let Some(path) = path(words) else {
        return Err(repl.refuse(Code::Usage, "a file is needed", "as in `:save scene.imp`"));
    };
    let name = escaped(&path.display().to_string());
    let is_there = match std::fs::symlink_metadata(&path) {
        Ok(_) => true,
        Err(error) => error.kind() != ErrorKind::NotFound,
    };
    if is_there && !replaces {
        let message = format!("`{name}` is there already");
        let help = format!("`:save! {name}` replaces it");
        return Err(repl.refuse(Code::CannotWrite, message, &help));
    }
    let statements = repl.workspace.session.statements();
    let text = text(&statements, &repl.workspace.heard.sources.borrow());
    file::write_text(&path, &text)
        .map_err(|error| repl.workspace.fail(&[*file_failure(&error)]))?;
    repl.tell(&format!("wrote {name}"));
    let imports = |statement: &Statement| matches!(statement.kind, StatementKind::Import { .. });
    if statements.iter().any(imports) {
        let folder = |path: &Path| path.parent().map(Path::to_owned).unwrap_or_default();
        let own = repl.file.as_deref().map(folder).unwrap_or_default();
        if own != folder(&path) {
            repl.tell("its imports start at its own folder, which is another than before");
        }
    }
    Ok(())
}

/// `:undo`
pub(super) fn undo(repl: &mut Repl) -> Result<(), u8> {
    match repl.undo() {
        Some(text) => repl.tell(&format!("taken back: {}", escaped(&text))),
        None => return Err(repl.refuse(Code::Usage, "there is nothing to take back", "")),
    }
    Ok(())
}

/// A path as it is typed, with or without quotes.
fn path(words: &str) -> Option<PathBuf> {
    let words = words.trim();
    let inner = words
        .strip_prefix('"')
        .and_then(|words| words.strip_suffix('"'));
    let words = inner.unwrap_or(words);
    (!words.is_empty()).then(|| PathBuf::from(words))
}

/// The statements as a file: each as it was typed, with the comments right above it.
fn text(statements: &[Statement], sources: &Sources) -> String {
    let mut text = String::new();
    let mut before: Option<&Statement> = None;
    for statement in statements {
        let source = &sources.get(statement.span.source).text;
        let start = statement.span.start as usize;
        let after = before
            .filter(|before| {
                before.span.source == statement.span.source && before.span.end as usize <= start
            })
            .map_or(0, |before| before.span.end as usize);
        // What stands behind the statement before, on its line, is about that one.
        let rest = source[after..start]
            .find('\n')
            .map_or(start, |end| after + end + 1);
        let after = if after == 0 { 0 } else { rest };
        let comments = comments_above(&source[after..start]);
        match &statement.documentation {
            // The statement was written anew, without the comment of the one that it replaces.
            Some(documentation) if comments.is_empty() => {
                for line in documentation.lines() {
                    text += format!("## {line}").trim_end();
                    text += "\n";
                }
            }
            _ => text += comments,
        }
        text += &source[start..statement.span.end as usize];
        text += "\n";
        before = Some(statement);
    }
    text
}

/// The lines at the end of a text that are comments, if it ends with a line's end.
fn comments_above(text: &str) -> &str {
    let Some(last) = text.rfind('\n') else {
        return "";
    };
    // What stands before the statement on its own line is no comment above it.
    if !text[last + 1..].trim().is_empty() {
        return "";
    }
    let mut begin = last + 1;
    for line in text[..=last].split_inclusive('\n').rev() {
        if !line.trim_start().starts_with('#') {
            break;
        }
        begin -= line.len();
    }
    &text[begin..=last]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::syntax::parse;

    #[test]
    fn comments_right_above_go_along() {
        let written = "# title\n\n# one\n## two\nlet a = 1; let b = 2 # behind\nlet c = 3\n";
        let mut sources = Sources::default();
        let id = sources.add("a", written);
        let statements = parse(id, written).tree.statements;
        let expected = "# one\n## two\nlet a = 1\nlet b = 2\nlet c = 3\n";
        assert_eq!(text(&statements, &sources), expected);
    }
}
