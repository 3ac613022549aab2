//! Statements, and whole texts.

use super::{parsed, tree};
use crate::diagnostic::SourceId;
use crate::syntax::parse_expression;
use crate::syntax::tree::StatementKind;

#[test]
fn definitions() {
    for (text, expected) in [
        ("param r = 1", "(param r 1)"),
        ("param r = 1 in 0.1..3", "(param r 1 (.. 0.1 3))"),
        ("param c = [[0, 1], [2, 3]]", "(param c [[0 1] [2 3]])"),
        ("setting n = 12 in 3..64", "(setting n 12 (.. 3 64))"),
        ("setting style = \"a\"", "(setting style (text \"a\"))"),
        ("import \"a/\\u{62}.imp\" as b", "(import \"a/b.imp\" b)"),
        ("import \"\" as b", "(import \"\" b)"),
        ("test \"t\" { assert(a) }", "(test \"t\" {(call assert a)})"),
        ("let k = 2*pi", "(let k (* 2 pi))"),
        ("let [a, [b, c]] = v", "(let [a [b c]] v)"),
        ("var n = 0", "(var n 0)"),
        ("fn square(t) = t^2", "(fn square (t) (^ t 2))"),
        ("fn g(a, n = 3) = n", "(fn g (a n=3) n)"),
        ("fn g(a) { let b = a; b }", "(fn g (a) {(let b a); b})"),
        ("fn g([a, b],) = a", "(fn g ([a b]) a)"),
        ("fn g() = 1", "(fn g () 1)"),
    ] {
        assert_eq!(tree(text), expected, "{text}");
    }
}

#[test]
fn fields() {
    for (text, expected) in [
        ("field f(x) = x", "(field f (x) () x)"),
        ("field f(x, y) = x*y", "(field f (x y) () (* x y))"),
        (
            "field f(x, y, z) over -1..1, -2..2, 0..1 = x",
            "(field f (x y z) ((.. (- 1) 1) (.. (- 2) 2) (.. 0 1)) x)",
        ),
        ("field b(p in R3) = p.x", "(field b (p in R3) () (. p x))"),
        (
            "field b(p in R2) over 0..1 = p.x",
            "(field b (p in R2) ((.. 0 1)) (. p x))",
        ),
        (
            "field h(x, y, z) = x^2 == y^3",
            "(field h (x y z) () (? (^ x 2) == (^ y 3)))",
        ),
        (
            "field s(x, y, z) = abs(z) <= 0.5 and x <= 1",
            "(field s (x y z) () (and (? (call abs z) <= 0.5) (? x <= 1)))",
        ),
    ] {
        assert_eq!(tree(text), expected, "{text}");
    }
}

#[test]
fn things_to_do() {
    for (text, expected) in [
        ("n = n + 1", "(set n (+ n 1))"),
        ("a[0].b = 1", "(set (. (at a 0) b) 1)"),
        (
            "for i in range(3) { print(i) }",
            "(for i (call range 3) {(call print i)})",
        ),
        (
            "for [a, b] in zip(c, d) { }",
            "(for [a b] (call zip c d) {})",
        ),
        (
            "for v in 0.3..0.9 by 0.2 { v }",
            "(for v (by (.. 0.3 0.9) 0.2) {v})",
        ),
        (
            "while n < 3 { n = n + 1 }",
            "(while (? n < 3) {(set n (+ n 1))})",
        ),
        ("assert(a, \"why\")", "(call assert a (text \"why\"))"),
        ("a; b\nc;;d;", "a; b; c; d"),
        ("", ""),
        ("\n# only a comment\n", ""),
    ] {
        assert_eq!(tree(text), expected, "{text}");
    }
}

#[test]
fn pipelines_run_over_lines() {
    assert_eq!(
        tree(
            "blobs\n    |> polygonize(cell\n= 0.05)\n    |> export(\"a.stl\")\nlet b = a\n    .f(1)"
        ),
        "(|> (|> blobs (call polygonize cell=0.05)) (call export (text \"a.stl\"))); \
         (let b (call (. a f) 1))"
    );
}

#[test]
fn a_whole_script() {
    let text = r#"#!/usr/bin/env -S imp run
## Two balls that melt together.

param threshold = 0.4 in 0.05..2
param centers = [[-0.5, 0, 0], [0.5, 0, 0]]   # six more

## The sum of bells.
field balls(p in R3) = threshold - sum(exp(-norm2(p - c)) for c in centers)

fn gear(n, depth = 0.1) {
    let teeth = p -> cos(n * atan2(p.y, p.x))
    p -> norm(p.xy) - 1 - depth * teeth(p)
}

let skin = polygonize(balls, cell = 0.05)
assert(skin.watertight and skin.genus == 0)
for v in 0.3..0.9 by 0.2 {
    let m = polygonize(balls with {threshold = v}, cell = 0.05)
    print("at {v:.2}: area {m.area}, {m.components} piece(s)")
}
let slope = balls / norm(grad(balls))
"#;
    let parsed = parsed(text);
    assert!(parsed.diagnostics.is_empty(), "{:?}", parsed.diagnostics);
    let statements = &parsed.tree.statements;
    assert_eq!(statements.len(), 8);
    assert_eq!(
        statements[2].documentation.as_deref(),
        Some("The sum of bells.")
    );
    assert_eq!(statements[0].documentation, None);
    assert_eq!(parsed.tree.comments.len(), 4);
    let covered = |index: usize| {
        let span = statements[index].span;
        &text[span.start as usize..span.end as usize]
    };
    assert_eq!(covered(0), "param threshold = 0.4 in 0.05..2");
    assert!(covered(3).starts_with("fn gear") && covered(3).ends_with('}'));
}

#[test]
fn doc_comments_reach_into_blocks() {
    let parsed = parsed("fn f() {\n    ## Half.\n    let h = 0.5\n    h\n}");
    let StatementKind::Function { function, .. } = &parsed.tree.statements[0].kind else {
        panic!("a function");
    };
    let crate::syntax::tree::ExpressionKind::Block(block) = &*function.body.kind else {
        panic!("a block");
    };
    assert_eq!(block.statements[0].documentation.as_deref(), Some("Half."));
    assert_eq!(block.statements[1].documentation, None);
}

#[test]
fn one_expression_can_be_parsed_on_its_own() {
    let source = SourceId(0);
    assert!(parse_expression(source, " grad(f)(1, 0, 2)[0] \n").is_ok());
    for (text, message) in [
        ("", "expected an expression, found nothing"),
        ("let a = 1", "expected an expression, found a statement"),
        ("1\n2", "expected one expression, found several"),
        ("1 +", "expected an expression, found the end of the file"),
    ] {
        let messages: Vec<String> = parse_expression(source, text)
            .err()
            .unwrap_or_default()
            .into_iter()
            .map(|mistake| mistake.message)
            .collect();
        assert_eq!(messages, [message], "{text}");
    }
}
