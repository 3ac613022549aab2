//! tree-sitter's grammar: what Imp reads without a diagnostic, it reads without an error.

use std::path::{Path, PathBuf};

use imp::diagnostic::SourceId;
use imp::syntax::parse;
use tree_sitter::{Language, Node, Parser};

use crate::generator::Generator;
use crate::sentences::{SEED, SENTENCES, formal_grammar};

pub(crate) fn parser() -> Parser {
    let mut parser = Parser::new();
    parser
        .set_language(&tree_sitter_imp::LANGUAGE.into())
        .expect("the language is for this version of tree-sitter");
    parser
}

/// The first error in a tree, or what is missing in it.
fn mistake(node: Node<'_>) -> Option<Node<'_>> {
    if node.is_error() || node.is_missing() {
        return Some(node);
    }
    (0..node.child_count())
        .filter_map(|index| node.child(index))
        .find(Node::has_error)
        .and_then(mistake)
        .or_else(|| node.has_error().then_some(node))
}

/// What is bad about how tree-sitter reads a program: an error, or statements that begin elsewhere
/// than they do for Imp.
fn complaint(parser: &mut Parser, text: &str) -> Option<String> {
    let tree = parser.parse(text, None).expect("nothing stops the parser");
    let root = tree.root_node();
    if let Some(node) = mistake(root) {
        let line: String = text[node.start_byte()..].chars().take(60).collect();
        return Some(format!("{:?} at {line:?}", node.kind()));
    }
    let found: Vec<usize> = (0..root.named_child_count() as u32)
        .filter_map(|index| root.named_child(index))
        .filter(|node| !node.is_extra())
        .map(|node| node.start_byte())
        .collect();
    let statements = parse(SourceId(0), text).tree.statements;
    let expected = statements
        .iter()
        .map(|statement| statement.span.start as usize);
    (!expected.eq(found.iter().copied())).then(|| format!("statements begin at {found:?}"))
}

fn is_program(text: &str) -> bool {
    parse(SourceId(0), text).diagnostics.is_empty()
}

/// All files below a folder of the repository with that ending.
pub(crate) fn files(folder: &str, ending: &str) -> Vec<PathBuf> {
    let mut pending = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join(folder)];
    let mut files = Vec::new();
    while let Some(folder) = pending.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                pending.push(path);
            } else if path.extension().is_some_and(|found| found == ending) {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

/// The programs in the fenced blocks of a Markdown file.
fn fenced(markdown: &str) -> Vec<&str> {
    let blocks = markdown.split("```imp\n").skip(1);
    blocks
        .map(|block| block.split("\n```").next().unwrap_or(block))
        .collect()
}

#[test]
fn programs_are_read_without_an_error() {
    let mut parser = parser();
    let mut wrong = Vec::new();
    let mut count = 0;
    let mut check = |name: &Path, text: &str| {
        if is_program(text) {
            count += 1;
            let complaint = complaint(&mut parser, text);
            wrong.extend(complaint.map(|complaint| format!("{}: {complaint}", name.display())));
        }
    };
    for folder in ["examples", "src", "tests"] {
        for path in files(folder, "imp") {
            check(&path, &std::fs::read_to_string(&path).expect("a text"));
        }
    }
    for path in files("docs", "md") {
        let text = std::fs::read_to_string(&path).expect("a text");
        fenced(&text).iter().for_each(|block| check(&path, block));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(count > 40, "only {count} programs");
}

#[test]
fn sentences_of_the_formal_grammar_are_read_without_an_error() {
    let grammar = formal_grammar();
    let mut generator = Generator::new(&grammar, SEED);
    let mut parser = parser();
    let mut wrong = Vec::new();
    for _ in 0..SENTENCES {
        let text = generator.sentence("file");
        if let Some(complaint) = complaint(&mut parser, &text) {
            wrong.push((text, complaint));
        }
    }
    wrong.sort_by_key(|(text, _)| text.len());
    let shortest: Vec<_> = wrong.iter().take(10).collect();
    assert!(
        wrong.is_empty(),
        "{} of {SENTENCES}: {shortest:#?}",
        wrong.len()
    );
}

#[test]
fn wrong_programs_are_read_with_an_error() {
    let mut parser = parser();
    for text in [
        "2(x)",
        "2x",
        "let = 1",
        "let if = 1",
        "f(1, 2",
        "a b",
        "for x in xs",
        "if a then b",
        "\"{a\"",
        "\"a\nb\"",
        "x = 1 in",
        "field f(p in R4) = 1",
        "(\na\nb\n)",
        "a +",
    ] {
        assert!(!is_program(text), "{text:?}");
        assert!(complaint(&mut parser, text).is_some(), "{text:?}");
    }
}

/// The parser is generated from `grammar.json`, which is generated from `grammar.js`; that all three
/// were generated together shows in their names.
#[test]
fn the_generated_files_belong_together() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("grammar/tree-sitter-imp");
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).expect("a text");
    let json: serde_json::Value = serde_json::from_str(&read("src/grammar.json")).expect("JSON");
    let rules = json["rules"].as_object().expect("the rules");
    let language: Language = tree_sitter_imp::LANGUAGE.into();
    let script = read("grammar.js");
    for rule in rules.keys() {
        assert!(script.contains(&format!("    {rule}: (")), "{rule}");
        let is_hidden = rule.starts_with('_');
        assert!(
            is_hidden || language.id_for_node_kind(rule, true) > 0,
            "{rule}"
        );
    }
    for id in 0..language.node_kind_count() as u16 {
        if language.node_kind_is_named(id) && language.node_kind_is_visible(id) {
            let kind = language.node_kind_for_id(id).expect("a name");
            let is_known = rules.contains_key(kind) || kind == "string_content" || kind == "ERROR";
            assert!(is_known, "{kind}");
        }
    }
    let mut fields: Vec<&str> = (script.split("field('").skip(1))
        .map(|rest| rest.split('\'').next().expect("a name"))
        .collect();
    fields.sort_unstable();
    fields.dedup();
    let known: Vec<&str> = (1..=language.field_count() as u16)
        .filter_map(|id| language.field_name_for_id(id))
        .collect();
    assert_eq!(fields, known);
}
