//! The language from a script's point of view: what programs print.

mod common;

use common::{imp_with, script};

/// What a program prints, line by line.
fn printed(program: &str) -> Vec<String> {
    let run = script(program).well();
    run.stdout.lines().map(str::to_string).collect()
}

#[track_caller]
fn prints(program: &str, expected: &[&str]) {
    assert_eq!(printed(program), expected, "{program}");
}

#[track_caller]
fn fails(program: &str, code: &str) {
    let run = script(program);
    assert_eq!(run.code, 1, "{program}\n{}", run.stderr);
    assert!(run.stderr.contains(code), "{program}\n{}", run.stderr);
}

#[test]
fn operators_bind_as_in_mathematics() {
    prints(
        "print(-2^2, 2^-1, 2^3^2, 7 % 3, -7 % 3, 1 - 2 - 3, 8 / 4 / 2)",
        &["-4 0.5 512 1 2 -4 1"],
    );
    prints(
        "print(1 < 2 < 3, 1 < 2 < 2, not true or true)",
        &["true false true"],
    );
}

#[test]
fn lists_are_vectors_and_matrices() {
    prints(
        "let v = [1, 2, 3]\nprint(v + 1, v * v, v.zx, v[-1], [[1, 2], [3, 4]] @ [1, 1])",
        &["[2, 3, 4] [1, 4, 9] [3, 1] 3 [3, 7]"],
    );
    prints(
        "print(norm([3, 4]), dot([1, 2], [3, 4]), cross([1, 0, 0], [0, 1, 0]), sum([]))",
        &["5 11 [0, 0, 1] 0"],
    );
    prints(
        "print([i*j for i in range(3) for j in range(3) if i != j], max(i^2 for i in range(4)))",
        &["[0, 0, 0, 2, 0, 2] 9"],
    );
}

#[test]
fn steps_of_decimals_are_decimals() {
    prints(
        "print(0.3..0.9 by 0.2, 0..0.3 by 0.1)",
        &["[0.3, 0.5, 0.7, 0.9] [0, 0.1, 0.2, 0.3]"],
    );
    // An element never lies outside the interval.
    prints("print(0..0.9999999999 by 1)", &["[0]"]);
}

#[test]
fn functions_have_defaults_names_methods_and_pipes() {
    prints(
        "fn f(a, b = 2*a) { let c = a + b\n c * 2 }\nprint(f(1), f(1, b = 5), f(b = 1, a = 2))",
        &["6 12 6"],
    );
    prints(
        "print([1, 2, 3].map(t -> t^2), [1, 2, 3] |> sum, 4.sqrt())",
        &["[1, 4, 9] 6 2"],
    );
}

#[test]
fn strings_show_values() {
    prints(
        "let x = 1/3\nprint(\"{x:.2} {{}} {[x > 0]} {\"in\"}\")",
        &["0.33 {} [true] in"],
    );
}

#[test]
fn variables_change_and_constants_do_not() {
    prints(
        "var xs = [1, [2, 3]]\nxs[1][0] = 7\nxs[0] = xs[1]\nprint(xs)",
        &["[[7, 3], [7, 3]]"],
    );
    prints("var n = 0\nwhile n < 5 { n = n + 2 }\nprint(n)", &["6"]);
    fails("let a = 1\na = 2", "E0207");
}

#[test]
fn relations_are_solids() {
    prints(
        "field slab(x, y, z) = abs(z) <= 0.5 and x^2 + y^2 <= 1\nprint(slab(0, 0, 0), slab(0, 0, 1))",
        &["-0.5 0.5"],
    );
    prints(
        "field s(p in R3) = norm(p) - 1\nlet shell = s < 0 and s > -0.5\nprint(shell(0, 0, 0.7), (not (s < 0))(0, 0, 0))",
        // max(0.7 - 1, -0.5 - (0.7 - 1)) in floating point.
        &["-0.19999999999999996 1"],
    );
}

/// ∂/∂t (x·t) = x, whatever the name of the variable outside.
#[test]
fn inner_functions_see_the_outer_point() {
    prints("field g(x) = grad(t -> x*t)(2)\nprint(g(3))", &["[3]"]);
    prints(
        "field outer(x, y) = { field inner(t) = x + t; inner(y) }\nprint(outer(1, 10))",
        &["11"],
    );
    prints(
        "field ball(p in R3) = norm(p) - 1\nfield h(x, y, z) = (ball + x)(0, 0, 2)\nprint(h(5, 0, 0))",
        &["6"],
    );
    prints(
        "fn q(t) = grad(u -> u*u*t)(t)\nfield f(x) = q(x)\nprint(f(3), grad(f)(3))",
        &["[18] [[12]]"],
    );
}

