//! Operators by precedence, and operands.

use super::{messages, tree};

/// Each pair is a text and its tree.
#[track_caller]
fn check(pairs: &[(&str, &str)]) {
    for (text, expected) in pairs {
        assert_eq!(tree(text), *expected, "{text}");
    }
}

#[test]
fn each_level_binds_tighter_than_the_one_before() {
    check(&[
        ("a |> b with {c = 1}", "(|> a (with b c=1))"),
        ("a or b with {c = 1}", "(with (or a b) c=1)"),
        ("a or b and c", "(or a (and b c))"),
        ("a and b or c", "(or (and a b) c)"),
        ("a and not b", "(and a (not b))"),
        ("not a and b", "(and (not a) b)"),
        ("not a < b", "(not (? a < b))"),
        ("a < b..c", "(? a < (.. b c))"),
        ("a..b | c", "(.. a (| b c))"),
        ("a..b by c | d", "(by (.. a b) (| c d))"),
        ("a | b & c", "(| a (& b c))"),
        ("a & b \\ c", "(& a (\\ b c))"),
        ("a \\ b + c", "(\\ a (+ b c))"),
        ("a + b * c", "(+ a (* b c))"),
        ("-a * b", "(* (- a) b)"),
        ("a * -b", "(* a (- b))"),
        ("-x^2", "(- (^ x 2))"),
        ("!a^2", "(! (^ a 2))"),
        ("a^b(c)", "(^ a (call b c))"),
        ("-a.b", "(- (. a b))"),
    ]);
}

#[test]
fn operators_of_one_level_associate_as_documented() {
    check(&[
        ("a - b - c + d", "(+ (- (- a b) c) d)"),
        ("a / b * c % d @ e", "(@ (% (* (/ a b) c) d) e)"),
        ("a ^ b ^ c", "(^ a (^ b c))"),
        ("a | b | c", "(| (| a b) c)"),
        ("a \\ b \\ c", "(\\ (\\ a b) c)"),
        ("a |> b |> c", "(|> (|> a b) c)"),
        ("a and b and c", "(and (and a b) c)"),
        ("a with {b = 1} with {c = 2}", "(with (with a b=1) c=2)"),
        ("- - a", "(- (- a))"),
        ("not not a", "(not (not a))"),
    ]);
}

#[test]
fn powers_take_signs_on_the_right() {
    check(&[
        ("2^-1", "(^ 2 (- 1))"),
        ("2^-1^2", "(^ 2 (- (^ 1 2)))"),
        ("2^-1 * 3", "(* (^ 2 (- 1)) 3)"),
        ("-2^-x^2 + 1", "(+ (- (^ 2 (- (^ x 2)))) 1)"),
    ]);
}

#[test]
fn comparisons_chain_unless_parenthesised() {
    check(&[
        ("a < b <= c", "(? a < b <= c)"),
        ("(a < b) < c", "(? <(? a < b)> < c)"),
        ("a < (b < c)", "(? a < <(? b < c)>)"),
        ("a == b != c > d >= e", "(? a == b != c > d >= e)"),
        ("a + 1 < b and b < c", "(and (? (+ a 1) < b) (? b < c))"),
    ]);
}

#[test]
fn intervals_have_two_ends_and_steps_follow_them() {
    check(&[
        ("0..1", "(.. 0 1)"),
        ("-pi..2 * pi", "(.. (- pi) (* 2 pi))"),
        ("0..1 by 0.1", "(by (.. 0 1) 0.1)"),
        ("(0..1) by 0.1", "(by <(.. 0 1)> 0.1)"),
        ("range by 1/4", "(by range (/ 1 4))"),
    ]);
    assert_eq!(messages("0..1..2"), ["an interval has two ends, `lo..hi`"]);
}

#[test]
fn functions_reach_as_far_as_they_can() {
    check(&[
        ("x -> x + 1", "(-> (x) (+ x 1))"),
        ("x -> y -> x |> y", "(-> (x) (-> (y) (|> x y)))"),
        ("(x, y) -> x * y", "(-> (x y) (* x y))"),
        ("() -> 1", "(-> () 1)"),
        (
            "([a, [b, c]], k = 1 + 1) -> a",
            "(-> ([a [b c]] k=(+ 1 1)) a)",
        ),
        ("points |> p -> p.x", "(|> points (-> (p) (. p x)))"),
        ("map(x -> x^2, xs)", "(call map (-> (x) (^ x 2)) xs)"),
        ("(x -> x)(1)", "(call <(-> (x) x)> 1)"),
        ("p -> { let a = p; a }", "(-> (p) {(let a p); a})"),
        ("(k = (m = 1) -> m) -> k", "(-> (k=(-> (m=1) m)) k)"),
    ]);
}

