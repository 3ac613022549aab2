//! The constructs by which the language describes itself: they parse, and mean what is said.

use imp::diagnostic::Sources;
use imp::syntax::parse;

use crate::common::{imp_with, script};

/// A scene and script in one, with everything on one page.
const SCENE: &str = r#"#!/usr/bin/env -S imp run
## Blobby spheres (Blinn 1982), as sampled by Witkin & Heckbert (1994).

param b = 0.5 in 0.05..2                                   # a shape parameter: part of q
param c = [[-0.8, 0, 0], [0, 0.6, 0], [0.8, 0, 0]]         # nine more
param s = [0.7, 0.7, 0.7] in 0.1..2                        # three more

field blobs(p in R3) = b - sum(exp(-norm2(p - ci) / si^2) for [ci, si] in zip(c, s))

let pts = sample(blobs, spacing = 0.08, seed = 7)          # floaters, the default
print("{len(pts)} floaters, worst |F| {max(abs(pts.residuals))}")
export(pts, "blobs.ply")

let skin = polygonize(blobs, cell = 0.05)
assert(skin.watertight and skin.genus == 0)
export(skin, "blobs.stl")

for v in 0.3..0.9 by 0.2 {                                 # q changes: no recompilation
    let m = polygonize(blobs with {b = v}, cell = 0.05)
    print("b = {v}: area {m.area}, volume {m.volume}, {m.components} piece(s)")
}

test "three blobs are one piece at the default threshold" {
    assert(polygonize(blobs, cell = 0.1).components == 1)
}
"#;

/// Every kind of definition.
const DEFINITIONS: &str = r#"
import "parts/bracket.imp" as bracket                              # a module: its definitions only
param r = 1 in 0.1..3            # with a range; outside it is an error
setting teeth = 12 in 3..64      # structural
let k = 2*pi                     # a constant, not in q
fn square(t) = t^2               # a function; default and named arguments; blocks allowed
fn gear(n, depth = 0.1) {        # a block: statements, then a last expression
    let teeth = p -> cos(n * atan2(p.y, p.x))
    p -> norm(p.xy) - 1 - depth * teeth(p)
}
field torus(x, y, z) = (sqrt(x^2 + y^2) - 1)^2 + z^2 - 0.3^2       # coordinates by name
field blob(p in R3) = norm(p) - r                                  # or a point
field heart(x, y, z) = (x^2 + 9/4*y^2 + z^2 - 1)^3 == x^2*z^3 + 9/80*y^2*z^3
field slab(x, y, z) = abs(z) <= 0.5 and x^2 + y^2 <= 1             # relations read as solids
field knot(p in R3) = [torus(p), blob(p)]                          # codimension 2: a space curve
field gyroid(x, y, z) over -pi..pi = sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x)
"#;

#[test]
fn the_scene_parses() {
    let mut sources = Sources::default();
    for text in [SCENE, DEFINITIONS] {
        let id = sources.add("scene.imp", text);
        let parsed = parse(id, text);
        assert!(parsed.diagnostics.is_empty(), "{:?}", parsed.diagnostics);
    }
}

#[test]
fn every_kind_of_definition_works() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("parts")).unwrap();
    let module = "param width = 3\nfield bracket(p in R3) = norm(p) - width\n";
    std::fs::write(folder.path().join("parts/bracket.imp"), module).unwrap();
    std::fs::write(folder.path().join("scene.imp"), DEFINITIONS).unwrap();
    let value = |expression: &str, more: &[&str]| {
        let words: Vec<&str> = ["eval", "scene.imp", expression]
            .iter()
            .chain(more)
            .copied()
            .collect();
        let run = imp_with(folder.path(), &words, b"").well();
        run.stdout.trim_end().to_string()
    };
    for (expression, expected) in [
        ("bracket.bracket(0, 0, 5)", "2"),
        ("teeth, k == τ, square(3)", "12 true 9"),
        (
            "gear(5)([1, 0]), gear(5, depth = 0.25)([1, 0]), gear(depth = 0.5, n = 2)([0, 1])",
            "-0.1 -0.25 0.5",
        ),
        (
            "torus(1, 0, 0) == -0.3^2, blob(0, 0, 3), blob([0, 0, 3])",
            "true 2 2",
        ),
        ("slab(0, 0, 0), knot(0, 0, 1)[1]", "-0.5 0"),
        ("gyroid(0, 0, 0), gyroid(0..0.5, 0, 0).low", "0 0"),
    ] {
        let parts: Vec<String> = split(expression)
            .iter()
            .map(|part| value(part, &[]))
            .collect();
        assert_eq!(parts.join(" "), expected, "{expression}");
    }
    assert_eq!(value("blob(0, 0, 3)", &["--set", "r=2.5"]), "0.5");
    assert_eq!(value("teeth", &["--set", "teeth=8"]), "8");
    assert_eq!(
        value("bracket.bracket(0, 0, 5)", &["--set", "bracket.width=1"]),
        "4"
    );
}