#[test]
fn derivatives_nest_and_follow_the_active_branch() {
    prints(
        "field t(x, y) = if x > 0 then x^2 + y else y - x\nprint(grad(t)(2, 1), grad(t)(-2, 1), hessian(t)(2, 1))",
        &["[4, 1] [-1, 1] [[2, 0], [0, 0]]"],
    );
    prints(
        "field c(x) = x^5\nprint(grad(grad(grad(c)))(2), laplacian(c)(2))",
        &["[[[240]]] 160"],
    );
    prints(
        "field n(p in R3) = norm(p)\nprint(grad(n)(0, 0, 0))",
        &["[0, 0, 0]"],
    );
}

/// d/dr (x + r)²·r = (x + r)² + 2r(x + r), which is 21 at x = 1, r = 2.
#[test]
fn parameters_stay_variables_through_with() {
    prints(
        "param r = 0.3\nfield f(x) = (x + r)^2 * r\nlet g = f with {r = 2}\n\
         print(diff(g, r)(1), diff(2*g, r)(1), diff(grad(g), r)(1), grad(diff(g, r))(1))",
        &["21 42 [10] [10]"],
    );
    // What is not part of the field keeps the value that it has.
    prints(
        "param r = 3\nfield f(x) = x + r\nprint(((f with {r = 10}) + r)(0), f(0))",
        &["13 3"],
    );
}

#[test]
fn intervals_enclose() {
    prints(
        "field s(p in R3) = norm(p) - 1\nlet i = s(3..4, 0, 0)\nprint(i.low <= 2, i.high >= 3, i.width < 1.0001)",
        &["true true true"],
    );
    prints("param r = 0.5\nprint((0..1)*r)", &["0..0.5"]);
}

#[test]
fn a_branch_that_is_not_taken_does_nothing() {
    prints(
        "param b = 0.5\nlet r = if b > 2 { print(\"big\"); 1 } else { print(\"small\"); 2 }\nprint(r)",
        &["small", "2"],
    );
    fails(
        "field f(x) = { var t = 0; let r = if x > 0 { t = 5; 1 } else { 2 }; r + t }",
        "E0207",
    );
}

#[test]
fn eval_and_check_see_the_program_that_runs() {
    let folder = tempfile::tempdir().unwrap();
    let program = "var n = 0\nfor i in range(3) { n = n + 1 }\nfield f(x) over 0..5 = x - n\n\
                   field s(p in R3) over -1.5..1.5 = norm(p) - 1\n\
                   let volume = polygonize(s, cell = 0.3).volume\n\
                   field g(p in R3) = norm(p) - volume\n\
                   print(volume)\n";
    std::fs::write(folder.path().join("s.imp"), program).unwrap();
    let imp = |words: &[&str]| imp_with(folder.path(), words, b"").well().stdout;
    let volume = imp(&["run", "s.imp"]);
    assert_eq!(imp(&["eval", "s.imp", "f(1)"]), "-2\n");
    assert_eq!(imp(&["eval", "s.imp", "0 - g(0, 0, 0)"]), volume);
    imp(&["check", "s.imp"]);
}

#[test]
fn an_unknown_loop_and_an_unknown_condition_pass_the_check() {
    let program = "field s(p in R3) over -1.5..1.5 = norm(p) - 1\n\
        fn refine(cell) { let m = polygonize(s, cell = cell); if m.genus == 0 then m else refine(cell/2) }\n\
        let m = refine(0.4)\nvar n = 0\nfor p in m.points { n = n + 1 }\nprint([5][n - len(m.points)])\n";
    let folder = tempfile::tempdir().unwrap();
    imp_with(folder.path(), &["check", "-"], program.as_bytes()).well();
    prints(program, &["5"]);
}

#[test]
fn nothing_grows_without_bounds() {
    fails("var x = []\nfor i in range(1000000) { x = [x] }", "E0603");
    fails("var x = [1]\nfor i in range(60) { x = [x, x] }", "E0603");
    fails(
        "var s = \"a\"\nfor i in range(100) { s = \"{s}{s}\" }",
        "E0603",
    );
    fails("let a = [range(1e6) for i in range(1000)]", "E0603");
    fails("fn f() { param z = 3; z }", "E0210");
    prints(
        "param b = 0.001\nvar t = 0\nwhile t < 10 { t = t + b }\nprint(t > 9.99 and t < 10.01)",
        &["true"],
    );
}

#[test]
fn several_misspelt_names_are_reported_together() {
    let run = script("let radius = 1\nprint(radus)\nprint(sqr(2))\nlet radius = 2\n");
    assert_eq!(run.code, 1);
    assert_eq!(run.stderr.matches("Error").count(), 3, "{}", run.stderr);
    assert!(
        run.stderr.contains("did you mean `radius`?"),
        "{}",
        run.stderr
    );
}
