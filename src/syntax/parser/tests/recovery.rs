//! Mistakes: how many are reported, in which words, and what of the tree remains.

use super::{messages, mistakes, parsed, print};
use crate::diagnostic::Code;

/// Each pair is a text with one mistake and the message.
#[track_caller]
fn check(pairs: &[(&str, &str)]) {
    for (text, message) in pairs {
        assert_eq!(messages(text), [*message], "{text}");
    }
}

#[test]
fn messages_say_what_was_expected_and_found() {
    check(&[
        ("let a = 1 + )", "`)` closes nothing"),
        ("let a = (1 + )", "expected an expression, found `)`"),
        (
            "let a =",
            "expected an expression, found the end of the file",
        ),
        (
            "let a = \nlet b = 2",
            "expected an expression, found the end of the line",
        ),
        ("let 3 = x", "expected a name or a list of names, found `3`"),
        ("let x 3", "expected `=` after the name, found `3`"),
        (
            "param x",
            "expected `=` after the name, found the end of the file",
        ),
        ("let [a, b] 3", "expected `=` after the names, found `3`"),
        (
            "let x = 1 let y = 2",
            "expected an operator or the end of the statement, found `let`",
        ),
        (
            "f(1 2)",
            "expected an operator, `,`, `for` or `)`, found `2`",
        ),
        (
            "[1 2]",
            "expected an operator, `,`, `for` or `]`, found `2`",
        ),
        ("a[1 2]", "expected an operator or `]`, found `2`"),
        ("(1 2)", "expected an operator or `)`, found `2`"),
        (
            "a.",
            "expected the name of a property after `.`, found the end of the file",
        ),
        (
            "a.for",
            "expected the name of a property after `.`, found `for`",
        ),
        (
            "fn f(x) x^2",
            "expected `=` or `{` after the function's parameters, found `x`",
        ),
        ("fn (x) = 1", "expected the function's name, found `(`"),
        (
            "fn f = 1",
            "expected `(` and the function's parameters, found `=`",
        ),
        (
            "fn f(1) = 1",
            "expected the name of a parameter or `)`, found `1`",
        ),
        (
            "field f(x, y) x",
            "expected `over` or `=` after the field's coordinates, found `x`",
        ),
        (
            "field f(p in R4) = 1",
            "expected `R1`, `R2` or `R3`, found `R4`",
        ),
        (
            "field f(x) over 0..a x",
            "expected an operator, `,` or `=` after the field's domain, found `x`",
        ),
        (
            "field f(a, b, c, d) = 1",
            "a field has one, two or three coordinates",
        ),
        (
            "for i range(3) { }",
            "expected `in` after the names, found `range`",
        ),
        (
            "for i in 3",
            "expected an operator or `{`, found the end of the file",
        ),
        ("if a b", "expected an operator, `{` or `then`, found `b`"),
        (
            "if a then b",
            "expected an operator or `else`, found the end of the file",
        ),
        (
            "if a { b } else c",
            "expected `if` or `{` after `else`, found `c`",
        ),
        ("f with a", "expected `{` after `with`, found `a`"),
        (
            "f with {1}",
            "expected the name of a parameter or setting or `}`, found `1`",
        ),
        ("\"{}\"", "expected an expression, found `}`"),
        (
            "\"{a b}\"",
            "expected an operator, a format such as `:.3` or `}`, found `b`",
        ),
        (
            "let for = 1",
            "expected a name or a list of names, found `for`",
        ),
        ("setting n 3", "expected `=` after the name, found `3`"),
        (
            "import parts as p",
            "expected the path of a file, a string, found `parts`",
        ),
        (
            "import \"a.imp\"",
            "expected `as` and a name for the module, found the end of the file",
        ),
        (
            "import \"{a}.imp\" as a",
            "expected a string without interpolations, found `{`",
        ),
        ("test \"a\" assert(true)", "expected `{`, found `assert`"),
        ("test { }", "expected the test's name, a string, found `{`"),
        (
            "1 = x",
            "the left side of `=` is a name, an element `a[i]` or a property `a.b`",
        ),
    ]);
}

