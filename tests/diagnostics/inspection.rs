//! What `check`, `singularities` and `imp check` find, against what is known in closed form.

use tempfile::tempdir;

use crate::common::{Run, imp_with, script};

fn check(text: &str) -> Run {
    let folder = tempdir().unwrap();
    let words = ["check", "-", "--message-format", "short"];
    imp_with(folder.path(), &words, text.as_bytes()).well()
}

/// The codes that `imp check` gives for a file, in order.
fn codes(text: &str) -> Vec<String> {
    let lines = check(text).stderr;
    let codes = lines.lines().filter_map(|line| {
        let (_, rest) = line.split_once("warning[")?;
        Some(rest.split_once(']')?.0.to_string())
    });
    codes.collect()
}

#[track_caller]
fn holds(program: &str) {
    let run = script(program);
    assert_eq!(run.code, 0, "{program}\n{}", run.stderr);
}

#[test]
fn nodes_of_algebraic_surfaces() {
    // Cayley's cubic in this form has its nodes at (±√2, 0, 1) and (0, ±√2, -1).
    holds(
        "field cayley(x, y, z) over -2..2 = x^2 + y^2 - x^2*z + y^2*z + z^2 - 1
         let found = singularities(cayley)
         assert(len(found) == 4)
         let known = [[sqrt(2), 0, 1], [-sqrt(2), 0, 1], [0, sqrt(2), -1], [0, -sqrt(2), -1]]
         for k in known { assert(min(norm(p - k) for p in found) < 1e-12) }",
    );
    // Barth's sextic has 65 nodes, 15 of them at infinity; all others within √3 of the origin.
    holds(
        "let k = 1 + 2*phi
         field barth(x, y, z) over -2..2 = {
             let s = x^2 + y^2 + z^2
             let t = 4*(phi^2*x^2 - y^2)*(phi^2*y^2 - z^2)*(phi^2*z^2 - x^2) - k*(s - 1)^2
             max(t, s - 3.5)
         }
         assert(len(singularities(barth)) == 50)",
    );
    // On Kummer's surface with mu^2 = 2 there are 16.
    holds(
        "let mu2 = 2
         let lambda = (3*mu2 - 1) / (3 - mu2)
         let r2 = sqrt(2)
         field kummer(x, y, z) over -6..6 = {
             let a = 1 - z - r2*x
             let b = 1 - z + r2*x
             let c = 1 + z + r2*y
             let d = 1 + z - r2*y
             (x^2 + y^2 + z^2 - mu2)^2 - lambda*a*b*c*d
         }
         assert(len(singularities(kummer)) == 16)",
    );
}

#[test]
fn degenerate_points_and_points_of_the_plane_and_the_line() {
    holds(
        "field cusp(x, y) over -2..2 = y^2 - x^3
         assert(norm(singularities(cusp)[0]) < 1e-6 and len(singularities(cusp)) == 1)
         field twice(x) over -2..2 = (x - 0.3)^2 * (x + 1)
         assert(abs(singularities(twice)[0][0] - 0.3) < 1e-9)
         field lemniscate(x, y) over -2..2 = (x^2 + y^2)^2 - x^2 + y^2
         assert(len(singularities(lemniscate)) == 1)",
    );
}

#[test]
fn curves_of_singular_points_are_sets() {
    // Taubin's heart: the ellipse z = 0, x^2 + 9/4 y^2 = 1, and (0, 0, ±1).
    let heart = "field heart(x, y, z) over -1.5..1.5 = \
                 (x^2 + 9/4*y^2 + z^2 - 1)^3 - x^2*z^3 - 9/80*y^2*z^3\n";
    let message = check(heart).stderr;
    assert!(
        message.contains("at 2 points, [0, 0, -1], [0, 0, 1] and along a set"),
        "{message}"
    );
    holds(&format!(
        "{heart}
         let all = singularities(heart)
         let ring = [p for p in all if abs(p.z) < 0.5]
         assert(len(ring) > 50)
         assert(max(abs(p.z) + abs(p.x^2 + 9/4*p.y^2 - 1) for p in ring) < 1e-4)"
    ));
    // Two spheres cross in the circle x = 0, y^2 + z^2 = 3/4.
    holds(
        "field crossed(x, y, z) over -2..2 =
             (norm2([x - 0.5, y, z]) - 1) * (norm2([x + 0.5, y, z]) - 1)
         let ring = singularities(crossed)
         assert(len(ring) > 50)
         assert(max(abs(p.x) + abs(p.y^2 + p.z^2 - 0.75) for p in ring) < 1e-12)",
    );
}

