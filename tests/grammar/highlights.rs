//! The queries for editors: they fit the grammar, and each kind of token has its colour.

use std::collections::BTreeMap;

use tree_sitter::{Language, Query, QueryCursor, StreamingIterator};

use crate::notation::Node;
use crate::sentences::formal_grammar;
use crate::tree_sitter::parser;

/// The colour of each named or anonymous leaf by its first byte, where later patterns of the query
/// go before earlier ones.
fn colours(text: &str) -> BTreeMap<usize, (String, String)> {
    let language: Language = tree_sitter_imp::LANGUAGE.into();
    let query = Query::new(&language, tree_sitter_imp::HIGHLIGHTS_QUERY).expect("a query");
    let tree = parser()
        .parse(text, None)
        .expect("nothing stops the parser");
    let mut colours = BTreeMap::new();
    let mut cursor = QueryCursor::new();
    let mut captures = cursor.captures(&query, tree.root_node(), text.as_bytes());
    let mut latest: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    while let Some((found, index)) = captures.next() {
        let capture = found.captures()[*index];
        let place = (capture.node.start_byte(), capture.node.end_byte());
        let pattern = latest.entry(place).or_insert(found.pattern_index);
        if found.pattern_index >= *pattern {
            *pattern = found.pattern_index;
            let name = query.capture_names()[capture.index as usize];
            colours.insert(
                place.0,
                (text[place.0..place.1].to_owned(), name.to_owned()),
            );
        }
    }
    colours
}

#[test]
fn the_queries_fit_the_grammar() {
    let language: Language = tree_sitter_imp::LANGUAGE.into();
    for query in [
        tree_sitter_imp::HIGHLIGHTS_QUERY,
        tree_sitter_imp::LOCALS_QUERY,
        tree_sitter_imp::FOLDS_QUERY,
        tree_sitter_imp::TAGS_QUERY,
    ] {
        Query::new(&language, query).expect("a query that fits");
    }
}

#[test]
fn each_kind_of_token_has_its_colour() {
    let text = "## What it is.\nfield ball(p in R3) = norm(p) - 2.5 # a note\n\
                fn twice(t) = t + π\nprint(\"é{twice(1):.2}\\n\", true, a = x.y)\n\
                param r = 1\n[x -> x]";
    let colours = colours(text);
    for (token, colour) in [
        ("## What it is.", "comment.documentation"),
        ("field", "keyword"),
        ("ball", "function.special"),
        ("p", "variable.parameter"),
        ("R3", "type.builtin"),
        ("norm", "function.call"),
        ("-", "operator"),
        ("2.5", "number"),
        ("# a note", "comment"),
        ("fn", "keyword"),
        ("twice", "function"),
        ("t", "variable.parameter"),
        ("π", "constant.builtin"),
        (":.2", "string.special"),
        ("\\n", "string.escape"),
        ("true", "boolean"),
        ("a", "variable.parameter"),
        ("y", "property"),
        ("r", "variable.special"),
        ("[", "punctuation.bracket"),
    ] {
        let found = colours.values().find(|(written, _)| written == token);
        let found = found.map(|(_, colour)| colour.as_str());
        assert_eq!(found, Some(colour), "{token}");
    }
    assert!(
        colours
            .values()
            .any(|(written, colour)| written.starts_with("\"é") && colour == "string")
    );
}

#[test]
fn every_word_and_sign_of_the_language_has_a_colour() {
    let grammar = formal_grammar();
    let mut missing = Vec::new();
    for rule in grammar.rules.values().filter(|rule| !rule.is_token) {
        rule.node.visit(&mut |node| {
            if let Node::Literal(text) = node {
                let quoted = format!("{:?}", text);
                let is_node = ["true", "false", "R1", "R2", "R3"].contains(&text.as_str());
                if !is_node && !tree_sitter_imp::HIGHLIGHTS_QUERY.contains(&quoted) {
                    missing.push(text.clone());
                }
            }
        });
    }
    assert!(missing.is_empty(), "{missing:?}");
}
