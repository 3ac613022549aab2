//! Fields and functions as values: arithmetic, constructive geometry, calls, solids, curves.

use crate::common::script;

#[track_caller]
fn prints(program: &str, expected: &str) {
    let run = script(program).well();
    assert_eq!(run.stdout.trim_end(), expected, "{program}");
}

#[track_caller]
fn fails(program: &str, code: &str, words: &str) {
    let run = script(program);
    assert_eq!(run.code, 1, "{program}\n{}", run.stderr);
    for part in [code, words] {
        assert!(run.stderr.contains(part), "{program}\n{}", run.stderr);
    }
}

const SHAPES: &str = "field ball(p in R3) over -2..2 = norm(p) - 1\n\
    fn round(p) = norm(p) - 1\nfn slope(p) = p.x\nfn volume(x, y, z, offset = 1) = x*y*z - offset\n";

#[track_caller]
fn gives(expression: &str, expected: &str) {
    prints(&format!("{SHAPES}print({expression})"), expected);
}

#[test]
fn fields_are_called_on_points_coordinates_and_intervals() {
    gives("ball(3, 0, 0), ball([0, 0, 2])", "2 1");
    // |p| on [0, 1] x {0} x {0} is [0, 1].
    gives("ball(0..1, 0, 0)", "-1..0");
    gives("ball([0..1, 0, 0])", "-1..0");
    // 0.5 |p| - 1 in a ball of twice the size.
    prints(
        &format!("{SHAPES}field big(p in R3) = ball(p/2)\nprint(big(2, 0, 0), big(4, 0, 0))"),
        "0 1",
    );
}

#[test]
fn arithmetic_on_fields_is_pointwise() {
    gives(
        "(ball + 0.5)(2, 0, 0), (2*ball)(3, 0, 0), (-ball)(3, 0, 0)",
        "1.5 4 -2",
    );
    gives(
        "(ball ^ 2)(4, 0, 0), abs(ball)(0, 0, 0), (ball - ball)(5, 5, 5)",
        "9 1 0",
    );
    gives(
        "(ball | ball - 1)(0, 0, 3), (ball & ball - 1)(0, 0, 3)",
        "1 2",
    );
    gives(
        "(ball \\ ball + 0.5)(0, 0, 0.75), (!ball)(0, 0, 0)",
        "-0.25 1",
    );
}

#[test]
fn arithmetic_on_functions_makes_functions() {
    gives(
        "(round | slope)([-3, 0, 0]), (round & slope)([3, 0, 0])",
        "-3 3",
    );
    gives(
        "(round \\ slope)([0.5, 0, 0]), (!round)([0, 0, 0]), (-slope)([2])",
        "-0.5 1 -2",
    );
    gives(
        "(round*2 + 1)([3, 0, 0]), sin(slope)([0, 1]), (slope ^ 2)([3])",
        "5 0 9",
    );
    gives(
        "norm(grad(round))([1, 2, 2]), max(round, slope)([0.5, 0, 0])",
        "1 0.5",
    );
    gives(
        "grad(round).x([3, 0, 4]), grad(round)[2]([3, 0, 4])",
        "0.6000000000000001 0.8",
    );
    gives(
        "(volume*2)(1, 2, 3), (volume | volume + 1)(1, 1, 1)",
        "10 0",
    );
    gives(
        "(slope < 1)([0]), (0 < slope < 2)([3]), (slope > 0 and round < 0)([0.5])",
        "true false true",
    );
    gives("(sin + cos)(0), (sqrt/2)(16)", "1 2");
    gives("sum([round, slope])([1, 0, 0])", "1");
}

#[test]
fn a_function_among_fields_becomes_a_field() {
    gives("ball | slope", "a field in R3");
    gives(
        "(ball | slope)(-3, 0, 0), (volume - ball)(1, 0, 0), (ball < slope)(2, 0, 0)",
        "-3 -1 -1",
    );
    // Taubin's distance of a function is polygonized like a field: here of a ball, 4.19.
    let program = format!(
        "{SHAPES}let m = polygonize(round/norm(grad(round)), bounds = [-2..2, -2..2, -2..2], cell = 0.25)\n\
         assert(m.watertight and abs(m.volume - 4*pi/3) < 0.15)\nprint(m.genus)"
    );
    prints(&program, "0");
}