#[test]
fn calls_indices_and_properties_follow_operands() {
    check(&[
        ("f(x)(y)", "(call (call f x) y)"),
        ("f()", "(call f)"),
        ("f(1, n = 2, )", "(call f 1 n=2)"),
        ("v[0][-1]", "(at (at v 0) (- 1))"),
        ("a.b(c).d", "(. (call (. a b) c) d)"),
        (
            "box(1).twist(45deg)",
            "(call (. (call box 1) twist) 0.7853981633974483)",
        ),
        ("[1, 2].x", "(. [1 2] x)"),
        ("\"a\".b", "(. (text \"a\") b)"),
        ("2.sqrt()", "(call (. 2 sqrt))"),
        ("f(a == b)", "(call f (? a == b))"),
    ]);
}

#[test]
fn lists_and_comprehensions() {
    check(&[
        ("[]", "[]"),
        ("[1]", "[1]"),
        ("[1, [2, 3], ]", "[1 [2 3]]"),
        ("[x^2 for x in xs]", "(each (^ x 2) for x xs)"),
        ("[[x for x in a]]", "[(each x for x a)]"),
        (
            "[x + y for x in a if x > 0 for [y, z] in b if z if y]",
            "(each (+ x y) for x a if (? x > 0) for [y z] b if z if y)",
        ),
        (
            "sum(e for i in range(9))",
            "(call sum (each e for i (call range 9)))",
        ),
        (
            "max(e for i in s, key = 3)",
            "(call max (each e for i s) key=3)",
        ),
    ]);
}

#[test]
fn a_bare_comprehension_stands_alone() {
    let expected = ["a bare comprehension is the only argument without a name"];
    assert_eq!(messages("f(a, e for i in s)"), expected);
    assert_eq!(messages("f(e for i in s, a)"), expected);
    assert_eq!(messages("f(k = 1, e for i in s)"), expected);
    assert_eq!(tree("f(a, [e for i in s])"), "(call f a (each e for i s))");
}

#[test]
fn conditions_are_expressions() {
    check(&[
        ("if a then b else c + 1", "(if a b (+ c 1))"),
        ("1 + if a then b else c", "(+ 1 (if a b c))"),
        ("if a then b else if c then d else e", "(if a b (if c d e))"),
        ("if a then if b then c else d else e", "(if a (if b c d) e)"),
        ("if a { b } else { c }", "(if a {b} {c})"),
        ("if a { b }", "(if a {b})"),
        (
            "if a { b } else if c { d } else { e }",
            "(if a {b} (if c {d} {e}))",
        ),
        ("if a { b }\nelse { c }", "(if a {b} {c})"),
        (
            "if { let t = 1; t } > 0 { b }",
            "(if (? {(let t 1); t} > 0) {b})",
        ),
        ("let a = if b\nthen c\nelse d", "(let a (if b c d))"),
    ]);
}

#[test]
fn with_takes_commas_lines_and_semicolons() {
    let expected = "(with f a=1 b=[2 3])";
    for text in [
        "f with {a = 1, b = [2, 3]}",
        "f with {a = 1; b = [2, 3]}",
        "f with {\n    a = 1\n    b = [2, 3]\n}",
        "f with {\n    a = 1,\n    b = [2, 3],\n}",
        "f\n  with\n  {a = 1, b = [2, 3],}",
    ] {
        assert_eq!(tree(text), expected, "{text}");
    }
    assert_eq!(tree("f with {}"), "(with f)");
}

#[test]
fn strings_have_literals_and_interpolations() {
    check(&[
        (r#""""#, "(text )"),
        (r#""a\tb\u{3c0}{{c}}""#, r#"(text "a\tbπ{c}")"#),
        (r#""{x:.3} and {y}""#, r#"(text x:.3 " and " y)"#),
        (r#""{f("in {n}")}""#, r#"(text (call f (text "in " n)))"#),
        (r#""{f with {a = 1}}""#, "(text (with f a=1))"),
        (r#""{[x for x in a]}""#, "(text (each x for x a))"),
    ]);
}

#[test]
fn blocks_are_expressions() {
    check(&[
        (
            "let y = { let t = x^2; t + 1 }",
            "(let y {(let t (^ x 2)); (+ t 1)})",
        ),
        ("f({\n  let t = 1\n  t\n})", "(call f {(let t 1); t})"),
        ("{}", "{}"),
        ("{\n\n}", "{}"),
        ("{ ; a ; }", "{a}"),
    ]);
}
