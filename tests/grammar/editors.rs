//! What editors read beside tree-sitter's grammar: the TextMate grammar and the extension for
//! Visual Studio Code, as far as one can see that they are whole without an editor.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::sentences::formal_grammar;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("grammar/vscode")
}

fn read(name: &str) -> String {
    std::fs::read_to_string(folder().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn json(name: &str) -> Value {
    serde_json::from_str(&read(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The strings of some keys, wherever in a value they stand.
fn strings<'value>(value: &'value Value, keys: &[&str], found: &mut Vec<&'value str>) {
    match value {
        Value::Array(values) => values.iter().for_each(|one| strings(one, keys, found)),
        Value::Object(entries) => {
            for (key, value) in entries {
                match value.as_str() {
                    Some(text) if keys.contains(&key.as_str()) => found.push(text),
                    _ => strings(value, keys, found),
                }
            }
        }
        _ => {}
    }
}

#[test]
fn every_file_that_the_manifest_names_is_there() {
    let manifest = json("package.json");
    let mut named = Vec::new();
    strings(
        &manifest["contributes"]["languages"],
        &["configuration"],
        &mut named,
    );
    strings(&manifest["contributes"]["grammars"], &["path"], &mut named);
    named.push(manifest["main"].as_str().expect("the main file"));
    assert_eq!(named.len(), 3);
    for name in named
        .iter()
        .chain(&["README.md", "LICENSE", ".vscodeignore"])
    {
        assert!(folder().join(name).is_file(), "{name}");
    }
    json("language-configuration.json");
    assert_eq!(read("LICENSE"), include_str!("../../LICENSE-MIT"));
    assert_eq!(manifest["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(manifest["license"], env!("CARGO_PKG_LICENSE"));
}

#[test]
fn the_extension_starts_the_language_server() {
    assert!(read("server.js").contains("{ command: program, args: ['lsp'] }"));
    let manifest = json("package.json");
    let default = &manifest["contributes"]["configuration"]["properties"]["imp.path"]["default"];
    assert_eq!(default, env!("CARGO_PKG_NAME"));
    let mut commands = Vec::new();
    strings(
        &manifest["contributes"]["commands"],
        &["command"],
        &mut commands,
    );
    assert_eq!(commands, ["imp.run", "imp.render"]);
    let source = read("extension.js");
    for command in commands {
        assert!(
            source.contains(&format!("registerCommand('{command}'")),
            "{command}"
        );
    }
}

#[test]
fn the_text_mate_grammar_knows_every_word() {
    let text_mate = json("syntaxes/imp.tmLanguage.json");
    let mut patterns = Vec::new();
    strings(&text_mate, &["match"], &mut patterns);
    let lists: Vec<&str> = (patterns.iter())
        .filter_map(|pattern| pattern.split("(?:").nth(1)?.split(')').next())
        .flat_map(|list| list.split('|'))
        .collect();
    for word in formal_grammar().words() {
        let is_space = ["R1", "R2", "R3"].contains(&word);
        assert!(is_space || lists.contains(&word), "{word}");
    }
}

#[test]
fn what_the_text_mate_grammar_includes_is_there() {
    let text_mate = json("syntaxes/imp.tmLanguage.json");
    let mut includes = Vec::new();
    strings(&text_mate, &["include"], &mut includes);
    assert!(includes.len() > 5);
    for include in includes {
        let name = include.strip_prefix('#').expect("a rule of its own");
        assert!(text_mate["repository"][name].is_object(), "{name}");
    }
}