#[test]
fn relations_are_solids() {
    let solids = "field slab(x, y, z) = abs(z) <= 0.5 and x^2 + y^2 <= 1\n\
        field corner(x, y, z) = not (x > 0 or y > 0)\nfield layer(x, y, z) = 0 < x < 1\n\
        field either(p in R3) = (norm(p) < 1) | (p.x > 2)\nfield hole(p in R3) = !(norm(p) < 1)\n\
        field cut(p in R3) = (norm(p) < 1) \\ (p.x > 0)\n\
        field heart(x, y, z) = (x^2 + 9/4*y^2 + z^2 - 1)^3 == x^2*z^3 + 9/80*y^2*z^3\n";
    for (expression, expected) in [
        ("slab(0, 0, 0), slab(0, 0, 2), slab(3, 0, 0)", "-0.5 1.5 8"),
        ("corner(-1, -2, 0), corner(-1, 2, 0)", "-1 2"),
        (
            "layer(0.25, 0, 0), layer(-1, 0, 0), layer(3, 0, 0)",
            "-0.25 1 2",
        ),
        (
            "either(3, 0, 0), either(0, 0, 0), hole(0, 0, 0), cut(0.5, 0, 0)",
            "-1 -1 1 0.5",
        ),
        ("heart(0, 0, 0), heart(1, 0, 0)", "-1 0"),
    ] {
        prints(&format!("{solids}print({expression})"), expected);
    }
    fails("field f(x) = x != 0", "E0403", "`!=`");
    fails("field f(x) = 1 < 2", "E0403", "true at every point");
}

#[test]
fn two_functions_in_space_are_a_curve() {
    let knot = "field knot(p in R3) = [norm2(p.xy) - 1, p.z]\n";
    for (expression, expected) in [
        ("knot", "the field knot in R3, 2 components"),
        ("knot(2, 0, 5), knot(0..1, 0, 2)", "[3, 5] [-1..0, 2..2]"),
        (
            "jacobian(knot)(1, 2, 3), grad(knot)(1, 2, 3)",
            "[[2, 4, 0], [0, 0, 1]] [[2, 4, 0], [0, 0, 1]]",
        ),
        ("cross(grad(knot)[0], grad(knot)[1])(1, 2, 3)", "[4, -2, 0]"),
        (
            "knot[0](2, 0, 0), knot.y(0, 0, 7), norm(knot)(2, 0, 4)",
            "3 7 5",
        ),
        (
            "(knot*2)(2, 0, 5), (knot - [3, 5])(2, 0, 5)",
            "[6, 10] [0, 0]",
        ),
        (
            "len(sample(knot, bounds = -2..2, count = 7)), sample(knot, bounds = -2..2).method",
            "7 trace",
        ),
        (
            "polygonize(knot, bounds = -2..2).closed, polygonize(knot, bounds = -2..2).components",
            "true 1",
        ),
    ] {
        prints(&format!("{knot}print({expression})"), expected);
    }
    for (call, message) in [
        (
            "polygonize(knot, bounds = -2..2, method = \"dual\")",
            "curves in space",
        ),
        (
            "sample(knot, bounds = -2..2, method = \"floaters\")",
            "curve in space",
        ),
    ] {
        fails(&format!("{knot}let x = {call}"), "E0309", message);
    }
}

#[test]
fn methods_and_pipelines_read_in_order() {
    let program = format!(
        "{SHAPES}fn raised(f, by_much) = f - by_much\n\
         let m = ball\n    .raised(0.25)\n    |> polygonize(cell = 0.25)\n\
         print(m.genus, ball.raised(1)(1, 0, 0), [3, 1, 2] |> sort |> len, 16 |> sqrt)\n\
         ball |> polygonize(cell = 0.5) |> export(\"a.stl\")\n"
    );
    prints(&program, "0 -1 3 4");
}

#[test]
fn blocks_and_conditions_are_expressions() {
    prints(
        "print(1 + { let t = 3; t + 1 }*2, [{ 1 }, 2], sqrt({ let q = 16; q }))",
        "9 [1, 2] 4",
    );
    prints(
        "print(if 1 < 2 then 3 else 4, if 1 > 2 { 3 } else if 1 > 3 { 4 } else { 5 })",
        "3 5",
    );
    prints(
        "field f(x) = if x < 0 then { let t = x^2; t + 1 } else 2*x\nprint(f(-2), f(2), grad(f)(-2))",
        "5 4 [-4]",
    );
    prints(
        "fn f(x, k = x + 1, m = 2*k) = [x, k, m]\nprint(f(1), f(1, m = 0), f(k = 5, x = 2))",
        "[1, 2, 4] [1, 2, 0] [2, 5, 10]",
    );
    prints(
        "print(sum(i^2 for i in range(9) if i % 2 == 0), product(i for i in range(1, 5)))",
        "120 24",
    );
    prints(
        "print(min(abs(x - 2) for x in [1, 5]), max(x*y for x in [1, 2] for y in [3, 4]))",
        "1 8",
    );
}

#[test]
fn time_goes_on() {
    prints(
        "let start = time()\nlet s = sum(sin(i) for i in range(1000))\nlet end = time()\n\
         print(start >= 0 and end > start)",
        "true",
    );
}
