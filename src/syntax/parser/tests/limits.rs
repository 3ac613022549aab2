//! Texts that are too deep or very long.

use super::{messages, parsed};
use crate::diagnostic::Code;
use crate::syntax::tree::{Expression, ExpressionKind, StatementKind};

/// Whether a text has exactly one mistake, that it is nested too deep.
#[track_caller]
fn is_too_deep(text: &str) {
    let mistakes = parsed(text).diagnostics;
    let codes: Vec<Code> = mistakes.iter().map(|mistake| mistake.code).collect();
    assert_eq!(codes, [Code::TooDeep], "{}…", &text[..20.min(text.len())]);
}

/// The only expression of a text.
#[track_caller]
fn only(text: &str) -> Expression {
    let parsed = parsed(text);
    assert!(parsed.diagnostics.is_empty(), "{:?}", parsed.diagnostics);
    match &parsed.tree.statements[..] {
        [statement] => match &statement.kind {
            StatementKind::Expression(expression) => expression.clone(),
            other => panic!("{other:?}"),
        },
        other => panic!("{} statements", other.len()),
    }
}

#[test]
fn chains_to_the_left_are_bounded_by_the_tree() {
    for (start, link) in [
        ("1", "+1"),
        ("x", ".a"),
        ("f", "(x)"),
        ("a", "[0]"),
        ("a", " |> f"),
        ("a", " and b"),
        ("a", " with {b = 1}"),
        ("a", " by 1"),
    ] {
        let chain = |links: usize| start.to_owned() + &link.repeat(links);
        only(&chain(1_990));
        is_too_deep(&chain(2_001));
        is_too_deep(&chain(20_000));
    }
}

#[test]
fn chains_to_the_right_are_bounded_before_parsing() {
    for (link, end) in [
        ("-", "x"),
        ("!", "x"),
        ("not ", "x"),
        ("x^", "x"),
        ("x -> ", "x"),
        ("(x, y) -> ", "x"),
        ("if a then b else ", "c"),
        ("if a then ", "b"),
        ("if a { b } else ", "{ c }"),
        ("if ", "a"),
    ] {
        let chain = |links: usize| link.repeat(links) + end;
        let within = messages(&chain(900));
        let unfinished = link == "if a then " || link == "if ";
        assert_eq!(within.is_empty(), !unfinished, "{link}: {within:?}");
        is_too_deep(&chain(2_002));
        is_too_deep(&chain(100_000));
    }
}

#[test]
fn brackets_nest_to_their_limit_and_no_further() {
    for (open, close) in [
        ("(", ")"),
        ("[", "]"),
        ("{", "}"),
        ("f(", ")"),
        ("a[", "]"),
        ("f(x -> ", ")"),
        ("if a { ", "}"),
        ("f with {a = ", "}"),
        ("[x for x in ", "]"),
        ("1 + 2 * (3 < -", ")"),
    ] {
        let nested = |depth: usize| open.repeat(depth) + "x" + &close.repeat(depth);
        let depth = if open.contains("f(x") { 250 } else { 256 };
        only(&nested(depth));
        is_too_deep(&nested(257));
        is_too_deep(&nested(10_000));
        is_too_deep(&open.repeat(10_000));
    }
    only(&("\"{".repeat(128) + "x" + &"}\"".repeat(128)));
    is_too_deep(&("\"{".repeat(10_000) + "x" + &"}\"".repeat(10_000)));
}

#[test]
fn what_is_long_but_not_deep_is_parsed() {
    let elements = 200_000;
    let list = only(&format!("[{}]", "1,".repeat(elements)));
    let ExpressionKind::List(list) = &*list.kind else {
        panic!("a list");
    };
    assert_eq!(list.len(), elements);
    let comparison = only(&("a < ".repeat(elements) + "b"));
    let ExpressionKind::Comparison { rest, .. } = &*comparison.kind else {
        panic!("a comparison");
    };
    assert_eq!(rest.len(), elements);
    let parsed = parsed(&"let a = f(x, 2*y)\n".repeat(20_000));
    assert_eq!(parsed.tree.statements.len(), 20_000);
    assert!(parsed.diagnostics.is_empty());
}

#[test]
fn a_sum_of_very_many_terms_is_one_error() {
    is_too_deep(&("1+".repeat(300_000) + "1"));
}

#[test]
fn long_words_are_shortened_in_messages() {
    for text in [
        "9".repeat(100_000),
        "let ".to_owned() + &"a".repeat(100_000) + " 1",
    ] {
        let mistakes = parsed(&text).diagnostics;
        assert_eq!(mistakes.len(), 1);
        assert!(mistakes[0].message.len() < 200);
        assert!(
            mistakes[0]
                .help
                .as_ref()
                .is_none_or(|help| help.len() < 200)
        );
    }
}