#[test]
fn known_mistakes_get_a_hint() {
    for (text, help) in [
        (
            "let a = b = c",
            "`==` asks whether two values are equal; `=` gives a name its value",
        ),
        (
            "if a = b { }",
            "`==` asks whether two values are equal; `=` gives a name its value",
        ),
        ("let x 3", "write `let x = …`"),
        ("var x += 3", "write `var x = …`"),
        ("fn f(x) x^2", "write `fn f(x) = x^2` or `fn f(x) { … }`"),
        (
            "field f(x) x",
            "write `field f(x, y, z) = …`, or `field f(x, y, z) over -1..1 = …`",
        ),
        (
            "let by = 1",
            "`by` is a word of the language, so it cannot be a name",
        ),
        (
            "f(x) = 2",
            "write `fn f(x) = …` for a function and `field f(x, y, z) = …` for a field",
        ),
        (
            "let a = 1.",
            "a number has a digit on both sides of its point: `1.0`",
        ),
        ("\"{}\"", "`{{` and `}}` are braces in a string"),
        (
            "if (a) b",
            "write `if c then a else b` or `if c { … } else { … }`",
        ),
        (
            "[a, 1] -> a",
            "the parameters of a function stand before `->`: `x -> …` or `(x, y) -> …`",
        ),
    ] {
        let mistakes = mistakes(text);
        assert_eq!(mistakes.len(), 1, "{text}: {mistakes:?}");
        assert_eq!(mistakes[0].help.as_deref(), Some(help), "{text}");
    }
}

#[test]
fn three_wrong_statements_are_three_errors() {
    let text =
        "let a = 1 +\n\nlet b = 2\nfield f(x, y = x\nlet c = (1, 2]\nlet d = 3\nfn g(x) x\nf(a)";
    let mistakes = mistakes(text);
    let lines: Vec<usize> = mistakes
        .iter()
        .filter_map(|mistake| mistake.span())
        .map(|span| text[..span.start as usize].matches('\n').count() + 1)
        .collect();
    assert_eq!(lines, [1, 4, 5, 7], "{mistakes:?}");
    assert_eq!(messages("let a = )\nlet = 2\nfor x { y }").len(), 3);
}

#[test]
fn statements_in_blocks_recover_on_their_own() {
    let text = "fn f(x) {\n    let = 1\n    let b = 2\n    b 3\n}\nlet c = )\nlet d = 4";
    let parsed = parsed(text);
    assert_eq!(parsed.diagnostics.len(), 3, "{:?}", parsed.diagnostics);
    assert_eq!(
        print::statements(&parsed.tree.statements),
        "(fn f (x) {ERROR; (let b 2); ERROR}); ERROR; (let d 4)"
    );
}

#[test]
fn brackets_recover_on_their_own() {
    let text = "g(f(1 2), [3 4], (5 6), a[7 8])";
    assert_eq!(messages(text).len(), 4);
    assert_eq!(
        print::statements(&parsed(text).tree.statements),
        "(call g (call f) [ERROR] <ERROR> (at a ERROR))"
    );
}

#[test]
fn one_mistake_in_a_statement_is_one_error() {
    for text in [
        "let a = 2x + 3y2",
        "let a = 2(x + 1)(y)",
        "let a = x**2",
        "let a = b && c",
        "let a = $ + 1 2",
        "let größe = 1",
        "print(\"abc)",
        "print(f(\"{x)",
        "let a = f(1, 2",
        "let a = [1, 2\nlet b = 3",
        "let a = 1)",
        "fn f(x) {\nlet a = 1\n",
        "let a = (1, 2]",
        "let a = 1..2..3",
        "let a = .5 5",
        "f(x) y z",
        "for i in 2(x) { let a = 1 }",
    ] {
        let messages = messages(text);
        assert!(
            messages.len() == 1 || text.contains("3y2") && messages.len() == 2,
            "{text}: {messages:?}"
        );
    }
}

#[test]
fn a_mistake_in_one_statement_does_not_hide_one_in_the_next() {
    let codes: Vec<Code> = mistakes("let a = 2x\nlet b = (1 2)\nlet c = \"x\nlet d = [\nlet e")
        .iter()
        .map(|mistake| mistake.code)
        .collect();
    assert_eq!(
        codes,
        [
            Code::ImplicitMultiplication,
            Code::UnexpectedToken,
            Code::UnclosedText,
            Code::UnclosedBracket,
            Code::UnexpectedToken
        ]
    );
}

#[test]
fn very_many_mistakes_are_cut_off() {
    let mistakes = mistakes(&"let = 1\n".repeat(1_000));
    assert_eq!(mistakes.len(), 50);
    assert_eq!(
        mistakes[49].message,
        "there are more mistakes than are shown"
    );
}