#[test]
fn regular_fields_are_clean() {
    holds(
        "field ball(p in R3) over -2..2 = norm(p) - 1
         field cube(p in R3) over -2..2 = max(abs(p)) - 1
         field torus(x, y, z) over -2..2 = (sqrt(x^2 + y^2) - 1)^2 + z^2 - 0.1
         field nearly(x, y, z) over -1..1 = x^2 + y^2 - z^2 - 1e-6
         field gyroid(x, y, z) over -pi..pi = sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x)
         for f in [ball, cube, torus, nearly, gyroid] {
             assert(check(f))
             assert(singularities(f) == [])
         }",
    );
}

#[test]
fn constant_undefined_and_inside_out_fields_are_warned_of() {
    let fields = "field a(x, y) over -2..2 = max(x^2 - 9, 1)\n\
                  field b(x, y) over -2..2 = log(-1 - x^2)\n\
                  field c(p in R3) over -2..2 = 1 - norm(p)\n\
                  field d(p in R3) over -2..2 = norm(p) - 1\n\
                  field e(p in R3) over -2..2 = p.x\n";
    assert_eq!(codes(fields), ["W0810", "W0811", "W0809"]);
    let places = check(fields).stderr;
    assert!(places.contains("<stdin>:3:7: warning[W0809]"), "{places}");
    holds("field c(p in R3) over -2..2 = 1 - norm(p)\nassert(not check(c) and check(!c))");
}

#[test]
fn parameters_that_nothing_uses_are_warned_of() {
    let text = "param used = 1\nparam idle = 2\nparam shown = 3\n\
                field f(x) over -2..2 = x - used\nprint(shown)\n";
    let run = check(text);
    assert_eq!(
        run.stderr,
        "<stdin>:2:7: warning[W0807]: nothing uses the parameter `idle`\n<stdin>: no errors\n"
    );
    // A command that asks one thing of the file says nothing about the rest.
    let folder = tempdir().unwrap();
    let info = imp_with(folder.path(), &["info", "-"], text.as_bytes()).well();
    assert_eq!(info.stderr, "");
}

#[test]
fn degrees_are_suspected_where_an_angle_is_a_plain_number() {
    for text in [
        "print(sin(90))",
        "print(cos(-45))",
        "print(tan(10))",
        "print(180.sin())",
    ] {
        let found = codes(text);
        let is_method = text.contains(".sin()");
        assert_eq!(
            found,
            if is_method { vec![] } else { vec!["W0808"] },
            "{text}"
        );
    }
    for text in [
        "print(sin(90deg))",
        "print(sin(3))",
        "print(sin(11))",
        "print(exp(90))",
    ] {
        assert_eq!(codes(text), [""; 0], "{text}");
    }
    // The file's own function may take degrees.
    assert_eq!(codes("fn sin(degrees) = degrees\nprint(sin(90))"), [""; 0]);
}

#[test]
fn a_box_is_needed_and_can_be_given() {
    let cone = "field cone(x, y, z) = x^2 + y^2 - z^2\n";
    assert!(
        script(&format!("{cone}check(cone)"))
            .stderr
            .contains("E0402")
    );
    holds(&format!(
        "{cone}assert(len(singularities(cone, bounds = -1..1)) == 1)"
    ));
    // The tip lies outside of this one.
    holds(&format!(
        "{cone}assert(check(cone, bounds = [-1..1, -1..1, 0.5..1]))"
    ));
}