/// The parts of `a, b, c` between commas that stand in no bracket.
fn split(text: &str) -> Vec<&str> {
    let mut parts = Vec::new();
    let (mut start, mut depth) = (0, 0);
    for (at, character) in text.char_indices() {
        match character {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(text[start..at].trim());
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(text[start..].trim());
    parts
}

#[track_caller]
fn prints(program: &str, expected: &str) {
    let run = script(program).well();
    assert_eq!(run.stdout.trim_end(), expected, "{program}");
}

#[test]
fn lexical_rules() {
    prints("print(1_000, 1e-3, 0.5, 1..2)", "1000 0.001 0.5 1..2");
    prints(
        "print(180deg == π, 0.25turn == pi/2, τ == 2*pi, φ == (1 + sqrt(5))/2)",
        "true true true true",
    );
    prints("let α = 2\nlet Δ = 3\nprint(α*Δ)", "6");
    prints(
        "print(\"{1/3:.3} {{x}} {[1/3, 2]:.1} {\"a{1 + 1}\"}\")",
        "0.333 {x} [0.3, 2.0] a2",
    );
    // Line ends inside brackets, after an operator and before one; `;` between statements.
    prints(
        "let a = 1 +\n    2\nlet b = a\n    * 2\nlet c = [1,\n    2]\nlet d = 1; let e = 2\n\
         let f = [3, 1]\n    |> sort\n    |> sum\nlet g = [3, 1]\n    .sort()\n    .len()\nprint(a, b, c, d + e, f, g)",
        "3 6 [1, 2] 3 4 2",
    );
}

#[test]
fn precedence_from_loosest_to_tightest() {
    for (expression, expected) in [
        ("(x -> x + 1)(2)", "3"),
        ("not true or true", "true"),
        ("not 1 == 2 and true", "true"),
        ("1 < 2 == true or false", "error"),
        ("-2^2", "-4"),
        ("2^-1", "0.5"),
        ("2^3^2", "512"),
        ("-7 % 3", "2"),
        ("mod(-7, 3)", "2"),
        ("7/2", "3.5"),
        ("1 - 2 - 3", "-4"),
        ("1..1 + 1", "1..2"),
        ("0..1 by 0.25 + 0.25", "[0, 0.5, 1]"),
        ("[[1, 2], [3, 4]] @ [1, 1] + 1", "[4, 8]"),
        ("1 < 2 < 3", "true"),
    ] {
        let run = script(&format!("print({expression})"));
        match expected {
            "error" => assert_eq!(run.code, 1, "{expression}"),
            expected => assert_eq!(run.well().stdout.trim_end(), expected, "{expression}"),
        }
    }
    // `|` is looser than `&`, `&` than `\`, `\` than `+`; `with` is looser than all of them.
    let fields = "param r = 1\nfield a(x) = x - r\nfield b(x) = x - 2\nfield c(x) = x - 3\n";
    for (expression, expected) in [
        ("(a | b & c)(5)", "3"),
        ("((a | b) & c)(5)", "3"),
        ("(a & b \\ c)(5)", "4"),
        ("(a + 1 | b)(5)", "3"),
        ("(a | b with {r = 7})(5)", "-2"),
        ("(-a ^ 2)(3)", "-4"),
        ("(!a + b)(5)", "-1"),
    ] {
        prints(&format!("{fields}print({expression})"), expected);
    }
}

#[test]
fn values_of_the_language() {
    for (expression, expected) in [
        ("[1, 2, 3] * 2 + [1, 1, 1]", "[3, 5, 7]"),
        ("[1, 2, 3].zyx", "[3, 2, 1]"),
        ("[[1, 2], [3, 4]][1].x", "3"),
        ("[1, 2, 3][-1]", "3"),
        ("range(3)", "[0, 1, 2]"),
        ("0..1 by 0.5", "[0, 0.5, 1]"),
        ("(t -> t^2 - t)(0..1)", "-1..1"),
        ("sum(i for i in range(9)), product([2, 3])", "36 6"),
        ("[i*j for i in range(3) for j in range(i) if i != 2]", "[0]"),
        ("length([3, 4]), ln(e)", "5 1"),
    ] {
        prints(&format!("print({expression})"), expected);
    }
    for (program, code, help) in [
        ("let x = 1\nlet y = 2x", "E0105", "`2*x`"),
        ("let x = 1\nlet y = 2(x + 1)", "E0105", "`*`"),
        ("let x = 2**3", "E0106", "`^`"),
        ("for i in 0..1 { print(i) }", "E0306", "range(n)"),
        ("let x = 1\nlet x = 2", "E0202", "first bound here"),
        ("let x = [1, 2] + [1, 2, 3]", "E0302", "lengths"),
        ("print(len(1, where = 2))", "E0203", "arguments"),
    ] {
        let run = script(program);
        assert_eq!(run.code, 1, "{program}");
        for words in [code, help] {
            assert!(run.stderr.contains(words), "{program}\n{}", run.stderr);
        }
    }
}

#[test]
fn statements_stand_in_functions_and_loops_unroll_into_the_graph() {
    prints(
        "fn power(x, n) {\n    var p = 1\n    for i in range(n) { p = p*x }\n    p\n}\n\
         field f(x) = power(x, 3)\nprint(f(2), grad(f)(2), power(3, 2))",
        "8 [12] 9",
    );
    prints(
        "fn steps(n) { var k = 0; var m = n; while m > 1 { m = if m % 2 == 0 then m/2 else 3*m + 1; k = k + 1 }; k }\n\
         print(steps(27))",
        "111",
    );
}
