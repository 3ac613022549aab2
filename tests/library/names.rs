//! The library's names in a file: visible everywhere, replaceable, and never to blame.

use imp::library::entries;

use super::common::{imp, script};

#[test]
fn names_are_visible_without_an_import() {
    let run =
        script("print(sphere(2)(0, 0, 3), algebraic.torus(1.5, 0, 0), ease.in_quad(0.5))").well();
    assert_eq!(run.stdout, "1 0 0.25\n");
}

#[test]
fn a_file_may_use_the_names_itself() {
    let text = "fn sphere(r) = 7*r\nlet box = 5\nfield gyroid(x, y, z) = x\n\
                print(sphere(2), box, gyroid(1, 2, 3), capsule()(0, 0, 0))\n\
                print(cone(1, 2)(0, 0, -1), {let X = 3; X}, X(1, 2, 3))";
    let run = script(text).well();
    assert_eq!(run.stdout, "14 5 1 -0.5\n0 3 1\n");
}

/// The library goes on using its own definitions.
#[test]
fn a_file_that_redefines_a_name_does_not_change_the_library() {
    let run =
        script("fn polygon(points) = 1\nfn revolve(f) = 2\nprint(cone(1, 2)(0, 0, -3))").well();
    assert_eq!(run.stdout, "2\n");
}

#[test]
fn shapes_read_in_the_order_in_which_things_happen() {
    let text = "let f = sphere(1).translate([1, 0, 0]) | box(1)\n\
                print(f(1, 0, 0), f(0, 0, 0))\n\
                field g(p in R3) = sphere(1)(p)\n\
                print(grad(g)(0, 0, 2), polygonize(sphere(1), bounds = -2..2, resolution = 20).genus)\n\
                print((box(1) |> twist(45deg))(0, 0, 0), box(2).round(0.25)(0, 0, 0))";
    let run = script(text).well();
    assert_eq!(run.stdout, "-1 -0.5\n[0, 0, 1] 0\n-0.5 -1.25\n");
}

#[test]
fn functions_are_shapes_too() {
    let text = "let f = p -> norm(p) - 1\n\
                print(f.translate([1, 0, 0])(1, 0, 0), f.scale(2)(3, 0, 0), f.extrude(4)(3, 0, 0))\n\
                print(((x, y) -> x).rotate(90deg)(0, 5), ((x, y) -> x - 1).revolve()(0, 3, 0))\n\
                print(union(f, box(1))(2, 0, 0), f.repeat(3, 3)(3, 3, 3))";
    let run = script(text).well();
    assert_eq!(run.stdout, "-1 1 2\n5 2\n1 -1\n");
}

/// A shape may be made of parameters, in a field and outside: they stay variables.
#[test]
fn parameters_stay_variables_in_shapes() {
    let text = "param r = 1 in 0.1..3\n\
                let ball = sphere(r)\n\
                field grown(p in R3) = union(ball, box(r), k = r/4)(p)\n\
                print(ball(0, 0, 0), (ball with {r = 2})(0, 0, 0), diff(ball, r)(3, 0, 0))\n\
                print((grown with {r = 2})(3, 0, 0) < grown(3, 0, 0))";
    let run = script(text).well();
    assert_eq!(run.stdout, "-1 -2 -1\ntrue\n");
}

/// What is wrong inside the library is reported at the call in the file, with its own line.
#[test]
fn errors_are_reported_at_the_call() {
    let wrong = [
        (
            "let a = 1\nprint(sphere(-2))",
            "E0501",
            "must not be negative",
            2,
            7,
        ),
        (
            "field f(p in R3) = sphere(1)(p)\n\n  torus(1, 2)",
            "E0501",
            "0 <= r <= R",
            3,
            3,
        ),
        (
            "field f(p in R3) = box(-1)(p)",
            "E0501",
            "must not be negative",
            1,
            20,
        ),
        ("let x = sphere(\"one\")", "", "a number", 1, 9),
        (
            "let x = sphere(1).translate([1, 0])",
            "E0302",
            "lists of different lengths",
            1,
            9,
        ),
        ("let x = circle(1) | sphere(1)", "", "R2", 1, 9),
        ("let x = extrude(sphere(1), 2)", "", "R3", 1, 9),
        (
            "let x = sphere(radius = 2)",
            "",
            "its arguments are r, center",
            1,
            25,
        ),
        ("let x = sphere(1, [0, 0, 0], 2)", "", "one more", 1, 30),
        ("let x = algebraic.hart", "", "did you mean `heart`?", 1, 19),
        ("let x = spere(1)", "E0201", "did you mean `sphere`?", 1, 9),
        (
            "let x = sphere(1).rotat(1)",
            "",
            "did you mean `rotate`?",
            1,
            19,
        ),
    ];
    for (text, code, message, line, column) in wrong {
        let run = script(text);
        let place = format!("<stdin>:{line}:{column} ");
        assert_ne!(run.code, 0, "{text}");
        assert!(run.stderr.contains(code), "{text}\n{}", run.stderr);
        assert!(run.stderr.contains(message), "{text}\n{}", run.stderr);
        assert!(
            run.stderr.contains(&place),
            "{text}: {place}\n{}",
            run.stderr
        );
    }
}

#[test]
fn help_prints_the_doc_comment() {
    let run = script("help(torus)").well();
    assert!(
        run.stdout
            .starts_with("torus(R = 1, r = 0.25)\nA torus around the z axis")
    );
    assert!(run.stdout.contains("Kind: exact"));
    let run = script("help(ease)").well();
    assert!(run.stdout.contains("in_quad") && run.stdout.contains("Easings"));
}

#[test]
fn commands_take_shapes() {
    let mesh = ["mesh", "examples/csg.imp", "sphere(1) & box(1.5)"];
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("part.stl");
    let more = [
        "--bounds=-1.1..1.1",
        "--cell",
        "0.05",
        "--json",
        "-o",
        file.to_str().unwrap(),
    ];
    let run = imp(&[&mesh[..], &more[..]].concat()).well();
    assert_eq!(run.json()["genus"], 0);
}

/// Every name that the library's texts use exists, also where no example goes: each section is a
/// correct file by itself.
#[test]
fn the_library_is_written_correctly() {
    let folder = tempfile::tempdir().unwrap();
    let mut sections: Vec<(&str, String)> = Vec::new();
    for entry in entries() {
        match sections.last_mut() {
            Some((section, text)) if *section == entry.section => {
                text.push_str("\n\n");
                text.push_str(entry.text);
            }
            _ => sections.push((entry.section, entry.text.to_string())),
        }
    }
    assert!(sections.len() >= 8);
    for (section, text) in sections {
        let file = folder.path().join("section.imp");
        std::fs::write(&file, text).unwrap();
        let run = imp(&["check", file.to_str().unwrap()]);
        assert_eq!(run.code, 0, "{section}\n{}", run.stderr);
    }
}
